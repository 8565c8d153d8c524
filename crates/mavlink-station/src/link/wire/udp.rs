//! Transport over UDP datagrams.

use std::io;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};
use std::time::Duration;

use socket2::SockRef;

use super::{Halves, Peer, Receiving, Sending};

/// Wanted receive buffer, bytes: half a second of a fast network. The system may give less.
const RECEIVE_BUFFER: usize = 8 << 20;

pub(super) fn listen(host: &str) -> io::Result<Halves> {
    halves(UdpSocket::bind(host)?, None)
}

pub(super) fn connect(host: &str) -> io::Result<Halves> {
    let peer = host.to_socket_addrs()?.next().ok_or(io::ErrorKind::NotFound)?;
    let any = if peer.is_ipv6() { "[::]:0" } else { "0.0.0.0:0" };
    halves(UdpSocket::bind(any)?, Some(peer))
}

fn halves(socket: UdpSocket, first: Option<SocketAddr>) -> io::Result<Halves> {
    // A smaller buffer only loses more, which is repaired.
    let _ = SockRef::from(&socket).set_recv_buffer_size(RECEIVE_BUFFER);
    let receiving = Receiver { socket: socket.try_clone()?, timeout: None };
    Ok((Box::new(Sender { socket, first }), Box::new(receiving)))
}

struct Sender {
    socket: UdpSocket,
    first: Option<SocketAddr>,
}

impl Sending for Sender {
    fn send(&mut self, to: Peer, frame: &[u8]) -> io::Result<()> {
        let Peer::At(to) = to else { return Ok(()) };
        // Unreachable, no route, buffers full: the frame is lost like any other.
        let _ = self.socket.send_to(frame, to);
        Ok(())
    }

    fn first_peer(&self) -> Option<Peer> {
        self.first.map(Peer::At)
    }
}

struct Receiver {
    socket: UdpSocket,
    timeout: Option<Duration>,
}

impl Receiving for Receiver {
    fn recv(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<(Peer, usize)>> {
        if self.timeout != Some(timeout) {
            self.socket.set_read_timeout(Some(timeout))?;
            self.timeout = Some(timeout);
        }
        match self.socket.recv_from(buffer) {
            Ok((size, from)) => Ok(Some((Peer::At(from), size))),
            Err(error) => match error.kind() {
                // A refused connection is told of an earlier send: that peer is not there (yet).
                io::ErrorKind::WouldBlock
                | io::ErrorKind::TimedOut
                | io::ErrorKind::Interrupted
                | io::ErrorKind::ConnectionRefused
                | io::ErrorKind::ConnectionReset => Ok(None),
                _ => Err(error),
            },
        }
    }

    fn is_datagram(&self) -> bool {
        true
    }
}
