//! The log of a drone: the messages of ArduPilot that an analysis reads.

use std::io::{self, Write};

use dataflash::Value::{Float as F, Int as I, Text as T};
use dataflash::{LogWriter, catalog};

use crate::autopilot::Errand;
use crate::battery::Battery;
use crate::flight::Drone;
use crate::noise::NoiseSettings;
use crate::random::{Coloured, Purpose, normal, stream};
use crate::telemetry::{ROTORS, Telemetry};
use crate::trim::{FULL_US, IDLE_US};
use crate::vector::Vector;
use crate::world::World;

/// Name of the firmware in the log: readers take the vehicle type from its beginning.
const VERSION: &str = "ArduCopter V4.4.4";
/// ModeNum of the show mode, and the reason for entering it.
const SHOW_MODE: (i64, i64) = (127, 32);
/// Method of arming: by the show.
const ARMED_BY_SHOW: i64 = 4;
/// Stages of the show in its log rows: waiting, performing, landed.
const STAGES: [i64; 3] = [2, 4, 8];
/// Board time of the log's first row, s: drones are switched on well before.
const BOOTED_S: (f64, f64) = (30.0, 150.0);
/// Interval of GPS solutions, ms, and their age when they are logged.
const GPS_MS: i64 = 200;
/// Differences of the four motors that hold the attitude, us; they add up to nothing.
const MOTORS_US: [f64; 4] = [3.0, -2.0, 1.5, -2.5];
/// Metres in a degree of latitude (sphere of the earth's mean radius).
const M_PER_DEG: f64 = 111_195.0;

/// What one row is made of.
pub(crate) struct Row<'a> {
    /// Show time, s.
    pub(crate) time_s: f64,
    pub(crate) is_armed: bool,
    pub(crate) is_flying: bool,
    pub(crate) errand: &'a Errand,
    /// As believed, show frame, m.
    pub(crate) position_m: Vector,
    /// As logged, m/s.
    pub(crate) velocity_mps: Vector,
    pub(crate) command: f64,
    /// Direction of the thrust.
    pub(crate) up: Vector,
    pub(crate) wanted_up: Vector,
    /// Mean speed of the rotors, where the plant has one.
    pub(crate) rotor_radps: Option<f64>,
    pub(crate) battery: &'a Battery,
}

/// Writes one log.
pub(crate) struct Record<W: Write> {
    log: LogWriter<W>,
    noise: NoiseSettings,
    pulse_noise: Coloured,
    white: rand_pcg::Pcg64,
    telemetry: Option<Telemetry>,
    /// Board time less show time, s.
    boot_s: f64,
    /// Show clock of the drone less the true one, s.
    clock_s: f64,
    /// Error of logged roll and pitch, degrees.
    level_deg: [f64; 2],
    home_m: Vector,
    home_deg: (f64, f64),
    amsl_m: f64,
    turn: (f64, f64),
    orientation_deg: f64,
    start: (i64, i64),
    was_armed: bool,
    has_flown: bool,
    last_fix_ms: i64,
}

impl<W: Write> Record<W> {
    pub(crate) fn new(world: &World, drone: &Drone<'_>, out: W) -> io::Result<Self> {
        let noise = world.noise;
        let mut clock = stream(world.seed, drone.slot, Purpose::Clock);
        let share = (normal(&mut clock) / 6.0 + 0.5).clamp(0.0, 1.0);
        let (least_s, most_s) = BOOTED_S;
        let boot_s = least_s + (most_s - least_s) * share - drone.takeoff_s.min(0.0) + 10.0;
        let clock_s = noise.clock_s * normal(&mut clock).clamp(-3.0, 3.0);
        let level_deg = [0; 2].map(|_| noise.level_deg * normal(&mut clock));
        let (sin, cos) = drone.site.orientation_deg.to_radians().sin_cos();
        let step_s = 1.0 / noise.rate_hz;
        let rng = |part: u64| stream(world.seed ^ (part << 40), drone.slot, Purpose::Pulses);
        let mut messages = vec![
            &catalog::VER,
            &catalog::MSG,
            &catalog::PARM,
            &catalog::MODE,
            &catalog::ARM,
            &catalog::SHOW,
            &catalog::RCOU,
            &catalog::ATT,
            &catalog::XKF1,
            &catalog::PSCN,
            &catalog::PSCE,
            &catalog::PSCD,
            &catalog::BAT,
            &catalog::GPS,
        ];
        if world.telemetry.is_some() {
            messages.push(&catalog::ESC);
        }
        let [north, east, _] = ned(drone.home_m, (sin, cos));
        let home_deg = (
            drone.site.lat_deg + north / M_PER_DEG,
            drone.site.lon_deg + east / (M_PER_DEG * drone.site.lat_deg.to_radians().cos()),
        );
        let mut record = Self {
            log: LogWriter::new(out, &messages)?,
            noise,
            pulse_noise: Coloured::new(
                noise.pulse_coloured_us,
                noise.pulse_coloured_s,
                step_s,
                rng(0),
            ),
            white: rng(1),
            telemetry: world
                .telemetry
                .map(|settings| Telemetry::new(settings, world.seed, drone.slot, step_s)),
            boot_s,
            clock_s,
            level_deg,
            home_m: drone.home_m,
            home_deg,
            amsl_m: drone.site.amsl_m + drone.home_m[2],
            turn: (sin, cos),
            orientation_deg: drone.site.orientation_deg,
            start: drone.start,
            was_armed: false,
            has_flown: false,
            last_fix_ms: i64::MIN,
        };
        record.begin(drone)?;
        Ok(record)
    }

    fn begin(&mut self, drone: &Drone<'_>) -> io::Result<()> {
        let time = I(1000);
        let log = &mut self.log;
        log.row(
            &catalog::VER,
            &[time, I(3), I(65535), I(4), I(4), I(4), I(255), I(0), T(VERSION), I(0), I(2)],
        )?;
        log.row(&catalog::MSG, &[time, T(VERSION)])?;
        let system = f64::from((drone.slot.saturating_sub(1)) % 255 + 1);
        for (name, value) in [
            ("BATT_MONITOR", 4.0),
            ("FRAME_CLASS", 1.0),
            ("FRAME_TYPE", 1.0),
            ("LOG_DISARMED", 1.0),
            ("MOT_PWM_MAX", IDLE_US + FULL_US),
            ("MOT_PWM_MIN", IDLE_US),
            ("MOT_THST_EXPO", 0.0),
            ("SYSID_THISMAV", system),
        ] {
            log.row(&catalog::PARM, &[time, T(name), F(value), F(value)])?;
        }
        log.row(&catalog::MODE, &[time, I(SHOW_MODE.0), I(SHOW_MODE.0), I(SHOW_MODE.1)])
    }

    /// Writes the rows of a step, if any are due.
    pub(crate) fn row(&mut self, step: u64, step_s: f64, row: &Row<'_>) -> io::Result<()> {
        self.has_flown |= row.is_flying;
        let every = (1.0 / (self.noise.rate_hz * step_s)).round().max(1.0) as u64;
        let board_us = ((row.time_s + self.boot_s) * 1e6).round() as i64;
        if row.is_armed != self.was_armed {
            self.was_armed = row.is_armed;
            let state = i64::from(row.is_armed);
            let by = [I(board_us), I(state), I(1), I(0), I(ARMED_BY_SHOW)];
            self.log.row(&catalog::ARM, &by)?;
        }
        if !step.is_multiple_of(every) {
            return Ok(());
        }
        self.outputs(row, board_us)?;
        self.attitude(row, board_us)?;
        self.motion(row, board_us)?;
        self.battery(row, board_us)?;
        let clock_ms = ((row.time_s + self.clock_s) * 1000.0).round() as i64;
        let stage = match (row.is_armed, row.is_flying) {
            (true, true) => STAGES[1],
            (false, _) if self.has_flown => STAGES[2],
            _ => STAGES[0],
        };
        let (dark, none) = (I(0), F(0.0));
        let values = [I(board_us), I(clock_ms), I(stage), dark, dark, dark, none, none];
        self.log.row(&catalog::SHOW, &values)?;
        self.fix(row, board_us)
    }

    fn outputs(&mut self, row: &Row<'_>, board_us: i64) -> io::Result<()> {
        let coloured_us = self.pulse_noise.step();
        let white_us = self.noise.pulse_white_us * normal(&mut self.white);
        let noise_us = if row.is_flying { coloured_us + white_us } else { 0.0 };
        let mean_us = IDLE_US + FULL_US * row.command + noise_us;
        let mut values = [I(0); 15];
        values[0] = I(board_us);
        for (value, more_us) in values[1..].iter_mut().zip(MOTORS_US) {
            let more_us = if row.is_flying { more_us } else { 0.0 };
            *value = I((mean_us + more_us).clamp(IDLE_US, IDLE_US + FULL_US).round() as i64);
        }
        self.log.row(&catalog::RCOU, &values)
    }

    fn attitude(&mut self, row: &Row<'_>, board_us: i64) -> io::Result<()> {
        let angles = |up: Vector| {
            let roll = (-up[1]).clamp(-1.0, 1.0).asin().to_degrees();
            [roll, (-up[0]).atan2(up[2]).to_degrees()]
        };
        let ([roll, pitch], [wanted_roll, wanted_pitch]) = (angles(row.up), angles(row.wanted_up));
        let yaw = self.orientation_deg.rem_euclid(360.0);
        self.log.row(
            &catalog::ATT,
            &[
                I(board_us),
                F(wanted_roll),
                F(roll + self.level_deg[0]),
                F(wanted_pitch),
                F(pitch + self.level_deg[1]),
                F(yaw),
                F(yaw),
                F(0.0),
                F(0.0),
                I(3),
            ],
        )
    }

    fn motion(&mut self, row: &Row<'_>, board_us: i64) -> io::Result<()> {
        let time = I(board_us);
        let place =
            |show: Vector| ned([0, 1, 2].map(|axis| show[axis] - self.home_m[axis]), self.turn);
        let at = place(row.position_m);
        let wanted = place(row.errand.target_m);
        let speed = ned(row.velocity_mps, self.turn);
        let wanted_speed = ned(row.errand.target_mps, self.turn);
        let zero = F(0.0);
        self.log.row(
            &catalog::XKF1,
            &[
                time,
                I(0),
                zero,
                zero,
                F(self.orientation_deg.rem_euclid(360.0)),
                F(speed[0]),
                F(speed[1]),
                F(speed[2]),
                F(speed[2]),
                F(at[0]),
                F(at[1]),
                F(at[2]),
                zero,
                zero,
                zero,
                F(self.amsl_m),
            ],
        )?;
        if !row.is_flying {
            return Ok(());
        }
        for (axis, message) in
            [&catalog::PSCN, &catalog::PSCE, &catalog::PSCD].into_iter().enumerate()
        {
            let (to, is) = (F(wanted_speed[axis]), F(speed[axis]));
            self.log.row(
                message,
                &[time, F(wanted[axis]), F(at[axis]), to, to, is, zero, zero, zero],
            )?;
        }
        Ok(())
    }

    fn battery(&mut self, row: &Row<'_>, board_us: i64) -> io::Result<()> {
        let battery = row.battery;
        let current_a = match &mut self.telemetry {
            Some(telemetry) => telemetry.current_a(battery.current_a),
            None => battery.current_a,
        };
        self.log.row(
            &catalog::BAT,
            &[
                I(board_us),
                I(0),
                F(battery.volts()),
                F(battery.resting_v()),
                F(current_a),
                F(battery.used_ah * 1000.0),
                F(battery.used_wh),
                F(25.0),
                F(battery.resistance_ohm()),
                I((battery.charge() * 100.0) as i64),
            ],
        )?;
        let Some((telemetry, radps)) = self.telemetry.as_mut().zip(row.rotor_radps) else {
            return Ok(());
        };
        let (volts, amps, none) = (F(battery.volts()), F(current_a / ROTORS as f64), F(0.0));
        for (instance, rpm) in (0..).zip(telemetry.speeds_rpm(radps)) {
            let rpm = F(rpm);
            let values = [I(board_us), I(instance), rpm, rpm, volts, amps, none, none, none, none];
            self.log.row(&catalog::ESC, &values)?;
        }
        Ok(())
    }

    fn fix(&mut self, row: &Row<'_>, board_us: i64) -> io::Result<()> {
        let (week, tow_ms) = self.start;
        let total_ms = tow_ms + (row.time_s * 1000.0) as i64;
        let fix_ms = total_ms - total_ms.rem_euclid(GPS_MS);
        if fix_ms == self.last_fix_ms {
            return Ok(());
        }
        self.last_fix_ms = fix_ms;
        let at = ned([0, 1, 2].map(|axis| row.position_m[axis] - self.home_m[axis]), self.turn);
        let speed = ned(row.velocity_mps, self.turn);
        let course = speed[1].atan2(speed[0]).to_degrees().rem_euclid(360.0);
        let (lat_deg, lon_deg) = self.home_deg;
        self.log.row(
            &catalog::GPS,
            &[
                I(board_us + (fix_ms - total_ms) * 1000),
                I(0),
                I(6),
                I(fix_ms),
                I(week),
                I(18),
                F(0.7),
                F(lat_deg + at[0] / M_PER_DEG),
                F(lon_deg + at[1] / (M_PER_DEG * lat_deg.to_radians().cos())),
                F(self.amsl_m - at[2]),
                F(speed[0].hypot(speed[1])),
                F(course),
                F(speed[2]),
                F(0.0),
                I(1),
            ],
        )
    }

    pub(crate) fn finish(self) -> io::Result<W> {
        self.log.finish()
    }
}

/// A vector of the show frame as north, east, down; `turn`: sine and cosine of the show's orientation.
fn ned([x, y, z]: Vector, (sin, cos): (f64, f64)) -> Vector {
    [cos * x + sin * y, sin * x - cos * y, -z]
}
