//! The trajectory object: `{version, takeoffTime, landingTime, points: [[t, [x,y,z], [ctrl..]]..]}`.

use nalgebra::Vector3;
use serde_json::Value;

use super::{MAX_COORDINATE_M, MAX_TIME_S};
use crate::bezier::path_through;
use crate::number::{push_m, push_ms};
use crate::{Segment, SegmentPath, Trajectory};

/// What is wrong, and where in the object.
#[derive(Debug, PartialEq)]
pub(super) struct Problem {
    /// Key or point, with a colon and a space; may be empty.
    pub place: String,
    pub problem: String,
}

impl Problem {
    pub(super) fn new(place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { place: place.into(), problem: problem.into() }
    }
}

/// How many points the object claims to have.
pub(super) fn point_count(trajectory: &Value) -> usize {
    trajectory.get("points").and_then(Value::as_array).map_or(0, Vec::len)
}

/// A trajectory from its JSON.
///
/// Times become whole milliseconds, each rounded on its own. A positive `takeoffTime` becomes a hold
/// at the first point. A first point whose time is not 0 is refused: the official server drops that
/// time while Live and Viewer show it, so the show would not be flown as it looks.
pub(super) fn from_json(trajectory: &Value) -> Result<Trajectory, Problem> {
    if !trajectory.is_object() {
        return Err(Problem::new("trajectory: ", "it must be an object"));
    }
    if trajectory.get("version").and_then(Value::as_f64) != Some(1.0) {
        let found = trajectory.get("version").map_or("nothing".to_owned(), short);
        return Err(Problem::new("version: ", format!("it must be 1, not {found}")));
    }
    let takeoff_ms = match trajectory.get("takeoffTime") {
        None | Some(Value::Null) => 0,
        Some(value) => time_ms(value).map_err(|problem| Problem::new("takeoffTime: ", problem))?,
    };
    if let Some(value) = trajectory.get("landingTime")
        && !(value.is_number() || value.is_null())
    {
        let found = short(value);
        return Err(Problem::new("landingTime: ", format!("{found} is not a number")));
    }
    let points = trajectory.get("points").and_then(Value::as_array);
    let Some((first, later)) = points.and_then(|points| points.split_first()) else {
        return Err(Problem::new("points: ", "it must be an array that is not empty"));
    };

    let at = |index: usize| format!("point {}: ", index + 1);
    let (first_ms, start_m, controls) =
        point(first).map_err(|problem| Problem::new(at(0), problem))?;
    if first_ms != 0 {
        return Err(Problem::new(
            at(0),
            format!(
                "the trajectory starts at t = {} s, not at 0: the official server would drop that \
                 wait while Live shows it; move it to takeoffTime, or insert a point at t = 0",
                first_ms as f64 / 1000.0
            ),
        ));
    }
    if !controls.is_empty() {
        return Err(Problem::new(at(0), "the first point must not have control points"));
    }
    let mut segments = Vec::with_capacity(later.len() + 1);
    if let Ok(duration_ms @ 1..) = u32::try_from(takeoff_ms) {
        segments.push(Segment { duration_ms, path: SegmentPath::Hold });
    }
    let (mut before_ms, mut from_m) = (0_i64, start_m);
    for (index, value) in later.iter().enumerate() {
        let fail = |problem: String| Problem::new(at(index + 1), problem);
        let (ms, to_m, controls) = point(value).map_err(fail)?;
        let duration_ms = match u32::try_from(ms - before_ms) {
            Ok(0) => {
                let t = ms as f64 / 1000.0;
                return Err(fail(format!(
                    "time stands still at t = {t} s (to the millisecond); times must grow"
                )));
            }
            Ok(duration_ms) => duration_ms,
            Err(_) => {
                let (before, t) = (before_ms as f64 / 1000.0, ms as f64 / 1000.0);
                return Err(fail(format!("time goes back from {before} s to {t} s")));
            }
        };
        let path = path(from_m, to_m, controls).map_err(fail)?;
        segments.push(Segment { duration_ms, path });
        (before_ms, from_m) = (ms, to_m);
    }
    Ok(Trajectory { start_m, segments })
}

/// Time, place and control points of one entry.
fn point(value: &Value) -> Result<(i64, Vector3<f64>, &[Value]), String> {
    match value.as_array().map(Vec::as_slice) {
        Some([time, place, Value::Array(controls), ..]) => {
            Ok((time_ms(time)?, vector(place)?, controls))
        }
        Some([_, _]) => Err("it has no list of control points, which Live and the server need: \
                             write [t, [x, y, z], []]"
            .to_owned()),
        _ => Err(format!("{} is not [t, [x, y, z], [control points]]", short(value))),
    }
}

fn time_ms(value: &Value) -> Result<i64, String> {
    let time_s = value.as_f64().ok_or_else(|| format!("t = {} is not a number", short(value)))?;
    if !(0.0..=MAX_TIME_S).contains(&time_s) {
        return Err(format!("t = {time_s} s is not between 0 and {MAX_TIME_S} s"));
    }
    Ok((time_s * 1000.0).round() as i64)
}

/// Places in the object with more than three coordinates, of which the rest is not read.
pub(super) fn spare_coordinates(trajectory: &Value) -> usize {
    let longer = |place: &Value| place.as_array().is_some_and(|place| place.len() > 3);
    let of_entry = |entry: &Value| {
        let (place, controls) = (entry.get(1), entry.get(2).and_then(Value::as_array));
        place
            .into_iter()
            .chain(controls.into_iter().flatten())
            .filter(|place| longer(place))
            .count()
    };
    let points = trajectory.get("points").and_then(Value::as_array);
    points.into_iter().flatten().map(of_entry).sum()
}

/// Three coordinates in metres; what follows them is left out, if it is numbers.
pub(super) fn vector(value: &Value) -> Result<Vector3<f64>, String> {
    let wrong = || format!("{} is not [x, y, z]", short(value));
    let Some([x, y, z, rest @ ..]) = value.as_array().map(Vec::as_slice) else {
        return Err(wrong());
    };
    if !rest.iter().all(Value::is_number) {
        return Err(wrong());
    }
    let mut vector = Vector3::zeros();
    for (to, from) in vector.iter_mut().zip([x, y, z]) {
        *to = from.as_f64().ok_or_else(wrong)?;
        if !to.is_finite() || to.abs() > MAX_COORDINATE_M {
            return Err(format!("a coordinate of {to:e} m is absurd"));
        }
    }
    Ok(vector)
}

fn path(
    from_m: Vector3<f64>,
    to_m: Vector3<f64>,
    controls: &[Value],
) -> Result<SegmentPath, String> {
    let control = |index: usize| {
        let value = controls.get(index).unwrap_or(&Value::Null);
        vector(value).map_err(|problem| format!("control point {}: {problem}", index + 1))
    };
    Ok(match controls.len() {
        0 if from_m == to_m => SegmentPath::Hold,
        0 => SegmentPath::Line(to_m),
        1 => {
            // A quadratic curve as a cubic one, exactly.
            let middle = control(0)?;
            SegmentPath::Cubic([(from_m + middle * 2.0) / 3.0, (middle * 2.0 + to_m) / 3.0, to_m])
        }
        2 => SegmentPath::Cubic([control(0)?, control(1)?, to_m]),
        6 => {
            let mut points = [to_m; 7];
            for (index, point) in points.iter_mut().take(6).enumerate() {
                *point = control(index)?;
            }
            path_through(&points).unwrap_or(SegmentPath::Hold)
        }
        count => {
            return Err(format!(
                "{count} control points: only 0 (line), 1, 2 (cubic) and 6 (7th degree) are known"
            ));
        }
    })
}

/// A value as people may recognise it, cut to a few characters.
pub(super) fn short(value: &Value) -> String {
    const MOST: usize = 40;
    let text = match value {
        Value::Array(items) if items.len() > 6 => format!("an array of {} values", items.len()),
        Value::Object(keys) if keys.len() > 2 => format!("an object of {} keys", keys.len()),
        other => other.to_string(),
    };
    if text.chars().count() <= MOST {
        return text;
    }
    text.chars().take(MOST).chain("...".chars()).collect()
}

/// A label for messages: without control characters, cut to a few characters.
pub(super) fn label(name: &str) -> String {
    name.chars().filter(|letter| !letter.is_control()).take(40).collect()
}

/// The JSON of a trajectory.
pub(super) fn to_json(trajectory: &Trajectory) -> Result<String, String> {
    let mut text = String::with_capacity(96 + trajectory.segments.len() * 40);
    text.push_str(r#"{"version":1,"takeoffTime":0,"landingTime":"#);
    push_ms(&mut text, trajectory.duration_ms());
    text.push_str(",\"points\":[[0,");
    push_point(&mut text, trajectory.start_m).map_err(|problem| format!("start: {problem}"))?;
    text.push_str(",[]]");
    for (index, piece) in trajectory.pieces().enumerate() {
        let fail = |problem: String| format!("piece {}: {problem}", index + 1);
        if piece.end_ms == piece.start_ms {
            return Err(fail("it lasts 0 ms; time must not stand still".to_owned()));
        }
        text.push_str(",\n[");
        push_ms(&mut text, piece.end_ms);
        text.push(',');
        push_point(&mut text, piece.end_m()).map_err(fail)?;
        match piece.path {
            SegmentPath::Hold | SegmentPath::Line(_) => text.push_str(",[]]"),
            SegmentPath::Cubic([first, second, _]) => {
                text.push_str(",[");
                push_point(&mut text, *first).map_err(fail)?;
                text.push(',');
                push_point(&mut text, *second).map_err(fail)?;
                text.push_str("]]");
            }
            SegmentPath::Septic(_) => {
                return Err(fail(
                    "it is a curve of 7th degree, which Live and Viewer cannot show; use cubic pieces"
                        .to_owned(),
                ));
            }
        }
    }
    text.push_str("]}\n");
    Ok(text)
}

/// Appends `[x,y,z]`.
pub(super) fn push_point(text: &mut String, point: Vector3<f64>) -> Result<(), String> {
    if !point.iter().all(|value| value.abs() <= MAX_COORDINATE_M) {
        let [x, y, z] = point.into();
        return Err(format!("the coordinates ({x}, {y}, {z}) m are absurd"));
    }
    for (separator, value) in ['[', ',', ','].into_iter().zip(point.iter()) {
        text.push(separator);
        push_m(text, *value);
    }
    text.push(']');
    Ok(())
}
