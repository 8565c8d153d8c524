//! Logs without a plan, in groups that were told the same.
//!
//! Half a fleet may fly in counter phase: in the bins of the other half it is another flight.

use super::bins::{Bin, cut};
use super::data::Flown;
use super::flights;
use crate::analysis::steps::steady;
use crate::analysis::windows::inferred;
use crate::flight::Flight;
use crate::flight::table::Steps;

/// A command this near to a bin's is the same, m/s: firmware adds corrections of its own, and rungs are 0.5 m/s apart.
const SAME_COMMAND_MPS: f64 = 0.1;
/// A log was told the same as another if it has the commands of this share of its bins: a drone that is late or misses
/// its last rungs is no group of its own. Chosen.
const SAME_SHARE: f64 = 0.8;
/// A log's command is in force for this long, s: some have it once a second.
const IN_FORCE_S: f64 = 1.5;

/// Logs that were told the same in one flight.
#[derive(Debug, Default)]
pub(super) struct Group<'a, 'b> {
    /// Steady bins that they have in common.
    pub(super) bins: Vec<Bin>,
    /// The logs.
    pub(super) members: Vec<&'a Flown<'b>>,
    /// Which flight it was, counted from 0.
    pub(super) flight: usize,
}

/// The groups of logs that were told the same, flight by flight.
pub(super) fn groups<'a, 'b>(flown: &'a [Flown<'b>], steps: Option<&Steps>) -> Vec<Group<'a, 'b>> {
    let flights = flights::of(flown);
    let last = flights.iter().copied().max().unwrap_or(0);
    let of_flight = |flight: usize| {
        let own = flown.iter().zip(&flights).filter(move |(_, own)| **own == flight);
        let groups = groups_of_flight(own.map(|(one, _)| one), steps);
        groups.into_iter().map(move |(bins, members)| Group { bins, members, flight })
    };
    (0..=last).flat_map(of_flight).collect()
}

/// The bins of each group of logs of a flight that were told the same, and its logs.
///
/// A few logs that were told otherwise than the others are drones that went home early, no group: they stay with the
/// largest one, which says what they lack.
fn groups_of_flight<'a, 'b: 'a>(
    flown: impl Iterator<Item = &'a Flown<'b>>,
    steps: Option<&Steps>,
) -> Vec<(Vec<Bin>, Vec<&'a Flown<'b>>)> {
    let mut groups: Vec<(Vec<Bin>, Vec<&Flown<'_>>)> = Vec::new();
    let mut others = Vec::new();
    for one in flown {
        let is_told_as = |bins: &[Bin]| share_told(one.flight, bins).is_none_or(is_same);
        if let Some((_, members)) = groups.iter_mut().find(|(bins, _)| is_told_as(bins)) {
            members.push(one);
            continue;
        }
        match bins_of(one.flight, steps) {
            bins if bins.is_empty() => others.push(one),
            bins => groups.push((bins, vec![one])),
        }
    }
    let largest = groups.iter().map(|(_, members)| members.len()).max().unwrap_or(0);
    let (mut kept, few): (Vec<_>, Vec<_>) =
        groups.into_iter().partition(|(_, members)| 2 * members.len() > largest);
    others.extend(few.into_iter().flat_map(|(_, members)| members));
    if kept.is_empty() {
        kept.push(Default::default());
    }
    let home = kept.iter().position(|(_, members)| members.len() == largest).unwrap_or(0);
    kept[home].1.extend(others);
    kept[home].1.sort_by_key(|one| one.slot);
    kept
}

fn is_same(share: f64) -> bool {
    share >= SAME_SHARE
}

/// The share of bins whose command a log has; `None`: it has no commands.
fn share_told(flight: &Flight, bins: &[Bin]) -> Option<f64> {
    let told = flight.desired_up_mps.as_ref()?;
    let is_told = |bin: &&Bin| {
        let up_mps = told.latest(bin.middle_s(), IN_FORCE_S);
        up_mps.is_some_and(|up_mps| (up_mps - bin.climb_mps()).abs() < SAME_COMMAND_MPS)
    };
    Some(bins.iter().filter(is_told).count() as f64 / bins.len().max(1) as f64)
}

/// Bins of a log by its own commands, or, of a table that has none, by its velocity.
fn bins_of(flight: &Flight, steps: Option<&Steps>) -> Vec<Bin> {
    let targets = match steps {
        Some(steps) if flight.desired_up_mps.is_none() => steady(flight, steps),
        _ => inferred(flight),
    };
    let pieces = targets.iter().enumerate().flat_map(|(index, target)| {
        let velocity = [0.0, 0.0, target.commanded_mps];
        cut(target.kind, target.start_s, target.end_s, velocity, index)
    });
    pieces.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::Series;

    /// A flight that was told these vertical velocities, m/s, for 20 s each.
    fn told(speeds: &[f64]) -> Flight {
        let time_s: Vec<f64> = (0..200 * speeds.len()).map(|tick| 0.1 * tick as f64).collect();
        let value = time_s.iter().map(|time| speeds[(time / 20.0) as usize]).collect();
        Flight { desired_up_mps: Some(Series { time_s, value }), ..Flight::default() }
    }

    /// The slots of each group.
    fn slots(flights: &[Flight]) -> Vec<Vec<u16>> {
        let flown: Vec<Flown<'_>> =
            flights.iter().zip(1..).map(|(flight, slot)| Flown { slot, flight }).collect();
        let groups = groups(&flown, None);
        groups.iter().map(|group| group.members.iter().map(|one| one.slot).collect()).collect()
    }

    const UP: [f64; 6] = [0.0, 1.0, -1.0, 0.0, 2.0, -2.0];
    const DOWN: [f64; 6] = [0.0, -1.0, 1.0, 0.0, -2.0, 2.0];

    #[test]
    fn halves_in_counter_phase_are_two_groups() {
        let flights = [told(&UP), told(&DOWN), told(&UP), told(&DOWN)];
        assert_eq!(slots(&flights), [[1, 3], [2, 4]]);
        assert_eq!(slots(&[told(&UP), told(&UP)]), [[1, 2]]);
    }

    #[test]
    fn who_went_home_early_is_no_group() {
        let early = told(&[0.0, 1.0, -0.5, -0.5, 0.0, 0.0]);
        let flights = [told(&UP), early, told(&UP), told(&UP)];
        assert_eq!(slots(&flights), [[1, 2, 3, 4]]);
        let without_commands = Flight::default();
        assert_eq!(slots(&[told(&UP), without_commands, told(&UP)]), [[1, 2, 3]]);
        assert_eq!(slots(&[Flight::default()]), [[1]]);
    }
}
