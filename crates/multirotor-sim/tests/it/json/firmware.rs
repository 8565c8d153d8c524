//! A firmware flies in the physics behind a UDP socket: take-off, hover, climb and descent.
//!
//! The firmware is the simulator's own autopilot, fed from the replies alone. What its pulses must
//! be follows from AirSim's constants (thrust linear in the pulse, quadratic drag, density), not
//! from the code that is tested.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::json::support::{Reply, frame, packet, read};
use multirotor_sim::sim::autopilot::Autopilot;
use multirotor_sim::sim::json::{Instance, InstanceSetup, Status, serve};
use multirotor_sim::sim::sensors::Estimate;
use multirotor_sim::sim::{Atmosphere, Uniform};
use multirotor_sim::vehicle::library::builtin;
use nalgebra::{Matrix3, Vector3};
use skybrush_show::frame::ShowFrame;
use skybrush_show::{Segment, SegmentPath, Trajectory};

const RATE_HZ: u16 = 400;
const HOME_AMSL_M: f64 = 190.0;
/// Show times, s: hover from 20, climb at 2 m/s from 40, hover, descend from 70.
const END_S: f64 = 90.0;

fn trajectory() -> Trajectory {
    let line = |duration_ms, height_m| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, height_m)),
    };
    let hold = |duration_ms| Segment { duration_ms, path: SegmentPath::Hold };
    let segments = vec![
        line(10_000, 20.0),
        hold(30_000),
        line(20_000, 60.0),
        hold(10_000),
        line(20_000, 20.0),
    ];
    Trajectory { start_m: Vector3::zeros(), segments }
}

/// The show frame's estimate that a reply stands for: its own conversion, independent of the
/// simulator's.
fn estimate(reply: &Reply, frame: &ShowFrame) -> Estimate {
    let show = |ned: Vector3<f64>| frame.from_neu(Vector3::new(ned.x, ned.y, -ned.z));
    let rotation = reply.attitude.to_rotation_matrix();
    let axis = |frd: Vector3<f64>| show(rotation * frd);
    let gravity = Vector3::new(0.0, 0.0, 9.80665);
    Estimate {
        position_m: show(reply.position),
        velocity_mps: show(reply.velocity),
        acceleration_mps2: show(rotation * reply.accel + gravity),
        rotation: Matrix3::from_columns(&[
            axis(Vector3::x()),
            axis(-Vector3::y()),
            axis(-Vector3::z()),
        ]),
        rate_radps: Vector3::new(reply.gyro.x, -reply.gyro.y, -reply.gyro.z),
    }
}

/// Time, height, climb and mean pulse of one flight over a socket.
fn fly(address: SocketAddr, place: &ShowFrame) -> Vec<[f64; 4]> {
    let vehicle = builtin("airsim-generic-quad").unwrap();
    let trajectory = trajectory();
    let mut pilot = Autopilot::new(
        &trajectory,
        &vehicle.autopilot,
        Vector3::zeros(),
        HOME_AMSL_M,
        1.0 / f64::from(RATE_HZ),
    )
    .unwrap();
    let start_s = pilot.director.takeoff_s - 5.0;
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.connect(address).unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut buffer = [0; 2000];
    let mut pulses = [1000; 4];
    let mut rows = Vec::new();
    for count in 0.. {
        socket.send(&packet(RATE_HZ, count, pulses)).unwrap();
        let length = socket.recv(&mut buffer).unwrap();
        let reply = read(std::str::from_utf8(&buffer[..length]).unwrap());
        let mean = pulses.map(f64::from).iter().sum::<f64>() / 4.0;
        rows.push([start_s + reply.time_s, -reply.position.z, -reply.velocity.z, mean]);
        if start_s + reply.time_s >= END_S {
            break;
        }
        pulses = pilot.update(start_s + reply.time_s, &estimate(&reply, place));
    }
    rows
}

/// One flight against a served instance in an air.
fn flight(air: &dyn Atmosphere) -> (Vec<[f64; 4]>, Status) {
    let vehicle = builtin("airsim-generic-quad").unwrap();
    let place = frame(HOME_AMSL_M);
    let mut instance = Instance::new(InstanceSetup {
        vehicle: &vehicle,
        home_m: Vector3::zeros(),
        frame: place,
        atmosphere: air,
        seed: 1,
        drone: 1,
    });
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap();
    let stop = AtomicBool::new(false);
    let rows = thread::scope(|scope| {
        let pilot = scope.spawn(|| {
            let rows = fly(address, &place);
            stop.store(true, Ordering::SeqCst);
            rows
        });
        let stopped = || stop.load(Ordering::SeqCst) || pilot.is_finished();
        serve(&socket, &mut instance, &stopped, &mut |_, refusal| assert_eq!(refusal, None))
            .unwrap();
        pilot.join().unwrap()
    });
    (rows, *instance.status())
}

/// Means of height, climb and pulse over a window.
fn window(rows: &[[f64; 4]], from_s: f64, to_s: f64) -> [f64; 3] {
    let inside: Vec<_> = rows.iter().filter(|row| row[0] >= from_s && row[0] < to_s).collect();
    [1, 2, 3].map(|column| inside.iter().map(|row| row[column]).sum::<f64>() / inside.len() as f64)
}

/// AirSim's law at a height and a vertical speed relative to the air, us; density by ICAO's formula.
fn law_us(height_m: f64, air_up_mps: f64) -> f64 {
    let ratio = (1.0 - 6.5e-3 / 288.15 * (HOME_AMSL_M + height_m)).powf(4.255_88);
    let drag = if air_up_mps.abs() > 0.1 { 8.0552 * air_up_mps * air_up_mps.abs() } else { 0.0 };
    1000.0 + 586.600 / ratio + drag
}

#[test]
fn a_firmware_hovers_and_climbs_by_airsims_law() {
    let (rows, status) = flight(&Uniform(Vector3::zeros()));
    assert_eq!((status.starts, status.repeated, status.skipped, status.refused), (1, 0, 0, 0));
    for (from_s, to_s, climb_mps) in [(28.0, 39.0, 0.0), (50.0, 59.0, 2.0), (80.0, 89.0, -2.0)] {
        let [height_m, got_mps, pulse_us] = window(&rows, from_s, to_s);
        assert!((got_mps - climb_mps).abs() < 0.02, "{climb_mps} m/s: {got_mps}");
        let want_us = law_us(height_m, got_mps);
        assert!((pulse_us - want_us).abs() < 0.25, "{climb_mps} m/s: {pulse_us}, not {want_us}");
    }
    // Table I of the paper is for hovering near 200 m above sea level: u0 = 1598.6.
    let [height_m, _, pulse_us] = window(&rows, 28.0, 39.0);
    assert!((height_m - 20.0).abs() < 0.05, "{height_m}");
    assert!((pulse_us - 1598.6).abs() < 0.5, "{pulse_us}");
}

#[test]
fn an_updraft_is_felt_as_sinking_through_the_air() {
    let (rows, _) = flight(&Uniform(Vector3::new(1.0, -2.0, 1.5)));
    let [height_m, climb_mps, pulse_us] = window(&rows, 28.0, 39.0);
    assert!(climb_mps.abs() < 0.02, "{climb_mps}");
    let want_us = law_us(height_m, climb_mps - 1.5);
    assert!((pulse_us - want_us).abs() < 0.5, "{pulse_us}, not {want_us}");
}
