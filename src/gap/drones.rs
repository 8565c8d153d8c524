//! Differences between drones: each one's hover pulse and response against the fleet's.

use nalgebra::{DMatrix, DVector};

use super::compare::Comparison;
use super::error::GapError;
use super::explain::Found;
use super::gls::Pulses;
use super::noise::{
    GUST_TIME, GUSTS, GroupPattern, Hyper, LEAST, OFFSETS, OWN, SHARED_TIME, SLOPES, WHITE,
};
use super::verdict::{DroneOffset, Drones};
use crate::effects::Reference;

/// Fewest drones from which a correlation is told.
const FEWEST: usize = 8;
/// Spread of the hover pulse that is usual, us (the paper's Table II: 6.7).
const USUAL_US: f64 = 20.0;

/// Offsets and responses of all drones of a comparison against the fleet's model.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub fn drones(
    all: &Comparison,
    found: &Found,
    is_held: impl Fn(u16) -> bool,
) -> Result<Drones, GapError> {
    let patterns = all.patterns(&found.vehicle)?;
    let residual = all.residual(&found.vehicle, found.gusts_mps)?;
    let mut each = Vec::new();
    for (index, (group, pattern)) in all.data.groups.iter().zip(&patterns).enumerate() {
        let blup = Blup::new(pattern, &found.hyper);
        let deviations = deviations(&residual, index);
        for (slot, deviation) in group.slots.iter().zip(deviations) {
            let (offset_us, slope) = blup.of(&deviation);
            each.push(DroneOffset { slot: *slot, offset_us, slope, held_out: is_held(*slot) });
        }
    }
    each.sort_by_key(|drone| drone.slot);
    let correlation = (each.len() >= FEWEST).then(|| correlation(&each));
    let words = words(&each, correlation, found);
    Ok(Drones { each, correlation, words })
}

fn deviations(residual: &Pulses, group: usize) -> Vec<Vec<f64>> {
    let drones = &residual[group];
    let count = drones.len().max(1) as f64;
    let bins = drones.first().map_or(0, Vec::len);
    let mean: Vec<f64> =
        (0..bins).map(|bin| drones.iter().map(|drone| drone[bin]).sum::<f64>() / count).collect();
    drones.iter().map(|d| d.iter().zip(&mean).map(|(a, b)| a - b).collect()).collect()
}

/// Best linear prediction of a drone's offset and response from its deviations.
struct Blup {
    map: DMatrix<f64>,
}

impl Blup {
    fn new(pattern: &GroupPattern, hyper: &Hyper) -> Self {
        let count = pattern.time_s.len();
        let square = |place: usize| hyper.get(place).powi(2);
        let response = |bin: usize| pattern.response[bin].abs() + hyper.get(LEAST);
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let apart_s = (pattern.time_s[a] - pattern.time_s[b]).abs();
            let air = square(OWN) * (-apart_s / hyper.get(SHARED_TIME)).exp()
                + square(GUSTS) * (-apart_s / hyper.get(GUST_TIME)).exp();
            response(a) * response(b) * air
                + square(OFFSETS)
                + square(SLOPES) * pattern.slope_us[a] * pattern.slope_us[b]
                + if a == b { square(WHITE) } else { 0.0 }
        });
        let cross = DMatrix::from_fn(count, 2, |bin, which| {
            if which == 0 { square(OFFSETS) } else { square(SLOPES) * pattern.slope_us[bin] }
        });
        let map = covariance
            .cholesky()
            .map_or_else(|| DMatrix::zeros(2, count), |factor| factor.solve(&cross).transpose());
        Self { map }
    }

    fn of(&self, deviation: &[f64]) -> (f64, f64) {
        let found = &self.map * DVector::from_column_slice(deviation);
        (found[0], found[1])
    }
}

fn correlation(each: &[DroneOffset]) -> f64 {
    let count = each.len() as f64;
    let mean = |of: fn(&DroneOffset) -> f64| each.iter().map(of).sum::<f64>() / count;
    let (offset, slope) = (mean(|d| d.offset_us), mean(|d| d.slope));
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for drone in each {
        let (x, y) = (drone.offset_us - offset, drone.slope - slope);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let product = (xx * yy).sqrt();
    if product > 0.0 { xy / product } else { 0.0 }
}

fn words(each: &[DroneOffset], correlation: Option<f64>, found: &Found) -> Vec<String> {
    let mut words = Vec::new();
    let spread_us = found.hyper.get(OFFSETS);
    let sensitivity = Reference::of(&found.vehicle).sensitivity_us();
    if each.len() >= FEWEST {
        words.push(format!(
            "hover pulses differ by {spread_us:.1} us from drone to drone (standard deviation): \
             {:.1} % of thrust or mass{}",
            100.0 * spread_us / sensitivity,
            if spread_us > USUAL_US { ", more than is usual" } else { "" },
        ));
        words.push(match correlation {
            Some(value) if value > 0.5 => {
                "drones that need more pulse also respond more: the thrust of rotors differs rather \
                 than the mass"
                    .to_owned()
            }
            _ => "whether thrust or mass differs cannot be told from offsets alone: a known payload \
                  on some drones would tell"
                .to_owned(),
        });
    }
    words
}
