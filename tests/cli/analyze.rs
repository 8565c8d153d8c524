//! `updraft analyze`: losses are named, nothing is invented.

use std::fs;

use crate::support::{Bench, contents};

#[test]
fn a_campaign_becomes_laws_and_a_report() {
    let bench = Bench::new();
    bench.fly();
    let analysed = bench.expect(0, &["analyze", "campaign"]);
    assert!(analysed.err.starts_with("Analysed 2 logs in "), "{analysed}");
    assert!(analysed.err.ends_with(" -> campaign/report/index.html\n"), "{analysed}");
    assert!(!analysed.out.contains('\u{1b}'), "no colours into a pipe");
    assert!(bench.path("campaign/analysis.json").is_file());

    let coloured = bench.expect(0, &["analyze", "campaign", "--no-report", "--color", "always"]);
    assert!(coloured.out.contains('\u{1b}'));
    let mut plain = bench.command(&["analyze", "campaign", "--no-report"]);
    let plain = plain.env("NO_COLOR", "1").output().unwrap();
    assert!(!plain.stdout.contains(&0x1b));

    let json = bench.expect(0, &["analyze", "campaign", "--no-report", "--json", "--quiet"]);
    assert!(json.err.is_empty(), "{json}");
    let value = json.json("updraft.analyze/1");
    assert_eq!(value["analysis"]["flights"][0]["drones"].as_array().unwrap().len(), 2);
    assert!(value["report"].is_null());
}

#[test]
fn a_missing_log_is_a_loss_that_is_named() {
    let bench = Bench::new();
    bench.fly();
    fs::remove_file(bench.path("campaign/logs/02.BIN")).unwrap();
    let analysed = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    assert!(analysed.out.contains("02.BIN") || analysed.out.contains("Drone 2"), "{analysed}");
}

#[test]
fn an_unfinished_log_is_never_analysed() {
    let bench = Bench::new();
    bench.fly();
    let clean = bench.expect(0, &["analyze", "campaign/logs", "--no-report"]);
    let log = fs::read(bench.path("campaign/logs/01.BIN")).unwrap();
    fs::write(bench.path("campaign/logs/.partial-x1.BIN"), &log[..log.len() / 2]).unwrap();
    let analysed = bench.expect(0, &["analyze", "campaign/logs", "--no-report"]);
    assert_eq!(analysed.out, clean.out);
    assert!(analysed.err.starts_with("Analysed 2 logs in "), "{analysed}");
}

#[test]
fn one_log_needs_no_plan() {
    let bench = Bench::new();
    bench.fly();
    let one = bench.expect(0, &["analyze", "campaign/logs/01.BIN", "--no-report"]);
    assert!(one.err.starts_with("Analysed 1 log in "), "{one}");
    let planned = ["analyze", "campaign/logs", "--plan", "campaign", "-o", "out"];
    bench.expect(0, &planned);
    assert!(bench.path("out/report/index.html").is_file());
    for plan in ["campaign/plan.json", "campaign/show.skyc"] {
        bench.expect(0, &["analyze", "campaign/logs", "--plan", plan, "--no-report"]);
    }
    bench.expect(2, &["analyze", "campaign/logs", "--plan", "out/analysis.json"]);
}

#[test]
fn nothing_to_work_on() {
    let bench = Bench::new();
    bench.plan();
    let before = contents(&bench.path("campaign"));
    let planned = bench.expect(5, &["analyze", "campaign"]);
    assert_eq!(planned.err.matches("error").count(), 1, "{planned}");
    fs::create_dir(bench.path("empty")).unwrap();
    let empty = bench.expect(5, &["analyze", "empty"]);
    assert_eq!(empty.err, "error: empty holds no .BIN logs\n");
    assert_eq!(contents(&bench.path("campaign")), before);
    let missing = bench.run(&["analyze", "not-there"]);
    assert!(matches!(missing.code, Some(1 | 2 | 5)), "{missing}");
    assert!(missing.err.contains("not-there"), "{missing}");
}
