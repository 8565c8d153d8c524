//! Effect of wind on the pulse of a vehicle whose physics is known: a table by lean and climb.
//!
//! A drone with rotor drag leans by a degree or more for each metre per second of wind, and its
//! rotors gain more from the fresh air (translational lift) than leaning costs. Wind is not logged,
//! but the lean is: the table says by how much the pulse differs from that of level flight in air
//! without wind.

use crate::flight::Indicator;
/// Directions in which what is doubted about drag and lift moves a table together.
pub const DIRECTIONS: usize = 2;

/// Change of the pulse by lean and vertical air speed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LeanTable {
    /// Indicator whose values the changes are of, in its unit where a name says us.
    pub indicator: Indicator,
    /// Step of the lean from 0 on, degrees.
    pub lean_step_deg: f64,
    /// Lowest vertical air speed, m/s.
    pub first_climb_mps: f64,
    /// Step of the vertical air speed, m/s.
    pub climb_step_mps: f64,
    /// For each lean the changes for each vertical air speed, us.
    pub change_us: Vec<Vec<f64>>,
    /// Wind that each lean is held against, m/s. Empty: not known.
    pub wind_mps: Vec<f64>,
    /// Change by one standard error of each direction of the doubt about drag and lift, us.
    /// They do not vanish where lift and the flow along the axis cancel each other. Empty: not known.
    pub doubts_us: Vec<Vec<Vec<f64>>>,
}

impl LeanTable {
    /// Change of the pulse, us, by linear interpolation; at the table's edges beyond them.
    pub fn at(&self, lean_deg: f64, climb_mps: f64) -> f64 {
        self.of(&self.change_us, lean_deg, climb_mps)
    }

    /// Change by one standard error of each direction of the doubt, us; `None` where the
    /// table does not have it.
    pub fn doubts_at(&self, lean_deg: f64, climb_mps: f64) -> Option<[f64; DIRECTIONS]> {
        let of = |direction: usize| {
            self.doubts_us.get(direction).map_or(0.0, |table| self.of(table, lean_deg, climb_mps))
        };
        (!self.doubts_us.is_empty()).then(|| std::array::from_fn(of))
    }

    /// Wind that a lean is held against, m/s, by linear interpolation; `None` where the table does not
    /// have it, or ends before.
    pub fn wind_at(&self, lean_deg: f64) -> Option<f64> {
        let place = lean_deg / self.lean_step_deg;
        let low = place.max(0.0).floor();
        let (from, to) = (self.wind_mps.get(low as usize)?, self.wind_mps.get(low as usize + 1)?);
        Some(from + (to - from) * (place - low))
    }

    fn of(&self, table: &[Vec<f64>], lean_deg: f64, climb_mps: f64) -> f64 {
        let place = |value: f64, first: f64, step: f64, n: usize| {
            let place = ((value - first) / step).clamp(0.0, (n.max(1) - 1) as f64);
            let low = (place as usize).min(n.saturating_sub(2));
            (low, place - low as f64)
        };
        let (row, down) = place(lean_deg, 0.0, self.lean_step_deg, table.len());
        let along = |row: usize| {
            let Some(row) = table.get(row) else { return 0.0 };
            let (column, right) =
                place(climb_mps, self.first_climb_mps, self.climb_step_mps, row.len());
            let value = |column: usize| row.get(column).copied().unwrap_or(0.0);
            value(column) * (1.0 - right) + value(column + 1) * right
        };
        let next = (row + 1).min(table.len().saturating_sub(1));
        along(row) * (1.0 - down) + along(next) * down
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interpolates_inside_and_holds_the_edges() {
        let table = LeanTable {
            indicator: Indicator::Pulse,
            lean_step_deg: 2.0,
            first_climb_mps: -1.0,
            climb_step_mps: 1.0,
            change_us: vec![vec![0.0; 3], vec![-10.0, -8.0, -6.0]],
            wind_mps: vec![0.0, 3.0],
            doubts_us: vec![vec![vec![0.0; 3], vec![4.0; 3]]],
        };
        assert_eq!(table.wind_at(0.5), Some(0.75));
        assert_eq!(table.wind_at(2.5), None, "further than the table");
        assert_eq!(table.at(0.0, 0.3), 0.0);
        assert_eq!(table.at(1.0, 0.0), -4.0);
        assert_eq!(table.at(2.0, 0.5), -7.0);
        assert_eq!(table.at(9.0, 9.0), -6.0);
        assert_eq!(table.doubts_at(1.0, 0.3), Some([2.0, 0.0]));
        assert_eq!(LeanTable::default().doubts_at(1.0, 0.3), None);
        assert_eq!(LeanTable::default().at(3.0, 1.0), 0.0);
    }
}
