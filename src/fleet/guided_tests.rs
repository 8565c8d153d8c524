//! A drone that is guided takes off and is left to its pilot.

use nalgebra::Vector3;

use super::guided::{Guided, GuidedError, GuidedFlight};
use super::messages::GUIDED;
use super::vehicle_clock::VehicleClock;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::base::time::GpsTime;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::{Conversation as _, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::show::{Segment, SegmentPath, Trajectory};

const STABILIZE: u32 = 0;
const LOITER: u32 = 5;
const UNIX_US: u64 = 1_795_143_537_000_000;
/// Link time of show time 0.
const START: Micros = 15 * S;

/// A climb at 1 m/s to 20 m, and back.
fn guided() -> Guided {
    let to = |z, duration_ms| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, z)),
    };
    let segments = vec![to(20.0, 20_000), to(20.0, 60_000), to(3.0, 20_000)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 };
    let frame = ShowFrame { origin, orientation_deg: 0.0 };
    let mut clock = VehicleClock::default();
    clock.read(0, UNIX_US);
    let start = GpsTime::from_unix_ms(((UNIX_US + START) / 1000) as i64).unwrap();
    let start_gps_ms = start.total_ms();
    let flight = GuidedFlight { trajectory, frame, start_gps_ms, yaw_rad: None, clock };
    Guided::new(DroneId { network: 0, system: 1 }, flight)
}

/// A drone as it says that it is.
#[derive(Clone, Copy)]
struct Says {
    mode: u32,
    armed: bool,
    above_home_m: f64,
}

/// What the station sends to a drone that says so all the time, until it is done with it.
fn sent(
    guided: &mut Guided,
    times: std::ops::Range<Micros>,
    says: Says,
) -> (Vec<MavMessage>, Option<Result<(), GuidedError>>) {
    let mut base_mode = dialect::MavModeFlag::empty();
    base_mode.set(dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, says.armed);
    let beat = dialect::HEARTBEAT_DATA { custom_mode: says.mode, base_mode, ..Default::default() };
    let place = dialect::GLOBAL_POSITION_INT_DATA {
        relative_alt: (says.above_home_m * 1000.0) as i32,
        ..Default::default()
    };
    let mut sent = Vec::new();
    for now in times.step_by((100 * MS) as usize) {
        guided.on_message(now, &MavMessage::HEARTBEAT(beat.clone()));
        guided.on_message(now, &MavMessage::GLOBAL_POSITION_INT(place.clone()));
        for _ in 0..10 {
            match guided.poll(now) {
                Step::Send(message) => sent.push(*message),
                Step::Wait(until) if until <= now => {}
                Step::Wait(_) => break,
                Step::Done(done) => return (sent, Some(done)),
            }
        }
    }
    (sent, None)
}

fn is_command(message: &MavMessage, wanted: dialect::MavCmd) -> bool {
    matches!(message, MavMessage::COMMAND_LONG(command) if command.command == wanted)
}

#[test]
fn a_drone_joins_its_trajectory_at_seven_tenths_of_the_take_off_altitude() {
    let take_offs = |sent: &[MavMessage]| {
        let wanted = dialect::MavCmd::MAV_CMD_NAV_TAKEOFF;
        sent.iter().filter(|message| is_command(message, wanted)).count()
    };
    let targets = |sent: &[MavMessage]| {
        let is_target = |message: &&MavMessage| {
            matches!(message, MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_))
        };
        sent.iter().filter(is_target).count()
    };
    let mut guided = guided();
    let at = |above_home_m| Says { mode: GUIDED, armed: true, above_home_m };
    let (messages, _) = sent(&mut guided, 7 * S..18 * S, at(0.0));
    assert!(take_offs(&messages) > 0, "{messages:?}");
    assert_eq!(targets(&messages), 0, "it stands on the ground");
    // The take-off altitude is 2.5 m.
    let (messages, _) = sent(&mut guided, 18 * S..20 * S, at(1.70));
    assert!(take_offs(&messages) > 0 && targets(&messages) == 0, "{messages:?}");
    let (messages, _) = sent(&mut guided, 20 * S..22 * S, at(1.80));
    assert_eq!(take_offs(&messages), 0, "{messages:?}");
    assert!((19..=21).contains(&targets(&messages)), "ten a second: {}", targets(&messages));
}

#[test]
fn a_drone_that_leaves_guided_is_left_to_its_pilot() {
    let mut guided = guided();
    let on_the_ground = |mode, armed| Says { mode, armed, above_home_m: 0.0 };
    let (messages, done) = sent(&mut guided, 7 * S..12 * S, on_the_ground(STABILIZE, false));
    let set_mode = dialect::MavCmd::MAV_CMD_DO_SET_MODE;
    assert!(messages.iter().any(|message| is_command(message, set_mode)), "{messages:?}");
    assert_eq!(done, None, "it was not in GUIDED yet");
    let (_, done) = sent(&mut guided, 12 * S..13 * S, on_the_ground(GUIDED, true));
    assert_eq!(done, None);
    let (messages, done) = sent(&mut guided, 13 * S..20 * S, on_the_ground(LOITER, true));
    assert_eq!(messages, []);
    assert!(matches!(done, Some(Err(GuidedError::TakenOver { .. }))), "{done:?}");
}
