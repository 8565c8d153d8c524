//! Options of a start: its time, a person's word, and what Ctrl-C means.

use clap::{Args, ValueEnum};

use crate::fleet::start::{LEAST_LEAD_S, MOST_LEAD_S};
use crate::workflow::fleet::interrupt::Choice;
use crate::workflow::fleet::start::Lead;

/// How a start is given.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct LeadArgs {
    /// Time from now to the start, s of the drones' time, 20 to 43200
    #[arg(long, value_name = "S", default_value_t = 30.0, value_parser = lead_seconds)]
    pub(in crate::cli) lead: f64,
    /// Authorize the start without asking
    #[arg(short, long)]
    yes: bool,
    #[command(flatten)]
    interrupt: InterruptArgs,
}

/// Parser of `--lead`: nothing has been sent when it refuses.
fn lead_seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (LEAST_LEAD_S..=MOST_LEAD_S).contains(&value) => Ok(value),
        _ => Err(format!(
            "a lead between {LEAST_LEAD_S} and {MOST_LEAD_S} s: the drones set their home and arm in \
             the last 10 s"
        )),
    }
}

impl LeadArgs {
    pub(in crate::cli) fn lead(&self) -> Lead {
        let on_interrupt = self.interrupt.on_interrupt.into();
        Lead { ahead_s: self.lead, yes: self.yes, on_interrupt }
    }
}

/// What drones in the air do when the program that watches or flies them is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum OnInterrupt {
    /// They land where they are
    Land,
    /// They return to where they took off, and land there
    Return,
    /// They are left flying: a show continues by itself; drones flown with --guided stop within 3 s
    /// and return by their own failsafe
    Leave,
}

impl From<OnInterrupt> for Choice {
    fn from(choice: OnInterrupt) -> Self {
        match choice {
            OnInterrupt::Land => Self::Land,
            OnInterrupt::Return => Self::Return,
            OnInterrupt::Leave => Self::Leave,
        }
    }
}

/// What Ctrl-C does in flight.
#[derive(Clone, Copy, Debug, Args)]
pub(in crate::cli) struct InterruptArgs {
    /// What drones in the air do on Ctrl-C, SIGTERM or SIGHUP (a lost terminal)
    ///
    /// On a terminal it is asked, and this is the answer after 15 s, at Enter, and at a second
    /// Ctrl-C; elsewhere it is done at once. While it is done, another Ctrl-C ends the program at
    /// once and says what becomes of the drones.
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = OnInterrupt::Return)]
    pub(in crate::cli) on_interrupt: OnInterrupt,
}
