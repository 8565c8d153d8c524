//! Errors of links, and refusals of messages.

use std::io;

use super::address::Address;
use super::id::DroneId;
use untrusted_io::file::FileError;

/// A message that was held back, because a drone's state does not allow it.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not sent: {what}, as {why}")]
pub struct Refusal {
    /// Vehicle it was addressed to; `None` for all vehicles.
    pub to: Option<DroneId>,
    /// Message, in words.
    pub what: String,
    /// Reason why it was held back, as a clause.
    pub why: String,
    /// Whether it may be sent in a moment, as when a drone is heard again; such a message counts as
    /// lost.
    pub for_now: bool,
}

/// Error of a link. A drone that does not answer is none: that is reported drone by drone.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetError {
    /// The socket or port cannot be opened.
    #[error("cannot open the link {address}: {hint}")]
    Open {
        /// Address of the link.
        address: Address,
        /// Remedy, for the user.
        hint: &'static str,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The thread of a link could not be started.
    #[error("cannot start a reader for the link {address}")]
    Thread {
        /// Address of the link.
        address: Address,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The message was held back: the vehicle's state does not allow it. The link is fine.
    #[error(transparent)]
    Refused(Refusal),
    /// The newest time stamps of the signing key could not be stored.
    #[error(
        "cannot keep what was said last with the signing key beside it: put the key into a folder \
         that this program can write into"
    )]
    Stamps(#[source] FileError),
    /// The thread that stores the time stamps could not be started.
    #[error("cannot start to keep what was said last with the signing key")]
    NoKeeper(#[source] io::Error),
    /// All links are closed.
    #[error("all links are closed: {reason}")]
    Closed {
        /// Last error of the links.
        reason: String,
    },
}
