//! What is in a show, and whether it breaks generous limits:
//! `cargo run -p skybrush-show --example inspect -- SHOW.skyc`.

use std::error::Error;
use std::io::{Write as _, stdout};
use std::path::Path;

use skybrush_show::check::{CheckInput, Limits, check};
use skybrush_show::skyc;
use untrusted_io::file::read_whole;

const LIMITS: Limits = Limits {
    max_speed_xy_mps: 8.0,
    max_speed_up_mps: 5.0,
    max_speed_down_mps: 4.0,
    max_acceleration_mps2: 4.0,
    max_velocity_step_mps: 5.0,
    max_altitude_m: 150.0,
    min_distance_m: 2.0,
    endurance_s: 1_200.0,
    endurance_reserve: 0.2,
};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: inspect SHOW.skyc")?;
    let show = skyc::read(&read_whole(Path::new(&path), 256 << 20)?)?;
    let mut out = stdout().lock();
    for drone in &show.drones {
        let lasts_s = f64::from(drone.trajectory.duration_ms() as u32) / 1000.0;
        writeln!(
            out,
            "{}: {lasts_s:.1} s, {} pieces",
            drone.name,
            drone.trajectory.segments.len()
        )?;
    }
    for finding in check(&CheckInput::new(&show, &LIMITS)).findings {
        writeln!(out, "{:?} {}: {}", finding.severity, finding.check, finding.message)?;
    }
    Ok(())
}
