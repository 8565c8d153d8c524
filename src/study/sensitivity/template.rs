//! Sensitivity studies as files: TOML that says which factors differ between campaigns, with errors that point
//! at the line. The grammar is documented in `docs/study.md`.

use std::collections::BTreeMap;
use std::path::Path;

use serde::Deserialize;
use serde::de::{Deserializer, Error as _};
use toml::{Spanned, Value};

use super::design::{Design, Drawn, Item, Seeds};
use super::factor::{AirTarget, Factor, Level, Levels, Range, Target};
use super::key::fingerprint;
use super::outcome::{OUTCOMES, OutcomeColumn, USUAL, outcome_column};
use super::setup::{Airs, Setup};
use crate::base::file::read_whole;
use crate::base::parse;
use crate::effects;
use crate::mission::error::TemplateError;
use crate::mission::template::first_line;
use crate::sim::air::spec::{self, AirSpec};
use crate::study::StudyError;
use crate::study::template::{MAX_STUDY_BYTES, Place, flatten};

/// Name and version of the format of sensitivity studies.
pub const SENSITIVITY_TEMPLATE_SCHEMA: &str = "updraft.sensitivity/1";

/// Most campaigns of a study.
const MAX_CAMPAIGNS: usize = 1_000_000;
/// Most rows of a Sobol' design: as far as its sequence goes.
const MAX_ROWS: i64 = 1 << 16;
/// Fewest campaigns or rows that anything can be said from.
const FEWEST: i64 = 2;
/// Most factors.
const MAX_FACTORS: usize = 100;
/// Air of a study that names none: that of `updraft run`.
const FIELD_DAY: &str = "field-day";
/// The study that comes with the program.
pub(in crate::study) const BUILTIN: &str = include_str!("../../../templates/sensitivity.toml");

/// What a study's TOML file states.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: Spanned<String>,
    title: String,
    #[serde(default = "campaign")]
    campaign: Spanned<String>,
    vehicle: Option<Spanned<String>>,
    design: Spanned<String>,
    samples: Option<Spanned<i64>>,
    repeats: Option<Spanned<i64>>,
    seeds: Option<Spanned<String>>,
    outcomes: Option<Spanned<Vec<String>>>,
    naming: Option<Spanned<String>>,
    #[serde(default)]
    effects: Vec<Spanned<String>>,
    air: Option<Vec<Spanned<String>>>,
    calibration_air: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    wind_mps: f64,
    #[serde(default = "west")]
    wind_from_deg: f64,
    #[serde(default)]
    updraft_mps: f64,
    #[serde(default)]
    calibration_wind_mps: f64,
    #[serde(default)]
    calibration_updraft_mps: f64,
    #[serde(default)]
    lost_share: f64,
    #[serde(default)]
    set: BTreeMap<String, Spanned<Value>>,
    factor: Spanned<Vec<FactorFile>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct FactorFile {
    name: Spanned<String>,
    #[serde(default)]
    unit: String,
    drives: Spanned<OneOrMore>,
    #[serde(default)]
    known: bool,
    values: Option<Spanned<Vec<Value>>>,
    from: Option<Spanned<Value>>,
    to: Option<Spanned<Value>>,
    scale: Option<Spanned<String>>,
    levels: Option<Spanned<i64>>,
}

/// A name, or a list of names.
#[derive(Clone, Debug)]
struct OneOrMore(Vec<String>);

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let wrong = || D::Error::custom("`drives` is a name, or a list of names");
        let name = |value: Value| value.as_str().map(str::to_owned);
        match Value::deserialize(deserializer)? {
            Value::String(one) => Ok(Self(vec![one])),
            Value::Array(list) if !list.is_empty() => {
                list.into_iter().map(name).collect::<Option<_>>().map(Self).ok_or_else(wrong)
            }
            _ => Err(wrong()),
        }
    }
}

fn campaign() -> Spanned<String> {
    Spanned::new(0..0, "campaign".to_owned())
}

fn west() -> f64 {
    270.0
}

/// A sensitivity study, read and checked.
#[derive(Clone, Debug)]
pub struct SensitivityPlan {
    /// Title of the study, for people.
    pub title: String,
    /// The factors, in the order of the file.
    pub factors: Vec<Factor>,
    /// How campaigns are drawn.
    pub design: Design,
    /// How campaigns get their seeds.
    pub seeds: Seeds,
    /// Effect that the search should name; `None`: nothing is searched for.
    pub naming: Option<String>,
    /// Outcomes that are shown, the most important first.
    pub outcomes: Vec<&'static OutcomeColumn>,
    /// Fixed settings, which the factors change.
    pub setup: Setup,
    /// SHA-256 of all files and settings that every campaign depends on.
    pub fingerprint: String,
}

impl SensitivityPlan {
    /// Reads a study's file.
    ///
    /// # Errors
    /// [`StudyError`]: an unreadable file, or a wrong study.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let bytes = read_whole(path, MAX_STUDY_BYTES)?;
        Self::parse(&path.to_string_lossy(), &String::from_utf8_lossy(&bytes))
    }

    /// Reads a study's text; `path` locates the files it names and is shown in messages.
    ///
    /// # Errors
    /// [`StudyError::Template`], with the line that is wrong.
    pub fn parse(path: &str, text: &str) -> Result<Self, StudyError> {
        let file: File = parse::toml(text).map_err(|error: toml::de::Error| {
            TemplateError::new(path, text, error.span(), first_line(error.message()))
        })?;
        let place = Place { path, text };
        if file.schema.get_ref() != SENSITIVITY_TEMPLATE_SCHEMA {
            let message = format!(
                "this program reads sensitivity studies of the format \
                 \"{SENSITIVITY_TEMPLATE_SCHEMA}\""
            );
            return Err(place.error(&file.schema, message).into());
        }
        let mut factors = factors(&place, &file)?;
        let seeds = seeds(&place, file.seeds.as_ref())?;
        let design = design(&place, &file, &factors)?;
        let campaigns = design.campaigns(&factors, seeds).filter(|count| *count <= MAX_CAMPAIGNS);
        if campaigns.is_none() {
            return Err(place
                .error(&file.design, "the study would have too many campaigns")
                .with_help(format!("allowed: up to {MAX_CAMPAIGNS}"))
                .into());
        }
        let outcomes = outcomes(&place, &file)?;
        let setup = setup(&place, &file)?;
        check(&place, &file, &setup)?;
        // Files are named as from the study, and looked for there.
        for factor in &mut factors {
            if let (Target::Campaign | Target::Vehicle, Levels::List(levels)) =
                (&factor.target, &mut factor.levels)
            {
                for level in levels {
                    *level = Level(Value::String(place.beside(&level.to_string())));
                }
            }
        }
        for (factor, from) in factors.iter().zip(file.factor.get_ref()) {
            for level in factor.levels.ends() {
                // Alone, so that the factor that cannot be is the one that is told.
                let (alone, levels) = (std::slice::from_ref(factor), [level.clone()]);
                let checked = setup.with(alone, &levels).and_then(|setup| setup.check());
                checked.map_err(|reason| {
                    let message = format!("{} cannot be {level}: {reason}", factor.name);
                    place.error(&from.drives, message)
                })?;
            }
        }
        let naming = naming(&place, file.naming.as_ref())?;
        let fingerprint = fingerprint(&setup, &factors, naming.as_deref())
            .map_err(|reason| place.error(&file.campaign, reason))?;
        Ok(Self { title: file.title, factors, design, seeds, naming, outcomes, setup, fingerprint })
    }

    /// Draws the campaigns.
    pub fn drawn(&self, seed: u64) -> Drawn<'_> {
        Drawn::new(self.design, self.seeds, seed, &self.factors)
    }

    /// Settings of one campaign.
    ///
    /// # Errors
    /// A sentence that says which level is impossible.
    pub fn setup_of(&self, item: &Item) -> Result<Setup, String> {
        self.setup.with(&self.factors, &item.levels)
    }
}

/// Checks what is fixed, and points at what cannot be: the campaign, the vehicle, or a key that is set.
fn check(place: &Place<'_>, file: &File, setup: &Setup) -> Result<(), TemplateError> {
    let fails = |reason: String| format!("the campaigns cannot be flown: {reason}");
    let mut checked = Setup { vehicle: None, overrides: Vec::new(), ..setup.clone() };
    checked.check().map_err(|reason| place.error(&file.campaign, fails(reason)))?;
    if let Some(vehicle) = &file.vehicle {
        checked.vehicle.clone_from(&setup.vehicle);
        checked.check().map_err(|reason| place.error(vehicle, fails(reason)))?;
    }
    for (key, value) in &file.set {
        flatten(key, value.get_ref(), &mut checked.overrides);
        checked.check().map_err(|reason| place.error(value, fails(reason)))?;
    }
    Ok(())
}

fn seeds(place: &Place<'_>, given: Option<&Spanned<String>>) -> Result<Seeds, TemplateError> {
    match given.map(|given| (given, given.get_ref().as_str())) {
        None | Some((_, "each")) => Ok(Seeds::Each),
        Some((_, "same")) => Ok(Seeds::Same),
        Some((given, other)) => Err(place
            .error(given, format!("seeds cannot be \"{other}\""))
            .with_help("allowed: \"each\" and \"same\"")),
    }
}

fn design(place: &Place<'_>, file: &File, factors: &[Factor]) -> Result<Design, TemplateError> {
    let count = |most: i64| {
        let Some(samples) = &file.samples else {
            return Err(place.error(&file.design, "the number of samples is missing"));
        };
        match *samples.get_ref() {
            count if (FEWEST..=most).contains(&count) => Ok(count as usize),
            count => Err(place
                .error(samples, format!("the number of samples cannot be {count}"))
                .with_help(format!("allowed: {FEWEST} to {most}"))),
        }
    };
    let only_grid = |design| match &file.repeats {
        Some(repeats) => Err(place
            .error(repeats, "only a grid has repeats")
            .with_help("give more samples instead")),
        None => Ok(design),
    };
    match file.design.get_ref().as_str() {
        "grid" => {
            if let Some(samples) = &file.samples {
                return Err(place
                    .error(samples, "a grid has no samples, but every combination of all levels")
                    .with_help("repeats = N flies each of them N times"));
            }
            let without = factors.iter().zip(file.factor.get_ref());
            for (factor, from) in without {
                if factor.levels.in_grid().is_none() {
                    return Err(place
                        .error(&from.name, "a grid needs the levels of this factor")
                        .with_help("give levels = 5 for equal steps, or values = [...]"));
                }
            }
            let repeats =
                file.repeats.as_ref().map_or(Ok(1), |repeats| match *repeats.get_ref() {
                    count @ 1..=100_000 => Ok(count as usize),
                    count => Err(place
                        .error(repeats, format!("the number of repeats cannot be {count}"))
                        .with_help("allowed: 1 to 100000")),
                })?;
            Ok(Design::Grid { repeats })
        }
        "latin-hypercube" => {
            only_grid(Design::LatinHypercube { samples: count(MAX_CAMPAIGNS as i64)? })
        }
        "sobol" => only_grid(Design::Sobol { samples: count(MAX_ROWS)? }),
        other => Err(place
            .error(&file.design, format!("there is no design \"{other}\""))
            .with_help("the designs are grid, latin-hypercube and sobol")),
    }
}

fn outcomes(place: &Place<'_>, file: &File) -> Result<Vec<&'static OutcomeColumn>, TemplateError> {
    let Some(given) = &file.outcomes else {
        let named = file.naming.is_some().then_some("named");
        return Ok(USUAL.iter().copied().chain(named).filter_map(outcome_column).collect());
    };
    if given.get_ref().is_empty() {
        return Err(place.error(given, "a study needs an outcome"));
    }
    let found = given.get_ref().iter().map(|name| {
        outcome_column(name).ok_or_else(|| {
            let names: Vec<_> = OUTCOMES.iter().map(|column| column.name).collect();
            place
                .error(given, format!("there is no outcome \"{name}\""))
                .with_help(format!("the outcomes are {}", names.join(", ")))
        })
    });
    found.collect()
}

fn naming(
    place: &Place<'_>,
    given: Option<&Spanned<String>>,
) -> Result<Option<String>, TemplateError> {
    let Some(given) = given else { return Ok(None) };
    effects::select::known(given.get_ref())
        .map_err(|error| place.error(given, error.to_string()))?;
    Ok(Some(given.get_ref().clone()))
}

fn setup(place: &Place<'_>, file: &File) -> Result<Setup, TemplateError> {
    let mut overrides = Vec::new();
    for (key, value) in &file.set {
        flatten(key, value.get_ref(), &mut overrides);
    }
    let airs = |given: &[Spanned<String>]| -> Result<Vec<AirSpec>, TemplateError> {
        let mut all = Vec::new();
        for text in given {
            let specs = spec::load(&place.beside(text.get_ref()));
            all.extend(specs.map_err(|error| place.error(text, error.to_string()))?);
        }
        Ok(all)
    };
    for effect in &file.effects {
        let name = effect.get_ref().split(['=', '.']).next().unwrap_or_default();
        effects::select::known(name).map_err(|error| place.error(effect, error.to_string()))?;
    }
    let added = match &file.air {
        Some(given) => airs(given)?,
        None => spec::load(FIELD_DAY).unwrap_or_default(),
    };
    Ok(Setup {
        campaign: place.beside(file.campaign.get_ref()),
        vehicle: file.vehicle.as_ref().map(|name| place.beside(name.get_ref())),
        overrides,
        known_effects: Vec::new(),
        effects: file.effects.iter().map(|effect| effect.get_ref().clone()).collect(),
        known_numbers: Vec::new(),
        numbers: Vec::new(),
        airs: Airs {
            wind_mps: file.wind_mps,
            wind_from_deg: file.wind_from_deg,
            updraft_mps: file.updraft_mps,
            calibration_wind_mps: file.calibration_wind_mps,
            calibration_updraft_mps: file.calibration_updraft_mps,
            added,
            calibration: file.calibration_air.as_deref().map(airs).transpose()?,
        },
        lost_share: file.lost_share,
    })
}

fn factors(place: &Place<'_>, file: &File) -> Result<Vec<Factor>, TemplateError> {
    let given = file.factor.get_ref();
    if given.is_empty() || given.len() > MAX_FACTORS {
        return Err(place
            .error(&file.factor, format!("a study cannot have {} factors", given.len()))
            .with_help(format!("allowed: 1 to {MAX_FACTORS}")));
    }
    let mut factors: Vec<Factor> = Vec::with_capacity(given.len());
    for one in given {
        let name = one.name.get_ref().trim();
        if name.is_empty() {
            return Err(place.error(&one.name, "a factor needs a name"));
        }
        let reserved = ["item", "seed", "lost", "warnings", "naming", "chance"];
        if reserved.contains(&name) || outcome_column(name).is_some() {
            return Err(place.error(
                &one.name,
                format!(
                    "a factor cannot be named {name}: \
                 the tables have that column"
                ),
            ));
        }
        if factors.iter().any(|other| other.name == name) {
            return Err(place.error(&one.name, format!("two factors are named {name}")));
        }
        factors.push(Factor {
            name: name.to_owned(),
            unit: one.unit.clone(),
            target: target(place, one)?,
            levels: levels(place, one)?,
        });
    }
    Ok(factors)
}

fn target(place: &Place<'_>, one: &FactorFile) -> Result<Target, TemplateError> {
    let unknown = |text: &str| {
        place
            .error(&one.drives, format!("a factor cannot drive \"{text}\""))
            .with_help(
                "set.KEY (of the template), effect.NAME or effect.NAME.PARAMETER, vehicle.KEY, \
                 air.wind_mps, air.wind_from_deg, air.updraft_mps, air.KIND.KEY, calibration_air.KEY, \
                 lost_share, campaign, vehicle",
            )
    };
    let texts = &one.drives.get_ref().0;
    let keys: Option<Vec<String>> =
        texts.iter().map(|text| text.strip_prefix("set.").map(str::to_owned)).collect();
    let unknowable =
        || place.error(&one.drives, "only effects and numbers of a vehicle can be known or not");
    if let Some(keys) = keys {
        return if one.known { Err(unknowable()) } else { Ok(Target::Keys(keys)) };
    }
    let [text] = &texts[..] else {
        return Err(place.error(&one.drives, "only keys of the template can be driven together"));
    };
    let found = match text.split_once('.') {
        None if text == "campaign" => Target::Campaign,
        None if text == "vehicle" => Target::Vehicle,
        None if text == "lost_share" => Target::LostShare,
        Some(("effect", choice)) => {
            let name = choice.split('.').next().unwrap_or_default();
            effects::select::known(name)
                .map_err(|error| place.error(&one.drives, error.to_string()))?;
            Target::Effect { choice: choice.to_owned(), known: one.known }
        }
        Some(("vehicle", key)) => Target::Parameter { key: key.to_owned(), known: one.known },
        Some((flight @ ("air" | "calibration_air"), key)) => {
            let in_calibration = flight != "air";
            let air = match (key, key.split_once('.')) {
                ("wind_mps", _) if in_calibration => AirTarget::CalibrationWind,
                ("wind_mps", _) => AirTarget::Wind,
                ("updraft_mps", _) if in_calibration => AirTarget::CalibrationUpdraft,
                ("updraft_mps", _) => AirTarget::Updraft,
                ("wind_from_deg", _) if !in_calibration => AirTarget::WindFrom,
                (_, Some((kind, key))) => {
                    let (kind, key) = (kind.to_owned(), key.to_owned());
                    AirTarget::Component { kind, key, in_calibration }
                }
                _ => return Err(unknown(text)),
            };
            Target::Air(air)
        }
        _ => return Err(unknown(text)),
    };
    if one.known && !matches!(found, Target::Effect { .. } | Target::Parameter { .. }) {
        return Err(unknowable());
    }
    Ok(found)
}

fn levels(place: &Place<'_>, one: &FactorFile) -> Result<Levels, TemplateError> {
    let misplaced = |what: &str| format!("{what} is for a range, from ... to ...");
    match (&one.values, &one.from, &one.to) {
        (Some(values), None, None) => {
            if let Some(scale) = &one.scale {
                return Err(place.error(scale, misplaced("scale")));
            }
            if let Some(levels) = &one.levels {
                return Err(place.error(levels, misplaced("levels")));
            }
            let list = values.get_ref();
            if list.len() < 2 {
                return Err(place.error(values, "a factor needs two values or more"));
            }
            let twice = list
                .iter()
                .enumerate()
                .any(|(index, value)| list.iter().take(index).any(|other| other == value));
            if twice {
                return Err(place.error(values, "a value is there twice"));
            }
            let is_finite = |value: &Value| value.as_float().is_none_or(f64::is_finite);
            if !list.iter().all(is_finite) {
                return Err(place.error(values, "a value is not a number"));
            }
            Ok(Levels::List(list.iter().cloned().map(Level).collect()))
        }
        (None, Some(from), Some(to)) => range(place, one, from, to).map(Levels::Range),
        _ => Err(place
            .error(&one.name, "this factor has no levels")
            .with_help("give values = [...], or from = ... and to = ...")),
    }
}

fn range(
    place: &Place<'_>,
    one: &FactorFile,
    from: &Spanned<Value>,
    to: &Spanned<Value>,
) -> Result<Range, TemplateError> {
    let number = |value: &Spanned<Value>| {
        let number = Level(value.get_ref().clone()).number().filter(|number| number.is_finite());
        number.ok_or_else(|| place.error(value, "this is not a number"))
    };
    let (low, high) = (number(from)?, number(to)?);
    if low >= high {
        return Err(place.error(to, format!("{high} is not above {low}")));
    }
    let log = match one.scale.as_ref().map(|scale| (scale, scale.get_ref().as_str())) {
        None | Some((_, "linear")) => false,
        Some((_, "log")) => true,
        Some((scale, other)) => {
            return Err(place
                .error(scale, format!("there is no scale \"{other}\""))
                .with_help("the scales are linear and log"));
        }
    };
    if log && low <= 0.0 {
        return Err(place.error(from, format!("a logarithmic scale does not reach {low}")));
    }
    let levels = match one.levels.as_ref().map(|levels| (levels, *levels.get_ref())) {
        None => None,
        Some((_, count @ 2..=10_000)) => Some(count as usize),
        Some((levels, count)) => {
            return Err(place
                .error(levels, format!("the number of levels cannot be {count}"))
                .with_help("allowed: 2 to 10000"));
        }
    };
    let is_whole = |value: &Spanned<Value>| value.get_ref().is_integer();
    Ok(Range { from: low, to: high, log, whole: is_whole(from) && is_whole(to), levels })
}
