//! What is missing, found in a fleet's flight: `cargo bench --bench gap`.
//!
//! 42 drones fly the paper's ladder once, in the simulator, on a calm field day, with rotor inflow that
//! the model lacks. Their logs are read before the clock runs. With the inflow of a usual rotor nothing
//! has to be flown for the threshold; with a tenth of it the gain is so near to what chance makes that the
//! bootstrap runs, with all its 60 flights.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot run fails")]

use std::path::Path;
use std::sync::LazyLock;

use divan::Bencher;
use rayon::prelude::*;
use updraft::base::time::GpsTime;
use updraft::blind::air::{AirScales, BlindAir};
use updraft::flight::{Flight, FlightOptions};
use updraft::gap::next::predict::matters;
use updraft::gap::next::search::{Aim, Choice, search};
use updraft::gap::next::{self, Known, Question, Sought, ask};
use updraft::gap::{Explained, Flown, Input, Options, explain};
use updraft::log::Log;
use updraft::mission::Plan;
use updraft::mission::plan::Slot;
use updraft::mission::resolve::{Override, resolve};
use updraft::sim::{FlightSetup, Hooks, fly};
use updraft::vehicle::{Vehicle, library::builtin};

/// Rows and columns: the paper's 49 drones less the seven whose logs were lost.
const GRID: [i64; 2] = [6, 7];
const VEHICLE: &str = "airsim-generic-quad";
/// Share of the inflow that is hidden: usual, and hardly to be seen.
const USUAL: f64 = 0.4;
const FAINT: f64 = 0.04;
/// Mean wind, show frame, m/s.
const WIND_MPS: [f64; 2] = [2.0, 1.0];
/// A calm day (docs/blind.md).
const AIR: AirScales = AirScales {
    shared_mps: 0.10,
    length_m: 145.0,
    time_s: 100.0,
    local_mps: 0.066,
    local_s: 8.0,
    wind_mps: WIND_MPS,
    wind_gust_mps: 0.33,
    wind_gust_s: 25.0,
    updraft_mps: 0.0,
};

struct Fleet {
    plan: Plan,
    flights: Vec<(u16, Flight)>,
}

static CLEAR: LazyLock<Fleet> = LazyLock::new(|| flown(USUAL));
static HARDLY: LazyLock<Fleet> = LazyLock::new(|| flown(FAINT));

fn main() {
    divan::main();
}

/// The model: drones differ in thrust, as they do.
fn base() -> Vehicle {
    let mut vehicle = builtin(VEHICLE).unwrap();
    set(&mut vehicle, "thrust-spread", "sd", 0.016);
    vehicle
}

fn set(vehicle: &mut Vehicle, effect: &str, parameter: &str, value: f64) {
    let table = vehicle.effects.entry(effect.to_owned()).or_default();
    table.on = true;
    table.parameters.insert(parameter.to_owned(), value);
}

/// The flights of drones with this inflow.
fn flown(inflow_share: f64) -> Fleet {
    let grid = [Override::new("grid.rows", GRID[0]), Override::new("grid.columns", GRID[1])];
    let plan = resolve("calibration", &grid).unwrap().flights.remove(0).plan;
    let air = BlindAir::new(&AIR, 1);
    let mut vehicle = base();
    set(&mut vehicle, "rotor-inflow", "inflow_share", inflow_share);
    let one = |slot: &Slot| {
        let trajectory = plan.trajectory(slot);
        let setup = FlightSetup {
            vehicle: &vehicle,
            trajectory: &trajectory,
            home_m: slot.home_m.into(),
            frame: plan.site.frame(),
            atmosphere: &air,
            seed: 1,
            drone: slot.slot,
            start: GpsTime { week: 2445, tow_ms: 442_755_000 },
            lights: &[],
            full_logs: false,
            hooks: Hooks::default(),
        };
        let mut bytes = Vec::new();
        fly(&setup, &mut bytes).unwrap();
        let log = Log::from_bytes(bytes);
        let options =
            FlightOptions { segments: Some(plan.segments(slot)), ..FlightOptions::default() };
        (slot.slot, Flight::from_log(&log, Path::new("memory.BIN"), options).unwrap())
    };
    let flights = plan.slots.par_iter().map(one).collect();
    Fleet { plan, flights }
}

fn explained(fleet: &Fleet) -> Explained {
    let flown: Vec<Flown<'_>> =
        fleet.flights.iter().map(|(slot, flight)| Flown { slot: *slot, flight }).collect();
    let vehicle = base();
    let input = Input {
        vehicle: &vehicle,
        plan: Some(&fleet.plan),
        flown: &flown,
        simulated: None,
        table: None,
        logs: fleet.flights.len(),
        left_out: Vec::new(),
    };
    explain(&input, &Options::default()).unwrap()
}

/// One verdict: the gap, the steps, the sizes, what could not be seen.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn inflow_of_a_usual_size_explained(bencher: Bencher<'_, '_>) {
    let fleet = &*CLEAR;
    let first = &explained(fleet).verdict.steps[0];
    assert!(first.finding.effects().contains(&"rotor-inflow"), "{first:?}");
    bencher.bench(|| explained(fleet));
}

/// The same, where the threshold must be found by simulated flights.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn inflow_that_is_hardly_seen_explained(bencher: Bencher<'_, '_>) {
    let fleet = &*HARDLY;
    let gain_nats = explained(fleet).verdict.steps[0].gain_nats;
    assert!((8.0..40.0).contains(&gain_nats), "no bootstrap at {gain_nats}");
    bencher.bench(|| explained(fleet));
}

/// The shortest flight that tells what that verdict leaves open.
#[divan::bench(sample_count = 5, sample_size = 1)]
fn the_next_flight(bencher: Bencher<'_, '_>) {
    let fleet = &*CLEAR;
    let explained = explained(fleet);
    bencher.bench(|| proposed(fleet, &explained));
}

fn proposed(fleet: &Fleet, explained: &Explained) -> Choice {
    let verdict = &explained.verdict;
    let known = Known::new(verdict, explained.model.clone(), WIND_MPS);
    let present = next::Flight::new(&known, fleet.plan.clone()).unwrap();
    let is_asked = |question: &Question| match &question.sought {
        Sought::Seen { effect } => matters(&known, &present, effect).unwrap(),
        _ => true,
    };
    let questions: Vec<Question> = ask(verdict).into_iter().filter(is_asked).collect();
    assert!(!questions.is_empty());
    let limits = &fleet.plan.limits;
    let longest_s = limits.endurance_s * (1.0 - limits.endurance_reserve);
    search(&known, &fleet.plan, VEHICLE, &questions, Aim { z: 5.0, longest_s }).unwrap().unwrap()
}
