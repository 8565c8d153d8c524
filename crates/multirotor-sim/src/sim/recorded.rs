//! A flight that is simulated step by step, with its log.

use std::io::{self, Write};
use std::sync::{Arc, Mutex, PoisonError};

use super::error::SimError;
use super::flight::{FlightSetup, FlightSummary};
use super::flying::OngoingFlight;
use super::recorder::LogRecorder;
use crate::effects::Reading;
use dataflash::time::GpsTime;

/// A flight whose log is taken away as it grows. All its pieces together are the log that
/// [`super::fly`] writes, if nothing disturbs the flight.
pub struct RecordedFlight<'a> {
    /// Flight that is recorded.
    pub flight: OngoingFlight<'a>,
    recorder: Option<LogRecorder<'a, Tap>>,
    tap: Tap,
    drone: u16,
}

/// Bytes that wait to be taken away.
#[derive(Clone, Debug, Default)]
struct Tap(Arc<Mutex<Vec<u8>>>);

impl Write for Tap {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> RecordedFlight<'a> {
    /// Prepares a drone that arms at this show time (s), or when the firmware does by itself,
    /// whichever is later. Board time in its log counts from `booted`, or from an instant that the
    /// seed determines.
    ///
    /// # Errors
    /// See [`SimError`].
    pub fn armed(
        setup: &FlightSetup<'a>,
        armed_s: Option<f64>,
        booted: Option<GpsTime>,
    ) -> Result<Self, SimError> {
        Self::of(setup, OngoingFlight::armed(setup, armed_s)?, booted)
    }

    /// Prepares a drone that arms at show time 0 in GUIDED, see [`OngoingFlight::guided`]; `booted` as in
    /// [`Self::armed`].
    ///
    /// # Errors
    /// See [`SimError`].
    pub fn guided(setup: &FlightSetup<'a>, booted: Option<GpsTime>) -> Result<Self, SimError> {
        Self::of(setup, OngoingFlight::guided(setup)?, booted)
    }

    fn of(
        setup: &FlightSetup<'a>,
        flight: OngoingFlight<'a>,
        booted: Option<GpsTime>,
    ) -> Result<Self, SimError> {
        let tap = Tap::default();
        let (armed_us, is_guided) = (flight.armed_us(), flight.is_guided());
        let recorder = LogRecorder::new(tap.clone(), setup, armed_us, is_guided, booted)
            .map_err(|source| SimError::Log { drone: setup.drone, source })?;
        Ok(Self { flight, recorder: Some(recorder), tap, drone: setup.drone })
    }

    /// Flies all steps before this show time, s. Returns whether the flight and its log have ended.
    ///
    /// # Errors
    /// See [`SimError`]; the flight cannot go on then.
    pub fn step_until(&mut self, time_s: f64) -> Result<bool, SimError> {
        let Some(recorder) = &mut self.recorder else { return Ok(true) };
        let is_over = self.flight.step_until(time_s, recorder)?;
        if is_over && let Some(recorder) = self.recorder.take() {
            recorder.finish().map_err(|source| SimError::Log { drone: self.drone, source })?;
        }
        Ok(is_over)
    }

    /// Takes the bytes by which the log has grown since the last call.
    pub fn take_log(&mut self) -> Vec<u8> {
        std::mem::take(&mut *self.tap.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// State of the battery as the log has it: the vehicle's own, or one that acts on nothing where its effects have
    /// none. `None` when the log has ended.
    pub fn battery(&self) -> Option<Reading> {
        self.recorder.as_ref().map(LogRecorder::battery)
    }

    /// Outcome of the flight so far.
    pub fn summary(&self) -> FlightSummary {
        self.flight.summary()
    }
}
