//! The plan: a versioned timetable of one flight that everything downstream reads.
//!
//! Written as `plan.json`; its JSON schema is `docs/schema/plan.schema.json`.

pub use crate::check::Fence;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::base::frame::{Geodetic, ShowFrame};
use crate::vehicle::Limits;

/// Name and version of the plan format.
pub const PLAN_SCHEMA: &str = "updraft.plan/1";

/// One flight of a fleet: slots, command groups with their segments, limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    /// Format name and version: `updraft.plan/1`.
    pub schema: String,
    /// Short name of the flight, used for folders: `calibration`, `hover`.
    pub name: String,
    /// Title for people.
    pub title: String,
    /// What the flight is for.
    pub purpose: Purpose,
    /// Name of the vehicle file the plan was made for.
    pub vehicle: String,
    /// Where the show frame is.
    pub site: Site,
    /// Name of the place, for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub site_name: Option<String>,
    /// Local time there less UTC, h.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub utc_offset_h: Option<f64>,
    /// Limits that the plan is checked against.
    pub limits: Limits,
    /// Fence around the show, show frame.
    pub fence: Fence,
    /// How the grid was laid out; absent for plans recovered from a show file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid: Option<Grid>,
    /// Every drone's place, in slot order.
    pub slots: Vec<Slot>,
    /// Command groups: all drones of a group fly the same segments, each from its own home.
    pub groups: Vec<Group>,
    /// End of the last segment of any group, show time, ms.
    pub duration_ms: u64,
    /// What the crew must prepare or know, one sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub briefing: Vec<String>,
}

/// What a flight is for, which decides how it is analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Purpose {
    /// A speed ladder that relates rotor effort to vertical air velocity.
    Calibration,
    /// A hover (or scan) that measures the air.
    Measurement,
}

/// Where the show frame is on the globe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Site {
    /// Latitude of the show origin, degrees.
    pub origin_lat_deg: f64,
    /// Longitude of the show origin, degrees.
    pub origin_lon_deg: f64,
    /// Ground height at the origin above mean sea level, m. Used for air density; drones fly heights
    /// relative to home.
    pub ground_amsl_m: f64,
    /// Whether the ground height is another place's: the origin was moved, and nobody gave a height.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ground_assumed: bool,
    /// Degrees clockwise from north to the show's x axis.
    pub orientation_deg: f64,
}

impl Site {
    /// The show frame at this site.
    pub fn frame(&self) -> ShowFrame {
        ShowFrame {
            origin: Geodetic {
                lat_deg: self.origin_lat_deg,
                lon_deg: self.origin_lon_deg,
                amsl_m: self.ground_amsl_m,
            },
            orientation_deg: self.orientation_deg,
        }
    }
}

/// Layout of a rectangular grid.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grid {
    /// Rows, along show x.
    pub rows: u32,
    /// Columns, along show y (to the left).
    pub columns: u32,
    /// Distance between neighbours, m.
    pub spacing_m: f64,
}

/// One drone's place on the ground.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Slot {
    /// Number of the slot, from 1.
    pub slot: u16,
    /// Label, for example `Drone 1`.
    pub name: String,
    /// Row in the grid, from 0 (along show x).
    pub row: u32,
    /// Column in the grid, from 0 (along show y).
    pub column: u32,
    /// Home on the ground, show frame, m.
    pub home_m: [f64; 3],
    /// Index into [`Plan::groups`].
    pub group: u16,
}

/// Drones that fly the same segments at the same times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Group {
    /// Name of the group: `all`, `even`, `odd`.
    pub name: String,
    /// How much later than the plan's steps this group flies, ms.
    pub offset_ms: u64,
    /// What the group flies, without gaps from show time 0.
    pub segments: Vec<Segment>,
}

/// One segment of a group's flight: constant commanded velocity, or a ramp between two velocities.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// What the segment is.
    pub kind: SegmentKind,
    /// Label for people: `up 0.5 m/s`.
    pub label: String,
    /// Start, show time, ms.
    pub start_ms: u64,
    /// End, show time, ms.
    pub end_ms: u64,
    /// Position at the start relative to home, show frame, m.
    pub from_m: [f64; 3],
    /// Position at the end relative to home, show frame, m.
    pub to_m: [f64; 3],
    /// Commanded velocity, show frame, m/s: constant, or that at the end of a ramp.
    pub velocity_mps: [f64; 3],
    /// Velocity at the start, for a ramp of constant acceleration; absent: constant velocity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub from_velocity_mps: Option<[f64; 3]>,
    /// Where the analysis looks; absent: not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<Window>,
    /// Flown to calibrate what wind does to the vehicle (`[legs]` of a template), with the hovers between: no map of
    /// the air is made of it. Absent: it is not.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub calibrates_wind: bool,
}

impl Segment {
    /// Farthest point of a ramp on each axis, relative to home, show frame, m: where its velocity changes its sign, the
    /// ramp leads beyond both of its ends. The end where there is no such point.
    pub(super) fn turn_m(&self) -> [f64; 3] {
        let Some(from_mps) = self.from_velocity_mps else { return self.to_m };
        let lasts_s = self.end_ms.saturating_sub(self.start_ms) as f64 / 1000.0;
        let mut turn_m = self.to_m;
        for (axis, turn_m) in turn_m.iter_mut().enumerate() {
            let (before, after) = (from_mps[axis], self.velocity_mps[axis]);
            if before * after < 0.0 {
                let until_s = lasts_s * before / (before - after);
                *turn_m = self.from_m[axis] + 0.5 * before * until_s;
            }
        }
        turn_m
    }
}

/// Kind of a segment.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
#[schemars(rename = "Kind")]
pub enum SegmentKind {
    /// Standing on the ground before take-off (a group's time offset).
    Wait,
    /// First vertical climb from the ground.
    Takeoff,
    /// Vertical transfer to a height; not analysed.
    Climb,
    /// Vertical transfer down; not analysed.
    Descend,
    /// A rung of the ladder, upwards.
    LegUp,
    /// A rung of the ladder, downwards.
    LegDown,
    /// Commanded velocity zero.
    Hover,
    /// Horizontal leg at constant speed.
    Horizontal,
    /// Change of velocity at constant acceleration.
    Ramp,
    /// Last vertical descent before the autopilot lands the drone.
    Landing,
}

impl SegmentKind {
    /// Whether the commanded velocity is zero (the paper's 0-windows).
    pub fn is_hover(self) -> bool {
        self == Self::Hover
    }

    /// Whether this is a rung of the speed ladder.
    pub fn is_leg(self) -> bool {
        matches!(self, Self::LegUp | Self::LegDown)
    }
}

/// An interval of show time, start included, end excluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Window {
    /// Start, show time, ms.
    pub start_ms: u64,
    /// End, show time, ms.
    pub end_ms: u64,
}

impl Window {
    /// Duration of the window, s.
    pub fn duration_s(self) -> f64 {
        self.end_ms.saturating_sub(self.start_ms) as f64 / 1000.0
    }
}

impl Plan {
    /// Slot by its number, from 1; `None` if the plan has no such slot.
    pub fn slot(&self, slot: u16) -> Option<&Slot> {
        self.slots.iter().find(|candidate| candidate.slot == slot)
    }

    /// Segments that a slot flies: those of its group.
    pub fn segments(&self, slot: &Slot) -> &[Segment] {
        self.groups.get(usize::from(slot.group)).map_or(&[], |group| &group.segments)
    }
}
