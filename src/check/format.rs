//! Limits of the `.skyb` format and of the tools that write it: range, unit, size and durations.

use super::report::{Collector, Finding, Margin, Severity};
use super::track::{Track, curve_of};
use crate::show::Path;

/// Largest unit, mm.
const MAX_SCALE: u64 = 127;
/// Largest coordinate in units.
const MAX_UNITS: f64 = 32_767.0;
/// Largest body of a block, B.
const MAX_BODY: u64 = 65_535;
/// Header of the trajectory block, B.
const HEADER: u64 = 9;
/// Longest segment, ms.
const MAX_SEGMENT_MS: u64 = 65_535;
/// Longest segment that Skybrush's server leaves whole, ms.
const SERVER_SEGMENT_MS: u64 = 65_000;
/// Rounding that a unit of 1 mm has anyway, mm.
const FINE_MM: f64 = 0.5;

/// What a drone's trajectory needs in a `.skyb` file.
struct Need {
    scale: u64,
    /// Largest coordinate, control points included, m.
    largest_m: f64,
    /// Largest rounding of a coordinate in that unit, mm, and the time of its piece, s.
    rounding: (f64, f64),
    body: u64,
    /// Largest loss of time, ms, when Skybrush's server splits a long piece, with its time.
    lost: Option<(u64, f64)>,
}

fn need(track: &Track<'_>) -> Need {
    let mut largest_m: f64 = 0.0;
    let mut each = |point: &nalgebra::Vector3<f64>| largest_m = largest_m.max(point.amax());
    each(&track.start_m);
    for piece in &track.pieces {
        curve_of(piece).points().iter().for_each(&mut each);
    }
    // Rounded to a micrometre first, so that 32.767 m is 32767 units in spite of binary fractions.
    let units = (largest_m * 1e6).round() / 1e3;
    let scale = ((units / MAX_UNITS).ceil() as u64).max(1);
    let mut rounding = (0.0, 0.0);
    let mut body = HEADER;
    let mut lost: Option<(u64, f64)> = None;
    let round = |value_m: f64| (value_m * 1000.0 / scale as f64).round();
    for piece in &track.pieces {
        let start_s = piece.start_ms as f64 / 1000.0;
        let curve = curve_of(piece);
        let values: u64 = match piece.path {
            Path::Hold => 0,
            Path::Line(_) => 1,
            Path::Cubic(_) => 3,
            Path::Septic(_) => 7,
        };
        let mut axes = 0;
        for axis in 0..3 {
            let first = round(curve.first()[axis]);
            axes += u64::from(curve.points().iter().any(|point| round(point[axis]) != first));
            for point in curve.points() {
                let error = (round(point[axis]) * scale as f64 - point[axis] * 1000.0).abs();
                if error > rounding.0 + 1e-9 {
                    rounding = (error, start_s);
                }
            }
        }
        let duration_ms = piece.end_ms - piece.start_ms;
        body += duration_ms.div_ceil(MAX_SEGMENT_MS) * (3 + 2 * values * axes);
        if duration_ms > SERVER_SEGMENT_MS {
            let parts = duration_ms / SERVER_SEGMENT_MS + 1;
            let loss = duration_ms % parts;
            if loss > lost.map_or(0, |(most, _)| most) {
                lost = Some((loss, start_s));
            }
        }
    }
    Need { scale, largest_m, rounding, body, lost }
}

pub(super) fn check(tracks: &[Track<'_>], collector: &mut Collector) {
    let needs: Vec<_> = tracks.iter().map(need).collect();
    for (track, need) in tracks.iter().zip(&needs) {
        let finding = |severity, check, time_s, value, limit, unit, message, remedy| Finding {
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
        let range_m = MAX_SCALE as f64 * MAX_UNITS / 1000.0;
        if need.scale > MAX_SCALE {
            let message = format!(
                "has a coordinate of {:.3} m; .skyb files hold up to {range_m:.3} m",
                need.largest_m
            );
            let remedy = "put the origin of the show near its middle";
            let (check, unit) = ("skyb-range", "m");
            let (value, limit) = (need.largest_m, range_m);
            let severity = Severity::Error;
            collector.add(
                track.index,
                finding(severity, check, None, value, limit, unit, message, remedy),
            );
        }
        let lights = track.drone.lights.len() as u64;
        let blocks = [("trajectory", need.body), ("light program", lights)];
        for (what, body) in blocks {
            if body > MAX_BODY {
                let message =
                    format!("needs {body} B for its {what}; a .skyb block holds {MAX_BODY} B");
                let remedy = "use fewer and longer pieces";
                let (value, limit) = (body as f64, MAX_BODY as f64);
                let finding =
                    finding(Severity::Error, "skyb-size", None, value, limit, "B", message, remedy);
                collector.add(track.index, finding);
            }
        }
        if let Some((loss, time_s)) = need.lost {
            let message = format!(
                "has a piece longer than 65 s that Skybrush's server cuts into parts {loss} ms short in all"
            );
            let remedy = "cut long pieces into equal parts of whole milliseconds";
            let finding = finding(
                Severity::Warning,
                "skyb-duration",
                Some(time_s),
                loss as f64,
                0.0,
                "ms",
                message,
                remedy,
            );
            collector.add(track.index, finding);
        }
    }
    coarse_units(tracks, &needs, collector);
    margins(tracks, &needs, collector);
}

/// One warning for the whole show: large shows have coarse units, and it is the same for all drones.
fn coarse_units(tracks: &[Track<'_>], needs: &[Need], collector: &mut Collector) {
    let coarse = |need: &Need| need.scale <= MAX_SCALE && need.rounding.0 > FINE_MM + 1e-6;
    let mut worst: Option<(&Track<'_>, &Need)> = None;
    for (track, need) in tracks.iter().zip(needs).filter(|(_, need)| coarse(need)) {
        if worst.is_none_or(|(_, most)| need.rounding.0 > most.rounding.0 + 1e-9) {
            worst = Some((track, need));
        }
    }
    let Some((track, need)) = worst else { return };
    let others = match needs.iter().filter(|need| coarse(need)).count() {
        1 => String::new(),
        count => format!("; {count} drones are rounded more than at 1 mm"),
    };
    let (error_mm, time_s) = need.rounding;
    let finding = Finding {
        severity: Severity::Warning,
        check: "skyb-unit",
        drones: vec![track.name()],
        time_s: Some(time_s),
        end_s: None,
        value: Some(error_mm),
        limit: Some(FINE_MM),
        unit: "mm",
        message: format!(
            "is stored in units of {} mm at least, which moves a point by {error_mm:.1} mm{others}",
            need.scale
        ),
        remedy: "put the origin near the middle of the show, or way-points on a 10 mm grid",
    };
    collector.add(track.index, finding);
}

fn margins(tracks: &[Track<'_>], needs: &[Need], collector: &mut Collector) {
    type Measure = fn(&Need) -> u64;
    let measures: [(&'static str, &'static str, Measure, u64, &'static str); 2] = [
        ("skyb-unit", "coarsest unit of a .skyb file", |need| need.scale, MAX_SCALE, "mm"),
        ("skyb-size", "largest trajectory block", |need| need.body, MAX_BODY, "B"),
    ];
    for (check, quantity, measure, limit, unit) in measures {
        let mut most: Option<(u64, &Track<'_>)> = None;
        for (track, need) in tracks.iter().zip(needs) {
            if most.is_none_or(|(value, _)| measure(need) > value) {
                most = Some((measure(need), track));
            }
        }
        if let Some((value, track)) = most {
            collector.margin(Margin {
                check,
                quantity,
                value: value as f64,
                limit: Some(limit as f64),
                unit,
                drones: vec![track.name()],
                time_s: None,
            });
        }
    }
}
