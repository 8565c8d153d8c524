//! What goes wrong on a link.

use std::io;

use super::address::Address;
use super::id::DroneId;
use untrusted_io::file::FileError;

/// A message that a gate has held back.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not sent: {what}, as {why}")]
pub struct Refusal {
    /// To whom; `None`: to everyone.
    pub to: Option<DroneId>,
    /// The message, in words.
    pub what: String,
    /// Why.
    pub why: String,
    /// It may be sent in a moment, as when a drone is heard again: like a message that was lost.
    pub for_now: bool,
}

/// A link that cannot be used. A drone that does not answer is not one: that is told per drone.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetError {
    /// The socket or port cannot be opened.
    #[error("cannot open the link {address}: {hint}")]
    Open {
        /// Which.
        address: Address,
        /// What to do about it.
        hint: &'static str,
        /// What the system says.
        source: io::Error,
    },
    /// No thread for the link.
    #[error("cannot start a reader for the link {address}")]
    Thread {
        /// Which.
        address: Address,
        /// What the system says.
        source: io::Error,
    },
    /// The message was held back: the vehicle's state does not allow it. The link is fine.
    #[error(transparent)]
    Refused(Refusal),
    /// What was said last with the key cannot be kept.
    #[error(
        "cannot keep what was said last with the signing key beside it: put the key into a folder \
         that this program can write into"
    )]
    Stamps(#[source] FileError),
    /// No thread for that.
    #[error("cannot start to keep what was said last with the signing key")]
    NoKeeper(#[source] io::Error),
    /// Every link is closed.
    #[error("all links are closed: {reason}")]
    Closed {
        /// What was heard last from them.
        reason: String,
    },
}
