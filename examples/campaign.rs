//! Plans, simulates and analyses a small campaign, and prints the mean updraft that its map shows.
//!
//! ```text
//! cargo run --release --example campaign
//! ```

#![expect(clippy::print_stdout, clippy::print_stderr, reason = "it prints its result")]

use std::error::Error;

use updraft::campaign;
use updraft::mission::resolve::Override;
use updraft::sim::air::spec::Air;
use updraft::workflow::analyze::{Settings, analyze_campaign};
use updraft::workflow::host::Quiet;
use updraft::workflow::simulate::{Simulation, simulate};
use updraft::workflow::{mission, plan};

/// What the air really does, m/s, up positive.
const UPDRAFT_MPS: f64 = 0.7;

fn main() -> Result<(), Box<dyn Error>> {
    let host = Quiet::default();
    let root = std::env::temp_dir().join(format!("updraft-example-{}", std::process::id()));

    // Four drones: a calibration in still air, then a hover of a minute in the updraft.
    let overrides = [
        Override::new("grid.rows", 2),
        Override::new("grid.columns", 2),
        Override::new("duration_s", 60.0),
    ];
    let planned = mission::resolve("campaign", &overrides)?;
    plan::write(&host, &planned, &plan::shows(&planned), &root, false)?;
    for (folder, updraft_mps) in campaign::flights(&root)?.iter().zip([0.0, UPDRAFT_MPS]) {
        let air = Air::new([0.0, 0.0, updraft_mps], &[]);
        simulate(&host, folder, &folder.read_plan()?, &Simulation::new(air, 1))?;
    }
    let analysed = analyze_campaign(&host, &root, &Settings::default())?;

    let map = analysed.analysis.flights.iter().find_map(|flight| flight.map.as_ref());
    let drones = &map.ok_or("the campaign has no map")?.drones;
    let mean_mps = drones.iter().map(|drone| drone.mean.value).sum::<f64>() / drones.len() as f64;
    println!("mean updraft {mean_mps:.2} m/s; the air rose at {UPDRAFT_MPS} m/s");
    for warning in host.heard() {
        eprintln!("{warning}");
    }
    std::fs::remove_dir_all(&root)?;
    Ok(())
}
