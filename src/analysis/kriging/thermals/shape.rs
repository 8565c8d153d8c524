//! The shape of a thermal: a column with one core, the same at all heights, that keeps its strength and may drift.
//!
//! ```text
//! w(r) = P (1 - a s) exp(-s^b),  s = (r/R)²
//! ```
//!
//! With `a = 0` and `b = 1` it is a Gaussian; with `a = 1`, `b = 1` as much air sinks in a ring around the core as rises
//! in it; a larger `b` has a flat core with a steep edge, as thermals have in Allen's fits to flights (AIAA 2006-1510).

use crate::analysis::running::RUNNING_S;

/// Numbers that describe a thermal besides its peak.
pub(super) const NUMBERS: usize = 7;
/// Place of the core at the reference time, units of [`PLACE_M`].
pub(super) const PLACE: [usize; 2] = [0, 1];
/// Logarithm of R in m.
pub(super) const LN_RADIUS: usize = 2;
/// Drift, units of [`DRIFT_MPS`].
pub(super) const DRIFT: [usize; 2] = [3, 4];
/// `a`.
pub(super) const SINK: usize = 5;
/// Logarithm of `b`.
pub(super) const LN_EDGE: usize = 6;

/// Unit of places in a search, m.
pub(super) const PLACE_M: f64 = 10.0;
/// Unit of drifts in a search, m/s.
pub(super) const DRIFT_MPS: f64 = 0.5;

/// Where it is met: places beyond this many R have nothing of it.
const FARTHEST: f64 = 6.0;
/// Gauss's nodes of the mean over 10 s as shares of the window, with their weights.
const WINDOW: [(f64, f64); 5] = [
    (0.0, 0.284_444_444),
    (0.269_234_655, 0.239_314_335),
    (-0.269_234_655, 0.239_314_335),
    (0.453_089_923, 0.118_463_443),
    (-0.453_089_923, 0.118_463_443),
];
/// Who moves by less than this share of R in a window meets one updraft. Chosen: it changes the mean by less than 0.1 %.
const STILL: f64 = 0.1;
/// Steps of sums along the radius.
const STEPS: usize = 64;

/// A thermal as it is searched, but for its peak.
pub(super) type Numbers = [f64; NUMBERS];

/// A thermal of peak 1 m/s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shape {
    core_m: [f64; 2],
    radius_m: f64,
    drift_mps: [f64; 2],
    sink: f64,
    edge: f64,
    /// When the core is at its place.
    at_s: f64,
}

impl Shape {
    pub(super) fn new(numbers: &Numbers, at_s: f64) -> Self {
        Self {
            core_m: PLACE.map(|index| PLACE_M * numbers[index]),
            radius_m: numbers[LN_RADIUS].exp(),
            drift_mps: DRIFT.map(|index| DRIFT_MPS * numbers[index]),
            sink: numbers[SINK],
            edge: numbers[LN_EDGE].exp(),
            at_s,
        }
    }

    /// Share of the peak at a distance from the core.
    pub(super) fn at_distance(&self, distance_m: f64) -> f64 {
        self.at_square((distance_m / self.radius_m).powi(2))
    }

    fn at_square(&self, s: f64) -> f64 {
        if s > FARTHEST * FARTHEST {
            return 0.0;
        }
        (1.0 - self.sink * s) * (-s.powf(self.edge)).exp()
    }

    /// From the core to a place, m.
    pub(super) fn off_m(&self, place_m: [f64; 3], time_s: f64) -> [f64; 2] {
        let off_s = time_s - self.at_s;
        [0, 1].map(|axis| place_m[axis] - self.core_m[axis] - self.drift_mps[axis] * off_s)
    }

    /// Mean over the 10 s around a time of who is at a place then and moves so fast.
    pub(super) fn mean(&self, place_m: [f64; 3], time_s: f64, velocity_mps: [f64; 3]) -> f64 {
        let off = self.off_m(place_m, time_s);
        let relative = [0, 1].map(|axis| velocity_mps[axis] - self.drift_mps[axis]);
        let square = |[x, y]: [f64; 2]| (x * x + y * y) / (self.radius_m * self.radius_m);
        let way = square(relative).sqrt() * RUNNING_S;
        if way < STILL {
            return self.at_square(square(off));
        }
        if square(off).sqrt() > FARTHEST + way {
            return 0.0;
        }
        WINDOW
            .iter()
            .map(|(at, weight)| {
                let by_s = at * RUNNING_S;
                let off = [0, 1].map(|axis| off[axis] + relative[axis] * by_s);
                weight * self.at_square(square(off))
            })
            .sum()
    }

    /// Distance at which the updraft has fallen to 1/e of the peak, m.
    pub(super) fn core_radius_m(&self) -> f64 {
        let (mut low, mut high) = (0.0, FARTHEST);
        for _ in 0..50 {
            let middle = f64::midpoint(low, high);
            if self.at_square(middle * middle) > (-1.0_f64).exp() {
                low = middle;
            } else {
                high = middle;
            }
        }
        f64::midpoint(low, high) * self.radius_m
    }

    /// Flux of a thermal of peak 1 m/s through the disc within [`Self::core_radius_m`], m³/s.
    pub(super) fn core_flux_m3ps(&self) -> f64 {
        let step_m = self.core_radius_m() / STEPS as f64;
        let rings = (0..STEPS).map(|step| {
            let r = (step as f64 + 0.5) * step_m;
            r * self.at_distance(r)
        });
        std::f64::consts::TAU * step_m * rings.sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(sink: f64, edge: f64) -> Numbers {
        [1.0, -0.5, 20.0_f64.ln(), 2.0, 0.0, sink, edge.ln()]
    }

    #[test]
    fn a_gaussian_and_a_ring_have_the_radii_and_fluxes_of_their_formulas() {
        let gaussian = Shape::new(&numbers(0.0, 1.0), 0.0);
        assert!((gaussian.core_radius_m() - 20.0).abs() < 1e-6);
        let expected = std::f64::consts::PI * 400.0 * (1.0 - (-1.0_f64).exp());
        assert!((gaussian.core_flux_m3ps() / expected - 1.0).abs() < 1e-3);
        let ring = Shape::new(&numbers(1.0, 1.0), 0.0);
        let s = (ring.core_radius_m() / 20.0).powi(2);
        assert!(((1.0 - s) * (-s).exp() - (-1.0_f64).exp()).abs() < 1e-9);
        // The integral of (1 - s) exp(-s) is s exp(-s).
        let expected = std::f64::consts::PI * 400.0 * s * (-s).exp();
        assert!((ring.core_flux_m3ps() / expected - 1.0).abs() < 1e-3);
    }

    #[test]
    fn means_are_those_along_the_way_that_sums_say() {
        let shape = Shape::new(&numbers(0.5, 1.3), 100.0);
        // The core drifts at 1 m/s along x from (10, -5) at 100 s.
        for (place_m, velocity_mps) in
            [([35.0, 0.0, 60.0], [4.0, 0.0, 0.0]), ([55.0, -8.0, 60.0], [0.0; 3])]
        {
            let time_s = 130.0;
            let summed: f64 = (0..1000)
                .map(|step| (f64::from(step) + 0.5) / 100.0 - 5.0)
                .map(|by| {
                    let core = [10.0 + (time_s + by - 100.0), -5.0];
                    let at =
                        [0, 1].map(|axis| place_m[axis] + velocity_mps[axis] * by - core[axis]);
                    shape.at_distance(at[0].hypot(at[1]))
                })
                .sum::<f64>()
                / 1000.0;
            let found = shape.mean(place_m, time_s, velocity_mps);
            assert!((found - summed).abs() < 5e-3, "{found} {summed}");
        }
    }
}
