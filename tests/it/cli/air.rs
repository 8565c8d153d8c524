//! Drones in the air, and a station that is interrupted, dies, is replaced, or knows nothing of
//! them: real processes and real signals.

#![cfg(unix)]

use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use updraft::fleet::messages::param_set;
use updraft::link::address::links;
use updraft::link::clock::{Micros, S};
use updraft::link::net::Net as _;
use updraft::link::station::{Setup, Station};

use crate::cli::fleet::free_port;
use crate::cli::guided::{Flight, flown, modes, stage};
use crate::cli::support::Bench;
use crate::cli::terminal::on_a_terminal;

/// A flight of some minutes.
const LONG: &[&str] = &["--speeds", "1,2", "--leg", "12", "--hover", "60", "--baseline", "20"];

fn shown<'a>(link: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let args = ["fly", "campaign", "--connect", link, "--set-params", "--yes", "--wait", "20"];
    let lead = if more.contains(&"--lead") { &[][..] } else { &["--lead", "25"] };
    [&args[..], lead, more].concat()
}

fn step<'a>(words: &[&'a str], link: &'a str) -> Vec<&'a str> {
    [words, &["campaign", "--connect", link, "--wait", "10"]].concat()
}

/// Flies until the drones are in the air.
fn in_the_air<'a>(bench: &'a Bench, link: &str, more: &[&str]) -> Flight<'a> {
    let mut flight = Flight::of(bench, &shown(link, more));
    flight.hear("drone 1: performing");
    flight.hear("drone 2: performing");
    flight
}

/// Sets parameters as another station would, that knows nothing of gates.
fn put(bench: &Bench, station: &str, params: &[(&str, f32)]) {
    let clock = bench.clock();
    let links = links(&format!("udpin:{station}")).unwrap();
    let mut net = Station::open(Setup { links, key: None, clock }).unwrap();
    let listen = |net: &mut Station, until: Micros| {
        while net.now() < until && net.recv(until).unwrap().is_some() {}
    };
    let begun = net.now();
    while net.heard().len() < 2 {
        assert!(net.now() < begun + 20 * S, "nobody is heard");
        let until = net.now() + S / 10;
        listen(&mut net, until);
    }
    for drone in net.heard() {
        for (name, value) in params {
            net.send(drone, &param_set(drone, name, *value)).unwrap();
        }
    }
    let until = net.now() + S;
    listen(&mut net, until);
}

fn journal(bench: &Bench) -> String {
    fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap()
}

#[test]
fn nothing_is_set_on_drones_that_perform_whatever_is_asked() {
    let bench = Bench::with_shared_clock();
    let plan = ["plan", "calibration", "--grid", "1x2", "-o", "campaign"];
    bench.expect(0, &[&plan[..], LONG].concat());
    let mut drones = bench.drones();
    drones.speed = 4.0;
    let station = free_port();
    let link = format!("udpin:{station}");
    let at = |name: &str| bench.path(&format!("campaign/{name}"));
    let said = drones.fly(
        station.parse().unwrap(),
        || {
            let mut flight = in_the_air(&bench, &link, &["--no-logs"]);
            flight.signal("-KILL");
            flight.end();
            put(&bench, &station, &[("LOG_FILE_DSRMROT", 0.0), ("BATT_FS_CRT_ACT", 3.0)]);
            let changes = fs::read(at("fleet-changes.json")).unwrap();
            let mut said = String::new();
            let mut refused = |code: i32, words: &[&'static str], more: &[&'static str]| {
                let ended = bench.expect(code, &[&step(words, &link)[..], more].concat());
                said.push_str(&ended.err);
                assert!(!ended.err.contains("disarm it"), "{ended}");
                assert!(ended.err.contains("is flying (performing)"), "{ended}");
                ended
            };
            refused(3, &["fleet", "restore"], &[]);
            refused(3, &["fleet", "restore"], &["--fence-off"]);
            let upload = refused(3, &["fleet", "upload"], &["--set-params"]);
            assert!(!upload.err.contains("Changed"), "{upload}");
            refused(4, &["fleet", "start"], &["--yes"]);
            refused(4, &["fly"], &["--yes", "--set-params"]);
            assert_eq!(fs::read(at("fleet-changes.json")).unwrap(), changes, "all is kept");
            said
        },
        |vehicles| {
            for vehicle in vehicles {
                assert!(vehicle.is_armed(), "it still performs");
                for (name, value) in [
                    ("FENCE_ENABLE", 1.0),
                    ("FENCE_TYPE", 5.0),
                    ("FENCE_ACTION", 1.0),
                    ("BATT_FS_LOW_ACT", 1.0),
                    // As the other station has left it.
                    ("LOG_FILE_DSRMROT", 0.0),
                    ("BATT_FS_CRT_ACT", 3.0),
                ] {
                    assert_eq!(vehicle.params.get(name), value, "{name}");
                }
                let top_m = drones.plan.fence.max_altitude_m as f32;
                assert_eq!(vehicle.params.get("FENCE_ALT_MAX"), top_m);
            }
        },
    );
    assert!(said.contains("`updraft fleet watch` follows the flight"), "{said}");
    assert!(said.contains("No parameter was restored"), "{said}");
    assert!(said.contains("so no parameter was set"), "{said}");
}

#[test]
fn no_fence_is_weakened_while_a_drone_of_the_table_is_not_heard() {
    let bench = Bench::with_shared_clock();
    bench.planned("1x2", "campaign");
    let mut drones = bench.drones();
    let station = free_port();
    let link = format!("udpin:{station}");
    let changes = || fs::read_to_string(bench.path("campaign/fleet-changes.json")).unwrap();
    drones.fly(
        station.parse().unwrap(),
        || bench.expect(0, &step(&["fleet", "upload"], &link)),
        |_| {},
    );
    // Another day drone 2 is off, and drone 1 has the fence of the upload.
    drones.setups[1].gone_at = Some(0);
    drones.params = vec![("FENCE_ENABLE", 1.0), ("FENCE_ALT_MAX", 40.0), ("FENCE_TYPE", 5.0)];
    let restore =
        ["fleet", "restore", "campaign", "--connect", &link, "--wait", "3", "--fence-off"];
    let ended = drones.fly(
        station.parse().unwrap(),
        || bench.expect(3, &restore),
        |vehicles| {
            assert_eq!(vehicles[0].params.get("FENCE_ENABLE"), 1.0);
            assert_eq!(vehicles[0].params.get("FENCE_ALT_MAX"), 40.0);
            // More than the plan asks for is no weakening.
            assert_eq!(vehicles[0].params.get("FENCE_TYPE"), 7.0);
        },
    );
    assert!(ended.err.contains("drone 2: it was never heard, so nothing was set"), "{ended}");
    assert!(ended.err.contains("fences and failsafes stay as they are"), "{ended}");
    assert!(changes().contains("FENCE_ENABLE"), "{}", changes());
}

#[test]
fn a_signal_in_flight_sends_everyone_home_whichever_it_is() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let (bench, _fleet, link) = stage(&["--speed", "5"]);
        let mut flight = in_the_air(&bench, &link, &["--no-logs"]);
        flight.signal(signal);
        if signal != "-INT" {
            // A session that ends sends them again.
            flight.signal(signal);
            flight.signal("-HUP");
        }
        assert_eq!(flight.end(), Some(130), "{signal}: {}", flight.said());
        let said = flight.said();
        assert!(said.contains("drone 1: returns") && said.contains("drone 2: returns"), "{said}");
        assert!(said.contains("has sent them home"), "{signal}: {said}");
        assert!(journal(&bench).contains("\"step\":\"abort\""), "{}", journal(&bench));
        assert_eq!(modes(&bench, &link), ["RTL", "RTL"], "{signal}");
    }
}

#[test]
fn what_a_signal_does_in_flight_is_chosen_by_an_option() {
    for (stock, choice, said, wanted) in [
        (false, "land", "has ordered them to land", ["LAND", "LAND"]),
        (false, "leave", "the drones fly on by themselves", ["DRONE_SHOW", "DRONE_SHOW"]),
        (true, "land", "has ordered them to land", ["LAND", "LAND"]),
        // Nobody streams, nobody is there: they have come home by themselves.
        (true, "leave", "the drones no longer receive targets", ["RTL", "RTL"]),
    ] {
        let more = if stock { &["--stock", "--speed", "5"][..] } else { &["--speed", "5"] };
        let (bench, _fleet, link) = stage(more);
        let chosen = ["--on-interrupt", choice];
        let mut flight = if stock {
            let mut flight = Flight::of(&bench, &[&flown(&link)[..], &chosen].concat());
            flight.hear("drone 2: armed");
            bench.pause(4);
            flight
        } else {
            in_the_air(&bench, &link, &chosen)
        };
        flight.signal("-TERM");
        assert_eq!(flight.end(), Some(130), "{}", flight.said());
        assert!(flight.said().contains(said), "{}", flight.said());
        if stock {
            bench.pause(2);
        }
        assert_eq!(modes(&bench, &link), wanted, "{choice}, stock: {stock}");
    }
}

#[test]
fn signals_end_every_command_and_nohup_is_respected() {
    let bench = Bench::new();
    bench.planned("1x2", "campaign");
    for signal in ["-INT", "-TERM", "-HUP"] {
        let link = format!("udpin:{}", free_port());
        let args = ["fleet", "status", "campaign", "--connect", &link, "--wait", "300"];
        let mut waiting = Flight::of(&bench, &args);
        std::thread::sleep(Duration::from_secs(2));
        waiting.signal(signal);
        assert_eq!(waiting.end(), Some(130), "{signal}: {}", waiting.said());
        let mut fleet =
            Flight::of(&bench, &["fleet", "virtual", "campaign", "--station", "127.0.0.1:9"]);
        fleet.hear("switched on");
        std::thread::sleep(Duration::from_secs(1));
        fleet.signal(signal);
        assert_eq!(fleet.end(), Some(0), "{signal}: {}", fleet.said());
    }
    let link = format!("udpin:{}", free_port());
    let err = fs::File::create(bench.path("nohup.txt")).unwrap();
    let mut command = Command::new("nohup");
    command.arg(env!("CARGO_BIN_EXE_updraft")).current_dir(bench.path(""));
    command.args(["fleet", "status", "campaign", "--connect", &link, "--wait", "8"]);
    let mut child = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(err).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(2));
    let id = child.id().to_string();
    assert!(Command::new("kill").args(["-HUP", &id]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(5), "it goes on and hears nobody");
}

#[test]
fn on_a_terminal_ctrl_c_asks_what_the_drones_do() {
    for (typed, said, wanted) in [
        ("x\nl\n", "has ordered them to land", "LAND"),
        ("\x03", "has sent them home", "RTL"),
        ("f\n", "the drones fly on by themselves", "DRONE_SHOW"),
    ] {
        let (bench, _fleet, link) = stage(&["--speed", "5"]);
        let talk = [("drone 2: performing", "\x03"), ("be left flying (f)?", typed)];
        let Some((code, told)) = on_a_terminal(&bench, &shown(&link, &["--no-logs"]), &talk) else {
            return;
        };
        assert!(told.contains(said), "{typed:?}: {told}");
        assert_eq!(code, 130, "{told}");
        assert_eq!(modes(&bench, &link), [wanted; 2], "{typed:?}");
    }
}

#[test]
fn a_station_that_died_is_replaced_and_the_logs_come_home() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let mut flight = in_the_air(&bench, &link, &[]);
    flight.signal("-KILL");
    assert_eq!(flight.end(), None);
    let ended = bench.expect(0, &step(&["fleet", "watch"], &link));
    assert!(ended.err.contains("Watching: the start is"), "{ended}");
    assert!(ended.err.contains("2 of 2 drones have landed"), "{ended}");
    assert!(ended.err.contains("Downloaded 2 of 2 logs"), "{ended}");
    assert!(!ended.err.contains("from its trajectory"), "{ended}");
    let journal = journal(&bench);
    let (_, after) = journal.split_once("\"step\":\"attached\"").unwrap();
    assert!(after.contains("\"event\":\"armed\",\"armed\":false"), "{after}");
    assert!(bench.path("campaign/logs/02.BIN").exists());
    // Nobody is in the air any more: that is said, and the logs are looked for.
    for again in [false, true] {
        if again {
            fs::remove_file(bench.path("campaign/logs/02.BIN")).unwrap();
        }
        let ended = bench.expect(0, &step(&["fleet", "watch"], &link));
        assert!(!ended.err.contains("have landed"), "{ended}");
        assert!(ended.err.contains("UTC is over; its logs are downloaded"), "{ended}");
        assert!(bench.path("campaign/logs/02.BIN").exists());
    }
}

#[test]
fn the_station_in_its_place_carries_orders_out() {
    let (bench, _fleet, link) = stage(&["--speed", "5"]);
    let mut flight = in_the_air(&bench, &link, &["--no-logs"]);
    flight.signal("-KILL");
    flight.end();
    let watch = [&step(&["fleet", "watch"], &link)[..], &["--no-logs"]].concat();
    let mut watch = Flight::of(&bench, &watch);
    watch.hear("Watching: the start is");
    let ended = bench.expect(0, &step(&["fleet", "abort"], &link));
    assert_eq!(ended.out, "drone 1: returns\ndrone 2: returns\n", "{ended}");
    assert!(ended.err.contains("running station"), "{ended}");
    assert_eq!(watch.end(), Some(3), "{}", watch.said());
    assert!(watch.said().contains("Ordered from another terminal: abort"), "{}", watch.said());
    assert!(journal(&bench).contains("\"step\":\"attached\""), "{}", journal(&bench));
}

#[test]
fn nobody_has_landed_who_is_gone_or_never_took_off() {
    // Drone 2 goes off in the air.
    let (bench, _fleet, link) = stage(&["--speed", "5", "--gone", "2", "--after", "60"]);
    let ended = bench.expect(3, &shown(&link, &["--no-logs"]));
    assert!(
        ended.err.contains("1 of 2 drones have landed; drone 2 (slot 2) has not been heard for"),
        "{ended}"
    );
    // The start is taken back: nobody took off.
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let mut flight = Flight::of(&bench, &shown(&link, &["--no-logs"]));
    flight.hear("Authorized.");
    bench.expect(0, &step(&["fleet", "abort"], &link));
    assert_eq!(flight.end(), Some(3), "{}", flight.said());
    let said = "0 of 2 drones have landed; drone 1 (slot 1) never took off; drone 2 (slot 2) never took off";
    assert!(flight.said().contains(said), "{}", flight.said());
}

#[test]
fn a_drone_that_restarts_in_the_air_has_not_landed() {
    let (bench, _fleet, link) = stage(&["--speed", "5", "--reboot", "2", "--after", "60"]);
    let ended = bench.expect(3, &shown(&link, &["--no-logs"]));
    assert!(ended.err.contains("warning: drone 2: restarted in the air"), "{ended}");
    let said = "1 of 2 drones have landed; drone 2 (slot 2) restarted in the air and fell";
    assert!(ended.err.contains(said), "{ended}");
    assert!(ended.err.contains("not seen to land: drones 2"), "{ended}");
}

#[test]
fn a_drone_that_restarts_before_the_start_is_named_and_flies_without_an_alarm() {
    let (bench, _fleet, link) = stage(&["--speed", "5", "--reboot", "2", "--after", "110"]);
    let ended = bench.expect(0, &shown(&link, &["--no-logs", "--lead", "160"]));
    assert!(ended.err.contains("drone 2: restarted\n"), "{ended}");
    assert!(!ended.err.contains("from its trajectory"), "{ended}");
    assert!(ended.err.contains("2 of 2 drones have landed"), "{ended}");
}

#[test]
fn a_folder_from_which_nobody_started_has_nothing_to_watch() {
    let (bench, _fleet, link) = stage(&["--speed", "1"]);
    let ended = bench.expect(5, &step(&["fleet", "watch"], &link));
    assert!(ended.err.contains("fleet.json does not exist"), "{ended}");
    bench.expect(0, &step(&["fleet", "upload"], &link));
    let ended = bench.expect(5, &step(&["fleet", "watch"], &link));
    assert!(ended.err.contains("no drone is in the air or has a start"), "{ended}");
}
