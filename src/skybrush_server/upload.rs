//! A show for one drone, as the server takes it.

use serde_json::{Value, json};

use super::error::ServerError;
use super::work::Job;
use crate::base::frame::ShowFrame;

/// Fence that is uploaded with a show. There is no show without one: a server that is given no
/// fence switches that of the drone off.
#[derive(Clone, Debug, PartialEq)]
pub struct Fence {
    /// Corners of the polygon, show x and y, m.
    pub polygon_m: Vec<[f64; 2]>,
    /// Highest altitude above home, m; the server takes 10 to 3000.
    pub max_altitude_m: f64,
    /// Largest distance from home, m; the server takes 30 to 10000.
    pub max_distance_m: f64,
}

/// Parts of an upload that all drones of a show have in common.
#[derive(Clone, Debug)]
pub struct ShowUpload {
    /// Short name of the show.
    pub id: String,
    /// Title of the show, for people.
    pub title: String,
    /// Number of drones in the show.
    pub drones: usize,
    /// Position and orientation of the show frame.
    pub frame: ShowFrame,
    /// Fence that is uploaded with the show.
    pub fence: Fence,
}

/// The server's limits, m.
const ALTITUDE_M: std::ops::RangeInclusive<f64> = 10.0..=3000.0;
const DISTANCE_M: std::ops::RangeInclusive<f64> = 30.0..=10_000.0;

impl ShowUpload {
    /// The payload for the drone with this index (from 0). `trajectory` and `lights` are the
    /// objects of a `.skyc` file.
    ///
    /// # Errors
    /// When the fence is not one that the server would set as it is.
    pub fn payload(
        &self,
        index: usize,
        trajectory: &Value,
        lights: Option<&Value>,
    ) -> Result<Value, ServerError> {
        let fail = |problem: String| ServerError::Show { problem };
        let fence = &self.fence;
        if fence.polygon_m.len() < 3 {
            return Err(fail("its fence has fewer than 3 corners".to_owned()));
        }
        if !ALTITUDE_M.contains(&fence.max_altitude_m) {
            let wrong = fence.max_altitude_m;
            return Err(fail(format!("its fence is {wrong} m high; 10 to 3000 m are possible")));
        }
        if !DISTANCE_M.contains(&fence.max_distance_m) {
            let wrong = fence.max_distance_m;
            return Err(fail(format!("its fence reaches {wrong} m; 30 to 10000 m are possible")));
        }
        let origin = self.frame.origin;
        let mut show = json!({
            "name": format!("{}", index + 1),
            "trajectory": trajectory,
            "amslReference": null,
            "coordinateSystem": {
                "type": "nwu",
                "origin": [origin.lon_deg, origin.lat_deg],
                "orientation": self.frame.orientation_deg,
            },
            "geofence": {
                "version": 1,
                "enabled": true,
                "polygons": [{ "isInclusion": true, "points": fence.polygon_m }],
                "rallyPoints": [],
                "maxAltitude": fence.max_altitude_m,
                "maxDistance": fence.max_distance_m,
                "minAltitude": null,
                "action": "return",
            },
            "mission": {
                "id": self.id,
                "title": self.title,
                "index": index,
                "displayName": format!("{} / {}", self.id, index + 1),
                "numDrones": self.drones,
            },
        });
        if let (Some(lights), Some(show)) = (lights, show.as_object_mut()) {
            show.insert("lights".to_owned(), lights.clone());
        }
        Ok(show)
    }
}

/// The request that uploads a payload to a drone of the server.
pub fn upload(drone: &str, show: &Value) -> Job {
    let body = json!({
        "type": "OBJ-CMD",
        "ids": [drone],
        "command": "__show_upload",
        "kwds": { "show": show },
    });
    Job { drone: drone.to_owned(), body }
}
