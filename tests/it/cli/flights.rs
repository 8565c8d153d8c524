//! Which flight a log is of: a crew that aborts, flies again, practises and swaps drones. Real processes.

#![cfg(unix)]

use std::fs;

use crate::cli::fleet::free_port;
use crate::cli::guided::{Flight, stage};
use crate::cli::support::{Bench, SHORT};

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
    bench.pause(4);
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
    assert!(again.err.contains("Downloaded 2 of 2 logs"), "{again}");
    assert!(!again.err.contains("already here"), "{again}");
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
    assert!(pulled.err.contains("(2 already here)"), "{pulled}");
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
    let mut flight = in_the_countdown(&bench, &link);
    bench.expect(0, &["fleet", "abort", "campaign", "--connect", &link, "--wait", "10"]);
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    assert!(!bench.path("campaign/logs/start.json").exists());
}

/// Authorizes a start long before its time.
fn in_the_countdown<'a>(bench: &'a Bench, link: &str) -> Flight<'a> {
    let mut args = fly(link);
    for word in &mut args {
        if *word == "25" {
            *word = "600";
        }
    }
    let mut flight = Flight::of(bench, &args);
    flight.hear("Authorized.");
    assert!(bench.path("campaign/logs/start.json").exists());
    flight
}

#[test]
fn a_start_that_a_signal_or_another_station_took_back_is_no_flight_either() {
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let mut flight = in_the_countdown(&bench, &link);
    flight.signal("-INT");
    assert_eq!(flight.end(), Some(130), "{}", flight.said());
    assert!(!bench.path("campaign/logs/start.json").exists(), "{}", flight.said());
    // The station died, and nobody takes its place.
    let mut flight = in_the_countdown(&bench, &link);
    flight.signal("-KILL");
    flight.end();
    let ended =
        bench.expect(0, &["fleet", "abort", "campaign", "--connect", &link, "--wait", "10"]);
    assert!(ended.out.contains("drone 2: on the ground, its start is taken back"), "{ended}");
    assert!(!bench.path("campaign/logs/start.json").exists(), "{ended}");
}

#[test]
fn the_logs_of_one_flight_never_stand_for_those_of_another_that_nobody_flew() {
    let bench = Bench::with_shared_clock();
    for folder in ["campaign", "drones"] {
        let hover = ["--grid", "1x2", "--duration", "10", "-o", folder];
        bench.expect(0, &[&["plan", "campaign"][..], SHORT, &hover].concat());
    }
    let station = free_port();
    let link = format!("udpin:{station}");
    let flights = |name: &'static str| ["--flight", name];
    let with = [&flights("hover")[..], &["--speed", "10"]].concat();
    let _fleet = bench.fleet(&station, &with);
    let ended = bench.expect(0, &[&fly(&link)[..], &flights("hover")].concat());
    assert!(ended.err.contains("Downloaded 2 of 2 logs"), "{ended}");
    let pull = ["logs", "pull", "campaign", "--connect", &link, "--flight", "calibration"];
    for _ in 0..2 {
        let ended = bench.expect(3, &pull);
        let why = "log 1 of the drone belongs to another flight: that of hover";
        assert!(ended.err.contains(why), "{ended}");
        assert!(!bench.path("campaign/calibration/logs/01.BIN").exists(), "{ended}");
    }
}

#[test]
fn who_flew_a_slot_is_what_was_written_down_at_its_start() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    bench.expect(0, &[&fly(&link)[..], &["--no-logs"]].concat());
    let table = bench.path("campaign/fleet.json");
    let swapped = fs::read_to_string(&table).unwrap();
    let mut swapped: serde_json::Value = serde_json::from_str(&swapped).unwrap();
    for (index, system) in [2, 1].into_iter().enumerate() {
        swapped["drones"][index]["drone"]["system"] = system.into();
    }
    fs::write(&table, swapped.to_string()).unwrap();
    let pulled = bench.expect(0, &["logs", "pull", "campaign", "--connect", &link]);
    let warning = "slot 1 was flown by drone 1; fleet.json says 2 now: the log of drone 1 \
                   belongs to the flight";
    assert!(pulled.err.contains(warning), "{pulled}");
    let manifest = json(&bench, "logs/manifest.json");
    for entry in manifest["logs"].as_array().unwrap() {
        assert_eq!(entry["slot"], entry["drone"]["system"], "{entry}");
    }
}

#[test]
fn records_that_cannot_be_read_are_told_before_anybody_flies() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    fs::create_dir_all(bench.path("campaign/logs")).unwrap();
    for (file, hint) in [
        ("manifest.json", "or move it away: `updraft logs pull --again` downloads the logs again"),
        ("start.json", "or move it away; without it the start of this flight is unknown"),
    ] {
        let path = bench.path(&format!("campaign/logs/{file}"));
        fs::write(&path, "{").unwrap();
        let pull = ["logs", "pull", "campaign", "--connect", &link, "--wait", "10"];
        for args in [&fly(&link)[..], &pull] {
            let ended = bench.expect(2, args);
            assert!(ended.err.contains(file) && ended.err.contains(hint), "{ended}");
            assert!(!ended.err.contains("Loaded"), "nothing was sent: {ended}");
        }
        fs::remove_file(path).unwrap();
    }
}

#[test]
fn logs_of_an_aborted_flight_that_stay_on_the_drones_are_told() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    let mut flight = Flight::of(&bench, &fly(&link));
    flight.hear("drone 2: armed");
    bench.pause(4);
    flight.signal("-TERM");
    assert_eq!(flight.end(), Some(130), "{}", flight.said());
    let told = "No log of flight 1 (";
    let again = bench.expect(0, &fly(&link));
    assert!(again.err.contains(told), "{again}");
    let pulled = bench.expect(0, &["logs", "pull", "campaign", "--connect", &link]);
    assert!(pulled.err.contains(told), "{pulled}");
    // As it advised.
    let pull = ["logs", "pull", "campaign", "--connect", &link];
    let all = bench.expect(0, &[&pull[..], &["--log", "all"]].concat());
    assert!(!all.err.contains(told), "{all}");
    let pulled = bench.expect(0, &pull);
    assert!(!pulled.err.contains(told), "{pulled}");
    // What no manifest knows was not verified.
    fs::remove_file(bench.path("campaign/logs/manifest.json")).unwrap();
    let verified = bench.expect(3, &["logs", "verify", "campaign"]);
    let why = "logs/01.BIN has no record of its download (manifest.json), so it cannot be verified";
    assert!(verified.err.contains(why), "{verified}");
}

#[test]
fn practice_and_the_field_have_folders_of_their_own() {
    let (bench, _fleet, link) = stage(&["--speed", "10"]);
    bench.expect(0, &["fly", "campaign", "--connect", "sim", "--yes"]);
    let practised = log(&bench, "simulated/01.BIN");
    assert!(!bench.path("campaign/logs").exists());
    let flown = bench.expect(0, &fly(&link));
    assert!(!flown.err.contains("already here"), "{flown}");
    let real = log(&bench, "logs/01.BIN");
    assert!(real != practised);
    // Practice after the field leaves the field's logs alone.
    bench.expect(0, &["simulate", "campaign", "--updraft", "1", "--force"]);
    assert!(log(&bench, "logs/01.BIN") == real && log(&bench, "simulated/01.BIN") != practised);
    let analysed = bench.run(&["analyze", "campaign", "--no-report"]);
    let words = "Using the logs in logs/; the simulated ones are ignored (--logs \
                 simulated uses them)";
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
    let words = "a start must be authorized by a person or with --yes; nothing was started";
    assert!(refused.err.contains(words), "{refused}");
    assert!(!bench.path("campaign/simulated").exists());
    let practised = bench.expect(0, &["fly", "campaign", "--connect", "sim", "--yes"]);
    assert!(practised.out.contains("GO: "), "{practised}");
    for words in ["Practice of calibration", "drone 1: ", "2 of 2 drones have landed"] {
        assert!(practised.err.contains(words), "{words}\n{practised}");
    }
}
