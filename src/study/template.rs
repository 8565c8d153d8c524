//! Study files: TOML that says which ladder is flown in which airs, with errors that point at the
//! line. The grammar is documented in `docs/study.md`.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use serde::Deserialize;
use serde::de::{self, Deserializer, Visitor};
use toml::{Spanned, Value};

use super::cell::{Cell, Condition};
use super::error::StudyError;
use crate::base::file::read_whole;
use crate::base::parse;
use crate::mission::error::TemplateError;
use crate::mission::plan::{Plan, Segment, Slot};
use crate::mission::resolve::{MissionError, Override, resolve};
use crate::mission::template::first_line;
use crate::vehicle::{Vehicle, VehicleError, library};

/// Name and version of the study format.
pub const STUDY_TEMPLATE_SCHEMA: &str = "updraft.study/1";

/// Largest study file that is read, bytes.
pub(super) const MAX_STUDY_BYTES: u64 = 4 << 20;
/// Most flights of a study.
const MAX_FLIGHTS: usize = 100_000;
/// Fewest updrafts that a correlation says anything about.
const FEWEST_UPDRAFTS: usize = 3;
/// Speeds and angles are kept to a millionth, so that -3.5 + 6 x 0.7 is 0.7.
const GRAIN: f64 = 1e-6;
/// The study that comes with the program.
const BUILTIN: &str = include_str!("../../templates/study.toml");

/// What a study's TOML file states.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StudyTemplate {
    schema: Spanned<String>,
    title: String,
    template: Spanned<String>,
    vehicle: Option<Spanned<String>>,
    winds_mps: Spanned<Vec<f64>>,
    #[serde(default = "six")]
    directions: Spanned<Directions>,
    updrafts_mps: Spanned<Updrafts>,
    #[serde(default)]
    set: BTreeMap<String, Spanned<Value>>,
}

fn six() -> Spanned<Directions> {
    Spanned::new(0..0, Directions::Count(6))
}

/// Where winds come from.
#[derive(Clone, Debug)]
enum Directions {
    /// So many, equally spaced, the first from north.
    Count(i64),
    /// Degrees clockwise from north.
    List(Vec<f64>),
}

/// Vertical air speeds, m/s.
#[derive(Clone, Debug)]
enum Updrafts {
    List(Vec<f64>),
    Range(Range),
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: f64,
    to: f64,
    step: f64,
}

impl<'de> Deserialize<'de> for Directions {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Directions;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a number of directions or a list of degrees")
            }

            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Directions, E> {
                Ok(Directions::Count(value))
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Directions, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Directions::List)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

impl<'de> Deserialize<'de> for Updrafts {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Updrafts;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of speeds or { from = ..., to = ..., step = ... }")
            }

            fn visit_seq<A: de::SeqAccess<'de>>(self, seq: A) -> Result<Updrafts, A::Error> {
                Vec::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Updrafts::List)
            }

            fn visit_map<A: de::MapAccess<'de>>(self, map: A) -> Result<Updrafts, A::Error> {
                Range::deserialize(de::value::MapAccessDeserializer::new(map)).map(Updrafts::Range)
            }
        }
        deserializer.deserialize_any(Either)
    }
}

/// A study, read and resolved: what is flown, and in which airs.
#[derive(Clone, Debug)]
pub struct StudyPlan {
    /// Title of the study, for people.
    pub title: String,
    /// The mission template, as the study names it.
    pub template: String,
    /// Vehicle that flies the study.
    pub vehicle: Vehicle,
    /// The plan; its first slot is flown.
    pub plan: Plan,
    /// The slot that is flown.
    pub slot: Slot,
    /// Segments that the slot flies, in order.
    pub segments: Vec<Segment>,
    /// Wind conditions, in the order of the file: still air once, each wind in every direction.
    pub conditions: Vec<Condition>,
    /// Vertical air speeds, m/s, up positive, in the order of the file.
    pub updrafts_mps: Vec<f64>,
}

impl StudyPlan {
    /// Reads a study: a file, or the built-in one by its name (`study`, `templates/study.toml`).
    ///
    /// # Errors
    /// [`StudyError`]: an unreadable file, or a wrong study or mission template.
    pub fn load(name: &str) -> Result<Self, StudyError> {
        let path = Path::new(name);
        if path.is_file() {
            let bytes = read_whole(path, MAX_STUDY_BYTES)?;
            return Self::parse(name, &String::from_utf8_lossy(&bytes));
        }
        let plain = name.strip_prefix("templates/").unwrap_or(name);
        match plain.strip_suffix(".toml").unwrap_or(plain) {
            "study" => Self::parse("templates/study.toml", BUILTIN),
            _ => Err(StudyError::NoStudy { name: name.to_owned() }),
        }
    }

    /// Reads a study's text; `path` locates the files it names and is shown in messages.
    ///
    /// # Errors
    /// See [`StudyPlan::load`].
    pub fn parse(path: &str, text: &str) -> Result<Self, StudyError> {
        let typed: StudyTemplate = parse::toml(text).map_err(|error: toml::de::Error| {
            TemplateError::new(path, text, error.span(), first_line(error.message()))
        })?;
        let place = Place { path, text };
        if typed.schema.get_ref() != STUDY_TEMPLATE_SCHEMA {
            let message =
                format!("this program reads studies of the format \"{STUDY_TEMPLATE_SCHEMA}\"");
            return Err(place.error(&typed.schema, message).into());
        }
        let winds = winds(&place, &typed.winds_mps)?;
        let directions = directions(&place, &typed.directions)?;
        let updrafts_mps = updrafts(&place, &typed.updrafts_mps)?;
        let conditions = conditions(&winds, &directions);
        let flights = conditions.len().saturating_mul(updrafts_mps.len());
        if flights > MAX_FLIGHTS {
            return Err(place
                .error(&typed.updrafts_mps, format!("the study would have {flights} flights"))
                .with_help(format!("allowed: up to {MAX_FLIGHTS}"))
                .into());
        }
        let (plan, vehicle) = resolved(&place, &typed)?;
        let slot = plan
            .slots
            .first()
            .cloned()
            .ok_or_else(|| place.error(&typed.template, "the template has no drone"))?;
        let segments = plan.segments(&slot).to_vec();
        let legs = segments.iter().filter(|s| s.kind.is_leg() && s.window.is_some()).count();
        if legs < FEWEST_UPDRAFTS {
            return Err(place
                .error(
                    &typed.template,
                    "the template has no ladder that A, u0 and W can be fitted to",
                )
                .with_help("a study flies a calibration: three legs or more")
                .into());
        }
        Ok(Self {
            title: typed.title,
            template: typed.template.into_inner(),
            vehicle,
            plan,
            slot,
            segments,
            conditions,
            updrafts_mps,
        })
    }

    /// Flights of the study: every updraft in every wind condition.
    pub fn cells(&self) -> Vec<Cell> {
        let of = |&condition: &Condition| {
            self.updrafts_mps.iter().map(move |&updraft_mps| Cell { condition, updraft_mps })
        };
        self.conditions.iter().flat_map(of).collect()
    }
}

/// Where a message points.
pub(super) struct Place<'a> {
    pub(super) path: &'a str,
    pub(super) text: &'a str,
}

impl Place<'_> {
    /// The path of a file beside the study's; a name that is none, from where the program runs or built in.
    pub(super) fn beside(&self, name: &str) -> String {
        let folder = Path::new(self.path).parent().unwrap_or(Path::new(""));
        let path = folder.join(name);
        if path.is_file() { path.to_string_lossy().into_owned() } else { name.to_owned() }
    }

    /// An error at the place of a value.
    pub(super) fn error<T>(&self, value: &Spanned<T>, message: impl Into<String>) -> TemplateError {
        let span = value.span();
        TemplateError::new(self.path, self.text, (!span.is_empty()).then_some(span), message)
    }
}

/// Refuses numbers outside of a range and numbers that are there twice.
fn numbers<T>(
    place: &Place<'_>,
    value: &Spanned<T>,
    list: &[f64],
    (what, unit): (&str, &str),
    (low, high): (f64, f64),
) -> Result<Vec<f64>, TemplateError> {
    let mut kept: Vec<f64> = Vec::with_capacity(list.len());
    for &number in list {
        if !(low..=high).contains(&number) {
            return Err(place
                .error(value, format!("{what} cannot be {number} {unit}"))
                .with_help(format!("allowed: {low} to {high} {unit}")));
        }
        let number = rounded(number);
        if kept.contains(&number) {
            return Err(place.error(value, format!("{what} {number} {unit} is there twice")));
        }
        kept.push(number);
    }
    Ok(kept)
}

/// To the grain, without a negative zero.
fn rounded(number: f64) -> f64 {
    (number / GRAIN).round() / (1.0 / GRAIN).round() + 0.0
}

fn needs_zero<T>(
    place: &Place<'_>,
    value: &Spanned<T>,
    list: &[f64],
    what: &str,
) -> Result<(), TemplateError> {
    if list.contains(&0.0) {
        return Ok(());
    }
    Err(place
        .error(value, format!("{what} 0 is missing"))
        .with_help("A and u0 come from the flight without wind and updraft"))
}

fn winds(place: &Place<'_>, value: &Spanned<Vec<f64>>) -> Result<Vec<f64>, TemplateError> {
    let list = numbers(place, value, value.get_ref(), ("wind", "m/s"), (0.0, 30.0))?;
    needs_zero(place, value, &list, "wind")?;
    Ok(list)
}

fn directions(place: &Place<'_>, value: &Spanned<Directions>) -> Result<Vec<f64>, TemplateError> {
    match value.get_ref() {
        Directions::Count(count @ 1..=360) => {
            Ok((0..*count).map(|k| rounded(k as f64 * 360.0 / *count as f64)).collect())
        }
        Directions::Count(count) => Err(place
            .error(value, format!("the number of directions cannot be {count}"))
            .with_help("allowed: 1 to 360")),
        Directions::List(list) if list.is_empty() => {
            Err(place.error(value, "a study needs a direction for its winds"))
        }
        Directions::List(list) => {
            numbers(place, value, list, ("direction", "degrees"), (0.0, 359.999_999))
        }
    }
}

fn updrafts(place: &Place<'_>, value: &Spanned<Updrafts>) -> Result<Vec<f64>, TemplateError> {
    let list = match value.get_ref() {
        Updrafts::List(list) => list.clone(),
        Updrafts::Range(range) => steps(place, value, range)?,
    };
    let list = numbers(place, value, &list, ("updraft", "m/s"), (-20.0, 20.0))?;
    needs_zero(place, value, &list, "updraft")?;
    if list.len() < FEWEST_UPDRAFTS {
        return Err(place
            .error(value, format!("{} updrafts do not make a correlation", list.len()))
            .with_help(format!("give {FEWEST_UPDRAFTS} or more")));
    }
    Ok(list)
}

fn steps(
    place: &Place<'_>,
    value: &Spanned<Updrafts>,
    range: &Range,
) -> Result<Vec<f64>, TemplateError> {
    let Range { from, to, step } = *range;
    let count = (to - from) / step;
    if !(step > 0.0 && count >= 0.0 && (count - count.round()).abs() < GRAIN) {
        return Err(place
            .error(value, format!("steps of {step} do not lead from {from} to {to} m/s"))
            .with_help(
                "a positive step that divides the range: { from = -3.5, to = 3.5, step = 0.7 }",
            ));
    }
    if count >= MAX_FLIGHTS as f64 {
        return Err(place
            .error(value, format!("{} updrafts are too many", count.round() + 1.0))
            .with_help(format!("allowed: up to {MAX_FLIGHTS} flights")));
    }
    Ok((0..=count.round() as usize).map(|k| rounded(from + k as f64 * step)).collect())
}

fn conditions(winds: &[f64], directions: &[f64]) -> Vec<Condition> {
    let mut conditions = Vec::new();
    for &wind_mps in winds {
        if wind_mps == 0.0 {
            conditions.push(Condition::STILL);
        } else {
            let blowing = |&from_deg| Condition { wind_mps, from_deg: Some(from_deg) };
            conditions.extend(directions.iter().map(blowing));
        }
    }
    conditions
}

/// The plan and the vehicle that the study flies.
fn resolved(place: &Place<'_>, typed: &StudyTemplate) -> Result<(Plan, Vehicle), StudyError> {
    let mut overrides = Vec::new();
    for (key, value) in &typed.set {
        flatten(key, value.get_ref(), &mut overrides);
    }
    if let Some(vehicle) = &typed.vehicle {
        let name = place.beside(vehicle.get_ref());
        library::load(&name).map_err(|error| match error {
            VehicleError::Unknown { .. } => place.error(vehicle, error.to_string()).into(),
            other => StudyError::Vehicle(Box::new(other)),
        })?;
        overrides.push(Override::new("vehicle", name));
    }
    let mission = resolve(&place.beside(typed.template.get_ref()), &overrides).map_err(
        |error| -> StudyError {
            match &error {
                MissionError::NoTemplate { .. } => {
                    place.error(&typed.template, error.to_string()).into()
                }
                MissionError::Override { key, .. } => {
                    let of_key = typed.set.iter().find(|(name, _)| {
                        key == *name
                            || key.strip_prefix(name.as_str()).is_some_and(|k| k.starts_with('.'))
                    });
                    match of_key {
                        Some((_, value)) => place.error(value, error.to_string()).into(),
                        None => error.into(),
                    }
                }
                _ => error.into(),
            }
        },
    )?;
    let mut flights = mission.flights.into_iter();
    match (flights.next(), flights.next()) {
        (Some(flight), None) => Ok((flight.plan, flight.vehicle)),
        _ => Err(place.error(&typed.template, "a study flies one flight, not a campaign").into()),
    }
}

/// `grid.rows = 1` without quotes is a table in a table: its keys are joined again.
pub(super) fn flatten(key: &str, value: &Value, overrides: &mut Vec<Override>) {
    match value {
        Value::Table(table) => {
            for (inner, value) in table {
                flatten(&format!("{key}.{inner}"), value, overrides);
            }
        }
        value => overrides.push(Override::new(key, value.clone())),
    }
}
