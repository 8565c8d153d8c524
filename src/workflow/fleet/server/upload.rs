//! Upload of shows through the server, several drones at once.

use std::collections::BTreeMap;

use super::{BEYOND_M, ServedFlight};
use crate::fleet::fence::fence_of;
use crate::mission::Plan;
use crate::show::Show;
use crate::show::skyc::drone_documents;
use crate::skybrush_server::{Client, Fence, Foreman, Job, Outcome, ShowUpload, upload};
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Drones that are sent their show at once. The server takes any number, but tells of no progress
/// and gives each up after 90 s: more of them would share the same radio, and all be late.
const AT_ONCE: usize = 5;

/// A plan's show as the server takes it.
pub(super) struct Shows<'a> {
    plan: &'a Plan,
    show: Show,
    common: ShowUpload,
}

impl<'a> Shows<'a> {
    /// With the same fence and the same refusal as over MAVLink.
    pub(super) fn of(plan: &'a Plan) -> Result<Self, WorkflowError> {
        let show = plan.to_show();
        let checked =
            fence_of(plan, &show).map_err(|error| WorkflowError::Usage(error.to_string()))?;
        let corners = &plan.fence.polygon_m;
        let homes = plan.slots.iter().map(|slot| slot.home_m);
        let reach_m = homes
            .flat_map(|home| {
                corners.iter().map(move |corner| (corner[0] - home[0]).hypot(corner[1] - home[1]))
            })
            .fold(0.0, f64::max);
        let common = ShowUpload {
            id: plan.name.clone(),
            title: plan.title.clone(),
            drones: plan.slots.len(),
            frame: plan.site.frame(),
            fence: Fence {
                polygon_m: corners.clone(),
                max_altitude_m: checked.top_m,
                max_distance_m: reach_m + BEYOND_M,
            },
        };
        Ok(Self { plan, show, common })
    }

    /// Every slot's request, to the drones that `name` says.
    pub(super) fn jobs(
        &self,
        name: impl Fn(u16) -> Option<String>,
    ) -> Result<BTreeMap<u16, Job>, WorkflowError> {
        let mut jobs = BTreeMap::new();
        for (index, (slot, drone)) in self.plan.slots.iter().zip(&self.show.drones).enumerate() {
            let Some(id) = name(slot.slot) else { continue };
            let (trajectory, lights) = drone_documents(drone).map_err(|problem| {
                WorkflowError::Failed(format!("slot {}: {problem}", slot.slot))
            })?;
            let payload = self.common.payload(index, &trajectory, lights.as_ref())?;
            jobs.insert(slot.slot, upload(&id, &payload));
        }
        Ok(jobs)
    }

    /// Sends every drone its show; who does not have it, and why.
    pub(super) fn send(
        &self,
        host: &dyn Host,
        client: &mut Client,
        flight: &ServedFlight<'_>,
    ) -> Result<BTreeMap<String, String>, WorkflowError> {
        let jobs = self.jobs(|slot| flight.drones.get(&slot).cloned())?;
        let mut uploads = Uploads { host, ended: BTreeMap::new() };
        client.work(jobs.into_values(), AT_ONCE, &mut uploads)?;
        host.check_stop()?;
        let mut refused = BTreeMap::new();
        for (slot, id) in flight.drones {
            let reason = match uploads.ended.remove(id) {
                Some(Ok(_)) => continue,
                Some(Err(reason)) => reason,
                None => "the server does not report on it".to_owned(),
            };
            host.warn(&format!("drone {id} (slot {slot}): {reason}"));
            refused.insert(id.clone(), reason);
        }
        Ok(refused)
    }
}

struct Uploads<'a> {
    host: &'a dyn Host,
    ended: BTreeMap<String, Outcome>,
}

impl Foreman for Uploads<'_> {
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job> {
        self.ended.insert(drone.to_owned(), outcome);
        None
    }

    fn stop(&mut self) -> bool {
        self.host.is_stopped()
    }
}
