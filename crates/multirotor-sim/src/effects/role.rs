//! Roles of parameters: their meaning to code that does not know the effect they belong to.
//!
//! Other rooms never name an effect. Who needs the vehicle's drag area or the cells of its battery
//! asks for the parameter with that role, and who adds an effect states the roles of its parameters.

use super::definition::Parameter;
use super::select::{set, value_of};
use super::{Effect, LIBRARY, find};
use crate::vehicle::Vehicle;

/// Meaning of a parameter to other code. One parameter of the library has each role, except for
/// [`Role::Spread`] and [`Role::Scatter`], which parameters of any effect may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Drag coefficient times area of the body for vertical flow, m².
    BodyDragTop,
    /// Drag coefficient times area of the body for horizontal flow, m².
    BodyDragSide,
    /// Force of the rotors against horizontal air over weight, per air speed, s/m.
    RotorDrag,
    /// Part of that force that goes with the flow through the disc.
    RotorDragFlow,
    /// Force of the rotors against horizontal air over mass, per air speed, 1/s.
    MomentumDrag,
    /// Relative change of the drag of the airframe's own top and bottom face.
    FaceDragTop,
    /// Relative change of the drag of the airframe's own side faces.
    FaceDragSide,
    /// Share of the geometric thrust that the rotors lose to their own inflow in hover.
    InflowShare,
    /// Share of the inflow of which horizontal air gives a part back.
    WindLift,
    /// Part of what horizontal air gives that goes with the square of its speed.
    WindLiftSquare,
    /// Share of the square in thrust as a curve over the command.
    ThrustExpo,
    /// Standard deviation of mass between drones, relative.
    MassSpread,
    /// Standard deviation of thrust at one pulse between drones, relative.
    ThrustSpread,
    /// Standard deviation of the inflow share between drones, relative.
    InflowSpread,
    /// Share of momentum theory's change of the induced velocity with the climb: one of two forms of the same effect.
    InflowInduced,
    /// Another standard deviation between drones.
    Spread,
    /// Strength of a jitter of the thrust, which hides how the drone answers gusts.
    Scatter,
    /// Bias of the autopilot's vertical speed, m/s up.
    SensorBias,
    /// Lag of the autopilot's vertical speed, s.
    SensorLag,
    /// 1: only the log has the error of the vertical speed; 0: the autopilot flies by it, too.
    SensorLogOnly,
    /// Time constant of warming up after take-off, s.
    WarmUpTime,
    /// Cells of the battery in series.
    BatteryCells,
    /// Charge of the full battery, Ah.
    BatteryCapacity,
    /// Internal resistance of the battery, ohm.
    BatteryResistance,
    /// Charge of the battery at take-off, share of full.
    BatteryCharge,
    /// Voltage under load for which the vehicle's hover is stated, V.
    BatteryReference,
    /// Power of everything but the motors, W.
    BatteryAvionics,
    /// Share of a fall of the voltage that reaches the motors, as an exponent.
    BatterySag,
    /// 1: the autopilot compensates for the voltage; 0: it does not.
    BatteryCompensated,
}

/// The library's parameter that has a role.
#[derive(Clone, Copy)]
pub struct Place {
    /// Effect that has the parameter.
    pub effect: &'static dyn Effect,
    /// Parameter that has the role.
    pub parameter: &'static Parameter,
}

impl Place {
    /// Name of the effect.
    pub fn name(&self) -> &'static str {
        self.effect.definition().name
    }
}

impl Role {
    /// Whether the parameter is a difference between drones: the fleet's mean drone has 0.
    pub fn is_spread(self) -> bool {
        matches!(self, Self::MassSpread | Self::ThrustSpread | Self::InflowSpread | Self::Spread)
    }

    /// Whether the parameter chooses between forms of its effect, each of which has a size of its own.
    pub fn is_choice(self) -> bool {
        self == Self::InflowInduced
    }

    /// Parameter with this role, the first in the library's order; `None` if there is none.
    pub fn place(self) -> Option<Place> {
        LIBRARY.iter().find_map(|effect| {
            let parameter = effect.definition().with_role(self)?;
            Some(Place { effect: *effect, parameter })
        })
    }

    /// Whether the effect of a name has a parameter with this role.
    pub fn is_of(self, effect: &str) -> bool {
        find(effect).is_some_and(|effect| effect.definition().with_role(self).is_some())
    }

    /// Value on a vehicle; `None` if the effect does not act on it, or has values that are not valid.
    pub fn value(self, vehicle: &Vehicle) -> Option<f64> {
        let place = self.place()?;
        value_of(vehicle, place.name(), place.parameter.name)
    }

    /// Value that the vehicle's file states, whether the effect acts or not.
    pub fn stated(self, vehicle: &Vehicle) -> Option<f64> {
        let place = self.place()?;
        vehicle.effects.get(place.name())?.parameters.get(place.parameter.name).copied()
    }

    /// Value that the vehicle's file states, else the default: what it has or would have.
    pub fn stated_or_default(self, vehicle: &Vehicle) -> Option<f64> {
        self.stated(vehicle).or_else(|| Some((self.place()?.parameter.default)(vehicle)))
    }

    /// Sets the parameter without a check of its bounds, and switches the effect on.
    pub fn set(self, vehicle: &mut Vehicle, value: f64) {
        if let Some(place) = self.place() {
            set(vehicle, place.name(), place.parameter.name, value);
        }
    }

    /// Whether the effect with this role acts on a vehicle.
    pub fn is_on(self, vehicle: &Vehicle) -> bool {
        let place = self.place();
        let table = place.and_then(|place| vehicle.effects.get(place.name()));
        table.is_some_and(|table| table.on)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONCE: [Role; 27] = [
        Role::BodyDragTop,
        Role::BodyDragSide,
        Role::RotorDrag,
        Role::RotorDragFlow,
        Role::MomentumDrag,
        Role::FaceDragTop,
        Role::FaceDragSide,
        Role::InflowShare,
        Role::WindLift,
        Role::WindLiftSquare,
        Role::ThrustExpo,
        Role::MassSpread,
        Role::ThrustSpread,
        Role::InflowSpread,
        Role::InflowInduced,
        Role::SensorBias,
        Role::SensorLag,
        Role::SensorLogOnly,
        Role::WarmUpTime,
        Role::BatteryCells,
        Role::BatteryCapacity,
        Role::BatteryResistance,
        Role::BatteryCharge,
        Role::BatteryReference,
        Role::BatteryAvionics,
        Role::BatterySag,
        Role::BatteryCompensated,
    ];

    #[test]
    fn one_parameter_has_each_role() {
        let count = |role: Role| {
            let all = LIBRARY.iter().flat_map(|effect| effect.definition().parameters);
            all.filter(|parameter| parameter.role == Some(role)).count()
        };
        for role in ONCE {
            assert_eq!(count(role), 1, "{role:?}");
        }
        let roles = LIBRARY.iter().flat_map(|effect| effect.definition().parameters);
        let held = roles.filter(|parameter| parameter.role.is_some()).count();
        assert_eq!(held, ONCE.len() + count(Role::Spread) + count(Role::Scatter));
    }

    #[test]
    fn what_is_stated_is_known_while_the_effect_is_off() {
        let mut vehicle = crate::vehicle::library::builtin("airsim-generic-quad").unwrap();
        assert_eq!(Role::BatteryCells.stated(&vehicle), None);
        assert_eq!(Role::BatteryCells.stated_or_default(&vehicle), Some(3.0));
        Role::BatteryCells.set(&mut vehicle, 4.0);
        assert!(Role::BatteryCells.is_on(&vehicle));
        assert_eq!(Role::BatteryCells.value(&vehicle), Some(4.0));
        vehicle.effects.values_mut().for_each(|table| table.on = false);
        assert!(!Role::BatteryCells.is_on(&vehicle));
        assert_eq!(Role::BatteryCells.value(&vehicle), None);
        assert_eq!(Role::BatteryCells.stated(&vehicle), Some(4.0));
    }
}
