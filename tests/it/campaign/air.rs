//! From moving air through flights and logs to a map, and the truth beside it.

#![expect(clippy::unwrap_used, reason = "a test fails")]

use std::path::Path;
use std::process::{Command, Output};

use nalgebra::Vector3;
use updraft::analysis::result::{Analysis, UpdraftMap};
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::campaign::{FlightFolder, read_json};
use updraft::show::{Segment, SegmentPath as Shape, Trajectory};
use updraft::sim::air::truth::{HEADER, read, to_csv, write};
use updraft::sim::air::{Atmosphere, Sum, Uniform};

fn updraft(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_updraft"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

pub(super) fn run(arguments: &str, folder: &Path) {
    let output = updraft(&arguments.split_whitespace().collect::<Vec<_>>(), folder);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

fn hover_map(folder: &Path) -> UpdraftMap {
    let analysis: Analysis = read_json(&folder.join("c/analysis.json")).unwrap();
    analysis.flights.into_iter().find_map(|flight| flight.map).unwrap()
}

/// Pairs of estimate and truth over all drones and times.
fn pairs(map: &UpdraftMap) -> Vec<(f64, f64)> {
    map.drones
        .iter()
        .flat_map(|drone| {
            let truth = drone.truth_mps.clone().unwrap_or_default();
            drone.updraft_mps.clone().into_iter().zip(truth)
        })
        .filter_map(|(estimate, truth)| Some((estimate?, truth?)))
        .collect()
}

fn mean(values: impl Iterator<Item = f64> + Clone) -> f64 {
    values.clone().sum::<f64>() / values.count() as f64
}

#[test]
fn a_map_of_moving_air_is_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Small scales, so that four drones and two minutes see several eddies.
    let air = "--air uniform:up=1.2 --air field:sd=0.5,lambda=20,tau=30,wind=0";
    run(
        &format!(
            "run campaign --grid 2x2 --duration 120 {air} --calibration-air still --vehicle airsim-generic-quad --no-study -o c"
        ),
        folder,
    );
    let map = hover_map(folder);
    let pairs = pairs(&map);
    assert!(pairs.len() > 4 * 90, "{} pairs", pairs.len());
    let estimate_mean = mean(pairs.iter().map(|pair| pair.0));
    let truth_mean = mean(pairs.iter().map(|pair| pair.1));
    let product = |left: fn(&(f64, f64)) -> f64, right: fn(&(f64, f64)) -> f64| {
        let means = (estimate_mean, truth_mean);
        mean(pairs.iter().map(|pair| (left(pair) - left(&means)) * (right(pair) - right(&means))))
    };
    let (estimate, truth) = (|pair: &(f64, f64)| pair.0, |pair: &(f64, f64)| pair.1);
    let variance = product(truth, truth);
    let rho = product(estimate, truth) / (product(estimate, estimate) * variance).sqrt();
    let rms = mean(pairs.iter().map(|pair| (pair.0 - pair.1).powi(2))).sqrt();
    assert!(variance.sqrt() > 0.15, "the air hardly moves: {}", variance.sqrt());
    assert!(rho > 0.97 && rms < 0.08, "correlation {rho}, rms {rms} m/s");

    // The record says what was flown; the updraft is no single number.
    let hover = FlightFolder(folder.join("c/hover"));
    let record = hover.read_record().unwrap().unwrap();
    assert_eq!(record.air, ["field:sd=0.5,lambda=20,tau=30,wind=0"]);
    assert_eq!(record.air_mps, [0.0, 0.0, 1.2]);
    let calibration = FlightFolder(folder.join("c/calibration")).read_record().unwrap().unwrap();
    assert!(calibration.air.is_empty() && calibration.air_mps == [0.0; 3], "still air");

    // Other air needs --force, and takes the old truth away.
    let other = ["simulate", "c", "--flight", "hover", "--air", "field"];
    let refused = updraft(&other, folder);
    assert_eq!(refused.status.code(), Some(2));
    run("simulate c --flight hover --drones 1 --air drone-constant:sd=0.5 --force", folder);
    assert!(
        hover.simulated_log(1, 4).exists()
            && !hover.simulated_log(2, 4).exists()
            && !hover.truth(1, 4).exists()
    );
    // The truth of flown logs can be had later, and a broken file is named.
    run("simulate c --flight hover --drones 1 --air drone-constant:sd=0.5 --truth", folder);
    let truth = read(&hover.truth(1, 4)).unwrap();
    assert!(truth.updraft_mps.iter().all(|w| (w - truth.updraft_mps[0]).abs() < 1e-5));
    std::fs::write(hover.truth(1, 4), "nonsense\n").unwrap();
    let failed = updraft(&["analyze", "c"], folder);
    // The other flight is analysed all the same.
    let told = String::from_utf8_lossy(&failed.stdout).into_owned();
    assert!(failed.status.code() == Some(3) && told.contains("01.csv, line 1"), "{told}");
}

fn frame() -> ShowFrame {
    let origin = Geodetic { lat_deg: 47.4733, lon_deg: 19.0621, amsl_m: 190.0 };
    ShowFrame { origin, orientation_deg: 90.0 }
}

/// An updraft that grows with time and height.
struct Growing;

impl Atmosphere for Growing {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        Vector3::new(1.0, 0.0, 0.01 * time_s + 0.1 * position_m.z)
    }
}

#[test]
fn truth_files_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("truth/01.csv");
    let line = |height: f64, duration_ms| Segment {
        duration_ms,
        path: Shape::Line(Vector3::new(0.0, 0.0, height)),
    };
    let hold = Segment { duration_ms: 20_000, path: Shape::Hold };
    let segments = vec![line(30.0, 10_000), hold, line(2.5, 10_000)];
    let trajectory = Trajectory { start_m: Vector3::zeros(), segments };
    let sum = Sum(vec![Box::new(Growing), Box::new(Uniform(Vector3::new(0.0, 2.0, 0.0)))]);
    write(&path, &sum, &trajectory, 1, &frame()).unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, to_csv(&sum, &trajectory, 1, &frame()));
    // Show x points east and y north.
    assert_eq!(text.lines().nth(21), Some("20,0.000,0.000,30.000,1.00000,2.00000,3.20000,3.20000"));
    let truth = read(&path).unwrap();
    assert_eq!((truth.first_s, truth.updraft_mps.len()), (0, 41));
    // Mean over 5..15 s: 0.1 for the time; heights 15..30 m in the first half.
    assert!((truth.updraft_mps[10] - (0.1 + f64::midpoint(2.25, 3.0))).abs() < 1e-4, "{truth:?}");

    for (broken, told) in [
        ("a,b\n0,1\n".to_owned(), "line 1"),
        (format!("{HEADER}\n0,0,0,0,0,0,0,0\n1,0,0,0\n"), "line 3: 4 values"),
        (format!("{HEADER}\n0,0,0,0,0,0,0,NaN\n"), "line 2: \"NaN\""),
        (format!("{HEADER}\n0.5,0,0,0,0,0,0,0\n"), "line 2: \"0.5\""),
        (format!("{HEADER}\n0,0,0,0,0,0,0,0\n2,0,0,0,0,0,0,0\n"), "line 3: second 2"),
        (format!("{HEADER}\n9223372036854775807,0,0,0,0,0,0,0\n0,0,0,0,0,0,0,0\n"), "line 3"),
    ] {
        std::fs::write(&path, broken).unwrap();
        let error = read(&path).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    }
}
