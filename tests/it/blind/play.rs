//! A flight with something hidden, before an audience: the verdict is on the disk before the seal is
//! opened.

#![expect(clippy::unwrap_used, reason = "a test that cannot fly fails")]

use std::path::Path;
use std::sync::Mutex;

use crate::gap::verdicts::{fitted, verdict};
use updraft::blind::explain::Cause;
use updraft::blind::play::{self, Act, play};
use updraft::blind::score::Called;
use updraft::blind::told::{HiddenRun, is_right};
use updraft::blind::{AirClass, Base, BlindError, Cell, Protocol, Scenario, seal};
use updraft::gap::Verdict;
use updraft::gap::verdict::Finding;

fn truth() -> Scenario {
    let mut cell = Cell::hiding_one(3, Protocol::Paper, AirClass::Calm, Base::Airsim);
    cell.side = 3;
    cell.hidden = vec!["rotor-inflow".to_owned()];
    Scenario::draw(3, &cell).unwrap()
}

fn naming(effect: &str) -> Verdict {
    verdict(vec![Finding::Name {
        effect: effect.to_owned(),
        parameters: vec![fitted("inflow_share", 0.4)],
        was_there: false,
    }])
}

fn write(flight: &Path, verdict: &Verdict) {
    let folder = flight.join("gap");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("verdict.json"), serde_json::to_vec(verdict).unwrap()).unwrap();
}

#[test]
fn the_truth_is_out_of_reach_until_the_verdict_is_on_the_disk() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let (truth_path, away) = (seal::truth_path(root), root.join("elsewhere"));
    let acts = Mutex::new(Vec::new());
    // The truth is carried off before the search and brought back when the verdict has been told: who
    // looks sooner finds nothing.
    let search = |flight: &Path| -> Result<Verdict, Cause> {
        acts.lock().unwrap().push("search");
        assert!(flight.join("plan.json").is_file());
        assert!(!flight.join("sealed").exists(), "the search is given nothing of the truth");
        std::fs::rename(&truth_path, &away).unwrap();
        write(flight, &naming("rotor-inflow"));
        Ok(naming("rotor-inflow"))
    };
    let published = Mutex::new(String::new());
    let mut tell = |act: Act<'_>| match act {
        Act::Sealed(hash) => {
            acts.lock().unwrap().push("sealed");
            assert!(seal::hash_path(root).is_file() && !play::flight(root).exists());
            published.lock().unwrap().push_str(hash);
        }
        Act::Flown(flown) => {
            acts.lock().unwrap().push("flown");
            assert!(flown.logs > 5 && !play::verdict(root).exists());
        }
        Act::Explained(_) => {
            acts.lock().unwrap().push("explained");
            assert!(play::verdict(root).is_file());
            std::fs::rename(&away, &truth_path).unwrap();
        }
    };
    let played = play(&truth(), root, &search, None, &mut tell).unwrap();
    assert_eq!(*acts.lock().unwrap(), ["sealed", "flown", "search", "explained"]);
    assert_eq!(played.opened.truth_sha256, *published.lock().unwrap());
    assert_eq!(played.outcome.hidden[0].called, Called::Named);
    let told = HiddenRun::of(&played, "updraft");
    assert!(told.right);
    assert!(told.words[0].starts_with("Right: rotor-inflow was hidden, at 0."), "{:?}", told.words);
    assert!(told.words[0].contains("Found: 0.400"), "{:?}", told.words);

    // A search that leaves no verdict never sees the truth opened.
    let (again, other) = (root.join("again"), root.join("other"));
    let silent = |_: &Path| -> Result<Verdict, Cause> { Ok(naming("rotor-inflow")) };
    let error = play(&truth(), &again, &silent, None, &mut |_| {}).unwrap_err();
    assert!(matches!(error, BlindError::NoVerdict { .. }), "{error}");

    // Another effect, of another class, is wrong, and said to be.
    let wrong = |flight: &Path| -> Result<Verdict, Cause> {
        write(flight, &naming("battery"));
        Ok(naming("battery"))
    };
    let played = play(&truth(), &other, &wrong, None, &mut |_| {}).unwrap();
    assert!(!is_right(&played.outcome));
    let words = HiddenRun::of(&played, "updraft").words;
    assert!(words[0].starts_with("Missed: rotor-inflow was hidden"), "{words:?}");
    assert!(words[1].contains("battery was named as well"), "{words:?}");

    // What was played can be removed, and nothing else.
    std::fs::write(other.join("mine.txt"), "mine").unwrap();
    assert!(play::is_played(&other));
    play::remove(&other).unwrap();
    assert!(!play::is_played(&other) && !play::flight(&other).exists());
    assert!(other.join("mine.txt").is_file());
}
