//! What the program says about itself.

use snapbox::cmd::Command;

use crate::cli::support::Bench;

/// What every command has; its own help says the same of them.
const GLOBAL: [&str; 6] = ["--json", "-q, ", "--color ", "--no-progress", "-h, ", "-V, "];

/// What a help says of each of these options.
fn of_options(help: &str, options: &[&str]) -> Vec<(String, String)> {
    let starts = |line: &str| {
        let option = line.trim_start();
        let is_option = option.starts_with('-') && line.len() - option.len() <= 6;
        is_option.then(|| options.iter().find(|known| option.starts_with(**known))).flatten()
    };
    let mut found: Vec<(String, String)> = Vec::new();
    let mut is_inside = false;
    for line in help.lines() {
        let is_new = !line.is_empty() && !line.starts_with("          ");
        if is_new {
            is_inside = false;
        }
        if let Some(option) = starts(line).filter(|_| is_new) {
            is_inside = true;
            found.push(((*option).to_owned(), String::new()));
        }
        if let (true, Some((_, said))) = (is_inside, found.last_mut()) {
            said.push_str(line.trim_end());
            said.push('\n');
        }
    }
    for (_, said) in &mut found {
        said.truncate(said.trim_end().len());
    }
    found
}

#[test]
fn the_program_has_its_help() {
    insta::assert_snapshot!(Bench::new().expect(0, &["--help"]).out);
}

/// Each command's own options, without blank lines.
#[test]
fn every_command_has_its_help() {
    let bench = Bench::new();
    let whole = bench.expect(0, &["--help"]).out;
    let global = of_options(&whole, &GLOBAL);
    assert_eq!(global.len(), GLOBAL.len());
    for command in ["run", "plan", "check", "simulate", "analyze", "inspect"] {
        let ended = bench.expect(0, &[command, "--help"]);
        assert!(ended.err.is_empty(), "{ended}");
        let mut own = ended.out.clone();
        for (option, said) in of_options(&ended.out, &GLOBAL) {
            assert!(global.contains(&(option.clone(), said.clone())), "{command} {option}: {said}");
            own = own.replace(&said, "");
        }
        let lines: Vec<&str> =
            own.lines().map(str::trim_end).filter(|line| !line.is_empty()).collect();
        insta::assert_snapshot!(format!("help_of_{command}"), lines.join("\n"));
    }
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
