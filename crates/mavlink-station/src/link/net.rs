//! What protocols talk through.

use std::collections::{BTreeMap, BTreeSet};

use super::clock::Micros;
use super::error::NetError;
use super::frame::MavMessage;
use super::id::DroneId;
use super::traffic::Traffic;

/// A message from a vehicle's autopilot.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Who sent it.
    pub from: DroneId,
    /// What it says.
    pub message: MavMessage,
}

/// Vehicles within reach, and a clock. Implemented by [`super::station::Station`] over sockets,
/// and by simulated links in tests, whose clock jumps to the next event.
pub trait Net {
    /// Time now; never goes back.
    fn now(&self) -> Micros;

    /// The next message from any vehicle; `None` when none has come until `until`. Other traffic
    /// of the station itself (its heartbeat) is handled meanwhile.
    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError>;

    /// Sends to a vehicle; what cannot be sent is lost, like anything on a radio.
    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError>;

    /// Sends to everyone in all networks.
    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError>;

    /// Vehicles heard so far.
    fn heard(&self) -> Vec<DroneId>;

    /// What went through each network so far; nothing where that is not counted.
    fn traffic(&self) -> BTreeMap<u16, Traffic> {
        BTreeMap::new()
    }

    /// Vehicles whose id was heard from two places at once: two vehicles with one id, or one
    /// vehicle over two links (then only one link is used).
    fn doubled(&self) -> BTreeSet<DroneId> {
        BTreeSet::new()
    }

    /// Vehicles that another process has ordered down through this station, and whether that is
    /// still going on.
    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        BTreeMap::new()
    }
}
