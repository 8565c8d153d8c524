//! Preflight, start, watch and abort with vehicles that do what they are told, in simulated time.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]
#![expect(clippy::items_after_statements, reason = "a test's helper beside its use")]

use std::collections::{BTreeMap, BTreeSet};

use crate::fleet::show::{A_WHILE, Fault, Net, Scripted, bad, drone, fleet, pass, plan, table};
use insta::assert_snapshot;
use updraft::base::time::GpsTime;
use updraft::fleet::abort::{ALL_AT_ONCE, Abort, Aborted, Action};
use updraft::fleet::changes::Changes;
use updraft::fleet::command::{Command, CommandError};
use updraft::fleet::dry_run::{Obliging, dry_run};
use updraft::fleet::greet::Greet;
use updraft::fleet::guided::{Guided, GuidedFlight};
use updraft::fleet::journal::{Entry, JOURNAL_FILE, Journal};
use updraft::fleet::messages::{self, GUIDED, LAND, RTL};
use updraft::fleet::params::{ListParams, ReadParams, SetParams};
use updraft::fleet::preflight::{Known, Limits, Preflight, preflight};
use updraft::fleet::required::{CheckParams, Difference, Requirement, Standing, requirements};
use updraft::fleet::slots::{self, FleetTable};
use updraft::fleet::start::{Start, StartOptions, StartPhase, StartRefusal};
use updraft::fleet::telemetry::Telemetry;
use updraft::fleet::vehicle_clock::VehicleClock;
use updraft::fleet::watch::{self, Monitor};
use updraft::link::clock::{MS, S};
use updraft::link::conversation::{Conversation, NoObserver, Step, run_all};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavResult};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::mission::Plan;
use updraft::protocol::show::{Stage, flag};
use updraft::show::Trajectory;
use updraft::virtual_fleet::lossy::Faults;

const READY: u8 = flag::LOADED | flag::ORIGIN_SET | flag::ORIENTATION_SET | flag::FENCE_ON;

/// A fleet that is ready to start, and what is known of it.
fn ready(plan: &Plan, faults: Faults, seed: u64) -> (Net, Telemetry) {
    let mut net = fleet(plan, true, faults, seed);
    for vehicle in net.vehicles.values_mut() {
        vehicle.inner.status.flags = READY;
    }
    let mut telemetry = Telemetry::default();
    pass(&mut net, A_WHILE, &mut telemetry);
    (net, telemetry)
}

fn all() -> BTreeSet<DroneId> {
    (1..=6).map(drone).collect()
}

fn known() -> Known {
    let params = all().into_iter().map(|id| (id, Standing::default())).collect();
    Known { loaded: all(), fenced: all(), params }
}

fn look(plan: &Plan, net: &Net, telemetry: &Telemetry, known: &Known) -> Preflight {
    preflight(plan, &table(plan), telemetry, known, &Limits::default(), net.now())
}

#[test]
fn a_fleet_that_is_ready_is_go() {
    let plan = plan();
    let (net, telemetry) = ready(&plan, Faults::default(), 1);
    let table = look(&plan, &net, &telemetry, &known());
    assert!(table.go(), "{table}");
    assert_snapshot!(table.to_string());
}

#[test]
fn every_no_go_is_said_in_words() {
    let plan = plan();
    let mut lines = Vec::new();
    let mut case = |change: &dyn Fn(&mut Net, &mut Telemetry, &mut Known)| {
        let (mut net, mut telemetry) = ready(&plan, Faults::default(), 1);
        let mut known = known();
        change(&mut net, &mut telemetry, &mut known);
        let seen = look(&plan, &net, &telemetry, &known).to_string();
        lines.extend(seen.lines().filter(|line| line.starts_with("NO-GO")).map(str::to_owned));
        assert!(!seen.contains("\nGO"), "{seen}");
    };
    let status = |change: fn(&mut updraft::protocol::show::Status)| {
        move |_: &mut Net, telemetry: &mut Telemetry, _: &mut Known| {
            let of = telemetry.drones.get_mut(&drone(1)).unwrap();
            change(&mut of.status.as_mut().unwrap().1);
        }
    };
    let of = |change: fn(&mut updraft::fleet::telemetry::Drone)| {
        move |_: &mut Net, telemetry: &mut Telemetry, _: &mut Known| {
            change(telemetry.drones.get_mut(&drone(1)).unwrap());
        }
    };
    case(&status(|status| status.flags &= !flag::LOADED));
    case(&status(|status| status.flags &= !flag::ORIGIN_SET));
    case(&status(|status| status.flags &= !flag::ORIENTATION_SET));
    case(&status(|status| status.flags &= !flag::FENCE_ON));
    case(&status(|status| status.flags |= flag::FENCE_BREACHED));
    case(&status(|status| status.flags |= flag::AUTHORIZED));
    case(&status(|status| status.flags |= flag::NO_GPS_TIME));
    case(&status(|status| {
        status.flags |= flag::START_SET;
        status.start_tow_s = 7;
    }));
    case(&status(|status| status.preflight = 8));
    case(&status(|status| status.preflight = 1));
    case(&status(|status| status.stage = Stage::Landed));
    case(&status(|status| status.stage = Stage::Off));
    case(&status(|status| status.stage = Stage::Error));
    case(&status(|status| status.stage = Stage::Init));
    case(&of(|of| of.gps.as_mut().unwrap().1.fix = 2));
    case(&of(|of| of.gps.as_mut().unwrap().1.satellites = 5));
    case(&of(|of| of.gps.as_mut().unwrap().1.h_acc_m = Some(4.0)));
    case(&of(|of| of.health.as_mut().unwrap().1.prearm_ok = Some(false)));
    case(&of(|of| of.health.as_mut().unwrap().1.prearm_ok = None));
    case(&of(|of| of.health.as_mut().unwrap().1.battery_percent = Some(20)));
    case(&of(|of| of.health.as_mut().unwrap().1.battery_percent = None));
    case(&of(|of| of.armed.as_mut().unwrap().1 = true));
    case(&of(|of| of.position.as_mut().unwrap().1.lat_deg += 2.4e-5));
    case(&of(|of| of.position.as_mut().unwrap().1.lat_deg += 3e-5));
    case(&of(|of| of.position.as_mut().unwrap().1.lat_deg += 1.0));
    case(&of(|of| of.position = None));
    case(&of(|of| *of = updraft::fleet::telemetry::Drone::default()));
    case(&of(|of| of.clock = VehicleClock::default()));
    case(&|_, _, known| {
        known.loaded.remove(&drone(1));
    });
    case(&|_, _, known| {
        known.params.remove(&drone(1));
    });
    case(&|_, _, known| {
        let wrong = |requirement: &Requirement| Difference {
            requirement: requirement.clone(),
            is: (requirement.name != "FENCE_ENABLE").then_some(7.0),
        };
        let required = requirements(&plan, true);
        let standing = known.params.get_mut(&drone(1)).unwrap();
        standing.wrong = required.iter().take(5).map(wrong).collect();
    });
    case(&|net, telemetry, _| {
        net.vehicles.get_mut(&drone(1)).unwrap().fault = Fault::Silent;
        pass(net, A_WHILE, telemetry);
    });
    case(&|net, telemetry, _| {
        net.faults.loss = 0.7;
        pass(net, 40 * S, telemetry);
    });
    case(&|_, telemetry, _| {
        let of = telemetry.drones[&drone(1)].clone();
        telemetry.drones.insert(drone(9), of);
    });
    case(&|net, telemetry, _| {
        net.vehicles.get_mut(&drone(1)).unwrap().inner.unix_us += 3_000_000;
        pass(net, 40 * S, telemetry);
    });
    assert_snapshot!(lines.join("\n"));
}

/// Broadcasts what is due for so long.
fn cast(net: &mut Net, telemetry: &mut Telemetry, start: &mut Start, for_us: u64) -> u32 {
    let (until, mut sent) = (net.now() + for_us, 0);
    while net.now() < until {
        if let Some(message) = start.due(telemetry, net.now()) {
            net.broadcast(&message).unwrap();
            sent += 1;
        }
        pass(net, 50 * MS, telemetry);
    }
    sent
}

#[test]
fn a_start_is_set_then_authorized_and_can_be_cancelled() {
    let plan = plan();
    for (seed, faults) in (0..10).map(|seed| (seed, bad())).chain([(0, Faults::default())]) {
        let (mut net, mut telemetry) = ready(&plan, faults, seed);
        let options = StartOptions { lead_s: 60.0, ..StartOptions::default() };
        let mut start = Start::announce(all(), &telemetry, options, net.now()).unwrap();
        let left_s = start.left_s(&telemetry, net.now()).unwrap();
        assert!((60.0..61.1).contains(&left_s), "{left_s}");
        let late = start.authorize(&telemetry, net.now()).unwrap_err();
        assert!(matches!(late, StartRefusal::Late { .. }), "{late}");
        let sent = cast(&mut net, &mut telemetry, &mut start, 15 * S);
        assert!((15..=16).contains(&sent), "{sent}");
        assert!(start.late(&telemetry, net.now()).is_empty());
        let armed = |net: &Net| {
            net.vehicles.values().filter(|v| v.inner.status.has(flag::AUTHORIZED)).count()
        };
        assert_eq!(armed(&net), 0, "nothing is authorized by a time");
        start.authorize(&telemetry, net.now()).unwrap();
        cast(&mut net, &mut telemetry, &mut start, 15 * S);
        assert!(start.late(&telemetry, net.now()).is_empty());
        assert_eq!(armed(&net), 6);
        start.cancel(net.now());
        cast(&mut net, &mut telemetry, &mut start, 15 * S);
        assert!(start.late(&telemetry, net.now()).is_empty());
        assert!(net.vehicles.values().all(|v| v.inner.status.start_tow_s == -1));
        assert_eq!(start.phase(), StartPhase::Cancelled);
    }
}

#[test]
fn nothing_is_broadcast_after_the_start() {
    let plan = plan();
    let (mut net, mut telemetry) = ready(&plan, Faults::default(), 1);
    let mut start = Start::announce(all(), &telemetry, StartOptions::default(), net.now()).unwrap();
    cast(&mut net, &mut telemetry, &mut start, 32 * S);
    assert_eq!(cast(&mut net, &mut telemetry, &mut start, 10 * S), 0);
}

#[test]
fn every_refusal_of_a_start_is_said() {
    let plan = plan();
    let (mut net, mut telemetry) = ready(&plan, Faults::default(), 1);
    let mut lines = Vec::new();
    let lead = |lead_s| StartOptions { lead_s, ..StartOptions::default() };
    let now = net.now();
    let mut announce = |drones, telemetry: &Telemetry, lead_s| {
        let refused = Start::announce(drones, telemetry, lead(lead_s), now).unwrap_err();
        lines.push(refused.to_string());
    };
    announce(BTreeSet::new(), &telemetry, 30.0);
    announce(all(), &telemetry, 5.0);
    announce(all(), &telemetry, f64::NAN);
    announce(BTreeSet::from([drone(1), drone(7), drone(8)]), &telemetry, 30.0);
    let mut apart = telemetry.clone();
    let ahead = telemetry.drones[&drone(2)].clock.gps_ms(now).unwrap() as u64;
    let unix_us = (ahead + 315_964_800_000 - 18_000 + 1_600) * 1000;
    apart.drones.get_mut(&drone(2)).unwrap().clock.read(now, unix_us);
    announce(all(), &apart, 30.0);

    let mut start = Start::announce(all(), &telemetry, lead(30.0), now).unwrap();
    net.vehicles.get_mut(&drone(4)).unwrap().fault = Fault::Silent;
    cast(&mut net, &mut telemetry, &mut start, 8 * S);
    net.vehicles.get_mut(&drone(5)).unwrap().inner.status.start_tow_s = 5;
    net.vehicles.get_mut(&drone(6)).unwrap().inner.status.start_tow_s = -1;
    pass(&mut net, 900 * MS, &mut telemetry);
    lines.push(start.authorize(&telemetry, net.now()).unwrap_err().to_string());
    cast(&mut net, &mut telemetry, &mut start, 14 * S);
    lines.push(start.authorize(&telemetry, net.now()).unwrap_err().to_string());
    assert_snapshot!(lines.join("\n"));
}

#[test]
fn an_abort_reaches_everyone_at_once() {
    let plan = plan();
    for (seed, faults) in (0..10).map(|seed| (seed, bad())).chain([(0, Faults::default())]) {
        let (mut net, mut telemetry) = ready(&plan, faults, seed);
        for (id, vehicle) in &mut net.vehicles {
            let inner = &mut vehicle.inner;
            inner.armed = id.system != 6;
            inner.status.stage =
                if id.system < 5 { Stage::Performing } else { Stage::WaitForStart };
            inner.status.flags |= flag::AUTHORIZED | flag::START_SET;
            inner.status.start_tow_s = 443_029;
        }
        pass(&mut net, 5 * S, &mut telemetry);
        let began = net.now();
        let conversations: BTreeMap<_, _> = all()
            .into_iter()
            .map(|id| (id, Abort::new(id, Action::Return, telemetry.get(id))))
            .collect();
        let done = run_all(&mut net, conversations, ALL_AT_ONCE, &mut NoObserver).unwrap();
        assert_eq!(done.len(), 6);
        for (id, aborted) in done {
            let inner = &net.vehicles[&id].inner;
            match id.system {
                1..=4 => {
                    assert_eq!(aborted, Aborted::Confirmed(Action::Return), "{id}");
                    assert_eq!(inner.mode, RTL);
                    assert!(!inner.status.has(flag::AUTHORIZED), "{id}: its start stays");
                }
                5 => assert!(!inner.armed || inner.mode == LAND, "{id} {aborted}"),
                _ => {
                    assert_eq!(aborted, Aborted::Grounded);
                    assert!(!inner.status.has(flag::AUTHORIZED));
                }
            }
        }
        assert!(net.now() - began < 10 * S, "{} us", net.now() - began);
    }
}

#[test]
fn a_return_that_is_refused_becomes_a_landing_and_silence_is_said() {
    let plan = plan();
    let (mut net, _) = ready(&plan, Faults::default(), 1);
    for vehicle in net.vehicles.values_mut() {
        vehicle.inner.armed = true;
        vehicle.inner.status.stage = Stage::Performing;
    }
    net.vehicles.get_mut(&drone(2)).unwrap().fault = Fault::Silent;
    pass(&mut net, 100 * MS, &mut NoObserver);
    struct NoReturn(Abort);
    impl Conversation for NoReturn {
        type Done = Aborted;
        fn on_message(&mut self, now: u64, message: &MavMessage) {
            // The vehicle's acknowledgement, turned into a refusal while a return is asked for.
            self.0.on_message(now, message);
        }
        fn poll(&mut self, now: u64) -> Step<Aborted> {
            self.0.poll(now)
        }
    }
    let mut refused = NoReturn(Abort::new(drone(1), Action::Return, None));
    let _ = refused.poll(0);
    for _ in 0..3 {
        refused.on_message(
            1,
            &MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA {
                command: MavCmd::MAV_CMD_DO_SET_MODE,
                result: MavResult::MAV_RESULT_FAILED,
                ..Default::default()
            }),
        );
    }
    let conversations = BTreeMap::from([
        (drone(1), refused),
        (drone(2), NoReturn(Abort::new(drone(2), Action::Land, None))),
    ]);
    let done = run_all(&mut net, conversations, ALL_AT_ONCE, &mut NoObserver).unwrap();
    assert_eq!(done[&drone(1)], Aborted::Confirmed(Action::Land));
    assert_snapshot!(done[&drone(2)], @"NOT CONFIRMED after 600 tries: use its remote control");
}

#[test]
fn a_drone_that_waits_in_guided_is_taken_from_its_station() {
    let plan = plan();
    let mut net = fleet(&plan, false, Faults::default(), 1);
    net.vehicles.get_mut(&drone(1)).unwrap().inner.mode = GUIDED;
    let aborted = run(&mut net, Abort::new(drone(1), Action::Return, None));
    assert_eq!(aborted, Aborted::Grounded);
    assert_eq!(net.vehicles[&drone(1)].inner.mode, LAND);
    // The station that was about to fly it sends nothing more.
    let trajectory = plan.trajectory(&plan.slots[0]);
    let mut clock = VehicleClock::default();
    clock.read(0, 1_795_143_537_000_000);
    let start_gps_ms = clock.gps_ms(0).unwrap() as i64 + 60_000;
    let frame = plan.site.frame();
    let flight = GuidedFlight { trajectory, frame, start_gps_ms, yaw_rad: None, clock };
    let mut conversation = Guided::new(drone(1), flight);
    let beat = |custom_mode| {
        MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA { custom_mode, ..Default::default() })
    };
    conversation.on_message(S, &beat(GUIDED));
    assert!(matches!(conversation.poll(S), Step::Wait(_)));
    conversation.on_message(2 * S, &beat(LAND));
    let Step::Done(Err(error)) = conversation.poll(2 * S) else { panic!("it goes on") };
    assert_snapshot!(error, @"the drone left GUIDED (LAND) at -58 s: nothing more was sent to it");
}

#[test]
fn slots_are_held_against_where_drones_stand() {
    let plan = plan();
    let (net, telemetry) = ready(&plan, Faults::default(), 1);
    let now = net.now();
    let right = table(&plan);
    assert_eq!(slots::check_stands(&plan, &right, &telemetry, now), []);
    assert_eq!(slots::propose(&plan, &telemetry, now), Ok(right.clone()));
    let mut lines = vec![slots::picture(&plan, &telemetry, now)];
    let mut case = |what: &str, table: &FleetTable, telemetry: &Telemetry| {
        lines.push(format!("-- {what}"));
        let problems = slots::check_stands(&plan, table, telemetry, now);
        lines.extend(problems.iter().map(ToString::to_string));
    };
    let pairs = |pairs: &[(u8, u16)]| {
        FleetTable::new(pairs.iter().map(|(system, slot)| (drone(*system), *slot)))
    };
    let swapped = pairs(&[(2, 1), (1, 2), (3, 3), (4, 4), (5, 5), (6, 6)]);
    case("swapped", &swapped, &telemetry);
    let doubled = pairs(&[(1, 1), (2, 1), (3, 3), (4, 4), (5, 5), (6, 6), (6, 9)]);
    case("doubled, empty, too many", &doubled, &telemetry);
    let mut moved = telemetry.clone();
    moved.drones.get_mut(&drone(1)).unwrap().position.as_mut().unwrap().1.lat_deg += 3e-5;
    let second = moved.drones[&drone(2)].position;
    moved.drones.get_mut(&drone(3)).unwrap().position = second;
    moved.drones.remove(&drone(4));
    case("moved, two on one, silent", &right, &moved);
    lines.push("-- proposal".to_owned());
    lines.extend(slots::propose(&plan, &moved, now).unwrap_err().iter().map(ToString::to_string));
    lines.push(slots::picture(&plan, &moved, now));
    assert_snapshot!(lines.join("\n"));

    let folder = tempfile::tempdir().unwrap();
    right.write(folder.path()).unwrap();
    assert_eq!(FleetTable::read(folder.path()).unwrap(), right);
}

fn run<C: Conversation>(net: &mut Net, conversation: C) -> C::Done {
    crate::fleet::show::one(net, conversation)
}

#[test]
fn parameters_are_checked_mended_and_put_back() {
    let plan = plan();
    for (seed, faults) in [(1, Faults::default()), (2, bad()), (3, bad())] {
        let (mut net, _) = ready(&plan, faults, seed);
        let inner = &mut net.vehicles.get_mut(&drone(1)).unwrap().inner;
        inner.only_these_params = true;
        let required = requirements(&plan, true);
        for requirement in &required {
            inner.params.insert(requirement.name.to_owned(), requirement.wanted.mend(0.0));
        }
        inner.params.insert("LOG_FILE_DSRMROT".to_owned(), 0.0);
        inner.params.insert("LOG_BITMASK".to_owned(), 65_535.0);
        inner.params.insert("RTL_ALT".to_owned(), 9_000.0);
        inner.params.remove("SHOW_SYNC_MODE");
        let before = inner.params.clone();
        let seen = run(&mut net, CheckParams::new(drone(1), required.clone(), false));
        assert!(seen.changed.is_empty() && !seen.is_right());
        if seed == 1 {
            let wrong: Vec<String> = seen.wrong.iter().map(ToString::to_string).collect();
            assert_snapshot!("parameters", wrong.join("\n"));
        }
        assert_eq!(net.vehicles[&drone(1)].inner.params, before, "nothing is changed unasked");
        let mended = run(&mut net, CheckParams::new(drone(1), required, true));
        assert_eq!((mended.wrong.len(), mended.changed.len()), (1, 3), "{mended:?}");
        assert_eq!(net.vehicles[&drone(1)].inner.params["LOG_BITMASK"], 196_607.0);
        let mut changes = Changes::default();
        changes.add(drone(1), &mended.changed);
        let again = mended
            .changed
            .iter()
            .map(|change| updraft::fleet::changes::Change { was: change.now, ..change.clone() });
        changes.add(drone(1), &again.collect::<Vec<_>>());
        run_all(&mut net, changes.restore(|_, change| !change.unfences()), 9, &mut NoObserver)
            .unwrap()[&drone(1)]
            .clone()
            .unwrap();
        assert_eq!(net.vehicles[&drone(1)].inner.params, before, "the first old value counts");
    }
}

#[test]
fn parameters_are_listed_read_and_set_over_a_bad_link() {
    let plan = plan();
    for seed in 0..5 {
        let (mut net, _) = ready(&plan, bad(), seed);
        let inner = &mut net.vehicles.get_mut(&drone(1)).unwrap().inner;
        inner.only_these_params = true;
        inner.params = (0..300).map(|n| (format!("P{n}"), n as f32)).collect();
        let wanted = inner.params.clone();
        assert_eq!(run(&mut net, ListParams::new(drone(1))), Ok(wanted), "seed {seed}");
        let names = ["P7", "NONE", "P9"].map(str::to_owned);
        let read = run(&mut net, ReadParams::new(drone(1), names));
        assert_eq!(read, BTreeMap::from([("P7".to_owned(), 7.0), ("P9".to_owned(), 9.0)]));
        let set = SetParams::new(drone(1), [("P7".to_owned(), 1.5), ("P9".to_owned(), -2.0)]);
        run(&mut net, set).unwrap();
        let params = &net.vehicles[&drone(1)].inner.params;
        assert_eq!((params["P7"], params["P9"]), (1.5, -2.0));
    }
    let (mut net, _) = ready(&plan, Faults::default(), 1);
    net.vehicles.get_mut(&drone(1)).unwrap().fault = Fault::Silent;
    let set = run(&mut net, SetParams::new(drone(1), [("P7".to_owned(), 1.5)]));
    let list = run(&mut net, ListParams::new(drone(1)));
    assert_snapshot!(format!("{}\n{}", set.unwrap_err(), list.unwrap_err()), @"
    no answer when P7 is set to 1.5: the firmware has no such parameter, or the radio does not reach the drone
    only 0 of 0 parameters arrived: bring the drone nearer to the radio and try again
    ");
}

#[test]
fn commands_wait_while_a_vehicle_works() {
    let ack = |result| {
        MavMessage::COMMAND_ACK(dialect::COMMAND_ACK_DATA {
            command: MavCmd::MAV_CMD_USER_1,
            result,
            ..Default::default()
        })
    };
    let message = messages::command_long(drone(1), MavCmd::MAV_CMD_USER_1, [0.0; 7], 0);
    let mut command = Command::new("load the show", message);
    use updraft::link::conversation::Step;
    assert!(matches!(command.poll(0), Step::Send(_)));
    command.on_message(1, &ack(MavResult::MAV_RESULT_IN_PROGRESS));
    assert!(matches!(command.poll(20 * S), Step::Wait(_)), "not repeated while it works");
    assert!(matches!(command.poll(31 * S), Step::Done(Err(CommandError::Silent { .. }))));
    command.on_message(31 * S, &ack(MavResult::MAV_RESULT_ACCEPTED));
    assert!(matches!(command.poll(31 * S), Step::Done(Ok(()))));
}

#[test]
fn a_greeting_gives_clock_and_version() {
    let plan = plan();
    let mut net = fleet(&plan, true, bad(), 4);
    let greeted = run(&mut net, Greet::new(drone(1)));
    assert!(greeted.clock && greeted.version);
}

#[test]
fn a_stock_vehicle_is_guided_along_its_trajectory() {
    let plan = plan();
    let trajectory = plan.trajectory(&plan.slots[1]);
    let frame = plan.site.frame();
    let mut vehicle = Obliging::new(drone(2), false, frame.to_geodetic(trajectory.start_m));
    let start_gps_ms =
        GpsTime::from_unix_ms((vehicle.unix_us / 1000) as i64 + 30_000).unwrap().total_ms();
    let flight = GuidedFlight {
        trajectory: trajectory.clone(),
        frame,
        start_gps_ms,
        yaw_rad: None,
        clock: VehicleClock::default(),
    };
    let (lines, done) = dry_run(Guided::new(drone(2), flight), &mut vehicle, 100_000);
    assert_eq!(done, Some(Ok(())));
    let targets = lines.iter().filter(|line| line.contains("SET_POSITION_TARGET")).count();
    let flown_s = targets as f64 / 10.0;
    let duration_s = trajectory.duration_ms() as f64 / 1000.0;
    assert!((duration_s - 4.0..duration_s).contains(&flown_s), "{flown_s} of {duration_s} s");
    let shown = lines[..12].iter().chain(&lines[lines.len() - 3..]);
    assert_snapshot!(shown.cloned().collect::<Vec<_>>().join("\n"));
}

#[test]
fn stock_vehicles_are_guided_over_a_slow_link_and_watched() {
    let plan = plan();
    let faults = Faults { loss: 0.05, delay: 100 * MS, jitter: 20 * MS, ..Faults::default() };
    let mut net = fleet(&plan, false, faults, 3);
    let mut telemetry = Telemetry::default();
    pass(&mut net, A_WHILE, &mut telemetry);
    let table = slots::propose(&plan, &telemetry, net.now()).unwrap();
    let now_ms = telemetry.drones[&drone(1)].clock.gps_ms(net.now()).unwrap();
    let start_gps_ms = (now_ms / 1000.0).ceil() as i64 * 1000 + 20_000;
    let guided = |id: DroneId| {
        let flight = GuidedFlight {
            trajectory: plan.trajectory(plan.slot(id.system.into()).unwrap()),
            frame: plan.site.frame(),
            start_gps_ms,
            yaw_rad: Some(0.0),
            clock: telemetry.drones[&id].clock.clone(),
        };
        (id, Guided::new(id, flight))
    };
    let conversations: BTreeMap<_, _> = all().into_iter().map(guided).collect();
    let mut monitor = Monitor::new(&plan, &table, telemetry, watch::Limits::of(&plan));
    monitor.set_start(Some(start_gps_ms));
    let done = run_all(&mut net, conversations, ALL_AT_ONCE, &mut monitor).unwrap();
    assert!(done.values().all(Result::is_ok), "{done:?}");
    let events = monitor.take_events();
    assert!(!events.iter().any(|told| told.event.is_alarm()), "{events:?}");
    pass(&mut net, 5 * S, &mut monitor);
    assert!(monitor.is_over());
}

#[test]
fn every_refusal_of_a_guided_flight_is_said() {
    let plan = plan();
    let trajectory = plan.trajectory(&plan.slots[1]);
    let frame = plan.site.frame();
    let place = frame.to_geodetic(trajectory.start_m);
    let start = |ahead_s: i64| {
        let unix_ms = (Obliging::new(drone(2), false, place).unix_us / 1000) as i64;
        GpsTime::from_unix_ms(unix_ms + ahead_s * 1000).unwrap().total_ms()
    };
    let flight = |trajectory: &Trajectory, ahead_s| GuidedFlight {
        trajectory: trajectory.clone(),
        frame,
        start_gps_ms: start(ahead_s),
        yaw_rad: None,
        clock: VehicleClock::default(),
    };
    let mut lines = Vec::new();
    let mut case = |trajectory: &Trajectory, ahead_s, fault: Fault| {
        let vehicle = Scripted::new(Obliging::new(drone(2), false, place), fault);
        let mut net = Net::new(BTreeMap::from([(drone(2), vehicle)]), Faults::default(), 1);
        let conversation = Guided::new(drone(2), flight(trajectory, ahead_s));
        let conversations = BTreeMap::from([(drone(2), conversation)]);
        let done = run_all(&mut net, conversations, 1, &mut NoObserver).unwrap();
        lines.push(done[&drone(2)].as_ref().unwrap_err().to_string());
    };
    case(&Trajectory::default(), 30, Fault::None);
    case(&trajectory, 30, Fault::Silent);
    case(&trajectory, -30, Fault::None);
    let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
    case(&trajectory, 30, Fault::Refuses(arm, MavResult::MAV_RESULT_FAILED));
    let takeoff = MavCmd::MAV_CMD_NAV_TAKEOFF;
    case(&trajectory, 30, Fault::Ignores(takeoff));
    assert_snapshot!(lines.join("\n"));
}

#[test]
fn a_monitor_tells_what_goes_wrong() {
    let plan = plan();
    let (mut net, telemetry) = ready(&plan, Faults::default(), 1);
    let start = telemetry.drones[&drone(1)].clock.gps_ms(net.now()).unwrap() as i64 - 15_000;
    let mut monitor = Monitor::new(&plan, &table(&plan), telemetry, watch::Limits::of(&plan));
    monitor.set_start(Some(start));
    pass(&mut net, S, &mut monitor);
    assert_eq!(monitor.take_events(), []);
    for vehicle in net.vehicles.values_mut() {
        vehicle.inner.armed = true;
        vehicle.inner.status.stage = Stage::Performing;
        vehicle.inner.above_home_m = 30.0;
    }
    let change = |net: &mut Net, system: u8, change: fn(&mut Scripted)| {
        change(net.vehicles.get_mut(&drone(system)).unwrap());
    };
    change(&mut net, 1, |v| v.inner.above_home_m = 20.0);
    change(&mut net, 2, |v| v.inner.status.flags |= flag::FENCE_BREACHED);
    change(&mut net, 3, |v| v.fault = Fault::Silent);
    change(&mut net, 4, |v| v.inner.mode = RTL);
    change(&mut net, 5, |v| v.inner.status.stage = Stage::Error);
    pass(&mut net, 5 * S, &mut monitor);
    change(&mut net, 1, |v| v.inner.above_home_m = 30.0);
    change(&mut net, 3, |v| v.fault = Fault::None);
    change(&mut net, 6, |v| v.inner.armed = false);
    pass(&mut net, 3 * S, &mut monitor);
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::open(folder.path()).unwrap();
    let events = monitor.take_events();
    for told in &events {
        let (unix_us, drone) = (1_795_143_537_000_000 + told.at, Some(told.drone));
        journal.write(&Entry { unix_us, drone, event: &told.event }).unwrap();
    }
    let text = |told: &watch::Told| {
        let mark = if told.event.is_alarm() { " !" } else { "" };
        format!("{:.1} s drone {}: {}{mark}", told.at as f64 / 1e6, told.drone, told.event)
    };
    let lines: Vec<String> = events.iter().map(text).collect();
    assert_snapshot!("events", lines.join("\n"));
    let written = std::fs::read_to_string(folder.path().join(JOURNAL_FILE)).unwrap();
    assert_snapshot!("journal", written);
}
