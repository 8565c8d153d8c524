//! Rows that only a full log has: the rest of the firmware's default set.
//!
//! Sensors are the truth with plausible noise; numbers that describe the inside of an EKF or of a
//! flight controller board are constants like those in the firmware's own logs.

use std::io::{self, Write};

use nalgebra::Vector3;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;

use super::view::{Euler, View, frd};
use super::{Moment, control, ekf, navigation};
use crate::rng::{Purpose, stream};
use crate::sim::air::{SEA_LEVEL_DENSITY, density_ratio};
use crate::sim::autopilot::motors::Spool;
use crate::sim::flight::FlightSetup;
use crate::sim::plant::GRAVITY;
use dataflash::Value::{Float as F, Int as I};
use dataflash::{LogWriter, Value, catalog};

/// Noise of the sensors, one standard deviation.
const GYRO_RADPS: f64 = 0.003;
const ACCELEROMETER_MPS2: f64 = 0.05;
const BAROMETER_M: f64 = 0.1;
const MAGNETOMETER_MGAUSS: f64 = 1.0;
/// A second stream of a drone's sensors, apart from the one that steers the flight.
const LOG_STREAM: u64 = 1 << 32;

/// State of the additional rows.
#[derive(Clone, Debug)]
pub(super) struct Full {
    rng: Pcg64,
    /// Earth's magnetic field, north, east, down, milligauss.
    field_mgauss: Vector3<f64>,
}

impl Full {
    pub(super) fn new(setup: &FlightSetup<'_>, view: &View) -> Self {
        // An axial dipole: 300 mG at the equator, twice that at the poles.
        let (sin, cos) = view.home.lat_deg.to_radians().sin_cos();
        Self {
            rng: stream(setup.seed, u64::from(setup.drone) | LOG_STREAM, Purpose::Sensors),
            field_mgauss: Vector3::new(300.0 * cos, 0.0, 600.0 * sin),
        }
    }

    /// The rows that are due at this step.
    pub(super) fn write<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        moment: &Moment<'_>,
        view: &View,
        board_us: i64,
    ) -> io::Result<u64> {
        let every = |steps: u64| moment.step.is_multiple_of(steps);
        let mut rows = write_truth(log, moment, view, board_us)?;
        if every(16) {
            rows += self.write_imu(log, moment, board_us)?;
        }
        if every(40) {
            let attitude = view.euler(&moment.estimate.rotation);
            rows += control::write_rates(log, moment, board_us)?;
            rows += self.write_sensors(log, moment, view, board_us)?;
            rows += write_attitudes(log, moment, view, &attitude, board_us)?;
            for core in 0..2 {
                if core == 1 {
                    navigation::write_core(log, moment, view, &attitude, board_us, core)?;
                    rows += 1;
                }
                rows += ekf::write_core(
                    log,
                    &attitude,
                    self.field_mgauss,
                    &mut self.rng,
                    board_us,
                    core,
                )?;
            }
        }
        if every(200) {
            rows += ekf::write_variances(log, board_us)?;
        }
        if every(400) {
            rows += write_housekeeping(log, moment, view, board_us)?;
        }
        if every(2000) {
            rows += ekf::write_timing(log, board_us)?;
        }
        if every(4000) {
            let mut values = [I(0); 14];
            values[..7].copy_from_slice(&[
                I(board_us),
                I(400),
                I(0),
                I(4000),
                I(2600),
                I(131_072),
                I(0),
            ]);
            log.row(&catalog::PM, &values)?;
            rows += 1;
        }
        Ok(rows)
    }

    fn noise(&mut self, deviation: f64) -> f64 {
        let draw: f64 = StandardNormal.sample(&mut self.rng);
        deviation * draw
    }

    fn noisy(&mut self, vector: Vector3<f64>, deviation: f64) -> [Value<'static>; 3] {
        [0, 1, 2].map(|axis| F(vector[axis] + self.noise(deviation)))
    }

    /// IMU, two of them.
    fn write_imu<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        moment: &Moment<'_>,
        board_us: i64,
    ) -> io::Result<u64> {
        let motion = moment.plant.motion();
        let push = motion.acceleration_mps2 + Vector3::new(0.0, 0.0, GRAVITY);
        let force = frd(&motion.rotation.tr_mul(&push));
        let rate = frd(&motion.rate_radps);
        for instance in 0..2 {
            let [gx, gy, gz] = self.noisy(rate, GYRO_RADPS);
            let [ax, ay, az] = self.noisy(force, ACCELEROMETER_MPS2);
            log.row(
                &catalog::IMU,
                &[
                    I(board_us),
                    I(instance),
                    gx,
                    gy,
                    gz,
                    ax,
                    ay,
                    az,
                    I(0),
                    I(0),
                    F(38.0),
                    I(1),
                    I(1),
                    I(1000),
                    I(1000),
                ],
            )?;
        }
        Ok(2)
    }

    /// BARO and VIBE of two sensors, MAG of three, RCIN, RCO2, CTRL.
    fn write_sensors<W: Write>(
        &mut self,
        log: &mut LogWriter<W>,
        moment: &Moment<'_>,
        view: &View,
        board_us: i64,
    ) -> io::Result<u64> {
        let time = I(board_us);
        let motion = moment.plant.motion();
        let height_m = -view.place(&motion.position_m).z;
        let amsl_m = view.home.amsl_m + height_m;
        let celsius = 15.0 - 0.0065 * amsl_m;
        let density = density_ratio(amsl_m) * SEA_LEVEL_DENSITY;
        let pressure_pa = density * 287.053 * (celsius + 273.15);
        let per_metre_pa = density * GRAVITY;
        let attitude = view.euler(&motion.rotation);
        let field = body_field(&self.field_mgauss, &attitude);
        for instance in 0..2 {
            let error_m = self.noise(BAROMETER_M);
            log.row(
                &catalog::BARO,
                &[
                    time,
                    I(instance),
                    F(height_m + error_m),
                    F(pressure_pa - error_m * per_metre_pa),
                    F(celsius),
                    F(motion.velocity_mps.z),
                    I(board_us / 1000),
                    F(0.0),
                    F(15.0 - 0.0065 * view.home.amsl_m),
                    I(1),
                ],
            )?;
            let [x, y, z] = self.noisy(Vector3::zeros(), ACCELEROMETER_MPS2).map(magnitude);
            log.row(&catalog::VIBE, &[time, I(instance), x, y, z, I(0)])?;
        }
        for instance in 0..3 {
            let mut values = [I(0); 13];
            values[0] = time;
            values[1] = I(instance);
            for axis in 0..3 {
                values[2 + axis] =
                    I((field[axis] + self.noise(MAGNETOMETER_MGAUSS)).round() as i64);
            }
            values[11] = I(1);
            values[12] = time;
            log.row(&catalog::MAG, &values)?;
        }
        let mut channels = [I(0); 15];
        channels[0] = time;
        log.row(&catalog::RCIN, &channels)?;
        log.row(&catalog::RCO2, &[time, I(0), I(0), I(0), I(0)])?;
        let calm = [2.5e-4, 3.3e-4, 1.9e-4, 2.8e-4, 2.3e-5].map(F);
        let [roll_p, roll_d, pitch_p, pitch_d, yaw] = calm;
        log.row(&catalog::CTRL, &[time, roll_p, roll_d, pitch_p, pitch_d, yaw])?;
        Ok(10)
    }
}

fn magnitude(value: Value<'static>) -> Value<'static> {
    match value {
        F(number) => F(number.abs()),
        other => other,
    }
}

/// A north, east, down vector seen from a body at this attitude: forward, right, down.
fn body_field(ned: &Vector3<f64>, attitude: &Euler) -> Vector3<f64> {
    let [w, x, y, z] = attitude.quaternion();
    let turn = nalgebra::UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    turn.inverse_transform_vector(ned)
}

/// GPA: what a receiver says of its accuracy.
pub(super) fn write_accuracy<W: Write>(log: &mut LogWriter<W>, board_us: i64) -> io::Result<u64> {
    let accuracy = [F(1.1), F(0.3), F(0.3), F(0.04), F(0.0)];
    let [vdop, horizontal, vertical, speed, yaw] = accuracy;
    let ms = I(board_us / 1000);
    let counts = [I(200), F(0.0), I(0), I(0)];
    let [delta, undulation, used, dropped] = counts;
    log.row(
        &catalog::GPA,
        &[
            I(board_us),
            I(0),
            vdop,
            horizontal,
            vertical,
            speed,
            yaw,
            I(1),
            ms,
            delta,
            undulation,
            used,
            dropped,
        ],
    )?;
    Ok(1)
}

/// SIM2 at every step.
fn write_truth<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    board_us: i64,
) -> io::Result<u64> {
    let motion = moment.plant.motion();
    let (place, velocity) = (view.place(&motion.position_m), view.ned(&motion.velocity_mps));
    let air_mps = (motion.velocity_mps - moment.around.air_velocity_mps).norm();
    log.row(
        &catalog::SIM2,
        &[
            I(board_us),
            F(place.x),
            F(place.y),
            F(place.z),
            F(velocity.x),
            F(velocity.y),
            F(velocity.z),
            F(air_mps),
        ],
    )?;
    Ok(1)
}

/// AHR2 (estimate) and SIM (truth).
fn write_attitudes<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    estimate: &Euler,
    board_us: i64,
) -> io::Result<u64> {
    let motion = moment.plant.motion();
    let truth = view.euler(&motion.rotation);
    let places = [moment.estimate.position_m, motion.position_m];
    let messages = [&catalog::AHR2, &catalog::SIM];
    for ((message, attitude), place) in messages.into_iter().zip([estimate, &truth]).zip(places) {
        let globe = view.globe(&view.place(&place));
        let [w, x, y, z] = attitude.quaternion().map(F);
        log.row(
            message,
            &[
                I(board_us),
                F(attitude.roll_deg),
                F(attitude.pitch_deg),
                F(attitude.yaw_deg),
                F(globe.amsl_m),
                F(globe.lat_deg),
                F(globe.lon_deg),
                w,
                x,
                y,
                z,
            ],
        )?;
    }
    Ok(2)
}

/// DSF, DU32, MAV and the breadcrumbs of SRTL at 1 Hz.
fn write_housekeeping<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    board_us: i64,
) -> io::Result<u64> {
    let time = I(board_us);
    let free = [I(204_000); 3];
    let [least, most, mean] = free;
    let second = (moment.step / 400) as i64;
    log.row(&catalog::DSF, &[time, I(0), I(second), I(40_000), least, most, mean])?;
    log.row(&catalog::DU32, &[time, I(7), I(4_235_384)])?;
    let sent = I((second * 13) & 0xFFFF);
    log.row(&catalog::MAV, &[time, I(0), sent, I(second & 0xFFFF), I(0), I(6), I(0), I(0)])?;
    if moment.pilot.motors.spool != Spool::Flying {
        return Ok(3);
    }
    let [north, east, down] = view.place(&moment.estimate.position_m).map(F).into();
    log.row(&catalog::SRTL, &[time, I(1), I(1), I(300), I(0), north, east, down])?;
    Ok(4)
}
