//! The gate between station and drones: every subcommand's messages, for every state of a drone,
//! heard or not; and drones that were ordered down.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Write as _;
use std::rc::Rc;

use crate::fleet::show::{bad, drone, load, plan, table};
use nalgebra::Vector3;
use updraft::base::time::GpsTime;
use updraft::fleet::abort::{Abort, Action};
use updraft::fleet::changes::{Change, Changes};
use updraft::fleet::command::Command;
use updraft::fleet::dry_run::Obliging;
use updraft::fleet::fence::{PutFence, fence_of};
use updraft::fleet::ftp::Caller;
use updraft::fleet::ftp::list::List;
use updraft::fleet::ftp::sum::Sum;
use updraft::fleet::gate::{Class, Gate, Protection, State, class};
use updraft::fleet::greet::Greet;
use updraft::fleet::guided::{Guided, GuidedFlight};
use updraft::fleet::log_protocol::list::LogList;
use updraft::fleet::messages::{GUIDED, LAND, RTL, ftp, param_set, set_mode, start_packet, text};
use updraft::fleet::order_handler::{Notice, OrderHandler};
use updraft::fleet::orders::{Inbox, OrderFrom, give};
use updraft::fleet::params::ReadParams;
use updraft::fleet::required::{CheckParams, requirements};
use updraft::fleet::upload::Upload;
use updraft::fleet::vehicle_clock::VehicleClock;
use updraft::link::clock::{Micros, S};
use updraft::link::conversation::{Conversation, Observer, Step, run_all};
use updraft::link::error::{NetError, Refusal};
use updraft::link::frame::MavMessage;
use updraft::link::frame::dialect::{self, MavCmd, MavModeFlag};
use updraft::link::id::DroneId;
use updraft::link::net::{Net, Received};
use updraft::mission::Plan;
use updraft::protocol::ftp::{Op, Packet};
use updraft::protocol::show::{
    CLEAR_TIME, FROM_DRONE, LEAVE_TIME, SHOW_FILE, Stage, StartConfig, Status, flag,
};
use updraft::virtual_fleet::endpoint::Endpoint;
use updraft::virtual_fleet::lossy::{Faults, LossyNet};

/// A net that says what it is told to, at a time that stands still.
#[derive(Default)]
struct Still {
    now: Micros,
    said: VecDeque<Received>,
    sent: Vec<MavMessage>,
    ordered: BTreeMap<DroneId, bool>,
}

impl Net for Still {
    fn now(&self) -> Micros {
        self.now
    }

    fn recv(&mut self, _: Micros) -> Result<Option<Received>, NetError> {
        Ok(self.said.pop_front())
    }

    fn send(&mut self, _: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.sent.push(message.clone());
        Ok(())
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.sent.push(message.clone());
        Ok(())
    }

    fn heard(&self) -> Vec<DroneId> {
        Vec::new()
    }

    fn ordered_down(&self) -> BTreeMap<DroneId, bool> {
        self.ordered.clone()
    }
}

fn beat(armed: bool) -> MavMessage {
    let mut base_mode = MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
    base_mode.set(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, armed);
    MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA { base_mode, ..Default::default() })
}

fn status(stage: Stage, start: Option<i32>, flags: u8) -> MavMessage {
    let status = Status {
        start_tow_s: start.unwrap_or(-1),
        colour: 0,
        flags,
        preflight: 0,
        stage,
        gps_fix: 6,
        satellites: 20,
        boot_count: 1,
        is_far: false,
        elapsed_s: None,
    };
    let (mavtype, len, data) = (FROM_DRONE, Status::LENGTH, status.to_data());
    MavMessage::DATA16(dialect::DATA16_DATA { mavtype, len, data })
}

/// What a drone says in each state that it can be in, and for how long it has been silent.
fn situations() -> Vec<(&'static str, Vec<MavMessage>, Micros)> {
    let authorized = flag::AUTHORIZED | flag::START_SET;
    let flying = |stage| vec![beat(true), status(stage, Some(5), authorized)];
    vec![
        ("disarmed, stock", vec![beat(false)], 0),
        ("disarmed, off", vec![beat(false), status(Stage::Off, None, 0)], 0),
        ("disarmed, waiting", vec![beat(false), status(Stage::WaitForStart, None, 0)], 0),
        ("start set", vec![beat(false), status(Stage::WaitForStart, Some(5), flag::START_SET)], 0),
        ("landed", vec![beat(false), status(Stage::Landed, Some(5), authorized)], 0),
        ("error", vec![beat(false), status(Stage::Error, Some(5), authorized)], 0),
        ("authorized", vec![beat(false), status(Stage::WaitForStart, Some(5), authorized)], 0),
        ("armed, waiting", flying(Stage::WaitForStart), 0),
        ("take-off", flying(Stage::Takeoff), 0),
        ("performing", flying(Stage::Performing), 0),
        ("returning", flying(Stage::ReturnToLaunch), 0),
        ("loiter", flying(Stage::Loiter), 0),
        ("landing", flying(Stage::Landing), 0),
        ("taken over, RTL", flying(Stage::Off), 0),
        ("armed, stock", vec![beat(true)], 0),
        ("disarmed, 6 s ago", vec![beat(false), status(Stage::WaitForStart, None, 0)], 6 * S),
        ("performing, 6 s ago", flying(Stage::Performing), 6 * S),
        ("without heartbeat", vec![status(Stage::WaitForStart, None, 0)], 0),
        ("never heard", Vec::new(), 0),
    ]
}

/// What a conversation sends to a drone with which all goes well.
fn sends<C: Conversation>(mut conversation: C, vehicle: &mut Obliging) -> Vec<MavMessage> {
    let (mut sent, mut now, mut heard) = (Vec::new(), 0, Vec::new());
    while now < 600 * S && sent.len() < 5_000 {
        let wake = vehicle.poll(now, &mut heard);
        for message in heard.drain(..) {
            conversation.on_message(now, &message);
        }
        match conversation.poll(now) {
            Step::Send(message) => {
                vehicle.on_message(now, &message, &mut heard);
                sent.push(*message);
            }
            Step::Wait(until) if heard.is_empty() => now = until.min(wake).max(now + 1),
            Step::Wait(_) => {}
            Step::Done(_) => return sent,
        }
    }
    sent
}

fn vehicle(plan: &Plan, show: bool) -> Obliging {
    let home = Vector3::from(plan.slots[0].home_m);
    Obliging::new(drone(1), show, plan.site.frame().to_geodetic(home))
}

fn flight(plan: &Plan, system: u8, vehicle: &Obliging) -> Guided {
    let start = GpsTime::from_unix_ms((vehicle.unix_us / 1000) as i64 + 15_000).unwrap();
    let flight = GuidedFlight {
        trajectory: plan.trajectory(plan.slot(system.into()).unwrap()),
        frame: plan.site.frame(),
        start_gps_ms: start.total_ms(),
        yaw_rad: None,
        clock: VehicleClock::default(),
    };
    Guided::new(drone(system), flight)
}

/// The messages of every subcommand.
fn subcommands(plan: &Plan) -> BTreeMap<&'static str, Vec<MavMessage>> {
    let (shown, stock) = (|| vehicle(plan, true), || vehicle(plan, false));
    let fence = fence_of(plan, &plan.to_show()).unwrap();
    let names = || fence.params().into_iter().map(|(name, _)| name);
    let greet = sends(Greet::new(drone(1)), &mut shown());
    let read = |may| {
        let required = requirements(plan, true);
        sends(CheckParams::new(drone(1), required, may), &mut shown())
    };
    let caller = || Caller::new(drone(1), 7);
    let sum = sends(Sum::new(caller(), SHOW_FILE, 100, 10 * S), &mut shown());
    let remember = sends(ReadParams::new(drone(1), names()), &mut shown());
    let load = sends(Upload::new(drone(1), load(plan, 1), 3), &mut shown());
    let packet = |start_tow_s, authorization, countdown_ms| {
        start_packet(&StartConfig { start_tow_s, authorization, countdown_ms })
    };
    let start = vec![
        packet(443_029, 0, LEAVE_TIME),
        packet(443_029, 1, LEAVE_TIME),
        packet(CLEAR_TIME, 0, CLEAR_TIME),
    ];
    let mut guided = sends(PutFence::new(drone(1), fence.clone()), &mut stock());
    let mode = Command::new("go into guided mode", set_mode(drone(1), GUIDED, 0));
    guided.extend(sends(mode, &mut stock()));
    guided.extend(sends(flight(plan, 1, &stock()), &mut stock()));
    let mut changes = Changes::default();
    let change = |(name, was): (&str, f32)| Change { name: name.to_owned(), was, now: 9.0 };
    let old = [
        ("LOG_FILE_DSRMROT", 0.0),
        ("BATT_FS_LOW_ACT", 0.0),
        ("FENCE_ALT_MAX", 500.0),
        ("FENCE_TYPE", 0.0),
        ("FENCE_ACTION", 0.0),
        ("FENCE_ENABLE", 0.0),
    ];
    changes.add(drone(1), &old.map(change));
    let restore = |off: bool| {
        let conversations = changes.restore(|_, change| off || !change.unfences());
        conversations.into_values().flat_map(|set| sends(set, &mut shown())).collect::<Vec<_>>()
    };
    let end = |action| {
        let mut flying = shown();
        flying.armed = true;
        flying.status.stage = Stage::Performing;
        sends(Abort::new(drone(1), action, None), &mut flying)
    };
    let list = sends(LogList::new(drone(1), 3 * S), &mut shown());
    let mut logs = sends(List::new(caller(), "/APM/LOGS", 3 * S), &mut shown());
    logs.extend(list.clone());
    logs.extend(sum.clone());
    let reads =
        [Op::OpenFileRO, Op::ReadFile, Op::BurstReadFile, Op::TerminateSession, Op::ResetSessions];
    logs.extend(reads.map(|op| ftp(drone(1), &Packet::request(op))));
    logs.push(MavMessage::LOG_REQUEST_DATA(dialect::LOG_REQUEST_DATA_DATA::default()));
    logs.push(MavMessage::LOG_REQUEST_END(dialect::LOG_REQUEST_END_DATA::default()));
    let all = |parts: &[&[MavMessage]]| parts.concat();
    BTreeMap::from([
        ("fleet status", greet.clone()),
        ("fleet preflight", all(&[&greet, &read(false), &sum])),
        ("fleet preflight --set-params", all(&[&greet, &read(true), &sum])),
        ("fleet upload", all(&[&greet, &remember, &load, &read(false)])),
        ("fleet upload --set-params", all(&[&greet, &remember, &load, &read(true)])),
        ("fleet start", all(&[&greet, &read(false), &sum, &start])),
        ("fly", all(&[&greet, &remember, &load, &read(true), &start])),
        ("fly --guided", all(&[&greet, &remember, &guided])),
        ("fleet watch", all(&[&greet, &start[2..], &end(Action::Return)])),
        ("fleet restore", restore(false)),
        ("fleet restore --fence-off", restore(true)),
        ("fleet abort", end(Action::Return)),
        ("fleet land", end(Action::Land)),
        ("logs list", list),
        ("logs pull", logs),
    ])
}

fn to(message: &MavMessage) -> Option<DroneId> {
    // Start packets have no address; those of an abort go to one drone all the same.
    (class(message) != Some(Class::Start)).then_some(drone(1))
}

/// What the gate says of a message to a drone in a situation, the fleet's other drone beside it.
fn verdict(plan: &Plan, said: &[(u8, Vec<MavMessage>)], age: Micros, of: &MavMessage) -> bool {
    let mut net = Still::default();
    let heard = |(system, said): &(u8, Vec<MavMessage>)| {
        let from = drone(*system);
        said.iter().map(|message| Received { from, message: message.clone() }).collect::<Vec<_>>()
    };
    net.said = said.iter().flat_map(heard).collect();
    let later = Rc::new(RefCell::new(0));
    let mut net = Later { net, now: Rc::clone(&later) };
    let mut gate = Gate::new(&mut net, plan);
    gate.set_fleet(BTreeSet::from([drone(1), drone(2)]));
    while gate.recv(0).unwrap().is_some() {}
    *later.borrow_mut() = age;
    gate.check(to(of), of).is_ok()
}

/// A net whose time is set from outside.
struct Later {
    net: Still,
    now: Rc<RefCell<Micros>>,
}

impl Net for Later {
    fn now(&self) -> Micros {
        *self.now.borrow()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        self.net.recv(until)
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.net.send(to, message)
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.net.broadcast(message)
    }

    fn heard(&self) -> Vec<DroneId> {
        self.net.heard()
    }
}

/// A message without its values.
fn kind(message: &MavMessage) -> String {
    let text = text(message);
    let words: Vec<&str> = text.split([' ', ':']).collect();
    match words[..] {
        ["COMMAND_LONG" | "COMMAND_INT", "DO_SET_MODE", _, _, mode, ..] => {
            format!("DO_SET_MODE {mode}")
        }
        ["COMMAND_LONG" | "COMMAND_INT", command, ..] => command.to_owned(),
        ["DATA16", "start", ..] => match class(message) {
            Some(Class::Emergency) => "start packet, taken back".to_owned(),
            _ => "start packet".to_owned(),
        },
        ["PARAM_SET", name, ..] if name.starts_with("FENCE") || name.starts_with("BATT_FS") => {
            format!("PARAM_SET {name}")
        }
        ["FTP", operation, ..] => format!("FTP {operation}"),
        // Messages without words of their own are shown with all that is in them.
        [first, ..] => first.split('(').next().unwrap_or(first).to_owned(),
        [] => String::new(),
    }
}

#[test]
fn every_subcommands_messages_pass_by_what_they_do_and_what_the_drone_is_at() {
    let plan = plan();
    let ground = vec![beat(false), status(Stage::WaitForStart, None, 0)];
    let mut shown = String::new();
    for (subcommand, messages) in subcommands(&plan) {
        assert!(!messages.is_empty(), "{subcommand} sends nothing");
        let mut rows: Vec<(String, Vec<&str>)> = Vec::new();
        for (situation, said, age) in situations() {
            let refused: BTreeSet<String> = messages
                .iter()
                .filter(|message| {
                    let both = [(1, said.clone()), (2, ground.clone())];
                    !verdict(&plan, &both, age, message)
                })
                .map(kind)
                .collect();
            let refused: Vec<String> = refused.into_iter().collect();
            let text = if refused.is_empty() { "-".to_owned() } else { refused.join(", ") };
            match rows.iter_mut().find(|(other, _)| *other == text) {
                Some((_, situations)) => situations.push(situation),
                None => rows.push((text, vec![situation])),
            }
        }
        let kinds: BTreeSet<String> = messages.iter().map(kind).collect();
        let kinds: Vec<String> = kinds.into_iter().collect();
        let _ = writeln!(shown, "{subcommand}: {}", kinds.join(", "));
        for (refused, situations) in rows {
            let _ = writeln!(shown, "  {}\n    refused: {refused}", situations.join(" | "));
        }
    }
    insta::assert_snapshot!(shown);
}

/// The same by the rules themselves, not by what was seen.
#[test]
fn nothing_changes_a_drone_that_is_not_heard_to_stand_disarmed() {
    let plan = plan();
    let ground = vec![beat(false), status(Stage::WaitForStart, None, 0)];
    let stands =
        ["disarmed, stock", "disarmed, off", "disarmed, waiting", "start set", "landed", "error"];
    for (subcommand, messages) in subcommands(&plan) {
        for (situation, said, age) in situations() {
            for message in &messages {
                let both = [(1, said.clone()), (2, ground.clone())];
                let passes = verdict(&plan, &both, age, message);
                let what = format!("{subcommand}, {situation}: {}", text(message));
                match message {
                    MavMessage::PARAM_SET(_)
                    | MavMessage::MISSION_COUNT(_)
                    | MavMessage::MISSION_ITEM_INT(_) => {
                        // The other drone, at the same age, is not heard either.
                        let weakens = age > 0 || !stands.contains(&situation);
                        assert_eq!(passes, !weakens, "{what}");
                    }
                    MavMessage::COMMAND_LONG(command) => match command.command {
                        MavCmd::MAV_CMD_DO_SET_MODE
                            if [RTL, LAND].contains(&(command.param2 as u32)) =>
                        {
                            assert!(passes, "{what}");
                        }
                        MavCmd::MAV_CMD_USER_1
                        | MavCmd::MAV_CMD_DO_SET_MODE
                        | MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => {
                            assert_eq!(passes, stands.contains(&situation), "{what}");
                        }
                        MavCmd::MAV_CMD_NAV_TAKEOFF => {
                            assert_eq!(
                                passes,
                                !stands.contains(&situation) && situation != "authorized",
                                "{what}"
                            );
                        }
                        _ => assert!(passes, "{what}"),
                    },
                    MavMessage::HEARTBEAT(_)
                    | MavMessage::PARAM_REQUEST_READ(_)
                    | MavMessage::LOG_REQUEST_LIST(_)
                    | MavMessage::MISSION_REQUEST_LIST(_) => assert!(passes, "{what}"),
                    _ => {}
                }
            }
        }
    }
}

#[test]
fn a_fence_is_weakened_for_nobody_while_anyone_may_be_flying() {
    let plan = plan();
    let ground = vec![beat(false), status(Stage::WaitForStart, None, 0)];
    let top = plan.fence.max_altitude_m as f32;
    let weaker = [
        ("FENCE_ENABLE", 0.0),
        ("FENCE_TYPE", 0.0),
        ("FENCE_TYPE", 2.0),
        ("FENCE_ACTION", 0.0),
        ("FENCE_ALT_MAX", top + 1.0),
        ("FENCE_ALT_MAX", f32::NAN),
        ("FENCE_RADIUS", 9.0),
        ("BATT_FS_LOW_ACT", 0.0),
        ("FS_EKF_ACTION", 0.0),
    ];
    let as_strong =
        [("FENCE_ENABLE", 1.0), ("FENCE_TYPE", 7.0), ("FENCE_ALT_MAX", top), ("LOG_BITMASK", 0.0)];
    for (situation, said, age) in situations() {
        // Age concerns both: here only the other drone is looked at.
        if age > 0 {
            continue;
        }
        let both = [(1, ground.clone()), (2, said)];
        let stands = ["disarmed", "start", "landed", "error"];
        let all_stand = stands.iter().any(|start| situation.starts_with(start));
        for (name, value) in weaker {
            let message = param_set(drone(1), name, value);
            let passes = verdict(&plan, &both, 0, &message);
            assert_eq!(passes, all_stand, "{name} {value} while the other is {situation}");
        }
        for (name, value) in as_strong {
            let message = param_set(drone(1), name, value);
            assert!(verdict(&plan, &both, 0, &message), "{name} {value}, {situation}");
        }
    }
    // Nobody has said who the fleet is.
    let mut net = Still::default();
    net.said.push_back(Received { from: drone(1), message: beat(false) });
    let mut gate = Gate::new(&mut net, &plan);
    gate.recv(0).unwrap();
    let refused = gate.send(drone(1), &param_set(drone(1), "FENCE_ENABLE", 0.0));
    assert!(matches!(refused, Err(NetError::Refused(_))), "{refused:?}");
    assert!(gate.send(drone(1), &param_set(drone(1), "FENCE_ENABLE", 1.0)).is_ok());
    assert!(Protection::of(&plan).is_weakened_by("FS_SOMETHING_NEW", 1.0), "nobody knows it");
}

#[test]
fn a_drone_that_has_just_disarmed_is_on_the_ground_whatever_it_said_before() {
    let plan = plan();
    let landing = || status(Stage::Landing, Some(5), flag::AUTHORIZED);
    for (before, after, wanted) in [
        (landing(), None, State::Ground),
        (landing(), Some(status(Stage::Landed, Some(5), flag::AUTHORIZED)), State::Ground),
        // It says so after its heartbeat: that is what counts.
        (landing(), Some(landing()), State::Flying),
    ] {
        let mut said = VecDeque::from([before, beat(false)]);
        said.extend(after);
        let later = Rc::new(RefCell::new(0));
        let mut net = Later { net: Still::default(), now: Rc::clone(&later) };
        let said = said.into_iter().map(|message| Received { from: drone(1), message });
        net.net.said = said.collect();
        let mut gate = Gate::new(&mut net, &plan);
        while gate.recv(0).unwrap().is_some() {
            *later.borrow_mut() += S / 10;
        }
        assert_eq!(gate.state(drone(1)), wanted);
        assert!(gate.is_disarmed(drone(1)));
    }
}

#[test]
fn what_is_refused_says_what_and_why_and_is_not_sent() {
    let plan = plan();
    let mut net = Still::default();
    net.said.extend([
        Received { from: drone(1), message: beat(true) },
        Received { from: drone(1), message: status(Stage::Performing, Some(5), 0) },
        Received { from: drone(2), message: beat(true) },
    ]);
    let mut words = Vec::new();
    {
        let mut gate = Gate::new(&mut net, &plan);
        gate.set_fleet(table(&plan).drones.iter().map(|line| line.drone).collect());
        while gate.recv(0).unwrap().is_some() {}
        assert_eq!(gate.state(drone(3)), State::Unheard);
        let start = StartConfig { start_tow_s: 5, authorization: 1, countdown_ms: LEAVE_TIME };
        let mut refused = |sent: Result<(), NetError>| match sent.unwrap_err() {
            NetError::Refused(Refusal { what, why, for_now, .. }) => {
                words.push(format!("{what}: {why}{}", if for_now { " (for now)" } else { "" }));
            }
            other => panic!("{other}"),
        };
        for system in 1..=3 {
            refused(gate.send(drone(system), &param_set(drone(system), "FENCE_ENABLE", 0.0)));
        }
        refused(gate.broadcast(&start_packet(&start)));
        refused(gate.broadcast(&param_set(drone(1), "LOG_BITMASK", 1.0)));
        let erase = dialect::LOG_ERASE_DATA { target_system: 1, target_component: 1 };
        refused(gate.send(drone(3), &MavMessage::LOG_ERASE(erase)));
    }
    assert!(net.sent.is_empty());
    insta::assert_snapshot!(words.join("\n"));
}

/// A drone that flies as it is told; one that is deaf does not take an order to return or land.
struct Deaf {
    inner: Obliging,
    obeys: bool,
}

impl Endpoint for Deaf {
    fn on_message(&mut self, now: Micros, message: &MavMessage, out: &mut Vec<MavMessage>) {
        if self.obeys || class(message) != Some(Class::Emergency) {
            self.inner.on_message(now, message, out);
        }
    }

    fn poll(&mut self, now: Micros, out: &mut Vec<MavMessage>) -> Micros {
        self.inner.poll(now, out)
    }
}

/// To whom, and what.
type Messages = Vec<(DroneId, MavMessage)>;
type Sent = Rc<RefCell<Messages>>;

/// Writes down what is sent.
struct Spy {
    net: LossyNet<Deaf>,
    sent: Sent,
}

impl Net for Spy {
    fn now(&self) -> Micros {
        self.net.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        self.net.recv(until)
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.sent.borrow_mut().push((to, message.clone()));
        self.net.send(to, message)
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        self.net.broadcast(message)
    }

    fn heard(&self) -> Vec<DroneId> {
        self.net.heard()
    }
}

/// Gives an order once, at a time.
struct Orders<'a> {
    at: Micros,
    given: bool,
    folder: &'a std::path::Path,
    refused: Vec<(DroneId, String)>,
}

impl Observer for Orders<'_> {
    fn on_refused(&mut self, drone: DroneId, refusal: &Refusal) {
        self.refused.push((drone, refusal.why.clone()));
    }

    fn stop(&mut self, now: Micros) -> bool {
        if now >= self.at && !self.given {
            self.given = true;
            give(self.folder, "1", Action::Return, Some(vec![drone(1)]), OrderFrom::Terminal)
                .unwrap()
                .unwrap();
        }
        now > self.at + 40 * S
    }
}

/// What drones 1 and 2 are sent after drone 1 was ordered down at a time of their guided flight,
/// and what was refused.
fn ordered_down(at: Micros, obeys: bool, faults: Faults) -> (Messages, Vec<(DroneId, String)>) {
    let (plan, folder) = (plan(), tempfile::tempdir().unwrap());
    let sent: Sent = Rc::default();
    let vehicles: BTreeMap<DroneId, Deaf> = [1_u8, 2]
        .map(|system| {
            let home = Vector3::from(plan.slots[usize::from(system) - 1].home_m);
            let place = plan.site.frame().to_geodetic(home);
            (drone(system), Deaf { inner: Obliging::new(drone(system), false, place), obeys })
        })
        .into();
    let stock = vehicle(&plan, false);
    let flights = [1, 2].map(|system| (drone(system), flight(&plan, system, &stock)));
    let net = LossyNet::new(vehicles, faults, 3);
    let mut net = Spy { net, sent: Rc::clone(&sent) };
    let before = RefCell::new(None);
    let inbox = Inbox::open(folder.path(), "one".to_owned()).unwrap();
    let refused = {
        let told = |notice: &Notice| {
            if matches!(notice, Notice::Ordered { .. }) {
                *before.borrow_mut() = Some(sent.borrow().len());
            }
        };
        let mut handler = OrderHandler::new(&mut net, Some(inbox), told);
        let mut gate = Gate::new(&mut handler, &plan);
        gate.set_fleet(BTreeSet::from([drone(1), drone(2)]));
        let given = false;
        let mut orders = Orders { at, given, folder: folder.path(), refused: Vec::new() };
        run_all(&mut gate, flights.into(), 9, &mut orders).unwrap();
        orders.refused
    };
    let before = before.borrow().expect("the order was taken");
    let after = sent.borrow()[before..].to_vec();
    (after, refused)
}

#[test]
fn a_drone_that_was_ordered_down_is_never_sent_a_take_off_or_a_target_again() {
    // Before it arms, while it takes off, and while it performs; it obeys, or is deaf to it.
    let cases = [(1, false), (8, false), (30, false), (30, true)];
    let links = [Faults::default(), bad()];
    for ((at_s, obeys), faults) in cases.iter().flat_map(|case| links.map(|link| (*case, link))) {
        let (heard, refused) = ordered_down(at_s * S, obeys, faults);
        let to = |system: u8, class_: Class| {
            let of = |(to, message): &&(DroneId, MavMessage)| {
                *to == drone(system) && class(message) == Some(class_)
            };
            heard.iter().filter(of).count()
        };
        assert!(to(1, Class::Emergency) > 0, "at {at_s} s it is told to return");
        for class in [Class::Flight, Class::Ground, Class::Start] {
            assert_eq!(to(1, class), 0, "at {at_s} s, obeys: {obeys}: {class:?}");
        }
        assert!(to(2, Class::Flight) > 0, "at {at_s} s the other one flies on");
        let why = refused.iter().find(|(to, _)| *to == drone(1));
        if !obeys {
            assert_eq!(why.unwrap().1, "it was ordered down");
        }
    }
}

#[test]
fn no_start_is_set_or_authorized_once_anyone_was_ordered_down() {
    let plan = plan();
    let mut net = Still::default();
    net.ordered.insert(drone(2), false);
    net.said.push_back(Received { from: drone(1), message: beat(false) });
    let mut gate = Gate::new(&mut net, &plan);
    gate.recv(0).unwrap();
    for authorization in [0, 1] {
        let start = StartConfig { start_tow_s: 5, authorization, countdown_ms: LEAVE_TIME };
        assert!(gate.broadcast(&start_packet(&start)).is_err());
    }
    let back = StartConfig { start_tow_s: CLEAR_TIME, authorization: 0, countdown_ms: CLEAR_TIME };
    assert!(gate.broadcast(&start_packet(&back)).is_ok());
    assert!(gate.send(drone(2), &set_mode(drone(2), GUIDED, 0)).is_err());
    assert!(gate.send(drone(2), &set_mode(drone(2), LAND, 0)).is_ok());
}
