//! Assembly of a flight from the channels of a log.

use std::path::Path;

use super::align::{Evidence, align};
use super::channels::{Ekf, Messages};
use super::supply::Logged;
use super::{
    Effort, Flight, FlightError, FlightOptions, Indicator, Loss, Place, Series, Warning, pick,
};
use crate::log::Log;
use crate::numeric::{most, upper_median};

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
    warnings.extend(choose_boot(&mut messages, wanted, held).map(Warning::Said));
    let channels = Channels::of(&messages, source, options.indicator)?;
    let stages = pick::stages(&messages);
    let armed = pick::armed(&messages, &channels.pulse);
    let flights = pick::flights(&armed, &channels.pulse);
    held.flights = flights.len();
    let chosen = match wanted.flight {
        Some(index) => flights.get(index).map(|flight| (*flight, None)),
        None => pick::flight(&armed, &stages, &channels.pulse),
    };
    let (flight, choice) = chosen.ok_or_else(|| {
        no_flight(source, "the motors were never armed for 5 s with outputs logged".into())
    })?;
    warnings.extend(choice.map(Warning::Said));
    let pulse_limits_us = messages.pulse_limits_us();
    let idle_us = pulse_limits_us.0 + IDLE_US;
    channels.must_run(flight, idle_us, source)?;

    let (desired_up, desired_horizontal) = messages.desired();
    let evidence = Evidence {
        messages: &messages,
        flight,
        desired_up: desired_up.as_ref(),
        velocity_up: &channels.ekf.velocity_up,
        height: &channels.ekf.height,
    };
    let clock = align(&evidence, options, &mut warnings);
    let ground_m = channels.ground_m(flight, idle_us, source)?;
    let cut_off_at_m = channels.cut_off_at_m(flight, idle_us, ground_m);
    warnings.extend(cut_off_at_m.map(|height_m| Warning::Loss(Loss::CutOff { height_m })));
    warnings.extend(channels.silences(flight));

    let cut = |series: Series| to_show_time(&series, flight, clock.offset_s);
    let show = |time: f64| time - clock.offset_s;
    let (voltage_v, current_a) = messages.battery();
    let (resting_v, resistance_ohm) = messages.resting();
    let (resting_v, resistance_ohm) = Logged {
        voltage_v: voltage_v.as_ref(),
        current_a: current_a.as_ref(),
        resting_v,
        resistance_ohm: resistance_ohm.as_ref(),
    }
    .at_rest(flight);
    let place = messages.places().into_iter().find(|(time, ..)| *time >= flight.0 - MARGIN_S);
    let Channels { pulse, pulse_max, pulse_min, ekf, roll, pitch, yaw, effort } = channels;
    let mut height_m = cut(ekf.height);
    height_m.value.iter_mut().for_each(|height| *height -= ground_m);
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
        thrust_expo: messages.thrust_expo(),
        lean_limit_deg: messages.lean_limit_deg(),
        cut_off_at_m,
        place: Place::of(&messages).map(|place| place.map(cut)),
        first_fix_deg: place.map(|(_, latitude, longitude)| (latitude, longitude)),
        scan: messages.scan,
        clock,
        warnings,
    })
}

/// Keeps one boot of a log; says which, if it was not asked for.
fn choose_boot(messages: &mut Messages, wanted: Wanted, held: &mut Held) -> Option<String> {
    let boots = messages.keep_one_boot(wanted.boot);
    (held.boots, held.boot) = (boots, messages.boot);
    let which = ordinal(messages.boot, boots);
    (boots > 1 && wanted.boot.is_none())
        .then(|| format!("the log holds {boots} boots of the autopilot; the {which} is analysed"))
}

/// What a flight cannot do without, over board time.
struct Channels {
    pulse: Series,
    pulse_max: Series,
    pulse_min: Series,
    ekf: Ekf,
    roll: Series,
    pitch: Series,
    yaw: Series,
    /// What stands for the pulse, if another indicator is asked for.
    effort: Option<Series>,
}

impl Channels {
    fn of(messages: &Messages, source: &Path, indicator: Indicator) -> Result<Self, FlightError> {
        let [pulse, pulse_max, pulse_min] = motors(messages, source)?;
        let ekf = position_filter(messages, source)?;
        let attitude = |field: &str| messages.rows("ATT")?.series(field, f64::to_radians);
        let yaw = messages.rows("ATT").and_then(|rows| rows.series("Yaw", |yaw| yaw));
        let (Some(roll), Some(pitch)) = (attitude("Roll"), attitude("Pitch")) else {
            return Err(missing(source, ["attitude", "ATT", LOG_ATTITUDE]));
        };
        let yaw = yaw.unwrap_or_default();
        let effort = effort(messages, source, indicator)?;
        Ok(Self { pulse, pulse_max, pulse_min, ekf, roll, pitch, yaw, effort })
    }

    /// Refuses a flight whose motors only idled.
    fn must_run(&self, flight: (f64, f64), idle_us: f64, source: &Path) -> Result<(), FlightError> {
        let strongest = most(self.pulse.between(flight.0, flight.1)).unwrap_or(f64::NEG_INFINITY);
        if strongest < idle_us {
            return Err(no_flight(
                source,
                format!(
                    "the motors were armed but never ran above idle (highest mean output \
                     {strongest:.0} us)"
                ),
            ));
        }
        Ok(())
    }

    /// Height of the ground, m; refuses a flight that never left it. A log that begins in the air does not
    /// know the ground; the filter's origin stands in.
    fn ground_m(
        &self,
        flight: (f64, f64),
        idle_us: f64,
        source: &Path,
    ) -> Result<f64, FlightError> {
        let first = self.pulse.between(flight.0 - 1.0, flight.0 + 1.0).first();
        if first.is_some_and(|first| *first > idle_us) {
            return Ok(0.0);
        }
        let ground_m = ground_height_m(&self.ekf.height, flight.0);
        let highest_m = most(self.ekf.height.between(flight.0, flight.1));
        if highest_m.is_some_and(|highest_m| highest_m - ground_m < LEAST_HEIGHT_M) {
            return Err(no_flight(
                source,
                format!(
                    "the motors ran, but the vehicle never rose {LEAST_HEIGHT_M} m above the ground"
                ),
            ));
        }
        Ok(ground_m)
    }

    /// How high the vehicle was when its log ended in the air, m.
    fn cut_off_at_m(&self, flight: (f64, f64), idle_us: f64, ground_m: f64) -> Option<f64> {
        let running = self.pulse.value.last().is_some_and(|last| *last > idle_us);
        let end_m = end_height_m(&self.pulse, &self.ekf.height, flight.1, ground_m);
        end_m.filter(|height| running && *height > CUT_OFF_M)
    }

    /// Silences that are worth a warning.
    fn silences(&self, flight: (f64, f64)) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let named = [
            ("motor output", &self.pulse),
            ("velocity", &self.ekf.velocity_up),
            ("attitude", &self.roll),
        ];
        for (name, series) in named {
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
        warnings
    }
}

/// What makes ArduPilot log the attitude.
const LOG_ATTITUDE: &str =
    "set LOG_BITMASK bit 1 or 0 (ATTITUDE_MED, +2, or FAST, +1) and fly again";

/// That something is not in the log: what, the messages that would have it, and what to do about it.
fn missing(source: &Path, [what, messages, remedy]: [&'static str; 3]) -> FlightError {
    FlightError::Missing { source_path: source.to_owned(), what, messages, remedy }
}

fn senseless(source: &Path, columns: String, range: &'static str) -> FlightError {
    FlightError::OutOfRange { source_path: source.to_owned(), columns, range }
}

fn no_flight(source: &Path, reason: String) -> FlightError {
    FlightError::NoFlight { source_path: source.to_owned(), reason }
}

/// Pulses of the motors: mean, largest and smallest.
fn motors(messages: &Messages, source: &Path) -> Result<[Series; 3], FlightError> {
    messages.motors().ok_or_else(|| {
        if messages.has_outputs() {
            return senseless(source, "RCOU".to_owned(), "a motor's pulse of 500 to 2500 us");
        }
        let lacking = if messages.rows("RCOU").is_some() {
            [
                "motor outputs under a name that is known",
                "RCOU with C1, Ch1 or Chan1",
                "the firmware names its columns in another way: report it, with the log",
            ]
        } else {
            ["motor outputs", "RCOU", "set LOG_BITMASK bit 10 (RCOUT, +1024) and fly again"]
        };
        missing(source, lacking)
    })
}

fn position_filter(messages: &Messages, source: &Path) -> Result<Ekf, FlightError> {
    messages.ekf().ok_or_else(|| match messages.ekf_name() {
        Some(name) => match messages.ekf_without_numbers() {
            Some(columns) => FlightError::NoNumbers { source_path: source.to_owned(), columns },
            None => senseless(source, format!("{name}.VD"), "a vertical velocity below 100 m/s"),
        },
        None => missing(
            source,
            ["vertical velocity of the position filter", "XKF1, NKF1 or EKF1", LOG_ATTITUDE],
        ),
    })
}

/// What stands for the pulse; `None`: the pulse itself.
fn effort(
    messages: &Messages,
    source: &Path,
    indicator: Indicator,
) -> Result<Option<Series>, FlightError> {
    let (found, lacking) = match indicator {
        Indicator::Pulse => return Ok(None),
        Indicator::RotorSpeed => (
            messages.rotor_speed(),
            [
                "rotor speeds",
                "ESC",
                "speed controllers with telemetry (bidirectional DShot) would log them; use the \
                 pulse width instead",
            ],
        ),
        Indicator::Power => (
            messages.power(),
            [
                "electrical power",
                "BAT with voltage and current",
                "set BATT_MONITOR for a sensor of both, or use the pulse width instead",
            ],
        ),
    };
    found.map(Some).ok_or_else(|| missing(source, lacking))
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
    upper_median(height.between(armed_s - 1.0, armed_s + 1.0).to_vec()).unwrap_or(0.0)
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

    #[test]
    fn the_first_and_the_last_of_several_are_called_so() {
        let named = [(0, 1), (0, 3), (1, 3), (2, 3)].map(|(index, count)| ordinal(index, count));
        assert_eq!(named, ["first", "first", "number 2", "last (number 3)"]);
    }
}
