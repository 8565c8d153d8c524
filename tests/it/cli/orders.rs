//! `fleet abort` and `fleet land` from another terminal, while `fly` holds the link: real processes.

#![cfg(unix)]

use std::fs;

use crate::cli::fleet::free_port;
use crate::cli::guided::{Flight, flown, modes, stage, stage_on};
use crate::cli::support::Bench;
use crate::cli::terminal::on_a_terminal;

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
    bench.pause(4);
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
    bench.pause(4);
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
        assert!(flight.said().contains("cancelled on all drones"), "{}", flight.said());
    }
}

/// Waits until a file has this.
fn wait_for(bench: &Bench, file: &str, text: &str) -> bool {
    let has = || {
        let bytes = fs::read(bench.path(file)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).contains(text).then_some(())
    };
    bench.wait_for(120, has).is_some()
}

#[test]
fn an_abort_at_the_question_is_confirmed_in_both_terminals() {
    for (stock, guided) in [(&[][..], &[][..]), (&["--stock"], &["--guided"])] {
        let (bench, _fleet, link) = stage(&[&["--speed", "5"][..], stock].concat());
        let fly = ["fly", "campaign", "--connect", &link, "--set-params", "--no-logs"];
        let fly = [&fly[..], &["--lead", "120", "--wait", "20"], guided].concat();
        let question = "Authorize the start?";
        let order =
            || wait_for(&bench, "typescript", question).then(|| bench.run(&ends("abort", &link)));
        let (shown, ended) =
            bench.together(|| on_a_terminal(&bench, &fly, &[(question, "")]), order);
        let (Some((code, shown)), Some(ended)) = (shown, ended) else { return };
        let down = "on the ground, its start is taken back";
        assert_eq!(ended.out, format!("drone 1: {down}\ndrone 2: {down}\n"), "{ended}");
        assert_eq!(ended.code, Some(0), "{ended}");
        assert_eq!(code, 4, "{shown}");
        assert!(shown.contains(&format!("drone 2: {down}")), "{shown}");
        assert!(!bench.path("campaign/fleet-orders").exists(), "nothing is left");
    }
}

#[test]
fn an_abort_before_anything_is_loaded_ends_the_flight() {
    let (bench, _fleet, link) = stage(&["--speed", "2"]);
    let mut flight = Flight::of(&bench, &shown(&link));
    assert!(wait_for(&bench, "campaign/fleet-orders/station.json", "station"));
    bench.expect(0, &ends("abort", &link));
    assert_eq!(flight.end(), Some(4), "{}", flight.said());
    let said = flight.said();
    assert!(said.contains("nothing was started: `fleet abort`"), "{said}");
    assert!(!said.contains("Loaded") && !said.contains("Changed"), "{said}");
}

#[test]
fn an_order_reaches_the_flight_that_is_in_the_air_whichever_is_named() {
    let bench = Bench::with_shared_clock();
    for folder in ["both", "drones"] {
        let plan = ["plan", "campaign", "--grid", "1x2", "--duration", "60", "--speeds", "1"];
        bench.expect(0, &[&plan[..], &["-o", folder]].concat());
    }
    let station = free_port();
    let _fleet = bench.fleet(&station, &["--flight", "calibration", "--speed", "5"]);
    let link = format!("udpin:{station}");
    let fly = ["fly", "both", "--flight", "calibration", "--connect", &link, "--set-params"];
    let fly = [&fly[..], &["--yes", "--no-logs", "--lead", "25", "--wait", "20"]].concat();
    let mut flight = Flight::of(&bench, &fly);
    flight.hear("drone 1: performing");
    flight.hear("drone 2: performing");
    // Another flight of the campaign, without the link, and from within the campaign.
    let abort = ["fleet", "abort", "both", "--flight", "hover", "--drones", "1"];
    let ended = bench.expect(0, &abort);
    assert_eq!(ended.out, "drone 1: returns\n", "{ended}");
    assert!(
        ended.err.contains("calibration is flying: its station will carry out the order"),
        "{ended}"
    );
    let ended = bench.expect(0, &["fleet", "land", "both/hover", "--drones", "2"]);
    assert_eq!(ended.out, "drone 2: lands\n", "{ended}");
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
}

#[test]
fn a_drone_that_does_not_confirm_is_left_to_its_remote_control_in_time() {
    let (bench, _fleet, link) = stage(&["--speed", "5", "--gone", "2", "--after", "60"]);
    let mut flight = Flight::of(&bench, &shown(&link));
    flight.hear("drone 2: not heard for");
    let order =
        ["fleet", "land", "campaign", "--connect", &link, "--drones", "2,77", "--wait", "15"];
    let ended = bench.expect(3, &order);
    let told =
        "drone 2: NOT CONFIRMED within 15 s: use its remote control; the running station goes on";
    assert!(ended.out.contains(told), "{ended}");
    assert!(ended.out.contains("drone 77: NOT HEARD"), "{ended}");
    assert!(ended.err.contains("not confirmed after 10 s: 2. Use the remote controls"), "{ended}");
    flight.signal("-INT");
    flight.hear("Ctrl-C again to end at once");
    flight.signal("-INT");
    flight.end();
}

#[test]
fn a_drone_of_the_flight_that_is_not_heard_is_named() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let mut drones = bench.drones();
    let station = free_port();
    let link = format!("udpin:{station}");
    let upload = ["fleet", "upload", "campaign", "--connect", &link, "--wait", "10"];
    drones.fly(station.parse().unwrap(), || bench.expect(0, &upload), |_| {});
    // The station is gone, and drone 2 says nothing.
    drones.setups[1].gone_at = Some(0);
    let abort = ["fleet", "abort", "campaign", "--connect", &link, "--wait", "5"];
    let ended = drones.fly(station.parse().unwrap(), || bench.expect(3, &abort), |_| {});
    assert!(ended.out.contains("drone 1: on the ground"), "{ended}");
    let unheard = "drone 2: NOT HEARD, so nothing was sent to it: use its remote control";
    assert!(ended.out.contains(unheard), "{ended}");
}

#[test]
fn a_start_that_was_left_on_drones_stands_in_nobodys_way() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let mut args = shown(&link);
    for word in &mut args {
        if *word == "25" {
            *word = "3000";
        }
    }
    let mut flight = Flight::of(&bench, &args);
    flight.hear("Authorized.");
    flight.signal("-KILL");
    flight.end();
    // Aborted before anybody takes off: that is no flight.
    let mut flight = Flight::of(&bench, &[&shown(&link)[..], &["--json"]].concat());
    flight.hear("Authorized.");
    let said = flight.said();
    assert!(
        said.contains("Cancelled a start left over from an earlier flight: drones 1, 2"),
        "{said}"
    );
    assert!(said.contains("Loaded 2 of 2 drones (they already had the file)"), "{said}");
    bench.expect(0, &[&ends("abort", &link)[..], &["--drones", "2"]].concat());
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    let printed = flight.printed();
    assert_eq!(printed["flights"][0]["outcome"], "not_flown", "{printed}");
}

#[test]
fn a_station_that_hangs_is_named_and_its_order_is_withdrawn() {
    // A shared clock would wait for it.
    let (bench, _fleet, link) = stage_on(Bench::new(), &["--speed", "5"]);
    let mut flight = Flight::of(&bench, &shown(&link));
    flight.hear("Authorized.");
    flight.signal("-STOP");
    let ended = bench.expect(1, &ends("abort", &link));
    assert!(ended.err.contains("no station answered within 3 s"), "{ended}");
    assert!(ended.err.contains("press Ctrl-C"), "{ended}");
    flight.signal("-CONT");
    bench.pause(2);
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
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let ended = bench.expect(2, &["fly", "campaign", "--lead", "8"]);
    assert!(ended.err.contains("a lead between 20 and 43200 s"), "{ended}");
    let ended = bench.expect(2, &["fleet", "upload", "campaign/plan.json"]);
    assert!(ended.err.contains("is a file; give the campaign's folder"), "{ended}");
    let host = ["fleet", "status", "campaign", "--connect", "udpin:no-such-host.invalid:14550"];
    let ended = bench.expect(1, &host);
    assert!(ended.err.contains("the host name is not known"), "{ended}");
    let ended = bench.expect(0, &["fly", "campaign", "--dry-run", "--lead", "60"]);
    assert!(ended.out.contains("the drones' GPS time + 60 s"), "{ended}");
    assert!(!ended.out.contains("2147483647"), "{ended}");
    bench.expect(0, &["plan", "campaign", "--grid", "1x2", "-o", "both"]);
    bench.expect(0, &["fleet", "abort", "both", "--dry-run"]);
}
