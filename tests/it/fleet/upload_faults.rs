//! Uploads to virtual vehicles while everything goes wrong, in simulated time: what the station
//! takes for loaded is what the vehicle has.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::collections::BTreeMap;

use crate::fleet::loaded::{assert_cleared, assert_loaded, bad, drone, hover, load};
use updraft::base::time::GpsTime;
use updraft::fleet::upload::{Left, Refused, Upload};
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::{Observer, run_all};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::mission::Plan;
use updraft::sim::Uniform;
use updraft::vehicle::library::builtin;
use updraft::virtual_fleet::lossy::LossyNet;
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;

const DRONES: u16 = 6;
/// The drone that is switched off for good, and two that reboot.
const GONE: u16 = 3;
const REBOOT: [u16; 2] = [1, 2];

/// Kills the station at this time: what it has under way is lost.
struct KilledAt(Micros);

impl Observer for KilledAt {
    fn stop(&mut self, now: Micros) -> bool {
        now >= self.0
    }
}

type Net<'w> = LossyNet<VirtualVehicle<'w>>;

fn net<'w>(world: &'w World<'w>, plan: &Plan, at: Micros, seed: u64) -> Net<'w> {
    let vehicles = plan.slots.iter().map(|slot| {
        let mut setup = VehicleSetup::new(slot.slot, slot.slot as u8, slot.home_m.into());
        setup.boot = BootTimes::short();
        setup.gone_at = (slot.slot == GONE).then_some(at);
        setup.reboot_at = REBOOT.contains(&slot.slot).then_some(at);
        let storage = Box::new(MemoryStorage::default());
        (drone(slot.slot), VirtualVehicle::new(world, setup, storage, 0))
    });
    LossyNet::new(vehicles.collect(), bad(), seed)
}

/// Uploads to all until the station is killed.
fn upload(
    net: &mut Net<'_>,
    plan: &Plan,
    numbers: u32,
    until: Micros,
) -> BTreeMap<DroneId, Result<(), Refused>> {
    let uploads = (1..=DRONES)
        .map(|slot| (drone(slot), Upload::new(drone(slot), load(plan, slot), numbers)))
        .collect();
    let done = run_all(net, uploads, 4, &mut KilledAt(until)).unwrap();
    done.into_iter().map(|(drone, done)| (drone, done.map(drop))).collect()
}

/// The time in which the fleet's uploads are over, if nothing but the link is bad: mishaps are
/// spread over it.
const USUAL: Micros = 25 * S;

#[test]
fn what_counts_as_loaded_is_loaded_whatever_befalls() {
    let plan = hover(2, 3);
    let vehicle = builtin("airsim-generic-quad").unwrap();
    let air = Uniform(nalgebra::Vector3::zeros());
    let mut refused = Vec::new();
    for seed in 0..12 {
        let gps = GpsTime { week: 2445, tow_ms: 100_000_000 };
        let world = World::new(&vehicle, &air, plan.site.frame(), 7, gps);
        let at = 3 * S + seed * USUAL / 12;
        let mut net = net(&world, &plan, at, seed);
        while net.recv(2500 * MS).unwrap().is_some() {}
        // Killed twice, and run again.
        for (round, killed) in [4 * S + seed * S, 9 * S + seed * S].into_iter().enumerate() {
            for (id, done) in upload(&mut net, &plan, 1 + 1000 * round as u32, killed) {
                if done.is_ok() {
                    assert_loaded(&net.vehicles[&id], &load(&plan, id.system.into()));
                }
            }
        }
        let done = upload(&mut net, &plan, 5000, Micros::MAX);
        assert_eq!(done.len(), usize::from(DRONES));
        for (id, done) in done {
            let vehicle = &net.vehicles[&id];
            match done {
                Ok(()) => assert_loaded(vehicle, &load(&plan, id.system.into())),
                Err(error) => {
                    if error.left == Left::Cleared {
                        assert_cleared(vehicle);
                    }
                    assert_eq!(id, drone(GONE), "seed {seed}: drone {id}: {error}");
                    refused.push(error.to_string());
                }
            }
        }
    }
    let silent = ["no answer", "nothing is heard", "sends no status"];
    let is_clear = |text: &String| silent.iter().any(|words| text.contains(words));
    assert!(!refused.is_empty() && refused.iter().all(is_clear), "{refused:#?}");
}
