//! Rows of a full log about the inside of the EKF: constants like those in the firmware's own logs,
//! with innovations of plausible size. Nothing in the simulation has these states.

use std::io::{self, Write};

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::view::Euler;
use dataflash::Value::{Float as F, Int as I};
use dataflash::{LogWriter, Value, catalog};

/// XKF2 to XKF5, XKFS, XKQ, XKY0 and XKY1 of one EKF core.
pub(super) fn write_core<W: Write>(
    log: &mut LogWriter<W>,
    attitude: &Euler,
    field_mgauss: Vector3<f64>,
    rng: &mut Pcg64,
    board_us: i64,
    core: i64,
) -> io::Result<u64> {
    let head = [I(board_us), I(core)];
    let mut row = |message, rest: &[Value<'static>]| {
        let mut values = [I(0); 16];
        values[..2].copy_from_slice(&head);
        values[2..2 + rest.len()].copy_from_slice(rest);
        log.row(message, &values[..2 + rest.len()])
    };
    let zeros = [F(0.0); 16];
    let mut innovations = zeros;
    for innovation in &mut innovations[..6] {
        let draw: f64 = StandardNormal.sample(rng);
        *innovation = F(0.02 * draw);
    }
    let [north, east, down] = field_mgauss.map(|part| I(part.round() as i64)).into();
    let [w, x, y, z] = attitude.quaternion().map(F);
    let mut field = zeros;
    field[5..8].copy_from_slice(&[north, east, down]);
    field[8..11].copy_from_slice(&[I(0); 3]);
    row(&catalog::XKF2, &field[..14])?;
    innovations[6..9].copy_from_slice(&[I(0); 3]);
    row(&catalog::XKF3, &innovations[..13])?;
    let status = [I(0), I(0), I(831), I(0), I(0)];
    let mut health = zeros;
    health[..6].copy_from_slice(&[0.03, 0.02, 0.02, 0.01, 0.0, 0.005].map(F));
    health[8..13].copy_from_slice(&status);
    row(&catalog::XKF4, &health[..13])?;
    row(&catalog::XKFS, &[I(0), I(0), I(0), I(0), I(0)])?;
    row(&catalog::XKQ, &[w, x, y, z])?;
    let mut angles = zeros;
    angles[0] = F(attitude.yaw_deg);
    angles[1] = F(2.0);
    for hypothesis in 0..5 {
        angles[2 + hypothesis] = F((attitude.yaw_deg + 72.0 * hypothesis as f64) % 360.0);
        angles[7 + hypothesis] = F(0.2);
    }
    row(&catalog::XKY0, &angles[..12])?;
    row(&catalog::XKY1, &zeros[..10])?;
    if core > 0 {
        return Ok(7);
    }
    let mut optical = zeros;
    optical[..4].copy_from_slice(&[I(0); 4]);
    optical[7] = F(0.0);
    optical[8] = F(0.5);
    row(&catalog::XKF5, &optical[..12])?;
    Ok(8)
}

/// XKV1, XKV2 and XKTV at 2 Hz.
pub(super) fn write_variances<W: Write>(log: &mut LogWriter<W>, board_us: i64) -> io::Result<u64> {
    let variances = [
        [1.2e-5, 1.2e-5, 1.2e-5, 1.8e-3, 9e-3, 9e-3, 6e-3, 0.027, 0.027, 0.05, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.2e-3, 6e-5, 1.2e-3, 1.2e-3, 4e-4, 1.2e-3, 0.0, 0.0],
    ];
    for (message, variances) in [&catalog::XKV1, &catalog::XKV2].into_iter().zip(variances) {
        let mut values = [I(0); 14];
        values[0] = I(board_us);
        for (value, variance) in values[2..].iter_mut().zip(variances) {
            *value = F(variance);
        }
        log.row(message, &values)?;
    }
    for core in 0..2 {
        log.row(&catalog::XKTV, &[I(board_us), I(core), F(1e-4), F(1e-4)])?;
    }
    Ok(4)
}

/// XKT of both cores every 5 s.
pub(super) fn write_timing<W: Write>(log: &mut LogWriter<W>, board_us: i64) -> io::Result<u64> {
    for core in 0..2 {
        let spans = [0.0025, 0.0025, 0.012, 0.0124, 0.0108, 0.0125, 0.01, 0.0133].map(F);
        let mut values = [I(0); 11];
        values[..3].copy_from_slice(&[I(board_us), I(core), I(406)]);
        values[3..].copy_from_slice(&spans);
        log.row(&catalog::XKT, &values)?;
    }
    Ok(2)
}
