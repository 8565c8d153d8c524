//! A lithium-ion battery: open-circuit voltage by charge, and internal resistance.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Open-circuit voltage of one cylindrical NMC cell by charge from 0 to 1 in steps of a tenth, V: typical of
/// slow discharges at 25 °C in data sheets.
const CELL_V: [f64; 11] = [3.00, 3.42, 3.53, 3.60, 3.65, 3.71, 3.80, 3.90, 4.00, 4.09, 4.18];

/// Open-circuit voltage of a cell at a charge from 0 to 1, V.
pub fn cell_v(charge: f64) -> f64 {
    let last = CELL_V.len() - 2;
    let place = charge.clamp(0.0, 1.0) * (last + 1) as f64;
    let index = (place as usize).min(last);
    let share = place - index as f64;
    CELL_V[index] * (1.0 - share) + CELL_V[index + 1] * share
}

/// A battery.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BatterySettings {
    /// Cells in series.
    pub cells: f64,
    /// Charge of a full battery, Ah.
    pub capacity_ah: f64,
    /// Internal resistance, ohm.
    pub resistance_ohm: f64,
    /// Voltage at which a command has its nominal meaning, V.
    pub reference_v: f64,
}

/// State of a battery in flight.
#[derive(Clone, Copy, Debug)]
pub struct Battery {
    settings: BatterySettings,
    initial: f64,
    /// Charge used, Ah.
    pub used_ah: f64,
    /// Energy used, Wh.
    pub used_wh: f64,
    /// Current, A.
    pub current_a: f64,
}

impl Battery {
    /// A battery at a charge from 0 to 1, without load.
    pub fn new(settings: &BatterySettings, charge: f64) -> Self {
        let settings = *settings;
        Self { settings, initial: charge, used_ah: 0.0, used_wh: 0.0, current_a: 0.0 }
    }

    /// Charge left, 0 to 1.
    pub fn charge(&self) -> f64 {
        (self.initial - self.used_ah / self.settings.capacity_ah).clamp(0.0, 1.0)
    }

    /// Voltage without load, V.
    pub fn resting_v(&self) -> f64 {
        self.settings.cells * cell_v(self.charge())
    }

    /// Internal resistance, ohm.
    pub fn resistance_ohm(&self) -> f64 {
        self.settings.resistance_ohm
    }

    /// Voltage under the present current, V.
    pub fn volts(&self) -> f64 {
        (self.resting_v() - self.settings.resistance_ohm * self.current_a)
            .max(0.5 * self.settings.reference_v)
    }

    /// Gives this power for a time.
    pub fn give(&mut self, power_w: f64, interval_s: f64) {
        self.current_a = power_w / self.volts();
        self.used_ah += self.current_a * interval_s / 3600.0;
        self.used_wh += power_w * interval_s / 3600.0;
    }

    /// Voltage over the reference.
    pub fn ratio(&self) -> f64 {
        self.volts() / self.settings.reference_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_voltage_falls_with_charge_and_current() {
        assert_eq!(cell_v(1.0), 4.18);
        assert_eq!(cell_v(0.0), 3.0);
        assert!((cell_v(0.55) - 3.755).abs() < 1e-12);
        let settings = BatterySettings {
            cells: 2.0,
            capacity_ah: 2.0,
            resistance_ohm: 0.05,
            reference_v: 7.9,
        };
        let mut battery = Battery::new(&settings, 1.0);
        assert_eq!(battery.volts(), 8.36);
        for _ in 0..36_000 {
            battery.give(40.0, 0.01);
        }
        // 40 W for 360 s at some 7.8 V are half an ampere-hour.
        assert!((battery.used_ah - 0.51).abs() < 0.02, "{}", battery.used_ah);
        assert!((battery.used_wh - 4.0).abs() < 1e-9);
        assert!(battery.volts() < battery.resting_v() - 0.2);
    }
}
