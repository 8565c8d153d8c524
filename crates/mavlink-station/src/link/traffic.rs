//! Traffic of a network, and the problems that a crew must know about.

use std::collections::{BTreeMap, BTreeSet};

use super::frame::FrameLoss;
use super::id::DroneId;

/// Counts of a network's traffic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Number of bytes received, with all overhead above UDP.
    pub bytes_in: u64,
    /// Number of bytes sent, with all overhead above UDP.
    pub bytes_out: u64,
    /// Number of frames received that gave a message.
    pub frames_in: u64,
    /// Number of frames that are signed although the station has no key: who signs does not hear
    /// unsigned messages.
    pub signed: u64,
    /// Bytes and frames that gave no message, by reason.
    pub loss: FrameLoss,
    /// Number of datagrams that were discarded because they came faster than they could be handled.
    pub dropped: u64,
}

/// Bytes outside of frames up to this share are no sign of a wrong link: a serial port is opened
/// in the middle of a frame, and a radio loses ends.
const USUAL_NOISE: f64 = 0.1;
/// Fewer are none either.
const LEAST_NOISE: u64 = 1_000;

/// A problem of a link that its users must know about.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Trouble {
    /// Key that is equal for reports of one problem, however often it was counted.
    pub key: String,
    /// Description of the problem, with the remedy.
    pub text: String,
}

/// Problems of the links, by their traffic and the vehicles that were heard twice.
pub fn troubles(traffic: &BTreeMap<u16, Traffic>, doubled: &BTreeSet<DroneId>) -> Vec<Trouble> {
    let mut all: Vec<Trouble> = doubled
        .iter()
        .map(|drone| Trouble {
            key: format!("doubled {drone}"),
            text: format!(
                "drone {drone} is heard from two places at once, and only one of them is listened \
                 to: two drones with one system id (give each its own SYSID_THISMAV, or put one \
                 into another network), or one drone over two links"
            ),
        })
        .collect();
    for (network, of) in traffic {
        let mut tell = |key: &str, text: String| {
            let key = format!("{key} {network}");
            all.push(Trouble { key, text: format!("network {network}: {text}") });
        };
        let FrameLoss { noise_bytes, version_1, unknown: _, unsigned, forged } = of.loss;
        if of.dropped > 0 {
            tell(
                "dropped",
                format!(
                    "{} thrown away: more arrives than can be processed. Is somebody flooding \
                     this port? Drones may be heard late or not at all",
                    if of.dropped == 1 {
                        "1 datagram was".to_owned()
                    } else {
                        format!("{} datagrams were", of.dropped)
                    }
                ),
            );
        }
        if of.signed > 0 {
            tell(
                "signed",
                "the drones' frames are signed: give --key, or they refuse what this station says"
                    .to_owned(),
            );
        }
        if unsigned > 0 {
            tell(
                "unsigned",
                format!(
                    "{} not signed: refused. Drones without the key are not heard; give them the \
                     key, or leave out --key",
                    frames(unsigned)
                ),
            );
        }
        if forged > 0 {
            tell(
                "forged",
                format!(
                    "{} with a wrong signature, or replayed: refused. Somebody has another key, \
                     or replays recorded frames",
                    frames(forged)
                ),
            );
        }
        if version_1 > 0 {
            tell(
                "version 1",
                format!(
                    "{} of MAVLink 1: ignored. Set SERIALn_PROTOCOL of the drones' telemetry port \
                     to 2 (MAVLink 2)",
                    frames(version_1)
                ),
            );
        }
        if noise_bytes > LEAST_NOISE && noise_bytes as f64 > USUAL_NOISE * of.bytes_in as f64 {
            tell(
                "noise",
                format!(
                    "{noise_bytes} of {} bytes are no MAVLink 2 frames: is the baud rate right, \
                     and is this the drones' link?",
                    of.bytes_in
                ),
            );
        }
    }
    all
}

fn frames(count: u64) -> String {
    if count == 1 { "1 frame".to_owned() } else { format!("{count} frames") }
}
