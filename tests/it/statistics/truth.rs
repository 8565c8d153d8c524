//! The paper's estimators on fields of known scales give what an independent simulation found for
//! them, and the likelihood finds the scales of the simulator's own random air.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use crate::statistics::support::{field, flight, grid, simulator};
use nalgebra::Vector3;
use updraft::analysis::statistics::{
    FieldInput, FieldScales, PaperScales, StatisticsOptions, field_statistics, paper_scales,
};
use updraft::base::rng::{Purpose, stream};
use updraft::sim::air::{FieldScales as AirScales, RandomField};

const SEEDS: u64 = 200;
const SECONDS: usize = 600;

/// Median, 5th and 95th percentile.
type Spread = [f64; 3];

/// Estimates of many flights of 7 x 7 drones, with a straight line of a standard deviation shared by
/// all drones.
fn estimates(scales: FieldScales, running_s: usize, trend: f64) -> Vec<PaperScales> {
    let places = grid(7);
    let air = simulator(&places, scales, SECONDS, running_s);
    let line = |second: usize| trend * 12.0_f64.sqrt() * (second as f64 / SECONDS as f64 - 0.5);
    (0..SEEDS)
        .map(|seed| paper_scales(&flight(&places, &air, running_s, seed, line)).unwrap())
        .collect()
}

/// That estimates scatter as expected: the share of them below each expected quantile is its own,
/// within three Monte-Carlo errors of both simulations.
fn assert_spread(
    name: &str,
    found: &[PaperScales],
    of: fn(&PaperScales) -> Option<f64>,
    expected: Spread,
) {
    let values: Vec<f64> = found.iter().filter_map(of).collect();
    let n = values.len() as f64;
    assert!(n > 0.95 * found.len() as f64, "{name}: only {n} have a value");
    for (share, quantile) in [0.5, 0.05, 0.95].into_iter().zip(expected) {
        let below = values.iter().filter(|value| **value < quantile).count() as f64 / n;
        let se = (share * (1.0 - share) * (1.0 / n + 1.0 / SEEDS as f64)).sqrt();
        assert!(
            (below - share).abs() < 3.0 * se,
            "{name}: {below:.3} of the estimates are below {quantile}, expected {share} ± {se:.3}"
        );
    }
}

#[test]
fn isotropic_fields_read_as_long_known() {
    for (tau_s, lambda, t0) in [
        (20.0, [144.0, 97.0, 219.0], [41.0, 23.0, 119.0]),
        (60.0, [143.0, 63.0, 288.0], [72.0, 42.0, 169.0]),
        (186.0, [159.0, 52.0, 529.0], [122.0, 60.0, 199.0]),
    ] {
        let found = estimates(field([145.0; 2], tau_s, 0.0), 1, 0.0);
        assert_spread(&format!("lambda, tau {tau_s} s"), &found, |one| one.lambda_m, lambda);
        assert_spread(&format!("t0, tau {tau_s} s"), &found, |one| one.t0_s, t0);
    }
}

#[test]
fn an_anisotropic_field_shows_its_two_lengths() {
    let found = estimates(field([121.0, 252.0], 100.0, 0.0), 1, 0.0);
    assert_spread("lambda x", &found, |one| one.lambda_x_m, [118.0, 50.0, 320.0]);
    assert_spread("lambda y", &found, |one| one.lambda_y_m, [286.0, 123.0, 665.0]);
    assert_spread("t0", &found, |one| one.t0_s, [107.0, 53.0, 184.0]);
}

#[test]
fn independent_noise_shortens_the_length() {
    let found = estimates(field([145.0; 2], 100.0, 0.3), 10, 0.0);
    assert_spread("lambda", &found, |one| one.lambda_m, [92.0, 45.0, 255.0]);
    assert_spread("t0", &found, |one| one.t0_s, [92.0, 51.0, 182.0]);
}

#[test]
fn a_shared_drift_makes_the_papers_numbers_of_a_short_field() {
    let found = estimates(field([60.0; 2], 60.0, 0.0), 1, 1.0);
    assert_spread("lambda", &found, |one| one.lambda_m, [180.0, 67.0, 416.0]);
    assert_spread("t0", &found, |one| one.t0_s, [178.0, 86.0, 225.0]);
}

#[test]
fn a_pure_drift_crosses_zero_at_a_share_of_the_record() {
    // exp(-r / lambda) through 1 / (1 + 0.3²) at all distances, and 0.366 T = 220 s for the crossing.
    let drift = FieldScales { sd_mps: 1e-6, ..field([145.0; 2], 60.0, 0.3) };
    for one in estimates(drift, 10, 1.0).iter().take(20) {
        let (lambda, t0) = (one.lambda_m.unwrap(), one.t0_s.unwrap());
        assert!((420.0..530.0).contains(&lambda), "{lambda}");
        assert!((223.0..231.0).contains(&t0), "{t0}");
    }
}

/// Mean of logarithms and its standard error.
fn mean_ln(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let logs: Vec<f64> = values.map(f64::ln).collect();
    let n = logs.len() as f64;
    let mean = logs.iter().sum::<f64>() / n;
    let variance = logs.iter().map(|log| (log - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// One of the paper's scales.
type Of = fn(&PaperScales) -> Option<f64>;

/// Flights of 4 x 4 drones, for both tests below.
const FLIGHTS: u64 = 60;
const SHORT_S: usize = 200;

#[test]
fn the_likelihood_finds_the_scales_of_exact_draws() {
    let places = grid(4);
    let options = StatisticsOptions { flights: 0, seed: 1, variants: false };
    let exact = simulator(&places, field([60.0; 2], 30.0, 0.0), SHORT_S, 1);
    let draw = |seed: u64| flight(&places, &exact, 1, seed, |_| 0.0);
    let models: Vec<_> = (0..FLIGHTS)
        .map(|seed| field_statistics(&draw(seed), &options).likelihood.unwrap())
        .collect();
    let all = [
        ("lambda", mean_ln(models.iter().map(|model| model.lambda_m.value / 60.0))),
        ("tau", mean_ln(models.iter().map(|model| model.tau_s.value / 30.0))),
        ("sd", mean_ln(models.iter().map(|model| model.sd_mps.value))),
    ];
    for (name, (mean, se)) in all {
        assert!(se < 0.06, "{name}: ± {se} says nothing");
        assert!(mean.abs() < 3.0 * se + 0.03, "{name}: {mean:.3} ± {se:.3}");
    }
}

/// The simulator's random air, 600 plane waves, reads as exact draws do. (To the likelihood it does
/// not: it looks at scales that so few waves leave empty, and reads lengths 17 % and times 13 % long;
/// with ten times as many waves, 8 % and 3 %.)
#[test]
fn the_simulators_air_reads_as_exact_draws_do() {
    let places = grid(4);
    let exact = simulator(&places, field([60.0; 2], 30.0, 0.0), SHORT_S, 1);
    let air = AirScales {
        sd_mps: 1.0,
        length_m: Vector3::repeat(60.0),
        time_s: 30.0,
        wind_mps: Vector3::zeros(),
        waves: 600,
    };
    let waves = |seed: u64| {
        let field = RandomField::new(&air, &mut stream(seed, 1, Purpose::Air));
        let at = |place: &[f64; 2]| {
            let place = Vector3::new(place[0], place[1], 0.0);
            (0..SHORT_S).map(|second| Some(field.updraft_mps(&place, second as f64))).collect()
        };
        FieldInput {
            places_m: places.clone(),
            values_mps: places.iter().map(at).collect(),
            running_s: 1,
        }
    };
    let scales = |draw: &dyn Fn(u64) -> FieldInput| -> Vec<PaperScales> {
        (0..FLIGHTS).map(|seed| paper_scales(&draw(seed)).unwrap()).collect()
    };
    let drawn = scales(&|seed| flight(&places, &exact, 1, seed, |_| 0.0));
    let waved = scales(&waves);
    let all: [(&str, Of); 2] = [("lambda", |one| one.lambda_m), ("t0", |one| one.t0_s)];
    for (name, of) in all {
        let (one, one_se) = mean_ln(drawn.iter().filter_map(of));
        let (other, other_se) = mean_ln(waved.iter().filter_map(of));
        let se = one_se.hypot(other_se);
        assert!(se < 0.15, "{name}: ± {se} says nothing");
        assert!((one - other).abs() < 3.0 * se, "{name}: {one:.3}, {other:.3} ± {se:.3}");
    }
}
