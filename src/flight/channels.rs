//! Channels over board time from the rows of messages: names, signs and units of all firmwares.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Series;
use super::clean::Rows;
use crate::log::{Log, ScanStats, Select, Table};
use crate::numeric::upper_median;

/// With less feed-forward than this the logged commands say nothing about velocity.
const LEAST_FEED_FORWARD: f64 = 0.05;
/// GUIP types whose velocity is a command: position-velocity-acceleration, velocity-acceleration.
const GUIDED_WITH_VELOCITY: [f64; 2] = [3.0, 4.0];
/// A median above this is centivolts (no show drone flies on 100 V).
const HIGHEST_VOLTAGE_V: f64 = 100.0;
/// No pack that flies has more resistance, ohm.
const HIGHEST_OHM: f64 = 1.0;
/// Pulse widths that a motor output can have, us; unused outputs are 0, and damage makes others.
const PULSES_US: std::ops::RangeInclusive<f64> = 500.0..=2500.0;
/// No multirotor is faster, m/s: what is was damaged in the log.
const FASTEST_MPS: f64 = 100.0;
/// No multirotor has more rotors.
const MOST_ROTORS: f64 = 16.0;
/// No rotor turns faster, rpm: what does was damaged in the log.
const FASTEST_RPM: f64 = 100_000.0;
/// Rows of one message that belong together are no further apart, s.
const SAME_ROW_S: f64 = 0.05;
/// A speed controller's last word that is older is none, s.
const STALE_S: f64 = 0.5;
/// Rows below which a desired-velocity message is not worth having.
const FEWEST_DESIRED: usize = 20;

const MOTORS: &[&str] = &[
    "TimeUS", "TimeMS", "C1", "C2", "C3", "C4", "C5", "C6", "C7", "C8", "C9", "C10", "C11", "C12",
    "C13", "C14", "Ch1", "Ch2", "Ch3", "Ch4", "Ch5", "Ch6", "Ch7", "Ch8", "Ch9", "Ch10", "Ch11",
    "Ch12", "Chan1", "Chan2", "Chan3", "Chan4", "Chan5", "Chan6", "Chan7", "Chan8",
];
/// What columns of motor outputs have been called, newest firmware first; `Chan1` in ArduCopter 3.2.
const OUTPUT_NAMES: [&str; 3] = ["C", "Ch", "Chan"];
const EKF: &[&str] = &["TimeUS", "TimeMS", "C", "VN", "VE", "VD", "PN", "PE", "PD"];

/// Messages of position filters, newest first.
const FILTERS: [&str; 3] = ["XKF1", "NKF1", "EKF1"];

/// The messages that a flight is read from.
const WANTED: &[Select<'static>] = &[
    Select { message: "XKF1", fields: EKF },
    Select { message: "NKF1", fields: EKF },
    Select { message: "EKF1", fields: EKF },
    Select { message: "XKF4", fields: &["TimeUS", "C", "PI"] },
    Select { message: "RCOU", fields: MOTORS },
    Select { message: "ATT", fields: &["TimeUS", "TimeMS", "Roll", "Pitch", "Yaw"] },
    Select { message: "GUIP", fields: &["TimeUS", "Type", "vX", "vY", "vZ"] },
    Select { message: "PSCD", fields: &["TimeUS", "DVD", "TVD"] },
    Select { message: "PSCN", fields: &["TimeUS", "DVN", "TVN"] },
    Select { message: "PSCE", fields: &["TimeUS", "DVE", "TVE"] },
    Select { message: "CTUN", fields: &["TimeUS", "TimeMS", "DCRt"] },
    Select { message: "BAT", fields: &["TimeUS", "Instance", "Volt", "VoltR", "Curr", "Res"] },
    Select { message: "ESC", fields: &["TimeUS", "Instance", "RPM"] },
    Select { message: "CURR", fields: &["TimeUS", "TimeMS", "Volt", "Curr"] },
    Select { message: "SHOW", fields: &["TimeUS", "ClockMS", "Stage"] },
    Select {
        message: "GPS",
        fields: &["TimeUS", "I", "Status", "GMS", "GWk", "Lat", "Lng", "Alt"],
    },
    Select { message: "POS", fields: &["TimeUS", "TimeMS", "Lat", "Lng", "Alt"] },
    Select { message: "ARM", fields: &["TimeUS", "ArmState"] },
    Select { message: "EV", fields: &["TimeUS", "TimeMS", "Id"] },
    Select { message: "PARM", fields: &["TimeUS", "Name", "Value"] },
];

/// All messages of a log that matter, over board time.
#[derive(Clone, Debug, Default)]
pub(super) struct Messages {
    rows: BTreeMap<String, Rows>,
    pub(super) parameters: BTreeMap<String, f64>,
    pub(super) scan: ScanStats,
    /// Rows whose time was impossible.
    pub(super) dropped: usize,
    /// Boot that was kept, from 0.
    pub(super) boot: usize,
}

impl Messages {
    pub(super) fn read(log: &Log) -> Self {
        Self::select(log, WANTED)
    }

    /// Only what tells drones apart: parameters, places, and when it flew.
    pub(super) fn read_identity(log: &Log) -> Self {
        let wanted: Vec<Select<'static>> = WANTED
            .iter()
            .filter(|select| matches!(select.message, "PARM" | "GPS" | "ARM" | "EV" | "SHOW"))
            .copied()
            .chain([
                Select { message: "RCOU", fields: &["TimeUS", "TimeMS", "C1", "Ch1", "Chan1"] },
                Select { message: "ORGN", fields: &["TimeUS", "Type", "Lat", "Lng", "Alt"] },
            ])
            .collect();
        Self::select(log, &wanted)
    }

    /// When motor outputs were logged, as the times of a channel.
    pub(super) fn output_times(&self) -> Option<Series> {
        let rows = self.rows("RCOU")?;
        OUTPUT_NAMES.iter().find_map(|name| rows.series(&format!("{name}1"), |pulse| pulse))
    }

    /// Whether the vehicle logs nothing while it is disarmed.
    pub(super) fn logs_only_armed(&self) -> bool {
        self.parameters.get("LOG_DISARMED") == Some(&0.0)
    }

    /// MAVLink system id.
    pub(super) fn system_id(&self) -> Option<u8> {
        ["SYSID_THISMAV", "MAV_SYSID"]
            .iter()
            .find_map(|name| self.parameters.get(*name))
            .filter(|id| (1.0..=255.0).contains(*id))
            .map(|id| *id as u8)
    }

    fn select(log: &Log, wanted: &[Select<'_>]) -> Self {
        let (tables, scan) = log.select(wanted);
        Self { scan, ..Self::of_tables(tables) }
    }

    pub(super) fn of_tables(tables: impl IntoIterator<Item = Table>) -> Self {
        let mut messages = Self::default();
        for table in tables {
            if table.message == "PARM" {
                messages.parameters = parameters(&table);
                continue;
            }
            let message = table.message.clone();
            let (rows, dropped) = Rows::from_table(table);
            // What is lost of the place alone is no doubt about the measurement.
            if message != "POS" {
                messages.dropped += dropped;
            }
            if !rows.is_empty() {
                messages.rows.insert(message, rows);
            }
        }
        messages
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty() && self.parameters.is_empty()
    }

    pub(super) fn rows(&self, message: &str) -> Option<&Rows> {
        self.rows.get(message)
    }

    /// Keeps one boot of a log that holds several: the `wanted` one, else the last one with motor
    /// outputs (or the last one that performed a show). Returns how many boots the log holds.
    pub(super) fn keep_one_boot(&mut self, wanted: Option<usize>) -> usize {
        let steady = ["RCOU", "ATT", "XKF1", "NKF1", "EKF1", "SHOW"];
        let boots = |rows: Option<&Rows>| rows.map_or(0, |rows| rows.boots().len());
        let count = steady.iter().map(|name| boots(self.rows(name))).max().unwrap_or(0);
        if count < 2 {
            return count;
        }
        let performing = self.rows("SHOW").filter(|show| show.boots().len() == count);
        let performed = || {
            performing.and_then(|show| {
                let stage = show.column("Stage")?;
                let performs = |boot: &Range<usize>| {
                    stage.get(boot.clone()).is_some_and(|stages| stages.contains(&4.0))
                };
                show.boots().iter().rposition(performs)
            })
        };
        let chosen = wanted.or_else(performed).unwrap_or(count - 1);
        self.boot = chosen;
        let spans: Vec<(f64, f64)> = steady
            .iter()
            .find_map(|name| self.rows(name).filter(|rows| rows.boots().len() == count))
            .map(|rows| {
                let span = |boot: Range<usize>| {
                    let times = rows.time_s.get(boot)?;
                    Some((times.first()? - 10.0, times.last()? + 10.0))
                };
                rows.boots().into_iter().filter_map(span).collect()
            })
            .unwrap_or_default();
        let span = spans.get(chosen).copied();
        for (name, rows) in &mut self.rows {
            let own = rows.boots();
            if own.len() == count {
                let boot = own.get(chosen).cloned().unwrap_or_default();
                rows.retain(|index| boot.contains(&index));
            } else if let Some((start, end)) = span {
                // A sparse message may have no row in some boots; its last rows in the time span
                // of the chosen boot are the best guess.
                let times = rows.time_s.clone();
                let of = |(start, end): (f64, f64), time: &f64| (start..=end).contains(time);
                let mut own = times.iter().filter(|time| of((start, end), time));
                let doubtful =
                    own.any(|time| spans.iter().filter(|span| of(**span, time)).count() > 1);
                // Whose arming it was must be certain: without any the whole boot counts as armed.
                let none = doubtful && matches!(name.as_str(), "ARM" | "EV");
                rows.retain(|index| {
                    !none && times.get(index).is_some_and(|time| of((start, end), time))
                });
            }
        }
        count
    }

    /// Velocity up, height, north and east of the EKF: primary core of the newest filter present.
    pub(super) fn ekf(&self) -> Option<Ekf> {
        let mut rows = self.rows(self.ekf_name()?)?.clone();
        let primary = self.primary_core();
        if let Some(cores) = rows.column("C").map(<[f64]>::to_vec) {
            let core = if cores.contains(&primary) { primary } else { 0.0 };
            rows.retain(|index| cores.get(index) == Some(&core));
        }
        Some(Ekf {
            velocity_up: rows.series("VD", |down| within(-down, FASTEST_MPS))?,
            height: rows.series("PD", |down| -down)?,
            north: rows.series("PN", |north| north).unwrap_or_default(),
            east: rows.series("PE", |east| east).unwrap_or_default(),
        })
    }

    /// Columns that the position filter logged without one number among them; `None`: it logged
    /// nothing, or its columns have numbers.
    pub(super) fn ekf_without_numbers(&self) -> Option<String> {
        let name = self.ekf_name()?;
        let rows = self.rows(name)?;
        let empty = |column: &&str| rows.series(column, |value| value).is_none();
        let empty: Vec<String> =
            ["VD", "PD"].iter().filter(|c| empty(c)).map(|c| format!("{name}.{c}")).collect();
        (!empty.is_empty()).then(|| empty.join(" and "))
    }

    /// The newest position filter that logged anything.
    pub(super) fn ekf_name(&self) -> Option<&'static str> {
        FILTERS.into_iter().find(|name| self.rows(name).is_some())
    }

    /// The core that most XKF4 rows call primary; core 0 without them.
    fn primary_core(&self) -> f64 {
        let mut counts = BTreeMap::<i64, usize>::new();
        let indices = self.rows("XKF4").and_then(|rows| rows.column("PI")).unwrap_or_default();
        for index in indices.iter().filter(|index| (0.0..8.0).contains(*index)) {
            *counts.entry(*index as i64).or_default() += 1;
        }
        // The lowest of equally frequent cores.
        let most = counts.iter().rev().max_by_key(|(_, count)| **count);
        most.map_or(0.0, |(core, _)| *core as f64)
    }

    /// Whether motor outputs have columns of a known name, whatever is in them.
    pub(super) fn has_outputs(&self) -> bool {
        let has = |name: &&str| self.rows("RCOU")?.column(&format!("{name}1"));
        OUTPUT_NAMES.iter().any(|name| has(name).is_some())
    }

    /// Mean, largest and smallest motor output, us.
    pub(super) fn motors(&self) -> Option<[Series; 3]> {
        let rows = self.rows("RCOU")?;
        let column = |channel: usize| {
            OUTPUT_NAMES.iter().find_map(|name| rows.column(&format!("{name}{channel}")))
        };
        let motors: Vec<&[f64]> = self.motor_channels().into_iter().filter_map(column).collect();
        let mut series = [Series::default(), Series::default(), Series::default()];
        for (row, time) in rows.time_s.iter().enumerate() {
            let outputs = motors
                .iter()
                .filter_map(|motor| motor.get(row).copied())
                .filter(|pulse| PULSES_US.contains(pulse));
            let (mut sum, mut count) = (0.0, 0);
            let (mut largest, mut smallest) = (f64::NEG_INFINITY, f64::INFINITY);
            for pulse in outputs {
                sum += pulse;
                count += 1;
                largest = largest.max(pulse);
                smallest = smallest.min(pulse);
            }
            if count > 0 && series[0].time_s.last().is_none_or(|last| time > last) {
                for (series, value) in
                    series.iter_mut().zip([sum / f64::from(count), largest, smallest])
                {
                    series.time_s.push(*time);
                    series.value.push(value);
                }
            }
        }
        (!series[0].is_empty()).then_some(series)
    }

    /// Output channels of the motors: SERVOn_FUNCTION 33..40 and 82..85, else the first four.
    fn motor_channels(&self) -> Vec<usize> {
        let is_motor =
            |function: f64| (33.0..=40.0).contains(&function) || (82.0..=85.0).contains(&function);
        let assigned: Vec<usize> = (1..=14)
            .filter(|n| {
                let function = self.parameters.get(&format!("SERVO{n}_FUNCTION"));
                function.is_some_and(|function| is_motor(*function))
            })
            .collect();
        if assigned.is_empty() { (1..=4).collect() } else { assigned }
    }

    /// Share of the square in the motors' thrust that the autopilot counts with.
    pub(super) fn thrust_expo(&self) -> Option<f64> {
        self.parameters.get("MOT_THST_EXPO").copied()
    }

    /// Largest lean that the autopilot lets its position controller ask for, degrees.
    pub(super) fn lean_limit_deg(&self) -> Option<f64> {
        let value = |name: &str| self.parameters.get(name).copied().filter(|limit| *limit > 0.0);
        // Hundredths of a degree until ArduCopter 4.6, then degrees by another name.
        let of_vehicle = value("ANGLE_MAX").map(|limit| limit / 100.0).or(value("ATC_ANGLE_MAX"));
        value("PSC_ANGLE_MAX").or(of_vehicle)
    }

    /// Pulse widths between which a spinning motor is kept, us.
    pub(super) fn pulse_limits_us(&self) -> (f64, f64) {
        let value = |name: &str| self.parameters.get(name).copied().filter(|v| *v > 0.0);
        // MOT_PWM_MIN/MAX of 0 mean "as the throttle stick" in older firmware.
        let low = value("MOT_PWM_MIN")
            .or_else(|| self.parameters.contains_key("MOT_PWM_MIN").then(|| value("RC3_MIN"))?);
        let high = value("MOT_PWM_MAX")
            .or_else(|| self.parameters.contains_key("MOT_PWM_MAX").then(|| value("RC3_MAX"))?);
        let (low, high) = (low.unwrap_or(1000.0), high.unwrap_or(2000.0));
        let at = |share: f64| low + (high - low) * share;
        (at(value("MOT_SPIN_MIN").unwrap_or(0.15)), at(value("MOT_SPIN_MAX").unwrap_or(0.95)))
    }

    /// Desired vertical velocity up and horizontal speed, m/s.
    pub(super) fn desired(&self) -> (Option<Series>, Option<Series>) {
        self.guided()
            .or_else(|| {
                let down = |message: &str, names: [&str; 2]| {
                    let rows = self.rows(message)?;
                    names.iter().find_map(|name| rows.series(name, |value| -value))
                };
                let up = down("PSCD", ["DVD", "TVD"]).filter(|s| s.len() >= FEWEST_DESIRED)?;
                let north = down("PSCN", ["DVN", "TVN"]);
                let east = down("PSCE", ["DVE", "TVE"]);
                Some((Some(up), horizontal(north.as_ref(), east.as_ref())))
            })
            .or_else(|| {
                let up = self.rows("CTUN")?.series("DCRt", |cmps| cmps / 100.0)?;
                (up.len() >= FEWEST_DESIRED).then_some((Some(up), None))
            })
            .unwrap_or_default()
    }

    /// The commands of guided (and show) mode, the profile as planned. The log has them in cm/s, and
    /// show mode logs its velocities times SHOW_VEL_FF_GAIN.
    fn guided(&self) -> Option<(Option<Series>, Option<Series>)> {
        let gain = self.parameters.get("SHOW_VEL_FF_GAIN").copied();
        // The show firmware without its parameters (they are lost, or no numbers): the factor is not
        // known, and the position controller's own target is better.
        if gain.is_none() && self.rows("SHOW").is_some() && self.rows("PSCD").is_some() {
            return None;
        }
        let gain = gain.unwrap_or(1.0);
        if !(LEAST_FEED_FORWARD..=10.0).contains(&gain) {
            return None;
        }
        let per_mps = 100.0 * gain;
        let mut rows = self.rows("GUIP")?.clone();
        let types = rows.column("Type")?.to_vec();
        rows.retain(|row| types.get(row).is_some_and(|kind| GUIDED_WITH_VELOCITY.contains(kind)));
        let mps = |name: &str| rows.series(name, |logged| logged / per_mps);
        let up = mps("vZ").filter(|series| series.len() >= FEWEST_DESIRED)?;
        Some((Some(up), horizontal(mps("vX").as_ref(), mps("vY").as_ref())))
    }

    /// Battery voltage (V) and current (A).
    pub(super) fn battery(&self) -> (Option<Series>, Option<Series>) {
        let Some(rows) = ["BAT", "CURR"].iter().find_map(|name| self.rows(name)) else {
            return (None, None);
        };
        let mut rows = rows.clone();
        if let Some(instances) = rows.column("Instance").map(<[f64]>::to_vec) {
            rows.retain(|row| instances.get(row) == Some(&0.0));
        }
        let volts = rows.column("Volt").map(<[f64]>::to_vec).unwrap_or_default();
        let centi = upper_median(volts).is_some_and(|median| median > HIGHEST_VOLTAGE_V);
        let scale = if centi { 0.01 } else { 1.0 };
        (rows.series("Volt", |v| v * scale), rows.series("Curr", |v| v * scale))
    }

    /// Electrical power, W: voltage times current of the same rows.
    pub(super) fn power(&self) -> Option<Series> {
        let (Some(volts), Some(amps)) = self.battery() else { return None };
        let mut power = Series::default();
        for (time, volt) in volts.time_s.iter().zip(&volts.value) {
            if let Some(amp) = amps.at(*time, SAME_ROW_S) {
                power.time_s.push(*time);
                power.value.push(volt * amp);
            }
        }
        // Boards without a current sensor log 0.
        power.value.iter().any(|watt| *watt > 0.0).then_some(power)
    }

    /// Rotor speed: mean over the speed controllers that report, rpm. Each has rows of its own; the
    /// mean is taken where the first one reports, with the others' last words.
    pub(super) fn rotor_speed(&self) -> Option<Series> {
        let rows = self.rows("ESC")?;
        let instances = rows.column("Instance")?;
        let mut ids: Vec<i64> = instances
            .iter()
            .filter(|id| (0.0..MOST_ROTORS).contains(*id))
            .map(|id| *id as i64)
            .collect();
        ids.sort_unstable();
        ids.dedup();
        let each: Vec<Series> = ids
            .iter()
            .filter_map(|id| {
                let mut own = rows.clone();
                own.retain(|row| instances.get(row) == Some(&(*id as f64)));
                own.series("RPM", |rpm| within(rpm, FASTEST_RPM))
            })
            .collect();
        let (first, others) = each.split_first()?;
        let mut speed = Series::default();
        for (time, rpm) in first.time_s.iter().zip(&first.value) {
            let others: Option<Vec<f64>> =
                others.iter().map(|other| other.latest(*time + SAME_ROW_S, STALE_S)).collect();
            if let Some(others) = others {
                let sum = rpm + others.iter().sum::<f64>();
                speed.time_s.push(*time);
                speed.value.push(sum / (others.len() + 1) as f64);
            }
        }
        speed.value.iter().any(|rpm| *rpm > 0.0).then_some(speed)
    }

    /// Battery voltage at rest as the autopilot estimates it, V, and the resistance of the pack
    /// that it found, ohm.
    pub(super) fn resting(&self) -> (Option<Series>, Option<Series>) {
        let Some(mut rows) = self.rows("BAT").cloned() else { return (None, None) };
        if let Some(instances) = rows.column("Instance").map(<[f64]>::to_vec) {
            rows.retain(|row| instances.get(row) == Some(&0.0));
        }
        let positive = |value: f64| if value > 0.0 { value } else { f64::NAN };
        let possible = |ohm: f64| if ohm < HIGHEST_OHM { positive(ohm) } else { f64::NAN };
        (rows.series("VoltR", positive), rows.series("Res", possible))
    }

    /// GPS rows with a 3-D fix: (board time s, milliseconds since the GPS epoch).
    pub(super) fn gps_ms(&self) -> Vec<(f64, f64)> {
        self.fixes("GWk", "GMS")
            .into_iter()
            .filter(|(_, week, _)| *week > 0.0)
            .map(|(time, week, ms)| (time, week * crate::base::time::WEEK_MS as f64 + ms))
            .collect()
    }

    /// Latitude and longitude of GPS rows with a 3-D fix: (board time s, degrees, degrees).
    pub(super) fn places(&self) -> Vec<(f64, f64, f64)> {
        let mut places = self.fixes("Lat", "Lng");
        places.retain(|(_, lat, lon)| is_place(*lat, *lon));
        places
    }

    /// The same with the height above sea level, m (NaN: not logged).
    pub(super) fn receiver_places(&self) -> Vec<(f64, [f64; 3])> {
        let heights = self.fixes("Lat", "Alt");
        let mut heights = heights.iter().peekable();
        let height_m = |time_s: f64| {
            while heights.next_if(|height| height.0 < time_s).is_some() {}
            heights.peek().filter(|height| height.0 == time_s).map_or(f64::NAN, |height| height.2)
        };
        let places = self.places().into_iter();
        let mut height_m = height_m;
        places.map(|(time_s, lat, lon)| (time_s, [lat, lon, height_m(time_s)])).collect()
    }

    /// Latitude, longitude, degrees, and height above sea level, m, of the position filter.
    pub(super) fn filter_places(&self) -> Vec<(f64, [f64; 3])> {
        let Some(rows) = self.rows("POS") else { return Vec::new() };
        let [Some(lat), Some(lon), alt] = ["Lat", "Lng", "Alt"].map(|name| rows.column(name))
        else {
            return Vec::new();
        };
        let height_m = |row: usize| alt.and_then(|alt| alt.get(row)).copied().unwrap_or(f64::NAN);
        (0..rows.time_s.len())
            .filter_map(|row| {
                let place = [*lat.get(row)?, *lon.get(row)?, height_m(row)];
                Some((*rows.time_s.get(row)?, place))
            })
            .filter(|(_, [lat, lon, _])| is_place(*lat, *lon))
            .collect()
    }

    fn fixes(&self, first: &str, second: &str) -> Vec<(f64, f64, f64)> {
        let Some(rows) = self.rows("GPS") else { return Vec::new() };
        let (Some(one), Some(two)) = (rows.column(first), rows.column(second)) else {
            return Vec::new();
        };
        let status = rows.column("Status").unwrap_or_default();
        let instance = rows.column("I").unwrap_or_default();
        (0..rows.time_s.len())
            .filter(|row| status.get(*row).is_none_or(|status| *status >= 3.0))
            .filter(|row| instance.get(*row).is_none_or(|instance| *instance == 0.0))
            .filter_map(|row| Some((*rows.time_s.get(row)?, *one.get(row)?, *two.get(row)?)))
            .filter(|(_, one, two)| one.is_finite() && two.is_finite())
            .collect()
    }
}

/// Whether this is a place: neither damage, nor what receivers claim (0, 0) before they have a fix.
fn is_place(lat_deg: f64, lon_deg: f64) -> bool {
    lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0 && (lat_deg != 0.0 || lon_deg != 0.0)
}

/// The value, or NaN (which channels leave out) when it is larger than anything possible.
fn within(value: f64, limit: f64) -> f64 {
    if value.abs() <= limit { value } else { f64::NAN }
}

/// What the position filter says, over board time.
#[derive(Debug)]
pub(super) struct Ekf {
    pub(super) velocity_up: Series,
    pub(super) height: Series,
    pub(super) north: Series,
    pub(super) east: Series,
}

/// Speed from two components logged at the same times.
fn horizontal(north: Option<&Series>, east: Option<&Series>) -> Option<Series> {
    let (north, east) = (north?, east?);
    let mut speed = Series::default();
    for (time, north) in north.time_s.iter().zip(&north.value) {
        if let Some(east) = east.latest(*time + 0.02, 0.2) {
            speed.time_s.push(*time);
            speed.value.push(north.hypot(east));
        }
    }
    (!speed.is_empty()).then_some(speed)
}

/// Parameters by name; the last value of each. Compass and statistics rows repeat in flight.
fn parameters(table: &Table) -> BTreeMap<String, f64> {
    let (Some(names), Some(values)) = (table.text("Name"), table.number("Value")) else {
        return BTreeMap::new();
    };
    names
        .iter()
        .zip(values)
        .filter(|(_, value)| value.is_finite())
        .map(|(name, value)| (name.clone(), *value))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{LogWriter, MessageDef, Value};

    /// As ArduCopter 3.2 defines it.
    static RCOU_3_2: MessageDef = MessageDef {
        id: 134,
        name: "RCOU",
        format: "Ihhhhhhhh",
        fields: "TimeMS,Chan1,Chan2,Chan3,Chan4,Chan5,Chan6,Chan7,Chan8",
        units: "s--------",
        multipliers: "C--------",
    };

    #[test]
    fn the_largest_lean_is_known_in_either_unit() {
        let log =
            Log::from_bytes(LogWriter::new(Vec::new(), &[&RCOU_3_2]).unwrap().finish().unwrap());
        let limit_deg = |parameters: &[(&str, f64)]| {
            let mut messages = Messages::read(&log);
            for (name, value) in parameters {
                messages.parameters.insert((*name).to_owned(), *value);
            }
            messages.lean_limit_deg()
        };
        assert_eq!(limit_deg(&[]), None);
        assert_eq!(limit_deg(&[("ANGLE_MAX", 4500.0), ("PSC_ANGLE_MAX", 0.0)]), Some(45.0));
        assert_eq!(limit_deg(&[("ANGLE_MAX", 4500.0), ("PSC_ANGLE_MAX", 20.0)]), Some(20.0));
        assert_eq!(limit_deg(&[("ATC_ANGLE_MAX", 30.0)]), Some(30.0));
    }

    #[test]
    fn outputs_of_old_firmware_are_read() {
        let mut writer = LogWriter::new(Vec::new(), &[&RCOU_3_2]).unwrap();
        for row in 0..50 {
            let outputs = [1500, 1520, 1480, 1500, 0, 0, 0, 0];
            let values = [100 + 20 * row].into_iter().chain(outputs).map(Value::Int);
            writer.row(&RCOU_3_2, &values.collect::<Vec<_>>()).unwrap();
        }
        let log = Log::from_bytes(writer.finish().unwrap());
        let messages = Messages::read(&log);
        assert!(messages.has_outputs());
        let [mean, largest, smallest] = messages.motors().unwrap();
        assert_eq!((mean.value[0], largest.value[0], smallest.value[0]), (1500.0, 1520.0, 1480.0));
        assert_eq!((mean.value.len(), mean.time_s[0]), (50, 0.1));
        assert_eq!(Messages::read_identity(&log).output_times().unwrap().time_s.len(), 50);
    }

    static RCOU: MessageDef = MessageDef {
        id: 135,
        name: "RCOU",
        format: "QHHHHHHHHHHHHHH",
        fields: "TimeUS,C1,C2,C3,C4,C5,C6,C7,C8,C9,C10,C11,C12,C13,C14",
        units: "s--------------",
        multipliers: "F--------------",
    };

    /// Outputs 1..8 at 1500 us, 9..12 at 1800 us; 13 and 14 carry a gimbal at 1100 us.
    fn twelve_outputs() -> Messages {
        let mut writer = LogWriter::new(Vec::new(), &[&RCOU]).unwrap();
        for row in 0..50 {
            let outputs = (1..=14).map(|output| match output {
                1..=8 => 1500,
                9..=12 => 1800,
                _ => 1100,
            });
            let values = [100_000 + 20_000 * row].into_iter().chain(outputs).map(Value::Int);
            writer.row(&RCOU, &values.collect::<Vec<_>>()).unwrap();
        }
        Messages::read(&Log::from_bytes(writer.finish().unwrap()))
    }

    /// SERVOn_FUNCTION of output n by ArduPilot's numbers: Motor1..8 are 33..40, Motor9..12 are 82..85.
    fn assign(messages: &mut Messages, functions: &[f64]) {
        for (index, function) in functions.iter().enumerate() {
            messages.parameters.insert(format!("SERVO{}_FUNCTION", index + 1), *function);
        }
    }

    fn first_row(messages: &Messages) -> (f64, f64, f64) {
        let [mean, largest, smallest] = messages.motors().unwrap();
        (mean.value[0], largest.value[0], smallest.value[0])
    }

    #[test]
    fn the_effort_of_a_dodecarotor_is_that_of_all_twelve() {
        let mut messages = twelve_outputs();
        let twelve = [33., 34., 35., 36., 37., 38., 39., 40., 82., 83., 84., 85., 7., 8.];
        assign(&mut messages, &twelve);
        assert_eq!(first_row(&messages), (1600.0, 1800.0, 1500.0));
    }

    #[test]
    fn functions_next_to_the_motors_are_none() {
        let mut messages = twelve_outputs();
        // 32, 41, 81 and 86 are other functions of ArduPilot.
        let some = [33., 34., 35., 40., 0., 0., 0., 0., 82., 85., 32., 41., 81., 86.];
        assign(&mut messages, &some);
        assert_eq!(messages.motor_channels(), [1, 2, 3, 4, 9, 10]);
        messages.parameters.clear();
        assert_eq!(messages.motor_channels(), [1, 2, 3, 4], "nothing is assigned: a quadrotor");
    }

    #[test]
    fn the_rotor_speed_is_the_mean_of_all_controllers() {
        static ESC: MessageDef = MessageDef {
            id: 136,
            name: "ESC",
            format: "QBf",
            fields: "TimeUS,Instance,RPM",
            units: "s#q",
            multipliers: "F--",
        };
        let mut writer = LogWriter::new(Vec::new(), &[&ESC]).unwrap();
        for row in 0..50 {
            for id in 0..12 {
                let time_us = 100_000 + 100_000 * row + 1_000 * id;
                let rpm = if id < 8 { 5000.0 } else { 8000.0 };
                let values = [Value::Int(time_us), Value::Int(id), Value::Float(rpm)];
                writer.row(&ESC, &values).unwrap();
            }
        }
        let messages = Messages::read(&Log::from_bytes(writer.finish().unwrap()));
        let speed = messages.rotor_speed().unwrap();
        assert!(speed.value.iter().all(|rpm| (rpm - 6000.0).abs() < 1e-6), "{:?}", speed.value);
    }
}
