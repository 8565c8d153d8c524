//! Messages that come together.

use crate::link::clock::{MS, Micros};
use crate::link::error::NetError;
use crate::link::net::{Net, Received};

/// Messages that come within this time are taken before all drones are looked at again: looking costs as much as taking
/// hundreds.
const TOGETHER: Micros = 20 * MS;

/// Waits for a message until `wait`, us, and takes what comes with it.
///
/// # Errors
/// If the net fails.
pub(super) fn hear_together(
    net: &mut dyn Net,
    mut wait: Micros,
    mut hear: impl FnMut(Micros, &Received),
) -> Result<(), NetError> {
    let until = net.now() + TOGETHER;
    while let Some(received) = net.recv(wait)? {
        let now = net.now();
        hear(now, &received);
        wait = now;
        if now >= until {
            break;
        }
    }
    Ok(())
}
