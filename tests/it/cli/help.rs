//! What the program says about itself.

use std::fmt::Write as _;

use snapbox::cmd::Command;

use crate::cli::support::Bench;

#[test]
fn every_command_has_its_help() {
    let bench = Bench::new();
    let mut all = String::new();
    let commands: [&[&str]; 7] =
        [&[], &["run"], &["plan"], &["check"], &["simulate"], &["analyze"], &["inspect"]];
    for command in commands {
        let ended = bench.expect(0, &[command, &["--help"]].concat());
        assert!(ended.err.is_empty(), "{ended}");
        let args = [command, &["--help"]].concat().join(" ");
        let _ = writeln!(all, "$ updraft {args}\n{}", ended.out);
    }
    insta::assert_snapshot!(all);
}

#[test]
fn wrong_arguments_end_with_2_and_say_what_is_right() {
    let updraft = || Command::new(env!("CARGO_BIN_EXE_updraft"));
    updraft().assert().code(2).stdout_eq("");
    updraft().arg("hop").assert().code(2).stderr_eq("error: unrecognized subcommand 'hop'\n...");
    updraft()
        .args(["plan", "calibration", "--grid", "7"])
        .assert()
        .code(2)
        .stderr_eq("error: [..]write it as rows x columns, for example 7x7\n...");
    updraft()
        .args(["check", "nothing-here"])
        .assert()
        .code(1)
        .stdout_eq("")
        .stderr_eq("error: failed to read nothing-here\n  because: [..]\n");
    updraft().arg("--version").assert().code(0).stdout_eq("updraft [..]\n");
}

#[test]
fn completions_manual_and_schemas_are_printed() {
    let bench = Bench::new();
    for shell in ["bash", "zsh", "fish"] {
        assert!(bench.expect(0, &["completions", shell]).out.contains("simulate"));
    }
    assert!(bench.expect(0, &["man"]).out.contains(".TH updraft"));
    for format in ["plan", "campaign", "flight", "analysis", "vehicle"] {
        let schema: serde_json::Value =
            serde_json::from_str(&bench.expect(0, &["schema", format]).out).unwrap();
        assert!(schema["properties"].is_object(), "{format}");
    }
}
