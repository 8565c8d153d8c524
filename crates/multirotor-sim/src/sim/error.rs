//! Why a flight could not be simulated.

use std::io;

use thiserror::Error;

use super::strain::Strain;
use untrusted_io::file::FileError;

/// A flight could not be simulated to its end; its log must not be kept.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimError {
    /// The firmware would not accept this show.
    #[error(
        "drone {drone}: the trajectory never rises {height_m} m above its start, so the firmware \
         derives no take-off time"
    )]
    NoTakeoff {
        /// The drone's slot.
        drone: u16,
        /// SHOW_TAKEOFF_ALT.
        height_m: f64,
    },
    /// The drone stands too far from where its trajectory starts.
    #[error(
        "drone {drone} stands {distance_m:.1} m from the start of its trajectory; the firmware \
         refuses more than {limit_m} m"
    )]
    NotAtStart {
        /// The drone's slot.
        drone: u16,
        /// Horizontal distance.
        distance_m: f64,
        /// SHOW_TAKEOFF_ERR.
        limit_m: f64,
    },
    /// A number of the setup is not finite.
    #[error("drone {drone}: {what} is not a finite number")]
    NotFinite {
        /// The drone's slot.
        drone: u16,
        /// Which number.
        what: &'static str,
    },
    /// The vehicle's effects cannot be used.
    #[error("drone {drone}: the vehicle's effects cannot be used")]
    Effect {
        /// The drone's slot.
        drone: u16,
        /// Which one, and why.
        #[source]
        source: crate::effects::EffectError,
    },
    /// The motion became infinite or undefined.
    #[error(
        "drone {drone}: the motion became undefined at show time {time_s:.1} s; check the wind"
    )]
    Diverged {
        /// The drone's slot.
        drone: u16,
        /// Show time.
        time_s: f64,
    },
    /// The drone was still in the air long after its trajectory's end.
    #[error(
        "drone {drone} had not landed by show time {time_s:.0} s: the air is more than the vehicle can \
         hold; {strain}"
    )]
    NotLanded {
        /// The drone's slot.
        drone: u16,
        /// Show time.
        time_s: f64,
        /// What the air was, and what the vehicle did.
        strain: Strain,
    },
    /// The drone never got off the ground as far as the show needs.
    #[error(
        "drone {drone} never reached the height where the show begins: the air is more than the \
         vehicle can hold; {strain}"
    )]
    NeverBegun {
        /// The drone's slot.
        drone: u16,
        /// What the air was, and what the vehicle did.
        strain: Strain,
    },
    /// The user asked to stop.
    #[error("drone {drone}: stopped at show time {time_s:.0} s")]
    Stopped {
        /// The drone's slot.
        drone: u16,
        /// Show time.
        time_s: f64,
    },
    /// The log's file could not be written.
    #[error("drone {drone}: the log was not written")]
    File {
        /// The drone's slot.
        drone: u16,
        /// Which file, and why.
        #[source]
        source: FileError,
    },
    /// The log could not be written.
    #[error("drone {drone}: failed to write the log")]
    Log {
        /// The drone's slot.
        drone: u16,
        /// The operating system's reason.
        #[source]
        source: io::Error,
    },
}
