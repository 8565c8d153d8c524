//! A plan as people read it: who, where, and what happens when.

use std::fmt::Write as _;

use super::words::{count, shorten};
use crate::mission::plan::{Group, Plan, Segment, SegmentKind};

/// Most rows of a timetable before the middle is left out, ramps apart.
const MAX_ROWS: usize = 60;

/// Columns of a row without its label and window.
const BARE: usize = 39;
/// Columns of the label, at most and at least.
const LABEL: [usize; 2] = [28, 12];
/// Columns that the window takes at most.
const WINDOW: usize = 17;

/// What fits a row.
#[derive(Clone, Copy)]
struct Room {
    label: usize,
    windows: bool,
}

impl Room {
    fn of(width: Option<usize>) -> Self {
        let [most, least] = LABEL;
        match width {
            Some(width) if width < BARE + most + WINDOW => {
                Self { label: width.saturating_sub(BARE).clamp(least, most), windows: false }
            }
            _ => Self { label: most, windows: true },
        }
    }
}

/// The plan's head and the timetable of each group; narrow terminals get no window column.
///
/// `is_example`: nobody has said where it is, so that it is where the built-in templates are.
pub(super) fn describe(plan: &Plan, width: Option<usize>, is_example: bool) -> String {
    let room = Room::of(width);
    let mut text = String::new();
    let _ = write!(text, "{}: {}", plan.title, count(plan.slots.len(), "drone"));
    if let Some(grid) = plan.grid {
        let (rows, columns) = (grid.rows, grid.columns);
        let _ = write!(text, " in {rows} x {columns}, {} m apart", grid.spacing_m);
    }
    let site = &plan.site;
    let _ = writeln!(
        text,
        "\norigin {:.6}, {:.6}, ground {} m above sea level, rows towards {}°, vehicle {}",
        site.origin_lat_deg,
        site.origin_lon_deg,
        site.ground_amsl_m,
        site.orientation_deg,
        plan.vehicle
    );
    if is_example {
        text.push_str(
            "THE SITE WAS NOT GIVEN: this is the templates' example, a field in Hungary. Give yours \
             with --origin LAT,LON and --ground M before you fly\n",
        );
    } else if site.ground_assumed {
        let _ = writeln!(
            text,
            "the height of the ground there is NOT KNOWN: {} m are assumed, which is the template's. \
             It sets the density of the air in simulations and in the map (1 % for each 100 m); \
             drones fly heights above home whatever it is. --ground M gives it",
            site.ground_amsl_m
        );
    }
    for group in &plan.groups {
        describe_group(&mut text, plan, group, room);
    }
    if !room.windows {
        text.push_str("(a wider terminal shows the analysis windows too)\n");
    }
    for line in &plan.briefing {
        let _ = writeln!(text, "note: {line}");
    }
    text
}

fn describe_group(text: &mut String, plan: &Plan, group: &Group, room: Room) {
    if plan.groups.len() > 1 {
        let index = plan.groups.iter().position(|other| std::ptr::eq(other, group));
        let members =
            plan.slots.iter().filter(|slot| Some(usize::from(slot.group)) == index).count();
        let offset_s = group.offset_ms as f64 / 1000.0;
        let _ = writeln!(
            text,
            "\ngroup {}: {}, {offset_s} s later",
            group.name,
            count(members, "drone")
        );
    }
    let _ = writeln!(
        text,
        "\n{:>8}  {:<label$} {:>8} {:>9} {:>9}{}",
        "time",
        "segment",
        "lasts s",
        "height m",
        "m/s",
        if room.windows { "  window s" } else { "" },
        label = room.label,
    );
    let shown = &group.segments;
    let ramps = shown.iter().any(|segment| segment.kind == SegmentKind::Ramp);
    let most = if ramps { 2 * MAX_ROWS } else { MAX_ROWS };
    for (index, segment) in shown.iter().enumerate() {
        if shown.len() > most && (most / 2..shown.len() - most / 2).contains(&index) {
            if index == most / 2 {
                let _ = writeln!(text, "{:>8}  {} more", "...", shown.len() - most);
            }
            continue;
        }
        describe_segment(text, segment, room);
    }
    if let Some(last) = group.segments.last() {
        let _ = writeln!(text, "{:>8}  end", clock(last.end_ms));
    }
}

fn describe_segment(text: &mut String, segment: &Segment, room: Room) {
    let [vx, vy, vz] = segment.velocity_mps;
    let speed = if vx == 0.0 && vy == 0.0 {
        if vz == 0.0 { String::new() } else { format!("{vz:+.2}") }
    } else {
        format!("{:.2}", (vx * vx + vy * vy + vz * vz).sqrt())
    };
    let speed = match segment.kind {
        SegmentKind::Ramp if speed.is_empty() => "to 0".to_owned(),
        SegmentKind::Ramp => format!("to {speed}"),
        _ => speed,
    };
    let height = if segment.from_m[2] == segment.to_m[2] {
        format!("{:.1}", segment.to_m[2])
    } else {
        format!("-> {:.1}", segment.to_m[2])
    };
    let window = segment.window.filter(|_| room.windows).map_or(String::new(), |window| {
        let at = |ms: u64| ms as f64 / 1000.0;
        format!("{:.1}..{:.1}", at(window.start_ms), at(window.end_ms))
    });
    let line = format!(
        "{:>8}  {:<label$} {:>8.1} {:>9} {:>9}  {}",
        clock(segment.start_ms),
        shorten(&segment.label, room.label),
        (segment.end_ms - segment.start_ms) as f64 / 1000.0,
        height,
        speed,
        window,
        label = room.label,
    );
    let _ = writeln!(text, "{}", line.trim_end());
}

/// Show time as minutes and seconds.
fn clock(ms: u64) -> String {
    let tenths = (ms + 50) / 100;
    format!("{}:{:02}.{}", tenths / 600, tenths / 10 % 60, tenths % 10)
}
