//! Effect of wind on a vehicle whose physics is known by its form: lean and pulse in its file's form,
//! and what other sizes and forms of drag and lift make of them.
//!
//! The pulse of a hover in wind is corrected by the lean, through two laws: how the vehicle leans in wind
//! (drag) and what wind does to the pulse at that speed (lift, less what the lean costs). Both are known
//! as forms with sizes, and neither well. Here each size and form is a doubt with a standard error; all
//! are zero in still air and grow with the wind, so that a flight in the same wind as its calibration
//! has none of them.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::lean_table::{DIRECTIONS, LeanTable};
use crate::flight::Indicator;

/// Leans of a table: up to 30 degrees, in which vehicles with much drag hold their place in 8 m/s.
const LEANS: usize = 61;
/// Step of the lean in a table, degrees.
const LEAN_STEP_DEG: f64 = 0.5;
/// Leans between which the directions of the doubt are chosen reach to that in this wind, m/s: the strongest
/// that show drones fly in.
const USUAL_WIND_MPS: f64 = 10.0;
/// And climbs through the air up to this, m/s: hovers, and what air does to them.
const USUAL_CLIMB_MPS: f64 = 2.0;
/// Standard error of the change of the pulse that is left where all sizes are known, as a share of it: the nearest
/// vehicle of this form to a plant of blade elements is up to 2.7 us off, of 40 us in strong wind (the tests of
/// `blind::worlds::identify`).
pub(super) const FORM_SHARE: f64 = 0.05;
/// What the directions of a table leave of a doubt is added to them, up to this factor. Numerical: where they leave
/// most, the doubt is small.
const MOST_WIDER: f64 = 3.0;
/// Steps of the climb to each side of hover that the file's slope is taken over: 3 m/s, about what ladders reach. Chosen.
const LADDER_STEPS: usize = 3;
/// Drones are not steeper than their file by more than this factor, nor flatter: then it is that of another drone. Chosen.
const MOST_RATIO: f64 = 1.5;
/// Least rise of the lean's tangent from one wind to the next: a lean must tell the wind. Numerical.
const LEAST_RISE: f64 = 1e-5;

/// Lean and change of the pulse by climb through the air and wind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Response {
    /// Tangents of the lean: for each climb those in each wind.
    pub lean: Vec<Vec<f64>>,
    /// Changes of the pulse from that without wind, us: for each climb those in each wind.
    pub change_us: Vec<Vec<f64>>,
}

/// Effect of wind on a vehicle, as its file says, and what is doubted about it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WindForms {
    /// Step of the wind from 0 on, m/s.
    pub wind_step_mps: f64,
    /// Lowest climb through the air, m/s.
    pub first_climb_mps: f64,
    /// Step of the climb, m/s.
    pub climb_step_mps: f64,
    /// Pulses without wind, us, by climb.
    pub calm_us: Vec<f64>,
    /// The file's own physics.
    pub file: Response,
    /// For each doubt, what one standard error of it adds.
    pub doubts: Vec<Response>,
}

/// How a table is read.
#[derive(Clone, Copy)]
struct Reading {
    /// By leans as they would be in level flight, not in the climb.
    is_level: bool,
    /// Slope of the pulse in still air over that of the file.
    slope_ratio: f64,
}

/// What is believed of the doubts of [`WindForms`], in their standard errors.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Belief {
    pub(super) mean: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
}

impl Response {
    fn plus(&self, doubts: &[Self], by: &DVector<f64>) -> Self {
        let mut sum = self.clone();
        for (doubt, by) in doubts.iter().zip(by) {
            add(&mut sum.lean, &doubt.lean, *by);
            add(&mut sum.change_us, &doubt.change_us, *by);
        }
        for row in &mut sum.lean {
            let mut last = 0.0;
            for lean in row.iter_mut().skip(1) {
                *lean = lean.max(last + LEAST_RISE);
                last = *lean;
            }
        }
        sum
    }
}

fn add(sum: &mut [Vec<f64>], of: &[Vec<f64>], by: f64) {
    let cells = sum.iter_mut().flatten().zip(of.iter().flatten());
    cells.for_each(|(sum, of)| *sum += by * of);
}

/// Value between the entries of a row; at its end beyond it.
fn between(row: &[f64], place: f64) -> f64 {
    let last = row.len().saturating_sub(1);
    let low = (place.max(0.0) as usize).min(last.saturating_sub(1));
    let share = (place - low as f64).clamp(0.0, 1.0);
    let at = |index: usize| row.get(index).copied().unwrap_or_default();
    at(low) + (at((low + 1).min(last)) - at(low)) * share
}

/// Place of a value in a rising row; its end beyond it.
fn place_in(row: &[f64], value: f64) -> f64 {
    let above = row.partition_point(|entry| *entry < value).min(row.len().saturating_sub(1));
    let Some(low) = above.checked_sub(1) else { return 0.0 };
    let (from, to) = (row[low], row[above]);
    low as f64 + ((value - from) / (to - from)).clamp(0.0, 1.0)
}

impl WindForms {
    /// The belief before any leg was flown.
    pub(super) fn prior(&self) -> Belief {
        let n = self.doubts.len();
        Belief { mean: DVector::zeros(n), covariance: DMatrix::identity(n, n) }
    }

    /// Tangent of the lean and change of the pulse, us, in level flight at a wind, m/s.
    pub(super) fn level(&self, doubts: &DVector<f64>, wind_mps: f64) -> [f64; 2] {
        let (row, place) = (self.level_row(), wind_mps / self.wind_step_mps);
        let of = |response: &Response| {
            let at = |of: &[Vec<f64>]| of.get(row).map_or(0.0, |of| between(of, place));
            [at(&response.lean), at(&response.change_us)]
        };
        let mut sum = of(&self.file);
        for (doubt, by) in self.doubts.iter().zip(doubts) {
            let more = of(doubt);
            sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += by * more);
        }
        sum
    }

    fn level_row(&self) -> usize {
        (-self.first_climb_mps / self.climb_step_mps).round().max(0.0) as usize
    }

    /// Changes of the pulse by lean and climb, us.
    fn by_lean(&self, response: &Response, reading: Reading) -> Vec<Vec<f64>> {
        let climbs = response.lean.len().min(response.change_us.len());
        let level = self.level_row().min(climbs.saturating_sub(1));
        let change = |tangent: f64, climb: usize| {
            let of = if reading.is_level { level } else { climb };
            let place = place_in(&response.lean[of], tangent);
            between(&response.change_us[climb], place)
        };
        let row = |step: usize| {
            let tangent = (step as f64 * LEAN_STEP_DEG).to_radians().tan();
            let row: Vec<f64> = (0..climbs).map(|climb| change(tangent, climb)).collect();
            let at_level = row.get(level).copied().unwrap_or_default();
            row.iter().map(|us| at_level + reading.slope_ratio * (us - at_level)).collect()
        };
        (0..LEANS).map(row).collect()
    }

    /// Slope between the file's pulses in a climb and in a descent without wind, us/(m/s).
    fn calm_slope(&self) -> Option<f64> {
        let level = self.level_row();
        let steps = level.min(self.calm_us.len().checked_sub(level + 1)?).min(LADDER_STEPS);
        let (low, high) = (self.calm_us.get(level - steps)?, self.calm_us.get(level + steps)?);
        let slope = (high - low) / (2.0 * steps as f64 * self.climb_step_mps);
        (slope > 0.0).then_some(slope)
    }

    /// Slope of the pulse of drones that were calibrated in still air, us/(m/s), over that of the file: what they gain in wind goes
    /// with it, as both go with what a change of the flow through the disc does. 1 where the file is that of another drone.
    pub(super) fn slope_ratio(&self, slope: f64) -> f64 {
        let ratio = self.calm_slope().map_or(1.0, |of_file| slope / of_file);
        if (MOST_RATIO.recip()..=MOST_RATIO).contains(&ratio) { ratio } else { 1.0 }
    }

    /// Standard error of a map in one wind that was calibrated in another, m/s, by these doubts alone.
    pub(super) fn error_mps(&self, belief: &Belief, calibrated_mps: f64, wind_mps: f64) -> f64 {
        let [table, _] = self.tables(belief, 1.0);
        let lean_deg = |wind_mps| self.level(&belief.mean, wind_mps)[0].atan().to_degrees();
        let doubts = |wind_mps| table.doubts_at(lean_deg(wind_mps), 0.0).unwrap_or_default();
        let (there, here) = (doubts(calibrated_mps), doubts(wind_mps));
        let apart: f64 = here.iter().zip(there).map(|(here, there)| (here - there).powi(2)).sum();
        let row = self.level_row();
        let calm = |row: usize| self.calm_us.get(row).copied().unwrap_or_default();
        let step_mps = self.climb_step_mps;
        let still = (calm(row + 1) - calm(row.saturating_sub(1))) / (2.0 * step_mps);
        let at = |climb_mps: f64| table.at(lean_deg(wind_mps), climb_mps);
        let slope = still + (at(step_mps) - at(-step_mps)) / (2.0 * step_mps);
        apart.sqrt() / slope.max(1.0)
    }

    /// The tables of a belief by leans as they are, and by leans as they would be in level flight: its mean, with the doubts
    /// as few directions that are the same in both; for drones whose slope in still air is so many times that of the file.
    pub(super) fn tables(&self, belief: &Belief, slope_ratio: f64) -> [LeanTable; 2] {
        let at = |doubts: &DVector<f64>| self.file.plus(&self.doubts, doubts);
        let middle = at(&belief.mean);
        let eigen = SymmetricEigen::new(belief.covariance.clone());
        let read = [false, true].map(|is_level| {
            let reading = Reading { is_level, slope_ratio };
            let change_us = self.by_lean(&middle, reading);
            let mut moved: Vec<Vec<Vec<f64>>> = Vec::new();
            for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
                let step = vector * value.max(0.0).sqrt();
                let more = self.by_lean(&at(&(&belief.mean + &step)), reading);
                let less = self.by_lean(&at(&(&belief.mean - &step)), reading);
                moved.push(combined(&[more, less], &[0.5, -0.5]));
            }
            moved.push(combined(std::slice::from_ref(&change_us), &[FORM_SHARE]));
            (change_us, moved)
        });
        let level = middle.lean.get(self.level_row()).cloned().unwrap_or_default();
        let wind = |step: usize| {
            let tangent = (step as f64 * LEAN_STEP_DEG).to_radians().tan();
            let inside = level.last().is_some_and(|last| tangent <= *last);
            inside.then(|| place_in(&level, tangent) * self.wind_step_mps)
        };
        let wind_mps: Vec<f64> = (0..LEANS).map_while(wind).collect();
        let usual = wind_mps.iter().take_while(|wind| **wind <= USUAL_WIND_MPS).count();
        let climbs = middle.lean.len();
        let is_usual = |climb: usize| {
            let climb_mps = self.first_climb_mps + climb as f64 * self.climb_step_mps;
            climb_mps.abs() <= USUAL_CLIMB_MPS
        };
        let usual_climbs: Vec<usize> = (0..climbs).filter(|climb| is_usual(*climb)).collect();
        let [(_, moved), _] = &read;
        let weights = weights(moved, usual, &usual_climbs);
        read.map(|(change_us, moved)| LeanTable {
            indicator: Indicator::Pulse,
            lean_step_deg: LEAN_STEP_DEG,
            first_climb_mps: self.first_climb_mps,
            climb_step_mps: self.climb_step_mps,
            change_us,
            wind_mps: wind_mps.clone(),
            doubts_us: directions(&moved, &weights),
        })
    }
}

fn combined(tables: &[Vec<Vec<f64>>], weights: &[f64]) -> Vec<Vec<f64>> {
    let mut sum: Vec<Vec<f64>> = tables
        .first()
        .map(|first| first.iter().map(|row| vec![0.0; row.len()]).collect())
        .unwrap_or_default();
    for (table, weight) in tables.iter().zip(weights) {
        add(&mut sum, table, *weight);
    }
    sum
}

/// What few directions take of each of these tables, to vary nearly as all of them do together where drones usually are.
fn weights(
    moved: &[Vec<Vec<f64>>],
    usual_leans: usize,
    usual_climbs: &[usize],
) -> Vec<DVector<f64>> {
    let cell = |table: &[Vec<f64>], lean: usize, climb: usize| table[lean][climb];
    let product = |one: &[Vec<f64>], other: &[Vec<f64>]| -> f64 {
        (0..usual_leans)
            .flat_map(|lean| usual_climbs.iter().map(move |climb| (lean, *climb)))
            .map(|(lean, climb)| cell(one, lean, climb) * cell(other, lean, climb))
            .sum()
    };
    let n = moved.len();
    let gram = DMatrix::from_fn(n, n, |row, column| product(&moved[row], &moved[column]));
    let eigen = SymmetricEigen::new(gram);
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
    let first = order.into_iter().take(DIRECTIONS);
    first.map(|index| eigen.eigenvectors.column(index).into_owned()).collect()
}

/// The directions with these weights; what they leave of a cell's variance widens them there.
fn directions(moved: &[Vec<Vec<f64>>], weights: &[DVector<f64>]) -> Vec<Vec<Vec<f64>>> {
    let cell = |table: &[Vec<f64>], lean: usize, climb: usize| table[lean][climb];
    let mut found: Vec<Vec<Vec<f64>>> =
        weights.iter().map(|weights| combined(moved, weights.as_slice())).collect();
    for lean in 0..found.first().map_or(0, Vec::len) {
        for climb in 0..found[0][lean].len() {
            let square = |of: &[Vec<Vec<f64>>]| -> f64 {
                of.iter().map(|table| cell(table, lean, climb).powi(2)).sum()
            };
            let (whole, told) = (square(moved), square(&found));
            let wider = if told > 0.0 { (whole / told).sqrt().min(MOST_WIDER) } else { 1.0 };
            for table in &mut found {
                table[lean][climb] *= wider;
            }
        }
    }
    found
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A drone that leans by 0.02 per m/s and 0.001 per (m/s)², and whose pulse falls by 0.5 us per (m/s)²; drag of
    /// the rotors by 40 % and lift by 20 % in doubt.
    pub(in crate::analysis) fn forms() -> WindForms {
        let grid = |value: &dyn Fn(f64) -> f64| {
            let row: Vec<f64> = (0..=32).map(|step| value(f64::from(step) * 0.5)).collect();
            vec![row; 5]
        };
        let response = |lean: &dyn Fn(f64) -> f64, change: &dyn Fn(f64) -> f64| Response {
            lean: grid(lean),
            change_us: grid(change),
        };
        WindForms {
            wind_step_mps: 0.5,
            first_climb_mps: -2.0,
            climb_step_mps: 1.0,
            calm_us: vec![1496.0, 1522.0, 1548.0, 1574.0, 1600.0],
            file: response(&|wind| 0.02 * wind + 0.001 * wind * wind, &|wind| -0.5 * wind * wind),
            doubts: vec![
                response(&|wind| 0.008 * wind, &|_| 0.0),
                response(&|_| 0.0, &|wind| -0.1 * wind * wind),
            ],
        }
    }

    #[test]
    fn a_table_reads_the_wind_by_the_lean_and_its_doubts_grow_with_the_wind() {
        let forms = forms();
        let [table, _] = forms.tables(&forms.prior(), 1.0);
        let lean_deg = |wind: f64| (0.02 * wind + 0.001 * wind * wind).atan().to_degrees();
        for wind in [1.0, 4.0, 8.0] {
            let read = table.wind_at(lean_deg(wind)).unwrap();
            assert!((read - wind).abs() < 0.05, "{read} for {wind}");
            assert!((table.at(lean_deg(wind), 0.3) + 0.5 * wind * wind).abs() < 0.3, "{wind}");
        }
        let sd = |wind: f64| {
            let doubts = table.doubts_at(lean_deg(wind), 0.0).unwrap();
            doubts.iter().map(|doubt| doubt * doubt).sum::<f64>().sqrt()
        };
        assert!(sd(0.0) < 1e-9, "no wind, no doubt");
        assert!(sd(1.0) < 0.5 && sd(8.0) > 6.0 && sd(8.0) > 2.0 * sd(4.0));
        // A fifth of 32 us of lift, and the wind's own by a lean of which much is doubted.
        assert!((6.4..25.0).contains(&sd(8.0)), "{}", sd(8.0));
    }

    #[test]
    fn a_level_lean_reads_one_wind_at_all_climbs_and_what_wind_adds_goes_with_the_slope() {
        let mut forms = forms();
        for (climb, (lean, change_us)) in
            forms.file.lean.iter_mut().zip(&mut forms.file.change_us).enumerate()
        {
            let by_climb = 1.0 + 0.05 * (climb as f64 - 2.0);
            for lean in lean.iter_mut() {
                *lean *= by_climb;
            }
            for us in change_us.iter_mut() {
                *us *= 1.5 - 0.25 * climb as f64;
            }
        }
        let lean_deg = (0.02 * 4.0 + 0.001 * 16.0_f64).atan().to_degrees();
        let [of_moment, level] = forms.tables(&forms.prior(), 1.0);
        let change_us = |table: &LeanTable, climb_mps: f64| table.at(lean_deg, climb_mps);
        assert!((change_us(&level, 1.0) + 0.75 * 8.0).abs() < 0.1, "{}", change_us(&level, 1.0));
        assert!(change_us(&of_moment, 1.0) > change_us(&level, 1.0) + 0.3, "a lesser wind");
        assert_eq!(change_us(&of_moment, 0.0), change_us(&level, 0.0));
        let [_, steep] = forms.tables(&forms.prior(), forms.slope_ratio(26.0 * 1.2));
        assert!((change_us(&steep, 0.0) - change_us(&level, 0.0)).abs() < 1e-12);
        let gained = |table: &LeanTable| change_us(table, 1.0) - change_us(table, -1.0);
        assert!((gained(&steep) - 1.2 * gained(&level)).abs() < 1e-9);
        // One direction of the doubts in both, of the same sign.
        let doubts = |table: &LeanTable| table.doubts_at(lean_deg, 0.0).unwrap();
        assert_eq!(doubts(&of_moment), doubts(&level));
        for slope in [1e9, -26.0, 0.0, f64::NAN] {
            assert_eq!(forms.slope_ratio(slope), 1.0, "{slope}");
        }
    }

    #[test]
    fn what_is_known_is_not_doubted_but_for_the_form() {
        let forms = forms();
        let known = Belief { mean: DVector::from_vec(vec![0.0, 1.0]), ..forms.prior() };
        let known = Belief { covariance: known.covariance * 1e-6, ..known };
        let [table, _] = forms.tables(&known, 1.0);
        let lean_deg = 0.224_f64.atan().to_degrees();
        assert!((table.at(lean_deg, 0.0) + 0.6 * 64.0).abs() < 0.3);
        let doubts = table.doubts_at(lean_deg, 0.0).unwrap();
        let sd = doubts.iter().map(|doubt| doubt * doubt).sum::<f64>().sqrt();
        assert!((sd - FORM_SHARE * 0.6 * 64.0).abs() < 0.1, "{sd}");
    }
}
