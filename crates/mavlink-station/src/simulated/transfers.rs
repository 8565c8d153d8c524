//! Rates at which a vehicle sends files and logs.

use crate::link::clock::{MS, Micros};

/// A computer that serves virtual vehicles looks at them less often than an autopilot at its
/// links: packets that are late by up to this are made up for.
const LATE: f64 = (20 * MS) as f64;

/// Duration of an autopilot's loop, us.
const LOOP: f64 = 2_500.0;

/// Largest rates at which a vehicle sends packets, 1/s; 0: no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transfers {
    /// Rate of MAVFTP packets, 1/s.
    pub ftp_per_s: f64,
    /// Rate of log data packets, 1/s.
    pub logs_per_s: f64,
}

impl Transfers {
    /// Rates measured with ArduCopter 4.4's simulator: one packet of MAVFTP in each loop of 400 Hz
    /// (94 kB/s of data), 40 of the log messages for each of two links (2.8 MB/s).
    pub const FIRMWARE: Self = Self { ftp_per_s: 394.0, logs_per_s: 32_000.0 };

    /// One rate for both protocols, packets per second.
    pub fn both(packets_per_s: f64) -> Self {
        Self { ftp_per_s: packets_per_s, logs_per_s: packets_per_s }
    }
}

/// Meters the packets of a server.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Meter {
    next: f64,
}

impl Meter {
    /// Nothing was to be sent until now. What comes then is served as it is heard, with the packets
    /// of a loop.
    pub(super) fn idle(&mut self, now: Micros) {
        self.next = self.next.max(now as f64 - LOOP);
    }

    /// When the next packet may go.
    pub(super) fn next(self) -> Micros {
        self.next as Micros
    }

    /// A packet has gone.
    pub(super) fn count(&mut self, now: Micros, per_s: f64) {
        if per_s > 0.0 {
            let pause = 1e6 / per_s;
            self.next = self.next.max(now as f64 - LATE.max(pause)) + pause;
        }
    }
}
