//! A blind table on a real scheduler whose node dies in the middle: the bytes of one process.

use std::fs;
use std::time::Duration;

use super::shards::{BLIND, assert_same, files};
use super::slurm_daemons::{Slurm, elapsed};
use crate::cli::support::{Bench, Ended};
use updraft::workflow::clock::SystemClock;

/// Flights of the table.
const FLIGHTS: &str = "3";
/// The whole job takes half a minute on two cores; a node that is lost costs another.
const LONGEST: Duration = Duration::from_mins(6);

#[test]
fn a_node_that_dies_costs_nothing_but_time() {
    let mut slurm = match Slurm::start(2) {
        Ok(slurm) => slurm,
        Err(reason) => {
            eprintln!("skipped: no Slurm here: {reason}");
            return;
        }
    };
    let bench = Bench::new();
    let (variable, value) = slurm.environment();
    let expect = |code: i32, args: &[&str]| {
        let ended = Ended::of(&bench.command(args).env(variable, &value).output().unwrap());
        assert_eq!(ended.code, Some(code), "updraft {}\n{ended}", args.join(" "));
        ended
    };
    let blind = |folder: &'static str| [BLIND, &["--flights", FLIGHTS, "-o", folder]].concat();
    let submit =
        [&["cluster", "submit"], &blind("many")[..], &["--shards", "3", "--time", "5"]].concat();
    let submitted = expect(0, &submit);
    assert!(submitted.err.contains("Submitted array"), "{submitted}");
    let begun = SystemClock::start();
    let results = || fs::read_dir(bench.path("many/flights")).map_or(0, Iterator::count);
    while results() < 1 {
        assert!(elapsed(&begun) < LONGEST, "{}", slurm.run("squeue", &[]));
        std::thread::sleep(Duration::from_millis(50));
    }
    slurm.kill_node(1);
    // Meanwhile one process makes the same.
    expect(0, &blind("one"));
    let table = bench.path("many/table.json");
    while !table.exists() {
        let said = || {
            let outputs = fs::read_dir(bench.path("many/cluster")).unwrap();
            let texts =
                outputs.map(|entry| fs::read_to_string(entry.unwrap().path()).unwrap_or_default());
            texts.collect::<Vec<_>>().join("\n--\n")
        };
        assert!(elapsed(&begun) < LONGEST, "{}\n{}", slurm.run("squeue", &[]), said());
        slurm.hurry();
        std::thread::sleep(Duration::from_millis(200));
    }
    let status = expect(0, &["cluster", "status", "many"]);
    assert!(status.out.contains("3 of 3 (100 %)") && status.out.contains("complete"), "{status}");
    let left_away = ["items.json", "cluster"];
    // A ghost of the dead node may still be flying.
    let whole = |folder| {
        let mut files = files(&bench.path(folder), &left_away);
        files.retain(|name, _| !name.contains("/.partial-") && !name.starts_with("work/"));
        files
    };
    assert_same(&whole("one"), &whole("many"));
}
