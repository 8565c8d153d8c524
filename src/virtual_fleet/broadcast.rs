//! Broadcasts of a ground station to a whole fleet, received at one port.
//!
//! Skybrush Server answers each drone where it speaks from, but sends starts, lights and remote
//! control to one UDP port that all drones of a network listen to. Virtual drones share a
//! computer, and so the port.

use std::io;
use std::net::UdpSocket;

/// Port that Skybrush Server broadcasts to by default.
pub const BROADCAST_PORT: u16 = 14_555;

/// Socket on which all vehicles hear what a station broadcasts.
#[derive(Debug)]
pub struct Broadcasts(UdpSocket);

impl Broadcasts {
    /// Listens at a port (0: a free one), on every interface: broadcasts from this computer arrive
    /// on the interfaces to other computers, not on the loopback.
    ///
    /// # Errors
    /// When the port is taken.
    pub fn open(port: u16) -> io::Result<Self> {
        let socket = UdpSocket::bind(("0.0.0.0", port))?;
        socket.set_nonblocking(true)?;
        Ok(Self(socket))
    }

    /// Number of the port.
    ///
    /// # Errors
    /// When the system does not know it.
    pub fn port(&self) -> io::Result<u16> {
        Ok(self.0.local_addr()?.port())
    }

    /// The next datagram that waits, if any.
    pub(super) fn receive<'b>(&self, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        let (size, _) = self.0.recv_from(buffer).ok()?;
        Some(&buffer[..size])
    }

    /// Whether a datagram waits.
    pub(super) fn has_mail(&self) -> bool {
        self.0.peek_from(&mut [0; 1]).is_ok()
    }
}
