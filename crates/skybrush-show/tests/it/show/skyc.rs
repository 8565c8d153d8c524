//! `.skyc`: there and back, what other writers make, every refusal, hostile files.

use std::fmt::Write as _;
use std::io::{Cursor, Read as _};

use super::common::{archive, hold, line, septic, trajectory, worked_example};
use nalgebra::Vector3;
use proptest::prelude::*;
use serde_json::{Value, json};
use skybrush_show::frame::{Geodetic, ShowFrame};
use skybrush_show::skyc::{self, Limits};
use skybrush_show::{
    Cue, Extras, FenceZone, Segment, SegmentPath, Show, ShowDrone, Trajectory, Validation,
    YawControl,
};

fn full_show() -> Show {
    let mut second = worked_example();
    second.name = "Drone \"2\"\n".into();
    second.trajectory.start_m.y = 3.0;
    second.home_m = Some(Vector3::new(0.0, 3.0, -0.125));
    second.land_at_m = Some(Vector3::new(0.0, 3.0, 0.0));
    second.yaw = Some(YawControl {
        auto: true,
        offset_deg: 12.5,
        setpoints: vec![(0.0, 0.0), (10.0, 90.0)],
    });
    second.trajectory.segments.push(Segment {
        duration_ms: 1001,
        path: SegmentPath::Cubic([
            Vector3::new(1.0, 2.0, 3.0),
            Vector3::new(0.1, -0.2, 1.0 / 3.0),
            Vector3::new(4.0, 5.0, 6.0),
        ]),
    });
    let origin = Geodetic { lat_deg: 47.473313, lon_deg: 19.062057, amsl_m: 150.25 };
    Show {
        id: Some("test-0001".into()),
        title: Some("Two drones".into()),
        frame: Some(ShowFrame { origin, orientation_deg: 59.0 }),
        has_amsl: true,
        drones: vec![worked_example(), second],
        cues: vec![
            Cue { time_s: 0.0, name: "take-off".into() },
            Cue { time_s: 15.0, name: "é".into() },
        ],
        validation: Some(Validation {
            max_altitude_m: Some(50.0),
            max_velocity_xy_mps: Some(4.0),
            max_velocity_z_mps: Some(2.0),
            max_velocity_z_up_mps: None,
            min_distance_m: Some(2.5),
            max_acceleration_xy_mps2: Some(3.5),
            max_acceleration_z_mps2: Some(2.5),
            max_yaw_rate_dps: Some(30.0),
            min_nav_altitude_m: Some(2.5),
            max_acceleration_mps2: Some(3.0),
            max_velocity_step_mps: Some(6.5),
            endurance_s: Some(600.0),
            endurance_reserve: Some(0.0),
        }),
        fence: vec![
            FenceZone::exclusion(vec![[30.0, 0.0], [31.0, 0.0], [31.0, 1.5], [30.0, 1.5]]),
            FenceZone::inclusion(vec![[-10.0, -10.0], [40.0, -10.0], [40.0, 20.5]]),
        ],
        fence_altitude_m: Some(60.0),
        doubts: vec![],
        phases_s: Some([10.0, 65.0, 73.0]),
    }
}

#[test]
fn what_others_write_is_read() {
    let with = |settings: Value, drone: Value| {
        let mut show = inline(&with_points(&points()));
        show["settings"] = settings;
        for (key, value) in drone.as_object().unwrap() {
            show["swarm"]["drones"][0]["settings"][key] = value.clone();
        }
        read_json(&show).unwrap()
    };
    // As Studio for Blender writes it, and as some older shows have it (Viewer reads both).
    let studio = json!({"maxAltitude": 150, "maxVelocityXY": 8, "maxVelocityZ": 3,
        "maxAccelerationXY": 4, "maxAccelerationZ": 3.5, "minDistance": 3, "minNavAltitude": 2.5,
        "maxYawRate": 30, "maxVelocityZUp": 5});
    let snake = json!({"max_altitude": 150, "max_velocity_xy": 8, "max_velocity_z": 3,
        "max_acceleration_xy": 4, "max_acceleration_z": 3.5, "min_distance": 3,
        "min_nav_altitude": 2.5, "max_yaw_rate": 30, "max_velocity_z_up": 5});
    let limits = Validation {
        max_altitude_m: Some(150.0),
        max_velocity_xy_mps: Some(8.0),
        max_velocity_z_mps: Some(3.0),
        max_velocity_z_up_mps: Some(5.0),
        min_distance_m: Some(3.0),
        max_acceleration_xy_mps2: Some(4.0),
        max_acceleration_z_mps2: Some(3.5),
        max_yaw_rate_dps: Some(30.0),
        min_nav_altitude_m: Some(2.5),
        ..Validation::default()
    };
    for validation in [studio, snake] {
        let show = with(json!({ "validation": validation }), json!({}));
        assert_eq!(show.validation, Some(limits), "{validation}");
    }
    // A bad cue costs the cue, not the show.
    let cues = json!({"version": 1, "items": [{"time": 1, "name": "a"}, {"name": "b"}, 5]});
    let show = with(json!({ "cues": cues }), json!({}));
    assert_eq!(show.cues, [Cue { time_s: 1.0, name: "a".into() }]);
    insta::assert_snapshot!(show.doubts.join("\n"), @r#"show.json: cue 2, {"name":"b"}, has no time and was skipped (and 1 more)"#);
    // Places with four values, pyro and a plan to return are there, and are known to be.
    let four = json!([[0, [0, 0, 0, 1], []], [10, [0, 0, 10, 1], []]]);
    let mut show = inline(&with_points(&four));
    let event = json!([[1.5, 1, "flare"]]);
    show["swarm"]["drones"][0]["settings"]["pyro"] =
        json!({"version": 1, "events": event, "payloads": {"flare": {"name": "Flare"}}});
    show["swarm"]["drones"][0]["settings"]["rthPlan"] = json!({"version": 1, "entries": []});
    let drone = read_json(&show).unwrap().drones.remove(0);
    assert_eq!(drone.trajectory, climb());
    let extras = Extras { pyro_events: 1, has_rth_plan: true, spare_coordinates: 2 };
    assert_eq!(drone.extras, extras);
}

/// Like [`archive`], with names and sizes exactly as given, which the ZIP library would not write.
fn patched(files: &[(&str, &str)], from: &[u8], to: &[u8]) -> Vec<u8> {
    let mut bytes = archive(files);
    assert_eq!(from.len(), to.len());
    let mut found = 0;
    for i in 0..=bytes.len() - from.len() {
        if &bytes[i..i + from.len()] == from {
            bytes[i..i + to.len()].copy_from_slice(to);
            found += 1;
        }
    }
    assert!(found >= 1, "nothing to patch");
    bytes
}

fn points() -> Value {
    json!([[0, [0, 0, 0], []], [10, [0, 0, 10], []]])
}

fn with_points(points: &Value) -> Value {
    json!({"version": 1, "points": points})
}

fn inline(trajectory: &Value) -> Value {
    json!({"version": 1, "swarm": {"drones": [{"settings": {"trajectory": trajectory}}]}})
}

fn read_json(show: &Value) -> Result<Show, String> {
    skyc::read(&archive(&[("show.json", &show.to_string())])).map_err(|error| error.to_string())
}

fn refusal(show: &Value) -> String {
    read_json(show).unwrap_err()
}

#[expect(clippy::needless_pass_by_value, reason = "calls with json! read better")]
fn point_refusal(points: Value) -> String {
    refusal(&inline(&with_points(&points)))
}

fn climb() -> Trajectory {
    Trajectory { start_m: Vector3::zeros(), segments: vec![line(10_000, 0.0, 0.0, 10.0)] }
}

#[test]
fn a_full_show_comes_back() {
    let show = full_show();
    let bytes = skyc::write(&show).unwrap();
    let mut read = skyc::read(&bytes).unwrap();
    // Thirds of a metre are written to 0.1 µm.
    let Some(Segment { path: SegmentPath::Cubic(points), .. }) =
        read.drones[1].trajectory.segments.last_mut()
    else {
        panic!("the cubic piece is lost")
    };
    assert!((points[1].z - 1.0 / 3.0).abs() < 1e-7);
    points[1].z = 1.0 / 3.0;
    // Names are read without what would drive a terminal.
    assert_eq!(read.drones[1].name, "Drone \"2\"\u{240a}");
    read.drones[1].name.clone_from(&show.drones[1].name);
    assert_eq!(read, show);
}

#[test]
fn the_same_show_gives_the_same_bytes_on_any_number_of_threads() {
    let mut show = full_show();
    show.drones = vec![show.drones[1].clone(); 130];
    let bytes = skyc::write(&show).unwrap();
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(alone.install(|| skyc::write(&show)).unwrap() == bytes);
    assert_eq!(skyc::read(&bytes).unwrap().drones.len(), 130);
}

#[test]
fn the_files_look_as_expected() {
    let bytes = skyc::write(&full_show()).unwrap();
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut text = String::new();
    for index in 0..zip.len() {
        let mut file = zip.by_index(index).unwrap();
        writeln!(text, "--- {}", file.name().unwrap()).unwrap();
        file.read_to_string(&mut text).unwrap();
    }
    insta::assert_snapshot!(text);
}

#[test]
fn reads_references_in_all_forms() {
    let flown = with_points(&points()).to_string();
    for reference in [
        "./drones/Drone 1/t.json#",
        "./drones/Drone 1/t.json",
        "drones/Drone 1/t.json",
        "drones/Drone%201/t.json#",
        "./drones/./Drone%201/t.json#/",
        "all.json#/drones/0/a~1b",
    ] {
        let key = if reference.ends_with("#/") { "" } else { "trajectory" };
        let show = inline(&json!({"$ref": reference})).to_string();
        let nested = if key.is_empty() {
            json!({"": with_points(&points())}).to_string()
        } else {
            flown.clone()
        };
        let all = json!({"drones": [{"a/b": {"$ref": "drones/Drone 1/t.json"}}]}).to_string();
        let files = [
            ("all.json", all.as_str()),
            ("show.json", show.as_str()),
            ("drones/Drone 1/t.json", nested.as_str()),
        ];
        let read = skyc::read(&archive(&files)).unwrap_or_else(|e| panic!("{reference}: {e}"));
        assert_eq!(read.drones[0].trajectory, climb(), "{reference}");
    }
}

#[test]
fn reads_references_anywhere_and_relative_to_their_file() {
    let files = [
        ("show.json", r#"{"$ref":"main/real.json#"}"#),
        (
            "main/real.json",
            r##"{"version":1,"swarm":{"$ref":"swarm.json"},"meta":{"$ref":"#/x"},"x":{"id":"i"}}"##,
        ),
        ("main/swarm.json", r#"{"drones":[{"$ref":"d.json"},{"$ref":"d.json"}]}"#),
        ("main/d.json", r#"{"settings":{"$ref":"../main/d.json#/inner"},"inner":{}}"#),
    ];
    let error = skyc::read(&archive(&files)).unwrap_err().to_string();
    assert_eq!(
        error,
        "main/d.json: the reference \"../main/d.json#/inner\" has \"..\" in its path; that is not followed"
    );
    let mut files = files;
    let inner = r##"{"settings":{"$ref":"#/inner"},"inner":{"trajectory":{"version":1,"points":[[0,[0,0,0],[]],[10,[0,0,10],[]]]}}}"##;
    files[3].1 = inner;
    let show = skyc::read(&archive(&files)).unwrap();
    assert_eq!(show.id.as_deref(), Some("i"));
    assert_eq!(show.drones[1].trajectory, climb());
}

#[test]
fn reads_what_other_writers_make() {
    // Everything inline, takeoffTime, a quadratic and a 7th-degree piece, unknown keys, no lights.
    let six: Vec<Value> = (1..7).map(|i| json!([i, 0, 10])).collect();
    let show = read_json(&json!({
        "version": 1, "vendor": {"deep": [[[]]]},
        "swarm": {"drones": [{"type": "generic", "x": 1, "settings": {"trajectory": {
            "version": 1, "takeoffTime": 2.5, "landingTime": null, "points": [
                [0, [0, 0, 0], []], [1.0014, [0, 0, 9], [[0, 3, 3]]], [2, [0, 0, 9], []],
                [3, [7, 0, 10], six],
            ]}}}]},
        "environment": {"cameras": [{"name": "c", "position": [0, 0, 0], "orientation": [1, 0, 0, 0]}]},
    }))
    .unwrap();
    let drone = &show.drones[0];
    assert_eq!(drone.name, "Drone 1");
    assert!(drone.lights.is_empty());
    let expected = [
        hold(2500),
        Segment {
            duration_ms: 1001,
            path: SegmentPath::Cubic([
                Vector3::new(0.0, 2.0, 2.0),
                Vector3::new(0.0, 2.0, 5.0),
                Vector3::new(0.0, 0.0, 9.0),
            ]),
        },
        hold(999),
    ];
    assert_eq!(drone.trajectory.segments[..3], expected);
    assert!(
        matches!(&drone.trajectory.segments[3].path, SegmentPath::Septic(points) if points[5].x == 6.0)
    );
}

#[test]
fn many_drones_may_share_one_document() {
    let drones: Vec<Value> = (0..3000)
        .map(|i| json!({"settings": {"trajectory": {"$ref": format!("all.json#/{}", i % 7)}}}))
        .collect();
    let show = json!({"version": 1, "swarm": {"drones": drones}}).to_string();
    let all = Value::Array(vec![with_points(&points()); 7]).to_string();
    let read = skyc::read(&archive(&[("show.json", &show), ("all.json", &all)])).unwrap();
    assert_eq!(read.drones[2999].trajectory, climb());
}

#[test]
fn refuses_what_the_official_loader_refuses() {
    let good = inline(&with_points(&points()));
    let with = |pointer: &str, value: Value| {
        let mut show = good.clone();
        show["environment"] = json!({"type": "outdoor"});
        *show.pointer_mut(pointer).unwrap() = value;
        refusal(&show)
    };
    insta::assert_snapshot!(with("/version", json!(2)), @"show.json: show: version 2 is not supported, only 1 is");
    insta::assert_snapshot!(with("/swarm", json!({})), @"show.json: swarm.drones: there are no drones in this show");
    insta::assert_snapshot!(with("/swarm", Value::Null), @"show.json: swarm: it is missing: there are no drones in this show");
    insta::assert_snapshot!(with("/swarm/drones", json!([])), @"show.json: swarm.drones: there are no drones in this show");
    insta::assert_snapshot!(with("/swarm/drones", json!(vec![1; 5001])), @"show.json: swarm.drones: 5001 drones are more than the 5000 allowed");
    insta::assert_snapshot!(with("/swarm/drones/0", json!({"settings": 3})), @"drone 1 (?), show.json: it has no settings object");
    insta::assert_snapshot!(with("/swarm/drones/0/settings", json!({"name": "A7"})), @"drone 1 (A7), show.json: it has no trajectory");
    let trajectory = "/swarm/drones/0/settings/trajectory";
    insta::assert_snapshot!(with(trajectory, json!([1])), @"drone 1 (Drone 1), show.json: trajectory: it must be an object");
    insta::assert_snapshot!(with(trajectory, json!({"version": 0, "points": points()})), @"drone 1 (Drone 1), show.json: version: it must be 1, not 0");
    insta::assert_snapshot!(with(trajectory, json!({"version": 1, "points": []})), @"drone 1 (Drone 1), show.json: points: it must be an array that is not empty");
    insta::assert_snapshot!(with(trajectory, json!({"version": 1, "points": points(), "takeoffTime": "now"})), @r#"drone 1 (Drone 1), show.json: takeoffTime: t = "now" is not a number"#);
    insta::assert_snapshot!(with(trajectory, json!({"version": 1, "points": points(), "landingTime": "now"})), @r#"drone 1 (Drone 1), show.json: landingTime: "now" is not a number"#);
    insta::assert_snapshot!(with("/environment/type", json!("lunar")), @r#"show.json: environment.type: "lunar" is neither "outdoor" nor "indoor""#);
    insta::assert_snapshot!(with("/environment", json!({"cameras": [{"position": [0, "x", 0]}]})), @"show.json: environment.cameras: the position of a camera must be 3 numbers");
    insta::assert_snapshot!(with("/environment", json!({"cameras": [{"orientation": [0, 0, 0]}]})), @"show.json: environment.cameras: the orientation of a camera must be 4 numbers");
    let with_setting = |key: &str, value: Value| {
        let mut show = good.clone();
        show["swarm"]["drones"][0]["settings"][key] = value;
        refusal(&show)
    };
    insta::assert_snapshot!(with_setting("pyro", json!({"version": 2})), @"drone 1 (Drone 1), show.json: pyro: its version must be 1");
    insta::assert_snapshot!(with_setting("pyro", json!({"version": 1, "events": [[1, "a"]]})), @r#"drone 1 (Drone 1), show.json: pyro: [1,"a"] is not [time, channel, payload]"#);
    insta::assert_snapshot!(with_setting("lights", json!({"version": 1, "data": "a*b"})), @"drone 1 (Drone 1), show.json: lights.data: not base64: Invalid symbol 42, offset 1.");
    insta::assert_snapshot!(with_setting("lights", json!({"version": 7, "data": ""})), @"drone 1 (Drone 1), show.json: lights.version: it must be 1");
    insta::assert_snapshot!(with_setting("home", json!([1, 2])), @"drone 1 (Drone 1), show.json: home: [1,2] is not [x, y, z]");
    insta::assert_snapshot!(with_setting("yawControl", json!({"version": 1, "setpoints": [[0]]})), @"drone 1 (Drone 1), show.json: yawControl: [0] is not [t, degrees]");
}

#[test]
fn refuses_points_that_cannot_be_flown() {
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], [5, [0, 0, 1], []], [5, [0, 0, 2], []]])), @"drone 1 (Drone 1), show.json: point 3: time stands still at t = 5 s (to the millisecond); times must grow");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], [5, [0, 0, 1], []], [4.5, [0, 0, 2], []]])), @"drone 1 (Drone 1), show.json: point 3: time goes back from 5 s to 4.5 s");
    insta::assert_snapshot!(point_refusal(json!([[3, [0, 0, 0], []], [5, [0, 0, 1], []]])), @"drone 1 (Drone 1), show.json: point 1: the trajectory starts at t = 3 s, not at 0: the official server would drop that wait while Live shows it; move it to takeoffTime, or insert a point at t = 0");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], [[0, 0, 0]]]])), @"drone 1 (Drone 1), show.json: point 1: the first point must not have control points");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0]]])), @"drone 1 (Drone 1), show.json: point 1: it has no list of control points, which Live and the server need: write [t, [x, y, z], []]");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], {"$ref": "x.json"}])), @r#"drone 1 (Drone 1), show.json: point 2: {"$ref":"x.json"} is not [t, [x, y, z], [control points]]"#);
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0], []]])), @"drone 1 (Drone 1), show.json: point 1: [0,0] is not [x, y, z]");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, null, 0], []]])), @"drone 1 (Drone 1), show.json: point 1: [0,null,0] is not [x, y, z]");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 1e300, 0], []]])), @"drone 1 (Drone 1), show.json: point 1: a coordinate of 1e300 m is absurd");
    insta::assert_snapshot!(point_refusal(json!([[-1, [0, 0, 0], []]])), @"drone 1 (Drone 1), show.json: point 1: t = -1 s is not between 0 and 86400 s");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], [90000, [0, 0, 0], []]])), @"drone 1 (Drone 1), show.json: point 2: t = 90000 s is not between 0 and 86400 s");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], [1, [0, 0, 0], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]]])), @"drone 1 (Drone 1), show.json: point 2: 3 control points: only 0 (line), 1, 2 (cubic) and 6 (7th degree) are known");
    insta::assert_snapshot!(point_refusal(json!([[0, [0, 0, 0], []], [1, [0, 0, 0], [[0, 0, 0], [0, "a", 0]]]])), @r#"drone 1 (Drone 1), show.json: point 2: control point 2: [0,"a",0] is not [x, y, z]"#);
}

#[test]
fn refuses_broken_archives_and_references() {
    let text = |bytes: &[u8]| skyc::read(bytes).unwrap_err().to_string();
    insta::assert_snapshot!(text(b"skyb"), @"not a usable show archive (ZIP): invalid Zip archive: Could not find EOCD");
    insta::assert_snapshot!(text(&archive(&[("a.json", "{}")])), @"not a usable show archive (ZIP): it has no show.json");
    insta::assert_snapshot!(text(&archive(&[("show.json", "{\"version\":")])), @"show.json: it is not valid JSON: EOF while parsing a value at line 1 column 11");
    insta::assert_snapshot!(text(&archive(&[("show.json", &"[".repeat(100))])), @"show.json: its JSON is nested deeper than 64 levels");
    let reference = |target: &str| refusal(&inline(&json!({"$ref": target})));
    insta::assert_snapshot!(reference("nowhere.json"), @r#"show.json: the reference "nowhere.json" points to nothing"#);
    insta::assert_snapshot!(reference("#/nowhere"), @r##"show.json: the reference "#/nowhere" points to nothing"##);
    insta::assert_snapshot!(reference("../../etc/passwd"), @r#"show.json: the reference "../../etc/passwd" has ".." in its path; that is not followed"#);
    insta::assert_snapshot!(reference("%2e%2e/x.json"), @r#"show.json: the reference "%2e%2e/x.json" has ".." in its path; that is not followed"#);
    insta::assert_snapshot!(reference("/etc/passwd"), @r#"show.json: the reference "/etc/passwd" leaves the archive; only relative paths are followed"#);
    insta::assert_snapshot!(reference("https://example.com/x.json"), @r#"show.json: the reference "https://example.com/x.json" leaves the archive; only relative paths are followed"#);
    insta::assert_snapshot!(reference("a%zz.json"), @r#"show.json: the reference "a%zz.json" has a broken %-escape"#);
    insta::assert_snapshot!(reference("show.json#anchor"), @r#"show.json: the reference "show.json#anchor" has something else than a JSON pointer after the #"#);
    insta::assert_snapshot!(reference("#/swarm/drones/0/settings/trajectory"), @r##"show.json: the reference "#/swarm/drones/0/settings/trajectory" goes round in circles"##);
    let chain = archive(&[
        ("show.json", &inline(&json!({"$ref": "a.json"})).to_string()),
        ("a.json", r#"{"$ref":"b.json"}"#),
        ("b.json", r#"{"$ref":"a.json#"}"#),
    ]);
    insta::assert_snapshot!(text(&chain), @r##"b.json: the reference "a.json#" goes round in circles"##);
}

#[test]
fn refuses_hostile_archives() {
    let good = inline(&with_points(&points())).to_string();
    let named = |name: &str| {
        let stand_in = "x".repeat(name.len());
        let files = [("show.json", good.as_str()), (stand_in.as_str(), "{}")];
        skyc::read(&patched(&files, stand_in.as_bytes(), name.as_bytes())).unwrap_err().to_string()
    };
    insta::assert_snapshot!(named("../../evil.json"), @r#"not a usable show archive (ZIP): entry "../../evil.json" has ".." in its path; it may be meant to do harm"#);
    insta::assert_snapshot!(named("/etc/evil"), @r#"not a usable show archive (ZIP): entry "/etc/evil" has an absolute path; it may be meant to do harm"#);
    insta::assert_snapshot!(named("..\\evil.json"), @r#"not a usable show archive (ZIP): entry "..\\evil.json" has a backslash in its name; it may be meant to do harm"#);
    insta::assert_snapshot!(named("C:evil.json"), @r#"not a usable show archive (ZIP): entry "C:evil.json" has a colon in its name; it may be meant to do harm"#);
    insta::assert_snapshot!(named("show.json"), @"not a usable show archive (ZIP): two entries have the same name");

    let text =
        |bytes: &[u8], limits: Limits| skyc::read_with(bytes, limits).unwrap_err().to_string();
    let zeros = format!("{}{}", good, " ".repeat(30 << 20));
    let bomb = archive(&[("show.json", &zeros)]);
    assert!(bomb.len() < 100_000);
    insta::assert_snapshot!(text(&bomb, Limits::default()), @"show.json: it is compressed 1025:1; it may be a ZIP bomb");
    let limits = Limits { ratio: 10_000, entry_bytes: 1 << 20, ..Limits::default() };
    insta::assert_snapshot!(text(&bomb, limits), @"show.json: it unpacks to 31457399 bytes, more than 1048576");
    let limits = Limits { ratio: 10_000, total_bytes: 1 << 20, ..Limits::default() };
    insta::assert_snapshot!(text(&bomb, limits), @"the file unpacks to more than the 1048576 bytes allowed here; it may be a ZIP bomb");
    let limits = Limits { entries: 1, ..Limits::default() };
    insta::assert_snapshot!(text(&archive(&[("show.json", &good), ("b", "")]), limits), @"not a usable show archive (ZIP): it has 2 entries, more than the 1 allowed");
    let limits = Limits { values: 10, ..Limits::default() };
    insta::assert_snapshot!(text(&archive(&[("show.json", &good)]), limits), @"show.json: it has more than 10 JSON values");

    // The header promises fewer bytes than come out, or more.
    let size = |bytes: usize| u32::try_from(bytes).unwrap().to_le_bytes();
    let files = [("show.json", good.as_str())];
    for promised in [good.len() - 40, good.len() + 40] {
        let liar = patched(&files, &size(good.len()), &size(promised));
        let error = text(&liar, Limits::default());
        let refused = ["it does not unpack to the", "larger than its declared", "Invalid checksum"];
        assert!(refused.iter().any(|reason| error.contains(reason)), "{error}");
    }

    // One shared document, used by many drones, multiplies.
    let drones = vec![json!({"settings": {"trajectory": {"$ref": "t.json"}}}); 100];
    let show = json!({"version": 1, "swarm": {"drones": drones}}).to_string();
    let shared = archive(&[("show.json", &show), ("t.json", &with_points(&points()).to_string())]);
    let limits = Limits { points: 199, ..Limits::default() };
    insta::assert_snapshot!(text(&shared, limits), @"the file unpacks to more than the 199 trajectory points allowed here; it may be a ZIP bomb");
}

#[test]
fn refuses_to_write_what_others_cannot_read() {
    let text = |show: &Show| skyc::write(show).unwrap_err().to_string();
    let with = |segments| {
        let mut show = full_show();
        show.drones[1].trajectory.segments = segments;
        text(&show)
    };
    insta::assert_snapshot!(text(&Show::default()), @"cannot write the show: it has no drones");
    let many = Show { drones: vec![ShowDrone::default(); 5001], ..Show::default() };
    insta::assert_snapshot!(text(&many), @"cannot write the show: it has 5001 drones; the format allows 5000");
    insta::assert_snapshot!(with(vec![hold(5), septic(1000)]), @r#"cannot write drone 2 (Drone "2"): piece 2: it is a curve of 7th degree, which Live and Viewer cannot show; use cubic pieces"#);
    insta::assert_snapshot!(with(vec![hold(0)]), @r#"cannot write drone 2 (Drone "2"): piece 1: it lasts 0 ms; time must not stand still"#);
    insta::assert_snapshot!(with(vec![line(5, f64::NAN, 0.0, 0.0)]), @r#"cannot write drone 2 (Drone "2"): piece 1: the coordinates (NaN, 0, 0) m are absurd"#);
    let mut show = full_show();
    show.phases_s = Some([0.0, f64::INFINITY, 1.0]);
    insta::assert_snapshot!(text(&show), @"cannot write the show: a phase of the show is not a finite number");
}

#[test]
fn every_prefix_and_many_byte_flips_are_survived() {
    let bytes = skyc::write(&full_show()).unwrap();
    for end in 0..bytes.len() {
        assert!(skyc::read(&bytes[..end]).is_err(), "a prefix of {end} bytes");
    }
    for i in 0..bytes.len() {
        for bit in [0, 3, 7] {
            let mut flipped = bytes.clone();
            flipped[i] ^= 1 << bit;
            let _ = skyc::read(&flipped);
        }
    }
}

#[test]
fn broken_json_is_survived() {
    let show = full_show();
    let bytes = skyc::write(&show).unwrap();
    let mut zip = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut text = String::new();
    zip.by_name("drones/drone_02/trajectory.json").unwrap().read_to_string(&mut text).unwrap();
    let root = inline(&json!({"$ref": "t.json"})).to_string();
    let mut refused = 0;
    for i in 0..text.len() {
        for byte in [b'0', b'9', b'-', b'e', b',', b'[', b']', b'"', b' ', b'n'] {
            let mut broken = text.clone().into_bytes();
            broken[i] = byte;
            let broken = String::from_utf8(broken).unwrap();
            refused += usize::from(
                skyc::read(&archive(&[("show.json", &root), ("t.json", &broken)])).is_err(),
            );
        }
    }
    assert!(refused > 1000, "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_trajectory_comes_back_within_a_micrometre(trajectory in trajectory(false)) {
        let drone = ShowDrone { name: "d".into(), trajectory, ..ShowDrone::default() };
        let show = Show { drones: vec![drone], ..Show::default() };
        let read = skyc::read(&skyc::write(&show).unwrap()).unwrap();
        let (a, b) = (&show.drones[0].trajectory, &read.drones[0].trajectory);
        prop_assert_eq!(a.segments.len(), b.segments.len());
        for (a, b) in a.segments.iter().zip(&b.segments) {
            prop_assert_eq!(a.duration_ms, b.duration_ms);
        }
        for i in 0..=200 {
            let time_s = a.duration_ms() as f64 / 1000.0 * f64::from(i) / 200.0;
            let gap = a.state_at(time_s).position_m - b.state_at(time_s).position_m;
            prop_assert!(gap.amax() <= 1e-6, "{} at {time_s} s", gap);
        }
    }
}
