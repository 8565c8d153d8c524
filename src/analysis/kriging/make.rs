//! The posterior map of a flight.

use nalgebra::{DMatrix, Matrix2};

use super::adequacy::{Adequacy, judge};
use super::calibration::{Calibration, Component, factor};
use super::covariance::{Air, Covariance};
use super::data::{Drone, GRADIENT, Rows, UNIFORM};
use super::grid::Grid;
use super::moving;
use super::neighbours::{Neighbours, Reach, before};
use super::predict::{Linear, Model, Series};
use super::predicted::{Predicted, Sites};
use super::sampling::{Drawn, Sampled, samples};
use super::scales::{
    COARSE, FINE, Found, LN_LENGTH, LN_TIME, Search, UNIFORM_MPS, Whole, log_prior, open_factor,
};
use super::scatter::Scatter;
use super::thermals::{Record, Thermal, asides, less};
use super::vecchia::{Common, CommonVector, Posterior as Solved, System, innovations};
use crate::analysis::corrections::DOUBTS;
use crate::analysis::running::RUNNING_S;
use crate::analysis::shape::PARAMETERS;
use crate::numeric::{log_sum, mean, rms};

/// Seconds between rows, which share none.
const STEP: usize = RUNNING_S as usize;
/// What the likelihood conditions on.
const REACH: Reach = Reach { beside: 7, step: 7, own: 2 };
/// Standard deviations to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Fewer values than this, one in 10 s of each drone, say nothing about scales. Chosen.
const FEWEST: usize = 24;
/// Fewer drones than this that hover say nothing about lengths: of one or two, 1 to 80 % of the values were inside of intervals that
/// said 95 (docs/errors.md).
const FEWEST_DRONES: usize = 3;
/// Probability that there is an updraft which is everywhere and always the same, before the values are seen, in air that
/// moves. Over level ground there is none in the long run. Chosen: with 0.2 this possibility alone made
/// the stated error of a field with known scales and gusts a fifth larger (docs/errors.md).
const UNIFORM_SHARE: f64 = 0.05;
/// The same in air that is still otherwise, which slopes, waves and fans make: there is no other updraft. Chosen.
const UNIFORM_SHARE_STILL: f64 = 0.8;
/// Air that moves by this is between the two, m/s. Chosen.
const STILL_MPS: f64 = 0.2;
/// A drone's constant in the search for scales, besides what its calibration says, m/s: what air in the calibration
/// leaves, before its scales are known.
const OWN_MPS: f64 = 0.08;

/// A gradient of the drones' constants in the search for scales, m/s per m: likewise.
const GRADIENT_MPS_PER_M: f64 = 0.005;
/// Drones' means that lie apart by so many times what their constants explain are asked of air that lasts. Chosen: a fleet of nine
/// has it by chance less than once in a hundred.
const LASTING: f64 = 1.75;
/// What a field that moves must explain values by, nats: it has a strength, a length and a time (5 % of a chi-square of three
/// degrees of freedom).
const MOVES_NATS: f64 = 4.0;
/// A field that is none, m/s.
const NO_FIELD_MPS: f64 = 1e-4;

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
    /// Whether the values show air that moves at all: what they scatter by may be their errors, and then there are no scales.
    pub(in super::super) moves: bool,
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
    let values = Values::of(input, input.drones)?;
    let (search, families) = values.scales(input.wind_mps)?;
    let found = families.first()?;
    let record = Record { search: &search, drones: input.drones, found, wind_mps: input.wind_mps };
    let thermals = record.thermals();
    if thermals.is_empty() {
        return mapped(input, &values, &search, &families, thermals);
    }
    // A thermal is no part of a stationary field: what is left without it is.
    let rest = less(input.drones, &thermals);
    let values = Values::of(input, &rest)?;
    let (search, families) = values.scales(input.wind_mps)?;
    mapped(input, &values, &search, &families, thermals)
}

/// Values with what their likelihood needs.
struct Values<'a> {
    drones: &'a [Drone],
    /// Second of the first rows.
    first: usize,
    rows: Rows,
    neighbours: Neighbours,
    fine: Whole,
    coarse: Whole,
    roughly_mps: Vec<f64>,
    slope_share: f64,
    moves: bool,
}

impl<'a> Values<'a> {
    /// `None` if there are too few.
    fn of(input: &Input<'_>, drones: &'a [Drone]) -> Option<Self> {
        let first = (input.seconds.saturating_sub(1) % STEP) / 2;
        let rows = Rows::of(drones, first, STEP);
        let moves = drones.iter().any(|drone| !drone.hovers());
        if rows.list.len() < FEWEST || !moves && drones.len() < FEWEST_DRONES {
            return None;
        }
        let own_slopes = drones.iter().map(|drone| drone.own_slope_share);
        Some(Self {
            drones,
            first,
            neighbours: before(drones, &rows, if moves { moving::REACH } else { REACH }),
            fine: Whole::of(drones, &rows, FINE),
            coarse: Whole::of(drones, &rows, COARSE),
            rows,
            roughly_mps: drones.iter().map(|drone| drone.own_mps().hypot(OWN_MPS)).collect(),
            slope_share: rms(own_slopes).unwrap_or(0.0),
            moves,
        })
    }

    /// By how much the drones' means lie apart about a plane over their places, m/s, where their constants do not explain it; else 0.
    fn lasting_mps(&self) -> f64 {
        let mean_of = |drone: &Drone| {
            let [x, y, _] = *drone.place_m.first()?;
            let values = drone.values.iter().flatten().map(|value| value.updraft_mps);
            Some(([x, y], mean(values)?))
        };
        let means: Vec<([f64; 2], f64)> = self.drones.iter().filter_map(mean_of).collect();
        let apart_mps = Scatter::of(&means).map_or(0.0, Scatter::sd_mps);
        let explained_mps = rms(self.roughly_mps.iter().copied()).unwrap_or(0.0);
        if self.moves || apart_mps < LASTING * explained_mps { 0.0 } else { apart_mps }
    }

    /// The most probable scales of each family of air, with what they were found by.
    fn scales(&self, wind_mps: Option<[f64; 2]>) -> Option<(Search<'_>, Vec<Found>)> {
        let mut search = Search {
            rows: &self.rows,
            neighbours: &self.neighbours,
            whole: Some(&self.fine),
            coarse: Some(&self.coarse),
            own_mps: &self.roughly_mps,
            slope_share: self.slope_share,
            wind_mps,
            factor: open_factor(&prior_factor(None, false)),
            lasting_mps: self.lasting_mps(),
        };
        let mut families = search.all();
        if let (true, None) = (self.moves, wind_mps) {
            search.wind_mps = moving::drift(&search, families.first()?);
            if search.wind_mps.is_some() {
                families = search.all();
            }
        }
        Some((search, families))
    }
}

/// The map of values in air of these scales, and of thermals that the values are without.
fn mapped(
    input: &Input<'_>,
    values: &Values<'_>,
    search: &Search<'_>,
    families: &[Found],
    thermals: Vec<Thermal>,
) -> Option<Posterior> {
    let own_of = |air: &Air| -> Vec<f64> {
        // Air that each drone met alone in its calibration is in its constant.
        let own = input.calibration.own_mps(air);
        input.drones.iter().map(|drone| drone.own_mps().max(own)).collect()
    };
    let components = |air: &Air| input.calibration.components(air);
    let sampled: Vec<(&Found, Sampled<Vec<Choice>>)> = families
        .iter()
        .map(|found| (found, sampled(search, found, &components, &own_of)))
        .collect();
    let found = sampled
        .iter()
        .max_by(|a, b| a.1.ln_evidence.total_cmp(&b.1.ln_evidence))
        .map(|(found, _)| *found)?;
    let air = search.air(found.family, &found.best);
    let own_mps = own_of(&air);
    let search = Search { own_mps: &own_mps, whole: None, ..*search };
    let (length_m, time_s) = (averaged(&sampled, LN_LENGTH), averaged(&sampled, LN_TIME));
    let system = search.system(found.family, &found.best)?;
    let (mean, covariance, uniform_probability) = over_all(&sampled)?;
    let covariance_of_air = Covariance::new(air).shown(values.slope_share);
    let model = Model {
        drones: values.drones,
        covariance: covariance_of_air,
        linear: linear(&system, mean, &covariance),
    };
    let sites = Sites { lost_m: input.lost_m, seconds: input.seconds, first: values.first };
    let mut predicted = Predicted::of(&model, &values.rows, &sites);
    if !thermals.is_empty() {
        let components = components(&air);
        let (at_best, ..) =
            mixed(std::iter::once((1.0, &choices(&system, &components, &air)[..])))?;
        predicted.add(&thermals, &values.rows, input.drones, &sites);
        // The whole map changes with a thermal's numbers: by one standard error in each independent direction.
        for aside in asides(&thermals) {
            let drones = less(input.drones, &aside);
            let rows = Rows::of(&drones, values.first, STEP);
            let system = Search { rows: &rows, ..search }.system(found.family, &found.best)?;
            let choices = choices(&system, &components, &air);
            let (there, ..) = mixed(std::iter::once((1.0, &choices[..])))?;
            let linear = linear(&system, mean + there - at_best, &covariance);
            let model = Model { drones: &drones, covariance: covariance_of_air, linear };
            let mut other = Predicted::of(&model, &rows, &sites);
            other.add(&aside, &rows, input.drones, &sites);
            predicted.widen(&other);
        }
    }
    let Predicted { mut drones, lost, grid, fleet_mps } = predicted;
    for (series, drone) in drones.iter_mut().zip(input.drones) {
        series.keep_near(drone);
        series.doubt_slope(drone.slope_share);
    }
    Some(Posterior {
        grid,
        fleet_mps,
        drones,
        lost,
        air,
        length_m,
        time_s,
        adequacy: adequate(&model, &values.rows, &values.neighbours),
        moves: moves(&Search { whole: Some(&values.fine), ..search }, air),
        zero_shift_mps: shift(&model, &values.rows),
        uniform_probability,
        thermals,
    })
}

/// Everything linear, with these common errors.
fn linear(system: &System, mean: CommonVector, covariance: &Common) -> Linear {
    let (own, answers) = system.own();
    Linear { mean, covariance: *covariance, own, answers, own_covariance: system.own_covariance() }
}

/// What the values allow of the scales of one family, with what each choice of them says about everything linear.
pub(super) fn sampled(
    search: &Search<'_>,
    found: &Found,
    components: &(dyn Fn(&Air) -> Vec<Component> + Sync),
    own_of: &dyn Fn(&Air) -> Vec<f64>,
) -> Sampled<Vec<Choice>> {
    let own_mps = own_of(&search.air(found.family, &found.best));
    let search = Search { own_mps: &own_mps, ..*search };
    samples(found, |point| {
        let system = search.system(found.family, point)?;
        let air = search.air(found.family, point);
        let choices = choices(&system, &components(&air), &air);
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

/// See [`UNIFORM_SHARE`].
fn uniform_share(air: &Air) -> f64 {
    let moves = air.sd_mps.hypot(air.slow_mps).hypot(air.gust_mps) / STILL_MPS;
    UNIFORM_SHARE + (UNIFORM_SHARE_STILL - UNIFORM_SHARE) / (1.0 + moves.powi(4))
}

/// All choices of the calibration's air and of a uniform updraft, for one choice of the scales.
fn choices(system: &System, components: &[Component], air: &Air) -> Vec<Choice> {
    let uniform_share = uniform_share(air);
    let mut found = Vec::new();
    for component in components {
        let mut mean = CommonVector::zeros();
        mean.iter_mut().zip(component.shift).for_each(|(mean, shift)| *mean = shift);
        for (is_uniform, share) in [(false, 1.0 - uniform_share), (true, uniform_share)] {
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

/// What all points of all families say of the common errors: mean, covariance, and the weight of a uniform updraft.
pub(super) fn over_all(
    sampled: &[(&Found, Sampled<Vec<Choice>>)],
) -> Option<(CommonVector, Common, f64)> {
    mixed(weighed(sampled).map(|(weight, drawn)| (weight, drawn.kept.as_slice())))
}

/// All points of all families, which weigh by their evidence; weights add up to one.
fn weighed<'a>(
    sampled: &'a [(&Found, Sampled<Vec<Choice>>)],
) -> impl Iterator<Item = (f64, &'a Drawn<Vec<Choice>>)> {
    let all = log_sum(sampled.iter().map(|(_, sampled)| sampled.ln_evidence));
    sampled.iter().flat_map(move |(_, sampled)| {
        let share = (sampled.ln_evidence - all).exp();
        sampled.drawn.iter().map(move |drawn| (share * drawn.weight, drawn))
    })
}

/// A scale that is searched as a logarithm, over all points and families: its mean, and 1.96 standard deviations to each side,
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
    let [below, above] = [side(-1.0), side(1.0)];
    // Where one point has all the weight there is none to one side.
    let or = |own: f64, other: f64| if own > 0.0 { own } else { other };
    let interval = [mean - NORMAL * or(below, above), mean + NORMAL * or(above, below)];
    Scale { value: mean.exp(), interval: interval.map(f64::exp) }
}

/// Whether air with a field explains the values better than air without.
fn moves(search: &Search<'_>, air: Air) -> bool {
    let log_likelihood = |air: Air| {
        let covariance = Covariance::new(air).shown(search.slope_share);
        let system = search.system_in(&covariance)?;
        let solved = system.posterior(&CommonVector::zeros(), &search.factor)?;
        Some(solved.log_likelihood)
    };
    let still = Air { sd_mps: NO_FIELD_MPS, slow_mps: NO_FIELD_MPS, ..air };
    let gain = log_likelihood(air).zip(log_likelihood(still)).map(|(with, without)| with - without);
    gain.is_none_or(|nats| nats > MOVES_NATS)
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
