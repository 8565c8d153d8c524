//! Flights in foreign worlds: drawn, flown into a folder like any other, read, and the same bytes again.

#![expect(clippy::unwrap_used, reason = "a test that cannot fly fails")]

use std::path::Path;

use updraft::blind::fly::fly;
use updraft::blind::series::Settings;
use updraft::blind::tables::FOREIGN_KINDS;
use updraft::blind::worlds::known;
use updraft::blind::{AirClass, Base, Cell, Protocol, Scenario, Worlds};
use updraft::gap::Dependence;
use updraft::log::{Log, Select};

fn cell(base: Base, hidden: &[&str]) -> Cell {
    Cell {
        worlds: Worlds::Foreign,
        protocol: Protocol::Paper,
        air: AirClass::Moderate,
        base,
        hidden: hidden.iter().map(|name| (*name).to_owned()).collect(),
        side: 3,
        columns: None,
    }
}

fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| (path.display().to_string(), std::fs::read(&path).unwrap()))
        .map(|(name, bytes)| (name.rsplit('/').next().unwrap_or_default().to_owned(), bytes))
        .collect();
    found.sort();
    found
}

#[test]
fn a_foreign_flight_is_a_folder_like_any_other_on_any_number_of_threads() {
    let flown: Vec<_> = [1, 2]
        .into_iter()
        .map(|threads| {
            let folder = tempfile::tempdir().unwrap();
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let truth = Scenario::draw(12, &cell(Base::Airsim, &["voltage", "icing"])).unwrap();
            let flown = pool.install(|| fly(&truth, folder.path(), None)).unwrap();
            assert_eq!(flown.lost, 0);
            assert_eq!(flown.logs + truth.nuisance.missing.len(), 9);
            let names: Vec<String> =
                bytes(folder.path()).into_iter().map(|(name, _)| name).collect();
            assert_eq!(names, ["plan.json", "template.toml", "vehicle.toml"]);
            bytes(&folder.path().join("logs"))
        })
        .collect();
    assert!(flown[0] == flown[1]);
    let log = Log::from_bytes(flown[0][0].1.clone());
    let (tables, damage) = log.select(&[Select { message: "RCOU", fields: &["C1"] }]);
    assert_eq!(damage.bad_bytes, 0);
    let pulses = tables[0].number("C1").unwrap();
    assert!(pulses.len() > 4_000 && pulses.iter().any(|pulse| *pulse > 1_400.0));
}

#[test]
fn every_foreign_kind_is_drawn_for_its_bases_and_sealed_with_its_world() {
    for kind in FOREIGN_KINDS {
        for base in kind.bases {
            let truth = Scenario::draw(9, &cell(*base, &[kind.name])).unwrap();
            let hidden = &truth.hidden[0];
            assert_eq!(hidden.foreign, kind.like.is_none());
            assert!(hidden.parameters.contains_key(&hidden.size), "{hidden:?}");
            let text = serde_json::to_string(&truth).unwrap();
            let again: Scenario = serde_json::from_str(&text).unwrap();
            assert_eq!(again, truth);
            // What is handed over does not depend on what is hidden.
            let nothing = Scenario::draw(9, &cell(*base, &[])).unwrap();
            let vehicle = |truth: &Scenario| {
                known::vehicle(truth.world.as_ref().unwrap(), &truth.cell).unwrap().vehicle
            };
            if *base == Base::Airsim {
                assert_eq!(vehicle(&truth), vehicle(&nothing), "{}", kind.name);
            }
        }
    }
    let drift = Scenario::draw(9, &cell(Base::Pixel, &["drift"])).unwrap();
    assert_eq!(drift.hidden[0].depends_on, [Dependence::ClimbTime]);
    assert!(Scenario::draw(9, &cell(Base::Pixel, &["inflow"])).is_err());
    assert!(Scenario::draw(9, &cell(Base::Airsim, &["rotor-inflow"])).is_err());
}

#[test]
fn home_truths_say_nothing_of_worlds() {
    let home = Cell { worlds: Worlds::Home, ..cell(Base::Airsim, &["step"]) };
    let text = serde_json::to_string(&Scenario::draw(9, &home).unwrap()).unwrap();
    assert!(
        !text.contains("world") && !text.contains("depends_on") && !text.contains("left_over"),
        "{text}"
    );
    assert!(
        !home.name().contains("home") && cell(Base::Airsim, &[]).name().starts_with("foreign-")
    );
}

#[test]
fn both_worlds_have_their_cells() {
    let settings = Settings {
        worlds: vec![Worlds::Home, Worlds::Foreign],
        protocols: vec![Protocol::Paper],
        airs: vec![AirClass::Calm],
        bases: vec![Base::Airsim, Base::Inflow, Base::Pixel],
        hidden: vec![vec![], vec!["step".to_owned()], vec!["icing".to_owned()]],
        flights: 1,
        seed: 3,
        side: 3,
        tuning: true,
    };
    let cells = settings.cells().unwrap();
    let count = |worlds| cells.iter().filter(|cell| cell.worlds == worlds).count();
    // Nothing and a step on three bases; nothing and icing on two plants.
    assert_eq!((count(Worlds::Home), count(Worlds::Foreign)), (6, 4));
}
