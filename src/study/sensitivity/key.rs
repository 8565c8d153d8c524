//! Hashes of all that a campaign's outcome depends on, by which finished ones are known.

use serde::Serialize;

use super::design::Item;
use super::factor::{Factor, Level, Levels, Target};
use super::item::ITEM_SCHEMA;
use super::setup::{Setup, vehicle_text};
use super::template::SensitivityPlan;
use crate::base::digest::sha256;
use crate::study::fly::MADE_BY;

/// What all campaigns of a study depend on.
#[derive(Serialize)]
struct Common {
    /// Templates and vehicles of each campaign that is chosen from, after the study's own changes.
    campaigns: Vec<[String; 2]>,
    /// Vehicles that are chosen from.
    vehicles: Vec<String>,
    effects: Vec<String>,
    airs: [Vec<String>; 2],
    has_calibration_air: bool,
    uniform: [f64; 5],
    lost_share: f64,
    naming: Option<String>,
}

/// What one campaign depends on.
#[derive(Serialize)]
struct Own<'a> {
    format: &'a str,
    made_by: &'a str,
    study: &'a str,
    levels: Vec<(String, bool, &'a Level)>,
    seed: u64,
}

/// SHA-256 of what all campaigns of a study depend on, hexadecimal.
///
/// # Errors
/// A sentence that says which template or vehicle is not valid.
pub(super) fn fingerprint(
    setup: &Setup,
    factors: &[Factor],
    naming: Option<&str>,
) -> Result<String, String> {
    let chosen = |is_it: fn(&Target) -> bool, own: Option<&String>| {
        let factor = factors.iter().find(|factor| is_it(&factor.target));
        match factor.map(|factor| &factor.levels) {
            Some(Levels::List(levels)) => levels.iter().map(ToString::to_string).collect(),
            _ => own.cloned().into_iter().collect::<Vec<_>>(),
        }
    };
    let campaigns = chosen(|target| *target == Target::Campaign, Some(&setup.campaign));
    let vehicles = chosen(|target| *target == Target::Vehicle, None);
    let mut common = Common {
        campaigns: Vec::new(),
        vehicles: Vec::new(),
        effects: setup.effects.clone(),
        airs: [Some(&setup.airs.added), setup.airs.calibration.as_ref()]
            .map(|specs| specs.into_iter().flatten().map(ToString::to_string).collect()),
        has_calibration_air: setup.airs.calibration.is_some(),
        uniform: [
            setup.airs.wind_mps,
            setup.airs.wind_from_deg,
            setup.airs.updraft_mps,
            setup.airs.calibration_wind_mps,
            setup.airs.calibration_updraft_mps,
        ],
        lost_share: setup.lost_share,
        naming: naming.map(str::to_owned),
    };
    for campaign in campaigns {
        let of_it = Setup { campaign, ..setup.clone() };
        let mission = of_it.mission(None).map_err(|error| error.to_string())?;
        for flight in mission.flights {
            let vehicle = toml::to_string(&flight.vehicle).map_err(|error| error.to_string())?;
            common.campaigns.push([flight.template_text, vehicle]);
        }
    }
    for vehicle in vehicles {
        common.vehicles.push(vehicle_text(&vehicle)?);
    }
    Ok(sha256(&serde_json::to_vec(&common).map_err(|error| error.to_string())?))
}

impl SensitivityPlan {
    /// SHA-256 of everything that a campaign's outcome depends on, hexadecimal.
    ///
    /// # Errors
    /// If the settings cannot be written as JSON.
    pub fn key(&self, item: &Item) -> Result<String, serde_json::Error> {
        let level = |(factor, level): (&Factor, _)| {
            let known = match factor.target {
                Target::Effect { known, .. } | Target::Parameter { known, .. } => known,
                _ => true,
            };
            (factor.target.words(), known, level)
        };
        let own = Own {
            format: ITEM_SCHEMA,
            made_by: MADE_BY,
            study: &self.fingerprint,
            levels: self.factors.iter().zip(&item.levels).map(level).collect(),
            seed: item.seed,
        };
        Ok(sha256(&serde_json::to_vec(&own)?))
    }
}
