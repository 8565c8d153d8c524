//! Contents of a show in figures, for people and for `--json`.

use nalgebra::Vector3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::Serialize;

use super::derive::{DeriveParams, Derived, Firmware, derive};
use super::lights::{self, Explanation};
use super::quantise::{self, DroneQuantisation};
use super::skyb::{BlockInfo, Event, SkybContents, SkybError, SkybOptions};
use super::trajectory::{SegmentPath, Trajectory};
use super::{FenceZone, Show, ShowDrone};

/// Lines of a light program that a summary shows.
const LIGHT_LINES: usize = 20;

/// A show in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct ShowSummary {
    /// Identifier of the show, if the file has one.
    pub id: Option<String>,
    /// Title of the show, if the file has one.
    pub title: Option<String>,
    /// Duration of the longest trajectory, s.
    pub duration_s: f64,
    /// Smallest and largest x, y, z of all drones, m; control points included, so an outer bound for
    /// curves.
    pub bounds_m: [[f64; 3]; 2],
    /// Largest horizontal, upward and downward speed of all drones.
    pub speeds: Speeds,
    /// Named instants: time in s and label.
    pub cues: Vec<(f64, String)>,
    /// Latitude and longitude in degrees, and AMSL in m if given, of the origin.
    pub origin: Option<(f64, f64, Option<f64>)>,
    /// Degrees clockwise from north to the show's x axis.
    pub orientation_deg: Option<f64>,
    /// Polygons of the proposed fence.
    pub fence: Vec<FenceZone>,
    /// Summary of each drone, in the order of the show.
    pub drones: Vec<DroneSummary>,
}

/// Largest speeds, m/s. Exact for straight pieces, an upper bound for curves.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Speeds {
    /// Largest horizontal speed, m/s.
    pub horizontal_mps: f64,
    /// Largest upward speed, m/s.
    pub up_mps: f64,
    /// Largest downward speed, m/s, as a positive number.
    pub down_mps: f64,
}

/// One drone in numbers.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct DroneSummary {
    /// Label of the drone.
    pub name: String,
    /// First point of the trajectory, show frame, m.
    pub start_m: [f64; 3],
    /// Last point of the trajectory, show frame, m.
    pub end_m: [f64; 3],
    /// Duration of the trajectory, s.
    pub duration_s: f64,
    /// Number of pieces by shape: holds, straight lines, cubic curves, curves of 7th degree.
    pub pieces: [usize; 4],
    /// Smallest and largest x, y, z, m (outer bound for curves).
    pub bounds_m: [[f64; 3]; 2],
    /// Largest speeds on the trajectory.
    pub speeds: Speeds,
    /// Size of the light program, bytes.
    pub light_bytes: usize,
    /// Figures of the drone's `.skyb` file, written with the finest scale; `None` if the show does
    /// not fit.
    pub skyb: Option<DroneQuantisation>,
    /// Reason why the show does not fit into a `.skyb` file.
    pub skyb_problem: Option<String>,
    /// Schedule that firmware 4.4 derives from the trajectory.
    pub derived_44: Derived,
    /// Schedule that firmware 4.6 derives from the trajectory.
    pub derived_46: Derived,
}

/// A `.skyb` file for people.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct SkybSummary {
    /// Version of the format.
    pub version: u8,
    /// Whether the file has a checksum.
    pub has_crc: bool,
    /// Size of the unit, mm.
    pub scale_mm: u8,
    /// Content of the comment block, if there is one.
    pub comment: Option<String>,
    /// Blocks in the order of the file.
    pub blocks: Vec<BlockInfo>,
    /// Timed events (pyro), in the order of the file.
    pub events: Vec<Event>,
    /// Whether there is a return-to-home plan.
    pub has_rth_plan: bool,
    /// The light program in words.
    pub lights: Explanation,
    /// The trajectory in numbers.
    pub drone: DroneSummary,
}

/// Summarises a show: its drones, their speeds, and the cost of their `.skyb` files.
pub fn summarise(show: &Show, params: &DeriveParams) -> ShowSummary {
    let files = quantise::report(show, &SkybOptions::default());
    let drones: Vec<DroneSummary> = show
        .drones
        .par_iter()
        .zip(files)
        .map(|(drone, file)| drone_summary(drone, file, params))
        .collect();
    let mut bounds = Bounds::default();
    let mut speeds = Speeds::default();
    for drone in &drones {
        drone.bounds_m.iter().for_each(|corner| bounds.add((*corner).into()));
        speeds = speeds.max(drone.speeds);
    }
    ShowSummary {
        id: show.id.clone(),
        title: show.title.clone(),
        duration_s: drones.iter().map(|drone| drone.duration_s).fold(0.0, f64::max),
        bounds_m: bounds.corners(),
        speeds,
        cues: show.cues.iter().map(|cue| (cue.time_s, cue.name.clone())).collect(),
        origin: show.frame.map(|frame| {
            let place = frame.origin;
            (place.lat_deg, place.lon_deg, show.has_amsl.then_some(place.amsl_m))
        }),
        orientation_deg: show.frame.map(|frame| frame.orientation_deg),
        fence: show.fence.clone(),
        drones,
    }
}

/// Summarises a `.skyb` file.
pub fn summarise_skyb(contents: &SkybContents, params: &DeriveParams) -> SkybSummary {
    let show = Show { drones: vec![contents.drone.clone()], ..Show::default() };
    let mut files = quantise::report(&show, &SkybOptions::default());
    let file = files.remove(0);
    SkybSummary {
        version: contents.version,
        has_crc: contents.has_crc,
        scale_mm: contents.scale_mm,
        comment: contents.comment.clone(),
        blocks: contents.blocks.clone(),
        events: contents.events.clone(),
        has_rth_plan: contents.has_rth_plan,
        lights: lights::explain(&contents.drone.lights, LIGHT_LINES),
        drone: drone_summary(&contents.drone, file, params),
    }
}

fn drone_summary(
    drone: &ShowDrone,
    skyb: Result<DroneQuantisation, SkybError>,
    params: &DeriveParams,
) -> DroneSummary {
    let trajectory = &drone.trajectory;
    let (bounds, speeds) = extremes(trajectory);
    let mut pieces = [0; 4];
    for segment in &trajectory.segments {
        let [holds, lines, cubics, septics] = &mut pieces;
        *match segment.path {
            SegmentPath::Hold => holds,
            SegmentPath::Line(_) => lines,
            SegmentPath::Cubic(_) => cubics,
            SegmentPath::Septic(_) => septics,
        } += 1;
    }
    DroneSummary {
        name: drone.name.clone(),
        start_m: trajectory.start_m.into(),
        end_m: trajectory.end_m().into(),
        duration_s: trajectory.duration_ms() as f64 / 1000.0,
        pieces,
        bounds_m: bounds.corners(),
        speeds,
        light_bytes: drone.lights.len(),
        skyb_problem: skyb.as_ref().err().map(ToString::to_string),
        skyb: skyb.ok(),
        derived_44: derive(trajectory, Firmware::V44, params),
        derived_46: derive(trajectory, Firmware::V46, params),
    }
}

impl Speeds {
    fn max(self, other: Self) -> Self {
        Self {
            horizontal_mps: self.horizontal_mps.max(other.horizontal_mps),
            up_mps: self.up_mps.max(other.up_mps),
            down_mps: self.down_mps.max(other.down_mps),
        }
    }
}

/// A box around points.
struct Bounds {
    low: Vector3<f64>,
    high: Vector3<f64>,
}

impl Default for Bounds {
    fn default() -> Self {
        let far = Vector3::repeat(f64::INFINITY);
        Self { low: far, high: -far }
    }
}

impl Bounds {
    fn add(&mut self, point: Vector3<f64>) {
        self.low = self.low.inf(&point);
        self.high = self.high.sup(&point);
    }

    fn corners(&self) -> [[f64; 3]; 2] {
        [self.low.into(), self.high.into()]
    }
}

/// Box and speeds from the control points: a curve and its derivative stay within those of theirs.
fn extremes(trajectory: &Trajectory) -> (Bounds, Speeds) {
    let mut bounds = Bounds::default();
    let mut speeds = Speeds::default();
    bounds.add(trajectory.start_m);
    for piece in trajectory.pieces() {
        let mut buffer = [Vector3::zeros(); 8];
        let points = piece.path.control_points(piece.from_m, &mut buffer);
        let rate = (points.len() - 1) as f64 / piece.duration_s();
        for point in points {
            bounds.add(*point);
        }
        for pair in points.windows(2) {
            let velocity = (pair[1] - pair[0]) * rate;
            speeds = speeds.max(Speeds {
                horizontal_mps: velocity.xy().norm(),
                up_mps: velocity.z,
                down_mps: -velocity.z,
            });
        }
    }
    (bounds, speeds)
}
