//! What `updraft effects` shows.

#![expect(clippy::unwrap_used, reason = "a test that cannot start the program fails")]

use std::process::{Command, Output};

fn updraft(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_updraft")).args(arguments).output().unwrap()
}

fn text(arguments: &[&str]) -> String {
    let output = updraft(arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn lists_all_effects_with_their_sizes() {
    insta::assert_snapshot!(text(&["effects"]));
}

#[test]
fn explains_one_effect() {
    insta::assert_snapshot!(text(&["effects", "show", "rotor-inflow"]));
}

#[test]
fn json_has_everything_and_the_svg_is_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lift.svg");
    let path = file.display().to_string();
    let arguments = [
        "--json",
        "effects",
        "show",
        "translational-lift",
        "--vehicle",
        "phantom4",
        "--svg",
        &path,
    ];
    let json: serde_json::Value = serde_json::from_str(&text(&arguments)).unwrap();
    assert_eq!(json["schema"], "updraft.effects/1");
    assert_eq!(json["vehicle"], "phantom4");
    let effect = &json["effects"][0];
    assert_eq!(effect["class"], "horizontal");
    assert_eq!(effect["parameters"][0]["value"], 0.297);
    assert!(effect["curve"]["points"].as_array().unwrap().len() > 100);
    let svg = std::fs::read_to_string(file).unwrap();
    assert!(svg.starts_with("<svg") && svg.contains("Translational lift on phantom4"));
}

#[test]
fn a_wrong_name_is_answered_with_the_right_one() {
    for arguments in [
        vec!["effects", "show", "ground-efect"],
        vec!["simulate", "nowhere", "--effect", "ground-efect"],
    ] {
        let output = updraft(&arguments);
        assert_eq!(output.status.code(), Some(2));
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(error.contains("did you mean ground-effect?"), "{error}");
    }
}
