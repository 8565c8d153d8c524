//! Rotor speed and power beside the pulse: what each says of the air, corrected by the vehicle's own trim, and all
//! together.

use std::fs;

use serde_json::Value;

use crate::cli::support::Bench;

const PIXEL: &str = include_str!("../../../templates/vehicles/pixel.toml");

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Four show drones whose motor controllers report their speed, in wind that moves up and down.
fn flown() -> Bench {
    let bench = Bench::new();
    let reporting = PIXEL.replace("[autopilot]\n", "[autopilot]\nesc_telemetry = true\n");
    assert_ne!(reporting, PIXEL);
    fs::write(bench.path("reporting.toml"), reporting).unwrap();
    let run =
        ["run", "--direct", "--no-study", "--quiet", "--vehicle", "reporting.toml", "-o", "c"];
    let air =
        ["--air", "field:sd=0.4,lambda=60,tau=40,wind=0", "--air", "uniform:up=0.3", "--wind", "3"];
    let small = ["--grid", "2x2", "--spacing", "10", "--duration", "90", "--height", "40"];
    let legs = ["--speeds", "1,2,3", "--leg", "14", "--hover", "8"];
    bench.expect(0, &[&run[..], &air, &small, &legs].concat());
    bench
}

fn map(bench: &Bench, indicator: &str) -> Value {
    let args = ["analyze", "c", "--no-report", "--json", "--indicator", indicator];
    let ended = bench.expect(0, &args);
    let whole: Value = serde_json::from_str(&ended.out).unwrap();
    let flights = whole["analysis"]["flights"].as_array().unwrap().clone();
    flights.into_iter().find(|flight| !flight["map"].is_null()).unwrap()["map"].clone()
}

#[test]
fn rotor_speed_and_power_measure_the_air_and_all_together_no_worse() {
    let bench = flown();
    let rpm = map(&bench, "rpm");
    assert_eq!(rpm["wind"], "physics", "corrected by the trim of the rotor speed");
    let rms = |map: &Value| number(&map["truth"]["rms_mps"]);
    assert!(
        rms(&rpm) < 0.25 && rms(&rpm) < number(&rpm["truth"]["zero_rms_mps"]),
        "{}",
        rpm["truth"]
    );
    let all = map(&bench, "all");
    let combined = &all["combined"];
    let told = format!("{}", combined["words"]);
    let indicators = combined["indicators"].as_array().unwrap();
    let names: Vec<&str> = indicators.iter().filter_map(|one| one["indicator"].as_str()).collect();
    assert_eq!(names, ["pulse", "rotor_speed", "power"], "{told}");
    let weights: f64 = indicators.iter().map(|one| number(&one["weight"])).sum();
    assert!((weights - 1.0).abs() < 1e-9, "{told}");
    let best = indicators.iter().map(|one| number(&one["own_mps"])).fold(f64::INFINITY, f64::min);
    assert!(number(&combined["own_mps"]) <= best + 1e-9, "{told}");
    assert!(indicators.iter().all(|one| number(&one["weight"]) >= 0.0), "{told}");
    // Nothing of the air itself is weighed away: together they are not far from the best of them.
    let errors = indicators.iter().map(|one| number(&one["rms_mps"]));
    let least = errors.fold(f64::INFINITY, f64::min);
    assert!(number(&combined["truth"]["rms_mps"]) < 1.2 * least + 0.01, "{told}");
    assert!(told.contains("several indicators, by errors of their own"), "{told}");
}

#[test]
fn an_indicator_that_logs_lack_is_told() {
    let bench = Bench::new();
    bench.fly();
    let told = bench.run(&["analyze", "campaign", "--no-report", "--indicator", "all"]);
    assert!(told.err.contains("the map is made without rotor speed"), "{told}");
}
