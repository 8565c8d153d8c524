//! A lithium battery: open-circuit voltage by charge, less current times resistance.

use super::cell::cell_v;
use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::role::Role;
use super::{Effect, InFlight, Now, Reading, Reference, Settled, Signals, Start, Supply};
use crate::vehicle::{Airframe, RotorLaw, Vehicle};

const CELLS: usize = 0;
const CAPACITY: usize = 1;
const RESISTANCE: usize = 2;
const INITIAL: usize = 3;
const REFERENCE: usize = 4;
const AVIONICS: usize = 5;
const EXPONENT: usize = 6;
const COMPENSATED: usize = 7;

/// Power over hover power by pulse over hover pulse: voltage times a current that grows a little
/// faster than squared.
const POWER_EXPONENT: f64 = 2.5;
/// Least voltage as a share of the open-circuit voltage.
const LEAST: f64 = 0.5;

/// Battery voltage sag.
#[derive(Debug)]
pub(super) struct Battery;

/// The battery of one drone.
#[derive(Clone, Debug)]
struct Pack {
    values: Values,
    used_ah: f64,
    /// Open-circuit voltage that is given, not that of the charge.
    given_v: Option<f64>,
    /// Under load.
    volts: f64,
    amps: f64,
    /// Open-circuit voltage.
    resting_v: f64,
    /// Factor on commands.
    factor: f64,
}

fn resting_v(values: &Values, used_ah: f64) -> f64 {
    values[CELLS] * cell_v(values[INITIAL] - used_ah / values[CAPACITY])
}

/// Voltage of a battery that gives this power, V.
fn loaded_v(values: &Values, resting: f64, power_w: f64) -> f64 {
    let root = resting * resting - 4.0 * values[RESISTANCE] * power_w;
    f64::midpoint(resting, root.max(0.0).sqrt()).max(LEAST * resting)
}

fn reference_v(vehicle: &Vehicle) -> f64 {
    match &vehicle.airframe.rotor {
        RotorLaw::Motor(motor) => motor.supply_v,
        RotorLaw::Linear => 3.0 * 3.85,
    }
}

fn capacity_ah(vehicle: &Vehicle) -> f64 {
    let amps = Reference::of(vehicle).hover_w() / reference_v(vehicle);
    (amps * vehicle.limits.endurance_s / 3600.0).clamp(0.1, 1000.0)
}

/// Take-off, and a landing at once, s: a battery that does not last so long is a mistake.
const SHORTEST_S: f64 = 30.0;

impl Effect for Battery {
    fn refusal(&self, values: &Values, vehicle: &Vehicle) -> Option<(usize, String)> {
        if values[CELLS].fract() != 0.0 {
            return Some((CELLS, "it must be a whole number".to_owned()));
        }
        if values[COMPENSATED] != 0.0 && values[COMPENSATED] != 1.0 {
            return Some((COMPENSATED, "it must be 0 or 1".to_owned()));
        }
        let power_w = Reference::of(vehicle).hover_w() + values[AVIONICS];
        let charge_ah = values[INITIAL] * values[CAPACITY];
        let lasts_s = charge_ah * resting_v(values, 0.0) / power_w * 3600.0;
        // NaN is refused too.
        if lasts_s >= SHORTEST_S {
            return None;
        }
        let culprit = if values[INITIAL] < 0.05 { INITIAL } else { CAPACITY };
        Some((
            culprit,
            format!(
                "such a battery lasts {lasts_s:.0} s of hover, and a take-off with a landing needs \
                 {SHORTEST_S:.0} s"
            ),
        ))
    }

    fn definition(&self) -> &'static Definition {
        &Definition {
            name: "battery",
            title: "Battery voltage sag",
            what: "the voltage falls with charge and current, and the pulse must rise against it",
            explanation: "A motor controller passes on a share of the battery's voltage, so a fall \
                of 1 % needs 1 % more of the pulse above 1000 us. The slow part (charge) looks like \
                a growing downdraft; the fast part (current times resistance) steepens every \
                response. ArduPilot's compensation raises the pulse before it is logged, so it \
                hides nothing; one that a motor controller does itself is not logged, and what it \
                leaves is gamma: 0 if it is right, another number if it is wrong by a factor. An empty battery does not switch off here: it stays at the voltage of \
                no charge (3.27 V a cell), and the drone flies on with what that gives; the \
                simulator names such drones. Terminal voltage must not be used as a regressor: the pulse drives \
                the current and with it the voltage.",
            formula: "V_b = n V_cell(q) - R I;  du = (u - 1000) ((V_ref/V_b)^gamma - 1)",
            source: "ArduPilot MOT_BAT_VOLT and MOTB; typical discharge curve of lithium polymer",
            class: Class::TimeDrift,
            signals: &[Signal::ChargeUsed, Signal::ModelIncrement],
            parameters: &[
                Parameter {
                    name: "cells",
                    unit: "",
                    what: "cells in series",
                    low: 1.0,
                    high: 24.0,
                    default: |vehicle| (reference_v(vehicle) / 3.85).round().max(1.0),
                    role: Some(Role::BatteryCells),
                },
                Parameter {
                    name: "capacity_ah",
                    unit: "Ah",
                    what: "charge of a full battery",
                    low: 0.01,
                    high: 1000.0,
                    default: capacity_ah,
                    role: Some(Role::BatteryCapacity),
                },
                Parameter {
                    name: "resistance_ohm",
                    unit: "ohm",
                    what: "internal resistance with leads",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.05,
                    role: Some(Role::BatteryResistance),
                },
                Parameter {
                    name: "initial_charge",
                    unit: "",
                    what: "charge at take-off, share of full",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 1.0,
                    role: Some(Role::BatteryCharge),
                },
                Parameter {
                    name: "reference_v",
                    unit: "V",
                    what: "voltage under load for which the vehicle's hover is stated",
                    low: 1.0,
                    high: 100.0,
                    default: reference_v,
                    role: Some(Role::BatteryReference),
                },
                Parameter {
                    name: "avionics_w",
                    unit: "W",
                    what: "power of everything but the motors",
                    low: 0.0,
                    high: 1000.0,
                    default: |_| 3.0,
                    role: Some(Role::BatteryAvionics),
                },
                Parameter {
                    name: "exponent",
                    unit: "",
                    what: "how much of a fall of voltage reaches the motor (gamma): 1 all, 0 none, \
                        below 0 where a compensation does too much",
                    low: -1.0,
                    high: 2.0,
                    default: |_| 1.0,
                    role: Some(Role::BatterySag),
                },
                Parameter {
                    name: "compensated",
                    unit: "",
                    what: "1: the autopilot is told the voltage and compensates; 0: it is not",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 1.0,
                    role: Some(Role::BatteryCompensated),
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::ChargeUsed, 0.0, 2.0),
            // Too little compensation, and too much.
            sought: Sought::Shape {
                size: "exponent",
                sizes: |_| &[1.0, -0.4],
                usual: None,
                shape: None,
            },
        }
    }

    fn pulse_us(&self, at: &Reference, values: &Values, signals: &Signals) -> f64 {
        let hover_us = at.hover_us() - 1000.0;
        let pulse_us = (hover_us + signals.increment_us).max(0.0);
        let load = (pulse_us / hover_us).powf(POWER_EXPONENT);
        let power_w = at.hover_w() * load + values[AVIONICS];
        let volts = loaded_v(values, resting_v(values, signals.charge_used_ah), power_w);
        pulse_us * ((values[REFERENCE] / volts).powf(values[EXPONENT]) - 1.0)
    }

    fn start(&self, start: &Start<'_>, _airframe: &mut Airframe) -> Option<Box<dyn InFlight>> {
        let resting_v = resting_v(start.values, 0.0);
        Some(Box::new(Pack {
            values: *start.values,
            used_ah: 0.0,
            given_v: None,
            volts: resting_v,
            amps: 0.0,
            resting_v,
            factor: 1.0,
        }))
    }
}

impl Pack {
    fn at_rest_v(&self) -> f64 {
        self.given_v.unwrap_or_else(|| resting_v(&self.values, self.used_ah))
    }
}

impl InFlight for Pack {
    fn follow(&mut self, now: &Now) {
        let values = &self.values;
        self.amps = (now.power_w + values[AVIONICS]) / self.volts;
        self.used_ah += self.amps * now.dt_s / 3600.0;
        self.resting_v = self.at_rest_v();
        let least = LEAST * self.resting_v;
        self.volts = (self.resting_v - values[RESISTANCE] * self.amps).max(least);
        let ratio = self.volts / values[REFERENCE];
        self.factor = if values[EXPONENT] == 1.0 { ratio } else { ratio.powf(values[EXPONENT]) };
    }

    fn command(&self, command: f64) -> f64 {
        command * self.factor
    }

    fn settle(&mut self, at: &Settled) {
        match at.supply {
            Supply::Used(charge_ah) => (self.used_ah, self.given_v) = (charge_ah, None),
            Supply::Resting(volts) => self.given_v = Some(volts),
        }
        self.resting_v = self.at_rest_v();
        self.volts = self.resting_v;
    }

    fn battery(&self) -> Option<Reading> {
        Some(Reading {
            volts: self.volts,
            resting_v: self.resting_v,
            amps: self.amps,
            used_ah: self.used_ah,
            charge: self.values[INITIAL] - self.used_ah / self.values[CAPACITY],
            capacity_ah: self.values[CAPACITY],
            resistance_ohm: self.values[RESISTANCE],
            compensated: self.values[COMPENSATED] >= 0.5,
        })
    }
}
