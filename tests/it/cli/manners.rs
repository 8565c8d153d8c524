//! Rules that hold for every subcommand: exit codes, `--quiet`, `--json`, numbers, narrow terminals.

use std::fs;

use crate::cli::support::{Bench, Ended, SHORT};

/// One rule: what is not there is 1, what is there but wrong 2, what is right but empty 5.
#[test]
fn exit_codes_follow_one_rule() {
    let bench = Bench::new();
    bench.plan();
    fs::write(bench.path("notes.txt"), "hello\n").unwrap();
    fs::write(bench.path("notes.skyc"), "hello\n").unwrap();
    fs::write(bench.path("notes.toml"), "hello\n").unwrap();
    fs::create_dir(bench.path("empty")).unwrap();
    let table: &[(i32, &[&str])] = &[
        // Not there.
        (1, &["run", "gone.toml"]),
        (1, &["plan", "gone.toml"]),
        (1, &["plan", "folder/gone"]),
        (1, &["plan", "hover", "--vehicle", "gone.toml"]),
        (1, &["check", "gone"]),
        (1, &["check", "gone.skyc"]),
        (1, &["check", "campaign", "--vehicle", "gone.toml"]),
        (1, &["simulate", "gone"]),
        (1, &["simulate", "campaign", "--vehicle", "./gone.toml"]),
        (1, &["physics", "--campaign", "gone"]),
        (1, &["analyze", "gone"]),
        (1, &["analyze", "gone.BIN"]),
        (1, &["compare", "gone", "gone.json"]),
        (1, &["sweep", "gone.toml"]),
        (1, &["inspect", "gone"]),
        (1, &["inspect", "gone.skyc"]),
        (1, &["inspect", "gone.skyb"]),
        (1, &["inspect", "gone.json"]),
        // There, but of the wrong kind or broken.
        (2, &["run", "notes.toml"]),
        (2, &["plan", "notes.toml"]),
        (2, &["plan", "hover", "--vehicle", "notes.toml"]),
        (2, &["check", "notes.txt"]),
        (2, &["check", "notes.skyc"]),
        (2, &["simulate", "notes.txt"]),
        (2, &["physics", "--campaign", "notes.txt"]),
        (2, &["analyze", "notes.txt"]),
        (2, &["compare", "notes.txt", "notes.toml"]),
        (2, &["sweep", "notes.toml"]),
        (2, &["inspect", "notes.txt"]),
        (2, &["inspect", "notes.skyc"]),
        // Wrong words.
        (2, &["run", "dance"]),
        (2, &["plan", "dance"]),
        (2, &["plan", "hover", "--vehicle", "dance"]),
        (2, &["check", "campaign", "--allow", "dance"]),
        (2, &["simulate", "campaign", "--flight", "dance"]),
        (2, &["sweep", "dance"]),
        (2, &["effects", "dance"]),
        // Right, but nothing in it.
        (5, &["check", "empty"]),
        (5, &["simulate", "empty"]),
        (5, &["physics", "--campaign", "empty"]),
        (5, &["analyze", "empty"]),
        (5, &["compare", "empty", "campaign"]),
        (5, &["inspect", "empty"]),
    ];
    let mut wrong = Vec::new();
    for (code, args) in table {
        let ended = bench.run(args);
        let once = ended.err.matches("error: ").count() == 1 && ended.out.is_empty();
        if ended.code != Some(*code) || !once {
            wrong.push(format!("updraft {}: wanted {code}, once\n{ended}", args.join(" ")));
        }
        // The same as JSON: nothing on standard output, one object as the last line of the other.
        let json = bench.run(&[args, &["--json"][..]].concat());
        let last = json.err.lines().last().unwrap_or_default();
        let value: serde_json::Value = serde_json::from_str(last).unwrap_or_default();
        if value["schema"] != "updraft.error/1"
            || value["exit"] != *code
            || json.code != Some(*code)
            || !json.out.is_empty()
        {
            wrong.push(format!("updraft --json {}\n{json}", args.join(" ")));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn wrong_arguments_are_json_too() {
    let bench = Bench::new();
    let ended = bench.expect(2, &["plan", "hover", "--json", "--grid", "7"]);
    let value: serde_json::Value = serde_json::from_str(&ended.err).unwrap();
    assert_eq!(value["schema"], "updraft.error/1");
    assert!(value["error"].as_str().unwrap().contains("7x7"), "{value}");
    assert!(ended.out.is_empty(), "{ended}");
}

#[test]
fn progress_is_switched_off_by_any_value_that_says_so() {
    let bench = Bench::new();
    for value in ["1", "true", "yes", "on", "0", "false", "no", "", "nonsense"] {
        let mut command = bench.command(&["schema", "plan"]);
        let ended = Ended::of(&command.env("UPDRAFT_NO_PROGRESS", value).output().unwrap());
        assert_eq!(ended.code, Some(0), "UPDRAFT_NO_PROGRESS={value}\n{ended}");
    }
    bench.expect(0, &["schema", "plan", "--no-progress"]);
}

/// With `--quiet`: warnings and errors on standard error, the result's path on standard output.
#[test]
fn quiet_prints_the_path_of_the_result_and_what_is_wrong() {
    let bench = Bench::new();
    let quiet = |args: &[&str], out: &str| {
        let ended = bench.expect(0, &[args, &["--quiet"][..]].concat());
        assert_eq!((ended.out.as_str(), ended.err.as_str()), (out, ""), "{args:?}");
    };
    let plan = ["plan", "calibration", "--grid", "1x2", "-o", "campaign"];
    quiet(&[&plan[..], SHORT].concat(), "campaign\n");
    quiet(&[&plan[..], SHORT, &["--dry-run"]].concat(), "");
    quiet(&["check", "campaign"], "");
    quiet(&["simulate", "campaign"], "");
    quiet(&["analyze", "campaign"], "campaign/report/index.html\n");
    quiet(&["analyze", "campaign", "--no-report"], "");
    let run = ["run", "--grid", "1x2", "--duration", "60", "-o", "whole", "--no-study"];
    quiet(&[&run[..], SHORT].concat(), "whole/report/index.html\n");
    for file in ["fields/updraft.csv", "analysis.json", "report/figures/fig5-hover.svg"] {
        assert!(bench.path("whole").join(file).is_file(), "{file}");
    }
    // What is asked for itself is printed as ever.
    for args in [&["inspect", "campaign"][..], &["effects"], &["schema", "plan"], &["man"]] {
        let (loud, hushed) = (bench.expect(0, args), [args, &["--quiet"]].concat());
        assert_eq!(bench.expect(0, &hushed).out, loud.out, "{args:?}");
    }
    // A warning is said.
    let one = ["plan", "calibration", "--grid", "1x1", "--speeds", "1", "-o", "one", "--quiet"];
    let ended = bench.expect(0, &one);
    assert_eq!(ended.out, "one\n");
    assert!(ended.err.starts_with("warning[ladder-speeds]: "), "{ended}");
}

#[test]
fn force_replaces_the_plan_and_nothing_else() {
    let bench = Bench::new();
    bench.plan();
    for (name, text) in [("notes.txt", "mine"), ("skyb/notes.txt", "mine"), ("07.BIN", "a log")] {
        fs::write(bench.path("campaign").join(name), text).unwrap();
    }
    bench.expect(0, &["plan", "hover", "--grid", "1x1", "-o", "campaign", "--force"]);
    for (name, text) in [("notes.txt", "mine"), ("skyb/notes.txt", "mine"), ("07.BIN", "a log")] {
        assert_eq!(fs::read_to_string(bench.path("campaign").join(name)).unwrap(), text);
    }
    assert!(!bench.path("campaign/skyb/02.skyb").exists());
    fs::create_dir(bench.path("campaign/logs")).unwrap();
    fs::write(bench.path("campaign/logs/01.BIN"), "a log").unwrap();
    let args = ["plan", "hover", "--grid", "1x2", "-o", "campaign", "--force"];
    let refused = bench.expect(2, &args);
    assert!(refused.err.contains("holds the logs of another plan"), "{refused}");
    assert_eq!(fs::read_to_string(bench.path("campaign/logs/01.BIN")).unwrap(), "a log");
}

#[test]
fn negative_and_absurd_numbers_are_values() {
    let bench = Bench::new();
    let south = ["plan", "hover", "--grid", "1x1", "--origin", "-35.3,149.1", "--dry-run"];
    assert!(bench.expect(0, &south).out.contains("origin -35.300000, 149.100000"));
    let cases: &[(&[&str], &str)] = &[
        (&["--spacing", "-3"], "cannot be -3 m"),
        (&["--spacing", "1e300"], "cannot be 1e300 m"),
        (&["--height", "-1e300"], "-1e300"),
        (&["--drones", "-3"], "cannot be -3"),
        (&["--origin", "-1e300,149"], "there is no place at -1e300, 149"),
    ];
    for (args, said) in cases {
        let ended = bench.expect(2, &[&["plan", "hover"], *args].concat());
        assert!(ended.err.contains(said), "{args:?}\n{ended}");
        assert!(ended.err.len() < 1000, "{ended}");
    }
    let ladder = bench.expect(2, &["plan", "calibration", "--speeds", "-1,2"]);
    assert!(ladder.err.contains("cannot be -1 m/s"), "{ladder}");
    bench.plan();
    let twice = ["simulate", "campaign", "--drones", "1,1,1-1"];
    let flown = bench.expect(0, &twice);
    assert!(flown.err.starts_with("Flew calibration: 1 log, "), "a slot is flown once: {flown}");
}

#[test]
fn tables_fit_a_narrow_terminal() {
    let bench = Bench::new();
    bench.fly();
    let commands: &[&[&str]] = &[
        &["check", "campaign"],
        &["check", "campaign/skyb/01.skyb"],
        &["plan", "calibration", "--grid", "1x2", "--dry-run"],
        &["inspect", "campaign"],
        &["inspect", "campaign/show.skyc"],
        &["inspect", "campaign/skyb/01.skyb"],
        &["inspect", "campaign/simulated/01.BIN"],
        &["effects"],
        &["--help"],
    ];
    for args in commands {
        let narrow = bench.command(args).env("COLUMNS", "60").output().unwrap();
        let narrow = Ended::of(&narrow);
        assert_eq!(narrow.code, Some(0), "{narrow}");
        // Examples are copied: they keep their lines.
        let breaks = |line: &&str| !line.starts_with("  updraft ");
        let lines = narrow.out.lines().filter(breaks);
        let long: Vec<_> = lines.filter(|line| line.chars().count() > 60).collect();
        assert!(long.is_empty(), "{args:?}: {long:#?}");
    }
}

#[test]
fn completions_and_the_manual_are_in_the_help() {
    let help = Bench::new().expect(0, &["--help"]).out;
    for command in ["completions", "man", "schema"] {
        assert!(help.contains(&format!("\n  {command} ")), "{help}");
    }
}
