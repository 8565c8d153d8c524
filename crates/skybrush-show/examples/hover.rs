//! Writes a show of one drone that hovers for a minute:
//! `cargo run -p skybrush-show --example hover -- OUT.skyb`.

use std::error::Error;

use nalgebra::Vector3;
use skybrush_show::skyb::{self, SkybOptions};
use skybrush_show::{Segment, SegmentPath, ShowDrone, Trajectory};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: hover OUT.skyb")?;
    let leg =
        |z| Segment { duration_ms: 10_000, path: SegmentPath::Line(Vector3::new(0.0, 0.0, z)) };
    let hold = Segment { duration_ms: 60_000, path: SegmentPath::Hold };
    let trajectory =
        Trajectory { start_m: Vector3::zeros(), segments: vec![leg(10.0), hold, leg(2.5)] };
    let drone = ShowDrone { trajectory, ..ShowDrone::default() };
    std::fs::write(path, skyb::write(&drone, &SkybOptions::default())?.bytes)?;
    Ok(())
}
