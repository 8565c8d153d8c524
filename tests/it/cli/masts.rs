//! `updraft analyze --csv --zero --vehicle`: a camera drone beside a mast with sonic anemometers, and what is said to
//! those who ask for a zero that there is not.

use std::fmt::Write as _;
use std::fs;

use insta::assert_snapshot;
use serde_json::Value;

use crate::cli::support::Bench;

const MAPPING: &str = include_str!("../../../templates/csv/phantom4-mast.toml");
const LEGS: &str = include_str!("../../data/phantom4/phantom4-vertical-3ms.csv");
const HOVER: &str = include_str!("../../data/phantom4/phantom4-hover-first300s.csv");
const ZERO: [&str; 4] = ["--zero", "0..150s", "--vehicle", "phantom4"];

fn bench(mapping: &str) -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("phantom4-vertical-3ms.csv"), LEGS).unwrap();
    fs::write(bench.path("phantom4-hover-first300s.csv"), HOVER).unwrap();
    fs::write(bench.path("mast.toml"), mapping).unwrap();
    bench
}

fn hover(bench: &Bench, more: &[&str]) -> Value {
    let args = [&["analyze", "--csv", "mast.toml", "--no-report", "--json"], more].concat();
    let ended = bench.expect(0, &args);
    let whole: Value = serde_json::from_str(&ended.out).unwrap();
    whole["analysis"]["flights"][1].clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Real rotors, real air, and an instrument that nothing is taken from (Meier et al., Atmosphere 13:551, 2022).
#[test]
fn half_of_a_real_hover_sets_the_zero_of_the_other() {
    let flight = hover(&bench(MAPPING), &ZERO);
    let levelled = &flight["map"]["levelled"];
    let held = &levelled["held_out"];
    let told = format!("{levelled:#}");
    for (errors, zero_mps) in [("apart", 0.447), ("running", 0.476)] {
        let of = |answer: &str| number(&held[errors][format!("{answer}_mps")]);
        assert!((of("zero_rms") - zero_mps).abs() < 0.005, "{told}");
        assert!(of("rms") <= 0.39, "{errors}: {told}");
        assert!(of("line_rms") > of("rms") + 0.05, "{errors}: {told}");
    }
    assert!(number(&held["half_width_there_mps"]) <= 0.8, "{told}");
    let inside = number(&held["inside_share_there"]);
    assert!((0.91..=0.98).contains(&inside), "{told}");
    let drone = &levelled["drones"][0];
    assert!((number(&drone["slope"]) - 112.0).abs() < 4.0, "steeper in wind: {told}");
    let time_s = number(&flight["statistics"]["baseline"]["drone"]["integral_time_s"]);
    assert!((2.0..20.0).contains(&time_s), "{time_s}");
}

/// Whatever the instrument read, the estimate, its errors and its zero are the same.
#[test]
fn nothing_is_taken_from_the_instrument() {
    let told = hover(&bench(MAPPING), &ZERO);
    let other = MAPPING.replace("\"windVert_1800cm\", \"windVert_2130cm\"", "\"roll\"");
    assert_ne!(other, MAPPING);
    let other = hover(&bench(&other), &ZERO);
    assert_ne!(told["map"]["truth"], other["map"]["truth"]);
    for part in ["updraft_mps", "interval_mps", "mean", "errors"] {
        assert_eq!(told["map"]["drones"][0][part], other["map"]["drones"][0][part], "{part}");
    }
    assert_eq!(told["map"]["levelled"]["drones"], other["map"]["levelled"]["drones"]);
}

#[test]
fn the_legs_give_the_level_or_the_slope() {
    let bench = bench(MAPPING);
    let levelled = |more: &[&str]| hover(&bench, more)["map"]["levelled"].clone();
    // Flown on another day, in air of another density: it is in the error.
    let of_legs = levelled(&["--vehicle", "phantom4"]);
    let drone = &of_legs["drones"][0];
    assert!(of_legs["zero_s"].is_null(), "{of_legs:#}");
    let bias = number(&of_legs["held_out"]["bias_mps"]);
    assert!(bias.abs() < 1.96 * number(&drone["level_se_mps"]), "{of_legs:#}");
    let line = levelled(&["--zero", "0..150s"]);
    assert_eq!(line["response"], "calibration's straight line");
    let slope = number(&line["drones"][0]["slope"]);
    assert!((slope - 87.0).abs() < 11.0, "{line:#}");
    assert_eq!(number(&line["drones"][0]["wind_mps"]), 0.0);
}

#[test]
fn the_report_shows_the_estimate_beside_the_instrument() {
    let bench = bench(MAPPING);
    let args = [&["analyze", "--csv", "mast.toml", "--output", "out"], &ZERO[..]].concat();
    let ended = bench.expect(0, &args);
    let lines: Vec<&str> = ended.out.split_whitespace().collect();
    let said = lines.join(" ");
    assert!(
        said.contains("against the instrument outside of the zero stretch: rms error of 14"),
        "{said}"
    );
    assert!(said.contains("for 0.1 m/s, and"), "{said}");
    let page = fs::read_to_string(bench.path("out/report/index.html")).unwrap();
    for words in ["The air beside an instrument", "sets the zero", "A drone’s baseline needs"] {
        let there = page.contains(words)
            || page.contains(&words.replace('’', "&#x27;"))
            || page.contains(&words.replace('’', "'"));
        assert!(there, "{words}");
    }
}

#[test]
fn a_zero_that_there_is_not_is_refused_with_what_to_do() {
    let bench = bench(MAPPING);
    let (tables, _) = MAPPING.split_once("[[flights]]").unwrap();
    let alone = format!(
        "{tables}[[flights]]\nname = \"hover\"\npurpose = \"measurement\"\nfiles = [\"phantom4-hover-first300s.csv\"]\n"
    );
    fs::write(bench.path("alone.toml"), alone).unwrap();
    let mut told = String::new();
    for args in [
        &["--csv", "mast.toml", "--vehicle", "phantom4", "--zero", "400..500s"][..],
        &["--csv", "mast.toml", "--vehicle", "phantom4", "--zero", "200..400s"],
        &["--csv", "mast.toml", "--vehicle", "phantom4", "--zero", "150..0s"],
        &["--csv", "mast.toml", "--vehicle", "phantom4", "--zero", "0..150"],
        &["--csv", "mast.toml", "--vehicle", "phantom4", "--zero", "0..20s"],
        &["--csv", "mast.toml", "--vehicle", "phantom5", "--zero", "0..150s"],
        &["--csv", "alone.toml", "--vehicle", "phantom4"],
        &["--csv", "alone.toml", "--zero", "0..150s"],
        &["campaign", "--zero", "0..150s"],
        &["campaign", "--vehicle", "phantom4"],
    ] {
        let ended = bench.expect(2, &[&["analyze", "--no-report"], args].concat());
        writeln!(told, "{}\n{}", args.join(" "), ended.err.trim()).unwrap();
    }
    assert_snapshot!(told);
}
