//! Transport over a TCP connection, as the firmware's simulator offers one. It reconnects when the
//! connection breaks.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::{Halves, Peer, Receiving, Sending};

const CONNECT_TIMEOUT: Duration = Duration::from_secs(3);
const WRITE_TIMEOUT: Duration = Duration::from_secs(1);
const BETWEEN_TRIES: Duration = Duration::from_millis(500);

pub(super) fn connect(host: &str) -> io::Result<Halves> {
    let stream = dial(host)?;
    let shared = Arc::new(Mutex::new(Some(stream.try_clone()?)));
    let receiver =
        Receiver { host: host.to_owned(), stream: Some(stream), shared: Arc::clone(&shared) };
    Ok((Box::new(Sender { shared }), Box::new(receiver)))
}

fn dial(host: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::NotFound);
    for address in host.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_TIMEOUT) {
            Ok(stream) => {
                stream.set_nodelay(true)?;
                stream.set_write_timeout(Some(WRITE_TIMEOUT))?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

type Shared = Arc<Mutex<Option<TcpStream>>>;

fn lock(shared: &Shared) -> MutexGuard<'_, Option<TcpStream>> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

struct Sender {
    shared: Shared,
}

impl Sending for Sender {
    fn send(&mut self, _: Peer, frame: &[u8]) -> io::Result<()> {
        let mut stream = lock(&self.shared);
        // A frame that was cut in the middle would spoil what follows: such a stream is given up
        // and the receiving half makes a new one.
        if stream.as_mut().is_some_and(|stream| stream.write_all(frame).is_err())
            && let Some(broken) = stream.take()
        {
            let _ = broken.shutdown(std::net::Shutdown::Both);
        }
        Ok(())
    }

    fn first_peer(&self) -> Option<Peer> {
        Some(Peer::Only)
    }
}

struct Receiver {
    host: String,
    stream: Option<TcpStream>,
    shared: Shared,
}

impl Receiving for Receiver {
    fn recv(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<Option<(Peer, usize)>> {
        let Some(stream) = &mut self.stream else {
            std::thread::sleep(BETWEEN_TRIES.min(timeout));
            if let Ok(stream) = dial(&self.host) {
                *lock(&self.shared) = Some(stream.try_clone()?);
                self.stream = Some(stream);
            }
            return Ok(None);
        };
        stream.set_read_timeout(Some(timeout))?;
        match stream.read(buffer) {
            Ok(size) if size > 0 => Ok(Some((Peer::Only, size))),
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::WouldBlock
                        | io::ErrorKind::TimedOut
                        | io::ErrorKind::Interrupted
                ) =>
            {
                Ok(None)
            }
            Ok(_) | Err(_) => {
                self.stream = None;
                *lock(&self.shared) = None;
                Ok(None)
            }
        }
    }

    fn is_datagram(&self) -> bool {
        false
    }
}
