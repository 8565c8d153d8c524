//! The posterior between the drones, as the page draws it: linear between the cells and between its times.

use crate::analysis::result::{PosteriorGrid, UpdraftMap};

use super::text::usable;

/// One field: by row (y) and column (x), m/s; `None` where nothing is known.
pub(super) type Cells = Vec<Vec<Option<f64>>>;

/// The grid of a posterior map whose parts fit together.
pub(super) struct GridField<'a> {
    grid: &'a PosteriorGrid,
}

impl<'a> GridField<'a> {
    /// `None` without a grid, and where its axes do not rise or its rows do not have their lengths.
    pub(super) fn of(map: &'a UpdraftMap) -> Option<Self> {
        let grid = map.posterior.as_ref()?.grid.as_ref()?;
        let rises = |axis: &[f64]| {
            axis.iter().all(|v| usable(*v)) && axis.windows(2).all(|pair| pair[0] < pair[1])
        };
        let fits = |fields: &[Cells]| {
            fields.len() == grid.time_s.len()
                && fields.iter().all(|rows| {
                    rows.len() == grid.y_m.len()
                        && rows.iter().all(|row| row.len() == grid.x_m.len())
                })
        };
        let whole = grid.x_m.len() > 1
            && grid.y_m.len() > 1
            && !grid.time_s.is_empty()
            && [&grid.x_m, &grid.y_m, &grid.time_s].into_iter().all(|axis| rises(axis))
            && fits(&grid.updraft_mps)
            && fits(&grid.sd_mps);
        whole.then_some(Self { grid })
    }

    pub(super) fn grid(&self) -> &'a PosteriorGrid {
        self.grid
    }

    /// Corners of the ground that the grid covers, [forward, left], m.
    pub(super) fn corners(&self) -> [[f64; 2]; 2] {
        let ends = |axis: &[f64]| {
            [axis.first().copied().unwrap_or(0.0), axis.last().copied().unwrap_or(0.0)]
        };
        let (x, y) = (ends(&self.grid.x_m), ends(&self.grid.y_m));
        [[x[0], y[0]], [x[1], y[1]]]
    }

    /// The field at a show time, m/s.
    pub(super) fn at(&self, show_s: f64) -> Cells {
        let (low, high, share) = between(&self.grid.time_s, show_s);
        let [Some(low), Some(high)] = [low, high].map(|index| self.grid.updraft_mps.get(index))
        else {
            return Vec::new();
        };
        let mixed = |(low, high): (&Option<f64>, &Option<f64>)| {
            Some((1.0 - share) * (*low)? + share * (*high)?)
        };
        low.iter().zip(high).map(|(low, high)| low.iter().zip(high).map(mixed).collect()).collect()
    }

    /// Mean over all times, m/s.
    pub(super) fn mean(&self) -> Cells {
        self.over_times(&self.grid.updraft_mps, |value| value, |mean| mean)
    }

    /// Standard deviation at one time, root mean square over all, m/s.
    pub(super) fn sd(&self) -> Cells {
        self.over_times(&self.grid.sd_mps, |sd| sd * sd, f64::sqrt)
    }

    fn over_times(&self, fields: &[Cells], inner: fn(f64) -> f64, outer: fn(f64) -> f64) -> Cells {
        let cell = |row: usize, column: usize| {
            let known: Vec<f64> = fields
                .iter()
                .filter_map(|field| *field.get(row)?.get(column)?)
                .filter(|value| usable(*value))
                .map(inner)
                .collect();
            crate::numeric::mean(known).map(outer)
        };
        (0..self.grid.y_m.len())
            .map(|row| (0..self.grid.x_m.len()).map(|column| cell(row, column)).collect())
            .collect()
    }

    /// Pixels of a field, row by row from the left upper one: forward is up, left is left. `forward` and `left` go
    /// from the first edge to the last one, m.
    pub(super) fn raster(
        &self,
        cells: &Cells,
        (columns, rows): (usize, usize),
        (forward, left): ([f64; 2], [f64; 2]),
    ) -> Vec<Option<f64>> {
        let place = |edges: [f64; 2], index: usize, count: usize| {
            edges[0] + (edges[1] - edges[0]) * (index as f64 + 0.5) / count as f64
        };
        (0..rows)
            .flat_map(|row| (0..columns).map(move |column| (row, column)))
            .map(|(row, column)| {
                self.value(cells, [place(forward, row, rows), place(left, column, columns)])
            })
            .collect()
    }

    /// Value at a place, [forward, left]; `None` outside of the grid and beside unknown cells.
    fn value(&self, cells: &Cells, [forward, left]: [f64; 2]) -> Option<f64> {
        let [low, high] = self.corners();
        // Half a pixel of rounding at the edges.
        let slack = 1e-6;
        let inside = (low[0] - slack..=high[0] + slack).contains(&forward)
            && (low[1] - slack..=high[1] + slack).contains(&left);
        if !inside {
            return None;
        }
        let (x0, x1, along) = between(&self.grid.x_m, forward);
        let (y0, y1, across) = between(&self.grid.y_m, left);
        let cell = |row: usize, column: usize| {
            let value = cells.get(row)?.get(column).copied().flatten();
            value.filter(|value| usable(*value))
        };
        let row = |row: usize| Some((1.0 - along) * cell(row, x0)? + along * cell(row, x1)?);
        Some((1.0 - across) * row(y0)? + across * row(y1)?)
    }
}

/// The two points of a rising axis around a value, and its share of the way between them.
fn between(axis: &[f64], value: f64) -> (usize, usize, f64) {
    let last = axis.len().saturating_sub(1);
    let high = axis.partition_point(|point| *point < value).min(last);
    let low = high.saturating_sub(1);
    let (Some(from), Some(to)) = (axis.get(low), axis.get(high)) else { return (0, 0, 0.0) };
    if to <= from {
        return (low, high, 0.0);
    }
    (low, high, ((value - from) / (to - from)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> UpdraftMap {
        let plane = |time: f64| -> Vec<Vec<f64>> {
            (0..4)
                .map(|y| (0..3).map(|x| time + 0.1 * f64::from(x) - 0.2 * f64::from(y)).collect())
                .collect()
        };
        serde_json::from_value(serde_json::json!({
            "law": "linear", "time_s": [], "drones": [], "truth": null,
            "posterior": {
                "fleet": null, "zero_shift_mps": 0.0, "uniform_probability": 0.1,
                "grid": {
                    "time_s": [10.0, 20.0], "x_m": [0.0, 1.0, 2.0], "y_m": [0.0, 1.0, 2.0, 3.0],
                    "height_m": 100.0,
                    "updraft_mps": [plane(0.0), plane(1.0)], "sd_mps": [plane(3.0), plane(4.0)],
                }
            }
        }))
        .unwrap()
    }

    #[test]
    fn a_plane_that_rises_evenly_comes_back_between_cells_and_times() {
        let map = map();
        let field = GridField::of(&map).unwrap();
        let cells = field.at(14.0);
        let raster = field.raster(&cells, (6, 4), ([2.5, -0.5], [3.5, -0.5]));
        for (index, found) in raster.iter().enumerate() {
            let forward = 2.5 - 3.0 * ((index / 6) as f64 + 0.5) / 4.0;
            let left = 3.5 - 4.0 * ((index % 6) as f64 + 0.5) / 6.0;
            let inside = (0.0..=2.0).contains(&forward) && (0.0..=3.0).contains(&left);
            assert_eq!(found.is_some(), inside, "{forward} {left}");
            if let Some(found) = found {
                let plane = 0.4 + 0.1 * forward - 0.2 * left;
                assert!((found - plane).abs() < 1e-9, "{forward} {left}: {found}");
            }
        }
        assert_eq!(field.at(-5.0), field.at(10.0), "before the first time it is the first");
        assert!((field.mean()[0][0].unwrap() - 0.5).abs() < 1e-12);
        assert!((field.sd()[0][0].unwrap() - 12.5_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn beside_an_unknown_cell_nothing_is_known() {
        let mut map = map();
        map.posterior.as_mut().unwrap().grid.as_mut().unwrap().updraft_mps[0][1][1] = None;
        let field = GridField::of(&map).unwrap();
        let cells = field.at(15.0);
        assert_eq!(cells[1][1], None);
        assert_eq!(field.value(&cells, [0.5, 0.5]), None);
        assert!(field.value(&cells, [0.5, 2.5]).is_some());
    }

    #[test]
    fn parts_that_do_not_fit_are_no_grid() {
        let mut short = map();
        short.posterior.as_mut().unwrap().grid.as_mut().unwrap().sd_mps[1].pop();
        assert!(GridField::of(&short).is_none());
        let mut falling = map();
        falling.posterior.as_mut().unwrap().grid.as_mut().unwrap().x_m.reverse();
        assert!(GridField::of(&falling).is_none());
    }
}
