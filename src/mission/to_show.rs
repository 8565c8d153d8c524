//! A plan's show: trajectories in the show frame, cues and limits.

use nalgebra::Vector3;

use super::plan::{self, Plan, SegmentKind, Slot};
use crate::show::lights::{self, LightStep, Rgb};
use crate::show::{Cue, FenceZone, Segment, SegmentPath, Show, ShowDrone, Trajectory, Validation};

impl Plan {
    /// Trajectory of a slot, in the show frame.
    ///
    /// Constant velocities become lines, ramps of constant acceleration become cubic Bézier pieces
    /// that are exactly that parabola.
    pub fn trajectory(&self, slot: &Slot) -> Trajectory {
        let home = Vector3::from(slot.home_m);
        let segments = self
            .segments(slot)
            .iter()
            .map(|segment| Segment {
                duration_ms: (segment.end_ms - segment.start_ms) as u32,
                path: path(segment, home),
            })
            .collect();
        Trajectory { start_m: home, segments }
    }
}

fn path(segment: &plan::Segment, home: Vector3<f64>) -> SegmentPath {
    let from = home + Vector3::from(segment.from_m);
    let to = home + Vector3::from(segment.to_m);
    match segment.from_velocity_mps {
        Some(start_velocity) => {
            // A parabola leaves along its start velocity: the quadratic's control point is half a
            // duration along it; raising the degree gives the cubic's two.
            let duration_s = (segment.end_ms - segment.start_ms) as f64 / 1000.0;
            let middle = from + Vector3::from(start_velocity) * (duration_s / 2.0);
            SegmentPath::Cubic([(from + middle * 2.0) / 3.0, (middle * 2.0 + to) / 3.0, to])
        }
        None if segment.from_m == segment.to_m => SegmentPath::Hold,
        None => SegmentPath::Line(to),
    }
}

/// Colour that tells people on the ground what a drone is doing.
fn color(kind: SegmentKind) -> Rgb {
    match kind {
        SegmentKind::Wait => [0, 0, 0],
        SegmentKind::LegUp => [255, 96, 0],
        SegmentKind::LegDown => [0, 96, 255],
        SegmentKind::Hover => [0, 160, 0],
        SegmentKind::Horizontal => [200, 0, 200],
        SegmentKind::Takeoff
        | SegmentKind::Climb
        | SegmentKind::Descend
        | SegmentKind::Ramp
        | SegmentKind::Landing => [96, 96, 96],
    }
}

/// Lights of a group: one colour per kind of segment, a ramp in that of the segment it leads to.
fn lights(segments: &[plan::Segment]) -> Vec<u8> {
    let mut steps: Vec<LightStep> = Vec::new();
    let mut ramp_ms = 0;
    for segment in segments {
        let duration_ms = (segment.end_ms - segment.start_ms) as u32;
        if segment.kind == SegmentKind::Ramp {
            ramp_ms += duration_ms;
            continue;
        }
        let color = color(segment.kind);
        match steps.last_mut() {
            Some(last) if last.color == color => last.duration_ms += ramp_ms + duration_ms,
            _ => steps.push(LightStep { duration_ms: ramp_ms + duration_ms, color, fade: false }),
        }
        ramp_ms = 0;
    }
    steps.push(LightStep { duration_ms: 1000, color: [0, 0, 0], fade: true });
    lights::encode(&steps)
}

impl Plan {
    /// The show of this plan: a trajectory and a light program for every slot, cues, and the fence.
    pub fn to_show(&self) -> Show {
        let plan = self;
        let programs: Vec<_> = plan.groups.iter().map(|group| lights(&group.segments)).collect();
        let drones = plan
            .slots
            .iter()
            .map(|slot| {
                let trajectory = plan.trajectory(slot);
                let end = trajectory.end_m();
                ShowDrone {
                    name: slot.name.clone(),
                    home_m: Some(Vector3::from(slot.home_m)),
                    land_at_m: Some(Vector3::new(end.x, end.y, slot.home_m[2])),
                    trajectory,
                    lights: programs.get(usize::from(slot.group)).cloned().unwrap_or_default(),
                    ..ShowDrone::default()
                }
            })
            .collect();
        let first = plan.groups.first().map_or(&[][..], |group| &group.segments);
        let at_s = |ms: u64| ms as f64 / 1000.0;
        let cues = first
            .iter()
            .filter(|segment| segment.kind != SegmentKind::Ramp)
            .map(|segment| Cue { time_s: at_s(segment.start_ms), name: segment.label.clone() })
            .collect();
        let takeoff_end = plan
            .groups
            .iter()
            .flat_map(|group| &group.segments)
            .filter(|segment| segment.kind == SegmentKind::Takeoff)
            .map(|segment| segment.end_ms)
            .max();
        let landing_start = plan
            .groups
            .iter()
            .flat_map(|group| &group.segments)
            .filter(|segment| segment.kind == SegmentKind::Landing)
            .map(|segment| segment.start_ms)
            .min();
        let limits = &plan.limits;
        Show {
            id: Some(format!("updraft-{}", plan.name)),
            title: Some(plan.title.clone()),
            frame: Some(plan.site.frame()),
            has_amsl: !plan.site.ground_assumed,
            drones,
            cues,
            validation: Some(Validation {
                max_altitude_m: Some(limits.max_altitude_m),
                max_velocity_xy_mps: Some(limits.max_speed_xy_mps),
                max_velocity_z_mps: Some(limits.max_speed_down_mps),
                max_velocity_z_up_mps: Some(limits.max_speed_up_mps),
                min_distance_m: Some(limits.min_distance_m),
                max_acceleration_xy_mps2: Some(limits.max_acceleration_mps2),
                max_acceleration_z_mps2: Some(limits.max_acceleration_mps2),
                max_acceleration_mps2: Some(limits.max_acceleration_mps2),
                max_velocity_step_mps: Some(limits.max_velocity_step_mps),
                endurance_s: Some(limits.endurance_s),
                endurance_reserve: Some(limits.endurance_reserve),
                ..Validation::default()
            }),
            fence: fence(plan),
            fence_altitude_m: (!plan.fence.polygon_m.is_empty())
                .then_some(plan.fence.max_altitude_m),
            doubts: Vec::new(),
            phases_s: takeoff_end
                .zip(landing_start)
                .map(|(takeoff, landing)| [at_s(takeoff), at_s(landing), at_s(plan.duration_ms)]),
        }
    }
}

/// A plan without a polygon has no fence.
fn fence(plan: &Plan) -> Vec<FenceZone> {
    let polygon_m = &plan.fence.polygon_m;
    if polygon_m.is_empty() { vec![] } else { vec![FenceZone::inclusion(polygon_m.clone())] }
}
