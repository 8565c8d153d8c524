//! Covariances between points and advection in a drawn field that the wind carries past a grid of drones.

use rand::SeedableRng as _;
use rand_distr::{Distribution as _, StandardNormal, StandardUniform};
use rand_pcg::Pcg64;
use turbulence_statistics::points::{At, advection, by_distance};
use turbulence_statistics::{Record, moments, spectrum};

const STEP_S: f64 = 0.5;
const COUNT: usize = 1200;
const WAVES: usize = 400;

/// A frozen field of waves with the covariance `sd² exp(-d/length)` in the plane, carried along.
struct Field {
    waves: Vec<([f64; 2], f64, f64)>,
    wind_mps: [f64; 2],
}

impl Field {
    fn draw(seed: u64, sd_mps: f64, length_m: f64, wind_mps: [f64; 2]) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let mut draw = || -> f64 { StandardUniform.sample(&mut random) };
        let waves = (0..WAVES).map(|_| {
            // The plane's spectrum of an exponential is k (k² + 1/L²)^(-3/2): its distribution turned round.
            let left: f64 = 1.0 - draw();
            let k = (left.powi(-2) - 1.0).sqrt() / length_m;
            let angle = std::f64::consts::TAU * draw();
            let amplitude = sd_mps * (2.0 / WAVES as f64).sqrt();
            ([k * angle.cos(), k * angle.sin()], std::f64::consts::TAU * draw(), amplitude)
        });
        Self { waves: waves.collect(), wind_mps }
    }

    fn record(&self, [x, y]: [f64; 2], noise: &mut impl FnMut() -> f64) -> Record {
        let mut values = vec![0.0; COUNT];
        let [east_mps, north_mps] = self.wind_mps;
        for ([kx, ky], phase, amplitude) in &self.waves {
            // The phase of a wave that is carried along turns by the same angle each step.
            let turn = -(kx * east_mps + ky * north_mps) * STEP_S;
            let (turn_sin, turn_cos) = turn.sin_cos();
            let (mut sin, mut cos) = (kx * x + ky * y + phase).sin_cos();
            for value in &mut values {
                *value += amplitude * cos;
                (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
            }
        }
        Record::new(
            STEP_S,
            values.into_iter().map(|value| Some(value + noise())).collect::<Vec<_>>(),
        )
    }
}

fn grid(side: usize, spacing_m: f64) -> Vec<[f64; 2]> {
    let at = |k: usize| spacing_m * k as f64;
    (0..side * side).map(|k| [at(k / side), at(k % side)]).collect()
}

fn fleet(seed: u64, sd_mps: f64, length_m: f64, wind_mps: [f64; 2]) -> Vec<([f64; 2], Record)> {
    let field = Field::draw(seed, sd_mps, length_m, wind_mps);
    let mut random = Pcg64::seed_from_u64(seed + 1000);
    let mut noise =
        || -> f64 { 0.05 * rand_distr::Distribution::<f64>::sample(&StandardNormal, &mut random) };
    grid(4, 15.0).into_iter().map(|place| (place, field.record(place, &mut noise))).collect()
}

fn points(fleet: &[([f64; 2], Record)]) -> Vec<At<'_>> {
    fleet.iter().map(|(place_m, record)| At { place_m: *place_m, record }).collect()
}

#[test]
fn covariances_between_points_are_those_of_the_field() {
    let (sd_mps, length_m) = (0.5, 40.0);
    let mut off = Vec::new();
    let mut inside = (0, 0);
    let mut fleet_inside = 0;
    for seed in 0..60 {
        let fleet = fleet(seed, sd_mps, length_m, [3.0, 1.0]);
        for class in by_distance(&points(&fleet), 10.0, 4, 0.0) {
            // The mean of the classes' pairs.
            let truth = sd_mps.powi(2) * (-class.distance_m / length_m).exp();
            off.push((class.covariance.value - truth).abs());
            assert!((class.by_lag[0] - class.covariance.value).abs() < 1e-12, "one definition");
            inside.1 += 1;
            inside.0 +=
                usize::from(class.covariance.low <= truth && truth <= class.covariance.high);
        }
        let records: Vec<&Record> = fleet.iter().map(|(_, record)| record).collect();
        let all = moments::mean_variance(&records, &[0.05f64.powi(2); 16], 0.0).unwrap();
        fleet_inside += u64::from(all.low <= 0.25 && 0.25 <= all.high);
    }
    off.sort_by(f64::total_cmp);
    let median = off[off.len() / 2];
    let held = inside.0 as f64 / inside.1 as f64;
    println!("median off {median}, inside {held}, fleet {fleet_inside} of 60");
    assert!(median < 0.05, "{median}");
    assert!(held > 0.9, "{held}");
    assert!(fleet_inside >= 52, "{fleet_inside}");
}

#[test]
fn the_wind_is_found_by_what_it_carries() {
    let mut off = Vec::new();
    let mut sum = [0.0, 0.0];
    for seed in 0..24u32 {
        let (sin, cos) = (std::f64::consts::TAU * f64::from(seed) / 24.0).sin_cos();
        let fleet = fleet(u64::from(seed), 0.5, 40.0, [3.0 * cos, 3.0 * sin]);
        let found = advection(&points(&fleet), 60.0).unwrap();
        let [x, y] = found.velocity_mps;
        sum = [sum[0] + x * cos + y * sin, sum[1] + y * cos - x * sin];
        off.push((found.speed_mps() / 3.0 - 1.0).abs());
    }
    off.sort_by(f64::total_cmp);
    let [along, across] = sum.map(|sum| sum / 24.0);
    let within = off.iter().filter(|off| **off < 0.15).count();
    println!(
        "along {along}, across {across}, within 15 %: {within}, median {}",
        off[off.len() / 2]
    );
    assert!((along - 3.0).abs() < 0.15 && across.abs() < 0.3, "{along} {across}");
    assert!(off[off.len() / 2] < 0.1 && within >= 20, "{off:?}");
    // Drones that see nothing in common tell no wind.
    let apart: Vec<_> =
        (0..16).map(|k| fleet(100 + k, 0.5, 40.0, [3.0, 1.0]).swap_remove(k as usize)).collect();
    assert_eq!(advection(&points(&apart), 60.0), None);
}

/// A pattern that does not move has no speed: waves that stand with noise, and noise alone that lasts for seconds.
#[test]
fn nothing_that_stands_has_a_speed() {
    let mut told = [0, 0];
    for seed in 0..40_u64 {
        let mut random = Pcg64::seed_from_u64(900 + seed);
        let mut draw = || -> f64 { StandardNormal.sample(&mut random) };
        let place = |k: usize| [10.0 * (k % 5) as f64, 10.0 * (k / 5) as f64];
        let mut fleet = |wave_mps: f64| -> Vec<([f64; 2], Record)> {
            let each = |k: usize| {
                let at = place(k);
                let here = wave_mps * (std::f64::consts::TAU * at[0] / 60.0).sin();
                let mut noise = 0.0;
                let value = |step: usize| {
                    // Ten seconds, as the means of a map.
                    noise = 0.95 * noise + 0.05 * draw();
                    let turned = std::f64::consts::TAU * step as f64 * STEP_S / 40.0;
                    Some(here * turned.sin() + noise)
                };
                (at, Record::new(STEP_S, (0..600).map(value)))
            };
            (0..25).map(each).collect()
        };
        for (told, wave_mps) in told.iter_mut().zip([0.0, 0.3]) {
            *told += usize::from(advection(&points(&fleet(wave_mps)), 37.5).is_some());
        }
    }
    assert_eq!(told, [0, 0], "noise, standing waves");
}

#[test]
fn a_fleets_spectrum_knows_how_coherent_it_is() {
    let fleet = fleet(5, 0.5, 200.0, [3.0, 1.0]);
    let records: Vec<&Record> = fleet.iter().map(|(_, record)| record).collect();
    let instrument = spectrum::Instrument::default();
    let one = spectrum::spectrum(records[0], &instrument);
    let all = spectrum::mean(&records, &instrument);
    // Large eddies hold all drones, so that they know little more together.
    assert!(all[0].freedom < 3.0 * one[0].freedom, "{:?} {:?}", all[0], one[0]);
    let last = (one.last().unwrap(), all.last().unwrap());
    assert!(last.1.freedom > 5.0 * last.0.freedom, "{last:?}");
    let cross = spectrum::cross(records[0], records[1], &instrument);
    let first = cross.iter().find(|band| band.freedom > 10.0).unwrap();
    assert!(first.coherence > first.coherence_threshold, "{first:?}");
}
