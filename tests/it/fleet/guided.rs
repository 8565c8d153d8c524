//! A guided drone that falls silent in the air is told to return, and what comes of it is said.

#![expect(clippy::unwrap_used, reason = "a test that cannot be set up fails")]

use std::ops::Range;

use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::fleet::dry_run::Obliging;
use updraft::fleet::guided::{AfterLoss, Guided, GuidedError, GuidedFlight};
use updraft::fleet::messages::{RTL, text};
use updraft::fleet::vehicle_clock::VehicleClock;
use updraft::link::clock::{Micros, S};
use updraft::link::conversation::{Conversation as _, Step};
use updraft::link::id::DroneId;
use updraft::show::{Segment, SegmentPath, Trajectory};

const DRONE: DroneId = DroneId { network: 0, system: 1 };

/// Flies with a drone that says nothing for a while; `hears`: it takes what it is told meanwhile.
/// How often it was told to return after the last target, and the outcome.
fn fly(silent: Range<Micros>, hears: bool) -> (usize, GuidedError) {
    let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 };
    let frame = ShowFrame { origin, orientation_deg: 0.0 };
    let to = |z, duration_ms| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, z)),
    };
    let segments = vec![to(20.0, 20_000), to(20.0, 120_000), to(3.0, 20_000)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let mut vehicle = Obliging::new(DRONE, false, frame.to_geodetic(Vector3::zeros()));
    let start = GpsTime::from_unix_ms((vehicle.unix_us / 1000) as i64 + 15_000).unwrap();
    let clock = VehicleClock::default();
    let start_gps_ms = start.total_ms();
    let mut conversation =
        Guided::new(DRONE, GuidedFlight { trajectory, frame, start_gps_ms, yaw_rad: None, clock });
    let (mut now, mut returns, mut heard) = (0, 0, Vec::new());
    loop {
        let is_silent = silent.contains(&now);
        let wake = if is_silent { Micros::MAX } else { vehicle.poll(now, &mut heard) };
        for message in heard.drain(..).filter(|_| !is_silent) {
            conversation.on_message(now, &message);
        }
        match conversation.poll(now) {
            Step::Send(message) => {
                let line = text(&message);
                returns += usize::from(line.contains(&format!("DO_SET_MODE (176) 1 {RTL}")));
                if !is_silent || hears {
                    vehicle.on_message(now, &message, &mut heard);
                }
            }
            Step::Wait(until) => now = until.min(wake).max(now + 1).min(now + S / 10),
            Step::Done(done) => return (returns, done.unwrap_err()),
        }
        assert!(now < 600 * S, "it never ends");
    }
}

#[test]
fn a_lost_drone_is_told_to_return() {
    // The link is gone for good: a minute of calls.
    let (returns, error) = fly(40 * S..Micros::MAX, false);
    assert!((55..=61).contains(&returns), "{returns}");
    assert!(matches!(error, GuidedError::Lost { then: AfterLoss::Silent, .. }), "{error}");
    let end = "nothing is heard of it any more; it was told to return and has NOT CONFIRMED it: use \
        its remote control";
    assert!(error.to_string().ends_with(end), "{error}");
    // Only its own voice is gone, for 40 s: it has obeyed when it is heard again.
    let (returns, error) = fly(40 * S..80 * S, true);
    assert!((5..=15).contains(&returns), "{returns}");
    assert!(matches!(error, GuidedError::Lost { then: AfterLoss::Returns, .. }), "{error}");
    assert!(error.to_string().ends_with("told to return and has confirmed it"), "{error}");
    // Gone before it armed: nobody is called.
    let (returns, error) = fly(2 * S..Micros::MAX, false);
    assert_eq!(returns, 0);
    assert!(matches!(error, GuidedError::NoTakeoff { .. }), "{error}");
}
