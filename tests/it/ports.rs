//! Ports that a test hands to programs it starts.

use std::net::{Ipv4Addr, SocketAddr, TcpListener, UdpSocket};
use std::sync::atomic::{AtomicU16, Ordering::Relaxed};

/// Ports below those the system itself hands out (from 32768 on Linux, 49152 elsewhere): a socket of
/// another test that asked for any port never takes one of these between this call and the program's
/// start.
const FIRST: u16 = 20_000;
const COUNT: u16 = 12_000;

/// A port of this machine that is free for UDP and TCP, and that no other test of this run is given.
pub(crate) fn free_port() -> SocketAddr {
    static GIVEN: AtomicU16 = AtomicU16::new(0);
    // Two runs of the tests at once begin at different ports.
    let begin = std::process::id() % u32::from(COUNT);
    for _ in 0..COUNT {
        let nth = (begin + u32::from(GIVEN.fetch_add(1, Relaxed))) % u32::from(COUNT);
        let port = FIRST + u16::try_from(nth).unwrap();
        let free = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, port)).is_ok()
            && TcpListener::bind((Ipv4Addr::LOCALHOST, port)).is_ok();
        if free {
            return (Ipv4Addr::LOCALHOST, port).into();
        }
    }
    panic!("no port is free")
}
