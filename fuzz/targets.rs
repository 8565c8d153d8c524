//! What the fuzzer and `tests/fuzz_corpus.rs` feed: every reader of bytes from outside.
//!
//! To add one: a function here and a line in `TARGETS`, a file in `fuzz_targets/`, a `[[bin]]` in
//! `fuzz/Cargo.toml`, and a few small inputs in `corpus/NAME/`. A target panics if what must hold
//! for any bytes does not; being refused with an error is fine.

use updraft::log::{Log, Select};

/// A name, as in `corpus/` and `fuzz_targets/`, and what takes the bytes.
pub(crate) type Target = (&'static str, fn(&[u8]));

/// All of them.
pub(crate) const TARGETS: &[Target] = &[("log", log)];

/// Feeds `bytes` to the target `name`.
pub(crate) fn run(name: &str, bytes: &[u8]) {
    for (_, target) in TARGETS.iter().filter(|(known, _)| *known == name) {
        target(bytes);
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
