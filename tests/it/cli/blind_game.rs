//! `updraft blind hide`, `reveal` and `verify`: a game of strangers, and what spoils it.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the program fails")]

use std::fs;
use std::path::Path;

use super::support::{Bench, Ended, contents};
use crate::gap::verdicts::{fitted, prove, verdict};
use updraft::base::digest::sha256;
use updraft::gap::Verdict;
use updraft::gap::verdict::Finding;

/// The shortest game, in steady air.
const SMALL: [&str; 6] = ["blind", "hide", "--protocol", "paper", "--air", "still"];
/// The fewest drones.
const FEW: [&str; 2] = ["--grid", "2x2"];

fn hide(bench: &Bench, more: &[&str]) -> Ended {
    bench.expect(0, &[&SMALL[..], more].concat())
}

#[test]
fn a_folder_with_something_else_in_it_is_left_alone() {
    let bench = Bench::new();
    fs::create_dir(bench.path("mine")).unwrap();
    fs::write(bench.path("mine/notes.txt"), "mine").unwrap();
    let refused = bench.expect(2, &[&SMALL[..], &FEW, &["--nothing", "-o", "mine"]].concat());
    assert!(refused.err.contains("mine is not empty, and holds no game"), "{refused}");
    assert_eq!(fs::read_dir(bench.path("mine")).unwrap().count(), 1);
}

fn naming(effect: &str, parameter: &str, value: f64) -> Verdict {
    let parameters = vec![fitted(parameter, value)];
    let mut verdict =
        verdict(vec![Finding::Name { effect: effect.to_owned(), parameters, was_there: false }]);
    verdict.summary = format!("{effect} is missing.");
    verdict
}

/// As if `updraft gap game` had compared.
fn compare(bench: &Bench, folder: &str, verdict: &Verdict) {
    let beside = Path::new(folder).parent().map(|of| of.join("game.json"));
    let beside = beside.map(|path| path.to_string_lossy().into_owned());
    let at = beside.filter(|path| bench.path(path).exists());
    let game = fs::read(bench.path(at.as_deref().unwrap_or("game/game.json"))).unwrap();
    let game: serde_json::Value = serde_json::from_slice(&game).unwrap();
    let files = game["files"].as_array().unwrap().iter();
    let logs = files.filter(|file| file["path"].as_str().unwrap().starts_with("flight/logs/"));
    let mut hashes: Vec<&str> = logs.map(|file| file["sha256"].as_str().unwrap()).collect();
    hashes.sort_unstable();
    let mut verdict = verdict.clone();
    verdict.data.logs_sha256 = sha256(hashes.join("\n").as_bytes());
    write(bench, folder, &verdict);
}

fn write(bench: &Bench, folder: &str, verdict: &Verdict) {
    let folder = bench.path(folder);
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("verdict.json"), serde_json::to_vec(verdict).unwrap()).unwrap();
    fs::write(folder.join("model.toml"), "").unwrap();
    prove(&folder);
}

fn swap(bench: &Bench, file: &str, from: &str, to: &str) -> Vec<u8> {
    let path = bench.path(file);
    let before = fs::read_to_string(&path).unwrap();
    assert!(before.contains(from), "{before}");
    fs::write(&path, before.replacen(from, to, 1)).unwrap();
    before.into_bytes()
}

/// A game from its making to its verification, and everything in it altered once.
#[test]
fn a_game_is_hidden_revealed_and_verified_and_every_alteration_is_named() {
    let bench = Bench::new();
    let hidden = hide(
        &bench,
        &[&FEW[..], &["--effect", "battery=0.7", "--seed", "7", "-o", "game"]].concat(),
    );
    let game: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("game/game.json")).unwrap()).unwrap();
    let published = game["truth_sha256"].as_str().unwrap();
    assert!(hidden.out.contains(published) && hidden.out.contains("updraft gap game"), "{hidden}");
    // Neither what is said nor what the player is given tells what is hidden.
    let told = format!("{hidden}{game}");
    assert!(!told.contains("battery"), "{told}");
    for (path, bytes) in contents(&bench.path("game/flight")) {
        if path.extension().is_some_and(|extension| extension != "BIN") {
            let text = String::from_utf8(bytes).unwrap();
            assert!(!text.contains("0.7") || !text.contains("exponent"), "{}", path.display());
        }
    }

    let early = bench.expect(5, &["blind", "reveal", "game"]);
    assert!(
        early.err.contains("the truth stays sealed: game/gap has no verdict.json; compare first (`updraft gap game`)"),
        "{early}"
    );
    assert!(!early.err.contains("battery") && !bench.path("game/reveal.json").exists());
    let before = bench.expect(0, &["blind", "verify", "game", "--sha256", published]);
    assert!(before.out.contains("The seal was not opened yet"), "{before}");
    assert!(!before.out.contains("battery"), "{before}");

    // The verdict of another game, and one that does not say of which logs it is, prove nothing of this.
    hide(&bench, &[&FEW[..], &["--nothing", "--seed", "8", "-o", "other"]].concat());
    let mut stranger = naming("battery", "exponent", 0.7);
    for (logs_sha256, said) in [
        (
            "ab".repeat(32),
            "the truth stays sealed: game/gap/verdict.json is of other logs than those of this game",
        ),
        (
            String::new(),
            "the truth stays sealed: game/gap/verdict.json does not say which logs were compared",
        ),
    ] {
        stranger.data.logs_sha256 = logs_sha256;
        write(&bench, "game/gap", &stranger);
        let ended = bench.expect(2, &["blind", "reveal", "game"]);
        assert!(ended.err.contains(said) && !ended.out.contains("Hidden"), "{ended}");
        let ended = bench.expect(4, &["blind", "verify", "game"]);
        assert!(ended.out.contains("WRONG  game/gap/verdict.json"), "{ended}");
    }
    compare(&bench, "game/gap", &naming("battery", "exponent", 0.72));
    // The truth was kept from the player, and nobody has put it back.
    fs::rename(bench.path("game/sealed"), bench.path("away")).unwrap();
    let ended = bench.expect(5, &["blind", "reveal", "game"]);
    assert!(
        ended.err.contains("the truth is not here: game/sealed/truth.json is missing"),
        "{ended}"
    );
    let ended = bench.expect(4, &["blind", "verify", "game"]);
    assert!(ended.out.contains("truth.json: is missing (put the folder back"), "{ended}");
    fs::rename(bench.path("away"), bench.path("game/sealed")).unwrap();
    // What was changed before the seal is opened keeps it closed.
    let log = bench.path("game/flight/logs/02.BIN");
    let flown = fs::read(&log).unwrap();
    fs::write(&log, &flown[..flown.len() / 2]).unwrap();
    let ended = bench.expect(2, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("flight/logs/02.BIN was changed after the flight"), "{ended}");
    fs::write(&log, &flown).unwrap();
    let written = swap(&bench, "game/gap/verdict.json", "battery", "buttery");
    let ended = bench.expect(2, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("game/gap/verdict.json was edited"), "{ended}");
    assert!(ended.err.contains("compare again (`updraft gap game`)"), "{ended}");
    // Nor does an edited verdict lead to another flight.
    let next = ["gap", "next", "game/flight", "--gap", "game/gap", "--no-verify"];
    let ended = bench.expect(2, &next);
    assert!(ended.err.contains("game/gap/verdict.json was edited after `updraft gap`"), "{ended}");
    assert!(
        !bench.path("game/gap/next.toml").exists() && !ended.err.contains("battery"),
        "{ended}"
    );
    fs::write(bench.path("game/gap/verdict.json"), &written).unwrap();
    let ended = bench.run(&next);
    assert!(!ended.err.contains("was edited"), "{ended}");
    assert!(!bench.path("game/reveal.json").exists());

    let ended = bench.expect(0, &["blind", "reveal", "game"]);
    assert!(ended.out.contains("Hidden:   battery (0.700"), "{ended}");
    assert!(ended.out.contains("Verdict:  battery is missing."), "{ended}");
    assert!(ended.out.contains("Right: battery was hidden"), "{ended}");
    assert!(ended.out.contains("Air:      updraft 0.00 m/s, the verdict has 0.00"), "{ended}");
    let again = bench.expect(0, &["blind", "reveal", "game", "--json"]);
    let record = again.json("updraft.blind-record/1");
    assert_eq!((&record["truth_sha256"], &record["right"]), (&game["truth_sha256"], &true.into()));
    let verified = bench.expect(0, &["blind", "verify", "game", "--json"]);
    let verified = verified.json("updraft.blind-verify/1");
    assert_eq!((&verified["intact"], &verified["revealed"]), (&true.into(), &true.into()));

    for (file, from, to, said) in [
        ("sealed/truth.json", "battery", "buttery", "truth.json: was altered: its SHA-256 is"),
        ("sealed/truth.json", "\"nonce\": \"", "\"nonce\": \"0", "truth.json: was altered"),
        ("sealed/SHA256", &published[..8], "01234567", "SHA256: says 01234567"),
        ("game.json", "still", "calm", "game.json: was altered: its SHA-256 is"),
        ("game.json", "\"still\"", "", "game.json"),
        ("game.json", "blind-game/1", "blind-game/9", "updraft.blind-game/9"),
        (
            "game.json",
            &published[..8],
            "01234567",
            "game.json: says that the truth's SHA-256 is 0123",
        ),
        ("gap/verdict.json", "battery", "buttery", "verdict.json: was altered: its SHA-256 is"),
        ("gap/SHA256", "verdict", "verdikt", "verdict.json was edited after"),
        ("flight/plan.json", "{", "{ ", "plan.json: was changed after the flight"),
        (
            "flight/vehicle.toml",
            "mass_kg",
            "mass_kg ",
            "vehicle.toml: was changed after the flight",
        ),
        ("reveal.json", "Right:", "Wrong:", "reveal.json was edited after"),
        ("reveal.json", "\"right\": true", "\"right\": false", "reveal.json was edited after"),
    ] {
        let file = format!("game/{file}");
        let before = swap(&bench, &file, from, to);
        let ended = bench.expect(4, &["blind", "verify", "game"]);
        assert!(ended.out.contains(said), "{file}: {ended}");
        assert!(ended.out.contains("WRONG  ") && ended.out.contains("proves nothing"), "{ended}");
        fs::write(bench.path(&file), before).unwrap();
    }
    fs::remove_file(&log).unwrap();
    fs::write(bench.path("game/flight/logs/09.BIN"), &flown).unwrap();
    let ended = bench.expect(4, &["blind", "verify", "game", "-q"]);
    assert!(ended.err.contains("02.BIN: is missing") && ended.out.is_empty(), "{ended}");
    assert!(ended.err.contains("09.BIN: was added after the flight"), "{ended}");
    fs::remove_file(bench.path("game/flight/logs/09.BIN")).unwrap();
    fs::write(&log, &flown).unwrap();
    // A forgery that fits in itself does not fit what was published.
    let other = "ab".repeat(32);
    let ended = bench.expect(4, &["blind", "verify", "game", "--sha256", &other]);
    assert!(ended.out.contains(&format!("and not {other}, which was given")), "{ended}");
    assert_eq!(ended.out.matches("WRONG  ").count(), 1, "all of it belongs together: {ended}");
    bench.expect(0, &["blind", "verify", "game"]);
    // The record is not given again for a flight that is no longer the one it was made of.
    let before = swap(&bench, "game/flight/plan.json", "{", "{ ");
    let ended = bench.expect(2, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("plan.json was changed after the flight"), "{ended}");
    assert!(ended.out.is_empty(), "{ended}");
    fs::write(bench.path("game/flight/plan.json"), before).unwrap();
    bench.expect(0, &["blind", "reveal", "game"]);

    // The record of another game blames itself alone.
    let record = fs::read(bench.path("game/reveal.json")).unwrap();
    let verdict_of_this = fs::read(bench.path("game/gap/verdict.json")).unwrap();
    fs::remove_dir_all(bench.path("other")).unwrap();
    fs::rename(bench.path("game"), bench.path("other")).unwrap();
    hide(&bench, &[&FEW[..], &["--nothing", "--seed", "9", "-o", "game"]].concat());
    compare(&bench, "game/gap", &naming("battery", "exponent", 0.72));
    fs::write(bench.path("game/reveal.json"), &record).unwrap();
    let ended = bench.expect(4, &["blind", "verify", "game"]);
    assert!(
        ended.out.contains("WRONG  game/reveal.json: is of a truth with the SHA-256"),
        "{ended}"
    );
    assert!(ended.out.contains("ok     game/sealed/truth.json"), "{ended}");
    fs::remove_dir_all(bench.path("game")).unwrap();
    fs::rename(bench.path("other"), bench.path("game")).unwrap();

    // Who knows the truth is not asked again, neither here nor by the search.
    let ended = bench.expect(2, &["gap", "game"]);
    assert!(
        ended.err.contains("game/gap/verdict.json is the verdict of a game whose seal was opened"),
        "{ended}"
    );
    // Nor by the flight alone.
    let ended = bench.expect(2, &["gap", "game/flight", "-o", "game/gap"]);
    assert!(ended.err.contains("is the verdict of a game whose seal was opened"), "{ended}");
    assert_eq!(fs::read(bench.path("game/gap/verdict.json")).unwrap(), verdict_of_this);
    // What cannot be made again must be put back.
    let written = swap(&bench, "game/gap/verdict.json", "battery", "buttery");
    let ended = bench.expect(2, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("put it back as it was"), "{ended}");
    assert!(!ended.err.contains("compare again"), "{ended}");
    fs::write(bench.path("game/gap/verdict.json"), written).unwrap();
    fs::rename(bench.path("game/gap/verdict.json"), bench.path("kept")).unwrap();
    let ended = bench.expect(2, &["gap", "game"]);
    assert!(
        ended.err.contains("game/gap/verdict.json was the verdict of a game whose seal was opened"),
        "{ended}"
    );
    let ended = bench.expect(5, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("the seal was opened before (game/reveal.json)"), "{ended}");
    compare(&bench, "game/gap", &naming("rotor-inflow", "inflow_share", 0.3));
    let ended = bench.expect(2, &["blind", "reveal", "game"]);
    assert!(ended.err.contains("the seal was opened for another verdict"), "{ended}");
    // Another game in its place: the old verdict does not count for it.
    let ended = bench.expect(2, &[&SMALL[..], &FEW[..], &["-o", "game"]].concat());
    assert!(ended.err.contains("game holds a game") && ended.err.contains("--force"), "{ended}");
    let ended = bench.expect(2, &["run", "--hide", "3", "--grid", "3x3", "-o", "game", "--force"]);
    assert!(ended.err.contains("holds a game of `updraft blind hide`"), "{ended}");
    hide(&bench, &[&FEW[..], &["--nothing", "--force", "--quiet", "-o", "game"]].concat());
    assert!(!bench.path("game/gap").exists() && !bench.path("game/reveal.json").exists());
    compare(&bench, "elsewhere", &naming("battery", "exponent", 0.72));
    let ended = bench.expect(0, &["blind", "reveal", "game", "--gap", "elsewhere"]);
    assert!(ended.out.contains("Hidden:   nothing"), "{ended}");
    assert!(ended.out.contains("Wrong: nothing was hidden, and battery was named."), "{ended}");
    bench.expect(0, &["blind", "verify", "game"]);
}

#[test]
fn the_seed_says_what_is_flown_and_the_nonce_is_another_each_time() {
    let bench = Bench::new();
    let flown = ["one", "two"].map(|folder| {
        hide(&bench, &["--seed", "11", "--grid", "2x3", "--wind", "3", "-o", folder]);
        let logs = contents(&bench.path(folder).join("flight"));
        let bytes: Vec<Vec<u8>> = logs.into_iter().map(|(_, bytes)| bytes).collect();
        (bytes, fs::read_to_string(bench.path(folder).join("sealed/SHA256")).unwrap())
    });
    let [(one, sealed_one), (two, sealed_two)] = flown;
    assert!(one.len() > 3 && one == two);
    assert_ne!(sealed_one, sealed_two);
}

#[test]
fn what_cannot_be_hidden_is_said() {
    let bench = Bench::new();
    let says = |code: i32, args: &[&str], words: &str| {
        let ended = bench.expect(code, &[&["blind", "hide"], args].concat());
        assert!(ended.err.contains(words), "{args:?}: {ended}");
        assert!(ended.out.is_empty(), "{ended}");
    };
    says(2, &["--effect", "warp"], "nothing is called \"warp\" that could be hidden; there are");
    says(2, &["--effect", "battery=much"], "\"much\" is not a number; write it as NAME=SIZE");
    says(2, &["--effect", "battery=9"], "a size of 9; it can be 0.05 to 3 share of the sag");
    says(2, &["--effect", "battery", "--nothing"], "cannot be used with");
    says(2, &["--effect", "battery", "--effect", "battery"], "they are one effect");
    says(
        2,
        &["--effect", "rotor-inflow", "--vehicle", "pixel"],
        "cannot be hidden from pixel, which has it",
    );
    says(2, &["--vehicle", "zeppelin"], "possible values: airsim-generic-quad, arducopter-sitl");
    says(2, &["--grid", "1x4"], "a game has 2 to 15 rows and columns; 1x4 is not possible");
    says(2, &["--wind", "-3"], "a wind speed between 0 and 30 m/s");
    says(2, &["--air", "storm"], "possible values: still, calm, moderate, field");
    bench.expect(0, &["plan", "calibration", "--grid", "2x2", "-o", "campaign"]);
    says(2, &["-o", "campaign", "--force"], "campaign holds a campaign; choose another folder");
    fs::create_dir_all(bench.path("mine/flight")).unwrap();
    says(2, &["-o", "mine", "--force"], "was not made by `updraft blind hide`");
    for command in ["reveal", "verify"] {
        let ended = bench.expect(5, &["blind", command, "campaign"]);
        assert!(ended.err.contains("campaign is no game: it has no game.json"), "{ended}");
    }
    for command in ["reveal", "verify"] {
        let ended = bench.expect(1, &["blind", command, "nowhere"]);
        assert!(ended.err.contains("nowhere"), "{ended}");
    }
    says(5, &["-o", "storm", "--updraft", "20", "--grid", "2x2"], "no drone can fly");
    assert!(!bench.path("storm").exists());
    let ended = bench.expect(2, &["blind", "verify", "campaign", "--sha256", "12"]);
    assert!(ended.err.contains("64 hexadecimal digits"), "{ended}");
    // A series without a seed is refused as it was.
    let ended = bench.expect(2, &["blind"]);
    assert!(ended.err.contains("--seed <SEED>"), "{ended}");
}

/// What descends no faster than the air sinks has no wake of its own to fly into.
#[test]
fn how_hard_it_was_to_see_is_told_of_the_air_that_was_flown_in() {
    let bench = Bench::new();
    let vehicle = ["--vehicle", "phantom4", "--effect", "vortex-ring=0.1", "--seed", "7"];
    let [in_still_air, in_sinking_air] =
        [("0", "still"), ("-2", "sinking")].map(|(updraft, folder)| {
            let air = ["--updraft", updraft, "--wind", "3", "-o", folder];
            hide(&bench, &[&FEW[..], &vehicle, &air].concat());
            compare(&bench, &format!("{folder}/gap"), &naming("battery", "exponent", 0.72));
            let ended = bench.expect(0, &["blind", "reveal", folder, "--json"]);
            ended.json("updraft.blind-record/1")["outcome"]["hidden"][0]["z"].as_f64().unwrap()
        });
    assert!(in_still_air > 6.0 && in_sinking_air < 2.0, "{in_still_air} {in_sinking_air}");
}

/// With such an error in its control loop no drone could have flown the plan at all.
#[test]
fn a_velocity_that_is_far_off_is_told_as_an_error_of_the_log_alone() {
    let bench = Bench::new();
    let more = ["--vehicle", "pixel", "--effect", "log-bias=0.9", "--seed", "3", "-o", "game"];
    hide(&bench, &[&FEW[..], &more].concat());
    let told = bench.expect(0, &["gap", "game", "--json"]).json("updraft.gap/1");
    assert_eq!(told["verdict"]["sensor"]["in_log"], true, "{}", told["verdict"]["sensor"]);
    let revealed = bench.expect(0, &["blind", "reveal", "game", "--json"]);
    assert_eq!(revealed.json("updraft.blind-record/1")["right"], true, "{revealed}");
}

/// The whole way, with the real search, which finds no truth: it was carried off.
///
/// `cargo test --release --test it cli::blind_game -- --ignored`
#[test]
#[ignore = "flies and searches: minutes in a debug build"]
fn the_search_does_not_need_the_seal_and_names_what_is_hidden() {
    let bench = Bench::new();
    let args = ["--grid", "4x4", "--air", "calm", "--effect", "rotor-inflow=20", "--seed", "5"];
    bench.expect(0, &[&["blind", "hide", "-o", "game"], &args[..]].concat());
    fs::rename(bench.path("game/sealed"), bench.path("sealed")).unwrap();
    bench.expect(0, &["gap", "game"]);
    fs::rename(bench.path("sealed"), bench.path("game/sealed")).unwrap();
    let ended = bench.expect(0, &["blind", "reveal", "game", "--json"]);
    assert_eq!(ended.json("updraft.blind-record/1")["right"], true, "{ended}");
    bench.expect(0, &["blind", "verify", "game"]);
}
