//! A net that tells a page what it hears.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::station::Station;
use crate::link::clock::Micros;
use crate::link::error::NetError;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::link::traffic::Traffic;

/// Net that passes everything on, and tells what has come.
pub struct Tap<'a> {
    net: &'a mut dyn Net,
    station: Option<Arc<Station>>,
}

impl std::fmt::Debug for Tap<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Tap").field("station", &self.station).finish_non_exhaustive()
    }
}

impl<'a> Tap<'a> {
    /// A net whose messages a station's pages hear of; `None`: nobody does.
    pub fn new(net: &'a mut dyn Net, station: Option<Arc<Station>>) -> Self {
        Self { net, station }
    }
}

impl Net for Tap<'_> {
    fn now(&self) -> Micros {
        self.net.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        let received = self.net.recv(until)?;
        if let (Some(station), Some(received)) = (&self.station, &received) {
            station.hear(received);
        }
        Ok(received)
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.net.send(to, message)
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.net.broadcast(message)
    }

    fn heard(&self) -> Vec<DroneId> {
        self.net.heard()
    }

    fn traffic(&self) -> BTreeMap<u16, Traffic> {
        self.net.traffic()
    }

    fn doubled(&self) -> BTreeSet<DroneId> {
        self.net.doubled()
    }

    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        self.net.ordered_down()
    }
}
