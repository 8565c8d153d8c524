//! Shows as people read them, for `inspect`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::words;
use crate::base::names::listed;
use crate::show::FenceZone;
use crate::show::summary::{DroneSummary, ShowSummary, SkybSummary};

/// Drones listed one by one.
const MAX_ROWS: usize = 60;
/// Zones of a fence described one by one.
const MAX_ZONES: usize = 20;

/// A show: head, bounds, one line per drone with as many columns as fit.
pub(super) fn describe_show(show: &ShowSummary, width: Option<usize>) -> String {
    let mut text = String::new();
    let count = show.drones.len();
    let title = show.title.as_deref().map_or(String::new(), |title| format!("\"{title}\", "));
    let _ = writeln!(text, "{title}{}, {:.3} s", words::count(count, "drone"), show.duration_s);
    if let Some((lat, lon, amsl)) = show.origin {
        let _ = write!(text, "origin {lat:.7}, {lon:.7}");
        if let Some(amsl) = amsl {
            let _ = write!(text, ", {amsl} m above sea level");
        }
        if let Some(orientation) = show.orientation_deg {
            let _ = write!(text, ", x towards {orientation}°");
        }
        text.push('\n');
    }
    let [low, high] = show.bounds_m;
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let gap = if axis == 0 { "" } else { ", " };
        let _ = write!(text, "{gap}{name} {:.3}..{:.3} m", low[axis], high[axis]);
    }
    let speeds = show.speeds;
    let _ = writeln!(
        text,
        "; up {:.2}, down {:.2}, horizontal {:.2} m/s at most",
        speeds.up_mps, speeds.down_mps, speeds.horizontal_mps
    );
    let cues = (!show.cues.is_empty()).then(|| words::count(show.cues.len(), "cue"));
    let extras: Vec<_> = cues.into_iter().chain(fence(&show.fence)).collect();
    if !extras.is_empty() {
        let _ = writeln!(text, "{}", extras.join(", "));
    }
    let columns = fitting(width);
    text.push('\n');
    push_row(&mut text, &COLUMNS.map(|(name, _)| name.to_owned()), columns);
    for drone in show.drones.iter().take(MAX_ROWS) {
        push_row(&mut text, &drone_cells(drone), columns);
    }
    if columns < COLUMNS.len() {
        text.push_str("(a wider terminal shows more columns)\n");
    }
    if count > MAX_ROWS {
        let _ = writeln!(text, "... and {} more", count - MAX_ROWS);
    }
    describe_remarks(&mut text, show);
    text
}

/// `fence of 4 corners`, `fence of 2 zones (1: inside 4 corners, 2: outside 3 corners)`.
fn fence(zones: &[FenceZone]) -> Option<String> {
    let corners = |zone: &FenceZone| words::count(zone.corners_m.len(), "corner");
    match zones {
        [] => None,
        [zone] if zone.is_inclusion => Some(format!("fence of {}", corners(zone))),
        zones => {
            let one = |(index, zone): (usize, &FenceZone)| {
                let side = if zone.is_inclusion { "inside" } else { "outside" };
                format!("{}: {side} {}", index + 1, corners(zone))
            };
            let each: Vec<_> = zones.iter().take(MAX_ZONES).enumerate().map(one).collect();
            let more = if zones.len() > MAX_ZONES { ", ..." } else { "" };
            let count = words::count(zones.len(), "zone");
            Some(format!("fence of {count} ({}{more})", each.join(", ")))
        }
    }
}

/// What is remarkable about drones, each thing once.
fn describe_remarks(text: &mut String, show: &ShowSummary) {
    let mut remarks: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for drone in &show.drones {
        let firmware = [("4.4", &drone.derived_44), ("4.6", &drone.derived_46)];
        let derived = firmware.into_iter().flat_map(|(version, derived)| {
            derived.reasons.iter().map(move |reason| format!("firmware {version}: {reason}"))
        });
        for remark in derived.chain(drone.skyb_problem.clone()) {
            remarks.entry(remark).or_default().push(&drone.name);
        }
    }
    if !remarks.is_empty() {
        text.push('\n');
    }
    for (remark, drones) in remarks {
        let _ = writeln!(text, "{}: {remark}", listed(drones));
    }
}

/// Heads and widths of the table of drones.
const COLUMNS: [(&str, usize); 9] = [
    ("drone", 14),
    ("start m", 24),
    ("lasts s", 9),
    ("pieces", 7),
    ("skyb B", 6),
    ("unit", 6),
    ("error mm", 9),
    ("flown by 4.4, s", 15),
    ("flown by 4.6, s", 15),
];

/// How many columns of the table fit a terminal.
fn fitting(width: Option<usize>) -> usize {
    let Some(width) = width else { return COLUMNS.len() };
    let mut used = 0;
    COLUMNS
        .iter()
        .take_while(|(_, column)| {
            used += column + 1;
            used <= width + 1
        })
        .count()
        .max(1)
}

fn push_row(text: &mut String, cells: &[String; COLUMNS.len()], columns: usize) {
    for (index, (cell, (_, width))) in cells.iter().zip(COLUMNS).take(columns).enumerate() {
        let _ = if index == 0 {
            write!(text, "{cell:<width$}")
        } else {
            write!(text, " {cell:>width$}")
        };
    }
    text.push('\n');
}

fn drone_cells(drone: &DroneSummary) -> [String; COLUMNS.len()] {
    let [x, y, z] = drone.start_m;
    let takeoff = |time: Option<f64>, landing: f64| {
        time.map_or("refused".to_owned(), |time| format!("{time:.2}..{landing:.1}"))
    };
    let (bytes, unit, error) = match &drone.skyb {
        Some(file) => (
            file.file_bytes.to_string(),
            format!("{} mm", file.scale_mm),
            format!("{:.2}", file.deviation.max_position_m * 1000.0),
        ),
        None => ("none".to_owned(), String::new(), String::new()),
    };
    [
        drone.name.clone(),
        format!("{x:.2}, {y:.2}, {z:.2}"),
        format!("{:.3}", drone.duration_s),
        drone.pieces.iter().sum::<usize>().to_string(),
        bytes,
        unit,
        error,
        takeoff(drone.derived_44.takeoff_s, drone.derived_44.landing_s),
        takeoff(drone.derived_46.takeoff_s, drone.derived_46.landing_s),
    ]
}

/// One binary show: blocks, lights, trajectory.
pub(super) fn describe_skyb(file: &SkybSummary) -> String {
    let mut text = String::new();
    let crc = if file.has_crc { "checksum correct" } else { "without checksum" };
    let _ = writeln!(text, "version {}, {crc}, {} mm per unit", file.version, file.scale_mm);
    for block in &file.blocks {
        let _ = writeln!(
            text,
            "block {}: {} bytes at {}",
            block.kind.name(),
            block.bytes,
            block.offset
        );
    }
    if let Some(comment) = &file.comment {
        let _ = writeln!(text, "comment: {comment}");
    }
    if file.has_rth_plan {
        let _ = writeln!(text, "has a return-to-home plan (not read: its form differs by version)");
    }
    if !file.events.is_empty() {
        let _ = writeln!(text, "{}", words::count(file.events.len(), "timed event"));
    }
    let drone = &file.drone;
    let [low, high] = drone.bounds_m;
    let _ = writeln!(
        text,
        "trajectory: {:.3} s; {} holds, {} lines, {} cubic, {} of 7th degree; z {:.3}..{:.3} m; up {:.2}, down {:.2}, horizontal {:.2} m/s",
        drone.duration_s,
        drone.pieces[0],
        drone.pieces[1],
        drone.pieces[2],
        drone.pieces[3],
        low[2],
        high[2],
        drone.speeds.up_mps,
        drone.speeds.down_mps,
        drone.speeds.horizontal_mps
    );
    for (version, derived) in [("4.4", &drone.derived_44), ("4.6", &drone.derived_46)] {
        let takeoff = derived.takeoff_s.map_or("never".to_owned(), |time| format!("{time:.3} s"));
        let _ = writeln!(
            text,
            "firmware {version}: takes off at {takeoff}, lands at {:.3} s from {:.2} m",
            derived.landing_s, derived.lands_from_m
        );
        for reason in &derived.reasons {
            let _ = writeln!(text, "  {reason}");
        }
    }
    if !file.lights.lines.is_empty() {
        let _ = writeln!(text, "lights:");
        for line in &file.lights.lines {
            let _ = writeln!(text, "  {line}");
        }
    }
    for problem in &file.lights.problems {
        let _ = writeln!(text, "lights: {problem}");
    }
    text
}
