//! How well the updraft of a whole flight is known.

use super::compare::UPDRAFT_DOUBT_MPS;
use super::error::GapError;
use super::explain::Found;
use super::gls::{Problem, Split};
use super::refine::{doubts, half_interval, slopes};

/// Half of the 95 % interval of the updraft in which a flight is explained best, m/s, with all that was found free and with what is
/// believed of updrafts before a flight.
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
    let solution = problem.with(std::slice::from_ref(updraft)).at(&noise.hyper);
    let covariance = solution.covariance();
    let Some(last) = covariance.nrows().checked_sub(1) else { return Ok(None) };
    // The regressor is one standard deviation of that belief.
    let information = 1.0 + covariance[(last, last)].recip();
    let half = half_interval(comparison, &noise.hyper) * UPDRAFT_DOUBT_MPS / information.sqrt();
    Ok(Some(half).filter(|half| half.is_finite()))
}
