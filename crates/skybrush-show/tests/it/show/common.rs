//! Shows and generators that several test files use.

use std::io::{Cursor, Write as _};

use nalgebra::Vector3;
use proptest::prelude::*;
use skybrush_show::{Segment, SegmentPath, ShowDrone, Trajectory};
use untrusted_io::crc::ap_crc32;
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

/// Writes the right checksum into a version 2 `.skyb` file.
pub(crate) fn fix_crc(bytes: &mut [u8]) {
    if bytes.len() >= 10 {
        bytes[6..10].fill(0);
        let crc = ap_crc32(bytes);
        bytes[6..10].copy_from_slice(&crc.to_le_bytes());
    }
}

pub(crate) fn hold(duration_ms: u32) -> Segment {
    Segment { duration_ms, path: SegmentPath::Hold }
}

pub(crate) fn line(duration_ms: u32, x: f64, y: f64, z: f64) -> Segment {
    Segment { duration_ms, path: SegmentPath::Line(Vector3::new(x, y, z)) }
}

pub(crate) fn septic(duration_ms: u32) -> Segment {
    let points = [1, 5, 2, 9, 3, 8, 4].map(|i| {
        let v = f64::from(i);
        Vector3::new(v, 2.0 * v, 10.0 - v)
    });
    Segment { duration_ms, path: SegmentPath::Septic(Box::new(points)) }
}

/// Drone 1 of the worked example of the formats note.
pub(crate) fn worked_example() -> ShowDrone {
    let segments = vec![
        line(10_000, 0.0, 0.0, 10.0),
        hold(5_000),
        line(20_000, 20.0, 0.0, 10.0),
        hold(5_000),
        line(20_000, 0.0, 0.0, 10.0),
        hold(5_000),
        line(8_000, 0.0, 0.0, 2.5),
    ];
    ShowDrone {
        name: "Drone 1".into(),
        trajectory: Trajectory { start_m: Vector3::zeros(), segments },
        lights: vec![0x04, 0, 0xff, 0, 0x90, 0x1c, 0x0a, 0x32, 0x06, 0x01, 0x00],
        ..ShowDrone::default()
    }
}

fn point(reach_m: f64) -> impl Strategy<Value = Vector3<f64>> {
    prop::array::uniform3(-reach_m..reach_m).prop_map(Vector3::from)
}

/// Random trajectories: holds, lines and curves up to 200 s each, up to ±4000 m.
pub(crate) fn trajectory(with_septic: bool) -> impl Strategy<Value = Trajectory> {
    let reach = prop::sample::select(vec![3.0, 30.0, 150.0, 4000.0]);
    reach.prop_flat_map(move |reach_m| {
        let kinds = if with_septic { 0..4_usize } else { 0..3 };
        let segment = (kinds, 1_u32..200_000, prop::collection::vec(point(reach_m), 7)).prop_map(
            |(kind, duration_ms, points)| {
                let path = match kind {
                    0 => SegmentPath::Hold,
                    1 => SegmentPath::Line(points[0]),
                    2 => SegmentPath::Cubic([points[0], points[1], points[2]]),
                    _ => SegmentPath::Septic(Box::new(points.try_into().unwrap())),
                };
                Segment { duration_ms, path }
            },
        );
        (point(reach_m), prop::collection::vec(segment, 1..12))
            .prop_map(|(start_m, segments)| Trajectory { start_m, segments })
    })
}

/// A ZIP of these files.
pub(crate) fn archive(files: &[(&str, &str)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, text) in files {
        zip.start_file(*name, SimpleFileOptions::default()).unwrap();
        zip.write_all(text.as_bytes()).unwrap();
    }
    zip.finish().unwrap().into_inner()
}
