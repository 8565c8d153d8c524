#![doc = include_str!("../README.md")]

mod archive;
mod bezier;
pub mod check;
pub mod csv;
pub mod derive;
pub mod frame;
pub mod lights;
mod number;
pub mod quantise;
pub mod skyb;
pub mod skyc;
pub mod summary;
pub mod trajectory;

use nalgebra::Vector3;

pub use archive::verify as verify_archive;

use crate::frame::ShowFrame;
pub use trajectory::{Segment, SegmentPath, Trajectory};

/// Largest number of drones in a show that the Skybrush loader accepts.
pub const MAX_DRONES: usize = 5_000;

/// A show: trajectories, lights and settings of all drones, in the show frame.
///
/// This is what `.skyc` files hold, whoever made them; a single `.skyb` is a show of one drone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Show {
    /// Identifier of the show (`meta.id`), if any.
    pub id: Option<String>,
    /// Title of the show (`meta.title`), if any.
    pub title: Option<String>,
    /// Place of the show frame on the globe, if known. Without AMSL the origin's altitude is 0 and
    /// [`Show::has_amsl`] is false.
    pub frame: Option<ShowFrame>,
    /// Whether the altitude in [`Show::frame`] is known. Heights of a show are above its own ground all
    /// the same: what they refer to on the drones is set apart from the file.
    pub has_amsl: bool,
    /// The drones, in the order of their slots.
    pub drones: Vec<ShowDrone>,
    /// Named instants, for people's timelines.
    pub cues: Vec<Cue>,
    /// Limits that Skybrush's own tools check and draw (`settings.validation`).
    pub validation: Option<Validation>,
    /// Proposed geofence: its polygons in the order of the file; empty: no fence.
    pub fence: Vec<FenceZone>,
    /// Top of the fence, m above the show's ground, if it is stated.
    pub fence_altitude_m: Option<f64>,
    /// Faults of the file that do no harm to a flight, one sentence each.
    pub doubts: Vec<String>,
    /// End of take-off, start of landing and end of the show, s (`meta.segments`).
    pub phases_s: Option<[f64; 3]>,
}

/// One polygon of a geofence. Drones must stay inside every inclusion zone and outside every exclusion
/// zone.
#[derive(Clone, Debug, PartialEq, serde::Serialize, schemars::JsonSchema)]
pub struct FenceZone {
    /// Whether drones must stay inside it (else: outside).
    pub is_inclusion: bool,
    /// Corners of the polygon, show x and y, m.
    pub corners_m: Vec<[f64; 2]>,
}

impl FenceZone {
    /// A zone that drones must stay in.
    pub fn inclusion(corners_m: Vec<[f64; 2]>) -> Self {
        Self { is_inclusion: true, corners_m }
    }

    /// A zone that drones must stay out of.
    pub fn exclusion(corners_m: Vec<[f64; 2]>) -> Self {
        Self { is_inclusion: false, corners_m }
    }
}

/// One drone of a show.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShowDrone {
    /// Label of the drone or slot, for example `Drone 1`.
    pub name: String,
    /// Ground position at the start, show frame, m.
    pub home_m: Option<Vector3<f64>>,
    /// Planned landing position, show frame, m.
    pub land_at_m: Option<Vector3<f64>>,
    /// Trajectory that the drone flies, from show time 0.
    pub trajectory: Trajectory,
    /// Light program in Skybrush bytecode; empty: none.
    pub lights: Vec<u8>,
    /// Yaw program, if any.
    pub yaw: Option<YawControl>,
    /// Parts of the drone's file that are not read, by kind.
    pub extras: Extras,
}

/// Parts that a file has for a drone and that this crate does not read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Extras {
    /// Number of pyro events.
    pub pyro_events: usize,
    /// Whether the file holds a plan for an early return home.
    pub has_rth_plan: bool,
    /// Number of points with more than three coordinates.
    pub spare_coordinates: usize,
}

/// A yaw program, as `.skyb` block 5 and `yawControl` in `.skyc` hold it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct YawControl {
    /// Whether the heading follows the direction of motion.
    pub auto: bool,
    /// Offset added to all setpoints, degrees clockwise.
    pub offset_deg: f64,
    /// Headings over time: (show time in s, degrees clockwise from the show's x axis), linear in
    /// between.
    pub setpoints: Vec<(f64, f64)>,
}

/// A named instant of the show.
#[derive(Clone, Debug, PartialEq)]
pub struct Cue {
    /// Show time of the cue, s.
    pub time_s: f64,
    /// Name of the cue, as the show's author gave it.
    pub name: String,
}

/// Limits drawn and checked by Skybrush Live and Viewer.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Validation {
    /// Highest altitude that the show may reach, m.
    pub max_altitude_m: Option<f64>,
    /// Largest horizontal speed, m/s.
    pub max_velocity_xy_mps: Option<f64>,
    /// Largest vertical speed (downward, and upward unless given apart), m/s.
    pub max_velocity_z_mps: Option<f64>,
    /// Largest upward speed, m/s.
    pub max_velocity_z_up_mps: Option<f64>,
    /// Smallest distance between drones, m.
    pub min_distance_m: Option<f64>,
    /// Largest horizontal acceleration, m/s².
    pub max_acceleration_xy_mps2: Option<f64>,
    /// Largest vertical acceleration, m/s².
    pub max_acceleration_z_mps2: Option<f64>,
    /// Fastest turn about the vertical axis, degrees/s.
    pub max_yaw_rate_dps: Option<f64>,
    /// Altitude below which drones must not move sideways, m.
    pub min_nav_altitude_m: Option<f64>,
    /// Largest acceleration within a piece, m/s² (`maxAcceleration`; other tools ignore it).
    pub max_acceleration_mps2: Option<f64>,
    /// Largest jump of velocity between pieces, m/s (`maxVelocityStep`; other tools ignore it).
    pub max_velocity_step_mps: Option<f64>,
    /// Time a full battery carries the vehicle in hover, s (`endurance`; other tools ignore it).
    pub endurance_s: Option<f64>,
    /// Share of the endurance that must be left at the end (`enduranceReserve`; other tools ignore
    /// it).
    pub endurance_reserve: Option<f64>,
}
