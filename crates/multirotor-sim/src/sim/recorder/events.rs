//! Rows at changes: arming, take-off, landing.

use std::io::{self, Write};

use crate::sim::autopilot::Autopilot;
use crate::sim::autopilot::director::{Abort, Stage, Touchdown};
use crate::sim::autopilot::motors::Spool;
use dataflash::Value::{Int as I, Text as T};
use dataflash::{LogWriter, catalog};

/// Event numbers of EV rows.
const MOTOR_INTERLOCK_ENABLED: i64 = 57;
const MOTOR_INTERLOCK_DISABLED: i64 = 56;
const AUTO_ARMED: i64 = 15;
const NOT_LANDED: i64 = 28;
const LAND_COMPLETE_MAYBE: i64 = 17;
const LAND_COMPLETE: i64 = 18;
const DISARMED: i64 = 11;
/// ModeReason of a mode that a ground station or the fence asked for.
const BY_STATION: i64 = 2;
/// AP_Arming::Method of disarming after a landing.
const DISARMED_AFTER_LANDING: i64 = 13;

/// What was seen last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Events {
    spinning: bool,
    flying: bool,
    armed: bool,
    touchdown: Touchdown,
    aborted: Option<Abort>,
}

impl Events {
    /// Armed, on the ground.
    pub(super) fn new() -> Self {
        Self {
            spinning: false,
            flying: false,
            armed: true,
            touchdown: Touchdown::None,
            aborted: None,
        }
    }

    /// Writes rows for what changed.
    #[inline]
    pub(super) fn write<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        pilot: &Autopilot<'_>,
        board_us: i64,
    ) -> io::Result<u64> {
        let director = &pilot.director;
        let now = Self {
            spinning: pilot.motors.spool != Spool::Stopped,
            flying: director.stage > Stage::Wait && director.stage < Stage::Landed,
            armed: director.armed,
            touchdown: director.touchdown,
            aborted: director.aborted,
        };
        if now == *self {
            return Ok(0);
        }
        self.write_changes(log, now, board_us)
    }

    #[cold]
    #[inline(never)]
    fn write_changes<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        now: Self,
        board_us: i64,
    ) -> io::Result<u64> {
        let before = std::mem::replace(self, now);
        let time = I(board_us);
        let reached = |state| before.touchdown < state && now.touchdown >= state;
        let mut rows = 0;
        if let (None, Some(abort)) = (before.aborted, now.aborted) {
            let mode = I(abort.mode().into());
            log.row(&catalog::MODE, &[time, mode, mode, I(BY_STATION)])?;
            rows += 1;
        }
        if before.armed && !now.armed {
            log.row(&catalog::MSG, &[time, T("Disarming motors")])?;
            log.row(&catalog::ARM, &[time, I(0), I(0), I(0), I(DISARMED_AFTER_LANDING)])?;
            rows += 2;
        }
        for (happened, event) in [
            (!before.spinning && now.spinning, MOTOR_INTERLOCK_ENABLED),
            (!before.flying && now.flying, AUTO_ARMED),
            (!before.flying && now.flying, NOT_LANDED),
            (reached(Touchdown::Maybe), LAND_COMPLETE_MAYBE),
            (reached(Touchdown::Complete), LAND_COMPLETE),
            (before.armed && !now.armed, DISARMED),
            (before.spinning && !now.spinning, MOTOR_INTERLOCK_DISABLED),
        ] {
            if happened {
                log.row(&catalog::EV, &[time, I(event)])?;
                rows += 1;
            }
        }
        Ok(rows)
    }
}
