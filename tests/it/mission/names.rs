//! The names that a planned show has in its file.

use std::io::{Cursor, Read as _};

use serde_json::{Value, json};
use updraft::mission::resolve::resolve;
use updraft::show::{Show, skyc};

fn root_of(show: &Show) -> Value {
    let mut zip = zip::ZipArchive::new(Cursor::new(skyc::write(show).unwrap())).unwrap();
    let mut text = String::new();
    zip.by_name("show.json").unwrap().read_to_string(&mut text).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The names are those of Viewer 2.10.7 (`ValidationSettings`), of Studio for Blender 3.10's
/// `SafetyCheckParams` and `ShowLocation`, and of the server's geofence.
#[test]
fn limits_place_and_fence_have_the_names_that_others_read() {
    let flight = resolve("calibration", &[]).unwrap().flights.remove(0);
    let root = root_of(&flight.plan.to_show());
    let validation = root["settings"]["validation"].as_object().unwrap();
    let keys: Vec<&str> = validation.keys().map(String::as_str).collect();
    for key in ["maxAltitude", "maxVelocityXY", "maxVelocityZ", "maxVelocityZUp", "minDistance"] {
        assert!(keys.contains(&key), "{key}: {keys:?}");
    }
    let own = flight.plan.limits.max_acceleration_mps2;
    assert_eq!(validation["maxAccelerationXY"], json!(own));
    assert_eq!(validation["maxAccelerationZ"], json!(own));
    let ground_mm = (flight.plan.site.ground_amsl_m * 1000.0) as i64;
    assert_eq!(root["environment"]["location"]["origin"][2], json!(ground_mm));
    let fence = &root["settings"]["geofence"];
    assert_eq!(fence["maxAltitude"], json!(flight.plan.fence.max_altitude_m));
    // Nobody knows the ground there: no altitude is made up.
    let mut elsewhere = flight.plan;
    elsewhere.site.ground_assumed = true;
    let root = root_of(&elsewhere.to_show());
    assert_eq!(root["environment"]["location"]["origin"].as_array().unwrap().len(), 2);
}
