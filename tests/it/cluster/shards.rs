//! Shards make what one process makes, whatever their number and order.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::cli::support::{Bench, SHORT, contents};
use crate::study::support::SMALL;

/// Blind flights that hide nothing from three by three drones: the shortest that there are.
pub(super) const BLIND: &[&str] = &[
    "blind",
    "--seed",
    "7",
    "--tuning",
    "--grid",
    "3",
    "--protocol",
    "paper",
    "--base",
    "airsim",
    "--air",
    "calm",
    "--effects",
    "none",
];

/// Files below a folder by their paths from there, without `left_away`.
pub(super) fn files(folder: &Path, left_away: &[&str]) -> BTreeMap<String, Vec<u8>> {
    let all = contents(folder).into_iter().map(|(path, bytes)| {
        (path.strip_prefix(folder).unwrap().to_string_lossy().into_owned(), bytes)
    });
    all.filter(|(path, _)| !left_away.iter().any(|other| path.starts_with(other))).collect()
}

/// That both folders have the same files with the same bytes.
pub(super) fn assert_same(one: &BTreeMap<String, Vec<u8>>, other: &BTreeMap<String, Vec<u8>>) {
    let names = |files: &BTreeMap<String, Vec<u8>>| files.keys().cloned().collect::<Vec<_>>();
    assert_eq!(names(one), names(other));
    let differ: Vec<_> = one
        .iter()
        .filter(|(name, bytes)| other.get(*name) != Some(bytes))
        .map(|(name, _)| name)
        .collect();
    assert!(differ.is_empty(), "{differ:?}");
}

#[test]
fn shards_of_a_study_make_the_study() {
    let bench = Bench::new();
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    bench.expect(0, &["sweep", "small.toml", "-o", "one"]);
    let of_one = files(&bench.path("one"), &["items.json", "report"]);
    assert!(of_one.contains_key("study.json"));
    for shards in [2, 5, 12] {
        let folder = format!("many-{shards}");
        let sweep = ["sweep", "small.toml", "-o", &folder];
        // From the last to the first: the order of arrival is nobody's.
        for shard in (1..=shards).rev() {
            let shard = format!("{shard}/{shards}");
            bench.expect(0, &[&sweep[..], &["--shard", &shard]].concat());
        }
        let gathered = bench.expect(0, &[&sweep[..], &["--no-fly"]].concat());
        assert!(gathered.err.contains("9 of 9 flights are there already"), "{gathered}");
        assert_same(&of_one, &files(&bench.path(&folder), &["items.json", "report"]));
    }
}

#[test]
fn what_is_missing_is_named_and_nothing_is_made() {
    let bench = Bench::new();
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    let sweep = ["sweep", "small.toml", "-o", "study"];
    let shard = bench.expect(0, &[&sweep[..], &["--shard", "2/3", "--json"]].concat());
    let said = shard.json("updraft.shard/1");
    assert_eq!((&said["items"], &said["made"], &said["there"]), (&3.into(), &3.into(), &0.into()));
    let missing = bench.expect(3, &[&sweep[..], &["--no-fly"]].concat());
    insta::assert_snapshot!("missing_cells", missing.err);
    assert!(!bench.path("study/study.json").exists());
    bench.expect(0, &[&sweep[..], &["--no-fly", "--shard", "2/3"]].concat());
    let missing = bench.expect(3, &[&sweep[..], &["--no-fly", "--shard", "1/3"]].concat());
    assert!(missing.err.contains("3 of 3 cells of the study missing: "), "{missing}");
}

#[test]
fn shards_of_a_simulation_make_its_logs() {
    let bench = Bench::new();
    for campaign in ["one", "many"] {
        bench.expect(
            0,
            &[&["plan", "calibration", "--grid", "2x2", "-o", campaign], SHORT].concat(),
        );
    }
    let simulate = |campaign| ["simulate", campaign, "--truth", "--seed", "5"];
    bench.expect(0, &simulate("one"));
    for shard in ["3/3", "1/3"] {
        bench.expect(0, &[&simulate("many")[..], &["--shard", shard]].concat());
    }
    let missing = bench.expect(3, &[&simulate("many")[..], &["--no-fly"]].concat());
    insta::assert_snapshot!("missing_logs", missing.err);
    let other = bench.expect(2, &["simulate", "many", "--seed", "6", "--shard", "2/3"]);
    assert!(other.err.contains("holds logs flown with other settings"), "{other}");
    bench.expect(2, &[&simulate("many")[..], &["--shard", "2/3", "--force"]].concat());
    bench.expect(0, &[&simulate("many")[..], &["--shard", "2/3"]].concat());
    bench.expect(0, &[&simulate("many")[..], &["--no-fly"]].concat());
    assert_same(&files(&bench.path("one"), &[]), &files(&bench.path("many"), &[]));
}

#[test]
fn shards_of_many_analyses_make_each() {
    let bench = Bench::new();
    let campaigns = ["a", "b", "c"];
    for (campaign, seed) in campaigns.iter().zip(["1", "2", "3"]) {
        bench.expect(
            0,
            &[&["plan", "calibration", "--grid", "1x2", "-o", campaign], SHORT].concat(),
        );
        bench.expect(0, &["simulate", campaign, "--seed", seed]);
    }
    let each = [&["analyze", "--each"][..], &campaigns].concat();
    let refused = bench.expect(2, &["analyze", "a", "--shard", "1/2"]);
    assert!(refused.err.contains("give --each"), "{refused}");
    bench.expect(0, &[&each[..], &["--shard", "2/2"]].concat());
    assert!(bench.path("b/report/index.html").exists() && !bench.path("a/analysis.json").exists());
    let missing = bench.expect(3, &[&each[..], &["--no-fly"]].concat());
    assert!(missing.err.contains("2 of 3 analyses missing: a, c"), "{missing}");
    bench.expect(0, &[&each[..], &["--shard", "1/2"]].concat());
    let gathered = bench.expect(0, &[&each[..], &["--no-fly", "--json"]].concat());
    let said = gathered.json("updraft.analyze-each/1");
    assert!(
        said["campaigns"].as_array().unwrap().iter().all(|one| one["was_there"] == true),
        "{gathered}"
    );
    // As each alone.
    let analysis = fs::read(bench.path("b/analysis.json")).unwrap();
    bench.expect(0, &["analyze", "b"]);
    assert_eq!(fs::read(bench.path("b/analysis.json")).unwrap(), analysis);
    // Its page tells of another command now. What is not as it was written is made again.
    let again = bench.expect(0, &each);
    assert!(again.err.contains("2 of them before"), "{again}");
    fs::write(bench.path("a/analysis.json"), b"{").unwrap();
    fs::remove_file(bench.path("c/report/index.html")).unwrap();
    let missing = bench.expect(3, &[&each[..], &["--no-fly"]].concat());
    assert!(missing.err.contains("2 of 3 analyses missing: a, c"), "{missing}");
    bench.expect(0, &[&each[..], &["--shard", "1/1"]].concat());
    // A log that has changed is analysed again, and one that cannot be read costs its campaign alone. The losses are named,
    // and the shard is complete all the same.
    fs::write(bench.path("a/simulated/01.BIN"), b"no log").unwrap();
    let shard = bench.expect(0, &[&each[..], &["--shard", "1/3"]].concat());
    assert!(shard.err.contains("a: calibration: slot 1: its log is not used"), "{shard}");
    let again = bench.expect(3, &each);
    assert!(again.err.contains("3 of them before"), "{again}");
}

#[test]
fn shards_of_a_blind_table_make_the_table() {
    let bench = Bench::new();
    let blind = |rest: &[&str]| {
        [BLIND, &["--flights", "2"], rest]
            .concat()
            .iter()
            .map(|word| (*word).to_owned())
            .collect::<Vec<_>>()
    };
    let expect = |code, rest: &[&str]| {
        let words = blind(rest);
        bench.expect(code, &words.iter().map(String::as_str).collect::<Vec<_>>())
    };
    expect(0, &["-o", "one"]);
    expect(0, &["-o", "many", "--shard", "2/3", "--scratch", "scratch"]);
    let missing = expect(3, &["-o", "many", "--no-fly"]);
    insta::assert_snapshot!("missing_flights", missing.err);
    assert!(!bench.path("many/table.json").exists());
    let other = expect(2, &["-o", "many", "--shard", "1/3", "--pairs"]);
    assert!(
        other.err.contains("many has items of other settings (made with `updraft blind"),
        "{other}"
    );
    // A result that was cut short is missing.
    fs::write(bench.path("many/flights/00001.json"), "{\"schema\"").unwrap();
    let missing = expect(3, &["-o", "many", "--no-fly"]);
    assert!(missing.err.contains("2 of 2 blind flights missing: 0, 1"), "{missing}");
    // Another number of shards takes what is there.
    expect(0, &["-o", "many", "--shard", "1/2"]);
    expect(0, &["-o", "many", "--shard", "2/2"]);
    expect(0, &["-o", "many", "--no-fly"]);
    assert_same(
        &files(&bench.path("one"), &["items.json"]),
        &files(&bench.path("many"), &["items.json"]),
    );
}

#[test]
fn a_task_of_an_array_finds_its_shard() {
    let bench = Bench::new();
    fs::write(bench.path("small.toml"), SMALL).unwrap();
    let sweep = ["sweep", "small.toml", "-o", "study", "--shard", "slurm"];
    let outside = bench.expect(2, &sweep);
    assert!(outside.err.contains("SLURM_ARRAY_TASK_ID is not set"), "{outside}");
    let output = bench
        .command(&sweep)
        .envs([("SLURM_ARRAY_TASK_ID", "2"), ("SLURM_ARRAY_TASK_COUNT", "3")])
        .envs([("SLURM_ARRAY_TASK_MIN", "1"), ("SLURM_ARRAY_TASK_MAX", "3")])
        .envs([("SLURM_JOB_ID", "77"), ("SLURM_CPUS_PER_TASK", "1")])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("Shard 2/3: 3 flights complete, 3 of them made now"), "{said}");
}
