//! Statistics of a hover as the paper flew it: 49 drones, 600 s, 200 simulated flights.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot run fails")]

use updraft::analysis::statistics::{
    FieldInput, FieldScales, Simulator, StatisticsOptions, field_statistics, paper_scales,
};
use updraft::base::rng::{Purpose, stream};

fn main() {
    divan::main();
}

fn hover() -> FieldInput {
    let places_m: Vec<[f64; 2]> =
        (0..49).map(|i| [7.0 * f64::from(i / 7), 7.0 * f64::from(i % 7)]).collect();
    let scales = FieldScales { sd_mps: 0.5, length_m: [145.0; 2], tau_s: 186.0, noise_mps: 0.05 };
    let simulator = Simulator::new(&places_m, scales, 600, 10).unwrap();
    let columns = simulator.flight(&mut stream(1, 0, Purpose::Air));
    let row = |column: &[f64]| column.iter().map(|value| Some(*value)).collect();
    let values_mps = columns.as_slice().chunks_exact(600).map(row).collect();
    FieldInput { places_m, values_mps, running_s: 10 }
}

#[divan::bench]
fn everything_with_200_simulated_flights(bencher: divan::Bencher<'_, '_>) {
    let input = hover();
    bencher.bench_local(|| field_statistics(&input, &StatisticsOptions::default()));
}

#[divan::bench]
fn the_papers_estimators(bencher: divan::Bencher<'_, '_>) {
    let input = hover();
    bencher.bench_local(|| paper_scales(&input));
}
