//! All estimators of one record: those of the paper and the likelihood, on measured and on simulated
//! values alike.

use nalgebra::DMatrix;

use super::curve::exponential_with_nugget;
use super::field::Field;
use super::likelihood::{Blocks, Fitted, Likelihood, Unknown};
use super::space::{
    Class, Pairs, classes, common_seconds, correlations, length, medians, points, scored,
};
use super::time::{Counts, zero_time};

/// What the estimators need to know besides the values.
pub(super) struct Estimators {
    /// Gaps: 0 where there is a value, NaN where there is none; `None` without gaps.
    gaps: Option<DMatrix<f64>>,
    /// Seconds that pairs of drones have in common.
    shared: DMatrix<f64>,
    pub(super) all: Vec<Class>,
    pub(super) along_x: Vec<Class>,
    pub(super) along_y: Vec<Class>,
    counts: Counts,
    half_counts: Option<[Counts; 2]>,
    pub(super) blocks: Option<Blocks>,
    likelihood: Option<Likelihood>,
}

/// What they give; `None` where a curve has no best fit.
#[derive(Clone, Debug, Default)]
pub(super) struct Estimates {
    pub(super) medians: Vec<f64>,
    pub(super) lambda_m: Option<f64>,
    pub(super) lambda_x_m: Option<f64>,
    pub(super) lambda_y_m: Option<f64>,
    pub(super) nugget_lambda_m: Option<f64>,
    pub(super) t0_s: Option<f64>,
    pub(super) half_t0_s: [Option<f64>; 2],
    pub(super) model: Option<Fitted>,
}

impl Estimates {
    /// Mean t0 of the halves, s.
    pub(super) fn mean_half_s(&self) -> Option<f64> {
        let [first, second] = self.half_t0_s;
        Some(f64::midpoint(first?, second?))
    }
}

impl Estimators {
    /// For records with the places and gaps of a field.
    pub(super) fn new(field: &Field, unknown: Unknown) -> Self {
        let blocks = Blocks::of(field);
        Self {
            half_counts: Some(halves(&field.columns()).map(|half| Counts::of(&half))),
            likelihood: blocks.as_ref().map(|blocks| Likelihood::new(field, blocks, unknown)),
            blocks,
            ..Self::of_paper(field)
        }
    }

    /// Estimators of the paper alone: without halves of the record and without the likelihood.
    pub(super) fn of_paper(field: &Field) -> Self {
        let columns = field.columns();
        let shared = common_seconds(&columns);
        let of = |which| classes(field, &shared, which);
        let gaps = columns.map(|value| if value.is_finite() { 0.0 } else { f64::NAN });
        Self {
            all: of(Pairs::All),
            along_x: of(Pairs::AlongX),
            along_y: of(Pairs::AlongY),
            counts: Counts::of(&columns),
            half_counts: None,
            likelihood: None,
            blocks: None,
            gaps: gaps.iter().any(|gap| gap.is_nan()).then_some(gaps),
            shared,
        }
    }

    /// Correlation of every pair.
    pub(super) fn correlations(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        correlations(&scored(columns), &self.shared)
    }

    /// All estimates of a record; the search for the likelihood starts from a guess of length and
    /// time.
    pub(super) fn of(&self, mut columns: DMatrix<f64>, guess: (f64, f64)) -> Estimates {
        if let Some(gaps) = &self.gaps {
            columns += gaps;
        }
        let scored_values = scored(&columns);
        let matrix = correlations(&scored_values, &self.shared);
        let length_of =
            |classes: &[Class]| Some(length(classes, &medians(classes, &matrix), None)?.value);
        let all = medians(&self.all, &matrix);
        let nugget = exponential_with_nugget(&points(&self.all, &all, None));
        let t0 = |scored: &DMatrix<f64>, counts: &Counts| Some(zero_time(scored, counts)?.t0.value);
        let half_t0_s = self.half_counts.as_ref().map(|[first_counts, second_counts]| {
            let [first, second] = halves(&columns).map(|half| scored(&half));
            [t0(&first, first_counts), t0(&second, second_counts)]
        });
        let model = self.likelihood.as_ref().zip(self.blocks.as_ref());
        Estimates {
            lambda_m: length(&self.all, &all, None).map(|length| length.value),
            lambda_x_m: length_of(&self.along_x),
            lambda_y_m: length_of(&self.along_y),
            nugget_lambda_m: nugget.map(|(_, length)| length.value),
            t0_s: t0(&scored_values, &self.counts),
            half_t0_s: half_t0_s.unwrap_or_default(),
            model: model
                .and_then(|(likelihood, blocks)| likelihood.fit(&blocks.take(&columns), guess)),
            medians: all,
        }
    }
}

fn halves(columns: &DMatrix<f64>) -> [DMatrix<f64>; 2] {
    let half = columns.nrows() / 2;
    [columns.rows(0, half).into_owned(), columns.rows(columns.nrows() - half, half).into_owned()]
}
