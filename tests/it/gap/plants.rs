//! One plant's logs against another's: the firmware's own simulator as it is, and with a drag that is a plain square.

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::cli::support::Bench;
use updraft::base::digest::sha256;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("crates/dataflash/tests/data").join(name)
}

#[test]
fn what_two_plants_differ_in_is_named_though_it_is_several_things() {
    let bench = Bench::new();
    let (measured, simulated) =
        (fixture("ladder-still.trimmed.BIN"), fixture("square-law-ladder.trimmed.BIN"));
    let (measured, simulated) = (measured.to_str().unwrap(), simulated.to_str().unwrap());
    let args = ["gap", "--measured", measured, "--simulated", simulated, "--json", "-o", "gap"];
    let verdict = &bench.expect(0, &args).json("updraft.gap/1")["verdict"];
    let steps = verdict["steps"].as_array().unwrap();
    let of = |step: &Value| (step["finding"]["kind"].clone(), step["finding"].clone());
    let found: Vec<(Value, Value)> = steps.iter().map(of).collect();
    assert_eq!(found.len(), 2, "{verdict}");
    // Its body drags by (8/15.08)² of the square plant's; the thrust curve adds nothing beside that in steady climbs.
    let names: Vec<(Option<&str>, Option<&str>)> =
        found.iter().map(|(kind, finding)| (kind.as_str(), finding["effect"].as_str())).collect();
    assert_eq!(names, [(Some("name"), Some("face-drag")), (Some("name"), Some("momentum-drag"))]);
    // What the model that stands for the square plant has of it is read from that plant's logs, and in no file.
    let body = &found[0].1;
    assert_eq!(
        (&body["was_there"], &body["parameters"][0]["before"]),
        (&Value::from(false), &Value::Null)
    );
    assert!(!verdict["summary"].to_string().contains("the model had"), "{verdict}");
    assert!(
        verdict["cautions"].to_string().contains("answer climbs as the model does with face-drag.")
    );
    let page = std::fs::read_to_string(bench.path("gap/report/index.html")).unwrap();
    for log in [&args[2], &args[4]] {
        let sha256 = sha256(&std::fs::read(log).unwrap());
        assert!(page.contains(&sha256), "the page has the hash of {log}");
    }
    let (_, name) = &found[1];
    // The frame has 0.2 1/s.
    let value = &name["parameters"][0]["value"];
    let ends = ["low", "high"].map(|end| value[end].as_f64().unwrap());
    assert!(ends[0] > 0.1 && ends[1] < 0.4, "{value}");
    let gap = &verdict["gap"]["rungs"];
    let us = |side: &str| gap[side]["value"].as_f64().unwrap();
    assert!(us("after_us") < 0.1 * us("before_us"), "{gap}");
}

#[test]
fn two_flights_of_the_firmware_in_still_air_and_in_wind_name_what_both_have() {
    let bench = Bench::new();
    let logs = bench.path("logs");
    std::fs::create_dir(&logs).unwrap();
    for name in ["ladder-still.trimmed.BIN", "ladder-wind5.trimmed.BIN"] {
        std::fs::copy(fixture(name), logs.join(name)).unwrap();
    }
    let simulated = fixture("square-law-ladder.trimmed.BIN");
    let args = [
        "gap",
        "--measured",
        "logs",
        "--simulated",
        simulated.to_str().unwrap(),
        "-o",
        "gap",
        "--json",
    ];
    let verdict = &bench.expect(0, &args).json("updraft.gap/1")["verdict"];
    assert_eq!(verdict["data"]["groups"].to_string(), r#"[["flight 1",1],["flight 2",1]]"#);
    let steps = verdict["steps"].as_array().unwrap();
    let named: Vec<Option<&str>> =
        steps.iter().map(|step| step["finding"]["effect"].as_str()).collect();
    assert_eq!(named, [Some("face-drag"), Some("momentum-drag")], "{verdict}");
    // The wind that only one flight had explains none of it.
    let cautions = verdict["cautions"].to_string();
    assert!(cautions.contains("the measured logs are of 2 flights"), "{cautions}");
    assert!(cautions.contains("flew in different wind"), "{cautions}");
    let summary = verdict["summary"].as_str().unwrap();
    assert!(
        summary.contains("differ in thrust-curve as well (MOT_THST_EXPO 0 and 0.500)"),
        "{summary}"
    );
    let gap = &verdict["gap"]["rungs"];
    let us = |side: &str| gap[side].as_f64().unwrap();
    assert!(us("after_without_air_us") < 0.1 * us("before_without_air_us"), "{gap}");
}
