//! Von Karman's gusts of the simulator, carried past at 3 m/s.

#![expect(clippy::print_stdout, reason = "this is test code, and its numbers are in the docs")]

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::support::{Fleet, median, wilson};
use turbulence_statistics::dissipation::{ACROSS, C1};
use updraft::analysis::result::Turbulence;

const SD_MPS: f64 = 0.5;
const LENGTH_M: f64 = 50.0;
const WIND_MPS: f64 = 3.0;
/// Spectra are compared from here on, Hz.
const LOWEST_HZ: f64 = 1.0 / 300.0;

/// One-sided spectral density across the wind, (m/s)²/Hz (MIL-F-8785C).
fn density(frequency_hz: f64) -> f64 {
    let n = 1.339 * TAU * frequency_hz * LENGTH_M / WIND_MPS;
    2.0 * SD_MPS.powi(2) * LENGTH_M / WIND_MPS * (1.0 + 8.0 / 3.0 * n * n)
        / (1.0 + n * n).powf(11.0 / 6.0)
}

/// Rate of dissipation that its spectrum has at high frequencies.
fn dissipation() -> f64 {
    let level = density(1e3) * 1e3f64.powf(5.0 / 3.0);
    (level / (ACROSS * C1 * (WIND_MPS / TAU).powf(2.0 / 3.0))).powf(1.5)
}

fn flown(seeds: std::ops::Range<u64>) -> Vec<Turbulence> {
    let fleet = Fleet { side: 2, spacing_m: 15.0, hover_s: 600.0 };
    // With fewer waves, bands of high frequencies have too few of them to scatter as air does.
    fleet.flown(seeds, &["von-karman:sd=0.5,length=50,modes=6000"], "wind:speed=3,from=240")
}

/// That the share of so many that hold agrees with one of these; in words.
fn share(what: &str, held: usize, of: usize, [least, most]: [f64; 2]) -> String {
    let [low, high] = wilson(held, of);
    let words = format!("{what}: {held} of {of}, {low:.3} to {high:.3}");
    assert!(high >= least && low <= most, "{words}");
    words
}

#[test]
fn gusts_of_known_statistics_are_measured() {
    are_measured(4016..4028);
}

#[test]
#[ignore = "minutes: the numbers of docs/products.md"]
fn gusts_of_known_statistics_are_measured_in_many_campaigns() {
    are_measured(4001..4031);
}

fn are_measured(seeds: std::ops::Range<u64>) {
    let campaigns = seeds.clone().count();
    let at_least = |share: f64| (share * campaigns as f64) as usize;
    let found = flown(seeds);
    assert_eq!(found.len(), campaigns);
    let truth = SD_MPS.powi(2);
    let variances: Vec<_> =
        found.iter().filter_map(|one| one.vertical.as_ref()?.variance).collect();
    let off = median(variances.iter().map(|of| of.value / truth).collect());
    println!("var(w)/truth: median {off:.3} of {}", variances.len());
    assert!(variances.len() >= at_least(0.85), "{}", variances.len());
    assert!((off - 1.0).abs() < 0.1, "{off}");
    let inside = variances.iter().filter(|of| of.low <= truth && truth <= of.high).count();
    println!("{}", share("var(w)", inside, variances.len(), [0.91, 0.98]));

    let mut bands = BTreeMap::<u64, [usize; 2]>::new();
    let mut ratios = BTreeMap::<u64, Vec<f64>>::new();
    let all = found.iter().flat_map(|one| &one.vertical.as_ref().unwrap().spectrum);
    for band in all.filter(|band| band.frequency_hz >= LOWEST_HZ) {
        let key = ((band.frequency_hz.log10() + 4.0) * 8.0) as u64;
        let truth = density(band.frequency_hz);
        let [held, of] = bands.entry(key).or_default();
        *held += usize::from(band.low <= truth && truth <= band.high);
        *of += 1;
        ratios.entry(key).or_default().push(band.density / truth);
    }
    for (key, [held, of]) in &bands {
        let ratio = ratios[key].iter().sum::<f64>() / *of as f64;
        println!(
            "{:.4} Hz: {held} of {of}, mean {ratio:.2}",
            10f64.powf((*key as f64 + 0.5) / 8.0 - 4.0)
        );
    }
    let [held, of] = bands.values().fold([0, 0], |sum, one| [sum[0] + one[0], sum[1] + one[1]]);
    println!("{}", share("spectra", held, of, [0.90, 0.985]));

    let truth = dissipation();
    let rates: Vec<_> = found.iter().filter_map(|one| one.dissipation).collect();
    let off = median(rates.iter().map(|of| of.value / truth).collect());
    println!("dissipation/truth: median {off:.3} of {}, truth {truth:.5}", rates.len());
    assert!(rates.len() >= at_least(0.5), "{}", rates.len());
    assert!((off - 1.0).abs() < 0.25, "{off}");
    let held = rates.iter().filter(|of| of.low <= truth && truth <= of.high).count();
    println!("{}", share("dissipation", held, rates.len(), [0.85, 1.0]));

    let speeds: Vec<f64> =
        found.iter().filter_map(|one| Some(one.advection?.speed_mps.value / WIND_MPS)).collect();
    println!("advection: median {:.3} of {}", median(speeds.clone()), speeds.len());
    assert!(speeds.len() >= at_least(0.7) && (median(speeds) - 1.0).abs() < 0.15);
    for one in [|one: &Turbulence| one.along.clone(), |one: &Turbulence| one.across.clone()] {
        let variances: Vec<_> = found.iter().filter_map(|found| one(found)?.variance).collect();
        let truth = SD_MPS.powi(2);
        let held = variances.iter().filter(|of| of.low <= truth && truth <= of.high).count();
        println!(
            "horizontal: median {:.3}",
            median(variances.iter().map(|of| of.value / truth).collect())
        );
        println!("{}", share("horizontal", held, variances.len(), [0.91, 1.0]));
    }
}

#[test]
fn a_short_record_says_what_is_not_known() {
    let fleet = Fleet { side: 2, spacing_m: 15.0, hover_s: 60.0 };
    let found =
        fleet.flown(1..2, &["von-karman:sd=0.5,length=50,modes=200"], "wind:speed=3,from=240");
    let short = found.first().unwrap();
    assert!(short.vertical.is_none() && short.drones.is_empty(), "{short:?}");
    assert!(short.absent.iter().any(|text| text.contains("39 s")), "{:?}", short.absent);
    let fleet = Fleet { side: 2, spacing_m: 15.0, hover_s: 150.0 };
    let found = fleet.flown(2..3, &["field:sd=0.5,lambda=145,tau=186,modes=200"], "still");
    let slow = found.first().unwrap();
    let up = slow.vertical.as_ref().unwrap();
    assert!(up.variance.is_none() && up.scales.is_none() && up.within_record > 0.0, "{up:?}");
    assert!(slow.dissipation.is_none() && slow.kinetic_energy.is_none());
    assert!(slow.absent.iter().any(|text| text.contains("integral time")), "{:?}", slow.absent);
}
