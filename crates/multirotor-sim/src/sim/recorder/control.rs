//! Rows about control: what was wanted, what was done, what the motors were told.

use std::io::{self, Write};

use nalgebra::Vector3;

use crate::sim::autopilot::director::Stage;
use crate::sim::autopilot::motors::Spool;
use crate::sim::plant::GRAVITY;
use dataflash::Value::{Float as F, Int as I};
use dataflash::{LogWriter, catalog};
use skybrush_show::lights::Rgb;

use super::Moment;
use super::battery::Battery;
use super::view::{Euler, View, frd};

/// ESC: the speed that each motor's controller reports, in whole rev/min as it comes over the wire, and its share of the
/// battery's current.
pub(super) fn write_speeds<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    battery: &Battery,
    board_us: i64,
) -> io::Result<u64> {
    let speeds = moment.plant.rotors().speeds_radps();
    let (volts, amps) = (battery.volts(), battery.current_a / speeds.len() as f64);
    let mut rows = 0;
    for (instance, speed_radps) in (0..).zip(speeds) {
        let rpm = F((speed_radps * 60.0 / std::f64::consts::TAU).round());
        let none = F(0.0);
        log.row(
            &catalog::ESC,
            &[I(board_us), I(instance), rpm, rpm, F(volts), F(amps), none, none, none, none],
        )?;
        rows += 1;
    }
    Ok(rows)
}

/// ATT, CTUN, BAT, RCOU, MOTB and, while the controllers run, PSCN/E/D: the 10 Hz rows.
pub(super) fn write<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    attitude: &Euler,
    battery: &Battery,
    board_us: i64,
) -> io::Result<u64> {
    let time = I(board_us);
    let pilot = moment.pilot;
    let error_deg = pilot.attitude.error_rad.map(f64::to_degrees);
    let wanted = view.wanted(&pilot.attitude.thrust_direction);
    log.row(
        &catalog::ATT,
        &[
            time,
            F(wanted.roll_deg),
            F(attitude.roll_deg),
            F(wanted.pitch_deg),
            F(attitude.pitch_deg),
            F(wanted.yaw_deg),
            F(attitude.yaw_deg),
            F(error_deg.xy().norm()),
            F(error_deg.z.abs()),
            I(3),
        ],
    )?;
    write_throttle(log, moment, view, battery, time)?;
    let mut outputs = [I(0); 15];
    outputs[0] = time;
    for (output, pulse) in outputs[1..].iter_mut().zip(pilot.motors.pulses_us) {
        *output = I(pulse.into());
    }
    log.row(&catalog::RCOU, &outputs)?;
    let mut rows = 5;
    if pilot.motors.spool == Spool::Flying {
        write_position_control(log, moment, view, time)?;
        rows += 3;
    }
    Ok(rows)
}

fn write_throttle<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    battery: &Battery,
    time: dataflash::Value<'_>,
) -> io::Result<()> {
    let (pilot, estimate) = (moment.pilot, moment.estimate);
    let height_m = -view.place(&estimate.position_m).z;
    let vertical = &pilot.vertical;
    let target_m = height_m + vertical.target.position.x - estimate.position_m.z;
    let boost = pilot.throttle_in * (pilot.boost(estimate) - 1.0);
    let throttle = pilot.motors.throttle;
    log.row(
        &catalog::CTUN,
        &[
            time,
            F(pilot.throttle_in),
            F(boost),
            F(throttle),
            F(vertical.hover_throttle),
            F(target_m),
            F(height_m),
            F(height_m),
            F(f64::NAN),
            F(0.0),
            F(f64::NAN),
            I((vertical.target.velocity.x * 100.0) as i64),
            I((estimate.velocity_mps.z * 100.0) as i64),
        ],
    )?;
    log.row(
        &catalog::BAT,
        &[
            time,
            I(0),
            F(battery.volts()),
            F(battery.resting_volts()),
            F(battery.current_a),
            F(battery.used_as / 3.6),
            F(battery.used_j / 3600.0),
            F(0.0),
            F(battery.resistance_ohm()),
            I(battery.remaining_percent() as i64),
        ],
    )?;
    log.row(&catalog::MOTB, &[time, F(1.0), F(1.0), F(1.0), F(throttle), F(throttle), I(2)])
}

fn write_position_control<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    time: dataflash::Value<'_>,
) -> io::Result<()> {
    let (pilot, estimate) = (moment.pilot, moment.estimate);
    let (flat, up) = (&pilot.horizontal, &pilot.vertical);
    let join = |flat: nalgebra::Vector2<f64>, up: f64| Vector3::new(flat.x, flat.y, up);
    // The firmware states the horizontal acceleration by the lean that it wants.
    let lean = pilot.attitude.thrust_direction;
    let push = lean.xy() * (GRAVITY / lean.z);
    let columns = [
        view.place(&join(flat.target.position, up.target.position.x)),
        view.place(&estimate.position_m),
        view.ned(&join(flat.target.velocity, up.target.velocity.x)),
        view.ned(&join(flat.velocity_target, up.velocity_target)),
        view.ned(&estimate.velocity_mps),
        view.ned(&join(flat.target.acceleration, up.target.acceleration.x)),
        view.ned(&join(flat.acceleration_target, up.acceleration_target)),
        view.ned(&join(push, estimate.acceleration_mps2.z)),
    ];
    for (axis, message) in [&catalog::PSCN, &catalog::PSCE, &catalog::PSCD].into_iter().enumerate()
    {
        let mut values = [time; 9];
        for (value, column) in values[1..].iter_mut().zip(&columns) {
            *value = F(column[axis]);
        }
        log.row(message, &values)?;
    }
    Ok(())
}

/// GUIP when the show has just given a target: centimetres north, east, up from the EKF's origin.
pub(super) fn write_target<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    view: &View,
    board_us: i64,
) -> io::Result<u64> {
    let director = &moment.pilot.director;
    if director.stage != Stage::Performing || director.target_age != 0 {
        return Ok(0);
    }
    let target = &director.target;
    let place = view.place(&target.position) * 100.0;
    let velocity = view.ned(&target.velocity) * 100.0;
    let push = view.ned(&target.acceleration) * 100.0;
    log.row(
        &catalog::GUIP,
        &[
            I(board_us),
            I(3),
            F(place.x),
            F(place.y),
            F(-place.z),
            I(0),
            F(velocity.x),
            F(velocity.y),
            F(-velocity.z),
            F(push.x),
            F(push.y),
            F(-push.z),
        ],
    )?;
    Ok(1)
}

/// SHOW: clock, stage, light and distance from the trajectory.
pub(super) fn write_show<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    color: Rgb,
    board_us: i64,
) -> io::Result<u64> {
    let director = &moment.pilot.director;
    let [red, green, blue] = color.map(|value| I(value.into()));
    let miss = if director.stage == Stage::Performing {
        moment.estimate.position_m - director.sent_m
    } else {
        Vector3::zeros()
    };
    log.row(
        &catalog::SHOW,
        &[
            I(board_us),
            I(moment.time_us.div_euclid(1000)),
            I(director.told().into()),
            red,
            green,
            blue,
            F(miss.xy().norm()),
            F(miss.z),
        ],
    )?;
    Ok(1)
}

/// RATE: turn rates about forward, right, down, degrees/s, and vertical acceleration, cm/s² up.
pub(super) fn write_rates<W: Write>(
    log: &mut LogWriter<W>,
    moment: &Moment<'_>,
    board_us: i64,
) -> io::Result<u64> {
    let (pilot, estimate) = (moment.pilot, moment.estimate);
    let wanted = frd(&pilot.attitude.rate_target).map(f64::to_degrees);
    let rate = frd(&estimate.rate_radps).map(f64::to_degrees);
    let output = frd(&pilot.attitude.output);
    let mut values = [I(board_us); 14];
    for axis in 0..3 {
        values[1 + 3 * axis] = F(wanted[axis]);
        values[2 + 3 * axis] = F(rate[axis]);
        values[3 + 3 * axis] = F(output[axis]);
    }
    values[10] = F(pilot.vertical.acceleration_target * 100.0);
    values[11] = F(estimate.acceleration_mps2.z * 100.0);
    values[12] = F(pilot.motors.throttle);
    values[13] = F(0.0);
    log.row(&catalog::RATE, &values)?;
    Ok(1)
}
