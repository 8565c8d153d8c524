//! Telemetry: the state of each vehicle, from the messages that it sends unasked.
//!
//! Memory is bounded: the last value of everything, and the last few texts.

use std::collections::{BTreeMap, VecDeque};

use super::messages::chars;
use super::vehicle_clock::VehicleClock;
use crate::link::clock::{Micros, S};
use crate::link::conversation::Observer;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::net::Received;
use crate::protocol::show::{CAPABILITY, FROM_DRONE, Status};
use dataflash::time::GpsTime;

/// Number of texts that are kept per vehicle.
pub const TEXTS: usize = 16;
/// Longest text, characters: those of several pieces end here.
const TEXT: usize = 250;
/// A board's time that is older by so much is that of another boot; by less it was overtaken, ms.
const RESTARTED_MS: u32 = 10_000;
/// Positions that the link's quality is taken from.
const BEATS: usize = 20;
/// Gaps between positions that agree are a rate.
const RATE_GAPS: usize = 4;

/// Version of a vehicle's firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Version {
    /// Whether it is the show firmware.
    pub show: bool,
    /// Version number: major, minor, patch.
    pub number: [u8; 3],
    /// Revision of its sources, as the vehicle states it; zeros: not stated.
    pub revision: [u8; 8],
}

impl std::fmt::Display for Version {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [major, minor, patch] = self.number;
        let kind = if self.show { "show" } else { "stock" };
        write!(f, "{kind} {major}.{minor}.{patch}")
    }
}

/// Position and velocity of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Position {
    /// Latitude, degrees, north positive.
    pub lat_deg: f64,
    /// Longitude, degrees, east positive.
    pub lon_deg: f64,
    /// Altitude above mean sea level, m.
    pub amsl_m: f64,
    /// Height above home, m.
    pub above_home_m: f64,
    /// Velocity to the north, to the east and up, m/s.
    pub neu_mps: [f64; 3],
    /// Heading, degrees clockwise from north, if known.
    pub heading_deg: Option<f64>,
    /// Time of the measurement, ms since the vehicle was switched on.
    pub boot_ms: u32,
}

impl Position {
    /// Whether it is a real place: without a fix the firmware sends zeros.
    pub fn has_place(&self) -> bool {
        self.lat_deg != 0.0 || self.lon_deg != 0.0
    }
}

/// State of a vehicle's GPS receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gps {
    /// Fix type: 3 is 3-D, 4 differential, 5 and 6 RTK.
    pub fix: u8,
    /// Number of satellites in use.
    pub satellites: u8,
    /// Estimated horizontal accuracy, m, if known.
    pub h_acc_m: Option<f64>,
}

/// State of a vehicle's battery and arming checks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Health {
    /// Whether all arming checks pass; `None` if the firmware does not report it.
    pub prearm_ok: Option<bool>,
    /// Battery voltage, V, if measured.
    pub battery_v: Option<f64>,
    /// Battery current, A, if measured.
    pub battery_a: Option<f64>,
    /// Charge left, %, if known.
    pub battery_percent: Option<u8>,
}

/// Attitude of a vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Attitude {
    /// Roll, rad, right side down positive.
    pub roll_rad: f64,
    /// Pitch, rad, nose up positive.
    pub pitch_rad: f64,
    /// Time of the measurement, ms since the vehicle was switched on.
    pub boot_ms: u32,
}

/// Outputs of a vehicle's first eight channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// Pulse widths, us; 0: no output.
    pub pulses_us: [u16; 8],
    /// Time of the outputs, us since the vehicle was switched on; it begins anew after 71 min.
    pub boot_us: u32,
}

/// A text that a vehicle sent.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Text {
    /// Time at which its last piece came, us.
    pub at: Micros,
    /// Severity of the text in MAVLink: 0 emergency ... 3 error, 4 warning, 6 info.
    pub severity: u8,
    /// Text, joined from its pieces.
    pub text: String,
    id: u16,
}

/// A value with the time at which it came, us; `None` if it never came.
pub type Heard<T> = Option<(Micros, T)>;

/// State of one vehicle, as far as it was heard.
#[derive(Clone, Debug, Default)]
pub struct Drone {
    /// Time of the last message, us.
    pub heard: Micros,
    /// Flight mode, from the heartbeat.
    pub mode: Heard<u32>,
    /// Whether the motors may run, from the heartbeat.
    pub armed: Heard<bool>,
    /// The show firmware's status packet.
    pub status: Heard<Status>,
    /// Position and velocity of the vehicle.
    pub position: Heard<Position>,
    /// State of the GPS receiver.
    pub gps: Heard<Gps>,
    /// State of the battery and the arming checks.
    pub health: Heard<Health>,
    /// Attitude of the vehicle, where it was asked for.
    pub attitude: Heard<Attitude>,
    /// Pulse widths of its outputs, where they were asked for.
    pub outputs: Heard<Outputs>,
    /// Strength of the radio's signal, % of the best, where the vehicle passes it on.
    pub signal: Heard<u8>,
    /// Clock of the vehicle.
    pub clock: VehicleClock,
    /// GPS time when it was switched on, by its own clock.
    pub booted: Option<GpsTime>,
    /// Version of the firmware, if it was reported.
    pub version: Option<Version>,
    /// Last texts of the vehicle, oldest first.
    pub texts: VecDeque<Text>,
    /// Number of texts so far, which exceeds those in `texts` once some are forgotten.
    pub texts_said: u64,
    /// Number of restarts that were seen: the board's time went back.
    pub restarts: u32,
    /// The board's time that was heard last, ms.
    board_ms: Option<u32>,
    beats: VecDeque<u32>,
}

impl Drone {
    /// Whether the vehicle has the show firmware; `None` if that is not known yet.
    pub fn has_show_firmware(&self) -> Option<bool> {
        if self.status.is_some() {
            return Some(true);
        }
        self.version.map(|version| version.show)
    }

    /// Whether the motors may run; `None` before the first heartbeat.
    pub fn is_armed(&self) -> Option<bool> {
        self.armed.map(|(_, armed)| armed)
    }

    /// Share of the vehicle's regular messages that arrive, by the vehicle's own clock in them;
    /// `None` if they are too few.
    pub fn link_quality(&self) -> Option<f64> {
        let gaps: Vec<u32> = self.beats.iter().zip(self.beats.iter().skip(1)).map(gap).collect();
        if gaps.len() < 5 {
            return None;
        }
        let span: u64 = gaps.iter().copied().map(u64::from).sum();
        let sent = (span as f64 / f64::from(usual_gap(&gaps))).round().max(1.0);
        Some((gaps.len() as f64 / sent).min(1.0))
    }

    /// Strength of the radio's signal, % of the best; `None` if nobody tells it.
    pub fn signal_percent(&self) -> Option<f64> {
        self.signal.map(|(_, percent)| f64::from(percent))
    }

    /// Newest text that says why arming is refused, without its prefix.
    pub fn prearm_reason(&self) -> Option<&str> {
        let said = |text: &'_ Text| text.text.starts_with("PreArm: ");
        let text = self.texts.iter().rev().find(|text| said(text))?;
        text.text.strip_prefix("PreArm: ")
    }

    /// Takes a message of the vehicle.
    pub fn on_message(&mut self, now: Micros, message: &MavMessage) {
        self.heard = now;
        match message {
            MavMessage::HEARTBEAT(beat) => {
                self.mode = Some((now, beat.custom_mode));
                let armed = dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
                self.armed = Some((now, beat.base_mode.contains(armed)));
            }
            MavMessage::DATA16(data) if data.mavtype == FROM_DRONE => {
                let length = usize::from(data.len).min(data.data.len());
                self.status = Some((now, Status::from_data(&data.data[..length])));
            }
            MavMessage::GLOBAL_POSITION_INT(at) => {
                self.board_time(at.time_boot_ms);
                self.beat(at.time_boot_ms);
                self.position = Some((now, position(at)));
            }
            MavMessage::GPS_RAW_INT(gps) => {
                let h_acc_m = (gps.h_acc > 0).then(|| f64::from(gps.h_acc) / 1000.0);
                let (fix, satellites) = (gps.fix_type as u8, gps.satellites_visible);
                self.gps = Some((now, Gps { fix, satellites, h_acc_m }));
            }
            MavMessage::SYS_STATUS(status) => self.health = Some((now, health(status))),
            MavMessage::SYSTEM_TIME(time) => {
                self.board_time(time.time_boot_ms);
                self.clock.read(now, time.time_unix_usec);
                self.clock.read_board(time.time_boot_ms, time.time_unix_usec);
                let unix_ms = (time.time_unix_usec / 1000) as i64 - i64::from(time.time_boot_ms);
                let booted = GpsTime::from_unix_ms(unix_ms);
                // Before the first fix its clock says nothing.
                self.booted = booted.filter(|_| time.time_unix_usec > 0).or(self.booted);
            }
            MavMessage::STATUSTEXT(text) => self.text(now, text),
            MavMessage::ATTITUDE(at) => {
                self.board_time(at.time_boot_ms);
                let (roll_rad, pitch_rad) = (f64::from(at.roll), f64::from(at.pitch));
                let boot_ms = at.time_boot_ms;
                self.attitude = Some((now, Attitude { roll_rad, pitch_rad, boot_ms }));
            }
            MavMessage::SERVO_OUTPUT_RAW(out) if out.port == 0 => {
                let pulses_us = [
                    out.servo1_raw,
                    out.servo2_raw,
                    out.servo3_raw,
                    out.servo4_raw,
                    out.servo5_raw,
                    out.servo6_raw,
                    out.servo7_raw,
                    out.servo8_raw,
                ];
                self.outputs = Some((now, Outputs { pulses_us, boot_us: out.time_usec }));
            }
            MavMessage::RADIO_STATUS(radio) if radio.rssi != u8::MAX => {
                self.signal = Some((now, strength(radio.rssi)));
            }
            MavMessage::RC_CHANNELS(channels) if channels.rssi != u8::MAX => {
                self.signal = Some((now, strength(channels.rssi)));
            }
            MavMessage::AUTOPILOT_VERSION(version) => {
                let [_, patch, minor, major] = version.flight_sw_version.to_le_bytes();
                let show = version.capabilities.bits() & CAPABILITY != 0;
                let number = [major, minor, patch];
                let revision = version.flight_custom_version;
                self.version = Some(Version { show, number, revision });
            }
            _ => {}
        }
    }

    /// The board's time that was heard last, ms since the vehicle was switched on.
    pub fn board_ms(&self) -> Option<u32> {
        self.board_ms
    }

    /// Takes a time of its board. After a restart nothing that its old clock has said holds: what was
    /// measured at a time of the new boot would be put at one of the old.
    fn board_time(&mut self, boot_ms: u32) {
        let last_ms = self.board_ms.unwrap_or(boot_ms);
        if last_ms.saturating_sub(boot_ms) >= RESTARTED_MS {
            self.restarts += 1;
            self.clock = VehicleClock::default();
            self.booted = None;
            self.beats.clear();
            self.board_ms = Some(boot_ms);
        } else {
            self.board_ms = Some(last_ms.max(boot_ms));
        }
    }

    fn beat(&mut self, boot_ms: u32) {
        // Reordered or repeated.
        if self.beats.back().is_some_and(|last| boot_ms <= *last) {
            return;
        }
        self.beats.push_back(boot_ms);
        if self.beats.len() > BEATS {
            self.beats.pop_front();
        }
        let gaps: Vec<u32> = self.beats.iter().zip(self.beats.iter().skip(1)).map(gap).collect();
        let Some((before, newest)) = gaps.split_at_checked(gaps.len().saturating_sub(RATE_GAPS))
        else {
            return;
        };
        if !before.is_empty() && is_other_rate(before, newest) {
            self.beats.drain(..before.len());
        }
    }

    fn text(&mut self, now: Micros, text: &dialect::STATUSTEXT_DATA) {
        let words = chars(&text.text[..]);
        if text.id != 0
            && text.chunk_seq > 0
            && let Some(last) = self.texts.back_mut()
            && last.id == text.id
        {
            last.at = now;
            last.text.push_str(&words);
            last.text = last.text.chars().take(TEXT).collect();
            return;
        }
        self.texts_said += 1;
        let severity = text.severity as u8;
        self.texts.push_back(Text { at: now, severity, text: words, id: text.id });
        if self.texts.len() > TEXTS {
            self.texts.pop_front();
        }
    }
}

/// A signal of 0 to 254, in %.
fn strength(rssi: u8) -> u8 {
    (f64::from(rssi) / 2.54).round() as u8
}

/// The gap at which nothing is missing: a small one, but none that is alone, as the first ones of a higher rate are.
fn usual_gap(gaps: &[u32]) -> u32 {
    let mut sorted = gaps.to_vec();
    sorted.sort_unstable();
    let rank = (gaps.len() / 3).clamp(1, RATE_GAPS);
    sorted.get(rank - 1).copied().unwrap_or(0).max(1)
}

/// Whether the newest gaps are those of a rate that was asked for anew, and not of a link that loses: these differ
/// from each other.
fn is_other_rate(before: &[u32], newest: &[u32]) -> bool {
    let (Some(&least), Some(&most)) = (newest.iter().min(), newest.iter().max()) else {
        return false;
    };
    let usual = f64::from(usual_gap(before));
    let agree = f64::from(most) <= 1.15 * f64::from(least);
    agree && (f64::from(least) > 1.3 * usual || f64::from(most) < usual / 1.3)
}

fn gap((earlier, later): (&u32, &u32)) -> u32 {
    later - earlier
}

fn position(at: &dialect::GLOBAL_POSITION_INT_DATA) -> Position {
    let mps = |cm: i16| f64::from(cm) / 100.0;
    Position {
        lat_deg: f64::from(at.lat) / 1e7,
        lon_deg: f64::from(at.lon) / 1e7,
        amsl_m: f64::from(at.alt) / 1000.0,
        above_home_m: f64::from(at.relative_alt) / 1000.0,
        neu_mps: [mps(at.vx), mps(at.vy), -mps(at.vz)],
        heading_deg: (at.hdg != u16::MAX).then(|| f64::from(at.hdg) / 100.0),
        boot_ms: at.time_boot_ms,
    }
}

fn health(status: &dialect::SYS_STATUS_DATA) -> Health {
    let prearm = dialect::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
    let known = status.onboard_control_sensors_enabled.contains(prearm);
    let volts = f64::from(status.voltage_battery) / 1000.0;
    Health {
        prearm_ok: known.then(|| status.onboard_control_sensors_health.contains(prearm)),
        battery_v: (status.voltage_battery != u16::MAX).then_some(volts),
        battery_a: (status.current_battery >= 0).then(|| f64::from(status.current_battery) / 100.0),
        battery_percent: u8::try_from(status.battery_remaining).ok().filter(|left| *left <= 100),
    }
}

/// State of all vehicles that were heard.
#[derive(Clone, Debug, Default)]
pub struct Telemetry {
    /// Vehicles that were heard at least once.
    pub drones: BTreeMap<DroneId, Drone>,
}

/// Time without a message after which a drone counts as silent, us.
pub const SILENT_AFTER: Micros = 5 * S;

impl Telemetry {
    /// Vehicles that have restarted and have not reported their time since.
    pub fn timeless(&self, now: Micros) -> Vec<DroneId> {
        let all = self.drones.iter();
        all.filter(|(_, of)| of.restarts > 0 && of.clock.gps_ms(now).is_none())
            .map(|(drone, _)| *drone)
            .collect()
    }

    /// State of a vehicle; `None` if it was never heard.
    pub fn get(&self, drone: DroneId) -> Option<&Drone> {
        self.drones.get(&drone)
    }
}

impl Observer for Telemetry {
    fn on_message(&mut self, now: Micros, received: &Received) {
        self.drones.entry(received.from).or_default().on_message(now, &received.message);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(id: u16, chunk_seq: u8, text: &str) -> MavMessage {
        MavMessage::STATUSTEXT(dialect::STATUSTEXT_DATA {
            text: text.into(),
            id,
            chunk_seq,
            ..Default::default()
        })
    }

    #[test]
    fn texts_are_joined_and_the_oldest_forgotten() {
        let mut drone = Drone::default();
        drone.on_message(1, &said(3, 0, "PreArm: Need "));
        drone.on_message(2, &said(3, 1, "Position Estimate"));
        assert_eq!(drone.prearm_reason(), Some("Need Position Estimate"));
        for number in 0..100 {
            drone.on_message(3, &said(0, 0, &number.to_string()));
        }
        assert_eq!((drone.texts.len(), drone.texts_said), (TEXTS, 101));
        for seq in 1..=255 {
            drone.on_message(4, &said(9, seq, &"x".repeat(50)));
        }
        assert_eq!(drone.texts.back().unwrap().text.len(), TEXT);
    }

    #[test]
    fn quality_is_the_share_that_arrives_at_any_rate_of_time() {
        let mut drone = Drone::default();
        for number in 0..40_u32 {
            // Every fourth one is lost, some come twice.
            if number % 4 != 3 {
                let beat = dialect::GLOBAL_POSITION_INT_DATA {
                    time_boot_ms: 500 * number,
                    ..Default::default()
                };
                drone.on_message(u64::from(number), &MavMessage::GLOBAL_POSITION_INT(beat.clone()));
                drone.on_message(u64::from(number), &MavMessage::GLOBAL_POSITION_INT(beat));
            }
        }
        let quality = drone.link_quality().unwrap();
        assert!((quality - 0.75).abs() < 0.05, "{quality}");
    }

    #[test]
    fn another_rate_of_positions_is_no_loss() {
        let mut drone = Drone::default();
        let mut at_ms = 0;
        // As stations ask: slowly on the ground, fast in the air, slowly for the logs.
        for (gap_ms, count) in [(1000, 30), (400, 30), (200, 30), (1000, 30)] {
            for number in 0..count {
                at_ms += gap_ms;
                let beat =
                    dialect::GLOBAL_POSITION_INT_DATA { time_boot_ms: at_ms, ..Default::default() };
                drone.on_message(u64::from(at_ms), &MavMessage::GLOBAL_POSITION_INT(beat));
                // The first few of a slower rate are like those of a link that loses.
                if number >= 4
                    && let Some(quality) = drone.link_quality()
                {
                    assert!(quality > 0.95, "{quality} at {at_ms} ms");
                }
            }
        }
    }

    #[test]
    fn the_firmware_is_known_from_its_version_or_its_status() {
        let mut drone = Drone::default();
        assert_eq!(drone.has_show_firmware(), None);
        let mut version = dialect::AUTOPILOT_VERSION_DATA {
            flight_sw_version: u32::from_be_bytes([4, 6, 1, 255]),
            flight_custom_version: *b"0123abcd",
            ..Default::default()
        };
        drone.on_message(1, &MavMessage::AUTOPILOT_VERSION(version.clone()));
        assert_eq!(drone.version.unwrap().to_string(), "stock 4.6.1");
        assert_eq!(drone.version.unwrap().revision, *b"0123abcd");
        assert_eq!(drone.has_show_firmware(), Some(false));
        version.capabilities = dialect::MavProtocolCapability::from_bits_retain(CAPABILITY);
        drone.on_message(1, &MavMessage::AUTOPILOT_VERSION(version));
        assert_eq!(drone.version.unwrap().to_string(), "show 4.6.1");
    }

    #[test]
    fn up_is_positive() {
        let mut drone = Drone::default();
        let at =
            dialect::GLOBAL_POSITION_INT_DATA { vz: -150, hdg: u16::MAX, ..Default::default() };
        drone.on_message(1, &MavMessage::GLOBAL_POSITION_INT(at));
        let (_, position) = drone.position.unwrap();
        assert_eq!(position.neu_mps, [0.0, 0.0, 1.5]);
        assert_eq!(position.heading_deg, None);
    }
}
