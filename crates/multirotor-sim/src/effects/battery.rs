//! A lithium battery: open-circuit voltage by charge, less current times resistance.

use super::definition::{Class, Definition, Hook, Parameter, Signal, Sought, Values};
use super::{Effect, Now, Own, Reading, Reference, Signals, Start};
use crate::vehicle::{Airframe, RotorLaw, Vehicle};

const CELLS: usize = 0;
const CAPACITY: usize = 1;
const RESISTANCE: usize = 2;
const INITIAL: usize = 3;
const REFERENCE: usize = 4;
const AVIONICS: usize = 5;
const EXPONENT: usize = 6;
const COMPENSATED: usize = 7;
/// State: charge used (Ah), voltage (V), current (A), open-circuit voltage (V), factor on commands.
const USED: usize = 0;
const VOLTS: usize = 1;
const AMPS: usize = 2;
const RESTING: usize = 3;
const FACTOR: usize = 4;

/// Open-circuit voltage of a lithium polymer cell by charge, in tenths.
const CELL_V: [f64; 11] = [3.27, 3.69, 3.73, 3.77, 3.80, 3.84, 3.87, 3.95, 4.02, 4.11, 4.20];
/// Power over hover power by pulse over hover pulse: voltage times a current that grows a little
/// faster than squared.
const POWER_EXPONENT: f64 = 2.5;
/// Least voltage as a share of the open-circuit voltage.
const LEAST: f64 = 0.5;

/// Battery voltage sag.
#[derive(Debug)]
pub(super) struct Battery;

/// Open-circuit voltage of a cell, V, at a charge of 0..1.
pub fn cell_v(charge: f64) -> f64 {
    let place = charge.clamp(0.0, 1.0) * 10.0;
    let index = (place as usize).min(9);
    let (low, high) = (CELL_V[index], CELL_V[index + 1]);
    low + (high - low) * (place - index as f64)
}

/// Charge of a cell, 0..1, at an open-circuit voltage, V: the inverse of the discharge curve.
pub fn charge_of_cell(volts: f64) -> f64 {
    let above = CELL_V.partition_point(|known| *known <= volts).clamp(1, CELL_V.len() - 1);
    let (low, high) = (CELL_V[above - 1], CELL_V[above]);
    ((above - 1) as f64 + (volts - low) / (high - low)) / 10.0
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
                hides nothing. An empty battery does not switch off here: it stays at the voltage of \
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
                },
                Parameter {
                    name: "capacity_ah",
                    unit: "Ah",
                    what: "charge of a full battery",
                    low: 0.01,
                    high: 1000.0,
                    default: capacity_ah,
                },
                Parameter {
                    name: "resistance_ohm",
                    unit: "ohm",
                    what: "internal resistance with leads",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 0.05,
                },
                Parameter {
                    name: "initial_charge",
                    unit: "",
                    what: "charge at take-off, share of full",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 1.0,
                },
                Parameter {
                    name: "reference_v",
                    unit: "V",
                    what: "voltage under load for which the vehicle's hover is stated",
                    low: 1.0,
                    high: 100.0,
                    default: reference_v,
                },
                Parameter {
                    name: "avionics_w",
                    unit: "W",
                    what: "power of everything but the motors",
                    low: 0.0,
                    high: 1000.0,
                    default: |_| 3.0,
                },
                Parameter {
                    name: "exponent",
                    unit: "",
                    what: "how much of a fall of voltage reaches the motor (gamma)",
                    low: 0.0,
                    high: 2.0,
                    default: |_| 1.0,
                },
                Parameter {
                    name: "compensated",
                    unit: "",
                    what: "1: the autopilot is told the voltage and compensates; 0: it is not",
                    low: 0.0,
                    high: 1.0,
                    default: |_| 1.0,
                },
            ],
            hooks: &[Hook::Command],
            shown: (Signal::ChargeUsed, 0.0, 2.0),
            sought: Sought::Shape { size: "exponent", sizes: &[1.0], shape: None },
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

    fn start(&self, own: &mut Own, _start: &Start<'_>, _airframe: &mut Airframe) {
        let resting = resting_v(&own.values, 0.0);
        own.state[RESTING] = resting;
        own.state[VOLTS] = resting;
        own.state[FACTOR] = 1.0;
    }

    fn follow(&self, own: &mut Own, now: &Now) {
        let Own { values, state, .. } = own;
        state[AMPS] = (now.power_w + values[AVIONICS]) / state[VOLTS];
        state[USED] += state[AMPS] * now.dt_s / 3600.0;
        state[RESTING] = resting_v(values, state[USED]);
        let least = LEAST * state[RESTING];
        state[VOLTS] = (state[RESTING] - values[RESISTANCE] * state[AMPS]).max(least);
        let ratio = state[VOLTS] / values[REFERENCE];
        state[FACTOR] = if values[EXPONENT] == 1.0 { ratio } else { ratio.powf(values[EXPONENT]) };
    }

    fn command(&self, own: &Own, command: f64) -> f64 {
        command * own.state[FACTOR]
    }

    fn battery(&self, own: &Own) -> Option<Reading> {
        Some(Reading {
            volts: own.state[VOLTS],
            resting_v: own.state[RESTING],
            amps: own.state[AMPS],
            used_ah: own.state[USED],
            charge: own.values[INITIAL] - own.state[USED] / own.values[CAPACITY],
            capacity_ah: own.values[CAPACITY],
            resistance_ohm: own.values[RESISTANCE],
            compensated: own.values[COMPENSATED] >= 0.5,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cell_curve_is_monotonic_and_has_its_ends() {
        assert_eq!((cell_v(1.0), cell_v(0.0), cell_v(7.0)), (4.2, 3.27, 4.2));
        assert!(CELL_V.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((cell_v(0.95) - 4.155).abs() < 1e-12);
        for charge in [0.0, 0.03, 0.5, 0.87, 1.0] {
            assert!((charge_of_cell(cell_v(charge)) - charge).abs() < 1e-12);
        }
    }
}
