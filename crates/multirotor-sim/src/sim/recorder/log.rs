//! The log of one flight: which rows are due at which step.

use std::io::{self, Write};

use super::battery::Battery;
use super::clock::Clock;
use super::events::Events;
use super::full::{self, Full};
use super::lights::Lights;
use super::view::View;
use super::{Moment, Recorder, control, navigation, start};
use crate::effects::Reading;
use crate::sim::flight::{FlightSetup, STEP_S, STEP_US};
use dataflash::time::GpsTime;
use dataflash::{LogWriter, MessageDef, catalog};

/// Control steps between two of the rows that a log has 25 times a second.
const STEPS_25_HZ: u64 = 16;
/// Number of control steps between rows that a log has ten times a second.
pub const STEPS_10_HZ: u64 = 40;

/// Writes a DataFlash log as the show firmware does.
pub struct LogRecorder<'a, W: Write> {
    log: LogWriter<W>,
    clock: Clock,
    view: View,
    battery: Battery,
    events: Events,
    lights: Lights<'a>,
    full: Option<Full>,
    has_show: bool,
    has_speeds: bool,
    rows: u64,
}

impl<'a, W: Write> LogRecorder<'a, W> {
    /// Starts the log of a flight that arms at this show time (us): definitions and first rows. A
    /// guided vehicle's log knows no show. Its board time counts from `booted`, or from a time of the
    /// seed's.
    pub(in crate::sim) fn new(
        out: W,
        setup: &FlightSetup<'a>,
        armed_us: i64,
        is_guided: bool,
        booted: Option<GpsTime>,
    ) -> io::Result<Self> {
        let clock = Clock::new(setup.seed, setup.drone, armed_us, setup.start, booted);
        let view = View::new(&setup.frame, setup.home_m);
        let board_us = clock.board_us(armed_us);
        let mut log =
            LogWriter::with_time(out, &messages(setup, is_guided), board_us.max(0) as u64)?;
        let rows = start::write(&mut log, setup, &view, board_us, is_guided)?;
        Ok(Self {
            log,
            clock,
            view,
            battery: Battery::new(setup.vehicle),
            events: Events::new(),
            lights: Lights::new(setup.lights),
            full: setup.full_logs.then(|| Full::new(setup, &view)),
            has_show: !is_guided,
            has_speeds: setup.vehicle.autopilot.esc_telemetry,
            rows,
        })
    }

    /// State of the battery in the latest rows.
    pub(in crate::sim) fn battery(&self) -> Reading {
        self.battery.reading()
    }

    /// Ends the log; returns its number of rows.
    pub(in crate::sim) fn finish(self) -> io::Result<u64> {
        self.log.finish()?;
        Ok(self.rows)
    }
}

/// The messages of the log.
fn messages(setup: &FlightSetup<'_>, is_guided: bool) -> Vec<&'static MessageDef> {
    let mut messages = if setup.full_logs {
        catalog::FULL_SET.to_vec()
    } else {
        let mut messages = catalog::DEFAULT_SET.to_vec();
        messages.push(&catalog::GUIP);
        messages
    };
    if setup.vehicle.autopilot.esc_telemetry {
        messages.push(&catalog::ESC);
    }
    messages.retain(|message| !(is_guided && message.name == catalog::SHOW.name));
    messages
}

impl<W: Write> Recorder for LogRecorder<'_, W> {
    #[inline]
    fn record(&mut self, moment: &Moment<'_>) -> io::Result<()> {
        let board_us = self.clock.board_us(moment.time_us);
        let log = &mut self.log;
        self.rows += self.events.write(log, moment.pilot, board_us)?;
        self.rows += control::write_target(log, moment, &self.view, board_us)?;
        if let Some(fix) = self.clock.fix(moment.time_us, STEP_US) {
            self.rows += navigation::write_gps(log, moment, &self.view, board_us, fix)?;
            if self.full.is_some() {
                self.rows += full::write_accuracy(log, board_us)?;
            }
        }
        if self.has_show && moment.step.is_multiple_of(STEPS_25_HZ) {
            let color = self.lights.color(moment.pilot, moment.time_us.div_euclid(1000));
            self.rows += control::write_show(log, moment, color, board_us)?;
        }
        if moment.step.is_multiple_of(STEPS_10_HZ) {
            self.battery.draw(moment.plant, STEPS_10_HZ as f64 * STEP_S);
            let attitude = self.view.euler(&moment.estimate.rotation);
            self.rows +=
                control::write(log, moment, &self.view, &attitude, &self.battery, board_us)?;
            self.rows += navigation::write(log, moment, &self.view, &attitude, board_us)?;
            if self.has_speeds {
                self.rows += control::write_speeds(log, moment, &self.battery, board_us)?;
            }
        }
        if let Some(full) = &mut self.full {
            self.rows += full.write(log, moment, &self.view, board_us)?;
        }
        Ok(())
    }
}
