//! Writing a mission as a campaign folder.

use std::path::Path;

use super::error::WorkflowError;
use super::host::Host;
use super::wind_forms::wind_forms;
use super::words;
use crate::analysis::wind_legs::{Bought, bought};
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::campaign::write::{FlightFiles, folders, write_index};
use crate::campaign::{self, CampaignError, FlightFolder};
use crate::mission::Plan;
use crate::mission::plan::{Purpose, SegmentKind};
use crate::mission::resolve::Mission;
use crate::show::Show;
use crate::vehicle::Vehicle;

/// The flights and the fleet in words: `calibration and hover for 49 drones`.
pub fn what_for_whom(mission: &Mission) -> String {
    let names: Vec<_> = mission.flights.iter().map(|flight| flight.plan.name.as_str()).collect();
    let drones = mission.flights.first().map_or(0, |flight| flight.plan.slots.len());
    format!("{} for {}", words::list(&names), words::count(drones, "drone"))
}

/// Writes the campaign folder, unless it holds something else. `shows` are those of the mission's
/// flights, in their order. With `force` another plan is replaced, but never logs.
///
/// # Errors
///
/// If the folder holds something else, or files cannot be written.
pub fn write(
    host: &dyn Host,
    mission: &Mission,
    shows: &[Show],
    root: &Path,
    force: bool,
) -> Result<(), WorkflowError> {
    let folders = folders(root, mission);
    let mut files = Vec::with_capacity(folders.len());
    for ((flight, folder), show) in mission.flights.iter().zip(&folders).zip(shows) {
        host.check_stop()?;
        let made = FlightFiles::of(flight, show)?;
        refuse_occupied(root, folder, made.plan(), force)?;
        files.push(made);
    }
    for (files, folder) in files.iter().zip(&folders) {
        host.check_stop()?;
        files.write(folder)?;
    }
    Ok(write_index(root, mission)?)
}

/// Refuses to replace another plan that has logs, or any other plan without `--force`. The plan that is
/// there may be written again.
fn refuse_occupied(
    root: &Path,
    folder: &FlightFolder,
    plan: &[u8],
    force: bool,
) -> Result<(), WorkflowError> {
    let occupied = |what: &str| {
        Err(CampaignError::Occupied { path: folder.0.clone(), what: what.to_owned() }.into())
    };
    if folder.0.as_path() != root && FlightFolder(root.to_owned()).plan().exists() {
        return occupied("a plan of one flight");
    }
    if folder.0.as_path() == root && campaign::index_path(root).exists() {
        return occupied("a campaign of several flights");
    }
    // One more is another plan already.
    let existing = match read_whole(&folder.plan(), plan.len() as u64) {
        Ok(existing) => Some(existing),
        Err(error) => match error.source.kind() {
            std::io::ErrorKind::NotFound => return Ok(()),
            std::io::ErrorKind::FileTooLarge => None,
            _ => return Err(error.into()),
        },
    };
    if existing.is_some_and(|existing| existing == plan) {
        return Ok(());
    }
    if folder.simulated().is_dir() || folder.logs().is_dir() {
        return Err(WorkflowError::Usage(format!(
            "{} holds the logs of another plan, which are never overwritten; choose another folder, \
             or move its folders logs and simulated away and give --force",
            folder.0.shown()
        )));
    }
    if force { Ok(()) } else { occupied("another plan") }
}

/// Winds for which it is told what legs buy, m/s.
const TOLD_WINDS_MPS: [f64; 2] = [5.0, 8.0];
/// Standard errors in half of a 95 % interval.
const NORMAL: f64 = 1.96;

/// Sentence on what the horizontal legs that calibrate the wind buy; `None` without such legs, and for vehicles whose
/// lean tells no wind.
pub fn legs_buy(plan: &Plan, vehicle: &Vehicle) -> Option<String> {
    let legs = plan
        .groups
        .first()?
        .segments
        .iter()
        .filter(|segment| segment.kind == SegmentKind::Horizontal && segment.window.is_some())
        .filter(|segment| plan.purpose == Purpose::Calibration || segment.calibrates_wind);
    let ground_mps: Vec<[f64; 2]> =
        legs.map(|leg| [leg.velocity_mps[0], leg.velocity_mps[1]]).collect();
    if ground_mps.len() < 2 {
        return None;
    }
    let forms = wind_forms(plan.site.ground_amsl_m, vehicle)?;
    let told = TOLD_WINDS_MPS.map(|wind_mps| {
        let Bought { without_mps, with_mps } = bought(&forms, &ground_mps, plan.purpose, wind_mps);
        let (without, with) = (NORMAL * without_mps, NORMAL * with_mps);
        format!("+-{with:.2} instead of +-{without:.2} m/s in {wind_mps} m/s of wind")
    });
    let (flown, map) = match plan.purpose {
        Purpose::Calibration => ("flown in light wind", "a later map"),
        Purpose::Measurement => ("beside a calibration in light wind", "this map"),
    };
    Some(format!(
        "The {} horizontal legs calibrate lean and lift: {flown}, what is unknown of them moves {map} by {} \
         (95 %, common to all drones)",
        ground_mps.len(),
        told.join(", ")
    ))
}

/// Shows of a mission's flights, in their order.
pub fn shows(mission: &Mission) -> Vec<Show> {
    mission.flights.iter().map(|flight| flight.plan.to_show()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::resolve::{Override, resolve};

    fn told(template: &str, legs: &[&str]) -> Vec<Option<String>> {
        let all = ["vehicle=pixel", "grid.rows=2"].iter().chain(legs);
        let overrides: Vec<Override> = all.map(|text| Override::parse(text).unwrap()).collect();
        let mission = resolve(template, &overrides).unwrap();
        mission.flights.iter().map(|flight| legs_buy(&flight.plan, &flight.vehicle)).collect()
    }

    #[test]
    fn it_is_told_what_legs_of_either_flight_buy() {
        let legs = ["calibration.legs.speeds_mps=[3, 6]", "hover.legs.speeds_mps=[3, 6]"];
        let [calibration, hover] = &told("campaign", &legs)[..] else { panic!("two flights") };
        let (calibration, hover) = (calibration.as_ref().unwrap(), hover.as_ref().unwrap());
        assert!(calibration.contains("moves a later map by"), "{calibration}");
        assert!(hover.contains("moves this map by"), "{hover}");
        for words in [calibration, hover] {
            let numbers: Vec<f64> = words
                .split("+-")
                .skip(1)
                .map(|part| part.split(' ').next().unwrap().parse().unwrap())
                .collect();
            let [with_5, without_5, with_8, without_8] = numbers[..] else { panic!("{words}") };
            assert!(with_5 < without_5 && with_8 < without_8, "{words}");
        }
        assert_eq!(told("campaign", &legs[..1])[1], None);
        assert_eq!(told("scan-campaign", &[]), [None, None], "a scan's own legs calibrate nothing");
    }
}
