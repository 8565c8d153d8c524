//! The trim is what the simulator flies: the closed loop, with the autopilot's whole microseconds and all, against the
//! state in which the loads balance, at the moments that were flown.

#![expect(clippy::print_stdout, reason = "the numbers are the point of a closer look")]

use std::io;

use dataflash::time::GpsTime;
use multirotor_sim::effects::active::deviation;
use multirotor_sim::effects::select::values_of;
use multirotor_sim::effects::{LIBRARY, Reference, Role, Signals, Supply, find};
use multirotor_sim::sim::plant::trim::{Condition, Trim};
use multirotor_sim::sim::recorder::{Moment, Recorder};
use multirotor_sim::sim::{FlightSetup, Hooks, Uniform, fly_with};
use multirotor_sim::vehicle::Vehicle;
use multirotor_sim::vehicle::library::{builtin, names};
use nalgebra::Vector3;
use skybrush_show::frame::{Geodetic, ShowFrame};
use skybrush_show::{Segment, SegmentPath, Trajectory};

use crate::effects::support::vehicle;

/// How far the trim may be off, us and degrees: what the users of the trim count on.
const PULSE_US: f64 = 0.05;
const LEAN_DEG: f64 = 0.01;
/// A leg takes this long to become steady, s.
const SETTLING_S: f64 = 9.0;
const SEED: u64 = 3;
const DRONE: u16 = 5;

/// Vertical legs at these speeds of 16 s each, of which the steady part is looked at.
fn legs(speeds_mps: &[f64]) -> (Trajectory, Vec<(f64, f64)>) {
    let (mut segments, mut windows) = (Vec::new(), Vec::new());
    let (mut time_s, mut height_m) = (0.0, 0.0);
    let mut leg = |duration_s: f64, to_m: f64, time_s: &mut f64| {
        let path = SegmentPath::Line(Vector3::new(0.0, 0.0, to_m));
        segments.push(Segment { duration_ms: (duration_s * 1000.0) as u32, path });
        *time_s += duration_s;
    };
    leg(4.0, 3.0, &mut time_s);
    leg(40.0, 90.0, &mut time_s);
    height_m += 90.0;
    for speed in speeds_mps {
        leg(8.0, height_m, &mut time_s);
        height_m += 16.0 * speed;
        leg(16.0, height_m, &mut time_s);
        windows.push((time_s - 16.0 + SETTLING_S, time_s - 0.5));
    }
    leg(10.0, height_m, &mut time_s);
    leg(60.0, 3.0, &mut time_s);
    (Trajectory { start_m: Vector3::zeros(), segments }, windows)
}

/// Sums over one window: count, and the trim's difference from what was flown.
#[derive(Clone, Copy, Debug, Default)]
struct Off {
    count: f64,
    pulse_us: f64,
    lean: [f64; 2],
    climb_mps: f64,
}

/// What is flown, and the trim that it is held against.
struct Compared {
    trim: Trim,
    windows: Vec<(f64, f64)>,
    off: Vec<Off>,
    turning_us: Option<i64>,
}

impl Recorder for Compared {
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()> {
        if moment.plant.rotors().total_output() == 0.0 {
            return Ok(());
        }
        let turning_us = *self.turning_us.get_or_insert(moment.time_us);
        let time_s = moment.time_us as f64 * 1e-6;
        let within = |window: &(f64, f64)| time_s >= window.0 && time_s < window.1;
        let Some(index) = self.windows.iter().position(within) else { return Ok(()) };
        let motion = moment.plant.motion();
        let battery = moment.plant.battery();
        let condition = Condition {
            velocity_mps: motion.velocity_mps,
            air_mps: moment.around.air_velocity_mps,
            acceleration_mps2: motion.acceleration_mps2,
            density_ratio: moment.around.density_ratio,
            position_m: motion.position_m,
            heading_rad: motion.rotation[(1, 0)].atan2(motion.rotation[(0, 0)]),
            time_s: (moment.time_us - turning_us) as f64 * 1e-6,
            supply: Supply::Used(battery.map_or(0.0, |battery| battery.used_ah)),
            neighbours: None,
        };
        let trimmed = self.trim.at(&condition).expect("what is flown is possible");
        let pulses = moment.pilot.motors.pulses_us.map(f64::from);
        let up = motion.rotation.column(2);
        let off = &mut self.off[index];
        off.count += 1.0;
        off.pulse_us += trimmed.pulse_us - pulses.iter().sum::<f64>() / 4.0;
        off.lean[0] += trimmed.lean.x - up.x;
        off.lean[1] += trimmed.lean.y - up.y;
        off.climb_mps += motion.velocity_mps.z;
        Ok(())
    }
}

/// Flies a vehicle's legs in an air and gives for each, against the trim of the same or another vehicle: climb over ground, m/s, and the mean difference of pulse, us, and
/// lean, degrees, between trim and flight.
fn differences(
    vehicle: &Vehicle,
    trimmed: &Vehicle,
    air_mps: Vector3<f64>,
    speeds_mps: &[f64],
) -> Vec<(f64, f64, f64)> {
    let (trajectory, windows) = legs(speeds_mps);
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 200.0 };
    let home_m = Vector3::zeros();
    let vehicle = &without_jitter(vehicle);
    let setup = FlightSetup {
        vehicle,
        lights: &[],
        trajectory: &trajectory,
        home_m,
        frame: ShowFrame { origin, orientation_deg: 59.0 },
        atmosphere: &Uniform(air_mps),
        seed: SEED,
        drone: DRONE,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        full_logs: false,
        hooks: Hooks::default(),
    };
    let own = |definition: &_| deviation(definition, SEED, DRONE);
    let trim = Trim::deviating(&without_jitter(trimmed), home_m, own).expect("effects");
    let off = vec![Off::default(); windows.len()];
    let mut compared = Compared { trim, windows, off, turning_us: None };
    fly_with(&setup, &mut compared).expect("a flight");
    let means = compared.off.iter().map(|off| {
        let lean_deg = off.lean[0].hypot(off.lean[1]).to_degrees() / off.count;
        (off.climb_mps / off.count, off.pulse_us / off.count, lean_deg)
    });
    means.collect()
}

/// The largest differences of all legs, us and degrees.
fn largest(case: &str, vehicle: &Vehicle, air_mps: Vector3<f64>, speeds: &[f64]) -> (f64, f64) {
    let mut most = (0.0_f64, 0.0_f64);
    for (climb_mps, pulse_us, lean_deg) in differences(vehicle, vehicle, air_mps, speeds) {
        println!("{case}: {climb_mps:+.2} m/s: {pulse_us:+.4} us, {lean_deg:.5} degrees");
        most = (most.0.max(pulse_us.abs()), most.1.max(lean_deg));
    }
    most
}

fn assert_flown(case: &str, vehicle: &Vehicle, air_mps: Vector3<f64>, speeds: &[f64]) {
    let (pulse_us, lean_deg) = largest(case, vehicle, air_mps, speeds);
    assert!(pulse_us < PULSE_US, "{case}: off by {pulse_us} us");
    assert!(lean_deg < LEAN_DEG, "{case}: off by {lean_deg} degrees");
}

/// The vehicle without the thrust's jitter in its own wake, whose mean a leg of seconds does not show.
fn without_jitter(vehicle: &Vehicle) -> Vehicle {
    let mut calm = vehicle.clone();
    for (name, table) in &mut calm.effects {
        let parameters = find(name).into_iter().flat_map(|effect| effect.definition().parameters);
        for jitter in parameters.filter(|one| one.role == Some(Role::Scatter)) {
            table.parameters.insert(jitter.name.to_owned(), 0.0);
        }
    }
    calm
}

/// Whether an effect's mean does not show in a flight of seconds: its gusts are chance.
fn is_chance(effect: &str) -> bool {
    effect == "turbulence"
}

#[test]
fn each_vehicle_is_flown_as_it_is_trimmed() {
    for name in names() {
        for (wind, up) in [(0.0, 0.0), (5.0, 1.0), (8.0, -1.0)] {
            let case = format!("{name}, wind {wind}, updraft {up}");
            let air_mps = Vector3::new(wind * 0.8, -wind * 0.6, up);
            assert_flown(&case, &builtin(name).unwrap(), air_mps, &[2.0, -2.0, 0.0]);
        }
    }
}

#[test]
fn each_effect_is_flown_as_it_is_trimmed() {
    let air_mps = Vector3::new(4.0, -3.0, 0.3);
    for effect in LIBRARY {
        let effect = effect.definition().name;
        if is_chance(effect) {
            continue;
        }
        let vehicle = vehicle("airsim-generic-quad", &[effect]);
        assert_flown(effect, &vehicle, air_mps, &[-3.0, 1.0]);
    }
}

/// Vehicles, effects with sizes that show, and whether the pulse shows them (the lean does otherwise).
const SIZED: [(&str, &[&str], bool); 10] = [
    ("airsim-generic-quad", &["face-drag.top=1.5"], true),
    ("airsim-generic-quad", &["face-drag.top=-0.8", "face-drag.sides=3"], true),
    ("arducopter-sitl", &["face-drag.top=2", "face-drag.sides=0.5"], true),
    ("airsim-generic-quad", &["momentum-drag.per_s=0.5"], true),
    ("pixel", &["momentum-drag.per_s=0.3"], false),
    ("phantom4", &["momentum-drag.per_s=0.3", "momentum-drag.axial=1"], true),
    ("airsim-generic-quad", &["response-drift.slope_us=-12"], true),
    ("arducopter-sitl", &["response-drift.slope_us=12"], true),
    ("pixel", &["battery.exponent=-0.5"], true),
    ("airsim-generic-quad", &["battery.exponent=2", "battery.resistance_ohm=0"], true),
];

#[test]
fn effects_of_any_size_are_flown_as_they_are_trimmed_and_not_without_them() {
    let air_mps = Vector3::new(4.0, -3.0, 0.3);
    for (name, choices, in_pulse) in SIZED {
        let (with, without) = (vehicle(name, choices), vehicle(name, &[]));
        let case = format!("{name}, {choices:?}");
        assert_flown(&case, &with, air_mps, &[-3.0, 1.0]);
        let missed = differences(&with, &without, air_mps, &[-3.0, 1.0]);
        let most = |of: fn(&(f64, f64, f64)) -> f64| missed.iter().map(of).fold(0.0, f64::max);
        let (pulse_us, lean_deg) = (most(|leg| leg.1.abs()), most(|leg| leg.2));
        println!("{case}: without it {pulse_us:.2} us, {lean_deg:.3} degrees");
        let seen = if in_pulse { pulse_us > 10.0 * PULSE_US } else { lean_deg > 10.0 * LEAN_DEG };
        assert!(seen, "{case}: the trim without it is off by {pulse_us} us, {lean_deg} degrees");
    }
}

/// Change of the pulse by an effect, us: by the trim, and by its closed form at the trim's lean.
fn twice(name: &str, choices: &[&str], effect: &str, condition: &Condition) -> (f64, f64) {
    let (with, without) = (vehicle(name, choices), vehicle(name, &[]));
    let [before, after] = [&without, &with]
        .map(|one| Trim::of(one).expect("a trim").at(condition).expect("a balance"));
    let effect = find(effect).expect("an effect");
    let values = values_of(effect, &with).expect("values");
    let relative = condition.velocity_mps - condition.air_mps;
    let signals = Signals {
        climb_mps: relative.z,
        horizontal_mps: relative.xy().norm(),
        tilt_rad: after.lean.norm().asin(),
        time_s: condition.time_s,
        density_ratio: condition.density_ratio,
        ..Signals::default()
    };
    let at = Reference::of(&with).in_air(condition.density_ratio);
    (after.pulse_us - before.pulse_us, effect.pulse_us(&at, &values, &signals))
}

#[test]
fn closed_forms_say_what_the_trim_finds() {
    let cases: [(&str, &[&str], &str, f64); 6] = [
        ("airsim-generic-quad", &["face-drag.top=1.5"], "face-drag", 0.0),
        ("airsim-generic-quad", &["face-drag.top=-0.8", "face-drag.sides=0"], "face-drag", 4.0),
        ("pixel", &["momentum-drag.per_s=0.3", "momentum-drag.axial=1"], "momentum-drag", 0.0),
        ("pixel", &["momentum-drag.per_s=0.4"], "momentum-drag", 6.0),
        ("pixel", &["response-drift.slope_us=-8"], "response-drift", 0.0),
        ("phantom4", &["response-drift.slope_us=8"], "response-drift", 0.0),
    ];
    for (name, choices, effect, wind_mps) in cases {
        for climb_mps in [-3.0, 1.0, 3.5] {
            let condition = Condition {
                velocity_mps: Vector3::new(0.0, 0.0, climb_mps),
                air_mps: Vector3::new(wind_mps, 0.0, 0.0),
                density_ratio: 0.97,
                time_s: 400.0,
                ..Condition::default()
            };
            let (trim_us, closed_us) = twice(name, choices, effect, &condition);
            println!("{effect} {name} {climb_mps:+} m/s: trim {trim_us:+.3}, {closed_us:+.3} us");
            let off_us = (trim_us - closed_us).abs();
            assert!(
                off_us < 0.1 + 0.02 * trim_us.abs(),
                "{effect} {climb_mps}: {trim_us}, {closed_us}"
            );
            assert!(trim_us.abs() > 1.0, "{effect} {climb_mps}: nothing to compare");
        }
    }
}

#[test]
fn a_drift_is_so_many_us_on_every_frame() {
    for name in names() {
        let choices = ["response-drift.slope_us=6", "response-drift.time_s=300"];
        let [with, without] = [vehicle(name, &choices), vehicle(name, &[])];
        let slope_us = |one: &Vehicle| {
            let mut trim = Trim::of(one).unwrap();
            let mut at = |climb_mps| {
                let velocity_mps = Vector3::new(0.0, 0.0, climb_mps);
                let at = Condition { velocity_mps, time_s: 600.0, ..Condition::default() };
                trim.at(&at).expect("a balance").pulse_us
            };
            (at(0.5) - at(-0.5)) / 1.0
        };
        let drift_us = slope_us(&with) - slope_us(&without);
        // ArduPilot's frame is taken in the hover of its reference test, in thinner air.
        assert!((drift_us - 12.0).abs() < 0.6, "{name}: {drift_us} us/(m/s) for 12");
    }
}

#[test]
fn without_drag_of_its_own_an_airframe_has_none_to_change() {
    let air_mps = Vector3::new(3.0, 0.0, -2.0);
    let at = Condition { air_mps, ..Condition::default() };
    let trimmed = |choices: &[&str]| Trim::of(&vehicle("pixel", choices)).unwrap().at(&at);
    assert_eq!(trimmed(&["face-drag.top=3"]), trimmed(&[]));
}

#[test]
#[ignore = "takes minutes: cargo test --release -p multirotor-sim --test it -- --ignored trim"]
fn everything_is_flown_as_it_is_trimmed() {
    let mut failed = Vec::new();
    for name in names() {
        for effect in LIBRARY.iter().map(|effect| effect.definition().name).chain([""]) {
            if is_chance(effect) {
                continue;
            }
            for wind in [0.0, 2.0, 4.0, 6.0, 8.0] {
                let mut vehicle = builtin(name).unwrap();
                if let Some(effect) = find(effect) {
                    vehicle.effects.entry(effect.definition().name.to_owned()).or_default().on =
                        true;
                }
                let case = format!("{name}, {effect}, wind {wind}");
                let air_mps = Vector3::new(wind, 0.0, 0.0);
                let speeds = [-4.0, 4.0, -2.0, 2.0, -1.0, 1.0, 0.0];
                let (pulse_us, lean_deg) = largest(&case, &vehicle, air_mps, &speeds);
                if pulse_us > PULSE_US || lean_deg > LEAN_DEG {
                    failed.push(format!("{case}: {pulse_us:.3} us, {lean_deg:.4} degrees"));
                }
            }
        }
    }
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}
