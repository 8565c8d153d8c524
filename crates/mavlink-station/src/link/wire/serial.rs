//! Transport over a serial radio.

use std::io::{self, Read, Write};
use std::time::Duration;

use serialport::SerialPort;

use super::{Halves, Peer, Receiving, Sending};

pub(super) fn open(device: &str, baud: u32) -> io::Result<Halves> {
    let port = serialport::new(device, baud).timeout(Duration::from_millis(100)).open()?;
    let receiving = Receiver { port: port.try_clone()? };
    Ok((Box::new(Sender { port }), Box::new(receiving)))
}

struct Sender {
    port: Box<dyn SerialPort>,
}

impl Sending for Sender {
    fn send(&mut self, _: Peer, frame: &[u8]) -> io::Result<()> {
        match self.port.write_all(frame) {
            // The radio does not take more now: lost.
            Err(error) if error.kind() == io::ErrorKind::TimedOut => Ok(()),
            other => other,
        }
    }

    fn first_peer(&self) -> Option<Peer> {
        Some(Peer::Only)
    }
}

struct Receiver {
    port: Box<dyn SerialPort>,
}

impl Receiving for Receiver {
    fn recv(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<(Peer, usize)>> {
        self.port.set_timeout(timeout)?;
        match self.port.read(buffer) {
            Ok(0) => Err(io::ErrorKind::UnexpectedEof.into()),
            Ok(size) => Ok(Some((Peer::Only, size))),
            Err(error)
                if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }

    fn is_datagram(&self) -> bool {
        false
    }
}
