//! An instance behind a UDP socket.

use std::io::{self, ErrorKind};
use std::net::UdpSocket;
use std::time::Duration;

use super::instance::{Instance, Refusal, Status};
use super::packet::MAX_PACKET_BYTES;

/// The stop request is looked at so often while nothing comes.
const PATIENCE: Duration = Duration::from_millis(100);

/// Answers packets until `stop` is set, and passes every outcome to `seen`.
///
/// A reply that cannot be sent is not an error: the firmware asks again.
///
/// # Errors
/// The socket failed.
pub fn serve(
    socket: &UdpSocket,
    instance: &mut Instance<'_>,
    stop: &(dyn Fn() -> bool + Sync),
    seen: &mut dyn FnMut(&Status, Option<Refusal>),
) -> io::Result<()> {
    socket.set_read_timeout(Some(PATIENCE))?;
    // One byte more than the longest packet tells longer ones from it.
    let mut buffer = [0; MAX_PACKET_BYTES + 1];
    while !stop() {
        let (length, from) = match socket.recv_from(&mut buffer) {
            Ok(received) => received,
            Err(error) => match error.kind() {
                // The last two are how some systems report that an earlier reply found nobody.
                ErrorKind::WouldBlock
                | ErrorKind::TimedOut
                | ErrorKind::Interrupted
                | ErrorKind::ConnectionReset
                | ErrorKind::ConnectionRefused => continue,
                _ => return Err(error),
            },
        };
        let refusal = match instance.answer(from, &buffer[..length]) {
            Ok(reply) => {
                let _ = socket.send_to(reply.as_bytes(), from);
                None
            }
            Err(refusal) => Some(refusal),
        };
        seen(instance.status(), refusal);
    }
    Ok(())
}
