//! `fleet abort` and `fleet land` from another terminal, while `fly` holds the link: real processes.

#![cfg(unix)]

use std::fs;
use std::time::Duration;

use crate::guided::{Flight, flown, modes, stage};
use crate::support::Bench;

/// A show that is in the air, and its link.
fn shown(link: &str) -> Vec<&str> {
    let args = ["fly", "campaign", "--connect", link, "--set-params", "--yes", "--no-logs"];
    [&args[..], &["--lead", "25", "--wait", "20"]].concat()
}

fn ends<'a>(what: &'a str, link: &'a str) -> Vec<&'a str> {
    vec!["fleet", what, "campaign", "--connect", link, "--wait", "10"]
}

fn journal(bench: &Bench) -> String {
    fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap()
}

#[test]
fn an_abort_reaches_the_station_that_watches_a_show() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let mut flight = Flight::of(&bench, &shown(&link));
    flight.hear("drone 2: armed");
    std::thread::sleep(Duration::from_secs(4));
    let status = bench.expect(1, &ends("status", &link));
    assert!(status.err.contains("held by the command that flies this campaign"), "{status}");
    let ended = bench.expect(0, &ends("abort", &link));
    assert_eq!(ended.out, "drone 1: returns\ndrone 2: returns\n", "{ended}");
    assert!(ended.err.contains("running station"), "{ended}");
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    assert!(flight.said().contains("Ordered from another terminal: abort"), "{}", flight.said());
    let journal = journal(&bench);
    assert!(journal.contains("{\"drone\":\"2\",\"outcome\":\"returns\"}"), "{journal}");
    assert!(!bench.path("campaign/fleet-orders").exists(), "nothing is left");
}

#[test]
fn a_landing_of_one_guided_drone_leaves_the_other_flying() {
    let (bench, _fleet, link) = stage(&["--stock", "--speed", "5"]);
    let mut flight = Flight::of(&bench, &flown(&link));
    flight.hear("drone 2: armed");
    std::thread::sleep(Duration::from_secs(4));
    let order = [&ends("land", &link)[..], &["--drones", "2"]].concat();
    let ended = bench.expect(0, &order);
    assert_eq!(ended.out, "drone 2: lands\n", "{ended}");
    let said = flight.said();
    assert!(!said.contains("drone 1: flight mode"), "{said}");
    let ended = bench.expect(0, &ends("abort", &link));
    assert!(ended.out.contains("drone 1: returns"), "{ended}");
    flight.signal("-KILL");
    flight.end();
    assert_eq!(modes(&bench, &link)[0], "RTL");
}

#[test]
fn an_abort_before_the_start_takes_the_start_back() {
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let mut args = shown(&link);
    args.extend(["--lead", "600"]);
    args.retain(|word| *word != "25");
    let place = args.iter().position(|word| *word == "--lead").unwrap();
    args.remove(place);
    let mut flight = Flight::of(&bench, &args);
    flight.hear("Authorized.");
    let ended = bench.expect(0, &ends("abort", &link));
    assert!(ended.out.contains("drone 1: on the ground, its start is taken back"), "{ended}");
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
}

#[test]
fn a_station_that_hangs_is_named_and_its_order_is_withdrawn() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let mut flight = Flight::of(&bench, &shown(&link));
    flight.hear("Authorized.");
    flight.signal("-STOP");
    let ended = bench.expect(1, &ends("abort", &link));
    assert!(ended.err.contains("no station answered within 3 s"), "{ended}");
    assert!(ended.err.contains("press Ctrl-C"), "{ended}");
    flight.signal("-CONT");
    std::thread::sleep(Duration::from_secs(2));
    assert!(!flight.said().contains("Ordered"), "{}", flight.said());
}
