//! A vehicle in the steady moments of a flight, by the simulator's own trim.

use nalgebra::Vector3;

use super::as_flown::AsFlown;
use super::response::Response;
use crate::effects::{Definition, EffectError, Signals, Supply};
use crate::sim::plant::trim::{Balance, Condition, Trim};
use crate::vehicle::Vehicle;

/// Pulse without thrust, us: the convention of all controllers (docs/physics.md, 1.1).
pub(super) const IDLE_US: f64 = 1000.0;

/// Halvings on the way to the fastest climb that a vehicle can fly. Numerical: to a thousandth.
const HALVINGS: usize = 10;

/// One steady moment: what closed forms look at, and which way the air goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    /// Signals at the moment; the lean that the logs show is not looked at.
    pub signals: Signals,
    /// Horizontal velocity relative to the air, show frame, m/s.
    pub relative_mps: [f64; 2],
}

impl Moment {
    /// The same moment at another vertical speed relative to the air, m/s.
    pub(super) fn climbing(self, climb_mps: f64) -> Self {
        Self { signals: Signals { climb_mps, ..self.signals }, ..self }
    }

    fn condition(&self, supply: Supply, neighbours: f64) -> Condition {
        let Signals { climb_mps, height_m, time_s, density_ratio, acceleration_mps2, .. } =
            self.signals;
        let [x, y] = self.relative_mps;
        Condition {
            velocity_mps: Vector3::new(x, y, climb_mps),
            acceleration_mps2: Vector3::new(0.0, 0.0, acceleration_mps2),
            density_ratio,
            position_m: Vector3::new(0.0, 0.0, height_m),
            time_s,
            supply,
            neighbours: Some(neighbours),
            ..Condition::default()
        }
    }

    fn refused(&self) -> EffectError {
        EffectError::NotFlown {
            climb_mps: self.signals.climb_mps,
            horizontal_mps: self.relative_mps[0].hypot(self.relative_mps[1]),
        }
    }
}

/// Steady pulses of a vehicle's mean drone.
#[derive(Clone)]
pub(super) struct Steady {
    trim: Trim,
    /// Power of thrust that `u - 1000` goes with at hover.
    exponent: f64,
    /// What another program's logs have more than the vehicle.
    as_flown: Option<AsFlown>,
}

impl Steady {
    /// Steady pulses of a vehicle with its effects.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn of(vehicle: &Vehicle) -> Result<Self, EffectError> {
        let exponent = super::compare::thrust_exponent(vehicle);
        Ok(Self { trim: Trim::of(vehicle)?, exponent, as_flown: None })
    }

    /// The same of vehicles that answer climb as another program's logs do.
    pub(super) fn answering(self, as_flown: Option<&AsFlown>) -> Self {
        Self { as_flown: as_flown.cloned(), ..self }
    }

    /// The same, for moments that follow each other.
    pub(super) fn following(self) -> Self {
        Self { trim: self.trim.following(), ..self }
    }

    fn condition(&self, at: &Moment, supply: Supply, neighbours: f64) -> Condition {
        let mut condition = at.condition(supply, neighbours);
        let more_mps2 = self.as_flown.as_ref().map_or(0.0, |own| own.at(at.signals.climb_mps));
        condition.acceleration_mps2.z += more_mps2;
        condition
    }

    /// Steady pulses of a drone that deviates from the fleet by so many standard deviations of each effect.
    ///
    /// # Errors
    /// As [`Steady::of`].
    pub(super) fn deviating(
        vehicle: &Vehicle,
        own: impl Fn(&Definition) -> f64,
    ) -> Result<Self, EffectError> {
        let exponent = super::compare::thrust_exponent(vehicle);
        let trim = Trim::deviating(vehicle, Vector3::zeros(), own)?;
        Ok(Self { trim, exponent, as_flown: None })
    }

    /// The pulse at a moment, brought to level as measured pulses are, us.
    ///
    /// # Errors
    /// The vehicle cannot fly so.
    pub(super) fn pulse_us(
        &mut self,
        at: &Moment,
        supply: Supply,
        neighbours: f64,
    ) -> Result<f64, EffectError> {
        let balance = self.balance(at, neighbours)?;
        self.of_balance(&balance, at, supply, neighbours)
    }

    /// The balance of forces at a moment, which no battery changes; where there is none, that of the fastest
    /// climb or descent in the same air that has one: rotors that are at their limits stay there.
    ///
    /// # Errors
    /// The vehicle cannot even hover in that air.
    pub(super) fn balance(&mut self, at: &Moment, neighbours: f64) -> Result<Balance, EffectError> {
        let supply = Supply::Used(0.0);
        if let Some(balance) = self.trim.balance(&self.condition(at, supply, neighbours)) {
            return Ok(balance);
        }
        self.nearest_flown(at, |steady, slower| {
            steady.trim.balance(&steady.condition(slower, supply, neighbours))
        })
    }

    /// Something of the fastest climb or descent in the same air that has it.
    fn nearest_flown<T>(
        &mut self,
        at: &Moment,
        of: impl Fn(&mut Self, &Moment) -> Option<T>,
    ) -> Result<T, EffectError> {
        let wanted_mps = at.signals.climb_mps;
        let mut found = of(self, &at.climbing(0.0)).ok_or_else(|| at.refused())?;
        let (mut flown, mut refused) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let share = f64::midpoint(flown, refused);
            match of(self, &at.climbing(share * wanted_mps)) {
                Some(there) => (found, flown) = (there, share),
                None => refused = share,
            }
        }
        Ok(found)
    }

    /// The pulse of a balance, brought to level, us; where no pulse does it, that of the fastest climb or descent in
    /// the same air that has one.
    ///
    /// # Errors
    /// The vehicle cannot even hover in that air.
    pub(super) fn of_balance(
        &mut self,
        balance: &Balance,
        at: &Moment,
        supply: Supply,
        neighbours: f64,
    ) -> Result<f64, EffectError> {
        let level = |steady: &mut Self, balance: &Balance, at: &Moment| {
            let condition = steady.condition(at, supply, neighbours);
            let pulse_us = steady.trim.pulse_us(balance, &condition)? - IDLE_US;
            let cos = (1.0 - balance.lean.norm_squared()).max(0.0).sqrt();
            Some(IDLE_US + pulse_us * cos.powf(steady.exponent))
        };
        if let Some(pulse_us) = level(self, balance, at) {
            return Ok(pulse_us);
        }
        self.nearest_flown(at, |steady, slower| {
            let balance = steady.balance(slower, neighbours).ok()?;
            level(steady, &balance, slower)
        })
    }

    /// Whether the vehicle hovers in a moment's air: then it has a pulse at any climb there.
    pub(super) fn hovers(&mut self, at: &Moment) -> bool {
        let (hover, supply) = (at.climbing(0.0), Supply::Used(at.signals.charge_used_ah));
        let balance = self.trim.balance(&self.condition(&hover, Supply::Used(0.0), 0.0));
        balance.is_some_and(|balance| {
            self.trim.pulse_us(&balance, &self.condition(&hover, supply, 0.0)).is_some()
        })
    }

    /// Response to vertical air speed at a moment.
    ///
    /// # Errors
    /// The vehicle cannot fly at a speed so near.
    pub(super) fn response(&mut self, at: &Moment) -> Result<Response, EffectError> {
        let mut refused = None;
        let response = Response::of(|shift_mps| {
            let shifted = at.climbing(at.signals.climb_mps + shift_mps);
            let supply = Supply::Used(at.signals.charge_used_ah);
            self.pulse_us(&shifted, supply, 0.0).unwrap_or_else(|error| {
                refused = Some(error);
                f64::NAN
            })
        });
        refused.map_or(Ok(response), Err)
    }
}
