//! The statistics of a map: every estimate, and simulated flights for its interval and its bias.

use rayon::prelude::*;

use super::curve::exponential_with_nugget;
use super::estimators::{Estimates, Estimators};
use super::field::{Field, FieldInput};
use super::likelihood::{Fitted, Unknown};
use super::paper;
use super::result::{
    Anisotropy, DistanceCorrelation, FieldModel, FieldStatistics, HalfRecord, Interval, NuggetFit,
    Reads, Scale, Simulated, SpaceCorrelation, TimeCorrelation, Treatment, Undetermined, Variant,
};
use super::simulate::{FieldScales, Simulator};
use super::space::{Class, described, length, medians, points};
use super::time::autocorrelation;
use super::words;
use crate::base::rng::{Purpose, stream};
use crate::numeric::{Moments, Sorted};

/// An interval needs this share of the simulated flights to have given an estimate. Chosen.
const FEWEST_SHARE: f64 = 0.8;

/// Options of the statistics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StatisticsOptions {
    /// Number of simulated flights for intervals and biases; 0: none.
    pub flights: usize,
    /// Seed of the simulated flights.
    pub seed: u64,
    /// Whether estimates are made of treated data ([`Variant`]) as well.
    pub variants: bool,
}

impl Default for StatisticsOptions {
    fn default() -> Self {
        Self { flights: 200, seed: 1, variants: true }
    }
}

/// The correlations of a map in space and time, with intervals from simulated flights.
///
/// What cannot be said is missing, and [`FieldStatistics::absent`] says why. Deterministic: the same
/// input and options give the same result on any number of threads.
pub fn field_statistics(input: &FieldInput, options: &StatisticsOptions) -> FieldStatistics {
    let mut absent = Vec::new();
    let field = match Field::new(input, &mut absent) {
        Ok(field) => field,
        Err(reason) => {
            absent.push(reason);
            return FieldStatistics { absent, ..FieldStatistics::default() };
        }
    };
    let record = field.record();
    let estimators = Estimators::new(&field, Unknown::default());
    let columns = field.columns();
    let guess = (record.extent_m, record.length_s / 10.0);
    let measured = estimators.of(columns.clone(), guess);
    let simulated = measured
        .model
        .as_ref()
        .map_or_else(Vec::new, |model| simulate(&field, &estimators, model, options));
    if measured.model.is_none() {
        absent.push(
            "no intervals: the likelihood of the field has no best fit (too few drones or blocks \
             without a gap)"
                .to_owned(),
        );
    }
    let flights = Flights { model: measured.model, estimates: &simulated };
    let matrix = estimators.correlations(&columns);
    let space = space(&estimators, &matrix, &flights, &mut absent);
    let time = time(autocorrelation(&columns), &measured, &flights, &record, &mut absent);
    let likelihood = measured.model.map(|model| field_model(&field, &estimators, &model, &flights));
    let made = Simulated {
        flights: simulated.len(),
        seed: options.seed,
        words: measured
            .model
            .map_or_else(String::new, |model| words::simulated(simulated.len(), &model, &record)),
    };
    let mut statistics = FieldStatistics {
        variants: if options.variants { variants(&field, &measured, guess) } else { Vec::new() },
        record,
        space: Some(space),
        time: Some(time),
        likelihood,
        simulated: (!simulated.is_empty()).then_some(made),
        absent,
        ..FieldStatistics::default()
    };
    words::fill(&mut statistics);
    statistics
}

/// Scales of the air as the paper estimates them; `None` where a curve has no best fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaperScales {
    /// Length over all pairs, m.
    pub lambda_m: Option<f64>,
    /// Length along x, m.
    pub lambda_x_m: Option<f64>,
    /// Length along y, m.
    pub lambda_y_m: Option<f64>,
    /// Correlation time, s.
    pub t0_s: Option<f64>,
}

/// The paper's estimates alone, without intervals: eqs. 8 and 9 and the curves of Fig. 6.
///
/// # Errors
///
/// Why there are none: too few drones, all in one place, a record that is too short.
pub fn paper_scales(input: &FieldInput) -> Result<PaperScales, String> {
    let field = Field::new(input, &mut Vec::new())?;
    let found = Estimators::of_paper(&field).of(field.columns(), (1.0, 1.0));
    Ok(PaperScales {
        lambda_m: found.lambda_m,
        lambda_x_m: found.lambda_x_m,
        lambda_y_m: found.lambda_y_m,
        t0_s: found.t0_s,
    })
}

/// Estimates of simulated flights: the same places, seconds, gaps and running mean.
fn simulate(
    field: &Field,
    estimators: &Estimators,
    model: &Fitted,
    options: &StatisticsOptions,
) -> Vec<Estimates> {
    let scales = FieldScales {
        sd_mps: model.sd_mps,
        length_m: [model.lambda_m; 2],
        tau_s: model.tau_s,
        noise_mps: model.noise_mps,
    };
    let Some(simulator) = Simulator::new(&field.places, scales, field.seconds, field.running)
    else {
        return Vec::new();
    };
    (0..options.flights as u64)
        .into_par_iter()
        .map(|flight| {
            let values = simulator.flight(&mut stream(options.seed, flight, Purpose::Resampling));
            estimators.of(values, (model.lambda_m, model.tau_s))
        })
        .collect()
}

/// The simulated flights and the field that they fly in.
struct Flights<'a> {
    model: Option<Fitted>,
    estimates: &'a [Estimates],
}

impl Flights<'_> {
    /// What an estimator gave, ascending; empty if too few flights gave anything.
    fn sorted(&self, of: impl Fn(&Estimates) -> Option<f64>) -> Vec<f64> {
        let mut values: Vec<f64> =
            self.estimates.iter().filter_map(of).filter(|value| value.is_finite()).collect();
        if (values.len() as f64) < FEWEST_SHARE * self.estimates.len() as f64 {
            values.clear();
        }
        Sorted::of(&mut values);
        values
    }

    /// An estimate with its interval: the ratio of estimate and truth is taken to scatter as in the
    /// simulated flights. Without a truth, their median stands for it.
    fn scale(
        &self,
        value: f64,
        fit_se: Option<f64>,
        truth: Option<f64>,
        of: impl Fn(&Estimates) -> Option<f64>,
    ) -> Scale {
        let sorted = self.sorted(of);
        let mut scale = Scale { value, fit_se, ..Scale::default() };
        if sorted.is_empty() {
            return scale.judged();
        }
        let at = |share: f64| Sorted::taken(&sorted).quantile(share).unwrap_or(f64::NAN);
        let truth = truth.unwrap_or_else(|| at(0.5));
        let interval = Interval { low: value * truth / at(0.975), high: value * truth / at(0.025) };
        scale.interval_95 =
            (interval.low.is_finite() && interval.high.is_finite()).then_some(interval);
        scale.reads = Some(Reads {
            truth,
            median: at(0.5),
            range_90: Interval { low: at(0.05), high: at(0.95) },
            flights: sorted.len(),
        });
        scale.judged()
    }

    fn truth(&self, of: impl Fn(&Fitted) -> f64) -> Option<f64> {
        self.model.as_ref().map(of)
    }
}

fn space(
    estimators: &Estimators,
    matrix: &nalgebra::DMatrix<f64>,
    flights: &Flights<'_>,
    absent: &mut Vec<String>,
) -> SpaceCorrelation {
    let truth = flights.truth(|model| model.lambda_m);
    let direction = |classes: &[Class], name: &str, of: &dyn Fn(&Estimates) -> Option<f64>| {
        if classes.len() < 2 {
            return Err(format!("no correlation {name}: the drones stand in no such lines"));
        }
        let mut found =
            DistanceCorrelation { classes: described(classes, matrix), ..Default::default() };
        let fitted = length(classes, &medians(classes, matrix), None);
        found.lambda_m = fitted.map(|fit| flights.scale(fit.value, Some(fit.se), truth, of));
        match found.lambda_m {
            Some(_) => Ok((found, None)),
            None => {
                Ok((found, Some(format!("no length {name}: the correlation does not fall off"))))
            }
        }
    };
    let mut keep = |found: Result<(DistanceCorrelation, Option<String>), String>| match found {
        Ok((found, note)) => {
            absent.extend(note);
            Some(found)
        }
        Err(reason) => {
            absent.push(reason);
            None
        }
    };
    let mut all =
        keep(direction(&estimators.all, "over distance", &|one| one.lambda_m)).unwrap_or_default();
    let mut along_x = keep(direction(&estimators.along_x, "along x", &|one| one.lambda_x_m));
    let mut along_y = keep(direction(&estimators.along_y, "along y", &|one| one.lambda_y_m));
    let pairs = [
        (Some(&mut all), paper::LAMBDA_M),
        (along_x.as_mut(), paper::LAMBDA_X_M),
        (along_y.as_mut(), paper::LAMBDA_Y_M),
    ];
    for (found, value) in pairs {
        if let Some(scale) = found.and_then(|found| found.lambda_m.as_mut()) {
            scale.paper = Some(value);
        }
    }
    weigh(&mut all, &estimators.all, flights);
    let medians: Vec<f64> = all.classes.iter().map(|class| class.median).collect();
    all.with_nugget =
        exponential_with_nugget(&points(&estimators.all, &medians, None)).map(|(c0, lambda)| {
            let of = |one: &Estimates| one.nugget_lambda_m;
            NuggetFit { c0, lambda_m: flights.scale(lambda.value, Some(lambda.se), truth, of) }
        });
    let anisotropy = anisotropy(along_x.as_ref(), along_y.as_ref(), flights);
    SpaceCorrelation { all, along_x, along_y, anisotropy, words: String::new() }
}

/// Errors of the medians from the simulated flights, and the fit weighted by them.
fn weigh(all: &mut DistanceCorrelation, classes: &[Class], flights: &Flights<'_>) {
    if flights.estimates.len() < 20 {
        return;
    }
    for (index, class) in all.classes.iter_mut().enumerate() {
        let values = flights.estimates.iter().filter_map(|one| one.medians.get(index));
        let scatter = Moments::of(values).and_then(|moments| moments.deviation());
        class.median_se = scatter.filter(|scatter| scatter.is_finite());
    }
    let weights: Vec<f64> =
        all.classes.iter().map(|class| class.median_se.map_or(0.0, |se| se.powi(-2))).collect();
    let medians: Vec<f64> = all.classes.iter().map(|class| class.median).collect();
    all.weighted_lambda_m = length(classes, &medians, Some(&weights)).map(|fit| {
        let of = |one: &Estimates| Some(length(classes, &one.medians, Some(&weights))?.value);
        flights.scale(fit.value, Some(fit.se), flights.truth(|model| model.lambda_m), of)
    });
}

fn anisotropy(
    along_x: Option<&DistanceCorrelation>,
    along_y: Option<&DistanceCorrelation>,
    flights: &Flights<'_>,
) -> Option<Anisotropy> {
    let value = |found: Option<&DistanceCorrelation>| Some(found?.lambda_m.as_ref()?.value);
    let ratio = value(along_y)? / value(along_x)?;
    let ratios = flights.sorted(|one| Some(one.lambda_y_m? / one.lambda_x_m?));
    let beyond = ratios.iter().filter(|one| one.ln().abs() >= ratio.ln().abs()).count();
    let p_value = (!ratios.is_empty()).then(|| (beyond + 1) as f64 / (ratios.len() + 1) as f64);
    Some(Anisotropy { ratio, p_value, words: String::new() })
}

fn time(
    mut found: TimeCorrelation,
    measured: &Estimates,
    flights: &Flights<'_>,
    record: &super::result::FieldRecord,
    absent: &mut Vec<String>,
) -> TimeCorrelation {
    match found.line.as_mut() {
        Some(line) => {
            let t0 = &line.t0_s;
            line.t0_s = Scale {
                paper: Some(paper::T0_S),
                ..flights.scale(t0.value, t0.fit_se, None, |one| one.t0_s)
            };
        }
        None => absent.push(
            "no t0: the autocorrelation has no zero crossing within half of the record".to_owned(),
        ),
    }
    let half = measured.mean_half_s().zip(measured.t0_s);
    found.half_record = half.map(|(half, whole)| {
        let ratios = flights.sorted(|one| Some(one.mean_half_s()? / one.t0_s?));
        let [first_t0_s, second_t0_s] = measured.half_t0_s;
        HalfRecord {
            length_s: (record.length_s / 2.0).floor(),
            first_t0_s,
            second_t0_s,
            ratio: half / whole,
            simulated_ratio: simulated_ratio(&ratios),
            words: String::new(),
        }
    });
    found
}

/// What a ratio that is truly 1 read in the simulated flights, ascending.
fn simulated_ratio(ratios: &[f64]) -> Option<Reads> {
    let at = |share: f64| Sorted::taken(ratios).quantile(share);
    Some(Reads {
        truth: 1.0,
        median: at(0.5)?,
        range_90: Interval { low: at(0.05)?, high: at(0.95)? },
        flights: ratios.len(),
    })
}

fn field_model(
    field: &Field,
    estimators: &Estimators,
    model: &Fitted,
    flights: &Flights<'_>,
) -> FieldModel {
    let scale = |of: &dyn Fn(&Fitted) -> f64| {
        flights.scale(of(model), None, Some(of(model)), |one| one.model.as_ref().map(of))
    };
    let mut warnings = Vec::new();
    if model.length_at_end {
        warnings.push(
            "the length ran into the end of the searched range: grid and record do not bound it"
                .to_owned(),
        );
    }
    if model.time_at_end {
        warnings.push(
            "the time ran into the end of the searched range: the record does not bound it"
                .to_owned(),
        );
    }
    let at_end = |mut scale: Scale, at_end: bool, middle: f64| {
        if at_end {
            let long = scale.value > middle;
            scale.undetermined =
                Some(if long { Undetermined::Longer } else { Undetermined::Shorter });
        }
        scale
    };
    let record = field.record();
    let blocks = estimators.blocks.as_ref();
    let drones = blocks.map_or(0, |blocks| blocks.drones.len());
    if drones < field.drones() {
        let left = field.drones() - drones;
        warnings.push(format!(
            "{} with gaps {} not in the likelihood",
            words::drones(left),
            words::are(left)
        ));
    }
    FieldModel {
        sd_mps: scale(&|model| model.sd_mps),
        lambda_m: at_end(scale(&|model| model.lambda_m), model.length_at_end, record.extent_m),
        tau_s: at_end(scale(&|model| model.tau_s), model.time_at_end, record.length_s / 2.0),
        nugget_mps: scale(&|model| model.noise_mps),
        log_likelihood: model.log_likelihood,
        drones,
        blocks: blocks.map_or(0, super::likelihood::Blocks::count),
        block_s: field.running as f64,
        warnings,
    }
}

fn variants(field: &Field, measured: &Estimates, guess: (f64, f64)) -> Vec<Variant> {
    let variant = |treatment: Treatment, one: &Estimates| Variant {
        treatment,
        lambda_m: one.lambda_m,
        lambda_x_m: one.lambda_x_m,
        lambda_y_m: one.lambda_y_m,
        t0_s: one.t0_s,
        likelihood_lambda_m: one.model.map(|model| model.lambda_m),
        likelihood_tau_s: one.model.map(|model| model.tau_s),
        likelihood_lambda_at_end: one.model.is_some_and(|model| model.length_at_end),
        likelihood_tau_at_end: one.model.is_some_and(|model| model.time_at_end),
    };
    let treated: Vec<Variant> =
        [Treatment::Detrended, Treatment::CommonRemoved, Treatment::DetrendedCommonRemoved]
            .into_par_iter()
            .map(|treatment| {
                let slope = treatment != Treatment::CommonRemoved;
                let common = treatment != Treatment::Detrended;
                let mut treated = field.clone();
                if slope {
                    treated = treated.detrended();
                }
                if common {
                    treated = treated.without_common();
                }
                let estimators = Estimators::new(field, Unknown { slope, common });
                variant(treatment, &estimators.of(treated.columns(), guess))
            })
            .collect();
    std::iter::once(variant(Treatment::AsMeasured, measured)).chain(treated).collect()
}
