//! Whether shifts are found and their intervals hold them, on ladders made up with known curves.

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::super::corrections::DOUBTS;
use super::points::{Point, average, common};
use super::shift::{Flights, Shift, shift};
use super::{MOST_STEEPER, slope_of};
use crate::base::rng::{Purpose as Stream, stream};

/// What the air and the noise of a ladder are.
#[derive(Clone, Copy)]
struct Weather {
    /// Standard deviation of slow air, m/s, and its time scale, s.
    air: (f64, f64),
    /// Standard deviation of a window's pulse, us.
    noise_us: f64,
}

const CALM: Weather = Weather { air: (0.0, 60.0), noise_us: 0.2 };
const MOVING: Weather = Weather { air: (0.15, 40.0), noise_us: 0.5 };

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

/// AirSim's law.
fn square(v: f64) -> f64 {
    1598.0 + 8.05 * v * v.abs()
}

/// ArduPilot's simulator: momentum theory (a fit to its still ladder).
fn momentum(v: f64) -> f64 {
    1591.2 + 9.1 * v + 0.62 * v * v + 0.42 * v * v.abs() + 0.6 * (v / 1.8).tanh()
}

/// A show drone: inflow, drag of the body, and the dip of thrust in descent.
fn rotor(v: f64) -> f64 {
    let dip = (-(v + 4.0).powi(2) / 3.0).exp();
    1546.5 + 25.0 * v + 0.9 * v * v + 1.1 * v * v.abs() + 9.0 * dip
}

const NOTHING: [f64; DOUBTS] = [0.0; DOUBTS];

/// The paper's ladder in an updraft.
fn ladder(curve: fn(f64) -> f64, w_mps: f64, weather: Weather, rng: &mut Pcg64) -> Vec<Point> {
    let mut points = Vec::new();
    let mut air = weather.air.0 * normal(rng);
    let mut last_s = 0.0;
    for rung in 1..=7_i32 {
        for (sign, is_leg) in [(1, true), (0, false), (-1, true), (0, false)] {
            let speed = 0.5 * f64::from(rung * sign);
            let time_s = 30.0 + 15.0 * points.len() as f64;
            let decay = (-(time_s - last_s) / weather.air.1).exp();
            air = air * decay + weather.air.0 * (1.0 - decay * decay).sqrt() * normal(rng);
            last_s = time_s;
            points.push(Point {
                key: (u8::from(!is_leg), i64::from(rung * sign), points.len()),
                is_leg,
                time_s,
                velocity_mps: speed,
                pulse_us: curve(speed - w_mps - air) + weather.noise_us * normal(rng),
                noise_us: weather.noise_us,
                velocity_noise_mps: 0.0,
                axial_mps: 0.0,
                doubts_us: NOTHING,
            });
        }
    }
    points
}

fn found(there: &[Point], here: &[Point]) -> Shift {
    shift(&Flights { there, here, sigmas: &NOTHING, spread: [0.0; 2] }).unwrap()
}

/// Share of intervals (of 12: nine or more hold in 99.8 % of the cases, if they hold 95 %) that hold the truth, and the largest error, over updrafts of -2 to 2 m/s.
fn coverage(curve: fn(f64) -> f64, weathers: [Weather; 2], seeds: u64) -> (f64, f64) {
    let (mut inside, mut all, mut worst) = (0, 0, 0.0_f64);
    for seed in 0..seeds {
        let rng = &mut stream(seed, 1, Stream::Resampling);
        let there = ladder(curve, 0.0, weathers[0], rng);
        for w_mps in [-2.0, 0.4, 1.3] {
            let here = ladder(curve, w_mps, weathers[1], rng);
            let found = found(&there, &here);
            let [low, high] = found.interval_mps;
            inside += usize::from((low..=high).contains(&w_mps));
            all += 1;
            worst = worst.max((found.mean_mps - w_mps).abs());
        }
    }
    (inside as f64 / f64::from(all), worst)
}

#[test]
fn a_curve_of_any_shape_is_shifted_to_within_its_interval() {
    for curve in [square, momentum, rotor] {
        let (share, worst) = coverage(curve, [CALM, CALM], 4);
        assert!(share >= 0.75, "{share} inside");
        assert!(worst < 0.06, "{worst} m/s off");
    }
}

#[test]
fn moving_air_widens_the_interval_whichever_flight_it_was_in() {
    for weathers in [[MOVING, MOVING], [CALM, MOVING]] {
        let (share, worst) = coverage(rotor, weathers, 4);
        assert!(share >= 0.75, "{share} inside");
        assert!(worst < 0.5, "{worst} m/s off");
    }
}

#[test]
fn ladders_without_a_speed_or_without_windows_tell_nothing() {
    let rng = &mut stream(3, 1, Stream::Resampling);
    let there = ladder(rotor, 0.0, CALM, rng);
    let hovers: Vec<Point> = there.iter().filter(|point| !point.is_leg).copied().collect();
    let none = |there: &[Point], here: &[Point]| {
        shift(&Flights { there, here, sigmas: &NOTHING, spread: [0.0; 2] }).is_none()
    };
    assert!(none(&hovers, &there) && none(&there, &[]) && none(&[], &there));
}

#[test]
fn averages_are_of_the_windows_that_all_drones_have() {
    let rng = &mut stream(4, 1, Stream::Resampling);
    let one = ladder(rotor, 0.0, CALM, rng);
    let mut other = one.clone();
    for point in &mut other {
        point.pulse_us += 4.0;
    }
    other.remove(5);
    let averaged = average(&common(vec![one.clone(), other]));
    assert_eq!(averaged.len(), one.len() - 1);
    assert!((averaged[0].pulse_us - one[0].pulse_us - 2.0).abs() < 1e-9);
    assert!((averaged[0].noise_us - CALM.noise_us / 2_f64.sqrt()).abs() < 1e-12);
}

fn leg(velocity_mps: f64, pulse_us: f64) -> Point {
    Point {
        key: (0, 0, 0),
        is_leg: true,
        time_s: 0.0,
        velocity_mps,
        pulse_us,
        noise_us: 0.1,
        velocity_noise_mps: 0.0,
        axial_mps: 0.0,
        doubts_us: [0.0; DOUBTS],
    }
}

#[test]
fn a_line_through_legs_has_their_slope() {
    let legs: Vec<Point> = [-2.0, -1.0, 1.0, 2.0].map(|v| leg(v, 1500.0 + 25.0 * v)).into();
    assert!((slope_of(&legs).unwrap() - 25.0).abs() < 1e-9);
    assert!(slope_of(&legs[..2]).is_none());
    assert!(slope_of(&[leg(1.0, 1.0); 3]).is_none());
}

#[test]
fn a_square_law_in_an_updraft_is_not_another_vehicle() {
    let slope = |w_mps: f64| {
        let of = |v: f64| leg(v, 8.0 * (v - w_mps) * (v - w_mps).abs());
        let legs: Vec<Point> = (1..=7)
            .flat_map(|rung| [0.5, -0.5].map(|step| step * f64::from(rung)))
            .map(of)
            .collect();
        slope_of(&legs).unwrap()
    };
    for w_mps in [-2.0, -1.0, 1.0, 2.0] {
        let steeper = slope(w_mps) / slope(0.0);
        assert!((1.0..0.9 * MOST_STEEPER).contains(&steeper), "{w_mps}: {steeper}");
    }
}
