//! Flies a vehicle into a steady state and averages what it does there.

#![allow(dead_code, clippy::allow_attributes, reason = "each test program uses its part of this")]

use std::io;

use dataflash::time::GpsTime;
use multirotor_sim::effects::select::choose;
use multirotor_sim::sim::recorder::{Moment, Recorder};
use multirotor_sim::sim::{FlightSetup, Hooks, Uniform, fly_with};
use multirotor_sim::vehicle::Vehicle;
use multirotor_sim::vehicle::library::builtin;
use nalgebra::Vector3;
use skybrush_show::frame::{Geodetic, ShowFrame};
use skybrush_show::{Segment, SegmentPath, Trajectory};

/// A built-in vehicle without its effects, and then with these choices.
pub(crate) fn vehicle(name: &str, choices: &[&str]) -> Vehicle {
    let mut vehicle = builtin(name).expect("a built-in vehicle");
    vehicle.effects.clear();
    for choice in choices {
        choose(&mut vehicle, choice).expect("an effect");
    }
    vehicle
}

/// What is flown: legs of (duration s, height at their end m), and in which air.
#[derive(Clone)]
pub(crate) struct Flight {
    pub(crate) legs: Vec<(u32, f64)>,
    pub(crate) air_mps: Vector3<f64>,
    pub(crate) home_m: Vector3<f64>,
    pub(crate) drone: u16,
    pub(crate) seed: u64,
    pub(crate) amsl_m: f64,
    /// Windows, show time from and to, s.
    pub(crate) windows: Vec<(f64, f64)>,
}

impl Flight {
    /// Hover at a height for 60 s; the window is its second half.
    pub(crate) fn hover(height_m: f64) -> Self {
        Self {
            legs: vec![(4, 3.0), (20, height_m), (60, height_m), (20, 3.0)],
            air_mps: Vector3::zeros(),
            home_m: Vector3::zeros(),
            drone: 1,
            seed: 1,
            amsl_m: 0.0,
            windows: vec![(54.0, 84.0)],
        }
    }

    /// Vertical motion at a speed for 20 s, around 60 m; the window is the last 10 s but one.
    pub(crate) fn moving(speed_mps: f64) -> Self {
        let from_m = 60.0 - 10.0 * speed_mps;
        Self {
            legs: vec![
                (4, 3.0),
                (40, from_m),
                (10, from_m),
                (20, from_m + 20.0 * speed_mps),
                (10, from_m + 20.0 * speed_mps),
                (40, 3.0),
            ],
            windows: vec![(64.0, 73.0)],
            ..Self::hover(0.0)
        }
    }

    pub(crate) fn wind(mut self, wind_mps: f64) -> Self {
        self.air_mps.x = wind_mps;
        self
    }
}

/// Means over a window.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Steady {
    pub(crate) count: f64,
    pub(crate) time_s: f64,
    pub(crate) pulse_us: f64,
    pub(crate) climb_mps: f64,
    pub(crate) measured_mps: f64,
    pub(crate) height_m: f64,
    pub(crate) tilt_rad: f64,
    pub(crate) density_ratio: f64,
    pub(crate) used_ah: f64,
    pub(crate) speed_radps: f64,
    pub(crate) pulse_sd_us: f64,
}

struct Averages(Vec<((f64, f64), Steady)>, Vec<Vec<f64>>);

impl Recorder for Averages {
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()> {
        let time_s = moment.time_us as f64 * 1e-6;
        for ((window, sum), pulses) in self.0.iter_mut().zip(&mut self.1) {
            if time_s >= window.0 && time_s < window.1 {
                let pulse = moment.pilot.motors.pulses_us.map(f64::from).iter().sum::<f64>() / 4.0;
                let motion = moment.plant.motion();
                pulses.push(pulse);
                sum.count += 1.0;
                sum.time_s += time_s;
                sum.pulse_us += pulse;
                sum.climb_mps += motion.velocity_mps.z;
                sum.measured_mps += moment.estimate.velocity_mps.z;
                sum.height_m += motion.position_m.z;
                sum.tilt_rad += motion.rotation[(2, 2)].min(1.0).acos();
                sum.density_ratio += moment.around.density_ratio;
                sum.used_ah += moment.plant.battery().map_or(0.0, |battery| battery.used_ah);
                sum.speed_radps += (moment.plant.rotors().total_output() / 4.0).sqrt();
            }
        }
        Ok(())
    }
}

/// Flies and averages over the windows.
pub(crate) fn fly_windows(vehicle: &Vehicle, flight: &Flight) -> Vec<Steady> {
    let segments = flight
        .legs
        .iter()
        .map(|(duration_s, height_m)| Segment {
            duration_ms: duration_s * 1000,
            path: SegmentPath::Line(flight.home_m + Vector3::new(0.0, 0.0, *height_m)),
        })
        .collect();
    let trajectory = Trajectory { start_m: flight.home_m, segments };
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: flight.amsl_m };
    let setup = FlightSetup {
        vehicle,
        lights: &[],
        trajectory: &trajectory,
        home_m: flight.home_m,
        frame: ShowFrame { origin, orientation_deg: 59.0 },
        atmosphere: &Uniform(flight.air_mps),
        seed: flight.seed,
        drone: flight.drone,
        start: GpsTime { week: 2445, tow_ms: 442_755_000 },
        full_logs: false,
        hooks: Hooks::default(),
    };
    let windows = flight.windows.iter().map(|window| (*window, Steady::default())).collect();
    let mut averages = Averages(windows, vec![Vec::new(); flight.windows.len()]);
    fly_with(&setup, &mut averages).expect("a flight");
    let max_radps = vehicle.airframe.max_rpm * std::f64::consts::TAU / 60.0;
    averages
        .0
        .into_iter()
        .zip(averages.1)
        .map(|((_, sum), pulses)| {
            let n = sum.count;
            assert!(n > 0.0, "no step in the window");
            let mean = sum.pulse_us / n;
            let variance = pulses.iter().map(|pulse| (pulse - mean).powi(2)).sum::<f64>() / n;
            Steady {
                count: n,
                time_s: sum.time_s / n,
                pulse_us: mean,
                climb_mps: sum.climb_mps / n,
                measured_mps: sum.measured_mps / n,
                height_m: sum.height_m / n,
                tilt_rad: sum.tilt_rad / n,
                density_ratio: sum.density_ratio / n,
                used_ah: sum.used_ah / n,
                speed_radps: sum.speed_radps / n * max_radps,
                pulse_sd_us: variance.sqrt(),
            }
        })
        .collect()
}

/// Flies and averages over the only window.
pub(crate) fn steady(vehicle: &Vehicle, flight: &Flight) -> Steady {
    fly_windows(vehicle, flight)[0]
}
