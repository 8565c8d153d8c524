//! `updraft analyze`: losses are named, nothing is invented.

use std::fs;

use insta::assert_snapshot;

use crate::cli::support::{Bench, SHORT, contents};

#[test]
fn a_campaign_becomes_laws_and_a_report() {
    let bench = Bench::new();
    bench.fly();
    let analysed = bench.expect(0, &["analyze", "campaign"]);
    assert!(analysed.err.contains("Analysed 2 logs in "), "{analysed}");
    assert!(analysed.err.ends_with(" -> campaign/report/index.html\n"), "{analysed}");
    assert!(!analysed.out.contains('\u{1b}'), "no colours into a pipe");
    assert!(bench.path("campaign/analysis.json").is_file());

    assert!(!bench.path("campaign/fields").exists(), "a calibration has no fields");
    let page = fs::read_to_string(bench.path("campaign/report/index.html")).unwrap();
    for input in ["plan.json", "vehicle.toml", "flight.json"] {
        assert!(page.contains(input), "{input} is an input, with its hash");
    }

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
fn an_estimate_without_errors_has_no_share_of_values_inside_of_them() {
    let bench = Bench::new();
    let run = ["run", "--direct", "--no-study", "--quiet", "--grid", "2x2", "--duration", "40"];
    bench.expect(0, &[&run[..], &["-o", "flown"], SHORT].concat());
    let truth = |more: &[&str]| {
        let args = [&["analyze", "flown", "--json", "--quiet"][..], more].concat();
        let found = bench.expect(0, &args).json("updraft.analyze/1");
        found["analysis"]["flights"][1]["map"]["truth"].clone()
    };
    let with_errors = truth(&["--no-report"]);
    assert!(with_errors["inside_share"].is_number(), "{with_errors}");
    let plain = truth(&["--plain"]);
    assert!(plain["rms_mps"].is_number() && plain["inside_share"].is_null(), "{plain}");
    let page = fs::read_to_string(bench.path("flown/report/index.html")).unwrap();
    assert!(page.contains("root mean square") && !page.contains("errors are too small"));
}

#[test]
fn figures_of_an_earlier_analysis_go_and_those_of_others_stay() {
    let bench = Bench::new();
    let run = ["run", "--direct", "--no-study", "--quiet", "--grid", "2x2", "--duration", "40"];
    bench.expect(0, &[&run[..], &["-o", "flown"], SHORT].concat());
    bench.expect(0, &["analyze", "flown", "-o", "out", "--quiet"]);
    let figure = |name: &str| bench.path("out/report/figures").join(name);
    assert!(figure("map-hover.svg").is_file() && figure("fig2-laws.svg").is_file());
    fs::write(figure("sketch.svg"), "<svg xmlns=\"http://www.w3.org/2000/svg\"/>").unwrap();
    fs::write(figure("notes.txt"), "mine").unwrap();
    bench.expect(0, &["analyze", "flown/calibration", "-o", "out", "--quiet"]);
    let page = fs::read_to_string(bench.path("out/report/index.html")).unwrap();
    let mut left = Vec::new();
    for entry in fs::read_dir(bench.path("out/report/figures")).unwrap() {
        left.push(entry.unwrap().file_name().into_string().unwrap());
    }
    assert!(left.contains(&"sketch.svg".to_owned()) && left.contains(&"notes.txt".to_owned()));
    let drawn: Vec<&String> = left.iter().filter(|name| name.starts_with("fig")).collect();
    assert!(!drawn.is_empty() && !left.iter().any(|name| name.contains("hover")), "{left:?}");
    for name in drawn {
        assert!(page.contains(name.trim_end_matches(".svg")), "{name}");
    }
}

#[test]
fn where_a_file_is_in_the_way_nothing_is_written() {
    let bench = Bench::new();
    bench.fly();
    for (place, file) in [("one", "report"), ("two", "fields"), ("three", "report/figures")] {
        let path = bench.path(place).join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, "in the way").unwrap();
        let ended = bench.expect(1, &["analyze", "campaign", "-o", place, "--quiet"]);
        let told = format!("failed to write into {place}/{file}");
        assert!(ended.err.contains(&told), "{ended}");
        assert!(!bench.path(place).join("analysis.json").exists());
    }
}

#[test]
fn a_study_that_cannot_be_read_is_told_and_left_out() {
    let bench = Bench::new();
    bench.fly();
    fs::create_dir(bench.path("campaign/study")).unwrap();
    let study = bench.path("campaign/study/study.json");
    fs::write(&study, "{\"schema\": ").unwrap();
    let broken = bench.expect(0, &["analyze", "campaign"]);
    assert!(broken.err.contains("does without Fig. 2 and Table I"), "{broken}");
    assert!(broken.err.contains("study.json is not valid"), "{broken}");
}

#[test]
fn a_missing_log_is_a_loss_that_is_named() {
    let bench = Bench::new();
    bench.fly();
    fs::remove_file(bench.path("campaign/simulated/02.BIN")).unwrap();
    let analysed = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    assert!(analysed.out.contains("02.BIN") || analysed.out.contains("Drone 2"), "{analysed}");
}

#[test]
fn an_unfinished_log_is_never_analysed() {
    let bench = Bench::new();
    bench.fly();
    // Legs of 6 s are too short to be found without the plan: nothing is a result of its own.
    let clean = bench.expect(5, &["analyze", "campaign/simulated", "--no-report"]);
    let log = fs::read(bench.path("campaign/simulated/01.BIN")).unwrap();
    fs::write(bench.path("campaign/simulated/.partial-x1.BIN"), &log[..log.len() / 2]).unwrap();
    let analysed = bench.expect(5, &["analyze", "campaign/simulated", "--no-report"]);
    assert_eq!(analysed.out, clean.out);
    assert!(analysed.err.contains("Analysed 2 logs in "), "{analysed}");
}

#[test]
fn one_log_needs_no_plan() {
    let bench = Bench::new();
    bench.fly();
    // Legs of 6 s are too short to be told from transfers: that is said, and is no success.
    let one = bench.expect(5, &["analyze", "campaign/simulated/01.BIN", "--no-report"]);
    assert!(one.out.contains("No ladder and no hover found"), "{one}");
    assert!(one.err.contains("Analysed 1 log in "), "{one}");
    let planned = ["analyze", "campaign/simulated", "--plan", "campaign", "-o", "out"];
    bench.expect(0, &planned);
    assert!(bench.path("out/report/index.html").is_file());
    for plan in ["campaign/plan.json", "campaign/show.skyc"] {
        bench.expect(0, &["analyze", "campaign/simulated", "--plan", plan, "--no-report"]);
    }
    bench.expect(2, &["analyze", "campaign/simulated", "--plan", "out/analysis.json"]);
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
    let words = "empty holds no .BIN logs: give a campaign, or the folder that contains them";
    assert_eq!(empty.err, format!("error: {words}\n"));
    assert_eq!(contents(&bench.path("campaign")), before);
    let missing = bench.run(&["analyze", "not-there"]);
    assert!(matches!(missing.code, Some(1 | 2 | 5)), "{missing}");
    assert!(missing.err.contains("not-there"), "{missing}");
}

#[test]
fn nothing_found_is_no_success() {
    let bench = Bench::new();
    let hover = ["plan", "hover", "--grid", "1x1", "--duration", "30", "--height", "20"];
    bench.expect(0, &[&hover[..], &["-o", "campaign"]].concat());
    bench.expect(0, &["simulate", "campaign"]);
    let analysed = bench.expect(5, &["analyze", "campaign"]);
    assert!(analysed.out.contains("No calibration"), "{analysed}");
    // The page says so too, but it is not offered as something to read.
    assert!(!analysed.err.contains("index.html"), "{analysed}");
    assert!(analysed.err.contains(": nothing found\nerror: no results: no law"), "{analysed}");
    assert_eq!(bench.expect(5, &["analyze", "campaign", "--quiet"]).out, "");
    let failed = bench.expect(5, &["analyze", "campaign", "--json"]);
    assert_eq!(failed.out, "", "as of every command that fails");
    let error: serde_json::Value =
        serde_json::from_str(failed.err.lines().last().unwrap()).unwrap();
    assert_eq!((&error["schema"], &error["exit"]), (&"updraft.error/1".into(), &5.into()));
    assert_snapshot!(serde_json::to_string_pretty(&error).unwrap());
    let page = fs::read_to_string(bench.path("campaign/report/index.html")).unwrap();
    assert!(page.contains("No calibration") && !page.contains("<svg"), "no empty figures");
}

/// Map values and their stated uncertainty: (value, two standard errors and the systematic error).
fn map_of(ended: &crate::cli::support::Ended) -> Vec<(f64, f64)> {
    let value = ended.json("updraft.analyze/1");
    let drones = value["analysis"]["flights"][1]["map"]["drones"].as_array().unwrap().clone();
    let number = |drone: &serde_json::Value, path: &str| drone.pointer(path).unwrap().as_f64();
    drones
        .iter()
        .map(|drone| {
            let stated = 2.0 * number(drone, "/mean/se").unwrap()
                + number(drone, "/systematic_mps").unwrap();
            (number(drone, "/mean/value").unwrap(), stated)
        })
        .collect()
}

#[test]
fn wind_biases_the_map_by_less_than_is_stated() {
    let bench = Bench::new();
    for (calibration, hover) in [("0", "0"), ("0", "5"), ("0", "10"), ("10", "10"), ("10", "0")] {
        let wind = ["--calibration-wind", calibration, "--wind", hover];
        let flown =
            ["run", "--grid", "1x1", "--duration", "40", "--speeds", "1,2,3", "--leg", "15"];
        let place = [
            "--updraft",
            "1",
            "-o",
            "campaign",
            "--force",
            "--quiet",
            "--vehicle",
            "airsim-generic-quad",
            "--air",
            "still",
            "--no-study",
        ];
        bench.expect(0, &[&flown[..], &wind, &place].concat());
        for corrected in [true, false] {
            let mut words = vec!["analyze", "campaign", "--no-report", "--json", "--quiet"];
            words.extend((!corrected).then_some("--no-wind"));
            let ended = bench.expect(0, &words);
            let (value, stated) = map_of(&ended)[0];
            println!("wind {calibration}, {hover}, corrected {corrected}: {value} ± {stated}");
            assert!((value - 1.0).abs() < stated, "{value} ± {stated}");
            if corrected {
                // Six legs of one drone: the law that knows of slow air cannot claim more.
                assert!((value - 1.0).abs() < 0.06 && stated < 2.0, "{value} ± {stated}");
            } else if hover == "10" {
                assert!(ended.out.contains("wind: the drones leaned 4"), "{ended}");
            }
        }
    }
}
