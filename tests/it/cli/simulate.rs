//! `updraft simulate`: what is there is kept, what is half is never taken for whole.

use std::fs;
use std::process::Stdio;

use crate::cli::support::{Bench, Ended, SHORT, contents};

#[test]
fn only_missing_logs_are_flown_again() {
    let bench = Bench::new();
    bench.fly();
    let logs = bench.path("campaign/simulated");
    let before = contents(&logs);
    let names: Vec<_> = before.iter().map(|(path, _)| path.file_name().unwrap()).collect();
    assert_eq!(names, ["01.BIN", "02.BIN", "flight.json"]);

    let kept = bench.expect(0, &["simulate", "campaign"]);
    assert!(kept.err.starts_with("Found calibration: 2 logs, "), "{kept}");

    let modified = |name: &str| fs::metadata(logs.join(name)).unwrap().modified().unwrap();
    let first = modified("01.BIN");
    fs::remove_file(logs.join("02.BIN")).unwrap();
    fs::write(logs.join(".partial-abc"), b"half a log").unwrap();
    let again = bench.expect(0, &["simulate", "campaign"]);
    assert!(again.err.starts_with("Flew calibration: 2 logs, "), "{again}");
    assert!(again.err.contains("(1 was there)"), "{again}");
    assert_eq!(contents(&logs), before, "the same bytes, and the unfinished file is swept");
    assert_eq!(modified("01.BIN"), first, "the log that was there is not touched");
}

#[test]
fn a_log_that_is_not_as_it_was_flown_is_flown_again() {
    let bench = Bench::new();
    bench.fly();
    let logs = bench.path("campaign/simulated");
    let before = contents(&logs);
    let whole = fs::read(logs.join("02.BIN")).unwrap();
    let mut flipped = whole.clone();
    flipped[whole.len() / 2] ^= 1;
    for damaged in [&whole[..whole.len() / 2], &whole[..0], &flipped] {
        fs::write(logs.join("02.BIN"), damaged).unwrap();
        let again = bench.expect(0, &["simulate", "campaign"]);
        let size = format!("it has {} bytes, not {}", damaged.len(), whole.len());
        let how = if damaged.len() == whole.len() { "its bytes were changed" } else { &size };
        let warning = format!(
            "warning: campaign/simulated/02.BIN is not as it was flown ({how}): flown again\n"
        );
        assert!(again.err.starts_with(&warning), "{again}");
        assert!(again.err.contains("Flew calibration: 2 logs"), "{again}");
        assert!(contents(&logs) == before, "the same bytes again");
    }
    // Another slot's flight alone does not forget what is known of this one.
    fs::write(logs.join("02.BIN"), &whole[..100]).unwrap();
    bench.expect(0, &["simulate", "campaign", "--drones", "1"]);
    let again = bench.expect(0, &["simulate", "campaign"]);
    assert!(again.err.contains("02.BIN is not as it was flown"), "{again}");
    // A real drone's log in its place is not the simulator's to replace.
    let real = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/crates/dataflash/tests/data/ladder-still.trimmed.BIN"
    );
    fs::copy(real, logs.join("02.BIN")).unwrap();
    let refused = bench.expect(2, &["simulate", "campaign"]);
    assert_eq!(
        refused.err,
        "error: campaign/simulated/02.BIN was not simulated by this program; move it away, or use \
         another folder\n"
    );
    assert_eq!(fs::read(logs.join("02.BIN")).unwrap(), fs::read(real).unwrap());
}

#[test]
fn other_settings_do_not_mix_with_logs() {
    let bench = Bench::new();
    bench.fly();
    let before = contents(&bench.path("campaign"));
    let windy = ["simulate", "campaign", "--updraft", "1.5"];
    let refused = bench.expect(2, &windy);
    assert!(refused.err.contains("logs flown with other settings; give --force"), "{refused}");
    assert_eq!(contents(&bench.path("campaign")), before);
    bench.expect(0, &[&windy[..], &["--force"]].concat());
    assert_ne!(contents(&bench.path("campaign/simulated")), before);
}

#[test]
fn logs_of_others_are_not_touched() {
    let bench = Bench::new();
    bench.plan();
    fs::create_dir(bench.path("campaign/simulated")).unwrap();
    fs::write(bench.path("campaign/simulated/01.BIN"), b"somebody's").unwrap();
    let refused = bench.expect(2, &["simulate", "campaign", "--force"]);
    assert!(refused.err.contains("logs that this program did not simulate"), "{refused}");
    assert_eq!(fs::read(bench.path("campaign/simulated/01.BIN")).unwrap(), b"somebody's");
}

#[test]
fn some_drones_of_one_flight() {
    let bench = Bench::new();
    bench.plan();
    let flown = bench.expect(0, &["simulate", "campaign", "--drones", "2", "--json", "--quiet"]);
    let value = flown.json("updraft.simulate/1");
    assert_eq!(value["flights"][0]["logs"], 1);
    assert!(!bench.path("campaign/simulated/01.BIN").exists());
    bench.expect(2, &["simulate", "campaign", "--flight", "dance"]);
    bench.expect(2, &["simulate", "campaign", "--drones", "2-1"]);
    let none = bench.expect(2, &["simulate", "campaign", "--drones", "3"]);
    assert!(none.err.contains("no slot 3"), "{none}");
    bench.expect(1, &["simulate", "nothing"]);
}

/// The signal goes to the program alone, in the middle of a flight that takes long.
#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_whole_logs_and_goes_on() {
    let bench = Bench::new();
    let long = ["--leg", "60", "--speeds", "0.5,1,1.5", "--hover", "20"];
    let plan = ["plan", "calibration", "--grid", "3x4", "-o", "campaign"];
    bench.expect(0, &[&plan[..], &long].concat());
    let child = bench
        .command(&["simulate", "campaign", "--full-logs"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // It is flying once an unfinished log is there.
    let logs = bench.path("campaign/simulated");
    let unfinished = || {
        fs::read_dir(&logs).is_ok_and(|mut entries| {
            entries.any(|entry| {
                let name = entry.unwrap().file_name();
                name.to_string_lossy().starts_with(".partial-")
            })
        })
    };
    while !(unfinished() && logs.join("flight.json").exists()) {
        std::thread::yield_now();
    }
    let signal = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(signal.success());
    let ended = Ended::of(&child.wait_with_output().unwrap());
    assert_eq!(ended.code, Some(130), "{ended}");
    assert_eq!(ended.err, "error: interrupted; run the same command again to resume\n");
    let left: Vec<_> = contents(&logs).into_iter().map(|(path, _)| path).collect();
    let half = left
        .iter()
        .any(|path| path.file_name().unwrap().to_string_lossy().starts_with(".partial-"));
    assert!(!half, "{left:?}");
    assert!(left.len() < 13, "it was stopped before its end: {left:?}");

    bench.expect(0, &["simulate", "campaign", "--full-logs"]);
    let whole = contents(&logs);
    assert_eq!(whole.len(), 13);
    let other = Bench::new();
    other.expect(0, &[&plan[..], &long].concat());
    other.expect(0, &["simulate", "campaign", "--full-logs"]);
    for (here, there) in whole.iter().zip(contents(&other.path("campaign/simulated"))) {
        assert!(here.1 == there.1, "{} differs from an uninterrupted run", here.0.display());
    }
}

#[test]
fn run_does_it_all_and_finds_it_done() {
    let bench = Bench::new();
    let args = [
        "run",
        "--grid",
        "1x2",
        "--duration",
        "60",
        "-o",
        "campaign",
        "--vehicle",
        "airsim-generic-quad",
        "--air",
        "still",
        "--no-study",
    ];
    let ran = bench.expect(0, &[&args[..], SHORT].concat());
    assert!(ran.out.contains("signed quadratic"), "{ran}");
    assert!(ran.err.starts_with("Planned calibration and hover for 2 drones in "), "{ran}");
    assert!(bench.path("campaign/report/index.html").is_file());
    let before = contents(&bench.path("campaign"));
    let again = bench.expect(0, &[&args[..], SHORT].concat());
    assert!(again.err.contains("Found calibration: 2 logs"), "{again}");
    assert!(again.err.contains("Found hover: 2 logs"), "{again}");
    assert_eq!(again.out, ran.out);
    assert!(contents(&bench.path("campaign")) == before, "the same bytes");
}
