//! Air that is not the standard atmosphere's: warmer, colder, other pressure.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Air, Effect, InFlight, Now, Reference, Signals, Start};
use crate::vehicle::Airframe;

const TEMPERATURE: usize = 0;
const PRESSURE: usize = 1;
/// The standard atmosphere at sea level.
const STANDARD_K: f64 = 288.15;
const STANDARD_HPA: f64 = 1013.25;

/// Air density.
#[derive(Debug)]
pub(super) struct AirDensity;

fn factor(values: &Values) -> f64 {
    (1.0 + values[PRESSURE] / STANDARD_HPA) * STANDARD_K / (STANDARD_K + values[TEMPERATURE])
}

/// The day's air.
#[derive(Clone, Debug)]
struct Day {
    /// Density over the standard atmosphere's.
    factor: f64,
}

impl Effect for AirDensity {
    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "air-density",
            title: "Air density",
            what: "thin air needs more rotor speed for the same thrust",
            explanation: "Known physics, to be computed and never fitted. The fall of density with \
                height is part of the simulator's base; this effect adds a day that is warmer or \
                under lower pressure than the standard atmosphere. With AirSim's linear rotors the \
                whole excess over 1000 us goes with 1/density; with motors only the part that turns \
                the rotor faster does, as the torque at given thrust stays.",
            formula: "du = (u0 - 1000) g (rho0/rho - 1),  g = 1 (linear law) or about 0.4 (motor)",
            source: "ICAO standard atmosphere; ideal gas",
            class: Class::HeightTrend,
            signals: &[Signal::Density],
            parameters: &[
                Parameter {
                    name: "temperature_offset_k",
                    unit: "K",
                    what: "temperature above the standard atmosphere's",
                    low: -60.0,
                    high: 60.0,
                    default: |_| 0.0,
                    role: None,
                },
                Parameter {
                    name: "pressure_offset_hpa",
                    unit: "hPa",
                    what: "pressure above the standard atmosphere's",
                    low: -100.0,
                    high: 100.0,
                    default: |_| 0.0,
                    role: None,
                },
            ],
            hooks: &[Hook::Air],
            shown: (Signal::Density, 0.9, 1.05),
            sought: Sought::No(
                "known physics: computed from temperature and pressure, never fitted",
            ),
        }
    }

    /// Against the density of `at`: nothing is counted twice when that is the signal's own.
    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        at.in_air(signals.density_ratio * factor(values)).hover_us() - at.hover_us()
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        Some(Box::new(Day { factor: factor(start.values) }))
    }
}

impl InFlight for Day {
    fn air(&mut self, _now: &Now, air: &mut Air) {
        air.density_ratio *= self.factor;
    }
}
