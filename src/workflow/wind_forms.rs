//! Effect of wind on a vehicle by its file: the trim of its physics, and of other sizes and forms of it.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::analysis::wind_forms::{Response, WindForms};
use crate::base::air::density_ratio;
use crate::effects::select::without;
use crate::effects::{Role, Signal};
use crate::sim::plant::trim::{Condition, Trim};
use crate::vehicle::{SitlFrame, Vehicle};

/// Step of the wind, m/s. Numerical: the pulse is a parabola in it, of which a straight piece is 0.04 us off.
const WIND_STEP_MPS: f64 = 0.5;
/// Strongest wind, m/s: a leg of 8 m/s into 8 m/s.
const STRONGEST_MPS: f64 = 16.0;
/// Least wind that a vehicle must bear for its lean to tell one, m/s.
const LEAST_WIND_MPS: f64 = 4.0;
/// Climbs through the air: -6 to +6 m/s.
const CLIMBS: usize = 13;
const FIRST_CLIMB_MPS: f64 = -6.0;
const CLIMB_STEP_MPS: f64 = 1.0;

/// Standard error of the rotors' drag, relative: small rotors lean by 0.6 to 1.7 degrees per m/s (docs/physics.md,
/// 2.6), and what a file states is one of them, or a fit in which body and rotors share as they like.
const ROTOR_DRAG: f64 = 0.45;
/// Standard error of the body's drag area from the side, relative: Hoerner's coefficients of plates and boxes are 0.8
/// to 1.3, and the area that the arms and rotors add is not well defined. Chosen.
const SIDE_DRAG: f64 = 0.4;
/// Standard error of its area from above, relative: a ladder tells it. Chosen.
const TOP_DRAG: f64 = 0.3;
/// Standard error of the lift that rotors gain in wind, as one of the share lost to the inflow, relative. Blades of 5
/// and 6 inches have 0.4 to 0.6 of it (docs/physics.md, 2.3).
const LIFT: f64 = 0.2;
/// Part of the lift that goes with the square of the speed where the file has none: thrust of advancing blades less
/// their profile power makes about a tenth (Leishman, ch. 5).
const LIFT_SQUARE: f64 = 0.1;
/// Part of the rotors' drag that goes with the flow through the disc where the file has none: half of it. Blade
/// elements have more, a fit of a file to flights in one wind none.
const DRAG_WITH_FLOW: f64 = 0.5;
/// Share of the lost inflow that wind may give back to a vehicle whose file has no lift: half of what is usual.
const UNSTATED_LIFT: f64 = 0.25;
/// Standard error of the lean of the reference flight of ArduPilot's own frame, degrees: it was flown, not computed.
const SITL_LEAN_DEG: f64 = 2.0;
/// And of the share of momentum drag in it, relative. Chosen.
const SITL_MOMENTUM: f64 = 0.3;

/// What wind does to the lean and the pulse of a vehicle, and what is doubted about it; `None` for vehicles without
/// drag of the rotors, whose lean says little, and those that no wind leaves in balance.
pub(crate) fn wind_forms(ground_amsl_m: f64, vehicle: &Vehicle) -> Option<WindForms> {
    let is_known = |role: Role| role.value(vehicle).is_some_and(|drag| drag > 0.0);
    let has_drag = is_known(Role::RotorDrag) || is_known(Role::MomentumDrag);
    if !(has_drag || vehicle.airframe.sitl.is_some()) {
        return None;
    }
    let ratio = density_ratio(ground_amsl_m);
    // The voltage is corrected for on its own.
    let vehicle = without(vehicle, Signal::ChargeUsed);
    let doubts = doubted(&vehicle);
    let others: Vec<&Vehicle> = doubts.iter().flat_map(|doubt| &doubt.vehicles).collect();
    let all: Vec<&Vehicle> = std::iter::once(&vehicle).chain(others).collect();
    let responses: Vec<Option<(Response, Vec<f64>)>> =
        all.par_iter().map(|vehicle| response(ratio, vehicle)).collect();
    let mut responses = responses.into_iter();
    let (file, calm_us) = responses.next()??;
    let mut responses = responses.map(|found| Some(found?.0));
    let mut moved = Vec::new();
    for doubt in &doubts {
        let found: Vec<Option<Response>> = responses.by_ref().take(doubt.vehicles.len()).collect();
        if let Some(found) = found.into_iter().collect::<Option<Vec<Response>>>() {
            moved.push((found, doubt.weights.clone()));
        }
    }
    let doubts: Vec<Response> =
        moved.into_iter().map(|(found, weights)| difference(&file, &found, &weights)).collect();
    // Where the file's vehicle finds no balance, the map has no climb.
    let flies = |climb: usize| !file.lean[climb].is_empty();
    let level = (-FIRST_CLIMB_MPS / CLIMB_STEP_MPS).round() as usize;
    if !flies(level) {
        return None;
    }
    let first = (0..=level).rev().take_while(|climb| flies(*climb)).last().unwrap_or(level);
    let end = (level..CLIMBS).take_while(|climb| flies(*climb)).last().unwrap_or(level) + 1;
    let kept = |response: Response| Response {
        lean: response.lean[first..end].to_vec(),
        change_us: response.change_us[first..end].to_vec(),
    };
    Some(WindForms {
        wind_step_mps: WIND_STEP_MPS,
        first_climb_mps: FIRST_CLIMB_MPS + first as f64 * CLIMB_STEP_MPS,
        climb_step_mps: CLIMB_STEP_MPS,
        calm_us: calm_us[first..end].to_vec(),
        file: kept(file),
        doubts: doubts.into_iter().map(kept).collect(),
    })
}

/// One thing that is doubted: vehicles that have more or less of it, and by what their differences from the file's
/// make up one standard error.
struct Doubted {
    vehicles: Vec<Vehicle>,
    weights: Vec<f64>,
}

fn doubted(vehicle: &Vehicle) -> Vec<Doubted> {
    let with = |role: Role, value: f64| {
        let mut other = vehicle.clone();
        role.set(&mut other, value);
        other
    };
    let about = |role: Role, share: f64| {
        let value = role.value(vehicle).filter(|value| *value > 0.0)?;
        let vehicles = vec![with(role, value * (1.0 + share)), with(role, value * (1.0 - share))];
        Some(Doubted { vehicles, weights: vec![0.5, -0.5] })
    };
    // What cannot be less than nothing.
    let more = |role: Role, value: f64| Doubted {
        vehicles: vec![with(role, role.value(vehicle).unwrap_or(0.0) + value)],
        weights: vec![1.0],
    };
    if let Some(frame) = &vehicle.airframe.sitl {
        let frames = |change: &dyn Fn(&mut SitlFrame, f64)| {
            let other = |sign: f64| {
                let (mut other, mut frame) = (vehicle.clone(), *frame);
                change(&mut frame, sign);
                other.airframe.sitl = Some(frame);
                other
            };
            Doubted { vehicles: vec![other(1.0), other(-1.0)], weights: vec![0.5, -0.5] }
        };
        return vec![
            frames(&|frame, sign| frame.reference_lean_deg += sign * SITL_LEAN_DEG),
            frames(&|frame, sign| frame.momentum_drag *= 1.0 + sign * SITL_MOMENTUM),
        ];
    }
    let mut doubts: Vec<Doubted> = [
        about(Role::RotorDrag, ROTOR_DRAG),
        about(Role::MomentumDrag, ROTOR_DRAG),
        about(Role::BodyDragSide, SIDE_DRAG),
        about(Role::BodyDragTop, TOP_DRAG),
        about(Role::WindLift, LIFT),
    ]
    .into_iter()
    .flatten()
    .collect();
    match Role::WindLift.value(vehicle).zip(Role::WindLiftSquare.value(vehicle)) {
        Some(_) => doubts.push(more(Role::WindLiftSquare, LIFT_SQUARE)),
        None => doubts.push(more(Role::WindLift, UNSTATED_LIFT)),
    }
    if let Some(part) = Role::RotorDragFlow.value(vehicle) {
        let other = if part + DRAG_WITH_FLOW <= 1.0 { DRAG_WITH_FLOW } else { -DRAG_WITH_FLOW };
        doubts.push(more(Role::RotorDragFlow, other));
    }
    doubts
}

/// Lean and change of the pulse in all winds, and the pulses without wind, us, by climb. Climbs without balance in calm
/// air or in [`LEAST_WIND_MPS`] are empty.
fn response(density_ratio: f64, vehicle: &Vehicle) -> Option<(Response, Vec<f64>)> {
    let mut trim = Trim::of(vehicle).ok()?;
    let (mut found, mut calm) = (Response::default(), Vec::new());
    for climb in 0..CLIMBS {
        let climb_mps = FIRST_CLIMB_MPS + climb as f64 * CLIMB_STEP_MPS;
        let mut at = |wind_mps: f64| {
            let velocity_mps = Vector3::new(wind_mps, 0.0, climb_mps);
            trim.at(&Condition { velocity_mps, density_ratio, ..Condition::default() })
        };
        let calm_us = at(0.0).map(|steady| steady.pulse_us);
        let steps = 0..=(STRONGEST_MPS / WIND_STEP_MPS) as usize;
        let in_winds: Vec<Option<[f64; 2]>> = steps
            .map(|step| {
                let steady = at(step as f64 * WIND_STEP_MPS)?;
                let sine = steady.lean.norm();
                let tangent = sine / (1.0 - sine * sine).sqrt();
                Some([if step == 0 { 0.0 } else { tangent }, steady.pulse_us - calm_us?])
            })
            .collect();
        let rows = filled(&in_winds).unwrap_or_default();
        found.lean.push(rows.iter().map(|[lean, _]| *lean).collect());
        found.change_us.push(rows.iter().map(|[_, change_us]| *change_us).collect());
        calm.push(calm_us.unwrap_or_default());
    }
    Some((found, calm))
}

/// A row without holes: between neighbours by a line, behind the last one on from the last two. `None` where too little
/// is there.
fn filled(row: &[Option<[f64; 2]>]) -> Option<Vec<[f64; 2]>> {
    let known: Vec<(usize, [f64; 2])> =
        row.iter().enumerate().filter_map(|(index, value)| Some((index, (*value)?))).collect();
    let (first, last) = (known.first()?.0, known.last()?.0);
    if first > 0 || (last as f64) * WIND_STEP_MPS < LEAST_WIND_MPS || known.len() < 2 {
        return None;
    }
    let at = |index: usize| {
        let above = known.partition_point(|(place, _)| *place < index).clamp(1, known.len() - 1);
        let ((low, from), (high, to)) = (known[above - 1], known[above]);
        let share = (index as f64 - low as f64) / (high as f64 - low as f64);
        std::array::from_fn(|part| from[part] + (to[part] - from[part]) * share)
    };
    Some((0..row.len()).map(at).collect())
}

/// What a weighed sum of other responses adds to one.
fn difference(file: &Response, others: &[Response], weights: &[f64]) -> Response {
    let part = |of: fn(&Response) -> &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
        let cell = |row: usize, column: usize, value: f64| {
            let off =
                |(other, weight): (&Response, &f64)| weight * (of(other)[row][column] - value);
            others.iter().zip(weights).map(off).sum()
        };
        let row = |(row, values): (usize, &Vec<f64>)| {
            values.iter().enumerate().map(|(column, value)| cell(row, column, *value)).collect()
        };
        of(file).iter().enumerate().map(row).collect()
    };
    Response { lean: part(|one| &one.lean), change_us: part(|one| &one.change_us) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::library::builtin;

    /// Place of the hover among the climbs.
    fn hover(forms: &WindForms) -> usize {
        (-forms.first_climb_mps / forms.climb_step_mps).round() as usize
    }

    #[test]
    fn a_show_drone_leans_and_lifts_in_wind_and_a_box_says_little() {
        let forms = wind_forms(190.0, &builtin("pixel").unwrap()).unwrap();
        assert_eq!(forms.doubts.len(), 6);
        let (hover, eight) = (hover(&forms), 16);
        assert!((0.2..0.35).contains(&forms.file.lean[hover][eight]));
        let change_us = forms.file.change_us[hover][eight];
        // The simulator's own hover in 8 m/s leans by 0.263 rad, and its pulse is 1.6 us less than without wind.
        assert!((-4.0..0.0).contains(&change_us), "{change_us}");
        for doubt in &forms.doubts {
            assert_eq!((doubt.lean[hover][0], doubt.change_us[hover][0]), (0.0, 0.0), "no wind");
            let moved =
                doubt.lean[hover][eight].abs() * 100.0 + doubt.change_us[hover][eight].abs();
            assert!(moved > 0.2, "{moved}");
        }
        assert!(wind_forms(190.0, &builtin("airsim-generic-quad").unwrap()).is_none());
    }

    #[test]
    fn the_firmwares_own_frame_leans_far_and_is_known() {
        let forms = wind_forms(584.0, &builtin("arducopter-sitl").unwrap()).unwrap();
        assert_eq!(forms.doubts.len(), 2);
        let lean = forms.file.lean[hover(&forms)][10];
        assert!((0.2..0.5).contains(&lean), "{lean}");
    }
}
