//! Limits of the `.skyb` format and of the tools that write it: range, unit, size and durations.
//!
//! The writer itself is asked what it makes of a trajectory, so that both never disagree.

use rayon::prelude::*;

use super::report::{Collector, Finding, Margin, Severity};
use super::track::Track;
use crate::skyb::{self, MAX_BODY, MAX_SCALE_MM, SkybCost, SkybError, SkybOptions};

/// Longest segment that Skybrush's server leaves whole, ms.
const SERVER_SEGMENT_MS: u64 = 65_000;
/// What whole millimetres can move a point by, mm: half of one along each axis.
const FINE_MM: f64 = 0.866_025_4;

/// What a drone's trajectory needs in a `.skyb` file.
struct Need {
    cost: Result<SkybCost, SkybError>,
    /// Largest loss of time, ms, when Skybrush's server splits a long piece, with its time.
    lost: Option<(u64, f64)>,
}

impl Need {
    fn of(track: &Track<'_>) -> Self {
        let cost = skyb::measure(&track.drone.trajectory, &SkybOptions::default());
        let mut lost: Option<(u64, f64)> = None;
        for piece in &track.pieces {
            let duration_ms = piece.end_ms - piece.start_ms;
            if duration_ms > SERVER_SEGMENT_MS {
                let parts = duration_ms / SERVER_SEGMENT_MS + 1;
                let loss = duration_ms % parts;
                if loss > lost.map_or(0, |(most, _)| most) {
                    lost = Some((loss, piece.start_ms as f64 / 1000.0));
                }
            }
        }
        Self { cost, lost }
    }

    /// Size of the trajectory's block, also one that is too large, B.
    fn body(&self) -> Option<usize> {
        match &self.cost {
            Ok(cost) => Some(cost.trajectory_bytes),
            Err(SkybError::TooManyPieces { bytes, .. }) => Some(*bytes),
            Err(_) => None,
        }
    }

    fn scale_mm(&self) -> Option<u8> {
        self.cost.as_ref().ok().map(|cost| cost.scale_mm)
    }

    /// What rounding moves a point by, mm, if that is more than whole millimetres would.
    fn coarse_mm(&self) -> Option<f64> {
        let rounding_mm = self.cost.as_ref().ok()?.quantisation.max_position_m * 1000.0;
        (rounding_mm > FINE_MM + 1e-3).then_some(rounding_mm)
    }
}

pub(super) fn check(tracks: &[Track<'_>], collector: &mut Collector) {
    let needs: Vec<_> = tracks.par_iter().map(Need::of).collect();
    for (track, need) in tracks.iter().zip(&needs) {
        check_drone(track, need, collector);
    }
    coarse_units(tracks, &needs, collector);
    margins(tracks, &needs, collector);
}

fn check_drone(track: &Track<'_>, need: &Need, collector: &mut Collector) {
    let mut add = |(severity, check), time_s, (value, limit, unit), message, remedy| {
        let finding = Finding {
            severity,
            check,
            drones: vec![track.name()],
            time_s,
            end_s: None,
            value: Some(value),
            limit: Some(limit),
            unit,
            message,
            remedy,
        };
        collector.add(track.index, finding);
    };
    if let Err(SkybError::OutOfRange { value_m, reach_m, .. }) = &need.cost {
        let message =
            format!("has a coordinate of {value_m:.3} m; .skyb files hold up to {reach_m:.3} m");
        let kind = (Severity::Error, "skyb-range");
        let remedy = "put the origin of the show near its middle";
        add(kind, None, (*value_m, *reach_m, "m"), message, remedy);
    }
    let lights = Some(track.drone.lights.len());
    for (what, body) in [("trajectory", need.body()), ("light program", lights)] {
        let Some(body) = body.filter(|body| *body > MAX_BODY) else { continue };
        let message = format!("needs {body} B for its {what}; a .skyb block holds {MAX_BODY} B");
        let kind = (Severity::Error, "skyb-size");
        let values = (body as f64, MAX_BODY as f64, "B");
        add(kind, None, values, message, "use fewer and longer pieces");
    }
    if let Some((loss, time_s)) = need.lost {
        let message = format!(
            "has a piece longer than 65 s that Skybrush's server cuts into parts {loss} ms short in all"
        );
        let kind = (Severity::Warning, "skyb-duration");
        let remedy = "cut long pieces into equal parts of whole milliseconds";
        add(kind, Some(time_s), (loss as f64, 0.0, "ms"), message, remedy);
    }
}

/// One warning for the whole show: large shows have coarse units, and it is the same for all drones.
fn coarse_units(tracks: &[Track<'_>], needs: &[Need], collector: &mut Collector) {
    let mut worst: Option<(&Track<'_>, u8, f64)> = None;
    let mut count = 0;
    for (track, need) in tracks.iter().zip(needs) {
        let (Some(scale_mm), Some(error_mm)) = (need.scale_mm(), need.coarse_mm()) else {
            continue;
        };
        count += 1;
        if worst.is_none_or(|(_, _, most)| error_mm > most + 1e-9) {
            worst = Some((track, scale_mm, error_mm));
        }
    }
    let Some((track, scale_mm, error_mm)) = worst else { return };
    let others = match count {
        1 => String::new(),
        count => format!("; {count} drones are rounded more than at 1 mm"),
    };
    let finding = Finding {
        severity: Severity::Warning,
        check: "skyb-unit",
        drones: vec![track.name()],
        time_s: None,
        end_s: None,
        value: Some(error_mm),
        limit: Some(FINE_MM),
        unit: "mm",
        message: format!(
            "is stored in units of {scale_mm} mm, which moves a point by up to {error_mm:.1} mm{others}"
        ),
        remedy: "put the origin near the middle of the show, or way-points on a 10 mm grid",
    };
    collector.add(track.index, finding);
}

fn margins(tracks: &[Track<'_>], needs: &[Need], collector: &mut Collector) {
    type Measure = fn(&Need) -> Option<f64>;
    let measures: [(&'static str, &'static str, Measure, f64, &'static str); 2] = [
        (
            "skyb-unit",
            "coarsest unit of a .skyb file",
            |need| need.scale_mm().map(f64::from),
            f64::from(MAX_SCALE_MM),
            "mm",
        ),
        (
            "skyb-size",
            "largest trajectory block",
            |need| need.body().map(|body| body as f64),
            MAX_BODY as f64,
            "B",
        ),
    ];
    for (check, quantity, measure, limit, unit) in measures {
        let mut most: Option<(f64, &Track<'_>)> = None;
        for (track, need) in tracks.iter().zip(needs) {
            let Some(value) = measure(need) else { continue };
            if most.is_none_or(|(known, _)| value > known) {
                most = Some((value, track));
            }
        }
        if let Some((value, track)) = most {
            collector.margin(Margin {
                check,
                quantity,
                value,
                limit: Some(limit),
                unit,
                drones: vec![track.name()],
                time_s: None,
            });
        }
    }
}
