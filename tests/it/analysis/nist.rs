//! The fit layer against the certified values of NIST's Statistical Reference Datasets for
//! nonlinear regression (public domain, files in `tests/nist/`).
//!
//! A case counts as solved when every parameter has at least 4 certified digits. Cases that the
//! algorithm does not solve from NIST's far start are listed, not skipped: when they begin to pass,
//! the test says so.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use updraft::analysis::fit::minimize;

type Model = fn(&[f64], &[f64]) -> f64;

/// y = f(b, x) for each file; Nelson's response is log y.
const MODELS: &[(&str, Model)] = &[
    ("Bennett5", |b, x| b[0] * (b[1] + x[0]).powf(-1.0 / b[2])),
    ("BoxBOD", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Chwirut1", |b, x| (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])),
    ("Chwirut2", |b, x| (-b[0] * x[0]).exp() / (b[1] + b[2] * x[0])),
    ("DanWood", |b, x| b[0] * x[0].powf(b[1])),
    ("ENSO", |b, x| {
        let year = 2.0 * PI * x[0] / 12.0;
        let (second, third) = (2.0 * PI * x[0] / b[3], 2.0 * PI * x[0] / b[6]);
        b[0] + b[1] * year.cos()
            + b[2] * year.sin()
            + b[4] * second.cos()
            + b[5] * second.sin()
            + b[7] * third.cos()
            + b[8] * third.sin()
    }),
    ("Eckerle4", |b, x| b[0] / b[1] * (-0.5 * ((x[0] - b[2]) / b[1]).powi(2)).exp()),
    ("Gauss1", gauss),
    ("Gauss2", gauss),
    ("Gauss3", gauss),
    ("Hahn1", cubic_ratio),
    ("Kirby2", |b, x| (b[0] + x[0] * (b[1] + x[0] * b[2])) / (1.0 + x[0] * (b[3] + x[0] * b[4]))),
    ("Lanczos1", lanczos),
    ("Lanczos2", lanczos),
    ("Lanczos3", lanczos),
    ("MGH09", |b, x| b[0] * (x[0] * x[0] + x[0] * b[1]) / (x[0] * x[0] + x[0] * b[2] + b[3])),
    ("MGH10", |b, x| b[0] * (b[1] / (x[0] + b[2])).exp()),
    ("MGH17", |b, x| b[0] + b[1] * (-x[0] * b[3]).exp() + b[2] * (-x[0] * b[4]).exp()),
    ("Misra1a", |b, x| b[0] * (1.0 - (-b[1] * x[0]).exp())),
    ("Misra1b", |b, x| b[0] * (1.0 - (1.0 + b[1] * x[0] / 2.0).powi(-2))),
    ("Misra1c", |b, x| b[0] * (1.0 - (1.0 + 2.0 * b[1] * x[0]).powf(-0.5))),
    ("Misra1d", |b, x| b[0] * b[1] * x[0] / (1.0 + b[1] * x[0])),
    ("Nelson", |b, x| b[0] - b[1] * x[0] * (-b[2] * x[1]).exp()),
    ("Rat42", |b, x| b[0] / (1.0 + (b[1] - b[2] * x[0]).exp())),
    ("Rat43", |b, x| b[0] / (1.0 + (b[1] - b[2] * x[0]).exp()).powf(1.0 / b[3])),
    ("Roszman1", |b, x| b[0] - b[1] * x[0] - (b[2] / (x[0] - b[3])).atan() / PI),
    ("Thurber", cubic_ratio),
];

fn gauss(b: &[f64], x: &[f64]) -> f64 {
    let peak = |height: f64, at: f64, width: f64| height * (-((x[0] - at) / width).powi(2)).exp();
    b[0] * (-b[1] * x[0]).exp() + peak(b[2], b[3], b[4]) + peak(b[5], b[6], b[7])
}

fn cubic_ratio(b: &[f64], x: &[f64]) -> f64 {
    (b[0] + x[0] * (b[1] + x[0] * (b[2] + x[0] * b[3])))
        / (1.0 + x[0] * (b[4] + x[0] * (b[5] + x[0] * b[6])))
}

fn lanczos(b: &[f64], x: &[f64]) -> f64 {
    (0..3).map(|i| b[2 * i] * (-b[2 * i + 1] * x[0]).exp()).sum()
}

struct Dataset {
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    errors: Vec<f64>,
    sum_of_squares: f64,
    y: Vec<f64>,
    x: Vec<Vec<f64>>,
}

fn read(name: &str) -> Dataset {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/nist/{name}.dat"));
    let text = fs::read_to_string(path).unwrap();
    let numbers = |line: &str| -> Vec<f64> {
        line.split_whitespace().filter_map(|word| word.parse().ok()).collect()
    };
    let mut set = Dataset {
        starts: [Vec::new(), Vec::new()],
        certified: Vec::new(),
        errors: Vec::new(),
        sum_of_squares: f64::NAN,
        y: Vec::new(),
        x: Vec::new(),
    };
    let mut in_data = false;
    for line in text.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if in_data {
            let row = numbers(line);
            if let Some((y, x)) = row.split_first().filter(|(_, x)| !x.is_empty()) {
                set.y.push(if name == "Nelson" { y.ln() } else { *y });
                set.x.push(x.to_vec());
            }
        } else if words.len() == 6 && words[0].starts_with('b') && words[1] == "=" {
            let row = numbers(line);
            set.starts[0].push(row[0]);
            set.starts[1].push(row[1]);
            set.certified.push(row[2]);
            set.errors.push(row[3]);
        } else if line.starts_with("Residual Sum of Squares:") {
            set.sum_of_squares = numbers(line)[0];
        } else if words.first() == Some(&"Data:")
            && words.get(1).is_some_and(|w| w.starts_with(['y', 'l']))
        {
            in_data = true;
        }
    }
    set
}

/// Certified digits in common, the usual log relative error.
fn digits(value: f64, certified: f64) -> f64 {
    if value == certified { 11.0 } else { -((value - certified).abs() / certified.abs()).log10() }
}

#[test]
fn nonlinear_reference_datasets() {
    let mut solved = 0;
    let mut unsolved = Vec::new();
    for (name, model) in MODELS {
        let set = read(name);
        assert!(!set.certified.is_empty() && set.y.len() > set.certified.len(), "{name}");
        for (index, start) in set.starts.iter().enumerate() {
            let fit = minimize(
                |b| set.x.iter().zip(&set.y).map(|(x, y)| y - model(b, x)).collect(),
                start,
            );
            let worst = fit.as_ref().map_or(0.0, |fit| {
                fit.parameters
                    .iter()
                    .zip(&set.certified)
                    .map(|(value, certified)| digits(*value, *certified))
                    .fold(f64::INFINITY, f64::min)
            });
            if worst < 4.0 {
                unsolved.push((*name, index + 1));
                continue;
            }
            solved += 1;
            // Lanczos1 is exact to 13 digits: its residuals are rounding, and so are their errors.
            if *name != "Lanczos1" {
                let fit = fit.unwrap();
                let errors = fit.scaled_errors().unwrap();
                for (error, certified) in errors.iter().zip(&set.errors) {
                    let digits = digits(*error, *certified);
                    assert!(digits > 4.0, "{name} start {}: error {error}", index + 1);
                }
                assert!(digits(fit.chi2, set.sum_of_squares) > 6.0, "{name}: chi2 {}", fit.chi2);
            }
        }
    }
    println!("{solved} of {} solved; not: {unsolved:?}", 2 * MODELS.len());
    assert_eq!(unsolved, [("BoxBOD", 1)], "the cases the algorithm is known to miss have changed");
}
