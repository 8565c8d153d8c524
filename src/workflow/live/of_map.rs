//! Pieces of an analysed map as pages show them: one reading for flights in the air and for replays.

use std::collections::BTreeMap;

use crate::analysis::result::{DroneUpdraft, PosteriorGrid, UpdraftMap};
use crate::base::estimate::Estimate;
use crate::live::facts::centi;
use crate::live::view::AirMap;

/// Half the width of the 95 % interval, standard errors.
pub(super) const WIDTH: f64 = 1.96;
/// Times that are one second of the map, s.
const SAME_S: f64 = 0.5;

/// Value with its standard error at each second of the map, all origins of error included, m/s: the posterior, or the
/// drone's own estimate where there is none.
pub(super) fn values(
    drone: &DroneUpdraft,
) -> impl DoubleEndedIterator<Item = Option<(f64, f64)>> + ExactSizeIterator {
    let together = !drone.posterior_mps.is_empty();
    let values = if together { &drone.posterior_mps } else { &drone.updraft_mps };
    let error = move |at: usize| {
        if together {
            return drone.posterior_sd_mps.get(at).copied().flatten();
        }
        // What scatters is only one of the origins; its interval has all of them.
        let interval = drone.interval_mps.get(at).copied().flatten();
        let whole = interval.map(|[low, high]| (high - low) / (2.0 * WIDTH));
        whole.or(drone.sd_mps.get(at).copied().flatten())
    };
    let value = move |at: usize| Some((values[at]?, error(at).unwrap_or(drone.mean.se)));
    (0..values.len()).map(value)
}

/// Latest value of each slot with its standard error, m/s, and the time of the latest of all, s.
pub(super) fn latest(map: &UpdraftMap) -> (Option<f64>, BTreeMap<u16, (f64, f64)>) {
    let mut of = BTreeMap::new();
    let mut latest_s = None::<f64>;
    for drone in &map.drones {
        let last = values(drone).enumerate().rev().find_map(|(at, of)| Some((at, of?)));
        if let (Some(slot), Some((at, value))) = (drone.slot, last) {
            of.insert(slot, value);
            let time_s = map.time_s.get(at).copied();
            latest_s = latest_s.into_iter().chain(time_s).reduce(f64::max);
        }
    }
    (latest_s, of)
}

/// Value of a slot at a show time, m/s.
pub(super) fn at(map: &UpdraftMap, slot: u16, time_s: f64) -> Option<f64> {
    let drone = map.drones.iter().find(|drone| drone.slot == Some(slot))?;
    let at = map.time_s.iter().position(|second| (second - time_s).abs() < SAME_S)?;
    Some(values(drone).nth(at)??.0)
}

/// Mean of the fleet with its 95 % interval, m/s.
pub(super) fn interval_mps(fleet: Estimate) -> [f64; 3] {
    let Estimate { value, se, .. } = fleet;
    [value, value - WIDTH * se, value + WIDTH * se].map(centi)
}

/// Maps between the drones by their times, s.
pub(super) fn maps(grid: &PosteriorGrid) -> impl DoubleEndedIterator<Item = (f64, AirMap)> {
    let corner = grid.x_m.first().zip(grid.y_m.first());
    let step_m = grid.x_m.windows(2).next().map_or(1.0, |pair| pair[1] - pair[0]);
    let map = move |(time_s, values): (&f64, &Vec<Vec<Option<f64>>>)| {
        let (x, y) = corner?;
        let map = AirMap {
            origin_m: [*x, *y],
            step_m,
            columns: grid.x_m.len(),
            values_mps: values.iter().flatten().map(|value| value.map(centi)).collect(),
        };
        Some((*time_s, map))
    };
    grid.time_s.iter().zip(&grid.updraft_mps).filter_map(map)
}
