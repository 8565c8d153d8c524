//! Reader of `.skyc` files.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use nalgebra::Vector3;
use rayon::prelude::*;
use serde_json::Value;

use super::documents::{Documents, Node, ROOT, Target, parse, reference};
use super::trajectory::{self, Problem, short};
use super::{Limits, MAX_DRONES, SkycError};
use crate::archive::Archive;
use crate::frame::{Geodetic, ShowFrame};
use crate::{Cue, Extras, FenceZone, Show, ShowDrone, Validation, YawControl};

/// Reads a `.skyc` file with the default [`Limits`].
///
/// # Errors
///
/// See [`read_with`].
pub fn read(bytes: &[u8]) -> Result<Show, SkycError> {
    read_with(bytes, Limits::default())
}

/// Reads a `.skyc` file.
///
/// References may be `./path`, `path`, with or without `#` and a JSON pointer, percent-encoded, and
/// may stand where objects are expected; without any, the whole show is in `show.json`. Unknown keys
/// are ignored. `takeoffTime` becomes a hold, quadratic curves become cubic ones, a line that ends
/// where it starts becomes a hold.
///
/// # Errors
///
/// What the official loader refuses, what cannot be flown (time that stands still or goes back, a
/// first point with t other than 0, two-element points, absurd numbers), and what looks hostile (see
/// [`Limits`]). The error names the entry, the drone and the point.
pub fn read_with(bytes: &[u8], limits: Limits) -> Result<Show, SkycError> {
    let archive = Archive::open(bytes, limits)?;
    if !archive.contains(ROOT) {
        let problem = format!("it has no {ROOT}");
        return Err(SkycError::Archive { problem });
    }
    let root = parse(&archive, ROOT)?;
    let mut shared = BTreeMap::new();
    for entry in shared_entries(&root) {
        if archive.contains(&entry) {
            let document = parse(&archive, &entry)?;
            shared.insert(entry, document);
        }
    }
    // References within show.json, and chains back to it, find it here.
    shared.insert(ROOT.to_owned(), root);
    let documents = Documents { archive: &archive, shared };
    let start = serde_json::json!({ "$ref": ROOT });
    let root = documents.follow(&start, &Arc::from(ROOT))?;
    Reader { documents: &documents, points: AtomicUsize::new(0) }.show(&root)
}

/// Entries that more than one drone refers to: they are parsed once.
fn shared_entries(root: &Value) -> BTreeSet<String> {
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    let drones = root.pointer("/swarm/drones").and_then(Value::as_array);
    for drone in drones.into_iter().flatten() {
        let settings = drone.get("settings").and_then(Value::as_object);
        let values = settings.into_iter().flat_map(|settings| settings.values());
        for text in
            std::iter::once(drone).chain(drone.get("settings")).chain(values).filter_map(reference)
        {
            if let Ok(target) = Target::parse(text, ROOT) {
                *counts.entry(target.entry).or_default() += 1;
            }
        }
    }
    counts
        .into_iter()
        .filter(|(entry, count)| *count > 1 && entry != ROOT)
        .map(|(entry, _)| entry)
        .collect()
}

struct Reader<'a> {
    documents: &'a Documents<'a>,
    points: AtomicUsize,
}

/// An error about the whole show.
fn wrong(node: &Node<'_>, place: &str, problem: impl Into<String>) -> SkycError {
    SkycError::Show {
        entry: node.entry.to_string(),
        place: place.to_owned(),
        problem: problem.into(),
    }
}

fn require_version_1(node: &Node<'_>, place: &str) -> Result<(), SkycError> {
    match node.value.get("version") {
        Some(version) if version.as_f64() == Some(1.0) => Ok(()),
        Some(version) => Err(wrong(
            node,
            place,
            format!("version {} is not supported, only 1 is", short(version)),
        )),
        None => Err(wrong(node, place, "the version is missing; it must be 1")),
    }
}

fn text(node: &Node<'_>, key: &str) -> Option<String> {
    node.value.get(key).and_then(Value::as_str).map(str::to_owned)
}

impl Reader<'_> {
    fn show(&self, root: &Node<'_>) -> Result<Show, SkycError> {
        if !root.value.is_object() {
            return Err(wrong(root, "show", "it must be an object"));
        }
        require_version_1(root, "show")?;
        let documents = self.documents;
        let mut show = Show::default();
        if let Some(environment) = documents.child(root, "environment")? {
            self.environment(&environment, &mut show)?;
        }
        if let Some(meta) = documents.child(root, "meta")? {
            show.id = text(&meta, "id");
            show.title = text(&meta, "title");
            show.phases_s = meta.value.get("segments").and_then(phases);
        }
        if let Some(settings) = documents.child(root, "settings")? {
            self.settings(&settings, &mut show)?;
        }
        let swarm = documents.child(root, "swarm")?.ok_or_else(|| {
            wrong(root, "swarm", "it is missing: there are no drones in this show")
        })?;
        let drones = match swarm.value.get("drones").and_then(Value::as_array) {
            Some(drones) if !drones.is_empty() => drones,
            _ => return Err(wrong(&swarm, "swarm.drones", "there are no drones in this show")),
        };
        if drones.len() > MAX_DRONES {
            let count = drones.len();
            let problem = format!("{count} drones are more than the {MAX_DRONES} allowed");
            return Err(wrong(&swarm, "swarm.drones", problem));
        }
        let read: Vec<Result<ShowDrone, SkycError>> = drones
            .par_iter()
            .enumerate()
            .map(|(index, value)| self.drone(index + 1, value, &swarm.entry))
            .collect();
        // Which drone exceeds the limits depends on the order of threads; that some does, does not.
        let mut first = None;
        for drone in read {
            match drone {
                Ok(drone) => show.drones.push(drone),
                Err(error @ SkycError::Bomb { .. }) => return Err(error),
                Err(error) => first = first.or(Some(error)),
            }
        }
        if let Some(error) = first {
            return Err(error);
        }
        Ok(show)
    }

    fn environment(&self, node: &Node<'_>, show: &mut Show) -> Result<(), SkycError> {
        if !node.value.is_object() {
            return Err(wrong(node, "environment", "it must be an object"));
        }
        match node.value.get("type") {
            None => {}
            Some(Value::String(kind)) if kind == "outdoor" || kind == "indoor" => {}
            Some(other) => {
                let problem = format!("{} is neither \"outdoor\" nor \"indoor\"", short(other));
                return Err(wrong(node, "environment.type", problem));
            }
        }
        if let Some(cameras) = node.value.get("cameras") {
            let cameras = cameras
                .as_array()
                .ok_or_else(|| wrong(node, "environment.cameras", "it must be an array"))?;
            for camera in cameras {
                let camera = self.documents.follow(camera, &node.entry)?;
                check_camera(&camera)?;
            }
        }
        if let Some(location) = self.documents.child(node, "location")? {
            let (frame, has_amsl) = frame(&location.value)
                .map_err(|problem| wrong(&location, "environment.location", problem))?;
            (show.frame, show.has_amsl) = (Some(frame), has_amsl);
        }
        Ok(())
    }

    fn settings(&self, node: &Node<'_>, show: &mut Show) -> Result<(), SkycError> {
        if let Some(cues) = self.documents.child(node, "cues")? {
            // People's timelines: a cue that cannot be read is not worth a show.
            let items = cues.value.get("items").and_then(Value::as_array);
            if items.is_none() {
                show.doubts
                    .push(format!("{}: the cues are not a list and were skipped", cues.entry));
            }
            let mut bad = Vec::new();
            for (index, item) in items.into_iter().flatten().enumerate() {
                let Some(time_s) = item.get("time").and_then(Value::as_f64) else {
                    bad.push((index + 1, item));
                    continue;
                };
                let name = item.get("name").and_then(Value::as_str).unwrap_or_default();
                show.cues.push(Cue { time_s, name: name.to_owned() });
            }
            if let [(number, item), ..] = bad[..] {
                let others = match bad.len() {
                    1 => String::new(),
                    count => format!(" (and {} more)", count - 1),
                };
                show.doubts.push(format!(
                    "{}: cue {number}, {}, has no time and was skipped{others}",
                    cues.entry,
                    short(item)
                ));
            }
        }
        if let Some(limits) = self.documents.child(node, "validation")? {
            let number = |key: &str| limits.value.get(key).and_then(Value::as_f64);
            // Some shows have their keys in snake_case; Viewer reads both.
            let either = |camel: &str, snake: &str| number(camel).or_else(|| number(snake));
            show.validation = Some(Validation {
                max_altitude_m: either("maxAltitude", "max_altitude"),
                max_velocity_xy_mps: either("maxVelocityXY", "max_velocity_xy"),
                max_velocity_z_mps: either("maxVelocityZ", "max_velocity_z"),
                max_velocity_z_up_mps: either("maxVelocityZUp", "max_velocity_z_up"),
                min_distance_m: either("minDistance", "min_distance"),
                max_acceleration_xy_mps2: either("maxAccelerationXY", "max_acceleration_xy"),
                max_acceleration_z_mps2: either("maxAccelerationZ", "max_acceleration_z"),
                max_yaw_rate_dps: either("maxYawRate", "max_yaw_rate"),
                min_nav_altitude_m: either("minNavAltitude", "min_nav_altitude"),
                max_acceleration_mps2: either("maxAcceleration", "max_acceleration"),
                max_velocity_step_mps: number("maxVelocityStep"),
                endurance_s: number("endurance"),
                endurance_reserve: number("enduranceReserve"),
            });
        }
        if let Some(fence) = self.documents.child(node, "geofence")? {
            show.fence =
                zones(&fence.value).map_err(|problem| wrong(&fence, "geofence", problem))?;
            let top = fence.value.get("maxAltitude").or_else(|| fence.value.get("max_altitude"));
            show.fence_altitude_m = top.and_then(Value::as_f64);
        }
        Ok(())
    }

    fn drone(
        &self,
        number: usize,
        value: &Value,
        entry: &Arc<str>,
    ) -> Result<ShowDrone, SkycError> {
        let fail = |name: &str, entry: &str, problem: Problem| SkycError::Drone {
            number,
            name: trajectory::label(name),
            entry: entry.to_owned(),
            place: problem.place,
            problem: problem.problem,
        };
        let documents = self.documents;
        let node = documents.follow(value, entry)?;
        let settings = documents.child(&node, "settings")?.filter(|node| node.value.is_object());
        let Some(settings) = settings else {
            return Err(fail("?", &node.entry, Problem::new("", "it has no settings object")));
        };
        let name = text(&settings, "name").unwrap_or_else(|| format!("Drone {number}"));
        let inside = |node: &Node<'_>, problem: Problem| fail(&name, &node.entry, problem);

        let Some(flown) = documents.child(&settings, "trajectory")? else {
            return Err(inside(&settings, Problem::new("", "it has no trajectory")));
        };
        self.charge_points(trajectory::point_count(&flown.value))?;
        let trajectory =
            trajectory::from_json(&flown.value).map_err(|problem| inside(&flown, problem))?;

        let mut extras = Extras {
            spare_coordinates: trajectory::spare_coordinates(&flown.value),
            has_rth_plan: documents.child(&settings, "rthPlan")?.is_some(),
            ..Extras::default()
        };
        let lights = match documents.child(&settings, "lights")? {
            None => Vec::new(),
            Some(node) => self.lights(&node).map_err(|error| match error {
                LightsError::Problem(problem) => inside(&node, problem),
                LightsError::Skyc(error) => error,
            })?,
        };
        let yaw = documents
            .child(&settings, "yawControl")?
            .map(|node| yaw(&node.value).map_err(|problem| inside(&node, problem)))
            .transpose()?;
        if let Some(pyro) = documents.child(&settings, "pyro")? {
            extras.pyro_events = check_pyro(&pyro.value)
                .map_err(|problem| inside(&pyro, Problem::new("pyro: ", problem)))?;
        }
        let place = |key: &str| -> Result<Option<Vector3<f64>>, SkycError> {
            match settings.value.get(key) {
                None | Some(Value::Null) => Ok(None),
                Some(value) => trajectory::vector(value).map(Some).map_err(|problem| {
                    inside(&settings, Problem::new(format!("{key}: "), problem))
                }),
            }
        };
        let (home_m, land_at_m) = (place("home")?, place("landAt")?);
        Ok(ShowDrone { name, home_m, land_at_m, trajectory, lights, yaw, extras })
    }

    fn charge_points(&self, count: usize) -> Result<(), SkycError> {
        let limit = self.documents.archive.limits().points;
        let before = self.points.fetch_add(count, Ordering::Relaxed);
        if before.saturating_add(count) > limit {
            return Err(SkycError::Bomb { limit: limit as u64, unit: "trajectory points" });
        }
        Ok(())
    }

    fn lights(&self, node: &Node<'_>) -> Result<Vec<u8>, LightsError> {
        let problem = |place: &str, problem: &str| {
            LightsError::Problem(Problem::new(format!("lights.{place}: "), problem))
        };
        if node.value.get("version").and_then(Value::as_f64) != Some(1.0) {
            return Err(problem("version", "it must be 1"));
        }
        let Some(data) = node.value.get("data").and_then(Value::as_str) else {
            return Err(problem("data", "it must be the base64 text of a light program"));
        };
        // Documents that many drones share are unpacked once, but each drone gets its own copy.
        self.documents.archive.charge(data.len() as u64).map_err(LightsError::Skyc)?;
        STANDARD.decode(data).map_err(|error| problem("data", &format!("not base64: {error}")))
    }
}

enum LightsError {
    Problem(Problem),
    Skyc(SkycError),
}

fn numbers(value: Option<&Value>) -> Option<Vec<f64>> {
    value?.as_array()?.iter().map(Value::as_f64).collect()
}

/// End of take-off, start of landing, end; `None` unless all three segments are there.
fn phases(segments: &Value) -> Option<[f64; 3]> {
    let end = |key: &str, index: usize| segments.get(key)?.get(index)?.as_f64();
    Some([end("takeoff", 1)?, end("landing", 0)?, end("landing", 1)?])
}

fn check_camera(camera: &Node<'_>) -> Result<(), SkycError> {
    for (key, count) in [("position", 3), ("orientation", 4)] {
        let value = camera.value.get(key);
        if value.is_some() && numbers(value).is_none_or(|numbers| numbers.len() < count) {
            let problem = format!("the {key} of a camera must be {count} numbers");
            return Err(wrong(camera, "environment.cameras", problem));
        }
    }
    if camera.value.is_object() {
        Ok(())
    } else {
        Err(wrong(camera, "environment.cameras", "a camera must be an object"))
    }
}

fn frame(location: &Value) -> Result<(ShowFrame, bool), String> {
    let origin = numbers(location.get("origin")).unwrap_or_default();
    let [lat, lon, amsl @ ..] = origin.as_slice() else {
        return Err("the origin must be [latitude * 1e7, longitude * 1e7, millimetres]".to_owned());
    };
    let origin = Geodetic {
        lat_deg: lat / 1e7,
        lon_deg: lon / 1e7,
        amsl_m: amsl.first().map_or(0.0, |mm| mm / 1e3),
    };
    if origin.lat_deg.abs() > 90.0 || origin.lon_deg.abs() > 180.0 || origin.amsl_m.abs() > 1e5 {
        return Err("the origin is not on the globe".to_owned());
    }
    let orientation_deg = location.get("orientation").map_or(Some(0.0), Value::as_f64);
    let orientation_deg = orientation_deg.ok_or("the orientation is not a number")?;
    Ok((ShowFrame { origin, orientation_deg }, !amsl.is_empty()))
}

/// All polygons of a fence; one without corners is none.
fn zones(fence: &Value) -> Result<Vec<FenceZone>, String> {
    let polygons = match fence.get("polygons") {
        None | Some(Value::Null) => return Ok(Vec::new()),
        Some(polygons) => polygons.as_array().ok_or("its polygons must be an array")?,
    };
    let numbered = polygons.iter().enumerate();
    let read = |(index, polygon)| {
        zone(polygon).map_err(|problem| format!("polygon {}: {problem}", index + 1))
    };
    let zones = numbered.map(read).collect::<Result<Vec<_>, String>>()?;
    Ok(zones.into_iter().filter(|zone| !zone.corners_m.is_empty()).collect())
}

fn zone(polygon: &Value) -> Result<FenceZone, String> {
    let is_inclusion = polygon.get("isInclusion").and_then(Value::as_bool);
    let is_inclusion = is_inclusion.ok_or("isInclusion must be true or false")?;
    let points = polygon.get("points").and_then(Value::as_array).ok_or("it has no points")?;
    let corner = |point| match numbers(Some(point)).as_deref() {
        Some([x, y, ..]) => Ok([*x, *y]),
        _ => Err(format!("{} is not [x, y]", short(point))),
    };
    let corners_m = points.iter().map(corner).collect::<Result<_, String>>()?;
    Ok(FenceZone { is_inclusion, corners_m })
}

fn yaw(value: &Value) -> Result<YawControl, Problem> {
    let problem = |text: String| Problem::new("yawControl: ", text);
    if value.get("version").and_then(Value::as_f64) != Some(1.0) {
        return Err(problem("its version must be 1".to_owned()));
    }
    let setpoints = value.get("setpoints").and_then(Value::as_array);
    let setpoints = setpoints.ok_or_else(|| problem("it has no setpoints".to_owned()))?;
    let mut program = YawControl {
        auto: value.get("autoYaw").and_then(Value::as_bool).unwrap_or(false),
        offset_deg: value.get("autoYawOffset").and_then(Value::as_f64).unwrap_or(0.0),
        setpoints: Vec::with_capacity(setpoints.len()),
    };
    for setpoint in setpoints {
        match numbers(Some(setpoint)).as_deref() {
            Some([time_s, angle_deg, ..]) => program.setpoints.push((*time_s, *angle_deg)),
            _ => return Err(problem(format!("{} is not [t, degrees]", short(setpoint)))),
        }
    }
    Ok(program)
}

/// What the official loader checks of pyro programs, which are not kept; how many events there are.
fn check_pyro(value: &Value) -> Result<usize, String> {
    if value.get("version").and_then(Value::as_f64) != Some(1.0) {
        return Err("its version must be 1".to_owned());
    }
    let events = value.get("events").and_then(Value::as_array).ok_or("it has no events")?;
    for event in events {
        let is_event = matches!(
            event.as_array().map(Vec::as_slice),
            Some([Value::Number(_), Value::Number(_), Value::String(_), ..])
        );
        if !is_event {
            return Err(format!("{} is not [time, channel, payload]", short(event)));
        }
    }
    let payloads = value.get("payloads").and_then(Value::as_object).ok_or("it has no payloads")?;
    for (name, payload) in payloads {
        let number =
            |key| payload.get(key).is_none_or(|value| value.is_number() || value.is_null());
        let fine = payload.get("name").is_some_and(Value::is_string)
            && ["prefireTime", "duration", "yaw", "pitch"].into_iter().all(number);
        if !fine {
            return Err(format!("payload {name:?} is malformed"));
        }
    }
    Ok(events.len())
}
