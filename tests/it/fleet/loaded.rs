//! What a virtual vehicle must have once a station calls it loaded, seen from the vehicle.

#![allow(dead_code, reason = "each test uses its part")]
#![allow(clippy::allow_attributes, reason = "unused in some tests only")]

use nalgebra::Vector3;
use updraft::base::frame::Geodetic;
use updraft::fleet::fence::fence_of;
use updraft::fleet::upload::ShowLoad;
use updraft::link::clock::MS;
use updraft::link::id::DroneId;
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};
use updraft::protocol::show::SHOW_FILE;
use updraft::show::skyb;
use updraft::virtual_fleet::lossy::Faults;
use updraft::virtual_fleet::vehicle::VirtualVehicle;

pub(crate) fn drone(system: u16) -> DroneId {
    DroneId { network: 0, system: system as u8 }
}

/// A hover of 30 s.
pub(crate) fn hover(rows: u16, columns: u16) -> Plan {
    let overrides = [
        Override::new("grid.rows", i64::from(rows)),
        Override::new("grid.columns", i64::from(columns)),
        Override::new("duration_s", 30.0),
        Override::new("height_m", 30.0),
        Override::new("site.orientation_deg", 40.0),
    ];
    resolve("hover", &overrides).unwrap().flights.remove(0).plan
}

/// What slot `slot` of a plan gets.
pub(crate) fn load(plan: &Plan, slot: u16) -> ShowLoad {
    let show = plan.to_show();
    let drone = &show.drones[usize::from(slot) - 1];
    let skyb = skyb::write(drone, &skyb::SkybOptions::default()).unwrap().bytes;
    ShowLoad { skyb, site: plan.site, fence: fence_of(plan, &show).unwrap() }
}

/// One frame in five is lost, each way, takes 200 ms, and frames overtake each other.
pub(crate) fn bad() -> Faults {
    Faults { loss: 0.2, repeat: 0.05, delay: 200 * MS, jitter: 50 * MS, ..Faults::default() }
}

/// The show file on a vehicle.
pub(crate) fn show_file(vehicle: &VirtualVehicle<'_>) -> Option<Vec<u8>> {
    let size = vehicle.storage.size(SHOW_FILE).ok()?;
    let mut bytes = vec![0; size as usize];
    let read = vehicle.storage.read_at(SHOW_FILE, 0, &mut bytes).unwrap();
    assert_eq!(read, bytes.len());
    Some(bytes)
}

/// It has the file, flies what is in it, and stays in a fence that the show fits into.
pub(crate) fn assert_loaded(vehicle: &VirtualVehicle<'_>, wanted: &ShowLoad) {
    let system = vehicle.setup.system;
    assert!(show_file(vehicle).as_deref() == Some(&wanted.skyb[..]), "drone {system}: its file");
    let has = vehicle.loaded().unwrap_or_else(|| panic!("drone {system} has loaded nothing"));
    let show = skyb::read(&wanted.skyb).unwrap().drone;
    assert_eq!(has.trajectory, show.trajectory, "drone {system}");
    assert_eq!(has.lights, show.lights, "drone {system}");
    assert_eq!(vehicle.fence_1e7(), wanted.fence.corners_1e7, "drone {system}");
    for (name, value) in wanted.fence.params() {
        assert_eq!(vehicle.params.get(&name), value, "drone {system}: {name}");
    }
    // Independently of what was sent: every point of the show is inside, with room to spare.
    let frame = wanted.site.frame();
    let corners: Vec<Vector3<f64>> = vehicle
        .fence_1e7()
        .iter()
        .map(|(lat, lon)| {
            let (lat_deg, lon_deg) = (f64::from(*lat) * 1e-7, f64::from(*lon) * 1e-7);
            frame.from_geodetic(Geodetic { lat_deg, lon_deg, ..frame.origin })
        })
        .collect();
    let end_ms = has.trajectory.duration_ms();
    for time_ms in (0..=end_ms).step_by(100) {
        let at = has.trajectory.state_at(time_ms as f64 * 1e-3).position_m;
        assert!(at.z + 1.0 < f64::from(vehicle.params.get("FENCE_ALT_MAX")), "{time_ms} ms: {at}");
        assert!(is_inside(&corners, at, 1.0), "drone {system}: {time_ms} ms: {at}");
    }
}

/// Whether a place is inside a polygon, and at least so far from its edges.
fn is_inside(corners: &[Vector3<f64>], at: Vector3<f64>, margin_m: f64) -> bool {
    let mut inside = false;
    for (index, to) in corners.iter().enumerate() {
        let from = corners[(index + corners.len() - 1) % corners.len()];
        let (edge, away) = (to.xy() - from.xy(), at.xy() - from.xy());
        let share = (away.dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0);
        if (away - edge * share).norm() < margin_m {
            return false;
        }
        let crosses = (from.y > at.y) != (to.y > at.y);
        if crosses && at.x < from.x + edge.x * (at.y - from.y) / edge.y {
            inside = !inside;
        }
    }
    inside
}

/// It has neither file nor show.
pub(crate) fn assert_cleared(vehicle: &VirtualVehicle<'_>) {
    let system = vehicle.setup.system;
    assert!(vehicle.loaded().is_none(), "drone {system} has a show");
    assert!(show_file(vehicle).is_none(), "drone {system} has a file");
}
