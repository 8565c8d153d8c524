//! The whole program against a Skybrush Server that is none.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod support;

use std::fmt::Write as _;
use std::fs;
use std::io::{BufRead as _, BufReader, Lines};
use std::process::{Child, ChildStderr, Command, Stdio};
use std::sync::Arc;
use std::time::Instant;

use crate::cli::support::{Bench, Ended};
use crate::skybrush_server::support::replay::Replay;
use crate::skybrush_server::support::{Fake, Fault};
use serde_json::{Value, json};
use updraft::link::clock::{Clock, Micros};
use updraft::skybrush_server::{Client, Foreman, Job, Outcome, fetch_log};

/// Its only flight takes half a minute, and two drones.
fn planned() -> Bench {
    let bench = Bench::new();
    let args = ["plan", "hover", "--grid", "1x2", "--set", "duration_s=10", "-o", "campaign"];
    bench.expect(0, &args);
    bench
}

fn plan(bench: &Bench) -> Value {
    serde_json::from_slice(&fs::read(bench.path("campaign/plan.json")).unwrap()).unwrap()
}

fn run(bench: &Bench, server: &Fake, args: &[&str]) -> Ended {
    let mut command = bench.command(args);
    command.args(["--connect", &format!("skybrush://{}", server.address)]);
    command.args(server.clock.args());
    let ended = Ended::of(&command.stdin(Stdio::null()).output().unwrap());
    // Its digits alone may be those of a distance.
    let address = server.address.to_string();
    let port = format!("port {}", server.address.port());
    let tidy = |text: &str| {
        let text = text.replace(&address, "127.0.0.1:PORT").replace(&port, "port PORT");
        without_time_left(&text)
    };
    Ended { err: tidy(&ended.err), out: tidy(&ended.out), ..ended }
}

/// How much of the lead is left depends on how busy the machine is.
fn without_time_left(text: &str) -> String {
    let said = "Every drone has the start time, in ";
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    for line in &mut lines {
        if line.starts_with(said) {
            *line = "Every drone has the start time, in LEFT s\n";
        }
    }
    lines.concat()
}

fn fly(bench: &Bench, fault: Fault) -> (Ended, Fake) {
    let server = Fake::start(&plan(bench), fault);
    let ended = run(bench, &server, &["fly", "campaign", "--yes", "--lead", "60", "--wait", "1"]);
    (ended, server)
}

fn refused(fault: Fault) -> String {
    let (ended, server) = fly(&planned(), fault);
    assert!(!server.is_authorized(), "{ended}");
    ended.to_string()
}

#[test]
fn a_flight_is_uploaded_started_watched_and_brings_its_logs_home() {
    let bench = planned();
    let (ended, server) = fly(&bench, Fault::Patient);
    assert_eq!(ended.code, Some(0), "{ended}");
    // It does not wait for the time at which the show ends, and some.
    let start = server.flown_unix_s().unwrap() as u64;
    let show_ms = plan(&bench)["duration_ms"].as_u64().unwrap();
    assert!(server.clock.unix_ms() < start * 1000 + show_ms, "{ended}");
    insta::assert_snapshot!(ended.err);

    // What the server was told.
    let plan = plan(&bench);
    let asked = server.asked();
    let uploads: Vec<&Value> =
        asked.iter().filter(|body| body["command"] == "__show_upload").collect();
    assert_eq!(uploads.len(), 2);
    assert_eq!(server.most_at_once(), 2, "both at once");
    for (index, upload) in uploads.iter().enumerate() {
        assert_eq!(upload["command"], "__show_upload");
        // The drones stand the other way round.
        let id = ["02", "01"][index];
        assert_eq!(upload["ids"], json!([id]));
        let show = &upload["kwds"]["show"];
        assert_eq!(show["trajectory"]["version"], 1);
        assert_eq!(show["mission"]["index"], index);
        assert_eq!(show["coordinateSystem"]["type"], "nwu");
        assert_eq!(show["coordinateSystem"]["origin"], json!([19.0621, 47.4733]));
        assert_eq!(show["geofence"]["enabled"], true);
        assert_eq!(show["geofence"]["polygons"][0]["points"], plan["fence"]["polygon_m"]);
        assert_eq!(show["geofence"]["maxAltitude"], plan["fence"]["max_altitude_m"]);
    }
    let starts: Vec<&Value> = asked.iter().filter(|body| body["type"] == "SHOW-SETCFG").collect();
    let start = |index: usize| &starts[index]["configuration"]["start"];
    assert_eq!(starts.len(), 3, "set, authorized, and cleared at the end");
    assert_eq!((&start(2)["authorized"], &start(2)["time"]), (&json!(false), &Value::Null));
    assert_eq!((&start(0)["authorized"], &start(1)["authorized"]), (&json!(false), &json!(true)));
    assert_eq!(start(0)["time"], start(1)["time"]);
    assert_eq!(start(1)["uavIds"], json!(["02", "01"]));

    // What came home.
    let manifest = fs::read(bench.path("campaign/logs/manifest.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    for (index, id) in ["02", "01"].into_iter().enumerate() {
        let entry = &manifest["logs"][index];
        assert_eq!(entry["slot"], index + 1);
        assert_eq!(entry["method"], "skybrush_server");
        assert_eq!(entry["verified"], "size");
        assert_eq!(entry["boot"], 2);
        assert!(entry["source"].as_str().unwrap().ends_with(&format!("drone {id} log 2")));
        let file = entry["file"].as_str().unwrap();
        let came = fs::read(bench.path("campaign/logs").join(file)).unwrap();
        let start = start(1)["time"].as_i64().unwrap();
        assert!(came == support::log_of(id, start), "{file}");
        assert_eq!(entry["flight"]["number"], 1, "{entry}");
    }
    bench.expect(0, &["logs", "verify", "campaign"]);
    let journal = fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap();
    assert!(journal.contains(r#""server_drone":"01","event":"code","code":7"#), "{journal}");
}

#[test]
fn errors_and_a_server_that_goes_away_are_told_while_it_flies() {
    let (ended, _) = fly(&planned(), Fault::TroubleInFlight);
    assert_eq!(ended.code, Some(3), "{ended}");
    insta::assert_snapshot!(ended.err);
}

#[test]
fn shows_that_cannot_be_flown_are_refused_before_anything_is_sent() {
    let mut said = String::new();
    let mut change = |change: &dyn Fn(&mut Value)| {
        let bench = planned();
        let mut plan = plan(&bench);
        change(&mut plan);
        fs::write(bench.path("campaign/plan.json"), plan.to_string()).unwrap();
        let (ended, server) = fly(&bench, Fault::None);
        assert!(server.asked().is_empty(), "{ended}");
        let _ = writeln!(said, "{ended}");
    };
    change(&|plan| plan["fence"]["polygon_m"] = json!([]));
    change(&|plan| plan["fence"]["polygon_m"] = json!([[-1, -1], [1, -1], [1, 1], [-1, 1]]));
    change(&|plan| plan["fence"]["max_altitude_m"] = json!(12.0));
    insta::assert_snapshot!(said);
}

#[test]
fn nobody_starts_without_a_person() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    let ended = run(&bench, &server, &["fly", "campaign"]);
    assert!(server.asked().is_empty(), "{ended}");
    let short = run(&bench, &server, &["fly", "campaign", "--yes", "--lead", "10"]);
    assert!(server.asked().is_empty(), "{short}");
    insta::assert_snapshot!(format!("{ended}\n{short}"));
}

/// Aborted or not: every start has its own logs, and a log of another start is none of it.
#[test]
fn the_logs_of_a_second_flight_do_not_stay_those_of_the_first() {
    let bench = planned();
    let at_home = |name: &str| fs::read(bench.path("campaign/logs").join(name)).unwrap();
    let (first, _) = fly(&bench, Fault::None);
    assert_eq!(first.code, Some(0), "{first}");
    let logs = [at_home("01.BIN"), at_home("02.BIN")];
    let (second, server) = fly(&bench, Fault::None);
    assert_eq!(second.code, Some(0), "{second}");
    assert!(second.err.contains("Moved 2 logs of an earlier flight to"), "{second}");
    assert_eq!([at_home("flight-1/01.BIN"), at_home("flight-1/02.BIN")], logs);
    let asked = server.asked();
    let mut starts =
        asked.iter().filter_map(|body| body.pointer("/configuration/start/time")?.as_i64());
    let start = starts.next_back().unwrap();
    assert!(at_home("01.BIN") == support::log_of("02", start));
    bench.expect(0, &["logs", "verify", "campaign"]);
    // Drones with cards of another day: what is home stays, and what they have is named.
    let others = Fake::start(&plan(&bench), Fault::None);
    let pulled = run(&bench, &others, &["logs", "pull", "campaign", "--again"]);
    assert_eq!(pulled.code, Some(3), "{pulled}");
    assert!(
        pulled.err.contains("log 2 of the drone belongs to another flight: its show"),
        "{pulled}"
    );
    assert!(at_home("01.BIN") == support::log_of("02", start));
    bench.expect(0, &["logs", "verify", "campaign"]);
}

/// What the real server said, word for word.
#[test]
fn a_recorded_flight_through_the_real_server_is_flown_again() {
    let bench = planned();
    let server = Replay::start("skybrush-server-2.50.0-flight.jsonl");
    let address = format!("skybrush://{}", server.address);
    let args = ["fly", "campaign", "--yes", "--lead", "20", "--connect", &address];
    let mut command = bench.command(&args);
    command.args(server.clock.args());
    let ended = Ended::of(&command.stdin(Stdio::null()).output().unwrap());
    assert_eq!(server.surprises(), [""; 0], "{ended}");
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.out.contains("GO: 2 of 2 drones are ready"), "{ended}");
    assert!(ended.err.contains("2 of 2 drones have landed"), "{ended}");
    assert!(ended.err.contains("Downloaded 2 of 2 logs"), "{ended}");
    bench.expect(0, &["logs", "verify", "campaign"]);
}

/// What is said of each fault; they take their time, so all at once.
fn refusals(faults: &[Fault]) -> String {
    let said: Vec<String> = std::thread::scope(|scope| {
        let threads: Vec<_> = faults
            .iter()
            .map(|fault| scope.spawn(move || format!("{fault:?}\n{}", refused(*fault))))
            .collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    said.join("\n")
}

#[test]
fn every_refusal_says_why() {
    insta::assert_snapshot!(refusals(&[
        Fault::StandsWrong,
        Fault::Upload("file transfer failed"),
        Fault::UploadTimeout,
        Fault::Nak("OBJ-CMD"),
        Fault::Nak("SHOW-SETCFG"),
        Fault::Gone("OBJ-CMD"),
        Fault::Trouble,
    ]));
}

#[test]
fn a_drone_that_cannot_fly_keeps_all_on_the_ground_before_anything_is_authorized() {
    insta::assert_snapshot!(refusals(&[
        Fault::OneFlies,
        Fault::Initializes,
        Fault::StaysOutOfShowMode,
        Fault::FailsChecks,
        Fault::NoShow,
        Fault::NoShowStatus,
        Fault::Silent,
    ]));
}

#[test]
fn a_start_that_not_every_drone_has_taken_is_taken_back() {
    insta::assert_snapshot!(refusals(&[
        Fault::NoStartTime,
        Fault::OtherStartTime,
        Fault::LeavesShowMode,
        Fault::NoAuthorization,
    ]));
}

#[test]
fn nothing_is_sent_while_somebody_elses_start_is_authorized() {
    let (ended, server) = fly(&planned(), Fault::AuthorizedAlready);
    assert_eq!(ended.code, Some(4), "{ended}");
    assert!(server.asked().is_empty(), "{ended}");
    insta::assert_snapshot!(ended.to_string());
}

#[test]
fn a_start_that_somebody_takes_back_is_no_flight() {
    let bench = planned();
    let (ended, _) = fly(&bench, Fault::TakenBack);
    assert_eq!(ended.code, Some(4), "{ended}");
    assert!(!bench.path("campaign/logs/start.json").exists());
    insta::assert_snapshot!(ended.err);
}

#[test]
fn a_drone_that_never_took_off_has_not_landed() {
    let (ended, server) = fly(&planned(), Fault::NeverTakesOff);
    assert_eq!(ended.code, Some(3), "{ended}");
    assert!(!server.is_authorized());
    assert!(ended.err.contains("drone 01 did not take off"), "{ended}");
    assert!(ended.err.contains("1 of 2 drones have landed"), "{ended}");
}

#[test]
fn status_upload_and_preflight_go_through_the_server() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    let step = |args: &[&str]| {
        let all = [args, &["campaign", "--wait", "1"]].concat();
        format!("{}\n{}\n", args.join(" "), run(&bench, &server, &all))
    };
    let mut said = step(&["fleet", "status"]);
    said += &step(&["fleet", "preflight"]);
    assert!(server.asked().is_empty(), "nothing is sent by looking");
    said += &step(&["fleet", "upload"]);
    said += &step(&["fleet", "status", "--json"]);
    said += &step(&["fleet", "preflight"]);
    said += &step(&["fleet", "preflight", "--json"]);
    said += &step(&["fleet", "status", "--dry-run"]);
    let asked = server.asked();
    let commands: Vec<&Value> = asked.iter().map(|body| &body["command"]).collect();
    assert_eq!(commands, ["__show_upload", "__show_upload", "mode", "mode"]);
    said += &step(&["fleet", "start", "--yes"]);
    insta::assert_snapshot!(said);
}

#[test]
fn options_that_do_nothing_through_a_server_are_refused() {
    let bench = planned();
    fs::write(bench.path("swarm.key"), [7; 32]).unwrap();
    let server = Fake::start(&plan(&bench), Fault::None);
    let mut said = String::new();
    let refusals: [&[&str]; 14] = [
        &["fly", "--yes", "--set-params"],
        &["fly", "--yes", "--assign"],
        &["fly", "--yes", "--key", "swarm.key"],
        &["fly", "--yes", "--force"],
        &["fly", "--yes", "--wind", "3"],
        &["fly", "--yes", "--effect", "gps=off"],
        &["fly", "--dry-run", "--updraft", "1"],
        &["fleet", "upload", "--set-params"],
        &["fleet", "preflight", "--assign"],
        &["fleet", "status", "--key", "swarm.key"],
        &["fleet", "abort", "--key", "swarm.key"],
        &["logs", "list", "--key", "swarm.key"],
        &["logs", "pull", "--rate", "1000"],
        &["logs", "pull", "--patience", "10"],
    ];
    for words in refusals {
        let ended = run(&bench, &server, &[words, &["campaign"]].concat());
        assert_eq!(ended.code, Some(2), "{words:?} {ended}");
        let _ = writeln!(said, "{}\n{}", words.join(" "), ended.err);
    }
    assert!(server.asked().is_empty());
    insta::assert_snapshot!(said);
}

#[test]
fn an_authorization_that_fails_is_taken_back() {
    let (ended, server) = fly(&planned(), Fault::NakAuthorization);
    assert_eq!(ended.code, Some(1), "{ended}");
    assert!(!server.is_authorized());
    let last = server.asked().pop().unwrap();
    assert_eq!(last["configuration"]["start"]["time"], Value::Null, "{last}");
    insta::assert_snapshot!(ended.err);
}

#[test]
fn logs_are_listed_and_pulled_and_losses_are_named() {
    let bench = planned();
    let pull = |fault| {
        let server = Fake::start(&plan(&bench), fault);
        run(&bench, &server, &["logs", "pull", "campaign"]).to_string()
    };
    let server = Fake::start(&plan(&bench), Fault::None);
    let mut said = run(&bench, &server, &["logs", "list", "campaign"]).to_string();
    for fault in [
        Fault::LogSize,
        Fault::LogCut,
        Fault::LogGarbled,
        Fault::LogIsNone,
        Fault::Nak("LOG-DATA"),
        Fault::Gone("LOG-DATA"),
    ] {
        let _ = write!(said, "\n{fault:?}\n{}", pull(fault));
        // Of a log that is still being written the beginning is kept.
        let is_there = bench.path("campaign/logs/01.BIN").exists();
        assert_eq!(is_there, fault == Fault::LogSize, "{fault:?}");
        if is_there {
            let manifest = fs::read_to_string(bench.path("campaign/logs/manifest.json")).unwrap();
            assert!(manifest.contains(r#""incomplete": "it was listed"#), "{manifest}");
            fs::remove_dir_all(bench.path("campaign/logs")).unwrap();
        }
    }
    let _ = write!(said, "\nwhole\n{}", pull(Fault::None));
    // What is there is not asked for again.
    let _ = write!(said, "\nagain\n{}", pull(Fault::Nak("LOG-DATA")));
    insta::assert_snapshot!(said);
    bench.expect(0, &["logs", "verify", "campaign"]);
}

#[test]
fn a_log_that_grew_or_was_missed_comes_home() {
    for (fault, attempts) in [(Fault::LogGrows, 1), (Fault::LogOnce, 2)] {
        let bench = planned();
        let server = Fake::start(&plan(&bench), fault);
        let ended = run(&bench, &server, &["logs", "pull", "campaign", "--at-once", "1"]);
        assert_eq!(ended.code, Some(0), "{fault:?} {ended}");
        assert_eq!(server.most_at_once(), 1);
        let manifest = fs::read(bench.path("campaign/logs/manifest.json")).unwrap();
        let manifest: Value = serde_json::from_slice(&manifest).unwrap();
        assert_eq!(manifest["logs"][1]["attempts"], attempts, "{fault:?} {manifest}");
        bench.expect(0, &["logs", "verify", "campaign"]);
    }
}

/// What keeps a log of drone 01 from coming, or from being this flight's.
#[test]
fn why_a_log_is_not_this_flights_is_said() {
    let mut said = String::new();
    for fault in [
        Fault::LogNewer,
        Fault::LogNone,
        Fault::LogHuge,
        Fault::LogTimeless,
        Fault::NoList,
        Fault::NoListAfter,
        Fault::LogGone,
    ] {
        let bench = planned();
        let (ended, server) = fly(&bench, fault);
        // The right log is there, and a newer one named.
        assert_eq!(ended.code, Some(if fault == Fault::LogNewer { 0 } else { 3 }), "{ended}");
        let start = server.flown_unix_s().unwrap();
        let came = fs::read(bench.path("campaign/logs/01.BIN")).unwrap();
        assert!(came == support::log_of("02", start), "{fault:?} {ended}");
        if fault == Fault::LogNewer {
            let came = fs::read(bench.path("campaign/logs/02.BIN")).unwrap();
            assert!(came == support::log_of("01", start), "{ended}");
        }
        let logs = ended.err.lines().skip_while(|line| !line.contains("have landed")).skip(1);
        let _ = writeln!(said, "{fault:?}\n{}", logs.collect::<Vec<_>>().join("\n"));
    }
    // What is home counts where the drone does not say what it has; and is said not to be compared.
    let bench = planned();
    let (first, server) = fly(&bench, Fault::None);
    assert_eq!(first.code, Some(0), "{first}");
    drop(server);
    let pull = |fault| {
        let other = Fake::start(&plan(&bench), fault);
        run(&bench, &other, &["logs", "pull", "campaign"])
    };
    let _ = writeln!(said, "NoList, home\n{}", pull(Fault::NoList));
    let _ = writeln!(said, "LogNone, home\n{}", pull(Fault::LogNone));
    // Without a start nobody knows which of two logs is the flight's.
    let bench = planned();
    let pull = |fault| {
        let other = Fake::start(&plan(&bench), fault);
        run(&bench, &other, &["logs", "pull", "campaign"])
    };
    assert_eq!(pull(Fault::None).code, Some(0));
    let newer = pull(Fault::LogNewer);
    assert_eq!(newer.code, Some(3), "{newer}");
    let _ = writeln!(said, "LogNewer, no start\n{newer}");
    insta::assert_snapshot!(said);
}

#[test]
fn one_drone_without_its_log_keeps_nobody_else_from_theirs() {
    let mut said = String::new();
    for fault in [Fault::LogUnknown, Fault::LogBusy, Fault::StandsWrong] {
        let bench = planned();
        let server = Fake::start(&plan(&bench), fault);
        let ended = run(&bench, &server, &["logs", "pull", "campaign", "--wait", "0"]);
        assert_eq!(ended.code, Some(3), "{ended}");
        assert!(bench.path("campaign/logs/01.BIN").exists(), "{ended}");
        let _ = writeln!(said, "{fault:?}\n{ended}");
    }
    insta::assert_snapshot!(said);
}

#[test]
fn lists_and_pulls_have_the_options_of_the_drones_own_links() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    let logs = |args: &[&str]| {
        let all = [&["logs", args[0], "campaign"], &args[1..]].concat();
        format!("{}\n{}\n", args.join(" "), run(&bench, &server, &all))
    };
    let mut said = logs(&["list", "--json"]);
    said += &logs(&["list", "--slots", "2"]);
    said += &logs(&["list", "--slots", "3"]);
    said += &logs(&["pull", "--dry-run"]);
    assert!(!server.asked().iter().any(|body| body["type"] == "LOG-DATA"));
    said += &logs(&["pull", "--slots", "2", "--json"]);
    assert!(!bench.path("campaign/logs/01.BIN").exists());
    said += &logs(&["pull", "--dry-run", "--json"]);
    said += &logs(&["pull", "--json"]);
    said += &logs(&["pull", "--slots", "1", "--again"]);
    said += &logs(&["pull", "--slots", "1", "--log", "7"]);
    let slot_1 = server.asked().iter().filter(|body| body["uavId"] == "02").count();
    assert_eq!(slot_1, 2, "once, and once again");
    fs::remove_file(bench.path("campaign/logs/manifest.json")).unwrap();
    said += &logs(&["pull", "--slots", "1"]);
    insta::assert_snapshot!(said);
}

#[test]
fn a_flights_dry_run_shows_the_servers_requests() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    let ended = run(&bench, &server, &["fly", "campaign", "--dry-run", "--json"]);
    assert!(server.asked().is_empty(), "{ended}");
    let shown: Value = serde_json::from_str(&ended.out).unwrap();
    let lines = shown["drones"]["on slot 2"].as_array().unwrap();
    let bodies: Vec<Value> =
        lines.iter().map(|line| serde_json::from_str(line.as_str().unwrap()).unwrap()).collect();
    let kinds: Vec<&str> = bodies.iter().map(|body| body["type"].as_str().unwrap()).collect();
    assert_eq!(kinds, ["OBJ-CMD", "OBJ-CMD", "SHOW-SETCFG", "SHOW-SETCFG"]);
    assert_eq!(bodies[0]["kwds"]["show"]["mission"]["index"], 1);
    let ended = run(&bench, &server, &["fleet", "abort", "campaign", "--dry-run"]);
    assert!(server.asked().is_empty(), "{ended}");
    assert!(
        ended.out.contains(r#"{"ids":["(who stands on slot 2)"],"type":"UAV-RTH"}"#),
        "{ended}"
    );
}

#[test]
fn drones_that_the_server_hears_late_are_waited_for() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::Late);
    let ended = run(&bench, &server, &["logs", "pull", "campaign"]);
    assert_eq!(ended.code, Some(0), "{ended}");
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::Late);
    let short = run(&bench, &server, &["logs", "pull", "campaign", "--wait", "0"]);
    insta::assert_snapshot!(format!("{ended}\n{short}"));
}

#[test]
fn a_drone_that_the_server_only_remembers_stands_nowhere() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::Remembers);
    let ended = run(&bench, &server, &["logs", "pull", "campaign"]);
    assert_eq!(ended.code, Some(0), "{ended}");
    let left = "Left out, because the server has not heard them for a while: drones 77";
    assert!(ended.err.contains(left), "{ended}");
}

/// Stops as soon as something moves.
struct Impatient {
    moved: bool,
}

impl Foreman for Impatient {
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job> {
        panic!("{drone} is over: {outcome:?}")
    }

    fn progress(&mut self, _: &str, share: f64) {
        self.moved |= share > 0.5;
    }

    fn stop(&mut self) -> bool {
        self.moved
    }
}

#[test]
fn what_nobody_waits_for_any_more_is_cancelled() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::LogHangs);
    let clock = Arc::new(Stopwatch::start());
    let mut client = Client::connect(&server.address.to_string(), clock).unwrap();
    let jobs = ["01", "02"].map(|drone| fetch_log(drone, "2"));
    client.work(jobs, 1, &mut Impatient { moved: false }).unwrap();
    let asked = server.asked();
    assert_eq!(asked.len(), 2, "{asked:?}");
    assert_eq!(asked[1], json!({ "type": "ASYNC-CANCEL", "ids": ["receipt-1"] }));
}

/// A command that goes on until somebody ends it.
struct Going {
    child: Child,
    lines: Lines<BufReader<ChildStderr>>,
}

impl Going {
    fn start(bench: &Bench, server: &Fake, args: &[&str]) -> Self {
        let address = format!("skybrush://{}", server.address);
        let mut command = bench.command(args);
        command.args(["--connect", &address]).args(server.clock.args());
        let command = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let lines = BufReader::new(child.stderr.take().unwrap()).lines();
        Self { child, lines }
    }

    /// Reads what it says until it says this.
    fn until(&mut self, word: &str) {
        let found = self.lines.by_ref().map(Result::unwrap).find(|line| line.contains(word));
        assert!(found.is_some(), "it never said {word}");
    }

    fn signal(&self, signal: &str) {
        let pid = self.child.id().to_string();
        assert!(Command::new("kill").args([signal, &pid]).status().unwrap().success());
    }

    /// What else it says, and its exit code.
    fn end(mut self) -> (String, Option<i32>) {
        let rest: Vec<String> = self.lines.map(Result::unwrap).collect();
        (rest.join("\n"), self.child.wait().unwrap().code())
    }
}

/// A flight that is told to end when it says this; what it says from then on, and its exit code.
fn ended_at(signal: &str, word: &str, fault: Fault, more: &[&str]) -> (String, Option<i32>, Fake) {
    let bench = planned();
    let server = Fake::start(&plan(&bench), fault);
    let mut flying = Going::start(&bench, &server, &[&["fly", "campaign", "--yes"], more].concat());
    flying.until(word);
    flying.signal(signal);
    server.let_go();
    let (said, code) = flying.end();
    (said, code, server)
}

/// A flight whose station is killed when it says this.
fn orphaned(word: &str, fault: Fault) -> (Bench, Fake) {
    let bench = planned();
    let server = Fake::start(&plan(&bench), fault);
    let mut flying = Going::start(&bench, &server, &["fly", "campaign", "--yes", "--lead", "60"]);
    flying.until(word);
    flying.signal("-KILL");
    assert_eq!(flying.end().1, None);
    (bench, server)
}

#[test]
#[cfg(unix)]
fn a_flight_whose_station_died_is_watched_to_its_end_by_another() {
    let mut said = String::new();
    for (word, fault) in
        [("take-off", Fault::HoldsInFlight), ("Authorized", Fault::HoldsBeforeStart)]
    {
        let (bench, server) = orphaned(word, fault);
        let again = run(&bench, &server, &["fly", "campaign", "--yes", "--wait", "1"]);
        assert_eq!(again.code, Some(4), "a second flight over the first: {again}");
        server.land();
        let ended = run(&bench, &server, &["fleet", "watch", "campaign"]);
        assert_eq!(ended.code, Some(0), "{ended}");
        let asked = server.asked();
        let last = asked.iter().rfind(|body| body["type"] == "SHOW-SETCFG").unwrap();
        assert_eq!(last["configuration"]["start"]["time"], Value::Null, "the start is cleared");
        for (index, id) in ["02", "01"].into_iter().enumerate() {
            let came = fs::read(bench.path(&format!("campaign/logs/0{}.BIN", index + 1))).unwrap();
            let start = server.flown_unix_s().unwrap();
            assert!(came == support::log_of(id, start), "{ended}");
        }
        bench.expect(0, &["logs", "verify", "campaign"]);
        let journal = fs::read_to_string(bench.path("campaign/fleet-journal.ndjson")).unwrap();
        assert!(journal.contains(r#""step":"attached""#), "{journal}");
        let start = r#""server_drone":"01","event":"code","code":7"#;
        assert!(journal.contains(start), "{journal}");
        let _ = writeln!(said, "{word}\n{}", without_time_of_day(&ended.err));
        // Now nobody flies any more.
        let over = run(&bench, &server, &["fleet", "watch", "campaign"]);
        assert_eq!(over.code, Some(5), "{over}");
        let _ = writeln!(said, "over\n{}", over.err);
    }
    insta::assert_snapshot!(said);
}

/// The trial's day is any.
fn without_time_of_day(text: &str) -> String {
    let line = |line: &str| match line.split_once("the start is ") {
        Some((before, _)) => format!("{before}the start is HH:MM:SS UTC"),
        None => line.to_owned(),
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

#[test]
#[cfg(unix)]
fn who_watches_in_place_of_another_station_can_end_the_flight() {
    let (bench, server) = orphaned("take-off", Fault::HoldsInFlight);
    let args = ["fleet", "watch", "campaign", "--on-interrupt", "land"];
    let mut watching = Going::start(&bench, &server, &args);
    watching.until("Watching");
    watching.signal("-TERM");
    server.let_go();
    let (said, code) = watching.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("this program has ordered them to land"), "{said}");
    let asked = server.asked();
    assert_eq!(asked.iter().filter(|body| body["type"] == "UAV-LAND").count(), 1);

    // Before the start nobody takes off.
    let (bench, server) = orphaned("Authorized", Fault::HoldsBeforeStart);
    let mut watching = Going::start(&bench, &server, &args);
    watching.until("Watching");
    watching.signal("-INT");
    server.let_go();
    let (said, code) = watching.end();
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("the start was cancelled; no drone takes off"), "{said}");
    assert!(!server.is_authorized());
    assert!(!bench.path("campaign/logs/start.json").exists());
}

#[test]
#[cfg(unix)]
fn drones_that_hover_long_after_their_show_are_watched_as_well() {
    let (bench, server) = orphaned("take-off", Fault::HoldsInFlight);
    server.clock.pass(600);
    let mut watching = Going::start(&bench, &server, &["fleet", "watch", "campaign", "--no-logs"]);
    watching.until("Watching");
    server.land();
    let (said, code) = watching.end();
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("2 of 2 drones have landed"), "{said}");
    assert!(!bench.path("campaign/logs/01.BIN").exists());
    assert!(!server.asked().iter().any(|body| body["type"] == "LOG-INF"));
}

#[test]
#[cfg(unix)]
fn who_is_on_the_ground_when_the_watch_begins_is_not_said_to_have_landed() {
    let (bench, server) = orphaned("take-off", Fault::HoldsInFlight);
    server.land();
    // It goes on by a state with every look.
    for _ in 0..3 {
        run(&bench, &server, &["fleet", "status", "campaign"]);
    }
    let ended = run(&bench, &server, &["fleet", "watch", "campaign"]);
    assert_eq!(ended.code, Some(3), "{ended}");
    let found =
        "drone 02 was on the ground when this watch began: its log will show whether it flew";
    assert!(ended.err.contains(found), "{ended}");
    // The other says that it has landed.
    assert!(ended.err.contains("1 of 2 drones have landed"), "{ended}");
    assert!(ended.err.contains("Downloaded 2 of 2 logs"), "{ended}");
}

#[test]
#[cfg(unix)]
fn a_watch_that_is_of_no_use_says_why() {
    let watch = |bench: &Bench, server: &Fake| {
        run(bench, server, &["fleet", "watch", "campaign", "--wait", "1"]).to_string()
    };
    let bench = planned();
    let mut said = watch(&bench, &Fake::start(&plan(&bench), Fault::None));
    let (bench, server) = orphaned("take-off", Fault::HoldsInFlight);
    let start = bench.path("campaign/logs/start.json");
    said += &watch(&bench, &Fake::start(&plan(&bench), Fault::NoDrones));
    said += &watch(&bench, &Fake::start(&plan(&bench), Fault::AuthorizedAlready));
    // A start of days ago, and somebody in the air.
    let record = fs::read_to_string(&start).unwrap();
    let mut old: Value = serde_json::from_str(&record).unwrap();
    let week = old["start"]["week"].as_i64().unwrap();
    old["start"]["week"] = json!(week - 1);
    fs::write(&start, old.to_string()).unwrap();
    said += &watch(&bench, &server);
    let days_ago = Fake::start(&plan(&bench), Fault::OneFlies);
    let ended = watch(&bench, &days_ago);
    assert!(days_ago.asked().is_empty(), "{ended}");
    assert!(ended.contains("exit Some(4)"), "{ended}");
    assert!(ended.contains("drones 01 are in the air, but not by the start of"), "{ended}");
    old["flying"] = json!("show");
    fs::write(&start, old.to_string()).unwrap();
    said += &watch(&bench, &server);
    insta::assert_snapshot!(said);
}

#[test]
fn a_flight_that_is_aborted_is_none_without_loss() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::HoldsInFlight);
    let args = ["fly", "campaign", "--yes", "--lead", "60"];
    let mut flying = Going::start(&bench, &server, &args);
    flying.until("take-off");
    let abort = run(&bench, &server, &["fleet", "abort", "campaign"]);
    assert_eq!(abort.code, Some(0), "{abort}");
    server.let_go();
    let (said, code) = flying.end();
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("drone 01 left the show before its end (flight mode rth)"), "{said}");
    assert!(said.contains("2 of 2 drones have landed"), "{said}");
    assert!(said.contains("Downloaded 2 of 2 logs"), "{said}");
}

#[test]
fn parameters_are_not_put_back_through_a_server() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    let ended = run(&bench, &server, &["fleet", "restore", "campaign"]);
    let dry = run(&bench, &server, &["fleet", "restore", "campaign", "--dry-run"]);
    assert_eq!(ended.to_string(), dry.to_string());
    assert!(server.asked().is_empty());
    insta::assert_snapshot!(ended.to_string());
}

#[test]
fn a_show_mode_that_the_server_has_no_name_for_is_one() {
    let (ended, _) = fly(&planned(), Fault::ModeByNumber);
    assert_eq!(ended.code, Some(0), "{ended}");
    assert!(ended.out.contains("mode 127"), "{ended}");
}

#[test]
fn drones_that_cannot_be_told_apart_or_are_not_there_are_named() {
    let mut said = refusals(&[Fault::SameSlot, Fault::NoPlace, Fault::Forgets, Fault::NoDrones]);
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::NoDrones);
    for words in [["fleet", "status"], ["logs", "list"], ["logs", "pull"]] {
        let ended = run(&bench, &server, &[&words[..], &["campaign", "--wait", "0"]].concat());
        let _ = write!(said, "\n{}\n{ended}", words.join(" "));
    }
    insta::assert_snapshot!(said);
}

#[test]
fn a_start_that_comes_too_late_or_cannot_be_taken_back_is_said() {
    let bench = planned();
    let late = Fake::start(&plan(&bench), Fault::LateStartTime);
    let args = ["fly", "campaign", "--yes", "--lead", "20", "--wait", "1"];
    let ended = run(&bench, &late, &args);
    assert_eq!(ended.code, Some(2), "{ended}");
    assert!(!late.is_authorized());
    assert!(ended.err.contains("s before the start it is too late to authorize it"), "{ended}");
    assert!(ended.err.contains("the start was cancelled"), "{ended}");
    let mut said = refusals(&[Fault::Gone("SHOW-SETCFG")]);
    let (uncleared, _) = fly(&planned(), Fault::NakClear);
    assert_eq!(uncleared.code, Some(0), "{uncleared}");
    let _ = write!(said, "\n{uncleared}");
    insta::assert_snapshot!(said);
}

#[test]
fn who_does_not_come_down_is_named() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::HoldsInFlight);
    server.let_go();
    let args = ["fly", "campaign", "--yes", "--lead", "60", "--no-logs"];
    let ended = run(&bench, &server, &args);
    assert_eq!(ended.code, Some(3), "{ended}");
    let abort = run(&bench, &server, &["fleet", "abort", "campaign"]);
    assert_eq!(abort.code, Some(0), "{abort}");
    let server = Fake::start(&plan(&bench), Fault::Disobeys);
    let flown = run(&bench, &server, &args);
    assert_eq!(flown.code, Some(3), "{flown}");
    let deaf = run(&bench, &server, &["fleet", "abort", "campaign"]);
    assert_eq!(deaf.code, Some(3), "{deaf}");
    insta::assert_snapshot!(format!("{ended}\n{abort}\n{deaf}"));
}

#[test]
fn steps_that_fail_have_their_exit_codes() {
    let bench = planned();
    let step = |fault, args: &[&str]| {
        let server = Fake::start(&plan(&bench), fault);
        let all = [args, &["campaign", "--wait", "1"]].concat();
        format!("{}\n{}\n", args.join(" "), run(&bench, &server, &all))
    };
    let mut said = step(Fault::Upload("file transfer failed"), &["fleet", "upload"]);
    said += &step(Fault::UploadTimeout, &["fleet", "upload", "--json"]);
    said += &step(Fault::Trouble, &["fleet", "preflight"]);
    said += &step(Fault::OneFlies, &["fleet", "upload"]);
    let (flown, _) = fly(&bench, Fault::LogBusy);
    assert_eq!(flown.code, Some(3), "{flown}");
    assert!(flown.err.contains("To try again: updraft logs pull campaign"), "{flown}");
    insta::assert_snapshot!(said);
}

#[test]
#[cfg(unix)]
fn a_signal_before_the_start_takes_it_back() {
    let (said, code, server) =
        ended_at("-INT", "Authorized", Fault::HoldsBeforeStart, &["--lead", "600"]);
    assert_eq!(code, Some(130), "{said}");
    assert!(!server.is_authorized(), "{said}");
    assert!(!server.asked().iter().any(|body| body["type"] == "UAV-RTH"), "{said}");
    assert!(said.contains("the start was cancelled; no drone takes off"), "{said}");
}

#[test]
#[cfg(unix)]
fn a_signal_in_flight_does_what_was_chosen() {
    for (signal, chosen, order, word) in [
        ("-INT", "return", "UAV-RTH", "this program has sent them home"),
        ("-TERM", "land", "UAV-LAND", "this program has ordered them to land"),
        ("-HUP", "leave", "", "the drones fly on by themselves"),
    ] {
        let more = ["--lead", "60", "--on-interrupt", chosen];
        let (said, code, server) = ended_at(signal, "take-off", Fault::HoldsInFlight, &more);
        assert_eq!(code, Some(130), "{said}");
        assert!(said.contains(word), "{said}");
        let asked = server.asked();
        let orders: Vec<&Value> = asked
            .iter()
            .filter(|body| ["UAV-RTH", "UAV-LAND"].contains(&body["type"].as_str().unwrap()))
            .collect();
        match order {
            "" => assert!(orders.is_empty(), "{orders:?}"),
            order => {
                assert_eq!(orders.len(), 1, "{orders:?}");
                assert_eq!(orders[0]["type"], order);
                assert_eq!(orders[0]["ids"], json!(["02", "01"]));
            }
        }
    }
}

#[test]
#[cfg(unix)]
fn drones_are_ordered_down_over_a_new_connection_when_the_old_one_is_broken() {
    let more = ["--lead", "60"];
    let (said, code, server) = ended_at("-INT", "take-off", Fault::GoneWhenOrdered, &more);
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains("drone 01: returns"), "{said}");
    let orders = server.asked().iter().filter(|body| body["type"] == "UAV-RTH").count();
    assert_eq!(orders, 2, "once in vain");
    let (said, code, _) = ended_at("-INT", "take-off", Fault::GoneForOrders, &more);
    assert_eq!(code, Some(130), "{said}");
    assert!(said.contains(": use Skybrush Live, or the remote controls"), "{said}");
}

#[test]
fn abort_brings_down_who_flies_and_takes_the_start_back() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::OneFlies);
    let all = run(&bench, &server, &["fleet", "abort", "campaign"]);
    let asked = server.asked();
    let rth = asked.iter().find(|body| body["type"] == "UAV-RTH").unwrap();
    assert_eq!(rth["ids"], json!(["01"]));
    assert_eq!(asked.last().unwrap()["configuration"]["start"]["authorized"], false);
    let one = run(&bench, &server, &["fleet", "land", "campaign", "--drones", "2"]);
    assert!(!server.asked().iter().any(|body| body["type"] == "UAV-LAND"));
    insta::assert_snapshot!(format!("{all}\n{one}"));
}

#[test]
fn nobody_at_the_address_is_said() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::None);
    server.stop();
    let ended = run(&bench, &server, &["logs", "list", "campaign"]);
    insta::assert_snapshot!(ended.to_string());
}

struct Stopwatch(Instant);

impl Stopwatch {
    #[expect(clippy::disallowed_methods, reason = "real sockets need a real clock")]
    fn start() -> Self {
        Self(Instant::now())
    }
}

impl Clock for Stopwatch {
    fn now(&self) -> Micros {
        self.0.elapsed().as_micros() as Micros
    }

    fn unix_us(&self) -> u64 {
        0
    }
}

#[test]
fn a_line_without_an_end_is_refused_at_its_limit() {
    let bench = planned();
    let server = Fake::start(&plan(&bench), Fault::Endless);
    let clock = Arc::new(Stopwatch::start());
    let client = Client::connect(&server.address.to_string(), clock).unwrap();
    let error = client.with_longest_line(1 << 20).version().unwrap_err();
    insta::assert_snapshot!(error.to_string());
}
