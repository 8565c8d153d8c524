//! Records of a drone's air in blocks of fractions of a second, from its log.
//!
//! The law of the map is steady: a drone that is accelerated upwards has more thrust than its weight, and a pulse to
//! match. In blocks of 10 s that is nothing; above 0.2 Hz it is as much as the air does, and is taken off first: `dp/da =
//! k (p - p0)/g`, where thrust goes with the pulse above that of no thrust to the power `1/k`.

use super::super::drone::Shared;
use super::super::hover::Second;
use super::super::running::Running;
use super::super::updraft::DroneSeries;
use super::super::windows::lean_deg;
use super::horizontal::Horizontal;
use crate::flight::{Flight, Series};

/// Acceleration of gravity, m/s²: standard.
pub(super) const GRAVITY_MPS2: f64 = 9.806_65;
/// Lengths of a block, s: the shortest in which each channel has two samples is taken.
const STEPS_S: [f64; 3] = [0.25, 0.5, 1.0];
/// Time constant with which motors follow a command, s: those of small multirotors have 0.03 to 0.08 s. What is logged is the
/// command, the thrust comes later. Rotor speeds and power are measured.
const MOTOR_S: f64 = 0.05;
/// Samples of each channel in a block.
const PER_BLOCK: f64 = 2.0;
/// Blocks of a silence that no value is joined over.
const SILENT_BLOCKS: f64 = 2.0;
/// No record has more blocks, whatever times a damaged log claims.
const MOST: usize = 1_000_000;

/// What a drone's log tells of its air, block by block.
#[derive(Clone, Debug, Default)]
pub(in crate::analysis) struct Records {
    /// Length of a block, s.
    pub(super) step_s: f64,
    /// Number of the first block: block `k` covers show times from `k step_s` to `(k + 1) step_s`.
    pub(super) first: i64,
    /// Vertical air speed, m/s, up positive.
    pub(super) w_mps: Vec<Option<f64>>,
    /// Wind towards true east and true north, m/s.
    pub(super) east_north_mps: Vec<Option<[f64; 2]>>,
    /// Relative standard errors of w's scale: of the fleet's law with what wind does to it, and of the drone's own part.
    pub(super) slope_share: [f64; 2],
    /// Standard error of w from what wind does to the pulse, m/s.
    pub(super) wind_mps: f64,
}

impl Records {
    /// Of a log whose hover was measured; `None` where it samples too seldom, or without a calibration that knows its
    /// errors.
    pub(in crate::analysis) fn of(
        shared: &Shared<'_>,
        flight: &Flight,
        series: &DroneSeries,
        (slot, name): (Option<u16>, &str),
    ) -> Option<Self> {
        let aware = shared.aware.as_ref()?;
        let measured = series.measured.as_ref().filter(|_| series.moved_m.is_empty())?;
        let from_s = series.first_s as f64 - 0.5;
        let to_s = from_s + series.updraft_mps.len() as f64;
        let step_s = step(flight, from_s, to_s)?;
        let first = (from_s / step_s).round() as i64;
        let count = (((to_s - from_s) / step_s).round() as usize).min(MOST);
        let means = Blocks { step_s, first };
        let followed = followed(flight);
        let (effort, velocity) = (Integral::of(&followed), Integral::of(&flight.velocity_up_mps));
        let leans = [&flight.roll_rad, &flight.pitch_rad]
            .map(|of| Running::new(of, from_s - 10.0, to_s + 10.0));
        let gain = Response::of(shared, flight);
        let known = |index: usize| {
            let time_s = means.centre_s(index);
            let second = usize::try_from((time_s.round() as i64) - series.first_s).ok()?;
            series.updraft_mps.get(second).copied().flatten()?;
            let (from, to) = means.ends_s(index);
            let gap_s = SILENT_BLOCKS * step_s;
            let climb = &flight.velocity_up_mps;
            let acceleration = (climb.at(to, gap_s)? - climb.at(from, gap_s)?) / step_s;
            let pulse_us = effort.mean(from, to, gap_s)?;
            let [roll, pitch] = [leans[0].mean(time_s)?, leans[1].mean(time_s)?];
            let height_m = flight.height_m.at(time_s, gap_s.max(1.0))?;
            Some(Second {
                time_s,
                pulse_us: gain.steady_us(pulse_us, acceleration),
                velocity_mps: velocity.mean(from, to, gap_s)?,
                lean_deg: lean_deg(roll, pitch),
                height_m,
            })
        };
        let seconds: Vec<Option<Second>> = (0..count).map(known).collect();
        let (w_mps, in_wind) = aware.values_of(flight, &seconds, slot, name);
        if w_mps.iter().all(Option::is_none) {
            return None;
        }
        let counts = |index: usize| seconds.get(index).is_some_and(Option::is_some);
        let east_north_mps = Horizontal::of(flight, shared.drag(), &means).record(count, counts);
        let slope_share = [measured.slope_share.hypot(in_wind), measured.own_slope_share];
        Some(Self {
            step_s,
            first,
            w_mps,
            east_north_mps,
            slope_share,
            wind_mps: measured.errors.wind_mps,
        })
    }
}

/// Blocks of a log.
#[derive(Clone, Copy)]
pub(super) struct Blocks {
    pub(super) step_s: f64,
    pub(super) first: i64,
}

impl Blocks {
    /// Middle of a block, show time, s.
    pub(super) fn centre_s(&self, index: usize) -> f64 {
        (self.first as f64 + index as f64 + 0.5) * self.step_s
    }

    /// Ends of a block, show time, s.
    pub(super) fn ends_s(&self, index: usize) -> (f64, f64) {
        let from = (self.first as f64 + index as f64) * self.step_s;
        (from, from + self.step_s)
    }
}

/// Length of the blocks that a log allows, s.
fn step(flight: &Flight, from_s: f64, to_s: f64) -> Option<f64> {
    let rate = |series: &Series| series.range(from_s, to_s).len() as f64 / (to_s - from_s);
    let slowest = rate(&flight.effort.values).min(rate(&flight.velocity_up_mps));
    STEPS_S.into_iter().find(|step_s| slowest * step_s >= PER_BLOCK)
}

/// The rotor effort as the motors follow it.
fn followed(flight: &Flight) -> Series {
    let effort = &flight.effort;
    if !effort.indicator.is_pulse() {
        return effort.values.clone();
    }
    let mut before: Option<(f64, f64)> = None;
    let value = |(time_s, command): (&f64, &f64)| {
        let now = before.map_or(*command, |(last_s, last)| {
            let share = -(-(time_s - last_s) / MOTOR_S).exp_m1();
            last + share * (command - last)
        });
        before = Some((*time_s, now));
        now
    };
    let value = effort.values.time_s.iter().zip(&effort.values.value).map(value).collect();
    Series { time_s: effort.values.time_s.clone(), value }
}

/// How the rotor effort answers an acceleration of the drone.
struct Response {
    exponent: f64,
    without_thrust: f64,
}

impl Response {
    fn of(shared: &Shared<'_>, flight: &Flight) -> Self {
        let indicator = flight.effort.indicator;
        let exponent = shared.options.windows.thrust_exponent;
        Self {
            exponent: exponent.unwrap_or_else(|| indicator.thrust_exponent()),
            without_thrust: indicator.without_thrust(),
        }
    }

    /// The effort that the same rotors have at the same flow without acceleration (m/s², up positive).
    fn steady_us(&self, effort: f64, acceleration: f64) -> f64 {
        let share = (1.0 + acceleration / GRAVITY_MPS2).max(0.2);
        self.without_thrust + (effort - self.without_thrust) * share.powf(-self.exponent)
    }
}

/// A series' integral, for means over any stretch: the series joined by straight lines.
pub(super) struct Integral<'a> {
    series: &'a Series,
    to: Vec<f64>,
}

impl<'a> Integral<'a> {
    pub(super) fn of(series: &'a Series) -> Self {
        let mut to = Vec::with_capacity(series.len());
        let mut sum = 0.0;
        let mut before: Option<(f64, f64)> = None;
        for (time, value) in series.time_s.iter().zip(&series.value) {
            if let Some((last, last_value)) = before {
                sum += (time - last) * f64::midpoint(*value, last_value);
            }
            before = Some((*time, *value));
            to.push(sum);
        }
        Self { series, to }
    }

    /// Integral up to a time; `None` outside of the samples and within silences.
    fn at(&self, time_s: f64, gap_s: f64) -> Option<f64> {
        let value = self.series.at(time_s, gap_s)?;
        let before = self.series.time_s.partition_point(|time| *time <= time_s).checked_sub(1)?;
        let (time, own) = (self.series.time_s.get(before)?, self.series.value.get(before)?);
        Some(self.to.get(before)? + (time_s - time) * f64::midpoint(*own, value))
    }

    /// Mean between two times; `None` across silences.
    pub(super) fn mean(&self, from_s: f64, to_s: f64, gap_s: f64) -> Option<f64> {
        let inside = self.series.times_between(from_s, to_s);
        let silent = inside.windows(2).any(|pair| pair[1] - pair[0] > gap_s);
        let mean = (self.at(to_s, gap_s)? - self.at(from_s, gap_s)?) / (to_s - from_s);
        (!silent && mean.is_finite()).then_some(mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_over_blocks_are_those_of_straight_lines() {
        let series = Series { time_s: vec![0.0, 1.0, 2.0, 6.0], value: vec![0.0, 2.0, 2.0, 4.0] };
        let integral = Integral::of(&series);
        assert_eq!(integral.mean(0.5, 1.5, 1.5), Some(0.75 + 1.0));
        assert_eq!(integral.mean(1.5, 3.0, 1.5), None, "a silence");
        assert_eq!(integral.mean(2.0, 6.0, 4.0), Some(3.0));
        assert_eq!(integral.mean(5.0, 7.0, 4.0), None, "beyond the end");
    }

    #[test]
    fn a_pulse_that_lifts_and_accelerates_is_that_of_the_lift_alone() {
        let response = Response { exponent: 0.5, without_thrust: 1000.0 };
        // dp/da = k (p - p0)/g = 0.5 * 400 / 9.81.
        let steady = response.steady_us(1400.0, 0.1);
        assert!((steady - (1400.0 - 0.1 * 0.5 * 400.0 / GRAVITY_MPS2)).abs() < 0.05, "{steady}");
    }
}
