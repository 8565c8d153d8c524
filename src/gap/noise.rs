//! Model of the pulses' noise: the shared air, each drone's own air, offsets and scatter.
//!
//! The data model (docs/physics.md, 3.2): drone i in bin k of its group reads
//!
//! ```text
//! y = mean + a_i o_k + b_i r_k + (S_k + s0) (W(t_k) + X_i(t_k) + g_i(t_k)) + H_k h(t_k) + p_i(t_k) + e
//! ```
//!
//! with W the updraft that all share (it may change with height), X a slow updraft of the drone's own place,
//! g its gusts, a its hover pulse, b its relative response, o and r what these are at a climb, S the model's response to vertical air speed in
//! gusts as strong as this noise has them, s0 what it is at least, h the horizontal gusts that are not known
//! and H the model's response to them, p noise of the drone's pulse that some seconds remember. Within a command group the likelihood splits exactly into the group's
//! mean and the deviations of its drones; both are whitened by filters.

use rayon::prelude::*;

use crate::numeric;

use super::filter::{Filter, LooksAt, Observation, State};
use super::response::{Response, gusts_mps};
use super::slopes::Slopes;

/// Parameters of the noise, by their logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hyper(pub [f64; COUNT]);

/// Number of parameters.
pub(super) const COUNT: usize = 12;
/// Place in [`Hyper`]: updraft that all drones share, m/s.
pub(super) const SHARED: usize = 0;
/// Place: time scale of the shared air and of the slow own air, s.
pub(super) const SHARED_TIME: usize = 1;
/// Place: slow updraft at one drone, m/s.
pub(super) const OWN: usize = 2;
/// Place: gusts at one drone, m/s.
pub(super) const GUSTS: usize = 3;
/// Place: time scale of gusts, s.
pub(super) const GUST_TIME: usize = 4;
/// Place: white noise of a bin, us.
pub(super) const WHITE: usize = 5;
/// Place: spread of hover pulses, us.
pub(super) const OFFSETS: usize = 6;
/// Place: relative spread of responses.
pub(super) const SLOPES: usize = 7;
/// Place: floor under the response to vertical air speed, us/(m/s).
pub(super) const LEAST: usize = 8;
/// Place: change of the shared updraft with height, m/s per 50 m.
pub(super) const GRADIENT: usize = 9;
/// Place: horizontal gusts beyond those that the leans show, each axis, m/s.
pub(super) const SIDE_GUSTS: usize = 10;
/// Place: noise of a drone's pulse that is remembered for [`PULSE_NOISE_S`], us.
pub(super) const PULSE_NOISE: usize = 11;
/// Time scale of [`PULSE_NOISE`], s: that of motors, controllers and the loops around them. Not fitted: against
/// bins of 3 s a scale nearby does the same.
const PULSE_NOISE_S: f64 = 5.0;
/// Time scale of [`SIDE_GUSTS`], s: gusts of the size of a fleet that drift over it; the benchmark's have
/// the same. Not fitted.
const SIDE_GUSTS_S: f64 = 25.0;

/// Prior of each parameter (docs/physics.md, 3.2): median, and a standard deviation as a factor. Wide: they
/// keep the search where weather and drones can be, and decide only what the flight cannot say (a record of
/// a few time scales hardly determines the time scale). Medians lie between calm and field air; 10 us and 5
/// % are near the spread of the paper's Table II. Chosen, not measured; the benchmark draws shared updrafts
/// of 0.1 to 0.42 m/s over 40 to 186 s.
const PRIOR: [(f64, f64); COUNT] = [
    (0.3, 2.5),
    (60.0, 2.0),
    (0.1, 2.5),
    (0.15, 2.5),
    (8.0, 1.6),
    (2.0, 2.5),
    (10.0, 2.5),
    (0.05, 2.0),
    (0.5, 1.7),
    (0.08, 2.0),
    (0.3, 2.0),
    (0.7, 3.0),
];

/// The parameters that are of the air: their prior ends in a wall, beyond [`STORM`].
const OF_THE_AIR: [usize; 7] = [SHARED, SHARED_TIME, OWN, GUSTS, LEAST, GRADIENT, SIDE_GUSTS];
/// How far above its prior's median the air may be, in prior standard deviations, before the wall: a shared
/// updraft of 3 m/s. Introduced because what is no air at all was taken for a storm that wanders for hours;
/// the value is chosen.
const STORM: f64 = 2.5;
/// By how much steeper the prior is beyond [`STORM`]. Chosen.
const WALL: f64 = 3.0;

impl Default for Hyper {
    fn default() -> Self {
        Self(PRIOR.map(|(median, _)| f64::ln(median)))
    }
}

impl Hyper {
    /// One parameter, in its own unit (the logarithm is undone).
    pub fn get(&self, place: usize) -> f64 {
        self.0[place].exp()
    }

    /// How the logarithm of the prior density changes with each parameter.
    pub(super) fn prior_slopes(&self) -> [f64; COUNT] {
        let mut slopes = [0.0; COUNT];
        for (place, slope) in slopes.iter_mut().enumerate() {
            let (median, factor) = PRIOR[place];
            let away = (self.0[place] - median.ln()) / factor.ln();
            *slope = -away / factor.ln();
            if OF_THE_AIR.contains(&place) {
                *slope -= WALL.powi(2) * (away - STORM).max(0.0) / factor.ln();
            }
        }
        slopes
    }

    /// Logarithm of the prior density, without its constant.
    pub fn log_prior(&self) -> f64 {
        let square = |(value, (median, factor)): (&f64, &(f64, f64))| {
            ((value - median.ln()) / factor.ln()).powi(2)
        };
        // Weather ends somewhere: what is no air at all must not be taken for a storm that wanders for hours.
        let storm = |place: &usize| {
            let (median, factor) = PRIOR[*place];
            let beyond = (self.0[*place] - median.ln()) / factor.ln() - STORM;
            (WALL * beyond.max(0.0)).powi(2)
        };
        let storms: f64 = OF_THE_AIR.iter().map(storm).sum();
        -0.5 * (self.0.iter().zip(&PRIOR).map(square).sum::<f64>() + storms)
    }
}

/// Pattern of a command group that the noise model takes.
#[derive(Clone, Debug, Default)]
pub struct GroupPattern {
    /// Number of drones.
    pub drones: usize,
    /// Middle of each bin, s.
    pub time_s: Vec<f64>,
    /// Height in each bin, m.
    pub height_m: Vec<f64>,
    /// The model's response to vertical air speed in each bin.
    pub response: Vec<Response>,
    /// Change of the speed relative to the air by the air that all share, in each bin, m/s; empty
    /// if unknown.
    pub shift_mps: Vec<f64>,
    /// Change of the mean of a curved response by gusts, in each bin, us, which is as uncertain as
    /// it is large; empty if there is none.
    pub bent_us: Vec<f64>,
    /// The model's response to horizontal air speed along either axis of the show, us/(m/s); empty: none.
    pub side_response: Vec<[f64; 2]>,
    /// Change of the pulse in each bin by what changes it by 1 us in hover; empty: the same in all.
    pub offset: Vec<f64>,
    /// Change of the pulse by a relative error of the response, in each bin, us.
    pub slope_us: Vec<f64>,
    /// How far the model's own flight is from what it comes to rest at, in each bin, us; empty: the model was not flown.
    pub unsteady_us: Vec<f64>,
}

/// The whitening filters of all groups at one set of parameters.
#[derive(Clone, Debug)]
pub(super) struct Whitener {
    /// Means of all groups together: (group, bin) in the order of time, and their filter.
    order: Vec<(usize, usize)>,
    means: Filter,
    /// Deviations within each group.
    deviations: Vec<Filter>,
    drones: Vec<usize>,
    /// Minus twice the logarithm of the normalisation, without the constant.
    pub log_det: f64,
}

/// How each drone differs from the others is described no better than to this, us, in each bin: an offset and a slope are not all of it,
/// and in still air, where bins repeat to a tenth of a microsecond, what they leave over would choose updrafts and names by hundreds of
/// nats. Chosen, of 0.2, 0.5, 1 and 2: twice what they leave over there; with 0.5 a drag was found in ArduPilot's frame in strong wind where
/// nothing was hidden.
const DIFFER_US: f64 = 0.2;
/// How far the model's own flight scatters from bin to bin, us: it is one drone's, whose sensors make its pulses as noisy as those of
/// each other drone in still air, however many of these are averaged. Measured: 0.22 to 0.23 rms, with what else is left there, beside
/// groups of five and six of ArduPilot's frames in 8 m/s of wind, 0.06 m/s from the true updraft.
const FLOWN_US: f64 = 0.2;
/// The model's flight is steady where it is no farther than this from what it comes to rest at, us. Measured in these
/// flights: at most 5.9 but after legs, and 11 to 37 there.
const STEADY_US: f64 = 6.0;
/// What a drone does before it is steady is known to this share of what lies beyond [`STEADY_US`]. Chosen: in one of
/// these flights up to 5 of 13 us were wrong, in the other at most 0.4 of 16.
const UNSTEADY_SHARE: f64 = 0.2;
/// States of the filter of the means: shared air, its gradient, the bend, two side gusts, the bend's
/// wandering, the curvature in height.
const SHARED_STATES: usize = 7;
/// States of a drone: slow air, gusts, offset, response, noise of the pulse.
const OWN_STATES: usize = 5;
/// Places, in what a mean looks at, of the response: to the drone's slow air and gusts, to the shared air, its
/// gradient and that of its gradient.
const LOOKS: [usize; 5] = [0, 1, OWN_STATES, OWN_STATES + 1, OWN_STATES + 2];
/// Parameters that the response depends on.
const OF_THE_RESPONSE: [usize; 5] = [SHARED, OWN, GUSTS, LEAST, GRADIENT];
/// Step of the difference quotients of states and responses. Numerical.
const STEP: f64 = 1e-5;
/// How the gradient itself changes over [`ALOFT_M`], as a share of it: an eddy of 150 m is not straight over
/// the height of a ladder. Chosen, near the ratio of the two lengths.
const CURVED: f64 = 0.3;
/// Heights are taken from here, m, in units of [`ALOFT_M`]. Convention: another origin moves variance
/// between the shared air and its gradient only.
const MIDDLE_M: f64 = 45.0;
/// Unit of height of the gradient, m. Convention; the prior of [`GRADIENT`] goes with it.
const ALOFT_M: f64 = 50.0;

impl GroupPattern {
    /// Height of a bin in units of the gradient.
    pub fn aloft(&self, bin: usize) -> f64 {
        (self.height_m[bin] - MIDDLE_M) / ALOFT_M
    }

    /// Change of the pulse in a bin by what changes it by 1 us in hover.
    pub fn offset_at(&self, bin: usize) -> f64 {
        self.offset.get(bin).copied().unwrap_or(1.0)
    }

    /// Variance of the model's own flight in a bin, us².
    fn flown_noise(&self, bin: usize) -> f64 {
        self.unsteady_us.get(bin).map_or(0.0, |unsteady_us| {
            let beyond_us = (unsteady_us.abs() - STEADY_US).max(0.0);
            FLOWN_US.powi(2) + (UNSTEADY_SHARE * beyond_us).powi(2)
        })
    }

    /// Response to vertical air speed in each bin, in this noise, us/(m/s).
    pub fn responses(&self, hyper: &Hyper) -> Vec<f64> {
        let (gusts_mps, least) = (gusts_mps(hyper), hyper.get(LEAST));
        self.response.iter().map(|response| response.over(gusts_mps).abs() + least).collect()
    }

    /// Response in each bin to what a drone does not share with the others, in this noise, us/(m/s).
    pub fn own_responses(&self, hyper: &Hyper) -> Vec<f64> {
        if self.shift_mps.is_empty() {
            return self.responses(hyper);
        }
        let least = hyper.get(LEAST);
        let own_mps = hyper.get(OWN).hypot(hyper.get(GUSTS));
        let each = self.response.iter().zip(&self.shift_mps);
        each.map(|(response, shift_mps)| response.around(*shift_mps, own_mps).abs() + least)
            .collect()
    }
}

/// States of a drone, or with a share of their variance those of a mean of drones.
fn own_states(hyper: &Hyper, share: f64) -> [State; OWN_STATES] {
    let state =
        |place: usize, time_s: f64| State { variance: hyper.get(place).powi(2) * share, time_s };
    [
        state(OWN, hyper.get(SHARED_TIME)),
        state(GUSTS, hyper.get(GUST_TIME)),
        state(OFFSETS, f64::INFINITY),
        state(SLOPES, f64::INFINITY),
        state(PULSE_NOISE, PULSE_NOISE_S),
    ]
}

/// States of the means of all groups.
fn shared_states(groups: &[GroupPattern], hyper: &Hyper) -> Vec<State> {
    let square = |place: usize| hyper.get(place).powi(2);
    let time_s = hyper.get(SHARED_TIME);
    // The square of a normal air varies by sqrt 2 of its mean and is forgotten twice as fast: what all
    // drones share of it bends all their means by the same.
    let shared_share =
        square(SHARED) / (square(SHARED) + square(OWN) + square(GUSTS)).max(f64::MIN_POSITIVE);
    let mut states = vec![
        State { variance: square(SHARED), time_s },
        State { variance: square(GRADIENT), time_s },
        State { variance: 1.0, time_s: f64::INFINITY },
        State { variance: square(SIDE_GUSTS), time_s: SIDE_GUSTS_S },
        State { variance: square(SIDE_GUSTS), time_s: SIDE_GUSTS_S },
        State { variance: 2.0 * shared_share.powi(2), time_s: time_s / 2.0 },
        State { variance: (CURVED * hyper.get(GRADIENT)).powi(2), time_s },
    ];
    for group in groups {
        states.extend(own_states(hyper, 1.0 / group.drones.max(1) as f64));
    }
    states
}

impl Whitener {
    /// For these groups and this noise.
    pub(super) fn new(groups: &[GroupPattern], hyper: &Hyper) -> Self {
        let white = hyper.get(WHITE).powi(2);
        let responses: Vec<Vec<f64>> = groups.iter().map(|group| group.responses(hyper)).collect();
        let own_responses: Vec<Vec<f64>> =
            groups.iter().map(|group| group.own_responses(hyper)).collect();
        let looks = |index: usize, bin: usize, first: usize| {
            let response = own_responses[index][bin];
            LooksAt::from_slice(&[
                (first, response),
                (first + 1, response),
                (first + 2, groups[index].offset_at(bin)),
                (first + 3, groups[index].slope_us[bin]),
                (first + 4, 1.0),
            ])
        };
        let mut order: Vec<(usize, usize)> = groups
            .iter()
            .enumerate()
            .flat_map(|(index, group)| (0..group.time_s.len()).map(move |bin| (index, bin)))
            .collect();
        order.sort_by(|a, b| groups[a.0].time_s[a.1].total_cmp(&groups[b.0].time_s[b.1]));
        let observations: Vec<Observation> = order
            .iter()
            .map(|(index, bin)| {
                let group = &groups[*index];
                let mut looks_at = looks(*index, *bin, SHARED_STATES + OWN_STATES * index);
                let response = responses[*index][*bin];
                looks_at.push((0, response));
                looks_at.push((1, response * group.aloft(*bin)));
                looks_at.push((6, response * group.aloft(*bin).powi(2)));
                // How far gusts bend the mean is computed, and doubted by as much as it is.
                looks_at.push((2, group.bent_us.get(*bin).copied().unwrap_or(0.0)));
                let [x, y] = group.side_response.get(*bin).copied().unwrap_or_default();
                looks_at.push((3, x));
                looks_at.push((4, y));
                looks_at.push((5, group.bent_us.get(*bin).copied().unwrap_or(0.0)));
                Observation {
                    time_s: group.time_s[*bin],
                    looks_at,
                    noise: white / group.drones.max(1) as f64 + group.flown_noise(*bin),
                }
            })
            .collect();
        let of_drones = |(index, group): (usize, &GroupPattern)| {
            let bins = 0..group.time_s.len();
            let observations = bins.map(|bin| Observation {
                time_s: group.time_s[bin],
                looks_at: looks(index, bin, 0),
                noise: white.max(DIFFER_US * DIFFER_US),
            });
            Filter::new(own_states(hyper, 1.0).to_vec(), observations.collect())
        };
        let (means, deviations) = rayon::join(
            || Filter::new(shared_states(groups, hyper), observations),
            || groups.iter().enumerate().map(of_drones).collect::<Vec<Filter>>(),
        );
        let mut log_det = means.log_det;
        for (filter, group) in deviations.iter().zip(groups) {
            log_det += filter.log_det * group.drones.saturating_sub(1) as f64;
        }
        let drones = groups.iter().map(|group| group.drones).collect();
        Self { order, means, deviations, drones, log_det }
    }

    /// Number of bins of all groups.
    pub(super) fn bins(&self) -> usize {
        self.order.len()
    }

    /// Whitens means of the groups, of so many series, one after another; `value` is that of a series, a group and a bin.
    pub(super) fn means(
        &self,
        count: usize,
        value: impl Fn(usize, usize, usize) -> f64,
    ) -> Vec<f64> {
        self.means.whiten_all(count, |series, place| {
            let (group, bin) = self.order[place];
            value(series, group, bin)
        })
    }

    /// Groups' means in the order of the filter.
    fn series(&self, by_group: &[Vec<f64>]) -> Vec<f64> {
        self.order.iter().map(|(group, bin)| by_group[*group][*bin]).collect()
    }

    /// How half of the determinant's logarithm, less half of the squares of whitened series, changes with each
    /// parameter of the noise: each series consists of means, in the order of the filter, and of the deviations
    /// of all drones, if it has any.
    pub(super) fn slopes(
        &self,
        groups: &[GroupPattern],
        hyper: &Hyper,
        series: &[(&[f64], &[f64])],
    ) -> [f64; COUNT] {
        let of_means = || {
            let mut slopes = Slopes::zero(&self.means);
            slopes.add_log_det(&self.means, 0.5);
            let mut weighed: Vec<f64> =
                series.iter().flat_map(|(means, _)| *means).copied().collect();
            self.means.back(&mut weighed);
            slopes.add_squares(&self.means, &weighed, -0.5);
            slopes
        };
        let mut first = 0;
        let mut firsts = Vec::with_capacity(self.deviations.len());
        for (filter, drones) in self.deviations.iter().zip(&self.drones) {
            firsts.push(first);
            first += drones * filter.observations.len();
        }
        let of_group = |group: usize| {
            let (filter, drones) = (&self.deviations[group], self.drones[group]);
            let bins = filter.observations.len();
            let mut slopes = Slopes::zero(filter);
            slopes.add_log_det(filter, 0.5 * drones.saturating_sub(1) as f64);
            for (_, deviations) in series {
                let own = deviations.get(firsts[group]..firsts[group] + drones * bins);
                let mut weighed = own.unwrap_or_default().to_vec();
                filter.back(&mut weighed);
                slopes.add_squares(filter, &weighed, -0.5);
            }
            slopes
        };
        let (means, deviations) = rayon::join(of_means, || -> Vec<Slopes> {
            (0..self.deviations.len()).into_par_iter().map(of_group).collect()
        });
        self.by_parameter(groups, hyper, &means, &deviations)
    }

    /// Slopes by what the filters are made of as slopes by the parameters.
    fn by_parameter(
        &self,
        groups: &[GroupPattern],
        hyper: &Hyper,
        means: &Slopes,
        deviations: &[Slopes],
    ) -> [f64; COUNT] {
        let moved = |place: usize, by: f64| {
            let mut moved = *hyper;
            moved.0[place] += by;
            moved
        };
        let of_states = |slopes: &Slopes, ahead: &[State], behind: &[State]| -> f64 {
            let states = ahead.iter().zip(behind).enumerate().map(|(state, (ahead, behind))| {
                let mut sum = slopes.variance[state] * (ahead.variance - behind.variance);
                if ahead.time_s.is_finite() {
                    sum += slopes.log_time[state] * (ahead.time_s / behind.time_s).ln();
                }
                sum
            });
            states.sum::<f64>() / (2.0 * STEP)
        };
        let mut by = [0.0; COUNT];
        for (place, by) in by.iter_mut().enumerate() {
            let (ahead, behind) = (moved(place, STEP), moved(place, -STEP));
            *by +=
                of_states(means, &shared_states(groups, &ahead), &shared_states(groups, &behind));
            for slopes in deviations {
                *by += of_states(slopes, &own_states(&ahead, 1.0), &own_states(&behind, 1.0));
            }
        }
        let white = hyper.get(WHITE).powi(2);
        let of_means = self.order.iter().zip(&means.noise);
        let each = of_means.map(|((group, _), slope)| slope / self.drones[*group].max(1) as f64);
        by[WHITE] += 2.0 * white * each.sum::<f64>();
        if hyper.get(WHITE) > DIFFER_US {
            for slopes in deviations {
                by[WHITE] += 2.0 * white * slopes.noise.iter().sum::<f64>();
            }
        }
        // By the response to what all share and to each drone's own air.
        let mut shared: Vec<Vec<f64>> =
            groups.iter().map(|group| vec![0.0; group.time_s.len()]).collect();
        let mut own = shared.clone();
        for ((group, bin), factors) in self.order.iter().zip(&means.factors) {
            let aloft = groups[*group].aloft(*bin);
            let [own_air, own_gusts, all, sloped, curved] = LOOKS.map(|look| factors[look]);
            own[*group][*bin] += own_air + own_gusts;
            shared[*group][*bin] += all + aloft * (sloped + aloft * curved);
        }
        for (own, slopes) in own.iter_mut().zip(deviations) {
            for (own, factors) in own.iter_mut().zip(&slopes.factors) {
                *own += factors[0] + factors[1];
            }
        }
        for place in OF_THE_RESPONSE {
            let (ahead, behind) = (moved(place, STEP), moved(place, -STEP));
            for (group, (shared, own)) in groups.iter().zip(shared.iter().zip(&own)) {
                let change = |slopes: &[f64], ahead: Vec<f64>, behind: Vec<f64>| -> f64 {
                    let each = slopes.iter().zip(ahead.iter().zip(&behind));
                    each.map(|(slope, (ahead, behind))| slope * (ahead - behind)).sum::<f64>()
                        / (2.0 * STEP)
                };
                by[place] += change(shared, group.responses(&ahead), group.responses(&behind));
                // Who knows the air that all share answers by the own air alone.
                if group.shift_mps.is_empty() || ![SHARED, GRADIENT].contains(&place) {
                    by[place] +=
                        change(own, group.own_responses(&ahead), group.own_responses(&behind));
                }
            }
        }
        by
    }

    /// The updraft that all drones share, by what is left of the groups' means, by group and bin, m/s: its
    /// mean over what this noise holds for likely.
    pub(super) fn shared_mps(
        &self,
        by_group: &[Vec<f64>],
        groups: &[GroupPattern],
        hyper: &Hyper,
    ) -> Vec<Vec<f64>> {
        let weighed = self.means.weigh(&self.series(by_group));
        let responses: Vec<Vec<f64>> = groups.iter().map(|group| group.responses(hyper)).collect();
        let variances = [
            hyper.get(SHARED).powi(2),
            hyper.get(GRADIENT).powi(2),
            (CURVED * hyper.get(GRADIENT)).powi(2),
        ];
        let mut shared: Vec<Vec<f64>> =
            responses.iter().map(|bins| vec![0.0; bins.len()]).collect();
        // Both ways, as far as it is remembered; what is in a bin itself comes once.
        let forward: Vec<usize> = (0..self.order.len()).collect();
        let backward: Vec<usize> = forward.iter().rev().copied().collect();
        for (places, has_own) in [(forward, true), (backward, false)] {
            let mut heard = [0.0; 3];
            let mut before_s = None;
            for place in places {
                let (index, bin) = self.order[place];
                let group = &groups[index];
                let time_s = group.time_s[bin];
                let apart_s = before_s.map_or(0.0, |before_s: f64| (time_s - before_s).abs());
                before_s = Some(time_s);
                let kept = (-apart_s / hyper.get(SHARED_TIME)).exp();
                let aloft = group.aloft(bin);
                let own = responses[index][bin] * weighed[place];
                for (power, heard) in heard.iter_mut().enumerate() {
                    let height = aloft.powi(power as i32);
                    *heard *= kept;
                    if has_own {
                        *heard += height * own;
                    }
                    shared[index][bin] += variances[power] * height * *heard;
                    if !has_own {
                        *heard += height * own;
                    }
                }
            }
        }
        shared
    }

    /// Whitens the deviations of a group's drones from their mean, one drone after another.
    pub(super) fn deviations(&self, group: usize, drones: &[Vec<f64>]) -> Vec<f64> {
        self.deviations[group].whiten_all(drones.len(), |drone, bin| drones[drone][bin])
    }

    /// Pulses of all drones that the noise alone makes, by group and drone: from independent noise.
    pub(super) fn simulate(&self, mut draw: impl FnMut() -> f64) -> Vec<Vec<Vec<f64>>> {
        let noise: Vec<f64> = self.order.iter().map(|_| draw()).collect();
        let series = self.means.colour(&noise);
        let mut means: Vec<Vec<f64>> = self.drones.iter().map(|_| Vec::new()).collect();
        for ((group, _), value) in self.order.iter().zip(series) {
            means[*group].push(value);
        }
        means
            .iter()
            .enumerate()
            .map(|(group, mean)| {
                let filter = &self.deviations[group];
                let drones: Vec<Vec<f64>> = (0..self.drones[group])
                    .map(|_| filter.colour(&mean.iter().map(|_| draw()).collect::<Vec<_>>()))
                    .collect();
                let of_bin = |bin: usize| numeric::mean(drones.iter().map(|drone| drone[bin]));
                let centre: Vec<f64> =
                    (0..mean.len()).map(|bin| of_bin(bin).unwrap_or(f64::NAN)).collect();
                drones
                    .into_iter()
                    .map(|drone| {
                        let parts = drone.iter().zip(&centre).zip(mean);
                        parts.map(|((value, centre), mean)| value - centre + mean).collect()
                    })
                    .collect()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(drones: usize, first: f64) -> GroupPattern {
        GroupPattern {
            drones,
            time_s: (0..6).map(|bin| first + 20.0 * f64::from(bin)).collect(),
            height_m: (0..6).map(|bin| 10.0 + 15.0 * f64::from(bin)).collect(),
            response: vec![Response::straight(20.0); 6],
            offset: Vec::new(),
            slope_us: vec![0.0; 6],
            ..GroupPattern::default()
        }
    }

    #[test]
    fn the_shared_updraft_is_its_mean_over_what_the_noise_holds_for_likely() {
        let groups = [group(5, 0.0), group(7, 8.0)];
        let hyper = Hyper::default();
        let rest: Vec<Vec<f64>> = (0..2)
            .map(|group| (0..6).map(|bin| f64::from((bin * 5 + group * 3) % 7) - 3.0).collect())
            .collect();
        let whitener = Whitener::new(&groups, &hyper);
        let found = whitener.shared_mps(&rest, &groups, &hyper);
        let weighed = whitener.means.weigh(&whitener.series(&rest));
        let responses: Vec<Vec<f64>> = groups.iter().map(|one| one.responses(&hyper)).collect();
        for (group, bin) in &whitener.order {
            let (at, here) = (&groups[*group], groups[*group].aloft(*bin));
            let each = whitener.order.iter().zip(&weighed).map(|((other, place), weighed)| {
                let (there, from) = (groups[*other].aloft(*place), &groups[*other]);
                let apart_s = (at.time_s[*bin] - from.time_s[*place]).abs();
                let gradient = hyper.get(GRADIENT).powi(2) * here * there;
                let bent = (CURVED * hyper.get(GRADIENT)).powi(2) * (here * there).powi(2);
                (hyper.get(SHARED).powi(2) + gradient + bent)
                    * (-apart_s / hyper.get(SHARED_TIME)).exp()
                    * responses[*other][*place]
                    * weighed
            });
            let wanted: f64 = each.sum();
            let found = found[*group][*bin];
            assert!((found - wanted).abs() < 1e-9 * wanted.abs().max(1.0), "{found} {wanted}");
            assert!(found.abs() < 0.3, "{found}: three pulses of 20 us/(m/s) are 0.15 m/s");
        }
    }

    #[test]
    fn a_model_that_was_flown_tells_the_mean_of_many_drones_no_better_than_its_own_flight_repeats()
    {
        let mut hyper = Hyper::default();
        hyper.0[WHITE] = f64::ln(0.1);
        let noise_us = |drones: usize, unsteady_us: Vec<f64>| {
            let groups = [GroupPattern { unsteady_us, ..group(drones, 0.0) }];
            let whitener = Whitener::new(&groups, &hyper);
            [0, 5].map(|bin: usize| whitener.means.observations[bin].noise.sqrt())
        };
        let after_a_leg = [0.0, 0.0, 0.0, 0.0, 0.0, STEADY_US + 10.0];
        let [steady_us, unsteady_us] = noise_us(1000, after_a_leg.to_vec());
        assert!((steady_us - FLOWN_US).abs() < 0.01, "{steady_us}");
        assert!((unsteady_us - 10.0 * UNSTEADY_SHARE).abs() < 0.05, "{unsteady_us}");
        let [few_us, _] = noise_us(1, after_a_leg.to_vec());
        assert!((few_us - FLOWN_US.hypot(0.1)).abs() < 1e-9, "{few_us}");
        let [closed_us, _] = noise_us(1000, Vec::new());
        assert!(closed_us < 0.01, "closed forms have no noise: {closed_us}");
    }

    #[test]
    fn simulated_drones_differ_about_the_noise_that_they_share() {
        let groups = [group(5, 0.0), group(7, 8.0)];
        let whitener = Whitener::new(&groups, &Hyper::default());
        let draw = |index: usize| (1.7 * index as f64).sin();
        let mut drawn = 0;
        let pulses = whitener.simulate(|| {
            drawn += 1;
            draw(drawn)
        });
        let first: Vec<f64> = (1..=whitener.order.len()).map(draw).collect();
        for ((group, bin), shared) in whitener.order.iter().zip(whitener.means.colour(&first)) {
            let values: Vec<f64> = pulses[*group].iter().map(|drone| drone[*bin]).collect();
            let mean = numeric::mean(&values).unwrap();
            assert!((mean - shared).abs() < 1e-9, "{mean} instead of {shared} us");
            assert!(values.iter().any(|value| (value - mean).abs() > 0.1), "{values:?}");
        }
    }
}
