//! Facts that do not change while a flight is looked at.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::http::guard::Rank;
use crate::mission::Plan;
use crate::show::trajectory::Cursor;

/// Points of a trajectory are no further apart, s.
const STEP_S: f64 = 2.0;
/// Points of all trajectories together: a page draws no more.
const MOST_POINTS: usize = 20_000;

/// Flight, site and trajectories. Positions are in the show frame, m.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Facts {
    /// Name of the flight.
    pub flight: String,
    /// Title for people.
    pub title: String,
    /// Name of the site, as the plan has it; empty: it has none.
    pub site: String,
    /// Length of the show, s.
    pub duration_s: f64,
    /// Latitude and longitude of the show's origin, degrees.
    pub origin_deg: [f64; 2],
    /// Degrees clockwise from north to the x axis.
    pub orientation_deg: f64,
    /// Corners of the fence, m.
    pub fence_m: Vec<[f64; 2]>,
    /// Height of the fence above home, m.
    pub fence_top_m: f64,
    /// Slots: number, home (x, y, z in m) and index of the way.
    pub slots: Vec<(u16, [f64; 3], usize)>,
    /// Ways from home: time (s) and offset (x, y, z in m) of each point.
    pub ways: Vec<Vec<[f64; 4]>>,
    /// Program and version.
    pub made_by: String,
    /// Whether the page that asks may give orders.
    pub may_order: bool,
    /// Whether it is a replay.
    pub is_replay: bool,
}

impl Facts {
    /// Facts of a plan.
    pub fn of(plan: &Plan, is_replay: bool) -> Self {
        let mut ways: Vec<Vec<[f64; 4]>> = Vec::new();
        let mut by_group: BTreeMap<u16, usize> = BTreeMap::new();
        let most = MOST_POINTS / plan.groups.len().max(1);
        let slots = plan.slots.iter().map(|slot| {
            let way = *by_group.entry(slot.group).or_insert_with(|| {
                let trajectory = plan.trajectory(slot);
                let mut cursor = Cursor::new(&trajectory);
                let duration_s = trajectory.duration_ms() as f64 / 1000.0;
                let mut times: Vec<f64> =
                    trajectory.pieces().map(|piece| piece.start_ms as f64 / 1000.0).collect();
                let between = (duration_s / STEP_S).ceil().min(most as f64) as usize;
                times.extend((0..=between).map(|k| duration_s * k as f64 / between.max(1) as f64));
                times.sort_by(f64::total_cmp);
                times.dedup();
                let point = |time_s: f64| {
                    let at = cursor.state_at(time_s).position_m - trajectory.start_m;
                    [time_s, at.x, at.y, at.z].map(centi)
                };
                ways.push(straightened(times.into_iter().map(point).collect()));
                ways.len() - 1
            });
            (slot.slot, slot.home_m.map(centi), way)
        });
        let slots = slots.collect();
        Self {
            flight: plan.name.clone(),
            title: plan.title.clone(),
            site: plan.site_name.clone().unwrap_or_default(),
            duration_s: plan.duration_ms as f64 / 1000.0,
            origin_deg: [plan.site.origin_lat_deg, plan.site.origin_lon_deg],
            orientation_deg: plan.site.orientation_deg,
            fence_m: plan.fence.polygon_m.clone(),
            fence_top_m: plan.fence.max_altitude_m,
            slots,
            ways,
            made_by: concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned(),
            may_order: false,
            is_replay,
        }
    }

    /// Facts as a page of this rank is told them.
    #[must_use]
    pub fn seen_by(mut self, rank: Rank) -> Self {
        self.may_order = rank == Rank::Operator;
        self
    }
}

/// To hundredths: what is drawn needs no more.
pub fn centi(value: f64) -> f64 {
    (value * 100.0).round() / 100.0
}

/// Without points that lie on the way between their neighbours, in place and time.
fn straightened(points: Vec<[f64; 4]>) -> Vec<[f64; 4]> {
    /// Distance from the straight way that is not seen, m.
    const UNSEEN_M: f64 = 0.02;
    let mut kept: Vec<[f64; 4]> = Vec::with_capacity(points.len());
    for point in points {
        if let [.., before, last] = kept.as_slice() {
            let share = (last[0] - before[0]) / (point[0] - before[0]).max(1e-9);
            let off = (1..4).map(|axis| {
                (before[axis] + share * (point[axis] - before[axis]) - last[axis]).abs()
            });
            if off.fold(0.0, f64::max) < UNSEEN_M {
                kept.pop();
            }
        }
        kept.push(point);
    }
    kept
}
