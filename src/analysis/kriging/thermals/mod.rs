//! Thermals as objects: columns of rising air that no stationary field explains.
//!
//! ```text
//! y(i, t) = model of the map + sum of P g((x_i - c - d t) / R)
//! ```
//!
//! with the shape `g` of [`shape`]. For air of given scales records are made white ([`whiten`]), and the most probable core
//! `c`, drift `d`, radius and shape follow from the generalized least squares of each choice ([`fit`]); the scales are
//! found again without the thermal. There are as many thermals as the evidence speaks for.

mod fit;
mod shape;
mod whiten;

#[cfg(test)]
pub(super) mod tests;

use rayon::prelude::*;

use super::covariance::{Covariance, Form};
use super::data::{Drone, Row, Rows, UNIFORM};
use super::neighbours::{Neighbours, Reach, before};
use super::scales::{
    COARSE, ENOUGH, Extent, FINE, Family, Found, LN_GUST, LN_LENGTH, LN_SD, LN_SLOW, LN_TIME,
    Point, Search, Whole, log_prior,
};
use crate::numeric::{LOGARITHM_STEP, Least, differences_at_once, extent, minimise_roughly};
use fit::{Candidate, Fit, PEAK, Region, record};
use shape::{DRIFT, DRIFT_MPS, PLACE, PLACE_M, SINK, Shape};
use whiten::Whitening;

/// Thermals that are looked for, at most. Chosen.
const MOST: usize = 4;
/// What the evidence for a thermal must exceed that for none by, nats, once the air's scales are found again: fields without a
/// thermal reach 1 (docs/errors.md).
const WORTH: f64 = 5.0;
/// The same where neighbours stand for all values: fields reach 9, as a thermal explains some of what neighbours miss.
const WORTH_BY_NEIGHBOURS: f64 = 12.0;
/// By how many times the standard deviation of the air around it a thermal's peak must stand out, less one standard error: patches of
/// that air do by two or three. Gusts of 30 m that the wind carries through a field that stays are no field of one scale, and
/// were thermals in three of five flights of 64 and 100 drones, of 1.1 to 1.7 times that. Chosen.
const STANDS_OUT: f64 = 2.5;
/// A thermal in quiet air must be worth so much to be followed, nats.
const WORTH_A_LOOK: f64 = 12.0;
/// Rounds in which scales and thermal are found again.
const ROUNDS: usize = 3;
/// A field that may have been taken for a thermal's is tried so much weaker, too (logarithm).
const QUIET: f64 = -1.2;
/// A thermal that fewer drones meet is an error of theirs.
const FEWEST_DRONES: usize = 3;
/// Share of the peak from which on a drone meets it.
const MET: f64 = 0.2;
/// Directions across which the places are measured that a thermal is seen from.
const ACROSS: usize = 8;
/// What a calibration leaves of the zero, and an updraft that is everywhere the same, m/s: with an open zero the tail of a
/// wide thermal cannot be told from it. The standard error of calibrations in moving air (docs/errors.md).
const ZERO_MPS: f64 = 0.3;
/// Larger records are not searched: the time grows with the number of values and of drones.
const MOST_VALUES: usize = 8000;
/// See [`MOST_VALUES`].
const MOST_DRONES: usize = 200;

/// What is conditioned on: with fewer neighbours, a thermal explains some of what they miss of smooth fields (false finds in
/// two of eight, with 16 neighbours).
const REACH: Reach = Reach { beside: 14, step: 14, own: 4 };
/// The same for drones that move, of whose values each has weights of its own.
const REACH_OF_MOVING: Reach = Reach { beside: 10, step: 8, own: 3 };

/// A value with its standard error.
pub(in super::super) type Known = (f64, f64);

/// A thermal.
#[derive(Clone, Debug)]
pub(in super::super) struct Thermal {
    /// When the core is at its place, s of the record: where that is known best.
    pub(in super::super) at_s: f64,
    /// The core, show frame, m.
    pub(in super::super) core_m: [Known; 2],
    /// Drift, m/s.
    pub(in super::super) drift_mps: [Known; 2],
    /// Distance from the core at which the updraft has fallen to 1/e of the peak, m.
    pub(in super::super) radius_m: Known,
    /// Updraft in the core over that of the air around, m/s.
    pub(in super::super) peak_mps: Known,
    /// Flux through the disc of that radius, m³/s.
    pub(in super::super) flux_m3ps: Known,
    /// How much sinks around it: 0 nothing, 1 as much as rises.
    pub(in super::super) sink: Known,
    /// Logarithm of the evidence for it over that for none.
    pub(in super::super) log_odds: f64,
    candidate: Candidate,
}

/// The updraft that thermals add for who moves like this, mean over the 10 s around a time, m/s.
pub(super) fn updraft_mps(
    thermals: &[Thermal],
    place_m: [f64; 3],
    time_s: f64,
    velocity_mps: [f64; 3],
) -> f64 {
    let one = |Thermal { candidate, .. }: &Thermal| {
        let shape = Shape::new(&candidate.numbers, candidate.at_s);
        candidate.peak_mps * shape.mean(place_m, time_s, velocity_mps)
    };
    thermals.iter().map(one).sum()
}

/// Drones with the values that they would have without thermals.
pub(super) fn less(drones: &[Drone], thermals: &[Thermal]) -> Vec<Drone> {
    let mut left = drones.to_vec();
    for (drone, own) in left.iter_mut().zip(drones) {
        for (second, value) in drone.values.iter_mut().enumerate() {
            let (Some(value), Some(place_m)) = (value, own.place_at(second)) else { continue };
            let velocity_mps = own.velocity_at(second);
            value.updraft_mps -= updraft_mps(thermals, place_m, second as f64, velocity_mps);
        }
    }
    left
}

/// The same thermals with one of them off by one standard error, in each independent direction of each.
pub(super) fn asides(thermals: &[Thermal]) -> Vec<Vec<Thermal>> {
    let mut found = Vec::new();
    for (index, thermal) in thermals.iter().enumerate() {
        for candidate in thermal.candidate.asides() {
            let mut aside = thermals.to_vec();
            aside[index].candidate = candidate;
            found.push(aside);
        }
    }
    found
}

/// A record in which thermals are looked for.
pub(super) struct Record<'a> {
    /// What scales are found by.
    pub(super) search: &'a Search<'a>,
    pub(super) drones: &'a [Drone],
    pub(super) found: &'a Found,
    pub(super) wind_mps: Option<[f64; 2]>,
}

/// Scales of the air.
type Scales = (Family, Point);

/// A thermal with the scales of the air around it.
struct Explained {
    candidate: Candidate,
    scales: Scales,
    /// Logarithm of the evidence.
    evidence: f64,
}

impl Explained {
    /// See [`STANDS_OUT`].
    fn stands_out(&self) -> bool {
        let (_, point) = &self.scales;
        let [field_mps, gust_mps, slow_mps] =
            [LN_SD, LN_GUST, LN_SLOW].map(|index| point[index].exp());
        let se_mps = self.candidate.covariance[(PEAK, PEAK)].max(0.0).sqrt();
        self.candidate.peak_mps - se_mps > STANDS_OUT * field_mps.hypot(gust_mps).hypot(slow_mps)
    }
}

impl Record<'_> {
    /// The thermals of a record, the most certain first.
    pub(super) fn thermals(&self) -> Vec<Thermal> {
        let rows = self.search.rows;
        let too_large = rows.list.len() > MOST_VALUES || self.search.own_mps.len() > MOST_DRONES;
        let Some(region) = Region::of(rows, self.wind_mps).filter(|_| !too_large) else {
            return Vec::new();
        };
        let mut search = *self.search;
        search.factor[(UNIFORM, UNIFORM)] = ZERO_MPS;
        let moves = self.drones.iter().any(|drone| !drone.hovers());
        let reach = if moves { REACH_OF_MOVING } else { REACH };
        let neighbours = if Whitening::is_of_all(rows) {
            Neighbours::default()
        } else {
            before(self.drones, rows, reach)
        };
        let looked = Looked { search: &search, drones: self.drones, neighbours: &neighbours };
        looked.thermals(&region, (self.found.family, self.found.best))
    }
}

/// A record with what makes it white.
struct Looked<'a> {
    search: &'a Search<'a>,
    drones: &'a [Drone],
    /// None where all values are made white at once.
    neighbours: &'a Neighbours,
}

impl Looked<'_> {
    fn thermals(&self, region: &Region, scales: Scales) -> Vec<Thermal> {
        let mut found: Vec<(Candidate, f64)> = Vec::new();
        let mut left = self.search.rows.clone();
        // With the zero better known.
        let mut scales = self.again(self.search.rows, scales, FINE).0;
        while found.len() < MOST {
            let Some(one) = self.one(&left, region, scales) else { break };
            let Some(none) = self.evidence(&left, &scales) else { break };
            let odds = one.evidence - none;
            let by_all = Whitening::is_of_all(&left);
            if odds < if by_all { WORTH } else { WORTH_BY_NEIGHBOURS } || !one.stands_out() {
                break;
            }
            left = without(&left, &one.candidate);
            scales = one.scales;
            found.push((one.candidate, odds));
        }
        self.one_by_one(&mut found, region, scales);
        found
            .into_iter()
            .map(|(candidate, log_odds)| thermal(&candidate.at_its_best(region), log_odds))
            .collect()
    }

    /// The most probable scales of a record in any form, from those of another one.
    fn in_any_form(&self, rows: &Rows, (family, start): Scales) -> Scales {
        let mut forms: Vec<Form> =
            Form::ALL.into_iter().filter(|other| *other != family.form).collect();
        forms.insert(0, family.form);
        let roughly: Vec<(Scales, f64)> = forms
            .into_par_iter()
            .map(|form| self.again(rows, (Family { form, ..family }, start), COARSE))
            .collect();
        let best = roughly.into_iter().rev().max_by(|a, b| a.1.total_cmp(&b.1));
        self.again(rows, best.map_or((family, start), |(scales, _)| scales), FINE).0
    }

    /// The most probable scales of a record, from others, with the logarithm of their posterior.
    fn again(&self, rows: &Rows, (family, start): Scales, extent: Extent) -> (Scales, f64) {
        let whole = Whole::of(self.drones, rows, extent);
        let search = Search { rows, whole: Some(&whole), ..*self.search };
        let of = |some: &[f64; 4]| {
            let mut point = start;
            AGAIN.iter().zip(some).for_each(|(index, value)| point[*index] = *value);
            point
        };
        let loss = |some: &[f64; 4]| -search.log_posterior(family, &of(some));
        let losses = |places: &[[f64; 4]; 4]| {
            let values: Vec<f64> = places.par_iter().map(loss).collect();
            std::array::from_fn(|index| values[index])
        };
        let slopes = |at: &[f64; 4], value| differences_at_once(losses, at, value, LOGARITHM_STEP);
        let first = AGAIN.map(|index| start[index]);
        let Least { at: best, value: least, .. } =
            minimise_roughly(first, None, ENOUGH, loss, slopes);
        ((family, if least.is_finite() { of(&best) } else { start }), -least)
    }

    fn whitening(&self, rows: &Rows, (family, point): &Scales) -> Option<Whitening<'_>> {
        let covariance =
            Covariance::new(self.search.air(*family, point)).shown(self.search.slope_share);
        let Search { factor, own_mps, .. } = self.search;
        Whitening::new(rows, self.neighbours, &covariance, factor, own_mps)
    }

    /// Logarithm of the evidence for no thermal.
    fn evidence(&self, rows: &Rows, scales: &Scales) -> Option<f64> {
        let whitening = self.whitening(rows, scales)?;
        Some(whitening.log_density(&whitening.white(&values(rows))) + log_prior(&scales.1))
    }

    /// The most probable thermal, with the scales of the air around it; `None` where nothing looks like one.
    fn one(&self, rows: &Rows, region: &Region, scales: Scales) -> Option<Explained> {
        let look = |scales: &Scales| {
            let whitening = self.whitening(rows, scales)?;
            let values = whitening.white(&values(rows));
            Fit { rows, region, whitening: &whitening, values }.best()
        };
        let mut quiet = scales;
        quiet.1[LN_SD] += QUIET;
        let second = look(&quiet)?;
        if second.log_odds < WORTH_A_LOOK {
            return None;
        }
        let first = look(&scales);
        let starts: Vec<Candidate> =
            first.into_iter().chain([second]).filter(|start| is_told(rows, start)).collect();
        let refined: Vec<Explained> = starts
            .into_par_iter()
            .filter_map(|start| self.refined(rows, region, start, scales))
            .collect();
        refined
            .into_iter()
            .filter(|one| is_told(rows, &one.candidate))
            .max_by(|a, b| a.evidence.total_cmp(&b.evidence))
    }

    /// A thermal and the scales of the air around it, each found again with the other.
    fn refined(
        &self,
        rows: &Rows,
        region: &Region,
        start: Candidate,
        scales: Scales,
    ) -> Option<Explained> {
        let mut at = Explained { candidate: start, scales, evidence: f64::NEG_INFINITY };
        for round in 0..ROUNDS {
            let left = without(rows, &at.candidate);
            let scales = match round {
                0 => self.in_any_form(&left, at.scales),
                _ => self.again(&left, at.scales, FINE).0,
            };
            let point = scales.1;
            let whitening = self.whitening(rows, &scales)?;
            let white = whitening.white(&values(rows));
            let without = whitening.log_density(&white) + log_prior(&point);
            let fit = Fit { rows, region, whitening: &whitening, values: white };
            let candidate = fit.from(&[(at.candidate.numbers, at.candidate.at_s)])?;
            let evidence = without + candidate.log_odds;
            let gained = evidence - at.evidence;
            if gained < 0.0 {
                break;
            }
            at = Explained { candidate, scales, evidence };
            if gained < 0.1 {
                break;
            }
        }
        at.evidence.is_finite().then_some(at)
    }

    /// Finds each of several thermals again without the others.
    fn one_by_one(&self, found: &mut [(Candidate, f64)], region: &Region, scales: Scales) {
        if found.len() < 2 {
            return;
        }
        for index in 0..found.len() {
            let mut left = self.search.rows.clone();
            for (other, (candidate, _)) in found.iter().enumerate() {
                if other != index {
                    left = without(&left, candidate);
                }
            }
            let Some(whitening) = self.whitening(&left, &scales) else { return };
            let white = whitening.white(&values(&left));
            let fit = Fit { rows: &left, region, whitening: &whitening, values: white };
            let start = (found[index].0.numbers, found[index].0.at_s);
            if let Some(candidate) = fit.from(&[start]) {
                found[index].0 = candidate;
            }
        }
    }
}

/// Scales that are found again with a thermal: the others hardly hang on it.
const AGAIN: [usize; 4] = [LN_SD, LN_LENGTH, LN_TIME, LN_GUST];

fn values(rows: &Rows) -> Vec<f64> {
    rows.list.iter().map(|row| row.value_mps).collect()
}

/// Rows less a thermal.
fn without(rows: &Rows, candidate: &Candidate) -> Rows {
    let record = record(rows, &candidate.numbers, candidate.at_s);
    let own = rows
        .list
        .iter()
        .zip(record)
        .map(|(row, share)| Row { value_mps: row.value_mps - candidate.peak_mps * share, ..*row });
    Rows { list: own.collect(), ..rows.clone() }
}

/// Whether these values can tell a thermal.
fn is_told(rows: &Rows, candidate: &Candidate) -> bool {
    is_met(rows, candidate) && is_spanned(rows, candidate)
}

/// Whether the places that a thermal is seen from, as it drifts by, are at least as wide as its radius. What is wider than they
/// are is a slope of any smooth field: three of 40 fleets of nine drones over 14 m found a thermal of 26 to 35 m in fields
/// that had none.
fn is_spanned(rows: &Rows, candidate: &Candidate) -> bool {
    let shape = Shape::new(&candidate.numbers, candidate.at_s);
    let places: Vec<[f64; 2]> =
        rows.list.iter().map(|row| shape.off_m(row.spot.place_m, row.spot.time_s)).collect();
    let radius_m = shape.core_radius_m();
    (0..ACROSS).all(|step| {
        let (sin, cos) = (std::f64::consts::PI * step as f64 / ACROSS as f64).sin_cos();
        let across = extent(places.iter().map(|[x, y]| x * cos + y * sin));
        across.is_some_and(|(least, most)| most - least >= radius_m)
    })
}

/// Whether enough drones meet a thermal.
fn is_met(rows: &Rows, candidate: &Candidate) -> bool {
    let record = record(rows, &candidate.numbers, candidate.at_s);
    let met = rows.list.iter().zip(record).filter(|(_, share)| *share > MET);
    let drones: std::collections::BTreeSet<Option<usize>> =
        met.map(|(row, _)| row.spot.drone).collect();
    drones.len() >= FEWEST_DRONES
}

fn thermal(candidate: &Candidate, log_odds: f64) -> Thermal {
    let at_s = candidate.at_s;
    Thermal {
        at_s,
        core_m: PLACE.map(|index| candidate.derived(|numbers, _| PLACE_M * numbers[index])),
        drift_mps: DRIFT.map(|index| candidate.derived(|numbers, _| DRIFT_MPS * numbers[index])),
        radius_m: candidate.derived(|numbers, _| Shape::new(numbers, at_s).core_radius_m()),
        peak_mps: candidate.derived(|_, peak_mps| peak_mps),
        flux_m3ps: candidate
            .derived(|numbers, peak_mps| peak_mps * Shape::new(numbers, at_s).core_flux_m3ps()),
        sink: candidate.derived(|numbers, _| numbers[SINK]),
        log_odds,
        candidate: candidate.clone(),
    }
}
