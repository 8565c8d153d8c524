//! The contract of `--json`: one object of a known schema on standard output, or an error as the last line of standard
//! error and nothing on standard output.

use std::collections::BTreeSet;

use clap::{Command, CommandFactory as _, ValueEnum as _};
use serde_json::Value;
use updraft::cli::Cli;
use updraft::cli::tools::Format;

use crate::cli::support::{Bench, Ended, SHORT};

/// The schema of a format.
fn schema(name: &str) -> Value {
    let format = Format::value_variants()
        .iter()
        .copied()
        .find(|format| format.to_possible_value().is_some_and(|value| value.get_name() == name));
    let format = format.unwrap_or_else(|| panic!("there is no schema {name}"));
    serde_json::from_str(&format.schema().unwrap()).unwrap()
}

/// Holds a value against a format's schema.
fn is_valid(name: &str, value: &Value) {
    let validator = jsonschema::validator_for(&schema(name)).unwrap();
    let wrong: Vec<String> = validator
        .iter_errors(value)
        .take(5)
        .map(|error| format!("{}: {error}", error.instance_path()))
        .collect();
    assert!(wrong.is_empty(), "{name}\n{}", wrong.join("\n"));
}

#[test]
#[should_panic(expected = "is not of type")]
fn a_value_that_is_not_as_its_schema_says_is_noticed() {
    is_valid(
        "error",
        &serde_json::json!({ "because": [], "error": "x", "exit": "4", "schema": "" }),
    );
}

/// The last line of standard error, as the error that it must be.
fn error_of(ended: &Ended) -> Value {
    let last = ended.err.lines().last().unwrap_or_default();
    let error: Value =
        serde_json::from_str(last).unwrap_or_else(|_| panic!("the last line is no error: {ended}"));
    is_valid("error", &error);
    assert_eq!(error["exit"].as_i64(), ended.code.map(i64::from), "{ended}");
    error
}

/// Runs a command that must do its work, and holds what it prints against a schema.
fn prints(bench: &Bench, format: &str, args: &[&str]) {
    let ended = bench.run(&[args, &["--json"]].concat());
    assert!(matches!(ended.code, Some(0 | 3)), "{args:?}\n{ended}");
    let value: Value = serde_json::from_str(&ended.out)
        .unwrap_or_else(|error| panic!("{args:?} prints no object: {error}\n{ended}"));
    assert!(value.is_object(), "{args:?}");
    is_valid(format, &value);
}

#[test]
fn what_commands_print_is_as_their_schemas_say() {
    let bench = Bench::new();
    let plan = ["plan", "campaign", "--grid", "1x2", "--duration", "60", "-o", "campaign"];
    prints(&bench, "plan-output", &[&plan[..], SHORT].concat());
    prints(&bench, "plan-output", &["plan", "hover", "--grid", "1x1", "--dry-run"]);
    prints(&bench, "check", &["check", "campaign"]);
    prints(&bench, "simulate", &["simulate", "campaign"]);
    prints(&bench, "verify", &["logs", "verify", "campaign"]);
    prints(&bench, "analyze", &["analyze", "campaign"]);
    prints(&bench, "analyze-each", &["analyze", "--each", "campaign"]);
    for file in [
        "campaign",
        "campaign/hover/plan.json",
        "campaign/hover/show.skyc",
        "campaign/hover/show.csv.zip",
        "campaign/hover/skyb/01.skyb",
        "campaign/hover/simulated/01.BIN",
    ] {
        prints(&bench, "inspect", &["inspect", file]);
    }
    prints(&bench, "effects", &["effects"]);
    prints(&bench, "effects", &["effects", "show", "battery", "--vehicle", "phantom4"]);
    prints(&bench, "man", &["man", "fleet", "upload"]);
    prints(&bench, "man", &["man", "--dir", "pages"]);
    prints(&bench, "completions", &["completions", "fish"]);
    for step in ["status", "upload", "preflight", "start", "abort", "land", "restore", "watch"] {
        let args = ["fleet", step, "campaign", "--flight", "hover", "--dry-run"];
        prints(&bench, "dry-run", &args);
    }
    prints(&bench, "dry-run", &["fly", "campaign", "--flight", "hover", "--dry-run"]);
    prints(&bench, "dry-run", &["logs", "pull", "campaign", "--flight", "hover", "--dry-run"]);
    let import = ["logs", "import", "campaign", "campaign/hover/simulated", "--flight", "hover"];
    prints(&bench, "import", &import);
    prints(&bench, "shard", &["simulate", "campaign", "--shard", "1/2"]);
}

#[cfg(feature = "parquet")]
#[test]
fn an_archive_is_told_as_its_schema_says() {
    let bench = Bench::new();
    bench.fly();
    bench.expect(0, &["analyze", "campaign"]);
    prints(&bench, "archive", &["archive", "campaign"]);
}

/// A command line that must fail, with what is wrong.
const FAILS: &[&[&str]] = &[
    &["plan", "nothing"],
    &["plan", "calibration", "--grid", "2x2", "--spacing", "1"],
    &["plan", "calibration", "--leg", "2", "--dry-run"],
    &["plan", "calibration", "--height", "100ft"],
    &["check", "nothing"],
    &["check", "campaign", "--allow", "everything"],
    &["simulate", "nothing"],
    &["simulate", "campaign", "--flight", "none"],
    &["run", "nothing"],
    &["run", "calibration", "--grid", "2x2", "--spacing", "1", "-o", "unsafe"],
    &["fly", "nothing"],
    &["fleet", "status", "nothing"],
    &["fleet", "upload", "nothing"],
    &["fleet", "preflight", "nothing"],
    &["fleet", "start", "nothing"],
    &["fleet", "watch", "nothing"],
    &["fleet", "abort", "nothing"],
    &["fleet", "land", "nothing"],
    &["fleet", "restore", "nothing"],
    &["fleet", "virtual", "nothing"],
    &["live", "nothing"],
    &["live", "campaign"],
    &["logs", "list", "nothing"],
    &["logs", "pull", "nothing"],
    &["logs", "verify", "campaign"],
    &["logs", "import", "campaign", "nothing"],
    &["physics", "--vehicle", "nothing"],
    &["physics", "--listen", "127.0.0.1:0", "--duration", "nothing"],
    &["analyze", "nothing"],
    &["analyze", "campaign"],
    &["archive", "nothing"],
    &["compare", "nothing", "elsewhere"],
    &["compare", "nothing", "--mast", "nothing.csv"],
    &["archive", "campaign"],
    &["sweep", "nothing"],
    &["gap", "nothing"],
    &["gap", "campaign"],
    &["gap", "next", "campaign"],
    &["blind", "--seed", "1", "--flights", "0"],
    &["blind", "hide", "-o", "campaign"],
    &["blind", "reveal", "nothing"],
    &["blind", "verify", "nothing"],
    &["cluster", "script", "sweep", "nothing"],
    &["cluster", "submit", "sweep", "nothing"],
    &["cluster", "status", "nothing"],
    &["cluster", "cancel", "nothing"],
    &["effects", "--vehicle", "nothing"],
    &["effects", "show", "nothing"],
    &["inspect", "nothing"],
    &["completions", "nothing"],
    &["man", "nothing"],
    &["schema", "nothing"],
];

/// Names of all commands that do something: `fleet upload`.
fn commands(command: &Command, above: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help") {
        let name = format!("{above}{}", inner.get_name());
        found.extend(commands(inner, &format!("{name} ")));
        if !inner.is_subcommand_required_set() {
            found.insert(name);
        }
    }
    found
}

#[test]
fn a_command_that_fails_prints_nothing_but_its_error() {
    let bench = Bench::new();
    bench.plan();
    let mut wrong = Vec::new();
    for args in FAILS {
        let ended = bench.run(&[args, &["--json"][..]].concat());
        if matches!(ended.code, Some(0 | 3)) || !ended.out.is_empty() {
            wrong.push(format!("{args:?}\n{ended}"));
            continue;
        }
        error_of(&ended);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn every_command_is_seen_to_fail() {
    let mut all = commands(&Cli::command(), "");
    // What these commands of a cluster take is that of the commands themselves.
    all.retain(|name| !name.starts_with("cluster script ") && !name.starts_with("cluster submit "));
    let failing: BTreeSet<String> = FAILS
        .iter()
        .flat_map(|args| [args[..1].join(" "), args[..2.min(args.len())].join(" ")])
        .collect();
    let unseen: Vec<&String> = all.iter().filter(|name| !failing.contains(*name)).collect();
    assert!(unseen.is_empty(), "{unseen:?}");
}

#[test]
fn a_check_that_fails_says_what_and_why() {
    let bench = Bench::new();
    let plan = ["plan", "calibration", "--grid", "2x2", "--spacing", "1", "-o", "campaign"];
    let refused = bench.run(&[&plan[..], &["--json"]].concat());
    assert_eq!((refused.code, refused.out.as_str()), (Some(4), ""), "{refused}");
    let because = error_of(&refused)["because"].to_string();
    assert!(because.contains("error[distance] drones 1-4"), "{because}");
    let allowed = ["--allow", "distance", "--json"];
    let ended = bench.expect(0, &[&plan[..], &allowed].concat());
    is_valid("plan-output", &serde_json::from_str(&ended.out).unwrap());
    // A check is what `check` is for: it has its result, and has failed.
    let checked = bench.expect(4, &["check", "campaign", "--json"]);
    is_valid("check", &serde_json::from_str(&checked.out).unwrap());
    error_of(&checked);
}
