//! Writes the results of many made-up blind flights, to measure how long it takes to put them together:
//!
//! ```sh
//! cargo run --release --example many_results -- 100000 many
//! time updraft blind --seed 20270101 --flights 100000 -o many --no-fly
//! ```

use std::path::PathBuf;

use updraft::blind::score::{Called, HiddenOutcome, Outcome};
use updraft::blind::series::{FlightResult, RESULT_SCHEMA, Settings};
use updraft::blind::{AirClass, Base, Protocol, Worlds};
use updraft::workflow::blind::one_each;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let usage = "give a number of flights and a folder";
    let mut args = std::env::args().skip(1);
    let flights: usize = args.next().ok_or(usage)?.parse()?;
    let folder = PathBuf::from(args.next().ok_or(usage)?).join("flights");
    let worlds = vec![Worlds::Home];
    let settings = Settings {
        hidden: one_each(&worlds),
        worlds,
        protocols: vec![Protocol::Paper, Protocol::Enhanced],
        airs: vec![AirClass::Calm, AirClass::Moderate, AirClass::Field],
        bases: vec![Base::Airsim, Base::Inflow, Base::Pixel],
        flights,
        seed: 20_270_101,
        side: 7,
        tuning: false,
    };
    std::fs::create_dir_all(&folder)?;
    for (index, draw) in settings.draws()?.into_iter().enumerate() {
        let hidden = draw.cell.hidden.iter().map(|kind| HiddenOutcome {
            kind: kind.clone(),
            effect: kind.clone(),
            foreign: false,
            single: true,
            z: Some(8.0),
            called: Called::Named,
            value: 0.2,
            fitted: Some(0.21),
            relative_error: Some(0.05),
            covered: Some(true),
            said_visible: Some(true),
        });
        let outcome = Outcome {
            seed: draw.seed,
            cell: (*draw.cell).clone(),
            hidden: hidden.collect(),
            found: draw.cell.hidden.clone(),
            wrong_names: Vec::new(),
            wrong_in_class: 0,
            wrong_classes: 0,
            wrong_unknowns: 0,
            raw_shrink: Some(0.8),
            mean_shrink: Some(0.9),
            excess_shrink: Some(0.95),
            made_worse: false,
        };
        let result = FlightResult {
            schema: RESULT_SCHEMA.to_owned(),
            made_by: concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned(),
            index,
            truth_sha256: "0".repeat(64),
            verdict_sha256: "0".repeat(64),
            truth: draw.cell.name(),
            outcome,
        };
        std::fs::write(
            folder.join(format!("{index:05}.json")),
            serde_json::to_vec_pretty(&result)?,
        )?;
    }
    Ok(())
}
