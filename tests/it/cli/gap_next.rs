//! `updraft gap next` and `updraft run --hide` as their users meet them.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the program fails")]

use super::support::Bench;
use crate::gap::verdicts::{INFLOW, climb_class, prove, verdict};
use updraft::gap::Verdict;
use updraft::vehicle::library;

/// A campaign of the paper's ladder that was compared.
fn compared(bench: &Bench, verdict: &Verdict) {
    bench.expect(0, &["plan", "calibration", "--grid", "2x2", "-o", "campaign"]);
    let folder = bench.path("campaign/gap");
    std::fs::create_dir_all(&folder).unwrap();
    let mut model = library::builtin("airsim-generic-quad").unwrap();
    let table = model.effects.entry("rotor-inflow".to_owned()).or_default();
    table.on = true;
    table.parameters.insert("inflow_share".to_owned(), INFLOW);
    std::fs::write(folder.join("model.toml"), toml::to_string(&model).unwrap()).unwrap();
    std::fs::write(folder.join("verdict.json"), serde_json::to_vec(verdict).unwrap()).unwrap();
    prove(&folder);
}

#[test]
fn an_edited_verdict_or_model_is_refused() {
    let bench = Bench::new();
    compared(&bench, &verdict(vec![climb_class()]));
    let next = ["gap", "next", "campaign", "--no-verify"];
    for (file, from, to) in [
        ("verdict.json", "parasitic-drag", "ground-effect"),
        ("model.toml", "inflow_share = 0.4", "inflow_share = 0.41"),
    ] {
        let path = bench.path("campaign/gap").join(file);
        let written = std::fs::read_to_string(&path).unwrap();
        assert!(written.contains(from), "{written}");
        std::fs::write(&path, written.replacen(from, to, 1)).unwrap();
        let ended = bench.expect(2, &next);
        let said =
            format!("campaign/gap/{file} was edited after `updraft gap` wrote it: its SHA-256 is");
        assert!(ended.err.contains(&said), "{ended}");
        assert!(ended.err.contains("compare again (`updraft gap campaign`)"), "{ended}");
        std::fs::write(&path, written).unwrap();
    }
    assert!(!bench.path("campaign/gap/next.toml").exists());
    std::fs::remove_file(bench.path("campaign/gap/SHA256")).unwrap();
    let ended = bench.expect(2, &next);
    assert!(ended.err.contains("verdict.json has no SHA256 beside it"), "{ended}");
    assert!(ended.err.contains("compare again (`updraft gap campaign`)"), "{ended}");
    std::fs::rename(bench.path("campaign/gap"), bench.path("else where")).unwrap();
    let ended = bench.expect(2, &[&next[..], &["--gap", "else where"]].concat());
    assert!(ended.err.contains("(`updraft gap campaign -o 'else where'`)"), "{ended}");
}

#[test]
fn without_a_verdict_or_a_question_it_says_so() {
    let bench = Bench::new();
    bench.expect(0, &["plan", "calibration", "--grid", "2x2", "-o", "campaign"]);
    let ended = bench.expect(5, &["gap", "next", "campaign"]);
    assert!(ended.err.contains("campaign has no gap/verdict.json: compare it first"), "{ended}");
    compared(&bench, &verdict(Vec::new()));
    let ended = bench.expect(5, &["gap", "next", "campaign"]);
    assert!(ended.err.contains("nothing is left to ask"), "{ended}");
    let ended = bench.expect(2, &["gap", "next", "campaign", "--z", "0"]);
    assert!(ended.err.contains("a number from 0.5 to 100"), "{ended}");
    let ended = bench.expect(2, &["gap"]);
    assert!(ended.err.contains("a campaign folder, --measured LOGS or --csv"), "{ended}");
}

#[test]
fn a_verdict_of_another_flight_is_not_taken() {
    let bench = Bench::new();
    let mut other = verdict(vec![climb_class()]);
    other.data.groups = vec![("climbers".to_owned(), 4)];
    compared(&bench, &other);
    let ended = bench.expect(2, &["gap", "next", "campaign"]);
    assert!(ended.err.contains("a group \"climbers\", which the flight calibration"), "{ended}");
    other.data.groups.clear();
    other.data.drones = 49;
    compared(&bench, &other);
    let ended = bench.expect(2, &["gap", "next", "campaign"]);
    assert!(ended.err.contains("compares 49 drones, and the flight calibration has 4"), "{ended}");
    other.schema = "updraft.verdict/0".to_owned();
    compared(&bench, &other);
    let ended = bench.expect(2, &["gap", "next", "campaign"]);
    assert!(ended.err.contains("has the schema \"updraft.verdict/0\""), "{ended}");
}

#[test]
fn a_comparison_may_be_elsewhere() {
    let bench = Bench::new();
    compared(&bench, &verdict(vec![climb_class()]));
    std::fs::rename(bench.path("campaign/gap"), bench.path("elsewhere")).unwrap();
    let ended = bench.expect(5, &["gap", "next", "campaign", "--gap", "nowhere"]);
    assert!(ended.err.contains("nowhere has no verdict.json"), "{ended}");
    bench.expect(0, &["gap", "next", "campaign", "--gap", "elsewhere", "--no-verify"]);
    assert!(bench.path("elsewhere/next.toml").is_file());
    assert!(!bench.path("campaign/gap").exists());
}

#[test]
fn the_template_is_one_that_plan_takes_and_check_passes() {
    let bench = Bench::new();
    compared(&bench, &verdict(vec![climb_class()]));
    // Four drones do not tell at z 4 in one flight.
    let ended = bench.expect(0, &["gap", "next", "campaign", "--no-verify", "--z", "3", "--json"]);
    let next = ended.json("updraft.next/1");
    let asked = &next["questions"][0];
    let z = |key: &str| asked[key].as_f64().unwrap();
    assert!(z("proposed_z") >= 3.0 && z("proposed_z") > z("present_z"), "{asked}");
    let on_disk = std::fs::read(bench.path("campaign/gap/next.json")).unwrap();
    let on_disk: serde_json::Value = serde_json::from_slice(&on_disk).unwrap();
    assert_eq!(on_disk, next);
    bench.expect(0, &["plan", "campaign/gap/next.toml", "-o", "second"]);
    bench.expect(0, &["check", "second"]);
    let text = std::fs::read_to_string(bench.path("campaign/gap/next.toml")).unwrap();
    assert!(text.contains("# The flight that would tell"), "{text}");
    assert!(text.contains("from parasitic-drag"), "{text}");
    let ended = bench.expect(2, &["gap", "next", "campaign", "--no-verify", "--longest", "60"]);
    assert!(ended.err.contains("no flight of the elements is as short as 60 s"), "{ended}");
    let table = bench.expect(0, &["gap", "next", "campaign", "--no-verify"]);
    assert!(table.out.contains("is it rotor-inflow or parasitic-drag or thrust-curve?"), "{table}");
}

#[test]
fn options_that_do_not_go_with_hidden_physics_are_refused() {
    let bench = Bench::new();
    let ended = bench.expect(2, &["run", "--hide", "3", "--lose", "2"]);
    assert!(ended.err.contains("--lose"), "{ended}");
    let ended = bench.expect(2, &["run", "--hide", "3", "--grid", "3x4"]);
    assert!(ended.err.contains("3x4 is not"), "{ended}");
    let ended = bench.expect(2, &["run", "--hide", "3", "--vehicle", "phantom4"]);
    assert!(ended.err.contains("airsim-generic-quad and pixel, not in phantom4"), "{ended}");
    bench.expect(2, &["run", "--protocol", "paper"]);
    bench.expect(0, &["plan", "calibration", "--grid", "2x2", "-o", "campaign"]);
    let ended = bench.expect(2, &["run", "--hide", "3", "-o", "campaign"]);
    assert!(ended.err.contains("campaign is a campaign; choose another folder"), "{ended}");
    std::fs::create_dir_all(bench.path("mine/flight")).unwrap();
    let ended = bench.expect(2, &["run", "--hide", "3", "-o", "mine", "--force"]);
    assert!(ended.err.contains("was not made by `run --hide`"), "{ended}");
}

/// The whole way, with the real search: half a minute in a release build.
///
/// `cargo test --release --test it cli::gap_next -- --ignored`
#[test]
#[ignore = "flies and searches: minutes in a debug build"]
fn an_effect_is_hidden_named_and_revealed() {
    let bench = Bench::new();
    let args = ["run", "--hide", "11", "--grid", "4x4", "--day", "calm", "-o", "out", "--json"];
    let ended = bench.expect(0, &args);
    let said: Vec<usize> = ["Sealed:", "Flown:", "Verdict:", "Gap on held-out", "Seal opened:"]
        .iter()
        .map(|word| ended.err.find(word).unwrap_or_else(|| panic!("{word}\n{ended}")))
        .collect();
    assert!(said.is_sorted(), "{ended}");
    let result = ended.json("updraft.hidden/1");
    assert_eq!(result["right"], true, "{ended}");
    let verdict = bench.path("out/flight/gap/verdict.json");
    assert!(verdict.is_file());
    // The verdict that the program writes is one that it takes.
    let next = bench.run(&["gap", "next", "out/flight", "--no-verify"]);
    assert!(!next.err.contains("edited") && !next.err.contains("SHA256"), "{next}");
    let again = bench.expect(2, &args);
    assert!(again.err.contains("replace it with --force"), "{again}");
}
