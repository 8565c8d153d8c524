//! What the real firmware sent, replayed: `tests/data/arducopter-4.4.4-json.zip` holds the servo
//! packets of ArduCopter 4.4.4 from arming to disarming, recorded between it and this physics.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::io::Read as _;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::json::support::{Reply, frame, packet, read};
use multirotor_sim::sim::json::{Instance, InstanceSetup, serve};
use multirotor_sim::sim::{Atmosphere, Uniform};
use multirotor_sim::vehicle::Vehicle;
use multirotor_sim::vehicle::library::builtin;
use nalgebra::{UnitQuaternion, Vector3};

const DT_S: f64 = 0.0025;
const STILL: Uniform = Uniform(Vector3::new(0.0, 0.0, 0.0));

fn recording() -> Vec<[u8; 40]> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/arducopter-4.4.4-json.zip");
    let mut archive = zip::ZipArchive::new(std::fs::File::open(path).unwrap()).unwrap();
    let mut bytes = Vec::new();
    archive.by_name("packets.bin").unwrap().read_to_end(&mut bytes).unwrap();
    bytes.as_chunks().0.to_vec()
}

fn vehicle() -> Vehicle {
    builtin("airsim-generic-quad").unwrap()
}

fn instance<'a>(vehicle: &'a Vehicle, atmosphere: &'a dyn Atmosphere) -> Instance<'a> {
    // The recording was made at a home 190 m above sea level.
    let home_m = Vector3::new(3.0, 4.0, 0.0);
    Instance::new(InstanceSetup {
        vehicle,
        home_m,
        frame: frame(190.0),
        atmosphere,
        seed: 1,
        drone: 1,
    })
}

fn peer() -> SocketAddr {
    SocketAddr::from(([127, 0, 0, 1], 50_000))
}

fn replayed(packets: &[[u8; 40]], air: &dyn Atmosphere) -> Vec<String> {
    let vehicle = vehicle();
    let mut instance = instance(&vehicle, air);
    packets.iter().map(|packet| instance.answer(peer(), packet).unwrap().to_owned()).collect()
}

#[test]
fn the_same_packets_get_the_same_bytes() {
    let packets = recording();
    let first = replayed(&packets, &STILL);
    assert!(first == replayed(&packets, &STILL), "two replays differ");
}

/// The heights that the firmware was told when the recording was made.
#[test]
fn the_recorded_firmware_takes_off_hovers_and_lands_again() {
    let replies = replayed(&recording(), &STILL);
    assert_eq!(replies.len(), 11_200);
    let at = |index: usize| read(&replies[index]);
    assert_eq!(at(0).position, Vector3::zeros());
    for (index, down_m, down_mps) in [
        (856, -0.1418, -0.5127),
        (1_880, -4.0972, -1.5629),
        (3_416, -5.9203, -0.0061),
        (5_976, -6.0108, -0.0148),
        (8_024, -3.8645, 0.5071),
    ] {
        let reply = at(index);
        assert!((reply.position.z - down_m).abs() < 0.01, "{index}: {reply:?}");
        assert!((reply.velocity.z - down_mps).abs() < 0.01, "{index}: {reply:?}");
        assert!(reply.position.xy().norm() < 0.1, "{index}: {reply:?}");
    }
    let landed = at(11_199);
    assert_eq!((landed.position.z, landed.velocity), (0.0, Vector3::zeros()));
    assert!((landed.accel - Vector3::new(0.0, 0.0, -9.80665)).norm() < 1e-9, "{landed:?}");
    // What the real firmware sent to hover is AirSim's pulse for this height, and for the little
    // that it was still speeding up (g is worth the hover's whole pulse).
    let (from, to) = (5_000, 5_976);
    let pulses: Vec<f64> = recording()[from..to]
        .iter()
        .map(|bytes| (8..16).step_by(2).map(|at| u16_at(bytes, at)).sum::<f64>() / 4.0)
        .collect();
    let mean = pulses.iter().sum::<f64>() / pulses.len() as f64;
    let change_mps = at(from).velocity.z - at(to).velocity.z;
    let acceleration = change_mps / (DT_S * (to - from) as f64);
    let ratio = (1.0 - 6.5e-3 / 288.15 * 195.99_f64).powf(4.255_88);
    let want = 1000.0 + 586.6 / ratio * (1.0 + acceleration / 9.80665);
    assert!((mean - want).abs() < 0.1, "{mean}, not {want}");
}

fn u16_at(bytes: &[u8; 40], at: usize) -> f64 {
    f64::from(u16::from_le_bytes([bytes[at], bytes[at + 1]]))
}

/// An estimator that integrates gyro and accelerometer arrives where the replies say: in flight, in
/// wind, over the touch-down, and on the ground.
#[test]
fn gyro_and_accelerometer_integrate_to_attitude_and_velocity() {
    let gravity = Vector3::new(0.0, 0.0, 9.80665);
    for air in [Vector3::zeros(), Vector3::new(2.0, -3.0, 0.8)] {
        let replies: Vec<Reply> =
            replayed(&recording(), &Uniform(air)).iter().map(|text| read(text)).collect();
        let mut attitude = replies[0].attitude;
        let mut velocity = replies[0].velocity;
        let mut position = replies[0].position;
        let (mut largest_turn, mut moved) = (0.0_f64, 0.0_f64);
        for reply in &replies[1..] {
            let turn = reply.gyro * DT_S;
            let middle = attitude * UnitQuaternion::from_scaled_axis(turn / 2.0);
            attitude *= UnitQuaternion::from_scaled_axis(turn);
            let before = velocity;
            velocity += (middle * reply.accel + gravity) * DT_S;
            position += (before + velocity) * (DT_S / 2.0);
            largest_turn = largest_turn.max(attitude.angle_to(&replies[0].attitude));
            moved = moved.max(velocity.norm());
            let error = attitude.angle_to(&reply.attitude);
            assert!(error < 1e-5, "attitude off by {error} rad at {} s", reply.time_s);
            let error = (velocity - reply.velocity).norm();
            assert!(error < 1e-3, "velocity off by {error} m/s at {} s", reply.time_s);
            let error = (position - reply.position).norm();
            assert!(error < 0.02, "position off by {error} m at {} s", reply.time_s);
        }
        assert!(largest_turn > 0.01 && moved > 0.5, "nothing moved: {largest_turn} {moved}");
    }
}

#[test]
fn instances_do_not_feel_each_other() {
    let packets = &recording()[..4_000];
    let updraft = Uniform(Vector3::new(0.0, 0.0, 1.0));
    let (vehicle, alone) = (vehicle(), replayed(packets, &STILL));
    let lifted = replayed(packets, &updraft);
    let (mut first, mut second) = (instance(&vehicle, &STILL), instance(&vehicle, &updraft));
    for (index, packet) in packets.iter().enumerate() {
        assert_eq!(first.answer(peer(), packet).unwrap(), alone[index]);
        // The second one runs at another pace: it asks everything twice.
        for _ in 0..2 {
            assert_eq!(second.answer(peer(), packet).unwrap(), lifted[index]);
        }
    }
    assert_ne!(alone, lifted);
}

#[test]
fn a_socket_survives_everything_that_is_not_a_packet() {
    let vehicle = vehicle();
    let mut instance = instance(&vehicle, &STILL);
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap();
    let stop = AtomicBool::new(false);
    let mut refusals = Vec::new();
    thread::scope(|scope| {
        let client = scope.spawn(|| {
            let client = UdpSocket::bind("127.0.0.1:0").unwrap();
            client.connect(address).unwrap();
            client.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
            let good = packet(400, 7, [1500; 4]);
            // The size of a long packet with a long packet's head, and one byte more.
            let mut long = vec![0; 73];
            long[..2].copy_from_slice(&29_569_u16.to_le_bytes());
            long[2] = 1;
            for bad in [&b""[..], b"{\"timestamp\":1}", &good[..39], &long, &[0xFF; 9_000]] {
                client.send(bad).unwrap();
            }
            client.send(&good).unwrap();
            let mut buffer = [0; 2000];
            let length = client.recv(&mut buffer).unwrap();
            stop.store(true, Ordering::SeqCst);
            String::from_utf8(buffer[..length].to_vec()).unwrap()
        });
        let stopped = || stop.load(Ordering::SeqCst) || client.is_finished();
        serve(&socket, &mut instance, &stopped, &mut |_, refusal| {
            refusals.extend(refusal.map(|refusal| refusal.to_string()));
        })
        .unwrap();
        assert!((read(&client.join().unwrap()).time_s - DT_S).abs() < 1e-9);
    });
    assert_eq!(instance.status().refused, 5);
    assert_eq!(instance.status().frames, 1);
    insta::assert_snapshot!(refusals.join("\n"));
}
