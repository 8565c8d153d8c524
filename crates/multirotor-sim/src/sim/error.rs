//! Errors of simulated flights.

use std::io;

use thiserror::Error;

use super::strain::Strain;
use untrusted_io::file::FileError;

/// Error of a simulated flight, which did not reach its end; its log must not be kept.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SimError {
    /// The firmware would not accept this show.
    #[error(
        "drone {drone}: the trajectory never rises {height_m} m above its start, so the firmware \
         derives no take-off time"
    )]
    NoTakeoff {
        /// Slot of the drone.
        drone: u16,
        /// Height of the take-off (SHOW_TAKEOFF_ALT), m.
        height_m: f64,
    },
    /// The drone stands too far from where its trajectory starts.
    #[error(
        "drone {drone} stands {distance_m:.1} m from the start of its trajectory; the firmware \
         refuses more than {limit_m} m"
    )]
    NotAtStart {
        /// Slot of the drone.
        drone: u16,
        /// Horizontal distance from the start of the trajectory, m.
        distance_m: f64,
        /// Largest distance that the firmware allows (SHOW_TAKEOFF_ERR), m.
        limit_m: f64,
    },
    /// A number of the setup is not finite.
    #[error("drone {drone}: {what} is not a finite number")]
    NotFinite {
        /// Slot of the drone.
        drone: u16,
        /// Name of the number.
        what: &'static str,
    },
    /// The vehicle's effects cannot be used.
    #[error("drone {drone}: the vehicle's effects cannot be used")]
    Effect {
        /// Slot of the drone.
        drone: u16,
        /// Effect that cannot be used, and the reason.
        #[source]
        source: crate::effects::EffectError,
    },
    /// The motion became infinite or undefined.
    #[error(
        "drone {drone}: the motion became undefined at show time {time_s:.1} s; check the wind"
    )]
    Diverged {
        /// Slot of the drone.
        drone: u16,
        /// Show time at which the motion became undefined, s.
        time_s: f64,
    },
    /// The drone was still in the air long after its trajectory's end.
    #[error(
        "drone {drone} had not landed by show time {time_s:.0} s: the air is more than the vehicle can \
         hold; {strain}"
    )]
    NotLanded {
        /// Slot of the drone.
        drone: u16,
        /// Show time at which the simulation was given up, s.
        time_s: f64,
        /// Strongest air of the flight, and the vehicle's reaction to it.
        strain: Strain,
    },
    /// The drone never got off the ground as far as the show needs.
    #[error(
        "drone {drone} never reached the height where the show begins: the air is more than the \
         vehicle can hold; {strain}"
    )]
    NeverBegun {
        /// Slot of the drone.
        drone: u16,
        /// Strongest air of the flight, and the vehicle's reaction to it.
        strain: Strain,
    },
    /// The user asked to stop.
    #[error("drone {drone}: stopped at show time {time_s:.0} s")]
    Stopped {
        /// Slot of the drone.
        drone: u16,
        /// Show time at which the flight was stopped, s.
        time_s: f64,
    },
    /// The log's file could not be written.
    #[error("drone {drone}: the log was not written")]
    File {
        /// Slot of the drone.
        drone: u16,
        /// File, and the reason why it could not be written.
        #[source]
        source: FileError,
    },
    /// The log could not be written.
    #[error("drone {drone}: failed to write the log")]
    Log {
        /// Slot of the drone.
        drone: u16,
        /// Reason given by the operating system.
        #[source]
        source: io::Error,
    },
}
