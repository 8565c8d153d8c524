//! Response of a vehicle's rotor effort to climb and wind: a table of steady flight.
//!
//! The table is made of the vehicle's own plant (`workflow/find/response.rs`), so that the curve, its steepening in
//! wind and the lift that wind gives are those that the simulator flies. Only its level is not taken from it: no file
//! knows the mass and the rotors of one drone to a percent.

use super::lean_table::LeanTable;

/// Step of the leans in a table of winds, degrees.
const LEAN_STEP_DEG: f64 = 0.1;

/// Rotor effort of steady flight by wind and climb.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// Whose it is, for people.
    pub of: String,
    /// Step of the wind from 0 on, m/s.
    pub wind_step_mps: f64,
    /// Lean that each wind is held against, degrees, rising.
    pub lean_deg: Vec<f64>,
    /// Lowest climb through the air, m/s.
    pub first_climb_mps: f64,
    /// Step of the climb, m/s.
    pub climb_step_mps: f64,
    /// Effort for each wind at each climb, in the indicator's unit; NaN where there is no steady flight.
    pub effort: Vec<Vec<f64>>,
    /// Standard error of the change with the climb, as a share of it.
    pub slope_share: f64,
    /// Responses of the same vehicle with one doubtful property changed by a standard error each.
    pub doubts: Vec<Response>,
}

/// Climbs beyond this are not looked for, m/s: further than any table.
const FASTEST_MPS: f64 = 12.0;

impl Response {
    /// A straight line without wind: the effort rises by `slope` per m/s of climb.
    pub fn line(of: String, slope: f64, slope_share: f64) -> Self {
        Self {
            of,
            wind_step_mps: 1.0,
            lean_deg: vec![0.0],
            first_climb_mps: -FASTEST_MPS,
            climb_step_mps: FASTEST_MPS,
            effort: vec![vec![-FASTEST_MPS * slope, 0.0, FASTEST_MPS * slope]],
            slope_share,
            doubts: Vec::new(),
        }
    }

    /// Wind that a lean is held against, m/s; that of the last lean beyond it.
    pub fn wind_mps(&self, lean_deg: f64) -> f64 {
        let above = self.lean_deg.partition_point(|lean| *lean <= lean_deg);
        let (Some(from), Some(to)) =
            (above.checked_sub(1).and_then(|low| self.lean_deg.get(low)), self.lean_deg.get(above))
        else {
            return self.wind_step_mps * above.saturating_sub(1) as f64;
        };
        self.wind_step_mps * ((above - 1) as f64 + (lean_deg - from) / (to - from))
    }

    /// The winds that leans are held against, as a vehicle's own table has them; `None`: it has no wind.
    pub fn leans(&self) -> Option<LeanTable> {
        let steepest = self.lean_deg.last().copied().filter(|deg| *deg > 0.0)?;
        let steps = 0..=(steepest / LEAN_STEP_DEG) as usize;
        let wind = |step: usize| self.wind_mps(step as f64 * LEAN_STEP_DEG);
        Some(LeanTable {
            lean_step_deg: LEAN_STEP_DEG,
            wind_mps: steps.map(wind).collect(),
            ..LeanTable::default()
        })
    }

    /// Effort in a wind at a climb through the air; `None` beyond the table.
    pub fn effort(&self, wind_mps: f64, climb_mps: f64) -> Option<f64> {
        let column = (climb_mps - self.first_climb_mps) / self.climb_step_mps;
        if !(column >= 0.0 && wind_mps >= 0.0) {
            return None;
        }
        let along = |row: usize| {
            let low = (column as usize).min(self.effort.get(row)?.len().checked_sub(2)?);
            let (from, to) = (self.effort.get(row)?.get(low)?, self.effort.get(row)?.get(low + 1)?);
            let part = column - low as f64;
            (part <= 1.0 + 1e-9).then(|| from + (to - from) * part)
        };
        let row = wind_mps / self.wind_step_mps;
        let low = (row as usize).min(self.effort.len().checked_sub(1)?);
        let high = (low + 1).min(self.effort.len() - 1);
        let part = (row - low as f64).min(1.0);
        let value = along(low)? * (1.0 - part) + along(high)? * part;
        value.is_finite().then_some(value)
    }

    /// Change of the effort with the climb, in a wind at a climb; `None` beyond the table.
    pub fn slope(&self, wind_mps: f64, climb_mps: f64) -> Option<f64> {
        let half = 0.5 * self.climb_step_mps.min(1.0);
        let at = |step: f64| self.effort(wind_mps, climb_mps + step);
        Some((at(half)? - at(-half)?) / (2.0 * half))
    }

    /// Climb through the air at which a drone in a wind has an effort; `None` beyond the table.
    pub fn climb_mps(&self, wind_mps: f64, effort: f64) -> Option<f64> {
        let columns = self.effort.first()?.len().checked_sub(1)?;
        let steps = 0..=columns;
        let climb = |step: usize| self.first_climb_mps + step as f64 * self.climb_step_mps;
        // Where the curve bends back (the vortex ring), the flank that hover is on.
        let known: Vec<(f64, f64)> = steps
            .filter_map(|step| Some((climb(step), self.effort(wind_mps, climb(step))?)))
            .collect();
        let pairs = || known.windows(2).map(|pair| (pair[0], pair[1]));
        let found = pairs()
            .filter(|(low, high)| low.1 < high.1 && (low.1..=high.1).contains(&effort))
            .map(|(low, high)| low.0 + (high.0 - low.0) * (effort - low.1) / (high.1 - low.1));
        found.min_by(|one, other| one.abs().total_cmp(&other.abs()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Response {
        Response {
            of: "a drone".to_owned(),
            wind_step_mps: 2.0,
            lean_deg: vec![0.0, 2.0, 5.0],
            first_climb_mps: -2.0,
            climb_step_mps: 1.0,
            effort: vec![
                vec![90.0, 80.0, 100.0, 110.0, 125.0],
                vec![86.0, 78.0, 96.0, 108.0, 125.0],
                vec![80.0, 75.0, 90.0, 105.0, f64::NAN],
            ],
            slope_share: 0.1,
            doubts: Vec::new(),
        }
    }

    #[test]
    fn winds_come_from_leans_and_efforts_from_both() {
        let table = table();
        assert_eq!(table.wind_mps(0.0), 0.0);
        assert_eq!(table.wind_mps(1.0), 1.0);
        assert_eq!(table.wind_mps(3.5), 3.0);
        assert_eq!(table.wind_mps(9.0), 4.0, "no further than the table");
        assert_eq!(table.effort(0.0, 0.5), Some(105.0));
        assert_eq!(table.effort(1.0, 0.0), Some(98.0));
        assert_eq!(table.effort(4.0, 1.5), None, "no steady flight there");
        assert_eq!(table.effort(0.0, 2.5), None);
        assert_eq!(table.effort(0.0, f64::NAN), None);
        assert_eq!(table.slope(0.0, 0.0), Some(15.0));
    }

    #[test]
    fn its_leans_are_a_table_of_winds() {
        let table = table();
        let leans = table.leans().unwrap();
        for lean_deg in [0.0, 0.4, 1.0, 3.5, 4.85] {
            let wind_mps = leans.wind_at(lean_deg).unwrap();
            assert!((wind_mps - table.wind_mps(lean_deg)).abs() < 1e-9, "{lean_deg}: {wind_mps}");
        }
        assert_eq!(leans.wind_at(9.0), None, "no wind is told beyond the table");
        assert_eq!(Response::line("legs".to_owned(), 80.0, 0.1).leans(), None);
    }

    #[test]
    fn the_flank_of_hover_is_taken() {
        let table = table();
        assert_eq!(table.climb_mps(0.0, 105.0), Some(0.5));
        assert_eq!(table.climb_mps(0.0, 90.0), Some(-0.5), "not -2 m/s, on the other flank");
        assert_eq!(table.climb_mps(0.0, 300.0), None);
        let line = Response::line("legs".to_owned(), 80.0, 0.1);
        assert_eq!(line.climb_mps(3.0, 40.0), Some(0.5));
        assert_eq!(line.wind_mps(5.0), 0.0);
        assert!((line.slope(0.0, 1.0).unwrap() - 80.0).abs() < 1e-9);
    }
}
