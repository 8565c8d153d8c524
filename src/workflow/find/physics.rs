//! Physics of the vehicle that flew, as far as the analysis needs it: the pulse by density, thrust
//! and voltage.

use std::path::Path;

use crate::analysis::battery::Sag;
use crate::analysis::density::Density;
use crate::effects::Signal;
use crate::effects::select::looks_at;
use crate::flight::Indicator;
use crate::log::{Log, Select};
use crate::mission::Plan;
use crate::sim::recorder::FIRMWARE_MARK;
use crate::vehicle::Vehicle;

/// Exponent of density for electric rotors with a real thrust curve.
const REAL_ROTOR_EXPONENT: f64 = 0.4;

/// 1 for vehicles whose thrust is linear in the pulse; for others nothing is known better than what
/// the analysis takes itself.
pub(super) fn linear_thrust(vehicle: &Vehicle) -> Option<f64> {
    (vehicle.autopilot.mot_thst_expo == 0.0).then_some(1.0)
}

/// How the map is corrected for air density: by the thrust curve that the vehicle's autopilot is set
/// for (none: linear thrust).
pub(super) fn density(plan: &Plan, vehicle: Option<&Vehicle>) -> Density {
    let linear = vehicle.is_some_and(|vehicle| vehicle.autopilot.mot_thst_expo == 0.0);
    Density {
        ground_amsl_m: plan.site.ground_amsl_m,
        exponent: if linear { 1.0 } else { REAL_ROTOR_EXPONENT },
        indicator: Indicator::Pulse,
    }
}

/// How the battery acts on the pulse. Simulated drones without a battery in their physics log one
/// that does nothing, virtual ones that flew for a crew as well; real ones have one that does.
pub(crate) fn sag(is_simulated: &dyn Fn() -> bool, vehicle: Option<&Vehicle>) -> Option<Sag> {
    let has_battery = vehicle.is_some_and(|vehicle| looks_at(vehicle, Signal::ChargeUsed));
    let by_firmware = vehicle.is_some_and(|vehicle| vehicle.airframe.sitl.is_some());
    let sag = if by_firmware { Sag::SIMULATOR } else { Sag::default() };
    (has_battery || !is_simulated()).then_some(sag)
}

/// Whether a log is of our own simulator's firmware, by what it says of itself; `None` if it does not say.
pub(crate) fn is_of_simulator(path: &Path) -> Option<bool> {
    let log = Log::open(path).ok()?;
    let (tables, _) = log.select(&[Select { message: "MSG", fields: &["Message"] }]);
    let mut texts = tables.iter().filter_map(|table| table.text("Message")).flatten().peekable();
    texts.peek()?;
    Some(texts.any(|text| text.contains(FIRMWARE_MARK)))
}
