//! Air that must be accelerated with the rotors.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::reference::DENSITY;
use super::{Change, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::Airframe;

const COEFFICIENT: usize = 0;

/// Added mass.
#[derive(Debug)]
pub(super) struct AddedMass;

/// Apparent mass of the air at four discs, kg: 8/3 rho R³ each.
fn added_kg(airframe: &Airframe, coefficient: f64) -> f64 {
    let radius_m = airframe.rotor_diameter_m / 2.0;
    coefficient * 4.0 * 8.0 / 3.0 * DENSITY * radius_m.powi(3)
}

/// The air that goes with one drone.
#[derive(Clone, Debug)]
struct Carried {
    /// At sea level.
    mass_kg: f64,
}

impl Effect for AddedMass {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "added-mass",
            title: "Added mass",
            what: "accelerating also accelerates the air at the discs",
            explanation: "Steady windows do not see it. While accelerating, the drone's own inertia \
                (L/g per m/s², part of every simulator) is increased by the apparent mass of the \
                air at the rotors, one or two percent. Only commanded accelerations may be used as \
                a regressor: a gust drives both the measured one and the residual.",
            formula: "F = -m_a a,  m_a = c 4 (8/3) rho R³;  du = L m_a a/(m g)",
            source: "apparent mass of a disc (Munk); Leishman, ch. 10",
            class: Class::Acceleration,
            signals: &[Signal::Acceleration],
            parameters: &[Parameter {
                name: "coefficient",
                unit: "",
                what: "apparent mass over that of an impermeable disc",
                low: 0.0,
                high: 10.0,
                default: |_| 0.64,
                role: None,
            }],
            hooks: &[Hook::Loads],
            shown: (Signal::Acceleration, -2.0, 2.0),
            sought: Sought::No("acts while accelerating only, and steady flight is compared"),
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let added = added_kg(&at.airframe, values[COEFFICIENT]) * at.density_ratio;
        let acceleration = signals.acceleration_mps2;
        let without = at.weight_n() + at.airframe.mass_kg * acceleration;
        let with = without + added * acceleration;
        at.thrust_us(with / at.weight_n()) - at.thrust_us(without / at.weight_n())
    }

    fn start(&self, start: &Start<'_>, airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        // More than the body itself cannot be solved step by step, and is not a multirotor.
        let mass_kg = added_kg(airframe, start.values[COEFFICIENT]).min(0.5 * airframe.mass_kg);
        Some(Box::new(Carried { mass_kg }))
    }
}

impl InFlight for Carried {
    fn loads(&mut self, now: &Now, change: &mut Change) {
        change.force_n.z -= self.mass_kg * now.density_ratio * now.acceleration_mps2.z;
    }
}
