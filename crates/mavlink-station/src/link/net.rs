//! Interface between conversations and links.

use std::collections::{BTreeMap, BTreeSet};

use super::clock::Micros;
use super::error::NetError;
use super::frame::MavMessage;
use super::id::DroneId;
use super::traffic::Traffic;

/// A message from a vehicle's autopilot.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Identifier of the vehicle.
    pub from: DroneId,
    /// Message of the vehicle.
    pub message: MavMessage,
}

/// Vehicles within reach, and a clock. Implemented by [`super::station::Station`] over sockets,
/// and by simulated links in tests, whose clock jumps to the next event.
pub trait Net {
    /// Present link time, us; never goes back.
    fn now(&self) -> Micros;

    /// Waits for the next message from any vehicle; `None` if none has come until `until`. Other
    /// traffic of the station itself (its heartbeat) is handled meanwhile.
    ///
    /// # Errors
    ///
    /// If no link is left, or one cannot be used any more.
    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError>;

    /// Sends a message to a vehicle; if it cannot be sent it is lost, like anything on a radio.
    ///
    /// # Errors
    ///
    /// [`NetError::Refused`] if the vehicle's state does not allow the message, otherwise as
    /// [`Net::recv`].
    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError>;

    /// Sends a message to all vehicles in all networks.
    ///
    /// # Errors
    ///
    /// [`NetError::Refused`] if the state of a vehicle does not allow the message, otherwise as
    /// [`Net::recv`].
    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError>;

    /// Vehicles that were heard so far.
    fn heard(&self) -> Vec<DroneId>;

    /// Traffic of each network so far; empty where that is not counted.
    fn traffic(&self) -> BTreeMap<u16, Traffic> {
        BTreeMap::new()
    }

    /// Vehicles whose id was heard from two places at once: two vehicles with one id, or one
    /// vehicle over two links (of which only one is used).
    fn doubled(&self) -> BTreeSet<DroneId> {
        BTreeSet::new()
    }

    /// Vehicles that another process has ordered down through this station, each with whether that
    /// is still in progress.
    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        BTreeMap::new()
    }
}
