//! A fleet of real processes and real sockets: a bad link, killed programs, and what is refused.

#![cfg(unix)]

use std::fs;
use std::net::UdpSocket;
use std::process::{Child, Stdio};

use crate::cli::support::{Bench, Ended, SHORT};

/// Virtual drones, switched off at the end.
pub(crate) struct Fleet(Child);

impl Drop for Fleet {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

pub(crate) fn free_port() -> String {
    crate::ports::free_port().to_string()
}

impl Bench {
    pub(crate) fn planned(&self, grid: &str, folder: &str) {
        let plan = ["plan", "calibration", "--grid", grid, "-o", folder];
        self.expect(0, &[&plan[..], SHORT].concat());
    }

    /// Virtual drones of the folder `drones`.
    pub(crate) fn fleet(&self, station: &str, more: &[&str]) -> Fleet {
        let args = ["fleet", "virtual", "drones", "--station", station];
        // Other tests have fleets at the same time.
        let args = [&args[..], &["--broadcast-port", "0"]].concat();
        let mut command = self.command(&[&args[..], more].concat());
        Fleet(self.start(command.stdout(Stdio::null()).stderr(Stdio::null())))
    }

    /// Pulls until a drone's unfinished log has grown, and is killed then.
    fn killed_pull(&self, args: &[&str]) -> u64 {
        let before = self.bytes_at_home();
        let mut pull = self.command(args);
        let mut pull = self.start(pull.stdout(Stdio::null()).stderr(Stdio::null()));
        let came = self.wait_for(60, || {
            assert!(pull.try_wait().unwrap().is_none(), "it ended before it was killed");
            (self.bytes_at_home() >= before + 100_000).then_some(())
        });
        assert!(came.is_some(), "nothing came");
        pull.kill().unwrap();
        assert_eq!(pull.wait().unwrap().code(), None, "killed, not ended");
        self.bytes_at_home()
    }

    fn bytes_at_home(&self) -> u64 {
        let Ok(entries) = fs::read_dir(self.path("home/logs")) else { return 0 };
        entries.filter_map(|entry| Some(entry.ok()?.metadata().ok()?.len())).sum()
    }
}

/// Every log but that of drone 3 comes home over a bad link, whatever befalls.
fn every_log_comes_home(grid: &str, count: u16, rate: &str, after: &str) {
    let bench = Bench::with_shared_clock();
    bench.planned(grid, "drones");
    bench.planned(grid, "home");
    bench.expect(0, &["simulate", "drones"]);
    let drones: Vec<_> = (1..=count)
        .map(|slot| serde_json::json!({ "slot": slot, "drone": { "network": 0, "system": slot } }))
        .collect();
    let table = serde_json::json!({ "schema": "updraft.fleet/1", "drones": drones });
    fs::write(bench.path("home/fleet.json"), table.to_string()).unwrap();
    let station = free_port();
    let link = format!("udpin:{station}");
    let faults = ["--flown", "--loss", "0.2", "--delay", "200", "--jitter", "50", "--repeat"];
    let more = ["0.02", "--rate", rate, "--gone", "3", "--reboot", "1,2", "--after", after];
    let _fleet = bench.fleet(&station, &[&faults[..], &more].concat());

    let pull = ["logs", "pull", "home", "--connect", &link, "--wait", "10", "--patience", "20"];
    let first = bench.killed_pull(&pull);
    let second = bench.killed_pull(&pull);
    assert!(second > first, "the second goes on where the first was killed");
    let ended = bench.expect(3, &pull);
    assert!(ended.err.contains("no log of drone 3 (slot 3): "), "{ended}");
    let again = format!(
        "To try again: updraft logs pull home --flight calibration --connect {link} --slots 3"
    );
    assert!(ended.err.contains(&again), "{ended}");
    for slot in 1..=count {
        let name = format!("{slot:02}.BIN");
        let has = fs::read(bench.path("drones/simulated").join(&name)).unwrap();
        match fs::read(bench.path("home/logs").join(&name)) {
            Ok(came) => assert!(slot != 3 && came == has, "log {slot} is another"),
            Err(_) => assert_eq!(slot, 3, "log {slot} is missing\n{ended}"),
        }
    }
    bench.expect(0, &["logs", "verify", "home"]);
}

#[test]
fn every_log_comes_home_over_a_bad_link() {
    every_log_comes_home("2x3", 6, "400000", "6");
}

#[test]
#[ignore = "takes minutes: cargo test --release --test it -- --ignored fleet::every_log_of_49"]
fn every_log_of_49_comes_home_over_a_bad_link() {
    every_log_comes_home("7x7", 49, "2000000", "12");
}

#[test]
fn virtual_drones_fly_as_simulated() {
    let bench = Bench::new();
    bench.planned("2x2", "campaign");
    bench.planned("2x2", "other");
    bench.expect(0, &["fly", "campaign", "--connect", "sim", "--yes"]);
    bench.expect(0, &["simulate", "other"]);
    for slot in 1..=4 {
        let read = |folder: &str| {
            fs::read(bench.path(folder).join(format!("simulated/{slot:02}.BIN"))).unwrap()
        };
        assert!(read("campaign") == read("other"), "log {slot}");
    }
    let manifest = fs::read(bench.path("campaign/simulated/manifest.json")).unwrap();
    let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
    assert_eq!(manifest["schema"], "updraft.logs/1");
    assert_eq!(manifest["logs"].as_array().unwrap().len(), 4);
    bench.expect(0, &["logs", "verify", "campaign"]);
}

/// What standard error says, without the port.
fn said(ended: &Ended, station: &str) -> String {
    ended.err.replace(station, "HOST:PORT")
}

#[test]
fn what_cannot_be_is_refused() {
    let bench = Bench::new();
    bench.planned("1x2", "campaign");
    let station = free_port();
    let link = format!("udpin:{station}");
    let mut all = String::new();
    let mut refused = |code: i32, args: &[&str]| {
        let ended = bench.expect(code, args);
        all.push_str(&said(&ended, &station));
        all.push('\n');
    };
    refused(5, &["fleet", "status", "campaign", "--connect", &link, "--wait", "0.5"]);
    refused(2, &["fleet", "status", "campaign", "--connect", "carrier-pigeon"]);
    refused(2, &["fleet", "status", "campaign", "--connect", "udpin:127.0.0.1:x"]);
    refused(2, &["fleet", "status", "campaign", "--connect", "sim"]);
    refused(2, &["logs", "pull", "campaign", "--connect", "sim"]);
    fs::write(bench.path("bad.key"), b"").unwrap();
    let key = ["--connect", &link, "--key", "bad.key"];
    refused(2, &[&["fleet", "status", "campaign"][..], &key].concat());
    refused(2, &["fleet", "virtual", "campaign", "--gone", "7"]);
    refused(2, &["fleet", "virtual", "campaign", "--truth"]);
    refused(5, &["fleet", "virtual", "campaign", "--flown"]);
    let taken = UdpSocket::bind(("0.0.0.0", 0)).unwrap();
    let port = taken.local_addr().unwrap().port().to_string();
    let asked = bench.expect(1, &["fleet", "virtual", "campaign", "--broadcast-port", &port]);
    all.push_str(&said(&asked, &station).replace(&port, "BROADCAST"));
    insta::assert_snapshot!(all);
}

#[test]
fn a_dry_run_sends_nothing_and_needs_nobody() {
    let bench = Bench::new();
    bench.planned("1x2", "campaign");
    let link = format!("udpin:{}", free_port());
    let steps: [&[&str]; 7] = [
        &["fleet", "status"],
        &["fleet", "upload", "--set-params"],
        &["fleet", "preflight", "--set-params"],
        &["fleet", "start", "--yes"],
        &["fleet", "abort"],
        &["fleet", "land"],
        &["fly", "--yes", "--set-params"],
    ];
    for step in steps {
        let args = [step, &["campaign", "--dry-run", "--connect", &link, "--wait", "0"]].concat();
        let ended = bench.expect(0, &args);
        assert!(ended.out.contains("to drone 2, if all goes well:"), "{ended}");
        assert!(ended.err.contains("Nothing was sent"), "{ended}");
        let json = bench.expect(0, &[&args[..], &["--json"]].concat()).json("updraft.dry-run/1");
        assert_eq!(json["drones"].as_object().unwrap().len(), 2, "{step:?}");
    }
    let args = ["fleet", "restore", "campaign", "--dry-run", "--connect", &link, "--wait", "0"];
    assert!(bench.expect(0, &args).out.is_empty(), "nothing was changed before");
    assert!(!bench.path("campaign/fleet.json").exists(), "nothing is written");
}
