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

/// The hover's table with some rows (0 is the first of values) changed: columns by their names, and what they become.
fn changed(rows: std::ops::Range<usize>, columns: &[&str], to: &str) -> String {
    let mut lines: Vec<String> = HOVER.lines().map(str::to_owned).collect();
    let heads: Vec<String> = lines[0].split(',').map(str::to_owned).collect();
    for row in rows {
        let mut cells: Vec<&str> = lines[row + 1].split(',').collect();
        for column in columns {
            cells[heads.iter().position(|head| head == column).unwrap()] = to;
        }
        lines[row + 1] = cells.join(",");
    }
    lines.join("\n")
}

/// The bench with another table of the hover.
fn flown(table: &str) -> Bench {
    let bench = bench(MAPPING);
    fs::write(bench.path("phantom4-hover-first300s.csv"), table).unwrap();
    bench
}

/// What the terminal says, in one line.
fn said(bench: &Bench, more: &[&str]) -> String {
    let args = [&["analyze", "--csv", "mast.toml", "--no-report"], more].concat();
    bench.expect(0, &args).out.split_whitespace().collect::<Vec<_>>().join(" ")
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

const SONICS: [&str; 2] = ["windVert_1800cm", "windVert_2130cm"];

#[test]
fn a_hole_in_the_truth_costs_the_seconds_that_it_touches() {
    let whole = hover(&bench(MAPPING), &ZERO);
    // One of the two is enough: their mean is the truth.
    for columns in [&SONICS[..], &SONICS[1..]] {
        let bench = flown(&changed(1000..1006, columns, ""));
        let flight = hover(&bench, &ZERO);
        let truth = flight["map"]["drones"][0]["truth_mps"].as_array().unwrap();
        let unknown = truth.iter().filter(|value| value.is_null()).count();
        assert!((8..=12).contains(&unknown), "{unknown} of {} s", truth.len());
        let values = |flight: &Value| {
            flight["map"]["levelled"]["held_out"]["running"]["values"].as_u64().unwrap()
        };
        assert_eq!(values(&flight) + unknown as u64, values(&whole));
        let said = said(&bench, &ZERO);
        let known = truth.len() - unknown;
        for words in [
            format!("are known in {known} of {} s of the hover", truth.len()),
            "the others are not compared with it".to_owned(),
            "against the instrument outside of the zero stretch".to_owned(),
            "(longest stretch 1.4 s)".to_owned(),
        ] {
            assert!(said.contains(&words), "{words}: {said}");
        }
    }
}

#[test]
fn a_truth_that_begins_late_or_is_not_there_is_told() {
    let late = flown(&changed(0..750, &SONICS, "NaN"));
    let told = said(&late, &ZERO);
    for words in ["(longest stretch 150.0 s)", "against the instrument outside of the zero stretch"]
    {
        assert!(told.contains(words), "{words}: {told}");
    }
    let none = flown(&changed(0..1500, &SONICS, ""));
    let told = said(&none, &ZERO);
    assert!(told.contains("are known in 0 of ") && told.contains("nothing is compared"), "{told}");
    let args = ["analyze", "--csv", "mast.toml", "--output", "out"];
    none.expect(0, &[&args[..], &ZERO].concat());
    let page = fs::read_to_string(none.path("out/report/index.html")).unwrap();
    assert!(!page.contains("The air beside an instrument"), "there is none");
}

/// One number that no rotor and no drone has in a table of 1500 rows.
#[test]
fn a_cell_that_cannot_be_is_no_measurement() {
    let whole = hover(&bench(MAPPING), &ZERO);
    let gain = |flight: &Value| number(&flight["map"]["levelled"]["drones"][0]["gain"]);
    for (row, column, to, words) in [
        (1000, "motRpm_RF", "65535", "1 cell of \"motRpm_RF\" is more than three times its median"),
        (500, "motRpm_RF", "1e9", "first in line 502: left out"),
        (500, "motRpm_LB", "0", "1 cell of \"motRpm_LB\" is 0 or less"),
        (500, "vd", "9999", "1 cell of \"vd\" is faster than 100 m/s"),
        (1000, "vd", "-9999", "1 cell of \"vd\" is faster than 100 m/s"),
    ] {
        let bench = flown(&changed(row..row + 1, &[column], to));
        let flight = hover(&bench, &ZERO);
        assert!((gain(&flight) - gain(&whole)).abs() < 0.01, "{column} {to}: {}", gain(&flight));
        assert_eq!(flight["map"]["time_s"], whole["map"]["time_s"], "{column} {to}");
        let said = said(&bench, &ZERO);
        assert!(said.contains(words), "{words}: {said}");
    }
}

/// A minute without rows in the first half: what is before and behind it sets the zero.
#[test]
fn a_hole_in_the_table_costs_its_own_seconds_alone() {
    let whole = hover(&bench(MAPPING), &ZERO);
    let rows: Vec<&str> = HOVER.lines().collect();
    let holed = flown(&[&rows[..252], &rows[551..]].concat().join("\n"));
    let flight = hover(&holed, &ZERO);
    assert_eq!(flight["map"]["time_s"], whole["map"]["time_s"]);
    let of = |flight: &Value| flight["map"]["levelled"].clone();
    assert_eq!(
        of(&flight)["held_out"]["running"]["values"],
        of(&whole)["held_out"]["running"]["values"]
    );
    let values = flight["map"]["drones"][0]["updraft_mps"].as_array().unwrap();
    let silent = values.iter().filter(|value| value.is_null()).count();
    assert!((60..=72).contains(&silent), "{silent} s");
    let said = said(&holed, &ZERO);
    assert!(said.contains("hover: the log has a gap: no values from"), "{said}");
}

#[test]
fn the_page_says_what_the_terminal_says() {
    let bench = bench(MAPPING);
    let args = ["analyze", "--csv", "mast.toml", "--output", "out"];
    let ended = bench.expect(0, &[&args[..], &ZERO].concat());
    let told: Vec<&str> = ended.out.split_whitespace().collect();
    let told = told.join(" ");
    let page = fs::read_to_string(bench.path("out/report/index.html")).unwrap();
    // The wind of the leans, the interval, and an error that the asked-for zero is not in.
    assert!(told.contains("m/s of wind that the leans show"), "{told}");
    for words in [
        "as the vehicle's drag is not",
        "as the vehicle&#x27;s drag is not",
        "as the vehicle’s drag is not",
    ] {
        assert!(!page.contains(words), "{words}");
    }
    assert!(page.contains("The wind was ") && page.contains("by the lean of the drones"));
    assert!(
        !page.contains("no 95 % interval is known") && told.contains("standard error (95 %: ±")
    );
    assert!(!page.contains("The errors are too small"), "94 % are inside of the bar for the mast");
    for words in ["rms error of the drone's mean", "rms error of the drone&#x27;s mean"] {
        assert!(!page.contains(&format!("{words}<")), "without the stretch that sets the zero");
    }
    assert!(page.contains("outside of the stretch that sets the zero"));
    assert!(
        told.contains("against the truth outside of the stretch that sets the zero: 0.038 m/s")
    );
    assert!(page.contains("the true mean of the air over the stretch that was set to zero"));
    assert!(!page.contains("slow air during the calibration that the whole fleet shared"));
}

#[test]
fn a_law_is_none_of_a_fitted_level() {
    let bench = bench(MAPPING);
    for law in ["linear", "signed-quadratic"] {
        let args = ["analyze", "--csv", "mast.toml", "--no-report", "--law", law];
        let ended = bench.expect(2, &[&args[..], &ZERO].concat());
        assert!(ended.err.contains("none of the laws that --law chooses"), "{ended}");
    }
}
