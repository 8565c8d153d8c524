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

pub use exchange::Exchange;

/// A burst of any known firmware has fewer packets, so that the number of a packet names its
/// burst.
const NUMBERS_PER_BURST: u16 = 4096;

/// Why a conversation failed.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FtpError {
    /// No answer for the whole time of patience.
    #[error("no answer for {seconds} s: is it on, and within reach?")]
    Silent {
        /// So long.
        seconds: u64,
    },
    /// The vehicle says no.
    #[error("{what} was refused: {refusal}")]
    Refused {
        /// What was asked.
        what: &'static str,
        /// Its reason.
        refusal: NakReason,
    },
    /// The file ends before its size.
    #[error("the vehicle says that the file has {said} bytes, but it ends at byte {ends}")]
    SizeLies {
        /// Its size by its own word, bytes.
        said: u64,
        /// Where reading ends.
        ends: u64,
    },
    /// The file is smaller than it was.
    #[error("the file has changed: {now} bytes, {before} before")]
    Changed {
        /// Size before, bytes.
        before: u64,
        /// Size now, bytes.
        now: u64,
    },
    /// More than is taken.
    #[error("the file has {size} bytes, more than the {most} allowed")]
    TooLarge {
        /// Its size by the vehicle's word, bytes.
        size: u64,
        /// The limit, bytes.
        most: u64,
    },
    /// The written file differs.
    #[error(
        "the file on the vehicle differs from what was sent (checksum {found:08x}, not {right:08x})"
    )]
    Checksum {
        /// Of the vehicle's file.
        found: u32,
        /// Of ours.
        right: u32,
    },
    /// The answer makes no sense.
    #[error("the answer to {what} makes no sense")]
    Nonsense {
        /// What was asked.
        what: &'static str,
    },
    /// The file's bytes could not be kept.
    #[error("{0}")]
    Sink(String),
    /// It was ended from here, to go on in another way.
    #[error("it was ended from here")]
    Paused,
}

/// Numbers requests to one drone. Clones count on together.
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
    /// `start` should differ from run to run: a vehicle takes a request with the numbers of its
    /// last one for a repetition, and repeats its answer.
    pub fn new(drone: DroneId, start: u32) -> Self {
        let mixed = start.wrapping_mul(0x9E37_79B1);
        let session = 1 + ((mixed >> 24) % 250) as u8;
        let numbers = Numbers { sequence: mixed as u16, session, open: None, rtt: Rtt::default() };
        Self { drone, numbers: Rc::new(RefCell::new(numbers)) }
    }

    /// For another conversation after this one.
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

    /// How long its answers take.
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
