//! A plan recovered from a show, so that anybody's show can be analysed.
//!
//! What a show file does not say is inferred by stated rules:
//! * drones whose trajectories differ only by their homes are one command group;
//! * neighbouring pieces on one line at one constant velocity are one segment (files split long ones);
//! * the first climb from the ground is the take-off, a last vertical descent the landing;
//! * a vertical piece of at least 5 s between hovers is a rung of the ladder, any other a transfer;
//! * a piece of constant acceleration is a ramp; a curve of changing acceleration is described as a
//!   ramp between its end velocities, which [`Plan::briefing`] says.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::mission::plan::{
    Fence, Group, PLAN_SCHEMA, Plan, Purpose, Segment, SegmentKind, Site, Slot,
};
use crate::mission::window::WindowRule;
use crate::show::{SegmentPath, Show, Trajectory};
use crate::vehicle::{Limits, Vehicle};

/// Velocities closer than this are the same, m/s: what rounding to a file's units can change.
const SAME_VELOCITY_MPS: f64 = 0.01;
/// How far the point between two pieces may be from the one line that they are taken for, m: the
/// resolution of `.skyc` files. Slow commands that differ by less than a file's rounding stay apart.
const JOINT_M: f64 = 0.001;
/// Shortest vertical piece that counts as a rung, ms.
const MIN_LEG_MS: u64 = 5_000;

impl Plan {
    /// Recovers a plan from a show; `vehicle` gives the limits that the show does not state.
    pub fn of_show(show: &Show, vehicle: &Vehicle) -> Self {
        let mut groups: Vec<Group> = Vec::new();
        let mut known: BTreeMap<Vec<i64>, u16> = BTreeMap::new();
        let mut curved = false;
        let mut slots = Vec::with_capacity(show.drones.len());
        for (index, drone) in show.drones.iter().enumerate() {
            let trajectory = &drone.trajectory;
            let group = *known.entry(fingerprint(trajectory)).or_insert_with(|| {
                groups.push(group(groups.len(), trajectory, &mut curved));
                (groups.len() - 1) as u16
            });
            slots.push(Slot {
                slot: (index + 1) as u16,
                name: drone.name.clone(),
                row: 0,
                column: 0,
                home_m: trajectory.start_m.into(),
                group,
            });
        }
        let all = || groups.iter().flat_map(|group| &group.segments);
        let duration_ms = all().map(|segment| segment.end_ms).max().unwrap_or(0);
        let ladder = all().filter(|segment| segment.kind.is_leg()).count() >= 2;
        let limits = limits(show, vehicle.limits);
        let title = show.title.clone().unwrap_or_else(|| "Show".to_owned());
        let mut briefing = Vec::new();
        if curved {
            briefing.push(
                "This show has curves of changing acceleration; they are described only by their ends."
                    .to_owned(),
            );
        }
        Self {
            schema: PLAN_SCHEMA.to_owned(),
            name: "show".to_owned(),
            title,
            purpose: if ladder { Purpose::Calibration } else { Purpose::Measurement },
            vehicle: vehicle.name.clone(),
            site: site(show),
            site_name: None,
            utc_offset_h: None,
            fence: fence(show, &limits),
            limits,
            grid: None,
            slots,
            groups,
            duration_ms,
            briefing,
        }
    }
}

/// What a trajectory is relative to its start, in whole millimetres and milliseconds.
fn fingerprint(trajectory: &Trajectory) -> Vec<i64> {
    let mut key = Vec::new();
    let mut buffer = [Vector3::zeros(); 8];
    for piece in trajectory.pieces() {
        key.push((piece.end_ms - piece.start_ms) as i64);
        for point in piece.path.control_points(piece.from_m, &mut buffer) {
            let relative = (point - trajectory.start_m) * 1000.0;
            key.extend(relative.iter().map(|value| value.round() as i64));
        }
        // Keeps "one cubic" apart from "several lines with the same numbers".
        key.push(i64::MIN);
    }
    key
}

/// A stretch of trajectory before it gets its kind.
struct Stretch {
    start_ms: u64,
    end_ms: u64,
    from_m: Vector3<f64>,
    to_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    from_velocity_mps: Option<Vector3<f64>>,
    /// Velocities, m/s, of the lines from its start that pass all its inner points near enough.
    passing_mps: [Vector3<f64>; 2],
}

impl Stretch {
    fn seconds_to(&self, ms: u64) -> f64 {
        (ms - self.start_ms) as f64 / 1000.0
    }

    /// Lengthens it to a new end, if it stays one straight line.
    fn goes_straight_on(&mut self, end_ms: u64, to_m: Vector3<f64>) -> bool {
        let joint_s = self.seconds_to(self.end_ms);
        let (mean_mps, slack_mps) = ((self.to_m - self.from_m) / joint_s, JOINT_M / joint_s);
        let low_mps = self.passing_mps[0].sup(&mean_mps.add_scalar(-slack_mps));
        let high_mps = self.passing_mps[1].inf(&mean_mps.add_scalar(slack_mps));
        let velocity_mps = (to_m - self.from_m) / self.seconds_to(end_ms);
        let passes = low_mps <= velocity_mps && velocity_mps <= high_mps;
        if passes {
            self.passing_mps = [low_mps, high_mps];
            (self.end_ms, self.to_m, self.velocity_mps) = (end_ms, to_m, velocity_mps);
        }
        passes
    }
}

fn group(index: usize, trajectory: &Trajectory, curved: &mut bool) -> Group {
    let stretches = stretches(trajectory, curved);
    let kinds = kinds(&stretches);
    let rule = WindowRule::default();
    let segments: Vec<_> = stretches
        .iter()
        .zip(kinds)
        .map(|(stretch, kind)| Segment {
            kind,
            label: label(kind, stretch),
            start_ms: stretch.start_ms,
            end_ms: stretch.end_ms,
            from_m: stretch.from_m.into(),
            to_m: stretch.to_m.into(),
            velocity_mps: stretch.velocity_mps.into(),
            from_velocity_mps: stretch.from_velocity_mps.map(Into::into),
            window: rule.of(kind, stretch.start_ms, stretch.end_ms),
            calibrates_wind: false,
        })
        .collect();
    let offset_ms = match segments.first() {
        Some(first) if first.kind == SegmentKind::Wait => first.end_ms,
        _ => 0,
    };
    Group { name: format!("group-{}", index + 1), offset_ms, segments }
}

fn stretches(trajectory: &Trajectory, curved: &mut bool) -> Vec<Stretch> {
    let mut stretches: Vec<Stretch> = Vec::new();
    for piece in trajectory.pieces() {
        if piece.end_ms == piece.start_ms {
            continue;
        }
        let (from_m, to_m) =
            (piece.from_m - trajectory.start_m, piece.end_m() - trajectory.start_m);
        let straight = matches!(piece.path, SegmentPath::Hold | SegmentPath::Line(_));
        let (first, last) = (piece.state(0.0), piece.state(1.0));
        let mean_mps = (to_m - from_m) / piece.duration_s();
        if straight {
            if let Some(before) = stretches.last_mut()
                && before.from_velocity_mps.is_none()
                && (before.velocity_mps - mean_mps).norm() < SAME_VELOCITY_MPS
                && before.goes_straight_on(piece.end_ms, to_m)
            {
                continue;
            }
        } else {
            let changing = (last.acceleration_mps2 - first.acceleration_mps2).norm();
            *curved |= changing > 0.05 * (1.0 + first.acceleration_mps2.norm());
        }
        stretches.push(Stretch {
            start_ms: piece.start_ms,
            end_ms: piece.end_ms,
            from_m,
            to_m,
            velocity_mps: if straight { mean_mps } else { last.velocity_mps },
            from_velocity_mps: (!straight).then_some(first.velocity_mps),
            passing_mps: [f64::NEG_INFINITY, f64::INFINITY].map(Vector3::repeat),
        });
    }
    stretches
}

fn is_hover(stretch: &Stretch) -> bool {
    stretch.from_velocity_mps.is_none() && stretch.velocity_mps.norm() < SAME_VELOCITY_MPS
}

fn is_vertical(stretch: &Stretch) -> bool {
    stretch.velocity_mps.xy().norm() < SAME_VELOCITY_MPS
}

fn kinds(stretches: &[Stretch]) -> Vec<SegmentKind> {
    let flown = stretches.iter().position(|stretch| !is_hover(stretch)).unwrap_or(stretches.len());
    let last = stretches.len().saturating_sub(1);
    // The neighbour in time that is not a ramp.
    let steady = |mut range: Box<dyn Iterator<Item = usize>>| {
        range.find(|&index| stretches[index].from_velocity_mps.is_none())
    };
    let mut taken_off = false;
    let mut kinds = Vec::with_capacity(stretches.len());
    for (index, stretch) in stretches.iter().enumerate() {
        let up = stretch.velocity_mps.z > 0.0;
        let kind = if stretch.from_velocity_mps.is_some() {
            SegmentKind::Ramp
        } else if is_hover(stretch) {
            if index < flown { SegmentKind::Wait } else { SegmentKind::Hover }
        } else if !is_vertical(stretch) {
            SegmentKind::Horizontal
        } else if !taken_off && up {
            taken_off = true;
            SegmentKind::Takeoff
        } else if index == last && !up {
            SegmentKind::Landing
        } else {
            let before = steady(Box::new((0..index).rev()));
            let after = steady(Box::new(index + 1..stretches.len()));
            let between_hovers = [before, after]
                .into_iter()
                .all(|neighbour| neighbour.is_some_and(|at| is_hover(&stretches[at])));
            match (between_hovers && stretch.end_ms - stretch.start_ms >= MIN_LEG_MS, up) {
                (true, true) => SegmentKind::LegUp,
                (true, false) => SegmentKind::LegDown,
                (false, true) => SegmentKind::Climb,
                (false, false) => SegmentKind::Descend,
            }
        };
        kinds.push(kind);
    }
    kinds
}

fn label(kind: SegmentKind, stretch: &Stretch) -> String {
    let speed = (stretch.velocity_mps.norm() * 100.0).round() / 100.0;
    let height = (stretch.to_m.z * 10.0).round() / 10.0;
    match kind {
        SegmentKind::Wait => "wait".to_owned(),
        SegmentKind::Takeoff => format!("take off to {height} m"),
        SegmentKind::Climb => format!("climb to {height} m"),
        SegmentKind::Descend => format!("descend to {height} m"),
        SegmentKind::LegUp => format!("up {speed} m/s"),
        SegmentKind::LegDown => format!("down {speed} m/s"),
        SegmentKind::Hover => format!("hover at {height} m"),
        SegmentKind::Horizontal => format!("{speed} m/s sideways"),
        SegmentKind::Ramp => "ramp".to_owned(),
        SegmentKind::Landing => format!("descend to {height} m and land"),
    }
}

fn site(show: &Show) -> Site {
    match show.frame {
        Some(frame) => Site {
            origin_lat_deg: frame.origin.lat_deg,
            origin_lon_deg: frame.origin.lon_deg,
            ground_amsl_m: frame.origin.amsl_m,
            ground_assumed: !show.has_amsl,
            orientation_deg: frame.orientation_deg,
        },
        None => Site {
            origin_lat_deg: 0.0,
            origin_lon_deg: 0.0,
            ground_amsl_m: 0.0,
            ground_assumed: true,
            orientation_deg: 0.0,
        },
    }
}

/// The show's limits, and the vehicle's where it states none.
///
/// Of distance, altitude and speeds the stricter one counts: a show cannot give itself more than the
/// vehicle has. The rest (acceleration, velocity step, endurance) is as stated: only shows of this
/// program state it.
fn limits(show: &Show, mut limits: Limits) -> Limits {
    let stated = show.validation.unwrap_or_default();
    let usable = |value: &f64| value.is_finite() && *value > 0.0;
    let up_mps = stated.max_velocity_z_up_mps.or(stated.max_velocity_z_mps);
    let strict = [
        (stated.max_altitude_m, &mut limits.max_altitude_m),
        (stated.max_velocity_xy_mps, &mut limits.max_speed_xy_mps),
        (stated.max_velocity_z_mps, &mut limits.max_speed_down_mps),
        (up_mps, &mut limits.max_speed_up_mps),
    ];
    for (value, limit) in strict {
        if let Some(value) = value.filter(usable) {
            *limit = limit.min(value);
        }
    }
    if let Some(value) = stated.min_distance_m.filter(usable) {
        limits.min_distance_m = limits.min_distance_m.max(value);
    }
    let free = [
        (stated.max_acceleration_mps2, &mut limits.max_acceleration_mps2),
        (stated.max_velocity_step_mps, &mut limits.max_velocity_step_mps),
        (stated.endurance_s, &mut limits.endurance_s),
    ];
    for (value, limit) in free {
        if let Some(value) = value.filter(usable) {
            *limit = value;
        }
    }
    // A reserve of nothing may be meant.
    if let Some(reserve) = stated.endurance_reserve.filter(|value| (0.0..1.0).contains(value)) {
        limits.endurance_reserve = reserve;
    }
    limits
}

/// The first inclusion polygon that the show brings, if it does: none is made up (the check looks at
/// the show's other polygons by itself). Where a show file states no top of the fence, the altitude
/// limit stands in its place.
fn fence(show: &Show, limits: &Limits) -> Fence {
    let inclusion = show.fence.iter().find(|zone| zone.is_inclusion);
    let top_m = show.fence_altitude_m.filter(|top_m| top_m.is_finite() && *top_m > 0.0);
    Fence {
        polygon_m: inclusion.map(|zone| zone.corners_m.clone()).unwrap_or_default(),
        max_altitude_m: top_m.unwrap_or(limits.max_altitude_m),
        margin_m: 0.0,
    }
}

#[cfg(test)]
mod tests {
    use crate::mission::plan::{Plan, Segment, SegmentKind};
    use crate::mission::resolve::{Override, resolve};

    fn round_trip(template: &str, overrides: &[&str]) -> (Plan, Plan) {
        let overrides: Vec<_> =
            overrides.iter().map(|text| Override::parse(text).unwrap()).collect();
        let flight = resolve(template, &overrides).unwrap().flights.remove(0);
        let recovered = Plan::of_show(&flight.plan.to_show(), &flight.vehicle);
        (flight.plan, recovered)
    }

    fn timetable(segments: &[Segment]) -> Vec<(SegmentKind, u64, u64, [i64; 3])> {
        let cm_per_s = |value: f64| (value * 100.0).round() as i64;
        let row = |s: &Segment| (s.kind, s.start_ms, s.end_ms, s.velocity_mps.map(cm_per_s));
        segments.iter().map(row).collect()
    }

    #[test]
    fn the_ladder_comes_back_from_its_show() {
        for ramp in ["motion.ramp_mps2=0", "motion.ramp_mps2=2"] {
            let (plan, recovered) = round_trip("calibration", &[ramp]);
            assert_eq!(recovered.groups.len(), 1);
            assert_eq!(
                timetable(&recovered.groups[0].segments),
                timetable(&plan.groups[0].segments),
                "{ramp}"
            );
            for (there, here) in recovered.groups[0].segments.iter().zip(&plan.groups[0].segments) {
                assert_eq!(there.window, here.window, "{}", here.label);
            }
            assert_eq!(recovered.slots.len(), 49);
            assert_eq!(recovered.slots[48].home_m, plan.slots[48].home_m);
            assert_eq!(recovered.purpose, plan.purpose);
        }
    }

    #[test]
    fn command_groups_come_back() {
        let (plan, recovered) = round_trip("calibration-counterphase", &[]);
        assert_eq!(recovered.groups.len(), 2);
        let membership = |plan: &Plan| plan.slots.iter().map(|s| s.group).collect::<Vec<_>>();
        assert_eq!(membership(&recovered), membership(&plan));
        assert!(recovered.briefing.is_empty(), "lines are not curves");
    }

    #[test]
    fn a_hover_comes_back() {
        let (plan, recovered) = round_trip("hover", &[]);
        let longest = |plan: &Plan| {
            let hovers = plan.groups[0].segments.iter().filter(|s| s.kind == SegmentKind::Hover);
            hovers.map(|s| (s.end_ms - s.start_ms, s.start_ms)).max()
        };
        assert_eq!(longest(&recovered), longest(&plan));
        assert_eq!(recovered.purpose, plan.purpose);
    }
}
