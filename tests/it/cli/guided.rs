//! `fly --guided` against stock drones, as processes: a flight to its report, Ctrl-C, a station
//! that dies, fleets of both firmwares.

#![cfg(unix)]

use std::fs;
use std::process::{Child, Command};

use crate::cli::fleet::{Fleet, free_port};
use crate::cli::support::{Bench, Ended};

/// A station that flies drones, and what it says.
pub(crate) struct Flight<'a> {
    bench: &'a Bench,
    child: Child,
}

impl Drop for Flight<'_> {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl<'a> Flight<'a> {
    fn begin(bench: &'a Bench, link: &str) -> Self {
        Self::of(bench, &flown(link))
    }

    pub(crate) fn of(bench: &'a Bench, args: &[&str]) -> Self {
        let mut command = bench.command(args);
        let err = fs::File::create(bench.path("err.txt")).unwrap();
        let out = fs::File::create(bench.path("out.txt")).unwrap();
        let child = bench.start(command.stdout(out).stderr(err));
        Self { bench, child }
    }

    /// What it has printed, as JSON.
    pub(crate) fn printed(&self) -> serde_json::Value {
        serde_json::from_slice(&fs::read(self.bench.path("out.txt")).unwrap()).unwrap()
    }

    pub(crate) fn said(&self) -> String {
        fs::read_to_string(self.bench.path("err.txt")).unwrap()
    }

    /// Waits until it has said this.
    pub(crate) fn hear(&mut self, text: &str) {
        let bench = self.bench;
        let heard = bench.wait_for(120, || {
            let said = self.said();
            let ended = self.child.try_wait().unwrap();
            assert!(ended.is_none() || said.contains(text), "it ended:\n{said}");
            said.contains(text).then_some(())
        });
        assert!(heard.is_some(), "no {text:?}:\n{}", self.said());
    }

    pub(crate) fn signal(&self, name: &str) {
        let id = self.child.id().to_string();
        assert!(Command::new("kill").args([name, &id]).status().unwrap().success());
    }

    pub(crate) fn end(&mut self) -> Option<i32> {
        let ended = self.bench.end_of(&mut self.child, 60);
        ended.unwrap_or_else(|| panic!("it goes on:\n{}", self.said())).code()
    }
}

pub(crate) fn flown(link: &str) -> Vec<&str> {
    let args = ["fly", "campaign", "--connect", link, "--guided", "--set-params", "--yes"];
    [&args[..], &["--lead", "40", "--wait", "20"]].concat()
}

pub(crate) fn stage(more: &[&str]) -> (Bench, Fleet, String) {
    stage_on(Bench::with_shared_clock(), more)
}

pub(crate) fn stage_on(bench: Bench, more: &[&str]) -> (Bench, Fleet, String) {
    bench.planned("1x2", "campaign");
    bench.planned("1x2", "drones");
    let station = free_port();
    let fleet = bench.fleet(&station, more);
    (bench, fleet, format!("udpin:{station}"))
}

/// Flight mode of each drone, by `fleet status`.
pub(crate) fn modes(bench: &Bench, link: &str) -> Vec<String> {
    let status = ["fleet", "status", "campaign", "--connect", link, "--wait", "5", "--json"];
    let ended = bench.expect(0, &status);
    let value: serde_json::Value = serde_json::from_str(&ended.out).unwrap();
    let rows = value["drones"].as_array().unwrap();
    rows.iter().map(|row| row["mode"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn stock_drones_are_flown_and_their_logs_analysed() {
    let (bench, _fleet, link) = stage(&["--stock", "--speed", "5"]);
    let ended = bench.expect(0, &flown(&link));
    assert!(ended.err.contains("2 of 2 drones have landed"), "{ended}");
    let start = fs::read(bench.path("campaign/logs/start.json")).unwrap();
    let start: serde_json::Value = serde_json::from_slice(&start).unwrap();
    assert_eq!(start["schema"], "updraft.start/2");
    let analysed = |ended: &Ended| {
        let analysis = ended.json("updraft.analyze/1")["analysis"].clone();
        let drones = analysis["flights"][0]["drones"].as_array().unwrap().clone();
        let method = |drone: &serde_json::Value| drone["clock"]["method"].clone();
        drones.iter().map(method).collect::<Vec<_>>()
    };
    let ended = bench.expect(0, &["analyze", "campaign", "--json"]);
    assert_eq!(analysed(&ended), ["gps_time", "gps_time"], "{ended}");
    // The manifest says it, too; without both the plan is slid along the log.
    fs::remove_file(bench.path("campaign/logs/start.json")).unwrap();
    fs::remove_file(bench.path("campaign/logs/manifest.json")).unwrap();
    let ended = bench.run(&["analyze", "campaign", "--json"]);
    assert!(!analysed(&ended).contains(&"gps_time".into()), "{ended}");
}

#[test]
fn ctrl_c_sends_guided_drones_home() {
    let (bench, _fleet, link) = stage(&["--stock", "--speed", "5"]);
    let mut flight = Flight::begin(&bench, &link);
    flight.hear("drone 1: armed");
    bench.pause(4);
    flight.signal("-INT");
    assert_eq!(flight.end(), Some(130), "{}", flight.said());
    let said = flight.said();
    assert!(said.contains("drone 1: returns") && said.contains("drone 2: returns"), "{said}");
    assert!(
        said.contains("has sent them home") && !said.contains("run the same command"),
        "{said}"
    );
    let journal = fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap();
    assert!(journal.contains("\"step\":\"abort\"") && journal.contains("returns"), "{journal}");
    assert_eq!(modes(&bench, &link), ["RTL", "RTL"]);
}

#[test]
fn a_second_ctrl_c_ends_at_once_and_says_what_becomes_of_drones() {
    let (bench, fleet, link) = stage(&["--stock", "--speed", "5"]);
    let mut flight = Flight::begin(&bench, &link);
    flight.hear("drone 1: armed");
    // Nobody is there to confirm anything.
    drop(fleet);
    flight.signal("-INT");
    flight.hear("Ctrl-C again to end at once");
    flight.signal("-INT");
    assert_eq!(flight.end(), Some(130), "{}", flight.said());
    assert!(flight.said().contains("Ended at once: drones that had not"), "{}", flight.said());
}

#[test]
fn drones_return_when_their_station_dies() {
    let (bench, _fleet, link) = stage(&["--stock", "--speed", "5"]);
    let mut flight = Flight::begin(&bench, &link);
    flight.hear("drone 1: armed");
    bench.pause(4);
    flight.signal("-KILL");
    assert_eq!(flight.end(), None);
    bench.pause(2);
    assert_eq!(modes(&bench, &link), ["RTL", "RTL"]);
}

#[test]
fn fleets_of_both_firmwares_are_refused_by_name() {
    let (bench, _fleet, link) = stage(&["--stock", "2"]);
    let fly = ["fly", "campaign", "--connect", &link, "--set-params", "--yes", "--wait", "20"];
    let ended = bench.expect(4, &fly);
    insta::assert_snapshot!(ended.err);
}

#[test]
fn a_dry_run_shows_each_drones_targets() {
    let bench = Bench::new();
    bench.planned("1x2", "campaign");
    let args = ["fly", "campaign", "--connect", "udpin:127.0.0.1:1", "--guided", "--dry-run"];
    let ended = bench.expect(0, &args);
    assert!(ended.err.contains("Nothing was sent"), "{ended}");
    assert!(ended.out.contains("to drone 2, if all goes well:"), "{ended}");
    let first = ended.out.split("to drone 2").next().unwrap();
    insta::assert_snapshot!(first);
}
