//! Turbulence in foreign worlds, whose plant shares no physics with the simulator.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "this is test code")]

use super::support::{Fleet, analysed, median, wilson};
use updraft::analysis::result::Turbulence;
use updraft::blind::worlds::maps;
use updraft::workflow::find::{Work, find};

fn flown(kind: &str, seed: u64) -> Turbulence {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("turbulent");
    let fleet = Fleet { side: 3, spacing_m: 15.0, hover_s: 600.0 };
    maps::fly(&fleet.plan(&root), kind, seed, None, None).unwrap();
    let mut work = Work::new(&root);
    find(&root, None, &mut work).unwrap();
    analysed(&work).pop().unwrap()
}

#[test]
fn a_foreign_plants_turbulence_is_measured() {
    is_measured(3101..3106);
}

#[test]
#[ignore = "minutes: the numbers of docs/products.md"]
fn foreign_plants_turbulence_is_measured_in_many_worlds() {
    let off = is_measured(3101..3131);
    assert!((off - 1.0).abs() < 0.1, "{off}");
}

/// The median of var(w) over the truth.
fn is_measured(seeds: std::ops::Range<u64>) -> f64 {
    let worlds = seeds.clone().count();
    let found: Vec<Turbulence> = seeds.map(|seed| flown("turbulent", seed)).collect();
    // A field of 0.4 m/s and own gusts of 0.3 m/s.
    let truth = 0.25;
    let variances: Vec<_> =
        found.iter().filter_map(|one| one.vertical.as_ref()?.variance).collect();
    let ratios: Vec<f64> = variances.iter().map(|of| of.value / truth).collect();
    assert!(5 * ratios.len() >= 4 * worlds, "{ratios:?}");
    let off = median(ratios.clone());
    let inside = variances.iter().filter(|of| of.low <= truth && truth <= of.high).count();
    let [low, high] = wilson(inside, variances.len());
    println!(
        "var(w)/truth: median {off:.3}, inside {inside} of {}, {low:.2} to {high:.2}",
        variances.len()
    );
    // Of few worlds, whose laws' slopes are 9 % off in either direction.
    assert!((0.75..1.33).contains(&off), "{ratios:.2?}");
    assert!(high >= 0.91, "{inside} of {}", variances.len());

    let mut apart = Vec::new();
    for at in found.iter().flat_map(|one| &one.distances) {
        // Along and across the drift alike, over the time of the record.
        let truth = 0.16 * (-0.5 * (at.distance_m / 25.0).powi(2)).exp();
        apart.push((at.covariance.value - truth).abs());
    }
    println!("covariance off by {:.3} (median) of {}", median(apart.clone()), apart.len());
    assert!(median(apart) < 0.05);

    let speeds: Vec<f64> =
        found.iter().filter_map(|one| Some(one.advection?.speed_mps.value / 3.0)).collect();
    println!("advection: {speeds:.2?}");
    assert!(2 * speeds.len() >= worlds && (median(speeds) - 1.0).abs() < 0.15);
    off
}

#[test]
fn another_wind_than_the_calibrations_is_in_the_interval() {
    is_in_the_interval(5101..5104);
}

#[test]
#[ignore = "minutes: the numbers of docs/products.md"]
fn another_wind_than_the_calibrations_is_in_the_interval_in_many_worlds() {
    is_in_the_interval(5101..5131);
}

fn is_in_the_interval(seeds: std::ops::Range<u64>) {
    let found: Vec<Turbulence> =
        seeds.map(|seed| flown("turbulent-calibrated-calm", seed)).collect();
    let variances: Vec<_> =
        found.iter().filter_map(|one| one.vertical.as_ref()?.variance).collect();
    let inside = variances.iter().filter(|of| of.low <= 0.25 && 0.25 <= of.high).count();
    let off: Vec<f64> = variances.iter().map(|of| of.value / 0.25).collect();
    println!("var(w)/truth: {off:.2?}, inside {inside} of {}", variances.len());
    let [_, high] = wilson(inside, variances.len());
    assert!(high >= 0.91, "{inside} of {}", variances.len());
}
