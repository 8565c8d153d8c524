//! Lean of simulated drones in wind, from the vehicle that was flown.

use crate::analysis::lean_table::LeanTable;
use crate::analysis::response::Response;
use crate::analysis::wind::Leaning;
use crate::base::air::{SEA_LEVEL_DENSITY, density_ratio};
use crate::base::digest::sha256;
use crate::campaign::FlightRecord;
use crate::effects::Role;
use crate::flight::Indicator;
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

/// Whether the file has drag of the rotors: without it, a lean says little of the wind.
pub(super) fn leans_by_rotors(vehicle: &Vehicle) -> bool {
    Role::RotorDrag.value(vehicle).is_some_and(|drag| drag > 0.0)
}

/// Leans of the table: up to 20 degrees.
const LEANS: usize = 41;
const LEAN_STEP_DEG: f64 = 0.5;
/// Vertical air speeds of the table: -6 to +6 m/s.
const CLIMBS: usize = 25;
const FIRST_CLIMB_MPS: f64 = -6.0;
const CLIMB_STEP_MPS: f64 = 0.5;

/// What wind does to another indicator than the pulse by the lean, from the vehicle's response.
pub(super) fn lean_table_of(response: &Response, indicator: Indicator) -> LeanTable {
    let change = |of: &Response, row: usize, column: usize| {
        let climb_mps = FIRST_CLIMB_MPS + column as f64 * CLIMB_STEP_MPS;
        let wind_mps = of.wind_mps(row as f64 * LEAN_STEP_DEG);
        let change = of.effort(wind_mps, climb_mps).zip(of.effort(0.0, climb_mps));
        // No steady flight there, and nothing measures there.
        change.map_or(0.0, |(windy, calm)| windy - calm)
    };
    let doubt = |of: &Response, row: usize, column: usize| {
        change(of, row, column) - change(response, row, column)
    };
    let table = |of: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
        (0..LEANS).map(|row| (0..CLIMBS).map(|column| of(row, column)).collect()).collect()
    };
    LeanTable {
        indicator,
        lean_step_deg: LEAN_STEP_DEG,
        first_climb_mps: FIRST_CLIMB_MPS,
        climb_step_mps: CLIMB_STEP_MPS,
        change_us: table(&|row, column| change(response, row, column)),
        wind_mps: (0..LEANS).map(|row| response.wind_mps(row as f64 * LEAN_STEP_DEG)).collect(),
        doubts_us: (response.doubts.iter())
            .map(|other| table(&|row, column| doubt(other, row, column)))
            .collect(),
    }
}
