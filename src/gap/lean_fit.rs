//! Fit of how a vehicle leans, by horizontal legs at known speeds over ground: most probable law
//! and mean wind, with gusts that the whole fleet shares.

use nalgebra::SMatrix;
use rayon::prelude::*;

use super::bins::Bin;
use super::gusts::{Gusts, Seen};
use super::lean_law::LeanLaw;
use super::memory::{Digest, Memory};
use crate::numeric::{differences_at_once, mean, minimise, minimise_roughly, most};

/// Laws that were fitted: the wind of a comparison is read until it stays, and then once more with all that it tells.
static FITTED: Memory<Fitted> = Memory::of(1_000);

/// Prior standard deviation of the quadratic part of the model's own lean law, as a share. 0.4 was tried and
/// taken back when the wind got an uncertainty of its own in the search.
const SQUARE_DOUBT: f64 = 0.15;
/// Prior standard deviation of the linear part, rad/(m/s): covers rotors without drag and those of the usual
/// 1.0 to 1.5 degrees per m/s (docs/physics.md, 2.6). 0.01 before gusts were fitted with the law; chosen.
const LINEAR_DOUBT: f64 = 0.03;
/// Linear parts from which the search starts besides the model's, rad/(m/s): small rotors have 0.6 to 1.7
/// degrees per m/s. The fit has several minima: of two flights whose models were tried with a body besides a drag of
/// the rotors, the deepest was found from nearly none in one, and from the usual ones in the other.
const USUAL_LINEAR: [f64; 3] = [0.001, 0.01, 0.03];
/// Starts are others if the square roots of their drags, in units, are further apart. Numerical.
const OTHER_START: f64 = 0.25;
/// A search that only finds under which start the deepest bottom is ends where two steps gain less, nats. Numerical.
const ROUGH_NATS: f64 = 0.1;
/// Searches from where the last one ended, at most: each has only so many steps. Numerical.
const AGAIN: usize = 3;
/// A search that gains less was at the bottom already, nats. Numerical.
const BOTTOM_NATS: f64 = 0.02;
/// Prior median of the gusts, m/s: 15 % of 1 to 6 m/s of wind are 0.15 to 0.9.
const GUST_MPS: f64 = 0.5;
/// Prior standard deviation of the gusts, as a factor. Chosen wide.
const GUST_FACTOR: f64 = 2.5;
/// The same downwards: some days are still, and some flights are in a hall. With the former, what hardly moves with a gust, a
/// law without a linear part, was as probable in still air as the law that legs of 3 and 6 m/s showed. Chosen wide.
const STILL_FACTOR: f64 = 20.0;
/// Gusts with which a search starts at least and at most, m/s. Numerical.
const START_GUSTS_MPS: [f64; 2] = [0.003, 3.0];
/// Time scale of the gusts, s, as in the benchmark. Not fitted; bins of 3 s hardly show it.
const GUST_S: f64 = 25.0;
/// Prior standard deviation of the exponent by which the wind grows with height: 1/7 over flat land, up to 0.3 over
/// rough (Stull 1988, section 9.7). Legs and hovers are flown at several heights, and what the wind gains aloft must not
/// be taken from the law.
pub(super) const SHEAR: f64 = 0.2;
/// Prior standard deviation of the updraft about the one that the law holds in, m/s. Leans of climbs and descents go with
/// it where a body feels the whole air, and a wrong one must not be taken for a wind: on ArduPilot's own frame with twice its drag,
/// in 0.5 m/s of updraft that nobody knew of, a wind of 3.0 m/s was read as 2.4, against what the legs said.
const UPDRAFT_MPS: f64 = 2.0;
/// Standard deviation of what a lean may differ by from a law of level axes along the climb, as a share, for a line and a
/// parabola: two models of the same rotor, fitted to each other over the flown speeds, differ by 3 % (rms) and up to 8 %. Rotors with
/// drag that lean by 15 degrees in 8 m/s lean by 4 % less at 3.5 m/s of descent than such a law says, which a body had explained.
pub(super) const FORM_SHARE: f64 = 0.05;
/// Heights below this count as this, m: the roughness layer.
const LOWEST_M: f64 = 1.0;
/// Prior median of the scatter of a group's mean lean in a bin, rad: a tenth of a degree, what attitudes of
/// the firmware are off by (docs/firmware.md).
pub(super) const SCATTER_RAD: f64 = 0.002;
/// Prior standard deviation of the scatter, as a factor. Chosen.
const SCATTER_FACTOR: f64 = 2.0;
/// Scatter below which there is none, rad: attitudes are logged to a hundredth of a degree.
const LEAST_SCATTER_RAD: f64 = 2e-4;
/// What the lean still lacks of its steady value on legs that are too short to settle, beyond what the
/// simulator lacks there, rad: a quarter of a degree. Chosen.
const UNSETTLED_RAD: f64 = 0.004;
/// Variables of the search, in numbers near 1: mean wind (two), the law's linear and quadratic parts, and
/// the logarithms of gusts and scatter.
const COUNT: usize = 6;
/// What one unit of each variable is. Numerical.
const UNITS: [f64; COUNT] = [1.0, 1.0, 0.01, 0.001, 1.0, 1.0];
/// Place of the law's linear part, or of what a body adds to its quadratic part. A search goes by its square root, as a lean
/// never goes against the wind: many vehicles have none of it, and a search that ran against a wall there ended up to 3 nats and
/// 0.2 m/s of wind beside the bottom.
const DRAG: usize = 2;
/// What one unit of the latter is, rad/(m/s)². Numerical.
const BODY_UNIT: f64 = 0.001;
/// Prior standard deviation of the drag of a round body that the model lacks, rad/(m/s)²: 0.1 m² on 1 kg. Chosen wide.
const BODY_DOUBT: f64 = 0.006;
/// Such drags from which the search starts, rad/(m/s)².
const BODIES: [f64; 3] = [0.0005, 0.002, 0.006];
/// Place of its quadratic part.
const SQUARE: usize = 3;
/// Place of the logarithm of the gusts.
const GUST: usize = 4;
/// Step of the first differences, in units. Numerical: across the valley between wind and law leans bend by 2e5 nats per (m/s)², along
/// it by 60. With a step of 1e-4 slopes were off by 12 nats per m/s, and the bottom by 0.2 m/s and more. Misfits of some
/// thousands of nats are rounded to 1e-12.
pub(super) const SLOPE_STEP: f64 = 1e-6;
/// Step of the second differences, in units. Numerical.
const STEP: f64 = 0.02;

/// The mean lean of a group in one bin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Point {
    time_s: f64,
    pub velocity_mps: [f64; 3],
    /// Logarithm of the height, in m.
    ln_height: f64,
    lean_rad: [f64; 2],
    /// Whether the bin is horizontal flight.
    pub moves: bool,
}

impl Point {
    pub(super) fn of(bin: &Bin, height_m: f64, lean_rad: [f64; 2]) -> Self {
        Self {
            time_s: bin.middle_s(),
            velocity_mps: bin.velocity_mps,
            ln_height: height_m.max(LOWEST_M).ln(),
            lean_rad,
            moves: bin.is_horizontal(),
        }
    }
}

/// What a model lacks that leans more than it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Lacks {
    /// Drag of the rotors, which is linear in the air speed.
    Rotors,
    /// Drag of a round body, which goes with its square.
    Body,
}

/// A round body that the model lacks, by legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Body {
    /// Part of the lean that it adds, rad/(m/s)².
    pub square: f64,
    /// Standard error of that.
    pub square_se: f64,
    /// By how much it explains the leans better than a drag of the rotors, nats.
    pub better_nats: f64,
}

/// A law and a mean wind by legs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Fitted {
    /// Most probable law of the lean.
    pub law: LeanLaw,
    /// Standard error of its linear part, rad/(m/s).
    pub linear_se: f64,
    /// Mean wind, show frame, m/s.
    pub mean_mps: [f64; 2],
    /// Standard error of it along either axis, m/s.
    pub mean_se_mps: f64,
    /// Minus the logarithm of the posterior density, but for a constant, nats.
    pub misfit_nats: f64,
}

/// Fits the law from the model's. The search starts from the model's own linear part and from what small
/// rotors usually have: with too small a one the wind begins far too strong.
pub(super) fn fit(points: Vec<Point>, model: LeanLaw) -> Fitted {
    // What does not feel the updraft is fitted once for all of them.
    let still = LeanLaw { updraft_mps: 0.0, ..model };
    let of = if model.feels_updraft() { model } else { still };
    let mut digest = Digest::new();
    digest.add_debug(&(&points, of));
    let fitted = FITTED.get(digest).unwrap_or_else(|| {
        let fitted = fitted(points, of);
        FITTED.keep(digest, fitted);
        fitted
    });
    Fitted { law: LeanLaw { updraft_mps: model.updraft_mps, ..fitted.law }, ..fitted }
}

fn fitted(points: Vec<Point>, model: LeanLaw) -> Fitted {
    let leans = Leans::of(points);
    let model = usable(model);
    let (at, misfit_nats) = most_probable(&leans, model, Lacks::Rotors);
    let found = Candidate::of(&at, model, Lacks::Rotors).air;
    // By the drag itself: at its bound, too, it is known only as well as the leans tell.
    let errors = standard_errors(&at, |at| misfit(&leans, at, model, Lacks::Rotors));
    Fitted {
        law: found.law,
        linear_se: UNITS[DRAG] * errors[DRAG],
        mean_mps: found.mean_mps,
        mean_se_mps: errors[0].hypot(errors[1]) / std::f64::consts::SQRT_2,
        misfit_nats,
    }
}

/// Fits a round body in place of a drag of the rotors, which was fitted to the same leans with this misfit, nats.
pub(super) fn fit_body(points: Vec<Point>, model: LeanLaw, of_rotors_nats: f64) -> Body {
    let leans = Leans::of(points);
    let model = usable(model);
    let (at, misfit_nats) = most_probable(&leans, model, Lacks::Body);
    let errors = standard_errors(&at, |at| misfit(&leans, at, model, Lacks::Body));
    Body {
        square: BODY_UNIT * at[DRAG],
        square_se: BODY_UNIT * errors[DRAG],
        better_nats: of_rotors_nats - misfit_nats,
    }
}

/// Leans in the order of time, with what is the same for every law.
pub(super) struct Leans {
    pub points: Vec<Point>,
    /// What is left at each of them of the gusts at the one before.
    decay: Vec<f64>,
    /// Logarithms of the heights, from their mean.
    aloft: Vec<f64>,
    /// Fastest climb or descent, 1 at least, m/s.
    pub fastest_climb_mps: f64,
}

impl Leans {
    pub(super) fn of(mut points: Vec<Point>) -> Self {
        points.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        let middle = mean(points.iter().map(|point| point.ln_height)).unwrap_or_default();
        let aloft = points.iter().map(|point| point.ln_height - middle).collect();
        let before = points.first().into_iter().chain(&points);
        let steps = points.iter().zip(before);
        let decay =
            steps.map(|(point, before)| (-(point.time_s - before.time_s) / GUST_S).exp()).collect();
        let climbs = points.iter().map(|point| point.velocity_mps[2].abs());
        let fastest_climb_mps = most(climbs).unwrap_or_default().max(1.0);
        Self { points, decay, aloft, fastest_climb_mps }
    }

    /// Minus the logarithm of their likelihood, without its constant: each lean is the law's in the mean wind, and gusts
    /// change it by the law's slopes there. (The other way round, from leans to the wind, a law without a linear part has
    /// no slope where a lean is small.) `sizes` are the standard deviations of the gusts along both axes, of the growth of
    /// the wind with height, and of what else lasts; `more` is what the latter change a lean, rad, by, which changes with the
    /// climb by so much, rad/(m/s). Of several laws at once: each waits for its own last moment, and meanwhile the others go on.
    pub(super) fn misfits_nats<const N: usize, const LAWS: usize>(
        &self,
        of: &[(InAir, [f64; N]); LAWS],
        more: impl Fn(&Point, f64, f64) -> [f64; N],
    ) -> [f64; LAWS] {
        let mut gusts = of.map(|(_, sizes)| Gusts::new(sizes));
        for (point, (decay, aloft)) in self.points.iter().zip(self.decay.iter().zip(&self.aloft)) {
            for ((of, _), gusts) in of.iter().zip(&mut gusts) {
                gusts.see(*decay, of.seen(point, *aloft, &more));
            }
        }
        gusts.map(|gusts| gusts.misfit_nats())
    }
}

/// A model's law with both parts, as numbers that a search can begin with.
pub(super) fn usable(model: LeanLaw) -> LeanLaw {
    LeanLaw { linear: model.linear.max(1e-4), square: model.square.max(1e-5), ..model }
}

/// Variables of a search with the square root of the drag, as those with the drag.
fn squared(mut at: [f64; COUNT]) -> [f64; COUNT] {
    at[DRAG] *= at[DRAG];
    at
}

/// The most probable variables and their misfit.
fn most_probable(leans: &Leans, model: LeanLaw, lacks: Lacks) -> ([f64; COUNT], f64) {
    let objective = |at: &[f64; COUNT]| misfit(leans, &squared(*at), model, lacks);
    let slopes = |at: &[f64; COUNT], value: f64| {
        let all = |all: &[[f64; COUNT]; COUNT]| misfits(leans, &all.map(squared), model, lacks);
        differences_at_once(all, at, value, SLOPE_STEP)
    };
    let search = |drag: &f64| {
        let mut start =
            [0.0, 0.0, *drag, model.square / UNITS[SQUARE], GUST_MPS.ln(), SCATTER_RAD.ln()];
        let law = Candidate::of(&start, model, lacks).air.law;
        let [x, y] = hovering_wind(&leans.points, law);
        (start[0], start[1], start[DRAG]) = (x, y, drag.sqrt());
        start[GUST] = hovering_gusts_mps(&leans.points, law, [x, y]).ln();
        let end = minimise_roughly(start, None, ROUGH_NATS, objective, slopes);
        (end.at, end.value)
    };
    let starts: Vec<f64> = match lacks {
        Lacks::Rotors => {
            let model = model.linear / UNITS[DRAG];
            let usual = USUAL_LINEAR.map(|linear| linear / UNITS[DRAG]);
            let is_other = |drag: &f64| (drag.sqrt() - model.sqrt()).abs() > OTHER_START;
            [model].into_iter().chain(usual.into_iter().filter(is_other)).collect()
        }
        Lacks::Body => BODIES.map(|square| square / BODY_UNIT).to_vec(),
    };
    let ends: Vec<([f64; COUNT], f64)> = starts.par_iter().map(search).collect();
    let best = ends.into_iter().reduce(|best, end| if end.1 < best.1 { end } else { best });
    let (at, nats) = bottom(best.unwrap_or(([0.0; COUNT], f64::INFINITY)), objective, slopes);
    (squared(at), nats)
}

/// The bottom under a place with its misfit, nats: searched for again from where each search ends.
pub(super) fn bottom<const N: usize>(
    mut best: ([f64; N], f64),
    objective: impl Fn(&[f64; N]) -> f64,
    slopes: impl Fn(&[f64; N], f64) -> [f64; N],
) -> ([f64; N], f64) {
    for _ in 0..AGAIN {
        let next = minimise(best.0, &objective, &slopes);
        let gained = best.1 - next.1;
        if gained > 0.0 {
            best = next;
        }
        if gained < BOTTOM_NATS {
            break;
        }
    }
    best
}

/// Mean wind that a law reads from the leans in hover and in vertical flight, m/s.
pub(super) fn hovering_wind(points: &[Point], law: LeanLaw) -> [f64; 2] {
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for point in points.iter().filter(|point| !point.moves) {
        let air = law.air(point.lean_rad, point.velocity_mps[2]);
        sum[0] -= air[0];
        sum[1] -= air[1];
        count += 1.0;
    }
    sum.map(|sum: f64| if count > 0.0 { sum / count } else { 0.0 })
}

/// Standard deviation along either axis of the air that a law reads there about its mean, m/s, within what a search starts with.
pub(super) fn hovering_gusts_mps(points: &[Point], law: LeanLaw, mean_mps: [f64; 2]) -> f64 {
    let hovers = points.iter().filter(|point| !point.moves);
    let squares = hovers.map(|point| {
        let air = law.air(point.lean_rad, point.velocity_mps[2]);
        0.5 * ((air[0] + mean_mps[0]).powi(2) + (air[1] + mean_mps[1]).powi(2))
    });
    let [least_mps, most_mps] = START_GUSTS_MPS;
    mean(squares).unwrap_or_default().sqrt().clamp(least_mps, most_mps)
}

/// A law in a mean wind, with what leans scatter by.
#[derive(Clone, Copy, Debug)]
pub(super) struct InAir {
    pub mean_mps: [f64; 2],
    pub law: LeanLaw,
    pub gust_mps: f64,
    pub scatter_rad: f64,
}

impl InAir {
    /// The leans at a point, which is so much higher than the mean in the logarithm of its height, as its gusts, the growth of
    /// the wind and `more` change them.
    fn seen<const N: usize>(
        &self,
        point: &Point,
        aloft: f64,
        more: impl Fn(&Point, f64, f64) -> [f64; N],
    ) -> [Seen<N>; 2] {
        let [vx, vy, climb_mps] = point.velocity_mps;
        let air = [vx - self.mean_mps[0], vy - self.mean_mps[1]];
        let (wanted, slopes) = self.law.lean_and_slopes(air, climb_mps);
        let more_rad = if point.moves { UNSETTLED_RAD } else { LEAST_SCATTER_RAD };
        let scatter = self.scatter_rad.hypot(more_rad);
        let more_mps = self.mean_mps.map(|mean_mps| mean_mps * aloft);
        [0, 1].map(|axis| {
            let by_air = [-slopes.by_air[(axis, 0)], -slopes.by_air[(axis, 1)]];
            let mut looks_at = more(point, wanted[axis], slopes.by_climb[axis]);
            let growth = by_air[0] * more_mps[0] + by_air[1] * more_mps[1];
            for (place, look) in [by_air[0], by_air[1], growth].into_iter().enumerate() {
                looks_at[place] = look;
            }
            Seen { off: point.lean_rad[axis] - wanted[axis], looks_at, variance: scatter * scatter }
        })
    }

    /// Twice the nats that its gusts and scatter cost for being other than usual.
    pub(super) fn unusual(&self) -> f64 {
        let factor = if self.gust_mps < GUST_MPS { STILL_FACTOR } else { GUST_FACTOR };
        let gusts = (self.gust_mps / GUST_MPS).ln() / factor.ln();
        let scatter = (self.scatter_rad / SCATTER_RAD).ln() / SCATTER_FACTOR.ln();
        gusts * gusts + scatter * scatter
    }
}

/// What is fitted, in natural units.
struct Candidate {
    air: InAir,
    /// Quadratic part of the law without a body that the model lacks, rad/(m/s)².
    square: f64,
}

impl Candidate {
    fn of(at: &[f64; COUNT], model: LeanLaw, lacks: Lacks) -> Self {
        let square = at[SQUARE] * UNITS[SQUARE];
        let law = match lacks {
            Lacks::Rotors => LeanLaw { linear: at[DRAG] * UNITS[DRAG], square, ..model },
            Lacks::Body => LeanLaw { square, ..model }.with_body(at[DRAG] * BODY_UNIT),
        };
        let (gust_mps, scatter_rad) = (at[GUST].exp(), at[5].exp());
        Self { air: InAir { mean_mps: [at[0], at[1]], law, gust_mps, scatter_rad }, square }
    }
}

/// Minus the logarithm of the posterior density, without its constant.
fn misfit(leans: &Leans, at: &[f64; COUNT], model: LeanLaw, lacks: Lacks) -> f64 {
    misfits(leans, &[*at], model, lacks)[0]
}

/// As [`misfit`], of several sets of variables at once.
fn misfits<const SETS: usize>(
    leans: &Leans,
    at: &[[f64; COUNT]; SETS],
    model: LeanLaw,
    lacks: Lacks,
) -> [f64; SETS] {
    let of = at.map(|at| Candidate::of(&at, model, lacks));
    let airs = of.each_ref().map(|of| of.air);
    let form = |point: &Point, lean_rad: f64| {
        let along = point.velocity_mps[2] / leans.fastest_climb_mps;
        [lean_rad * along, lean_rad * along * along]
    };
    // No updraft for what is tried beside a model that does not feel it: a body would explain with one what rotors must without.
    let mut misfits = if model.leaning.is_some() {
        let sizes = airs.map(|air| (air, [air.gust_mps, air.gust_mps, SHEAR, UPDRAFT_MPS]));
        leans.misfits_nats(&sizes, |_, _, by_climb| [0.0, 0.0, 0.0, -by_climb])
    } else if model.feels_updraft() {
        let sizes = airs.map(|air| {
            (air, [air.gust_mps, air.gust_mps, SHEAR, FORM_SHARE, FORM_SHARE, UPDRAFT_MPS])
        });
        leans.misfits_nats(&sizes, |point, lean_rad, by_climb| {
            let [line, parabola] = form(point, lean_rad);
            [0.0, 0.0, 0.0, line, parabola, -by_climb]
        })
    } else {
        let sizes =
            airs.map(|air| (air, [air.gust_mps, air.gust_mps, SHEAR, FORM_SHARE, FORM_SHARE]));
        leans.misfits_nats(&sizes, |point, lean_rad, _| {
            let [line, parabola] = form(point, lean_rad);
            [0.0, 0.0, 0.0, line, parabola]
        })
    };
    let square = |value: f64| value * value;
    for ((misfit, of), at) in misfits.iter_mut().zip(&of).zip(at) {
        let drag = match lacks {
            Lacks::Rotors => (of.air.law.linear - model.linear) / LINEAR_DOUBT,
            Lacks::Body => at[DRAG] * BODY_UNIT / BODY_DOUBT,
        };
        let known = square((of.square.max(1e-7) / model.square).ln() / SQUARE_DOUBT) + square(drag);
        *misfit += 0.5 * (known + of.air.unusual());
    }
    misfits
}

/// Standard errors in the search's units, by the curvature at the bottom; infinite where it has none.
fn standard_errors(at: &[f64; COUNT], objective: impl Fn(&[f64; COUNT]) -> f64) -> [f64; COUNT] {
    let moved = |a: usize, by_a: f64, b: usize, by_b: f64| {
        let mut place = *at;
        place[a] += by_a;
        place[b] += by_b;
        objective(&place)
    };
    let curvature = SMatrix::<f64, COUNT, COUNT>::from_fn(|a, b| {
        (moved(a, STEP, b, STEP) - moved(a, STEP, b, -STEP) - moved(a, -STEP, b, STEP)
            + moved(a, -STEP, b, -STEP))
            / (4.0 * STEP * STEP)
    });
    let inverse = curvature.try_inverse();
    let mut errors = [f64::INFINITY; COUNT];
    for (place, error) in errors.iter_mut().enumerate() {
        let variance = inverse.map_or(f64::INFINITY, |inverse| inverse[(place, place)]);
        if variance > 0.0 {
            *error = variance.sqrt();
        }
    }
    errors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::air::SEA_LEVEL_DENSITY;
    use crate::effects::Role;
    use crate::vehicle::library::builtin;

    /// Small rotors' law, by which the leans of a flight in wind that grows with height are made.
    fn law() -> LeanLaw {
        let mut vehicle = builtin("airsim-generic-quad").unwrap();
        vehicle.effects.clear();
        Role::RotorDrag.set(&mut vehicle, 0.01);
        LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0)
    }

    /// Hovers and climbs between 10 and 90 m, and legs at 20 m.
    fn flown(law: LeanLaw, shear: f64) -> Vec<Point> {
        let wind = |height_m: f64| [-5.0, 2.0].map(|mean| mean * (height_m / 30.0).powf(shear));
        let legs = [[4.0, 0.0], [-4.0, 0.0], [0.0, 4.0], [0.0, -4.0]];
        (0..120)
            .map(|bin| {
                let leg = (bin % 6 == 0).then(|| legs[(bin / 6) % 4]);
                let height_m =
                    if leg.is_some() { 20.0 } else { 10.0 + 80.0 * (bin % 17) as f64 / 17.0 };
                let [vx, vy] = leg.unwrap_or_default();
                let [x, y] = wind(height_m);
                // Scatter of a tenth of a degree.
                let scatter = |turns: f64| 0.0025 * (turns * bin as f64).sin();
                let [ahead, aside] = law.lean([vx - x, vy - y], 0.0);
                Point {
                    time_s: 3.0 * bin as f64,
                    velocity_mps: [vx, vy, 0.0],
                    ln_height: height_m.ln(),
                    lean_rad: [ahead + scatter(2.4), aside + scatter(1.7)],
                    moves: leg.is_some(),
                }
            })
            .collect()
    }

    #[test]
    fn a_wind_that_grows_with_height_is_not_taken_from_the_law() {
        for shear in [0.0, 0.14, 0.28] {
            let found = fit(flown(law(), shear), law());
            let off = found.law.linear - law().linear;
            assert!(off.abs() < 4e-4, "{shear}: {off} rad/(m/s)");
        }
    }

    #[test]
    fn a_search_ends_at_the_bottom_where_rotors_have_no_drag() {
        let without = LeanLaw { linear: 0.0, ..law() };
        // Where hardly anything scatters, the valley is stiff.
        for (bent, share) in [(0.0, 1.0), (0.3, 1.0), (0.6, 0.05), (0.9, 1.0), (1.2, 0.05)] {
            let mut flown = flown(without, 0.0);
            for (bin, point) in flown.iter_mut().enumerate() {
                let [vx, vy, climb_mps] = point.velocity_mps;
                let steady = without.lean([vx + 5.0, vy - 2.0], climb_mps);
                point.lean_rad[0] += 0.002 * (bent * bin as f64).cos();
                point.lean_rad =
                    [0, 1].map(|axis| steady[axis] + share * (point.lean_rad[axis] - steady[axis]));
            }
            let leans = Leans::of(flown);
            let model = usable(without);
            let (at, nats) = most_probable(&leans, model, Lacks::Rotors);
            // From somewhere beside it, several times: nothing is deeper.
            for turn in 0..12 {
                let mut beside = at;
                beside[DRAG] = at[DRAG].sqrt();
                for (place, value) in beside.iter_mut().enumerate() {
                    *value += 0.1 * f64::from(7 * turn + 3 * place as i32).sin();
                }
                let of = |at: &[f64; COUNT]| misfit(&leans, &squared(*at), model, Lacks::Rotors);
                let slopes = |at: &[f64; COUNT], _: f64| {
                    std::array::from_fn(|place| {
                        let [after, before] = [1e-5, -1e-5].map(|step| {
                            let mut moved = *at;
                            moved[place] += step;
                            of(&moved)
                        });
                        (after - before) / 2e-5
                    })
                };
                let (_, deeper) = minimise(beside, of, slopes);
                assert!(deeper > nats - 0.05, "{bent}, {turn}: {deeper} for {nats}");
            }
        }
    }

    #[test]
    fn in_still_air_the_law_is_the_one_that_legs_show() {
        let law = LeanLaw::of(&builtin("arducopter-sitl").unwrap(), SEA_LEVEL_DENSITY, 0.0);
        let legs = [[3.0, 0.0], [3.0, 0.0], [-3.0, 0.0], [-3.0, 0.0], [0.0, -6.0], [0.0, 6.0]];
        for scatter_rad in [1e-5, 1e-4, 1e-3] {
            let point = |bin: usize| {
                // At the end of a ladder, of which each moment is flown by two groups.
                let leg = (bin / 2).checked_sub(135).and_then(|after| legs.get(after));
                let [x, y] = leg.copied().unwrap_or_default();
                let steady = law.lean([x, y], 0.0);
                let lean_rad =
                    [2.4, 1.7].map(|turns: f64| scatter_rad * (turns * bin as f64).sin());
                Point {
                    time_s: 4.0 * (bin / 2) as f64,
                    velocity_mps: [x, y, 0.0],
                    ln_height: 20_f64.ln(),
                    lean_rad: [steady[0] + lean_rad[0], steady[1] + lean_rad[1]],
                    moves: leg.is_some(),
                }
            };
            let found = fit((0..294).map(point).collect(), law);
            let off = found.law.linear / law.linear - 1.0;
            let wind_mps = found.mean_mps[0].hypot(found.mean_mps[1]);
            assert!(off.abs() < 0.05 && wind_mps < 0.02, "{scatter_rad}: {off}, {wind_mps} m/s");
        }
    }

    #[test]
    fn an_updraft_that_leans_of_climbs_show_is_not_taken_for_a_wind() {
        let body = law().with_body(0.004);
        let in_updraft = LeanLaw { updraft_mps: 1.0, ..body };
        let mut flown = flown(body, 0.0);
        // Every bin but the legs and a few hovers climbs or descends.
        for (bin, point) in flown.iter_mut().enumerate().filter(|(_, point)| !point.moves) {
            let climb_mps = [-3.0, -1.5, 0.0, 1.5, 3.0][bin % 5];
            let air_mps = [5.0, -2.0];
            let (before, after) = (body.lean(air_mps, 0.0), in_updraft.lean(air_mps, climb_mps));
            point.velocity_mps[2] = climb_mps;
            point.lean_rad = [0, 1].map(|axis| point.lean_rad[axis] + after[axis] - before[axis]);
        }
        let found = fit(flown, body);
        let off_mps = (found.mean_mps[0] + 5.0).hypot(found.mean_mps[1] - 2.0);
        let off = found.law.linear - body.linear;
        assert!(off_mps < 0.15 && off.abs() < 0.001, "{off_mps} m/s, {off} rad/(m/s)");
    }

    #[test]
    fn several_laws_at_once_are_each_as_alone() {
        let leans = Leans::of(flown(law(), 0.14));
        let sets = [0.2, 0.9, 1.7].map(|drag| [-4.0, 1.0, drag, 2.0, -0.5, -6.0]);
        let at_once = misfits(&leans, &sets, law(), Lacks::Rotors);
        let alone = sets.map(|at| misfit(&leans, &at, law(), Lacks::Rotors));
        assert_eq!(at_once.map(f64::to_bits), alone.map(f64::to_bits));
    }

    #[test]
    fn a_round_body_is_told_from_a_drag_of_the_rotors() {
        let more = 0.003;
        let told = |flown: Vec<Point>| {
            let of_rotors = fit(flown.clone(), law());
            fit_body(flown, law(), of_rotors.misfit_nats)
        };
        let body = told(flown(law().with_body(more), 0.14));
        assert!(body.better_nats > 10.0, "{body:?}");
        assert!((body.square - more).abs() < 3.0 * body.square_se, "{body:?}");
        assert!(body.square_se < 0.2 * more, "{body:?}");
        let rotors = LeanLaw { linear: law().linear + 0.02, ..law() };
        let body = told(flown(rotors, 0.14));
        assert!(body.better_nats < -10.0, "{body:?}");
        let body = told(flown(law(), 0.14));
        assert!(body.better_nats.abs() < 6.0, "nothing is missing: {body:?}");
    }

    #[test]
    fn leans_of_climbs_that_are_a_little_off_the_form_are_no_body() {
        let mut flown = flown(LeanLaw { linear: law().linear + 0.02, ..law() }, 0.0);
        // As rotors that lean by 15 degrees do: less in descents, and in climbs hardly more.
        for (bin, point) in flown.iter_mut().enumerate().filter(|(_, point)| !point.moves) {
            let climb_mps = [-3.5, -2.0, 0.0, 1.5, 3.5][bin % 5];
            point.velocity_mps[2] = climb_mps;
            let off = if climb_mps < 0.0 { -0.04 * (climb_mps / 3.5_f64).powi(2) } else { 0.0 };
            point.lean_rad = point.lean_rad.map(|lean_rad| (1.0 + off) * lean_rad);
        }
        let of_rotors = fit(flown.clone(), law());
        let body = fit_body(flown, law(), of_rotors.misfit_nats);
        assert!(body.better_nats < -6.0, "{body:?}");
    }

    #[test]
    fn a_law_at_its_bound_is_not_known_by_the_bound() {
        let without = LeanLaw { linear: 0.0, ..law() };
        let found = fit(flown(without, 0.0), law());
        assert!(found.law.linear < 1e-3, "{}", found.law.linear);
        assert!(found.linear_se > 3e-4, "{}", found.linear_se);
    }
}
