//! Links to drones, opened for a workflow.

use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;

use crate::link::address::{Address, Way};
use crate::link::signing::Key;
use crate::link::station::{Setup, Station};
use crate::workflow::clock::Clock;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::host::Host;

/// Opens links with a clock.
pub(crate) fn open(
    links: Vec<Address>,
    key: Option<Key>,
    clock: &Arc<dyn Clock>,
) -> Result<Station, WorkflowError> {
    Station::open(Setup { links, key, clock: Arc::clone(clock) })
        .map_err(|error| WorkflowError::Failed(with_reasons(&error)))
}

/// A link to a network of virtual drones on this computer, on a free port, and the port's address.
pub(crate) fn own_link(network: u16) -> Result<(Address, SocketAddr), WorkflowError> {
    let free =
        || -> std::io::Result<SocketAddr> { UdpSocket::bind(("127.0.0.1", 0))?.local_addr() };
    let address = free().map_err(|error| {
        WorkflowError::Failed(format!("no free UDP port on this computer: {error}"))
    })?;
    Ok((Address { network, way: Way::UdpIn(address.to_string()) }, address))
}

/// Differs from run to run, for sequence numbers that answers of an earlier run must not match.
pub(crate) fn run_number(host: &dyn Host) -> u32 {
    (host.clock().unix_us() / 1000) as u32
}
