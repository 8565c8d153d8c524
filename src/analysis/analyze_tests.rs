//! Which calibration measures flights that nobody has planned.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

use super::result::FlightAnalysis;
use super::{AnalysisOptions, FlightInput, LogInput, analyze, analyze_flight};
use crate::flight::table::Mapping;
use crate::mission::plan::Purpose;

const MAPPING: &str = r#"
schema = "updraft.csv/1"
indicator = "pulse"
time = { column = "time" }
effort = { columns = ["pulse"] }
velocity_up = { columns = ["up"] }
height = { columns = ["height"] }
roll = { columns = ["level"] }
pitch = { columns = ["level"] }
command_up = { columns = ["up"] }
flights = [{ name = "day", purpose = "measurement", files = ["log.csv"] }]
"#;
/// Legs of 20 s, each after a hover of 10 s.
const LADDER: [f64; 8] = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 0.5, -0.5];
const HOVER: [f64; 4] = [0.0; 4];

/// The table of a drone in still air whose pulse in hover is this one.
fn log(folder: &Path, name: &str, legs: &[f64], hover_us: f64) -> [LogInput; 1] {
    let mut table = "time,pulse,up,height,level\n".to_owned();
    let mut height_m = 50.0;
    for tick in 0..300 * legs.len() {
        let up_mps = if tick % 300 < 100 { 0.0 } else { legs[tick / 300] };
        height_m += 0.1 * up_mps;
        let ripple_us = [0.0, 1.0, -1.0][tick % 3];
        let (time_s, pulse_us) = (tick as f64 / 10.0, hover_us + 25.0 * up_mps + ripple_us);
        writeln!(table, "{time_s},{pulse_us},{up_mps},{height_m},0").unwrap();
    }
    let path = folder.join(name);
    std::fs::write(&path, table).unwrap();
    let mapping = Mapping::parse(Path::new("mapping.toml"), MAPPING.as_bytes()).unwrap();
    [LogInput { path, table: Some(Arc::new(mapping)), ..LogInput::default() }]
}

fn input<'a>(name: &'a str, logs: &'a [LogInput]) -> FlightInput<'a> {
    FlightInput { name, logs, ..FlightInput::default() }
}

fn updraft_mps(flight: &FlightAnalysis) -> f64 {
    flight.map.as_ref().unwrap().drones[0].mean.value
}

#[test]
fn a_given_calibration_measures_and_without_one_that_of_the_same_day() {
    let folder = tempfile::tempdir().unwrap();
    let options = AnalysisOptions::default();
    // The hover's pulse is that of still air by the given calibration, and 2 m/s above it by the own.
    let given = log(folder.path(), "given.csv", &LADDER, 1500.0);
    let given = analyze_flight(&input("given", &given), &options, None, &|_, _| {}).unwrap();
    let hover = log(folder.path(), "hover.csv", &HOVER, 1500.0);
    let ladder = log(folder.path(), "ladder.csv", &LADDER, 1550.0);
    for inputs in [
        [input("hover", &hover), input("ladder", &ladder)],
        [input("ladder", &ladder), input("hover", &hover)],
    ] {
        for (reference, expected_mps) in [(None, 2.0), (Some(&given), 0.0)] {
            let found = analyze("day", &inputs, &options, reference, &|_, _| {}).unwrap();
            let [ladder, hover] = &found.flights[..] else { panic!("{:?}", found.warnings) };
            assert_eq!(ladder.purpose, Purpose::Calibration);
            let mps = updraft_mps(hover);
            assert!((mps - expected_mps).abs() < 0.1, "{mps} instead of {expected_mps} m/s");
        }
    }
}
