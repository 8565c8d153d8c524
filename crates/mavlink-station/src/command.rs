//! Commands with their answer: repeated until the vehicle accepts, refuses or stays silent.

use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Step};
use crate::link::error::Refusal;
use crate::link::frame::{MavMessage, dialect};
use dialect::{MavCmd, MavResult};

/// Repetition of a request until it counts as unanswered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Patience {
    /// Time between repetitions, us.
    pub every: Micros,
    /// Largest number of times that the request is sent.
    pub tries: u32,
}

impl Default for Patience {
    /// Ten times a second apart: with a fifth of the frames lost each way, one in 25,000
    /// conversations fails.
    fn default() -> Self {
        Self { every: S, tries: 10 }
    }
}

/// A vehicle that works on a command has so long between two signs of it.
const PROGRESS_WITHIN: Micros = 30 * S;

/// Error of a command.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CommandError {
    /// The vehicle does not answer.
    #[error(
        "no answer to \"{what}\" after {tries} tries: bring the drone nearer to the radio, or \
         restart it, and try again"
    )]
    Silent {
        /// Request, in words.
        what: String,
        /// Number of times that it was sent.
        tries: u32,
    },
    /// The vehicle refuses the command.
    #[error("the drone refuses \"{what}\": {reason}")]
    Refused {
        /// Request, in words.
        what: String,
        /// Answer of the vehicle, in words.
        reason: &'static str,
        /// Number of the answer (MAV_RESULT).
        result: u8,
    },
    /// The command was not sent, because the vehicle must not be touched.
    #[error("\"{what}\" was not sent, as {why}")]
    Held {
        /// Request that was not sent, in words.
        what: String,
        /// Reason why it was not sent, as a clause.
        why: String,
    },
}

/// Conversation of one command to one vehicle.
#[derive(Clone, Debug)]
pub struct Command {
    what: String,
    message: MavMessage,
    asked: MavCmd,
    patience: Patience,
    tries: u32,
    next: Micros,
    in_progress: bool,
    answer: Option<MavResult>,
}

impl Command {
    /// Makes a conversation of a COMMAND_LONG or COMMAND_INT, as from [`super::messages`]; `what`
    /// is the request in words. Other messages are never answered.
    pub fn new(what: impl Into<String>, message: MavMessage) -> Self {
        let asked = match &message {
            MavMessage::COMMAND_LONG(c) => c.command,
            MavMessage::COMMAND_INT(c) => c.command,
            _ => MavCmd::DEFAULT,
        };
        Self {
            what: what.into(),
            message,
            asked,
            patience: Patience::default(),
            tries: 0,
            next: 0,
            in_progress: false,
            answer: None,
        }
    }

    /// Sets how often and for how long the command is repeated.
    #[must_use]
    pub fn with_patience(self, patience: Patience) -> Self {
        Self { patience, ..self }
    }
}

impl Conversation for Command {
    type Done = Result<(), CommandError>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        let MavMessage::COMMAND_ACK(ack) = message else { return };
        if ack.command != self.asked || self.tries == 0 {
            return;
        }
        match ack.result {
            MavResult::MAV_RESULT_IN_PROGRESS => {
                self.in_progress = true;
                self.next = now + PROGRESS_WITHIN;
            }
            // It may be able to in a moment.
            MavResult::MAV_RESULT_TEMPORARILY_REJECTED if self.tries < self.patience.tries => {}
            result => self.answer = Some(result),
        }
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        let (what, why) = (self.what.clone(), refusal.why.clone());
        Some(Err(CommandError::Held { what, why }))
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        match self.answer {
            Some(MavResult::MAV_RESULT_ACCEPTED) => return Step::Done(Ok(())),
            Some(result) => {
                return Step::Done(Err(CommandError::Refused {
                    what: self.what.clone(),
                    reason: reason(result),
                    result: result as u8,
                }));
            }
            None => {}
        }
        if now < self.next {
            return Step::Wait(self.next);
        }
        if self.tries >= self.patience.tries || self.in_progress {
            let (what, tries) = (self.what.clone(), self.tries);
            return Step::Done(Err(CommandError::Silent { what, tries }));
        }
        if let MavMessage::COMMAND_LONG(command) = &mut self.message {
            command.confirmation = self.tries.min(255) as u8;
        }
        self.tries += 1;
        self.next = now + self.patience.every;
        Step::send(self.message.clone())
    }
}

fn reason(result: MavResult) -> &'static str {
    match result {
        MavResult::MAV_RESULT_ACCEPTED => "accepted",
        MavResult::MAV_RESULT_TEMPORARILY_REJECTED => "not now (temporarily rejected)",
        MavResult::MAV_RESULT_DENIED => "denied",
        MavResult::MAV_RESULT_UNSUPPORTED => {
            "its firmware does not know the command: is it the show firmware?"
        }
        MavResult::MAV_RESULT_FAILED => "failed",
        MavResult::MAV_RESULT_CANCELLED => "cancelled",
        _ => "not in this form",
    }
}
