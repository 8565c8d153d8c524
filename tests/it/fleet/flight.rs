//! A whole show with virtual vehicles, from the first word to the landing, in simulated time.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;
use updraft::base::time::GpsTime;
use updraft::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use updraft::fleet::fence::fence_of;
use updraft::fleet::greet::Greet;
use updraft::fleet::preflight::{Known, Limits, preflight};
use updraft::fleet::required::{CheckParams, requirements};
use updraft::fleet::slots;
use updraft::fleet::start::{Start, StartOptions};
use updraft::fleet::telemetry::Telemetry;
use updraft::fleet::upload::{ShowLoad, Upload};
use updraft::fleet::watch::{self, Event, Monitor};
use updraft::link::clock::{MS, Micros, S};
use updraft::link::conversation::{Observer, run_all};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};
use updraft::show::skyb;
use updraft::sim::Uniform;
use updraft::vehicle::Vehicle;
use updraft::vehicle::library::builtin;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;

type Net<'w> = LossyNet<VirtualVehicle<'w>>;

fn drone(system: u16) -> DroneId {
    DroneId { network: 0, system: system as u8 }
}

/// A hover of three drones, ten seconds long.
fn plan() -> Plan {
    let overrides = [
        Override::new("grid.rows", 1),
        Override::new("grid.columns", 3),
        Override::new("duration_s", 10.0),
        Override::new("height_m", 20.0),
        Override::new("window.settle_s", 3.0),
    ];
    resolve("hover", &overrides).unwrap().flights.remove(0).plan
}

struct Place {
    vehicle: Vehicle,
    air: Uniform,
}

impl Place {
    fn new() -> Self {
        let vehicle = builtin("airsim-generic-quad").unwrap();
        Self { vehicle, air: Uniform(Vector3::new(0.5, 0.0, 0.2)) }
    }

    fn world(&self, plan: &Plan) -> World<'_> {
        let gps = GpsTime { week: 2445, tow_ms: 100_000_000 };
        World::new(&self.vehicle, &self.air, plan.site.frame(), 7, gps)
    }
}

fn net<'w>(world: &'w World<'w>, plan: &Plan, faults: Faults) -> Net<'w> {
    let vehicle = |slot: &updraft::mission::plan::Slot| {
        let home = Vector3::from(slot.home_m);
        let mut setup = VehicleSetup::new(slot.slot, slot.slot as u8, home);
        setup.boot = BootTimes::short();
        let storage = Box::new(MemoryStorage::default());
        (drone(slot.slot), VirtualVehicle::new(world, setup, storage, 0))
    };
    LossyNet::new(plan.slots.iter().map(vehicle).collect(), faults, 5)
}

fn pass(net: &mut Net<'_>, for_us: Micros, watch: &mut dyn Observer) {
    let until = net.now() + for_us;
    while net.now() < until {
        if let Some(received) = net.recv(until).unwrap() {
            watch.on_message(net.now(), &received);
        }
        watch.stop(net.now());
    }
}

/// One frame in five is lost, each way, and takes 200 ms.
fn bad() -> Faults {
    Faults { loss: 0.2, repeat: 0.02, delay: 200 * MS, jitter: 30 * MS, ..Faults::default() }
}

/// Everything up to an authorized start.
fn started(net: &mut Net<'_>, plan: &Plan) -> (Monitor, Start) {
    let show = plan.to_show();
    let fence = fence_of(plan, &show).unwrap();
    let all: BTreeSet<DroneId> = plan.slots.iter().map(|slot| drone(slot.slot)).collect();
    let mut telemetry = Telemetry::default();
    pass(net, 10 * S, &mut telemetry);
    let greets = all.iter().map(|id| (*id, Greet::new(*id))).collect();
    let greeted = run_all(net, greets, 9, &mut telemetry).unwrap();
    assert!(greeted.values().all(|greeted| greeted.clock && greeted.version), "{greeted:?}");
    let table = slots::propose(plan, &telemetry, net.now()).unwrap();
    let checks =
        all.iter().map(|id| (*id, CheckParams::new(*id, requirements(plan, true), true))).collect();
    let params = run_all(net, checks, 9, &mut telemetry).unwrap();
    assert!(params.values().all(updraft::fleet::required::Standing::is_right), "{params:?}");
    let upload = |line: &slots::Assignment| {
        let of = &show.drones[usize::from(line.slot) - 1];
        let skyb = skyb::write(of, &skyb::SkybOptions::default()).unwrap().bytes;
        let load = ShowLoad { skyb, site: plan.site, fence: fence.clone() };
        (line.drone, Upload::new(line.drone, load, u32::from(line.slot)))
    };
    let uploads: BTreeMap<_, _> = table.drones.iter().map(upload).collect();
    let loaded = run_all(net, uploads, 9, &mut telemetry).unwrap();
    assert!(loaded.values().all(Result::is_ok), "{loaded:?}");
    pass(net, 15 * S, &mut telemetry);
    let known = Known { loaded: all.clone(), fenced: all.clone(), params };
    // A fifth of the frames is lost in one of the tests.
    let limits = Limits { link_quality: 0.4, ..Limits::default() };
    let look = preflight(plan, &table, &telemetry, &known, &limits, net.now());
    assert!(look.go(), "{look}");

    let options = StartOptions { lead_s: 40.0, ..StartOptions::default() };
    let mut start = Start::announce(all, &telemetry, options, net.now()).unwrap();
    let mut monitor = Monitor::new(plan, &table, telemetry, watch::Limits::of(plan));
    monitor.set_start(start.time().map(GpsTime::total_ms));
    for second in 0..20 {
        if second == 10 {
            start.authorize(&monitor.telemetry, net.now()).unwrap();
        }
        for _ in 0..20 {
            if let Some(message) = start.due(&monitor.telemetry, net.now()) {
                net.broadcast(&message).unwrap();
            }
            pass(net, 50 * MS, &mut monitor);
        }
    }
    assert!(start.late(&monitor.telemetry, net.now()).is_empty());
    (monitor, start)
}

fn whole_show(faults: Faults) {
    let (plan, place) = (plan(), Place::new());
    let world = place.world(&plan);
    let mut net = net(&world, &plan, faults);
    let (mut monitor, _) = started(&mut net, &plan);
    assert!(!monitor.is_over());
    let (mut worst_m, mut flown) = (0.0_f64, 0);
    let until = net.now() + 300 * S;
    while !monitor.is_over() {
        assert!(net.now() < until, "it does not end");
        pass(&mut net, 200 * MS, &mut monitor);
        for (_, flying) in monitor.flying() {
            worst_m = worst_m.max(flying.distance_m.unwrap_or(0.0));
            flown += u32::from(flying.distance_m.is_some());
        }
    }
    assert!(flown > 300, "{flown} distances");
    assert!(worst_m < 3.0, "{worst_m} m");
    // The log goes on for a while after the landing.
    pass(&mut net, 30 * S, &mut monitor);
    let events = monitor.take_events();
    for id in plan.slots.iter().map(|slot| drone(slot.slot)) {
        let stages: Vec<&str> = events
            .iter()
            .filter(|told| told.drone == id)
            .filter_map(|told| match &told.event {
                Event::Stage { stage, .. } => Some(stage.as_str()),
                _ => None,
            })
            .collect();
        assert_eq!(stages, ["take-off", "performing", "landing", "landed"], "drone {id}");
        let vehicle = &net.vehicles[&id];
        assert_eq!(vehicle.flown.len(), 1);
    }
}

#[test]
fn a_show_is_flown_over_a_good_link() {
    whole_show(Faults::default());
}

#[test]
fn a_show_is_flown_over_a_bad_link() {
    whole_show(bad());
}

#[test]
fn a_show_is_aborted_in_the_air() {
    let (plan, place) = (plan(), Place::new());
    let world = place.world(&plan);
    let mut net = net(&world, &plan, bad());
    let (mut monitor, _) = started(&mut net, &plan);
    pass(&mut net, 35 * S, &mut monitor);
    let aborts = plan
        .slots
        .iter()
        .map(|slot| drone(slot.slot))
        .map(|id| (id, Abort::new(id, Action::Return, monitor.telemetry.get(id))))
        .collect();
    let began = net.now();
    let done = run_all(&mut net, aborts, ALL_AT_ONCE, &mut monitor).unwrap();
    let confirmed = Aborted::Confirmed(Action::Return);
    assert!(done.values().all(|aborted| *aborted == confirmed), "{done:?}");
    assert!(net.now() - began < 8 * S, "{} us", net.now() - began);
    let until = net.now() + 200 * S;
    while !monitor.is_over() && net.now() < until {
        pass(&mut net, S, &mut monitor);
    }
    assert!(net.vehicles.values().all(|vehicle| !vehicle.is_armed()));
}
