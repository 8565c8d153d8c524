//! A virtual vehicle at its socket: frames in, frames out, signed or not.

use std::io;
use std::net::{SocketAddr, UdpSocket};

use super::endpoint::Endpoint as _;
use super::vehicle::VirtualVehicle;
use crate::link::clock::Micros;
use crate::link::frame::{Frame, FrameReader, Sender, encode};
use crate::link::signing::{Key, Signer, Verifier};
use crate::link::station::AUTOPILOT;

/// Packets that a vehicle may send in one round, in batches of its servers.
const MOST_BATCHES: usize = 16;
/// Frames that leave together share datagrams of this size, as network bridges send them.
const DATAGRAM: usize = 1_400;
/// Link id in a vehicle's signatures.
const LINK: u8 = 0;

/// A vehicle and its socket.
pub(super) struct Post<'w> {
    pub(super) vehicle: VirtualVehicle<'w>,
    socket: UdpSocket,
    station: SocketAddr,
    signing: Option<(Signer, Verifier)>,
    sequence: u8,
    inbox: Vec<Frame>,
    wake: Micros,
    /// Whether a transfer had more to send.
    pub(super) is_sending: bool,
    datagram: Vec<u8>,
}

impl<'w> Post<'w> {
    /// Opens a socket that speaks to this station; `time` is signing time.
    pub(super) fn open(
        vehicle: VirtualVehicle<'w>,
        station: SocketAddr,
        key: Option<&Key>,
        time: u64,
    ) -> io::Result<Self> {
        let signing =
            key.map(|key| (Signer::new(key.clone(), LINK, time), Verifier::new(key.clone(), time)));
        Ok(Self {
            vehicle,
            socket: open(station)?,
            station,
            signing,
            sequence: 0,
            inbox: Vec::new(),
            wake: 0,
            is_sending: false,
            datagram: Vec::with_capacity(DATAGRAM),
        })
    }

    pub(super) fn is_busy(&self) -> bool {
        self.vehicle.is_busy() || self.vehicle.is_writing()
    }

    /// The next datagram that waits, if any.
    pub(super) fn receive<'b>(&self, buffer: &'b mut [u8]) -> Option<&'b [u8]> {
        // Errors tell of earlier sends: the station is not there (yet).
        let (size, _) = self.socket.recv_from(buffer).ok()?;
        Some(&buffer[..size])
    }

    /// Whether a datagram waits.
    pub(super) fn has_mail(&self) -> bool {
        self.socket.peek_from(&mut [0; 1]).is_ok()
    }

    /// Takes what has come; returns how many frames were refused for want of a good signature.
    pub(super) fn hear(&mut self, bytes: &[u8], time: u64) -> u64 {
        let mut reader = FrameReader::default();
        reader.push(bytes);
        let mut verifier = self.signing.as_mut().map(|(_, verifier)| verifier);
        if let Some(verifier) = verifier.as_deref_mut() {
            verifier.advance(time);
        }
        while let Some(frame) = reader.next(verifier.as_deref_mut()) {
            self.inbox.push(frame);
        }
        reader.loss.unsigned + reader.loss.forged
    }

    /// Takes what has been heard, and goes on to this time; returns the frames to send.
    pub(super) fn round(&mut self, now: Micros, time: u64) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        let heard = !self.inbox.is_empty();
        for frame in self.inbox.drain(..) {
            self.vehicle.on_frame(now, frame.sender, &frame.message, &mut out);
            // A vehicle serves requests as they come; only a burst makes them wait.
            self.wake = self.vehicle.poll(now, &mut out);
        }
        self.is_sending = false;
        if heard || self.wake <= now {
            for batch in 1..=MOST_BATCHES {
                self.wake = self.vehicle.poll(now, &mut out);
                if self.wake > now {
                    break;
                }
                self.is_sending = batch == MOST_BATCHES;
            }
        }
        let sender = Sender { system: self.vehicle.setup.system, component: AUTOPILOT };
        let mut signer = self.signing.as_mut().map(|(signer, _)| signer);
        if let Some(signer) = signer.as_deref_mut() {
            signer.advance(time);
        }
        out.iter()
            .map(|message| {
                let frame = encode(sender, self.sequence, message, signer.as_deref_mut());
                self.sequence = self.sequence.wrapping_add(1);
                frame
            })
            .collect()
    }

    /// Sends a frame, with the next ones or at the next [`Self::flush`].
    pub(super) fn send(&mut self, frame: &[u8]) {
        if self.datagram.len() + frame.len() > DATAGRAM {
            self.flush();
        }
        self.datagram.extend_from_slice(frame);
    }

    /// Sends what has been collected.
    pub(super) fn flush(&mut self) {
        if !self.datagram.is_empty() {
            // A full buffer loses it, as a radio does.
            let _ = self.socket.send_to(&self.datagram, self.station);
            self.datagram.clear();
        }
    }
}

fn open(station: SocketAddr) -> io::Result<UdpSocket> {
    let any: SocketAddr = match (station.is_ipv6(), station.ip().is_loopback()) {
        (false, true) => ([127, 0, 0, 1], 0).into(),
        (false, false) => ([0, 0, 0, 0], 0).into(),
        (true, _) => (std::net::Ipv6Addr::UNSPECIFIED, 0).into(),
    };
    let socket = UdpSocket::bind(any)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}
