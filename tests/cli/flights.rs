//! Which flight a log is of: a crew that aborts, flies again, practises and swaps drones. Real processes.

#![cfg(unix)]

use std::fs;
use std::time::Duration;

use crate::guided::{Flight, stage};
use crate::support::Bench;

fn fly(link: &str) -> Vec<&str> {
    let args = ["fly", "campaign", "--connect", link, "--set-params", "--yes"];
    [&args[..], &["--lead", "25", "--wait", "20"]].concat()
}

fn log(bench: &Bench, path: &str) -> Vec<u8> {
    fs::read(bench.path(&format!("campaign/{path}"))).unwrap()
}

fn json(bench: &Bench, path: &str) -> serde_json::Value {
    serde_json::from_slice(&log(bench, path)).unwrap()
}

/// Flies until the drones are in the air, and sends them home.
fn abort(bench: &Bench, link: &str) {
    let mut flight = Flight::of(bench, &fly(link));
    flight.hear("drone 2: armed");
    std::thread::sleep(Duration::from_secs(4));
    bench.expect(0, &["fleet", "abort", "campaign", "--connect", link, "--wait", "10"]);
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
}

#[test]
fn the_logs_of_an_aborted_flight_never_stand_for_those_of_the_next() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    abort(&bench, &link);
    let aborted = [log(&bench, "logs/01.BIN"), log(&bench, "logs/02.BIN")];
    let first = json(&bench, "logs/start.json");
    assert_eq!((&first["schema"], &first["number"]), (&"updraft.start/2".into(), &1.into()));
    assert_eq!(first["drones"][1]["drone"], "2");
    assert!(first["drones"][1]["show_crc32"].is_u64() && first["drones"][1]["booted"].is_object());

    let again = bench.expect(0, &fly(&link));
    assert!(again.err.contains("Moved 2 logs of an earlier flight to campaign/logs/flight-1"));
    assert!(again.err.contains("Brought 2 of 2 logs home"), "{again}");
    assert!(!again.err.contains("had come before"), "{again}");
    for (slot, aborted) in (1..).zip(&aborted) {
        let now = log(&bench, &format!("logs/{slot:02}.BIN"));
        assert!(now != *aborted, "log {slot}");
        assert!(log(&bench, &format!("logs/flight-1/{slot:02}.BIN")) == *aborted, "log {slot}");
    }
    let manifest = json(&bench, "logs/manifest.json");
    let flight = &manifest["logs"][0]["flight"];
    let start = json(&bench, "logs/start.json");
    assert_eq!((&flight["number"], &start["number"]), (&2.into(), &2.into()), "{flight}");
    assert_eq!(flight["authorized_start"], start["start"]);
    assert_eq!(flight["show_crc32"], start["drones"][0]["show_crc32"]);
    assert_eq!(flight["gps_start"]["week"], start["start"]["week"], "{flight}");
    assert_eq!(json(&bench, "logs/flight-1/manifest.json")["logs"][0]["flight"]["number"], 1);
    assert_eq!(json(&bench, "logs/flight-1/start.json"), first);
    bench.expect(0, &["logs", "verify", "campaign"]);
    let pulled = bench.expect(0, &["logs", "pull", "campaign", "--connect", &link]);
    assert!(pulled.err.contains("(2 had come before)"), "{pulled}");
}

#[test]
fn drones_that_were_switched_off_in_between_have_other_logs_under_the_same_numbers() {
    let (bench, fleet, link) = stage(&["--speed", "10"]);
    abort(&bench, &link);
    let aborted = log(&bench, "logs/01.BIN");
    drop(fleet);
    // New cards: their logs begin at number 1, too.
    let station = link.strip_prefix("udpin:").unwrap().to_owned();
    let _fleet = bench.fleet(&station, &["--speed", "10"]);
    let again = bench.expect(0, &fly(&link));
    assert!(again.err.contains("Moved 2 logs of an earlier flight"), "{again}");
    let now = log(&bench, "logs/01.BIN");
    assert!(now != aborted && !now.starts_with(&aborted));
    assert!(log(&bench, "logs/flight-1/01.BIN") == aborted);
    // Again and again: nothing that is home is overwritten or lost.
    let pull = ["logs", "pull", "campaign", "--connect", &link, "--again"];
    bench.expect(0, &pull);
    assert!(log(&bench, "logs/01.BIN") == now);
}

#[test]
fn a_start_that_was_taken_back_is_no_flight() {
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let mut args = fly(&link);
    for word in &mut args {
        if *word == "25" {
            *word = "600";
        }
    }
    let mut flight = Flight::of(&bench, &args);
    flight.hear("Authorized.");
    assert!(bench.path("campaign/logs/start.json").exists());
    bench.expect(0, &["fleet", "abort", "campaign", "--connect", &link, "--wait", "10"]);
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    assert!(!bench.path("campaign/logs/start.json").exists());
}

#[test]
fn practice_and_the_field_have_folders_of_their_own() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    bench.expect(0, &["fly", "campaign", "--connect", "sim", "--yes"]);
    let practised = log(&bench, "simulated/01.BIN");
    assert!(!bench.path("campaign/logs").exists());
    let flown = bench.expect(0, &fly(&link));
    assert!(!flown.err.contains("had come before"), "{flown}");
    let real = log(&bench, "logs/01.BIN");
    assert!(real != practised);
    // Practice after the field leaves the field's logs alone.
    bench.expect(0, &["simulate", "campaign", "--updraft", "1", "--force"]);
    assert!(log(&bench, "logs/01.BIN") == real && log(&bench, "simulated/01.BIN") != practised);
    let analysed = bench.run(&["analyze", "campaign", "--no-report"]);
    let words = "Using the logs of real drones (logs/); the simulated ones are left (--logs simulated \
                 takes them)";
    assert!(analysed.err.contains(words), "{analysed}");
    let practice = bench.run(&["analyze", "campaign", "--no-report", "--logs", "simulated"]);
    assert!(practice.err.contains("Using the simulated logs (simulated/)"), "{practice}");
    // A report of simulated flights does not take the place of the field's.
    let template = ["run", "calibration", "--grid", "1x2", "-o", "campaign"];
    let refused = bench.expect(2, &template);
    assert!(refused.err.contains("campaign/logs holds logs of real drones"), "{refused}");
}

#[test]
fn practice_asks_and_shows_what_the_field_does() {
    let (bench, _fleet, _link) = stage(&["--speed", "1"]);
    let refused = bench.expect(2, &["fly", "campaign", "--connect", "sim"]);
    let words = "a start is authorized by a person, or with --yes; nothing was started";
    assert!(refused.err.contains(words), "{refused}");
    assert!(!bench.path("campaign/simulated").exists());
    let practised = bench.expect(0, &["fly", "campaign", "--connect", "sim", "--yes"]);
    assert!(practised.out.contains("GO: "), "{practised}");
    for words in ["Practice of calibration", "drone 1: ", "2 of 2 drones have landed"] {
        assert!(practised.err.contains(words), "{words}\n{practised}");
    }
}
