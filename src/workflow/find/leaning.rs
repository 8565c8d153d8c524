//! Lean of simulated drones in wind, from the vehicle that was flown.

use crate::analysis::wind::Leaning;
use crate::base::air::{SEA_LEVEL_DENSITY, density_ratio};
use crate::base::digest::sha256;
use crate::campaign::FlightRecord;
use crate::mission::Plan;
use crate::sim::plant::GRAVITY;
use crate::sim::plant::drag::Drag;
use crate::vehicle::Vehicle;

/// How the simulated vehicle leans in wind, where its drag is that of its box alone: neither
/// effects nor another airframe model shape it, and it is the vehicle that was flown.
pub(super) fn leaning(plan: &Plan, record: &FlightRecord, vehicle: &Vehicle) -> Option<Leaning> {
    let text = toml::to_string(vehicle).ok()?;
    let known = sha256(text.as_bytes()) == record.vehicle_sha256
        && vehicle.airframe.sitl.is_none()
        && vehicle.autopilot.mot_thst_expo == 0.0
        && !vehicle.effects.values().any(|effect| effect.on);
    let factor = Drag::new(&vehicle.airframe).factor_m2();
    let density = SEA_LEVEL_DENSITY * density_ratio(plan.site.ground_amsl_m);
    let per_square = density * (factor.x * factor.y).sqrt();
    (known && per_square > 0.0).then(|| Leaning {
        thrust_exponent: 1.0,
        drag_speed_mps: (vehicle.airframe.mass_kg * GRAVITY / per_square).sqrt(),
    })
}
