//! Windows: intervals of constant commanded velocity, from the plan or from the log itself, and what
//! the vehicle did in them.
//!
//! The paper's rule: of a leg the last 10 s without the last second; of a hover all but the first
//! 3 s (the controller's overshoot) and the last second.

use super::battery;
use super::cause::Cause;
use super::stats::{SampleStats, sample_stats};
use super::window::{Rejection, WindowStats};
use crate::flight::{Flight, Indicator, Series};
use crate::mission::plan::{Segment, SegmentKind};
use crate::numeric::{self, extent, upper_median};

/// Correction of rotor effort for tilt.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Tilt {
    /// The paper's `u cos(phi)`. It scales the whole pulse, also the 1000 us that make no thrust,
    /// and takes thrust for linear in the pulse: at 8 degrees of tilt that is 12 us too much on a
    /// real drone, which reads as 0.46 m/s of updraft.
    Paper,
    /// The share that the vertical part of the thrust takes: `(u - 1000) cos(phi)^p + 1000` with p
    /// the power of thrust that the excess pulse goes with ([`Indicator::thrust_exponent`]).
    #[default]
    Thrust,
}

impl Tilt {
    /// Value of an indicator at a tilt, corrected to level flight, in its unit.
    pub fn correct(self, value: f64, tilt_rad: f64, indicator: Indicator, exponent: f64) -> f64 {
        let cos = tilt_rad.cos();
        match self {
            Self::Paper => value * cos,
            Self::Thrust => {
                let zero = indicator.without_thrust();
                (value - zero) * cos.powf(exponent) + zero
            }
        }
    }
}

/// Options for measuring windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowOptions {
    /// Correction for tilt.
    pub tilt: Tilt,
    /// Power of thrust that the indicator goes with, where the vehicle is known; else
    /// [`Indicator::thrust_exponent`].
    pub thrust_exponent: Option<f64>,
    /// Block length for standard errors, s: longer than the memory of gusts and controller.
    pub block_s: f64,
    /// A window is rejected when the mean velocity is further than this from the command, m/s.
    pub follow_limit_mps: f64,
}

impl Default for WindowOptions {
    fn default() -> Self {
        Self { tilt: Tilt::default(), thrust_exponent: None, block_s: 1.0, follow_limit_mps: 0.3 }
    }
}

impl WindowOptions {
    fn exponent(&self, indicator: Indicator) -> f64 {
        self.thrust_exponent
            .filter(|_| indicator == Indicator::Pulse)
            .unwrap_or_else(|| indicator.thrust_exponent())
    }

    /// What the other form of the tilt correction would change at an indicator's value and a tilt.
    fn other_form(&self, value: f64, tilt_rad: f64, indicator: Indicator) -> f64 {
        let exponent = self.exponent(indicator);
        let other = match self.tilt {
            Tilt::Paper => Tilt::Thrust,
            Tilt::Thrust => Tilt::Paper,
        };
        let by = |tilt: Tilt| tilt.correct(value, tilt_rad, indicator, exponent);
        by(other) - by(self.tilt)
    }
}

/// A window to measure: its time, and the command in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Kind of the segment.
    pub kind: SegmentKind,
    /// Name of the window for people.
    pub label: String,
    /// Start of the window, show time, s.
    pub start_s: f64,
    /// End of the window, excluded, s.
    pub end_s: f64,
    /// Commanded vertical velocity, up positive, m/s.
    pub commanded_mps: f64,
}

/// Last part of a leg that is used, s: the paper's.
const LEG_USED_S: f64 = 10.0;
/// Cut at the end of every window, s: the paper's.
const END_CUT_S: f64 = 1.0;
/// Cut at the start of a hover (and the least cut at the start of a leg), s: the overshoot after 3.5 m/s
/// lasts 2 to 3 s (docs/physics.md, 5.1). The paper does not say.
const START_CUT_S: f64 = 3.0;
/// Shortest constant command that is a leg or hover, s.
const SHORTEST_RUN_S: f64 = 8.0;
/// Shortest stretch of a logged command that counts as steady, s.
const SHORTEST_STEADY_S: f64 = 4.0;
/// Longest time that a vehicle takes from one steady command to the next, s.
const LONGEST_TRANSITION_S: f64 = 5.0;
/// Legs shorter than this share of the longest one are transfers, not rungs. Chosen.
const TRANSFER_SHARE: f64 = 0.6;
/// Wobble of a constant command, m/s (firmware adds its own corrections in some messages). Chosen.
const STEADY_MPS: f64 = 0.03;
/// A command below this is a hover, m/s.
const HOVER_MPS: f64 = 0.05;
/// A silence longer than this breaks a window, s.
const GAP_S: f64 = 1.0;
/// A silence longer than this breaks a run of commands (some logs have them once a second), s.
const RUN_GAP_S: f64 = 1.5;
/// Fewest samples in a usable window: half a second of a log at 10 Hz. Chosen.
const FEWEST_SAMPLES: usize = 5;
/// A commanded velocity further than this from the plan's belongs to another plan, m/s. Chosen: below the
/// 0.5 m/s between rungs.
const WRONG_MPS: f64 = 0.3;
/// Fewest legs from which a constant time offset is told.
const OFFSET_LEGS: usize = 3;
/// Legs of two ladders whose speeds differ by less are the same, m/s.
const SAME_LEG_MPS: f64 = 0.1;
/// Fewest wrong legs that refuse a log when they are half of it.
const FEWEST_WRONG: usize = 2;
/// How far the time offsets of a ladder's legs may lie apart and still be one, s.
const OFFSET_SPREAD_S: f64 = 1.0;
/// Smallest time offset that is told, s.
const OFFSET_MIN_S: f64 = 0.5;
/// Pulse quantum, us: a motor within it of its limit is at the limit.
const QUANTUM_US: f64 = 1.0;

/// Windows of a plan's segments: legs, hovers, and those horizontal legs that carry a window.
pub fn planned(segments: &[Segment]) -> Vec<Target> {
    let analysed = |segment: &&Segment| {
        segment.kind.is_leg() || segment.kind.is_hover() || segment.kind == SegmentKind::Horizontal
    };
    let target = |segment: &Segment| {
        let window = segment.window?;
        Some(Target {
            kind: segment.kind,
            label: segment.label.clone(),
            start_s: window.start_ms as f64 / 1000.0,
            end_s: window.end_ms as f64 / 1000.0,
            commanded_mps: round_mmps(segment.velocity_mps[2]),
        })
    };
    segments.iter().filter(analysed).filter_map(target).collect()
}

/// Those of a plan's windows that a map of the air is made of: legs that calibrate the wind, and the hovers between
/// them, are none.
pub(super) fn of_air(segments: &[Segment]) -> Vec<Target> {
    let segments: Vec<Segment> =
        segments.iter().filter(|segment| !segment.calibrates_wind).cloned().collect();
    planned(&segments)
}

/// Windows from the log's own desired velocity: wherever it is constant for 8 s or more.
///
/// Horizontal legs are told from hovers where the log has horizontal commands. Legs much shorter
/// than the longest (climbs to height, descents to land) are not rungs and are left out.
pub fn inferred(flight: &Flight) -> Vec<Target> {
    let Some(desired) = &flight.desired_up_mps else { return Vec::new() };
    let mut runs: Vec<Run> = steady_runs(desired);
    runs.retain(|run| run.duration_s() >= SHORTEST_STEADY_S);
    let mut last_end = f64::NEG_INFINITY;
    for run in &mut runs {
        if run.steady_s - last_end <= LONGEST_TRANSITION_S {
            run.start_s = last_end;
        }
        last_end = run.end_s;
    }
    runs.retain(|run| run.duration_s() >= SHORTEST_RUN_S && flies(flight, run));
    let longest_leg = runs
        .iter()
        .filter(|run| run.velocity_mps.abs() > HOVER_MPS)
        .map(Run::duration_s)
        .fold(0.0, f64::max);
    let target = |run: &Run| {
        let velocity = run.velocity_mps;
        if velocity.abs() <= HOVER_MPS {
            let speed = flight
                .desired_horizontal_mps
                .as_ref()
                .map(|series| mean(series.between(run.start_s, run.end_s)))
                .unwrap_or_default();
            let moves = speed > HOVER_MPS;
            return Some(Target {
                kind: if moves { SegmentKind::Horizontal } else { SegmentKind::Hover },
                label: if moves { format!("level {speed:.1} m/s") } else { "hover".to_owned() },
                start_s: (run.start_s + START_CUT_S).max(run.steady_s),
                end_s: run.end_s - END_CUT_S,
                commanded_mps: 0.0,
            });
        }
        if run.duration_s() < TRANSFER_SHARE * longest_leg {
            return None;
        }
        let (kind, word) = if velocity > 0.0 {
            (SegmentKind::LegUp, "up")
        } else {
            (SegmentKind::LegDown, "down")
        };
        Some(Target {
            kind,
            label: format!("{word} {} m/s", velocity.abs()),
            start_s: (run.end_s - LEG_USED_S).max(run.start_s + START_CUT_S).max(run.steady_s),
            end_s: run.end_s - END_CUT_S,
            commanded_mps: velocity,
        })
    };
    runs.iter().filter_map(target).collect()
}

struct Run {
    /// When the command was given: where the run before ended, if the time between is a transition.
    start_s: f64,
    /// From when on the logged command is steady (firmware rounds off the plan's steps).
    steady_s: f64,
    end_s: f64,
    velocity_mps: f64,
}

impl Run {
    fn duration_s(&self) -> f64 {
        self.end_s - self.start_s
    }
}

/// Stretches over which the command stays put. A run ends where the next command begins.
fn steady_runs(desired: &Series) -> Vec<Run> {
    let mut runs = Vec::new();
    let mut start = 0;
    let mut sum = 0.0;
    let n = desired.len();
    let (times, values) = (&desired.time_s, &desired.value);
    for index in 0..=n {
        let current = times.get(index).copied().zip(values.get(index).copied());
        let before = index.checked_sub(1).and_then(|before| times.get(before).copied());
        let mean = sum / (index - start).max(1) as f64;
        let goes_on = match (current, before) {
            (Some((time, value)), Some(before)) if index > start => {
                time - before <= RUN_GAP_S && (value - mean).abs() <= STEADY_MPS
            }
            (Some(_), _) => true,
            (None, _) => false,
        };
        if !goes_on {
            let window = values.get(start..index).unwrap_or_default().to_vec();
            if let (Some(start_s), Some(last), Some(median)) =
                (times.get(start), before, upper_median(window))
            {
                // The command held until the row that says otherwise, unless the log was silent.
                let end_s = current
                    .map_or(last, |(time, _)| if time - last <= RUN_GAP_S { time } else { last });
                let velocity_mps = round_mmps(median);
                runs.push(Run { start_s: *start_s, steady_s: *start_s, end_s, velocity_mps });
            }
            start = index;
            sum = 0.0;
        }
        sum += current.map_or(0.0, |(_, value)| value);
    }
    runs
}

/// Whether the vehicle is armed and off the ground in a run (a desired velocity of 0 is also logged
/// while it stands).
fn flies(flight: &Flight, run: &Run) -> bool {
    let middle = f64::midpoint(run.start_s, run.end_s);
    let armed = flight.armed_s.iter().any(|(start, end)| (*start..=*end).contains(&middle));
    // Standing, the motors idle well below the lowest output in flight. That is seen in the pulses,
    // whatever the flight's effort is read by.
    let pulses = match flight.effort.indicator {
        Indicator::Pulse => &flight.effort.values,
        Indicator::RotorSpeed | Indicator::Power => &flight.pulse_max_us,
    };
    let spins =
        mean(pulses.between(run.start_s, run.end_s)) > flight.pulse_limits_us.0 - QUANTUM_US;
    (armed || flight.armed_s.is_empty()) && spins
}

fn round_mmps(velocity_mps: f64) -> f64 {
    // + 0.0 turns -0 into 0.
    (velocity_mps * 1000.0).round() / 1000.0 + 0.0
}

fn mean(values: &[f64]) -> f64 {
    numeric::mean(values).unwrap_or_default()
}

/// Channels derived from a flight at the times of its rotor effort.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Corrected {
    /// Tilt-corrected rotor effort (u_phi), in the unit of the flight's indicator.
    pub effort: Series,
    /// Tilt from the vertical, degrees.
    pub tilt_deg: Series,
}

/// Corrects rotor effort for tilt, `phi = arctan sqrt(tan² pitch + tan² roll)`, with roll and pitch
/// interpolated to its times. Samples without attitude within 1 s are left out.
pub fn correct_tilt(flight: &Flight, options: &WindowOptions) -> Corrected {
    let exponent = options.exponent(flight.effort.indicator);
    let mut corrected = Corrected::default();
    for (time, value) in flight.effort.values.time_s.iter().zip(&flight.effort.values.value) {
        let (Some(roll), Some(pitch)) =
            (nearby(&flight.roll_rad, *time), nearby(&flight.pitch_rad, *time))
        else {
            continue;
        };
        let phi = pitch.tan().hypot(roll.tan()).atan();
        let value = options.tilt.correct(*value, phi, flight.effort.indicator, exponent);
        corrected.effort.time_s.push(*time);
        corrected.effort.value.push(value);
        corrected.tilt_deg.time_s.push(*time);
        corrected.tilt_deg.value.push(phi.to_degrees());
    }
    corrected
}

/// Angle between the vertical and the rotor axis at a mean roll and pitch, degrees. The mean of
/// [`Corrected::tilt_deg`] is not that: noise of the attitude only ever adds to an angle.
pub(super) fn lean_deg(roll_rad: f64, pitch_rad: f64) -> f64 {
    pitch_rad.tan().hypot(roll_rad.tan()).atan().to_degrees()
}

/// Interpolated value; at the ends of the log, where one neighbour is missing, the other one's.
fn nearby(series: &Series, time_s: f64) -> Option<f64> {
    series.at(time_s, GAP_S).or_else(|| series.latest(time_s, GAP_S)).or_else(|| {
        let (first, _) = series.span()?;
        (0.0..=GAP_S).contains(&(first - time_s)).then(|| series.value.first().copied())?
    })
}

/// Measures the vehicle in each window.
pub fn measure(
    flight: &Flight,
    corrected: &Corrected,
    targets: &[Target],
    options: &WindowOptions,
) -> Vec<WindowStats> {
    targets.iter().map(|target| measure_one(flight, corrected, target, options)).collect()
}

fn measure_one(
    flight: &Flight,
    corrected: &Corrected,
    target: &Target,
    options: &WindowOptions,
) -> WindowStats {
    let (start, end) = (target.start_s, target.end_s);
    let stats = |series: &Series| -> SampleStats {
        sample_stats(series.times_between(start, end), series.between(start, end), options.block_s)
    };
    let velocity = stats(&flight.velocity_up_mps);
    let effort_phi = stats(&corrected.effort);
    let mut rejected = Vec::new();
    let (low, high) = flight.pulse_limits_us;
    let touches = flight.pulse_max_us.between(start, end).iter().any(|u| *u >= high - QUANTUM_US)
        || flight.pulse_min_us.between(start, end).iter().any(|u| *u <= low);
    if touches {
        rejected.push(Rejection::Saturated);
    }
    let needed = [&flight.velocity_up_mps, &corrected.effort];
    let ends_early =
        needed.iter().any(|series| series.span().is_none_or(|(_, last)| last < end - GAP_S));
    if ends_early {
        rejected.push(Rejection::Incomplete);
    } else if needed.iter().any(|series| series.longest_gap_s(start, end) > GAP_S)
        || velocity.n < FEWEST_SAMPLES
        || effort_phi.n < FEWEST_SAMPLES
    {
        rejected.push(Rejection::Gap);
    }
    if velocity.n > 0 && (velocity.mean - target.commanded_mps).abs() > options.follow_limit_mps {
        rejected.push(Rejection::NotFollowing);
    } else if target.kind.is_hover() && velocity.sd > options.follow_limit_mps {
        // It went up and down: on the average it stayed, but that is no hover.
        rejected.push(Rejection::Manoeuvre);
    }
    WindowStats {
        kind: target.kind,
        label: target.label.clone(),
        start_s: start,
        end_s: end,
        commanded_mps: target.commanded_mps,
        height_m: mean(flight.height_m.between(start, end)),
        velocity_mps: velocity,
        effort: stats(&flight.effort.values),
        effort_phi,
        tilt_deg: stats(&corrected.tilt_deg),
        lean_deg: lean_deg(
            mean(flight.roll_rad.between(start, end)),
            mean(flight.pitch_rad.between(start, end)),
        ),
        tilt_form_us: options.other_form(
            mean(flight.effort.values.between(start, end)),
            mean(corrected.tilt_deg.between(start, end)).to_radians(),
            flight.effort.indicator,
        ),
        offset_us: None,
        offset_outside: false,
        supply: battery::supply(flight, start, end),
        rejected,
    }
}

/// Whether the log contradicts the plan: what was flown instead, if more than half of the plan's legs
/// (or of its hovers, when it has no legs) were commanded otherwise. A log without commands is
/// judged by its measured velocity.
pub fn contradiction(flight: &Flight, targets: &[Target]) -> Option<Cause> {
    let series = flight.desired_up_mps.as_ref().unwrap_or(&flight.velocity_up_mps);
    let flown = |target: &Target| {
        let values = series.between(target.start_s, target.end_s);
        (!values.is_empty()).then(|| mean(values))
    };
    // A ladder flown instead of a hover goes up and down: on the average it stands still.
    let busy = |target: &Target| {
        let values = series.between(target.start_s, target.end_s);
        let off = values.iter().filter(|v| (**v - target.commanded_mps).abs() > WRONG_MPS).count();
        target.kind.is_hover() && 2 * off > values.len()
    };
    let has_legs = targets.iter().any(|target| target.kind.is_leg() && flown(target).is_some());
    let compared: Vec<(&Target, f64)> = targets
        .iter()
        .filter(|target| !has_legs || target.kind.is_leg())
        .filter_map(|target| Some((target, flown(target)?)))
        .collect();
    let wrong: Vec<&(&Target, f64)> = compared
        .iter()
        .filter(|(target, flown)| (flown - target.commanded_mps).abs() > WRONG_MPS || busy(target))
        .collect();
    // Half of some legs is no accident either.
    let too_many = 2 * wrong.len() > compared.len()
        || (wrong.len() >= FEWEST_WRONG && 2 * wrong.len() == compared.len());
    let (target, flown) = wrong.first().filter(|_| too_many)?;
    let label = target.label.clone();
    if busy(target) {
        return Some(Cause::Restless { label, from_to_s: [target.start_s, target.end_s] });
    }
    Some(Cause::OtherSpeeds {
        wrong_of: [wrong.len(), compared.len()],
        legs: has_legs,
        label,
        start_s: target.start_s,
        planned_flown_mps: [target.commanded_mps, *flown],
        offset_s: time_offset_s(flight, targets),
    })
}

/// How much later than planned the legs were flown, s, if they were the plan's legs in the plan's
/// order, all off by the same time.
fn time_offset_s(flight: &Flight, targets: &[Target]) -> Option<f64> {
    let legs = |targets: &[Target]| -> Vec<(f64, f64)> {
        let legs = targets.iter().filter(|target| target.kind.is_leg());
        legs.map(|leg| (leg.commanded_mps, leg.end_s)).collect()
    };
    let (planned, flown) = (legs(targets), legs(&inferred(flight)));
    let same = planned.iter().zip(&flown).all(|(a, b)| (a.0 - b.0).abs() < SAME_LEG_MPS);
    if planned.len() < OFFSET_LEGS || planned.len() != flown.len() || !same {
        return None;
    }
    let offsets: Vec<f64> = planned.iter().zip(&flown).map(|(a, b)| b.1 - a.1).collect();
    let (least, most) = extent(&offsets)?;
    let median = upper_median(offsets)?;
    (most - least <= OFFSET_SPREAD_S && median.abs() >= OFFSET_MIN_S).then_some(median)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_leaning_drone_needs_less_pulse_upright() {
        let tilt = 8.0_f64.to_radians();
        let cos = tilt.cos();
        let paper = Tilt::Paper.correct(1546.0, tilt, Indicator::Pulse, 1.0);
        assert!((paper - 1546.0 * cos).abs() < 1e-9);
        // The thrust is that of the pulse beyond 1000 us.
        let thrust = Tilt::Thrust.correct(1546.0, tilt, Indicator::Pulse, 0.5);
        assert!((thrust - (1000.0 + 546.0 * cos.sqrt())).abs() < 1e-9, "{thrust}");
        assert_eq!(Tilt::Thrust.correct(1546.0, 0.0, Indicator::Pulse, 0.5), 1546.0);
    }

    #[test]
    fn beside_the_log_its_last_and_first_values_hold_for_a_gap() {
        let series = Series { time_s: vec![10.0, 10.5, 11.0], value: vec![1.0, 2.0, 5.0] };
        assert_eq!(nearby(&series, 10.25), Some(1.5));
        assert_eq!(nearby(&series, 11.0 + 0.5 * GAP_S), Some(5.0));
        assert_eq!(nearby(&series, 10.0 - 0.5 * GAP_S), Some(1.0));
        assert_eq!(nearby(&series, 11.0 + 1.5 * GAP_S), None);
        assert_eq!(nearby(&series, 10.0 - 1.5 * GAP_S), None);
    }
}
