//! Errors of a Skybrush Server and of the connection to it.

use std::io;

/// Error of using a Skybrush Server. Problems of single drones are reported drone by drone.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// The server cannot be connected to.
    #[error(
        "cannot reach Skybrush Server at {address}: is it running, and is its TCP port {port}?"
    )]
    Connect {
        /// Address, as `host:port`.
        address: String,
        /// Port that was tried, which is the server's base port + 1.
        port: u16,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The connection broke during a request.
    #[error("the connection to Skybrush Server broke while waiting for {what}")]
    Broken {
        /// Request whose answer was awaited.
        what: String,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The server did not answer in time.
    #[error("Skybrush Server did not answer {what} within {seconds} s")]
    Silent {
        /// Request that stayed without an answer.
        what: String,
        /// Time waited for the answer, s.
        seconds: u64,
    },
    /// The server refused the request.
    #[error("Skybrush Server refuses {what}: {reason}")]
    Refused {
        /// Request that was refused.
        what: String,
        /// Reason, in the server's words.
        reason: String,
    },
    /// The server's answer is not valid.
    #[error("Skybrush Server's answer to {what} cannot be understood: {problem}")]
    Answer {
        /// Request that was answered.
        what: String,
        /// Description of the problem with the answer.
        problem: String,
    },
    /// A line longer than anything the server has reason to send.
    #[error(
        "Skybrush Server sent a line longer than {most} bytes; logs of that size cannot come \
         through it: take them from the drone's card with `updraft logs import`"
    )]
    TooLong {
        /// Longest line that is accepted, bytes.
        most: usize,
    },
    /// The show cannot be expressed for the server.
    #[error("the show cannot be uploaded through Skybrush Server: {problem}")]
    Show {
        /// Reason why it cannot be uploaded.
        problem: String,
    },
}
