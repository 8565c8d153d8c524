//! `updraft physics` as a user starts it: two instances on ports of the system's choice.

#[path = "../../../crates/multirotor-sim/tests/it/json/support.rs"]
mod packets;

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::UdpSocket;
use std::process::{Command, Stdio};
use std::time::Duration;

use packets::{packet, read};
use updraft::sim::air::truth::{HEADER, read as read_truth};
use updraft::vehicle::library::builtin;

use super::support::Bench;

fn updraft() -> Command {
    Command::new(env!("CARGO_BIN_EXE_updraft"))
}

#[test]
fn serves_every_instance_on_its_own_port_until_the_duration_is_flown() {
    let mut child = updraft()
        .args(["physics", "--listen", "127.0.0.1:0", "--instances", "2", "--json"])
        .args(["--home", "47.4733,19.0621,190,59", "--duration", "0.5", "--status", "0"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut clients = Vec::new();
    for index in 0..2 {
        let line = lines.next().unwrap().unwrap();
        assert!(line.contains(&format!("-I{index} --home=47.4733000,19.0621000,190,59")), "{line}");
        let address = line.split(' ').nth(3).unwrap().trim_end_matches(':');
        let client = UdpSocket::bind("127.0.0.1:0").unwrap();
        client.connect(address).unwrap();
        client.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        clients.push(client);
    }
    let mut buffer = [0; 2000];
    for count in 0..200 {
        for (client, pulse) in clients.iter().zip([1700, 1000]) {
            client.send(&packet(400, count, [pulse; 4])).unwrap();
            let length = client.recv(&mut buffer).unwrap();
            let reply = read(std::str::from_utf8(&buffer[..length]).unwrap());
            assert!((reply.time_s - f64::from(count + 1) * 0.0025).abs() < 1e-8, "{reply:?}");
        }
    }
    let mut json = String::new();
    child.stdout.take().unwrap().read_to_string(&mut json).unwrap();
    assert!(child.wait().unwrap().success());
    let output: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(output["schema"], "updraft.physics/1");
    let of = |index: usize, key: &str| output["instances"][index][key].as_f64().unwrap();
    assert_eq!((of(0, "frames"), of(1, "frames")), (200.0, 200.0));
    assert!(of(0, "height_m") > 0.1 && of(1, "height_m") == 0.0, "{json}");
}

/// Frames per second of [`fly`]: long ones, as each waits for its reply.
const RATE_HZ: u16 = 100;

/// Flies one instance with the same pulse in every frame. Returns the replies and the summary.
fn fly(bench: &Bench, more: &[&str], frames: u32, pulse: u16) -> (Vec<String>, serde_json::Value) {
    // Half a frame less: the sum of frames is not exact.
    let duration = ((f64::from(frames) - 0.5) / f64::from(RATE_HZ)).to_string();
    let mut child = bench
        .command(&["physics", "--listen", "127.0.0.1:0", "--json", "--status", "0"])
        .args(["--duration", &duration])
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let line = lines.next().unwrap().unwrap();
    let address = line.split(' ').nth(3).unwrap().trim_end_matches(':').to_owned();
    let client = UdpSocket::bind("127.0.0.1:0").unwrap();
    client.connect(address).unwrap();
    client.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    let mut buffer = [0; 2000];
    let replies = (0..frames).map(|count| {
        client.send(&packet(RATE_HZ, count, [pulse; 4])).unwrap();
        let length = client.recv(&mut buffer).unwrap();
        String::from_utf8(buffer[..length].to_vec()).unwrap()
    });
    let replies: Vec<String> = replies.collect();
    let mut json = String::new();
    child.stdout.take().unwrap().read_to_string(&mut json).unwrap();
    assert!(child.wait().unwrap().success());
    (replies, serde_json::from_str(&json).unwrap())
}

/// The body's drag is what the specific force of the same pulse at the same speed lacks.
#[test]
fn an_effect_acts_on_the_body_that_the_firmware_flies() {
    const AREA_M2: f64 = 0.1;
    let bench = Bench::new();
    let home = ["--home", "47.4733,19.0621,190,59"];
    let drag = format!("parasitic-drag.vertical_m2={AREA_M2}");
    let (bare, _) = fly(&bench, &home, 250, 1950);
    let (held, _) = fly(&bench, &[&home[..], &["--effect", &drag]].concat(), 250, 1950);
    // The specific force is the mean of a frame, as is the mean of the speeds at its ends.
    let motion = |replies: &[String]| -> Vec<(f64, f64)> {
        let replies: Vec<_> = replies.iter().map(|text| read(text)).collect();
        let of = |pair: &[packets::Reply]| {
            (-f64::midpoint(pair[0].velocity.z, pair[1].velocity.z), -pair[1].accel.z)
        };
        replies.windows(2).map(of).collect()
    };
    let (bare, held) = (motion(&bare), motion(&held));
    let density = 1.225 * (1.0 - 0.0065 * 200.0 / 288.15_f64).powf(4.2559);
    let mass_kg = builtin("airsim-generic-quad").unwrap().airframe.mass_kg;
    for climb_mps in [1.5, 3.0, 4.5] {
        let force_at = |motion: &[(f64, f64)]| {
            let place = motion.iter().position(|(climb, _)| *climb >= climb_mps).unwrap();
            let [(below, before), (above, after)] = [motion[place - 1], motion[place]];
            before + (after - before) * (climb_mps - below) / (above - below)
        };
        let found = force_at(&bare) - force_at(&held);
        let wanted = 0.5 * density * AREA_M2 * climb_mps * climb_mps / mass_kg;
        assert!((found / wanted - 1.0).abs() < 0.05, "{climb_mps}: {found} for {wanted}");
    }
    // Switched off again it is as without.
    let (off, _) =
        fly(&bench, &[&home[..], &["--effect", "parasitic-drag=off"]].concat(), 50, 1950);
    assert_eq!(motion(&off), bare[..49]);
}

#[test]
fn the_truth_is_what_the_body_met_and_the_same_packets_give_the_same_bytes() {
    let bench = Bench::new();
    bench.expect(0, &["plan", "calibration", "--grid", "1x2", "-o", "campaign"]);
    let args = ["--updraft", "1.5", "--wind", "4", "--effect", "turbulence", "--truth"];
    let alone = fly(&bench, &args, 301, 1700);
    let path = bench.path("physics-truth/01.csv");
    assert_eq!(alone.1["instances"][0]["truth"], "physics-truth/01.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|value| value.parse().unwrap()).collect())
        .collect();
    assert_eq!(text.lines().next().unwrap(), HEADER);
    assert_eq!(rows.len(), 4, "{text}");
    for (second, row) in rows.iter().enumerate() {
        // The frame that ends then has the place at which the next begins.
        let height_m = match second {
            0 => 0.0,
            _ => -read(&alone.0[second * 100 - 1]).position.z,
        };
        assert!((row[3] - height_m).abs() < 0.002, "{second}: {row:?}");
        assert_eq!((row[0], &row[4..]), (second as f64, &[4.0, 0.0, 1.5, 1.5][..]));
    }
    assert_eq!(read_truth(&path).unwrap().updraft_mps, [1.5; 4]);
    let again = fly(&bench, &args, 301, 1700);
    assert!(again.0 == alone.0 && std::fs::read_to_string(&path).unwrap() == text);

    // With a campaign it lies in the flight's folder, apart from the truth of `simulate`.
    let args = ["--campaign", "campaign", "--instances", "1", "--truth", "--air", "still"];
    let (_, output) = fly(&bench, &args, 40, 1000);
    assert_eq!(output["instances"][0]["truth"], "campaign/physics-truth/01.csv");
    assert!(bench.path("campaign/physics-truth/01.csv").is_file());
    assert!(!bench.path("campaign/truth").exists());
    let (_, output) = fly(&bench, &["--air", "still"], 4, 1000);
    assert!(output["instances"][0].get("truth").is_none(), "{output}");
}

#[test]
fn effects_that_cannot_act_are_refused() {
    let bench = Bench::new();
    for (choice, words) in [
        ("rotor-inflw", "did you mean rotor-inflow?"),
        ("battery.initial_charge=3", "it must be 0 to 1"),
        ("battery.volts=3", "no parameter \"volts\""),
        (
            "velocity-error",
            "an error of the autopilot's sensors, and the firmware simulates its own",
        ),
    ] {
        // Who accepts it does not wait for a firmware.
        let at = ["physics", "--listen", "127.0.0.1:0", "--duration", "0", "--effect", choice];
        let ended = bench.expect(2, &at);
        assert!(ended.err.contains(words) && ended.out.is_empty(), "{choice}: {ended}");
    }
}

#[test]
fn a_port_in_use_and_a_wrong_home_are_said() {
    let taken = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap().to_string();
    let output = updraft().args(["physics", "--listen", &address]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains(&address) && said.contains("another simulator"), "{said}");

    let output = updraft().args(["physics", "--home", "47,19"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    let output = updraft().args(["physics", "--instances", "0"]).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
}
