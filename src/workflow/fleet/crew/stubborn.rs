//! Links that may fail while drones are in the air.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::link::clock::{MS, Micros};
use crate::link::error::NetError;
use crate::link::frame::MavMessage;
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::workflow::error::with_reasons;
use crate::workflow::host::Host;

/// A link that says nothing is asked again after this at the soonest.
const PAUSE: Micros = 20 * MS;

/// Tries on whatever fails: who flies drones does not leave them because a message could not be
/// sent. What failed first is told at once.
pub(super) struct Stubborn<'a> {
    net: &'a mut dyn Net,
    host: &'a dyn Host,
    /// What failed first, in words.
    pub(super) failed: Option<String>,
}

impl<'a> Stubborn<'a> {
    pub(super) fn new(net: &'a mut dyn Net, host: &'a dyn Host) -> Self {
        Self { net, host, failed: None }
    }

    fn note(&mut self, error: &NetError) {
        if self.failed.is_none() {
            let text = with_reasons(error);
            self.host.warn(&format!(
                "{text}; this program keeps trying. Drones that hear nothing stop after 3 s, and \
                 return by themselves when they lose the station (FS_GCS_ENABLE)"
            ));
            self.failed = Some(text);
        }
    }
}

impl Net for Stubborn<'_> {
    fn now(&self) -> Micros {
        self.net.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        match self.net.recv(until) {
            Ok(received) => Ok(received),
            Err(error) => {
                self.note(&error);
                // A closed link fails at once, every time.
                let left = until.saturating_sub(self.net.now()).min(PAUSE);
                self.host.clock().pause(Duration::from_micros(left));
                Ok(None)
            }
        }
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        match self.net.send(to, message) {
            // That is no fault of the link.
            Err(NetError::Refused(refusal)) => Err(NetError::Refused(refusal)),
            Err(error) => {
                self.note(&error);
                Ok(())
            }
            Ok(()) => Ok(()),
        }
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        if let Err(error) = self.net.broadcast(message) {
            self.note(&error);
        }
        Ok(())
    }

    fn heard(&self) -> Vec<DroneId> {
        self.net.heard()
    }

    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        self.net.ordered_down()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workflow::host::Quiet;

    /// Fails at everything.
    struct Broken;

    impl Net for Broken {
        fn now(&self) -> Micros {
            0
        }

        fn recv(&mut self, _: Micros) -> Result<Option<Received>, NetError> {
            Err(NetError::Closed { reason: "the cable was pulled".to_owned() })
        }

        fn send(&mut self, _: DroneId, _: &MavMessage) -> Result<(), NetError> {
            self.recv(0).map(drop)
        }

        fn broadcast(&mut self, _: &MavMessage) -> Result<(), NetError> {
            self.recv(0).map(drop)
        }

        fn heard(&self) -> Vec<DroneId> {
            Vec::new()
        }
    }

    #[test]
    fn a_link_that_fails_is_told_and_tried_again() {
        let (host, mut broken) = (Quiet::default(), Broken);
        let mut net = Stubborn::new(&mut broken, &host);
        let heartbeat = crate::link::station::heartbeat();
        let drone = DroneId { network: 0, system: 1 };
        assert!(net.send(drone, &heartbeat).is_ok());
        assert!(net.broadcast(&heartbeat).is_ok());
        assert!(matches!(net.recv(1), Ok(None)));
        assert_eq!(net.failed.as_deref(), Some("all links are closed: the cable was pulled"));
    }
}
