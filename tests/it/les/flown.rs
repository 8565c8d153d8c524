//! Drones in the sample: truth files are the field, the map of w is the truth, and Python reads the same.

use std::fs;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

use updraft::analysis::result::Analysis;
use updraft::base::digest::sha256;
use updraft::campaign::{FlightFolder, read_json};

use super::sample::{As, FIRST_S, Field, PALM, write};

/// Wind along x and y, m/s: a cell between two outputs at most.
const WIND_MPS: [f64; 2] = [1.0, 0.25];

fn updraft(arguments: &str, folder: &Path) {
    let output = Command::new(env!("CARGO_BIN_EXE_updraft"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}

/// Rows of a truth file: second, place, motion towards east, north and up.
fn truth(path: &Path) -> Vec<[f64; 7]> {
    let text = fs::read_to_string(path).unwrap();
    text.lines()
        .skip(1)
        .map(|line| {
            let fields: Vec<f64> = line.split(',').map(|field| field.parse().unwrap()).collect();
            fields[..7].try_into().unwrap()
        })
        .collect()
}

/// Correlation of pairs.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let number = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / number;
    let (one, other) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let sum = |of: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>();
    let product = sum(&|pair| (pair.0 - one) * (pair.1 - other));
    product / (sum(&|pair| (pair.0 - one).powi(2)) * sum(&|pair| (pair.1 - other).powi(2))).sqrt()
}

#[test]
fn a_map_flown_in_a_models_air_is_the_models_air() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let field = Field::drawn(5, 0.6, WIND_MPS);
    let after_s: Vec<f64> = (0..34).map(|index| 8.0 * f64::from(index)).collect();
    write(&field, As::new(&PALM, &after_s), &folder.join("les.nc"));
    updraft(
        "run campaign --grid 2x2 --spacing 25 --duration 100 --height 60 --air les:les.nc --calibration-air still \
         --vehicle airsim-generic-quad --no-study --direct -o c",
        folder,
    );
    let hover = FlightFolder(folder.join("c/hover"));
    let plan = hover.read_plan().unwrap();
    // Truth: the field, but for what linear interpolation takes from waves of some cells.
    let (mut squares, mut all, mut rows) = (0.0, 0.0, 0.0);
    for slot in 1..=4 {
        for [time_s, x, y, z, east, _, up] in truth(&hover.truth(slot, 4)) {
            if z < 10.0 {
                continue;
            }
            // Show x is towards north, the model's x towards east; the show stands in the middle of the points of w.
            let at = [160.0 - y, 160.0 + x, z];
            let is = [field.at(0, at, time_s), field.at(2, at, time_s)];
            squares += (east - is[0]).powi(2) + (up - is[1]).powi(2);
            all += (is[0] - WIND_MPS[0]).powi(2) + is[1].powi(2);
            rows += 1.0;
        }
    }
    assert!(rows > 4.0 * 100.0);
    let share = squares / all;
    // A tenth of the variance: waves of 26 to 160 m on points every 10 m, 8 s apart.
    assert!(share < 0.1, "{share} of the variance is off");

    let analysis: Analysis = read_json(&folder.join("c/analysis.json")).unwrap();
    let map = analysis.flights.into_iter().find_map(|flight| flight.map).unwrap();
    let pairs: Vec<(f64, f64)> = map
        .drones
        .iter()
        .flat_map(|drone| {
            let truth = drone.truth_mps.clone().unwrap();
            drone.updraft_mps.clone().into_iter().zip(truth)
        })
        .filter_map(|(estimate, truth)| Some((estimate?, truth?)))
        .collect();
    let rho = correlation(&pairs);
    assert!(pairs.len() > 4 * 70 && rho > 0.95, "{} values, correlation {rho}", pairs.len());

    // The record names the file.
    let record = hover.read_record().unwrap().unwrap();
    let bytes = fs::read(folder.join("les.nc")).unwrap();
    assert_eq!(record.air, ["les:les.nc"]);
    assert_eq!(record.air_files[0].sha256, sha256(&bytes));
    assert_eq!(record.air_files[0].bytes, bytes.len() as u64);
    let page = fs::read_to_string(folder.join("c/report/index.html")).unwrap();
    assert!(page.contains("les.nc") && page.contains(&sha256(&bytes)), "the report names it, too");
    outside(folder, &hover);

    // The same flight in a file that has changed is another one.
    let other = Field::drawn(6, 0.6, WIND_MPS);
    write(&other, As::new(&PALM, &after_s), &folder.join("les.nc"));
    let output = Command::new(env!("CARGO_BIN_EXE_updraft"))
        .args(["simulate", "c", "--flight", "hover", "--air", "les:les.nc", "--truth"])
        .current_dir(folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("other settings"), "{said}");
    assert_eq!(plan.slots.len(), 4);
}

/// The sample and the truth by other programs: xarray's interpolation, and the spectrum and divergence by numpy.
fn outside(folder: &Path, hover: &FlightFolder) {
    let modules = "import numpy, scipy, xarray, netCDF4";
    let there = Command::new("python3").args(["-c", modules]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: Python lacks one of numpy, scipy, xarray, netCDF4 for tests/it/les; pip install it"
        );
        return;
    }
    let output = Command::new("python3")
        .args(["-c", include_str!("outside.py")])
        .args([folder.join("les.nc"), hover.truth(3, 4)])
        .arg(FIRST_S.to_string())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    let numbers: Vec<f64> = said.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let [worst_mps, slope, divergence] = numbers[..] else { panic!("{said}") };
    // The truth has five digits, and places to a millimetre.
    assert!(worst_mps < 1e-4, "xarray interpolates {worst_mps} m/s off");
    assert!((slope + 5.0 / 3.0).abs() < 0.25, "spectrum k^{slope}");
    assert!(divergence < 1e-5, "divergence is {divergence} of the gradients");
}
