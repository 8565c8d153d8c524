//! Intervals hold the truth as often as they say.
//!
//! `cargo test --release --test it statistics::coverage -- --ignored --nocapture` does it with the
//! paper's grid and record, and 400 flights each (some minutes).

#![expect(clippy::unwrap_used, reason = "this is test code")]

use crate::statistics::support::{field, flight, grid, simulator};
use rayon::prelude::*;
use updraft::analysis::statistics::result::Scale;
use updraft::analysis::statistics::{StatisticsOptions, field_statistics};

struct Campaign {
    side: u32,
    seconds: usize,
    length_m: f64,
    tau_s: f64,
    noise_mps: f64,
    /// Flights that are analysed.
    seeds: u64,
    /// Simulated flights behind each interval.
    flights: usize,
}

/// Scales that have a truth, in the order of [`coverage`].
const NAMES: [&str; 4] = ["lambda", "t0", "likelihood lambda", "likelihood tau"];

/// Share of flights whose 95 % interval holds the truth. That of t0 is its median over the flights:
/// it is no property of the air.
fn coverage(campaign: &Campaign) -> [f64; 4] {
    let Campaign { side, seconds, length_m, tau_s, noise_mps, seeds, flights } = *campaign;
    let places = grid(side);
    let air = simulator(&places, field([length_m; 2], tau_s, noise_mps), seconds, 10);
    let found: Vec<[Option<Scale>; 4]> = (0..seeds)
        .into_par_iter()
        .map(|seed| {
            let options = StatisticsOptions { flights, seed, variants: false };
            let input = flight(&places, &air, 10, 1000 + seed, |_| 0.0);
            let statistics = field_statistics(&input, &options);
            let model = statistics.likelihood.unwrap();
            [
                statistics.space.unwrap().all.lambda_m,
                statistics.time.unwrap().line.map(|line| line.t0_s),
                Some(model.lambda_m),
                Some(model.tau_s),
            ]
        })
        .collect();
    let mut t0: Vec<f64> = found.iter().filter_map(|one| Some(one[1].as_ref()?.value)).collect();
    t0.sort_by(f64::total_cmp);
    let truths = [length_m, t0[t0.len() / 2], length_m, tau_s];
    std::array::from_fn(|index| {
        let holds = |one: &&[Option<Scale>; 4]| {
            let interval = one[index].as_ref().and_then(|scale| scale.interval_95);
            interval.is_some_and(|found| (found.low..=found.high).contains(&truths[index]))
        };
        found.iter().filter(holds).count() as f64 / found.len() as f64
    })
}

#[test]
fn intervals_hold_the_truth() {
    let small = Campaign {
        side: 5,
        seconds: 300,
        length_m: 60.0,
        tau_s: 25.0,
        noise_mps: 0.1,
        seeds: 100,
        flights: 80,
    };
    for (name, share) in NAMES.into_iter().zip(coverage(&small)) {
        assert!((0.90..=0.99).contains(&share), "{name}: {share}");
    }
}

#[test]
#[ignore = "some minutes; see the file's head"]
fn intervals_of_the_papers_grid_hold_the_truth() {
    for (length_m, tau_s, noise_mps) in
        [(145.0, 60.0, 0.05), (145.0, 186.0, 0.05), (60.0, 60.0, 0.2)]
    {
        let paper = Campaign {
            side: 7,
            seconds: 600,
            length_m,
            tau_s,
            noise_mps,
            seeds: 400,
            flights: 200,
        };
        for (name, share) in NAMES.into_iter().zip(coverage(&paper)) {
            println!("{length_m} m, {tau_s} s, noise {noise_mps}: {name} {share:.3}");
            assert!((0.93..=0.97).contains(&share), "{name}: {share}");
        }
    }
}
