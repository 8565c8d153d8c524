//! Random histories of drones: boots, starts that were taken back, aborted and whole flights, logs that
//! go on in one file, cards copied twice, ids that were never set, receivers without time. What is taken
//! is always the log of the start that is meant; else there is a doubt.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use crate::fleet::cards::{Logger, Sortie, later};
use nalgebra::Vector3;
use updraft::base::time::GpsTime;
use updraft::fleet::logs::import::{
    Answers, CardLog, Doubt, Flown, ImportFlight, StartFrom, Survey, decide,
};
use updraft::flight::identity::{Boot, Show};
use updraft::flight::{Belongs, Flight, FlightOptions, Identity, identify};
use updraft::log::Log;
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};

/// Random numbers of a seed.
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((mixed ^ (mixed >> 31)) % end as u64) as usize
    }

    /// One in so many.
    fn one_in(&mut self, count: usize) -> bool {
        self.below(count) == 0
    }
}

const DAY: GpsTime = GpsTime { week: 2445, tow_ms: 300_000_000 };

fn plans() -> [Plan; 2] {
    let grid = [Override::new("grid.rows", 3), Override::new("grid.columns", 2)];
    ["calibration", "hover"].map(|name| resolve(name, &grid).unwrap().flights.remove(0).plan)
}

/// Something that the whole fleet was to fly.
#[derive(Clone, Copy, Debug)]
struct Event {
    start: GpsTime,
    plan: usize,
    /// Share that was flown; 0: taken back before take-off.
    share: f64,
}

/// A drone's slot, and for each of its boots the events that it saw.
type Boots = (u16, Vec<Vec<usize>>);

/// A log, and what is really in it.
struct Truth {
    slot: u16,
    events: Vec<usize>,
}

/// A day of a fleet: its starts in their order, and for each drone its boots with the starts that they
/// saw. `Chance` decides which drone failed when.
fn day(chance: &mut Chance) -> (Vec<Event>, Vec<Boots>) {
    let mut time_s = 0.0;
    let mut events = Vec::new();
    for _ in 0..=chance.below(6) {
        // At least as long as a flight takes.
        time_s += 900.0 + chance.below(5000) as f64;
        let share = [1.0, 1.0, 0.3, 0.05, 0.0][chance.below(5)];
        events.push(Event { start: later(DAY, time_s), plan: chance.below(2), share });
    }
    let drones = (1..=6_u16).map(|slot| {
        let mut boots: Vec<Vec<usize>> = vec![Vec::new()];
        for event in 0..events.len() {
            if chance.one_in(2) {
                boots.push(Vec::new());
            }
            // Some miss a start.
            if !chance.one_in(8) {
                boots.last_mut().unwrap().push(event);
            }
        }
        (slot, boots)
    });
    let drones = drones.collect();
    (events, drones)
}

fn identity(
    plan: &Plan,
    slot: u16,
    chance: &mut Chance,
    events: &[Event],
    seen: &[usize],
) -> Identity {
    let first = events[seen[0]].start;
    let last = seen.last().map(|event| events[*event]).unwrap();
    let booted = later(first, -60.0 - chance.below(300) as f64);
    let home = plan.site.frame().to_geodetic(Vector3::from(plan.slot(slot).unwrap().home_m));
    let has_gps = !chance.one_in(12);
    // Clocks of drones differ by less than a second.
    let shows = seen.iter().map(|event| Show {
        start: later(events[*event].start, chance.below(900) as f64 / 1000.0),
        flown: events[*event].share > 0.0,
    });
    let boot = Boot {
        booted: has_gps.then_some(booted),
        span: has_gps.then(|| (later(first, -7.0), later(last.start, 600.0 * last.share))),
        home: has_gps.then_some(home),
        shows: if has_gps { shows.collect() } else { Vec::new() },
        armed: Vec::new(),
    };
    let system_id = [Some(slot as u8), Some(slot as u8), None, Some(1)][chance.below(4)];
    let flew = seen.iter().any(|event| events[*event].share > 0.0);
    Identity { system_id, flew, boots: vec![boot], ..Identity::default() }
}

fn flight(plan: &Plan, start: Option<GpsTime>) -> ImportFlight {
    ImportFlight {
        name: plan.name.clone(),
        plan: plan.clone(),
        logs: PathBuf::new(),
        slots: BTreeMap::new(),
        files: BTreeMap::new(),
        start,
        record: None,
        is_wanted: true,
    }
}

#[test]
fn what_is_taken_is_of_the_start_that_is_meant() {
    let plans = plans();
    let (mut taken, mut doubted, mut agreed) = (0, 0, 0);
    for seed in 0..4000 {
        let chance = &mut Chance(seed);
        let (events, drones) = day(chance);
        let mut survey = Survey::default();
        let mut truth: Vec<Truth> = Vec::new();
        for (slot, boots) in &drones {
            for seen in boots.iter().filter(|seen| !seen.is_empty()) {
                let own = identity(&plans[0], *slot, chance, &events, seen);
                let has_gps = own.boots[0].span.is_some();
                let flown =
                    seen.iter().map(|event| events[*event]).filter(|event| event.share > 0.0);
                let flown = flown.map(|event| Flown {
                    start: has_gps.then_some(event.start),
                    shares: (0..2)
                        .map(|plan| if plan == event.plan { event.share } else { 0.1 })
                        .collect(),
                });
                let copy_of = None;
                let log = CardLog {
                    path: PathBuf::from(format!("{:03}.BIN", survey.logs.len())),
                    size_bytes: 1000,
                    identity: own,
                    flown: flown.collect(),
                    copy_of,
                    beginning_of: None,
                };
                truth.push(Truth { slot: *slot, events: seen.clone() });
                survey.logs.push(log.clone());
                // Copied twice.
                if chance.one_in(6) {
                    let copy_of = Some(survey.logs.len() - 1);
                    truth.push(Truth { slot: *slot, events: seen.clone() });
                    survey.logs.push(CardLog { copy_of, ..log });
                }
            }
        }
        // The start of each flight is known, or not.
        let known: Vec<Option<usize>> = (0..2)
            .map(|plan| {
                let own = (0..events.len()).filter(|event| events[*event].plan == plan);
                let own: Vec<usize> = own.collect();
                let last = own.last().copied();
                last.filter(|_| chance.one_in(2))
            })
            .collect();
        let flights: Vec<ImportFlight> = (0..2)
            .map(|plan| flight(&plans[plan], known[plan].map(|event| events[event].start)))
            .collect();
        let decision = decide(&survey, &flights, &Answers::default());

        let mut meant: [Option<usize>; 2] = [None, None];
        for plan in 0..2 {
            let Some((start, from)) = decision.starts[plan] else { continue };
            let is_it = |event: &Event| (event.start.total_ms() - start.total_ms()).abs() <= 1000;
            let event = events.iter().position(is_it).unwrap_or_else(|| panic!("seed {seed}"));
            assert_eq!(events[event].plan, plan, "seed {seed}: {events:?}");
            if let StartFrom::Agreed(count) = from {
                agreed += 1;
                // Nothing else of this plan was flown as wholly by more drones.
                let whole = |event: usize| {
                    let saw = drones.iter().filter(|(_, boots)| boots.concat().contains(&event));
                    (events[event].share >= 0.75, saw.count())
                };
                assert!(count <= whole(event).1, "seed {seed}");
                let any_whole =
                    events.iter().any(|event| event.plan == plan && event.share >= 0.75);
                let has_voters = count > 0;
                assert!(whole(event).0 || !any_whole || has_voters, "seed {seed}");
            } else {
                assert_eq!(known[plan], Some(event), "seed {seed}");
            }
            meant[plan] = Some(event);
        }
        let mut slots = BTreeSet::new();
        for take in &decision.take {
            let own = &truth[take.log];
            let event = meant[take.flight].unwrap();
            assert_eq!(own.slot, take.slot, "seed {seed}: another drone's log");
            assert!(own.events.contains(&event), "seed {seed}: a log of another start: {take:?}");
            assert!(slots.insert((take.flight, take.slot)), "seed {seed}: two logs of one slot");
            assert_eq!(survey.logs[take.log].copy_of, None, "seed {seed}");
            taken += 1;
        }
        // And every log of a start that is meant is taken, or doubted.
        for (plan, event) in meant.iter().enumerate() {
            let Some(event) = event else { continue };
            for (index, own) in truth.iter().enumerate() {
                let log = &survey.logs[index];
                if !own.events.contains(event) || log.copy_of.is_some() {
                    continue;
                }
                let is_taken = slots.contains(&(plan, own.slot));
                let is_doubt = |doubt: &Doubt| match doubt {
                    Doubt::Log { logs, .. } => logs.contains(&index),
                    Doubt::Slot { log, .. } | Doubt::Flight { log, .. } => *log == index,
                    Doubt::Start { .. } => false,
                };
                let doubted_here = decision.doubts.iter().any(is_doubt);
                doubted += usize::from(doubted_here);
                // Of a drone that says neither its number nor where it stood nobody knows the slot.
                let is_nobody = log.identity.boots[0].home.is_none()
                    && log.identity.system_id != u8::try_from(own.slot).ok();
                assert!(is_taken || doubted_here || is_nobody, "seed {seed}: log {index} is lost");
            }
        }
    }
    println!("{taken} taken, {doubted} doubted, {agreed} starts agreed");
    assert!(taken > 10_000 && doubted > 300 && agreed > 1000, "{taken} {doubted} {agreed}");
}

/// The same from bytes: what a log says belongs to it is what it holds.
#[test]
fn logs_belong_to_the_starts_they_saw_and_to_no_other() {
    let plans = [("calibration", 4.0), ("hover", 20.0)].map(|(name, hover_s)| {
        let mut own = vec![Override::new("grid.rows", 1), Override::new("grid.columns", 2)];
        own.extend(match name {
            "hover" => vec![Override::new("height_m", 15.0), Override::new("duration_s", hover_s)],
            _ => vec![
                Override::new("speeds_mps", vec![1.0]),
                Override::new("leg_s", 8.0),
                Override::new("hover_s", hover_s),
                Override::new("window.length_s", 4.0),
            ],
        });
        resolve(name, &own).unwrap().flights.remove(0).plan
    });
    let (mut yes, mut no) = (0, 0);
    for seed in 0..60 {
        let chance = &mut Chance(seed);
        let (events, drones) = day(chance);
        for (slot, boots) in drones.into_iter().take(2) {
            for seen in boots.iter().filter(|seen| !seen.is_empty()) {
                let booted = later(events[seen[0]].start, -60.0 - chance.below(300) as f64);
                let mut logger = Logger::of(slot, booted);
                logger.has_show = !chance.one_in(4);
                let sortie = |event: &usize| Sortie {
                    plan: &plans[events[*event].plan],
                    start: events[*event].start,
                    share: events[*event].share,
                };
                let sorties: Vec<Sortie<'_>> = seen.iter().map(sortie).collect();
                let log = Log::from_bytes(logger.log(&sorties));
                let identity = identify(&log);
                for (index, event) in events.iter().enumerate() {
                    let found = identity.belongs_to(event.start);
                    // Without a show clock a start between two that the log saw is in its time, too.
                    let between = seen.first() < Some(&index) && seen.last() > Some(&index);
                    let expected = seen.contains(&index) || (between && !logger.has_show);
                    assert_eq!(
                        found == Belongs::Yes,
                        expected,
                        "seed {seed}, {event:?}: {found:?}"
                    );
                    assert!(!matches!(found, Belongs::Unknown(_)), "seed {seed}: {found:?}");
                    (yes, no) = (yes + usize::from(expected), no + usize::from(!expected));
                    if !seen.contains(&index) {
                        continue;
                    }
                    // And the part that is read is the one of that start, or none.
                    let options =
                        FlightOptions { start: Some(event.start), ..FlightOptions::default() };
                    let path = PathBuf::from("x.BIN");
                    match Flight::from_log(&log, &path, options) {
                        Ok(flight) if event.share > 0.0 => {
                            let start = flight.clock.start.unwrap();
                            let off_ms = start.total_ms() - event.start.total_ms();
                            assert!(off_ms.abs() < 100, "seed {seed}: {off_ms} ms off, {event:?}");
                            let rose = flight.height_m.value.iter().copied().fold(0.0, f64::max);
                            assert!(rose > 0.5, "seed {seed}: it did not rise");
                        }
                        Ok(_) => panic!("seed {seed}: {event:?} was not flown"),
                        Err(error) => assert!(event.share < 0.1, "seed {seed} {event:?}: {error}"),
                    }
                }
            }
        }
    }
    assert!(yes > 100 && no > 100, "{yes} {no}");
}
