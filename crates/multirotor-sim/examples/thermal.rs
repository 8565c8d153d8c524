//! Climbs to 100 m in the middle of a thermal and comes down again:
//! `cargo run -p multirotor-sim --example thermal -- OUT.BIN`.

use std::error::Error;
use std::fs::File;
use std::io::{Write as _, stdout};

use dataflash::time::GpsTime;
use multirotor_sim::sim::air::AllenThermals;
use multirotor_sim::sim::{FlightSetup, Hooks, fly};
use multirotor_sim::vehicle::library::builtin;
use nalgebra::{Vector2, Vector3};
use skybrush_show::frame::{Geodetic, ShowFrame};
use skybrush_show::{Segment, SegmentPath, Trajectory};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: thermal OUT.BIN")?;
    let vehicle = builtin("airsim-generic-quad")?;
    // Convective velocity scale of 2 m/s under an inversion at 1,000 m; no wind.
    let air = AllenThermals::new(2.0, 1_000.0, Vector3::zeros(), vec![Vector2::zeros()]);
    let leg = |duration_ms, z| Segment {
        duration_ms,
        path: SegmentPath::Line(Vector3::new(0.0, 0.0, z)),
    };
    let hold = Segment { duration_ms: 20_000, path: SegmentPath::Hold };
    let segments = vec![leg(40_000, 100.0), hold, leg(40_000, 2.5)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let origin = Geodetic { lat_deg: 47.47, lon_deg: 19.06, amsl_m: 150.0 };
    let setup = FlightSetup {
        vehicle: &vehicle,
        trajectory: &trajectory,
        home_m: Vector3::zeros(),
        frame: ShowFrame { origin, orientation_deg: 0.0 },
        atmosphere: &air,
        seed: 1,
        drone: 1,
        start: GpsTime { week: 2400, tow_ms: 0 },
        lights: &[],
        full_logs: false,
        hooks: Hooks::default(),
    };
    let flown = fly(&setup, &mut File::create(path)?)?;
    writeln!(
        stdout(),
        "landed after {:.1} s, highest at {:.1} m, {} rows in the log",
        flown.landed_s,
        flown.max_height_m,
        flown.log_rows
    )?;
    Ok(())
}
