//! Calibration: laws from windows, for a drone, for the fleet's average, and as tables.

use thiserror::Error;

use super::fit::FitError;
use super::fitted::{Fit, Laws};
use super::law::{self, ErrorScale, Law, LawPoint};
use super::stats::SampleStats;
use super::window::WindowStats;
use crate::flight::Indicator;
use crate::numeric::mean;

/// Chords at most that the added variance is found by. Numerical: a few are needed.
const MOST_CHORDS: usize = 60;
/// It is known to this share of it. Numerical.
const ADDED_SHARE: f64 = 1e-7;

/// Statistic that represents the samples of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Location {
    /// Median of the samples (the paper, in simulation).
    Median,
    /// Mean of the samples (the paper, in the field).
    Mean,
    /// Mean without the lowest and highest tenth: as robust as needed, and unlike the median it
    /// resolves fractions of the whole microseconds that logs hold.
    #[default]
    Trimmed,
}

/// Error of a window in the fit of a law.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Weights {
    /// Standard deviation of the samples (the paper). It is not the error of a mean, so that chi²
    /// is no test; parameter errors are scaled with chi².
    WindowSd,
    /// Standard error of the window's mean from block means, plus one variance common to all
    /// windows (turbulence longer than a window), chosen so that the better of the two laws has a
    /// reduced chi² of 1. Velocity errors count. Parameter errors are not scaled.
    #[default]
    BlockError,
    /// One error for all windows; parameter errors are scaled with chi².
    Equal,
}

impl Weights {
    fn scale(self) -> ErrorScale {
        match self {
            Self::BlockError => ErrorScale::Unscaled,
            Self::WindowSd | Self::Equal => ErrorScale::Scaled,
        }
    }
}

/// A and u0 of the signed-quadratic law, which are held while W alone is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hold {
    /// A of the signed-quadratic law, us/(m/s)².
    pub a: f64,
    /// u0 of the signed-quadratic law, us.
    pub u0_us: f64,
}

impl Hold {
    /// A and u0 of a reference calibration's signed-quadratic fit; `None` if it has none.
    pub fn from_laws(laws: &Laws) -> Option<Self> {
        match Law::from_fit(laws.signed_quadratic.as_ref()?)? {
            Law::SignedQuadratic { a, u0_us, .. } => Some(Self { a, u0_us }),
            Law::Linear { .. } => None,
        }
    }
}

/// Options of a calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FitOptions {
    /// Indicator of rotor effort in the windows.
    pub indicator: Indicator,
    /// Statistic that represents a window.
    pub location: Location,
    /// Error of a window.
    pub weights: Weights,
    /// Whether the hovers are fitted too (the paper does not).
    pub with_hovers: bool,
    /// A and u0 to hold in an additional fit of W; `None`: no such fit.
    pub hold: Option<Hold>,
    /// Whether a W whose error reaches beyond the searched range counts as a number, as in the paper's tables.
    pub wide_w_counts: bool,
}

/// Error of a calibration.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// No window of vertical motion can be used.
    #[error(
        "no ladder: the flight has no usable window of constant vertical speed ({rejected} rejected, \
         {hovers} hovers); a calibration needs legs at two speeds or more"
    )]
    NoLadder {
        /// Number of moving windows that were rejected.
        rejected: usize,
        /// Number of hover windows.
        hovers: usize,
    },
    /// There is only one speed in all moving windows.
    #[error(
        "only one vertical speed ({speed_mps} m/s) in {windows} usable window(s); a calibration \
         needs legs at two speeds or more"
    )]
    OneSpeed {
        /// Vertical speed of the windows, m/s, up positive.
        speed_mps: f64,
        /// Number of windows with the speed.
        windows: usize,
    },
    /// The indicator has one value in all windows.
    #[error(
        "the {} is {value:.0} {} in all windows: it does not depend on the speed (are these the \
         motor channels? check SERVOn_FUNCTION)",
        indicator.words(),
        indicator.unit()
    )]
    ConstantPulse {
        /// Indicator of rotor effort.
        indicator: Indicator,
        /// Value of the indicator in all windows, in its unit.
        value: f64,
    },
    /// The fit of a law failed.
    #[error("the fit failed: {0}")]
    Fit(#[from] FitError),
}

/// Value of the statistic that represents samples.
pub fn location(stats: &SampleStats, location: Location) -> f64 {
    match location {
        Location::Median => stats.median,
        Location::Mean => stats.mean,
        Location::Trimmed => stats.trimmed,
    }
}

/// Whether a window takes part in fits.
pub fn is_used(window: &WindowStats, options: &FitOptions) -> bool {
    window.rejected.is_empty()
        && (window.kind.is_leg() || options.with_hovers && window.kind.is_hover())
}

/// A window as a point of a law.
fn point(window: &WindowStats, options: &FitOptions) -> LawPoint {
    let (sigma_us, velocity_sigma_mps) = match options.weights {
        Weights::WindowSd => (window.effort_phi.sd, 0.0),
        Weights::BlockError => (window.effort_phi.se, window.velocity_mps.se),
        Weights::Equal => (1.0, 0.0),
    };
    LawPoint {
        velocity_mps: location(&window.velocity_mps, options.location),
        pulse_us: location(&window.effort_phi, options.location) - window.offset_us.unwrap_or(0.0),
        sigma_us: sigma_us.max(options.indicator.quantum()),
        velocity_sigma_mps,
    }
}

/// Fits the laws to one drone's windows.
pub fn calibrate(windows: &[WindowStats], options: &FitOptions) -> Result<Laws, CalibrationError> {
    let points: Vec<LawPoint> =
        windows.iter().filter(|w| is_used(w, options)).map(|w| point(w, options)).collect();
    let moving = windows.iter().filter(|window| window.kind.is_leg());
    let rejected = moving.filter(|window| !window.rejected.is_empty()).count();
    let hovers = windows.iter().filter(|window| window.kind.is_hover()).count();
    fit_points(&points, options, CalibrationError::NoLadder { rejected, hovers })
}

fn fit_points(
    points: &[LawPoint],
    options: &FitOptions,
    empty: CalibrationError,
) -> Result<Laws, CalibrationError> {
    let Some(first) = points.first() else { return Err(empty) };
    let spread = |value: fn(&LawPoint) -> f64| {
        points.iter().map(|point| (value(point) - value(first)).abs()).fold(0.0, f64::max)
    };
    // A held fit needs one window only; the free laws need two speeds.
    if spread(|point| point.velocity_mps) < 0.1 && options.hold.is_none() {
        let speed_mps = (first.velocity_mps * 10.0).round() / 10.0;
        return Err(CalibrationError::OneSpeed { speed_mps, windows: points.len() });
    }
    if spread(|point| point.pulse_us) < options.indicator.quantum() && options.hold.is_none() {
        let indicator = options.indicator;
        return Err(CalibrationError::ConstantPulse { indicator, value: first.pulse_us });
    }
    let scale = options.weights.scale();
    let sigma_added_us =
        (options.weights == Weights::BlockError).then(|| added_sigma_us(points)).flatten();
    let measured = points;
    let points = widened(points, sigma_added_us.unwrap_or(0.0));
    let held = options
        .hold
        .map(|hold| law::signed_quadratic_held(&points, hold.a, hold.u0_us, scale))
        .transpose();
    let linear = law::linear(&points, scale);
    if options.hold.is_none() {
        // Without a held fit the line is the least that a calibration must give.
        linear.as_ref().map_err(Clone::clone)?;
    }
    let untuned = |fit: Fit, of_measured: Result<Fit, FitError>| match of_measured {
        Ok(plain) if sigma_added_us.is_some_and(|added| added > 0.0) => Fit {
            chi2: plain.chi2,
            chi2_reduced: plain.chi2_reduced,
            p_value: plain.p_value,
            ..fit
        },
        _ => fit,
    };
    let held = held?.zip(options.hold).map(|(fit, hold)| {
        untuned(fit, law::signed_quadratic_held(measured, hold.a, hold.u0_us, scale))
    });
    let in_units = |fit: Fit| {
        let fit = in_units_of(options.indicator, fit);
        if options.wide_w_counts { fit } else { law::bounded(fit) }
    };
    Ok(Laws {
        signed_quadratic: law::signed_quadratic(&points, scale)
            .ok()
            .map(|fit| in_units(untuned(fit, law::signed_quadratic(measured, scale)))),
        signed_quadratic_held: held.map(in_units),
        linear: linear.ok().map(|fit| in_units(untuned(fit, law::linear(measured, scale)))),
        sigma_added_us,
        held: None,
    })
}

/// The fit's parameters in the indicator's unit instead of microseconds.
fn in_units_of(indicator: Indicator, mut fit: Fit) -> Fit {
    for parameter in &mut fit.parameters {
        parameter.unit = parameter.name.unit(indicator);
    }
    fit
}

fn widened(points: &[LawPoint], added_us: f64) -> Vec<LawPoint> {
    points
        .iter()
        .map(|point| LawPoint { sigma_us: point.sigma_us.hypot(added_us), ..*point })
        .collect()
}

/// Standard deviation to add to every point's error so that the better law's reduced chi² is 1
/// (Paule and Mandel 1982); 0 when it is below 1 already, `None` without degrees of freedom.
fn added_sigma_us(points: &[LawPoint]) -> Option<f64> {
    // By how much the lesser reduced chi² exceeds 1, as a share of it: with the variance that is added it falls nearly along a
    // line. `None` where neither law has a chi².
    let excess = |added_us2: f64| -> Option<f64> {
        let points = widened(points, added_us2.sqrt());
        let chi2 = |fit: Result<Fit, FitError>| fit.ok()?.chi2_reduced;
        let linear = chi2(law::linear(&points, ErrorScale::Unscaled));
        let quadratic = chi2(law::signed_quadratic(&points, ErrorScale::Unscaled));
        let least = linear.into_iter().chain(quadratic).min_by(f64::total_cmp)?;
        Some(1.0 - 1.0 / least)
    };
    let mut low = (0.0, excess(0.0)?);
    if low.1 <= 0.0 {
        return Some(0.0);
    }
    let mut high_us = 1.0_f64;
    let mut high = (high_us.powi(2), excess(high_us.powi(2))?);
    while high.1 > 0.0 {
        high_us *= 2.0;
        if high_us > 1e4 {
            return None;
        }
        low = std::mem::replace(&mut high, (high_us.powi(2), excess(high_us.powi(2))?));
    }
    // The chord; the value at an end that stays twice is halved (Dowell and Jarratt 1971).
    let (mut at, mut last) = (high.0, 0.0);
    for _ in 0..MOST_CHORDS {
        let before = at;
        at = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
        let found = excess(at)?;
        if (at - before).abs() <= ADDED_SHARE * at || found == 0.0 {
            break;
        }
        if found > 0.0 {
            low = (at, found);
            if last > 0.0 {
                high.1 *= 0.5;
            }
        } else {
            high = (at, found);
            if last < 0.0 {
                low.1 *= 0.5;
            }
        }
        last = found;
    }
    Some(at.sqrt())
}

/// The paper's flock mapping: windows averaged over drones with equal weights, then fitted.
///
/// Windows are the same when kind, label, command and their order among equals agree, so that groups
/// flying at different times are averaged too. The averages' statistical errors shrink with the
/// number of drones; the air they share does not, which the added variance accounts for. Drones with
/// a part of the ladder are not to be among them: the average would change its drones from rung to rung.
pub fn flock<'a>(
    drones: impl IntoIterator<Item = &'a [WindowStats]>,
    options: &FitOptions,
) -> Result<Laws, CalibrationError> {
    let mut groups: std::collections::BTreeMap<(String, i64, usize), Vec<LawPoint>> =
        std::collections::BTreeMap::new();
    for windows in drones {
        let mut seen = std::collections::BTreeMap::<(String, i64), usize>::new();
        for window in windows {
            let command = (window.commanded_mps * 1000.0).round() as i64;
            let key = (format!("{:?} {}", window.kind, window.label), command);
            let count = seen.entry(key.clone()).or_default();
            if is_used(window, options) {
                groups.entry((key.0, key.1, *count)).or_default().push(point(window, options));
            }
            *count += 1;
        }
    }
    let average = |points: &Vec<LawPoint>| {
        let n = points.len() as f64;
        let over = |value: fn(&LawPoint) -> f64| mean(points.iter().map(value)).unwrap_or(f64::NAN);
        let error = |value: fn(&LawPoint) -> f64| {
            points.iter().map(|point| value(point).powi(2)).sum::<f64>().sqrt() / n
        };
        let sigma_us = match options.weights {
            Weights::WindowSd => over(|point| point.sigma_us),
            Weights::BlockError => error(|point| point.sigma_us),
            Weights::Equal => 1.0,
        };
        LawPoint {
            velocity_mps: over(|point| point.velocity_mps),
            pulse_us: over(|point| point.pulse_us),
            sigma_us,
            velocity_sigma_mps: error(|point| point.velocity_sigma_mps),
        }
    };
    let points: Vec<LawPoint> = groups.values().map(average).collect();
    fit_points(&points, options, CalibrationError::NoLadder { rejected: 0, hovers: 0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(scatter_us: f64) -> Vec<LawPoint> {
        let sign = [1.0, -1.0, -1.0, 1.0, 1.0, -1.0];
        let point = |index: usize| {
            let velocity_mps = index as f64 - 2.5;
            let pulse_us = 1540.0 + 25.0 * velocity_mps + scatter_us * sign[index];
            LawPoint { velocity_mps, pulse_us, sigma_us: 1.0, velocity_sigma_mps: 0.0 }
        };
        (0..6).map(point).collect()
    }

    #[test]
    fn the_added_error_explains_the_scatter_and_no_more() {
        // With equal errors chi² goes as one over their square.
        let points = points(7.0);
        let scattered = law::linear(&points, ErrorScale::Unscaled).unwrap().chi2_reduced.unwrap();
        let expected = (scattered - 1.0).sqrt();
        let added = added_sigma_us(&points).unwrap();
        assert!((added - expected).abs() < 1e-3, "{added} {expected}");
        // One that is below its own error needs none.
        assert_eq!(added_sigma_us(&self::points(0.5)), Some(0.0));
        assert_eq!(added_sigma_us(&points[..2]), None, "two points lie on a line");
    }
}
