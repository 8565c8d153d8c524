//! The air between the windows of a calibration.

use nalgebra::DMatrix;

use super::covariance::{Covariance, slow};
use super::ways::Ways;
use crate::analysis::zero::CellAt;

/// Drones that stand for all.
const STAND_INS: usize = 6;
/// Nodes of the mean over a window, as shares of its length from its middle on (Gauss and Legendre).
const NODES: [f64; 2] = [-0.288_675_135, 0.288_675_135];
/// Weight of each pair of them.
const WEIGHT: f64 = 0.25;

impl CellAt {
    /// Time and height at a share of the window's length from its middle on.
    fn at(&self, share: f64) -> (f64, f64) {
        let by_s = share * self.span_s;
        (self.time_s + by_s, self.height_m + by_s * self.climb_mps)
    }
}

/// Covariances of the air in the windows of a calibration, each with each, (m/s)².
#[derive(Clone, Debug)]
pub(super) struct Between {
    /// Of the averages over drones.
    pub(super) shared: DMatrix<f64>,
    /// Of one drone's own deviation from them, by the field.
    pub(super) by_field: DMatrix<f64>,
    /// The same by its own gusts.
    pub(super) by_gusts: DMatrix<f64>,
}

impl Between {
    /// No air in so many windows.
    pub(super) fn none(windows: usize) -> Self {
        let none = DMatrix::zeros(windows, windows);
        Self { shared: none.clone(), by_field: none.clone(), by_gusts: none }
    }
}

/// Drones of which each window is an average.
#[derive(Clone, Debug)]
pub(super) struct StandIns {
    /// From each of some drones to each other of them, m: the covariance of *their* average is one, however the air
    /// drifts, which a choice of pairs would not give.
    pairs_m: Vec<[f64; 2]>,
    /// How many stand for all.
    count: f64,
    /// Drones in a window, on average.
    drones: f64,
}

impl StandIns {
    /// Of drones at these places on the level, m, of which so many are in a window on average.
    pub(super) fn of(homes_m: &[[f64; 2]], drones: f64) -> Self {
        let count = homes_m.len().min(STAND_INS);
        // Spread over the list, and by no step that follows the rows of a grid.
        let chosen =
            (0..count).map(|index| (index as f64 * homes_m.len() as f64 / count as f64) as usize);
        let stand_ins: Vec<[f64; 2]> =
            chosen.filter_map(|index| homes_m.get(index).copied()).collect();
        let mut pairs_m: Vec<[f64; 2]> = Vec::new();
        for (index, one) in stand_ins.iter().enumerate() {
            for other in &stand_ins[index + 1..] {
                pairs_m.push([one[0] - other[0], one[1] - other[1]]);
            }
        }
        Self { pairs_m, count: count.max(1) as f64, drones }
    }

    /// By the covariance of one drone with itself, and the sum over all pairs both ways: that of the average over drones, and of
    /// one drone's own deviation from it.
    fn split(&self, [own, over]: [f64; 2]) -> [f64; 2] {
        if self.pairs_m.is_empty() {
            return [own, 0.0];
        }
        let shared = (own * self.count + over) / self.count.powi(2);
        [shared, own - shared]
    }
}

/// Two windows, with all that does not hang on the air.
#[derive(Clone, Debug)]
struct Two {
    /// Row and column of the matrices.
    at: (usize, usize),
    apart_s: f64,
    /// How much higher and later each node of one is than each of the other, m and s.
    nodes: [(f64, f64); NODES.len() * NODES.len()],
    /// Shared and own part of slow air of variance 1.
    slow: [f64; 2],
}

/// All windows of a calibration, each with each, for air that is so many times as tall as long.
#[derive(Clone, Debug)]
pub(super) struct Met {
    windows: usize,
    two: Vec<Two>,
}

impl Met {
    /// Of the cells of a calibration.
    pub(super) fn of(cells: &[CellAt], stand_ins: &StandIns, taller: f64) -> Self {
        let mut all = Vec::new();
        for (row, one) in cells.iter().enumerate() {
            for (column, other) in cells[..=row].iter().enumerate() {
                all.push(two((row, one), (column, other), stand_ins, taller));
            }
        }
        Self { windows: cells.len(), two: all }
    }

    /// The air between them.
    pub(super) fn between(&self, covariance: &Covariance, stand_ins: &StandIns) -> Between {
        let mut found = Between::none(self.windows);
        let ways = Ways::of(covariance, &stand_ins.pairs_m);
        let slow = covariance.air().slow_mps.powi(2);
        for Two { at: (row, column), apart_s, nodes, slow: of_slow } in &self.two {
            let mut sums = [0.0; 2];
            for (up_m, apart_s) in nodes {
                let at = ways.at(*up_m, *apart_s);
                sums.iter_mut().zip(at).for_each(|(sum, at)| *sum += WEIGHT * at);
            }
            let gusts = covariance.gusts(*apart_s);
            let [shared, own] = stand_ins.split(sums);
            let of_all =
                if stand_ins.pairs_m.is_empty() { gusts } else { gusts / stand_ins.drones };
            for at in [(*row, *column), (*column, *row)] {
                found.shared[at] = shared + slow * of_slow[0] + of_all;
                found.by_field[at] = own + slow * of_slow[1];
                found.by_gusts[at] = gusts - of_all;
            }
        }
        found
    }
}

fn two(
    (row, one): (usize, &CellAt),
    (column, other): (usize, &CellAt),
    stand_ins: &StandIns,
    taller: f64,
) -> Two {
    let mut nodes = [(0.0, 0.0); NODES.len() * NODES.len()];
    for (index, node) in nodes.iter_mut().enumerate() {
        let (time_s, height_m) = one.at(NODES[index / NODES.len()]);
        let (other_s, other_m) = other.at(NODES[index % NODES.len()]);
        *node = ((height_m - other_m) / taller, time_s - other_s);
    }
    let over = |x_m: f64, y_m: f64| -> f64 {
        nodes.iter().map(|(up_m, apart_s)| WEIGHT * slow([x_m, y_m, *up_m], *apart_s)).sum()
    };
    let pairs = stand_ins.pairs_m.iter().map(|[x_m, y_m]| 2.0 * over(*x_m, *y_m)).sum();
    let slow = stand_ins.split([over(0.0, 0.0), pairs]);
    Two { at: (row, column), apart_s: one.time_s - other.time_s, nodes, slow }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::tests::air;
    use crate::analysis::kriging::covariance::{Air, Form};

    fn cell(time_s: f64, height_m: f64, climb_mps: f64) -> CellAt {
        CellAt { time_s, span_s: 9.0, height_m, climb_mps, drones: 4 }
    }

    /// The average over drones, and one drone's part of it, by summing over all drones.
    fn summed(
        covariance: &Covariance,
        homes_m: &[[f64; 2]],
        (one, other): (&CellAt, &CellAt),
        taller: f64,
    ) -> [f64; 2] {
        let over = |[x_m, y_m]: [f64; 2]| {
            let mut sum = 0.0;
            for at in NODES {
                for other_at in NODES {
                    let ((time_s, height_m), (other_s, other_m)) = (one.at(at), other.at(other_at));
                    let way_m = [x_m, y_m, (height_m - other_m) / taller];
                    sum += WEIGHT * covariance.instant(way_m, time_s - other_s);
                }
            }
            sum
        };
        let own = over([0.0; 2]);
        let mut all = 0.0;
        for from_m in homes_m {
            for to_m in homes_m {
                all += over([to_m[0] - from_m[0], to_m[1] - from_m[1]]);
            }
        }
        let shared = if homes_m.is_empty() { own } else { all / (homes_m.len() as f64).powi(2) };
        [shared, own - shared]
    }

    #[test]
    fn windows_share_what_the_averages_over_drones_share() {
        let cells = [cell(0.0, 20.0, 0.0), cell(15.0, 27.0, 1.5), cell(70.0, 60.0, -2.0)];
        let homes_m = [[0.0, 0.0], [12.0, 0.0], [3.0, 14.0], [30.0, 25.0]];
        for drift_mps in [[0.0; 2], [1.0, -2.0]] {
            let covariance = Covariance::new(Air {
                stretch: [0.2, 0.1],
                drift_mps,
                slow_mps: 0.3,
                ..air(Form::Exponential)
            });
            for drones in [0, 1, 2, 4] {
                let homes_m = &homes_m[..drones];
                let stand_ins = StandIns::of(homes_m, 4.0);
                for taller in [1.0, 4.0] {
                    let met = Met::of(&cells, &stand_ins, taller);
                    let found = met.between(&covariance, &stand_ins);
                    for (row, one) in cells.iter().enumerate() {
                        for (column, other) in cells.iter().enumerate() {
                            let [shared, own] = summed(&covariance, homes_m, (one, other), taller);
                            let gusts = covariance.gusts(one.time_s - other.time_s);
                            let of_all = if drones < 2 { gusts } else { gusts / 4.0 };
                            let at = (row, column);
                            let close = |found: f64, is: f64| (found - is).abs() < 1e-12;
                            assert!(close(found.shared[at], shared + of_all), "{drones} {at:?}");
                            assert!(close(found.by_field[at], own), "{drones} {at:?}");
                            assert!(close(found.by_gusts[at], gusts - of_all), "{drones} {at:?}");
                        }
                    }
                }
            }
        }
    }
}
