//! Logs of drones that flew plans, aborted them, and were switched off in between.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use nalgebra::Vector3;
use updraft::base::frame::Geodetic;
use updraft::base::time::GpsTime;
use updraft::log::catalog::{ARM, ATT, GPS, GUIP, PARM, RCOU, SHOW, XKF1};
use updraft::log::{LogWriter, MessageDef, Value};
use updraft::mission::Plan;
use updraft::mission::plan::Segment;

/// Rows a second.
const RATE_HZ: f64 = 2.0;
/// Armed so long before show time 0, s.
const ARMED_BEFORE_S: f64 = 7.0;

/// What a drone did in a boot.
#[derive(Clone, Copy)]
pub(crate) struct Sortie<'a> {
    pub(crate) plan: &'a Plan,
    /// GPS time of show time 0.
    pub(crate) start: GpsTime,
    /// Share of the plan after which it landed; 1: all; 0: it never took off.
    pub(crate) share: f64,
}

/// `start` plus seconds.
pub(crate) fn later(start: GpsTime, seconds: f64) -> GpsTime {
    GpsTime::from_total_ms(start.total_ms() + (seconds * 1000.0).round() as i64).unwrap()
}

/// A drone that logs.
#[derive(Clone, Copy)]
pub(crate) struct Logger {
    pub(crate) system: Option<u8>,
    /// Where it stands, beside the slot's home, m to the show's x.
    pub(crate) slot: u16,
    pub(crate) offset_m: f64,
    pub(crate) booted: GpsTime,
    pub(crate) has_gps: bool,
    pub(crate) has_show: bool,
}

impl Logger {
    pub(crate) fn of(slot: u16, booted: GpsTime) -> Self {
        let system = u8::try_from(slot).ok();
        Self { system, slot, offset_m: 0.3, booted, has_gps: true, has_show: true }
    }

    /// The log of one boot: its sorties, one after the other in the same file.
    pub(crate) fn log(&self, sorties: &[Sortie<'_>]) -> Vec<u8> {
        let messages = [&PARM, &SHOW, &ATT, &RCOU, &XKF1, &GUIP, &GPS, &ARM];
        let mut log = LogWriter::new(Vec::new(), &messages).unwrap();
        let mut parameter = |name: &str, value: f64| {
            let values = [("Name", Value::Text(name)), ("Value", Value::Float(value))];
            row(&mut log, &PARM, &values);
        };
        if let Some(system) = self.system {
            parameter("SYSID_THISMAV", system.into());
        }
        parameter("SHOW_VEL_FF_GAIN", 1.0);
        parameter("LOG_DISARMED", 0.0);
        for sortie in sorties {
            self.fly(&mut log, sortie);
        }
        log.finish().unwrap()
    }

    fn fly(&self, log: &mut LogWriter<Vec<u8>>, sortie: &Sortie<'_>) {
        let slot = sortie.plan.slot(self.slot).unwrap();
        let segments = sortie.plan.segments(slot);
        let home = Vector3::from(slot.home_m) + Vector3::new(self.offset_m, 0.0, 0.0);
        let Geodetic { lat_deg, lon_deg, .. } = sortie.plan.site.frame().to_geodetic(home);
        let flown_s = segments.last().unwrap().end_ms as f64 / 1000.0 * sortie.share;
        let start_s = (sortie.start.total_ms() - self.booted.total_ms()) as f64 / 1000.0;
        let (mut time_s, mut height_m) = (-ARMED_BEFORE_S, 0.0_f64);
        let mut armed = None;
        loop {
            let board = Value::Int(((start_s + time_s) * 1e6).round() as i64);
            let is_up = sortie.share > 0.0 && time_s >= 0.0;
            let up_mps = match () {
                () if !is_up => 0.0,
                () if time_s < flown_s => planned_up_mps(segments, time_s),
                () if height_m > 0.0 => -1.0,
                () => 0.0,
            };
            let has_ended = time_s > flown_s && (height_m <= 0.0 || !is_up);
            let is_armed = !has_ended;
            if armed != Some(is_armed) {
                armed = Some(is_armed);
                row(log, &ARM, &[("TimeUS", board), ("ArmState", Value::Int(is_armed.into()))]);
            }
            let gps = later(sortie.start, time_s);
            if self.has_gps {
                let fix = [
                    ("TimeUS", board),
                    ("Status", Value::Int(6)),
                    ("GWk", Value::Int(gps.week.into())),
                    ("GMS", Value::Int(gps.tow_ms.into())),
                    ("Lat", Value::Float(lat_deg)),
                    ("Lng", Value::Float(lon_deg)),
                ];
                row(log, &GPS, &fix);
            }
            let stage = match () {
                () if !is_up => 2,
                () if time_s < 1.5 => 3,
                () if time_s < flown_s => 4,
                () if is_armed => 7,
                () => 8,
            };
            if self.has_show {
                let clock = Value::Int((time_s * 1000.0).round() as i64);
                let show = [("TimeUS", board), ("ClockMS", clock), ("Stage", Value::Int(stage))];
                row(log, &SHOW, &show);
            }
            row(log, &ATT, &[("TimeUS", board)]);
            let pulse = Value::Int(if is_up && is_armed { 1550 } else { 1000 });
            let motors = [("C1", pulse), ("C2", pulse), ("C3", pulse), ("C4", pulse)];
            row(log, &RCOU, &[&[("TimeUS", board)][..], &motors].concat());
            let filter = [("VD", Value::Float(-up_mps)), ("PD", Value::Float(-height_m))];
            row(log, &XKF1, &[&[("TimeUS", board)][..], &filter].concat());
            let command = [("Type", Value::Int(3)), ("vZ", Value::Float(100.0 * up_mps))];
            row(log, &GUIP, &[&[("TimeUS", board)][..], &command].concat());
            height_m = (height_m + up_mps / RATE_HZ).max(0.0);
            time_s += 1.0 / RATE_HZ;
            if has_ended && time_s > flown_s + 3.0 {
                return;
            }
        }
    }
}

fn planned_up_mps(segments: &[Segment], time_s: f64) -> f64 {
    let segment = segments.iter().find(|segment| segment.end_ms as f64 > time_s * 1000.0);
    segment.map_or(0.0, |segment| segment.velocity_mps[2])
}

fn row(log: &mut LogWriter<Vec<u8>>, message: &'static MessageDef, values: &[(&str, Value<'_>)]) {
    let value = |label| {
        let given = values.iter().find(|(name, _)| *name == label);
        given.map_or(Value::Int(0), |(_, value)| *value)
    };
    let row: Vec<Value<'_>> = message.fields.split(',').map(value).collect();
    log.row(message, &row).unwrap();
}
