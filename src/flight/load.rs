//! Assembly of a flight from the channels of a log.

use std::path::Path;

use super::align::{Evidence, align};
use super::channels::Messages;
use super::{Effort, Flight, FlightError, FlightOptions, Indicator, Loss, Series, Warning, pick};
use crate::log::Log;

/// Kept before arming and after disarming, s.
const MARGIN_S: f64 = 2.0;
/// A silence in a channel longer than this is worth a warning, s.
const GAP_S: f64 = 1.0;
/// No flight has a silence longer than this, s: the clock jumped.
const LONGEST_FLIGHT_S: f64 = 6.0 * 3600.0;
/// A vehicle that never rises above this did not fly, m.
const LEAST_HEIGHT_M: f64 = 0.5;
/// A log that ends higher than this with its motors running was cut off, m.
const CUT_OFF_M: f64 = 1.0;
/// Motors that never exceed their lower limit by this much did not fly, us.
const IDLE_US: f64 = 20.0;

/// Which flight of a log is meant.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Wanted {
    /// Boot, from 0; `None`: the last one that performed a show, else the last.
    pub(super) boot: Option<usize>,
    /// Flight of that boot, from 0; `None` as above.
    pub(super) flight: Option<usize>,
}

/// How many there are to choose from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Held {
    /// Boots in the log.
    pub(super) boots: usize,
    /// The one that was read, from 0.
    pub(super) boot: usize,
    /// Flights in the boot that was read.
    pub(super) flights: usize,
}

/// Reads the wanted flight of a log; `held` becomes what there was to choose from.
pub(super) fn load(
    log: &Log,
    source: &Path,
    options: FlightOptions<'_>,
    wanted: Wanted,
    held: &mut Held,
) -> Result<Flight, FlightError> {
    let mut messages = Messages::read(log);
    if messages.is_empty() {
        return Err(FlightError::Empty { source_path: source.to_owned() });
    }
    let mut warnings = scan_warnings(&messages);
    let boots = messages.keep_one_boot(wanted.boot);
    (held.boots, held.boot) = (boots, messages.boot);
    if boots > 1 && wanted.boot.is_none() {
        let which = ordinal(messages.boot, boots);
        warnings.push(
            format!("the log holds {boots} boots of the autopilot; the {which} is analysed").into(),
        );
    }
    let missing = |what, messages, remedy| FlightError::Missing {
        source_path: source.to_owned(),
        what,
        messages,
        remedy,
    };
    let senseless = |columns: String, range: &'static str| FlightError::OutOfRange {
        source_path: source.to_owned(),
        columns,
        range,
    };
    let [pulse, pulse_max, pulse_min] = messages.motors().ok_or_else(|| {
        if messages.has_outputs() {
            return senseless("RCOU".to_owned(), "a motor's pulse of 500 to 2500 us");
        }
        if messages.rows("RCOU").is_some() {
            return missing(
                "motor outputs under a name that is known",
                "RCOU with C1, Ch1 or Chan1",
                "the firmware names its columns in another way: report it, with the log",
            );
        }
        missing("motor outputs", "RCOU", "set LOG_BITMASK bit 10 (RCOUT, +1024) and fly again")
    })?;
    let ekf = messages.ekf().ok_or_else(|| match messages.ekf_name() {
        Some(name) => match messages.ekf_without_numbers() {
            Some(columns) => FlightError::NoNumbers { source_path: source.to_owned(), columns },
            None => senseless(format!("{name}.VD"), "a vertical velocity below 100 m/s"),
        },
        None => missing(
            "vertical velocity of the position filter",
            "XKF1, NKF1 or EKF1",
            "set LOG_BITMASK bit 1 or 0 (ATTITUDE_MED, +2, or FAST, +1) and fly again",
        ),
    })?;
    let attitude = |field: &str| messages.rows("ATT")?.series(field, f64::to_radians);
    let yaw = messages.rows("ATT").and_then(|rows| rows.series("Yaw", |yaw| yaw));
    let yaw = yaw.unwrap_or_default();
    let (Some(roll), Some(pitch)) = (attitude("Roll"), attitude("Pitch")) else {
        return Err(missing(
            "attitude",
            "ATT",
            "set LOG_BITMASK bit 1 or 0 (ATTITUDE_MED, +2, or FAST, +1) and fly again",
        ));
    };

    let effort = match options.indicator {
        Indicator::Pulse => None,
        Indicator::RotorSpeed => Some(messages.rotor_speed().ok_or_else(|| {
            missing(
                "rotor speeds",
                "ESC",
                "speed controllers with telemetry (bidirectional DShot) would log them; use the \
                 pulse width instead",
            )
        })?),
        Indicator::Power => Some(messages.power().ok_or_else(|| {
            missing(
                "electrical power",
                "BAT with voltage and current",
                "set BATT_MONITOR for a sensor of both, or use the pulse width instead",
            )
        })?),
    };

    let stages = pick::stages(&messages);
    let armed = pick::armed(&messages, &pulse);
    let no_flight =
        |reason: String| FlightError::NoFlight { source_path: source.to_owned(), reason };
    let flights = pick::flights(&armed, &pulse);
    held.flights = flights.len();
    let chosen = match wanted.flight {
        Some(index) => flights.get(index).map(|flight| (*flight, None)),
        None => pick::flight(&armed, &stages, &pulse),
    };
    let (flight, choice) = chosen.ok_or_else(|| {
        no_flight("the motors were never armed for 5 s with outputs logged".into())
    })?;
    warnings.extend(choice.map(Warning::Said));
    let pulse_limits_us = messages.pulse_limits_us();
    let strongest =
        pulse.between(flight.0, flight.1).iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if strongest < pulse_limits_us.0 + IDLE_US {
        return Err(no_flight(format!(
            "the motors were armed but never ran above idle (highest mean output {strongest:.0} us)"
        )));
    }

    let (desired_up, desired_horizontal) = messages.desired();
    let clock = align(
        &Evidence {
            messages: &messages,
            flight,
            desired_up: desired_up.as_ref(),
            velocity_up: &ekf.velocity_up,
            height: &ekf.height,
        },
        options,
        &mut warnings,
    );

    let cut = |series: Series| to_show_time(&series, flight, clock.offset_s);
    // A log that begins in the air does not know the ground; the filter's origin stands in.
    let starts_in_air = pulse
        .between(flight.0 - 1.0, flight.0 + 1.0)
        .first()
        .is_some_and(|first| *first > pulse_limits_us.0 + IDLE_US);
    let ground_m = if starts_in_air { 0.0 } else { ground_height_m(&ekf.height, flight.0) };
    let heights = ekf.height.between(flight.0, flight.1).iter().copied();
    let highest_m = heights.fold(f64::NEG_INFINITY, f64::max);
    if !starts_in_air && highest_m.is_finite() && highest_m - ground_m < LEAST_HEIGHT_M {
        return Err(no_flight(format!(
            "the motors ran, but the vehicle never rose {LEAST_HEIGHT_M} m above the ground"
        )));
    }
    let running = pulse.value.last().is_some_and(|last| *last > pulse_limits_us.0 + IDLE_US);
    let cut_off_at_m = running.then(|| end_height_m(&pulse, &ekf.height, flight.1, ground_m));
    let cut_off_at_m = cut_off_at_m.flatten().filter(|height| *height > CUT_OFF_M);
    warnings.extend(cut_off_at_m.map(|height_m| Warning::Loss(Loss::CutOff { height_m })));
    let mut height_m = cut(ekf.height);
    for height in &mut height_m.value {
        *height -= ground_m;
    }
    for (name, series) in
        [("motor output", &pulse), ("velocity", &ekf.velocity_up), ("attitude", &roll)]
    {
        let (from, to) = series.span().unwrap_or_default();
        let gap = series.longest_gap_s(flight.0.max(from), flight.1.min(to));
        let lost = flight.1 - to;
        let told = [
            (gap, format!("no data for {gap:.1} s of the flight")),
            (lost, format!("the log ends {lost:.1} s before the flight does")),
        ];
        warnings.extend(told.into_iter().filter_map(|(silent_s, words)| {
            silence(silent_s, words).map(|words| format!("{name}: {words}").into())
        }));
    }
    let (voltage_v, current_a) = messages.battery();
    let (resting_v, resistance_ohm) = messages.resting();
    let show = |time: f64| time - clock.offset_s;
    let place = messages.places().into_iter().find(|(time, ..)| *time >= flight.0 - MARGIN_S);
    Ok(Flight {
        source: source.to_owned(),
        system_id: messages.system_id(),
        velocity_up_mps: cut(ekf.velocity_up),
        height_m,
        north_m: cut(ekf.north),
        east_m: cut(ekf.east),
        effort: Effort { indicator: options.indicator, values: cut(effort.unwrap_or(pulse)) },
        pulse_max_us: cut(pulse_max),
        pulse_min_us: cut(pulse_min),
        roll_rad: cut(roll),
        pitch_rad: cut(pitch),
        yaw_deg: cut(yaw),
        desired_up_mps: desired_up.map(cut).filter(|series| !series.is_empty()),
        desired_horizontal_mps: desired_horizontal.map(cut).filter(|series| !series.is_empty()),
        voltage_v: voltage_v.map(cut),
        current_a: current_a.map(cut),
        truth_up_mps: None,
        resting_v: resting_v.map(cut).filter(|series| !series.is_empty()),
        resistance_ohm,
        stages: stages.into_iter().map(|(time, stage)| (show(time), stage)).collect(),
        armed_s: armed.into_iter().map(|(start, end)| (show(start), show(end))).collect(),
        pulse_limits_us,
        cut_off_at_m,
        first_fix_deg: place.map(|(_, latitude, longitude)| (latitude, longitude)),
        scan: messages.scan,
        clock,
        warnings,
    })
}

/// Which of so many, from 0, as people say it: `first`, `number 2`, `last (number 3)`.
pub(super) fn ordinal(index: usize, count: usize) -> String {
    match (index, count) {
        (0, _) => "first".to_owned(),
        (index, count) if index + 1 == count => format!("last (number {count})"),
        (index, _) => format!("number {}", index + 1),
    }
}

/// How high the vehicle was at the end of its log, if it was still armed then, m.
fn end_height_m(pulse: &Series, height: &Series, disarmed_s: f64, ground_m: f64) -> Option<f64> {
    let end = pulse.span()?.1.min(height.span()?.1);
    let armed = disarmed_s >= end - GAP_S;
    height.value.last().filter(|_| armed).map(|height| height - ground_m)
}

fn scan_warnings(messages: &Messages) -> Vec<Warning> {
    let scan = &messages.scan;
    let mut warnings: Vec<Warning> = Loss::of(scan).into_iter().map(Warning::Loss).collect();
    if scan.rejected_formats > 0 {
        let count = scan.rejected_formats;
        let text = format!("{count} message definitions in the log contradict themselves");
        warnings.push(text.into());
    }
    if messages.dropped > 0 {
        let count = messages.dropped;
        warnings.push(format!("{count} rows with an impossible time were dropped").into());
    }
    warnings
}

/// Cuts a channel over board time to the flight (with margins) and shifts it to show time.
fn to_show_time(series: &Series, flight: (f64, f64), offset_s: f64) -> Series {
    let range = series.range(flight.0 - MARGIN_S, flight.1 + MARGIN_S);
    let times = series.time_s.get(range.clone()).unwrap_or_default();
    Series {
        time_s: times.iter().map(|time| time - offset_s).collect(),
        value: series.value.get(range).unwrap_or_default().to_vec(),
    }
}

/// Height of the ground the vehicle was armed on: median over the first second after arming, when it
/// is still there.
fn ground_height_m(height: &Series, armed_s: f64) -> f64 {
    let mut first = height.between(armed_s - 1.0, armed_s + 1.0).to_vec();
    first.sort_by(f64::total_cmp);
    first.get(first.len() / 2).copied().unwrap_or(0.0)
}

/// Sentence about a silence of the log; `None` if it is too short to mention.
fn silence(silent_s: f64, words: String) -> Option<String> {
    if silent_s > LONGEST_FLIGHT_S {
        return Some(format!(
            "the log's clock jumps by more than {:.0} hours in the flight: times behind the jump are \
             not to be trusted",
            LONGEST_FLIGHT_S / 3600.0
        ));
    }
    (silent_s > GAP_S).then_some(words)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_that_jumps_is_no_gap() {
        let words = |silent_s| silence(silent_s, "a gap".to_owned()).unwrap_or_default();
        assert_eq!(words(0.5 * GAP_S), "");
        assert_eq!(words(2.0 * GAP_S), "a gap");
        assert!(words(9.2e12).contains("clock jumps"), "{}", words(9.2e12));
    }
}
