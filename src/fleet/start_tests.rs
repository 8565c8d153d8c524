//! When the packet of a start is broadcast, and when it must not be.

use super::start::{Start, StartOptions};
use super::telemetry::Telemetry;
use crate::link::clock::{Micros, S};
use crate::link::conversation::Observer as _;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::net::Received;

const DRONE: DroneId = DroneId { network: 0, system: 1 };

/// A drone whose clock was read at link time 0.
fn telemetry() -> Telemetry {
    let mut telemetry = Telemetry::default();
    let time =
        dialect::SYSTEM_TIME_DATA { time_unix_usec: 1_795_143_537_000_000, ..Default::default() };
    telemetry.on_message(0, &Received { from: DRONE, message: MavMessage::SYSTEM_TIME(time) });
    telemetry
}

fn is_due(start: &mut Start, now: Micros) -> bool {
    start.due(&telemetry(), now).is_some()
}

#[test]
fn a_start_is_broadcast_once_a_second_and_never_after_it() {
    let options = StartOptions { lead_s: 30.0, ..StartOptions::default() };
    let mut start = Start::announce([DRONE].into(), &telemetry(), options, S).unwrap();
    assert!(is_due(&mut start, S));
    assert!(!is_due(&mut start, S) && !is_due(&mut start, 3 * S / 2));
    assert!(is_due(&mut start, 2 * S));
    assert!(is_due(&mut start, 30 * S), "a second before it");
    assert!(!is_due(&mut start, 33 * S), "it would be taken for next week's");
    start.cancel(34 * S);
    assert!(is_due(&mut start, 34 * S), "a withdrawal is never too late");
}

#[test]
fn the_start_of_another_station_is_taken_back_and_not_repeated() {
    let mut start = Start::attached([DRONE].into(), None);
    assert!(!is_due(&mut start, S) && !is_due(&mut start, 10 * S));
    start.cancel(11 * S);
    assert!(is_due(&mut start, 11 * S));
}
