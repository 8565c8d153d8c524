//! Words of the page: a flight at one moment.

use schemars::JsonSchema;
use serde::Serialize;

/// A flight at one moment. Positions are in the show frame (x along the rows, y to the left, z up), m.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct View {
    /// Time of the station, ms since 1970.
    pub now_ms: u64,
    /// Time of the show, s; absent before a start is known.
    pub show_s: Option<f64>,
    /// Step that the station is at.
    pub step: Step,
    /// What the station waits for, and what follows, in a sentence; empty: nothing.
    pub waits: String,
    /// Question that is open, if it can be answered from a page.
    pub question: Option<Question>,
    /// Drones, by slot; those without a slot last.
    pub drones: Vec<DroneView>,
    /// What was said, oldest first.
    pub said: Vec<Said>,
    /// Table before a start, as far as it is filled.
    pub preflight: Option<PreflightView>,
    /// Air as it is measured.
    pub air: Option<AirView>,
    /// Where a replay stands.
    pub replay: Option<Replay>,
}

/// Steps of a flight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Step {
    /// Drones are listened for.
    #[default]
    Listening,
    /// Drones are asked for clocks and versions.
    Greeting,
    /// Drones are assigned to slots by where they stand.
    Assigning,
    /// Shows, origins and fences are sent.
    Uploading,
    /// Parameters are read, and set where that was asked for.
    Parameters,
    /// Everything that must be right before a start is looked at.
    Preflight,
    /// The start time is set, and a person is asked for leave.
    Start,
    /// The show runs.
    Flying,
    /// Logs are brought home.
    Logs,
    /// Nothing more follows.
    Over,
    /// A flight is shown from its logs.
    Replay,
}

/// A question to whoever may answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Question {
    /// Number of the question: an answer to an earlier one is none.
    pub number: u64,
    /// Text of the question.
    pub text: String,
    /// Answers that may be given: the word, and what it does.
    pub answers: Vec<(String, String)>,
}

/// How bad it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// As it should be.
    #[default]
    Good,
    /// Worth a look.
    Notice,
    /// Stands in the way, or will soon.
    Warning,
    /// Somebody must act at once.
    Alarm,
}

/// One drone.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct DroneView {
    /// Slot of the plan; absent: the drone has none.
    pub slot: Option<u16>,
    /// Identifier; absent: nobody flies the slot yet.
    pub drone: Option<String>,
    /// Stage of the show, or flight mode.
    pub stage: String,
    /// Whether its motors may run.
    pub armed: Option<bool>,
    /// When it was heard last, ms since 1970.
    pub heard_ms: Option<u64>,
    /// Share of its messages that is lost, %.
    pub loss_percent: Option<f64>,
    /// Strength of its signal, % of the best, where the radio tells it.
    pub signal_percent: Option<f64>,
    /// Fix of its GPS receiver: 3 is 3-D, 4 differential, 5 and 6 RTK.
    pub gps_fix: Option<u8>,
    /// Satellites in use.
    pub satellites: Option<u8>,
    /// Charge left, %.
    pub battery_percent: Option<f64>,
    /// Voltage, V.
    pub battery_v: Option<f64>,
    /// Time until the charge that must be left is all there is, min, at the rate of the flight so far.
    pub minutes_left: Option<f64>,
    /// Where it is, m.
    pub place_m: Option<[f64; 3]>,
    /// Distance from its trajectory, m.
    pub distance_m: Option<f64>,
    /// Latest words of weight, or the last thing that happened to it.
    pub words: String,
    /// How bad it is.
    pub level: Level,
    /// Why, in a few words; empty: nothing is wrong.
    pub trouble: String,
    /// What it was ordered to do, and how far that is.
    pub order: String,
    /// Vertical air speed, m/s, up positive.
    pub air_mps: Option<f64>,
    /// Its standard error, m/s.
    pub air_se_mps: Option<f64>,
}

/// Something that was said, by the station or a drone.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Said {
    /// Number, rising from 1.
    pub number: u64,
    /// When, ms since 1970.
    pub at_ms: u64,
    /// How bad it is.
    pub level: Level,
    /// Text.
    pub text: String,
}

/// Table before a start.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, JsonSchema)]
pub struct PreflightView {
    /// Whether the fleet may start.
    pub go: bool,
    /// Headings of the cells.
    pub columns: Vec<String>,
    /// Rows: slot, and text and reason (empty: good) of each cell.
    pub rows: Vec<(u16, Vec<(String, String)>)>,
    /// Problems of several drones.
    pub fleet: Vec<String>,
}

/// Air as it is measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct AirView {
    /// Whether it rests on telemetry alone.
    pub provisional: bool,
    /// Time of the show that it is of, s.
    pub time_s: f64,
    /// Mean of the fleet with its 95 % interval, m/s, up positive.
    pub fleet_mps: Option<[f64; 3]>,
    /// Map between the drones.
    pub map: Option<AirMap>,
    /// How it was made, and what it lacks.
    pub note: String,
}

/// Map of the vertical air speed in the plane of the grid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct AirMap {
    /// Corner of the first cell's centre, m.
    pub origin_m: [f64; 2],
    /// Distance of cells, m.
    pub step_m: f64,
    /// Cells along x.
    pub columns: usize,
    /// Values, m/s, cells along x first; absent: not known there.
    pub values_mps: Vec<Option<f64>>,
}

/// Where a replay stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Replay {
    /// First and last moment, show time, s.
    pub ends_s: [f64; 2],
    /// Times as fast as the flight.
    pub speed: f64,
    /// Whether it goes on.
    pub plays: bool,
}
