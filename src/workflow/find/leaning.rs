//! Lean of simulated drones in wind, from the vehicle that was flown.

use crate::analysis::lean_table::LeanTable;
use crate::analysis::response::Response;
use crate::analysis::wind::Leaning;
use crate::base::air::{SEA_LEVEL_DENSITY, density_ratio};
use crate::base::digest::sha256;
use crate::campaign::FlightRecord;
use crate::effects::select::without;
use crate::effects::{Model, Role, Signal, Signals};
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

/// Leans of the table: up to 20 degrees.
const LEANS: usize = 41;
const LEAN_STEP_DEG: f64 = 0.5;
/// Vertical air speeds of the table: -6 to +6 m/s.
const CLIMBS: usize = 25;
const FIRST_CLIMB_MPS: f64 = -6.0;
const CLIMB_STEP_MPS: f64 = 0.5;
/// Fastest wind that a lean is explained with, m/s.
const FASTEST_WIND_MPS: f64 = 40.0;

/// Standard error of the drag that tells the wind from the lean, relative.
const DRAG_ERROR: f64 = 0.075;
/// Standard error of the lift that rotors gain in wind, as one of the share lost to the inflow, relative.
const LIFT_ERROR: f64 = 0.07;

/// What wind does to the pulse of a vehicle by its lean, from the vehicle's own effects (rotor drag,
/// body drag, translational lift); `None` for vehicles without rotor drag, whose lean says little.
pub(super) fn lean_table(plan: &Plan, vehicle: &Vehicle) -> Option<LeanTable> {
    let ratio = density_ratio(plan.site.ground_amsl_m);
    let (change_us, wind_mps) = changes(ratio, vehicle)?;
    let other = |role: Role, error: f64| {
        let mut vehicle = vehicle.clone();
        let value = role.value(&vehicle)? * (1.0 + error);
        role.set(&mut vehicle, value);
        changes(ratio, &vehicle).map(|(change_us, _)| change_us)
    };
    let others: Vec<Vec<Vec<f64>>> =
        [other(Role::RotorDrag, DRAG_ERROR), other(Role::WindLift, LIFT_ERROR)]
            .into_iter()
            .flatten()
            .collect();
    let at = |table: &[Vec<f64>], row: usize, column: usize| {
        table.get(row).and_then(|row| row.get(column)).copied().unwrap_or(0.0)
    };
    let doubt = |row: usize, column: usize| {
        let middle = at(&change_us, row, column);
        others.iter().fold(0.0, |sum: f64, other| sum.hypot(at(other, row, column) - middle))
    };
    let doubt_us =
        (0..LEANS).map(|row| (0..CLIMBS).map(|column| doubt(row, column)).collect()).collect();
    Some(LeanTable {
        indicator: Indicator::Pulse,
        lean_step_deg: LEAN_STEP_DEG,
        first_climb_mps: FIRST_CLIMB_MPS,
        climb_step_mps: CLIMB_STEP_MPS,
        change_us,
        wind_mps,
        doubt_us,
    })
}

/// What wind does to another indicator than the pulse by the lean, from the vehicle's response.
pub(super) fn lean_table_of(response: &Response, indicator: Indicator) -> LeanTable {
    let change = |of: &Response, row: usize, column: usize| {
        let climb_mps = FIRST_CLIMB_MPS + column as f64 * CLIMB_STEP_MPS;
        let wind_mps = of.wind_mps(row as f64 * LEAN_STEP_DEG);
        let change = of.effort(wind_mps, climb_mps).zip(of.effort(0.0, climb_mps));
        // No steady flight there, and nothing measures there.
        change.map_or(0.0, |(windy, calm)| windy - calm)
    };
    let doubt = |row: usize, column: usize| {
        let known = change(response, row, column);
        let others = response.doubts.iter().map(|other| change(other, row, column) - known);
        others.fold(0.0, f64::hypot)
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
        doubt_us: table(&doubt),
    }
}

/// Change of the pulse by wind, for each lean and vertical air speed of the table, us, and the wind of
/// each lean, m/s.
fn changes(ratio: f64, vehicle: &Vehicle) -> Option<(Vec<Vec<f64>>, Vec<f64>)> {
    let rotor_drag = Role::RotorDrag.value(vehicle).filter(|drag| *drag > 0.0)?;
    let body_m2 = Role::BodyDragSide.value(vehicle).unwrap_or(0.0);
    // The voltage is corrected for on its own.
    let model = Model::of(&without(vehicle, Signal::ChargeUsed)).ok()?;
    let body = SEA_LEVEL_DENSITY * ratio * body_m2 / 2.0 / (vehicle.airframe.mass_kg * GRAVITY);
    let lean = |wind_mps: f64| {
        let mut phi: f64 = 0.0;
        for _ in 0..8 {
            phi = (rotor_drag * wind_mps * phi.cos().sqrt() + body * wind_mps * wind_mps).atan();
        }
        phi
    };
    let wind = |tilt_rad: f64| {
        let (mut low, mut high) = (0.0, FASTEST_WIND_MPS);
        for _ in 0..50 {
            let middle = f64::midpoint(low, high);
            if lean(middle) < tilt_rad { low = middle } else { high = middle }
        }
        high
    };
    let change = |tilt_rad: f64, climb_mps: f64| {
        let calm = Signals { climb_mps, density_ratio: ratio, ..Signals::default() };
        let windy = Signals { horizontal_mps: wind(tilt_rad), tilt_rad, ..calm };
        model.pulse_us(&windy) - model.pulse_us(&calm)
    };
    let row = |index: usize| {
        let tilt_rad = (index as f64 * LEAN_STEP_DEG).to_radians();
        let climbs = (0..CLIMBS).map(|step| FIRST_CLIMB_MPS + step as f64 * CLIMB_STEP_MPS);
        climbs.map(|climb| if index == 0 { 0.0 } else { change(tilt_rad, climb) }).collect()
    };
    let of_lean = |index: usize| wind((index as f64 * LEAN_STEP_DEG).to_radians());
    let winds = (0..LEANS).map(|index| if index == 0 { 0.0 } else { of_lean(index) }).collect();
    Some(((0..LEANS).map(row).collect(), winds))
}
