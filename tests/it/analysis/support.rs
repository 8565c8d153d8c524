//! Plans and logs for the analysis tests.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::path::PathBuf;

use updraft::log::catalog::{ATT, GUIP, PARM, RCOU, SHOW, XKF1};
use updraft::log::{LogWriter, Value};
use updraft::mission::plan::{
    Fence, Group, PLAN_SCHEMA, Plan, Purpose, Segment, SegmentKind, Site, Slot, Window,
};
use updraft::vehicle::Limits;

/// A committed fixture.
pub(crate) fn fixture(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("crates/dataflash/tests/data").join(name)
}

/// GPS time of week of the start of the fixtures' shows, s (week 2445).
pub(crate) const LADDER_START_S: u32 = 442_755;

/// Builds segments one after the other.
#[derive(Default)]
pub(crate) struct Timetable {
    pub(crate) segments: Vec<Segment>,
    time_ms: u64,
    height_m: f64,
}

impl Timetable {
    pub(crate) fn add(
        mut self,
        kind: SegmentKind,
        label: &str,
        up_mps: f64,
        duration_s: f64,
    ) -> Self {
        let start_ms = self.time_ms;
        let end_ms = start_ms + (duration_s * 1000.0).round() as u64;
        let window = match kind {
            SegmentKind::LegUp | SegmentKind::LegDown => {
                Some(Window { start_ms: end_ms - 10_000, end_ms: end_ms - 1000 })
            }
            SegmentKind::Hover => Some(Window { start_ms: start_ms + 3000, end_ms: end_ms - 1000 }),
            _ => None,
        };
        let from_m = [0.0, 0.0, self.height_m];
        self.height_m += up_mps * duration_s;
        self.time_ms = end_ms;
        self.segments.push(Segment {
            kind,
            label: label.to_owned(),
            start_ms,
            end_ms,
            from_m,
            to_m: [0.0, 0.0, self.height_m],
            velocity_mps: [0.0, 0.0, up_mps],
            from_velocity_mps: None,
            window,
            calibrates_wind: false,
        });
        self
    }
}

/// The ladder that the fixtures flew; `sign` -1 flies it upside down (a wrong plan).
pub(crate) fn ladder(sign: f64) -> Vec<Segment> {
    let mut table = Timetable::default().add(SegmentKind::Takeoff, "climb", 2.0, 10.0).add(
        SegmentKind::Hover,
        "hover",
        0.0,
        10.0,
    );
    for rung in 1..=7 {
        let speed = 0.5 * f64::from(rung);
        table = table
            .add(SegmentKind::LegUp, &format!("up {speed} m/s"), sign * speed, 20.0)
            .add(SegmentKind::Hover, "hover", 0.0, 10.0)
            .add(SegmentKind::LegDown, &format!("down {speed} m/s"), -sign * speed, 20.0)
            .add(SegmentKind::Hover, "hover", 0.0, 10.0);
    }
    table.add(SegmentKind::Landing, "descend", -17.5 / 8.5, 8.5).segments
}

/// A plan in which `slots` drones fly the same segments, 7 m apart.
pub(crate) fn plan(purpose: Purpose, segments: Vec<Segment>, slots: u16) -> Plan {
    let duration_ms = segments.last().map_or(0, |segment| segment.end_ms);
    Plan {
        schema: PLAN_SCHEMA.to_owned(),
        name: "flight".to_owned(),
        title: "Flight".to_owned(),
        purpose,
        vehicle: "quad".to_owned(),
        site: Site {
            origin_lat_deg: -35.363_261,
            origin_lon_deg: 149.165_23,
            ground_amsl_m: 584.0,
            ground_assumed: false,
            orientation_deg: 0.0,
        },
        site_name: None,
        utc_offset_h: None,
        limits: Limits {
            max_speed_xy_mps: 8.0,
            max_speed_up_mps: 5.0,
            max_speed_down_mps: 5.0,
            max_acceleration_mps2: 5.0,
            max_velocity_step_mps: 10.0,
            max_altitude_m: 120.0,
            min_distance_m: 3.0,
            endurance_s: 900.0,
            endurance_reserve: 0.2,
        },
        fence: Fence { polygon_m: Vec::new(), max_altitude_m: 120.0, margin_m: 5.0 },
        grid: None,
        slots: (1..=slots)
            .map(|slot| Slot {
                slot,
                name: format!("Drone {slot}"),
                row: u32::from(slot) - 1,
                column: 0,
                home_m: [7.0 * f64::from(slot - 1), 0.0, 0.0],
                group: 0,
            })
            .collect(),
        groups: vec![Group { name: "all".to_owned(), offset_ms: 0, segments }],
        duration_ms,
        briefing: Vec::new(),
    }
}

/// The bytes of a fixture with a message renamed in its definition, which hides it from readers.
pub(crate) fn renamed(bytes: &[u8], from: [u8; 4], to: [u8; 4]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut count = 0;
    for start in 0..bytes.len().saturating_sub(9) {
        // FMT row: header A3 95 80, type, length, then the name.
        if bytes[start..].starts_with(&[0xA3, 0x95, 0x80]) && bytes[start + 5..start + 9] == from {
            bytes[start + 5..start + 9].copy_from_slice(&to);
            count += 1;
        }
    }
    assert!(count > 0, "the fixture defines {from:?}");
    bytes
}

/// The rungs of [`ladder_up`], in their order, m/s.
pub(crate) const LEGS: [f64; 8] = [1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 0.5, -0.5];

/// A ladder for synthetic logs: legs of 20 s, a hover of 20 s before them and of 10 s after each.
pub(crate) fn ladder_up(time: f64) -> f64 {
    let index = (time - 20.0) / 30.0;
    let rung = LEGS.get(index.max(0.0) as usize).copied().unwrap_or(0.0);
    if index >= 0.0 && (time - 20.0) % 30.0 < 20.0 { rung } else { 0.0 }
}

/// The segments of [`ladder_up`].
pub(crate) fn ladder_up_segments() -> Vec<Segment> {
    let mut table = Timetable::default().add(SegmentKind::Hover, "hover", 0.0, 20.0);
    for rung in LEGS {
        let kind = if rung > 0.0 { SegmentKind::LegUp } else { SegmentKind::LegDown };
        table = table.add(kind, &format!("leg {rung}"), rung, 20.0).add(
            SegmentKind::Hover,
            "hover",
            0.0,
            10.0,
        );
    }
    table.segments
}

/// A synthetic log at 10 Hz: what the drone does and how its rotors answer, over show time.
pub(crate) struct Synthetic {
    pub(crate) system_id: u8,
    pub(crate) duration_s: f64,
    pub(crate) velocity_up_mps: fn(f64) -> f64,
    pub(crate) pulse_us: Box<dyn Fn(f64) -> f64>,
}

impl Synthetic {
    /// The log's bytes; board time is show time plus 50 s.
    pub(crate) fn write(&self) -> Vec<u8> {
        let messages = [&PARM, &SHOW, &ATT, &RCOU, &XKF1, &GUIP];
        let mut log = LogWriter::new(Vec::new(), &messages).unwrap();
        let id = Value::Float(f64::from(self.system_id));
        let name = Value::Text("SYSID_THISMAV");
        log.row(&PARM, &[Value::Int(40_000_000), name, id, id]).unwrap();
        let (int, float) = (Value::Int, Value::Float);
        let zero = float(0.0);
        let mut height = 0.0;
        for tick in 0..(self.duration_s * 10.0) as i64 {
            let time = tick as f64 / 10.0;
            let at = int(50_000_000 + tick * 100_000);
            let up = (self.velocity_up_mps)(time);
            height += up * 0.1;
            let mut row = vec![at, int(tick * 100), int(4), int(0), int(0), int(0)];
            row.extend([zero, zero]);
            log.row(&SHOW, &row).unwrap();
            let mut row = vec![at];
            row.extend([zero; 8]);
            row.push(int(3));
            log.row(&ATT, &row).unwrap();
            // Four motors in whole microseconds, dithered around the mean.
            let pulse = (self.pulse_us)(time);
            let mut row = vec![at];
            row.extend((0..4).map(|motor| int((pulse + 0.25 * f64::from(motor)).floor() as i64)));
            row.extend([int(0); 10]);
            log.row(&RCOU, &row).unwrap();
            let mut row = vec![at, int(0), zero, zero, zero, zero, zero, float(-up), zero, zero];
            row.extend([zero, float(-height), zero, zero, zero, zero]);
            log.row(&XKF1, &row).unwrap();
            let mut row = vec![at, int(3), zero, zero, zero, int(0), zero, zero, float(100.0 * up)];
            row.extend([zero; 3]);
            log.row(&GUIP, &row).unwrap();
        }
        log.finish().unwrap()
    }
}
