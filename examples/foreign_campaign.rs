//! Flies a campaign (the paper's ladder, and a hover or a scan) in a foreign world with air of a known kind, and writes
//! the true air beside it: what maps are held against.
//!
//! ```text
//! cargo run --release --example foreign_campaign -- gusty 7 FOLDER
//! updraft analyze FOLDER
//! ```
//!
//! The kind is `still`, `field`, `gusty`, `anisotropic`, `advected`, `turbulent`, `wind-change`, `thermal` or `drifting-thermal`; after
//! `scan-` the fleet flies `scan-campaign`. `truth.csv` has the mean of the true vertical air speed over the 10 s around each second,
//! along the planned way; `truth-thermal.json` the thermal. A fourth argument is the side of the grid (5), a fifth the
//! distance of its drones (10 m). Arguments with an equals sign, wherever behind the folder, set values of the campaign's
//! templates: `'calibration.legs.speeds_mps=[3, 6]'`, `'hover.legs.speeds_mps=[3, 6]'`. With `telemetry=true` the logs
//! have rotor speeds, and currents with errors.

#![expect(clippy::print_stderr, reason = "it says what went wrong")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use foreign_worlds::telemetry::TelemetrySettings;
use updraft::blind::worlds::maps;
use updraft::campaign;
use updraft::mission::resolve::Override;
use updraft::workflow::host::Quiet;
use updraft::workflow::{mission, plan};

/// The argument that asks for rotor speeds.
const TELEMETRY: &str = "telemetry=true";

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(kind), Some(seed), Some(folder)) = (words.next(), words.next(), words.next()) else {
        eprintln!(
            "usage: foreign_campaign [scan-]KIND SEED FOLDER [SIDE] [SPACING] [KEY=VALUE...]"
        );
        return Ok(());
    };
    let (mut more, numbers): (Vec<String>, Vec<String>) =
        words.partition(|word| word.contains('='));
    let has_telemetry = more.iter().any(|word| word == TELEMETRY);
    more.retain(|word| word != TELEMETRY);
    let mut numbers = numbers.into_iter();
    let side = numbers.next().map_or(Ok(5), |word| word.parse::<u32>())?;
    let spacing_m = numbers.next().map_or(Ok(10.0), |word| word.parse::<f64>())?;
    let (seed, root) = (seed.parse::<u64>()?, PathBuf::from(folder));
    let (template, kind) = kind
        .strip_prefix("scan-")
        .map_or(("campaign", kind.as_str()), |kind| ("scan-campaign", kind));
    let mut overrides = vec![
        Override::new("grid.rows", i64::from(side)),
        Override::new("grid.columns", i64::from(side)),
        Override::new("grid.spacing_m", spacing_m),
        Override::new("vehicle", "pixel"),
    ];
    if template == "campaign" {
        overrides.push(Override::new("duration_s", 300.0));
    }
    for word in &more {
        overrides.push(Override::parse(word)?);
    }
    let planned = mission::resolve(template, &overrides)?;
    let host = Quiet::default();
    plan::write(&host, &planned, &plan::shows(&planned), &root, false)?;
    let flights = campaign::flights(&root)?;
    let truth = maps::fly(&flights, kind, seed, has_telemetry.then(telemetry), None)?;
    let mut table = "slot,time_s,w10_mps\n".to_owned();
    for (slot, series) in &truth.updraft {
        for (time_s, value) in (series.first_s..).zip(&series.updraft_mps) {
            let _ = writeln!(table, "{slot},{time_s},{value:.4}");
        }
    }
    std::fs::write(root.join("truth.csv"), table)?;
    std::fs::write(root.join("truth-air.json"), serde_json::to_string_pretty(&truth.air)?)?;
    if let Some(thermal) = truth.thermal {
        let thermal = serde_json::to_string_pretty(&thermal)?;
        std::fs::write(root.join("truth-thermal.json"), thermal)?;
    }
    Ok(())
}

/// Telemetry of controllers that send hundreds of electrical revolutions of motors with seven pairs of poles, and a
/// current sensor as power modules have them: calibrated to a hundredth. Chosen.
fn telemetry() -> TelemetrySettings {
    TelemetrySettings {
        speed_white_rpm: 15.0,
        speed_step_rpm: 100.0 / 7.0,
        current_share: 0.01,
        current_coloured_share: 0.005,
        current_coloured_s: 60.0,
        current_white_a: 0.1,
        current_step_a: 0.01,
    }
}
