//! The law that a calibration's windows prefer, with its numbers: what a reader is told first.
//!
//! It is chosen as the map's law is ([`super::aware`]): by the evidence of all drones' windows for a line that may
//! bend and for the signed quadratic. The paper's two laws stay in the tables beside it.

use std::array;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::aware::Aware;
use super::battery::Sag;
use super::corrections::Corrections;
use super::kind::LawKind;
use super::result::FlightAnalysis;
use super::shape::Shape;
use super::zero::DroneLaw;
use crate::base::estimate::Estimate;

/// A bend of so many standard errors is told. Convention: 95 %.
const TOLD: f64 = 2.0;

/// The law that the windows of a calibration prefer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Headline {
    /// `linear` (a line that may bend) or `signed quadratic`.
    #[schemars(with = "String")]
    pub law: LawKind,
    /// Why, in one phrase.
    pub reason: String,
    /// The line, where it is preferred: of the drones' average, with errors that count slow air.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<BentLine>,
}

/// The line that may bend: `u = u0 + A' V + B V² + C V|V|`, at level flight, and at the ground's air density and
/// one battery voltage where those are known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BentLine {
    /// Effort in hover u0, us (or the indicator's unit).
    pub u0: Estimate,
    /// Slope in hover A', us/(m/s).
    pub slope: Estimate,
    /// Bend B of both branches to one side, us/(m/s)².
    pub bend: Estimate,
    /// Bend C of each branch away from hover, us/(m/s)².
    pub drag: Estimate,
    /// Lowest and highest vertical speed of the windows, m/s.
    pub speeds_mps: [f64; 2],
    /// Covariance of u0, A', B and C, in the products of their units; absent: of an older version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 4]; 4]>,
}

impl BentLine {
    fn of(law: &DroneLaw, covariance: &DMatrix<f64>, speeds_mps: [f64; 2]) -> Self {
        let estimate = |index: usize| {
            Estimate::new(law.law[index], covariance[(index, index)].max(0.0).sqrt())
        };
        Self {
            u0: estimate(0),
            slope: estimate(1),
            bend: estimate(2),
            drag: estimate(3),
            speeds_mps,
            covariance: Some(array::from_fn(|row| {
                array::from_fn(|column| covariance[(row, column)])
            })),
        }
    }

    /// Whether it bends by more than chance.
    pub fn is_bent(&self) -> bool {
        [self.bend, self.drag].iter().any(|bend| bend.value.abs() > TOLD * bend.se)
    }

    /// Slope at a vertical speed, us/(m/s).
    pub fn slope_at(&self, velocity_mps: f64) -> f64 {
        let by_speed = self.bend.value * velocity_mps + self.drag.value * velocity_mps.abs();
        self.slope.value + 2.0 * by_speed
    }
}

/// Writes the law that a calibration's windows prefer into it and its drones; nothing where they do not allow a
/// fit.
pub(super) fn add(flight: &mut FlightAnalysis, corrections: Corrections<'_>, sag: Option<Sag>) {
    let Some(aware) = Aware::new(flight, corrections, sag, None) else { return };
    let (law, reason) = (aware.law(), aware.law_reason());
    let is_line = aware.zero.shape == Shape::Line;
    let zero = aware.zero;
    let line = is_line.then(|| BentLine::of(&zero.flock, &zero.common, zero.speeds_mps));
    if is_line {
        for (drone, law) in flight.drones.iter_mut().zip(&zero.drones) {
            drone.line = law.as_ref().map(|law| {
                let own =
                    DMatrix::from_fn(zero.common.nrows(), zero.common.ncols(), |row, column| {
                        zero.common[(row, column)] + law.own[(row, column)]
                    });
                BentLine::of(law, &own, zero.speeds_mps)
            });
        }
    }
    flight.headline = Some(Headline { law, reason, line });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bend_within_its_error_is_none() {
        let of = |bend: f64| BentLine {
            u0: Estimate::new(1540.0, 1.0),
            slope: Estimate::new(25.0, 0.5),
            bend: Estimate::new(bend, 0.4),
            drag: Estimate::new(0.2, 0.4),
            speeds_mps: [-3.5, 3.5],
            covariance: None,
        };
        assert!(!of(0.7).is_bent() && of(-0.9).is_bent());
        let bent = of(1.0);
        let pulse = |v: f64| 25.0 * v + 1.0 * v * v + 0.2 * v * v.abs();
        for v in [-3.0, 2.0] {
            let rise = (pulse(v + 1e-4) - pulse(v - 1e-4)) / 2e-4;
            assert!((bent.slope_at(v) - rise).abs() < 1e-6, "{v}");
        }
    }
}
