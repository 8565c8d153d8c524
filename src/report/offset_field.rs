//! The slow offset of a drone's pulse as pixels over time and height, and the scale that a fleet
//! shares.

use crate::analysis::offset::OffsetMap;
use crate::analysis::result::FlightAnalysis;

use super::axis::{Axis, scale_end};
use super::raster::Pixel;
use super::text::usable;

/// Smallest end of the scale, us.
const LEAST_US: f64 = 1.0;

/// Axes and scale that all drones of a flight share.
pub(super) struct OffsetScale {
    /// Show time, s.
    pub(super) time: Axis,
    /// Height above home, m.
    pub(super) height: Axis,
    /// The scale runs from minus to plus this, us.
    pub(super) limit_us: f64,
    /// The unit of rotor effort, as the analysis names it.
    pub(super) unit: &'static str,
}

impl OffsetScale {
    /// Around all 0-windows and all flown heights; `None` where no drone has an offset.
    pub(super) fn of(flight: &FlightAnalysis) -> Option<Self> {
        let points = || {
            flight.drones.iter().filter_map(|drone| drone.offset.as_ref()).flat_map(|o| &o.points)
        };
        points().next()?;
        let windows = || flight.drones.iter().flat_map(|drone| &drone.windows);
        let ends = windows().flat_map(|window| [window.start_s, window.end_s]);
        let heights = windows().map(|w| w.height_m).chain(points().map(|p| p.height_m));
        let largest =
            points().map(|p| p.offset_us.abs()).filter(|us| usable(*us)).fold(LEAST_US, f64::max);
        Some(Self {
            time: Axis::time(ends.chain(points().map(|p| p.time_s))),
            height: Axis::heights(heights),
            limit_us: scale_end(largest),
            unit: flight.indicator.unit(),
        })
    }

    /// The offset on `columns` by `rows` pixels over the axes, upper left first. Hatched where it is
    /// not between the 0-windows: there it is the nearest one's.
    pub(super) fn pixels(&self, map: &OffsetMap, columns: usize, rows: usize) -> Vec<Pixel> {
        let surface = map.surface();
        let along = |axis: &Axis, i: usize, n: usize| {
            axis.min + (axis.max - axis.min) * (i as f64 + 0.5) / n as f64
        };
        let mut pixels = Vec::with_capacity(columns * rows);
        for row in 0..rows {
            let height_m = along(&self.height, rows - 1 - row, rows);
            for column in 0..columns {
                let offset = surface.at(along(&self.time, column, columns), height_m);
                pixels.push(match offset {
                    Some(offset) if !offset.inside && (row + column) % 6 == 0 => Pixel::Hatch,
                    Some(offset) if usable(offset.us) => Pixel::At(offset.us / self.limit_us),
                    _ => Pixel::Empty,
                });
            }
        }
        pixels
    }
}
