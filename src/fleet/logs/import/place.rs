//! Whose a log is: by its system id and by where the drone stood.

use nalgebra::Vector3;

use super::ImportFlight;
use crate::base::frame::Geodetic;
use crate::base::time::GpsTime;
use crate::flight::Identity;

/// A log's home is the slot's when it is nearer than this, m (satellite positions are no better).
const NEAR_M: f64 = 2.5;
/// A home this far from the slot of its system id contradicts it, m.
const FAR_M: f64 = 10.0;

/// Why the slot of a log is not known.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum NoSlot {
    /// It was flown somewhere else, or by a drone that is not of this fleet.
    Elsewhere(String),
    /// It contradicts itself.
    Contradiction(String),
}

/// The slot of a flight's plan that a log is of. A log belongs to the slot of its system id. Where ids
/// are missing or were never set (several logs of one flight have the same) its home decides.
pub(super) fn slot_of(
    identity: &Identity,
    flight: &ImportFlight,
    start: Option<GpsTime>,
) -> Result<u16, NoSlot> {
    let plan = &flight.plan;
    let frame = plan.site.frame();
    let home = identity.home(start);
    let distance_m = |slot: u16| {
        let slot = plan.slot(slot)?;
        let there = frame.from_geodetic(Geodetic { amsl_m: frame.origin.amsl_m, ..home? });
        Some((there - Vector3::from(slot.home_m)).xy().norm())
    };
    let mut near: Vec<(f64, u16)> = (plan.slots.iter())
        .filter_map(|slot| Some((distance_m(slot.slot)?, slot.slot)))
        .filter(|(distance, _)| *distance < NEAR_M)
        .collect();
    near.sort_by(|a, b| a.0.total_cmp(&b.0));
    let by_id = identity.system_id.and_then(|system| {
        if flight.slots.is_empty() {
            plan.slot(system.into()).map(|slot| slot.slot)
        } else {
            flight.slots.get(&system).copied()
        }
    });
    let away_m = by_id.and_then(distance_m);
    match (by_id, near.as_slice()) {
        (Some(slot), _) if away_m.is_none_or(|away_m| away_m < NEAR_M) => Ok(slot),
        (Some(slot), [(near_m, near), ..]) => {
            let is_far = away_m.is_some_and(|away_m| away_m > FAR_M);
            if is_far && flight.slots.is_empty() {
                // Ids that were never set: where it stood tells.
                Ok(*near)
            } else {
                Err(NoSlot::Contradiction(format!(
                    "its system id is of slot {slot}, but it stood {near_m:.1} m from the home of slot \
                     {near} and {:.1} m from its own",
                    away_m.unwrap_or(f64::NAN)
                )))
            }
        }
        (Some(slot), []) if away_m.is_some_and(|away_m| away_m > FAR_M) => {
            Err(NoSlot::Elsewhere(format!(
                "its system id is of slot {slot}, but it stood {} from there: it was flown elsewhere",
                metres(away_m.unwrap_or_default())
            )))
        }
        (Some(slot), []) => Ok(slot),
        (None, [(_, only)]) => Ok(*only),
        (None, [(first_m, first), (second_m, second), ..]) => {
            if 2.0 * first_m < *second_m {
                Ok(*first)
            } else {
                Err(NoSlot::Contradiction(format!(
                    "its system id is of no slot, and it stood between slots {first} and {second}"
                )))
            }
        }
        (None, []) => {
            Err(NoSlot::Elsewhere("neither its system id nor its home is in the plan".to_owned()))
        }
    }
}

fn metres(distance_m: f64) -> String {
    if distance_m < 1000.0 {
        format!("{distance_m:.0} m")
    } else {
        format!("{:.1} km", distance_m / 1000.0)
    }
}
