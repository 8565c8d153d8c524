//! Sides of a comparison: a campaign's analysis with what is known of its drones, and which flights and drones of
//! two campaigns belong together.

use std::collections::BTreeMap;

use super::result::{ComparedCampaign, Identity, Pair};
use crate::analysis::result::{Analysis, FlightAnalysis};

/// A campaign to compare.
#[derive(Clone, Debug)]
pub struct Side {
    /// Label, which no other side has.
    pub id: String,
    /// Path as it was given.
    pub path: String,
    /// Analysis of the campaign.
    pub analysis: Analysis,
    /// Facts of the flights from the campaign's records, in their order; empty: there are none.
    pub facts: Vec<FlightFacts>,
}

/// Facts of a flight from its campaign's records.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FlightFacts {
    /// Airframe of each slot: its system id.
    pub airframes: BTreeMap<u16, String>,
    /// Vehicle of the plan.
    pub vehicle: Option<String>,
    /// Seed, where the flight was simulated.
    pub seed: Option<u64>,
}

/// A flight of a side.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlightOf<'a> {
    pub(super) side: &'a Side,
    pub(super) index: usize,
    pub(super) flight: &'a FlightAnalysis,
}

impl Side {
    pub(super) fn flights(&self) -> impl Iterator<Item = FlightOf<'_>> {
        let flights = self.analysis.flights.iter().enumerate();
        flights.map(|(index, flight)| FlightOf { side: self, index, flight })
    }

    /// Vehicle of the first flight that knows one.
    pub(super) fn vehicle(&self) -> Option<&str> {
        self.facts.iter().find_map(|facts| facts.vehicle.as_deref())
    }

    pub(super) fn told(&self) -> ComparedCampaign {
        ComparedCampaign {
            id: self.id.clone(),
            path: self.path.clone(),
            title: self.analysis.title.clone(),
            vehicle: self.vehicle().map(str::to_owned),
            flights: self.flights().map(|flight| flight.id()).collect(),
        }
    }
}

impl<'a> FlightOf<'a> {
    /// Id that no other flight of the comparison has: campaign/flight, numbered where an analysis has the name twice.
    pub(super) fn id(&self) -> String {
        let Self { side, index, flight } = self;
        let same = |one: &&FlightAnalysis| one.name == flight.name;
        let before = side.analysis.flights.iter().take(*index).filter(same).count();
        let number = if before > 0 { format!("-{}", before + 1) } else { String::new() };
        format!("{}/{}{number}", side.id, flight.name)
    }

    pub(super) fn facts(&self) -> Option<&'a FlightFacts> {
        self.side.facts.get(self.index)
    }

    /// How many flights of this name and purpose stand before it.
    fn turn(&self) -> usize {
        let before = self.side.analysis.flights.iter().take(self.index);
        before
            .filter(|one| one.name == self.flight.name && one.purpose == self.flight.purpose)
            .count()
    }

    /// Key of a drone, as an identity has it; `None`: it has none.
    pub(super) fn key(&self, identity: Identity, slot: Option<u16>, name: &str) -> Option<String> {
        match (identity, slot) {
            (Identity::Airframe, slot) => self.facts()?.airframes.get(&slot?).cloned(),
            (Identity::Slot, Some(slot)) => Some(format!("slot {slot}")),
            (Identity::Slot, None) => Some(name.to_owned()),
        }
    }

    fn knows_airframes(&self) -> bool {
        let known = |slot: Option<u16>| {
            slot.zip(self.facts()).is_some_and(|(slot, facts)| facts.airframes.contains_key(&slot))
        };
        !self.flight.drones.is_empty() && self.flight.drones.iter().all(|drone| known(drone.slot))
    }
}

/// Two flights that belong together.
#[derive(Clone, Copy, Debug)]
pub(super) struct Couple<'a> {
    pub(super) reference: FlightOf<'a>,
    pub(super) other: FlightOf<'a>,
}

impl Couple<'_> {
    pub(super) fn pair(&self) -> Pair {
        Pair { reference: self.reference.id(), other: self.other.id() }
    }

    /// Airframes, where both flights know those of all their drones.
    pub(super) fn identity(&self) -> Identity {
        if self.reference.knows_airframes() && self.other.knows_airframes() {
            Identity::Airframe
        } else {
            Identity::Slot
        }
    }

    /// Whether the flights were measured by the same windows of the same logs.
    pub(super) fn is_one_flight(&self) -> bool {
        let (a, b) = (&self.reference.flight.drones, &self.other.flight.drones);
        let windows = |drones: &[crate::analysis::result::DroneAnalysis]| {
            drones.iter().any(|drone| !drone.windows.is_empty())
        };
        windows(a)
            && a.len() == b.len()
            && a.iter().zip(b).all(|(a, b)| a.slot == b.slot && a.windows == b.windows)
    }
}

/// Flights of two sides that belong together: of one purpose, by their names, or the only ones of their purpose.
pub(super) fn couples<'a>(reference: &'a Side, other: &'a Side) -> Vec<Couple<'a>> {
    let alone = |side: &Side, one: &FlightAnalysis| {
        side.analysis.flights.iter().filter(|flight| flight.purpose == one.purpose).count() == 1
    };
    let partner = |flight: FlightOf<'a>| {
        let purpose = |one: &FlightOf<'_>| one.flight.purpose == flight.flight.purpose;
        let named = other
            .flights()
            .filter(purpose)
            .find(|one| one.flight.name == flight.flight.name && one.turn() == flight.turn());
        let only = || {
            let found = other.flights().find(purpose)?;
            (alone(reference, flight.flight) && alone(other, found.flight)).then_some(found)
        };
        Some(Couple { reference: flight, other: named.or_else(only)? })
    };
    reference.flights().filter_map(partner).collect()
}
