//! One campaign of a study, ready to be planned and flown: mission, vehicles, air, losses.

use toml::{Table, Value};

use super::factor::{AirTarget, Factor, Level, Target};
use crate::effects;
use crate::mission::plan::Purpose;
use crate::mission::resolve::{Mission, MissionError, Override, resolve};
use crate::sim::air::spec::{Air, AirSpec};
use crate::vehicle::{Vehicle, library};

/// Fixed settings of a study, which its factors change.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Setup {
    /// Template of the campaign: a file or a built-in name.
    pub campaign: String,
    /// Vehicle that is planned for; `None`: the template's.
    pub vehicle: Option<String>,
    /// Changes to the template.
    pub overrides: Vec<Override>,
    /// Choices of effects that plan and analysis know of, as `--effect` takes them.
    pub known_effects: Vec<String>,
    /// Choices of effects that the drones alone have.
    pub effects: Vec<String>,
    /// Numbers of the vehicle that plan and analysis know of.
    pub known_numbers: Vec<(String, f64)>,
    /// Numbers of the vehicle that flies, which nobody knows of.
    pub numbers: Vec<(String, f64)>,
    /// Air of the flights.
    pub airs: Airs,
    /// Share of the drones of each flight whose logs are lost.
    pub lost_share: f64,
}

/// Air of a campaign's flights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Airs {
    /// Speed of a uniform wind in measurements, m/s.
    pub wind_mps: f64,
    /// Direction that uniform wind comes from, degrees clockwise from north.
    pub wind_from_deg: f64,
    /// Vertical speed of uniform air in measurements, m/s, up positive.
    pub updraft_mps: f64,
    /// Speed of a uniform wind in calibrations, m/s.
    pub calibration_wind_mps: f64,
    /// Vertical speed of uniform air in calibrations, m/s, up positive.
    pub calibration_updraft_mps: f64,
    /// Components of all flights.
    pub added: Vec<AirSpec>,
    /// Components of calibrations, where they differ.
    pub calibration: Option<Vec<AirSpec>>,
}

impl Setup {
    /// The campaign with factors at some levels.
    ///
    /// # Errors
    /// A sentence that says which level is impossible, and why.
    pub fn with(&self, factors: &[Factor], levels: &[Level]) -> Result<Self, String> {
        let mut setup = self.clone();
        for (factor, level) in factors.iter().zip(levels) {
            setup.change(&factor.target, level)?;
        }
        Ok(setup)
    }

    fn change(&mut self, target: &Target, level: &Level) -> Result<(), String> {
        let number = || level.number().ok_or_else(|| format!("{level} is not a number"));
        match target {
            Target::Campaign => self.campaign = level.to_string(),
            Target::Vehicle => self.vehicle = Some(level.to_string()),
            Target::Keys(keys) => {
                let new = keys.iter().map(|key| Override::new(key, level.0.clone()));
                self.overrides.extend(new);
            }
            Target::Effect { choice, known } => {
                let list = if *known { &mut self.known_effects } else { &mut self.effects };
                list.push(format!("{choice}={level}"));
            }
            Target::Parameter { key, known } => {
                let list = if *known { &mut self.known_numbers } else { &mut self.numbers };
                list.push((key.clone(), number()?));
            }
            Target::Air(air) => self.airs.change(air, number()?)?,
            Target::LostShare => self.lost_share = number()?,
        }
        Ok(())
    }

    /// The vehicle that is planned for, where it is no file and no built-in one.
    ///
    /// # Errors
    /// A sentence that says which number or effect it cannot have.
    pub fn planned_vehicle(&self, own: &Vehicle) -> Result<Option<Vehicle>, String> {
        if self.known_effects.is_empty() && self.known_numbers.is_empty() {
            return Ok(None);
        }
        changed(own, &self.known_numbers, &self.known_effects).map(Some)
    }

    /// The vehicle that flies, where it differs from the one that is planned for.
    ///
    /// # Errors
    /// A sentence that says which number or effect it cannot have.
    pub fn flown_vehicle(&self, planned: &Vehicle) -> Result<Option<Vehicle>, String> {
        if self.effects.is_empty() && self.numbers.is_empty() {
            return Ok(None);
        }
        changed(planned, &self.numbers, &self.effects).map(Some)
    }

    /// The mission, for a vehicle's file where one is given.
    ///
    /// # Errors
    /// A template or a key that is not valid.
    pub fn mission(&self, vehicle_file: Option<&str>) -> Result<Mission, MissionError> {
        let mut overrides = self.overrides.clone();
        if let Some(vehicle) = vehicle_file.or(self.vehicle.as_deref()) {
            overrides.push(Override::new("vehicle", vehicle));
        }
        resolve(&self.campaign, &overrides)
    }

    /// Whether this campaign can be planned and flown.
    ///
    /// # Errors
    /// A sentence that says what cannot be.
    pub fn check(&self) -> Result<(), String> {
        let plain = |error: MissionError| match error {
            MissionError::Template(error) => match error.help {
                Some(help) => format!("{} ({help})", error.message.trim_end_matches('.')),
                None => error.message,
            },
            other => other.to_string(),
        };
        let mission = self.mission(None).map_err(plain)?;
        for flight in &mission.flights {
            let planned = self.planned_vehicle(&flight.vehicle)?;
            self.flown_vehicle(planned.as_ref().unwrap_or(&flight.vehicle))?;
            self.airs.of(flight.plan.purpose)?;
        }
        if !mission.flights.iter().any(|flight| flight.plan.purpose == Purpose::Measurement) {
            return Err(format!("{} has no measurement, so that it makes no map", self.campaign));
        }
        if !(0.0..=0.95).contains(&self.lost_share) {
            return Err(format!("{} is no share of the drones from 0 to 0.95", self.lost_share));
        }
        Ok(())
    }
}

/// A vehicle with other numbers and effects.
fn changed(
    vehicle: &Vehicle,
    numbers: &[(String, f64)],
    choices: &[String],
) -> Result<Vehicle, String> {
    let mut vehicle = vehicle.clone();
    if !numbers.is_empty() {
        let mut table = Table::try_from(&vehicle).map_err(|error| error.to_string())?;
        for (key, number) in numbers {
            set(&mut table, key, *number)?;
        }
        vehicle = Vehicle::from_toml(&table.to_string(), &vehicle.name)
            .map_err(|error| error.to_string())?;
    }
    for choice in choices {
        effects::select::choose(&mut vehicle, choice).map_err(|error| error.to_string())?;
    }
    effects::select::resolved(&vehicle).map_err(|error| error.to_string())?;
    Ok(vehicle)
}

/// Sets a number of a vehicle's file. The number must be there: a mistyped key is no new one.
fn set(table: &mut Table, key: &str, number: f64) -> Result<(), String> {
    let missing = || format!("the vehicle has no number {key}");
    let (parents, last) = key.rsplit_once('.').map_or(("", key), |split| split);
    let mut place = table;
    for parent in parents.split('.').filter(|parent| !parent.is_empty()) {
        place = place.get_mut(parent).and_then(Value::as_table_mut).ok_or_else(missing)?;
    }
    match place.get_mut(last) {
        Some(value @ Value::Float(_)) => *value = Value::Float(number),
        Some(value @ Value::Integer(_)) if number.fract() == 0.0 => {
            *value = Value::Integer(number as i64);
        }
        _ => return Err(missing()),
    }
    Ok(())
}

impl Airs {
    /// The air of a flight.
    ///
    /// # Errors
    /// A sentence that says which number is impossible.
    pub fn of(&self, purpose: Purpose) -> Result<Air, String> {
        let (wind_mps, updraft_mps, added) = match purpose {
            Purpose::Calibration => (
                self.calibration_wind_mps,
                self.calibration_updraft_mps,
                self.calibration.as_ref().unwrap_or(&self.added),
            ),
            Purpose::Measurement => (self.wind_mps, self.updraft_mps, &self.added),
        };
        let from_deg = self.wind_from_deg;
        let uniform =
            [format!("wind:speed={wind_mps},from={from_deg}"), format!("uniform:up={updraft_mps}")];
        let mut specs = added.clone();
        for text in uniform {
            specs.push(text.parse().map_err(|error| format!("{error}"))?);
        }
        Ok(Air::new([0.0; 3], &specs))
    }

    fn change(&mut self, target: &AirTarget, number: f64) -> Result<(), String> {
        match target {
            AirTarget::Wind => self.wind_mps = number,
            AirTarget::WindFrom => self.wind_from_deg = number,
            AirTarget::Updraft => self.updraft_mps = number,
            AirTarget::CalibrationWind => self.calibration_wind_mps = number,
            AirTarget::CalibrationUpdraft => self.calibration_updraft_mps = number,
            AirTarget::Component { kind, key, in_calibration } => {
                let mut found = false;
                if *in_calibration {
                    // From here on calibrations have an air of their own.
                    let specs = self.calibration.get_or_insert_with(|| self.added.clone());
                    found |= set_component(specs, kind, key, number)?;
                } else {
                    found |= set_component(&mut self.added, kind, key, number)?;
                    if let Some(specs) = &mut self.calibration {
                        found |= set_component(specs, kind, key, number)?;
                    }
                }
                if !found {
                    return Err(format!("the study's air has no component of the kind {kind}"));
                }
            }
        }
        Ok(())
    }
}

/// Sets a key of all components of a kind; whether there is one.
fn set_component(
    specs: &mut [AirSpec],
    kind: &str,
    key: &str,
    number: f64,
) -> Result<bool, String> {
    let mut found = false;
    for spec in specs.iter_mut().filter(|spec| spec.kind().name == kind) {
        let text = spec.to_string();
        let keys = text.split_once(':').map_or("", |(_, keys)| keys);
        let is_other = |pair: &&str| pair.split_once('=').is_none_or(|(name, _)| name != key);
        let mut pairs: Vec<&str> =
            keys.split(',').filter(|pair| !pair.is_empty()).filter(is_other).collect();
        let new = format!("{key}={number}");
        pairs.push(&new);
        *spec =
            format!("{kind}:{}", pairs.join(",")).parse().map_err(|error| format!("{error}"))?;
        found = true;
    }
    Ok(found)
}

/// The vehicle that a campaign's template names, or another.
///
/// # Errors
/// A sentence that says what is wrong with it.
pub(super) fn vehicle_text(name: &str) -> Result<String, String> {
    let vehicle = library::load(name).map_err(|error| error.to_string())?;
    toml::to_string(&vehicle).map_err(|error| error.to_string())
}
