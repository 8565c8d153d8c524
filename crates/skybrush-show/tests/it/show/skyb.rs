//! `.skyb`: the worked example bit for bit, random shows there and back, and every refusal.

use super::common::{fix_crc, hold, line, septic, trajectory, worked_example};
use nalgebra::Vector3;
use proptest::prelude::*;
use skybrush_show::skyb::{self, BlockKind, Scale, SkybOptions};
use skybrush_show::{Segment, SegmentPath, ShowDrone, Trajectory, YawControl};

/// The 65 bytes that the official server writes for the worked example.
#[rustfmt::skip]
const EXAMPLE: [u8; 65] = [
    0x73, 0x6b, 0x79, 0x62, 0x02, 0x01, 0x67, 0x56, 0x8e, 0x7c,
    0x01, 0x26, 0x00,
    0x01, 0, 0, 0, 0, 0, 0, 0, 0,
    0x10, 0x10, 0x27, 0x10, 0x27,
    0x00, 0x88, 0x13,
    0x01, 0x20, 0x4e, 0x20, 0x4e,
    0x00, 0x88, 0x13,
    0x01, 0x20, 0x4e, 0x00, 0x00,
    0x00, 0x88, 0x13,
    0x10, 0x40, 0x1f, 0xc4, 0x09,
    0x02, 0x0b, 0x00,
    0x04, 0x00, 0xff, 0x00, 0x90, 0x1c,
    0x0a, 0x32,
    0x06, 0x01,
    0x00,
];

fn write(drone: &ShowDrone) -> skyb::SkybFile {
    skyb::write(drone, &SkybOptions::default()).unwrap()
}

fn flying(start_m: Vector3<f64>, segments: Vec<Segment>) -> ShowDrone {
    ShowDrone { trajectory: Trajectory { start_m, segments }, ..ShowDrone::default() }
}

fn refusal(bytes: &[u8]) -> String {
    skyb::read(bytes).unwrap_err().to_string()
}

/// A version 2 file of these blocks, with the right checksum.
fn file(blocks: &[(u8, &[u8])]) -> Vec<u8> {
    let mut bytes = b"skyb\x02\x01\0\0\0\0".to_vec();
    for (code, body) in blocks {
        bytes.push(*code);
        bytes.extend(u16::try_from(body.len()).unwrap().to_le_bytes());
        bytes.extend(*body);
    }
    fix_crc(&mut bytes);
    bytes
}

const EMPTY_TRAJECTORY: &[u8] = &[1, 0, 0, 0, 0, 0, 0, 0, 0];

#[test]
fn writes_the_worked_example_bit_for_bit() {
    let file = write(&worked_example());
    assert_eq!(file.bytes, EXAMPLE);
    assert_eq!((file.scale_mm, file.pieces), (1, 7));
    assert_eq!(file.quantisation.max_position_m, 0.0);
}

#[test]
fn reads_the_worked_example_back() {
    let contents = skyb::read(&EXAMPLE).unwrap();
    assert_eq!(contents.drone.trajectory, worked_example().trajectory);
    assert_eq!(contents.drone.lights, worked_example().lights);
    assert_eq!((contents.version, contents.has_crc, contents.scale_mm), (2, true, 1));
    assert!(contents.events.is_empty() && !contents.has_rth_plan && !contents.has_trajectory_yaw);
}

#[test]
fn reads_version_1_and_version_2_without_checksum() {
    let blocks = &EXAMPLE[10..];
    for header in [b"skyb\x01".as_slice(), b"skyb\x02\x00"] {
        let contents = skyb::read(&[header, blocks].concat()).unwrap();
        assert_eq!(contents.drone.trajectory, worked_example().trajectory);
        assert!(!contents.has_crc);
    }
}

#[test]
fn skips_unknown_blocks_and_takes_the_first_of_each_type() {
    let event = [0x10, 0x27, 0, 0, 1, 3, 0xff, 0xff, 0xff, 0xff];
    let bytes = file(&[
        (99, b"whatever"),
        (0, b""),
        (3, "é first".as_bytes()),
        (1, EMPTY_TRAJECTORY),
        (3, b"second"),
        (4, &[1, 0, 0, 0, 0]),
        (6, &event),
        (1, b"broken, but never used"),
    ]);
    let contents = skyb::read(&bytes).unwrap();
    assert_eq!(contents.comment.as_deref(), Some("é first"));
    assert!(contents.has_rth_plan);
    assert_eq!(contents.events[0].time_ms, 10_000);
    assert_eq!((contents.events[0].kind, contents.events[0].subtype), (1, 3));
    let used: Vec<_> =
        contents.blocks.iter().filter(|block| block.used).map(|block| block.kind).collect();
    assert_eq!(
        used,
        [BlockKind::Comment, BlockKind::Trajectory, BlockKind::RthPlan, BlockKind::Events]
    );
}

#[test]
fn brings_axes_of_different_degree_to_one_path() {
    // x cubic, y linear, z of 7th degree, yaw linear.
    let mut body = EMPTY_TRAJECTORY.to_vec();
    body[0] = 0x80 | 0x0a;
    body.push(0b01_11_01_10);
    body.extend(2000_u16.to_le_bytes());
    for value in [0_i16, 300, 300, 700, 100, 200, 300, 400, 500, 600, 700, 900] {
        body.extend(value.to_le_bytes());
    }
    let contents = skyb::read(&file(&[(1, &body)])).unwrap();
    assert!(contents.has_trajectory_yaw);
    assert_eq!(contents.scale_mm, 10);
    let trajectory = contents.drone.trajectory;
    assert!(matches!(trajectory.segments[0].path, SegmentPath::Septic(_)));
    let middle = trajectory.state_at(1.0).position_m;
    // x: (0 + 3*0 + 3*3 + 3) / 8; y: half of 7 m; z: symmetric about 3.5 m.
    assert!((middle - Vector3::new(1.5, 3.5, 3.5)).norm() < 1e-12, "{middle}");
}

#[test]
fn cuts_long_pieces_without_losing_a_millisecond() {
    let segments = vec![hold(600_000), line(130_001, 30.0, 0.0, 7.0), hold(65_001)];
    let drone = flying(Vector3::new(0.0, 0.0, 7.0), segments);
    let file = write(&drone);
    let read = skyb::read(&file.bytes).unwrap().drone.trajectory;
    let durations: Vec<_> = read.segments.iter().map(|segment| segment.duration_ms).collect();
    let mut expected = vec![60_000; 10];
    expected.extend([43_333, 43_334, 43_334, 32_500, 32_501]);
    assert_eq!(durations, expected);
    assert_eq!(file.trajectory_bytes, 9 + 12 * 3 + 3 * 5);
    assert!(file.quantisation.max_speed_mps < 0.03e-3, "{:?}", file.quantisation);
}

#[test]
fn takes_the_finest_scale_that_holds_the_rounded_values() {
    let scale_of = |reach_m: f64, scale: Scale| {
        let drone = flying(Vector3::new(0.0, -reach_m, 0.0), vec![line(1000, 1.0, 1.0, 1.0)]);
        let options = SkybOptions { scale, ..SkybOptions::default() };
        skyb::write(&drone, &options).map(|file| file.scale_mm).map_err(|error| error.to_string())
    };
    assert_eq!(scale_of(32.7674, Scale::Smallest), Ok(1));
    assert_eq!(scale_of(32.7676, Scale::Smallest), Ok(2));
    assert_eq!(scale_of(70.0, Scale::Smallest), Ok(3));
    assert_eq!(scale_of(70.0, Scale::Nice), Ok(5));
    assert_eq!(scale_of(4161.4, Scale::Smallest), Ok(127));
    assert_eq!(scale_of(10.0, Scale::Fixed(5)), Ok(5));
    insta::assert_snapshot!(scale_of(5000.0, Scale::Smallest).unwrap_err(), @"a coordinate of 5000.000 m does not fit: 127 mm per unit reaches ±4161.409 m (move the origin to the middle of the show, or choose a coarser scale)");
    insta::assert_snapshot!(scale_of(40.0, Scale::Fixed(1)).unwrap_err(), @"a coordinate of 40.000 m does not fit: 1 mm per unit reaches ±32.767 m (move the origin to the middle of the show, or choose a coarser scale)");
    insta::assert_snapshot!(scale_of(40.0, Scale::Fixed(0)).unwrap_err(), @"a scale of 0 mm per unit does not exist: it must be 1 to 127");
}

#[test]
fn an_axis_that_is_straight_in_a_curve_takes_two_bytes() {
    // y moves evenly, x curves, z stands: 3 + 6 + 2 bytes.
    let points =
        [Vector3::new(0.0, 1.0, 5.0), Vector3::new(3.0, 2.0, 5.0), Vector3::new(3.0, 3.0, 5.0)];
    let segments = vec![Segment { duration_ms: 4000, path: SegmentPath::Cubic(points) }];
    let drone = flying(Vector3::new(0.0, 0.0, 5.0), segments);
    let file = write(&drone);
    assert_eq!(file.trajectory_bytes, 9 + 11);
    let read = skyb::read(&file.bytes).unwrap().drone.trajectory;
    assert!(
        (read.state_at(1.7).position_m - drone.trajectory.state_at(1.7).position_m).norm() < 1e-9
    );
}

#[test]
fn writes_comment_and_yaw() {
    let yaw = YawControl {
        auto: false,
        offset_deg: 10.0,
        setpoints: vec![(0.0, 20.0), (90.0, 20.0), (100.0, -250.0), (101.5, 9000.0)],
    };
    let drone = ShowDrone { yaw: Some(yaw), ..worked_example() };
    let options = SkybOptions { comment: Some("drone 7".into()), ..SkybOptions::default() };
    let contents = skyb::read(&skyb::write(&drone, &options).unwrap().bytes).unwrap();
    assert_eq!(contents.comment.as_deref(), Some("drone 7"));
    let read = contents.drone.yaw.unwrap();
    assert_eq!(read.offset_deg, 30.0);
    let at = |time_s: f64| read.setpoints.iter().find(|setpoint| setpoint.0 == time_s).unwrap().1;
    assert_eq!((at(90.0), at(100.0), at(101.5)), (0.0, -270.0, 8980.0));
}

#[test]
fn refuses_to_write_what_the_format_cannot_hold() {
    let refusal =
        |drone: ShowDrone| skyb::write(&drone, &SkybOptions::default()).unwrap_err().to_string();
    let still = flying(Vector3::zeros(), vec![hold(1500), hold(0)]);
    insta::assert_snapshot!(refusal(still), @"piece 2 (at 1.500 s) lasts 0 ms: time must not stand still, remove the piece or give it a duration");
    let nan = flying(Vector3::zeros(), vec![line(10, f64::NAN, 0.0, 0.0)]);
    insta::assert_snapshot!(refusal(nan), @"piece 1 (0: the start point) has a coordinate that is not a finite number");
    let steps = (0..8000).map(|i| {
        let side = f64::from(i % 2) + 1.0;
        line(40, side, side, side)
    });
    insta::assert_snapshot!(refusal(flying(Vector3::zeros(), steps.collect())), @"the trajectory needs 72009 bytes, a block holds 65535: the first 7280 of its 8000 pieces fit, until 291.200 s (use fewer, longer or curved pieces)");
    let lights = ShowDrone { lights: vec![1; 70_000], ..worked_example() };
    insta::assert_snapshot!(refusal(lights), @"the light program has 70000 bytes, a block holds 65535");
    let yaw = |setpoints| ShowDrone {
        yaw: Some(YawControl { setpoints, ..YawControl::default() }),
        ..worked_example()
    };
    insta::assert_snapshot!(refusal(yaw(vec![(0.0, 1.0), (5.0, 2.0), (5.0, 3.0)])), @"yaw setpoint 3: time stands still or goes back");
    insta::assert_snapshot!(refusal(yaw(vec![(0.0, 4000.0)])), @"yaw setpoint 1: the first angle is not within ±3276.7 degrees");
    insta::assert_snapshot!(refusal(yaw(vec![(0.0, 0.0), (1.0, f64::NAN)])), @"yaw setpoint 2: the angle is not a sensible number");
}

#[test]
fn refuses_broken_files_and_says_where() {
    insta::assert_snapshot!(refusal(b"PK\x03\x04 zip"), @r#"not a .skyb file: it starts with [50, 4b, 03, 04], not with "skyb" (73 6b 79 62)"#);
    insta::assert_snapshot!(refusal(b""), @r#"not a .skyb file: it starts with [], not with "skyb" (73 6b 79 62)"#);
    insta::assert_snapshot!(refusal(b"skyb\x03\x00"), @"byte 4: version 3 is not known; versions 1 and 2 are");
    insta::assert_snapshot!(refusal(b"skyb\x02\x01\x00"), @"byte 4: the file header is cut off: 6 bytes are needed, 3 are left");
    let mut flipped = EXAMPLE;
    flipped[30] ^= 4;
    insta::assert_snapshot!(refusal(&flipped), @"byte 6: the file is damaged: its checksum says 0x7c8e5667, its content gives 0xf41405c5");
    let mut short = EXAMPLE[..60].to_vec();
    fix_crc(&mut short);
    insta::assert_snapshot!(refusal(&short), @"byte 54: the light program block is cut off: 11 bytes are needed, 6 are left");
    let mut short = EXAMPLE[..52].to_vec();
    fix_crc(&mut short);
    insta::assert_snapshot!(refusal(&short), @"byte 51: a block header is cut off: 3 bytes are needed, 1 are left");
    insta::assert_snapshot!(refusal(&file(&[(2, &[0])])), @"the file has no trajectory block: a drone would refuse the show");
    insta::assert_snapshot!(refusal(&file(&[(1, &[1, 0, 0])])), @"byte 13: the trajectory header is cut off: 9 bytes are needed, 3 are left");
    let with = |scale: u8, pieces: &[u8]| {
        let mut body = EMPTY_TRAJECTORY.to_vec();
        body[0] = scale;
        body.extend(pieces);
        refusal(&file(&[(1, &body)]))
    };
    insta::assert_snapshot!(with(0, &[0, 1, 0]), @"byte 13: the trajectory has a scale of 0 mm per unit, and pieces: the scale must be 1 to 127");
    insta::assert_snapshot!(with(1, &[0, 1, 0, 0x10, 0, 0, 5, 0]), @"byte 25: piece 2 lasts 0 ms: time must not stand still");
    insta::assert_snapshot!(with(1, &[0, 1]), @"byte 22: the header of a piece is cut off: 3 bytes are needed, 2 are left");
    insta::assert_snapshot!(with(1, &[0b10, 1, 0, 0, 0, 0, 0]), @"byte 25: a piece is cut off: 6 bytes are needed, 4 are left");
    insta::assert_snapshot!(refusal(&file(&[(1, EMPTY_TRAJECTORY), (5, &[0, 0, 0, 1])])), @"byte 28: a yaw control entry is cut off: 4 bytes are needed, 1 are left");
    insta::assert_snapshot!(refusal(&file(&[(1, EMPTY_TRAJECTORY), (5, &[0])])), @"byte 25: the yaw control header is cut off: 3 bytes are needed, 1 are left");
    insta::assert_snapshot!(refusal(&file(&[(1, EMPTY_TRAJECTORY), (6, &[0; 13])])), @"byte 35: an event is cut off: 10 bytes are needed, 3 are left");
    insta::assert_snapshot!(refusal(&[b"skyb\x01".as_slice(), &vec![0; 9 << 20]].concat()), @"the file has 9437189 bytes; a .skyb file larger than 8388608 bytes is refused");
}

#[test]
fn an_empty_trajectory_is_read_with_any_scale() {
    for body in [&[] as &[u8], &[0; 9], EMPTY_TRAJECTORY] {
        let contents = skyb::read(&file(&[(1, body)])).unwrap();
        assert_eq!(contents.drone.trajectory, Trajectory::default());
    }
}

#[test]
fn every_prefix_and_thousands_of_byte_flips_are_survived() {
    let drone = ShowDrone {
        yaw: Some(YawControl { setpoints: vec![(0.0, 1.0), (9.0, 2.0)], ..YawControl::default() }),
        ..flying(
            Vector3::new(1.0, 2.0, 3.0),
            vec![septic(3000), hold(10), line(70_000, 4.0, 4.0, 4.0), hold(5)],
        )
    };
    let options = SkybOptions { comment: Some("hello".into()), ..SkybOptions::default() };
    let bytes = skyb::write(&drone, &options).unwrap().bytes;
    for end in 0..bytes.len() {
        let mut prefix = bytes[..end].to_vec();
        assert!(skyb::read(&prefix).is_err(), "a prefix of {end} bytes");
        fix_crc(&mut prefix);
        let _ = skyb::read(&prefix);
    }
    let (mut refused, mut taken) = (0, 0);
    for i in 0..bytes.len() {
        for value in 0..=255_u8 {
            let mut flipped = bytes.clone();
            if flipped[i] == value {
                continue;
            }
            flipped[i] = value;
            assert!(skyb::read(&flipped).is_err(), "byte {i} set to {value}");
            fix_crc(&mut flipped);
            match skyb::read(&flipped) {
                Ok(contents) => {
                    taken += 1;
                    let _ = contents.drone.trajectory.state_at(1.5);
                }
                Err(error) => {
                    refused += 1;
                    assert!(!error.to_string().is_empty());
                }
            }
        }
    }
    assert!(refused > 1000 && taken > 1000, "{refused} refused, {taken} taken");
}

proptest! {
    #[test]
    fn any_trajectory_survives_within_one_unit(trajectory in trajectory(true), nice: bool) {
        let drone = ShowDrone { trajectory, ..ShowDrone::default() };
        let scale = if nice { Scale::Nice } else { Scale::Smallest };
        let options = SkybOptions { scale, ..SkybOptions::default() };
        let written = skyb::write(&drone, &options);
        prop_assume!(!(nice && written.is_err()));
        let file = written.unwrap();
        let read = skyb::read(&file.bytes).unwrap().drone.trajectory;
        prop_assert_eq!(read.duration_ms(), drone.trajectory.duration_ms());
        let unit_m = f64::from(file.scale_mm) / 1000.0;
        let (mut worst_m, mut worst_mps) = (0.0_f64, 0.0_f64);
        for i in 0..=400 {
            let time_s = drone.trajectory.duration_ms() as f64 / 1000.0 * f64::from(i) / 400.0;
            let (a, b) = (drone.trajectory.state_at(time_s), read.state_at(time_s));
            let gap = a.position_m - b.position_m;
            prop_assert!(gap.amax() <= 0.5 * unit_m + 1e-9, "{} at {time_s} s", gap);
            worst_m = worst_m.max(gap.norm());
            if i % 400 != 0 {
                worst_mps = worst_mps.max((a.velocity_mps - b.velocity_mps).norm());
            }
        }
        prop_assert!(worst_m <= file.quantisation.max_position_m + 1e-9);
        prop_assert!(worst_mps <= file.quantisation.max_speed_mps + 1e-7, "{worst_mps} {:?}", file.quantisation);
    }

    #[test]
    fn any_bytes_are_survived(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = skyb::read(&bytes);
        let mut dressed = [b"skyb\x02\x01\0\0\0\0".as_slice(), &bytes].concat();
        fix_crc(&mut dressed);
        let _ = skyb::read(&dressed);
        let _ = skyb::read(&file(&[(1, &bytes)]));
    }
}
