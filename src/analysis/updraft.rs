//! The map of the air (eqs. 6-7): `W = V_U - f⁻¹(u_phi)` on running 10 s means, then on a common
//! 1 s grid.

use nalgebra::{DMatrix, DVector};

use super::fitted::Fit;
use super::law::Law;
use super::levelled::Levelled;
use super::measured::Measured;
use super::running::{RUNNING_S, Running};
use super::stats::{block_error, mean_sd};
use super::wind::{self, Leaning};
use super::window::WindowStats;
use super::windows::{Target, lean_deg};
use crate::base::estimate::Estimate;
use crate::flight::{Flight, Series};

/// Fewest running values in a 1 s bin. Chosen; logs have 10.
const FEWEST_PER_BIN: usize = 3;
/// Blocks for the error of the mean: twice the running window, so that blocks are nearly independent.
const BLOCK_S: f64 = 20.0;
/// No map is longer, whatever times a damaged log claims, s.
const LONGEST_S: usize = 200_000;
/// Below this air velocity the inverse of the signed-quadratic law is too steep to propagate errors
/// through; this velocity's slope stands in, m/s.
const STEEP_MPS: f64 = 0.05;

/// One drone's updraft on the 1 s grid, before the fleet's common times are known.
#[derive(Clone, Debug)]
pub struct DroneSeries {
    /// Whole second of show time of the first bin; bin k covers [k - 0.5, k + 0.5).
    pub first_s: i64,
    /// Estimates, m/s, up positive; `None` where the log has a gap.
    pub updraft_mps: Vec<Option<f64>>,
    /// Mean over the hover. Its error joins the scatter of 20 s blocks and the errors of the law.
    pub mean: Estimate,
    /// Systematic error of the mean from wind on the leaning drone, m/s.
    pub systematic_mps: f64,
    /// Lean of the mean attitude in the hover, degrees.
    pub tilt_deg: f64,
    /// Mean height above home, m.
    pub height_m: f64,
    /// Errors, where the calibration tells them.
    pub(super) measured: Option<Measured>,
    /// Where a drone that moved was at each second: north and east of its home and above it, m;
    /// empty for a hover.
    pub(super) moved_m: Vec<Option<[f64; 3]>>,
    /// What a vehicle's response with a fitted level left for the comparison with the truth.
    pub(super) levelled: Option<Box<Levelled>>,
}

/// Lean of a drone, with its effect on the drone's estimate.
#[derive(Clone, Copy, Debug)]
pub struct Lean<'a> {
    /// Lean of the vehicle in wind, where that is known.
    pub leaning: Option<Leaning>,
    /// The drone's windows in the calibration.
    pub calibration: &'a [WindowStats],
}

/// Longest hover among the windows, in which a measurement is made.
pub fn hover(targets: &[Target]) -> Option<&Target> {
    let length = |target: &&Target| target.end_s - target.start_s;
    targets
        .iter()
        .filter(|target| target.kind.is_hover())
        .max_by(|left, right| length(left).total_cmp(&length(right)))
}

/// Estimates the vertical air speed over a hover with a law and its fit's covariance.
///
/// `None` when the hover has no full running window without a gap.
pub fn estimate(
    flight: &Flight,
    pulse_phi_us: &Series,
    hover: &Target,
    fit: &Fit,
    lean: Lean<'_>,
) -> Option<DroneSeries> {
    let law = Law::from_fit(fit)?;
    let velocity = Running::new(&flight.velocity_up_mps, hover.start_s, hover.end_s);
    let pulse = Running::new(pulse_phi_us, hover.start_s, hover.end_s);
    let roll = Running::new(&flight.roll_rad, hover.start_s, hover.end_s);
    let pitch = Running::new(&flight.pitch_rad, hover.start_s, hover.end_s);
    let half = RUNNING_S / 2.0;
    let mut values = Series::default();
    for time in pulse_phi_us.times_between(hover.start_s + half, hover.end_s - half) {
        let (Some(velocity), Some(pulse)) = (velocity.mean(*time), pulse.mean(*time)) else {
            continue;
        };
        // The attitude is averaged first: the flow that a lean lets through is not linear in it.
        let through = lean.leaning.map_or(0.0, |leaning| {
            let attitude = roll.mean(*time).zip(pitch.mean(*time));
            attitude.map_or(0.0, |(roll, pitch)| leaning.axial_mps(lean_deg(roll, pitch)))
        });
        let updraft = velocity + through - law.air_velocity_mps(pulse);
        if updraft.is_finite() {
            values.time_s.push(*time);
            values.value.push(updraft);
        }
    }
    let (first, last) = values.span()?;
    let first_s = first.round() as i64;
    let seconds = usize::try_from(last.round() as i64 - first_s + 1).ok()?.min(LONGEST_S);
    let bin = |index: usize| {
        let centre = (first_s + index as i64) as f64;
        let values = values.between(centre - 0.5, centre + 0.5);
        (values.len() >= FEWEST_PER_BIN).then(|| mean_sd(values).0)
    };
    let updraft_mps: Vec<Option<f64>> = (0..seconds).map(bin).collect();
    let (times, known): (Vec<f64>, Vec<f64>) = updraft_mps
        .iter()
        .enumerate()
        .filter_map(|(index, value)| Some(((first_s + index as i64) as f64, (*value)?)))
        .unzip();
    let (mean, sd) = mean_sd(&known);
    if known.is_empty() {
        return None;
    }
    let scatter = block_error(&times, &known, BLOCK_S).unwrap_or(sd);
    let mean_pulse = mean_sd(pulse_phi_us.between(hover.start_s, hover.end_s)).0;
    let from_law = law_error_mps(law, fit, mean_pulse);
    let mean_rad = |angle: &Series| mean_sd(angle.between(hover.start_s, hover.end_s)).0;
    let tilt_deg = lean_deg(mean_rad(&flight.roll_rad), mean_rad(&flight.pitch_rad));
    let raw_pulse = mean_sd(flight.effort.values.between(hover.start_s, hover.end_s)).0;
    let at_hover = (if raw_pulse > 0.0 { raw_pulse } else { mean_pulse }, tilt_deg);
    Some(DroneSeries {
        first_s,
        updraft_mps,
        mean: Estimate::new(mean, scatter.hypot(from_law)),
        systematic_mps: wind::systematic_mps(lean.leaning, law, at_hover, lean.calibration),
        tilt_deg,
        height_m: mean_sd(flight.height_m.between(hover.start_s, hover.end_s)).0,
        measured: None,
        moved_m: Vec::new(),
        levelled: None,
    })
}

/// The updraft of a drone with its errors, from values that a calibration with errors gave.
pub(super) fn with_errors(
    flight: &Flight,
    hover: &Target,
    measured: Measured,
    systematic_mps: f64,
) -> DroneSeries {
    let mean = |series: &Series| mean_sd(series.between(hover.start_s, hover.end_s)).0;
    DroneSeries {
        first_s: measured.first_s,
        updraft_mps: measured.updraft_mps.clone(),
        mean: Estimate::new(measured.mean_mps, measured.errors.total_mps),
        systematic_mps,
        tilt_deg: lean_deg(mean(&flight.roll_rad), mean(&flight.pitch_rad)),
        height_m: mean(&flight.height_m),
        measured: Some(measured),
        moved_m: Vec::new(),
        levelled: None,
    }
}

/// Error of `f⁻¹(u)` from the covariance of the law's parameters, m/s.
fn law_error_mps(law: Law, fit: &Fit, pulse_us: f64) -> f64 {
    let gradient = match law {
        Law::Linear { slope, u0_us } => {
            vec![-(pulse_us - u0_us) / (slope * slope), -1.0 / slope]
        }
        Law::SignedQuadratic { a, .. } => {
            let air = law.air_velocity_mps(pulse_us);
            let steep = air.abs().max(STEEP_MPS);
            // W of the calibration is not a property of the drone: it does not enter the inverse.
            vec![-air / (2.0 * a), -1.0 / (2.0 * a * steep), 0.0]
        }
    };
    let n = gradient.len();
    if fit.covariance.len() != n * n {
        return 0.0;
    }
    let gradient = DVector::from_vec(gradient);
    let covariance = DMatrix::from_row_slice(n, n, &fit.covariance);
    (gradient.transpose() * covariance * gradient)[(0, 0)].max(0.0).sqrt()
}

/// Common times of all drones, s: from the earliest first bin to the latest last one.
pub fn common_times(drones: &[DroneSeries]) -> Vec<i64> {
    let first = drones.iter().map(|drone| drone.first_s).min();
    let last = drones.iter().map(|drone| drone.first_s + drone.updraft_mps.len() as i64).max();
    match (first, last) {
        (Some(first), Some(last)) => (first..last).take(LONGEST_S).collect(),
        _ => Vec::new(),
    }
}

impl DroneSeries {
    /// Estimates at common times, m/s; `None` outside the drone's own.
    pub fn at(&self, times_s: &[i64]) -> Vec<Option<f64>> {
        self.spread(&self.updraft_mps, times_s)
    }

    /// Values of the drone's own seconds at common times.
    pub(super) fn spread<T: Copy>(&self, own: &[Option<T>], times_s: &[i64]) -> Vec<Option<T>> {
        let value = |time: &i64| {
            let index = usize::try_from(time - self.first_s).ok()?;
            own.get(index).copied().flatten()
        };
        times_s.iter().map(value).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::law::{ErrorScale, LawPoint, linear, signed_quadratic};
    use crate::mission::plan::SegmentKind;

    const RATE: f64 = 10.0;
    const LEVEL: Lean<'static> = Lean { leaning: None, calibration: &[] };

    fn linear_fit() -> Fit {
        fit(Law::Linear { slope: 26.4, u0_us: 1546.5 })
    }

    fn fit(law: Law) -> Fit {
        let points: Vec<LawPoint> = (-7..=7)
            .filter(|rung| *rung != 0)
            .map(|rung| {
                let velocity_mps = 0.5 * f64::from(rung);
                LawPoint {
                    velocity_mps,
                    pulse_us: law.pulse_us(velocity_mps),
                    sigma_us: 0.3,
                    velocity_sigma_mps: 0.0,
                }
            })
            .collect();
        match law {
            Law::Linear { .. } => linear(&points, ErrorScale::Unscaled).unwrap(),
            Law::SignedQuadratic { .. } => signed_quadratic(&points, ErrorScale::Unscaled).unwrap(),
        }
    }

    /// A hover of 300 s in air that rises as `air` says; the drone drifts at 0.05 m/s.
    fn flown(law: Law, air: impl Fn(f64) -> f64) -> (Flight, Series) {
        let time_s: Vec<f64> = (0..3000).map(|index| f64::from(index) / RATE).collect();
        let pulse: Vec<f64> = time_s.iter().map(|time| law.pulse_us(0.05 - air(*time))).collect();
        let flight = Flight {
            velocity_up_mps: Series { time_s: time_s.clone(), value: vec![0.05; 3000] },
            ..Flight::default()
        };
        (flight, Series { time_s, value: pulse })
    }

    fn hover() -> Target {
        let label = String::new();
        Target { kind: SegmentKind::Hover, label, start_s: 0.0, end_s: 300.0, commanded_mps: 0.0 }
    }

    #[test]
    fn steady_air_is_measured_by_both_laws() {
        for law in [
            Law::Linear { slope: 26.4, u0_us: 1546.5 },
            Law::SignedQuadratic { a: 8.14, u0_us: 1598.6, w_mps: 0.0 },
        ] {
            for truth in [-3.0, -0.4, 0.7, 2.0] {
                let (flight, pulse) = flown(law, |_| truth);
                let found = estimate(&flight, &pulse, &hover(), &fit(law), LEVEL).unwrap();
                assert!((found.mean.value - truth).abs() < 1e-3, "{law:?}: {}", found.mean);
                assert!(found.mean.se > 0.0, "the law's own error is in");
                let first_and_last = (found.first_s, found.updraft_mps.len());
                assert_eq!(first_and_last, (5, 291), "only full windows: 5 s to 295 s");
            }
        }
    }

    #[test]
    fn a_gap_is_none_and_does_not_bleed_into_the_rest() {
        let law = Law::Linear { slope: 26.4, u0_us: 1546.5 };
        let (flight, mut pulse) = flown(law, |time| if time < 150.0 { 0.5 } else { -0.5 });
        let keep: Vec<usize> =
            (0..3000).filter(|i| !(140.0..160.0).contains(&pulse.time_s[*i])).collect();
        pulse = Series {
            time_s: keep.iter().map(|i| pulse.time_s[*i]).collect(),
            value: keep.iter().map(|i| pulse.value[*i]).collect(),
        };
        let found = estimate(&flight, &pulse, &hover(), &linear_fit(), LEVEL).unwrap();
        let at = |time: i64| found.at(&[time])[0];
        assert!((at(130).unwrap() - 0.5).abs() < 1e-9);
        assert!((at(170).unwrap() + 0.5).abs() < 1e-9);
        assert!((137..=163).all(|time| at(time).is_none()), "no value mixes both sides");
        assert_eq!(at(-3), None);
    }

    #[test]
    fn a_slow_wave_is_followed_without_lag() {
        let law = Law::Linear { slope: 26.4, u0_us: 1546.5 };
        let wave = |time: f64| 0.8 * (time / 60.0 * std::f64::consts::TAU).sin();
        let (flight, pulse) = flown(law, wave);
        let found = estimate(&flight, &pulse, &hover(), &linear_fit(), LEVEL).unwrap();
        // A centred 10 s mean keeps the phase and damps a 60 s wave by sinc(pi/6) = 0.955.
        for time in [20_i64, 75, 130, 222] {
            let expected = 0.9549 * wave(time as f64);
            let value = found.at(&[time])[0].unwrap();
            assert!((value - expected).abs() < 0.01, "{time}: {value} {expected}");
        }
    }
}
