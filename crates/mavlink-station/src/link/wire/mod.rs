//! Transports of frames: sockets and serial ports.

#[cfg(feature = "serial")]
mod serial;
mod tcp;
mod udp;

use std::io;
use std::net::SocketAddr;
use std::time::Duration;

use super::address::{Address, Way};
use super::error::NetError;

/// Peer of a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Peer {
    /// The only peer of the link.
    Only,
    /// One of many peers on a datagram socket, by its address.
    At(SocketAddr),
}

/// Sending half of a link.
pub trait Sending: Send {
    /// Sends one frame. Losing it is not an error; a link that is down for now loses all.
    ///
    /// # Errors
    ///
    /// If the link cannot be used any more.
    fn send(&mut self, to: Peer, frame: &[u8]) -> io::Result<()>;

    /// Peer to send to before any vehicle was heard; `None` if the link can only answer.
    fn first_peer(&self) -> Option<Peer>;
}

/// Receiving half of a link.
pub trait Receiving: Send {
    /// Receives bytes until the timeout; `None` if none came. A datagram is received whole.
    ///
    /// # Errors
    ///
    /// If the link cannot be used any more.
    fn recv(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<(Peer, usize)>>;

    /// Whether bytes that are received at once are one datagram.
    fn is_datagram(&self) -> bool;
}

/// Sending and receiving halves of a link.
pub type Halves = (Box<dyn Sending>, Box<dyn Receiving>);

/// Opens the transport of a link.
///
/// # Errors
/// When the address is not there, taken, or not allowed.
pub fn open(address: &Address) -> Result<Halves, NetError> {
    let (opened, wrong) = match &address.way {
        Way::UdpIn(host) => {
            (udp::listen(host), "is another ground station listening on the same port?")
        }
        Way::UdpOut(host) => (udp::connect(host), "is the host name right?"),
        Way::Tcp(host) => {
            (tcp::connect(host), "does anything listen there, and is the host name right?")
        }
        #[cfg(feature = "serial")]
        Way::Serial(device, baud) => {
            (serial::open(device, *baud), "is the radio plugged in, and may you use the device?")
        }
        #[cfg(not(feature = "serial"))]
        Way::Serial(..) => (
            Err(io::ErrorKind::Unsupported.into()),
            "this program was built without the feature `serial`",
        ),
    };
    opened.map_err(|source| {
        let is_udp = matches!(address.way, Way::UdpIn(_));
        let hint = match source.kind() {
            io::ErrorKind::AddrInUse => wrong,
            io::ErrorKind::AddrNotAvailable if is_udp => {
                "this computer does not have that address: give its own, or 0.0.0.0 for all"
            }
            io::ErrorKind::PermissionDenied if is_udp => {
                "may you listen there? Give a port above 1023"
            }
            _ if is_udp => "the host name is not known to this computer: is it right?",
            _ => wrong,
        };
        NetError::Open { address: address.clone(), hint, source }
    })
}
