//! Writer of `.skyc` files.

use std::io::{Cursor, Write as _};

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use rayon::prelude::*;
use serde_json::{Map, Value, json};
use zip::write::{PreparedZipFile, SimpleFileOptions, ZipFileBuilder};
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{MAX_COORDINATE_M, MAX_DRONES, SkycError, trajectory};
use crate::{FenceZone, Show, ShowDrone, YawControl, lights};

/// Writes a show. The same show gives the same bytes, on any number of threads.
///
/// Coordinates are written to the millimetre where they are whole millimetres, else to 0.1 µm; times
/// exactly. Light programs that end in a fade get a final set, see [`lights::with_final_set`].
///
/// # Errors
///
/// When the show breaks a rule of the format: no drones or more than 5000, pieces without duration
/// or of 7th degree (which Live and Viewer cannot show), coordinates or times that are not sensible.
pub fn write(show: &Show) -> Result<Vec<u8>, SkycError> {
    let unwritable = |problem: String| SkycError::Unwritable { what: "the show".into(), problem };
    if show.drones.is_empty() {
        return Err(unwritable("it has no drones".to_owned()));
    }
    if show.drones.len() > MAX_DRONES {
        let count = show.drones.len();
        return Err(unwritable(format!("it has {count} drones; the format allows {MAX_DRONES}")));
    }
    let width = show.drones.len().to_string().len().max(2);
    let folder = |index: usize| format!("drones/drone_{:0width$}", index + 1);
    let drone_entries: Vec<_> = show
        .drones
        .par_iter()
        .enumerate()
        .map(|(index, drone)| {
            let what = || format!("drone {} ({})", index + 1, trajectory::label(&drone.name));
            drone_files(&folder(index), drone)
                .map_err(|problem| SkycError::Unwritable { what: what(), problem })
        })
        .collect();
    let root = root(show, folder).map_err(unwritable)?;
    let zip_failed = |error: zip::result::ZipError| unwritable(error.to_string());

    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let mut add = |file| zip.add_prepared_file(file).map_err(zip_failed);
    add(pack("show.json", &pretty(&root)).map_err(unwritable)?)?;
    if !show.cues.is_empty() {
        let items: Vec<Value> =
            show.cues.iter().map(|cue| json!({ "time": cue.time_s, "name": cue.name })).collect();
        let cues = json!({ "version": 1, "items": items });
        add(pack("cues.json", &pretty(&cues)).map_err(unwritable)?)?;
    }
    for entries in drone_entries {
        for file in entries? {
            add(file)?;
        }
    }
    Ok(zip.finish().map_err(zip_failed)?.into_inner())
}

fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

fn pack(name: &str, text: &str) -> Result<PreparedZipFile, String> {
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Deflated)
        .last_modified_time(DateTime::DEFAULT)
        .unix_permissions(0o644);
    let packed = || {
        let mut builder = ZipFileBuilder::new(name, options)?;
        builder.write_all(text.as_bytes())?;
        builder.finish()
    };
    packed().map_err(|error| format!("{name}: {error}"))
}

/// A drone's trajectory and lights as the objects of a `.skyc` file: what Skybrush Server takes.
///
/// # Errors
/// When the trajectory cannot be written.
pub fn drone_documents(drone: &ShowDrone) -> Result<(Value, Option<Value>), String> {
    let text = trajectory::to_json(&drone.trajectory)?;
    let value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
    let data = || STANDARD.encode(lights::with_final_set(&drone.lights));
    let lights = (!drone.lights.is_empty()).then(|| json!({ "version": 1, "data": data() }));
    Ok((value, lights))
}

fn drone_files(folder: &str, drone: &ShowDrone) -> Result<Vec<PreparedZipFile>, String> {
    let text = trajectory::to_json(&drone.trajectory)?;
    let mut files = vec![pack(&format!("{folder}/trajectory.json"), &text)?];
    if !drone.lights.is_empty() {
        let data = STANDARD.encode(lights::with_final_set(&drone.lights));
        let text = format!("{{\"version\":1,\"data\":\"{data}\"}}\n");
        files.push(pack(&format!("{folder}/lights.json"), &text)?);
    }
    Ok(files)
}

fn root(show: &Show, folder: impl Fn(usize) -> String) -> Result<Value, String> {
    let mut drones = Vec::with_capacity(show.drones.len());
    for (index, drone) in show.drones.iter().enumerate() {
        let refer = |file: &str| json!({ "$ref": format!("./{}/{file}#", folder(index)) });
        let mut settings = Map::new();
        settings.insert("name".into(), drone.name.clone().into());
        for (key, place) in [("home", drone.home_m), ("landAt", drone.land_at_m)] {
            if let Some(place) = place {
                let fail = |problem| format!("drone {}: {key}: {problem}", index + 1);
                let mut text = String::new();
                trajectory::push_point(&mut text, place).map_err(fail)?;
                let value = serde_json::from_str(&text).map_err(|error| error.to_string())?;
                settings.insert(key.into(), value);
            }
        }
        settings.insert("trajectory".into(), refer("trajectory.json"));
        if !drone.lights.is_empty() {
            settings.insert("lights".into(), refer("lights.json"));
        }
        if let Some(yaw) = &drone.yaw {
            settings.insert("yawControl".into(), yaw_json(yaw));
        }
        drones.push(json!({ "type": "generic", "settings": settings }));
    }
    Ok(json!({
        "version": 1,
        "settings": settings(show)?,
        "swarm": { "drones": drones },
        "environment": environment(show)?,
        "meta": meta(show)?,
        "media": {},
    }))
}

fn yaw_json(yaw: &YawControl) -> Value {
    json!({
        "version": 1,
        "setpoints": yaw.setpoints,
        "autoYaw": yaw.auto,
        "autoYawOffset": yaw.offset_deg,
    })
}

/// JSON has no NaN; writing one would silently become `null`.
fn finite(what: &str, values: &[f64]) -> Result<(), String> {
    if values.iter().all(|value| value.is_finite()) {
        Ok(())
    } else {
        Err(format!("{what} is not a finite number"))
    }
}

fn settings(show: &Show) -> Result<Value, String> {
    let mut settings = Map::new();
    if !show.cues.is_empty() {
        for cue in &show.cues {
            finite("the time of a cue", &[cue.time_s])?;
        }
        settings.insert("cues".into(), json!({ "$ref": "./cues.json" }));
    }
    if let Some(limits) = show.validation {
        let mut validation = Map::new();
        for (key, value) in [
            ("maxAltitude", limits.max_altitude_m),
            ("maxVelocityXY", limits.max_velocity_xy_mps),
            ("maxVelocityZ", limits.max_velocity_z_mps),
            ("maxVelocityZUp", limits.max_velocity_z_up_mps),
            ("minDistance", limits.min_distance_m),
            ("maxAccelerationXY", limits.max_acceleration_xy_mps2),
            ("maxAccelerationZ", limits.max_acceleration_z_mps2),
            ("maxYawRate", limits.max_yaw_rate_dps),
            ("minNavAltitude", limits.min_nav_altitude_m),
            ("maxAcceleration", limits.max_acceleration_mps2),
            ("maxVelocityStep", limits.max_velocity_step_mps),
            ("endurance", limits.endurance_s),
            ("enduranceReserve", limits.endurance_reserve),
        ] {
            if let Some(value) = value {
                finite(key, &[value])?;
                validation.insert(key.into(), value.into());
            }
        }
        settings.insert("validation".into(), validation.into());
    }
    if !show.fence.is_empty() {
        for corner in show.fence.iter().flat_map(|zone| &zone.corners_m) {
            finite("a corner of the geofence", corner)?;
        }
        let polygon = |zone: &FenceZone| json!({ "isInclusion": zone.is_inclusion, "points": zone.corners_m });
        let polygons: Vec<_> = show.fence.iter().map(polygon).collect();
        let mut fence = Map::new();
        fence.insert("version".into(), 1.into());
        fence.insert("polygons".into(), polygons.into());
        if let Some(altitude_m) = show.fence_altitude_m {
            finite("the top of the geofence", &[altitude_m])?;
            fence.insert("maxAltitude".into(), altitude_m.into());
        }
        settings.insert("geofence".into(), fence.into());
    }
    Ok(settings.into())
}

fn environment(show: &Show) -> Result<Value, String> {
    let mut environment = Map::new();
    environment.insert("type".into(), "outdoor".into());
    if let Some(frame) = &show.frame {
        let place = frame.origin;
        finite(
            "the origin of the show",
            &[place.lat_deg, place.lon_deg, place.amsl_m, frame.orientation_deg],
        )?;
        if place.lat_deg.abs() > 90.0 || place.lon_deg.abs() > 180.0 {
            return Err("the origin of the show is not on the globe".to_owned());
        }
        let mut origin = vec![
            json!((place.lat_deg * 1e7).round() as i64),
            json!((place.lon_deg * 1e7).round() as i64),
        ];
        if show.has_amsl {
            if place.amsl_m.abs() > MAX_COORDINATE_M {
                return Err("the altitude of the origin is absurd".to_owned());
            }
            origin.push(json!((place.amsl_m * 1e3).round() as i64));
        }
        let location = json!({ "origin": origin, "orientation": frame.orientation_deg });
        environment.insert("location".into(), location);
    }
    Ok(environment.into())
}

fn meta(show: &Show) -> Result<Value, String> {
    let mut meta = Map::new();
    for (key, text) in [("id", &show.id), ("title", &show.title)] {
        if let Some(text) = text {
            meta.insert(key.into(), text.clone().into());
        }
    }
    if let Some(phases_s) = show.phases_s {
        finite("a phase of the show", &phases_s)?;
        let [takeoff, landing, end] = phases_s;
        let segments = json!({
            "takeoff": [0, takeoff],
            "show": [takeoff, landing],
            "landing": [landing, end],
        });
        meta.insert("segments".into(), segments);
    }
    Ok(meta.into())
}
