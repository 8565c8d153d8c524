//! Measurement of a log in each steady bin.

use super::bins::{Bin, BinValues};
use crate::flight::{Flight, Indicator, Series};

/// Fewest samples in a usable bin: half a second of a log at 10 Hz. Chosen.
const FEWEST_SAMPLES: usize = 5;
/// A silence longer than this breaks a bin, s. As in the analysis; chosen.
const GAP_S: f64 = 1.0;
/// A bin is left out when its mean velocity is further than this from the command, m/s: a drone at its
/// limits falls behind (AirSim's quad by 0.45 m/s at 7 m/s through the air; ArduPilot's own frame, which leans by 30 degrees
/// at most, by 1.2 m/s on a leg of 3 m/s against 8 m/s of wind, where it is off by less than 0.2 m/s on all legs that it can fly).
/// Chosen below that.
pub(super) const FOLLOW_MPS: f64 = 0.3;
/// Who leans to within this of its autopilot's limit is held back by it, degrees. Chosen: twice what a lean
/// scatters by.
pub(super) const LIMIT_MARGIN_DEG: f64 = 0.5;
/// Share of a bin at the limit from which a drone is no longer in balance on its course, even where it is carried away slowly.
/// Chosen, not measured.
pub(super) const LIMITED_SHARE: f64 = 0.2;
/// Quantum of a logged pulse, us: a motor within it of its limit is at the limit.
const QUANTUM_US: f64 = 1.0;
/// Share of samples at a limit from which a bin counts as saturated. Chosen, not measured.
const SATURATED_SHARE: f64 = 0.05;

/// The bins of one drone's flight; `None`: not usable there (a gap in the log, saturated motors, the
/// command was not followed).
///
/// `orientation_deg` is the show frame's, clockwise from north to x; `thrust_exponent` the power of
/// thrust that `u - 1000` goes with.
pub(super) fn measured(
    flight: &Flight,
    bins: &[Bin],
    orientation_deg: f64,
    thrust_exponent: f64,
) -> Vec<Option<BinValues>> {
    let turn = orientation_deg.to_radians().sin_cos();
    bins.iter().map(|bin| one(flight, bin, turn, thrust_exponent)).collect()
}

fn one(flight: &Flight, bin: &Bin, turn: (f64, f64), thrust_exponent: f64) -> Option<BinValues> {
    let (start_s, end_s) = (bin.start_s, bin.end_s);
    let pulses = flight.effort.values.between(start_s, end_s);
    if pulses.len() < FEWEST_SAMPLES || flight.effort.values.longest_gap_s(start_s, end_s) > GAP_S {
        return None;
    }
    if flight.effort.indicator == Indicator::Pulse && is_saturated(flight, start_s, end_s) {
        return None;
    }
    let climb_mps = mean(flight.velocity_up_mps.between(start_s, end_s))?;
    let follows = |climb_mps: f64| (climb_mps - bin.climb_mps()).abs() <= FOLLOW_MPS;
    // A velocity that is off is no reason to drop a drone whose height did what it should.
    if !follows(climb_mps) && !rise_mps(flight, bin).is_some_and(follows) {
        return None;
    }
    // Who leans as far as its autopilot lets it is carried away by the wind, and its lean is no longer that of the plan.
    let [x_mps, y_mps, _] = bin.velocity_mps;
    if moved_mps(flight, bin, turn).is_some_and(|[moved_x_mps, moved_y_mps]| {
        (moved_x_mps - x_mps).hypot(moved_y_mps - y_mps) > FOLLOW_MPS
    }) {
        return None;
    }
    if is_held_back(flight, start_s, end_s) {
        return None;
    }
    let lean_rad = lean(flight, start_s, end_s, turn)?;
    let pulse = mean(pulses)?;
    let zero = flight.effort.indicator.without_thrust();
    let exponent = match flight.effort.indicator {
        Indicator::Pulse => thrust_exponent,
        other => other.thrust_exponent(),
    };
    let cos = lean_rad[0].hypot(lean_rad[1]).cos();
    let of_battery = |series: &Option<Series>| {
        // Logged once a second or ten times.
        let values = series.as_ref()?.between(start_s - 0.5, end_s + 0.5);
        mean(values).filter(|value| *value > 0.0)
    };
    let loaded_v = of_battery(&flight.voltage_v);
    let power_w = loaded_v.zip(of_battery(&flight.current_a)).map(|(volts, amps)| volts * amps);
    let values = BinValues {
        pulse_us: zero + (pulse - zero) * cos.powf(exponent),
        climb_mps,
        height_m: mean(flight.height_m.between(start_s, end_s))?,
        lean_rad,
        resting_v: of_battery(&flight.resting_v).unwrap_or(f64::NAN),
        loaded_v: loaded_v.unwrap_or(f64::NAN),
        power_w: power_w.unwrap_or(f64::NAN),
        carried_away: false,
    };
    (values.pulse_us.is_finite() && values.height_m.is_finite()).then_some(values)
}

/// Rate of the height over a bin, m/s.
fn rise_mps(flight: &Flight, bin: &Bin) -> Option<f64> {
    rate(&flight.height_m, bin)
}

/// Horizontal velocity over a bin by the places at its ends, show frame, m/s.
fn moved_mps(flight: &Flight, bin: &Bin, turn: (f64, f64)) -> Option<[f64; 2]> {
    Some(in_show_frame(rate(&flight.north_m, bin)?, rate(&flight.east_m, bin)?, turn))
}

/// Rate of a series between the ends of a bin, per second.
fn rate(of: &Series, bin: &Bin) -> Option<f64> {
    Some((of.at(bin.end_s, GAP_S)? - of.at(bin.start_s, GAP_S)?) / bin.length_s())
}

/// Along the show's axes: x is `orientation` clockwise from north, with this sine and cosine, and y to the left of it.
fn in_show_frame(north: f64, east: f64, (sin, cos): (f64, f64)) -> [f64; 2] {
    [cos * north + sin * east, sin * north - cos * east]
}

fn is_saturated(flight: &Flight, start_s: f64, end_s: f64) -> bool {
    let (low, high) = flight.pulse_limits_us;
    let share = |values: &[f64], at: &dyn Fn(f64) -> bool| {
        let count = values.iter().filter(|value| at(**value)).count();
        count as f64 / values.len().max(1) as f64
    };
    share(flight.pulse_max_us.between(start_s, end_s), &|value| value >= high - QUANTUM_US)
        > SATURATED_SHARE
        || share(flight.pulse_min_us.between(start_s, end_s), &|value| value <= low + QUANTUM_US)
            > SATURATED_SHARE
}

/// Whether a drone leans as far as its autopilot lets it: then it is not in balance on its course, even where it is carried away
/// slowly.
fn is_held_back(flight: &Flight, start_s: f64, end_s: f64) -> bool {
    let Some(limit_deg) = flight.lean_limit_deg else { return false };
    let times = flight.roll_rad.times_between(start_s, end_s);
    let rolls = flight.roll_rad.between(start_s, end_s);
    let limit = (limit_deg - LIMIT_MARGIN_DEG).to_radians().cos();
    let held = times.iter().zip(rolls).filter(|(time_s, roll)| {
        let pitch = flight.pitch_rad.at(**time_s, GAP_S).unwrap_or_default();
        pitch.cos() * roll.cos() < limit
    });
    held.count() as f64 > LIMITED_SHARE * rolls.len() as f64
}

/// Mean horizontal part of the thrust axis, show frame.
fn lean(flight: &Flight, start_s: f64, end_s: f64, turn: (f64, f64)) -> Option<[f64; 2]> {
    let times = flight.roll_rad.times_between(start_s, end_s);
    let rolls = flight.roll_rad.between(start_s, end_s);
    let (mut north, mut east, mut count) = (0.0, 0.0, 0.0);
    for (time_s, roll) in times.iter().zip(rolls) {
        let Some(pitch) = flight.pitch_rad.at(*time_s, GAP_S) else { continue };
        // Heading jumps at north: the value in force, not between two.
        let yaw_deg = flight.yaw_deg.latest(*time_s, GAP_S).unwrap_or(0.0);
        let (yaw_sin, yaw_cos) = yaw_deg.to_radians().sin_cos();
        // Nose down pulls forward, right side down pulls right.
        let (forward, right) = (-pitch.sin() * roll.cos(), roll.sin());
        north += forward * yaw_cos - right * yaw_sin;
        east += forward * yaw_sin + right * yaw_cos;
        count += 1.0;
    }
    if count == 0.0 {
        return None;
    }
    let (north, east) = (north / count, east / count);
    // Accelerating takes lean as well; what is left is the wind's.
    let (north_mps2, east_mps2) = acceleration(flight, start_s, end_s).unwrap_or_default();
    let (north, east) = (north - north_mps2 / GRAVITY, east - east_mps2 / GRAVITY);
    Some(in_show_frame(north, east, turn))
}

/// Mean horizontal acceleration over a bin by the speeds at its ends, north and east, m/s².
fn acceleration(flight: &Flight, start_s: f64, end_s: f64) -> Option<(f64, f64)> {
    let half_s = 0.5;
    let of = |series: &Series| {
        let speed = |time_s: f64| {
            let ahead = series.at(time_s + half_s, GAP_S)?;
            Some((ahead - series.at(time_s - half_s, GAP_S)?) / (2.0 * half_s))
        };
        Some((speed(end_s)? - speed(start_s)?) / (end_s - start_s))
    };
    Some((of(&flight.north_m)?, of(&flight.east_m)?))
}

/// Standard gravity, m/s².
const GRAVITY: f64 = 9.80665;

/// Mean of logged values; `None` of nothing, and if a value is not finite.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    crate::numeric::mean(values).filter(|mean| mean.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Effort;

    /// A log of ten seconds at these speeds, north, east and up, m/s.
    fn log([north_mps, east_mps, up_mps]: [f64; 3]) -> Flight {
        let time_s: Vec<f64> = (0..100).map(|tenth| 0.1 * f64::from(tenth)).collect();
        let series = |of: &dyn Fn(f64) -> f64| Series {
            time_s: time_s.clone(),
            value: time_s.iter().map(|time_s| of(*time_s)).collect(),
        };
        Flight {
            velocity_up_mps: series(&|_| up_mps),
            height_m: series(&|time_s| 20.0 + up_mps * time_s),
            north_m: series(&|time_s| north_mps * time_s),
            east_m: series(&|time_s| east_mps * time_s),
            effort: Effort { values: series(&|_| 1500.0), ..Effort::default() },
            roll_rad: series(&|_| 0.1),
            pitch_rad: series(&|_| 0.0),
            yaw_deg: series(&|_| 0.0),
            pulse_limits_us: (1000.0, 2000.0),
            ..Flight::default()
        }
    }

    #[test]
    fn a_drone_that_the_wind_carries_away_is_not_measured() {
        // Show x is east.
        let turn = 90.0_f64.to_radians().sin_cos();
        let bin = |velocity_mps: [f64; 3]| Bin {
            start_s: 3.0,
            end_s: 6.0,
            velocity_mps,
            ..crate::gap::trial::ladder()[0].clone()
        };
        let measures = |told_mps: [f64; 3], flown_mps: [f64; 3]| {
            one(&log(flown_mps), &bin(told_mps), turn, 1.0).is_some()
        };
        assert!(measures([0.0; 3], [0.0; 3]));
        assert!(measures([0.0; 3], [0.2, 0.2, 0.0]), "it sways in gusts");
        assert!(!measures([0.0; 3], [0.25, 0.25, 0.0]));
        assert!(measures([-3.0, 0.0, 0.0], [0.0, -2.9, 0.0]));
        assert!(!measures([-3.0, 0.0, 0.0], [0.0, -1.8, 0.0]), "a leg against the wind");
        assert!(!measures([0.0, 3.0, 0.0], [-3.0, 0.0, 0.0]), "y is left of x: north");
        assert!(measures([0.0, 3.0, 0.0], [3.0, 0.0, 0.0]));
        let mut of_a_table = log([1.0, 1.0, 2.0]);
        (of_a_table.north_m, of_a_table.east_m) = Default::default();
        assert!(one(&of_a_table, &bin([0.0, 0.0, 2.0]), turn, 1.0).is_some(), "it has no place");
    }

    #[test]
    fn a_drone_that_its_autopilot_holds_back_is_not_measured() {
        let bin = Bin { start_s: 3.0, end_s: 6.0, ..crate::gap::trial::ladder()[0].clone() };
        let [.., climb_mps] = bin.velocity_mps;
        let measures = |roll_deg: f64, lean_limit_deg: Option<f64>| {
            let mut log = log([0.0, 0.0, climb_mps]);
            log.roll_rad.value.iter_mut().for_each(|roll_rad| *roll_rad = roll_deg.to_radians());
            one(&Flight { lean_limit_deg, ..log }, &bin, (0.0, 1.0), 1.0).is_some()
        };
        assert!(measures(28.0, Some(30.0)));
        assert!(!measures(29.8, Some(30.0)));
        assert!(measures(29.8, None), "the log says of no limit");
    }

    #[test]
    fn legs_of_simulated_logs_are_those_of_a_plan_that_is_turned() {
        let mut data = crate::gap::trial::data(1, |_, _| 0.0);
        let group = &mut data.groups[0];
        group.bins.truncate(1);
        group.measured.iter_mut().for_each(|drone| drone.truncate(1));
        let (start_s, end_s, velocity_mps) = (3.0, 6.0, [3.0, 0.0, 0.0]);
        group.bins[0] = Bin { start_s, end_s, velocity_mps, ..group.bins[0].clone() };
        group.measured[0][0].height_m = 20.0;
        let flight = log([0.0, 3.0, 0.0]);
        let flown = [crate::gap::Flown { slot: 1, flight: &flight }];
        let has_leg = |data: &crate::gap::Data| data.averaged(&flown, 1.0)[0][0].is_some();
        assert!(!has_leg(&data), "it flew east for north");
        data.orientation_deg = 90.0;
        assert!(has_leg(&data), "the plan's x is east");
    }
}
