//! `updraft analyze` on logs without a plan, logs given twice, and laws of other drones.

use std::fs;
use std::sync::OnceLock;

use insta::assert_snapshot;

use crate::cli::analyze_inputs::{campaign, said};
use crate::cli::support::{Bench, Ended};

/// A ladder of three rungs and a hover of 40 s by one drone, flown once.
fn flown() -> &'static Bench {
    static FLOWN: OnceLock<Bench> = OnceLock::new();
    FLOWN.get_or_init(|| {
        let bench = Bench::new();
        fly(&bench, "campaign", &[]);
        bench
    })
}

fn fly(bench: &Bench, folder: &str, more: &[&str]) {
    let run = ["run", "--direct", "--no-study", "--quiet", "--air", "still", "-o", folder];
    let small = ["--duration", "40", "--height", "40", "--speeds", "1,2,3"];
    let legs = ["--leg", "12", "--hover", "6"];
    let grid: &[&str] = if more.contains(&"--grid") { &[] } else { &["--grid", "1x1"] };
    bench.expect(0, &[&run[..], &small, &legs, grid, more].concat());
}

fn analyze(bench: &Bench, code: i32, args: &[&str]) -> Ended {
    bench.expect(code, &[&["analyze", "--no-report"], args].concat())
}

#[test]
fn a_hover_alone_is_no_calibration() {
    let bench = flown();
    let alone = analyze(bench, 5, &["campaign/hover/simulated/01.BIN"]);
    assert_snapshot!(said(&alone));
    assert!(
        alone.out.contains("without a plan a flight is a calibration only if it climbs"),
        "{alone}"
    );
    let laws = ["campaign/hover/simulated/01.BIN", "--hold", "campaign/analysis.json"];
    let held = analyze(bench, 0, &laws);
    assert!(held.out.contains("vertical air speed W*, m/s: mean +"), "{held}");
}

#[test]
fn a_ladder_and_a_hover_work_without_a_plan_in_any_order() {
    let bench = flown();
    let (ladder, hover) = ("campaign/calibration/simulated", "campaign/hover/simulated");
    let one = analyze(bench, 0, &[ladder, hover]);
    let other = analyze(bench, 0, &[hover, ladder]);
    assert_eq!(one.out, other.out);
    let heads: Vec<&str> = one.out.lines().filter(|l| l.contains(": 1 drone")).collect();
    assert_eq!(heads, ["calibration: 1 drone", "hover, measurement: 1 drone"], "{one}");
    assert!(one.out.contains("vertical air speed W*, m/s: mean +"), "{one}");
    assert!(!one.out.contains("No measurement flight"), "{one}");
}

#[test]
fn nothing_counts_twice() {
    let bench = campaign();
    fs::create_dir(bench.path("copy")).unwrap();
    let log = bench.path("campaign/hover/simulated/02.BIN");
    fs::copy(log, bench.path("copy/7.BIN")).unwrap();
    let mut told = String::new();
    for paths in [
        ["campaign", "campaign/../campaign"],
        ["campaign", "campaign/hover"],
        ["campaign", "copy"],
        ["copy/7.BIN", "copy"],
    ] {
        told.push_str(&analyze(&bench, 2, &paths).err);
    }
    assert_snapshot!(told);
}

#[test]
fn laws_of_other_drones_are_used_with_a_warning() {
    let bench = flown();
    let other = Bench::new();
    let more = ["--grid", "1x2", "--spacing", "9", "--seed", "5", "--vehicle", "phantom4"];
    fly(&other, "campaign", &more);
    let laws = other.path("campaign/analysis.json");
    let laws = laws.to_str().unwrap();
    // So far from them that no pulse fits.
    let held = analyze(bench, 5, &["campaign", "--hold", laws]);
    let folder = laws.strip_suffix("campaign/analysis.json").unwrap();
    let told: Vec<&str> = held.out.split_whitespace().collect();
    let told = told.join(" ").replace(folder, "");
    let start =
        told.find("the laws of campaign/analysis.json seem").unwrap_or_else(|| panic!("{held}"));
    let end = told[start..].find("calibration of these drones").unwrap();
    assert_snapshot!(told[start..start + end]);
    let own = analyze(bench, 0, &["campaign", "--hold", "campaign/analysis.json"]);
    assert!(!own.out.contains("seem to be those of other drones"), "{own}");
}

#[test]
fn each_campaign_has_its_own_calibration() {
    let bench = flown();
    let other = Bench::new();
    let more = ["--seed", "5", "--vehicle", "phantom4", "--updraft", "1"];
    fly(&other, "campaign", &more);
    let path = other.path("campaign");
    let path = path.to_str().unwrap();
    let means = |args: &[&str]| -> Vec<(String, f64)> {
        let ended = analyze(bench, 0, &[args, &["--json"]].concat());
        let found: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
        let flights = found["analysis"]["flights"].as_array().unwrap().iter();
        flights
            .filter_map(|flight| {
                let mean = flight["map"]["drones"][0]["mean"]["value"].as_f64()?;
                Some((flight["name"].as_str()?.to_owned(), mean))
            })
            .collect()
    };
    let alone = [means(&["campaign"]), means(&[path])];
    let together = means(&["campaign", path]);
    assert_eq!(together.len(), 2, "{together:?}");
    for ((_, alone), (name, together)) in alone.iter().flatten().zip(&together) {
        assert!((alone - together).abs() < 1e-12, "{name}: {together} instead of {alone}");
    }
}

#[test]
fn laws_of_other_drones_are_doubted_for_a_ladder_alone() {
    let bench = flown();
    let other = Bench::new();
    fly(&other, "campaign", &["--seed", "5", "--vehicle", "airsim-generic-quad"]);
    let laws = other.path("campaign/analysis.json");
    let hold = ["campaign/calibration", "--hold", laws.to_str().unwrap()];
    let held = analyze(bench, 0, &hold);
    let told = held.out.split_whitespace().collect::<Vec<_>>().join(" ");
    for words in [
        "seem to be those of other drones: they flew airsim-generic-quad, and calibration flew pixel; they were \
         simulated with seed 5, and calibration with seed 1: other drones",
        "with another fleet's laws the updraft is wrong",
        // And what the windows themselves say.
        "no updraft within 8 m/s brings the ladder's windows onto the calibration's curve",
        "this seems to be the calibration of another vehicle",
    ] {
        assert!(told.contains(words), "{words}: {held}");
    }
    assert!(!told.contains("A and u0 held"), "no W* by the law of another vehicle: {held}");
    let json = analyze(bench, 0, &[&hold[..], &["--json"]].concat());
    let json: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(json["analysis"]["warnings"].as_array().unwrap().len(), 1, "{json}");

    // The same drones' own calibration, and their ladder on another day.
    let again = Bench::new();
    fly(&again, "campaign", &[]);
    let own = bench.path("campaign/analysis.json");
    for bench in [bench, &again] {
        let held = ["campaign/calibration", "--hold", own.to_str().unwrap()];
        let held = analyze(bench, 0, &held);
        assert!(!held.out.contains("those of other drones"), "{held}");
        assert!(!held.out.contains("another vehicle"), "{held}");
    }
}

#[test]
fn laws_of_another_indicator_are_refused() {
    let bench = flown();
    let laws = ["--hold", "campaign/analysis.json", "--indicator", "power"];
    let held = analyze(bench, 2, &[&["campaign/hover"], &laws[..]].concat());
    let told: Vec<&str> = held.err.split_whitespace().collect();
    let told = told.join(" ");
    assert!(
        told.contains(
            "the laws of campaign/analysis.json are of the rotor control pulse width, and here the electrical \
             power is analysed; name the same indicator for both with --indicator"
        ),
        "{held}"
    );
}

#[test]
fn a_hover_alone_is_whole_with_the_laws_of_an_earlier_day() {
    let bench = flown();
    let today = Bench::new();
    fly(&today, "today", &[]);
    fs::remove_dir_all(today.path("today/calibration/simulated")).unwrap();
    let laws = bench.path("campaign/analysis.json");
    let alone = analyze(&today, 5, &["today"]);
    assert!(alone.out.contains("calibration: no logs to analyse"), "{alone}");
    let held = analyze(&today, 0, &["today", "--hold", laws.to_str().unwrap()]);
    assert!(!held.out.contains("no logs to analyse"), "{held}");
    let told: Vec<&str> = held.out.split_whitespace().collect();
    let sentence = "The laws that measure are held from an earlier calibration of 1 drone, 2026-06-01 12:00 UTC";
    assert!(told.join(" ").contains(sentence), "{held}");
    let json = analyze(&today, 0, &["today", "--hold", laws.to_str().unwrap(), "--json"]);
    let told: serde_json::Value = serde_json::from_str(&json.out).unwrap();
    assert_eq!(told["analysis"]["laws_from"]["drones"], 1, "{json}");
}

#[test]
fn simulated_logs_are_home_and_can_be_verified() {
    let bench = Bench::new();
    bench.fly();
    let link = format!("udpin:{}", crate::cli::fleet::free_port());
    let pulled = bench.expect(5, &["logs", "pull", "campaign", "--connect", &link, "--wait", "1"]);
    let whole = bench.expect(0, &["logs", "verify", "campaign"]);
    let path = bench.path("campaign/simulated/02.BIN");
    let mut log = fs::read(&path).unwrap();
    let last = log.len() - 9;
    log[last] ^= 1;
    fs::write(&path, &log).unwrap();
    let changed = bench.expect(3, &["logs", "verify", "campaign"]);
    fs::remove_file(&path).unwrap();
    let gone = bench.expect(3, &["logs", "verify", "campaign"]);
    let told = [pulled.err, whole.err, changed.err, gone.err].concat();
    assert_snapshot!(told);
    let planned = Bench::new();
    planned.plan();
    assert_snapshot!(planned.expect(5, &["logs", "verify", "campaign"]).err);
}

#[test]
fn laws_of_another_campaign_are_doubted_as_held_ones_are() {
    let bench = Bench::new();
    for (folder, seed) in [("one", "5"), ("two", "6")] {
        fly(&bench, folder, &["--grid", "1x2", "--seed", seed]);
    }
    let told = analyze(&bench, 0, &["one/calibration", "two/hover"]);
    let words: Vec<&str> = told.out.split_whitespace().collect();
    let doubt = "the laws of calibration seem to be those of other drones: they were simulated with seed 5, \
                 and hover with seed 6: other drones.";
    assert!(words.join(" ").contains(doubt), "{told}");
    let own = analyze(&bench, 0, &["two"]);
    assert!(!own.out.contains("seem to be those of other drones"), "{own}");
}
