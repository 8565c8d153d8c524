//! Tests of a calibration: what it says of the air, by rotors that are no polynomials and drones that stand in a gradient.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution as _, StandardNormal};

use super::calibration::{Calibration, Component};
use super::covariance::{Air, Form};
use super::data::{Drone, Value};
use super::make::{Input, Posterior, posterior};
use super::moving_tests::{CASE, Case, Field};
use crate::analysis::air_prior::Record;
use crate::analysis::corrections::DOUBTS;
use crate::analysis::shape::PARAMETERS;
use crate::analysis::zero::{CellAt, Windows};
use crate::base::rng::{Purpose, stream};

pub(super) const SLOPE_US: f64 = 25.0;

/// Windows at these places; `beside_us` is what their pulses have besides the fleet's law.
pub(super) fn windows(
    cells: Vec<CellAt>,
    noise_us: f64,
    beside_us: impl Fn(&CellAt) -> f64,
) -> Windows {
    let n = cells.len();
    let design = DMatrix::from_fn(n + 2, PARAMETERS, |row, column| match cells.get(row) {
        Some(CellAt { climb_mps: speed, .. }) => {
            [1.0, *speed, speed * speed, speed * speed.abs()][column]
        }
        None => f64::from(u8::from(column == row - n + 2)),
    });
    let parameters = vec![1546.5, SLOPE_US, 0.0, 0.0];
    let mut pulse_us = &design * DVector::from_column_slice(&parameters);
    for (pulse_us, cell) in pulse_us.iter_mut().zip(&cells) {
        *pulse_us += beside_us(cell);
    }
    let record = Record {
        design,
        pulse_us,
        noise_us: (0..n + 2).map(|row| if row < n { noise_us } else { 1.5 }).collect(),
        sensitivity: (0..n + 2).map(|row| if row < n { SLOPE_US } else { 0.0 }).collect(),
        time_s: cells.iter().map(|cell| cell.time_s).collect(),
        doubts_us: Vec::new(),
        windows: n,
    };
    Windows { record, cells, parameters }
}

/// The paper's ladder: up, a hover, down, a hover, faster and higher from rung to rung.
fn ladder() -> Vec<CellAt> {
    let rung = |rung: u32| {
        let (start_s, speed_mps) = (60.0 * f64::from(rung), 0.5 * f64::from(rung));
        let top_m = 20.0 + 10.0 * f64::from(rung);
        [(0.0, 20.0, 0.0), (19.0, 0.7, speed_mps), (30.0, 1.0, 0.0), (49.0, 0.3, -speed_mps)].map(
            |(after_s, share, climb_mps)| CellAt {
                time_s: start_s + after_s,
                span_s: if climb_mps == 0.0 { 6.0 } else { 9.0 },
                height_m: if after_s == 0.0 { 20.0 } else { 20.0 + share * (top_m - 20.0) },
                climb_mps,
                drones: 25,
            },
        )
    };
    (1..=7).flat_map(rung).collect()
}

pub(super) fn homes_m() -> Vec<[f64; 2]> {
    (0..25).map(|index| [10.0 * f64::from(index % 5), 10.0 * f64::from(index / 5)]).collect()
}

pub(super) fn air(length_m: f64) -> Air {
    Air {
        form: Form::Gaussian,
        sd_mps: 0.5,
        length_m,
        stretch: [0.0; 2],
        time_s: 263.0,
        drift_mps: [0.0; 2],
        gust_mps: 0.0,
        gust_s: 4.0,
        shared_mps: 0.0,
        slow_mps: 0.01,
    }
}

/// How a rotor differs from a polynomial of the fleet's law: half a microsecond more in slow climbs and descents.
fn bump_us(cell: &CellAt) -> f64 {
    let speed_mps = cell.climb_mps.abs();
    -0.6 * speed_mps * (-0.5 * (speed_mps / 1.2).powi(2)).exp()
}

#[test]
fn what_a_rotor_has_besides_its_law_is_not_taken_for_air_that_changes_with_height() {
    let homes_m = homes_m();
    let explains = |windows: &Windows, length_m: f64| {
        let calibration = Calibration::new(windows, &homes_m, SLOPE_US);
        let all = calibration.components(&air(length_m));
        all.iter().map(|component| component.log_weight).fold(f64::NEG_INFINITY, f64::max)
    };
    // Air of 200 m and more, which changes little over the ladder and its heights.
    let slow_us = |cell: &CellAt| {
        SLOPE_US * 0.3 * (cell.time_s / 250.0).sin() + SLOPE_US * 0.003 * cell.height_m
    };
    let flown = windows(ladder(), 0.15, |cell| slow_us(cell) + bump_us(cell));
    let [short, long] = [80.0, 205.0].map(|length_m| explains(&flown, length_m));
    assert!(long > short, "{long:.1} {short:.1}");
    // The zero is that of the hovers.
    let calibration = Calibration::new(&flown, &homes_m, SLOPE_US);
    let plain = windows(ladder(), 0.15, slow_us);
    let without = Calibration::new(&plain, &homes_m, SLOPE_US);
    let zero_us =
        |calibration: &Calibration<'_>| calibration.known(&[air(205.0)]).unwrap().shift[0];
    let moved_us = zero_us(&calibration) - zero_us(&without);
    assert!(moved_us.abs() < 0.25, "{moved_us:.2}");
}

/// Standard error of the zero over all that is left open, and of a drone's own constant, m/s.
fn errors_mps(windows: &Windows, air: &Air) -> [f64; 2] {
    let homes_m = homes_m();
    let calibration = Calibration::new(windows, &homes_m, SLOPE_US);
    let all = calibration.components(air);
    let most = all.iter().map(|one| one.log_weight).fold(f64::NEG_INFINITY, f64::max);
    let weighed = || all.iter().map(|one| ((one.log_weight - most).exp(), one));
    let sum: f64 = weighed().map(|(weight, _)| weight).sum();
    let mean = weighed().map(|(weight, one)| weight * one.shift[0]).sum::<f64>() / sum;
    let of = |one: &Component| one.covariance[(0, 0)] + (one.shift[0] - mean).powi(2);
    let variance = weighed().map(|(weight, one)| weight * of(one)).sum::<f64>() / sum;
    [variance.sqrt() / SLOPE_US, calibration.own_mps(air)]
}

#[test]
fn a_calibration_on_a_calm_morning_knows_its_zero_whatever_moves_in_the_hover() {
    let moving = Air { gust_mps: 0.3, ..air(145.0) };
    let moved_us = |cell: &CellAt| SLOPE_US * 0.4 * (cell.time_s / 60.0).sin();
    let [calm, moved] = [windows(ladder(), 0.15, |_| 0.0), windows(ladder(), 0.15, moved_us)]
        .map(|windows| errors_mps(&windows, &moving));
    assert!(calm[0] < 0.03 && calm[1] < 0.02, "{calm:?}");
    // In air like the hover's it does not.
    assert!(moved[0] > 0.15 && moved[1] > 0.04, "{moved:?}");
}

#[test]
fn a_plane_of_constants_is_the_calibration_s() {
    let mut rng = stream(5, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let field = Field::new(&Case { length_m: 205.0, time_s: 200.0, ..CASE }, &mut normal);
    let mut law = [0.0; PARAMETERS];
    law[0] = 1.0 / SLOPE_US;
    let flown = |is_known: bool| -> Vec<Drone> {
        homes_m()
            .into_iter()
            .map(|[x, y]| {
                let value = |second: u32| {
                    let truth_mps = field.at([x, y, 60.0], f64::from(second));
                    Some(Value {
                        updraft_mps: truth_mps + 0.004 * x - 0.003 * y,
                        law,
                        doubts_mps: [0.0; DOUBTS],
                        own_mps: 0.03,
                        noise_mps: 0.02,
                    })
                };
                Drone {
                    place_m: vec![[x, y, 60.0]],
                    calibrated_m: is_known.then_some([x, y]),
                    values: (0..300).map(value).collect(),
                    ..Drone::default()
                }
            })
            .collect()
    };
    // Of air as strong as the hover's: that of a calmer day would not tilt the constants so.
    let windows = windows(ladder(), 0.15, |cell| SLOPE_US * 0.7 * (cell.time_s / 150.0).sin());
    let homes_m = homes_m();
    // How far the map slopes the wrong way, m/s from the middle to a corner.
    let slopes_mps = |is_known: bool| {
        let drones = flown(is_known);
        let input = Input {
            drones: &drones,
            lost_m: &[],
            seconds: 300,
            calibration: Calibration::new(&windows, &homes_m, SLOPE_US),
            wind_mps: Some([0.0; 2]),
        };
        let map = posterior(&input).unwrap();
        let mean = |corner: [f64; 2]| {
            let index = homes_m.iter().position(|at| *at == corner).unwrap();
            let truths = (0..300).map(|s| field.at([corner[0], corner[1], 60.0], f64::from(s)));
            let (mean_mps, se_mps) = map.drones[index].over_all.unwrap();
            (mean_mps - truths.sum::<f64>() / 300.0, se_mps)
        };
        let ((one, se_mps), (other, _)) = (mean([40.0, 0.0]), mean([0.0, 40.0]));
        (0.5 * (one - other), se_mps)
    };
    let ((known, se_mps), (unknown, _)) = (slopes_mps(true), slopes_mps(false));
    assert!(known.abs() < 0.7 * unknown.abs(), "{known:.3} {unknown:.3}");
    assert!(known.abs() < 2.0 * se_mps, "{known:.3} {se_mps:.3}");
}

#[test]
fn two_drones_that_hover_have_no_map_of_the_air() {
    let homes_m = homes_m();
    let windows = windows(ladder(), 0.15, |_| 0.0);
    let has_map = |count: usize| {
        let value = Value {
            updraft_mps: 0.0,
            law: [1.0 / SLOPE_US, 0.0, 0.0, 0.0],
            doubts_mps: [0.0; DOUBTS],
            own_mps: 0.03,
            noise_mps: 0.02,
        };
        let drone = |[x, y]: &[f64; 2]| Drone {
            place_m: vec![[*x, *y, 60.0]],
            values: vec![Some(value); 300],
            ..Drone::default()
        };
        let drones: Vec<Drone> = homes_m.iter().take(count).map(drone).collect();
        let calibration = Calibration::new(&windows, &homes_m, SLOPE_US);
        let input =
            Input { drones: &drones, lost_m: &[], seconds: 300, calibration, wind_mps: None };
        posterior(&input).is_some()
    };
    assert!(!has_map(1) && !has_map(2));
    assert!(has_map(3));
}

#[test]
fn air_that_differs_from_drone_to_drone_and_lasts_is_air() {
    let mut rng = stream(12, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let homes_m: Vec<[f64; 2]> =
        (0..9).map(|index| [7.0 * f64::from(index % 3), 7.0 * f64::from(index / 3)]).collect();
    let windows = windows(ladder(), 0.15, |_| 0.0);
    let truths_mps: Vec<f64> = homes_m.iter().map(|_| 0.4 * normal()).collect();
    let mut drone = |([x, y], truth_mps): (&[f64; 2], &f64)| {
        let mut value = || Value {
            updraft_mps: truth_mps + 0.01 * normal(),
            law: [1.0 / SLOPE_US, 0.0, 0.0, 0.0],
            doubts_mps: [0.0; DOUBTS],
            own_mps: 0.01,
            noise_mps: 0.01,
        };
        Drone {
            place_m: vec![[*x, *y, 60.0]],
            values: (0..120).map(|_| Some(value())).collect(),
            ..Drone::default()
        }
    };
    let drones: Vec<Drone> = homes_m.iter().zip(&truths_mps).map(&mut drone).collect();
    let calibration = Calibration::new(&windows, &homes_m, SLOPE_US);
    let input = Input { drones: &drones, lost_m: &[], seconds: 120, calibration, wind_mps: None };
    let map = posterior(&input).unwrap();
    // Without their mean, which may be the zero's.
    let found: Vec<f64> = map.drones.iter().map(|one| one.over_all.unwrap().0).collect();
    let mean = |values: &[f64]| values.iter().sum::<f64>() / 9.0;
    for (found_mps, truth_mps) in found.iter().zip(&truths_mps) {
        let error_mps = (found_mps - mean(&found)) - (truth_mps - mean(&truths_mps));
        assert!(error_mps.abs() < 0.1, "{found:.2?} {truths_mps:.2?}");
    }
}

/// A fleet over which all air rises alike; the calibration's zero, in still air, is off by the doubt of a wind.
fn rises_mps(updraft_mps: f64, doubt_mps: f64) -> Posterior {
    let mut rng = stream(9, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let homes_m = homes_m();
    let windows = windows(ladder(), 0.15, |_| 0.0);
    let mut doubts_mps = [0.0; DOUBTS];
    doubts_mps[0] = doubt_mps;
    let drones: Vec<Drone> = homes_m
        .iter()
        .map(|[x, y]| {
            let own_mps = 0.005 * normal();
            let value = |_| {
                Some(Value {
                    updraft_mps: updraft_mps + own_mps + 0.005 * normal(),
                    law: [1.0 / SLOPE_US, 0.0, 0.0, 0.0],
                    doubts_mps,
                    own_mps: 0.005,
                    noise_mps: 0.005,
                })
            };
            Drone {
                place_m: vec![[*x, *y, 60.0]],
                calibrated_m: Some([*x, *y]),
                values: (0..120).map(value).collect(),
                ..Drone::default()
            }
        })
        .collect();
    let calibration = Calibration::new(&windows, &homes_m, SLOPE_US);
    let input = Input { drones: &drones, lost_m: &[], seconds: 120, calibration, wind_mps: None };
    posterior(&input).unwrap()
}

#[test]
fn air_that_rises_everywhere_alike_is_within_the_map_s_interval() {
    for (updraft_mps, doubt_mps) in [(1.0, 0.02), (-0.8, 0.02), (1.0, 0.5), (-1.0, 0.3)] {
        let map = rises_mps(updraft_mps, doubt_mps);
        let (mean_mps, se_mps) = map.fleet_mps.unwrap();
        println!(
            "{updraft_mps} {doubt_mps}: {mean_mps:.3} {se_mps:.3} {:.2}",
            map.uniform_probability
        );
        assert!((mean_mps - updraft_mps).abs() < 1.96 * se_mps, "{mean_mps:.3} {se_mps:.3}");
    }
}
