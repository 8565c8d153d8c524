//! Resolution of a template's name and overrides into a mission with its plans.

use std::path::{Path, PathBuf};

use thiserror::Error;
use toml::Table;
use toml::Value as Toml;

use super::build::build_plan;
use super::error::TemplateError;
use super::keys::{TOP_LEVEL, keys_of, short_numbers};
use super::plan::Plan;
use super::template::{CampaignTemplate, FlightReference, FlightTemplate, Template, span_of};
use crate::base::file::{FileError, read_whole};
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::base::plain::plain;
use crate::vehicle::{Vehicle, VehicleError};

/// Largest template file that is read, bytes.
const MAX_TEMPLATE_BYTES: u64 = 4 << 20;

/// Templates that come with the program: file name and text.
pub const BUILTIN: &[(&str, &str)] = &[
    ("calibration.toml", include_str!("../../templates/calibration.toml")),
    (
        "calibration-counterphase.toml",
        include_str!("../../templates/calibration-counterphase.toml"),
    ),
    ("hover.toml", include_str!("../../templates/hover.toml")),
    ("campaign.toml", include_str!("../../templates/campaign.toml")),
    ("scan.toml", include_str!("../../templates/scan.toml")),
    ("scan-campaign.toml", include_str!("../../templates/scan-campaign.toml")),
    ("profile.toml", include_str!("../../templates/profile.toml")),
    ("column.toml", include_str!("../../templates/column.toml")),
    ("cross.toml", include_str!("../../templates/cross.toml")),
    ("race-track.toml", include_str!("../../templates/race-track.toml")),
];

/// Origin of the built-in templates, latitude and longitude in degrees: a field in Hungary, which
/// is an example and nobody's own.
pub const EXAMPLE_ORIGIN: [f64; 2] = [47.4733, 19.0621];

/// A `KEY=VALUE` that replaces a value of a template.
#[derive(Clone, Debug, PartialEq)]
pub struct Override {
    /// Dotted path (`grid.rows`, `steps.2.speed_mps`) or the name of a parameter (`leg_s`).
    pub key: String,
    /// The new value; `None` removes the key.
    pub value: Option<Toml>,
}

/// Error of making a mission out of a template, its overrides and a vehicle.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum MissionError {
    /// The template itself is wrong.
    #[error(transparent)]
    Template(#[from] TemplateError),
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The vehicle is unknown or its file is wrong.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// The name is neither a file nor a built-in template.
    #[error("there is no template {}; the built-in ones are {}", plain(name), names().join(", "))]
    NoTemplate {
        /// Name of the template, as asked for.
        name: String,
    },
    /// A template file is not UTF-8 text.
    #[error("{} is not UTF-8 text", path.shown())]
    NotText {
        /// Path of the file.
        path: PathBuf,
    },
    /// An override does not fit the template.
    #[error("cannot set {}: {}", plain(key), plain(reason))]
    Override {
        /// Key of the override, as asked for.
        key: String,
        /// Reason why it cannot be set.
        reason: String,
    },
}

/// A mission: one flight, or a campaign of several.
#[derive(Clone, Debug)]
pub struct Mission {
    /// Short name of the mission, used for folders.
    pub name: String,
    /// Title of the mission, for people.
    pub title: String,
    /// Text of the campaign template; `None` for a single flight.
    pub campaign_text: Option<String>,
    /// Flights of the mission, in the order of the campaign; one if there is no campaign.
    pub flights: Vec<ResolvedFlight>,
}

/// A flight's template after overrides, and its plan.
#[derive(Clone, Debug)]
pub struct ResolvedFlight {
    /// Text of the template with all overrides applied: reading it again gives the same plan.
    pub template_text: String,
    /// Vehicle that the flight was planned for.
    pub vehicle: Vehicle,
    /// Plan of the flight.
    pub plan: Plan,
}

impl Override {
    /// Reads `KEY=VALUE`; the value is TOML, or plain text where it is not.
    ///
    /// # Errors
    ///
    /// If there is no `=`, or nothing before or behind it.
    pub fn parse(text: &str) -> Result<Self, MissionError> {
        let bad = |reason: &str| MissionError::Override { key: text.into(), reason: reason.into() };
        let (key, value) = text.split_once('=').ok_or_else(|| bad("write it as KEY=VALUE"))?;
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() {
            return Err(bad("write it as KEY=VALUE"));
        }
        let parsed = format!("value = {value}")
            .parse::<Table>()
            .ok()
            .filter(|table| table.len() == 1)
            .and_then(|mut table| table.remove("value"))
            .unwrap_or_else(|| Toml::String(value.to_owned()));
        Ok(Self { key: key.to_owned(), value: Some(parsed) })
    }

    /// An override of the key by a value.
    pub fn new(key: &str, value: impl Into<Toml>) -> Self {
        Self { key: key.to_owned(), value: Some(value.into()) }
    }

    /// An override that removes the key, if it is there.
    pub fn remove(key: &str) -> Self {
        Self { key: key.to_owned(), value: None }
    }
}

fn names() -> Vec<&'static str> {
    BUILTIN.iter().map(|(name, _)| *name).collect()
}

/// Names of the built-in templates, as the command line takes them.
pub fn builtin_names() -> Vec<&'static str> {
    names().into_iter().map(|name| name.strip_suffix(".toml").unwrap_or(name)).collect()
}

/// Text of a template: a file, or a built-in one by its name (with or without folder and `.toml`).
fn load(name: &str, relative_to: Option<&Path>) -> Result<(String, String), MissionError> {
    let asked = Path::new(name);
    let path = match relative_to {
        Some(folder) if asked.is_relative() => folder.join(asked),
        _ => asked.to_owned(),
    };
    if path.is_file() {
        let bytes = read_whole(&path, MAX_TEMPLATE_BYTES)?;
        let text =
            String::from_utf8(bytes).map_err(|_| MissionError::NotText { path: path.clone() })?;
        return Ok((path.to_string_lossy().into_owned(), text));
    }
    let plain = name.strip_prefix("templates/").unwrap_or(name);
    BUILTIN
        .iter()
        .find(|(builtin, _)| *builtin == plain || builtin.strip_suffix(".toml") == Some(plain))
        .map(|(builtin, text)| (format!("templates/{builtin}"), (*text).to_owned()))
        .ok_or_else(|| MissionError::NoTemplate { name: name.to_owned() })
}

/// Resolves a template (a file or a built-in name) with overrides into plans.
///
/// # Errors
///
/// If the template, a file it names, its vehicle or an override is not valid.
pub fn resolve(name: &str, overrides: &[Override]) -> Result<Mission, MissionError> {
    let (path, text) = load(name, None)?;
    resolve_text(&path, &text, overrides)
}

/// Resolves a template's text; `path` locates files it refers to and is named in messages.
///
/// # Errors
///
/// If the template, a file it names, its vehicle or an override is not valid.
pub fn resolve_text(
    path: &str,
    text: &str,
    overrides: &[Override],
) -> Result<Mission, MissionError> {
    match Template::parse(path, text)? {
        Template::Flight(_) => one_flight(path, text, overrides),
        Template::Campaign(campaign) => campaign_of(&campaign, path, text, overrides),
    }
}

fn one_flight(path: &str, text: &str, overrides: &[Override]) -> Result<Mission, MissionError> {
    let overrides = &without_own_name(text, overrides);
    let (flight, used) = resolve_flight(path, text, overrides)?;
    if let Some(key) = unused(overrides, &used) {
        return Err(MissionError::Override {
            key: key.to_owned(),
            reason: format!("{path} has no such key; {}", keys_of(key, &[text])),
        });
    }
    Ok(Mission {
        name: flight.plan.name.clone(),
        title: flight.plan.title.clone(),
        campaign_text: None,
        flights: vec![flight],
    })
}

/// Overrides without the flight's own name before the key, which tells the flights of a campaign apart.
fn without_own_name(text: &str, overrides: &[Override]) -> Vec<Override> {
    let table = parse::toml::<Table>(text).unwrap_or_default();
    let name = table.get("name").and_then(Toml::as_str).unwrap_or_default();
    let is_key = |first: &str| table.contains_key(first);
    let own = |item: &Override| match item.key.split_once('.') {
        Some((first, rest)) if first == name && !is_key(first) => {
            Override { key: rest.to_owned(), value: item.value.clone() }
        }
        _ => item.clone(),
    };
    overrides.iter().map(own).collect()
}

fn campaign_of(
    campaign: &CampaignTemplate,
    path: &str,
    text: &str,
    overrides: &[Override],
) -> Result<Mission, MissionError> {
    let refused = |span, reason: &str| TemplateError::new(path, text, span, reason);
    let folder = Path::new(path).parent();
    let mut used = vec![false; overrides.len()];
    let mut flights: Vec<ResolvedFlight> = Vec::new();
    for reference in campaign.flights.get_ref() {
        let name = reference.template.get_ref();
        let span = || span_of(&reference.template);
        let (flight_path, flight_text) = load(name, folder).map_err(|error| match error {
            MissionError::NoTemplate { .. } => {
                refused(span(), &format!("there is no template {name}"))
                    .with_help(format!("built in are {}", names().join(", ")))
                    .into()
            }
            other => other,
        })?;
        let Template::Flight(parsed) = Template::parse(&flight_path, &flight_text)? else {
            return Err(refused(span(), "a campaign cannot contain a campaign").into());
        };
        let from_user = overrides_of(campaign, reference, parsed.name.get_ref(), overrides);
        let mut all = table_overrides(&campaign.set);
        all.extend(table_overrides(&reference.set));
        let own = all.len();
        all.extend(from_user.iter().map(|(_, item)| item.clone()));
        let (flight, used_here) = resolve_flight(&flight_path, &flight_text, &all)?;
        for (used_here, (index, _)) in used_here.iter().skip(own).zip(&from_user) {
            used[*index] |= used_here;
        }
        if flights.iter().any(|other| other.plan.name == flight.plan.name) {
            let reason = format!("two flights are named \"{}\"", flight.plan.name);
            return Err(refused(span(), &reason).into());
        }
        flights.push(flight);
    }
    if flights.is_empty() {
        return Err(refused(span_of(&campaign.flights), "a campaign needs flights").into());
    }
    if let Some(key) = unused(overrides, &used) {
        let texts: Vec<_> = flights.iter().map(|flight| flight.template_text.as_str()).collect();
        return Err(MissionError::Override {
            key: key.to_owned(),
            reason: format!(
                "none of the campaign's flights has such a key; {}",
                keys_of(key, &texts)
            ),
        });
    }
    Ok(Mission {
        name: campaign.name.get_ref().clone(),
        title: campaign.title.clone(),
        campaign_text: Some(text.to_owned()),
        flights,
    })
}

/// The overrides that are for one flight of a campaign, each with its place among all: those that name no
/// flight, and those that name this one, without its name.
fn overrides_of(
    campaign: &CampaignTemplate,
    reference: &FlightReference,
    own_name: &str,
    overrides: &[Override],
) -> Vec<(usize, Override)> {
    let of = |(index, item): (usize, &Override)| match item.key.split_once('.') {
        Some((first, rest)) if campaign_has(&campaign.flights, first) => {
            let named = first == flight_stem(reference.template.get_ref()) || first == own_name;
            named.then(|| (index, Override { key: rest.to_owned(), value: item.value.clone() }))
        }
        _ => Some((index, item.clone())),
    };
    overrides.iter().enumerate().filter_map(of).collect()
}

/// Key of the first override that had no place.
fn unused<'a>(overrides: &'a [Override], used: &[bool]) -> Option<&'a str> {
    let unused = overrides.iter().zip(used).find(|(_, used)| !**used);
    unused.map(|(item, _)| item.key.as_str())
}

fn flight_stem(name: &str) -> &str {
    Path::new(name).file_stem().and_then(|stem| stem.to_str()).unwrap_or(name)
}

fn campaign_has(flights: &toml::Spanned<Vec<FlightReference>>, first: &str) -> bool {
    flights.get_ref().iter().any(|flight| flight_stem(flight.template.get_ref()) == first)
}

fn table_overrides(table: &Table) -> Vec<Override> {
    table.iter().map(|(key, value)| Override::new(key, value.clone())).collect()
}

/// Applies overrides, reads the result and builds the plan. Also says which overrides had a place.
fn resolve_flight(
    path: &str,
    text: &str,
    overrides: &[Override],
) -> Result<(ResolvedFlight, Vec<bool>), MissionError> {
    let mut used = vec![true; overrides.len()];
    let (shown_path, resolved_text) = if overrides.is_empty() {
        (path.to_owned(), text.to_owned())
    } else {
        let mut table: Table = parse::toml(text).map_err(|error: toml::de::Error| {
            TemplateError::new(path, text, error.span(), error.message())
        })?;
        for (used, item) in used.iter_mut().zip(overrides) {
            *used = apply(&mut table, item)?;
        }
        let resolved = toml::to_string(&table).map_err(|error| MissionError::Override {
            key: path.to_owned(),
            reason: error.to_string(),
        })?;
        (format!("{path} with overrides"), short_numbers(&resolved))
    };
    let parsed = Template::parse(&shown_path, &resolved_text)
        .map_err(|error| with_range(error, path, text, overrides));
    let template = match parsed? {
        Template::Flight(template) => template,
        Template::Campaign(_) => {
            return Err(MissionError::Override {
                key: "flights".to_owned(),
                reason: "a flight template cannot become a campaign".to_owned(),
            });
        }
    };
    let vehicle = vehicle_of(&shown_path, &resolved_text, &template)?;
    let plan = build_plan(&shown_path, &resolved_text, &template, &vehicle)?;
    Ok((ResolvedFlight { template_text: resolved_text, vehicle, plan }, used))
}

/// Adds the allowed range to the error of an override whose value is text where a number belongs: what
/// the template says of a number out of every range.
fn with_range(
    error: TemplateError,
    path: &str,
    text: &str,
    overrides: &[Override],
) -> TemplateError {
    let is_text = |item: &&Override| matches!(item.value, Some(Toml::String(_)));
    for item in overrides.iter().filter(is_text) {
        let number = Override::new(&item.key, f64::NAN);
        if let Err(MissionError::Template(TemplateError { help: Some(help), .. })) =
            resolve_flight(path, text, &[number])
            && help.starts_with("allowed: ")
        {
            let list = Override::new(&item.key, vec![f64::NAN; 2]);
            let is = if takes(path, text, list) {
                "a number, or a list of numbers such as [0.5, 1.0, 1.5]"
            } else {
                "a number"
            };
            return error.with_help(format!("{} is {is}; {help}", item.key));
        }
    }
    error
}

/// Whether a value of this kind has a place under its key, whatever is wrong with its numbers.
fn takes(path: &str, text: &str, value: Override) -> bool {
    matches!(
        resolve_flight(path, text, &[value]),
        Err(MissionError::Template(TemplateError { help: Some(help), .. })) if help.starts_with("allowed: ")
    )
}

fn vehicle_of(path: &str, text: &str, template: &FlightTemplate) -> Result<Vehicle, MissionError> {
    let name = template.vehicle.get_ref();
    crate::vehicle::library::load(name).map_err(|error| match error {
        VehicleError::Unknown { .. } => {
            TemplateError::new(path, text, span_of(&template.vehicle), error.to_string()).into()
        }
        other => other.into(),
    })
}

/// Sets one value. `Ok(false)`: the template has no place for it.
fn apply(table: &mut Table, item: &Override) -> Result<bool, MissionError> {
    let refused = |reason: String| MissionError::Override { key: item.key.clone(), reason };
    // A bare name that is a parameter means that parameter.
    if let Some(Toml::Table(parameters)) = table.get_mut("parameters")
        && parameters.contains_key(&item.key)
        && let Some(value) = &item.value
    {
        parameters.insert(item.key.clone(), value.clone());
        return Ok(true);
    }
    let keys: Vec<&str> = item.key.split('.').collect();
    let Some((last, parents)) = keys.split_last() else { return Ok(false) };
    // Only known top-level keys: anything else is a mistyped parameter.
    if !TOP_LEVEL.contains(&keys[0]) {
        return Ok(false);
    }
    if parents.is_empty() {
        match &item.value {
            Some(value) => table.insert((*last).to_owned(), value.clone()),
            None => table.remove(*last),
        };
        return Ok(true);
    }
    let mut place: &mut Toml =
        table.entry(parents[0].to_owned()).or_insert_with(|| Toml::Table(Table::new()));
    for key in &parents[1..] {
        place = match place {
            Toml::Table(inner) => {
                inner.entry((*key).to_owned()).or_insert_with(|| Toml::Table(Table::new()))
            }
            Toml::Array(list) => {
                let count = list.len();
                key.parse::<usize>().ok().and_then(|index| list.get_mut(index)).ok_or_else(
                    || refused(format!("`{key}` is not one of the {count} entries (from 0)")),
                )?
            }
            _ => return Err(refused(format!("`{key}` is inside a plain value"))),
        };
    }
    match (place, &item.value) {
        (Toml::Table(inner), Some(value)) => {
            inner.insert((*last).to_owned(), value.clone());
        }
        (Toml::Table(inner), None) => {
            inner.remove(*last);
        }
        (Toml::Array(list), Some(value)) => {
            let count = list.len();
            *last.parse::<usize>().ok().and_then(|index| list.get_mut(index)).ok_or_else(
                || refused(format!("`{last}` is not one of the {count} entries (from 0)")),
            )? = value.clone();
        }
        _ => return Err(refused(format!("`{last}` is inside a plain value"))),
    }
    Ok(true)
}
