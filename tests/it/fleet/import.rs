//! Logs from cards find their flights and slots by what is inside.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::fleet::cards::{Logger, Sortie, later};
use updraft::base::time::GpsTime;
use updraft::campaign::start::StartRecord;
use updraft::fleet::logs::import::{
    Answers, Carried, CarriedOut, Carry, Decision, Doubt, ImportFlight, StartFrom, Survey, Take,
    carry_out, decide, survey,
};
use updraft::fleet::logs::manifest::Shelf;
use updraft::fleet::logs::verify::verify;
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};

/// The start of a flight of these tests.
const START: GpsTime = GpsTime { week: 2445, tow_ms: 442_755_000 };

fn plan(name: &str, side: i64) -> Plan {
    let grid = [Override::new("grid.rows", side), Override::new("grid.columns", side)];
    let own = match name {
        "hover" => vec![Override::new("height_m", 15.0), Override::new("duration_s", 40.0)],
        _ => vec![
            Override::new("speeds_mps", vec![1.0, 2.0]),
            Override::new("leg_s", 10.0),
            Override::new("hover_s", 4.0),
            Override::new("window.length_s", 5.0),
        ],
    };
    resolve(name, &[&grid[..], &own].concat()).unwrap().flights.remove(0).plan
}

fn flight(plan: &Plan, folder: &Path, start: Option<GpsTime>) -> ImportFlight {
    let files = plan.slots.iter().map(|slot| (slot.slot, format!("{:02}.BIN", slot.slot)));
    ImportFlight {
        name: plan.name.clone(),
        plan: plan.clone(),
        logs: folder.join(&plan.name).join("logs"),
        slots: BTreeMap::new(),
        files: files.collect(),
        start,
        record: None,
        is_wanted: true,
    }
}

const CARRY: fn() -> Carry = || Carry { again: false, made_by: "test".to_owned(), unix_s: 0 };

fn put(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(&path, bytes).unwrap();
    path
}

fn whole(plan: &Plan, start: GpsTime) -> Sortie<'_> {
    Sortie { plan, start, share: 1.0 }
}

struct Tried {
    found: Survey,
    decision: Decision,
    outcomes: Vec<(Take, Carried)>,
    missing: Vec<BTreeSet<u16>>,
}

impl Tried {
    fn of(cards: &Path, flights: &[ImportFlight], how: &Carry) -> Self {
        let found = survey(&[cards.to_owned()], flights, &|_| {}).unwrap();
        let decision = decide(&found, flights, &Answers::default());
        let CarriedOut { outcomes, missing } = carry_out(&decision, &found, flights, how).unwrap();
        Self { found, decision, outcomes, missing }
    }

    /// (flight, slot, file below the cards).
    fn taken(&self, cards: &Path) -> Vec<(usize, u16, String)> {
        let path = |take: &Take| self.found.logs[take.log].path.strip_prefix(cards).unwrap();
        (self.outcomes.iter())
            .filter(|(_, outcome)| matches!(outcome, Carried::Taken(..)))
            .map(|(take, _)| (take.flight, take.slot, path(take).display().to_string()))
            .collect()
    }

    /// `file: why`.
    fn left(&self, cards: &Path) -> String {
        let below = |path: &Path| path.strip_prefix(cards).unwrap().display().to_string();
        let mut left: Vec<String> = (self.decision.left.iter())
            .map(|(log, why)| format!("{}: {why}", below(&self.found.logs[*log].path)))
            .collect();
        left.extend(
            self.found.unreadable.iter().map(|(path, why)| format!("{}: {why}", below(path))),
        );
        left.sort();
        left.join("\n").replace(&format!("{}/", cards.display()), "")
    }
}

#[test]
fn each_log_goes_to_the_flight_that_it_flew() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let (calibration, hover) = (plan("calibration", 2), plan("hover", 2));
    let (morning, noon) = (later(START, -3000.0), START);
    let last_week = later(START, -7.0 * 86_400.0);
    for slot in 1..=4 {
        let drone = |booted: f64| Logger::of(slot, later(START, booted));
        let name = |number: u32| format!("{slot}/APM/LOGS/{number:08}.BIN");
        let week = drone(-7.0 * 86_400.0 - 90.0).log(&[whole(&hover, last_week)]);
        let week = if slot == 4 { Vec::new() } else { week };
        put(&cards, &name(1), &week);
        put(&cards, &name(2), &drone(-3100.0).log(&[whole(&calibration, morning)]));
        let aborted = Sortie { plan: &hover, start: later(noon, -400.0), share: 0.3 };
        put(&cards, &name(3), &drone(-500.0).log(&[aborted]));
        put(&cards, &name(4), &drone(-100.0).log(&[whole(&hover, noon)]));
    }
    let flights = [flight(&calibration, folder.path(), None), flight(&hover, folder.path(), None)];
    let tried = Tried::of(&cards, &flights, &CARRY());
    // Last week's are of three drones, today's of four.
    let agreed = |start| Some((start, StartFrom::Agreed(4)));
    assert_eq!(tried.decision.starts, [agreed(morning), agreed(noon)]);
    let mut expected = Vec::new();
    for (index, number) in [(0, 2), (1, 4)] {
        expected
            .extend((1..=4).map(|slot| (index, slot, format!("{slot}/APM/LOGS/{number:08}.BIN"))));
    }
    assert_eq!(tried.taken(&cards), expected);
    assert_eq!(tried.missing, [BTreeSet::new(), BTreeSet::new()]);
    assert_eq!(tried.decision.doubts, []);
    insta::assert_snapshot!(tried.left(&cards));
    for flight in &flights {
        let checked = verify(&flight.logs).unwrap();
        assert_eq!(checked.len(), 4);
        assert!(checked.iter().all(|one| one.faults.is_empty()));
        let bound = Shelf::open(&flight.logs, "test").unwrap().manifest.logs.remove(0).flight;
        let bound = bound.unwrap();
        assert_eq!((bound.number, bound.authorized_start), (0, None));
        assert!(bound.booted.is_some() && bound.gps_start.is_some());
    }
    // Again: they are home.
    let again = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(again.outcomes.len(), 8);
    assert!(again.outcomes.iter().all(|(_, outcome)| *outcome == Carried::There(None)));
}

#[test]
fn a_start_that_was_written_down_counts_more_than_what_most_cards_hold() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    for slot in 1..=4 {
        let drone = Logger::of(slot, later(START, -2000.0));
        put(&cards, &format!("{slot}/1.BIN"), &drone.log(&[whole(&hover, later(START, -1204.0))]));
        let drone = Logger::of(slot, later(START, -60.0));
        // Only one flew the start that is meant, and only a part of it; one did not even take off.
        if slot <= 2 {
            let share = if slot == 1 { 0.4 } else { 0.0 };
            let sortie = Sortie { plan: &hover, start: START, share };
            put(&cards, &format!("{slot}/2.BIN"), &drone.log(&[sortie]));
        }
    }
    let flights = [flight(&hover, folder.path(), Some(START))];
    let tried = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(tried.taken(&cards), [(0, 1, "1/2.BIN".into()), (0, 2, "2/2.BIN".into())]);
    assert_eq!(tried.missing, [BTreeSet::from([3, 4])]);
    let left = "1/1.BIN: its show began 1,204 s before hover's start\n";
    assert!(tried.left(&cards).starts_with(left), "{}", tried.left(&cards));
}

#[test]
fn swapped_cards_same_names_copies_and_damage() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 3);
    let log = |slot| Logger::of(slot, later(START, -60.0)).log(&[whole(&hover, START)]);
    // The cards of drones 3 and 5 lie in each other's folders; all have the same file name.
    put(&cards, "drone-5/00000001.BIN", &log(3));
    put(&cards, "drone-3/00000001.BIN", &log(5));
    put(&cards, "drone-1/00000001.BIN", &log(1));
    put(&cards, "drone-1/copy/00000001.BIN", &log(1));
    // Ids that were never set: where it stood tells.
    let unset = Logger { system: Some(1), ..Logger::of(9, later(START, -60.0)) };
    put(&cards, "drone-9/00000001.BIN", &unset.log(&[whole(&hover, START)]));
    let nameless = Logger { system: None, ..Logger::of(8, later(START, -60.0)) };
    put(&cards, "drone-8/00000001.BIN", &nameless.log(&[whole(&hover, START)]));
    // Cut off in the air, and only its beginning copied once more.
    let cut = log(2);
    put(&cards, "drone-2/00000001.BIN", &cut[..cut.len() * 2 / 3]);
    put(&cards, "drone-2/half/00000001.BIN", &cut[..cut.len() / 3]);
    // Put down between two homes, as its pilot could: its id tells.
    let between = Logger { offset_m: 3.6, ..Logger::of(4, later(START, -60.0)) };
    put(&cards, "drone-4/00000001.BIN", &between.log(&[whole(&hover, START)]));
    put(&cards, "drone-7/00000001.BIN", b"no log");
    put(&cards, "drone-7/._00000002.BIN", b"no log, and nobody's");
    put(&cards, "drone-7/notes.txt", b"x");
    let flights = [flight(&hover, folder.path(), None)];
    let tried = Tried::of(&cards, &flights, &CARRY());
    let taken: Vec<(u16, String)> =
        tried.taken(&cards).into_iter().map(|(_, slot, file)| (slot, file)).collect();
    let expected = [
        (1, "drone-1/00000001.BIN"),
        (2, "drone-2/00000001.BIN"),
        (3, "drone-5/00000001.BIN"),
        (4, "drone-4/00000001.BIN"),
        (5, "drone-3/00000001.BIN"),
        (8, "drone-8/00000001.BIN"),
        (9, "drone-9/00000001.BIN"),
    ];
    assert_eq!(taken, expected.map(|(slot, file)| (slot, file.to_owned())));
    assert_eq!(tried.missing, [BTreeSet::from([6, 7])]);
    assert_eq!(tried.decision.doubts, []);
    insta::assert_snapshot!(tried.left(&cards));
    let entry = |slot: u16| {
        let shelf = Shelf::open(&flights[0].logs, "test").unwrap();
        shelf.entry(&format!("{slot:02}.BIN")).unwrap().clone()
    };
    assert_eq!(entry(2).incomplete.as_deref(), Some("it ends in the middle of a message"));
    assert_eq!((entry(1).incomplete, entry(1).boot), (None, Some(1)));
}

#[test]
fn where_it_stood_tells_unless_a_table_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 3);
    // Ids in any order: drone 7 stood on slot 2.
    let other = Logger { system: Some(7), ..Logger::of(2, later(START, -60.0)) };
    put(&cards, "1.BIN", &other.log(&[whole(&hover, START)]));
    let mut flights = [flight(&hover, folder.path(), Some(START))];
    let slot = |flights: &[ImportFlight]| {
        let found = survey(std::slice::from_ref(&cards), flights, &|_| {}).unwrap();
        let decision = decide(&found, flights, &Answers::default());
        (decision.take.first().map(|take| take.slot), decision.doubts)
    };
    assert_eq!(slot(&flights), (Some(2), vec![]));
    flights[0].slots = BTreeMap::from([(7, 2)]);
    assert_eq!(slot(&flights), (Some(2), vec![]));
    flights[0].slots = BTreeMap::from([(7, 7)]);
    let (taken, doubts) = slot(&flights);
    assert_eq!(taken, None);
    let [Doubt::Slot { why, .. }] = doubts.as_slice() else { panic!("{doubts:?}") };
    let said = "its system id belongs to slot 7, but it stood 0.3 m from the home of slot 2 and ";
    assert!(why.starts_with(said), "{why}");
}

#[test]
fn two_flights_that_fit_equally_are_a_persons_to_choose() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    let second = later(START, 900.0);
    for slot in 1..=4 {
        // Two whole flights, in one boot and one file.
        let drone = Logger::of(slot, later(START, -60.0));
        let log = drone.log(&[whole(&hover, START), whole(&hover, second)]);
        put(&cards, &format!("{slot}.bin"), &log);
    }
    let mut flights = [flight(&hover, folder.path(), None)];
    let tried = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(tried.outcomes, []);
    let doubt = Doubt::Start { flight: 0, starts: vec![(START, 4), (second, 4)] };
    assert_eq!(tried.decision.doubts, [doubt]);
    // The answer, and the same said beforehand.
    let answers = Answers { starts: BTreeMap::from([(0, second)]), ..Answers::default() };
    let decision = decide(&tried.found, &flights, &answers);
    assert_eq!((decision.take.len(), decision.doubts.len()), (4, 0));
    flights[0].start = Some(second);
    assert_eq!(Tried::of(&cards, &flights, &CARRY()).taken(&cards).len(), 4);
}

#[test]
fn two_logs_of_one_slot_are_a_persons_to_choose() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    let of = |booted: f64| Logger::of(1, later(START, booted)).log(&[whole(&hover, START)]);
    put(&cards, "a.BIN", &of(-60.0));
    put(&cards, "b.BIN", &of(-90.0));
    let flights = [flight(&hover, folder.path(), Some(START))];
    let tried = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(tried.outcomes, []);
    let [Doubt::Log { slot: 1, logs, why, .. }] = tried.decision.doubts.as_slice() else {
        panic!("{:?}", tried.decision.doubts)
    };
    assert_eq!((logs.as_slice(), why.as_str()), (&[0, 1][..], "they fit equally"));
    let answers = Answers { logs: BTreeMap::from([((0, 1), Some(1))]), ..Answers::default() };
    let decision = decide(&tried.found, &flights, &answers);
    assert_eq!(decision.take, [Take { flight: 0, slot: 1, log: 1 }]);
}

#[test]
fn of_logs_of_one_start_the_one_that_flew_the_plan_is_taken() {
    // As simulated flights are: all of a campaign begin at the same time.
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let (calibration, hover) = (plan("calibration", 2), plan("hover", 2));
    for slot in 1..=4 {
        let drone = Logger::of(slot, later(START, -60.0));
        put(&cards, &format!("{slot}/1.BIN"), &drone.log(&[whole(&hover, START)]));
        put(&cards, &format!("{slot}/2.BIN"), &drone.log(&[whole(&calibration, START)]));
    }
    for start in [None, Some(START)] {
        let folder = folder.path().join(start.map_or("agreed", |_| "known"));
        let flights = [flight(&calibration, &folder, start), flight(&hover, &folder, start)];
        let tried = Tried::of(&cards, &flights, &CARRY());
        assert_eq!(tried.decision.doubts, []);
        let mut expected: Vec<_> = (1..=4).map(|slot| (0, slot, format!("{slot}/2.BIN"))).collect();
        expected.extend((1..=4).map(|slot| (1, slot, format!("{slot}/1.BIN"))));
        assert_eq!(tried.taken(&cards), expected);
    }
}

#[test]
fn a_log_without_time_is_not_taken_unasked() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    let timeless = Logger { has_gps: false, ..Logger::of(1, START) };
    put(&cards, "1.BIN", &timeless.log(&[whole(&hover, later(START, 60.0))]));
    for (start, why) in [
        (Some(later(START, 60.0)), "it has no GPS time"),
        (None, "it flew the plan, but has no GPS time: it may be of another day"),
    ] {
        let flights = [flight(&hover, folder.path(), start)];
        let tried = Tried::of(&cards, &flights, &CARRY());
        assert_eq!(tried.outcomes, []);
        let [Doubt::Log { why: said, .. }] = tried.decision.doubts.as_slice() else {
            panic!("{:?}", tried.decision)
        };
        assert_eq!(said, why);
    }
}

#[test]
fn logs_at_home_of_another_start_make_room_and_nothing_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    let log = |slot, start| Logger::of(slot, later(start, -60.0)).log(&[whole(&hover, start)]);
    let second = later(START, 900.0);
    let (first_log, second_log) = (log(1, START), log(1, second));
    let record = |start| -> StartRecord {
        let text = serde_json::json!({
            "schema": "updraft.start/2", "made_by": "test", "start": start,
            "number": if start == START { 1 } else { 2 },
        });
        serde_json::from_value(text).unwrap()
    };
    let wanted = |start| ImportFlight {
        record: Some(record(start)),
        ..flight(&hover, folder.path(), Some(start))
    };
    let home = wanted(START).logs;
    put(&cards, "first/1.BIN", &first_log);
    let tried = Tried::of(&cards, &[wanted(START)], &CARRY());
    assert_eq!(tried.outcomes.len(), 1);
    // The next start: the log of the first one goes to its folder.
    put(&cards, "second/1.BIN", &second_log);
    for again in [false, true] {
        put(&home, "flight-1/start.json", &serde_json::to_vec(&record(START)).unwrap());
        let how = Carry { again, ..CARRY() };
        let tried = Tried::of(&cards, &[wanted(second)], &how);
        assert_eq!(fs::read(home.join("01.BIN")).unwrap(), second_log);
        assert_eq!(fs::read(home.join("flight-1/01.BIN")).unwrap(), first_log);
        let outcome = &tried.outcomes[0].1;
        if again {
            assert_eq!(*outcome, Carried::There(None), "the same log is not copied again");
        } else {
            let Carried::Taken(_, moved) = outcome else { panic!("{outcome:?}") };
            assert_eq!(moved.as_deref(), Some(home.join("flight-1/01.BIN").as_path()));
        }
    }
    // Another log of the same start stays, unless it is asked for; then it is kept.
    let other = Logger::of(1, later(second, -95.0)).log(&[whole(&hover, second)]);
    fs::write(home.join("01.BIN"), &other).unwrap();
    fs::remove_file(home.join("manifest.json")).unwrap();
    let tried = Tried::of(&cards, &[wanted(second)], &CARRY());
    let Carried::Left(why) = &tried.outcomes[0].1 else { panic!("{:?}", tried.outcomes) };
    assert_eq!(why, "01.BIN of the same start is already here (--again replaces it)");
    let how = Carry { again: true, ..CARRY() };
    Tried::of(&cards, &[wanted(second)], &how);
    assert_eq!(fs::read(home.join("01.BIN")).unwrap(), second_log);
    assert_eq!(fs::read(home.join("older/01-replaced-1.BIN")).unwrap(), other);
    // The beginning of a log gives way to the whole.
    fs::write(home.join("01.BIN"), &second_log[..second_log.len() / 2]).unwrap();
    fs::remove_file(home.join("manifest.json")).unwrap();
    Tried::of(&cards, &[wanted(second)], &CARRY());
    assert_eq!(fs::read(home.join("01.BIN")).unwrap(), second_log);
    assert_eq!(
        fs::read(home.join("older/01-shorter-1.BIN")).unwrap(),
        &second_log[..second_log.len() / 2]
    );
}

#[test]
fn a_boot_that_contradicts_the_start_is_a_doubt() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let hover = plan("hover", 2);
    put(&cards, "1.BIN", &Logger::of(1, later(START, -60.0)).log(&[whole(&hover, START)]));
    for (booted, doubts) in [(-60.0, 0), (-400.0, 1)] {
        let text = serde_json::json!({
            "schema": "updraft.start/2", "made_by": "test", "start": START, "number": 1,
            "drones": [{ "slot": 1, "drone": "1", "booted": later(START, booted) }],
        });
        let flights = [ImportFlight {
            record: Some(serde_json::from_value(text).unwrap()),
            ..flight(&hover, folder.path(), Some(START))
        }];
        let found = survey(std::slice::from_ref(&cards), &flights, &|_| {}).unwrap();
        let decision = decide(&found, &flights, &Answers::default());
        assert_eq!((decision.take.len(), decision.doubts.len()), (1 - doubts, doubts));
    }
}

#[test]
fn a_card_that_is_not_there_is_an_error_and_an_empty_one_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let flights = [flight(&plan("hover", 2), folder.path(), None)];
    let gone = folder.path().join("card-7");
    let error = survey(std::slice::from_ref(&gone), &flights, &|_| {}).unwrap_err();
    assert_eq!(error.path, gone);
    let empty = folder.path().join("card-8");
    fs::create_dir(&empty).unwrap();
    let found = survey(std::slice::from_ref(&empty), &flights, &|_| {}).unwrap();
    assert_eq!((found.empty, found.logs.len()), (vec![empty], 0));
}

/// Both flights of 49 drones, an aborted one, last week's and one on the bench, swapped cards.
#[test]
fn forty_nine_cards_of_two_flights() {
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    let (calibration, hover) = (plan("calibration", 7), plan("hover", 7));
    let (morning, aborted_at) = (later(START, -3000.0), later(START, -500.0));
    let mut expected = [Vec::new(), Vec::new()];
    for slot in 1..=49_u16 {
        let drone = |booted: f64| Logger::of(slot, later(START, booted));
        // Cards are put back in any order, and counters of logs differ.
        let card = (slot * 17) % 49;
        let mut number = u32::from(slot) * 3;
        let mut add = |bytes: Vec<u8>| {
            number += 1;
            put(&cards, &format!("{card}/{number:08}.BIN"), &bytes);
            format!("{card}/{number:08}.BIN")
        };
        if slot % 3 == 0 {
            let start = later(START, -6.9 * 86_400.0);
            add(drone(-6.9 * 86_400.0 - 60.0).log(&[whole(&hover, start)]));
        }
        add(drone(-9000.0).log(&[Sortie {
            plan: &hover,
            start: later(START, -8900.0),
            share: 0.0,
        }]));
        let calibrated = whole(&calibration, morning);
        let aborted = Sortie { plan: &hover, start: aborted_at, share: 0.2 };
        if slot % 5 == 0 {
            // It was not switched off: one boot, one file.
            let one = add(drone(-3200.0).log(&[calibrated, aborted, whole(&hover, START)]));
            expected[0].push((0, slot, one.clone()));
            expected[1].push((1, slot, one));
        } else {
            let file = add(drone(-3200.0).log(&[calibrated]));
            expected[0].push((0, slot, file));
            let both = slot % 5 == 1;
            let start = whole(&hover, START);
            if both {
                let file = add(drone(-700.0).log(&[aborted, start]));
                expected[1].push((1, slot, file));
            } else {
                add(drone(-700.0).log(&[aborted]));
                let file = add(drone(-100.0).log(&[start]));
                expected[1].push((1, slot, file));
            }
        }
    }
    let flights = [flight(&calibration, folder.path(), None), flight(&hover, folder.path(), None)];
    let tried = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(tried.decision.doubts, []);
    assert_eq!(tried.taken(&cards), expected.concat());
    assert_eq!(tried.missing, [BTreeSet::new(), BTreeSet::new()]);
    // One flight alone: the others' logs are told apart all the same.
    let other = folder.path().join("other");
    let mut flights = [flight(&calibration, &other, None), flight(&hover, &other, None)];
    flights[0].is_wanted = false;
    let tried = Tried::of(&cards, &flights, &CARRY());
    assert_eq!(tried.taken(&cards), expected[1]);
    assert!(tried.left(&cards).contains("it belongs to calibration"));
}
