//! Mission templates: TOML files that say what to fly, with errors that point at the line.
//!
//! The grammar is documented in `docs/templates.md`. A template is read twice: once as typed here,
//! with the place of every value kept, and once more after command-line overrides.

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;

use serde::de::{self, Deserializer, Visitor};
use serde::{Deserialize, Serialize};
use toml::Spanned;

use super::error::TemplateError;
use super::plan::Purpose;
use crate::base::parse;

/// Name and version of the template format.
pub const TEMPLATE_SCHEMA: &str = "updraft.template/1";

/// A template file: one flight, or a campaign of several.
#[derive(Clone, Debug)]
pub enum Template {
    /// A template of a single flight.
    Flight(Box<FlightTemplate>),
    /// A template of several flights with one fleet.
    Campaign(CampaignTemplate),
}

/// A campaign: several flights with one fleet, each from its own template.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CampaignTemplate {
    /// Name and version of the format: `updraft.template/1`.
    pub schema: Spanned<String>,
    /// Short name of the campaign, used for folders.
    pub name: Spanned<String>,
    /// Title of the campaign, for people.
    pub title: String,
    /// Overrides applied to every flight: key path to value.
    #[serde(default)]
    pub set: toml::Table,
    /// The flights, in the order they are flown.
    pub flights: Spanned<Vec<FlightReference>>,
}

/// One flight of a campaign.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightReference {
    /// Template file: a built-in name or a path relative to the campaign's file.
    pub template: Spanned<String>,
    /// Overrides for this flight: key path to value.
    #[serde(default)]
    pub set: toml::Table,
}

/// A flight, as its TOML file states it.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FlightTemplate {
    /// Name and version of the format: `updraft.template/1`.
    pub schema: Spanned<String>,
    /// Short name, used for folders.
    pub name: Spanned<String>,
    /// Title of the flight, for people.
    pub title: String,
    /// Purpose of the flight, which decides what the analysis makes of it.
    pub purpose: Purpose,
    /// Vehicle: a built-in name or a path to a vehicle file.
    pub vehicle: Spanned<String>,
    /// Place of the show.
    pub site: SiteTemplate,
    /// Start positions of the drones, and their spacing.
    pub grid: GridTemplate,
    /// Climb from the ground to the height at which the steps begin.
    #[serde(default)]
    pub takeoff: TakeoffTemplate,
    /// Descent at the end, from the last step to the height at which the show ends.
    #[serde(default)]
    pub landing: LandingTemplate,
    /// Changes of velocity between the segments.
    #[serde(default)]
    pub motion: MotionTemplate,
    /// Fence around the show.
    #[serde(default)]
    pub fence: FenceTemplate,
    /// Part of each segment that the analysis looks at.
    #[serde(default)]
    pub window: WindowTemplate,
    /// Limits that differ from the vehicle's.
    #[serde(default)]
    pub limits: LimitsTemplate,
    /// Named numbers, used in steps as `"$name"`.
    #[serde(default)]
    pub parameters: BTreeMap<String, Spanned<Quantity>>,
    /// Groups that fly the steps at different times; if empty, all drones fly together.
    #[serde(default)]
    pub groups: Vec<GroupTemplate>,
    /// Steps between take-off and landing, in order.
    pub steps: Vec<Spanned<StepTemplate>>,
    /// Horizontal legs behind the steps, which calibrate what wind does to the vehicle.
    pub legs: Option<Spanned<LegsTemplate>>,
    /// Preparations and warnings for the crew, one sentence each.
    #[serde(default)]
    pub briefing: Vec<String>,
}

/// Place and orientation of the show frame.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SiteTemplate {
    /// Name of the place, for people.
    #[serde(default)]
    pub name: Option<Spanned<String>>,
    /// Local time there less UTC, h.
    #[serde(default)]
    pub utc_offset_h: Option<Spanned<f64>>,
    /// Latitude and longitude of the show origin, degrees.
    pub origin: Spanned<[f64; 2]>,
    /// Ground height above mean sea level, m.
    pub ground_amsl_m: Spanned<f64>,
    /// Whether the ground height is that of another place, because none was given for this origin.
    #[serde(default)]
    pub ground_assumed: bool,
    /// Degrees clockwise from north to the show's x axis.
    #[serde(default = "zero")]
    pub orientation_deg: Spanned<f64>,
}

/// Arrangement of the drones on the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// Rows and columns.
    #[default]
    Grid,
    /// Two lines that cross in the show origin: one along the rows, one along the columns.
    Cross,
}

/// Layout of the fleet on the ground, centred on the show origin: a rectangular grid, or a cross.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridTemplate {
    /// Rows, along show x.
    pub rows: Option<Spanned<i64>>,
    /// Columns, along show y.
    pub columns: Option<Spanned<i64>>,
    /// Number of drones; fills the grid row by row. Without rows and columns the grid is the
    /// smallest near-square one that holds them.
    pub drones: Option<Spanned<i64>>,
    /// Arrangement of the drones: a grid of rows and columns, or a cross of as many drones.
    #[serde(default)]
    pub shape: Shape,
    /// Distance between neighbours, m.
    pub spacing_m: Spanned<f64>,
}

/// First climb from the ground.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TakeoffTemplate {
    /// Height at which the steps begin, m.
    pub altitude_m: Spanned<f64>,
    /// Climb speed of the take-off, m/s.
    pub speed_mps: Spanned<f64>,
}

/// Last vertical descent; the autopilot lands the drone from its end.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LandingTemplate {
    /// Height at which the show ends, m.
    pub end_altitude_m: Spanned<f64>,
    /// Descent speed of the landing, m/s.
    pub speed_mps: Spanned<f64>,
}

/// Changes of velocity between segments.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotionTemplate {
    /// Acceleration of the ramps between segments, m/s²; 0: steps, as in the paper.
    pub ramp_mps2: Spanned<f64>,
}

/// Fence around the show.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FenceTemplate {
    /// Room between the outermost trajectory and the fence, m.
    pub room_m: Spanned<f64>,
    /// Distance that trajectories must keep from the fence, m.
    pub margin_m: Spanned<f64>,
    /// Highest altitude above ground, m; absent: the highest point plus `room_m`.
    pub max_altitude_m: Option<Spanned<f64>>,
}

/// Analysis windows: the last `length_s` of a segment without its last `trim_s`, and never before
/// `settle_s` into it. Hovers are used whole, from `settle_s` to `trim_s` before the end.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct WindowTemplate {
    /// Length counted back from the end of a leg, s.
    pub length_s: Spanned<f64>,
    /// Time left out at the end of a segment, s.
    pub trim_s: Spanned<f64>,
    /// Time left out at the start of a segment, s.
    pub settle_s: Spanned<f64>,
}

/// Horizontal legs that calibrate what wind does to the vehicle: each speed on each heading, with a hover before
/// the first and behind each.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LegsTemplate {
    /// Speeds over ground, m/s.
    pub speeds_mps: Spanned<Quantity>,
    /// Headings at each speed, degrees clockwise from the show's x axis.
    #[serde(default = "all_sides")]
    pub headings_deg: Spanned<Quantity>,
    /// Duration of a leg with its ramp, s.
    #[serde(default = "leg_s")]
    pub duration_s: Spanned<Quantity>,
    /// Duration of a hover with its ramp, s.
    #[serde(default = "between_legs_s")]
    pub hover_s: Spanned<Quantity>,
    /// Acceleration of the ramps where the flight has none of its own, m/s².
    #[serde(default = "leg_ramp")]
    pub ramp_mps2: Spanned<f64>,
}

/// Limits that differ from the vehicle's own.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LimitsTemplate {
    /// Largest horizontal speed, m/s.
    pub max_speed_xy_mps: Option<Spanned<f64>>,
    /// Largest upward speed, m/s.
    pub max_speed_up_mps: Option<Spanned<f64>>,
    /// Largest downward speed, m/s.
    pub max_speed_down_mps: Option<Spanned<f64>>,
    /// Largest acceleration within a piece, m/s².
    pub max_acceleration_mps2: Option<Spanned<f64>>,
    /// Largest jump of velocity between pieces, m/s.
    pub max_velocity_step_mps: Option<Spanned<f64>>,
    /// Highest altitude above ground, m.
    pub max_altitude_m: Option<Spanned<f64>>,
    /// Smallest distance between drones in the air, m.
    pub min_distance_m: Option<Spanned<f64>>,
    /// Time a full battery carries the vehicle in hover, s.
    pub endurance_s: Option<Spanned<f64>>,
    /// Share of the endurance that must be left after landing.
    pub endurance_reserve: Option<Spanned<f64>>,
}

/// A group of drones that fly all steps with one time offset.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GroupTemplate {
    /// Name of the group.
    pub name: Spanned<String>,
    /// Which drones: `all`, `checkerboard-even`, `checkerboard-odd`, `rows-even`, `rows-odd`,
    /// `columns-even`, `columns-odd`, or a list of slot numbers.
    pub select: Spanned<Selection>,
    /// Delay of the group's steps, s.
    #[serde(default = "zero_quantity")]
    pub offset_s: Spanned<Quantity>,
}

/// Choice of the drones that belong to a group.
#[derive(Clone, Debug, PartialEq)]
pub enum Selection {
    /// A named pattern of the grid.
    Pattern(String),
    /// Slot numbers, from 1.
    Slots(Vec<u16>),
}

/// One step, as typed: which keys are allowed depends on `kind` (see `docs/templates.md`).
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StepTemplate {
    /// Manoeuvre of the step; it decides which of the other keys apply.
    pub kind: Spanned<StepKind>,
    /// `climb`: target height above home, m. Inside a `repeat` over heights, absent means that height.
    pub to_m: Option<Spanned<Quantity>>,
    /// `climb`, `leg`, `horizontal`: speed, m/s. Inside a `repeat` over speeds, absent means that
    /// speed.
    pub speed_mps: Option<Spanned<Quantity>>,
    /// `leg`, `hover`, `horizontal`: duration, s.
    pub duration_s: Option<Spanned<Quantity>>,
    /// `leg`: up or down.
    pub direction: Option<Spanned<Direction>>,
    /// `horizontal`: degrees clockwise from the show's x axis.
    pub heading_deg: Option<Spanned<Quantity>>,
    /// `repeat`: one pass per speed, m/s, in this order.
    pub speeds_mps: Option<Spanned<Quantity>>,
    /// `repeat`: one pass per height above home, m, in this order.
    pub heights_m: Option<Spanned<Quantity>>,
    /// `repeat`: number of passes.
    pub times: Option<Spanned<Quantity>>,
    /// `repeat`: the steps of each pass.
    pub steps: Option<Vec<Spanned<StepTemplate>>>,
}

/// Kinds of steps, as `kind` names them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum StepKind {
    /// Vertical transfer to a height.
    Climb,
    /// Rung of the ladder: constant vertical speed for a time.
    Leg,
    /// Stand still in the air.
    Hover,
    /// Constant horizontal speed for a time.
    Horizontal,
    /// Several passes of inner steps.
    Repeat,
    /// Hover for the group's own time offset; the groups are apart in time from here on.
    Stagger,
    /// Hover until the last group has caught up; the groups are together from here on.
    Rejoin,
}

/// Sense of a vertical leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// A climb, towards positive z.
    Up,
    /// A descent, towards negative z.
    Down,
}

/// A number, a list of numbers, or the name of a parameter (`"$name"`).
#[derive(Clone, Debug, PartialEq)]
pub enum Quantity {
    /// A single number, as written.
    Number(f64),
    /// A list of numbers.
    List(Vec<f64>),
    /// Reference to `[parameters]`, without the `$`.
    Reference(String),
}

fn at_default<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

fn zero() -> Spanned<f64> {
    at_default(0.0)
}

/// There and back, and there and back across: the fleet ends where it began.
fn all_sides() -> Spanned<Quantity> {
    at_default(Quantity::List(vec![0.0, 180.0, 90.0, 270.0]))
}

/// Three seconds of ramp, three to settle, and a window of ten.
fn leg_s() -> Spanned<Quantity> {
    at_default(Quantity::Number(16.0))
}

fn between_legs_s() -> Spanned<Quantity> {
    at_default(Quantity::Number(12.0))
}

/// Half of what show drones are allowed.
fn leg_ramp() -> Spanned<f64> {
    at_default(2.0)
}

fn zero_quantity() -> Spanned<Quantity> {
    at_default(Quantity::Number(0.0))
}

impl Default for TakeoffTemplate {
    fn default() -> Self {
        Self { altitude_m: at_default(5.0), speed_mps: at_default(1.0) }
    }
}

impl Default for LandingTemplate {
    fn default() -> Self {
        Self { end_altitude_m: at_default(2.5), speed_mps: at_default(1.0) }
    }
}

impl Default for MotionTemplate {
    fn default() -> Self {
        Self { ramp_mps2: at_default(0.0) }
    }
}

impl Default for FenceTemplate {
    fn default() -> Self {
        Self { room_m: at_default(20.0), margin_m: at_default(10.0), max_altitude_m: None }
    }
}

impl Default for WindowTemplate {
    fn default() -> Self {
        Self { length_s: at_default(10.0), trim_s: at_default(1.0), settle_s: at_default(3.0) }
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct QuantityVisitor;

        impl<'de> Visitor<'de> for QuantityVisitor {
            type Value = Quantity;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number, a list of numbers, or a parameter such as \"$leg_s\"")
            }

            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Quantity, E> {
                Ok(Quantity::Number(value))
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Quantity, E> {
                Ok(Quantity::Number(value as f64))
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<Quantity, E> {
                match value.strip_prefix('$') {
                    Some(name) if !name.is_empty() => Ok(Quantity::Reference(name.to_owned())),
                    _ => Err(E::invalid_value(de::Unexpected::Str(value), &self)),
                }
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Quantity, A::Error> {
                let mut list = Vec::new();
                while let Some(value) = seq.next_element::<f64>()? {
                    list.push(value);
                }
                Ok(Quantity::List(list))
            }
        }

        deserializer.deserialize_any(QuantityVisitor)
    }
}

impl<'de> Deserialize<'de> for Selection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct SelectionVisitor;

        impl<'de> Visitor<'de> for SelectionVisitor {
            type Value = Selection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a pattern such as \"checkerboard-even\" or a list of slot numbers")
            }

            fn visit_str<E: de::Error>(self, value: &str) -> Result<Selection, E> {
                Ok(Selection::Pattern(value.to_owned()))
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, mut seq: A) -> Result<Selection, A::Error> {
                let mut slots = Vec::new();
                while let Some(slot) = seq.next_element::<u16>()? {
                    slots.push(slot);
                }
                Ok(Selection::Slots(slots))
            }
        }

        deserializer.deserialize_any(SelectionVisitor)
    }
}

impl Template {
    /// Reads a template. `path` is only for messages.
    ///
    /// # Errors
    ///
    /// [`TemplateError`], which points at the line: bad TOML, an unknown or missing key, a wrong
    /// type, or another format.
    pub fn parse(path: &str, text: &str) -> Result<Self, TemplateError> {
        let failed = |error: &toml::de::Error| {
            TemplateError::new(path, text, error.span(), first_line(error.message()))
        };
        let table: toml::Table = parse::toml(text).map_err(|error| failed(&error))?;
        let template = if table.contains_key("flights") {
            Self::Campaign(parse::toml(text).map_err(|error| failed(&error))?)
        } else {
            Self::Flight(Box::new(parse::toml(text).map_err(|error| failed(&error))?))
        };
        let schema = match &template {
            Self::Flight(flight) => &flight.schema,
            Self::Campaign(campaign) => &campaign.schema,
        };
        if schema.get_ref() != TEMPLATE_SCHEMA {
            return Err(TemplateError::new(
                path,
                text,
                Some(schema.span()),
                format!("this program reads templates of the format \"{TEMPLATE_SCHEMA}\""),
            ));
        }
        Ok(template)
    }
}

/// The reader's message in the words of people who write templates.
pub(crate) fn first_line(message: &str) -> String {
    let line = message.lines().next().unwrap_or_default();
    line.replace("expected f64", "expected a number")
        .replace("expected a sequence", "expected a list")
        .replace("expected i64", "expected a whole number")
        .replace("unknown field", "unknown key")
        .replace("missing field", "missing key")
        .replace("unknown variant", "unknown value")
}

/// Span of a value, or `None` for a default that stands nowhere in the text.
pub(super) fn span_of<T>(value: &Spanned<T>) -> Option<Range<usize>> {
    let span = value.span();
    (!span.is_empty()).then_some(span)
}
