//! A compact formula for a free shape, if one describes it.

use super::dependence::Dependence;
use super::verdict::Shape;
use crate::numeric::mean;

/// A formula must describe this share of the shape's variance. Chosen.
const ENOUGH: f64 = 0.95;

/// A formula in plain text, for example `-12.3 sin(2 pi h / 31 m + 0.4) us`.
pub(super) fn formula(depends_on: Dependence, shape: &Shape) -> Option<String> {
    let (x, y) = (&shape.x, &shape.us);
    if x.len() < 5 {
        return None;
    }
    let (letter, _) = symbol(depends_on)?;
    let mut forms: Vec<(String, f64)> = Vec::new();
    let linear = [x.clone()];
    if let Some((beta, share)) = explained(&linear, y) {
        forms.push((format!("{:.3} {letter} us", beta[0]), share));
    }
    let square = [x.iter().map(|x| x * x).collect::<Vec<f64>>()];
    if let Some((beta, share)) = explained(&square, y) {
        forms.push((format!("{:.3} {letter}² us", beta[0]), share));
    }
    let signed = [x.iter().map(|x| x * x.abs()).collect::<Vec<f64>>()];
    if x.iter().any(|x| *x < 0.0)
        && let Some((beta, share)) = explained(&signed, y)
    {
        forms.push((format!("{:.3} {letter}|{letter}| us", beta[0]), share));
    }
    let span = x.last().zip(x.first()).map_or(0.0, |(last, first)| last - first);
    for step in 1..40 {
        let wave = span * 2.0 / f64::from(step).max(1.0);
        let phase = |of: fn(f64) -> f64| -> Vec<f64> {
            x.iter().map(|x| of(std::f64::consts::TAU * x / wave)).collect()
        };
        if wave < span / 10.0 {
            break;
        }
        if let Some((beta, share)) = explained(&[phase(f64::sin), phase(f64::cos)], y) {
            let size = beta[0].hypot(beta[1]);
            let lag = beta[1].atan2(beta[0]);
            // Two more numbers than a straight line: it must say clearly more.
            let text = format!("{size:.2} sin(2 pi {letter}/{wave:.1} {lag:+.2}) us");
            forms.push((text, share - 0.02));
        }
    }
    let jumps = x.iter().skip(1).map(|at| {
        let jump: Vec<f64> = x.iter().map(|x| if x < at { 0.0 } else { 1.0 }).collect();
        (*at, explained(&[jump], y))
    });
    for (at, fit) in jumps {
        if let Some((beta, share)) = fit {
            forms.push((format!("{:.2} us from {letter} = {at:.1}", beta[0]), share - 0.01));
        }
    }
    let best = forms.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (best.1 >= ENOUGH).then_some(best.0)
}

/// The letter by which formulas name what something depends on, and what that is in which unit; `None`: they have none for it.
pub(super) fn symbol(depends_on: Dependence) -> Option<(&'static str, &'static str)> {
    Some(match depends_on {
        Dependence::Climb => ("V", "the climb through the air in m/s"),
        Dependence::Height => ("h", "the height in m"),
        Dependence::Time | Dependence::Step => ("t", "the time since arming in s"),
        Dependence::Wind => ("v", "the horizontal air speed in m/s"),
        Dependence::Voltage => ("q", "the charge as a share"),
        _ => return None,
    })
}

/// Coefficients of one or two regressors beside a constant, and the share of variance explained.
fn explained(columns: &[Vec<f64>], y: &[f64]) -> Option<(Vec<f64>, f64)> {
    let centred = |values: &[f64]| -> Vec<f64> {
        let centre = mean(values).unwrap_or_default();
        values.iter().map(|value| value - centre).collect()
    };
    let y = centred(y);
    let columns: Vec<Vec<f64>> = columns.iter().map(|column| centred(column)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let total = dot(&y, &y);
    let beta = match &columns[..] {
        [one] => vec![dot(one, &y) / dot(one, one)],
        [one, two] => {
            let (aa, ab, bb) = (dot(one, one), dot(one, two), dot(two, two));
            let det = aa * bb - ab * ab;
            let (ya, yb) = (dot(one, &y), dot(two, &y));
            vec![(ya * bb - yb * ab) / det, (yb * aa - ya * ab) / det]
        }
        _ => return None,
    };
    let gone: f64 = beta.iter().zip(&columns).map(|(b, column)| b * dot(column, &y)).sum();
    let share = gone / total;
    share.is_finite().then_some((beta, share))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shape(of: impl Fn(f64) -> f64) -> Shape {
        let x: Vec<f64> = (0..40).map(|index| f64::from(index) * 2.0).collect();
        let us = x.iter().map(|x| of(*x)).collect();
        Shape { axis: String::new(), x, us }
    }

    #[test]
    fn known_shapes_have_their_formulas() {
        let line = formula(Dependence::Height, &shape(|x| 0.5 * x - 3.0)).unwrap();
        assert_eq!(line, "0.500 h us");
        let wave =
            formula(Dependence::Height, &shape(|x| 4.0 * (std::f64::consts::TAU * x / 31.2).sin()));
        assert!(wave.unwrap().contains("sin(2 pi h/31.2"), "a sinusoid");
        let step = formula(Dependence::Step, &shape(|x| if x < 30.0 { 1.0 } else { 6.0 })).unwrap();
        assert_eq!(step, "5.00 us from t = 30.0");
    }
}
