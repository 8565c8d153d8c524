//! Processes in one folder of a file system without locks, killed at random: nothing is lost, nothing double.

#![expect(clippy::print_stderr, reason = "says why it is skipped")]

use std::fs;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use super::shards::{assert_same, files};
use crate::cli::support::Bench;
use crate::study::support::SMALL;

/// A library that takes the locks of files away: `flock` and `fcntl` locks succeed and lock nothing, as on
/// network file systems that are mounted so.
const NO_LOCKS: &str =
    "int flock(int file, int operation) { (void)file; (void)operation; return 0; }\n";

/// Builds it; `None`: there is no C compiler.
fn no_locks(bench: &Bench) -> Option<PathBuf> {
    let (source, library) = (bench.path("nolocks.c"), bench.path("nolocks.so"));
    fs::write(&source, NO_LOCKS).unwrap();
    let built =
        Command::new("cc").args(["-shared", "-fPIC", "-o"]).args([&library, &source]).status();
    built.is_ok_and(|status| status.success()).then_some(library)
}

/// Numbers that are the same in each run of the test.
struct Dice(u64);

impl Dice {
    fn below(&mut self, bound: u64) -> u64 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % bound
    }
}

/// Runs copies of shards until all are complete, killing some of them after a random time.
fn storm(bench: &Bench, command: &[&str], longest_ms: u64) {
    let Some(library) = no_locks(bench) else {
        eprintln!("skipped: no C compiler to take locks away with");
        return;
    };
    let start = |shard: &str| -> Child {
        bench
            .command(&[command, &["--shard", shard, "-j", "1"]].concat())
            .env("LD_PRELOAD", &library)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap()
    };
    let mut dice = Dice(7);
    // Ghosts and requeued tasks: two copies of each shard at once, and one of two is killed.
    for _round in 0..4 {
        let mut all: Vec<Child> =
            ["1/2", "2/2", "1/2", "2/2", "1/3"].iter().map(|shard| start(shard)).collect();
        std::thread::sleep(Duration::from_millis(dice.below(longest_ms)));
        for child in &mut all {
            if dice.below(3) > 0 {
                child.kill().unwrap();
            } else {
                std::thread::sleep(Duration::from_millis(dice.below(longest_ms / 4)));
                child.kill().unwrap();
            }
            child.wait().unwrap();
        }
    }
    for shard in ["1/2", "2/2"] {
        assert!(start(shard).wait().unwrap().success());
    }
}

#[test]
fn killed_shards_of_a_study_leave_the_study() {
    let bench = Bench::new();
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    let sweep = |folder| ["sweep", "small.toml", "-o", folder];
    bench.expect(0, &sweep("one"));
    storm(&bench, &sweep("many"), 800);
    let merged = bench.expect(0, &[&sweep("many")[..], &["--no-fly"]].concat());
    assert!(merged.err.contains("9 of 9"), "{merged}");
    assert_same(
        &files(&bench.path("one"), &["items.json", "report"]),
        &files(&bench.path("many"), &["items.json", "report"]),
    );
}

#[test]
fn a_shard_that_is_told_to_end_ends_with_what_is_finished() {
    let bench = Bench::new();
    let sweep = ["sweep", "-o", "study", "--shard", "1/1", "-j", "1"];
    let mut child =
        bench.command(&sweep).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let cells = bench.path("study/cells");
    while !cells.is_dir() || fs::read_dir(&cells).unwrap().count() < 3 {
        std::thread::sleep(Duration::from_millis(20));
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-TERM", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let left = files(&cells, &[]);
    assert!(left.keys().all(|name| !name.starts_with(".partial-")), "{:?}", left.keys());
    assert!(left.len() < 143);
}
