//! Horizontal legs of known ground speed: what they tell of drag and lift in wind.
//!
//! A leg at a constant speed through calm air leans and lifts a drone as a hover in that wind does. Beside
//! the hovers around it, each leg gives a lean and a change of the pulse at an air speed that is known but
//! for the wind of the day, which legs to all sides tell as well. From the prior of the forms
//! ([`super::wind_forms`]) follows their posterior: Gauss-Newton steps over the doubts and the wind of each
//! flight with legs, with gusts of a share of the wind. Calibration and measurement may both have legs. The
//! air that a measurement is flown for is no part of it: a leg's pulse counts beside that of its hovers,
//! which stand in the same air.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector, Matrix3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::result::DroneAnalysis;
use super::wind_forms::{Belief, FORM_SHARE, WindForms};
use super::window::WindowStats;
use crate::mission::Plan;
use crate::mission::plan::{Purpose, SegmentKind};
use crate::numeric::mean;

/// Hovers that a leg is compared with: not further away in time, s, and in height, m. Chosen: battery and air drift.
const NEAR_S: f64 = 60.0;
const NEAR_M: f64 = 3.0;
/// Least standard error of a leg's change of the pulse, us: motors' quanta, and what the forms leave. Chosen.
const LEAST_NOISE_US: f64 = 1.5;
/// Standard error of a mean lean, rad: a quarter of a degree, as the lean on legs that are too short to settle.
/// Chosen as in `gap::lean_fit`.
const LEAN_RAD: f64 = 0.004;
/// Gusts of the wind over a leg, as a share of the wind, and at least, m/s. Chosen: 10 to 15 % over flat land.
const GUST_SHARE: f64 = 0.12;
const LEAST_GUST_MPS: f64 = 0.1;
/// Air speeds that differ by less are alike to what no form describes, m/s. Chosen.
const ALIKE_MPS: f64 = 1.5;
/// Prior standard deviation of the wind along each axis, m/s.
const WIND_MPS: f64 = 6.0;
/// Winds from which the search starts, m/s, in so many directions.
const STARTS_MPS: [f64; 6] = [0.3, 1.0, 2.5, 4.0, 6.0, 8.5];
const STARTS_TO: usize = 8;
/// Starts that are followed.
const FOLLOWED: usize = 3;
/// Steps of the search.
const STEPS: usize = 25;
/// Step of the numerical derivatives.
const STEP: f64 = 1e-3;
/// Wind of the day on which legs are flown, m/s, and standard error of a hover's mean pulse in its air, us: a calm
/// morning. Chosen for what is told beforehand.
const EXPECTED_WIND_MPS: f64 = 1.0;
const EXPECTED_NOISE_US: f64 = 4.0;
/// Fewest legs that are a calibration of the wind.
const FEWEST: usize = 2;

/// One horizontal leg: means over the drones that flew it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindLeg {
    /// Label: `4 m/s towards 0°`.
    pub label: String,
    /// Velocity over ground, show frame, m/s.
    pub ground_mps: [f64; 2],
    /// Number of drones.
    pub drones: usize,
    /// Angle of the mean attitude from the vertical, degrees.
    pub lean_deg: f64,
    /// Pulse, over that of the hovers before and after, us.
    pub change_us: f64,
    /// Vertical speed, over that of these hovers, m/s.
    pub climb_mps: f64,
    /// Lean of these hovers, degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hover_lean_deg: Option<f64>,
    /// The air is measured along it: its lean tells the drag, and its pulse is what is measured.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_track: bool,
}

/// The horizontal legs of a flight.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WindLegs {
    /// The legs, in the order in which they were flown.
    pub legs: Vec<WindLeg>,
    /// Lean of the hovers around them, degrees.
    pub hover_lean_deg: f64,
    /// Standard error of a hover's pulse as a mean over the fleet, us: by the scatter from one hover to the next.
    pub noise_us: f64,
}

impl WindLegs {
    /// The legs of a flight; `None` with fewer than two. Of those that a scan is measured along only the lean counts.
    pub(super) fn of(plan: &Plan, drones: &[DroneAnalysis]) -> Option<Self> {
        let mut found: BTreeMap<(u64, String), OneLeg> = BTreeMap::new();
        for drone in drones {
            let Some(slot) = drone.slot.and_then(|slot| plan.slot(slot)) else { continue };
            for segment in plan.segments(slot) {
                let Some(window) = segment.window else { continue };
                if segment.kind != SegmentKind::Horizontal {
                    continue;
                }
                let is_track = plan.purpose == Purpose::Measurement && !segment.calibrates_wind;
                let start_s = window.start_ms as f64 / 1000.0;
                let Some(flown) = Flown::of(&drone.windows, start_s, is_track) else { continue };
                let [x, y, _] = segment.velocity_mps;
                let key = (window.start_ms, segment.label.clone());
                found.entry(key).or_insert_with(|| (Vec::new(), [x, y], is_track)).0.push(flown);
            }
        }
        let over = |flown: &[Flown], value: fn(&Flown) -> f64| {
            mean(flown.iter().map(value)).unwrap_or_default()
        };
        let hover_leans =
            found.values().flat_map(|(flown, ..)| flown).map(|one| one.hover_lean_deg);
        let hover_lean_deg = mean(hover_leans)?;
        let legs: Vec<WindLeg> = found
            .iter()
            .map(|((_, label), (flown, ground_mps, is_track))| WindLeg {
                label: label.clone(),
                ground_mps: *ground_mps,
                drones: flown.len(),
                lean_deg: over(flown, |one| one.lean_deg),
                change_us: over(flown, |one| one.change_us),
                climb_mps: over(flown, |one| one.climb_mps),
                hover_lean_deg: Some(over(flown, |one| one.hover_lean_deg)),
                is_track: *is_track,
            })
            .collect();
        let noise_us = noise_us(drones);
        (legs.len() >= FEWEST).then_some(Self { legs, hover_lean_deg, noise_us })
    }

    /// What vehicles of these forms lean and lift on legs of a plan that is not flown yet, in a wind, m/s.
    pub(super) fn expected(
        forms: &WindForms,
        ground_mps: &[[f64; 2]],
        wind_mps: [f64; 2],
        noise_us: f64,
    ) -> Self {
        let none = DVector::zeros(forms.doubts.len());
        let level = |[x, y]: [f64; 2]| {
            let [lean, change_us] = forms.level(&none, (x - wind_mps[0]).hypot(y - wind_mps[1]));
            (lean.atan().to_degrees(), change_us)
        };
        let (hover_lean_deg, hover_us) = level([0.0; 2]);
        let leg = |ground_mps: &[f64; 2]| {
            let (lean_deg, change_us) = level(*ground_mps);
            WindLeg {
                label: String::new(),
                ground_mps: *ground_mps,
                drones: 1,
                lean_deg,
                change_us: change_us - hover_us,
                climb_mps: 0.0,
                hover_lean_deg: Some(hover_lean_deg),
                is_track: false,
            }
        };
        Self { legs: ground_mps.iter().map(leg).collect(), hover_lean_deg, noise_us }
    }
}

/// What the legs of some flights leave of a belief about the forms, each with its own wind; `slope` is the pulse
/// per vertical speed, us/(m/s).
pub(super) fn posterior(flown: &[&WindLegs], forms: &WindForms, slope: f64) -> Belief {
    let fit = Fit { flown, forms, slope };
    (!flown.is_empty()).then(|| fit.best()).flatten().unwrap_or_else(|| forms.prior())
}

/// Worth of legs: standard errors of a map in a wind, m/s, that was calibrated in a light one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bought {
    /// With the vehicle's file alone.
    pub without_mps: f64,
    /// With the legs.
    pub with_mps: f64,
}

/// Worth of legs over ground at these velocities (show frame, m/s) for a map in this wind, m/s: legs of a calibration
/// are flown in a light one, those of the measurement in the wind of the map.
pub fn bought(
    forms: &WindForms,
    ground_mps: &[[f64; 2]],
    purpose: Purpose,
    wind_mps: f64,
) -> Bought {
    let flown_in_mps = match purpose {
        Purpose::Calibration => EXPECTED_WIND_MPS,
        Purpose::Measurement => wind_mps,
    };
    let legs = WindLegs::expected(forms, ground_mps, [flown_in_mps, 0.0], EXPECTED_NOISE_US);
    let error = |belief: &Belief| forms.error_mps(belief, EXPECTED_WIND_MPS, wind_mps);
    // No level needs a slope where nothing climbs.
    let with = posterior(&[&legs], forms, 0.0);
    Bought { without_mps: error(&forms.prior()), with_mps: error(&with) }
}

/// What the drones flew of a leg, its velocity over ground, show frame, m/s, and whether the air is measured along it.
type OneLeg = (Vec<Flown>, [f64; 2], bool);

/// One drone on one leg.
struct Flown {
    lean_deg: f64,
    change_us: f64,
    climb_mps: f64,
    hover_lean_deg: f64,
}

impl Flown {
    /// The one that starts at a time. A track tells its lean beside all hovers, wherever these are.
    fn of(windows: &[WindowStats], start_s: f64, is_track: bool) -> Option<Self> {
        let leg = windows.iter().find(|window| {
            window.kind == SegmentKind::Horizontal && (window.start_s - start_s).abs() < 0.01
        })?;
        if !leg.rejected.is_empty() {
            return None;
        }
        if is_track {
            let hovers = windows
                .iter()
                .filter(|window| window.kind.is_hover() && window.rejected.is_empty());
            let hover_lean_deg = mean(hovers.map(|hover| hover.lean_deg))?;
            let (change_us, climb_mps) = (0.0, 0.0);
            return Some(Self { lean_deg: leg.lean_deg, change_us, climb_mps, hover_lean_deg });
        }
        let hovers = || {
            windows.iter().filter(|window| {
                let is_near = (window.height_m - leg.height_m).abs() < NEAR_M;
                window.kind.is_hover() && window.rejected.is_empty() && is_near
            })
        };
        let before = hovers()
            .rfind(|hover| hover.end_s <= leg.start_s && hover.end_s > leg.start_s - NEAR_S);
        let after =
            hovers().find(|hover| hover.start_s >= leg.end_s && hover.start_s < leg.end_s + NEAR_S);
        let around: Vec<&WindowStats> = before.into_iter().chain(after).collect();
        let over = |value: fn(&WindowStats) -> f64| mean(around.iter().map(|one| value(one)));
        Some(Self {
            lean_deg: leg.lean_deg,
            change_us: leg.effort.mean - over(|hover| hover.effort.mean)?,
            climb_mps: leg.velocity_mps.mean - over(|hover| hover.velocity_mps.mean)?,
            hover_lean_deg: over(|hover| hover.lean_deg)?,
        })
    }
}

/// Standard error of the fleet's mean pulse in a hover, us, with the air that all met, apart from what gusts do that lean
/// it: by hovers at one height that follow each other.
fn noise_us(drones: &[DroneAnalysis]) -> f64 {
    let mut cells: BTreeMap<i64, Vec<[f64; 3]>> = BTreeMap::new();
    for window in drones.iter().flat_map(|drone| &drone.windows) {
        if window.kind.is_hover() && window.rejected.is_empty() {
            let at = (window.start_s * 1000.0).round() as i64;
            let cell = [window.effort.mean, window.height_m, window.lean_deg.to_radians()];
            cells.entry(at).or_default().push(cell);
        }
    }
    let means: Vec<(f64, [f64; 3])> = cells
        .iter()
        .filter_map(|(start_ms, cell)| {
            let of = |index: usize| mean(cell.iter().map(|one| one[index]));
            Some((*start_ms as f64 / 1000.0, [of(0)?, of(1)?, of(2)?]))
        })
        .collect();
    let mut steps: Vec<[f64; 2]> = Vec::new();
    for (index, (time_s, [pulse_us, height_m, lean])) in means.iter().enumerate() {
        let next = means[index + 1..].iter().find(|(at_s, next)| {
            (next[1] - height_m).abs() < NEAR_M && *at_s < time_s + 2.0 * NEAR_S
        });
        steps.extend(next.map(|(_, next)| [next[0] - pulse_us, next[2] - lean]));
    }
    if steps.len() < 2 {
        return LEAST_NOISE_US;
    }
    // Gusts of the wind count on their own: what goes with the lean is theirs.
    let product: f64 = steps.iter().map(|[pulse_us, lean]| pulse_us * lean).sum();
    let by_lean = product / steps.iter().map(|[_, lean]| lean * lean).sum::<f64>().max(1e-12);
    let squares: f64 =
        steps.iter().map(|[pulse_us, lean]| (pulse_us - by_lean * lean).powi(2)).sum();
    (squares / 2.0 / (steps.len() - 1) as f64).sqrt().max(LEAST_NOISE_US)
}

/// The search: doubts of the forms, then for each flight its wind along show x and y.
struct Fit<'a> {
    flown: &'a [&'a WindLegs],
    forms: &'a WindForms,
    slope: f64,
}

/// What is left of a leg's lean, its change of the pulse and its hovers' lean, and their covariance.
type Left = (Vector3<f64>, Matrix3<f64>);

impl Fit<'_> {
    fn doubts(&self) -> usize {
        self.forms.doubts.len()
    }

    fn size(&self) -> usize {
        self.doubts() + 2 * self.flown.len()
    }

    /// What a point leaves of each leg of a flight. A gust moves lean and pulse together, of the leg and of its hovers.
    fn left(&self, flight: usize, at: &DVector<f64>) -> Vec<Left> {
        let n = self.doubts();
        let legs = self.flown[flight];
        let doubts = at.rows(0, n).into_owned();
        let (x, y) = (at[n + 2 * flight], at[n + 2 * flight + 1]);
        let level = |air_mps: f64| Vector2::from(self.forms.level(&doubts, air_mps));
        let gust_mps = (GUST_SHARE * x.hypot(y)).max(LEAST_GUST_MPS);
        let slope_at = |air_mps: f64| {
            let low = (air_mps - 0.25).max(0.0);
            (level(low + 0.5) - level(low)) / 0.5
        };
        let hover_mps = x.hypot(y);
        let hover = level(hover_mps);
        let count = legs.legs.len() as f64;
        // The air of a leg and that of the hovers around it.
        let pulse_us = legs.noise_us.max(LEAST_NOISE_US) * 1.5_f64.sqrt();
        let air_of = |leg: &WindLeg| (leg.ground_mps[0] - x).hypot(leg.ground_mps[1] - y);
        let tangent = |lean_deg: f64| lean_deg.to_radians().tan();
        let lean2 = LEAN_RAD * LEAN_RAD;
        let at_hover = slope_at(hover_mps) * gust_mps;
        let by_hover = Vector3::new(0.0, -at_hover.y, at_hover.x);
        let one = |leg: &WindLeg| {
            let air_mps = air_of(leg);
            let wanted = level(air_mps);
            let compared = wanted.y - hover.y;
            let change_us = leg.change_us - self.slope * leg.climb_mps;
            let hover_lean_deg = leg.hover_lean_deg.unwrap_or(legs.hover_lean_deg);
            let mut left = Vector3::new(
                tangent(leg.lean_deg) - wanted.x,
                change_us - compared,
                tangent(hover_lean_deg) - hover.x,
            );
            // What no form describes is the same on all legs at one air speed: these do not average it away.
            let alike = |other: &&WindLeg| (air_of(other) - air_mps).abs() < ALIKE_MPS;
            let alike = legs.legs.iter().filter(alike).count() as f64;
            let mut form = Vector3::new(
                alike * wanted.x * wanted.x,
                alike * compared * compared,
                count * hover.x * hover.x,
            );
            let alone = Vector3::new(lean2, pulse_us * pulse_us, count * lean2);
            let at_leg = slope_at(air_mps) * gust_mps;
            let mut by_leg = Vector3::new(at_leg.x, at_leg.y, 0.0);
            let mut by_hover = by_hover;
            if leg.is_track {
                // Nothing is told by its pulse.
                for of_pulse in [&mut left.y, &mut form.y, &mut by_leg.y, &mut by_hover.y] {
                    *of_pulse = 0.0;
                }
            }
            let noise = Matrix3::from_diagonal(&(alone + FORM_SHARE * FORM_SHARE * form))
                + by_leg * by_leg.transpose()
                + by_hover * by_hover.transpose();
            (left, noise)
        };
        legs.legs.iter().map(one).collect()
    }

    /// Minus the logarithm of a flight's likelihood, without its constant, and its misfit.
    fn cost_of(&self, flight: usize, at: &DVector<f64>) -> (f64, f64) {
        let (mut cost, mut misfit) = (0.0, 0.0);
        for (left, noise) in self.left(flight, at) {
            let Some(inverse) = noise.try_inverse() else { return (f64::INFINITY, f64::INFINITY) };
            let chi2 = left.dot(&(inverse * left));
            misfit += chi2;
            cost += 0.5 * (chi2 + noise.determinant().ln());
        }
        (cost, misfit)
    }

    /// Minus the logarithm of the posterior density, without its constant.
    fn cost(&self, at: &DVector<f64>) -> f64 {
        let legs: f64 = (0..self.flown.len()).map(|flight| self.cost_of(flight, at).0).sum();
        let prior = at
            .iter()
            .enumerate()
            .map(|(place, value)| 0.5 * (value / self.prior_sd(place)).powi(2));
        legs + prior.sum::<f64>()
    }

    fn prior_sd(&self, place: usize) -> f64 {
        if place < self.doubts() { 1.0 } else { WIND_MPS }
    }

    /// Normal matrix of a flight's legs and gradient of the cost by what is left.
    fn normal(&self, flight: usize, at: &DVector<f64>) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let p = at.len();
        let here = self.left(flight, at);
        let columns: Vec<Vec<Vector3<f64>>> = (0..p)
            .map(|place| {
                let mut beside = at.clone();
                beside[place] += STEP;
                let there = self.left(flight, &beside);
                here.iter().zip(there).map(|(here, there)| (there.0 - here.0) / STEP).collect()
            })
            .collect();
        let (mut normal, mut right) = (DMatrix::zeros(p, p), DVector::zeros(p));
        for (row, (left, noise)) in here.iter().enumerate() {
            let inverse = noise.try_inverse()?;
            for one in 0..p {
                let weighed = inverse * columns[one][row];
                right[one] += weighed.dot(left);
                for other in 0..p {
                    normal[(one, other)] += weighed.dot(&columns[other][row]);
                }
            }
        }
        Some((normal, right))
    }

    fn descend(&self, start: &DVector<f64>) -> Option<(DVector<f64>, f64)> {
        let (mut at, mut cost) = (start.clone(), self.cost(start));
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let (mut normal, mut right) =
                (DMatrix::zeros(at.len(), at.len()), DVector::zeros(at.len()));
            for flight in 0..self.flown.len() {
                let of_flight = self.normal(flight, &at)?;
                normal += of_flight.0;
                right += of_flight.1;
            }
            for place in 0..at.len() {
                let known = self.prior_sd(place).powi(-2);
                normal[(place, place)] += known;
                right[place] += known * at[place];
            }
            let mut gained = 0.0;
            for _ in 0..8 {
                let mut damped = normal.clone();
                for place in 0..at.len() {
                    damped[(place, place)] *= 1.0 + damping;
                }
                let tried = &at - damped.cholesky()?.solve(&right);
                let there = self.cost(&tried);
                if there < cost {
                    gained = cost - there;
                    (at, cost) = (tried, there);
                    damping *= 0.2;
                    break;
                }
                damping *= 8.0;
            }
            if gained < 1e-6 {
                break;
            }
        }
        Some((at, cost))
    }

    /// Winds of a flight from which the search starts.
    fn winds(&self, flight: usize) -> Vec<[f64; 2]> {
        let place = self.doubts() + 2 * flight;
        let mut starts: Vec<(f64, [f64; 2])> = Vec::new();
        for speed_mps in STARTS_MPS {
            for to in 0..STARTS_TO {
                let angle = to as f64 / STARTS_TO as f64 * std::f64::consts::TAU;
                let wind_mps = [speed_mps * angle.cos(), speed_mps * angle.sin()];
                let mut start = DVector::zeros(self.size());
                (start[place], start[place + 1]) = (wind_mps[0], wind_mps[1]);
                let prior = 0.5 * (speed_mps / WIND_MPS).powi(2);
                starts.push((self.cost_of(flight, &start).0 + prior, wind_mps));
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.into_iter().take(FOLLOWED).map(|(_, wind_mps)| wind_mps).collect()
    }

    fn best(&self) -> Option<Belief> {
        let n = self.doubts();
        let mut starts = vec![DVector::zeros(self.size())];
        for flight in 0..self.flown.len() {
            let place = n + 2 * flight;
            let winds = self.winds(flight);
            let with = |start: &DVector<f64>, wind_mps: &[f64; 2]| {
                let mut start = start.clone();
                (start[place], start[place + 1]) = (wind_mps[0], wind_mps[1]);
                start
            };
            starts = starts
                .iter()
                .flat_map(|start| winds.iter().map(move |wind_mps| with(start, wind_mps)))
                .collect();
        }
        let ends = starts.iter().filter_map(|start| self.descend(start));
        let (at, _) = ends.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let mut normal = DMatrix::zeros(at.len(), at.len());
        for (flight, legs) in self.flown.iter().enumerate() {
            // Legs that scatter by more than they should tell less.
            let free = (3 * legs.legs.len()).saturating_sub(2).max(1) as f64;
            let worse = (self.cost_of(flight, &at).1 / free).max(1.0);
            normal += self.normal(flight, &at)?.0 / worse;
        }
        for place in 0..at.len() {
            normal[(place, place)] += self.prior_sd(place).powi(-2);
        }
        let covariance = normal.cholesky()?.inverse();
        let belief = Belief {
            mean: at.rows(0, n).into_owned(),
            covariance: covariance.view((0, 0), (n, n)).into_owned(),
        };
        belief.mean.iter().all(|value| value.is_finite()).then_some(belief)
    }
}

#[cfg(test)]
mod tests {
    use super::super::wind_forms::tests::forms;
    use super::*;

    const LEGS: [[f64; 2]; 8] = [
        [3.0, 0.0],
        [-3.0, 0.0],
        [0.0, 3.0],
        [0.0, -3.0],
        [6.0, 0.0],
        [-6.0, 0.0],
        [0.0, 6.0],
        [0.0, -6.0],
    ];

    /// A drone with other drag and lift than its file's.
    fn flown(doubts: [f64; 2]) -> WindLegs {
        flown_in(doubts, [0.8, -0.5])
    }

    fn flown_in(doubts: [f64; 2], wind_mps: [f64; 2]) -> WindLegs {
        let forms = forms();
        let doubts = DVector::from_row_slice(&doubts);
        let mut other = forms.clone();
        for (doubt, by) in forms.doubts.iter().zip(&doubts) {
            for (of, more) in
                [(&mut other.file.lean, &doubt.lean), (&mut other.file.change_us, &doubt.change_us)]
            {
                let cells = of.iter_mut().flatten().zip(more.iter().flatten());
                cells.for_each(|(of, more)| *of += by * more);
            }
        }
        WindLegs::expected(&other, &LEGS, wind_mps, 2.0)
    }

    #[test]
    fn legs_tell_drag_and_lift_and_the_wind_besides() {
        for truth in [[0.0, 0.0], [-1.5, 1.0], [1.0, -1.2]] {
            let belief = posterior(&[&flown(truth)], &forms(), 26.0);
            for (place, truth) in truth.iter().enumerate() {
                let sd = belief.covariance[(place, place)].sqrt();
                assert!(sd < 0.6, "{sd}");
                let off = belief.mean[place] - truth;
                assert!(off.abs() < 1.5 * sd.max(0.1), "{place}: {off} of {truth} with {sd}");
            }
        }
    }

    #[test]
    fn legs_of_two_flights_share_the_drone_and_not_the_wind() {
        let forms = forms();
        for truth in [[-1.5, 1.0], [1.0, -1.2]] {
            let (calm, windy) = (flown(truth), flown_in(truth, [-4.0, 6.5]));
            let found = |flown: &[&WindLegs]| posterior(flown, &forms, 26.0);
            let both = found(&[&calm, &windy]);
            for (place, truth) in truth.iter().enumerate() {
                let sd = |belief: &Belief| belief.covariance[(place, place)].sqrt();
                assert!(sd(&both) < sd(&found(&[&calm])), "{place}");
                assert!(sd(&both) < sd(&found(&[&windy])), "{place}");
                let off = both.mean[place] - truth;
                assert!(off.abs() < 1.5 * sd(&both).max(0.1), "{place}: {off} of {truth}");
            }
            let swapped = found(&[&windy, &calm]);
            assert!((swapped.mean - both.mean).norm() < 1e-3, "in any order");
        }
        assert_eq!(posterior(&[], &forms, 26.0), forms.prior());
    }

    #[test]
    fn tracks_tell_drag_by_their_leans_and_nothing_by_their_pulses() {
        let truth = [-1.5, 1.0];
        let mut scan = flown(truth);
        for (index, leg) in scan.legs.iter_mut().enumerate() {
            leg.is_track = true;
            // The air that is measured along them.
            leg.change_us += if index % 2 == 0 { 30.0 } else { -45.0 };
        }
        let belief = posterior(&[&scan], &forms(), 26.0);
        let sd = |place: usize| belief.covariance[(place, place)].sqrt();
        assert!((belief.mean[0] - truth[0]).abs() < 0.5, "drag {}", belief.mean[0]);
        assert!(sd(0) < 0.6, "drag {}", sd(0));
        assert!(belief.mean[1].abs() < 0.1 && sd(1) > 0.95, "lift {} {}", belief.mean[1], sd(1));
    }

    #[test]
    fn legs_that_scatter_tell_less() {
        let mut scattered = flown([0.0, 0.0]);
        let sure = posterior(&[&scattered], &forms(), 26.0).covariance.trace();
        for (index, leg) in scattered.legs.iter_mut().enumerate() {
            leg.change_us += if index % 3 == 0 { 20.0 } else { -10.0 };
        }
        let unsure = posterior(&[&scattered], &forms(), 26.0).covariance.trace();
        assert!(unsure > 1.5 * sure, "{unsure} {sure}");
    }

    #[test]
    fn a_climb_on_a_leg_is_no_lift() {
        let mut climbing = flown([0.0, 1.0]);
        let wanted = posterior(&[&climbing], &forms(), 26.0).mean;
        for leg in &mut climbing.legs {
            leg.climb_mps += 0.1;
            leg.change_us += 2.6;
        }
        let found = posterior(&[&climbing], &forms(), 26.0).mean;
        assert!((found - wanted).norm() < 1e-6);
    }
}
