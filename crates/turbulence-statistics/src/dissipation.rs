//! Rate of dissipation of turbulent kinetic energy, from the inertial range of a record at a point that the wind blows
//! past (Taylor's hypothesis), if there is such a range.
//!
//! In it the spectrum of a component across the wind is `S(f) = (4/3) C1 epsilon^(2/3) (U/2 pi)^(2/3) f^(-5/3)`, and its
//! structure function `D(t) = (4/3) C2 (epsilon U t)^(2/3)`; of the component along the wind 4/3 is left out. `C1 = 0.49`
//! and `C2 = 1.97` (Pope 2000, section 6.5.2: C = 1.5).

use std::f64::consts::TAU;

use crate::Record;
use crate::quantile::WIDTH;
use crate::spectrum::{Band, slope};

/// Constant of the one-dimensional spectrum along the wind, by wave number in rad/m.
pub const C1: f64 = 0.49;
/// Constant of the structure function along the wind.
pub const C2: f64 = 1.97;
/// Ratio of a component across the wind to the one along it.
pub const ACROSS: f64 = 4.0 / 3.0;
/// Slope of the inertial range.
pub const SLOPE: f64 = -5.0 / 3.0;
/// Slopes further from it are no inertial range, however uncertain they are.
const SLOPE_WITHIN: f64 = 0.35;
/// Relative standard error of the constants: 0.49 to 0.53 are in use for C1.
const CONSTANT_SE: f64 = 0.05;
/// An inertial range is at least so wide, as a ratio of frequencies.
const WIDEST_TO_NARROWEST: f64 = 2.5;
/// Bands that a range has at least.
const FEWEST_BANDS: usize = 3;

/// Direction of a component against the wind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    /// Along the wind.
    Along,
    /// Across the wind, as the vertical one.
    Across,
}

impl Component {
    fn factor(self) -> f64 {
        match self {
            Self::Along => 1.0,
            Self::Across => ACROSS,
        }
    }
}

/// Wind that carries the air past, m/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wind {
    /// Speed, m/s.
    pub speed_mps: f64,
    /// Standard error of the speed, m/s.
    pub se_mps: f64,
}

/// Rate of dissipation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schemars", derive(schemars::JsonSchema))]
pub struct Dissipation {
    /// Rate, m²/s³.
    pub value: f64,
    /// Ends of the 95 % interval, m²/s³.
    pub low: f64,
    /// Upper end, m²/s³.
    pub high: f64,
    /// Frequencies of the range that it is from, Hz.
    pub from_hz: f64,
    /// Upper end of the range, Hz.
    pub to_hz: f64,
    /// Slope of the spectrum there; -5/3 is expected.
    pub slope: f64,
    /// Standard error of the slope.
    pub slope_se: f64,
}

/// Reason why there is no rate of dissipation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoRange {
    /// Too few bands between the ends of the range.
    TooNarrow,
    /// The slope is none of an inertial range.
    Slope {
        /// Slope of the logarithm of density over that of frequency.
        slope: f64,
        /// Standard error of the slope.
        se: f64,
    },
    /// The wind carries nothing past.
    Calm,
}

impl std::fmt::Display for NoRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::TooNarrow => {
                f.write_str("too few frequencies between large eddies and the limit of the record")
            }
            Self::Slope { slope, se } => {
                write!(
                    f,
                    "the spectrum falls with a slope of {slope:.2} ± {:.2} there, not -5/3",
                    WIDTH * se
                )
            }
            Self::Calm => f.write_str("the wind is too weak, or not known, to carry eddies past"),
        }
    }
}

/// Bands of the inertial range: above three times the frequency of the largest eddies (`largest_hz`), where the slope
/// agrees with -5/3.
fn range(bands: &[Band], largest_hz: f64) -> Result<(&[Band], f64, f64), NoRange> {
    let from = bands.partition_point(|band| band.frequency_hz < 3.0 * largest_hz);
    let used = &bands[from..];
    let wide = |used: &[Band]| match used {
        [first, .., last] => last.frequency_hz >= WIDEST_TO_NARROWEST * first.frequency_hz,
        _ => false,
    };
    if used.len() < FEWEST_BANDS || !wide(used) {
        return Err(NoRange::TooNarrow);
    }
    let (found, se) = slope(used).ok_or(NoRange::TooNarrow)?;
    let off = (found - SLOPE).abs();
    if off > SLOPE_WITHIN || off > WIDTH * se.max(0.05) {
        return Err(NoRange::Slope { slope: found, se });
    }
    Ok((used, found, se))
}

/// Rate of dissipation from the bands of a spectrum. `largest_hz` is the frequency of the largest eddies: wind over
/// integral length. `scale_se` is the relative standard error of the record's scale.
///
/// # Errors
///
/// Where there is no inertial range.
pub fn from_spectrum(
    bands: &[Band],
    component: Component,
    wind: Wind,
    largest_hz: f64,
    scale_se: f64,
) -> Result<Dissipation, NoRange> {
    if !(wind.speed_mps > 0.0 && wind.speed_mps > 2.0 * wind.se_mps) {
        return Err(NoRange::Calm);
    }
    let (used, slope, slope_se) = range(bands, largest_hz)?;
    // Each band's level of S f^(5/3), weighted by its degrees of freedom.
    let freedom: f64 = used.iter().map(|band| band.freedom).sum();
    let level = used
        .iter()
        .map(|band| band.freedom * band.density * band.frequency_hz.powf(-SLOPE))
        .sum::<f64>()
        / freedom;
    let constant = component.factor() * C1 * (wind.speed_mps / TAU).powf(2.0 / 3.0);
    let value = (level / constant).powf(1.5);
    // The rate goes as the 3/2 power of the level, which goes as the square of the scale, and as the wind's inverse.
    let relative = (1.5 * (2.0 / freedom).sqrt())
        .hypot(1.5 * CONSTANT_SE)
        .hypot(3.0 * scale_se)
        .hypot(wind.se_mps / wind.speed_mps);
    let [low, high] = [-1.0, 1.0].map(|sign: f64| value * (sign * WIDTH * relative).exp());
    let (from_hz, to_hz) = (used[0].frequency_hz, used[used.len() - 1].frequency_hz);
    Ok(Dissipation { value, low, high, from_hz, to_hz, slope, slope_se })
}

/// Structure function of a record: mean square of what a later value differs by, less that of its noise, at lags of 1,
/// 2, ... steps.
pub fn structure_function(record: &Record, noise: f64, lags: usize) -> Vec<f64> {
    let values = record.values();
    let at = |lag: usize| {
        let later = values.get(lag..).unwrap_or_default();
        let squares = values.iter().zip(later).map(|(one, other)| (other - one).powi(2));
        let (sum, count) = squares
            .filter(|square| !square.is_nan())
            .fold((0.0, 0usize), |(sum, count), square| (sum + square, count + 1));
        if count == 0 { f64::NAN } else { sum / count as f64 - 2.0 * noise }
    };
    (1..=lags).map(at).collect()
}

/// Share of the structure function of an inertial range that frequencies up to `highest_hz` give at a lag, s: what an
/// instrument or a record does not have of higher ones is not in its differences.
fn share_below(lag_s: f64, highest_hz: f64) -> f64 {
    // The integral of x^(-5/3) (1 - cos x) from 0 to infinity: (3/2) Gamma(1/3) sin(pi/6).
    const WHOLE: f64 = 2.009_203;
    const STEPS: usize = 200;
    let end = TAU * highest_hz * lag_s;
    // With x = y³ the root at 0 is smooth.
    let to = end.cbrt();
    let at = |step: usize| {
        let y = to * (step as f64 + 0.5) / STEPS as f64;
        let x = y.powi(3);
        3.0 * (1.0 - x.cos()) / y.powi(3)
    };
    (0..STEPS).map(at).sum::<f64>() * to / STEPS as f64 / WHOLE
}

/// Rate of dissipation from the structure function over the times of an inertial range that the spectrum has shown (its
/// frequencies are those of `found`), m²/s³; `None` where no lag lies in it. `highest_hz`: up to which the record has
/// everything.
///
/// A structure function sees all frequencies at each lag, so that its range is narrower: it is a check on the spectrum,
/// not another measurement.
pub fn from_structure(
    record: &Record,
    noise: f64,
    component: Component,
    wind: Wind,
    (found, highest_hz): (&Dissipation, f64),
) -> Option<f64> {
    let lag_of = |frequency_hz: f64| 1.0 / (TAU * frequency_hz * record.step_s());
    let (least, most) =
        (lag_of(found.to_hz).ceil().max(1.0) as usize, lag_of(found.from_hz) as usize);
    let function = structure_function(record, noise, most);
    let constant = component.factor() * C2;
    let of = (least..=most).filter_map(|lag| {
        let lag_s = lag as f64 * record.step_s();
        let at = *function.get(lag - 1)? / share_below(lag_s, highest_hz);
        (at > 0.0).then(|| (at / constant).powf(1.5) / (wind.speed_mps * lag_s))
    });
    let (sum, count) = of.fold((0.0, 0usize), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / count as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_of_the_inertial_range_are_those_of_its_integral() {
        assert!((share_below(1.0, 1e3) - 1.0).abs() < 0.02, "{}", share_below(1.0, 1e3));
        // scipy.integrate.quad(lambda x: x**(-5/3)*(1-cos(x)), 0, pi)[0] / 2.00875
        let half = share_below(1.0, 0.5);
        assert!((half - 0.6276).abs() < 1e-3, "{half}");
    }
}
