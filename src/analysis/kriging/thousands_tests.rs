//! Maps of hundreds and thousands of drones that hover: how far neighbours that stand for all values are from all values, and
//! what such a map costs.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution as _, StandardNormal};

use super::calibration::Calibration;
use super::calibration_tests::{SLOPE_US, windows as flown_windows};
use super::covariance::{Air, Covariance, Form};
use super::data::{COMMON, Drone, Rows, UNIFORM, Value};
use super::make::{Input, posterior};
use super::moving_tests::{CASE, Field};
use super::neighbours::{Reach, before};
use super::predict::{Linear, Model};
use super::scales::Search;
use super::vecchia::{Common, CommonVector};
use crate::analysis::corrections::DOUBTS;
use crate::analysis::shape::PARAMETERS;
use crate::analysis::zero::{CellAt, Windows};
use crate::base::rng::{Purpose, stream};

const SPACING_M: f64 = 10.0;
const NOISE_MPS: f64 = 0.03;
const OWN_MPS: f64 = 0.04;
const ZERO_MPS: f64 = 0.1;

fn place_m(side: usize, index: usize) -> [f64; 3] {
    [SPACING_M * (index % side) as f64, SPACING_M * (index / side) as f64, 60.0]
}

/// Drones with their values, and the true means, in a field of 0.5 m/s and no gusts.
fn flown(side: usize, seconds: usize, seed: u64) -> (Vec<Drone>, Vec<Vec<f64>>) {
    let mut rng = stream(seed, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let field = Field::new(&CASE, &mut normal);
    let zero = ZERO_MPS * normal();
    let mut law = [0.0; PARAMETERS];
    law[0] = 1.0 / SLOPE_US;
    (0..side * side)
        .map(|index| {
            let own = OWN_MPS * normal();
            let place_m = place_m(side, index);
            // The field hardly changes within the 10 s of a mean.
            let truth: Vec<f64> =
                (0..seconds).map(|second| field.at(place_m, second as f64)).collect();
            let value = |truth: &f64| {
                Some(Value {
                    updraft_mps: zero + own + truth + NOISE_MPS * normal(),
                    law,
                    doubts_mps: [0.0; DOUBTS],
                    own_mps: OWN_MPS,
                    noise_mps: NOISE_MPS,
                })
            };
            let values = truth.iter().map(value).collect();
            let drone = Drone { place_m: vec![place_m], values, ..Drone::default() };
            (drone, truth)
        })
        .unzip()
}

const AIR: Air = Air {
    form: Form::Gaussian,
    sd_mps: 0.5,
    length_m: 60.0,
    stretch: [0.0; 2],
    time_s: 100.0,
    drift_mps: [0.0; 2],
    gust_mps: 0.0,
    gust_s: 4.0,
    slow_mps: 0.0,
    shared_mps: 0.0,
};

/// A prior of the zero, as a calibration leaves it.
fn zero_factor() -> Common {
    let mut factor = Common::zeros();
    factor[(0, 0)] = ZERO_MPS * SLOPE_US;
    factor
}

#[test]
fn neighbours_stand_for_all_values() {
    let (drones, _) = flown(10, 120, 7);
    let rows = Rows::of(&drones, 5, 10);
    let n = rows.list.len();
    let covariance = Covariance::new(AIR);
    let factor = zero_factor();
    // With all values at once.
    let of_air = DMatrix::from_fn(n, n, |row, column| {
        covariance.of(&rows.list[row].spot, &rows.list[column].spot)
    });
    let common = DMatrix::from_fn(n, COMMON, |row, column| rows.list[row].common[column]);
    let spread = &common * DMatrix::from_fn(COMMON, COMMON, |row, column| factor[(row, column)]);
    let mut of_values = &of_air + &spread * spread.transpose();
    for row in 0..n {
        for column in 0..n {
            if rows.list[row].spot.drone == rows.list[column].spot.drone {
                of_values[(row, column)] += OWN_MPS * OWN_MPS;
            }
        }
        of_values[(row, row)] += rows.list[row].noise_mps.powi(2);
    }
    let values = DVector::from_fn(n, |row, _| rows.list[row].value_mps);
    let solved = of_values.cholesky().unwrap();
    let expected = &of_air * solved.solve(&values);
    let left = &of_air - &of_air * solved.solve(&of_air);
    // By neighbours.
    let reach = Reach { beside: 7, step: 7, own: 2 };
    let all = before(&drones, &rows, reach);
    let own_mps = vec![OWN_MPS; drones.len()];
    let search = Search {
        rows: &rows,
        neighbours: &all,
        whole: None,
        coarse: None,
        own_mps: &own_mps,
        slope_share: 0.0,
        wind_mps: None,
        factor,
        lasting_mps: 0.0,
    };
    let system = search.system_in(&covariance).unwrap();
    let posterior = system.posterior(&CommonVector::zeros(), &factor).unwrap();
    let (own, answers) = system.own();
    let linear = Linear {
        mean: posterior.mean,
        covariance: posterior.covariance,
        own,
        answers,
        own_covariance: system.own_covariance(),
    };
    assert_eq!(linear.mean[UNIFORM], 0.0);
    let model = Model { drones: &drones, covariance, linear };
    let sites: Vec<(Option<usize>, [f64; 3])> =
        (0..drones.len()).map(|index| (Some(index), drones[index].place_m[0])).collect();
    let map = model.at(&sites, 120);
    let (mut squares, mut variances, mut stated) = (0.0, 0.0, 0.0);
    for (index, row) in rows.list.iter().enumerate() {
        let (drone, second) = (row.spot.drone.unwrap(), row.spot.time_s as usize);
        squares += (map[drone].mean_mps[second].unwrap() - expected[index]).powi(2) / n as f64;
        variances += left[(index, index)] / n as f64;
        stated += map[drone].sd_mps[second].unwrap().powi(2) / n as f64;
    }
    let (apart, dense, stated) = (squares.sqrt(), variances.sqrt(), stated.sqrt());
    println!("apart {apart:.4} m/s; error of the dense answer {dense:.4}, stated {stated:.4}");
    assert!(apart < 0.02, "{apart}");
    assert!((0.9..1.2).contains(&(stated / dense)), "{stated} {dense}");
}

/// A calibration of seven speeds up and down.
fn windows() -> Windows {
    let speeds = (1..=7).flat_map(|rung| [0.5, -0.5].map(|speed| speed * f64::from(rung)));
    let cell = |(index, climb_mps)| CellAt {
        time_s: 30.0 * index as f64,
        span_s: 9.0,
        height_m: 50.0,
        climb_mps,
        drones: 16,
    };
    flown_windows(speeds.enumerate().map(cell).collect(), 1.5, |_| 0.0)
}

#[test]
#[ignore = "a minute: UPDRAFT_SIDE=71 cargo test --release --lib kriging::thousands -- --ignored --nocapture"]
fn thousands_of_drones() {
    let side = std::env::var("UPDRAFT_SIDE").ok().and_then(|text| text.parse().ok()).unwrap_or(71);
    let seconds =
        std::env::var("UPDRAFT_SECONDS").ok().and_then(|text| text.parse().ok()).unwrap_or(600);
    let (drones, truths) = flown(side, seconds, 11);
    let windows = windows();
    let homes_m: Vec<[f64; 2]> =
        drones.iter().map(|drone| [drone.place_m[0][0], drone.place_m[0][1]]).collect();
    let input = Input {
        drones: &drones,
        lost_m: &[],
        seconds,
        calibration: Calibration::new(&windows, &homes_m, SLOPE_US),
        wind_mps: Some([0.0; 2]),
    };
    let map = posterior(&input).unwrap();
    let (mut count, mut inside, mut squares, mut bias) = (0.0, 0.0, 0.0, 0.0);
    for (series, truth) in map.drones.iter().zip(&truths) {
        for (second, truth) in truth.iter().enumerate() {
            let (Some(mean), Some(sd)) = (series.mean_mps[second], series.sd_mps[second]) else {
                continue;
            };
            count += 1.0;
            inside += f64::from(u8::from((mean - truth).abs() < 1.96 * sd));
            squares += (mean - truth).powi(2);
            bias += mean - truth;
        }
    }
    println!(
        "{} drones, {seconds} s: rms {:.3} m/s, bias {:.3}, {:.1} % inside; {:?}",
        drones.len(),
        f64::sqrt(squares / count),
        bias / count,
        100.0 * inside / count,
        map.air
    );
    assert!(count > 0.9 * (drones.len() * seconds) as f64);
}
