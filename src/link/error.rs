//! What goes wrong on a link.

use std::io;

use super::address::Address;

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
    /// Every link is closed.
    #[error("all links are closed: {reason}")]
    Closed {
        /// What was heard last from them.
        reason: String,
    },
}
