//! Rows about where the drone believes to be: POS, XKF1, GPS.

use std::io::{self, Write};

use dataflash::Value::{Float as F, Int as I};
use dataflash::{LogWriter, catalog};

use super::Moment;
use super::view::{Euler, View, course_deg};

/// POS and XKF1 of one EKF core: 10 Hz rows.
pub(super) fn write<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    attitude: &Euler,
    board_us: i64,
) -> io::Result<u64> {
    let ned = view.place(&moment.estimate.position_m);
    let globe = view.globe(&ned);
    log.row(
        &catalog::POS,
        &[I(board_us), F(globe.lat_deg), F(globe.lon_deg), F(globe.amsl_m), F(-ned.z), F(-ned.z)],
    )?;
    write_core(log, moment, view, attitude, board_us, 0)?;
    Ok(2)
}

/// XKF1 of an EKF core.
pub(super) fn write_core<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    attitude: &Euler,
    board_us: i64,
    core: i64,
) -> io::Result<()> {
    let ned = view.place(&moment.estimate.position_m);
    let velocity = view.ned(&moment.estimate.velocity_mps);
    log.row(
        &catalog::XKF1,
        &[
            I(board_us),
            I(core),
            F(attitude.roll_deg),
            F(attitude.pitch_deg),
            F(attitude.yaw_deg),
            F(velocity.x),
            F(velocity.y),
            F(velocity.z),
            F(velocity.z),
            F(ned.x),
            F(ned.y),
            F(ned.z),
            F(0.0),
            F(0.0),
            F(0.0),
            F(view.home.amsl_m),
        ],
    )
}

/// GPS: one receiver with an RTK-like fix. `fix` is its week and millisecond.
pub(super) fn write_gps<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    board_us: i64,
    fix: (i64, i64),
) -> io::Result<u64> {
    let globe = view.globe(&view.place(&moment.estimate.position_m));
    let velocity = view.ned(&moment.estimate.velocity_mps);
    log.row(
        &catalog::GPS,
        &[
            I(board_us),
            I(0),
            I(6),
            I(fix.1),
            I(fix.0),
            I(18),
            F(0.7),
            F(globe.lat_deg),
            F(globe.lon_deg),
            F(globe.amsl_m),
            F(velocity.xy().norm()),
            F(course_deg(velocity.x, velocity.y)),
            F(velocity.z),
            F(0.0),
            I(1),
        ],
    )?;
    Ok(1)
}
