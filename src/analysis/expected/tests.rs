use nalgebra::Vector3;

use super::*;
use crate::base::rng::{Purpose as Chance, stream};
use crate::mission::resolve::{Override, resolve};
use crate::sim::air::{Atmosphere as _, FieldScales, RandomField};

fn plan(template: &str, overrides: &[&str]) -> Plan {
    let overrides: Vec<Override> =
        overrides.iter().map(|text| Override::parse(text).unwrap()).collect();
    resolve(template, &overrides).unwrap().flights.remove(0).plan
}

#[test]
fn one_drone_has_the_errors_of_lenschow() {
    let plan = plan("hover", &["grid.rows=1", "grid.columns=1", "duration_s=611"]);
    let air = AssumedAir { integral_s: Some(30.0), sd_mps: Some(0.5) };
    let found = expected_errors(&plan, None, air).unwrap();
    assert!((found.measured_s - 600.0).abs() < 1e-9 && found.heights == 1, "{found:?}");
    assert!((found.integral_s - 30.0).abs() < 1e-9);
    // sd (2T/t)^(1/2) less what the record's ends take: 0.158 less 2.5 %; (2T/t)^(1/2) of a square of half the time.
    assert!((found.mean_mps.drone - 0.154).abs() < 1e-3, "{:?}", found.mean_mps);
    assert!((found.variance.drone - 0.312).abs() < 2e-3, "{:?}", found.variance);
    assert!((found.variance_to_tenth_s.drone - 6_000.0).abs() < 1e-6);
    // The fleet of one is that one.
    for (fleet, drone) in [
        (found.mean_mps.fleet, found.mean_mps.drone),
        (found.variance.fleet, found.variance.drone),
        (found.variance_to_tenth_s.fleet, found.variance_to_tenth_s.drone),
    ] {
        assert!((fleet / drone - 1.0).abs() < 0.02, "{fleet} {drone}");
    }
    assert!(found.covariances.is_empty() && found.zero_mps.is_none());
}

#[test]
fn drones_apart_tell_more_and_drones_together_do_not() {
    let of = |spacing: &str| {
        expected_errors(&plan("hover", &[spacing]), None, AssumedAir::default()).unwrap()
    };
    let (close, far) = (of("grid.spacing_m=1"), of("grid.spacing_m=500"));
    assert!(close.mean_mps.fleet > 0.95 * close.mean_mps.drone, "{close:?}");
    // 49 drones that see different eddies.
    assert!(far.mean_mps.fleet < 0.3 * far.mean_mps.drone, "{far:?}");
    assert!(far.variance.fleet < 0.3 * far.variance.drone, "{far:?}");
    let [near, corner] = &close.covariances[..] else { panic!("{:?}", close.covariances) };
    assert!(near.share > 0.98 && near.distance_m == 1.0 && corner.share < near.share);
    // The covariance of what is the same is the variance.
    assert!((near.error / close.variance.drone - 1.0).abs() < 0.03, "{near:?} {close:?}");
}

#[test]
fn every_measurement_template_has_its_errors_and_a_calibration_gives_the_zero() {
    let calibration = plan("calibration", &[]);
    assert_eq!(expected_errors(&calibration, None, AssumedAir::default()), None);
    for template in ["hover", "scan", "cross", "column", "profile", "race-track"] {
        let found =
            expected_errors(&plan(template, &[]), Some(&calibration), AssumedAir::default());
        let found = found.unwrap();
        assert!(found.variance.fleet < found.variance.drone, "{template}: {found:?}");
        let zero = found.zero_mps.unwrap();
        assert!(zero.fleet < zero.drone && zero.fleet > 0.02, "{template}: {zero:?}");
        assert_eq!(found.heights, if template == "column" { 4 } else { 1 }, "{template}");
        assert_eq!(found.speed_mps > 0.5, ["scan", "profile", "race-track"].contains(&template));
    }
}

/// Standard deviation of values about their mean.
fn sd(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}

/// Drawn air over a fleet, and what its means, variances and covariances scatter by from draw to draw.
#[test]
fn drawn_air_scatters_as_expected() {
    const DRAWS: u64 = 200;
    const LENGTH_S: f64 = 300.0;
    let air = AssumedAir { integral_s: Some(12.0), sd_mps: Some(1.0) };
    let scales = Scales::of(air, 20.0, 0.0);
    let places_m: Vec<[f64; 2]> =
        (0..9).map(|index| [30.0 * f64::from(index % 3), 30.0 * f64::from(index / 3)]).collect();
    // The wind of the drawn air is along x.
    let separations = Separations::of(&places_m, &[0.0]);
    let expected = errors(&scales, &separations, LENGTH_S);
    let (mut means, mut fleet_means) = (Vec::new(), Vec::new());
    let (mut variances, mut fleet_variances) = (Vec::new(), Vec::new());
    for seed in 0..DRAWS {
        let drawn = FieldScales {
            sd_mps: 1.0,
            length_m: Vector3::repeat(scales.length_m),
            time_s: 1.0 / scales.decay_per_s,
            wind_mps: Vector3::new(scales.past_mps, 0.0, 0.0),
            waves: 2_400,
        };
        let field = RandomField::new(&drawn, &mut stream(seed, 0, Chance::Air));
        let records: Vec<Vec<f64>> = places_m
            .iter()
            .map(|[x, y]| {
                let at = |second: i32| {
                    field.air_velocity(&Vector3::new(*x, *y, 20.0), 3.0 * f64::from(second)).z
                };
                (0..100).map(at).collect()
            })
            .collect();
        let mean = |record: &Vec<f64>| record.iter().sum::<f64>() / record.len() as f64;
        // About the air's own mean, which is zero.
        let square = |record: &Vec<f64>| {
            record.iter().map(|value| value * value).sum::<f64>() / record.len() as f64
        };
        let of_fleet = |of: &dyn Fn(&Vec<f64>) -> f64| records.iter().map(of).sum::<f64>() / 9.0;
        means.push(mean(&records[0]));
        fleet_means.push(of_fleet(&mean));
        variances.push(square(&records[0]));
        fleet_variances.push(of_fleet(&square));
    }
    // 200 draws tell a standard deviation to 5 %: three of these, and what steps of 3 s and a sum of waves add.
    for (what, expected, drawn) in [
        ("mean of one", expected.mean_mps.drone, sd(&means)),
        ("mean of the fleet", expected.mean_mps.fleet, sd(&fleet_means)),
        ("variance of one", expected.variance.drone, sd(&variances)),
        ("variance of the fleet", expected.variance.fleet, sd(&fleet_variances)),
    ] {
        let ratio = drawn / expected;
        assert!((0.85..1.18).contains(&ratio), "{what}: {drawn} where {expected} is expected");
    }
}
