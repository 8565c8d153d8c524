//! What goes wrong with a server.

use std::io;

/// The server cannot be used. What goes wrong with one drone is told per drone.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// No connection.
    #[error(
        "cannot reach Skybrush Server at {address}: is it running, and is its TCP port {port}?"
    )]
    Connect {
        /// Where.
        address: String,
        /// The port, which is the server's base port + 1.
        port: u16,
        /// What the system says.
        source: io::Error,
    },
    /// The connection broke.
    #[error("the connection to Skybrush Server broke while waiting for {what}")]
    Broken {
        /// What was being waited for.
        what: String,
        /// What the system says.
        source: io::Error,
    },
    /// No answer in time.
    #[error("Skybrush Server did not answer {what} within {seconds} s")]
    Silent {
        /// What was asked.
        what: String,
        /// How long it was waited for.
        seconds: u64,
    },
    /// The server said no.
    #[error("Skybrush Server refuses {what}: {reason}")]
    Refused {
        /// What was asked.
        what: String,
        /// The server's words.
        reason: String,
    },
    /// An answer that is none.
    #[error("Skybrush Server's answer to {what} cannot be understood: {problem}")]
    Answer {
        /// What was asked.
        what: String,
        /// What is wrong with the answer.
        problem: String,
    },
    /// A line longer than anything the server has reason to send.
    #[error(
        "Skybrush Server sent a line longer than {most} bytes; logs of that size cannot come \
         through it: take them from the drone's card and `updraft logs import` them"
    )]
    TooLong {
        /// The limit.
        most: usize,
    },
    /// The show cannot be expressed for the server.
    #[error("the show cannot be uploaded through Skybrush Server: {problem}")]
    Show {
        /// Why.
        problem: String,
    },
}
