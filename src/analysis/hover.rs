//! A hover second by second: running means of what was logged, and what is doubtful.
//!
//! A bad part (a motor at its limit, a gap, a manoeuvre) costs the values whose 10 s it touches, and
//! a flag; the rest of the hover stands.

use super::budget::{Quality, QualityFlag};
use super::cause::Cause;
use super::running::{RUNNING_S, Running};
use super::stats::mean_sd;
use super::windows::{Target, WindowOptions, lean_deg};
use crate::flight::{Alignment, Flight, Series};
use crate::numeric::{self, Line};

/// Quantum of a logged pulse, us: a motor within it of its limit is at the limit.
const QUANTUM_US: f64 = 1.0;
/// Clocks that agree with their source to this are aligned, s: half of a second of the map.
const ALIGNED_S: f64 = 0.5;
/// More drift than this is marked, us per minute: 0.4 m/s at 26 us/(m/s). A small drone's battery causes
/// about 3; chosen above that.
const DRIFT_US_PER_MIN: f64 = 10.0;
/// Shortest hover whose drift is stated, s. Chosen.
const DRIFT_S: f64 = 60.0;
/// Longest hover, s.
const LONGEST_S: i64 = 200_000;

/// Means over the 10 s around a whole second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Second {
    pub(super) time_s: f64,
    pub(super) pulse_us: f64,
    pub(super) velocity_mps: f64,
    pub(super) lean_deg: f64,
    pub(super) height_m: f64,
}

/// One drone's hover.
#[derive(Clone, Debug, Default)]
pub(super) struct Hover {
    pub(super) start_s: f64,
    pub(super) end_s: f64,
    pub(super) first_s: i64,
    pub(super) seconds: Vec<Option<Second>>,
    pub(super) quality: Vec<QualityFlag>,
    /// Means over single seconds of pulse and velocity, in good stretches.
    steps: Vec<[f64; 2]>,
    /// What the velocity's mean says against the change of height, m/s.
    pub(super) velocity_bias_mps: f64,
    /// Several legs and hovers of a drone that moves along a track ([`super::track`]).
    pub(super) moves: bool,
}

impl Hover {
    /// Adds a later stretch of the same flight; the seconds between have no values.
    pub(super) fn join(&mut self, later: Self) {
        if self.seconds.is_empty() {
            (self.start_s, self.first_s) = (later.start_s, later.first_s);
        }
        let until = usize::try_from(later.first_s.saturating_sub(self.first_s)).unwrap_or(0);
        // Stretches in another order than that of time are not joined.
        if until < self.seconds.len() || until > LONGEST_S as usize {
            return;
        }
        self.seconds.resize(until, None);
        self.seconds.extend(later.seconds);
        self.end_s = later.end_s;
        self.quality.extend(later.quality);
        self.steps.extend(later.steps);
    }

    /// Looks at a hover of a flight.
    pub(super) fn of(flight: &Flight, target: &Target, options: &WindowOptions) -> Self {
        let (start_s, end_s) = (target.start_s, target.end_s);
        let half = RUNNING_S / 2.0;
        let running = |series| Running::new(series, start_s, end_s);
        let pulse = running(&flight.effort.values);
        let velocity = running(&flight.velocity_up_mps);
        let (roll, pitch) = (running(&flight.roll_rad), running(&flight.pitch_rad));
        let (first_s, last_s) = ((start_s + half).ceil() as i64, (end_s - half).floor() as i64);
        let last_s = last_s.min(first_s.saturating_add(LONGEST_S));
        let ends_s = |series: &Series| series.span().map_or(f64::NEG_INFINITY, |(_, last)| last);
        let log_ends_s = ends_s(&flight.effort.values).min(ends_s(&flight.velocity_up_mps));
        let (low, high) = flight.pulse_limits_us;
        let mut hover = Self { start_s, end_s, first_s, ..Self::default() };
        let mut bad: Vec<Option<Quality>> = Vec::new();
        for second in first_s..=last_s {
            let time_s = second as f64;
            let (from, to) = (time_s - half, time_s + half);
            let at_limit =
                flight.pulse_max_us.between(from, to).iter().any(|u| *u >= high - QUANTUM_US)
                    || flight.pulse_min_us.between(from, to).iter().any(|u| *u <= low);
            let moved = {
                let (mean, sd) = mean_sd(flight.velocity_up_mps.between(from, to));
                let limit = options.follow_limit_mps;
                (mean - target.commanded_mps).abs() > limit || sd > limit
            };
            let means = (|| {
                Some(Second {
                    time_s,
                    pulse_us: pulse.mean(time_s)?,
                    velocity_mps: velocity.mean(time_s)?,
                    lean_deg: lean_deg(roll.mean(time_s)?, pitch.mean(time_s)?),
                    height_m: mean_sd(flight.height_m.between(from, to)).0,
                })
            })();
            let flag = match means {
                None if to > log_ends_s + 1.0 => Some(Quality::Incomplete),
                None => Some(Quality::Gap),
                Some(_) if at_limit => Some(Quality::Saturation),
                Some(_) if moved => Some(Quality::Manoeuvre),
                Some(_) => None,
            };
            bad.push(flag);
            hover.seconds.push(means.filter(|_| flag.is_none()));
        }
        hover.flag_stretches(&bad);
        hover.flag_clock(flight);
        hover.look_closer(flight);
        hover
    }

    fn flag_stretches(&mut self, bad: &[Option<Quality>]) {
        let mut start = 0;
        for index in 0..=bad.len() {
            let (this, before) = (bad.get(index), bad.get(start));
            if this == before {
                continue;
            }
            if let Some(Some(flag)) = before {
                let time = |index: usize| (self.first_s + index as i64) as f64;
                let (start_s, end_s) = (time(start), time(index - 1));
                let reason =
                    format!("{}: no values from {start_s:.0} to {end_s:.0} s", flag.words());
                self.quality.push(QualityFlag { flag: *flag, start_s, end_s, reason });
            }
            start = index;
        }
    }

    fn flag_clock(&mut self, flight: &Flight) {
        let clock = &flight.clock;
        let reason = if clock.method == Alignment::Takeoff {
            "its times count from take-off, not from the show's clock".to_owned()
        } else if clock.residual_s > ALIGNED_S {
            format!("its clock wanders by {:.1} s", clock.residual_s)
        } else {
            return;
        };
        let (start_s, end_s) = (self.start_s, self.end_s);
        let flag = Quality::Misaligned;
        self.quality.push(QualityFlag { flag, start_s, end_s, reason });
    }

    /// Second means for the noise, and the velocity against the height.
    fn look_closer(&mut self, flight: &Flight) {
        let mean = |series: &Series, from: f64, to: f64| numeric::mean(series.between(from, to));
        let mut last: Option<[f64; 2]> = None;
        for second in &self.seconds {
            let now = second.and_then(|second| {
                let (from, to) = (second.time_s - 0.5, second.time_s + 0.5);
                Some([
                    mean(&flight.effort.values, from, to)?,
                    mean(&flight.velocity_up_mps, from, to)?,
                ])
            });
            if let (Some(now), Some(last)) = (now, last) {
                self.steps.push([now[0] - last[0], now[1] - last[1]]);
            }
            last = now;
        }
        let good: Vec<&Second> = self.seconds.iter().flatten().collect();
        if let (Some(first), Some(last)) = (good.first(), good.last()) {
            let length_s = last.time_s - first.time_s;
            if good.len() as f64 > length_s && length_s > RUNNING_S {
                let climbed = (last.height_m - first.height_m) / length_s;
                let velocity = numeric::mean(good.iter().map(|second| second.velocity_mps));
                self.velocity_bias_mps = (velocity.unwrap_or_default() - climbed).abs();
            }
        }
    }

    /// Noise of a mean over one second, us: from the steps between seconds, so that slow air does
    /// not count, and with a velocity that moves the pulse by `slope`.
    pub(super) fn noise_us(&self, slope: f64) -> f64 {
        let squares: f64 =
            self.steps.iter().map(|[pulse, velocity]| (pulse - slope * velocity).powi(2)).sum();
        (squares / 2.0 / self.steps.len().max(1) as f64).sqrt()
    }

    /// Trend of pulses through the hover, us per minute, if it is worth a flag.
    pub(super) fn trend_us_per_min(pulses: &[(f64, f64)]) -> Option<f64> {
        let (first, last) = (pulses.first()?.0, pulses.last()?.0);
        let line = Line::through(pulses.iter().copied())?;
        let per_minute = 60.0 * line.xy / line.xx;
        (last - first >= DRIFT_S && per_minute.abs() > DRIFT_US_PER_MIN).then_some(per_minute)
    }

    /// Why there is not one value.
    pub(super) fn nothing(&self) -> Cause {
        let length_s = self.end_s - self.start_s;
        if length_s < RUNNING_S {
            return Cause::TooShort { length_s };
        }
        let mut reasons: Vec<&'static str> = Vec::new();
        for flag in self.quality.iter().filter(|flag| flag.flag.excludes()) {
            if !reasons.contains(&flag.flag.words()) {
                reasons.push(flag.flag.words());
            }
        }
        let track = self.moves;
        if reasons.is_empty() {
            return Cause::OutsideLaw { track };
        }
        Cause::Rejected { track, from_to_s: [self.start_s, self.end_s], reasons }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{Clock, Effort, Series};
    use crate::mission::plan::SegmentKind;

    fn flown(pulse: impl Fn(f64) -> f64) -> Flight {
        let time_s: Vec<f64> = (0..2000).map(|index| f64::from(index) / 10.0).collect();
        let series = |value: Vec<f64>| Series { time_s: time_s.clone(), value };
        let pulses: Vec<f64> = time_s.iter().map(|time| pulse(*time)).collect();
        Flight {
            effort: Effort { values: series(pulses.clone()), ..Effort::default() },
            pulse_max_us: series(pulses.clone()),
            pulse_min_us: series(pulses),
            pulse_limits_us: (1150.0, 1950.0),
            velocity_up_mps: series(vec![0.0; 2000]),
            height_m: series(vec![100.0; 2000]),
            roll_rad: series(vec![0.0; 2000]),
            pitch_rad: series(vec![0.0; 2000]),
            clock: Clock { method: Alignment::ShowRows, ..Clock::default() },
            ..Flight::default()
        }
    }

    fn look(flight: &Flight, end_s: f64) -> Hover {
        let label = String::new();
        let target =
            Target { kind: SegmentKind::Hover, label, start_s: 0.0, end_s, commanded_mps: 0.0 };
        Hover::of(flight, &target, &WindowOptions::default())
    }

    fn flags(hover: &Hover) -> Vec<(Quality, f64, f64)> {
        hover.quality.iter().map(|one| (one.flag, one.start_s, one.end_s)).collect()
    }

    #[test]
    fn a_motor_at_its_limit_costs_the_seconds_that_it_touches() {
        let hover = look(&flown(|time| if time == 50.0 { 1950.0 } else { 1540.0 }), 199.0);
        assert_eq!(flags(&hover), [(Quality::Saturation, 46.0, 55.0)]);
        assert_eq!(hover.quality[0].reason, "a motor touched its limit: no values from 46 to 55 s");
        assert_eq!(hover.seconds.len(), 190);
        assert_eq!(hover.seconds.iter().flatten().count(), 180);
    }

    #[test]
    fn a_climb_inside_of_a_hover_costs_its_seconds() {
        let mut flight = flown(|_| 1540.0);
        let moving = flight.velocity_up_mps.time_s.iter().map(|time| (80.0..84.0).contains(time));
        flight.velocity_up_mps.value = moving.map(|moves| f64::from(u8::from(moves))).collect();
        let hover = look(&flight, 199.0);
        assert_eq!(flags(&hover), [(Quality::Manoeuvre, 76.0, 88.0)]);
    }

    #[test]
    fn a_log_that_ends_early_keeps_what_it_has() {
        let hover = look(&flown(|_| 1540.0), 300.0);
        assert_eq!(flags(&hover), [(Quality::Incomplete, 196.0, 295.0)]);
        let none = Hover { seconds: Vec::new(), ..hover };
        assert_eq!(
            none.nothing().to_string(),
            "the hover from 0 to 300 s was rejected: the log ends early"
        );
        let short = look(&flown(|_| 1540.0), 8.0);
        assert!(
            short.nothing().to_string().starts_with("the hover is too short: its window has 8 s")
        );
    }

    #[test]
    fn a_gap_is_no_end() {
        let mut flight = flown(|_| 1540.0);
        let kept = |time: &f64| !(100.0..103.0).contains(time);
        let time_s: Vec<f64> = flight.effort.values.time_s.iter().copied().filter(kept).collect();
        flight.effort.values = Series { value: vec![1540.0; time_s.len()], time_s };
        assert_eq!(flags(&look(&flight, 199.0)), [(Quality::Gap, 96.0, 106.0)]);
    }

    #[test]
    fn a_clock_from_take_off_and_a_strong_drift_are_told() {
        let mut flight = flown(|time| 1540.0 + 0.3 * time);
        flight.clock.method = Alignment::Takeoff;
        let hover = look(&flight, 199.0);
        assert_eq!(hover.quality[0].flag, Quality::Misaligned);
        let pulses: Vec<(f64, f64)> =
            hover.seconds.iter().flatten().map(|one| (one.time_s, one.pulse_us)).collect();
        assert!((Hover::trend_us_per_min(&pulses).unwrap() - 18.0).abs() < 0.01);
        let calm = look(&flown(|time| 1540.0 + 0.1 * time), 199.0);
        let pulses: Vec<(f64, f64)> =
            calm.seconds.iter().flatten().map(|one| (one.time_s, one.pulse_us)).collect();
        assert_eq!(Hover::trend_us_per_min(&pulses), None, "6 us per minute are not rare");
    }

    #[test]
    fn noise_is_that_of_seconds_and_not_of_slow_air() {
        let slow = |time: f64| 1540.0 + 20.0 * (time / 60.0).sin();
        assert!(look(&flown(slow), 199.0).noise_us(26.0) < 0.3);
        let odd = |time: f64| 1540.0 + if time.round() as i64 % 2 == 0 { 2.0 } else { -2.0 };
        let noise = look(&flown(odd), 199.0).noise_us(26.0);
        assert!((2.5..3.0).contains(&noise), "steps of 4 us: {noise}");
    }

    #[test]
    fn a_hover_is_as_long_as_from_its_start_to_its_end() {
        let from_to = |start_s, end_s| Hover { start_s, end_s, ..Hover::default() };
        let short = from_to(100.0, 108.0).nothing().to_string();
        assert!(short.starts_with("the hover is too short: its window has 8 s"), "{short}");
        assert_eq!(from_to(100.0, 140.0).nothing(), Cause::OutsideLaw { track: false });
    }
}
