//! Blind flights as they are flown: the same bytes again, magnitudes as promised, a known vehicle that
//! says nothing of what is hidden.

#![expect(clippy::unwrap_used, reason = "a test that cannot fly fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use updraft::blind::fly::{fly, planned};
use updraft::blind::hide::{KINDS, kind_of};
use updraft::blind::series::flight_seed;
use updraft::blind::vehicles::true_vehicle;
use updraft::blind::{AirClass, Base, Cell, Protocol, Scenario, Worlds};
use updraft::effects::select::resolved;
use updraft::effects::{Model, Signals};

fn cell(protocol: Protocol, base: Base, hidden: &[&str]) -> Cell {
    let hidden = hidden.iter().map(|name| (*name).to_owned()).collect();
    let (worlds, air) = (Worlds::Home, AirClass::Moderate);
    Cell { worlds, protocol, air, base, hidden, side: 3, columns: None }
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            let name = path.strip_prefix(folder.parent().unwrap()).unwrap();
            found.insert(name.display().to_string(), std::fs::read(&path).unwrap());
        }
    }
    found
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_one_thread_and_on_two() {
    let cell = cell(Protocol::Paper, Base::Pixel, &["battery", "step"]);
    let flown: Vec<_> = [1, 2]
        .into_iter()
        .map(|threads| {
            let folder = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let truth = Scenario::draw(11, &cell).unwrap();
            let place = folder.path().join("flight");
            let flown = pool.install(|| fly(&truth, &place, None)).unwrap();
            assert_eq!(flown.lost, 0);
            assert_eq!(flown.logs + truth.nuisance.missing.len(), 9);
            files(&place)
        })
        .collect();
    assert!(flown[0] == flown[1]);
    let names: Vec<_> = flown[0].keys().filter(|name| !name.ends_with("BIN")).collect();
    assert_eq!(names, ["flight/plan.json", "flight/template.toml", "flight/vehicle.toml"]);
}

#[test]
fn what_is_handed_over_says_nothing_of_the_truth() {
    for base in [Base::Airsim, Base::Inflow, Base::Pixel] {
        let known = base.known().unwrap();
        for kind in KINDS.iter().filter(|kind| kind.bases.contains(&base)) {
            let truth = Scenario::draw(5, &cell(Protocol::Enhanced, base, &[kind.name])).unwrap();
            let (hidden, true_one) = (&truth.hidden[0], true_vehicle(&truth, 1).unwrap());
            if kind.foreign {
                assert!(
                    !resolved(&true_one)
                        .unwrap()
                        .iter()
                        .any(|(effect, _)| { effect.definition().name == kind.effect })
                );
                continue;
            }
            let changed = true_one.effects[kind.effect].parameters[&hidden.size];
            assert_eq!(changed, hidden.value(), "{}", kind.name);
            assert_ne!(Some(changed), hidden.before, "{}", kind.name);
            resolved(&true_one).unwrap();
            assert!(known.effects != true_one.effects);
        }
    }
    let truth = Scenario::draw(5, &cell(Protocol::Paper, Base::Airsim, &[])).unwrap();
    let text = planned(&truth).unwrap().template_text;
    assert!(!text.contains("seed"), "{text}");
}

#[test]
fn magnitudes_are_within_their_ranges_and_fill_them() {
    for kind in KINDS {
        for base in kind.bases {
            let drawn: Vec<f64> = (0..40)
                .map(|seed| {
                    let hidden = kind.draw(seed, *base, Protocol::Enhanced, 42.0).unwrap();
                    hidden.words.split(' ').next().unwrap().parse::<f64>().unwrap().abs()
                })
                .collect();
            let (low, high) = kind.range;
            let (least, most) =
                drawn.iter().fold((f64::MAX, 0.0_f64), |(a, b), one| (a.min(*one), b.max(*one)));
            assert!(least >= low * 0.999 && most <= high * 1.001, "{} {drawn:?}", kind.name);
            assert!(least < low * 1.3, "{} {}: {least}", kind.name, base.name());
        }
    }
}

#[test]
fn an_inflow_of_so_many_us_has_this_slope() {
    for seed in 0..10 {
        let hidden = kind_of("rotor-inflow")
            .unwrap()
            .draw(seed, Base::Airsim, Protocol::Paper, 42.0)
            .unwrap();
        let mut vehicle = Base::Airsim.known().unwrap();
        let table = vehicle.effects.entry("rotor-inflow".to_owned()).or_default();
        table.parameters.insert("inflow_share".to_owned(), hidden.value());
        vehicle.airframe.drag_coefficient = 0.0;
        let model = Model::of(&vehicle).unwrap();
        let at = |climb_mps| model.pulse_us(&Signals { climb_mps, ..Signals::default() });
        let slope = (at(1.0) - at(-1.0)) / 2.0;
        let promised: f64 = hidden.words.split(' ').next().unwrap().parse().unwrap();
        assert!((slope / promised - 1.0).abs() < 0.01, "{slope} for {promised}");
    }
}

#[test]
fn enhanced_flights_stagger_charge_and_warmth_and_the_papers_do_not() {
    let mut enhanced = cell(Protocol::Enhanced, Base::Pixel, &["motor-thermal"]);
    enhanced.side = 7;
    let truth = Scenario::draw(2, &enhanced).unwrap();
    let charges = &truth.nuisance.charges;
    let least = charges.iter().copied().fold(f64::MAX, f64::min);
    assert_eq!((charges.len(), least), (49, 0.62));
    assert!(charges.iter().any(|charge| (charge - 1.0).abs() < 1e-9));
    assert_eq!(truth.nuisance.warm.len(), 24);
    let warm = truth.nuisance.warm[0];
    let cold = (1..=49).find(|slot| !truth.nuisance.warm.contains(slot)).unwrap();
    let time_s =
        |slot| true_vehicle(&truth, slot).unwrap().effects["motor-thermal"].parameters["time_s"];
    assert!(time_s(warm) < 2.0 && time_s(cold) >= 60.0);

    let paper = Cell { protocol: Protocol::Paper, ..enhanced };
    let truth = Scenario::draw(2, &paper).unwrap();
    assert!(truth.nuisance.charges.iter().all(|charge| *charge == 1.0));
    assert!(truth.nuisance.warm.is_empty());
}

#[test]
fn a_run_that_hides_something_hides_each_effect_in_its_turn() {
    let chosen: BTreeSet<String> = (0..300)
        .map(|seed| {
            let cell = Cell::hiding_one(seed, Protocol::Enhanced, AirClass::Moderate, Base::Airsim);
            assert_eq!(cell.hidden.len(), 1);
            Scenario::draw(seed, &cell).unwrap().hidden[0].kind.clone()
        })
        .collect();
    let takes = |kind: &&updraft::blind::hide::HiddenKind| {
        !kind.foreign && kind.bases.contains(&Base::Airsim)
    };
    assert_eq!(chosen.len(), KINDS.iter().filter(takes).count());
}

#[test]
fn flights_of_two_tables_never_share_a_seed() {
    let mut seen = BTreeSet::new();
    for table in [1, 2, 999_999, 1_000_000, 1_000_001, 20_270_101] {
        for index in [0, 1, 2, 77, 1_048_575] {
            assert!(seen.insert(flight_seed(table, index).unwrap()), "{table} {index}");
        }
    }
    assert!(flight_seed(1, 1_048_576).is_err() && flight_seed(1 << 44, 0).is_err());
}

#[test]
fn what_cannot_be_hidden_says_why() {
    let error = |base, hidden: &[&str]| {
        Scenario::draw(1, &cell(Protocol::Paper, base, hidden)).unwrap_err().to_string()
    };
    insta::assert_snapshot!(
        [
            error(Base::Airsim, &["batery"]),
            error(Base::Pixel, &["rotor-inflow"]),
            error(Base::Airsim, &["velocity-bias", "velocity-lag"]),
        ]
        .join("\n")
    );
}
