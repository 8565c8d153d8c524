//! Slot of a log, by its system id and by where the drone stood.

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

/// The slot of a flight's plan that a log is of: by the campaign's table of drones, which the place must
/// not contradict; without a table by the place where it stood, as ids may be set in any order or never.
pub(super) fn slot_of(
    identity: &Identity,
    flight: &ImportFlight,
    start: Option<GpsTime>,
) -> Result<u16, NoSlot> {
    let plan = &flight.plan;
    let has_table = !flight.slots.is_empty();
    let by_id = identity.system_id.and_then(|system| {
        if has_table {
            flight.slots.get(&system).copied()
        } else {
            plan.slot(system.into()).map(|slot| slot.slot)
        }
    });
    let Some(home) = identity.home(start) else {
        let nowhere = "its system id belongs to no slot, and it does not say where it stood";
        return by_id.ok_or_else(|| NoSlot::Elsewhere(nowhere.to_owned()));
    };
    let frame = plan.site.frame();
    let there = frame.from_geodetic(Geodetic { amsl_m: frame.origin.amsl_m, ..home });
    let mut slots: Vec<(f64, u16)> = (plan.slots.iter())
        .map(|slot| ((there - Vector3::from(slot.home_m)).xy().norm(), slot.slot))
        .collect();
    slots.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some((near_m, near)) = slots.first().copied() else {
        return Err(NoSlot::Elsewhere("the plan has no slots".to_owned()));
    };
    let is_clear = near_m < NEAR_M && slots.get(1).is_none_or(|(next_m, _)| 2.0 * near_m < *next_m);
    let own_m = by_id.and_then(|own| slots.iter().find(|(_, slot)| *slot == own));
    match (by_id, own_m.map(|(own_m, _)| *own_m)) {
        (Some(own), _) if own == near && near_m <= FAR_M => Ok(own),
        (_, _) if is_clear && !has_table => Ok(near),
        (None, _) if is_clear => Ok(near),
        (Some(own), Some(own_m)) if is_clear => Err(NoSlot::Contradiction(format!(
            "its system id belongs to slot {own}, but it stood {near_m:.1} m from the home of \
             slot {near} and {own_m:.1} m from its own"
        ))),
        (Some(own), Some(own_m)) if own_m <= FAR_M => Ok(own),
        (Some(own), Some(own_m)) => Err(NoSlot::Elsewhere(format!(
            "its system id belongs to slot {own}, but it stood {} from there: it was flown \
             elsewhere",
            metres(own_m)
        ))),
        (_, _) if near_m < FAR_M => Err(NoSlot::Contradiction(format!(
            "its system id belongs to no slot, and it stood {near_m:.1} m from the home of slot \
             {near}, the nearest"
        ))),
        (_, _) => {
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
