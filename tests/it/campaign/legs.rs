//! Legs of known ground speed behind a hover: they calibrate the wind, and the map stays the hover's.

#![expect(clippy::unwrap_used, reason = "a test fails")]

use std::path::Path;

use updraft::analysis::result::{Analysis, FlightAnalysis};
use updraft::campaign::read_json;

use super::air::run;

fn hover(folder: &Path, name: &str, more: &str) -> FlightAnalysis {
    run(
        &format!(
            "run campaign --grid 1x2 --duration 40 --vehicle pixel --air uniform:up=0.4 \
             --calibration-air still --wind 7 --calibration-wind 1 --direct --no-study -o {name} {more}"
        ),
        folder,
    );
    let analysis: Analysis = read_json(&folder.join(name).join("analysis.json")).unwrap();
    analysis.flights.into_iter().find(|flight| flight.map.is_some()).unwrap()
}

#[test]
fn legs_behind_a_hover_calibrate_the_wind_and_are_no_part_of_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let plain = hover(folder.path(), "plain", "");
    let with = hover(folder.path(), "with", "--set hover.legs.speeds_mps=[3,6]");
    assert!(plain.wind_legs.is_none());
    assert_eq!(with.wind_legs.unwrap().legs.len(), 8);
    let (plain, with) = (plain.map.unwrap(), with.map.unwrap());
    assert!(!with.is_scan());
    assert_eq!(with.time_s, plain.time_s);
    for (plain, with) in plain.drones.iter().zip(&with.drones) {
        assert_eq!(with.position_m, plain.position_m);
        // They tell drag and lift where the wind is that of the map.
        assert!(with.errors.wind_mps < 0.7 * plain.errors.wind_mps, "{:?}", with.errors);
        assert!((with.mean.value - 0.4).abs() < 1.96 * with.mean.se, "{}", with.mean);
    }
}
