//! Zipped CSV ("Skybrush CSV"): one file of samples per drone, the exchange format that Studio for
//! Blender and many other tools read and write.
//!
//! Header `Time [msec],x [m],y [m],z [m],Red,Green,Blue`, linear in between. Lines and holds need
//! only their ends, so what this tool plans is exact in it; curves are sampled closely enough.

use std::fmt::Write as _;
use std::io::{Cursor, Write as _};
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Vector3;
use rayon::prelude::*;
use thiserror::Error;
use zip::write::{SimpleFileOptions, ZipFileBuilder};
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::archive::Archive;
use super::lights::{self, LightStep, Rgb};
use super::skyc::{Limits, MAX_COORDINATE_M, MAX_DRONES, MAX_TIME_S, SkycError};
use super::trajectory::{Cursor as Playhead, Piece, Segment, SegmentPath, Trajectory};
use super::{Show, ShowDrone};

const HEADER: &str = "Time [msec],x [m],y [m],z [m],Red,Green,Blue";

/// Options of [`write()`]: how densely a show is sampled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CsvOptions {
    /// Largest distance of a curve from the straight lines between its samples, m.
    pub tolerance_m: f64,
    /// Longest time between two rows on a curve, ms.
    pub longest_step_ms: u32,
    /// Shortest time between two rows that are there for the lights alone, ms.
    pub light_step_ms: u32,
}

impl Default for CsvOptions {
    fn default() -> Self {
        Self { tolerance_m: 0.002, longest_step_ms: 100, light_step_ms: 100 }
    }
}

/// Error of writing or reading a show as zipped CSV.
#[derive(Debug, Error)]
pub enum CsvError {
    /// The archive is unusable.
    #[error(transparent)]
    Archive(#[from] SkycError),
    /// A row is unusable.
    #[error("{entry}, line {line}: {problem}")]
    Row {
        /// Name of the entry.
        entry: String,
        /// Number of the line in the entry, from 1.
        line: usize,
        /// Description of the problem in that line.
        problem: String,
    },
    /// The show cannot be written.
    #[error("cannot write {what}: {problem}")]
    Unwritable {
        /// Subject that has no representation in CSV: the show, or a drone by its label.
        what: String,
        /// Reason why it cannot be written.
        problem: String,
    },
}

/// Writes a show as zipped CSV, `drone_01.csv` and so on. The same show gives the same bytes.
///
/// # Errors
///
/// When there are no drones or more than 5000, a coordinate is not a number or a piece lasts 0 ms.
pub fn write(show: &Show, options: &CsvOptions) -> Result<Vec<u8>, CsvError> {
    let fail = |what: String, problem: String| CsvError::Unwritable { what, problem };
    if !(1..=MAX_DRONES).contains(&show.drones.len()) {
        let problem = format!("it has {} drones, not 1 to {MAX_DRONES}", show.drones.len());
        return Err(fail("the show".to_owned(), problem));
    }
    let width = show.drones.len().to_string().len().max(2);
    let files: Vec<_> = show
        .drones
        .par_iter()
        .enumerate()
        .map(|(index, drone)| {
            let name = format!("drone_{:0width$}.csv", index + 1);
            let failed = |problem| fail(format!("drone {}", index + 1), problem);
            let text = rows(drone, options).map_err(failed)?;
            let options = SimpleFileOptions::default()
                .compression_method(CompressionMethod::Deflated)
                .last_modified_time(DateTime::DEFAULT)
                .unix_permissions(0o644);
            let packed = || {
                let mut builder = ZipFileBuilder::new(name, options)?;
                builder.write_all(text.as_bytes())?;
                builder.finish()
            };
            packed().map_err(|error| failed(error.to_string()))
        })
        .collect();
    let zip_failed = |error: zip::result::ZipError| fail("the show".into(), error.to_string());
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for file in files {
        zip.add_prepared_file(file?).map_err(zip_failed)?;
    }
    Ok(zip.finish().map_err(zip_failed)?.into_inner())
}

fn rows(drone: &ShowDrone, options: &CsvOptions) -> Result<String, String> {
    let trajectory = &drone.trajectory;
    let mut times = vec![0_u64];
    for (index, piece) in trajectory.pieces().enumerate() {
        if piece.end_ms <= piece.start_ms {
            return Err(format!("piece {} lasts 0 ms; time must not stand still", index + 1));
        }
        let mut buffer = [Vector3::zeros(); 8];
        let points = piece.path.control_points(piece.from_m, &mut buffer);
        if !points.iter().all(|point| point.amax() <= MAX_COORDINATE_M) {
            return Err(format!("piece {} has coordinates that are absurd", index + 1));
        }
        curve_times(&piece, points, options, &mut times);
        times.push(piece.end_ms);
    }
    light_times(drone, options, &mut times);

    let mut playhead = Playhead::new(trajectory);
    let mut player = lights::Player::new(&drone.lights);
    let mut text = String::with_capacity(64 + times.len() * 32);
    text.push_str(HEADER);
    text.push('\n');
    for time_ms in times {
        let place = playhead.state_at(time_ms as f64 / 1000.0).position_m;
        let [r, g, b] = player.color_at(time_ms);
        let _ = write!(text, "{time_ms}");
        for value in place.iter() {
            text.push(',');
            super::number::push_m(&mut text, *value);
        }
        let _ = writeln!(text, ",{r},{g},{b}");
    }
    Ok(text)
}

/// Times within a curve: a line over a step of `h` misses it by at most `h²/8` times the largest
/// acceleration, which the second differences of its control points bound.
fn curve_times(
    piece: &Piece<'_>,
    points: &[Vector3<f64>],
    options: &CsvOptions,
    times: &mut Vec<u64>,
) {
    if matches!(piece.path, SegmentPath::Hold | SegmentPath::Line(_)) {
        return;
    }
    let degree = (points.len() - 1) as f64;
    let lasts_s = piece.duration_s();
    let bend = points.windows(3).map(|p| (p[0] - p[1] * 2.0 + p[2]).norm()).fold(0.0, f64::max);
    let accel = bend * degree * (degree - 1.0) / (lasts_s * lasts_s);
    let step_ms = if accel > 0.0 {
        (8.0 * options.tolerance_m.max(1e-6) / accel).sqrt() * 1000.0
    } else {
        f64::INFINITY
    };
    let step_ms = step_ms.floor().clamp(1.0, f64::from(options.longest_step_ms.max(1))) as u64;
    let mut time_ms = piece.start_ms + step_ms;
    while time_ms < piece.end_ms {
        times.push(time_ms);
        time_ms += step_ms;
    }
}

/// Adds times at which the light program changes, seen on a grid.
fn light_times(drone: &ShowDrone, options: &CsvOptions, times: &mut Vec<u64>) {
    if drone.lights.is_empty() {
        return;
    }
    let end_ms = times.last().copied().unwrap_or(0);
    let step_ms = u64::from(options.light_step_ms.max(1));
    let mut player = lights::Player::new(&drone.lights);
    let mut before: Option<(u64, Rgb, bool)> = None;
    let mut extra = Vec::new();
    let mut time_ms = 0;
    while time_ms <= end_ms {
        let color = player.color_at(time_ms);
        let changes = before.is_some_and(|(_, last, _)| last != color);
        if let Some((last_ms, _, kept)) = before
            && changes
        {
            // The row before the change as well, or the change would look like a long fade.
            if !kept {
                extra.push(last_ms);
            }
            extra.push(time_ms);
        }
        before = Some((time_ms, color, changes));
        time_ms += step_ms;
    }
    times.extend(extra);
    times.sort_unstable();
    times.dedup();
}

/// Reads zipped CSV: one drone per `.csv` entry, in the order of their names (numbers in them by
/// value). Between rows the drones fly straight; rows at the same place are holds. The colours become
/// a light program that fades from row to row.
///
/// # Errors
///
/// Names the entry and the line: a missing header, times that are not whole milliseconds or do not
/// grow, a first row not at 0, numbers that are not finite; archives that look hostile.
pub fn read(bytes: &[u8]) -> Result<Show, CsvError> {
    let limits = Limits::default();
    let archive = Archive::open(bytes, limits)?;
    let is_csv = |name: &&str| name.len() > 4 && name.to_ascii_lowercase().ends_with(".csv");
    let mut names: Vec<&str> = archive.names().filter(is_csv).collect();
    names.sort_by_key(|name| (natural_key(name), *name));
    if !(1..=MAX_DRONES).contains(&names.len()) {
        let problem = format!("it has {} .csv entries, not 1 to {MAX_DRONES}", names.len());
        return Err(SkycError::Archive { problem }.into());
    }
    let rows = AtomicUsize::new(0);
    let read: Vec<_> = names.par_iter().map(|name| drone(&archive, name, &rows)).collect();
    let mut drones = Vec::with_capacity(names.len());
    let mut first = None;
    for drone in read {
        match drone {
            Ok(drone) => drones.push(drone),
            // Which drone exceeds a limit of the whole file depends on the order of threads.
            Err(CsvError::Archive(error @ SkycError::Bomb { .. })) => return Err(error.into()),
            Err(error) => first = first.or(Some(error)),
        }
    }
    match first {
        Some(error) => Err(error),
        None => Ok(Show { drones, ..Show::default() }),
    }
}

/// Splits a name into text and numbers, so that drone 10 comes after drone 9.
fn natural_key(name: &str) -> Vec<(String, u64)> {
    let mut key = Vec::new();
    let mut rest = name;
    while !rest.is_empty() {
        let text_end = rest.find(|c: char| c.is_ascii_digit()).unwrap_or(rest.len());
        let (text, digits) = rest.split_at(text_end);
        let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
        let (number, later) = digits.split_at(end);
        key.push((text.to_owned(), number.parse().unwrap_or(u64::MAX)));
        rest = later;
    }
    key
}

struct Row {
    time_ms: u64,
    place_m: Vector3<f64>,
    color: Option<Rgb>,
}

fn drone(
    archive: &Archive<'_>,
    entry: &str,
    all_rows: &AtomicUsize,
) -> Result<ShowDrone, CsvError> {
    let content = archive.unpack(entry)?;
    let fail =
        |line: usize, problem: String| CsvError::Row { entry: entry.to_owned(), line, problem };
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&content);
    let text =
        std::str::from_utf8(content).map_err(|_| fail(1, "it is not UTF-8 text".to_owned()))?;
    // Rows take more memory than their text: count them before any is kept.
    let limit = archive.limits().points;
    let count = text.lines().count();
    if all_rows.fetch_add(count, Ordering::Relaxed).saturating_add(count) > limit {
        return Err(SkycError::Bomb { limit: limit as u64, unit: "rows" }.into());
    }
    let mut lines = text.lines().enumerate();
    let header = lines.next().map_or("", |(_, line)| line.trim());
    let plain = |text: &str| text.replace(['"', ' '], "").to_ascii_lowercase();
    if !plain(HEADER).starts_with(&plain(header)) || header.split(',').count() < 4 {
        return Err(fail(1, format!("the header must be {HEADER:?}")));
    }
    let mut rows = Vec::new();
    for (index, line) in lines {
        if line.trim().is_empty() {
            continue;
        }
        let row = parse_row(line).map_err(|problem| fail(index + 1, problem))?;
        let before_ms = rows.last().map(|row: &Row| row.time_ms);
        match before_ms {
            None if row.time_ms != 0 => {
                let problem = format!("the first time is {} ms, not 0", row.time_ms);
                return Err(fail(index + 1, problem));
            }
            Some(before_ms) if row.time_ms <= before_ms => {
                let problem = format!("time stands still or goes back: {} ms", row.time_ms);
                return Err(fail(index + 1, problem));
            }
            _ => rows.push(row),
        }
    }
    let Some(first) = rows.first() else {
        return Err(fail(2, "there are no rows".to_owned()));
    };
    let mut trajectory = Trajectory::starting_at(first.place_m);
    for pair in rows.windows(2) {
        let [from, to] = pair else { continue };
        let path = if from.place_m == to.place_m {
            SegmentPath::Hold
        } else {
            SegmentPath::Line(to.place_m)
        };
        let duration_ms = (to.time_ms - from.time_ms) as u32;
        match trajectory.segments.last_mut() {
            Some(Segment { duration_ms: total, path: SegmentPath::Hold })
                if path == SegmentPath::Hold =>
            {
                *total += duration_ms;
            }
            _ => trajectory.segments.push(Segment { duration_ms, path }),
        }
    }
    let name = entry.rsplit('/').next().unwrap_or(entry);
    let name = name.get(..name.len().saturating_sub(4)).unwrap_or(name).to_owned();
    let home_m = Some(first.place_m);
    let lights = light_program(&rows);
    Ok(ShowDrone { name, home_m, trajectory, lights, ..ShowDrone::default() })
}

fn parse_row(line: &str) -> Result<Row, String> {
    let mut cells = line.split(',').map(|cell| cell.trim().trim_matches('"'));
    let mut number = |what: &str, most: f64| -> Result<f64, String> {
        let cell = cells.next().unwrap_or("");
        let value: f64 = cell.parse().map_err(|_| {
            let cell: String = cell.chars().take(20).collect();
            format!("{what} is {cell:?}, not a number")
        })?;
        if value.abs() <= most { Ok(value) } else { Err(format!("{what} is {value}: absurd")) }
    };
    let time = number("the time", MAX_TIME_S * 1000.0)?;
    if time < 0.0 || time.fract() != 0.0 {
        return Err(format!("the time is {time} ms, not a whole number of milliseconds from 0"));
    }
    let mut place_m = Vector3::zeros();
    for (value, what) in place_m.iter_mut().zip(["x", "y", "z"]) {
        *value = number(what, MAX_COORDINATE_M)?;
    }
    let mut color = |what: &str| number(what, 255.0).map(|value| value.max(0.0).round() as u8);
    let color = if line.split(',').count() >= 7 {
        Some([color("red")?, color("green")?, color("blue")?])
    } else {
        None
    };
    Ok(Row { time_ms: time as u64, place_m, color })
}

/// Fades from row to row; equal colours become one SET.
fn light_program(rows: &[Row]) -> Vec<u8> {
    let mut steps: Vec<LightStep> = Vec::new();
    for pair in rows.windows(2) {
        let [Row { time_ms: from_ms, color: Some(from), .. }, Row { time_ms, color: Some(to), .. }] =
            pair
        else {
            return Vec::new();
        };
        let (duration_ms, fade) = ((time_ms - from_ms) as u32, from != to);
        if steps.is_empty() && fade {
            steps.push(LightStep { duration_ms: 0, color: *from, fade: false });
        }
        match steps.last_mut() {
            Some(last) if !fade && !last.fade && last.color == *to => {
                last.duration_ms += duration_ms;
            }
            _ => steps.push(LightStep { duration_ms, color: *to, fade }),
        }
    }
    if steps.iter().all(|step| step.color == [0; 3]) {
        return Vec::new();
    }
    lights::encode(&steps)
}
