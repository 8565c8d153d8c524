//! `updraft check`: the same verdict for a campaign and its files, and every file held to the plan.

use std::fs;
use std::path::Path;

use crate::cli::support::{Bench, Ended, SHORT};

fn shipped(name: &str) -> String {
    format!("{}/shows/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (path, name) = entry.map(|entry| (entry.path(), entry.file_name())).unwrap();
        if path.is_dir() {
            copy(&path, &to.join(name));
        } else {
            fs::copy(&path, to.join(name)).unwrap();
        }
    }
}

#[test]
fn a_campaign_and_its_files_get_the_same_verdict() {
    let bench = Bench::new();
    let folder = shipped("calibration-counterphase");
    for file in ["", "/show.skyc", "/show.csv.zip", "/skyb", "/skyb/07.skyb"] {
        let ended = bench.expect(0, &["check", &format!("{folder}{file}")]);
        assert!(ended.out.contains("loosened to 6.5 m/s; the vehicle's own is 4 m/s"), "{ended}");
        assert_eq!(
            ended.out.contains("limits and fence are those of "),
            !file.is_empty(),
            "{ended}"
        );
    }
    // Away from its folder, the .skyc still knows its limits.
    fs::copy(format!("{folder}/show.skyc"), bench.path("alone.skyc")).unwrap();
    let alone = bench.expect(0, &["check", "alone.skyc"]);
    assert!(alone.out.contains("loosened to 6.5 m/s"), "{alone}");
    // A binary show says nothing about limits: the vehicle's hold.
    fs::copy(format!("{folder}/skyb/07.skyb"), bench.path("07.skyb")).unwrap();
    let alone = bench.expect(4, &["check", "07.skyb"]);
    assert!(alone.out.contains("error[velocity-step]"), "{alone}");
    assert!(alone.out.contains("note: no fence in this show"), "{alone}");
}

#[test]
fn allowed_errors_are_not_called_safe() {
    let bench = Bench::new();
    fs::copy(shipped("calibration-counterphase/skyb/07.skyb"), bench.path("07.skyb")).unwrap();
    let args = ["check", "07.skyb", "--allow", "velocity-step"];
    let ended = bench.expect(0, &args);
    let verdict = "Safe apart from 4 allowed findings (velocity-step: 4): checked in ";
    assert!(ended.err.starts_with(verdict), "{ended}");
    let value = bench.expect(0, &[&args[..], &["--json"]].concat()).json("updraft.check/1");
    assert_eq!(value["safe"], false);
    assert_eq!(value["passed"], true);
    assert_eq!(value["allowed"]["velocity-step"], 4);

    let near = ["plan", "calibration", "--grid", "1x2", "--spacing", "1", "-o", "near"];
    let planned = bench.expect(0, &[&near[..], SHORT, &["--allow", "distance"]].concat());
    assert!(planned.err.contains("Safe apart from 1 allowed finding (distance: 1)"), "{planned}");
}

/// Changes the first folder, perhaps with files of the second.
type Change = fn(&Path, &Path);

/// Each change to a campaign's files, and what the check says about it.
#[test]
fn every_file_of_a_campaign_is_held_to_the_plan() {
    let bench = Bench::new();
    bench.plan();
    let other = ["plan", "calibration", "--grid", "1x2", "--speeds", "1,3", "-o", "other"];
    bench.expect(0, &[&other[..], &["--leg", "6", "--hover", "4", "--baseline", "10"]].concat());
    bench.expect(0, &["check", "campaign"]);
    let changes: [(&str, &str, Change); 9] = [
        ("stray", "skyb/03.skyb belongs to no slot of the plan", |here, _| {
            fs::copy(here.join("skyb/01.skyb"), here.join("skyb/03.skyb")).unwrap();
        }),
        ("named", "skyb/1.SKYB belongs to no slot of the plan", |here, _| {
            fs::copy(here.join("skyb/01.skyb"), here.join("skyb/1.SKYB")).unwrap();
        }),
        ("gone", "skyb/02.skyb is missing", |here, _| {
            fs::remove_file(here.join("skyb/02.skyb")).unwrap();
        }),
        ("csv", "show.csv.zip: Drone 1 does not fly the plan: ", |here, other| {
            fs::copy(other.join("show.csv.zip"), here.join("show.csv.zip")).unwrap();
        }),
        ("skyc", "show.skyc: Drone 1 does not fly the plan: ", |here, other| {
            fs::copy(other.join("show.skyc"), here.join("show.skyc")).unwrap();
        }),
        ("crc", "cannot be unpacked: Invalid checksum", |here, _| {
            damage(&here.join("show.skyc"), b"lights.json");
        }),
        ("no-csv", "show.csv.zip is missing", |here, _| {
            fs::remove_file(here.join("show.csv.zip")).unwrap();
        }),
        ("no-vehicle", "vehicle.toml is missing", |here, _| {
            fs::remove_file(here.join("vehicle.toml")).unwrap();
        }),
        ("plan", "plan.json is not valid", |here, _| {
            fs::write(here.join("plan.json"), "{}").unwrap();
        }),
    ];
    for (name, said, change) in changes {
        let folder = bench.path(name);
        copy(&bench.path("campaign"), &folder);
        change(&folder, &bench.path("other"));
        let ended = bench.expect(4, &["check", name]);
        let errors: Vec<_> = ended.out.lines().filter(|line| line.starts_with("error: ")).collect();
        assert!(errors.iter().any(|line| line.contains(said)), "{name}: {said}\n{ended}");
        assert!(ended.err.starts_with("Not safe"), "{ended}");
        let quiet = bench.expect(4, &["check", name, "--quiet"]);
        assert_eq!(quiet.out, "", "{quiet}");
        assert!(quiet.err.contains(said), "{quiet}");
        let value = bench.expect(4, &["check", name, "--json"]).json("updraft.check/1");
        assert_eq!(value["safe"], false);
        assert!(value["shows"][0]["mismatches"].to_string().contains(said), "{value}");
    }
}

/// Changes one byte of the content of the first entry with this in its name, not of its head.
fn damage(path: &Path, name: &[u8]) {
    let mut bytes = fs::read(path).unwrap();
    let at = bytes.windows(name.len()).position(|window| window == name).unwrap();
    // The checksum in the entry's head and in the directory stay as they were.
    let inside = at + name.len() + 12;
    bytes[inside] ^= 0x04;
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_flight_that_is_gone_is_named() {
    let bench = Bench::new();
    let args = ["plan", "campaign", "--grid", "1x1", "--duration", "60", "-o", "both"];
    bench.expect(0, &[&args[..], SHORT].concat());
    fs::remove_dir_all(bench.path("both/hover")).unwrap();
    let ended = bench.expect(4, &["check", "both"]);
    assert!(ended.out.contains("error: both/hover/plan.json is missing"), "{ended}");
    assert!(ended.out.contains("both/calibration\n"), "the other flight is checked: {ended}");
}

#[test]
fn a_flood_of_findings_is_one_line_but_can_be_had() {
    let bench = Bench::new();
    let args = ["plan", "calibration", "--grid", "2x10", "--spacing", "1", "-o", "near"];
    bench.expect(0, &[&args[..], SHORT, &["--allow", "distance"]].concat());
    let lines = |ended: &Ended| ended.out.matches("error[distance]").count();
    let few = bench.expect(4, &["check", "near"]);
    assert_eq!(lines(&few), 1, "{few}");
    assert!(few.out.contains("error[distance] drones 1-20, "), "{few}");
    assert!(few.out.contains("(--verbose lists every finding)"), "{few}");
    let all = bench.expect(4, &["check", "near", "--verbose"]);
    assert!(lines(&all) > 20, "{all}");
    assert!(!all.out.contains(": and "), "{all}");
    let value = bench.expect(4, &["check", "near", "--json"]).json("updraft.check/1");
    let findings = value["shows"][0]["report"]["findings"].as_array().unwrap();
    assert_eq!(findings.iter().filter(|f| f["check"] == "distance").count(), lines(&all));
}
