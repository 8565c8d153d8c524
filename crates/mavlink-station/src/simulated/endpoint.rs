//! One end of a MAVLink conversation, without sockets.

use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, Sender};

/// A vehicle, or a part of one, as the other end of the link meets it.
pub trait Endpoint {
    /// Handles a message from a ground station; answers go to `out`.
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
