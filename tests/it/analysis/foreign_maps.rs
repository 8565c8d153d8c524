//! Maps of campaigns in foreign worlds, against the true air and the best linear estimate of who knows its covariances.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::collections::BTreeMap;

use updraft::analysis::TruthSeries;
use updraft::analysis::budget::TruthCheck;
use updraft::analysis::result::UpdraftMap;
use updraft::blind::worlds::maps;
use updraft::campaign;
use updraft::mission::resolve::Override;
use updraft::workflow::analyze::{Analysing, Settings};
use updraft::workflow::find::{Work, find};
use updraft::workflow::host::Quiet;
use updraft::workflow::{mission, plan};

/// The true air over each slot, by second.
type Truth = BTreeMap<u16, TruthSeries>;

/// What one campaign of `side` by `side` drones gave: the map by each second alone, and the posterior.
fn flown(template: &str, side: i64, own: Override, kind: &str, seed: u64) -> [TruthCheck; 2] {
    let (map, _) = mapped(template, side, own, kind, seed);
    [map.truth.unwrap(), map.posterior.unwrap().truth.unwrap()]
}

/// The map of one campaign of `side` by `side` drones, and the true air.
fn mapped(template: &str, side: i64, own: Override, kind: &str, seed: u64) -> (UpdraftMap, Truth) {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join(kind);
    let overrides = [
        Override::new("vehicle", "pixel"),
        Override::new("grid.rows", side),
        Override::new("grid.columns", side),
        Override::new("grid.spacing_m", 10.0),
        own,
    ];
    let host = Quiet::default();
    let planned = mission::resolve(template, &overrides).unwrap();
    plan::write(&host, &planned, &plan::shows(&planned), &root, false).unwrap();
    let truth = maps::fly(&campaign::flights(&root).unwrap(), kind, seed, None, None).unwrap();
    let mut work = Work::new(&root);
    find(&root, None, &mut work).unwrap();
    let hover = work.flights.last_mut().unwrap();
    hover.truth.clone_from(&truth.updraft);
    hover.true_air = Some(truth.air);
    let settings = Settings::default();
    let analysing = Analysing::begin(&host, &work, &settings, None).unwrap();
    let analysed = analysing.run(false).unwrap();
    let map = analysed.analysis.flights.last().unwrap().map.clone().unwrap();
    (map, truth.updraft)
}

/// Slope of the values of each second against the true air.
fn slope(map: &UpdraftMap, truth: &Truth) -> f64 {
    let of_drone = |slot: Option<u16>, values: &[Option<f64>]| -> Vec<[f64; 2]> {
        let Some(truth) = slot.and_then(|slot| truth.get(&slot)) else { return Vec::new() };
        let of = |(time_s, value): (&f64, &Option<f64>)| {
            Some([truth.at_second(*time_s as i64)?, (*value)?])
        };
        map.time_s.iter().zip(values).filter_map(of).collect()
    };
    let all: Vec<[f64; 2]> =
        map.drones.iter().flat_map(|drone| of_drone(drone.slot, &drone.updraft_mps)).collect();
    let mean = |axis: usize| all.iter().map(|one| one[axis]).sum::<f64>() / all.len() as f64;
    let middle = [mean(0), mean(1)];
    let product = |axis: usize| -> f64 {
        all.iter().map(|one| (one[0] - middle[0]) * (one[axis] - middle[axis])).sum()
    };
    product(1) / product(0)
}

#[test]
fn the_posterior_is_near_the_best_linear_estimate() {
    let mut sums = [0.0; 4];
    let mut inside = Vec::new();
    let mut off_squared = Vec::new();
    let first = [("field", 1701), ("gusty", 1801), ("advected", 1901)];
    // A zero counts once for all values of its campaign, and in the first two of them it is so far off that who knows
    // everything is off by 0.6 m/s as well: three campaigns say little of intervals.
    let more = first.into_iter().flat_map(|(kind, seed)| [1, 2].map(|next| (kind, seed + next)));
    for (index, (kind, seed)) in first.into_iter().chain(more).enumerate() {
        let hover_s = Override::new("duration_s", 180.0);
        let [plain, posterior] = flown("campaign", 4, hover_s, kind, seed);
        let (limit, at_limit) =
            (posterior.limit_rms_mps.unwrap(), posterior.at_limit_rms_mps.unwrap());
        println!(
            "{kind}: each second alone {:.3} m/s, posterior {:.3} (rest {:.3}), {:.0} % inside; limit {limit:.3}, there {at_limit:.3}",
            plain.rms_mps,
            posterior.rms_mps,
            posterior.rms_without_bias_mps,
            100.0 * posterior.inside_share.unwrap(),
        );
        inside.push(posterior.inside_share.unwrap());
        off_squared.push((limit / posterior.limit_se_mps.unwrap()).powi(2));
        if index < first.len() {
            let squares = [plain.rms_mps, limit, at_limit, posterior.rms_without_bias_mps];
            sums.iter_mut().zip(squares).for_each(|(sum, value)| *sum += value * value);
        }
    }
    let [plain, limit, at_limit, rest] = sums.map(|sum: f64| (sum / first.len() as f64).sqrt());
    let inside = inside.iter().sum::<f64>() / inside.len() as f64;
    println!(
        "plain {plain:.3}, limit {limit:.3}, there {at_limit:.3}, rest {rest:.3}, inside {inside:.2}"
    );
    assert!(at_limit < 1.3 * limit, "{at_limit} {limit}");
    assert!(at_limit < plain, "{at_limit} {plain}");
    assert!(inside > 0.85, "{inside}");
    // Nearly all of its error is that of the mean: one square of a standard normal number for each campaign.
    let off_squared = off_squared.iter().sum::<f64>() / off_squared.len() as f64;
    assert!((0.2..3.0).contains(&off_squared), "{off_squared}");
    // Without what all drones share.
    assert!(rest < 0.08, "{rest}");
}

#[test]
fn a_thermal_that_stands_in_the_fleet_is_no_part_of_the_field() {
    let hover_s = Override::new("duration_s", 240.0);
    let [plain, posterior] = flown("campaign", 5, hover_s, "thermal", 91001);
    println!("each second alone {plain:?}, posterior {posterior:?}");
    // A stationary field in its place is off by 0.14 m/s without what all drones share.
    assert!(posterior.rms_without_bias_mps < 0.09, "{posterior:?}");
    assert!(posterior.inside_share.unwrap() > 0.9, "{posterior:?}");
}

#[test]
fn a_scan_of_a_vehicle_that_leans_less_than_its_file_says_is_near_the_truth() {
    let passes = Override::new("scan.passes", 1);
    let [plain, posterior] = flown("scan-campaign", 3, passes, "still", 1951);
    println!("each second alone {:.3} m/s, posterior {:.3}", plain.rms_mps, posterior.rms_mps);
    // With lean and lift of the file each second is 0.9 m/s off, and a tenth is inside.
    assert!(plain.rms_mps < 0.45 && plain.inside_share.unwrap() > 0.9, "{plain:?}");
    assert!(posterior.rms_mps < 0.2 && posterior.inside_share.unwrap() > 0.8, "{posterior:?}");
    assert_eq!(posterior.limit_rms_mps, None, "no covariance of what the lean leaves is known");
}

#[test]
fn along_legs_rising_air_is_no_stronger_than_it_is() {
    let passes = Override::new("scan.passes", 1);
    let (map, truth) = mapped("scan-campaign", 4, passes, "thermal", 7003);
    let slope = slope(&map, &truth);
    println!("slope {slope:.3}, {:?}", map.truth);
    // With leans that are wind alone, and what wind adds to the slope as the file has it, it is 1.14.
    assert!((0.96..1.08).contains(&slope), "{slope}");
}
