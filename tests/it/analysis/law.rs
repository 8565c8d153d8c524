//! The fits of the laws against synthetic truth, above all the paper's Table II: a linear truth
//! with window errors of 15 us looks, fitted with the signed-quadratic law, as the paper's field
//! flights do (scattered W, reduced chi² of 2).

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "this is test code")]

use rand::Rng;
use rand_distr::{Distribution, Normal};
use updraft::analysis::law::{
    ErrorScale, Law, LawKind, LawPoint, linear, signed_quadratic, signed_quadratic_held,
};
use updraft::base::rng::{Purpose, stream};

/// The 14 moving windows of the calibration ladder.
fn rungs() -> impl Iterator<Item = f64> {
    (1..=7).flat_map(|rung| [0.5 * f64::from(rung), -0.5 * f64::from(rung)])
}

fn points(law: Law, noise_us: f64, random: &mut impl Rng) -> Vec<LawPoint> {
    let noise = Normal::new(0.0, noise_us).unwrap();
    rungs()
        .map(|velocity_mps| LawPoint {
            velocity_mps,
            pulse_us: law.pulse_us(velocity_mps) + noise.sample(random),
            sigma_us: noise_us.max(0.1),
            velocity_sigma_mps: 0.0,
        })
        .collect()
}

#[derive(Default)]
struct Statistics(Vec<f64>);

impl Statistics {
    /// Mean and standard deviation, checked against those of a published fleet of 42 drones to
    /// within twice that fleet's own sampling errors.
    fn check(&self, what: &str, mean: f64, sd: f64) {
        let n = self.0.len() as f64;
        let found = self.0.iter().sum::<f64>() / n;
        let variance = self.0.iter().map(|v| (v - found).powi(2)).sum::<f64>() / (n - 1.0);
        let found_sd = variance.sqrt();
        println!("{what}: {found:.2} ± {found_sd:.2} (expected {mean} ± {sd})");
        assert!((found - mean).abs() <= 2.0 * sd / 42.0_f64.sqrt(), "{what}: mean {found}");
        assert!((found_sd - sd).abs() <= 2.0 * sd / 84.0_f64.sqrt(), "{what}: sd {found_sd}");
    }
}

#[test]
fn a_linear_truth_reproduces_the_papers_table_ii() {
    let drones = 2000_u32;
    let mut random = stream(20, 1, Purpose::Resampling);
    let (slopes, hovers) = (Normal::new(26.4, 1.9).unwrap(), Normal::new(1546.5, 6.7).unwrap());
    let [mut a, mut u0, mut w, mut nu, mut slope, mut hover, mut nu_linear] =
        [(); 7].map(|()| Statistics::default());
    let mut far = 0;
    for _ in 0..drones {
        let truth =
            Law::Linear { slope: slopes.sample(&mut random), u0_us: hovers.sample(&mut random) };
        let points = points(truth, 15.0, &mut random);
        let quadratic = signed_quadratic(&points, ErrorScale::Unscaled).unwrap();
        let line = linear(&points, ErrorScale::Unscaled).unwrap();
        a.0.push(quadratic.parameters[0].estimate.value);
        u0.0.push(quadratic.parameters[1].estimate.value);
        w.0.push(quadratic.parameters[2].estimate.value);
        far += u32::from(quadratic.parameters[2].estimate.value.abs() > 3.0);
        let said =
            quadratic.warnings.iter().any(|one| one.to_string().contains("no minimum inside"));
        let edge = said.then_some(quadratic.parameters[2].estimate.value);
        assert_eq!(quadratic.w_beyond_mps, edge, "an edge is marked, and nothing else is");
        assert!(edge.is_none_or(|edge| edge.abs() == 8.0), "{edge:?}");
        nu.0.push(quadratic.chi2_reduced.unwrap());
        slope.0.push(line.parameters[0].estimate.value);
        hover.0.push(line.parameters[1].estimate.value);
        nu_linear.0.push(line.chi2_reduced.unwrap());
    }
    println!("{far} of {drones} with |W| > 3 m/s");
    a.check("A", 8.2, 2.2);
    w.check("W", -0.1, 2.8);
    u0.check("u0", 1545.0, 39.0);
    nu.check("chi2_nu", 2.12, 0.82);
    slope.check("A'", 26.5, 2.6);
    hover.check("u0 of the line", 1546.1, 8.0);
    nu_linear.check("chi2_nu of the line", 1.03, 0.40);
    assert!((0.05..0.2).contains(&(f64::from(far) / f64::from(drones))), "{far} far minima");
}

#[test]
fn an_exact_law_is_recovered_to_the_last_digits() {
    let truth = Law::SignedQuadratic { a: 8.14, u0_us: 1598.6, w_mps: -0.035 };
    let mut random = stream(1, 1, Purpose::Resampling);
    let mut points = points(truth, 0.0, &mut random);
    for point in &mut points {
        point.velocity_sigma_mps = 0.01;
    }
    let fit = signed_quadratic(&points, ErrorScale::Unscaled).unwrap();
    let values: Vec<f64> = fit.parameters.iter().map(|p| p.estimate.value).collect();
    assert!((values[0] - 8.14).abs() < 1e-6, "{values:?}");
    assert!((values[1] - 1598.6).abs() < 1e-6, "{values:?}");
    assert!((values[2] + 0.035).abs() < 1e-6, "{values:?}");
    assert!(fit.other_minima.is_empty() && fit.warnings.is_empty(), "{:?}", fit.warnings);
    assert_eq!(Law::from_fit(&fit).unwrap().kind(), LawKind::SignedQuadratic);

    let held = signed_quadratic_held(&points, 8.14, 1598.6, ErrorScale::Unscaled).unwrap();
    assert!((held.parameters[2].estimate.value + 0.035).abs() < 1e-9);
    assert!(held.parameters[0].held && held.parameters[1].held && !held.parameters[2].held);
    assert_eq!(held.dof, 13);
    assert_eq!(&held.covariance[..8], &[0.0; 8], "held parameters have no covariance");
}

#[test]
fn strong_updrafts_are_found_with_the_law_held() {
    for step in -7..=7 {
        let w_mps = 0.5 * f64::from(step);
        let truth = Law::SignedQuadratic { a: 8.14, u0_us: 1598.6, w_mps };
        let points = points(truth, 0.3, &mut stream(2, 1, Purpose::Resampling));
        let fit = signed_quadratic_held(&points, 8.14, 1598.6, ErrorScale::Unscaled).unwrap();
        let w = fit.parameters[2].estimate;
        assert!((w.value - w_mps).abs() < 4.0 * w.se && w.se < 0.01, "{w_mps}: {w}");
    }
}

#[test]
fn errors_cover_the_truth_as_often_as_they_say() {
    let truth = Law::SignedQuadratic { a: 8.0, u0_us: 1600.0, w_mps: 0.3 };
    let mut random = stream(3, 1, Purpose::Resampling);
    let mut inside = [0; 3];
    let rounds = 500;
    for _ in 0..rounds {
        let fit = signed_quadratic(&points(truth, 2.0, &mut random), ErrorScale::Unscaled).unwrap();
        for (count, (parameter, truth)) in
            inside.iter_mut().zip(fit.parameters.iter().zip([8.0, 1600.0, 0.3]))
        {
            *count += usize::from((parameter.estimate.value - truth).abs() < parameter.estimate.se);
        }
    }
    for count in inside {
        let share = count as f64 / f64::from(rounds);
        assert!((0.60..0.77).contains(&share), "one sigma covers {share}, not 0.683");
    }
}

#[test]
fn a_line_is_reported_as_the_wrong_shape() {
    let truth = Law::Linear { slope: 26.4, u0_us: 1546.5 };
    let points = points(truth, 0.0, &mut stream(4, 1, Purpose::Resampling));
    let fit = signed_quadratic(&points, ErrorScale::Unscaled).unwrap();
    assert!(fit.warnings.iter().any(|w| w.to_string().contains("beyond the searched")), "{fit:?}");
    // physics: a line projected onto x|x| has A = A' sum |V|³ / sum V⁴
    let (cubes, fourths) = rungs()
        .fold((0.0, 0.0), |(cubes, fourths), v| (cubes + v.abs().powi(3), fourths + v.powi(4)));
    let ratio = fit.parameters[0].estimate.value / (26.4 * cubes / fourths);
    assert!((ratio - 1.0).abs() < 0.1, "{ratio} {fit:?}");
}

#[test]
fn both_inverses_return_the_air_velocity() {
    for law in [
        Law::SignedQuadratic { a: 8.0, u0_us: 1600.0, w_mps: 0.0 },
        Law::Linear { slope: 26.4, u0_us: 1546.5 },
    ] {
        for velocity in [-7.0, -0.2, 0.0, 0.4, 3.5] {
            let back = law.air_velocity_mps(law.pulse_us(velocity));
            assert!((back - velocity).abs() < 1e-6, "{law:?} {velocity} {back}");
        }
    }
}

/// ISA density ratio to sea level (the stock simulator's atmosphere).
fn density_ratio(amsl_m: f64) -> f64 {
    let kelvin = 288.15 - 0.0065 * amsl_m;
    let pascal = 101_325.0 * (288.15 / kelvin).powf(-5.255_877);
    pascal / (287.053 * kelvin) / 1.225
}

#[test]
fn density_along_the_ladder_explains_table_i() {
    // The stock simulator's steady law: 8.0552 us/(m/s)² of drag, 586.6 us of thrust at sea level
    // density. Climbs are measured higher than descents, in thinner air: that widens A and fakes a
    // downdraft. Table I has A 8.207 ± 0.020, u0 1598.656 ± 0.039, W -0.0589 ± 0.0031.
    let home_amsl_m = 190.0;
    let points: Vec<LawPoint> = rungs()
        .map(|velocity_mps| {
            // Mean height in the window from 10 s to 19 s of a 20 s leg, from 20 m or from its top.
            let speed = velocity_mps.abs();
            let above = if velocity_mps > 0.0 { 14.5 * speed } else { 20.0 * speed - 14.5 * speed };
            let thrust = 586.6 / density_ratio(home_amsl_m + 20.0 + above);
            let drag = 8.0552 * velocity_mps * speed;
            let pulse_us = 1000.0 + thrust + drag;
            LawPoint { velocity_mps, pulse_us, sigma_us: 0.3, velocity_sigma_mps: 0.0 }
        })
        .collect();
    let fit = signed_quadratic(&points, ErrorScale::Scaled).unwrap();
    let [a, u0, w] = [0, 1, 2].map(|index| fit.parameters[index].estimate);
    println!("A {a}  u0 {u0}  W {w}");
    assert!((a.value - 8.14).abs() < 0.01, "{a}");
    assert!((u0.value - 1598.6).abs() < 0.2, "{u0}");
    assert!((w.value + 0.035).abs() < 0.003, "{w}");
}

#[test]
fn a_law_from_few_windows_claims_little() {
    let law = Law::Linear { slope: 26.4, u0_us: 1546.5 };
    let few = |n: usize| {
        let mut random = stream(1, 1, Purpose::Resampling);
        points(law, 1.0, &mut random).into_iter().take(n).collect::<Vec<_>>()
    };
    for scale in [ErrorScale::Unscaled, ErrorScale::Scaled] {
        let two = linear(&few(2), scale).unwrap();
        assert_eq!((two.dof, two.chi2_reduced), (0, None));
        assert!(two.parameters.iter().all(|p| p.estimate.se == 0.0), "no error is known");
        assert!(
            two.warnings.iter().any(|w| w.to_string().contains("no errors can be given")),
            "{two:?}"
        );
        let three = linear(&few(3), scale).unwrap();
        assert!(three.parameters.iter().all(|p| p.estimate.se > 0.0));
        assert!(
            three.warnings.iter().any(|w| w.to_string().contains("only 3 windows")),
            "{three:?}"
        );
        assert!(linear(&few(4), scale).unwrap().warnings.is_empty());
    }
}
