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
    let returns = "\"step\":\"abort\",\"drones\":[{\"drone\":{\"network\":0,\"system\":2},\"outcome\":\"returns\"}]";
    assert!(journal.contains(returns), "{journal}");
    assert!(
        journal.contains("\"outcome\":\"loaded: file written, fence set and read back\""),
        "{journal}"
    );
    assert!(journal.contains("\"outcome\":\"set: "), "{journal}");
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
    assert!(said.contains("drone 2: lands") && !said.contains("drone 1: lands"), "{said}");
    assert!(journal(&bench).contains("\"step\":\"land\""), "{}", journal(&bench));
    let ended = bench.expect(0, &ends("abort", &link));
    assert!(ended.out.contains("drone 1: returns"), "{ended}");
    flight.signal("-KILL");
    flight.end();
    assert_eq!(modes(&bench, &link)[0], "RTL");
}

#[test]
fn an_abort_before_the_start_takes_the_start_back_for_everyone() {
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let mut args = shown(&link);
    for word in &mut args {
        if *word == "25" {
            *word = "600";
        }
    }
    for (some, ended_by) in [(&[][..], "drone 1: on"), (&["--drones", "2"][..], "drone 2: on")] {
        let mut flight = Flight::of(&bench, &args);
        flight.hear("Authorized.");
        let ended = bench.expect(0, &[&ends("abort", &link)[..], some].concat());
        assert!(ended.out.contains(ended_by), "{ended}");
        assert!(ended.out.contains("on the ground, its start is taken back"), "{ended}");
        assert_eq!(flight.end(), Some(3), "{}", flight.said());
        assert!(flight.said().contains("taken back for everyone"), "{}", flight.said());
    }
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

#[test]
fn an_abort_needs_no_disk_and_names_who_was_not_heard() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    // Nothing can be written into a folder.
    fs::create_dir(bench.path("campaign/fleet-journal.ndjson")).unwrap();
    let ended = bench.expect(0, &ends("abort", &link));
    assert!(ended.out.contains("drone 2: on the ground, its start is taken back"), "{ended}");
    assert!(ended.err.contains("warning: not in the journal"), "{ended}");
    let some =
        ["fleet", "abort", "campaign", "--connect", &link, "--drones", "2,77", "--wait", "3"];
    let ended = bench.expect(3, &some);
    assert!(ended.out.contains("drone 2: on the ground"), "{ended}");
    assert!(ended.out.contains("drone 77: NOT HEARD, so nothing was sent to it"), "{ended}");
}

#[test]
fn json_is_one_object_however_a_flight_ends() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let fly = ["fly", "campaign", "--connect", &link, "--yes", "--wait", "5", "--json"];
    let no_go = bench.expect(4, &fly).json("updraft.fly/1");
    assert_eq!(no_go["flights"][0]["outcome"], "no_go");
    assert_eq!(no_go["flights"][0]["preflight"]["go"], false);
    assert_eq!(no_go["flights"][0]["drones"][1]["outcome"], "not_started");
    let go = [&fly[..], &["--set-params", "--lead", "25"]].concat();
    let flown = bench.expect(0, &go).json("updraft.fly/1");
    assert_eq!(flown["flights"][0]["drones"][1]["outcome"], "landed");
    assert_eq!(flown["flights"][0]["logs"][1]["state"], "pulled");
    let sim = bench.expect(0, &["fly", "drones", "--connect", "sim", "--yes", "--json"]);
    let sim = sim.json("updraft.fly/1");
    assert_eq!(sim["flights"][0]["drones"][1]["outcome"], "landed");
    assert_eq!(sim["flights"][0]["logs"].as_array().unwrap().len(), 2);
}

#[test]
fn arguments_are_refused_before_anything_is_sent() {
    let bench = Bench::new();
    bench.planned("1x2", "campaign");
    let ended = bench.expect(2, &["fly", "campaign", "--lead", "8"]);
    assert!(ended.err.contains("a lead between 20 and 43200 s"), "{ended}");
    let ended = bench.expect(2, &["fleet", "upload", "campaign/plan.json"]);
    assert!(ended.err.contains("is a file: give the campaign's folder"), "{ended}");
    let host = ["fleet", "status", "campaign", "--connect", "udpin:no-such-host.invalid:14550"];
    let ended = bench.expect(1, &host);
    assert!(ended.err.contains("the host name is not known"), "{ended}");
    let ended = bench.expect(0, &["fly", "campaign", "--dry-run", "--lead", "60"]);
    assert!(ended.out.contains("the drones' GPS time + 60 s"), "{ended}");
    assert!(!ended.out.contains("2147483647"), "{ended}");
    bench.expect(0, &["plan", "campaign", "--grid", "1x2", "-o", "both"]);
    bench.expect(0, &["fleet", "abort", "both", "--dry-run"]);
}
