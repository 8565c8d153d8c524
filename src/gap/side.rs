//! The simulated side, flown by the model for each group, and another program's with what a change of the model does in it.

use rayon::prelude::*;

use super::bins::BinValues;
use super::compare::thrust_exponent;
use super::data::Data;
use super::error::GapError;
use super::lean_law::LeanLaw;
use super::refly::refly;
use crate::mission::plan::Plan;
use crate::numeric::mean;
use crate::vehicle::Vehicle;

/// Values of the simulated side by group and bin; `None` where the simulation lacks the bin.
pub(super) type Side = Vec<Vec<Option<BinValues>>>;

/// Shares of the wind that legs tell in which a model is flown if it cannot fly in all of it. Chosen: in 8 m/s they tell it
/// within a twentieth, and a tenth less is no other wind to the pulse.
const SHARES: [f64; 4] = [1.0, 0.97, 0.94, 0.9];

/// Flies the groups of a plan in air whose wind legs tell, show frame, z up, m/s: in all of that wind, or in so much of it
/// that the model can fly there. With the air that was flown in.
///
/// # Errors
/// The model cannot fly in any of these.
pub(super) fn fly_in_told_wind(
    data: &Data,
    vehicle: &Vehicle,
    plan: &Plan,
    [x_mps, y_mps, updraft_mps]: [f64; 3],
) -> Result<([f64; 3], Side), GapError> {
    let mut failed = None;
    for share in SHARES {
        let air_mps = [share * x_mps, share * y_mps, updraft_mps];
        match fly_groups(data, vehicle, plan, air_mps) {
            Ok(side) => return Ok((air_mps, side)),
            // The reason is that of the whole wind.
            Err(error) if error.is_not_flown() => failed = failed.or(Some(error)),
            Err(error) => return Err(error),
        }
    }
    Err(failed.unwrap_or(GapError::NothingCommon))
}

/// Flies the groups of a plan, each with the drone nearest to its middle, in uniform air, show frame, z up, m/s.
///
/// # Errors
/// The model cannot fly there.
pub(super) fn fly_groups(
    data: &Data,
    vehicle: &Vehicle,
    plan: &Plan,
    air_mps: [f64; 3],
) -> Result<Side, GapError> {
    data.groups
        .par_iter()
        .map(|group| {
            let middle = |axis: usize| {
                mean(group.place_m.iter().map(|place| place[axis])).unwrap_or_default()
            };
            let (x, y) = (middle(0), middle(1));
            let apart = |place: &[f64; 2]| (place[0] - x).hypot(place[1] - y);
            let nearest = group.slots.iter().zip(&group.place_m);
            let nearest = nearest.min_by(|a, b| apart(a.1).total_cmp(&apart(b.1)));
            let slot =
                nearest.and_then(|(slot, _)| plan.slot(*slot)).ok_or(GapError::NothingCommon)?;
            let exponent = thrust_exponent(vehicle);
            Ok(refly(vehicle, plan, slot, &group.bins, air_mps, exponent)?)
        })
        .collect()
}

/// Where a model's drone was carried away, the steady lean that it would have had on its course in this air, show frame, m/s:
/// what it lacks of that when it flies back is none of the measured drone's.
pub(super) fn lean_steadily(
    data: &Data,
    side: &mut Side,
    law: LeanLaw,
    [x_mps, y_mps, updraft_mps]: [f64; 3],
) {
    let law = LeanLaw { updraft_mps, ..law };
    for (group, values) in data.groups.iter().zip(side) {
        for (bin, values) in group.bins.iter().zip(values) {
            if let Some(values) = values.as_mut().filter(|values| values.carried_away) {
                let [x, y, climb_mps] = bin.velocity_mps;
                values.lean_rad = law.lean([x - x_mps, y - y_mps], climb_mps);
            }
        }
    }
}

/// Bins of another simulation, with what a change of the model does in this one.
pub(super) fn changed(given: &Side, without: &Side, with: &Side) -> Side {
    let bin = |((given, without), with): (
        (&Option<BinValues>, &Option<BinValues>),
        &Option<BinValues>,
    )| {
        let (given, without, with) = ((*given)?, (*without)?, (*with)?);
        Some(BinValues {
            pulse_us: given.pulse_us + with.pulse_us - without.pulse_us,
            climb_mps: given.climb_mps + with.climb_mps - without.climb_mps,
            ..given
        })
    };
    let groups = given.iter().zip(without).zip(with);
    groups
        .map(|((given, without), with)| given.iter().zip(without).zip(with).map(bin).collect())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::trial;
    use crate::mission::resolve::resolve;
    use crate::vehicle::library::builtin;

    #[test]
    fn a_model_that_cannot_fly_in_the_wind_that_legs_tell_flies_in_a_little_less() {
        let vehicle = builtin("pixel").unwrap();
        let plan = resolve("calibration-counterphase", &[]).unwrap().flights.remove(0).plan;
        let mut data = trial::data(1, |_, _| 0.0);
        let group = &mut data.groups[0];
        group.slots = vec![plan.slots[0].slot];
        group.bins.truncate(2);
        let flies =
            |wind_mps: f64| fly_groups(&data, &vehicle, &plan, [0.0, -wind_mps, 2.0]).is_ok();
        let too_fast =
            (32..80).map(|fourths| 0.25 * f64::from(fourths)).find(|wind_mps| !flies(*wind_mps));
        let too_fast_mps = too_fast.unwrap();
        let air_mps = [0.0, -too_fast_mps, 2.0];
        let (flown_in, side) = fly_in_told_wind(&data, &vehicle, &plan, air_mps).unwrap();
        let share = flown_in[1] / air_mps[1];
        assert!((0.9..0.98).contains(&share) && flown_in[2] == 2.0, "{flown_in:?}");
        // Voltages are no numbers there.
        let there = fly_groups(&data, &vehicle, &plan, flown_in).unwrap();
        assert_eq!(format!("{side:?}"), format!("{there:?}"));
        let whole =
            fly_groups(&data, &vehicle, &plan, [0.0, -1.5 * too_fast_mps, 2.0]).unwrap_err();
        let failed = fly_in_told_wind(&data, &vehicle, &plan, [0.0, -1.5 * too_fast_mps, 2.0]);
        assert_eq!(failed.unwrap_err().to_string(), whole.to_string());
    }
}
