//! What a crew sees when something is not as it must be, and that the drones are left alone then.

use std::fs;

use nalgebra::Vector3;
use updraft::link::signing::Key;
use updraft::virtual_fleet::vehicle::VirtualVehicle;

use crate::cli::fleet::free_port;
use crate::cli::support::{Bench, Ended};
use crate::fleet::loaded::{assert_cleared, assert_loaded};

/// Standard error without the port.
fn said(ended: &Ended, station: &str) -> String {
    ended.err.replace(station, "HOST:PORT")
}

/// Nothing was loaded, and no start is set.
fn assert_untouched(vehicles: &[VirtualVehicle<'_>]) {
    for vehicle in vehicles {
        assert_cleared(vehicle);
        assert_not_started(vehicle);
        assert!(vehicle.fence_1e7().is_empty(), "it has a fence");
    }
}

fn assert_not_started(vehicle: &VirtualVehicle<'_>) {
    assert_eq!(vehicle.params.get("SHOW_START_AUTH"), 0.0);
    assert_eq!(vehicle.params.get("SHOW_START_TIME"), -1.0);
    assert!(vehicle.flown.is_empty() && !vehicle.is_armed());
}

#[test]
fn drones_on_wrong_and_doubled_slots_are_shown_and_nothing_is_sent() {
    let bench = Bench::with_shared_clock();
    bench.planned("2x2", "campaign");
    let mut drones = bench.drones();
    // Drone 2 stands beside drone 1; drone 4 is off its place, but near enough.
    drones.setups[1].stands_m = drones.setups[0].stands_m + Vector3::new(0.6, 0.3, 0.0);
    drones.setups[3].stands_m += Vector3::new(2.0, 1.0, 0.0);
    let station = free_port();
    let link = format!("udpin:{station}");
    let step = |command: &'static str| [command, "campaign", "--connect", &link, "--wait", "20"];
    let all = drones.fly(
        station.parse().unwrap(),
        || {
            let upload = bench.expect(4, &[&["fleet"][..], &step("upload")[..]].concat());
            let fly = bench.expect(4, &[&step("fly")[..], &["--yes"]].concat());
            // With a table that does not fit how they stand.
            let line = |slot: u16, system: u8| {
                serde_json::json!({ "slot": slot, "drone": { "network": 0, "system": system } })
            };
            let lines = [line(1, 1), line(2, 2), line(3, 3), line(4, 4)];
            let table = serde_json::json!({ "schema": "updraft.fleet/1", "drones": lines });
            fs::write(bench.path("campaign/fleet.json"), table.to_string()).unwrap();
            let table = bench.expect(4, &[&["fleet"][..], &step("upload")[..]].concat());
            [upload, fly, table].map(|ended| said(&ended, &station)).join("\n----\n")
        },
        assert_untouched,
    );
    insta::assert_snapshot!(all);
}

#[test]
fn a_fleet_that_is_not_loaded_is_no_go() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let drones = bench.drones();
    let station = free_port();
    let link = format!("udpin:{station}");
    let no_go = drones.fly(
        station.parse().unwrap(),
        || {
            let step = ["campaign", "--connect", &link, "--wait", "5"];
            let table = bench.expect(4, &[&["fleet", "preflight"][..], &step[..]].concat());
            let start = bench.expect(4, &[&["fleet", "start", "--yes"][..], &step[..]].concat());
            let lines = |ended: &Ended| -> Vec<String> {
                let lines = ended.out.lines().filter(|line| line.starts_with("NO-GO"));
                lines.map(str::to_owned).collect()
            };
            assert_eq!(lines(&table), lines(&start));
            let json = [&["fleet", "preflight", "--json"][..], &step[..]].concat();
            let json = bench.expect(4, &json).json("updraft.preflight/1");
            assert_eq!(json["go"], false);
            format!("{}\n{}", lines(&table).join("\n"), table.err)
        },
        assert_untouched,
    );
    insta::assert_snapshot!(no_go);
}

#[test]
fn nobody_starts_a_fleet_without_a_person_or_yes() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let drones = bench.drones();
    let station = free_port();
    let link = format!("udpin:{station}");
    let err = drones.fly(
        station.parse().unwrap(),
        || {
            let step = ["campaign", "--connect", &link, "--wait", "20", "--set-params"];
            bench.expect(0, &[&["fleet", "upload"][..], &step[..]].concat());
            // Standard input is no terminal.
            bench.expect(2, &[&["fleet", "start"][..], &step[..]].concat()).err
        },
        |vehicles| {
            for (slot, vehicle) in (1..).zip(vehicles) {
                assert_loaded(vehicle, &drones.load(slot));
                assert_not_started(vehicle);
            }
        },
    );
    insta::assert_snapshot!(err);
}

fn for_its_owner(key: &std::path::Path) {
    use std::os::unix::fs::PermissionsExt as _;
    fs::set_permissions(key, fs::Permissions::from_mode(0o600)).unwrap();
}

#[test]
fn a_key_that_others_can_read_is_warned_of_and_used() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let key = bench.path("our.key");
    fs::write(&key, "a passphrase of the crew").unwrap();
    let link = format!("udpin:{}", free_port());
    let step =
        ["fleet", "status", "campaign", "--connect", &link, "--key", "our.key", "--wait", "0"];
    fs::set_permissions(&key, std::os::unix::fs::PermissionsExt::from_mode(0o644)).unwrap();
    let open = bench.run(&step);
    assert!(open.err.contains("can be read or changed by others"), "{open}");
    assert!(open.err.contains("chmod 600 our.key"), "{open}");
    assert!(bench.path("our.key.stamps").is_file(), "{open}");
    for_its_owner(&key);
    let closed = bench.run(&step);
    assert_eq!(closed.code, open.code);
    assert!(!closed.err.contains("others"), "{closed}");
    // What cannot be understood is not thrown away.
    fs::write(bench.path("our.key.stamps"), "{").unwrap();
    let broken = bench.expect(1, &step);
    assert!(broken.err.contains("our.key.stamps"), "{broken}");
}

#[test]
fn a_station_with_a_key_refuses_what_is_not_signed_and_says_so() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    fs::write(bench.path("our.key"), "a passphrase of the crew").unwrap();
    for_its_owner(&bench.path("our.key"));
    let mut all = String::new();
    for key in [None, Some(Key::from_bytes([7; 32]))] {
        let mut drones = bench.drones();
        drones.key = key;
        let station = free_port();
        let link = format!("udpin:{station}");
        let ended = drones.fly(
            station.parse().unwrap(),
            || {
                let step = ["campaign", "--connect", &link, "--key", "our.key", "--wait", "3"];
                bench.expect(5, &[&["fleet", "upload"][..], &step[..]].concat())
            },
            assert_untouched,
        );
        // How many frames came depends on the clock on the wall.
        let counted = ended
            .err
            .split_whitespace()
            .map(|word| if word.bytes().all(|byte| byte.is_ascii_digit()) { "N" } else { word });
        all.push_str(&counted.collect::<Vec<_>>().join(" "));
        all.push('\n');
        let journal = fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap();
        let last = journal.lines().last().unwrap();
        assert!(last.contains("\"step\":\"link\"") && last.contains("refused"), "{last}");
    }
    insta::assert_snapshot!(all);
}

#[test]
fn a_station_without_the_drones_key_is_told_to_give_it() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let mut drones = bench.drones();
    drones.key = Some(Key::from_bytes([7; 32]));
    let station = free_port();
    let link = format!("udpin:{station}");
    let step = ["campaign", "--connect", &link, "--wait", "20"];
    let steps = || {
        let status = bench.expect(0, &[&["fleet", "status"], &step[..]].concat());
        // Who is asked in vain says nothing: the reason is known all the same.
        let list = bench.expect(3, &[&["logs", "list"], &step[..]].concat());
        [status, list]
    };
    for ended in drones.fly(station.parse().unwrap(), steps, assert_untouched) {
        assert!(ended.err.contains("the drones' frames are signed: give --key"), "{ended}");
    }
}

#[test]
fn two_drones_with_one_system_id_are_reported() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let mut drones = bench.drones();
    drones.setups[1].system = 1;
    let station = free_port();
    let link = format!("udpin:{station}");
    let err = drones.fly(
        station.parse().unwrap(),
        || {
            let step = ["campaign", "--connect", &link, "--wait", "4"];
            let status = bench.expect(0, &[&["fleet", "status", "--json"][..], &step[..]].concat());
            let json = status.json("updraft.fleet-status/1");
            assert_eq!(json["drones"].as_array().unwrap().len(), 1);
            assert_eq!(json["drones"][0]["doubled"], true);
            assert!(json["networks"][0]["frames_in"].as_u64().unwrap() > 10);
            // The other one's slot is empty, whichever of them spoke first: nothing is sent.
            let upload = bench.expect(4, &[&["fleet", "upload"][..], &step[..]].concat());
            let empty = |slot: u8| upload.err.contains(&format!("slot {slot} has no drone"));
            assert!(
                empty(1) != empty(2) && upload.err.contains("nothing was sent"),
                "{}",
                upload.err
            );
            status.err
        },
        assert_untouched,
    );
    insta::assert_snapshot!(err);
}

#[test]
fn the_fence_stays_on_unless_somebody_says_otherwise() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let mut drones = bench.drones();
    let station = free_port();
    let link = format!("udpin:{station}");
    let step = ["campaign", "--connect", &link, "--wait", "20"];
    let changes = || fs::read_to_string(bench.path("campaign/fleet-changes.json")).unwrap();
    let restored = |more: &[&'static str]| {
        bench.expect(0, &[&["fleet", "restore"][..], &step[..], more].concat()).err
    };
    let seen = drones.fly(
        station.parse().unwrap(),
        || {
            bench.expect(0, &[&["fleet", "upload"][..], &step[..]].concat());
            let uploaded = changes();
            let again = bench.expect(0, &[&["fleet", "upload"][..], &step[..]].concat());
            assert_eq!(changes(), uploaded, "the first old values count\n{again}");
            let kept = restored(&[]);
            format!("{uploaded}\n----\n{kept}\n{}", changes())
        },
        |vehicles| {
            for vehicle in vehicles {
                assert_eq!(vehicle.params.get("FENCE_ENABLE"), 1.0);
                assert_eq!(vehicle.params.get("FENCE_ALT_MAX"), 100.0, "as it was");
            }
        },
    );
    insta::assert_snapshot!(seen);
    // Another day, with the fence as it was left: it is put back when it is said.
    drones.params.push(("FENCE_ENABLE", 1.0));
    drones.fly(
        station.parse().unwrap(),
        || {
            let shown = restored(&["--fence-off", "--dry-run"]);
            assert!(shown.contains("Nothing was sent"), "{shown}");
            let err = restored(&["--fence-off"]);
            assert!(!err.contains("the fence stays on"), "{err}");
            assert!(!changes().contains("FENCE"), "{}", changes());
        },
        |vehicles| {
            for vehicle in vehicles {
                assert_eq!(vehicle.params.get("FENCE_ENABLE"), 0.0);
            }
        },
    );
}
