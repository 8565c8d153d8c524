//! Check that a plan can measure what it is flown for: it needs windows, and speeds that differ.

use std::collections::BTreeSet;

use super::plan::{Group, Plan, Purpose, Segment, SegmentKind};
use crate::check::{Collector, Finding, Rule, Severity};

/// Speeds that a law needs at least: one gives one equation for two unknowns.
const MIN_SPEEDS: usize = 2;
/// Speeds closer than this are the same, m/s.
const SAME_SPEED_MPS: f64 = 0.01;

/// Names of the findings of this check.
pub const NAMES: [&str; 2] = ["ladder-speeds", "ladder-window"];

/// Warns of segments that the analysis will leave out, and of ladders of one speed; a ladder from which no law can come
/// is an error.
impl Rule for Plan {
    fn check(&self, collector: &mut Collector) {
        for group in &self.groups {
            windows(self, group, collector);
            if !counts(self.purpose, SegmentKind::Hover) {
                eaten_hovers(group, collector);
            }
        }
        if self.purpose == Purpose::Calibration {
            speeds(self, collector);
        }
    }
}

/// Whether a segment is flown to be looked at.
fn counts(purpose: Purpose, kind: SegmentKind) -> bool {
    match purpose {
        Purpose::Calibration => kind.is_leg() || kind == SegmentKind::Horizontal,
        Purpose::Measurement => {
            kind == SegmentKind::Hover || kind.is_leg() || kind == SegmentKind::Horizontal
        }
    }
}

/// One warning for all segments of a group without a window.
fn windows(plan: &Plan, group: &Group, collector: &mut Collector) {
    let wanted: Vec<&Segment> =
        group.segments.iter().filter(|segment| counts(plan.purpose, segment.kind)).collect();
    let blind: Vec<&&Segment> = wanted.iter().filter(|segment| segment.window.is_none()).collect();
    let Some(first) = blind.first() else { return };
    let lasts_s = (first.end_ms - first.start_ms) as f64 / 1000.0;
    let message = format!(
        "{} of {} segments to be analysed (group {}) are too short for an analysis window, first \"{}\" of {lasts_s:.1} s: they will not count",
        blind.len(),
        wanted.len(),
        group.name,
        first.label,
    );
    collector.add(
        0,
        Finding {
            time_s: Some(first.start_ms as f64 / 1000.0),
            value: Some(lasts_s),
            unit: "s",
            ..warning("ladder-window", message, "fly them longer, or settle and trim less")
        },
    );
}

/// One warning for all hovers of a group that have no window because of the ramp they begin with.
fn eaten_hovers(group: &Group, collector: &mut Collector) {
    let of_transfer =
        |kind| matches!(kind, SegmentKind::Takeoff | SegmentKind::Climb | SegmentKind::Descend);
    let mut eaten = Vec::new();
    let mut before: [Option<&Segment>; 2] = [None, None];
    for segment in &group.segments {
        // The ramp at the end of a transfer is the transfer's own time.
        if let [Some(flown), Some(ramp)] = before
            && segment.kind == SegmentKind::Hover
            && segment.window.is_none()
            && ramp.kind == SegmentKind::Ramp
            && !of_transfer(flown.kind)
        {
            eaten.push((ramp, segment));
        }
        before = [before[1], Some(segment)];
    }
    let Some((ramp, first)) = eaten.first() else { return };
    let hovers = group.segments.iter().filter(|segment| segment.kind == SegmentKind::Hover).count();
    let lasts_s = |segment: &Segment| (segment.end_ms - segment.start_ms) as f64 / 1000.0;
    let message = format!(
        "{} of {hovers} hovers (group {}) are too short for an analysis window after the ramps they begin with, first \"{}\": {:.1} s are left after a ramp of {:.1} s",
        eaten.len(),
        group.name,
        first.label,
        lasts_s(first),
        lasts_s(ramp),
    );
    collector.add(
        0,
        Finding {
            time_s: Some(first.start_ms as f64 / 1000.0),
            value: Some(lasts_s(first)),
            unit: "s",
            ..warning("ladder-window", message, "hover longer, or take a larger ramp acceleration")
        },
    );
}

/// A ladder of one speed, or of none that can be looked at.
fn speeds(plan: &Plan, collector: &mut Collector) {
    let speeds: BTreeSet<i64> = plan
        .groups
        .iter()
        .flat_map(|group| &group.segments)
        .filter(|segment| segment.kind.is_leg() && segment.window.is_some())
        .map(|segment| (segment.velocity_mps[2].abs() / SAME_SPEED_MPS).round() as i64)
        .collect();
    if speeds.len() >= MIN_SPEEDS {
        return;
    }
    let counted = |found: Finding| Finding {
        value: Some(speeds.len() as f64),
        limit: Some(MIN_SPEEDS as f64),
        ..found
    };
    let remedy = "fly legs at two speeds or more, each long enough for its window; the paper's ladder has \
                  seven";
    collector.add(
        0,
        counted(match speeds.first() {
            // What is flown for a law must be able to give one.
            None => Finding::new(
                Severity::Error,
                "ladder-speeds",
                "the ladder has no leg with an analysis window: no law can be fitted".to_owned(),
                remedy,
            ),
            Some(speed) => {
                let speed_mps = *speed as f64 * SAME_SPEED_MPS;
                let message = format!(
                    "all legs of the ladder have the same speed, {speed_mps:.2} m/s: a straight line is all \
                     that can be fitted to fewer than {MIN_SPEEDS} speeds"
                );
                warning("ladder-speeds", message, remedy)
            }
        }),
    );
}

fn warning(check: &'static str, message: String, remedy: &'static str) -> Finding {
    Finding::new(Severity::Warning, check, message, remedy)
}
