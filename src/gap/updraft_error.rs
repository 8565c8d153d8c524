//! How well the updraft of a whole flight is known.

use super::compare::UPDRAFT_DOUBT_MPS;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Problem, Split};
use super::refine::{doubts, half_interval, slopes};

/// By how much farther the truth is than noise and air explain, as no model answers an updraft quite as a drone does. Chosen: of 46
/// foreign flights (docs/gap.md, 3) 44 were inside with it, and 39 without.
const FORM: f64 = 2.0;

/// Half of the 95 % interval of the updraft in which a flight is explained best, m/s, with all that was found free and with what is
/// believed of updrafts before a flight. Where the search stayed beside the updraft that the pulses speak for, as another air has its
/// price, the interval reaches beyond that one.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn half_mps(found: &Found) -> Result<Option<f64>, GapError> {
    let Found { comparison, vehicle, gusts_mps, parameters, extras, noise, .. } = found;
    let patterns = comparison.patterns(vehicle, *gusts_mps)?;
    let split = Split::of(&comparison.residual(vehicle, *gusts_mps)?);
    let doubts = doubts(comparison, vehicle, parameters)?;
    let Some((updraft, others)) = doubts.split_first() else { return Ok(None) };
    let slopes = slopes(comparison, vehicle, parameters)?;
    let problem = Problem::new(&patterns, &split).doubting(others).with(extras).with(&slopes);
    // The regressor is one standard deviation of that belief.
    let gain = problem.at(&noise.hyper).gain(updraft);
    let told = gain.se.powi(2).recip();
    let beside_mps = UPDRAFT_DOUBT_MPS * gain.beta * told / (1.0 + told);
    let own_mps = half_interval(comparison, &noise.hyper) * UPDRAFT_DOUBT_MPS / (1.0 + told).sqrt();
    let half = FORM * (beside_mps.abs() + own_mps);
    Ok(Some(half).filter(|half| half.is_finite()))
}
