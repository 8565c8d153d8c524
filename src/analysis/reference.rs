//! A drone's laws in a reference calibration.

use super::fitted::Laws;
use super::kind::LawOf;
use super::result::{DroneAnalysis, FlightAnalysis};
use super::window::WindowStats;

/// A drone in a reference calibration: of the same slot, else of the same name. A log without a plan that is named as
/// those of a slot are (`07.BIN`) is of this slot; `00000007.BIN` is an autopilot's count.
pub(super) fn same_drone<'a>(
    reference: &'a FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Option<&'a DroneAnalysis> {
    let same = |drone: &&DroneAnalysis| match (slot, drone.slot) {
        (Some(slot), Some(other)) => slot == other,
        (None, Some(other)) => drone.name == name || name == format!("{other:02}"),
        _ => drone.name == name,
    };
    reference.drones.iter().find(same)
}

/// The laws of a drone in a reference calibration, and its windows there: its own, else the flock's
/// with those of the first drone. A law of a part of the ladder stands only where there is no flock's.
pub(super) fn laws_for<'a>(
    reference: &'a FlightAnalysis,
    slot: Option<u16>,
    name: &str,
) -> Option<(&'a Laws, LawOf, &'a [WindowStats])> {
    let whole = |drone: &DroneAnalysis| drone.partial_ladder.is_none() || reference.flock.is_none();
    let own = same_drone(reference, slot, name).filter(|drone| whole(drone));
    if let Some((drone, laws)) = own.and_then(|drone| Some((drone, drone.laws.as_ref()?))) {
        return Some((laws, LawOf::Own, &drone.windows));
    }
    let first = reference.drones.iter().find(|drone| drone.laws.is_some() && whole(drone));
    Some((reference.flock.as_ref()?, LawOf::Flock, first.map_or(&[][..], |drone| &drone.windows)))
}
