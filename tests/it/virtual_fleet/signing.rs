//! Drones that sign, and networks that are told apart, behind real sockets.

use std::net::UdpSocket;
use std::sync::Arc;
use std::time::Duration;

use updraft::link::clock::{Clock, MS, S, SystemClock};
use updraft::link::frame::{FrameReader, MavMessage, Sender, dialect, encode};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::link::signing::{Key, Signer, Verifier, signing_time};
use updraft::link::station::{STATION, Setup, Station};
use updraft::virtual_fleet::lossy::Faults;
use updraft::virtual_fleet::server::{Pace, Running, ServerError, ServerOptions, serve};

use super::server::drone;
use super::support::{Field, show_of};
use crate::ports::free_port;

fn key(byte: u8) -> Key {
    Key::from_bytes([byte; 32])
}

fn options(stations: Vec<std::net::SocketAddr>, key: Option<Key>) -> ServerOptions {
    ServerOptions { stations, key, pace: Pace::Speed(1.0), faults: Faults::default(), seed: 1 }
}

fn wish(system: u8) -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(dialect::PARAM_REQUEST_READ_DATA {
        param_index: -1,
        target_system: system,
        target_component: 1,
        param_id: "FENCE_ACTION".into(),
    })
}

/// Whether the drone is heard within a second, and answers; and what it refused.
fn talk(of_station: Option<Key>, of_drone: Option<Key>) -> (bool, bool, u64) {
    let (field, clock, at) = (Field::new(), Arc::new(SystemClock::start()), free_port());
    let world = field.world();
    let links = vec![format!("udpin:{at}").parse().unwrap()];
    let wall: Arc<dyn Clock> = clock.clone();
    let mut station = Station::open(Setup { links, key: of_station, clock: wall }).unwrap();
    let vehicles = vec![drone(&world, 1, &show_of([0.0, 0.0], 12.0))];
    let body = |running: &Running| {
        let id = DroneId { network: 0, system: 1 };
        let (mut heard, mut answered) = (false, false);
        let until = station.now() + 3 * S;
        while station.now() < until && !answered {
            // Also when it has not been heard: a broadcast goes to everyone who was.
            station.send(id, &wish(1)).unwrap();
            let next = station.now() + 100 * MS;
            while let Some(received) = station.recv(next).unwrap() {
                heard = true;
                answered |= matches!(received.message, MavMessage::PARAM_VALUE(_));
            }
        }
        (heard, answered, running.refused())
    };
    serve(vehicles, &options(vec![at], of_drone), clock.as_ref(), body).unwrap().0
}

#[test]
fn who_has_the_key_is_heard_and_answered() {
    assert_eq!(talk(Some(key(1)), Some(key(1))), (true, true, 0));
    assert_eq!(talk(None, None), (true, true, 0));
}

#[test]
fn another_key_or_none_is_not() {
    assert!(matches!(talk(Some(key(2)), Some(key(1))), (false, false, _)));
    assert!(matches!(talk(Some(key(1)), None), (false, false, _)));
    // A station without a key reads what is signed; the drone refuses its words.
    let (heard, answered, refused) = talk(None, Some(key(1)));
    assert!(heard && !answered && refused > 10, "{refused} refused");
}

#[test]
fn a_frame_that_is_sent_again_is_refused() {
    let (field, clock) = (Field::new(), SystemClock::start());
    let world = field.world();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_millis(20))).unwrap();
    let vehicles = vec![drone(&world, 1, &show_of([0.0, 0.0], 12.0))];
    let time = signing_time(clock.unix_us());
    let mut signer = Signer::new(key(1), 1, time);
    let frame = encode(STATION, 0, &wish(1), Some(&mut signer));
    let mut verifier = Verifier::new(key(1), time);
    let body = |running: &Running| {
        let (mut bytes, mut sent, mut answers) = ([0; 2048], 0, 0);
        let until = clock.now() + S;
        while clock.now() < until {
            let Ok((size, drone)) = socket.recv_from(&mut bytes) else { continue };
            if sent < 5 {
                sent += 1;
                socket.send_to(&frame, drone).unwrap();
            }
            let mut reader = FrameReader::default();
            reader.push(&bytes[..size]);
            while let Some(frame) = reader.next(Some(&mut verifier)) {
                answers += u32::from(matches!(frame.message, MavMessage::PARAM_VALUE(_)));
            }
        }
        (sent, answers, running.refused())
    };
    let options = options(vec![socket.local_addr().unwrap()], Some(key(1)));
    let (seen, _) = serve(vehicles, &options, &clock, body).unwrap();
    assert_eq!(seen, (5, 1, 4));
}

/// A heartbeat of a vehicle that signs.
fn beat(system: u8, signer: &mut Signer) -> Vec<u8> {
    let beat = dialect::HEARTBEAT_DATA {
        autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        ..Default::default()
    };
    let sender = Sender { system, component: 1 };
    encode(sender, 0, &MavMessage::HEARTBEAT(beat), Some(signer))
}

/// How many of these frames are taken and refused, in the network that they are sent into.
fn judged(station: &mut Station, at: std::net::SocketAddr, frames: &[Vec<u8>]) -> (usize, u64) {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let refused = |station: &Station| -> u64 {
        station.traffic().values().map(|traffic| traffic.loss.forged).sum()
    };
    let before = refused(station);
    let (mut taken, mut judged) = (0, 0);
    for frame in frames {
        socket.send_to(frame, at).unwrap();
    }
    let until = station.now() + 10 * S;
    while judged < frames.len() && station.now() < until {
        taken += usize::from(station.recv(station.now() + 20 * MS).unwrap().is_some());
        judged = taken + (refused(station) - before) as usize;
    }
    (taken, refused(station) - before)
}

#[test]
fn what_was_heard_in_one_network_or_by_an_earlier_station_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("swarm.key");
    std::fs::write(&path, [7; 32]).unwrap();
    let from_file = || Some(Key::from_file(&path).unwrap());
    let clock = Arc::new(SystemClock::start());
    let mut signer = Signer::new(from_file().unwrap(), 0, signing_time(clock.unix_us()));
    let recorded: Vec<Vec<u8>> = (0..5).map(|_| beat(9, &mut signer)).collect();
    let open = || {
        let ports = [free_port(), free_port()];
        let links = (0..2).map(|n| format!("{n}@udpin:{}", ports[n]).parse().unwrap()).collect();
        let wall: Arc<dyn Clock> = clock.clone();
        (Station::open(Setup { links, key: from_file(), clock: wall }).unwrap(), ports)
    };
    let (mut station, ports) = open();
    assert_eq!(judged(&mut station, ports[0], &recorded), (5, 0));
    assert_eq!(judged(&mut station, ports[1], &recorded), (0, 5), "in the other network");
    drop(station);
    let (mut station, ports) = open();
    assert_eq!(judged(&mut station, ports[0], &recorded), (0, 5), "by the next station");
    let newer = [beat(9, &mut signer)];
    assert_eq!(judged(&mut station, ports[0], &newer), (1, 0));
}

#[test]
fn the_same_id_in_two_networks_is_two_drones() {
    let (field, clock) = (Field::new(), Arc::new(SystemClock::start()));
    let world = field.world();
    let ports = vec![free_port(), free_port()];
    let links = (0..2).map(|n: usize| format!("{n}@udpin:{}", ports[n]).parse().unwrap()).collect();
    let wall: Arc<dyn Clock> = clock.clone();
    let mut station = Station::open(Setup { links, key: None, clock: wall }).unwrap();
    let make = |network| {
        let mut vehicle = drone(&world, 1, &show_of([0.0, 0.0], 12.0));
        vehicle.setup.network = network;
        vehicle
    };
    let (heard, _) =
        serve(vec![make(0), make(1)], &options(ports.clone(), None), clock.as_ref(), |_| {
            let until = station.now() + 5 * S;
            while station.heard().len() < 2 && station.now() < until {
                let _ = station.recv(until.min(station.now() + 50 * MS)).unwrap();
            }
            station.heard()
        })
        .unwrap();
    let id = |network| DroneId { network, system: 1 };
    assert_eq!(heard, [id(0), id(1)]);

    let error = serve(vec![make(2)], &options(ports, None), clock.as_ref(), |_| ()).err().unwrap();
    assert!(matches!(error, ServerError::Network { network: 2, .. }));
    assert_eq!(
        error.to_string(),
        "virtual vehicle 1 is in network 2, but the station has 2 ports: give one for each network"
    );
}
