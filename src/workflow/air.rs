//! Air of simulated flights: what is drawn, and what is read from models' output, checked against the plan.

use std::path::Path;

use rayon::prelude::*;
use sha2::{Digest as _, Sha256};

use super::error::WorkflowError;
use super::host::Host;
use crate::base::digest::hexadecimal;
use crate::base::file::read_pieces;
use crate::base::frame::ShowFrame;
use crate::base::plain::Shown as _;
use crate::campaign::AirFile;
use crate::les::{self, Les, Where};
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::show::trajectory::Cursor;
use crate::sim::air::{Sum, spec, spec::Air};

/// Height at which a model's mean wind carries its air where no plan says how high drones fly, m.
const USUAL_HEIGHT_M: f64 = 50.0;

/// Models' output that was opened for a flight.
#[derive(Clone, Default)]
pub(crate) struct ReadAir(Vec<Les>);

impl ReadAir {
    /// Opens what an air reads from files, and says what it covers.
    pub(crate) fn open(
        host: &dyn Host,
        air: &Air,
        frame: &ShowFrame,
        height_m: Option<f64>,
    ) -> Result<Self, WorkflowError> {
        let mut all = Vec::new();
        for spec in &air.read {
            let place = Where {
                orientation_deg: frame.orientation_deg,
                height_m: height_m.unwrap_or(USUAL_HEIGHT_M),
            };
            let les = les::open(spec, place)?;
            host.say(&les.about.words());
            if let Some(caution) = les.about.caution() {
                host.warn(&caution);
            }
            all.push(les);
        }
        Ok(Self(all))
    }

    /// Opens what a flight of a plan meets, and checks that it covers the flight.
    pub(crate) fn of_plan(
        host: &dyn Host,
        air: &Air,
        plan: &Plan,
        slots: &[&Slot],
    ) -> Result<Self, WorkflowError> {
        if air.read.is_empty() {
            return Ok(Self::default());
        }
        let highest_m = |slot: &Slot| {
            let trajectory = plan.trajectory(slot);
            let mut cursor = Cursor::new(&trajectory);
            seconds(plan).map(|second| cursor.state_at(second).position_m.z).fold(0.0, f64::max)
        };
        // Drones of a plan fly at the same heights, but for those of groups with other steps.
        let height_m = slots.par_iter().map(|slot| highest_m(slot)).reduce(|| 0.0, f64::max);
        let read = Self::open(host, air, &plan.site.frame(), Some(height_m))?;
        for les in &read.0 {
            les.about.check_times(plan.duration_ms as f64 / 1000.0)?;
            slots.par_iter().try_for_each(|slot| {
                let trajectory = plan.trajectory(slot);
                let mut cursor = Cursor::new(&trajectory);
                seconds(plan).try_for_each(|second| {
                    let place = cursor.state_at(second).position_m;
                    les.about.check_place(&les.air, slot.slot, &place, second)
                })
            })?;
        }
        read.check_read()?;
        Ok(read)
    }

    /// The air of a flight: what is drawn for it, and what is read.
    pub(crate) fn with_drawn(&self, air: &Air, frame: &ShowFrame, seed: u64, flight: &str) -> Sum {
        let mut sum = spec::build(air, frame, seed, flight);
        for les in &self.0 {
            sum.0.push(Box::new(std::sync::Arc::clone(&les.air)));
        }
        sum
    }

    /// Whether all that was asked of the files so far could be read.
    ///
    /// # Errors
    /// The first thing that could not be.
    pub(crate) fn check_read(&self) -> Result<(), WorkflowError> {
        match self.0.iter().find_map(|les| les.air.failure()) {
            Some(reason) => Err(WorkflowError::Failed(format!(
                "the air of the flight could not be read: {reason}; nothing was kept of the flight"
            ))),
            None => Ok(()),
        }
    }

    /// The files, for records.
    pub(crate) fn files(&self) -> Result<Vec<AirFile>, WorkflowError> {
        let mut files = Vec::new();
        for path in self.0.iter().flat_map(|les| &les.about.files) {
            files.push(air_file(path)?);
        }
        Ok(files)
    }
}

fn air_file(path: &Path) -> Result<AirFile, WorkflowError> {
    let mut hash = Sha256::new();
    let bytes = read_pieces(path, |piece| hash.update(piece))?;
    Ok(AirFile { file: path.shown().to_string(), bytes, sha256: hexadecimal(hash) })
}

/// Seconds of a flight.
fn seconds(plan: &Plan) -> impl Iterator<Item = f64> {
    (0..=plan.duration_ms.div_ceil(1000).min(86_400)).map(|second| second as f64)
}
