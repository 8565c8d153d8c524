//! `updraft plan` and `updraft check`.

use std::fs;

use crate::cli::support::{Bench, SHORT, contents};

#[test]
fn a_plan_is_written_and_safe() {
    let bench = Bench::new();
    let planned = bench.plan();
    assert!(planned.out.starts_with("Calibration speed ladder: 2 drones in 1 x 2, 7 m apart\n"));
    assert!(planned.err.starts_with("Planned calibration for 2 drones in "), "{planned}");
    assert!(planned.err.ends_with(" -> campaign\n"), "{planned}");
    for file in ["plan.json", "show.skyc", "show.csv.zip", "skyb/01.skyb", "skyb/02.skyb"] {
        assert!(bench.path("campaign").join(file).is_file(), "{file}");
    }
    let checked = bench.expect(0, &["check", "campaign"]);
    assert!(checked.out.ends_with("2 drones, 59.0 s: 0 errors, 0 warnings\n"), "{checked}");
    assert!(checked.err.starts_with("Safe: checked in "), "{checked}");
    insta::assert_snapshot!(checked.out);
}

#[test]
fn the_files_of_a_plan_pass_the_check_one_by_one() {
    let bench = Bench::new();
    bench.plan();
    for file in ["show.skyc", "show.csv.zip", "skyb/01.skyb", "skyb"] {
        bench.expect(0, &["check", &format!("campaign/{file}")]);
    }
}

#[test]
fn a_file_that_does_not_fly_the_plan_is_named() {
    let bench = Bench::new();
    bench.plan();
    fs::copy(bench.path("campaign/skyb/01.skyb"), bench.path("campaign/skyb/02.skyb")).unwrap();
    let checked = bench.expect(4, &["check", "campaign"]);
    assert!(
        checked.out.contains("error: campaign/skyb/02.skyb does not fly the plan: "),
        "{checked}"
    );
}

#[test]
fn drones_too_near_are_not_written() {
    let bench = Bench::new();
    let args = ["plan", "calibration", "--grid", "1x2", "--spacing", "1", "-o", "near"];
    let planned = bench.expect(4, &[&args[..], SHORT].concat());
    let error = planned.err.lines().next().unwrap();
    for part in ["error[distance] Drone 1 and Drone 2 at ", " s: ", "1.000 m", "limit 3.000 m"] {
        assert!(error.contains(part), "{part}: {error}");
    }
    assert_eq!(planned.err.matches("error").count(), 1, "each error once: {planned}");
    assert!(planned.err.ends_with("Nothing was written: the show is not safe as it is\n"));
    assert!(!bench.path("near").exists());

    let quiet = bench.expect(4, &[&args[..], SHORT, &["--quiet"]].concat());
    assert!(quiet.err.starts_with("error[distance]"), "quiet says what went wrong: {quiet}");

    let ran = bench.expect(4, &["run", "--grid", "1x2", "--spacing", "1", "-o", "near"]);
    assert!(ran.err.ends_with("Nothing was flown: the show is not safe as it is\n"), "{ran}");
    assert!(!bench.path("near").exists());

    let allowed = bench.expect(0, &[&args[..], SHORT, &["--allow", "distance"]].concat());
    assert!(allowed.err.contains("allowed: error[distance]"), "{allowed}");
    let unknown = bench.expect(2, &[&args[..], SHORT, &["--allow", "nonsense"]].concat());
    assert!(unknown.err.contains("there is no check \"nonsense\"; the checks are "), "{unknown}");
    bench.expect(4, &["check", "near"]);
    bench.expect(0, &["check", "near", "--allow", "distance"]);
}

#[test]
fn a_broken_template_is_pointed_at() {
    let bench = Bench::new();
    bench.plan();
    let template = fs::read_to_string(bench.path("campaign/template.toml")).unwrap();
    fs::write(bench.path("bad.toml"), template.replace("spacing_m", "spacing_n")).unwrap();
    let line = 1 + template.lines().position(|line| line.starts_with("spacing_m")).unwrap();
    let planned = bench.expect(2, &["plan", "bad.toml"]);
    assert!(planned.err.contains(&format!("bad.toml:{line}:1")), "{planned}");
    assert!(planned.err.contains("spacing_n") && planned.err.contains("spacing_m"), "{planned}");
    assert!(planned.out.is_empty());

    let planned = bench.expect(2, &["plan", "no-such-template"]);
    assert!(planned.err.contains("calibration"), "names those there are: {planned}");
    bench.expect(2, &["plan", "calibration", "--set", "grid.spacing_m=wide"]);
    bench.expect(2, &["plan", "calibration", "--spacing", "-1"]);
}

#[test]
fn a_dry_run_writes_nothing() {
    let bench = Bench::new();
    let planned = bench.expect(0, &["plan", "campaign", "--grid", "2x2", "--dry-run"]);
    assert!(planned.out.contains("Hover measurement: 4 drones"), "{planned}");
    assert_eq!(planned.err, "Would write campaign\n");
    assert!(contents(&bench.path("")).is_empty());
}

#[test]
fn a_campaign_names_its_flights() {
    let bench = Bench::new();
    let planned = bench.expect(0, &["plan", "campaign", "--grid", "1x1", "-o", "both"]);
    assert!(planned.err.starts_with("Planned calibration and hover for 1 drone in "), "{planned}");
    bench.expect(0, &["check", "both"]);
    bench.expect(0, &["check", "both/hover"]);
}

#[test]
fn the_same_plan_may_be_written_again_but_no_other() {
    let bench = Bench::new();
    bench.plan();
    let before = contents(&bench.path("campaign"));
    fs::write(bench.path("campaign/.partial-left"), b"half").unwrap();
    bench.plan();
    assert_eq!(contents(&bench.path("campaign")), before, "swept and the same");

    let resolved = ["plan", "campaign/template.toml", "-o", "campaign"];
    bench.expect(0, &resolved);
    assert_eq!(contents(&bench.path("campaign")), before, "the resolved template is the same plan");

    let other = ["plan", "hover", "--grid", "1x1", "-o", "campaign"];
    let refused = bench.expect(2, &other);
    assert_eq!(
        refused.err,
        "error: campaign already holds another plan; choose another folder or give --force\n"
    );
    bench.expect(2, &["plan", "campaign", "--grid", "1x1", "-o", "campaign"]);
    assert_eq!(contents(&bench.path("campaign")), before);
    bench.expect(0, &[&other[..], &["--force"]].concat());
    assert!(
        !bench.path("campaign/skyb/02.skyb").exists(),
        "nothing is left of the larger fleet that was there"
    );
    bench.expect(0, &["check", "campaign"]);
}

#[test]
fn a_plan_is_never_written_over_logs() {
    let bench = Bench::new();
    bench.fly();
    let before = contents(&bench.path("campaign"));
    let other = ["plan", "hover", "--grid", "1x2", "-o", "campaign"];
    let refused = bench.expect(2, &[&other[..], &["--force"]].concat());
    assert!(refused.err.contains("holds the logs of another plan"), "{refused}");
    assert_eq!(contents(&bench.path("campaign")), before);
    bench.plan();
}

#[test]
fn json_and_quiet() {
    let bench = Bench::new();
    let args = ["plan", "calibration", "--grid", "1x2", "-o", "campaign"];
    let json = bench.expect(0, &[&args[..], SHORT, &["--json", "--quiet"]].concat());
    let value = json.json("updraft.plan-output/1");
    assert_eq!(value["flights"][0]["plan"]["slots"].as_array().unwrap().len(), 2);
    assert!(json.err.is_empty(), "{json}");
    let value = bench.expect(0, &["check", "campaign", "--json"]).json("updraft.check/1");
    assert_eq!(value["safe"], true);
    assert!(bench.expect(0, &["check", "campaign", "-q"]).err.is_empty());
}

#[test]
fn the_timetable_has_no_gaps_where_ramps_are() {
    let bench = Bench::new();
    let args = ["plan", "calibration", "--speeds", "3.5,0.5", "--ramp", "0.5", "--dry-run"];
    let planned = bench.expect(0, &[&args[..], &["--grid", "2x2"]].concat());
    let rows = planned.out.lines().skip_while(|line| !line.contains("segment")).skip(1);
    // Time and duration of every row: each begins where the one before ended.
    let mut end_s: f64 = 0.0;
    let mut ramps = 0;
    for row in rows.take_while(|row| !row.ends_with("  end")) {
        let (minutes, seconds) = row.split_whitespace().next().unwrap().split_once(':').unwrap();
        let start_s = 60.0 * minutes.parse::<f64>().unwrap() + seconds.parse::<f64>().unwrap();
        assert!((start_s - end_s).abs() < 0.3, "{row}\n{planned}");
        let lasts_s: f64 = row[40..].split_whitespace().next().unwrap().parse().unwrap();
        end_s = start_s + lasts_s;
        ramps += usize::from(row.contains("  ramp "));
    }
    assert!(ramps > 8, "{planned}");
    assert!(planned.out.contains("to +3.50"), "{planned}");
    assert!(planned.err.contains("hovers (group all) are too short"), "{planned}");
}

#[test]
#[cfg(unix)]
fn who_reads_only_the_beginning_gets_the_whole_campaign() {
    let bench = Bench::new();
    let program = env!("CARGO_BIN_EXE_updraft");
    let line = format!("'{program}' plan campaign --grid 1x2 -o campaign | head -1");
    let mut shell = std::process::Command::new("sh");
    let ended = shell.args(["-c", &line]).current_dir(bench.path("")).output().unwrap();
    assert!(ended.status.success());
    assert!(
        bench.path("campaign/campaign.json").exists(),
        "the reader has gone, and so has the plan"
    );
}
