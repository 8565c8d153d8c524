//! `updraft physics` as a user starts it: two instances on ports of the system's choice.

#[path = "../../../crates/multirotor-sim/tests/it/json/support.rs"]
mod packets;

use std::io::{BufRead as _, BufReader, Read as _};
use std::net::UdpSocket;
use std::process::{Command, Stdio};
use std::time::Duration;

use packets::{packet, read};

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
