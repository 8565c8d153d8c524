//! What the fuzzer and `tests/fuzz_corpus.rs` feed: every reader of bytes from outside.
//!
//! To add one: a function here and a line in `TARGETS`, a file in `fuzz_targets/`, a `[[bin]]` in
//! `fuzz/Cargo.toml`, and a few small inputs in `corpus/NAME/`. A target panics if what must hold
//! for any bytes does not; being refused with an error is fine.

use std::net::SocketAddr;

use nalgebra::Vector3;
use updraft::base::crc::ap_crc32;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::campaign::{parse_plan, to_json};
use updraft::check::{CheckInput, check};
use updraft::log::{Log, Select};
use updraft::mission::Plan;
use updraft::mission::resolve::resolve_text;
use updraft::show::derive::DeriveParams;
use updraft::show::summary::{summarise, summarise_skyb};
use updraft::show::{Show, csv, skyb, skyc};
use updraft::sim::Uniform;
use updraft::sim::json::{Instance, InstanceSetup, ServoPacket};
use updraft::vehicle::library;

/// Shows of more drones or segments are read, but not checked: that takes too long for a fuzzer.
const MAX_DRONES: usize = 16;
const MAX_SEGMENTS: usize = 2_000;

/// A name, as in `corpus/` and `fuzz_targets/`, and what takes the bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: &[Target] = &[
    ("csv", csv),
    ("json_packet", json_packet),
    ("log", log),
    ("plan", plan),
    ("skyb", skyb),
    ("skyc", skyc),
    ("template", template),
];

/// Feeds `bytes` to the target `name`.
pub(crate) fn run(name: &str, bytes: &[u8]) {
    for (_, target) in TARGETS.iter().filter(|(known, _)| *known == name) {
        target(bytes);
    }
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
        checked(&Show::of_plan(plan), plan);
    }
}
