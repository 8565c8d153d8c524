//! A ladder in an updraft against a calibration of the same drones: how far is the calibration's own curve
//! shifted along the vertical speed?
//!
//! A steady updraft `W` moves a drone's pulse from `g(V)` to `g(V - W)`, whatever the curve `g` looks like.
//! Holding two parameters of one law ([`super::calibrate::Hold`], the paper's way) is right only where that
//! law is the drone's. Here the curve is what the calibration's windows show: a line with bends and a smooth
//! rest, with all that they leave open ([`curve`]); the shift is found by the likelihood of both flights'
//! windows together ([`shift`]).
//!
//! Its error has the noise of both flights' windows, the curve's doubt between and beyond the rungs, slow air
//! in both flights, and the doubts of the corrections ([`super::corrections`]), which count as far as the
//! flights' own hovers leave them open.

mod curve;
mod points;
mod shift;
#[cfg(test)]
mod tests;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::points::{Point, average, common, keyed};
use self::shift::{Flights, Shift, shift};
use super::battery::{self, Pack, Sag};
use super::budget::BatteryCorrection;
use super::corrections::{Corrections, DOUBTS, WINDS};
use super::reference::same_drone;
use super::result::{DroneAnalysis, FlightAnalysis, Laws, WindowStats};
use super::stats::mean_sd;
use crate::base::estimate::Estimate;
use crate::numeric::mean;

/// Legs that must lie in the calibration's range of air speeds, for a shift to be given. Chosen: three speeds
/// are what makes a ladder.
const FEWEST_INSIDE: usize = 3;

/// The updraft of a ladder against a calibration, whose own curve is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldCurve {
    /// W with its standard error, m/s, up positive: relative to the mean air of the calibration, or absolute
    /// where the calibration tells its own ([`HeldCurve::calibration_w_mps`]). Absent: not determined.
    pub updraft: Option<Estimate>,
    /// Interval that holds it with a probability of 95 %, m/s.
    pub interval_mps: Option<[f64; 2]>,
    /// Vertical air speed of the calibration that is included, m/s: where the signed quadratic describes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration_w_mps: Option<Estimate>,
    /// Legs of the ladder that were compared.
    pub legs: usize,
    /// Those of them that flew through the air faster than the calibration did, where the curve is continued.
    pub beyond: usize,
    /// Lowest and highest vertical speed of the calibration, m/s.
    pub speeds_mps: [f64; 2],
    /// Chi² of the ladder's windows over their number less one, with all errors, in air as the calibration's.
    pub chi2_reduced: Option<f64>,
    /// Why there is no number, or what is doubtful about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubt: Option<String>,
    /// Whether the calibration is that of another vehicle: its law, held, tells no updraft either.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_other_vehicle: bool,
}

/// A calibration whose curve is held.
pub(super) struct Holding<'a> {
    reference: &'a FlightAnalysis,
    corrections: Corrections<'a>,
    battery: Option<BatteryCorrection>,
    /// Slope of the drones' lines, us/(m/s).
    slope: f64,
    /// Spread between drones: standard deviations of constant (us) and slope (us/(m/s)).
    spread: [f64; 2],
    /// Air of the calibration, where its law tells.
    origin: Option<Estimate>,
    /// Standard errors of the corrections' doubts.
    sigmas: [f64; DOUBTS],
}

impl<'a> Holding<'a> {
    /// Prepares a calibration; `origin` is the vertical air speed that it was flown in, where its law
    /// tells. `None` without laws.
    pub(super) fn new(
        reference: &'a FlightAnalysis,
        corrections: Corrections<'a>,
        sag: Option<Sag>,
        origin: Option<Estimate>,
    ) -> Option<Self> {
        let windows = || reference.drones.iter().map(|drone| drone.windows.as_slice());
        let battery = sag.and_then(|sag| battery::correction(windows(), sag));
        let unknown_share =
            battery.map_or(0.0, |battery| battery::unknown_share(windows(), battery));
        let corrections = Corrections { unknown_share, ..corrections };
        let lines = || reference.drones.iter().filter_map(|drone| line(drone.laws.as_ref()?));
        let (constants, slopes): (Vec<f64>, Vec<f64>) = lines().unzip();
        if slopes.is_empty() {
            return None;
        }
        let spread = [mean_sd(&constants).1, mean_sd(&slopes).1];
        let slope = mean_sd(&slopes).0;
        let mut packs = reference.drones.iter().filter_map(|drone| pack_of(drone, battery));
        let sigmas = corrections.sigmas(packs.next().as_ref());
        Some(Self { reference, corrections, battery, slope, spread, origin, sigmas })
    }

    /// The updraft of one drone's ladder; `None` where there is nothing to compare.
    pub(super) fn of_drone(
        &self,
        windows: &[WindowStats],
        slot: Option<u16>,
        name: &str,
    ) -> Option<HeldCurve> {
        let own = same_drone(self.reference, slot, name)
            .filter(|drone| drone.laws.is_some() && drone.partial_ladder.is_none());
        let here = self.points(windows, own);
        match own {
            Some(drone) => self.held(&self.points(&drone.windows, own), &here, [0.0; 2]),
            // The average of the fleet stands for a drone that was not calibrated.
            None => self.held(&self.average(), &here, self.spread),
        }
    }

    /// The updraft of the average over a fleet's drones.
    pub(super) fn of_fleet(&self, drones: &[DroneAnalysis]) -> Option<HeldCurve> {
        let counts =
            |drone: &&DroneAnalysis| drone.laws.is_some() && drone.partial_ladder.is_none();
        let own = |drone: &DroneAnalysis| {
            same_drone(self.reference, drone.slot, &drone.name).filter(counts)
        };
        let pairs: Vec<(&DroneAnalysis, &DroneAnalysis)> =
            drones.iter().filter(counts).filter_map(|drone| Some((own(drone)?, drone))).collect();
        if pairs.is_empty() {
            let here: Vec<Vec<Point>> = (drones.iter().filter(counts))
                .map(|drone| self.points(&drone.windows, None))
                .collect();
            let one_of = (here.len().max(1) as f64).sqrt();
            return self.held(&self.average(), &average(&here), self.spread.map(|s| s / one_of));
        }
        let (there, here): (Vec<Vec<Point>>, Vec<Vec<Point>>) = pairs
            .iter()
            .map(|(own, drone)| {
                let there = self.points(&own.windows, Some(own));
                let here = self.points(&drone.windows, Some(own));
                (there, here)
            })
            .unzip();
        // A window that is missing for one drone is left out for all of its flight: averages of other drones
        // would differ by the drones.
        self.held(&average(&common(there)), &average(&common(here)), [0.0; 2])
    }

    /// The calibration's windows averaged over its drones.
    fn average(&self) -> Vec<Point> {
        let counts =
            |drone: &&DroneAnalysis| drone.laws.is_some() && drone.partial_ladder.is_none();
        let all: Vec<Vec<Point>> = (self.reference.drones.iter().filter(counts))
            .map(|drone| self.points(&drone.windows, Some(drone)))
            .collect();
        average(&common(all))
    }

    /// Windows with what is known taken away; `own` is the drone in the calibration, of whose pack the
    /// correction is.
    fn points(&self, windows: &[WindowStats], own: Option<&DroneAnalysis>) -> Vec<Point> {
        let drone = own.or(self.reference.drones.first());
        let pack = drone.and_then(|drone| pack_of(drone, self.battery));
        keyed(windows, &self.corrections, pack.as_ref(), self.slope)
    }

    fn held(&self, there: &[Point], here: &[Point], spread: [f64; 2]) -> Option<HeldCurve> {
        let origin = self.origin.unwrap_or_default();
        let there: Vec<Point> = there
            .iter()
            .map(|point| Point { velocity_mps: point.velocity_mps - origin.value, ..*point })
            .collect();
        let flights = Flights { there: &there, here, sigmas: &self.sigmas, spread };
        let wind_mps = self.wind_mps(&there, here);
        let apart = Apart {
            slopes: slope_of(&there).zip(slope_of(here)),
            hover: hover_of(here).zip(hover_of(&there)).map(|(here, there)| here - there),
        };
        Some(self.words(here, shift(&flights)?, wind_mps, apart))
    }

    /// Standard error of the shift by wind: that the corrections are off by their doubt, or, where there are none,
    /// what another lean may do at most, as two standard errors.
    fn wind_mps(&self, there: &[Point], here: &[Point]) -> f64 {
        let change = |value: &dyn Fn(&Point) -> f64| {
            let over = |points: &[Point]| mean(points.iter().map(value)).unwrap_or_default();
            over(here) - over(there)
        };
        let of_doubt = |doubt: usize| self.sigmas[doubt] * change(&|point| point.doubts_us[doubt]);
        let pulse_us = WINDS.into_iter().map(of_doubt).fold(0.0, f64::hypot);
        let along_mps = 0.5 * change(&|point| point.axial_mps);
        (pulse_us / self.slope).hypot(along_mps)
    }

    /// The result in its words.
    fn words(&self, here: &[Point], found: Shift, wind_mps: f64, apart: Apart) -> HeldCurve {
        let origin = self.origin.unwrap_or_default();
        let legs = || here.iter().filter(|point| point.is_leg);
        let [low, high] = found.speeds_mps;
        let beyond_at = |w_mps: f64| {
            let [low, high] = [low - SAME_MPS, high + SAME_MPS];
            legs().filter(|point| !(low..=high).contains(&(point.velocity_mps - w_mps))).count()
        };
        let beyond = beyond_at(found.mean_mps);
        let few = legs().count().saturating_sub(beyond) < FEWEST_INSIDE;
        let stormy = wind_mps > MOST_WIND_MPS;
        let other = apart.slopes.filter(|(there, here)| {
            let steeper = here / there;
            !(MOST_STEEPER.recip()..=MOST_STEEPER).contains(&steeper)
        });
        let unit = self.reference.indicator.unit();
        let nowhere = found.is_open && beyond > 0 && beyond == legs().count();
        let doubt = if let Some((there, here)) = other {
            Some(format!(
                "W is not determined: over the ladder the indicator changes by {here:.1} {unit} per m/s and over the \
                 calibration by {there:.1}: this is the calibration of another vehicle"
            ))
        } else if nowhere {
            let hover = apart.hover.map_or_else(String::new, |by| {
                let word = if by > 0.0 { "higher" } else { "lower" };
                format!(" (in hover the indicator is {:.0} {unit} {word})", by.abs())
            });
            Some(format!(
                "W is not determined: no updraft within {:.0} m/s brings the ladder's windows onto the calibration's \
                 curve{hover}: this seems to be the calibration of another vehicle",
                shift::FASTEST_MPS
            ))
        } else if found.is_open {
            Some(format!(
                "W is not determined: the windows allow air beyond {:.0} m/s",
                shift::FASTEST_MPS
            ))
        } else if few {
            Some(format!(
                "W is not determined: with it, fewer than {FEWEST_INSIDE} legs flew through the air at \
                 speeds of the calibration, {low:+.1} to {high:+.1} m/s"
            ))
        } else if stormy {
            Some(
                "W is not determined: the drones leaned otherwise than in the calibration, and what wind along \
                 their rotor axes may have done is more than that (the vehicle's drag is not known)"
                    .to_owned(),
            )
        } else if wind_mps > WINDY_MPS && wind_mps > found.sd_mps {
            Some(format!(
                "the drones leaned otherwise than in the calibration: what wind along their rotor axes may \
                 have done is most of the error, {wind_mps:.2} m/s"
            ))
        } else if found.chi2_reduced.is_some_and(|chi2| chi2 > MISFIT_CHI2) {
            Some(
                "the ladder's windows scatter about the calibration's curve by more than its own do: its \
                 air moved more, or it has another shape"
                    .to_owned(),
            )
        } else {
            (beyond > 0).then(|| {
                format!(
                    "{beyond} of {} legs flew through the air faster than the calibration's {low:+.1} to \
                     {high:+.1} m/s: there its curve is continued, and the error grows",
                    legs().count()
                )
            })
        };
        let known = !(found.is_open || few || stormy) && other.is_none();
        let se_more = wind_mps.hypot(origin.se);
        let end = |end: f64| {
            let off = end - found.mean_mps;
            found.mean_mps + off.signum() * off.hypot(NORMAL * se_more)
        };
        let se = found.sd_mps.hypot(se_more);
        HeldCurve {
            updraft: known.then(|| Estimate::new(found.mean_mps, se)),
            interval_mps: known.then(|| found.interval_mps.map(end)),
            calibration_w_mps: self.origin,
            legs: legs().count(),
            beyond,
            speeds_mps: [low + origin.value, high + origin.value],
            chi2_reduced: found.chi2_reduced,
            doubt,
            is_other_vehicle: other.is_some() || nowhere,
        }
    }
}

/// How a ladder differs from a calibration.
#[derive(Clone, Copy)]
struct Apart {
    /// Slopes of lines through the legs, of the calibration and of the ladder, us/(m/s).
    slopes: Option<(f64, f64)>,
    /// Mean in hover, less that of the calibration, us.
    hover: Option<f64>,
}

/// Mean pulse of the hovers, us.
fn hover_of(points: &[Point]) -> Option<f64> {
    mean(points.iter().filter(|point| !point.is_leg).map(|point| point.pulse_us))
}

/// Slope of a line through the legs; `None` with fewer than three.
fn slope_of(points: &[Point]) -> Option<f64> {
    let legs = || points.iter().filter(|point| point.is_leg);
    let (speed, pulse) =
        (mean(legs().map(|leg| leg.velocity_mps))?, mean(legs().map(|leg| leg.pulse_us))?);
    let over = |of: &dyn Fn(f64, f64) -> f64| -> f64 {
        legs().map(|leg| of(leg.velocity_mps - speed, leg.pulse_us - pulse)).sum()
    };
    let slope = over(&|v, u| v * u) / over(&|v, _| v * v);
    (slope.is_finite() && legs().count() >= FEWEST_INSIDE).then_some(slope)
}

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// The same drone's ladder is steeper or flatter than its calibration by this factor at most: a square law in an updraft of
/// half the ladder's speed by 1.5.
const MOST_STEEPER: f64 = 2.0;
/// An error by wind below this is not worth a sentence, m/s. Chosen, as for maps.
const WINDY_MPS: f64 = 0.05;
/// With a larger error by wind, a shift of the air's usual size is not determined, m/s. Chosen.
const MOST_WIND_MPS: f64 = 1.0;
/// Speeds that differ by less are the same rung, m/s: how well drones follow. Chosen.
const SAME_MPS: f64 = 0.05;
/// A reduced chi² above this is no chance with the 14 to 30 windows of a ladder: one in a thousand has 2.3 at
/// 20 degrees of freedom.
const MISFIT_CHI2: f64 = 2.3;

fn pack_of(drone: &DroneAnalysis, battery: Option<BatteryCorrection>) -> Option<Pack> {
    Pack::of(&battery::of_hovers(&drone.windows), battery?)
}

/// Constant and slope of a drone's line.
fn line(laws: &Laws) -> Option<(f64, f64)> {
    let fit = laws.linear.as_ref()?;
    Some((fit.value(super::law::Symbol::U0)?, fit.value(super::law::Symbol::Slope)?))
}
