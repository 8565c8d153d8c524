//! `updraft gap` and `updraft analyze` with logs of ArduPilot's own simulator, flown by the firmware.

use std::fs;

use serde_json::Value;

use crate::analysis::support::fixture;
use crate::cli::support::Bench;

const STILL: &str = "ladder-still.trimmed.BIN";
const UPDRAFT: &str = "ladder-updraft.trimmed.BIN";
const HOVER: &str = "hover-still.trimmed.BIN";

/// The firmware's hover of the fixture.
const HOVER_TEMPLATE: &str = r#"
schema = "updraft.template/1"
name = "hover"
purpose = "measurement"
title = "Hover"
vehicle = "arducopter-sitl"
site = { origin = [-35.363261, 149.16523], ground_amsl_m = 584.0, orientation_deg = 30.0 }
grid = { rows = 1, columns = 1, spacing_m = 7.0 }
takeoff = { altitude_m = 5.0, speed_mps = 1.0 }
landing = { end_altitude_m = 2.5, speed_mps = 1.0 }
window = { settle_s = 10.0, trim_s = 1.0 }

[[steps]]
kind = "climb"
speed_mps = 3.0
to_m = 30.0

[[steps]]
kind = "hover"
duration_s = 60.0

[[steps]]
kind = "climb"
speed_mps = 2.0
to_m = 15.0
"#;

/// What the measured log has that the simulated one lacks.
fn between(measured: &str, simulated: &str) -> Value {
    let bench = Bench::new();
    let [measured, simulated] = [measured, simulated].map(fixture);
    let measured = ["gap", "--json", "--measured", measured.to_str().unwrap()];
    let simulated = ["--simulated", simulated.to_str().unwrap()];
    let ended = bench.expect(0, &[&measured[..], &simulated].concat());
    ended.json("updraft.gap/1")["verdict"].clone()
}

/// A flight's folder with a log of the firmware.
fn flown(bench: &Bench, name: &str, plan: &[&str], log: &str) {
    let place = ["--origin", "-35.363261,149.16523", "--ground", "584", "--quiet", "-o", name];
    bench.expect(0, &[&["plan"], plan, &place].concat());
    let logs = bench.path(&format!("{name}/logs"));
    fs::create_dir_all(&logs).unwrap();
    fs::copy(fixture(log), logs.join("01.BIN")).unwrap();
}

fn calibration(bench: &Bench, log: &str) {
    let ladder = ["calibration", "--grid", "1x1", "--vehicle", "arducopter-sitl"];
    let heights = ["--baseline", "20", "--ramp", "0", "--set", "takeoff.speed_mps=2"];
    flown(bench, "calibration", &[&ladder[..], &heights].concat(), log);
}

fn steps(verdict: &Value) -> Vec<Value> {
    verdict["steps"].as_array().unwrap().iter().map(|step| step["finding"].clone()).collect()
}

#[test]
fn an_updraft_all_over_is_nothing_that_the_simulated_logs_lack() {
    let verdict = between(UPDRAFT, STILL);
    assert_eq!(steps(&verdict), [Value::Null; 0], "{}", verdict["summary"]);
}

#[test]
fn a_ladder_of_the_firmware_lacks_nothing_that_its_own_vehicle_has() {
    let bench = Bench::new();
    calibration(&bench, STILL);
    let ended = bench.expect(0, &["gap", "calibration", "--json"]);
    let verdict = ended.json("updraft.gap/1")["verdict"].clone();
    assert_eq!(steps(&verdict), [Value::Null; 0], "{}", verdict["summary"]);
    let gap_us = verdict["gap"]["rungs"]["before_without_air_us"].as_f64().unwrap();
    assert!(gap_us < 0.2, "{gap_us}");
}

#[test]
fn a_hover_in_still_air_is_mapped_as_still() {
    let bench = Bench::new();
    calibration(&bench, STILL);
    fs::write(bench.path("hover.toml"), HOVER_TEMPLATE).unwrap();
    flown(&bench, "hover", &["hover.toml", "--orientation", "30"], HOVER);
    let ended = bench.expect(0, &["analyze", "calibration", "hover", "--json"]);
    let analysis = ended.json("updraft.analyze/1")["analysis"].clone();
    let mean = &analysis["flights"][1]["map"]["drones"][0]["mean"];
    let of = |key: &str| mean[key].as_f64().unwrap();
    // Its pack has no resistance, and what the autopilot takes for it moves: -0.5 m/s by BAT.VoltR.
    assert!(of("value").abs() < 0.05 && of("se") < 0.05, "{mean}");
}
