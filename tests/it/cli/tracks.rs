//! Profiles, columns and race-tracks: the air along the way is what was there, at all heights.

use std::fs;

use serde_json::Value;

use crate::cli::support::Bench;

/// Turbulence that grows with height: a third at 20 m of what it is at 110 m.
const AIR: [&str; 4] = ["--air", "lenschow:w_star=1.5,lambda=60,tau=200,wind=0", "--wind", "1.5"];

/// A calibration in still air and a measurement by two drones, flown and analysed: its part of the analysis.
fn measured(template: &str, short: &[&str]) -> (Bench, Value) {
    let bench = Bench::new();
    fs::write(
        bench.path("both.toml"),
        format!(
            "schema = \"updraft.template/1\"\nname = \"both\"\ntitle = \"Both\"\n[[flights]]\ntemplate = \
             \"calibration.toml\"\nset = {{ speeds_mps = [1.0, 2.0] }}\n[[flights]]\ntemplate = \"{template}.toml\"\n"
        ),
    )
    .unwrap();
    let plan = ["plan", "both.toml", "--grid", "1x2", "-o", "campaign"];
    bench.expect(0, &[&plan[..], short].concat());
    let fly = ["simulate", "campaign", "--quiet", "--seed", "3", "--flight"];
    bench.expect(0, &[&fly[..], &["calibration"]].concat());
    bench.expect(0, &[&fly[..], &[template, "--truth"], &AIR].concat());
    let args = ["analyze", "campaign", "--json", "--quiet"];
    let value = bench.expect(0, &args).json("updraft.analyze/1");
    let flight = value["analysis"]["flights"][1].clone();
    (bench, flight)
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap()
}

/// Heights above home of the values of the first drone, m.
fn heights_m(bench: &Bench) -> Vec<f64> {
    let table = fs::read_to_string(bench.path("campaign/fields/updraft.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let cell = |row: &csv::StringRecord, index: usize| row.get(index).unwrap().parse::<f64>();
    rows.records()
        .map(Result::unwrap)
        .filter(|row| row.get(2) == Some("1") && cell(row, 7).is_ok())
        .map(|row| cell(&row, 6).unwrap())
        .collect()
}

#[test]
fn every_track_measures_the_air_that_was_there() {
    for (template, short, lowest_m, highest_m) in [
        ("profile", &["--set", "profile.passes=1"][..], 20.0, 110.0),
        (
            "column",
            &["--set", "column.heights_m=[20.0,60.0,20.0]", "--set", "column.hover_s=50"],
            20.0,
            60.0,
        ),
        ("race-track", &["--set", "race-track.laps=1"], 60.0, 60.0),
    ] {
        let (bench, found) = measured(template, short);
        let truth = |key: &str| number(&found, &format!("/map/truth/{key}"));
        let (rms, zero) = (truth("rms_mps"), truth("zero_rms_mps"));
        println!(
            "{template}: {} values, rms {rms:.3} of {zero:.3}, inside {:.2}",
            truth("values"),
            truth("inside_share")
        );
        assert!(truth("values") > 90.0, "{template}: {}", found["map"]["truth"]);
        assert!(rms < 0.12 && rms < 0.4 * zero, "{template}: {}", found["map"]["truth"]);
        assert!(truth("inside_share") > 0.9, "{template}: {}", found["map"]["truth"]);
        let heights = heights_m(&bench);
        let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
        let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        // A profile's first and last seconds at constant speed are 10 m from its ends.
        assert!((low - lowest_m).abs() < 3.0, "{template}: from {low} m");
        assert!((high - highest_m).abs() < 3.0, "{template}: to {high} m");
        let between = heights.iter().filter(|m| **m > 30.0 && **m < 50.0).count();
        assert_eq!(between > 10, template == "profile", "{template}: {between} values on the way");
    }
}
