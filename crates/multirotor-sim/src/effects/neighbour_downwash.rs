//! The array of drones drives a sinking motion of the air it hovers in.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::DENSITY;
use super::{Air, Effect, InFlight, Now, Reference, Settled, Signals, Start, momentum};
use crate::vehicle::Airframe;

const SPACING: usize = 0;
const ARRAY: usize = 1;
const STRENGTH: usize = 2;

/// Neighbour downwash.
#[derive(Debug)]
pub(super) struct NeighbourDownwash;

/// Sink of the air in the middle of a large array, m/s: Glauert's disc with a drone's weight on the
/// square of the spacing.
fn sink_mps(weight_n: f64, density_ratio: f64, values: &Values, wind_mps: f64) -> f64 {
    let area_m2 = values[SPACING] * values[SPACING];
    let calm = (weight_n / (2.0 * DENSITY * density_ratio * area_m2)).sqrt();
    values[STRENGTH] * calm * momentum::induced(0.0, wind_mps / calm)
}

/// How many of the eight neighbours in a square array a place has.
fn neighbours(x_m: f64, y_m: f64, values: &Values) -> f64 {
    let edge_m = (values[ARRAY] - values[SPACING]) / 2.0;
    let lines = |place_m: f64| if place_m.abs() < edge_m { 3.0 } else { 2.0 };
    lines(x_m) * lines(y_m) - 1.0
}

/// One drone's place in the array.
#[derive(Clone, Debug)]
struct Seat {
    values: Values,
    /// Its neighbours over the eight of a drone in the middle.
    share: f64,
    /// The same as its place before take-off has it.
    share_at_home: f64,
    weight_n: f64,
}

impl Effect for NeighbourDownwash {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "neighbour-downwash",
            title: "Neighbour downwash",
            what: "the fleet as a whole pushes the air down, most in the middle of the array",
            explanation: "The jets of drones 7 m apart do not touch, but together the array is a \
                weak actuator disc: the air in it sinks by up to 0.2 m/s in calm air and by less \
                when the wind carries the momentum away. It is constant in time, so it looks like \
                an offset of the drone unless drones change places.",
            formula: "w = strength·n/8·v_a;  v_a sqrt(U² + v_a²) = m g/(2 rho spacing²);  \
                du = S w",
            source: "Glauert's momentum theory on the array; Bauersfeld et al., arXiv:2403.13321",
            class: Class::DroneOffset,
            signals: &[Signal::Neighbours, Signal::Horizontal, Signal::Sensitivity],
            parameters: &[
                Parameter {
                    name: "spacing_m",
                    unit: "m",
                    what: "distance of neighbours in the array",
                    low: 0.5,
                    high: 1000.0,
                    default: |_| 7.0,
                    role: None,
                },
                Parameter {
                    name: "array_m",
                    unit: "m",
                    what: "width of the square array, first to last drone",
                    low: 0.0,
                    high: 10_000.0,
                    default: |_| 42.0,
                    role: None,
                },
                Parameter {
                    name: "strength",
                    unit: "",
                    what: "share of the momentum disc's sink that reaches the drones",
                    low: 0.0,
                    high: 4.0,
                    default: |_| 1.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Air],
            shown: (Signal::Neighbours, 0.0, 8.0),
            sought: Sought::Shape { size: "strength", sizes: |_| &[1.0], usual: None, shape: None },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let sink = sink_mps(at.weight_n(), at.density_ratio, values, signals.horizontal_mps);
        signals.sensitivity * sink * signals.neighbours / 8.0
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let share_at_home = neighbours(start.home_m.x, start.home_m.y, start.values) / 8.0;
        Some(Box::new(Seat {
            values: *start.values,
            share: share_at_home,
            share_at_home,
            weight_n: start.reference.weight_n(),
        }))
    }
}

impl InFlight for Seat {
    fn air(&mut self, now: &Now, air: &mut Air) {
        let wind_mps = now.relative_mps.xy().norm();
        let sink = sink_mps(self.weight_n, now.density_ratio, &self.values, wind_mps);
        air.velocity_mps.z -= sink * self.share;
    }

    fn settle(&mut self, at: &Settled) {
        self.share = at.neighbours.map_or(self.share_at_home, |count| count / 8.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn array_of_the_paper_sinks_by_less_than_two_tenths() {
        let mut values = [0.0; 8];
        values[..3].copy_from_slice(&[7.0, 42.0, 1.0]);
        let calm = sink_mps(0.4 * 9.80665, 1.0, &values, 0.0);
        assert!((calm - 0.18).abs() < 0.005, "{calm}");
        // In wind w U = v_a².
        assert!((sink_mps(0.4 * 9.80665, 1.0, &values, 5.0) * 5.0 - calm * calm).abs() < 1e-4);
        let count = |x, y| neighbours(x, y, &values);
        assert_eq!([count(0.0, 7.0), count(21.0, 0.0), count(-21.0, 21.0)], [8.0, 5.0, 3.0]);
    }
}
