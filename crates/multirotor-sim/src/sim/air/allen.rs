//! Thermals after Allen 2006, "Updraft Model for Development of Autonomous Soaring Uninhabited Air
//! Vehicles" (AIAA 2006-1510; NASA/TM-2006-214019).
//!
//! Rotated-trapezoid updrafts that grow with height in a sinking environment, carried by the wind.
//! Shape factors and the order of operations follow the program printed in the report, not its
//! equation for the shape, which does not fit its own radii: the program's `k1 |r/r2 + k3|` falls to
//! one half between r1 and r2, `|k1 r/r2 + k3|` far inside r1 for wide thermals.

use std::f64::consts::PI;

use nalgebra::{Vector2, Vector3};
use rand::Rng;
use rand_distr::{Distribution as _, StandardUniform};

use super::Atmosphere;

/// r1/r2 and shape factors k1..k4 of the report's table.
const SHAPES: [(f64, [f64; 4]); 7] = [
    (0.14, [1.5352, 2.5826, -0.0113, -0.1950]),
    (0.25, [1.5265, 3.6054, -0.0176, -0.1265]),
    (0.36, [1.4866, 4.8356, -0.0320, -0.0818]),
    (0.47, [1.2042, 7.7904, 0.0848, -0.0445]),
    (0.58, [0.8816, 13.9720, 0.3404, -0.0216]),
    (0.69, [0.7067, 23.9940, 0.5689, -0.0099]),
    (0.80, [0.6189, 42.7965, 0.7157, -0.0033]),
];
/// Thermals are no narrower, m.
const SMALLEST_RADIUS_M: f64 = 10.0;

/// Dimensions and strength of one thermal at one height.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// Outer radius r2, m.
    pub outer_m: f64,
    /// Radius of the core r1, m.
    pub core_m: f64,
    /// Mean updraft over the thermal, m/s.
    pub mean_mps: f64,
    /// Updraft in the centre, m/s.
    pub peak_mps: f64,
}

impl Thermal {
    /// A thermal of the convective velocity scale w* under an inversion at `zi_m`, at a height.
    /// Without updraft at the ground and from the height where the mean is zero (0.91 zi).
    pub fn at_height(w_star_mps: f64, zi_m: f64, height_m: f64) -> Self {
        let z = (height_m / zi_m).clamp(0.0, 1.0);
        let outer_m = mean_radius_m(zi_m, height_m).max(SMALLEST_RADIUS_M);
        let share = if outer_m < 600.0 { 0.0011 * outer_m + 0.14 } else { 0.8 };
        let core_m = share * outer_m;
        let mean_mps = (w_star_mps * z.cbrt() * (1.0 - 1.1 * z)).max(0.0);
        let peak_mps = 3.0 * mean_mps * (1.0 - share) / (1.0 - share.powi(3));
        Self { outer_m, core_m, mean_mps, peak_mps }
    }

    /// Shape of the updraft at a distance from the centre, as a share of the peak: 1 in the middle,
    /// never negative.
    pub fn shape(&self, distance_m: f64) -> f64 {
        let share = self.core_m / self.outer_m;
        // The nearest row of the table.
        let row = SHAPES
            .windows(2)
            .position(|pair| share < f64::midpoint(pair[0].0, pair[1].0))
            .unwrap_or(SHAPES.len() - 1);
        let [k1, k2, k3, k4] = SHAPES[row].1;
        let r = distance_m / self.outer_m;
        (1.0 / (1.0 + (k1 * (r + k3).abs()).powf(k2)) + k4 * r).max(0.0)
    }
}

/// Mean outer radius at a height, m.
fn mean_radius_m(zi_m: f64, height_m: f64) -> f64 {
    let z = (height_m / zi_m).clamp(0.0, 1.0);
    0.102 * z.cbrt() * (1.0 - 0.25 * z) * zi_m
}

/// Thermals on an endlessly repeated square, moving with the wind.
#[derive(Clone, Debug, PartialEq)]
pub struct AllenThermals {
    w_star_mps: f64,
    zi_m: f64,
    wind_mps: Vector2<f64>,
    centres_m: Vec<Vector2<f64>>,
    side_m: f64,
}

impl AllenThermals {
    /// Thermals at given places (show x and y, m, at show time 0) under an inversion at `zi_m`, with
    /// the convective velocity scale w*, moving with the wind (show frame, m/s).
    ///
    /// The square that they repeat on has Allen's density: `N = 0.6 X Y / (zi r2(0.4 zi))`.
    pub fn new(
        w_star_mps: f64,
        zi_m: f64,
        wind_mps: Vector3<f64>,
        centres_m: Vec<Vector2<f64>>,
    ) -> Self {
        let side_m = side_m(zi_m, centres_m.len());
        Self { w_star_mps, zi_m, wind_mps: wind_mps.xy(), centres_m, side_m }
    }

    /// Thermals at random places; the first one at `first_m` if given.
    pub fn random<R: Rng>(
        w_star_mps: f64,
        zi_m: f64,
        wind_mps: Vector3<f64>,
        count: usize,
        first_m: Option<Vector2<f64>>,
        rng: &mut R,
    ) -> Self {
        let side_m = side_m(zi_m, count);
        let mut coordinate = || -> f64 {
            let share: f64 = StandardUniform.sample(rng);
            (share - 0.5) * side_m
        };
        let mut centres_m: Vec<_> =
            (0..count).map(|_| Vector2::new(coordinate(), coordinate())).collect();
        if let (Some(first_m), Some(centre)) = (first_m, centres_m.first_mut()) {
            *centre = first_m;
        }
        Self::new(w_star_mps, zi_m, wind_mps, centres_m)
    }

    /// Side of the square that the thermals repeat on, m.
    pub fn side_m(&self) -> f64 {
        self.side_m
    }

    /// Distance to the nearest thermal, m; infinite when there is none.
    fn distance_m(&self, place_m: Vector2<f64>, time_s: f64) -> f64 {
        let here = place_m - self.wind_mps * time_s;
        let nearest = self.centres_m.iter().map(|centre| {
            let off = (here - centre) / self.side_m;
            (off - off.map(f64::round)).norm_squared()
        });
        nearest.fold(f64::INFINITY, f64::min).sqrt() * self.side_m
    }

    /// Vertical velocity of the air at a position (show frame, m) and show time, m/s, up positive.
    pub fn updraft_mps(&self, position_m: &Vector3<f64>, time_s: f64) -> f64 {
        let distance_m = self.distance_m(position_m.xy(), time_s);
        let z = position_m.z / self.zi_m;
        let thermal = Thermal::at_height(self.w_star_mps, self.zi_m, position_m.z);
        // Also false for NaN.
        if !(distance_m.is_finite() && thermal.peak_mps > 0.0) {
            return 0.0;
        }
        let r = distance_m / thermal.outer_m;
        // Sink around the upper half of the thermal.
        let (mut ring, mut ring_share) = (0.0, 0.0);
        if z > 0.5 && z <= 0.9 {
            ring_share = 2.5 * (z - 0.5);
            if distance_m > thermal.core_m && r < 2.0 {
                ring = (ring_share * PI / 6.0 * (PI * r).sin()).min(0.0);
            }
        }
        let inside = thermal.shape(distance_m) * thermal.peak_mps + ring * thermal.mean_mps;
        if distance_m <= thermal.core_m {
            return inside;
        }
        let area =
            self.centres_m.len() as f64 * PI * mean_radius_m(self.zi_m, position_m.z).powi(2);
        let free = self.side_m * self.side_m - area;
        let sink_mps =
            if free > 0.0 { -area * thermal.mean_mps * (1.0 - ring_share) / free } else { 0.0 };
        inside * (1.0 - sink_mps / thermal.peak_mps) + sink_mps
    }
}

fn side_m(zi_m: f64, count: usize) -> f64 {
    (count.max(1) as f64 * zi_m * mean_radius_m(zi_m, 0.4 * zi_m) / 0.6).sqrt()
}

impl Atmosphere for AllenThermals {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        Vector3::new(0.0, 0.0, self.updraft_mps(position_m, time_s))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thermal_has_the_reports_numbers() {
        // At 100 m under 1400 m, w* 2: r2 58 m, mean 0.77 m/s.
        let thermal = Thermal::at_height(2.0, 1_400.0, 100.0);
        assert!((thermal.outer_m - 58.2).abs() < 0.1, "{thermal:?}");
        assert!((thermal.core_m / thermal.outer_m - 0.204).abs() < 1e-3);
        assert!((thermal.mean_mps - 0.765).abs() < 1e-3);
        // The report's fit of a revolved trapezoid: its volume is the mean over r2.
        let (r1, r2) = (thermal.core_m, thermal.outer_m);
        let volume = PI / 3.0 * thermal.peak_mps * (r1 * r1 + r1 * r2 + r2 * r2);
        assert!((volume / (PI * r2 * r2) / thermal.mean_mps - 1.0).abs() < 1e-9);
    }

    #[test]
    fn every_shape_is_the_trapezoid_it_stands_for() {
        for zi in [300.0, 1_000.0, 2_000.0, 4_000.0, 6_000.0, 8_000.0] {
            let thermal = Thermal::at_height(2.0, zi, 0.4 * zi);
            assert!((thermal.shape(0.0) - 1.0).abs() < 0.01, "{zi}");
            assert!(thermal.shape(thermal.outer_m) < 0.11, "{zi} {thermal:?}");
            let half = f64::midpoint(thermal.core_m, thermal.outer_m);
            assert!((0.2..0.8).contains(&thermal.shape(half)), "{zi}: {}", thermal.shape(half));
            // Mean over the disc r < r2.
            let steps = 2_000;
            let mean: f64 = (0..steps)
                .map(|step| {
                    let r = (f64::from(step) + 0.5) / f64::from(steps);
                    2.0 * r * thermal.shape(r * thermal.outer_m) / f64::from(steps)
                })
                .sum();
            let ratio = mean * thermal.peak_mps / thermal.mean_mps;
            assert!((0.8..1.15).contains(&ratio), "{zi}: {ratio}");
        }
    }
}
