//! Horizontal wind in blocks of a log, from the lean that no acceleration needs.

use super::super::statistics::tilt_wind::{LeanDrag, MeanLean};
use super::records::{Blocks, GRAVITY_MPS2, Integral};
use crate::flight::{Flight, Series};

/// Half of the time over which a way gives speed and acceleration, s: positions of a filter are known to millimetres, and a
/// second difference over less has more noise than air.
const HALF_S: f64 = 0.5;

/// A log, as far as it tells the wind.
pub(super) struct Horizontal<'a> {
    flight: &'a Flight,
    drag: LeanDrag<'a>,
    blocks: Blocks,
    roll: Integral<'a>,
    pitch: Integral<'a>,
}

impl<'a> Horizontal<'a> {
    pub(super) fn of(flight: &'a Flight, drag: LeanDrag<'a>, blocks: &Blocks) -> Self {
        let (roll, pitch) = (Integral::of(&flight.roll_rad), Integral::of(&flight.pitch_rad));
        Self { flight, drag, blocks: *blocks, roll, pitch }
    }

    /// Wind towards east and north in each block that counts; empty where it is not known at all.
    pub(super) fn record(
        &self,
        count: usize,
        counts: impl Fn(usize) -> bool,
    ) -> Vec<Option<[f64; 2]>> {
        if self.drag.share().is_none() {
            return Vec::new();
        }
        let found: Vec<Option<[f64; 2]>> =
            (0..count).map(|index| self.block(index).filter(|_| counts(index))).collect();
        if found.iter().all(Option::is_none) { Vec::new() } else { found }
    }

    fn block(&self, index: usize) -> Option<[f64; 2]> {
        let time_s = self.blocks.centre_s(index);
        let gap_s = 2.0 * self.blocks.step_s;
        let (from, to) = (time_s - HALF_S, time_s + HALF_S);
        let lean = MeanLean::forward_right_of(
            self.roll.mean(from, to, gap_s)?,
            self.pitch.mean(from, to, gap_s)?,
        );
        let heading = self.flight.yaw_deg.latest(time_s, gap_s.max(1.0))?.to_radians();
        let (sin, cos) = heading.sin_cos();
        let [east, north] =
            [Self::way(&self.flight.east_m, time_s)?, Self::way(&self.flight.north_m, time_s)?];
        // What the drone is accelerated by, forward and to the right, is not held against the wind.
        let ahead = (east[1] * sin + north[1] * cos) / GRAVITY_MPS2;
        let right = (east[1] * cos - north[1] * sin) / GRAVITY_MPS2;
        let [flow_ahead, flow_right] = self.drag.flow([lean[0] - ahead, lean[1] - right]);
        let wind = [
            east[0] - (flow_ahead * sin + flow_right * cos),
            north[0] + flow_right * sin - flow_ahead * cos,
        ];
        wind.iter().all(|mps| mps.is_finite()).then_some(wind)
    }

    /// Speed and acceleration along an axis: those of the way half a second before and after.
    fn way(series: &Series, time_s: f64) -> Option<[f64; 2]> {
        let at = |time_s: f64| series.at(time_s, 1.0);
        let (before, now, after) = (at(time_s - HALF_S)?, at(time_s)?, at(time_s + HALF_S)?);
        let speed = (after - before) / (2.0 * HALF_S);
        Some([speed, (after - 2.0 * now + before) / HALF_S.powi(2)])
    }
}
