//! `logs pull` from fleets that are not all there, or not clear.

use std::fs;
use std::time::Duration;

use crate::cli::fleet::free_port;
use crate::cli::guided::Flight;
use crate::cli::support::Bench;

impl Bench {
    /// A flown flight, and a campaign of the same plan without logs.
    fn flown(&self) {
        self.planned("2x2", "drones");
        self.planned("2x2", "home");
        self.expect(0, &["simulate", "drones"]);
    }

    fn is_home(&self, slot: u16) -> bool {
        let read = |folder: &str| fs::read(self.path(&format!("{folder}/{slot:02}.BIN")));
        read("home/logs").is_ok_and(|bytes| bytes == read("drones/simulated").unwrap())
    }
}

#[test]
fn one_drone_that_is_off_keeps_nobody_elses_log_away() {
    let bench = Bench::with_shared_clock();
    bench.flown();
    let station = free_port();
    let link = format!("udpin:{station}");
    let _fleet = bench.fleet(&station, &["--flown", "--gone", "3"]);
    // Nobody has said who flies what: where they stand tells.
    let pull = ["logs", "pull", "home", "--connect", &link, "--wait", "8"];
    let two = bench.expect(0, &[&pull[..], &["--slots", "1,2"]].concat());
    assert!(two.err.contains("Downloaded 2 of 2 logs"), "{two}");
    let ended = bench.expect(3, &pull);
    for line in [
        "waiting for a drone on slot 3",
        "no log of slot 3: no drone is known to stand on it",
        "Downloaded 3 of 3 logs",
        &format!(
            "To try again: updraft logs pull home --flight calibration --connect {link} --slots 3"
        ),
    ] {
        assert!(ended.err.contains(line), "{line}\n{ended}");
    }
    assert_eq!([1, 2, 3, 4].map(|slot| bench.is_home(slot)), [true, true, false, true]);
    assert!(!bench.path("home/fleet.json").exists(), "half a table is not written");
    let listed = bench.expect(3, &["logs", "list", "home", "--connect", &link, "--wait", "4"]);
    assert!(listed.out.contains("slot    3  no drone is known to stand on it"), "{listed}");

    // What was damaged at home comes again.
    fs::write(bench.path("home/logs/01.BIN"), b"damaged").unwrap();
    bench.expect(0, &[&pull[..], &["--slots", "1"]].concat());
    assert!(bench.is_home(1) && bench.path("home/logs/older/01-damaged-1.BIN").exists());
}

#[test]
fn a_drone_that_is_switched_on_late_is_joined() {
    let bench = Bench::with_shared_clock();
    bench.flown();
    let drones: Vec<_> = (1..=4)
        .map(|slot| serde_json::json!({ "slot": slot, "drone": { "network": 0, "system": slot } }))
        .collect();
    let table = serde_json::json!({ "schema": "updraft.fleet/1", "drones": drones });
    fs::write(bench.path("home/fleet.json"), table.to_string()).unwrap();
    let station = free_port();
    let link = format!("udpin:{station}");
    let _fleet = bench.fleet(&station, &["--flown", "--gone", "3"]);
    let pull = ["logs", "pull", "home", "--connect", &link, "--wait", "60"];
    let mut pull = Flight::of(&bench, &pull);
    // The others do not wait for it.
    let came = || [1, 2, 4].iter().all(|slot| bench.is_home(*slot)).then_some(());
    assert!(bench.wait_for(30, came).is_some(), "the logs of those that are on do not come");
    bench.clock().pause(Duration::from_secs(3));
    let _late = bench.fleet(&station, &["--flown", "--gone", "1,2,4"]);
    assert_eq!(pull.end(), Some(0), "{}", pull.said());
    let said = pull.said();
    assert!(said.contains("waiting for drone 3 (slot 3)"), "{said}");
    assert!(!said.contains("waiting for drone 1"), "{said}");
    assert!(bench.is_home(3));
}

#[test]
fn two_drones_on_one_slot_are_refused_by_name_and_the_others_are_not() {
    let bench = Bench::with_shared_clock();
    bench.planned("2x2", "campaign");
    let mut drones = bench.drones();
    drones.setups[1].stands_m = drones.setups[0].stands_m;
    drones.setups[1].stands_m.x += 0.3;
    let station = free_port();
    let link = format!("udpin:{station}");
    let pull = ["logs", "pull", "campaign", "--connect", &link, "--wait", "6"];
    let ended = drones.fly(station.parse().unwrap(), || bench.expect(3, &pull), |_| {});
    for line in [
        "no log of slot 1: drones 1 and 2 both stand on slot 1: move one of them",
        "no log of slot 2: no drone is known to stand on it",
        "no log of drone 3 (slot 3): the drone has no logs",
        "no log of drone 4 (slot 4): the drone has no logs",
        "--slots 1,2,3,4",
    ] {
        assert!(ended.err.contains(line), "{line}\n{ended}");
    }
}
