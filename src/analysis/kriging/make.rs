//! The posterior map of a flight.

use nalgebra::{DMatrix, Matrix2};

use super::adequacy::{Adequacy, judge};
use super::calibration::{Calibration, Component, factor};
use super::covariance::{Air, Covariance};
use super::data::{Drone, GRADIENT, Rows, UNIFORM};
use super::grid::{Grid, grid};
use super::moving;
use super::neighbours::{Neighbours, Reach, before};
use super::predict::{Linear, Model, Series};
use super::sampling::{Drawn, Sampled, samples};
use super::scales::{
    COARSE, FINE, Found, LN_LENGTH, LN_TIME, Search, UNIFORM_MPS, Whole, log_prior, open_factor,
};
use super::thermals::{Record, Thermal};
use super::vecchia::{Common, CommonVector, Posterior as Solved, System, innovations};
use crate::analysis::corrections::DOUBTS;
use crate::analysis::running::RUNNING_S;
use crate::analysis::shape::PARAMETERS;
use crate::numeric::rms;

/// What the likelihood conditions on.
const REACH: Reach = Reach { beside: 7, step: 7, own: 2 };
/// Standard deviations to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Fewer values than this, one in 10 s of each drone, say nothing about scales. Chosen.
const FEWEST: usize = 24;
/// Fewer drones than this that hover say nothing about lengths: of one or two, 1 to 80 % of the values were inside of intervals that
/// said 95 (docs/errors.md).
const FEWEST_DRONES: usize = 3;
/// Probability that there is an updraft which is everywhere and always the same, before the values are seen.
/// Over level ground there is none in the long run; slopes and waves have one. Chosen: with 0.2 this possibility alone made
/// the stated error of a field with known scales and gusts a fifth larger (docs/errors.md).
const UNIFORM_SHARE: f64 = 0.05;
/// A drone's constant in the search for scales, besides what its calibration says, m/s: what air in the calibration
/// leaves, before its scales are known.
const OWN_MPS: f64 = 0.08;

/// A gradient of the drones' constants in the search for scales, m/s per m: likewise.
const GRADIENT_MPS_PER_M: f64 = 0.005;

/// A flight's values with its calibration.
pub(in super::super) struct Input<'a> {
    /// Drones with values.
    pub(in super::super) drones: &'a [Drone],
    /// Places without a log, show frame, m.
    pub(in super::super) lost_m: &'a [[f64; 3]],
    /// Seconds of the record.
    pub(in super::super) seconds: usize,
    pub(in super::super) calibration: Calibration<'a>,
    /// Mean wind along show x and y, m/s.
    pub(in super::super) wind_mps: Option<[f64; 2]>,
}

/// One scale of the air: the most probable value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Scale {
    pub(in super::super) value: f64,
    pub(in super::super) interval: [f64; 2],
}

/// The map with what was found on the way.
#[derive(Clone, Debug)]
pub(in super::super) struct Posterior {
    /// At the drones.
    pub(in super::super) drones: Vec<Series>,
    /// At the places without a log.
    pub(in super::super) lost: Vec<Series>,
    /// Between them; `None` for fleets that move.
    pub(in super::super) grid: Option<Grid>,
    /// Mean over all drones and seconds with its standard error, m/s.
    pub(in super::super) fleet_mps: Option<(f64, f64)>,
    pub(in super::super) air: Air,
    pub(in super::super) length_m: Scale,
    pub(in super::super) time_s: Scale,
    pub(in super::super) adequacy: Adequacy,
    /// What is added to all values, m/s: how far the zero moved.
    pub(in super::super) zero_shift_mps: f64,
    /// Probability of an updraft that is everywhere the same.
    pub(in super::super) uniform_probability: f64,
    pub(in super::super) thermals: Vec<Thermal>,
}

/// One choice of everything that is not linear, with what follows.
pub(super) struct Choice {
    log_weight: f64,
    solved: Solved,
    is_uniform: bool,
}

/// The posterior map; `None` with too few values, or where none of the scales fits at all.
pub(in super::super) fn posterior(input: &Input<'_>) -> Option<Posterior> {
    let step = RUNNING_S as usize;
    let first = (input.seconds.saturating_sub(1) % step) / 2;
    let rows = Rows::of(input.drones, first, step);
    let moves = input.drones.iter().any(|drone| !drone.hovers());
    if rows.list.len() < FEWEST || !moves && input.drones.len() < FEWEST_DRONES {
        return None;
    }
    let all = before(input.drones, &rows, if moves { moving::REACH } else { REACH });
    let roughly: Vec<f64> =
        input.drones.iter().map(|drone| drone.own_mps().hypot(OWN_MPS)).collect();
    let slope_share = rms(input.drones.iter().map(|drone| drone.own_slope_share)).unwrap_or(0.0);
    let (fine, coarse) =
        (Whole::of(input.drones, &rows, FINE), Whole::of(input.drones, &rows, COARSE));
    let search = Search {
        rows: &rows,
        neighbours: &all,
        whole: Some(&fine),
        coarse: Some(&coarse),
        own_mps: &roughly,
        slope_share,
        wind_mps: input.wind_mps,
        factor: open_factor(&prior_factor(None, false)),
    };
    let mut forms = search.all();
    let mut search = search;
    if let (true, None) = (moves, input.wind_mps) {
        search.wind_mps = moving::drift(&search, forms.first()?);
        if search.wind_mps.is_some() {
            forms = search.all();
        }
    }
    let found = forms.first()?;
    let record = Record { search: &search, drones: input.drones, found, wind_mps: input.wind_mps };
    let thermals = record.thermals();
    let own_of = |air: &Air| -> Vec<f64> {
        // Air that each drone met alone in its calibration is in its constant.
        let own = input.calibration.own_mps(air);
        input.drones.iter().map(|drone| drone.own_mps().max(own)).collect()
    };
    let components = |air: &Air| input.calibration.components(air);
    let sampled: Vec<(&Found, Sampled<Vec<Choice>>)> =
        forms.iter().map(|found| (found, sampled(&search, found, &components, &own_of))).collect();
    let found = sampled
        .iter()
        .max_by(|a, b| a.1.ln_evidence.total_cmp(&b.1.ln_evidence))
        .map_or(found, |(found, _)| found);
    let air = search.air(found.form, &found.best);
    let own_mps = own_of(&air);
    let search = Search { own_mps: &own_mps, ..search };
    let (length_m, time_s) = (averaged(&sampled, LN_LENGTH), averaged(&sampled, LN_TIME));
    let search = Search { whole: None, ..search };
    let system = search.system(found.form, &found.best)?;
    let (mean, covariance, uniform_probability) = over_all(&sampled)?;
    let (own, answers) = system.own();
    let linear = Linear { mean, covariance, own, answers, own_covariance: system.own_covariance() };
    let model =
        Model { drones: input.drones, covariance: Covariance::new(air).shown(slope_share), linear };
    let adequacy = adequate(&model, &rows, &all);
    let mut sites: Vec<(Option<usize>, [f64; 3])> = (0..input.drones.len())
        .map(|index| (Some(index), input.drones[index].place_at(0).unwrap_or_default()))
        .collect();
    sites.extend(input.lost_m.iter().map(|place_m| (None, *place_m)));
    let mut drones = model.at(&sites, input.seconds);
    let lost = drones.split_off(input.drones.len());
    for (series, drone) in drones.iter_mut().zip(input.drones) {
        series.keep_near(drone);
        series.doubt_slope(drone.slope_share);
    }
    let zero_shift_mps = shift(&model, &rows);
    Some(Posterior {
        grid: grid(&model, input.lost_m, first),
        fleet_mps: model.fleet(&rows),
        drones,
        lost,
        air,
        length_m,
        time_s,
        adequacy,
        zero_shift_mps,
        uniform_probability,
        thermals,
    })
}

/// What the values allow of the scales of one form, with what each choice of them says about everything linear.
pub(super) fn sampled(
    search: &Search<'_>,
    found: &Found,
    components: &(dyn Fn(&Air) -> Vec<Component> + Sync),
    own_of: &dyn Fn(&Air) -> Vec<f64>,
) -> Sampled<Vec<Choice>> {
    let own_mps = own_of(&search.air(found.form, &found.best));
    let search = Search { own_mps: &own_mps, ..*search };
    samples(found, |point| {
        let system = search.system(found.form, point)?;
        let choices = choices(&system, &components(&search.air(found.form, point)));
        let log_likelihood = log_sum(choices.iter().map(|choice| choice.log_weight));
        Some((log_likelihood + log_prior(point), choices))
    })
}

/// Factor of the common errors' covariance: a component's law (none: not known), the doubts, and a uniform
/// updraft or none.
pub(super) fn prior_factor(component: Option<&Component>, is_uniform: bool) -> Common {
    let mut prior = Common::zeros();
    if let Some(component) = component {
        let law = factor(&component.covariance);
        for row in 0..law.nrows().min(PARAMETERS) {
            for column in 0..law.ncols().min(PARAMETERS) {
                prior[(row, column)] = law[(row, column)];
            }
        }
    }
    for doubt in PARAMETERS..PARAMETERS + DOUBTS {
        prior[(doubt, doubt)] = 1.0;
    }
    let unknown = Matrix2::identity() * GRADIENT_MPS_PER_M.powi(2);
    let gradient = component.map_or(unknown, |component| component.gradient);
    let gradient = factor(&DMatrix::from_column_slice(2, 2, gradient.as_slice()));
    prior.view_mut((GRADIENT, GRADIENT), (2, 2)).copy_from(&gradient);
    prior[(UNIFORM, UNIFORM)] = if is_uniform { UNIFORM_MPS } else { 0.0 };
    prior
}

/// All choices of the calibration's air and of a uniform updraft, for one choice of the scales.
fn choices(system: &System, components: &[Component]) -> Vec<Choice> {
    let mut found = Vec::new();
    for component in components {
        let mut mean = CommonVector::zeros();
        mean.iter_mut().zip(component.shift).for_each(|(mean, shift)| *mean = shift);
        for (is_uniform, share) in [(false, 1.0 - UNIFORM_SHARE), (true, UNIFORM_SHARE)] {
            let Some(solved) = system.posterior(&mean, &prior_factor(Some(component), is_uniform))
            else {
                continue;
            };
            let log_weight = solved.log_likelihood + component.log_weight + share.ln();
            if log_weight.is_finite() {
                found.push(Choice { log_weight, solved, is_uniform });
            }
        }
    }
    found
}

/// Logarithm of a sum of exponentials.
fn log_sum(logs: impl Iterator<Item = f64> + Clone) -> f64 {
    let most = logs.clone().fold(f64::NEG_INFINITY, f64::max);
    most + logs.map(|log| (log - most).exp()).sum::<f64>().ln()
}

/// Mean and covariance of the common errors over all choices, and the weight of a uniform updraft.
fn mixed<'a>(
    samples: impl Iterator<Item = (f64, &'a [Choice])>,
) -> Option<(CommonVector, Common, f64)> {
    let weighed: Vec<(f64, &Choice)> = samples
        .flat_map(|(weight, choices)| {
            let sum = log_sum(choices.iter().map(|choice| choice.log_weight));
            choices.iter().map(move |choice| (weight * (choice.log_weight - sum).exp(), choice))
        })
        .collect();
    if weighed.is_empty() {
        return None;
    }
    let mut mean = CommonVector::zeros();
    for (weight, choice) in &weighed {
        mean += choice.solved.mean * *weight;
    }
    let mut covariance = Common::zeros();
    for (weight, choice) in &weighed {
        let off = choice.solved.mean - mean;
        covariance += (choice.solved.covariance + off * off.transpose()) * *weight;
    }
    let uniform =
        weighed.iter().filter(|(_, choice)| choice.is_uniform).map(|(weight, _)| weight).sum();
    (mean.iter().all(|value| value.is_finite())).then_some((mean, covariance, uniform))
}

/// What all points of all forms say of the common errors: mean, covariance, and the weight of a uniform updraft.
pub(super) fn over_all(
    sampled: &[(&Found, Sampled<Vec<Choice>>)],
) -> Option<(CommonVector, Common, f64)> {
    mixed(weighed(sampled).map(|(weight, drawn)| (weight, drawn.kept.as_slice())))
}

/// All points of all forms, which weigh by their evidence; weights add up to one.
fn weighed<'a>(
    sampled: &'a [(&Found, Sampled<Vec<Choice>>)],
) -> impl Iterator<Item = (f64, &'a Drawn<Vec<Choice>>)> {
    let all = log_sum(sampled.iter().map(|(_, sampled)| sampled.ln_evidence));
    sampled.iter().flat_map(move |(_, sampled)| {
        let share = (sampled.ln_evidence - all).exp();
        sampled.drawn.iter().map(move |drawn| (share * drawn.weight, drawn))
    })
}

/// A scale that is searched as a logarithm, over all points and forms: its mean, and 1.96 standard deviations to each side,
/// of which one is that of the points on this side.
fn averaged(sampled: &[(&Found, Sampled<Vec<Choice>>)], index: usize) -> Scale {
    let points: Vec<(f64, f64)> =
        weighed(sampled).map(|(weight, drawn)| (weight, drawn.point[index])).collect();
    let mean: f64 = points.iter().map(|(weight, value)| weight * value).sum();
    let side = |sign: f64| {
        let beyond = || points.iter().filter(move |(_, value)| sign * (value - mean) > 0.0);
        let weight: f64 = beyond().map(|(weight, _)| weight).sum();
        let squares: f64 = beyond().map(|(weight, value)| weight * (value - mean).powi(2)).sum();
        if weight > 0.0 { (squares / weight).sqrt() } else { 0.0 }
    };
    let interval = [mean - NORMAL * side(-1.0), mean + NORMAL * side(1.0)];
    Scale { value: mean.exp(), interval: interval.map(f64::exp) }
}

fn adequate(model: &Model<'_>, rows: &Rows, neighbours: &Neighbours) -> Adequacy {
    let left: Vec<f64> = rows
        .list
        .iter()
        .map(|row| model.left(row.spot.drone, &row.common, row.value_mps))
        .collect();
    let innovations = innovations(rows, neighbours, &model.covariance, &left);
    let drones: Vec<usize> = rows.list.iter().map(|row| row.spot.drone.unwrap_or(0)).collect();
    judge(&innovations, &drones)
}

/// How far the common errors move the values on average, m/s.
fn shift(model: &Model<'_>, rows: &Rows) -> f64 {
    let mut mean = model.linear.mean;
    mean[UNIFORM] = 0.0;
    let moved = rows.list.iter().map(|row| -CommonVector::from(row.common).dot(&mean));
    crate::numeric::mean(moved).unwrap_or(0.0)
}
