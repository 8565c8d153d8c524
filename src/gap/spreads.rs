//! How the drones of a vehicle differ by the model, and what that does to their pulses.

use super::compare::{Comparison, LEAST_DOUBT_US};
use super::data::Group;
use super::gls::Column;
use super::scene::Scene;
use crate::effects::{EffectError, Role, find, select};
use crate::numeric::{mean, rms};
use crate::vehicle::Vehicle;

/// Spread of the inflow between the drones of a usual fleet, relative: by how much the responses of the paper's fleet differ (Table II).
const USUAL_INFLOW_SPREAD: f64 = 0.055;

/// Something in which a vehicle's drones differ.
#[derive(Clone, Debug)]
pub(super) struct Spread {
    effect: String,
    parameter: &'static str,
    /// Standard deviation, in the parameter's unit.
    size: f64,
}

impl Spread {
    /// Every way in which a vehicle's drones differ.
    pub(super) fn all_of(vehicle: &Vehicle) -> Vec<Self> {
        let mut found = Vec::new();
        for (name, table) in vehicle.effects.iter().filter(|(_, table)| table.on) {
            let parameters =
                find(name).into_iter().flat_map(|effect| effect.definition().parameters);
            for spread in parameters.filter(|one| one.role.is_some_and(Role::is_spread)) {
                let size = table.parameters.get(spread.name).copied();
                let size = size.unwrap_or_else(|| (spread.default)(vehicle));
                if size > 0.0 {
                    found.push(Self { effect: name.clone(), parameter: spread.name, size });
                }
            }
        }
        found
    }

    /// How drones of a vehicle differ besides that, where nobody says by how much: no two rotors meet the air alike.
    fn unsaid(vehicle: &Vehicle, said: &[Self]) -> Option<Self> {
        let place = Role::InflowSpread.place().filter(|_| Role::InflowSpread.is_on(vehicle))?;
        let is_said = said.iter().any(|spread| spread.effect == place.name());
        (!is_said).then(|| Self {
            effect: place.name().to_owned(),
            parameter: place.parameter.name,
            size: USUAL_INFLOW_SPREAD,
        })
    }

    /// Change of the pulse when the mean of each group's drones is one standard deviation above the fleet's, by group and bin, us.
    fn change_us(&self, scene: &Scene, vehicle: &Vehicle) -> Result<Vec<Vec<f64>>, EffectError> {
        let mut spread = vehicle.clone();
        select::set(&mut spread, &self.effect, self.parameter, self.size);
        let without = scene.deviating(&spread, "")?;
        let mut change_us = scene.deviating(&spread, &self.effect)?;
        for (with, without) in change_us.iter_mut().zip(&without) {
            with.iter_mut().zip(without).for_each(|(with, without)| *with -= without);
        }
        Ok(change_us)
    }
}

impl Comparison {
    /// This comparison with drones that differ as those of a vehicle do: what was found is in a mean drone, which
    /// differs from none.
    #[must_use]
    pub(super) fn spread_as(mut self, vehicle: &Vehicle) -> Self {
        self.spreads = Spread::all_of(vehicle);
        self
    }

    /// Change of the pulse by one standard deviation of the mean of each group's drones, for everything in which drones
    /// differ by the model, by group and bin, us.
    fn by_spreads_us(&self, vehicle: &Vehicle) -> Result<Vec<Vec<Vec<f64>>>, EffectError> {
        if self.spreads.is_empty() {
            return Ok(Vec::new());
        }
        let scene = self.scene_of(vehicle);
        self.spreads.iter().map(|spread| spread.change_us(&scene, vehicle)).collect()
    }

    /// Change of the pulse by one standard deviation of the mean of each group's drones, for everything in which drones
    /// differ by the model, and group: few drones are not the fleet.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn spread_doubts(&self, vehicle: &Vehicle) -> Result<Vec<Column>, EffectError> {
        let mut doubts = Vec::new();
        for change_us in self.by_spreads_us(vehicle)? {
            let change = Column::Shared(change_us);
            let of_group = |group: usize| {
                change.each(
                    |of, drone, bin| {
                        if of == group { change.at(of, drone, bin) } else { 0.0 }
                    },
                )
            };
            doubts.extend((0..self.data.groups.len()).map(of_group));
        }
        doubts.retain(|doubt| doubt.range() > LEAST_DOUBT_US);
        Ok(doubts)
    }

    /// Standard deviation of the pulse from drone to drone by what makes them differ in the model, in the air and at
    /// the climbs of this flight, us.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn offsets_us(&self, vehicle: &Vehicle) -> Result<f64, EffectError> {
        let ways = self.by_spreads_us(vehicle)?;
        let variance = |(group, of): (usize, &Group)| -> f64 {
            let of_mean = |way: &Vec<Vec<f64>>| mean(&way[group]).unwrap_or_default();
            of.slots.len() as f64 * ways.iter().map(|way| of_mean(way).powi(2)).sum::<f64>()
        };
        Ok(mean(self.data.groups.iter().enumerate().map(variance)).unwrap_or_default().sqrt())
    }

    /// How the drones of each group differ, where a relative error of the whole response does so much beside hover, us.
    ///
    /// # Errors
    /// Effects of the vehicle that are not valid.
    pub(super) fn drones_differ(
        &self,
        vehicle: &Vehicle,
        beside_hover_us: Vec<Vec<f64>>,
    ) -> Result<Vec<Differences>, EffectError> {
        let said = self.by_spreads_us(vehicle)?;
        let unsaid = Spread::unsaid(vehicle, &self.spreads);
        // A drone that nobody spoke of need not be able to fly.
        let unsaid = unsaid.and_then(|one| one.change_us(&self.scene_of(vehicle), vehicle).ok());
        let of_group = |((group, of), slope_us): ((usize, &Group), Vec<f64>)| {
            let drones = of.slots.len().max(1) as f64;
            let of_one = |way: &Vec<Vec<f64>>| -> Vec<f64> {
                way[group].iter().map(|value| value * drones.sqrt()).collect()
            };
            let said: Vec<Vec<f64>> = said.iter().map(of_one).collect();
            let unsaid = unsaid.as_ref().map(of_one);
            Differences::of(&said, unsaid.as_ref(), |values| of.in_hover(values), slope_us)
        };
        Ok(self.data.groups.iter().enumerate().zip(beside_hover_us).map(of_group).collect())
    }
}

/// In which two ways drones of a group differ.
#[derive(Clone, Debug)]
pub(super) struct Differences {
    /// Change of the pulse in each bin by what changes it by 1 us in hover; empty: the same in all.
    pub offset: Vec<f64>,
    /// Change of the pulse in each bin by a relative error of the response, us.
    pub slope_us: Vec<f64>,
}

impl Differences {
    /// Of the ways in which a vehicle lets drones differ, by one standard deviation in each bin, us: that which changes hovers most, and
    /// much the same everywhere, and that which changes others beside hovers most, be it `unsaid`; otherwise an offset, and `slope_us`.
    fn of(
        ways: &[Vec<f64>],
        unsaid: Option<&Vec<f64>>,
        in_hover: impl Fn(&[f64]) -> f64,
        slope_us: Vec<f64>,
    ) -> Self {
        let rms = |values: &[f64]| rms(values).unwrap_or_default();
        // What goes with the climb more than it changes hovers is no offset.
        let is_offset = |way: &&Vec<f64>| {
            let hover_us = in_hover(way);
            let beside: Vec<f64> = way.iter().map(|value| value - hover_us).collect();
            hover_us.abs() > LEAST_DOUBT_US && rms(&beside) < 0.5 * hover_us.abs()
        };
        let offsets = ways.iter().filter(is_offset);
        let most = offsets.max_by(|a, b| in_hover(a).abs().total_cmp(&in_hover(b).abs()));
        let offset: Vec<f64> = most
            .map(|way| {
                let hover_us = in_hover(way);
                way.iter().map(|value| value / hover_us).collect()
            })
            .unwrap_or_default();
        let others = ways.iter().filter(|way| most.is_none_or(|most| *way != most)).chain(unsaid);
        let beside = others.map(|way| {
            let hover_us = in_hover(way);
            let at = |bin: usize| offset.get(bin).copied().unwrap_or(1.0);
            let each = way.iter().enumerate().map(|(bin, value)| value - hover_us * at(bin));
            each.collect::<Vec<f64>>()
        });
        let beside = beside.max_by(|a, b| rms(a).total_cmp(&rms(b)));
        let slope_us = match beside.filter(|beside| rms(beside) > LEAST_DOUBT_US) {
            Some(beside) => {
                // As large as a relative error of the whole response.
                let times = rms(&slope_us) / rms(&beside);
                beside.iter().map(|value| value * times).collect()
            }
            None => slope_us,
        };
        Self { offset, slope_us }
    }
}

#[cfg(test)]
mod tests {
    use super::super::trial;
    use super::*;

    #[test]
    fn drones_with_inflow_differ_in_it_where_nobody_says_by_how_much() {
        let comparison = trial::comparison(&trial::data(4, |_, _| 0.0));
        let mut vehicle = comparison.vehicle.clone();
        let beside = |vehicle: &Vehicle| comparison.beside_hover_us(vehicle).unwrap();
        let differ = |vehicle: &Vehicle| {
            let found = comparison.drones_differ(vehicle, beside(vehicle)).unwrap();
            found[0].slope_us.clone()
        };
        assert_eq!(differ(&vehicle), beside(&vehicle)[0], "no inflow");
        Role::InflowShare.set(&mut vehicle, 0.3);
        let mut more = vehicle.clone();
        Role::InflowShare.set(&mut more, 0.301);
        let (slope_us, whole_us) = (differ(&vehicle), &beside(&vehicle)[0]);
        let by_share: Vec<f64> =
            beside(&more)[0].iter().zip(whole_us).map(|(more, less)| more - less).collect();
        let along = |other: &[f64]| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            dot(&slope_us, other) / (dot(&slope_us, &slope_us) * dot(other, other)).sqrt()
        };
        assert!(along(&by_share) > 0.999, "{}", along(&by_share));
        assert!(along(whole_us) < 0.99, "{}", along(whole_us));
        assert!(comparison.spread_doubts(&vehicle).unwrap().is_empty(), "no doubt of the mean");
        let said = Spread::all_of(&{
            Role::InflowSpread.set(&mut vehicle, 0.02);
            vehicle.clone()
        });
        assert!(said.len() == 1 && Spread::unsaid(&vehicle, &said).is_none());
    }

    #[test]
    fn drones_differ_as_the_vehicle_lets_them() {
        let differ = |ways: &[[f64; 3]]| {
            let ways: Vec<Vec<f64>> = ways.iter().map(|way| way.to_vec()).collect();
            let found = Differences::of(&ways, None, |values| values[0], vec![0.0, 30.0, -40.0]);
            (found.offset, found.slope_us)
        };
        assert_eq!(differ(&[]), (vec![], vec![0.0, 30.0, -40.0]));
        // Thrust changes hovers most; of inflow, what is no offset counts, as large as that of the whole response.
        let (thrust, inflow) = ([4.0, 4.4, 3.8], [1.0, 4.1, -3.05]);
        for ways in [[thrust, inflow], [inflow, thrust]] {
            let (offset, slope_us) = differ(&ways);
            assert_eq!(offset, [1.0, 1.1, 0.95]);
            assert!((slope_us[1] - 30.0).abs() < 1e-9 && (slope_us[2] + 40.0).abs() < 1e-9);
            assert_eq!(slope_us[0], 0.0);
        }
        // In an updraft inflow changes hovers as well.
        let (offset, slope_us) = differ(&[[5.0, 8.0, 1.0], thrust]);
        assert!(offset == [1.0, 1.1, 0.95] && slope_us[1] > 0.0, "{offset:?} {slope_us:?}");
        assert_eq!(differ(&[[5.0, 12.0, -4.0]]).0, [0.0; 0], "and is no offset alone");
        // What nobody says is no offset, however much it changes hovers.
        let unsaid = vec![5.0, 6.0, 4.0];
        let beside =
            Differences::of(&[], Some(&unsaid), |values| values[0], vec![0.0, 30.0, -40.0]);
        assert!(beside.offset.is_empty() && (beside.slope_us[1] + beside.slope_us[2]).abs() < 1e-9);
        let (offset, slope_us) = differ(&[thrust]);
        assert_eq!((offset.len(), slope_us), (3, vec![0.0, 30.0, -40.0]), "one way is the offset");
    }
}
