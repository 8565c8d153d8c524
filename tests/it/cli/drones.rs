//! Virtual drones of the test itself, behind real sockets: what the program has done is looked up
//! on the drones.

use std::net::SocketAddr;
use std::sync::Arc;

use nalgebra::Vector3;
use updraft::base::time::GpsTime;
use updraft::campaign::{self, FlightFolder};
use updraft::fleet::fence::fence_of;
use updraft::fleet::upload::ShowLoad;
use updraft::link::clock::Clock;
use updraft::link::signing::Key;
use updraft::mission::Plan;
use updraft::sim::Uniform;
use updraft::vehicle::library::builtin;
use updraft::virtual_fleet::lossy::Faults;
use updraft::virtual_fleet::server::{Pace, ServerOptions, serve};
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;

use crate::cli::support::Bench;

/// Drones of a campaign's flight.
pub(crate) struct Drones {
    pub(crate) folder: FlightFolder,
    pub(crate) plan: Plan,
    pub(crate) setups: Vec<VehicleSetup>,
    pub(crate) key: Option<Key>,
    pub(crate) faults: Faults,
    /// Parameters that are not as the firmware has them at first.
    pub(crate) params: Vec<(&'static str, f32)>,
    /// Their seconds per second of the clock.
    pub(crate) speed: f64,
    clock: Arc<dyn Clock>,
}

impl Bench {
    /// Drones at the slots of the folder `campaign`, drone 1 at slot 1 and so on.
    pub(crate) fn drones(&self) -> Drones {
        let folder = campaign::flights(&self.path("campaign")).unwrap().remove(0);
        let plan = folder.read_plan().unwrap();
        let setup = |slot: &updraft::mission::plan::Slot| {
            let mut setup = VehicleSetup::new(slot.slot, slot.slot as u8, slot.home_m.into());
            setup.boot = BootTimes::short();
            setup
        };
        let setups = plan.slots.iter().map(setup).collect();
        let (key, faults, params, speed) = (None, Faults::default(), Vec::new(), 1.0);
        Drones { folder, plan, setups, key, faults, params, speed, clock: self.clock() }
    }
}

impl Drones {
    /// What a slot's drone must get.
    pub(crate) fn load(&self, slot: u16) -> ShowLoad {
        let skyb = std::fs::read(self.folder.skyb(slot, self.plan.slots.len())).unwrap();
        let fence = fence_of(&self.plan, &self.plan.to_show()).unwrap();
        ShowLoad { skyb, site: self.plan.site, fence }
    }

    /// Runs `body` while the drones look for a station at `station`; then looks at them.
    pub(crate) fn fly<T>(
        &self,
        station: SocketAddr,
        body: impl FnOnce() -> T,
        look: impl FnOnce(&[VirtualVehicle<'_>]),
    ) -> T {
        let (vehicle, air) = (builtin("airsim-generic-quad").unwrap(), Uniform(Vector3::zeros()));
        let clock = &self.clock;
        let on = GpsTime::from_unix_ms((clock.unix_us() / 1000) as i64).unwrap();
        let world = World::new(&vehicle, &air, self.plan.site.frame(), 7, on);
        let vehicles = self
            .setups
            .iter()
            .map(|setup| {
                let storage = Box::new(MemoryStorage::default());
                let mut vehicle = VirtualVehicle::new(&world, setup.clone(), storage, 0);
                self.params.iter().for_each(|(name, value)| vehicle.params.put(name, *value));
                vehicle
            })
            .collect();
        let options = ServerOptions {
            stations: vec![station],
            key: self.key.clone(),
            pace: Pace::Speed(self.speed),
            faults: self.faults,
            seed: 4,
        };
        let (given, vehicles) = serve(vehicles, &options, &**clock, |_| body()).unwrap();
        look(&vehicles);
        given
    }
}
