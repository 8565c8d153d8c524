//! Virtual drones that are switched on: for practice, and for other ground stations.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;

use super::links::{open, own_link};
use crate::base::time::GpsTime;
use crate::link::clock::{Micros, S};
use crate::link::signing::Key;
use crate::link::station::Station;
use crate::mission::Plan;
use crate::mission::plan::Slot;
use crate::sim::Atmosphere;
use crate::vehicle::Vehicle;
use crate::virtual_fleet::broadcast::Broadcasts;
use crate::virtual_fleet::lossy::Faults;
use crate::virtual_fleet::server::{Pace, Running, ServerOptions, serve_with};
use crate::virtual_fleet::storage::MemoryStorage;
use crate::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use crate::virtual_fleet::world::World;
use crate::workflow::clock::{Clock, SinceNow};
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::slots::SlotSet;
use crate::workflow::words;

/// Virtual drones in one network: its system ids, without those of ground stations.
pub(crate) const MOST_PER_NETWORK: usize = 253;
/// Most virtual drones of one process: each has a socket, and systems allow about 1,000 files.
pub(crate) const MOST_DRONES: usize = 800;

/// What virtual drones fly in, and how well they are heard.
pub(crate) struct Hangar<'a> {
    pub(crate) plan: &'a Plan,
    /// The slots that have a drone.
    pub(crate) slots: Vec<&'a Slot>,
    pub(crate) vehicle: &'a Vehicle,
    pub(crate) air: &'a dyn Atmosphere,
    pub(crate) seed: u64,
    pub(crate) full_logs: bool,
    /// Their logs are those of `simulate`, to the byte.
    pub(crate) boots_by_seed: bool,
    /// GPS time when they are switched on.
    pub(crate) switched_on: GpsTime,
    pub(crate) pace: Pace,
    pub(crate) faults: Faults,
    pub(crate) boot: BootTimes,
    /// What they sign with.
    pub(crate) key: Option<Key>,
    pub(crate) mishaps: Mishaps,
}

/// What befalls virtual drones, besides a bad link, and what they bring along.
#[derive(Clone, Debug, Default)]
pub(crate) struct Mishaps {
    /// Slots whose drones are switched off for good.
    pub(crate) gone: Option<SlotSet>,
    /// Slots whose drones reboot once.
    pub(crate) reboot: Option<SlotSet>,
    /// Slots whose drones have stock firmware; `Some(None)`: all.
    #[expect(clippy::option_option, reason = "none, all, or these")]
    pub(crate) stock: Option<Option<SlotSet>>,
    /// When, their time from being switched on.
    pub(crate) at: Micros,
    /// Logs that are on their cards, by slot.
    pub(crate) cards: BTreeMap<u16, Vec<u8>>,
}

impl Hangar<'_> {
    /// Switches the drones on, on this computer, and runs `body` with a station that hears them.
    pub(crate) fn open<T>(
        &self,
        clock: &Arc<dyn Clock>,
        body: impl FnOnce(&mut Station) -> Result<T, WorkflowError>,
    ) -> Result<T, WorkflowError> {
        let networks = self.slots.len().div_ceil(MOST_PER_NETWORK).max(1);
        let opened: Result<Vec<_>, WorkflowError> =
            (0..networks).map(|network| own_link(network as u16)).collect();
        let (links, stations) = opened?.into_iter().unzip();
        let clock: Arc<dyn Clock> = Arc::new(SinceNow::of(clock));
        let mut station = open(links, self.key.clone(), &clock)?;
        self.serve(stations, None, &*clock, |_| body(&mut station))?
    }

    /// Switches the drones on; they look for a station at these addresses, one for each
    /// network, among which they are divided evenly. What is broadcast they all hear.
    pub(crate) fn serve<T>(
        &self,
        stations: Vec<SocketAddr>,
        broadcasts: Option<&Broadcasts>,
        clock: &dyn Clock,
        body: impl FnOnce(&Running) -> T,
    ) -> Result<T, WorkflowError> {
        let most = MOST_PER_NETWORK * stations.len();
        if self.slots.len() > most {
            return Err(WorkflowError::Usage(format!(
                "{} virtual drones do not fit into {} with {MOST_PER_NETWORK} system ids each: give \
                 --station {} times, once for each network",
                self.slots.len(),
                words::count(stations.len(), "network"),
                self.slots.len().div_ceil(MOST_PER_NETWORK)
            )));
        }
        let per_network = self.slots.len().div_ceil(stations.len().max(1)).max(1);
        let mut world =
            World::new(self.vehicle, self.air, self.plan.site.frame(), self.seed, self.switched_on);
        world.full_logs = self.full_logs;
        world.boots_by_seed = self.boots_by_seed;
        let vehicles = self
            .slots
            .iter()
            .enumerate()
            .map(|(index, slot)| {
                let system = (index % per_network) as u8 + 1;
                let mut setup = VehicleSetup::new(slot.slot, system, slot.home_m.into());
                setup.network = (index / per_network) as u16;
                setup.boot = self.boot;
                let mishaps = &self.mishaps;
                let befalls = |slots: &Option<SlotSet>| {
                    let named = slots.as_ref().is_some_and(|slots| slots.contains(slot.slot));
                    named.then_some(mishaps.at)
                };
                setup.stock = mishaps.stock.as_ref().is_some_and(|slots| {
                    slots.as_ref().is_none_or(|slots| slots.contains(slot.slot))
                });
                setup.gone_at = befalls(&mishaps.gone);
                setup.reboot_at = befalls(&mishaps.reboot);
                let mut storage = MemoryStorage::default();
                if let Some(log) = mishaps.cards.get(&slot.slot) {
                    let name = format!("{}/00000001.BIN", setup.log_folder);
                    storage.put(&name, log.clone()).map_err(|_| {
                        WorkflowError::Failed(format!("slot {} has no place for a log", slot.slot))
                    })?;
                }
                Ok(VirtualVehicle::new(&world, setup, Box::new(storage), 0))
            })
            .collect::<Result<Vec<_>, WorkflowError>>()?;
        let options = ServerOptions {
            stations,
            key: self.key.clone(),
            pace: self.pace,
            faults: self.faults,
            seed: self.seed,
        };
        let served = serve_with(vehicles, broadcasts, &options, clock, body);
        let (given, _) = served.map_err(|error| WorkflowError::Failed(with_reasons(&error)))?;
        Ok(given)
    }
}

/// From switching on to a start that is the same every time, vehicle time.
pub(crate) const TO_START: Micros = 240 * S;
