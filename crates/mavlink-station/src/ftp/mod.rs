//! MAVFTP conversations with one drone: [`put::Put`], [`get::Get`], [`list::List`], [`sum::Sum`].

mod exchange;
pub mod get;
pub mod list;
pub mod put;
pub(crate) mod reads;
pub mod sum;

use std::cell::RefCell;
use std::rc::Rc;

use crate::link::clock::Micros;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::station::{AUTOPILOT, STATION};
use crate::protocol::ftp::{NakReason, Packet};

use super::rtt::Rtt;

use exchange::Exchange;

/// A burst of any known firmware has fewer packets, so that the number of a packet names its
/// burst.
const NUMBERS_PER_BURST: u16 = 4096;

/// Error of a MAVFTP conversation.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FtpError {
    /// The vehicle has not answered for the whole time of patience.
    #[error("no answer for {seconds} s: is it on, and within reach?")]
    Silent {
        /// Time without an answer, s.
        seconds: u64,
    },
    /// The vehicle refuses a request.
    #[error("{what} was refused: {refusal}")]
    Refused {
        /// Request that was refused, in words.
        what: &'static str,
        /// Reason that the vehicle gives.
        refusal: NakReason,
    },
    /// The file ends before the size that the vehicle states.
    #[error("the vehicle says that the file has {said} bytes, but it ends at byte {ends}")]
    SizeLies {
        /// Size that the vehicle states, bytes.
        said: u64,
        /// Offset at which reading ends, bytes.
        ends: u64,
    },
    /// The file is smaller than it was at first.
    #[error("the file has changed: {now} bytes, {before} before")]
    Changed {
        /// Size at first, bytes.
        before: u64,
        /// Present size, bytes.
        now: u64,
    },
    /// The file is larger than the limit.
    #[error("the file has {size} bytes, more than the {most} allowed")]
    TooLarge {
        /// Size that the vehicle states, bytes.
        size: u64,
        /// Largest size accepted, bytes.
        most: u64,
    },
    /// The file that was written differs from the one that was sent.
    #[error(
        "the file on the vehicle differs from what was sent (checksum {found:08x}, not {right:08x})"
    )]
    Checksum {
        /// CRC-32 of the vehicle's file.
        found: u32,
        /// CRC-32 of the file that was sent.
        right: u32,
    },
    /// The answer is not valid.
    #[error("the answer to {what} makes no sense")]
    Nonsense {
        /// Request that was answered, in words.
        what: &'static str,
    },
    /// The bytes could not be kept, for this reason.
    #[error("{0}")]
    Sink(String),
    /// The conversation was ended by the station, to continue in another way.
    #[error("it was ended from here")]
    Paused,
}

/// Numbering of the requests to one drone. Clones share the numbers.
#[derive(Clone, Debug)]
pub struct Caller {
    drone: DroneId,
    numbers: Rc<RefCell<Numbers>>,
}

#[derive(Debug)]
struct Numbers {
    sequence: u16,
    session: u8,
    /// A session that the vehicle may still hold open.
    open: Option<u8>,
    rtt: Rtt,
}

impl Caller {
    /// Starts the numbering of a drone's requests. `start` should differ from run to run: a vehicle
    /// takes a request with the numbers of its last one for a repetition, and repeats its answer.
    pub fn new(drone: DroneId, start: u32) -> Self {
        let mixed = start.wrapping_mul(0x9E37_79B1);
        let session = 1 + ((mixed >> 24) % 250) as u8;
        let numbers = Numbers { sequence: mixed as u16, session, open: None, rtt: Rtt::default() };
        Self { drone, numbers: Rc::new(RefCell::new(numbers)) }
    }

    /// Numbering for a further conversation after this one.
    #[must_use]
    pub fn another(&self) -> Self {
        self.skip();
        self.clone()
    }

    fn session(&self) -> u8 {
        self.numbers.borrow().session
    }

    /// The vehicle has opened a file.
    fn opened(&self, session: u8) {
        let mut numbers = self.numbers.borrow_mut();
        numbers.session = session;
        numbers.open = Some(session);
    }

    /// What the vehicle may hold open is closed.
    fn closed(&self) {
        self.numbers.borrow_mut().open = None;
    }

    fn left_open(&self) -> Option<u8> {
        self.numbers.borrow().open
    }

    /// Estimate of the time to the drone's answers.
    pub fn rtt(&self) -> Rtt {
        self.numbers.borrow().rtt
    }

    fn timeout(&self) -> Micros {
        self.numbers.borrow().rtt.timeout()
    }

    fn knows_rtt(&self) -> bool {
        self.numbers.borrow().rtt.is_known()
    }

    fn add_rtt(&self, took: Micros) {
        self.numbers.borrow_mut().rtt.add(took);
    }

    fn new_session(&self) {
        {
            let mut numbers = self.numbers.borrow_mut();
            numbers.session = 1 + numbers.session % 250;
        }
        self.skip();
    }

    /// Goes on with numbers that no burst so far has used.
    fn skip(&self) {
        let mut numbers = self.numbers.borrow_mut();
        numbers.sequence = numbers.sequence.wrapping_add(NUMBERS_PER_BURST);
    }

    fn number(&self, mut packet: Packet) -> Packet {
        let mut numbers = self.numbers.borrow_mut();
        numbers.sequence = numbers.sequence.wrapping_add(1);
        packet.sequence = numbers.sequence;
        packet.session = numbers.session;
        packet
    }

    fn message(&self, packet: &Packet) -> MavMessage {
        MavMessage::FILE_TRANSFER_PROTOCOL(dialect::FILE_TRANSFER_PROTOCOL_DATA {
            target_network: 0,
            target_system: self.drone.system,
            target_component: AUTOPILOT,
            payload: packet.to_payload(),
        })
    }
}

/// An answer to this station.
fn answer(message: &MavMessage) -> Option<Packet> {
    let MavMessage::FILE_TRANSFER_PROTOCOL(message) = message else { return None };
    if !matches!(message.target_system, 0) && message.target_system != STATION.system {
        return None;
    }
    Packet::from_payload(&message.payload)
}
