//! `updraft analyze` with what a field day brings: a flight that was not flown, one drone, columns without
//! numbers, two boots in one log, clocks an hour apart, logs of another plan. Each is said, and what can
//! still be had is.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use insta::assert_snapshot;

use crate::cli::support::{Bench, Ended};

/// A ladder of two rungs and a hover of 40 s, flown by two drones in air that rises at
/// 1 m/s everywhere; flown once for all tests.
pub(crate) fn campaign() -> Bench {
    static FLOWN: OnceLock<Bench> = OnceLock::new();
    let flown = FLOWN.get_or_init(|| {
        let bench = Bench::new();
        fly(&bench, "campaign", "1x2");
        bench
    });
    let bench = Bench::new();
    for flight in ["calibration", "hover"] {
        let (from, to) = (flown.path("campaign").join(flight), bench.path("campaign").join(flight));
        fs::create_dir_all(to.join("simulated")).unwrap();
        for file in ["plan.json", "vehicle.toml", "simulated/01.BIN", "simulated/02.BIN"] {
            fs::copy(from.join(file), to.join(file)).unwrap();
        }
    }
    fs::copy(flown.path("campaign/campaign.json"), bench.path("campaign/campaign.json")).unwrap();
    bench
}

pub(crate) fn fly(bench: &Bench, folder: &str, grid: &str) {
    let run = ["run", "--direct", "--no-study", "--quiet", "--air", "still", "-o", folder];
    let small = ["--grid", grid, "--duration", "40", "--height", "30", "--speeds", "1,2"];
    let legs = ["--leg", "15", "--hover", "6"];
    bench.expect(0, &[&run[..], &small, &legs].concat());
}

/// What is said beside the numbers: heads, lists and standard error, without times.
pub(crate) fn said(ended: &Ended) -> String {
    let mut told = String::new();
    let mut in_list = false;
    for line in ended.out.lines() {
        let heading = line.trim_start();
        let list = ["Drones without", "Logs not", "Logs partly", "Warnings", "No measurement"];
        let starts = list.iter().any(|words| heading.starts_with(words));
        in_list = starts || (in_list && !line.is_empty());
        let law = ["signed", "linear"].iter().any(|words| heading.starts_with(words));
        let head = !line.starts_with(' ') && !line.is_empty();
        let counts = heading.contains(" used, ") || heading.starts_with("vertical air speed");
        let boots = heading.contains("boots") || heading.contains("show began");
        if !law && (in_list || head || counts || boots) {
            told.push_str(line);
            told.push('\n');
        }
    }
    told.push_str("-- err\n");
    for line in ended.err.lines() {
        let timed = line.contains("Analysed");
        told.push_str(if timed { line.split(" in ").next().unwrap_or_default() } else { line });
        told.push('\n');
    }
    told
}

fn analyze(bench: &Bench, code: i32) -> String {
    said(&bench.expect(code, &["analyze", "campaign", "--no-report"]))
}

/// Mean of the map over one drone, m/s.
fn mean_mps(bench: &Bench, code: i32, name: &str) -> f64 {
    let args = ["analyze", "campaign", "--no-report", "--json", "--quiet"];
    let value = bench.expect(code, &args).json("updraft.analyze/1");
    let drones = value["analysis"]["flights"][1]["map"]["drones"].as_array().unwrap();
    let drone = drones.iter().find(|drone| drone["name"] == name).unwrap();
    drone["mean"]["value"].as_f64().unwrap()
}

/// Bytes of a field in a message, by its letter.
fn size(letter: u8) -> usize {
    match letter {
        b'b' | b'B' | b'M' => 1,
        b'h' | b'H' | b'c' | b'C' => 2,
        b'i' | b'I' | b'f' | b'n' | b'e' | b'E' | b'L' => 4,
        b'q' | b'Q' | b'd' => 8,
        b'N' => 16,
        _ => 64,
    }
}

/// Changes a field in every message of one name: (row, bytes of the field).
pub(crate) fn patch(path: &Path, message: &str, field: &str, change: impl Fn(usize, &mut [u8])) {
    let mut bytes = fs::read(path).unwrap();
    let mut lengths = [0_usize; 256];
    let mut wanted: Option<(u8, usize, usize)> = None;
    lengths[128] = 89;
    let (mut at, mut row) = (0, 0);
    while at + 3 <= bytes.len() {
        let kind = bytes[at + 2];
        let length = lengths[usize::from(kind)];
        if kind == 128 {
            let text = |range: std::ops::Range<usize>| {
                String::from_utf8_lossy(&bytes[at + range.start..at + range.end])
                    .trim_end_matches('\0')
                    .to_owned()
            };
            lengths[usize::from(bytes[at + 3])] = usize::from(bytes[at + 4]);
            if text(5..9) == message {
                let labels = text(25..89);
                let letters = text(9..25).into_bytes();
                let index = labels.split(',').position(|label| label == field).unwrap();
                let offset: usize = letters[..index].iter().map(|letter| size(*letter)).sum();
                wanted = Some((bytes[at + 3], 3 + offset, size(letters[index])));
            }
        } else if let Some((_, offset, length)) = wanted.filter(|(known, ..)| *known == kind) {
            change(row, &mut bytes[at + offset..at + offset + length]);
            row += 1;
        }
        at += length;
    }
    assert!(row > 0, "{message}.{field}");
    fs::write(path, bytes).unwrap();
}

/// Another value for a field of four bytes.
pub(crate) fn all(value: f32) -> impl Fn(usize, &mut [u8]) {
    move |_, field| field.copy_from_slice(&value.to_le_bytes())
}

#[test]
fn a_campaign_without_its_hover_gives_laws() {
    let bench = campaign();
    fs::remove_dir_all(bench.path("campaign/hover/simulated")).unwrap();
    assert_snapshot!(analyze(&bench, 3));
    fs::remove_dir_all(bench.path("campaign/hover")).unwrap();
    assert_snapshot!(analyze(&bench, 3));
    // A calibration alone was all that was asked for.
    let alone = bench.expect(0, &["analyze", "campaign/calibration", "--no-report"]);
    assert!(alone.out.contains("No measurement flight: there are laws"), "{alone}");
    fs::remove_file(bench.path("campaign/calibration/plan.json")).unwrap();
    let none = bench.expect(1, &["analyze", "campaign", "--no-report"]);
    assert!(none.err.contains("campaign/calibration/plan.json"), "{none}");
}

#[test]
fn one_drone_is_no_fleet_and_still_measures() {
    let bench = campaign();
    for flight in ["calibration", "hover"] {
        fs::remove_file(bench.path("campaign").join(flight).join("simulated/02.BIN")).unwrap();
    }
    assert_snapshot!(analyze(&bench, 3));
    assert!((mean_mps(&bench, 3, "Drone 1") - 1.0).abs() < 0.1);
}

#[test]
fn empty_logs_cost_their_drones() {
    let bench = campaign();
    fs::write(bench.path("campaign/hover/simulated/01.BIN"), b"").unwrap();
    assert_snapshot!(analyze(&bench, 3));
    fs::write(bench.path("campaign/hover/simulated/02.BIN"), b"").unwrap();
    assert_snapshot!(analyze(&bench, 3));
    for log in ["01.BIN", "02.BIN"] {
        fs::write(bench.path("campaign/calibration/simulated").join(log), b"").unwrap();
    }
    assert_snapshot!(analyze(&bench, 5));
}

#[test]
fn columns_without_numbers_are_named() {
    let clean = mean_mps(&campaign(), 0, "Drone 1");
    let one = "campaign/hover/simulated/01.BIN";
    for (column, value) in [("VD", f32::NAN), ("VD", f32::INFINITY), ("PD", f32::NEG_INFINITY)] {
        let bench = campaign();
        patch(&bench.path(one), "XKF1", column, all(value));
        let told = analyze(&bench, 3);
        assert!(told.contains(&format!("XKF1.{column} in the log holds not one number")), "{told}");
        assert!(told.contains("hover, measurement: 1 of 2 drones"), "{told}");
    }
    // What is not needed, or has another source, is not missed.
    for (message, column) in
        [("XKF1", "PN"), ("GUIP", "vZ"), ("PSCD", "DVD"), ("BAT", "VoltR"), ("PARM", "Value")]
    {
        let bench = campaign();
        patch(&bench.path(one), message, column, all(f32::NAN));
        let found = mean_mps(&bench, 0, "Drone 1");
        assert!((found - clean).abs() < 0.02, "{message}.{column}: {found}, not {clean}");
    }
    // Without its parameters a log of the show firmware does not say what its commands were scaled by.
    let bench = campaign();
    patch(&bench.path("campaign/calibration/simulated/01.BIN"), "PARM", "Value", all(f32::NAN));
    assert!((mean_mps(&bench, 0, "Drone 1") - clean).abs() < 0.02);
}

#[test]
fn a_stretch_without_numbers_costs_its_windows() {
    let bench = campaign();
    let stretch = |from: usize, to: usize| {
        move |row: usize, field: &mut [u8]| {
            if (from..to).contains(&row) {
                field.copy_from_slice(&f32::NAN.to_le_bytes());
            }
        }
    };
    patch(&bench.path("campaign/calibration/simulated/02.BIN"), "XKF1", "VD", stretch(400, 700));
    patch(&bench.path("campaign/hover/simulated/01.BIN"), "XKF1", "VD", stretch(400, 440));
    let ended = bench.expect(0, &["analyze", "campaign", "--no-report"]);
    for words in [
        "slot 2: 3 windows gap in the log",
        "slot 2: velocity: no data for 30.1 s of the flight",
        "slot 1: velocity: no data for 4.1 s of the flight",
    ] {
        assert!(ended.out.contains(words), "{words}\n{ended}");
    }
}

#[test]
fn of_two_boots_the_one_that_flew_the_plan_is_taken() {
    let whole = campaign();
    let clean = mean_mps(&whole, 0, "Drone 1");
    let log = |flight: &str| {
        fs::read(whole.path("campaign").join(flight).join("simulated/01.BIN")).unwrap()
    };
    let (ladder, hover) = (log("calibration"), log("hover"));
    for both in [[&ladder[..], &hover].concat(), [&hover[..], &ladder].concat()] {
        let bench = campaign();
        for flight in ["calibration", "hover"] {
            fs::write(bench.path("campaign").join(flight).join("simulated/01.BIN"), &both).unwrap();
        }
        assert!((mean_mps(&bench, 0, "Drone 1") - clean).abs() < 1e-9);
        let told = analyze(&bench, 0);
        let told: Vec<&str> = told.split_whitespace().collect();
        let told = told.join(" ");
        let words = "the log holds 2 boots of the autopilot; the ";
        // In one of the two flights it is the one that is taken without being asked.
        for which in ["one that flew the plan is analysed: the", "last (number 2) is analysed"] {
            assert!(told.contains(&format!("{words}{which}")), "{which}: {told}");
        }
    }
}

#[test]
fn a_drone_that_flew_at_another_hour_is_not_in_the_map() {
    let bench = Bench::new();
    fly(&bench, "campaign", "1x3");
    let later = |path: &str, ms: i64| {
        patch(&bench.path(path), "GPS", "GMS", |_, field| {
            let now = u32::from_le_bytes([field[0], field[1], field[2], field[3]]);
            let then = u32::try_from(i64::from(now) + ms).unwrap();
            field.copy_from_slice(&then.to_le_bytes());
        });
    };
    later("campaign/hover/simulated/03.BIN", 3_600_000);
    later("campaign/calibration/simulated/01.BIN", -3_600_000);
    let ended = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    let told: Vec<&str> =
        ended.out.lines().skip_while(|l| !l.contains("show began")).take(3).collect();
    assert!(ended.out.contains("Drone 1: its show began 3600 s earlier"), "{ended}");
    assert!(ended.out.contains("slot 3: its show began 3600 s later"), "{ended}");
    let words = ended.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("s.d. between 2 drones"), "{ended}");
    assert_snapshot!(told.join("\n"));

    // The same by the show's own clock: its plan would have been flown an hour before its log begins.
    let bench = Bench::new();
    fly(&bench, "campaign", "1x3");
    patch(&bench.path("campaign/hover/simulated/02.BIN"), "SHOW", "ClockMS", |_, field| {
        let now = i32::from_le_bytes([field[0], field[1], field[2], field[3]]);
        field.copy_from_slice(&(now - 3_600_000).to_le_bytes());
    });
    let ended = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    assert!(ended.out.contains("slot 2: its show began 3600 s later"), "{ended}");
}

#[test]
fn logs_in_the_folder_of_another_flight_are_refused() {
    let bench = campaign();
    let path =
        |flight: &str, log: &str| bench.path("campaign").join(flight).join("simulated").join(log);
    let swap = |log: &str| {
        let held = fs::read(path("hover", log)).unwrap();
        fs::copy(path("calibration", log), path("hover", log)).unwrap();
        fs::write(path("calibration", log), held).unwrap();
    };
    swap("01.BIN");
    assert_snapshot!(analyze(&bench, 3));
    swap("02.BIN");
    assert_snapshot!(analyze(&bench, 5));
}

#[test]
fn logs_of_another_ladder_are_refused() {
    let bench = campaign();
    let other = Bench::new();
    let run = ["run", "--direct", "--no-study", "--quiet", "--air", "still", "-o", "campaign"];
    let small = ["--grid", "1x2", "--duration", "40", "--height", "30", "--speeds", "0.5,1.5,1"];
    other.expect(0, &[&run[..], &small, &["--leg", "20", "--hover", "6"]].concat());
    for log in ["01.BIN", "02.BIN"] {
        let below = format!("campaign/calibration/simulated/{log}");
        fs::copy(other.path(&below), bench.path(&below)).unwrap();
    }
    assert_snapshot!(analyze(&bench, 5));
}
