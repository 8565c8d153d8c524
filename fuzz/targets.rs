//! What the fuzzer and `tests/fuzz_corpus.rs` feed: every reader of bytes from outside.
//!
//! To add one: a function here and a line in `TARGETS`, a file in `fuzz_targets/`, a `[[bin]]` in
//! `fuzz/Cargo.toml`, and a few small inputs in `corpus/NAME/`. A target panics if what must hold
//! for any bytes does not; being refused with an error is fine.

use std::net::SocketAddr;

use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::log::{Log, Select};
use updraft::sim::Uniform;
use updraft::sim::json::{Instance, InstanceSetup, ServoPacket};
use updraft::vehicle::library::builtin;

/// A name, as in `corpus/` and `fuzz_targets/`, and what takes the bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: &[Target] = &[("json_packet", json_packet), ("log", log)];

/// Feeds `bytes` to the target `name`.
pub(crate) fn run(name: &str, bytes: &[u8]) {
    for (_, target) in TARGETS.iter().filter(|(known, _)| *known == name) {
        target(bytes);
    }
}

/// Datagrams of a length byte and as many bytes, to one instance: whatever they are, an answer is a
/// finite motion at or above the ground and comes exactly for what is a packet.
fn json_packet(bytes: &[u8]) {
    let Ok(vehicle) = builtin("airsim-generic-quad") else { return };
    let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 190.0 };
    let air = Uniform(Vector3::new(3.0, -2.0, 1.0));
    let mut instance = Instance::new(InstanceSetup {
        vehicle: &vehicle,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 59.0 },
        atmosphere: &air,
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
