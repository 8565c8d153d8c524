//! One end of a link, without the link.

use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, Sender};

/// A vehicle, or a part of one, as it is met on the air.
pub trait Endpoint {
    /// A message from a ground station has come; answers go to `out`.
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>);

    /// Handles a message whose sender is known, as some answers go to the sender alone.
    fn on_frame(
        &mut self,
        now: Micros,
        sender: Sender,
        message: &MavMessage,
        out: &mut Vec<MavMessage>,
    ) {
        let _ = sender;
        self.on_message(now, message, out);
    }

    /// Adds the messages that the vehicle sends unasked to `out`; returns the time at which it
    /// wants to be polled again.
    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros;
}
