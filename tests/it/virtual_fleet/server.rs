//! A fleet behind real sockets on this computer.

use std::net::UdpSocket;
use std::sync::Arc;
use std::time::Duration;

use nalgebra::Vector3;
use updraft::link::clock::{Clock, MS, S, SystemClock};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavResult};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::link::station::{STATION, Setup, Station};
use updraft::protocol::show::{LEAVE_TIME, SHOW_FILE, StartConfig, Status, TO_DRONE};
use updraft::show::ShowDrone;
use updraft::virtual_fleet::broadcast::Broadcasts;
use updraft::virtual_fleet::lossy::Faults;
use updraft::virtual_fleet::server::{
    Pace, Running, ServerError, ServerOptions, serve, serve_with,
};
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;
use updraft::workflow::clock::SharedClock;

use super::support::{Field, file, gps_at, ladder, log_of, read, show_of, tow_at};
use crate::ports::free_port;

fn slot_m(system: u8) -> [f64; 2] {
    let index = u32::from(system - 1);
    [f64::from(index % 7) * 5.0, f64::from(index / 7) * 5.0]
}

pub(crate) fn drone<'w>(world: &'w World<'w>, system: u8, show: &ShowDrone) -> VirtualVehicle<'w> {
    let [x, y] = slot_m(system);
    let mut setup = VehicleSetup::new(system.into(), system, Vector3::new(x, y, 0.0));
    setup.boot =
        BootTimes { heartbeat: 10 * MS, files: 50 * MS, gps: 100 * MS, position: 200 * MS };
    let mut storage = MemoryStorage::default();
    storage.put(SHOW_FILE, file(show)).unwrap();
    VirtualVehicle::new(world, setup, Box::new(storage), 0)
}

/// Waits for all, tells them where and when, and waits until all have landed; the start's second.
///
/// Between the order and the start lie `ahead_s` seconds of the fleet's time.
fn lead(station: &mut Station, running: &Running, field: &Field, count: u8, ahead_s: i64) -> i64 {
    let ids: Vec<DroneId> = (1..=count).map(|system| DroneId { network: 0, system }).collect();
    let mut known = 0;
    for round in 0.. {
        assert!(round < 100, "{known} of {count} have an origin");
        let until = station.now() + 200 * MS;
        while let Some(received) = station.recv(until).unwrap() {
            if let MavMessage::COMMAND_ACK(ack) = &received.message {
                assert_eq!(ack.result, MavResult::MAV_RESULT_ACCEPTED);
            }
            if let MavMessage::DATA16(packet) = &received.message
                && Status::from_data(&packet.data[..]).flags & 0xB0 == 0xB0
            {
                known |= 1_u64 << received.from.system;
            }
        }
        let missing: Vec<_> =
            ids.iter().filter(|id| known & 1 << id.system == 0).copied().collect();
        if missing.is_empty() {
            break;
        }
        for id in missing {
            let origin = field.frame.origin;
            let place = dialect::COMMAND_INT_DATA {
                param4: field.frame.orientation_deg as f32,
                x: (origin.lat_deg * 1e7).round() as i32,
                y: (origin.lon_deg * 1e7).round() as i32,
                z: -32_768_000.0,
                command: MavCmd::MAV_CMD_USER_2,
                target_system: id.system,
                target_component: 1,
                ..Default::default()
            };
            station.send(id, &MavMessage::COMMAND_INT(place)).unwrap();
        }
    }
    let start_s = (running.now() / S) as i64 + ahead_s;
    let start =
        StartConfig { start_tow_s: tow_at(start_s), authorization: 1, countdown_ms: LEAVE_TIME };
    let (data, len) = start.to_data();
    let mut was_busy = false;
    let patience = station.now() + 300 * S;
    while !was_busy || running.busy() > 0 {
        assert!(station.now() < patience, "they have not landed");
        was_busy |= running.busy() == u64::from(count);
        if !was_busy {
            let packet = dialect::DATA16_DATA { mavtype: TO_DRONE, len, data };
            station.broadcast(&MavMessage::DATA16(packet)).unwrap();
        }
        let until = station.now() + 50 * MS;
        while station.recv(until).unwrap().is_some() {}
    }
    start_s
}

fn fly_fleet(count: u8, show: impl Fn([f64; 2]) -> ShowDrone, pace: Pace, faults: Faults) {
    let field = Field::new();
    let world = field.world();
    let clock = Arc::new(SystemClock::start());
    let at = free_port();
    let links = vec![format!("udpin:{at}").parse().unwrap()];
    let wall: Arc<dyn Clock> = clock.clone();
    let mut station = Station::open(Setup { links, key: None, clock: wall }).unwrap();
    let vehicles = (1..=count).map(|system| drone(&world, system, &show(slot_m(system)))).collect();
    let options = ServerOptions { stations: vec![at], key: None, pace, faults, seed: 1 };
    // Drones arm 8 s before the take-off. A clock that does not wait for the fleet must leave a busy
    // computer some seconds of its own to bring the order to all.
    let ahead_s = match pace {
        Pace::Fast { .. } => 9,
        Pace::Speed(speed) => 9 + (10.0 * speed) as i64,
    };
    let begun = clock.now();
    let (start_s, vehicles) = serve(vehicles, &options, clock.as_ref(), |running| {
        lead(&mut station, running, &field, count, ahead_s)
    })
    .unwrap();
    #[expect(clippy::print_stdout, reason = "the measurement of an ignored test")]
    {
        println!("{count} drones: {:.1} s", (clock.now() - begun) as f64 * 1e-6);
    }
    for (system, vehicle) in (1..).zip(&vehicles) {
        assert_eq!(vehicle.flown.len(), 1, "drone {system}");
        if system == 1 || faults.loss == 0.0 && count < 10 {
            let [x, y] = slot_m(system);
            let flown = updraft::show::skyb::read(&file(&show([x, y]))).unwrap().drone;
            let home_m = Vector3::new(x, y, 0.0);
            let setup = field.flight(&flown, system.into(), home_m, gps_at(start_s));
            let log = log_of(&setup, vehicle.booted().unwrap());
            let written = read(vehicle.storage.as_ref(), "logs/00000001.BIN");
            assert!(log == written, "drone {system}: the logs differ");
        }
    }
}

#[test]
fn a_fleet_flies_as_fast_as_it_can_and_logs_the_same() {
    fly_fleet(5, |place| show_of(place, 12.0), Pace::Fast { ground: 5.0 }, Faults::default());
}

#[test]
fn a_fleet_flies_at_a_chosen_speed_over_a_bad_link() {
    let faults =
        Faults { loss: 0.2, repeat: 0.1, delay: 5 * MS, jitter: 10 * MS, ..Faults::default() };
    fly_fleet(3, |place| show_of(place, 12.0), Pace::Speed(10.0), faults);
}

/// Skybrush Server tells all drones of a start at one port, and each where it speaks from.
#[test]
fn what_is_broadcast_at_one_port_is_heard_by_all() {
    let field = Field::new();
    let world = field.world();
    let clock = Arc::new(SystemClock::start());
    let ports = [free_port(), free_port()];
    let links = ports.iter().enumerate();
    let links = links.map(|(network, at)| format!("{network}@udpin:{at}").parse().unwrap());
    let wall: Arc<dyn Clock> = clock.clone();
    let setup = Setup { links: links.collect(), key: None, clock: wall };
    let mut station = Station::open(setup).unwrap();
    // Two networks, with the same system ids.
    let vehicles = (0..4).map(|index: u16| {
        let mut vehicle = drone(&world, (index % 2) as u8 + 1, &show_of(slot_m(1), 12.0));
        vehicle.setup.network = index / 2;
        vehicle
    });
    let broadcasts = Broadcasts::open(0).unwrap();
    let port = broadcasts.port().unwrap();
    let options = ServerOptions {
        stations: ports.to_vec(),
        key: None,
        pace: Pace::Speed(1.0),
        faults: Faults::default(),
        seed: 1,
    };
    let tow_s = tow_at(1000);
    let start = StartConfig { start_tow_s: tow_s, authorization: 0, countdown_ms: LEAVE_TIME };
    let (data, len) = start.to_data();
    let packet = MavMessage::DATA16(dialect::DATA16_DATA { mavtype: TO_DRONE, len, data });
    let server = UdpSocket::bind("127.0.0.1:0").unwrap();
    let heard = |_: &Running| {
        let mut told = std::collections::BTreeSet::new();
        let until = station.now() + 20 * S;
        let mut sequence = 0;
        while told.len() < 4 && station.now() < until {
            let frame = updraft::link::frame::encode(STATION, sequence, &packet, None);
            sequence += 1;
            server.send_to(&frame, ("127.0.0.1", port)).unwrap();
            let next = station.now() + 200 * MS;
            while let Some(received) = station.recv(next).unwrap() {
                if let MavMessage::DATA16(packet) = &received.message
                    && Status::from_data(&packet.data[..]).start_tow_s == tow_s
                {
                    told.insert((received.from.network, received.from.system));
                }
            }
        }
        told.len()
    };
    let vehicles = vehicles.collect();
    let (count, _) =
        serve_with(vehicles, Some(&broadcasts), &options, clock.as_ref(), heard).unwrap();
    assert_eq!(count, 4);
}

#[test]
fn a_port_that_is_taken_is_an_error() {
    let taken = Broadcasts::open(0).unwrap();
    let error = Broadcasts::open(taken.port().unwrap()).unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::AddrInUse);
}

/// For measuring: 49 drones, 500 s each.
#[test]
#[ignore = "slow without optimisation"]
fn forty_nine_fly_a_ladder() {
    fly_fleet(49, ladder, Pace::Fast { ground: 5.0 }, Faults::default());
}

#[test]
fn a_speed_of_nothing_is_refused() {
    let clock = SystemClock::start();
    for speed in [0.0, -1.0, f64::NAN, 1e9] {
        let options = ServerOptions {
            stations: vec![free_port()],
            key: None,
            pace: Pace::Speed(speed),
            faults: Faults::default(),
            seed: 1,
        };
        let error = serve(Vec::new(), &options, &clock, |_| ()).err().unwrap();
        assert!(matches!(error, ServerError::Pace(_)));
        assert!(error.to_string().ends_with("give a number above 0 and at most 1000"));
    }
}

#[test]
fn a_clock_that_is_shared_waits_for_the_fleet_from_the_first_instant() {
    let folder = tempfile::tempdir().unwrap();
    let clock = SharedClock::open(1_800_000_000, &folder.path().join("time")).unwrap();
    let options = ServerOptions {
        stations: vec![free_port()],
        key: None,
        pace: Pace::Speed(1.0),
        faults: Faults::default(),
        seed: 1,
    };
    let body = |running: &Running| {
        // Until then the fleet goes on alone.
        clock.join();
        let before = running.now();
        clock.pause(Duration::from_secs(10));
        running.now() - before
    };
    let (went_on, _) = serve(Vec::new(), &options, &clock, body).unwrap();
    // The fleet tells the time at the end of a round of 20 ms: what was told before can be that old.
    assert!((9 * S..=10 * S + S / 25).contains(&went_on), "{went_on}");
}
