//! Search for missing physics, as the blind benchmark calls it.

use std::path::Path;

use super::compare::{Both, compare, flown};
use super::{logs, one_flight, write};
use crate::base::file::create_folder;
use crate::blind::explain::{Cause, Explain, there};
use crate::blind::scenario::Scenario;
use crate::blind::vehicles::true_vehicle;
use crate::campaign::FlightFolder;
use crate::gap::{Explained, Input, Options, Verdict, fisher_z};
use crate::vehicle::{Vehicle, library};
use crate::workflow::error::WorkflowError;
use crate::workflow::find::{Found, Work};
use crate::workflow::host::Host;
use crate::workflow::provenance::provenance;

/// `updraft gap` on a flight folder, with its files written to `gap/` there.
pub(crate) struct Written<'a>(pub(crate) &'a dyn Host);

impl Explain for Written<'_> {
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause> {
        let (explained, found) = explained(flight)?;
        let work = Work { flights: vec![found], ..Work::new(flight) };
        let provenance = provenance(self.0, &work, Vec::new());
        let folder = flight.join("gap");
        create_folder(&folder)?;
        write(&folder, &explained, &provenance)?;
        Ok(explained.verdict)
    }

    fn fisher_z(&self, flight: &Path, truth: &Scenario) -> Vec<Option<f64>> {
        Searched.fisher_z(flight, truth)
    }
}

fn explained(flight: &Path) -> Result<(Explained, Found), Cause> {
    let (found, _) = one_flight(flight, None)?;
    let vehicle = library::load(&FlightFolder::at(flight).vehicle().to_string_lossy())?;
    let both = Both { measured: &found, simulated: None, hover: None };
    let explained = compare(&both, &vehicle, &Options::default())?;
    Ok((explained, found))
}

/// `updraft gap` on a campaign folder with this model: verdict on its calibration.
pub(crate) fn searched(campaign: &Path, model: &Vehicle) -> Result<Verdict, WorkflowError> {
    let (found, _) = one_flight(campaign, None)?;
    let both = Both { measured: &found, simulated: None, hover: None };
    Ok(compare(&both, model, &Options::default())?.verdict)
}

/// `updraft gap` on a flight folder.
pub(crate) struct Searched;

impl Explain for Searched {
    fn explain(&self, flight: &Path) -> Result<Verdict, Cause> {
        Ok(explained(flight)?.0.verdict)
    }

    fn fisher_z(&self, flight: &Path, truth: &Scenario) -> Vec<Option<f64>> {
        let unknown = || vec![None; truth.hidden.len()];
        let Ok((found, _)) = one_flight(flight, None) else { return unknown() };
        let Some(slot) = truth.cold_slot() else { return unknown() };
        let Ok(vehicle) = true_vehicle(truth, slot) else { return unknown() };
        let read = logs::read(&found, Path::new(""));
        let flown = flown(&read);
        let input = Input {
            vehicle: &vehicle,
            plan: found.plan.as_ref(),
            flown: &flown,
            simulated: None,
            table: None,
            logs: found.logs.len(),
            left_out: Vec::new(),
        };
        let hidden = there(truth, &vehicle);
        fisher_z(&input, truth.updraft_mps(), &hidden).unwrap_or_else(|_| unknown())
    }
}
