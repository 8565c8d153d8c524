//! A hover second by second: running means of what was logged, and what is doubtful.
//!
//! A bad part (a motor at its limit, a gap, a manoeuvre) costs the values whose 10 s it touches, and
//! a flag; the rest of the hover stands.

use super::budget::{Quality, QualityFlag};
use super::stats::mean_sd;
use super::updraft::{RUNNING_S, Running};
use super::windows::{Target, WindowOptions, lean_deg};
use crate::flight::{Alignment, Flight};

/// Pulse quantum, us: a motor within it of its limit is at the limit.
const QUANTUM_US: f64 = 1.0;
/// Clocks that agree with their source to this are aligned, s.
const ALIGNED_S: f64 = 0.5;
/// More drift than this is marked, us per minute: 0.4 m/s at 26 us/(m/s).
const DRIFT_US_PER_MIN: f64 = 10.0;
/// Shortest hover whose drift is told, s.
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
}

impl Hover {
    /// Looks at a hover of a flight.
    pub(super) fn of(flight: &Flight, target: &Target, options: &WindowOptions) -> Self {
        let (start_s, end_s) = (target.start_s, target.end_s);
        let half = RUNNING_S / 2.0;
        let running = |series| Running::new(series, start_s, end_s);
        let pulse = running(&flight.pulse_us);
        let velocity = running(&flight.velocity_up_mps);
        let (roll, pitch) = (running(&flight.roll_rad), running(&flight.pitch_rad));
        let (first_s, last_s) = ((start_s + half).ceil() as i64, (end_s - half).floor() as i64);
        let last_s = last_s.min(first_s.saturating_add(LONGEST_S));
        let log_ends_s = [&flight.pulse_us, &flight.velocity_up_mps]
            .iter()
            .map(|series| series.span().map_or(f64::NEG_INFINITY, |(_, last)| last))
            .fold(f64::INFINITY, f64::min);
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
        let mean = |series: &crate::flight::Series, from: f64, to: f64| {
            let values = series.between(from, to);
            (!values.is_empty()).then(|| mean_sd(values).0)
        };
        let mut last: Option<[f64; 2]> = None;
        for second in &self.seconds {
            let now = second.and_then(|second| {
                let (from, to) = (second.time_s - 0.5, second.time_s + 0.5);
                Some([mean(&flight.pulse_us, from, to)?, mean(&flight.velocity_up_mps, from, to)?])
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
                let velocity =
                    good.iter().map(|second| second.velocity_mps).sum::<f64>() / good.len() as f64;
                self.velocity_bias_mps = (velocity - climbed).abs();
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
    pub(super) fn trend_us_per_min(&self, pulses: &[(f64, f64)]) -> Option<f64> {
        let (first, last) = (pulses.first()?.0, pulses.last()?.0);
        let n = pulses.len() as f64;
        let mean = |value: fn(&(f64, f64)) -> f64| pulses.iter().map(value).sum::<f64>() / n;
        let (time, pulse) = (mean(|one| one.0), mean(|one| one.1));
        let (mut tt, mut tu) = (0.0, 0.0);
        for one in pulses {
            tt += (one.0 - time).powi(2);
            tu += (one.0 - time) * (one.1 - pulse);
        }
        let per_minute = 60.0 * tu / tt;
        (last - first >= DRIFT_S && per_minute.abs() > DRIFT_US_PER_MIN).then_some(per_minute)
    }

    /// Why there is not one value.
    pub(super) fn nothing(&self) -> String {
        let length_s = self.end_s - self.start_s;
        if length_s < RUNNING_S {
            return format!(
                "the hover is too short: its window has {length_s:.0} s, the running mean needs \
                 {RUNNING_S:.0} s"
            );
        }
        let mut reasons: Vec<&str> = Vec::new();
        for flag in self.quality.iter().filter(|flag| flag.flag.excludes()) {
            if !reasons.contains(&flag.flag.words()) {
                reasons.push(flag.flag.words());
            }
        }
        if reasons.is_empty() {
            return "the hover's pulses are outside of the law's range".to_owned();
        }
        format!(
            "the hover from {:.0} to {:.0} s was rejected: {}",
            self.start_s,
            self.end_s,
            reasons.join(", ")
        )
    }
}
