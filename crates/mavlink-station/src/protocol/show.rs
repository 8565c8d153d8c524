//! The drone-show protocol of the ArduCopter fork: commands, start packets, status packets.

use std::fmt;

/// MAV_CMD_USER_1, which reloads (param1 0) or clears (1) the show.
pub const RELOAD: u16 = 31010;
/// MAV_CMD_USER_2, which sets origin, altitude reference and orientation; COMMAND_INT only.
pub const SET_ORIGIN: u16 = 31011;
/// Altitude in [`SET_ORIGIN`] that means "relative to home", mm.
pub const NO_AMSL_MM: i32 = -32_768_000;
/// Custom mode number of the show mode.
pub const SHOW_MODE: u32 = 127;
/// Bit of AUTOPILOT_VERSION.capabilities that marks firmware with show mode.
pub const CAPABILITY: u64 = 0x0400_0000;
/// Path of the show file on the vehicle.
pub const SHOW_FILE: &str = "/collmot/show.skyb";
/// Type of DATA packets to the drone.
pub const TO_DRONE: u8 = 0x5C;
/// Type of DATA packets from the drone.
pub const FROM_DRONE: u8 = 0x5B;
/// Start time that means "leave it as it is".
pub const LEAVE_TIME: i32 = i32::MAX;
/// Start time that clears the one that is set, as all below zero do.
pub const CLEAR_TIME: i32 = i32::MIN;

const START_CONFIG: u8 = 1;

/// Start time and authorization, as a start packet carries them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StartConfig {
    /// Start time, GPS second of week; or [`CLEAR_TIME`], or [`LEAVE_TIME`].
    pub start_tow_s: i32,
    /// Authorization: 0 none, 1 live (4.6 has rehearsal 2 and lights 3, too).
    pub authorization: u8,
    /// Countdown, ms, for vehicles that synchronise by it: a time, [`CLEAR_TIME`] or
    /// [`LEAVE_TIME`].
    pub countdown_ms: i32,
}

impl StartConfig {
    /// Encodes the data of a DATA16 packet of type [`TO_DRONE`], with its length. The last two
    /// bytes are a millisecond offset, always 0 (as Skybrush Server sends it).
    pub fn to_data(&self) -> ([u8; 16], u8) {
        let mut data = [0; 16];
        data[0] = START_CONFIG;
        data[1..5].copy_from_slice(&self.start_tow_s.to_le_bytes());
        data[5] = self.authorization;
        data[6..10].copy_from_slice(&self.countdown_ms.to_le_bytes());
        (data, 12)
    }

    /// Decodes the data of a packet of type [`TO_DRONE`]; `None` for other kinds and short ones. A
    /// countdown that is missing becomes [`LEAVE_TIME`].
    pub fn from_data(data: &[u8], length: u8) -> Option<Self> {
        let data = data.get(..usize::from(length))?;
        if data.len() < 6 || data[0] != START_CONFIG {
            return None;
        }
        let number = |at: usize| {
            data.get(at..at + 4)
                .map(|bytes| i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]))
        };
        Some(Self {
            start_tow_s: number(1)?,
            authorization: data[5],
            countdown_ms: number(6).unwrap_or(LEAVE_TIME),
        })
    }
}

/// Stage of a drone in its show. Names are the firmware's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// Not in show mode.
    Off,
    /// Entering show mode.
    Init,
    /// Waiting for the start time.
    WaitForStart,
    /// Taking off by itself.
    Takeoff,
    /// Flying its trajectory.
    Performing,
    /// Returning to where it took off.
    ReturnToLaunch,
    /// Staying where it is.
    Loiter,
    /// Landing where its trajectory ended.
    Landing,
    /// On the ground, disarmed.
    Landed,
    /// Error: the show was given up.
    Error,
    /// Showing its lights on the ground (4.6).
    TestingLights,
    /// A stage that this program does not know, by its number.
    Other(u8),
}

impl Stage {
    /// Stage of the firmware's number.
    pub fn from_number(number: u8) -> Self {
        match number {
            0 => Self::Off,
            1 => Self::Init,
            2 => Self::WaitForStart,
            3 => Self::Takeoff,
            4 => Self::Performing,
            5 => Self::ReturnToLaunch,
            6 => Self::Loiter,
            7 => Self::Landing,
            8 => Self::Landed,
            9 => Self::Error,
            10 => Self::TestingLights,
            other => Self::Other(other),
        }
    }

    /// Number of the stage in the firmware.
    pub fn number(self) -> u8 {
        match self {
            Self::Off => 0,
            Self::Init => 1,
            Self::WaitForStart => 2,
            Self::Takeoff => 3,
            Self::Performing => 4,
            Self::ReturnToLaunch => 5,
            Self::Loiter => 6,
            Self::Landing => 7,
            Self::Landed => 8,
            Self::Error => 9,
            Self::TestingLights => 10,
            Self::Other(number) => number,
        }
    }

    /// Whether the drone is off the ground on its own.
    pub fn is_flying(self) -> bool {
        matches!(
            self,
            Self::Takeoff | Self::Performing | Self::ReturnToLaunch | Self::Loiter | Self::Landing
        )
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            Self::Off => "off",
            Self::Init => "init",
            Self::WaitForStart => "waiting for start",
            Self::Takeoff => "take-off",
            Self::Performing => "performing",
            Self::ReturnToLaunch => "RTL",
            Self::Loiter => "loiter",
            Self::Landing => "landing",
            Self::Landed => "landed",
            Self::Error => "error",
            Self::TestingLights => "testing lights",
            Self::Other(number) => return f.pad(&format!("stage {number}")),
        };
        f.pad(text)
    }
}

/// Bits of [`Status::flags`]: state of the show.
pub mod flag {
    /// A show is loaded and its take-off time is valid.
    pub const LOADED: u8 = 0x80;
    /// A start time is set.
    pub const START_SET: u8 = 0x40;
    /// The origin is set.
    pub const ORIGIN_SET: u8 = 0x20;
    /// The orientation is set.
    pub const ORIENTATION_SET: u8 = 0x10;
    /// The fence is on.
    pub const FENCE_ON: u8 = 0x08;
    /// The start is authorized.
    pub const AUTHORIZED: u8 = 0x04;
    /// GPS time is not known.
    pub const NO_GPS_TIME: u8 = 0x02;
    /// The fence is breached.
    pub const FENCE_BREACHED: u8 = 0x01;
}

/// Bits of [`Status::preflight`]: failed checks.
pub mod preflight {
    /// Show, origin or orientation are missing.
    pub const NOT_CONFIGURED: u8 = 0x1;
    /// The drone is too far from the first point of the trajectory.
    pub const NOT_AT_TAKEOFF: u8 = 0x8;
}

/// A drone's status packet (DATA16 of type [`FROM_DRONE`], 2 Hz).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Start time, GPS second of week; -1 if none is set.
    pub start_tow_s: i32,
    /// Colour of the light, RGB565.
    pub colour: u16,
    /// State of the show, bits of [`flag`].
    pub flags: u8,
    /// Failed preflight checks, four bits of [`preflight`].
    pub preflight: u8,
    /// Stage of the show.
    pub stage: Stage,
    /// GPS fix type, 0..=7; 3 is a 3-D fix.
    pub gps_fix: u8,
    /// Number of satellites; 31 or more read as 31.
    pub satellites: u8,
    /// Number of boots, modulo 4.
    pub boot_count: u8,
    /// Whether the drone is far from where it should be in the show.
    pub is_far: bool,
    /// Time since the show's start, s, negative before it; `None` if not known.
    pub elapsed_s: Option<i16>,
}

/// Elapsed time that is not known.
const UNKNOWN_ELAPSED: i16 = i16::MIN;

impl Status {
    /// Bytes of the packet in firmware 4.4.
    pub const LENGTH: u8 = 12;

    /// Whether a flag of [`flag`] is set.
    pub fn has(&self, flag: u8) -> bool {
        self.flags & flag != 0
    }

    /// Encodes the data of a DATA16 packet.
    pub fn to_data(&self) -> [u8; 16] {
        let mut data = [0; 16];
        data[0..4].copy_from_slice(&self.start_tow_s.to_le_bytes());
        data[4..6].copy_from_slice(&self.colour.to_le_bytes());
        data[6] = self.flags;
        data[7] = self.preflight << 4 | (self.stage.number() & 0x0F);
        data[8] = self.satellites.min(31) << 3 | (self.gps_fix & 0x07);
        data[9] = (self.boot_count & 0x03) | if self.is_far { 0x80 } else { 0 };
        data[10..12].copy_from_slice(&self.elapsed_s.unwrap_or(UNKNOWN_ELAPSED).to_le_bytes());
        data
    }

    /// Decodes the data of a DATA packet of type [`FROM_DRONE`]. Bytes cut off at the end are
    /// zeros.
    pub fn from_data(data: &[u8]) -> Self {
        let mut all = [0; 12];
        let length = data.len().min(all.len());
        all[..length].copy_from_slice(&data[..length]);
        let elapsed_s = i16::from_le_bytes([all[10], all[11]]);
        Self {
            start_tow_s: i32::from_le_bytes([all[0], all[1], all[2], all[3]]),
            colour: u16::from_le_bytes([all[4], all[5]]),
            flags: all[6],
            preflight: all[7] >> 4,
            stage: Stage::from_number(all[7] & 0x0F),
            gps_fix: all[8] & 0x07,
            satellites: all[8] >> 3,
            boot_count: all[9] & 0x03,
            is_far: all[9] & 0x80 != 0,
            elapsed_s: (elapsed_s != UNKNOWN_ELAPSED).then_some(elapsed_s),
        }
    }

    /// Obstacle to the take-off, in the words and the order that crews know from Skybrush Live;
    /// `None` if there is none.
    pub fn obstacle(&self) -> Option<&'static str> {
        let missing = |flag| !self.has(flag);
        if missing(flag::LOADED) {
            Some("no show data")
        } else if missing(flag::ORIGIN_SET) {
            Some("origin not set")
        } else if missing(flag::ORIENTATION_SET) {
            Some("orientation not set")
        } else if self.preflight & preflight::NOT_AT_TAKEOFF != 0 {
            Some("not at takeoff position")
        } else if self.gps_fix < 3 {
            Some("no 3D GPS fix yet")
        } else if self.has(flag::NO_GPS_TIME) {
            Some("invalid GPS timestamp")
        } else if missing(flag::FENCE_ON) {
            Some("geofence not set")
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_start_packet_is_what_skybrush_server_was_measured_to_send() {
        let start = StartConfig { start_tow_s: 443_029, authorization: 1, countdown_ms: 21_213 };
        let (data, length) = start.to_data();
        let measured = [0x01, 0x95, 0xc2, 0x06, 0x00, 0x01, 0xdd, 0x52, 0, 0, 0, 0];
        assert_eq!((&data[..12], length), (&measured[..], 12));
        assert_eq!(StartConfig::from_data(&data, length), Some(start));
        let short = StartConfig::from_data(&data, 6).unwrap();
        assert_eq!(short.countdown_ms, LEAVE_TIME);
        assert_eq!(StartConfig::from_data(&data, 5), None);
        assert_eq!(StartConfig::from_data(&data, 200), None);
    }

    proptest! {
        #[test]
        fn a_status_is_read_as_it_was_written(data: [u8; 12]) {
            let mut wanted = [0; 16];
            wanted[..12].copy_from_slice(&data);
            // Bits of other firmware versions.
            wanted[9] &= 0x83;
            prop_assert_eq!(Status::from_data(&data).to_data(), wanted);
        }
    }
}
