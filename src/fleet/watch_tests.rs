//! Events of drones that fly, fall silent, restart or go astray, as a monitor tells them.

use std::collections::BTreeMap;

use super::slots::FleetTable;
use super::telemetry::Telemetry;
use super::watch::{Event, Limits, Monitor};
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::Observer as _;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::link::net::Received;
use crate::mission::Plan;
use crate::mission::resolve::resolve;
use crate::protocol::show::{FROM_DRONE, Stage, Status};

/// Unix time at which the drones were switched on, us, and show time 0 after that, ms.
const ON_US: u64 = 1_795_143_537_000_000;
const START_MS: u64 = 100_000;

/// A station, its clock, and drones that say where they are.
struct Field {
    plan: Plan,
    monitor: Monitor,
}

impl Field {
    fn new() -> Self {
        let mission = resolve("calibration", &[]).unwrap();
        let plan = mission.flights.into_iter().next().unwrap().plan;
        let rows = [1, 2].map(|system| (DroneId { network: 0, system }, system.into()));
        let table = FleetTable::new(rows);
        let limits = Limits::of(&plan);
        let mut monitor = Monitor::new(&plan, &table, Telemetry::default(), limits);
        let unix_ms = (ON_US / 1000 + START_MS) as i64;
        let start = crate::base::time::GpsTime::from_unix_ms(unix_ms).unwrap();
        monitor.set_start(Some(start.total_ms()));
        Self { plan, monitor }
    }

    fn hear(&mut self, now: Micros, system: u8, message: MavMessage) {
        let from = DroneId { network: 0, system };
        self.monitor.on_message(now, &Received { from, message });
    }

    /// What a drone says at a show time, off its trajectory by so much, m; heard at `now`.
    fn say(&mut self, now: Micros, system: u8, show_ms: u64, off_m: f64) {
        self.says(now, system, (START_MS + show_ms, 0), off_m, true);
    }

    /// What it says so long after all were switched on, and its last boot after that, ms; before
    /// the start from the ground.
    fn says(
        &mut self,
        now: Micros,
        system: u8,
        (on_ms, boot_at_ms): (u64, u64),
        off_m: f64,
        clock: bool,
    ) {
        if clock {
            let clock = dialect::SYSTEM_TIME_DATA {
                time_unix_usec: ON_US + on_ms * 1000,
                time_boot_ms: (on_ms - boot_at_ms) as u32,
            };
            self.hear(now, system, MavMessage::SYSTEM_TIME(clock));
        }
        let flies = on_ms >= START_MS;
        self.beat(now, system, flies);
        self.status(now, system, if flies { Stage::Performing } else { Stage::WaitForStart });
        self.is_at(now, system, (on_ms, boot_at_ms), off_m);
    }

    fn beat(&mut self, now: Micros, system: u8, armed: bool) {
        let base_mode = if armed {
            dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED
        } else {
            dialect::MavModeFlag::empty()
        };
        let beat = dialect::HEARTBEAT_DATA { base_mode, ..Default::default() };
        self.hear(now, system, MavMessage::HEARTBEAT(beat));
    }

    fn status(&mut self, now: Micros, system: u8, stage: Stage) {
        let status = Status { stage, ..Status::from_data(&[]) };
        let data = dialect::DATA16_DATA {
            mavtype: FROM_DRONE,
            len: Status::LENGTH,
            data: status.to_data(),
        };
        self.hear(now, system, MavMessage::DATA16(data));
    }

    fn is_at(&mut self, now: Micros, system: u8, (on_ms, boot_at_ms): (u64, u64), off_m: f64) {
        let show_ms = on_ms.saturating_sub(START_MS);
        let slot = self.plan.slot(system.into()).unwrap();
        let trajectory = self.plan.trajectory(slot);
        let mut place = trajectory.state_at(show_ms as f64 / 1000.0).position_m;
        place.x += off_m;
        let at = self.plan.site.frame().to_geodetic(place);
        let position = dialect::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: (on_ms - boot_at_ms) as u32,
            lat: (at.lat_deg * 1e7).round() as i32,
            lon: (at.lon_deg * 1e7).round() as i32,
            relative_alt: ((place.z - trajectory.start_m.z) * 1000.0) as i32,
            ..Default::default()
        };
        self.hear(now, system, MavMessage::GLOBAL_POSITION_INT(position));
    }

    fn alarms(&mut self) -> Vec<(Micros, String)> {
        let told = self.monitor.take_events().into_iter();
        told.filter(|told| told.event.is_alarm())
            .map(|told| (told.at, told.event.to_string()))
            .collect()
    }
}

#[test]
fn neither_a_slow_link_nor_a_busy_station_is_a_distance() {
    let mut field = Field::new();
    for half_s in 0..600 {
        let show_ms = 20_000 + 500 * half_s;
        // Delayed by up to 4 s, in bursts; at 3.5 m/s that would be 14 m.
        let delay = 7919 * half_s % 4000;
        let now = (show_ms + delay).max(24_000 + 500 * half_s / 8 * 8) * MS;
        field.say(now, 1, show_ms, 0.3);
        field.say(now, 2, show_ms, 0.3);
    }
    assert_eq!(field.alarms(), []);
}

#[test]
fn neither_is_a_simulator_that_does_not_keep_its_rate() {
    let mut field = Field::new();
    let mut now = S;
    for half_s in 0..600_u64 {
        // From twice to a thousand times as fast as the clock on the wall.
        now += 250_000 / [1, 3, 40, 500][(half_s / 25 % 4) as usize];
        field.say(now, 1, 20_000 + 500 * half_s, 0.3);
        field.say(now, 2, 20_000 + 500 * half_s, 0.3);
    }
    assert_eq!(field.alarms(), []);
}

#[test]
fn a_drone_on_a_wrong_way_is_told_within_seconds_over_the_same_link() {
    let mut field = Field::new();
    for half_s in 0..120 {
        let show_ms = 20_000 + 500 * half_s;
        let delay = 7919 * half_s % 1000;
        let now = (show_ms + delay) * MS;
        // Drone 2 is blown away at 1 m/s from 30 s on.
        let off_m = ((show_ms as f64 - 30_000.0) / 1000.0).max(0.0);
        field.say(now, 1, show_ms, 0.3);
        field.say(now, 2, show_ms, off_m);
    }
    let alarms = field.alarms();
    let [(at, text)] = &alarms[..] else { panic!("{alarms:?}") };
    // 3 m are reached at 33 s.
    assert!(text.contains(" m from its trajectory at 3"), "{text}");
    assert!((33 * S..38 * S).contains(at), "{at}: {text}");
}

#[test]
fn a_drone_that_restarts_on_the_ground_is_not_held_against_its_old_clock() {
    let mut field = Field::new();
    let mut told = Vec::new();
    for half_s in 60..500_u64 {
        let on_ms = 500 * half_s;
        let now = on_ms * MS;
        // Drone 2 restarts 50 s after it was switched on, is back 5 s later, and says nothing of
        // its clock until the show has run for 80 s. From 100 s on it is far away.
        let boot = if on_ms < 50_000 { 0 } else { 50_000 };
        let clock = boot == 0 || on_ms >= START_MS + 80_000;
        let off_m = if on_ms < START_MS + 100_000 { 0.3 } else { 9.0 };
        field.says(now, 1, (on_ms, 0), 0.3, true);
        if boot == 0 || on_ms >= 55_000 {
            field.says(now, 2, (on_ms, boot), off_m, clock);
        }
        told.extend(
            field
                .monitor
                .take_events()
                .into_iter()
                .filter(|told| matches!(told.event, Event::Restarted { .. } | Event::Far { .. })),
        );
    }
    let texts: Vec<String> = told.iter().map(|told| told.event.to_string()).collect();
    assert_eq!(texts.len(), 2, "{texts:?}");
    assert_eq!((told[0].drone.system, texts[0].as_str()), (2, "restarted"));
    assert!(texts[1].contains("from its trajectory at 10"), "{texts:?}");
    let flying: BTreeMap<_, _> = field.monitor.flying().collect();
    assert!(flying.values().all(|of| of.flew && !of.fell), "{flying:?}");
}

#[test]
fn a_drone_that_restarts_in_the_air_has_not_landed_unless_it_flies_on() {
    for flies_on in [false, true] {
        let mut field = Field::new();
        for half_s in 0..40_u64 {
            let show_ms = 20_000 + 500 * half_s;
            let now = show_ms * MS;
            field.say(now, 1, show_ms, 0.3);
            if half_s < 20 {
                field.say(now, 2, show_ms, 0.3);
            } else if half_s >= 24 {
                // Its heartbeat comes first, and nobody knows its clock.
                field.beat(now, 2, flies_on);
                let stage = if flies_on { Stage::Performing } else { Stage::Off };
                field.status(now, 2, stage);
                let on_ms = START_MS + show_ms;
                field.is_at(now, 2, (on_ms, START_MS + 30_000), if flies_on { 0.3 } else { 40.0 });
            }
        }
        let alarms = field.alarms();
        let texts: Vec<&str> = alarms.iter().map(|(_, text)| text.as_str()).collect();
        assert_eq!(texts, ["restarted in the air"], "{flies_on}");
        let flying: BTreeMap<_, _> = field.monitor.flying().collect();
        let fell: Vec<bool> = flying.values().map(|of| of.fell).collect();
        assert_eq!(fell, [false, !flies_on]);
        assert!(flying.values().all(|of| of.flew));
    }
}

#[test]
fn motors_that_stop_in_the_air_are_no_landing_before_the_drone_says_where_it_is() {
    for says_again in [false, true] {
        let mut field = Field::new();
        let flying = |field: &Field| field.monitor.flying().nth(1).unwrap().1;
        let end_ms = 30_000;
        for half_s in 40..60_u64 {
            field.say(500 * half_s * MS, 1, 500 * half_s, 0.3);
            field.say(500 * half_s * MS, 2, 500 * half_s, 0.3);
        }
        // Its heartbeat is the first that comes of the new boot.
        field.beat(end_ms * MS, 2, false);
        field.status(end_ms * MS, 2, Stage::Off);
        field.monitor.stop((end_ms + 200) * MS);
        assert!(!flying(&field).over && !flying(&field).fell, "nobody knows yet");
        let mut now_ms = end_ms + 1_000;
        if says_again {
            field.is_at(now_ms * MS, 2, (START_MS + now_ms, START_MS + end_ms), 0.3);
        }
        while now_ms < end_ms + 17_000 {
            now_ms += 500;
            field.beat(now_ms * MS, 2, false);
            if says_again {
                break;
            }
        }
        field.monitor.stop((now_ms + 200) * MS);
        assert!(flying(&field).over && flying(&field).fell, "{says_again}");
    }
}

#[test]
fn a_station_that_was_held_up_calls_nobody_silent_and_a_silent_drone_is() {
    let mut field = Field::new();
    let mut now = 20 * S;
    for tenth in 0..100 {
        now += if tenth == 50 { 20 * S } else { 100 * MS };
        // Held up for 20 s; then it looks before it hears.
        field.monitor.stop(now);
        for system in [1, 2] {
            if system == 1 || tenth < 60 {
                field.say(now, system, 20_000 + 100 * tenth, 0.0);
            }
        }
    }
    let alarms = field.alarms();
    let [(at, text)] = &alarms[..] else { panic!("{alarms:?}") };
    assert_eq!(text, "not heard for 3 s");
    // Its last words came at tenth 59.
    assert!((42 * S..50 * S).contains(at), "{at}");
}

#[test]
fn drones_that_all_fall_silent_are_told_although_no_message_comes_any_more() {
    let mut field = Field::new();
    for system in [1, 2] {
        field.say(20 * S, system, 20_000, 0.0);
    }
    for tenth in 1..100 {
        assert!(!field.monitor.stop(20 * S + tenth * 100 * MS), "a watch has no end of its own");
    }
    let alarms = field.alarms();
    let silent = (23_100 * MS, "not heard for 3 s".to_owned());
    assert_eq!(alarms, [silent.clone(), silent]);
}

/// How far a drone is from its trajectory that says at one show time that it is at the top of the ladder,
/// where it belongs `early_s` later, when its clock was read last 125 s ago; the station's clock runs
/// `rate` times slower than its own.
fn distance_by_an_old_clock_m(early_s: u64, rate: u64) -> f64 {
    let mut field = Field::new();
    let trajectory = field.plan.trajectory(field.plan.slot(1).unwrap());
    let height_m = |second: &u64| trajectory.state_at(*second as f64).position_m.z;
    let highest_m = (0..600).map(|second| height_m(&second)).fold(0.0, f64::max);
    let is_top = |second: &u64| height_m(second) > highest_m - 0.01;
    let (first_s, last_s) = ((0..600).find(is_top).unwrap(), (0..600).rev().find(is_top).unwrap());
    assert!(last_s - first_s >= 8 && first_s > 260, "{first_s} to {last_s} s");
    let top_s = u64::midpoint(first_s, last_s);
    let now_s = top_s - early_s;
    for show_s in now_s - 155..=now_s - 125 {
        field.say(show_s * S / rate, 1, 1000 * show_s, 0.0);
    }
    let boot_at_ms = 1000 * early_s;
    field.is_at(now_s * S / rate, 1, (START_MS + 1000 * top_s, boot_at_ms), 0.0);
    field.monitor.flying().next().unwrap().1.distance_m.unwrap()
}

#[test]
fn a_clock_that_was_read_long_ago_is_doubted_in_a_simulator_only() {
    let far_m = distance_by_an_old_clock_m(40, 1);
    assert!(far_m > 5.0, "a drone is 40 s ahead, and its clock keeps time: {far_m} m");
    let near_m = distance_by_an_old_clock_m(40, 10);
    assert!(near_m < 0.1, "a simulator may have run faster for 125 s: {near_m} m");
    let far_m = distance_by_an_old_clock_m(100, 10);
    assert!(far_m > 5.0, "but not nearly twice as fast: {far_m} m");
}
