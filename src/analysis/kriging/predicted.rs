//! Prediction of a model at all places that a map has: at the drones, where logs are lost, and between them.

use super::data::{Drone, Rows};
use super::grid::{Grid, grid};
use super::predict::{Model, Series};
use super::thermals::{Thermal, updraft_mps};
use crate::numeric::mean;

/// The places and seconds that a map has besides its drones'.
pub(super) struct Sites<'a> {
    /// Places without a log, show frame, m.
    pub(super) lost_m: &'a [[f64; 3]],
    /// Seconds of the record.
    pub(super) seconds: usize,
    /// The first second of the grid.
    pub(super) first: usize,
}

/// The air at all of them.
pub(super) struct Predicted {
    pub(super) drones: Vec<Series>,
    pub(super) lost: Vec<Series>,
    pub(super) grid: Option<Grid>,
    /// Mean over all drones and seconds with its standard error, m/s.
    pub(super) fleet_mps: Option<(f64, f64)>,
}

impl Predicted {
    pub(super) fn of(model: &Model<'_>, rows: &Rows, sites: &Sites<'_>) -> Self {
        let mut places: Vec<(Option<usize>, [f64; 3])> = (0..model.drones.len())
            .map(|index| (Some(index), model.drones[index].place_at(0).unwrap_or_default()))
            .collect();
        places.extend(sites.lost_m.iter().map(|place_m| (None, *place_m)));
        let mut drones = model.at(&places, sites.seconds);
        let lost = drones.split_off(model.drones.len());
        let grid = grid(model, sites.lost_m, sites.first);
        Self { drones, lost, grid, fleet_mps: model.fleet(rows) }
    }

    /// Adds what thermals add, which the model's values are without.
    pub(super) fn add(
        &mut self,
        thermals: &[Thermal],
        rows: &Rows,
        drones: &[Drone],
        sites: &Sites<'_>,
    ) {
        let by = |place_m, second: usize, velocity_mps| {
            updraft_mps(thermals, place_m, second as f64, velocity_mps)
        };
        for (series, drone) in self.drones.iter_mut().zip(drones) {
            series.add(|second| {
                let place_m = drone.place_at(second).unwrap_or_default();
                by(place_m, second, drone.velocity_at(second))
            });
        }
        for (series, place_m) in self.lost.iter_mut().zip(sites.lost_m) {
            series.add(|second| by(*place_m, second, [0.0; 3]));
        }
        if let Some(grid) = &mut self.grid {
            grid.add(|place_m, second| by(place_m, second, [0.0; 3]));
        }
        let spots = rows.list.iter().map(|row| row.spot);
        let of_spots = mean(
            spots.map(|spot| updraft_mps(thermals, spot.place_m, spot.time_s, spot.velocity_mps)),
        );
        if let (Some((fleet, _)), Some(more)) = (&mut self.fleet_mps, of_spots) {
            *fleet += more;
        }
    }

    /// Widens standard deviations by how far another is off that has an independent error of one standard deviation.
    pub(super) fn widen(&mut self, other: &Self) {
        let drones = self.drones.iter_mut().zip(&other.drones);
        let lost = self.lost.iter_mut().zip(&other.lost);
        for (series, there) in drones.chain(lost) {
            series.widen(there);
        }
        if let (Some(grid), Some(there)) = (&mut self.grid, &other.grid) {
            grid.widen(there);
        }
        if let (Some((fleet, sd)), Some((there, _))) = (&mut self.fleet_mps, other.fleet_mps) {
            *sd = sd.hypot(there - *fleet);
        }
    }
}
