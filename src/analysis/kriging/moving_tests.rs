//! Maps along tracks, in fields that are made of waves: means over 10 s along the way, once a second, with noise.

use nalgebra::{DMatrix, Matrix2};
use rand_distr::{Distribution as _, StandardNormal};

use super::calibration::Component;
use super::covariance::{Air, Covariance};
use super::data::{Drone, Rows, UNIFORM, Value};
use super::make::{over_all, sampled};
use super::moving;
use super::neighbours::before;
use super::predict::{Linear, Model, Series};
use super::scales::{COARSE, FINE, Search, Whole};
use super::vecchia::Common;
use crate::analysis::corrections::DOUBTS;
use crate::analysis::shape::PARAMETERS;
use crate::base::rng::{Purpose, stream};

const NOISE_MPS: f64 = 0.03;
const OWN_MPS: f64 = 0.04;
/// What a calibration leaves of the zero, m/s.
const ZERO_MPS: f64 = 0.1;
/// All values hang on the zero alike.
const CONSTANT: [f64; PARAMETERS] = [1.0, 0.0, 0.0, 0.0];
const WAVES: usize = 200;
const LEG_S: usize = 40;
const TURN_S: usize = 8;
const SPEED_MPS: f64 = 4.0;

#[derive(Clone, Copy, Debug)]
pub(super) struct Case {
    pub(super) side: usize,
    pub(super) legs: usize,
    pub(super) heights_m: [f64; 2],
    pub(super) length_m: f64,
    pub(super) time_s: f64,
    pub(super) drift_mps: [f64; 2],
    pub(super) gust_mps: f64,
}

/// A field with the correlation `exp(-(r/length)² - (t/time)²)`, sd 0.5 m/s.
pub(super) struct Field {
    waves: Vec<[f64; 5]>,
    drift_mps: [f64; 2],
}

impl Field {
    pub(super) fn new(case: &Case, mut normal: impl FnMut() -> f64) -> Self {
        let (k, rate) = (2.0_f64.sqrt() / case.length_m, 2.0_f64.sqrt() / case.time_s);
        let wave =
            |_| [k * normal(), k * normal(), k * normal(), rate * normal(), 100.0 * normal()];
        Self { waves: (0..WAVES).map(wave).collect(), drift_mps: case.drift_mps }
    }

    pub(super) fn at(&self, [x, y, z]: [f64; 3], time_s: f64) -> f64 {
        let (x, y) = (x - self.drift_mps[0] * time_s, y - self.drift_mps[1] * time_s);
        let of = |[a, b, c, rate, phase]: &[f64; 5]| {
            (a * x + b * y + c * z + rate * time_s + phase).cos()
        };
        0.5 * (2.0 / WAVES as f64).sqrt() * self.waves.iter().map(of).sum::<f64>()
    }
}

/// Where a drone is; legs there and back, the second half of them at the other height.
fn place_m(case: &Case, index: usize, time_s: f64) -> [f64; 3] {
    let step = |step: usize| 10.0 * (step as f64 - 0.5 * (case.side - 1) as f64);
    let period_s = (LEG_S + TURN_S) as f64;
    let leg = (time_s / period_s).floor().max(0.0);
    let along = SPEED_MPS * (time_s - leg * period_s).clamp(0.0, LEG_S as f64);
    let length = SPEED_MPS * LEG_S as f64;
    let x = if (leg as usize).is_multiple_of(2) { along } else { length - along };
    let height = case.heights_m[usize::from(2 * leg as usize >= case.legs)];
    [x + step(index % case.side), step(index / case.side), height]
}

/// Drones with their values, and the true means.
fn flown(case: &Case, seed: u64) -> (Vec<Drone>, Vec<Vec<f64>>) {
    let mut rng = stream(seed, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let field = Field::new(case, &mut normal);
    let seconds = case.legs * (LEG_S + TURN_S);
    let zero = ZERO_MPS * normal();
    let mut drones = Vec::new();
    let mut truths = Vec::new();
    for index in 0..case.side * case.side {
        let own = OWN_MPS * normal();
        let mut gust = normal();
        // The middle of each second, its air with gusts of 4 s, and noise.
        let mut air = Vec::new();
        let mut noise = Vec::new();
        for second in 0..seconds + 10 {
            let time_s = second as f64 - 4.5;
            gust = gust * (-0.25_f64).exp() + (1.0 - (-0.5_f64).exp()).sqrt() * normal();
            air.push(field.at(place_m(case, index, time_s), time_s) + case.gust_mps * gust);
            noise.push(NOISE_MPS * 10.0_f64.sqrt() * normal());
        }
        let mean =
            |values: &[f64], second: usize| values[second..second + 10].iter().sum::<f64>() / 10.0;
        let truth: Vec<f64> = (0..seconds).map(|second| mean(&air, second)).collect();
        let values = (0..seconds).map(|second| {
            let is_steady = (5..=LEG_S - 5).contains(&(second % (LEG_S + TURN_S)));
            is_steady.then(|| Value {
                updraft_mps: zero + own + truth[second] + mean(&noise, second),
                law: CONSTANT,
                doubts_mps: [0.0; DOUBTS],
                own_mps: OWN_MPS,
                noise_mps: NOISE_MPS,
            })
        });
        let place_m = (0..seconds).map(|second| place_m(case, index, second as f64)).collect();
        drones.push(Drone {
            calibrated_m: None,
            place_m,
            values: values.collect(),
            slope_share: 0.0,
            own_slope_share: 0.0,
        });
        truths.push(truth);
    }
    (drones, truths)
}

/// The map, with a zero that is known as a calibration leaves it.
fn mapped(drones: &[Drone]) -> Vec<Series> {
    let seconds = drones[0].values.len();
    let rows = Rows::of(drones, 5, 10);
    let all = before(drones, &rows, moving::REACH);
    let (fine, coarse) = (Whole::of(drones, &rows, FINE), Whole::of(drones, &rows, COARSE));
    let own_mps = vec![OWN_MPS; drones.len()];
    let mut factor = Common::zeros();
    factor[(UNIFORM, UNIFORM)] = 3.0;
    let mut search = Search {
        rows: &rows,
        neighbours: &all,
        whole: Some(&fine),
        coarse: Some(&coarse),
        own_mps: &own_mps,
        slope_share: 0.0,
        wind_mps: None,
        factor,
        lasting_mps: 0.0,
    };
    let mut forms = search.all();
    search.wind_mps = moving::drift(&search, &forms[0]);
    if search.wind_mps.is_some() {
        forms = search.all();
    }
    let zero = |_: &Air| {
        let mut covariance = DMatrix::zeros(PARAMETERS, PARAMETERS);
        covariance[(0, 0)] = ZERO_MPS * ZERO_MPS;
        let shift = [0.0; PARAMETERS];
        vec![Component { shift, covariance, gradient: Matrix2::zeros(), log_weight: 0.0 }]
    };
    let own_of = |_: &Air| own_mps.clone();
    let sampled: Vec<_> =
        forms.iter().map(|found| (found, sampled(&search, found, &zero, &own_of))).collect();
    let (mean, covariance, _) = over_all(&sampled).unwrap();
    let air = search.air(forms[0].family, &forms[0].best);
    if std::env::var("UPDRAFT_EACH").is_ok() {
        println!("{air:?}");
    }
    let search = Search { whole: None, ..search };
    let system = search.system(forms[0].family, &forms[0].best).unwrap();
    let (own, answers) = system.own();
    let linear = Linear { mean, covariance, own, answers, own_covariance: system.own_covariance() };
    let model = Model { drones, covariance: Covariance::new(air), linear };
    let sites: Vec<(Option<usize>, [f64; 3])> =
        (0..drones.len()).map(|index| (Some(index), drones[index].place_m[0])).collect();
    model.at(&sites, seconds)
}

/// Share of values inside their 95 % intervals, and rms errors of the map and of the values.
fn score(case: &Case, seed: u64) -> (f64, f64, f64) {
    let (drones, truths) = flown(case, seed);
    let map = mapped(&drones);
    let (mut count, mut inside, mut squares, mut plain) = (0.0, 0.0, 0.0, 0.0);
    for ((drone, series), truth) in drones.iter().zip(&map).zip(&truths) {
        for (second, truth) in truth.iter().enumerate() {
            let Some(value) = drone.values[second] else { continue };
            let (mean, sd) = (series.mean_mps[second].unwrap(), series.sd_mps[second].unwrap());
            count += 1.0;
            inside += f64::from(u8::from((mean - truth).abs() < 1.96 * sd));
            squares += (mean - truth).powi(2);
            plain += (value.updraft_mps - truth).powi(2);
        }
    }
    (inside / count, (squares / count).sqrt(), (plain / count).sqrt())
}

pub(super) const CASE: Case = Case {
    side: 4,
    legs: 4,
    heights_m: [60.0; 2],
    length_m: 60.0,
    time_s: 100.0,
    drift_mps: [0.0; 2],
    gust_mps: 0.15,
};

#[test]
#[ignore = "minutes: UPDRAFT_SEEDS=20 cargo test --release --lib kriging::moving -- --ignored --nocapture"]
fn many_scans() {
    let seeds =
        std::env::var("UPDRAFT_SEEDS").ok().and_then(|text| text.parse().ok()).unwrap_or(10);
    for (name, case) in [
        ("still field", CASE),
        ("drifting field", Case { drift_mps: [1.5, -0.5], ..CASE }),
        ("two heights", Case { heights_m: [50.0, 80.0], ..CASE }),
        ("short field, gusty", Case { length_m: 35.0, gust_mps: 0.3, ..CASE }),
        ("49 drones, 600 s", Case { side: 7, legs: 12, ..CASE }),
    ] {
        let count = if case.side > 5 { 2 } else { seeds };
        let scores: Vec<(f64, f64, f64)> = (0..count).map(|seed| score(&case, seed)).collect();
        let mean = |of: fn(&(f64, f64, f64)) -> f64| {
            scores.iter().map(of).sum::<f64>() / scores.len() as f64
        };
        println!(
            "{name}: {:.1} % inside, rms {:.3} m/s (values {:.3}); each campaign {:?}",
            100.0 * mean(|one| one.0),
            mean(|one| one.1),
            mean(|one| one.2),
            scores.iter().map(|one| (100.0 * one.0).round()).collect::<Vec<_>>()
        );
    }
}
