//! Posterior map of drones that move: no constellation of neighbours comes again, and the wind is not read from
//! leans.

use rayon::prelude::*;

use super::neighbours::Reach;
use super::scales::{DRIFT, Family, Found, Search};
use crate::numeric::{LOGARITHM_STEP, differences, minimise};

/// What the likelihood of drones that move conditions on.
pub(super) const REACH: Reach = Reach { beside: 6, step: 4, own: 2 };
/// Drifts that are tried along each axis, m/s.
const TRIED_MPS: [f64; 5] = [-4.0, -2.0, 0.0, 2.0, 4.0];
/// A drift of a field before the values are seen: standard deviation of each component, m/s. Winds that small drones
/// fly in.
const DRIFT_MPS: f64 = 3.0;
/// A drift must explain so much more than none, nats. Two more numbers are worth 3 in 95 % of all cases.
const WORTH: f64 = 3.0;

/// How fast the field drifts, m/s, if that explains more than that it stays.
pub(super) fn drift(search: &Search<'_>, found: &Found) -> Option<[f64; 2]> {
    let mut point = found.best;
    point[DRIFT] = 1.0;
    let drifts = Family { drifts: true, ..found.family };
    let gain = |drift_mps: &[f64; 2]| {
        let [u, v] = drift_mps.map(|part| part / DRIFT_MPS);
        let search = Search { wind_mps: Some(*drift_mps), ..*search };
        search.log_posterior(drifts, &point) - 0.5 * (u * u + v * v)
    };
    let tried: Vec<[f64; 2]> =
        TRIED_MPS.iter().flat_map(|u| TRIED_MPS.iter().map(|v| [*u, *v])).collect();
    let gains: Vec<f64> = tried.par_iter().map(gain).collect();
    let (start, _) = tried
        .iter()
        .zip(&gains)
        .filter(|(_, gain)| gain.is_finite())
        .max_by(|a, b| a.1.total_cmp(b.1))?;
    let loss = |at: &[f64; 2]| -gain(at);
    let (best, least) =
        minimise(*start, loss, |at, value| differences(loss, at, value, LOGARITHM_STEP));
    (-least > gain(&[0.0; 2]) + WORTH).then_some(best)
}
