//! How far the air that a page has shown is from that of the logs.

use std::collections::BTreeMap;
use std::fmt;

use super::of_map::WIDTH;
use crate::numeric::{self, Line};

/// What a page has shown once.
#[derive(Clone, Debug)]
pub(super) struct Look {
    /// Show time that it was of, s.
    pub(super) time_s: f64,
    /// Value and standard error by slot, m/s.
    pub(super) of: BTreeMap<u16, (f64, f64)>,
}

/// Air of telemetry against that of the logs, at the same drones and seconds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Agreement {
    /// Number of values.
    pub(crate) values: usize,
    /// Correlation over drones and seconds; absent: one of them does not vary.
    pub(crate) correlation: Option<f64>,
    /// Mean of the page's values less those of the logs, m/s.
    pub(crate) bias_mps: f64,
    /// Half the width of the 95 % interval that the page stated, mean, m/s.
    pub(crate) stated_mps: f64,
    /// Share of the logs' values inside of the page's intervals.
    pub(crate) inside: f64,
}

impl Agreement {
    /// Agreement of looks with what the logs say of a slot at a show time, m/s; `None` if they have no value in
    /// common.
    pub(super) fn of(looks: &[Look], logged: &dyn Fn(u16, f64) -> Option<f64>) -> Option<Self> {
        let mut pairs = Vec::new();
        for look in looks {
            for (slot, (shown, error)) in &look.of {
                if let Some(logged) = logged(*slot, look.time_s) {
                    pairs.push((*shown, *error, logged));
                }
            }
        }
        let apart = || pairs.iter().map(|(shown, _, logged)| shown - logged);
        let within =
            pairs.iter().filter(|(shown, error, logged)| (shown - logged).abs() <= WIDTH * error);
        Some(Self {
            values: pairs.len(),
            correlation: Line::through(pairs.iter().map(|(shown, _, logged)| (*shown, *logged)))
                .and_then(|line| line.correlation()),
            bias_mps: numeric::mean(apart())?,
            stated_mps: WIDTH * numeric::mean(pairs.iter().map(|(_, error, _)| *error))?,
            inside: within.count() as f64 / pairs.len() as f64,
        })
    }
}

impl fmt::Display for Agreement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { values, correlation, bias_mps, stated_mps, inside } = self;
        let side = if *bias_mps < 0.0 { "low" } else { "high" };
        write!(f, "The page's air was {:.2} m/s too {side} on average", bias_mps.abs())?;
        write!(f, " (it stated +- {stated_mps:.2} m/s) by {values} values of the logs")?;
        if let Some(correlation) = correlation {
            write!(f, ", correlation {correlation:.2}")?;
        }
        write!(f, ", {:.0} % of them inside of its 95 % intervals", 100.0 * inside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look(time_s: f64, of: [f64; 2]) -> Look {
        let of = of.into_iter().zip(1..).map(|(value, slot)| (slot, (value, 0.1)));
        Look { time_s, of: of.collect() }
    }

    #[test]
    fn drones_and_seconds_are_compared_with_themselves() {
        let values = [[0.0, 1.0, 2.0], [0.5, 1.0, 2.5]];
        let logged = |slot: u16, time_s: f64| {
            values.get(usize::from(slot) - 1)?.get((time_s.round() - 10.0) as usize).copied()
        };
        let looks = [look(10.2, [-0.1, 0.4]), look(12.0, [1.9, 2.0]), look(99.0, [9.0, 9.0])];
        let found = Agreement::of(&looks, &logged).unwrap();
        assert_eq!(found.values, 4);
        // By hand: apart -0.1, -0.1, -0.1 and -0.5.
        assert!((found.bias_mps + 0.2).abs() < 1e-12, "{found:?}");
        assert!((found.stated_mps - 0.196).abs() < 1e-12 && found.inside == 0.75, "{found:?}");
        // numpy.corrcoef([-0.1, 0.4, 1.9, 2.0], [0.0, 0.5, 2.0, 2.5])
        let correlation = found.correlation.unwrap();
        assert!((correlation - 0.990_881_802).abs() < 1e-6, "{correlation}");
        assert_eq!(
            found.to_string(),
            "The page's air was 0.20 m/s too low on average (it stated +- 0.20 m/s) by 4 values of the \
             logs, correlation 0.99, 75 % of them inside of its 95 % intervals"
        );
        assert_eq!(Agreement::of(&looks[2..], &logged), None);
        assert_eq!(Agreement::of(&[look(11.0, [1.0, 1.0])], &logged).unwrap().correlation, None);
    }
}
