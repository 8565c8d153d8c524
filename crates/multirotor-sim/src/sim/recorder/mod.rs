//! Recorder of a flight, which writes its log.
//!
//! A [`Recorder`] sees every control step. The one that writes DataFlash logs has one file for each
//! group of messages; `view` is the border where the show frame becomes north, east, down.

mod battery;
mod clock;
mod control;
mod ekf;
mod events;
mod full;
mod lights;
mod log;
mod navigation;
mod start;
mod view;

use std::io;

use super::air::Surroundings;
use super::autopilot::Autopilot;
use super::plant::Plant;
use super::sensors::Estimate;
pub use log::{LogRecorder, STEPS_10_HZ};
pub use start::FIRMWARE_MARK;

/// State of a flight at one control step, before the body moves.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// Number of the step since arming.
    pub step: u64,
    /// Show time, us.
    pub time_us: i64,
    /// Autopilot after the step.
    pub pilot: &'a Autopilot<'a>,
    /// State estimate that the autopilot used in the step, its vertical speed as the log has it.
    pub estimate: &'a Estimate,
    /// Body with its true motion.
    pub plant: &'a Plant,
    /// Air around the body.
    pub around: &'a Surroundings,
}

/// Observer of every control step of a flight.
pub trait Recorder {
    /// Takes one step.
    ///
    /// # Errors
    ///
    /// If the record could not be kept, which ends the flight.
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()>;
}

/// A recorder that records nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoLog;

impl Recorder for NoLog {
    fn record(&mut self, _moment: &Moment<'_>) -> io::Result<()> {
        Ok(())
    }
}
