//! Words that were wrong once: the site that nobody gave, a plan without its shows, one cause told for
//! each drone.

use std::fs;

use crate::cli::support::{Bench, SHORT};

#[test]
fn a_site_that_was_not_given_is_said_first() {
    let bench = Bench::new();
    let planned = |more: &[&str]| {
        let args = ["plan", "calibration", "--grid", "1x2", "--dry-run"];
        let out = bench.expect(0, &[&args[..], SHORT, more].concat()).out;
        out.split("\n\n").next().unwrap().replace('\n', " ")
    };
    let head = planned(&[]);
    assert!(head.contains("THE SITE WAS NOT GIVEN"), "{head}");
    assert!(head.contains("a field in Hungary"), "{head}");
    let head = planned(&["--origin", "52.1,8.3"]);
    assert!(!head.contains("NOT GIVEN"), "{head}");
    assert!(
        head.contains("the height of the ground there is NOT KNOWN: 190 m are assumed"),
        "{head}"
    );
    for given in [
        &["--origin", "52.1,8.3", "--ground", "70"][..],
        &["--set", "site.origin=[52.1, 8.3]", "--set", "site.ground_amsl_m=70"],
        &["--origin", "47.4733,19.0621"],
    ] {
        let head = planned(given);
        assert!(!head.contains("NOT GIVEN") && !head.contains("NOT KNOWN"), "{given:?}: {head}");
    }
}

#[test]
fn an_assumed_ground_goes_with_the_plan_and_not_into_the_show() {
    let bench = Bench::new();
    let args = ["plan", "calibration", "--grid", "1x2", "--origin", "52.1,8.3", "-o", "campaign"];
    bench.expect(0, &[&args[..], SHORT].concat());
    let plan = fs::read_to_string(bench.path("campaign/plan.json")).unwrap();
    assert!(plan.contains("\"ground_assumed\": true"), "{plan}");
    // Planned again from the template beside it, the plan is the same.
    bench.expect(0, &["plan", "campaign/template.toml", "-o", "again"]);
    assert_eq!(fs::read_to_string(bench.path("again/plan.json")).unwrap(), plan);
    let seen = bench.expect(0, &["inspect", "campaign/show.skyc"]);
    assert!(!seen.out.contains("190"), "{seen}");
}

#[test]
fn a_folder_with_a_plan_alone_is_a_plan() {
    let bench = Bench::new();
    bench.fly();
    fs::create_dir(bench.path("flown")).unwrap();
    fs::copy(bench.path("campaign/plan.json"), bench.path("flown/plan.json")).unwrap();
    let with = |plan: &str| {
        let args = ["analyze", "campaign/simulated", "--no-report", "--json", "--plan", plan];
        bench.expect(0, &args).json("updraft.analyze/1")
    };
    assert_eq!(with("flown"), with("campaign/plan.json"));
}

#[test]
fn a_folder_keeps_its_whole_name() {
    let bench = Bench::new();
    bench.fly();
    fs::rename(bench.path("campaign/simulated"), bench.path("arducopter-4.4")).unwrap();
    let args = ["analyze", "arducopter-4.4", "--plan", "campaign", "--json"];
    let analysed = bench.expect(0, &args).json("updraft.analyze/1");
    assert_eq!(analysed["analysis"]["title"], "arducopter-4.4");
    assert!(bench.path("arducopter-4.4-analysis/analysis.json").is_file());
}

#[test]
fn one_cause_is_one_line_and_quiet_losses_have_their_reason() {
    let bench = Bench::new();
    let four = ["plan", "calibration", "--grid", "2x2", "-o", "campaign"];
    bench.expect(0, &[&four[..], SHORT].concat());
    bench.expect(0, &["simulate", "campaign", "--quiet"]);
    // All but one were switched off in the air.
    for slot in 2..=4 {
        let path = bench.path(&format!("campaign/simulated/{slot:02}.BIN"));
        let log = fs::read(&path).unwrap();
        fs::write(&path, &log[..log.len() * 2 / 3]).unwrap();
    }
    fs::remove_file(bench.path("campaign/simulated/flight.json")).unwrap();
    let analysed = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    assert_eq!(analysed.out.matches("ends in the air").count(), 1, "{analysed}");
    assert!(analysed.out.contains("Logs partly used (3)"), "{analysed}");
    assert!(analysed.out.contains("- slots 2-4: the log ends in the air, "), "{analysed}");
    for words in [&["--quiet"][..], &["--json"]] {
        let args = [&["analyze", "campaign", "--no-report"], words].concat();
        let quiet = bench.expect(3, &args);
        assert!(quiet.err.contains("slots 2-4: the log ends in the air, "), "{quiet}");
    }
}

#[test]
fn every_drone_in_counter_phase_is_told_of_its_design_once() {
    let bench = Bench::new();
    let args = ["plan", "calibration-counterphase", "--dry-run", "--json"];
    let planned = bench.expect(0, &args);
    assert!(planned.err.lines().count() <= 8, "{}", planned.err);
    assert_eq!(planned.err.matches("[low-flight]").count(), 1, "{}", planned.err);
    let value = planned.json("updraft.plan-output/1");
    let findings = value["flights"][0]["check"]["findings"].as_array().unwrap();
    let low: Vec<_> = findings.iter().filter(|found| found["check"] == "low-flight").collect();
    assert_eq!(low.len(), 1);
    assert_eq!(low[0]["drones"].as_array().unwrap().len(), 49, "all of them are named");
    // A defect of one drone is still its own.
    let near = bench.expect(4, &[&args[..], &["--spacing", "2.5"]].concat());
    assert!(near.err.contains("error[distance] drones 1-49, "), "{}", near.err);
}
