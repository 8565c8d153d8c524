//! What the fuzzer and `tests/it/house/fuzz_corpus.rs` feed: every reader of bytes from outside.
//!
//! To add one: a function here and a line in `TARGETS`, a file in `fuzz_targets/`, a `[[bin]]` in
//! `fuzz/Cargo.toml`, and a few small inputs in `corpus/NAME/`. A target panics if what must hold
//! for any bytes does not; being refused with an error is fine.

use std::net::SocketAddr;
use std::path::Path;

use nalgebra::Vector3;
use serde::Serialize;
use serde::de::DeserializeOwned;
use updraft::analysis::result::Analysis;
use updraft::archive::{series, slim};
use updraft::base::crc::ap_crc32;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::parse;
use updraft::campaign::start::StartRecord;
use updraft::campaign::{parse_plan, to_json};
use updraft::check::{CheckInput, check};
use updraft::fleet::ftp::Caller;
use updraft::fleet::ftp::get::{Get, GetOptions};
use updraft::fleet::ftp::list::List;
use updraft::fleet::ftp::put::Put;
use updraft::fleet::log_protocol::get::LogGet;
use updraft::fleet::log_protocol::list::LogList;
use updraft::fleet::logs::manifest::Manifest;
use updraft::fleet::sink::Memory;
use updraft::fleet::slots::{FleetTable, check_table};
use updraft::flight::table::{Mapping, read_from};
use updraft::gap::Verdict;
use updraft::les::LesMap;
use updraft::link::clock::S;
use updraft::link::conversation::{Conversation, Step};
use updraft::link::frame::{FrameReader, MAX_FRAME, MavMessage, dialect, encode};
use updraft::link::id::DroneId;
use updraft::log::{Log, Select};
use updraft::mission::Plan;
use updraft::mission::resolve::{resolve, resolve_text};
use updraft::protocol::ftp::{MOST_DATA, PAYLOAD, Packet};
use updraft::protocol::show::{Stage, StartConfig, Status};
use updraft::show::derive::DeriveParams;
use updraft::show::summary::{summarise, summarise_skyb};
use updraft::show::{Show, csv, skyb, skyc};
use updraft::sim::Uniform;
use updraft::sim::air::spec::{AirSpec, from_toml};
use updraft::sim::json::{Instance, InstanceSetup, ServoPacket};
use updraft::skybrush_server::lines::Lines;
use updraft::skybrush_server::watch::Monitor;
use updraft::skybrush_server::{log_bytes, log_entries, message};
use updraft::study::StudyPlan;
use updraft::vehicle::{Vehicle, library};

/// Shows of more drones or segments are read, but not checked: that takes too long for a fuzzer.
const MAX_DRONES: usize = 16;
const MAX_SEGMENTS: usize = 2_000;

/// A name, as in `corpus/` and `fuzz_targets/`, and what takes the bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: &[Target] = &[
    ("air", air),
    ("archive", archive),
    ("conversation", conversation),
    ("csv", csv),
    ("fleet_table", fleet_table),
    ("frame", frame),
    ("ftp_packet", ftp_packet),
    ("json_packet", json_packet),
    ("les_map", les_map),
    ("log", log),
    ("plan", plan),
    ("records", records),
    ("server_line", server_line),
    ("show_status", show_status),
    ("skyb", skyb),
    ("skyc", skyc),
    ("study", study),
    ("table", table),
    ("template", template),
    ("vehicle", vehicle),
];

/// Feeds `bytes` to the target `name`.
pub(crate) fn run(name: &str, bytes: &[u8]) {
    for (_, target) in TARGETS.iter().filter(|(known, _)| *known == name) {
        target(bytes);
    }
}

/// `analysis.json` as an archive reads it: twice, without keeping the whole. What the short way refuses the long way may
/// still walk through, and an error of the taker ends the walk.
fn archive(bytes: &[u8]) {
    let slim = parse::json_from(bytes, std::marker::PhantomData::<slim::Analysis>);
    let spans: Vec<slim::Span> = slim
        .iter()
        .flat_map(|slim| &slim.flights)
        .map(|flight| flight.map.as_ref().map(|map| map.time_s).unwrap_or_default())
        .collect();
    let mut drones = 0;
    let walked = series::walk(bytes, &spans, &mut |_, time_s, series| {
        drones += 1;
        assert!(time_s.len() <= bytes.len());
        assert!(series.updraft_mps.at(bytes.len()).is_none());
        Ok(())
    });
    // Whatever the program itself reads is walked through, every drone of it.
    if let Ok(whole) = parse::json::<Analysis>(bytes) {
        assert!(slim.is_ok(), "{:?}", slim.err());
        assert_eq!(walked, Ok(()));
        let maps = whole.flights.iter().filter_map(|flight| flight.map.as_ref());
        assert!(drones >= maps.map(|map| map.drones.len()).sum::<usize>());
    }
    if drones > 0 {
        let stop = || Err("enough".to_owned());
        assert!(series::walk(bytes, &spans, &mut |_, _, _| stop()).is_err());
    }
}

/// What is accepted has names, and lengths above 0.
fn les_map(bytes: &[u8]) {
    let Ok(map) = LesMap::from_toml(&String::from_utf8_lossy(bytes)) else { return };
    assert!([&map.u, &map.v, &map.w].iter().all(|of| !of.variable.is_empty()));
    assert!(map.period_m.into_iter().flatten().all(|m| m.is_finite() && m > 0.0));
}

/// Datagrams of a length byte and as many bytes, to one instance: whatever they are, an answer is a
/// finite motion at or above the ground and comes exactly for what is a packet.
fn json_packet(bytes: &[u8]) {
    let Ok(vehicle) = library::builtin("airsim-generic-quad") else { return };
    let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 190.0 };
    let air = Uniform(Vector3::new(3.0, -2.0, 1.0));
    let mut instance = Instance::new(InstanceSetup {
        vehicle: &vehicle,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 59.0 },
        atmosphere: &air,
        seed: 1,
        drone: 1,
    });
    let peer = SocketAddr::from(([127, 0, 0, 1], 50_000));
    let mut rest = bytes;
    while let Some((&length, after)) = rest.split_first() {
        let (datagram, after) = after.split_at(usize::from(length).min(after.len()));
        rest = after;
        let frames = instance.status().frames;
        let reply = instance.answer(peer, datagram).map(str::to_owned);
        assert_eq!(reply.is_ok(), ServoPacket::parse(datagram).is_ok());
        let status = instance.status();
        if let Ok(reply) = reply {
            assert!(reply.len() < 1_000 && !reply.contains("NaN") && !reply.contains("inf"));
            assert!(status.frames - frames <= 6_553, "{status:?}");
            assert!(status.height_m >= 0.0, "{status:?}");
        } else {
            assert_eq!(status.frames, frames);
        }
    }
}

/// `fleet.json`: what can be read is held against a plan, and is written as it was read.
fn fleet_table(bytes: &[u8]) {
    let Ok(table) = FleetTable::parse(bytes) else { return };
    let json = to_json(&table).expect("a table is JSON");
    assert_eq!(FleetTable::parse(&json).as_ref(), Ok(&table));
    let mission = resolve("hover", &[]).expect("it is built in");
    for problem in check_table(&mission.flights[0].plan, &table) {
        assert!(!problem.to_string().is_empty());
    }
    for line in &table.drones {
        assert!(table.slot_of(line.drone).is_some());
    }
}

/// MAVLink from a stream and from a datagram: no byte is counted twice, and a message that came is
/// one that can be sent.
fn frame(bytes: &[u8]) {
    let mut whole = FrameReader::default();
    let mut pieces = FrameReader::default();
    whole.push(bytes);
    let mut found = Vec::new();
    while let Some(frame) = whole.next(None) {
        found.push(frame);
    }
    let mut again = Vec::new();
    for piece in bytes.chunks(7) {
        pieces.push(piece);
        while let Some(frame) = pieces.next(None) {
            again.push(frame);
        }
    }
    // Text, as numbers that are none are not equal to themselves.
    assert_eq!(format!("{found:?}"), format!("{again:?}"));
    assert_eq!(whole.loss, pieces.loss);
    whole.end_of_datagram();
    assert!(whole.loss.noise_bytes <= bytes.len() as u64);
    for frame in &found {
        let sent = encode(frame.sender, frame.sequence, &frame.message, None);
        assert!(sent.len() <= MAX_FRAME);
        let mut reader = FrameReader::default();
        reader.push(&sent);
        let back = reader.next(None).expect("what is written can be read");
        assert_eq!(format!("{:?}", back.message), format!("{:?}", frame.message));
    }
}

/// The payload of FILE_TRANSFER_PROTOCOL; shorter ones are filled with zeros, as MAVLink does.
fn ftp_packet(bytes: &[u8]) {
    let mut payload = [0; PAYLOAD];
    let length = bytes.len().min(PAYLOAD);
    payload[..length].copy_from_slice(&bytes[..length]);
    let Some(packet) = Packet::from_payload(&payload) else { return };
    assert!(packet.data.len() <= MOST_DATA && packet.data.len() == usize::from(packet.size));
    assert_eq!(Packet::from_payload(&packet.to_payload()).as_ref(), Some(&packet));
    if let Some(refusal) = packet.refusal() {
        assert!(!refusal.to_string().is_empty());
    }
}

/// DATA16 of the show protocol, of any length, in both directions.
fn show_status(bytes: &[u8]) {
    let status = Status::from_data(bytes);
    assert_eq!(Status::from_data(&status.to_data()).stage, status.stage);
    assert_eq!(Stage::from_number(status.stage.number()), status.stage);
    let _ = (status.obstacle(), status.stage.to_string(), status.stage.is_flying());
    for length in [0, 5, 6, 9, 10, 12, 16, 255] {
        if let Some(start) = StartConfig::from_data(bytes, length) {
            let (data, length) = start.to_data();
            assert_eq!(StartConfig::from_data(&data, length), Some(start));
        }
    }
}

/// What Skybrush Server says, line by line, through everything that reads it.
fn server_line(bytes: &[u8]) {
    let mut lines = Lines::new(1 << 16);
    let mut monitor = Monitor::new(["01".to_owned()], 25.0, 0);
    for (second, piece) in bytes.chunks(61).enumerate() {
        if lines.push(piece).is_err() {
            return;
        }
        while let Some(line) = lines.next_line() {
            assert!(!line.contains(&b'\n'));
            let Some(incoming) = message::parse(&line) else { continue };
            let result = incoming.body.get("result").unwrap_or(&incoming.body);
            if let Ok(log) = log_bytes(result) {
                assert!(log.len() <= line.len());
            }
            let _ = log_entries(result);
            let status = incoming.body.pointer("/status").and_then(|status| status.as_object());
            let status = status.cloned().unwrap_or_default().into_iter().collect();
            for (_, event) in monitor.look(second as u64 * 1_000_000, second > 3, &status) {
                assert!(!event.to_string().is_empty());
            }
        }
    }
}

fn log(bytes: &[u8]) {
    let log = Log::from_bytes(bytes.to_vec());
    let inventory = log.inventory();
    let read: u64 = inventory.messages.iter().map(|message| message.bytes).sum();
    let stats = inventory.stats;
    assert_eq!(read + stats.bad_bytes + stats.truncated_bytes, bytes.len() as u64, "{stats:?}");

    // Fields of everything that came, and some that may not have.
    let labels: Vec<Vec<&str>> = inventory
        .messages
        .iter()
        .map(|message| {
            let labels = message.fields.iter().map(|field| field.label.as_str());
            labels.chain(["TimeUS", "Nothing"]).take(8).collect()
        })
        .collect();
    let wanted: Vec<Select<'_>> = inventory
        .messages
        .iter()
        .zip(&labels)
        .take(32)
        .map(|(message, fields)| Select { message: &message.name, fields })
        .collect();
    let (tables, again) = log.select(&wanted);
    assert_eq!(again, stats);
    assert_eq!(tables.len(), wanted.len());
    for table in &tables {
        assert!(table.numbers.iter().all(|(_, column)| column.len() == table.rows));
        assert!(table.texts.iter().all(|(_, column)| column.len() == table.rows));
        assert_eq!(table.numbers.len() + table.texts.len(), table.columns.len());
    }
}

/// The binary show as it is, and with a correct checksum, so that mutations get past it.
fn skyb(bytes: &[u8]) {
    binary_show(bytes);
    if bytes.len() > 10 && bytes.starts_with(b"skyb\x02") {
        let mut bytes = bytes.to_vec();
        bytes[6..10].fill(0);
        let crc = ap_crc32(&bytes);
        bytes[6..10].copy_from_slice(&crc.to_le_bytes());
        binary_show(&bytes);
    }
}

fn binary_show(bytes: &[u8]) {
    let contents = match skyb::read(bytes) {
        Ok(contents) => contents,
        Err(error) => return drop(error.to_string()),
    };
    let _ = summarise_skyb(&contents, &DeriveParams::default());
    // What was read is written again in the same unit, and comes back as it was.
    let scale = skyb::Scale::Fixed(contents.scale_mm);
    let options = skyb::SkybOptions { scale, ..skyb::SkybOptions::default() };
    if let Ok(file) = skyb::write(&contents.drone, &options) {
        let again = skyb::read(&file.bytes).expect("what is written can be read");
        let unit_m = f64::from(contents.scale_mm) / 1000.0;
        let trajectory = &contents.drone.trajectory;
        // Cutting a piece of more than a minute may round its new points.
        let way = again.drone.trajectory.difference(trajectory, unit_m + 1e-9);
        assert_eq!(way, None);
    }
    use_show(&Show { drones: vec![contents.drone], ..Show::default() });
}

fn skyc(bytes: &[u8]) {
    match skyc::read(bytes) {
        Ok(show) => use_show(&show),
        Err(error) => drop(error.to_string()),
    }
}

fn csv(bytes: &[u8]) {
    match csv::read(bytes) {
        Ok(show) => use_show(&show),
        Err(error) => drop(error.to_string()),
    }
}

/// What `check` and `inspect` do with a show of somebody else.
fn use_show(show: &Show) {
    let segments: usize = show.drones.iter().map(|drone| drone.trajectory.segments.len()).sum();
    if show.drones.len() > MAX_DRONES || segments > MAX_SEGMENTS {
        return;
    }
    let _ = summarise(show, &DeriveParams::default());
    let vehicle = library::builtin("airsim-generic-quad").expect("it is built in");
    let plan = Plan::of_show(show, &vehicle);
    checked(show, &plan);
    if let Ok(file) = skyc::write(show) {
        let again = skyc::read(&file).expect("what is written can be read");
        assert_eq!(again.drones.len(), show.drones.len());
    }
}

fn checked(show: &Show, plan: &Plan) {
    let report = check(&CheckInput::new(show, &plan.limits).with_fence(Some(&plan.fence)));
    assert!(report.to_string().contains("error"));
    // A show that passes can be written for its drones.
    if report.passed() {
        for drone in &show.drones {
            skyb::write(drone, &skyb::SkybOptions::default()).expect("the check looked at that");
        }
    }
}

/// A mapping, a line of `%%`, and a table: what is read has times that go forward and values that
/// are numbers, and what is not is refused with a reason.
fn table(bytes: &[u8]) {
    const BETWEEN: &[u8] = b"\n%%\n";
    let Some(at) = bytes.windows(BETWEEN.len()).position(|piece| piece == BETWEEN) else { return };
    let (mapping, rows) = (&bytes[..at], &bytes[at + BETWEEN.len()..]);
    let mapping = match Mapping::parse(Path::new("fuzz.toml"), mapping) {
        Ok(mapping) => mapping,
        Err(error) => return drop(error.to_string()),
    };
    let flight = match read_from(rows, Path::new("fuzz.csv"), &mapping) {
        Ok(flight) => flight,
        Err(error) => return assert!(!error.to_string().is_empty()),
    };
    let always =
        [&flight.effort.values, &flight.velocity_up_mps, &flight.height_m, &flight.roll_rad];
    let sometimes = [&flight.desired_up_mps, &flight.truth_up_mps];
    for series in always.into_iter().chain(sometimes.into_iter().flatten()) {
        assert_eq!(series.time_s.len(), series.value.len());
        assert!(series.time_s.windows(2).all(|pair| pair[0] < pair[1]));
        assert!(series.time_s.iter().chain(&series.value).all(|value| value.is_finite()));
    }
}

fn template(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let mission = match resolve_text("fuzz.toml", text, &[]) {
        Ok(mission) => mission,
        Err(error) => return drop(error.to_string()),
    };
    for flight in &mission.flights {
        let json = to_json(&flight.plan).expect("a plan is JSON");
        assert_eq!(parse_plan(&json).as_ref(), Ok(&flight.plan));
        let again = resolve_text("again.toml", &flight.template_text, &[])
            .expect("a resolved template can be resolved");
        assert_eq!(again.flights[0].plan, flight.plan);
        use_plan(&flight.plan);
    }
}

fn plan(bytes: &[u8]) {
    if let Ok(plan) = parse_plan(bytes) {
        use_plan(&plan);
    }
}

/// What `check` does with a plan.
fn use_plan(plan: &Plan) {
    let segments: usize = plan.groups.iter().map(|group| group.segments.len()).sum();
    if plan.slots.len() <= MAX_DRONES && segments <= MAX_SEGMENTS {
        checked(&plan.to_show(), plan);
    }
}

/// A file of air: what is read is said again in the same words.
fn air(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match from_toml(text, "fuzz.toml") {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(specs) => {
            for spec in specs {
                let again: AirSpec = spec.to_string().parse().expect("what is said can be read");
                assert_eq!(again.to_string(), spec.to_string());
            }
        }
    }
}

/// A vehicle's file: what is read can fly, and is written as it was read.
fn vehicle(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    match Vehicle::from_toml(text, "fuzz.toml") {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(vehicle) => {
            let json = to_json(&vehicle).expect("a vehicle is JSON");
            let again: Vehicle = parse::json(&json).expect("what is written can be read");
            assert_eq!(again, vehicle);
        }
    }
}

/// A study's template.
fn study(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Err(error) = StudyPlan::parse("fuzz.toml", text) {
        assert!(!error.to_string().is_empty());
    }
}

/// What other programs, or an older one, may have written into a campaign: what can be read is written as it
/// was read.
fn records(bytes: &[u8]) {
    record::<Verdict>(bytes);
    record::<Manifest>(bytes);
    record::<StartRecord>(bytes);
    record::<Analysis>(bytes);
}

fn record<T: Serialize + DeserializeOwned>(bytes: &[u8]) {
    let Ok(record) = parse::json::<T>(bytes) else { return };
    let json = to_json(&record).expect("a record is JSON");
    // By its text: numbers that are none are not equal to themselves.
    let again: T = parse::json(&json).expect("what is written can be read");
    assert_eq!(to_json(&again).expect("a record is JSON"), json);
}

/// Answers of a drone, in pieces of 40 bytes, to everything that asks for files and logs: each conversation
/// ends, whatever it is told.
fn conversation(bytes: &[u8]) {
    let messages: Vec<MavMessage> = bytes.chunks(40).take(200).map(answer).collect();
    let drone = DroneId { network: 0, system: 1 };
    let caller = || Caller::new(drone, 1);
    let options = GetOptions { most_size: 200_000, ..GetOptions::default() };
    survives(Get::new(caller(), "/log", Memory::default(), options), &messages);
    survives(List::new(caller(), "/", 20 * S), &messages);
    survives(Put::new(caller(), "/log", vec![1; 3000], 20 * S), &messages);
    survives(LogGet::new(drone, 1, 100_000, Memory::default(), 20 * S), &messages);
    survives(LogList::new(drone, 20 * S), &messages);
}

/// A message that is near enough to be believed.
fn answer(piece: &[u8]) -> MavMessage {
    let byte = |place: usize| piece.get(place).copied().unwrap_or(0);
    let number = |place: usize| u32::from_le_bytes([0, 1, 2, 3].map(|more| byte(place + more)));
    let id = u16::from(byte(1));
    match byte(0) % 4 {
        0 => MavMessage::LOG_DATA(dialect::LOG_DATA_DATA {
            ofs: number(2) % 100_000,
            id: id % 4,
            count: byte(6),
            data: [byte(7); 90],
        }),
        1 => MavMessage::LOG_ENTRY(dialect::LOG_ENTRY_DATA {
            time_utc: number(10),
            size: number(2),
            id: id % 300,
            num_logs: u16::from(byte(6)),
            last_log_num: u16::from(byte(7)),
        }),
        _ => {
            let mut payload = [0; PAYLOAD];
            let own = piece.get(1..).unwrap_or_default();
            payload[..own.len()].copy_from_slice(own);
            payload[3] = 128 + payload[3] % 2;
            payload[5] %= 16;
            payload[4] %= 240;
            payload[10..12].fill(0);
            MavMessage::FILE_TRANSFER_PROTOCOL(dialect::FILE_TRANSFER_PROTOCOL_DATA {
                target_network: 0,
                target_system: 0,
                target_component: 0,
                payload,
            })
        }
    }
}

/// Feeds a conversation messages, those about files with its own numbers; it must end.
fn survives<C: Conversation>(mut conversation: C, messages: &[MavMessage]) {
    let (mut now, mut asked) = (0, [0_u8; 4]);
    let mut messages = messages.iter();
    for _ in 0..200_000 {
        match conversation.poll(now) {
            Step::Done(_) => return,
            Step::Wait(until) => {
                let Some(message) = messages.next() else {
                    assert!(until > now, "it waits for the past");
                    now = until;
                    continue;
                };
                let mut message = message.clone();
                if let MavMessage::FILE_TRANSFER_PROTOCOL(file) = &mut message {
                    let step = 1 + u16::from(file.payload[0] % 3);
                    let number = u16::from_le_bytes([asked[0], asked[1]]).wrapping_add(step);
                    file.payload[..2].copy_from_slice(&number.to_le_bytes());
                    file.payload[2] = asked[2];
                    if file.payload[6] % 4 != 0 {
                        file.payload[5] = asked[3];
                    }
                }
                now += 1000;
                conversation.on_message(now, &message);
            }
            Step::Send(message) => {
                if let MavMessage::FILE_TRANSFER_PROTOCOL(file) = &*message {
                    asked = [0, 1, 2, 3].map(|place| file.payload[place]);
                }
            }
        }
    }
    panic!("it never ends");
}
