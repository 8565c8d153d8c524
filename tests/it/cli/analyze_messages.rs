//! `updraft analyze` with logs that hold what cannot be: each message says what it is.

use std::fs;

use insta::assert_snapshot;

use crate::cli::analyze_inputs::{all, campaign, patch, said};
use crate::cli::support::{Bench, Ended};

const HOVER: &str = "campaign/hover/simulated/01.BIN";

fn analyze(bench: &Bench, code: i32) -> Ended {
    bench.expect(code, &["analyze", "campaign", "--no-report"])
}

/// The lines that speak of one thing, without the breaks of the terminal.
fn about(ended: &Ended, word: &str) -> String {
    let mut found: Vec<String> = Vec::new();
    let mut is_open = false;
    for line in ended.out.lines() {
        is_open &= !line.trim().is_empty();
        if line.trim_start().starts_with("- ") {
            found.push(line.trim().to_owned());
            is_open = true;
        } else if let Some(last) = found.last_mut().filter(|_| is_open) {
            last.push(' ');
            last.push_str(line.trim());
        }
    }
    found.retain(|line| line.contains(word));
    assert!(!found.is_empty(), "{word}\n{ended}");
    found.join("\n")
}

/// Standard error of the drone's mean in the map by the battery, and by all, m/s.
fn errors(bench: &Bench, drone: usize) -> (f64, f64) {
    let args = ["analyze", "campaign", "--no-report", "--json", "--quiet"];
    let value = bench.expect(0, &args).json("updraft.analyze/1");
    let errors = &value["analysis"]["flights"][1]["map"]["drones"][drone]["errors"];
    (errors["battery_mps"].as_f64().unwrap(), errors["total_mps"].as_f64().unwrap())
}

#[test]
fn a_battery_that_was_not_logged_is_an_error_of_its_size_and_a_caution() {
    let bench = campaign();
    let (before, _) = errors(&bench, 0);
    for column in ["Volt", "VoltR"] {
        patch(&bench.path(HOVER), "BAT", column, all(f32::NAN));
    }
    let (after, total) = errors(&bench, 0);
    assert!(after > 0.15 && after > 2.0 * before && total > after, "{before} -> {after}, {total}");
    let (other, _) = errors(&bench, 1);
    assert!(other < after, "the other drone's is known: {other}");
    let told = analyze(&bench, 0);
    assert_snapshot!("a_hover_without_voltage", about(&told, "battery: "));

    let bench = campaign();
    for column in ["Volt", "VoltR"] {
        patch(&bench.path("campaign/calibration/simulated/02.BIN"), "BAT", column, all(f32::NAN));
    }
    assert_snapshot!("a_ladder_without_voltage", about(&analyze(&bench, 0), "battery: "));
    for column in ["Volt", "VoltR"] {
        patch(&bench.path("campaign/calibration/simulated/01.BIN"), "BAT", column, all(f32::NAN));
    }
    assert_snapshot!("no_ladder_with_voltage", about(&analyze(&bench, 0), "battery: "));
}

#[test]
fn values_that_cannot_be_are_not_called_missing() {
    let bench = campaign();
    for motor in ["C1", "C2", "C3", "C4"] {
        patch(&bench.path(HOVER), "RCOU", motor, |_, field| field.fill(0xff));
    }
    patch(&bench.path("campaign/calibration/simulated/02.BIN"), "XKF1", "VD", all(3e38));
    assert_snapshot!(said(&analyze(&bench, 3)));
}

#[test]
fn a_log_an_hour_off_in_all_its_clocks_says_so() {
    let bench = campaign();
    let later = |_: usize, field: &mut [u8]| {
        let now = i32::from_le_bytes([field[0], field[1], field[2], field[3]]);
        field.copy_from_slice(&(now + 3_600_000).to_le_bytes());
    };
    patch(&bench.path(HOVER), "GPS", "GMS", later);
    patch(&bench.path(HOVER), "SHOW", "ClockMS", later);
    let told = analyze(&bench, 3);
    assert_snapshot!(about(&told, "show time"));
}

#[test]
fn a_log_that_ends_before_the_first_window_says_so_and_is_not_used() {
    let bench = campaign();
    let log = fs::OpenOptions::new().write(true).open(bench.path(HOVER)).unwrap();
    // After take-off, and before the window from 23 to 52 s: 88 s have been logged.
    log.set_len(log.metadata().unwrap().len() / 5).unwrap();
    let told = analyze(&bench, 3);
    let said = about(&told, "the log ends in the air");
    assert!(
        said.contains(" s after the show's start, before the plan's first window (from 23 s)"),
        "{said}"
    );
    assert!(!told.out.contains("what it holds is analysed"), "{told}");
    assert!(!told.out.contains("clock jumped"), "{told}");
    assert!(told.out.contains("Logs not used (1)"), "{told}");
}

#[test]
fn what_the_papers_method_does_not_say_is_said() {
    let bench = campaign();
    let told = bench.expect(0, &["analyze", "campaign", "--no-report", "--paper"]);
    assert_snapshot!(about(&told, "errors: "));
    let ours = analyze(&bench, 0);
    assert!(!ours.out.contains("inverts the laws of the tables"), "{ours}");
}

#[test]
fn quiet_keeps_what_is_wrong() {
    let bench = campaign();
    fs::write(bench.path(HOVER), b"").unwrap();
    let lost = bench.expect(3, &["-q", "analyze", "campaign", "--no-report"]);
    assert_snapshot!("quiet_names_a_lost_drone", said(&lost));
    let bench = campaign();
    fs::remove_dir_all(bench.path("campaign/calibration/simulated")).unwrap();
    let nothing = bench.expect(5, &["-q", "analyze", "campaign", "--no-report"]);
    assert_snapshot!("quiet_says_why_there_is_nothing", said(&nothing));
}
