//! The map of the air as one estimate: what all values of a flight, its calibration and the scales of the
//! air say together about the vertical air speed at each drone and second, and between the drones.
//!
//! ```text
//! y(i, t) = W + f(x_i, t) + g_i(t) + B(i, t) beta + a_i + noise
//! ```
//!
//! with a uniform updraft `W`, a Gaussian field `f` that may drift with the wind, gusts `g_i` of each drone's
//! own ([`covariance`]), errors `beta` that all drones share (the fleet's law with its zero, and the doubts of the
//! corrections) and a constant `a_i` of each drone. Scales are found by the likelihood ([`scales`]) of nearest
//! neighbours in space and time ([`neighbours`], [`vecchia`]); the zero by hover and calibration together
//! ([`calibration`]); and the map is the posterior mean with its standard deviation ([`predict`]).

mod adequacy;
mod along;
mod calibration;
#[cfg(test)]
mod calibration_tests;
mod covariance;
mod data;
mod dense;
mod gradient;
mod grid;
mod levinson;
mod limit;
mod make;
mod moving;
#[cfg(test)]
mod moving_tests;
mod neighbours;
mod pairs;
mod predict;
mod predicted;
mod sampling;
mod scales;
#[cfg(test)]
mod scales_tests;
mod scatter;
mod thermals;
#[cfg(test)]
mod thousands_tests;
mod vecchia;
mod ways;
mod windows;

pub(super) use calibration::Calibration;
pub(super) use covariance::{Air, Form};
pub(super) use data::{Drone, Value};
pub(super) use limit::{Best, best};
pub(super) use make::{Input, Scale, posterior};
pub(super) use thermals::{Known, Thermal};
