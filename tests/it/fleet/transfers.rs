//! What tests of log transfers share.

#[path = "../../../crates/mavlink-station/tests/it/content.rs"]
mod contents;

pub(crate) use contents::{content, drone};
use updraft::fleet::logs::pull::Wanted;

/// The log of each drone from 1 to `count`, for the slot of its number.
pub(crate) fn wanted(count: u8) -> Vec<Wanted> {
    let one = |system: u8| Wanted {
        drone: drone(system),
        slot: system.into(),
        file: format!("{system:02}.BIN"),
        flight: None,
    };
    (1..=count).map(one).collect()
}
