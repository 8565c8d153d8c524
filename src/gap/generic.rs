//! Free shapes: a dependence of the pulse on a signal that no effect of the library explains.

use std::ops::RangeInclusive;

use nalgebra::DVector;

use super::dependence::Dependence;
use super::gls::{Column, Pulses, means_of};
use super::response::Response;
use super::scene::Scene;
use crate::effects::Signals;
use crate::gap::verdict::Shape;
use crate::numeric;

/// A family of regressors that together make a free shape along one signal.
#[derive(Clone, Debug)]
pub(super) struct Generic {
    /// Name of the signal that the shape depends on.
    pub depends_on: Dependence,
    /// Label of the signal for an axis, with its unit.
    pub axis: &'static str,
    /// Regressors that span the shape.
    pub columns: Vec<Column>,
    /// Contribution of each regressor to the response to vertical air speed, by group and bin;
    /// empty if there is none.
    pub felt: Vec<Vec<Vec<Response>>>,
    /// The signal itself by group and bin, for drawing.
    pub along: Vec<Vec<f64>>,
    /// Nats that its freedom takes: 2 for each regressor beyond the first, and the logarithm of how
    /// many such families are tried.
    pub penalty: f64,
}

/// Wavelengths of height that are tried, m: a factor of sqrt 2 apart, from the height of a leg to the whole
/// ladder.
const WAVES_M: [f64; 7] = [10.0, 15.0, 20.0, 28.0, 40.0, 56.0, 80.0];
/// Air speed from which a direction alone may count, m/s. Chosen.
const KNEE_MPS: f64 = 1.5;
/// How the effect of a direction depends on the air speed, m/s: it grows with it, or hardly any more above
/// the knee. The two limits of what a body may do; the second is paid for in the penalty.
const GROWTHS: [fn(f64) -> f64; 2] =
    [|speed_mps| speed_mps, |speed_mps| KNEE_MPS * speed_mps / speed_mps.hypot(KNEE_MPS)];
/// Bins of two groups that begin at nearly the same time, s.
const SAME_INSTANT_S: f64 = 1.0;
/// Shortest period of a swing that is tried, s: ten bins.
const SHORTEST_SWING_S: f64 = 30.0;
/// Quarter turns of the slowest swing that is tried: what turns less is a curve in time.
const FEWEST_QUARTERS: usize = 8;
/// Share of the climb's square from which a swing is its trace. Chosen: within half a turn over the flight of the ladder's
/// own period, which is nearly 0.6.
const OF_THE_LADDER: f64 = 0.4;
/// Step of the derivative by vertical air speed, m/s. Numerical.
const SLOPE_STEP: f64 = 0.01;
/// Half of a range of height from which a response may change with it, m. Chosen.
const LEAST_HALF_M: f64 = 5.0;
/// A charge that changes by less, as a share, says nothing. Chosen.
const LEAST_CHARGE: f64 = 0.05;
/// A component of the air from the nose that spans less says nothing, m/s. Chosen; with 1.5 at first, in a calm wind what
/// depends on the heading had no shape.
const LEAST_TURN_MPS: f64 = 0.75;
/// A signal that moves less than this share of its scale says nothing. Chosen.
const LEAST_SPAN: f64 = 0.05;

/// All free shapes that the flight can show.
pub(super) fn all(scene: &Scene, headings: &[Vec<f64>]) -> Vec<Generic> {
    let along = |of: &dyn Fn(&Signals) -> f64| -> Vec<Vec<f64>> {
        scene.signals.iter().map(|group| group.iter().map(of).collect()).collect()
    };
    let climb = along(&|s| s.climb_mps);
    let time = along(&|s| s.time_s);
    let height = along(&|s| s.height_m);
    let wind = along(&|s| s.horizontal_mps);
    let mut found = Vec::new();
    found.extend(
        smooth(Dependence::Climb, "vertical velocity (m/s)", &climb, 5, 0.5).map(Generic::feels),
    );
    found.extend(smooth(Dependence::Time, "time since arming (s)", &time, 3, 30.0));
    found.extend(smooth(Dependence::Height, "height (m)", &height, 3, 3.0));
    found.extend(smooth(Dependence::Wind, "horizontal air speed (m/s)", &wind, 3, 1.5));
    found.extend(waves(&height));
    found.push(climb_times_time(&climb, &time));
    found.extend(climb_times_height(&climb, &height));
    found.extend(swings(&climb, &time));
    found.extend(steps(&time));
    found.extend(changes(&climb, &time));
    found.extend(scene.charge().as_ref().and_then(by_charge));
    found.extend(directions(scene, headings));
    found
}

/// Standard deviation of each shape by which steady flight may differ from a file that describes its vehicle well, us:
/// two models of the same rotor, fitted to each other over the flown speeds, differ by 0.4 to 2 us rms (docs/blind.md).
/// Many drones in calm air know their pulse to a tenth of that.
const FORM_US: f64 = 0.6;
/// Curves over the climb by which it may: from the first bend on.
const FORM_ORDERS: RangeInclusive<usize> = 2..=4;
/// Curves over the horizontal air speed.
const FORM_WIND_ORDERS: RangeInclusive<usize> = 1..=2;
/// As [`FORM_US`], over the horizontal air speed of legs: into a wind of 5 m/s they fly twice as fast as the ladder, and
/// the two models differ by 2 to 3 us there (docs/blind.md).
const FORM_WIND_US: f64 = 1.5;
/// As [`FORM_US`], over the climb of a flight that has legs: a model that is fitted to both fits the climb less well.
const FORM_WITH_LEGS_US: f64 = 1.0;

/// Shapes by which a flight may differ from any model of its kind, as regressors of one standard deviation each.
pub(super) fn form_doubts(scene: &Scene) -> Vec<Column> {
    let wind = Along { of: |signals| signals.horizontal_mps, least_span: 1.5 };
    let of_wind = wind.shapes(scene, FORM_WIND_ORDERS, 1.0);
    if of_wind.is_empty() {
        return CLIMB.shapes(scene, FORM_ORDERS, FORM_US);
    }
    // How climb acts changes with the wind.
    let mut of_both = Vec::new();
    for climb in CLIMB.shapes(scene, FORM_WIND_ORDERS, FORM_US) {
        let by = |wind: &Column| wind.each(|g, d, b| wind.at(g, d, b) * climb.at(g, d, b));
        of_both.extend(of_wind.iter().map(by));
    }
    let of_wind = wind.shapes(scene, FORM_WIND_ORDERS, FORM_WIND_US).into_iter();
    let of_climb = CLIMB.shapes(scene, FORM_ORDERS, FORM_WITH_LEGS_US).into_iter();
    of_climb.chain(of_wind).chain(of_both).collect()
}

/// Chebyshev polynomials over the climb; none where a flight spans too little of it.
pub(super) fn climb_shapes(scene: &Scene, orders: RangeInclusive<usize>) -> Vec<Column> {
    CLIMB.shapes(scene, orders, 1.0)
}

/// What shapes run along: a signal, and the least span of it that tells them apart.
struct Along {
    of: fn(&Signals) -> f64,
    least_span: f64,
}

/// Along the climb, m/s.
const CLIMB: Along = Along { of: |signals| signals.climb_mps, least_span: 0.5 };

impl Along {
    /// Chebyshev polynomials of a size; none where a flight spans too little.
    fn shapes(&self, scene: &Scene, orders: RangeInclusive<usize>, size: f64) -> Vec<Column> {
        let along: Vec<Vec<f64>> =
            scene.signals.iter().map(|group| group.iter().map(self.of).collect()).collect();
        let shows = span(&along).is_finite() && span(&along) > self.least_span;
        if shows { polynomials(&along, orders, size) } else { Vec::new() }
    }
}

/// Chebyshev polynomials over the range of a signal, of a size.
fn polynomials(along: &[Vec<f64>], orders: RangeInclusive<usize>, size: f64) -> Vec<Column> {
    let (low, high) = (least(along), most(along));
    let scaled = |value: f64| (2.0 * value - low - high) / (high - low);
    let of_order =
        |order: usize| Column::Shared(map(along, &|v| size * chebyshev(order, scaled(v))));
    orders.map(of_order).collect()
}

/// Waves over the height, where the flight spans most of one.
fn waves(height: &[Vec<f64>]) -> impl Iterator<Item = Generic> {
    WAVES_M.into_iter().filter(|wave_m| span(height) > 0.7 * wave_m).map(|wave_m| {
        let phase = |of: fn(f64) -> f64| {
            Column::Shared(map(height, &|h| of(std::f64::consts::TAU * h / wave_m)))
        };
        Generic {
            depends_on: Dependence::Height,
            axis: "height (m)",
            columns: vec![phase(f64::sin), phase(f64::cos)],
            felt: Vec::new(),
            along: height.to_vec(),
            penalty: 2.0 + (WAVES_M.len() as f64).ln(),
        }
    })
}

/// The product of climb speed and time.
fn climb_times_time(climb: &[Vec<f64>], time: &[Vec<f64>]) -> Generic {
    let middle = f64::midpoint(least(time), most(time));
    let half = (most(time) - least(time)).max(1.0) / 2.0;
    let product = |(climb, time): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
        climb.iter().zip(time).map(|(climb, time)| climb * (time - middle) / half).collect()
    };
    let crossed: Vec<Vec<f64>> = climb.iter().zip(time).map(product).collect();
    Generic {
        depends_on: Dependence::ClimbTime,
        axis: "vertical velocity times time, scaled",
        // A product comes with its own mean part. What goes with the size of the climb and time is what a
        // drift of the air does.
        felt: vec![
            straight(map(time, &|time| (time - middle) / half)),
            straight(map(time, &|_| 1.0)),
        ],
        columns: vec![Column::Shared(crossed.clone()), Column::Shared(climb.to_vec())],
        along: crossed,
        penalty: 2.0,
    }
}

/// The product of climb speed and height, where the flight spans enough of both.
fn climb_times_height(climb: &[Vec<f64>], height: &[Vec<f64>]) -> Option<Generic> {
    let middle = f64::midpoint(least(height), most(height));
    let half = span(height) / 2.0;
    let shows = span(climb) > 0.5 && half.is_finite() && half > LEAST_HALF_M;
    let part = map(height, &|height| (height - middle) / half);
    let product = |(climb, part): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
        climb.iter().zip(part).map(|(climb, part)| climb * part).collect()
    };
    let crossed: Vec<Vec<f64>> = climb.iter().zip(&part).map(product).collect();
    shows.then(|| Generic {
        depends_on: Dependence::ClimbHeight,
        axis: "vertical velocity times height, scaled",
        felt: vec![straight(part), straight(map(climb, &|_| 1.0))],
        columns: vec![Column::Shared(crossed.clone()), Column::Shared(climb.to_vec())],
        along: crossed,
        penalty: 2.0,
    })
}

/// Swings in time with one period, from [`SHORTEST_SWING_S`] to half of the flight. Neighbours differ by a
/// quarter of a turn over the whole flight, so that between them a twentieth of a swing's square is lost at most.
/// Of a swing with the ladder's own period only that part is one that is at rest where the ladder is fastest: the rest goes
/// with the climb.
fn swings<'a>(climb: &'a [Vec<f64>], time: &'a [Vec<f64>]) -> impl Iterator<Item = Generic> + 'a {
    let ladder = without_mean(climb);
    let span_s = span(time);
    let most = if span_s.is_finite() { (4.0 * span_s / SHORTEST_SWING_S) as usize } else { 0 };
    let count = most.saturating_sub(FEWEST_QUARTERS - 1);
    (FEWEST_QUARTERS..=most).map(move |quarters| {
        let per_s = std::f64::consts::FRAC_PI_2 * quarters as f64 / span_s;
        let phases = [f64::sin, f64::cos].map(|of| map(time, &|t: f64| of(per_s * t)));
        let phases = if share_in(&phases, &ladder) < OF_THE_LADDER {
            phases.map(Column::Shared).to_vec()
        } else {
            vec![Column::Shared(across(&phases, &ladder))]
        };
        Generic {
            depends_on: Dependence::Time,
            axis: "time since arming (s)",
            penalty: 2.0 * (phases.len() as f64 - 1.0) + (count as f64).ln(),
            columns: phases,
            felt: Vec::new(),
            along: time.to_vec(),
        }
    })
}

/// The swing of a period that has nothing of a series: between its turns where the series has its own.
fn across([sin, cos]: &[Vec<Vec<f64>>; 2], series: &DVector<f64>) -> Vec<Vec<f64>> {
    let along = |phase: &[Vec<f64>]| without_mean(phase).dot(series);
    let (of_sin, of_cos) = (along(sin), along(cos));
    let size = of_sin.hypot(of_cos).max(f64::MIN_POSITIVE);
    let (of_sin, of_cos) = (of_sin / size, of_cos / size);
    let at = |(sin, cos): (&f64, &f64)| of_cos * sin - of_sin * cos;
    let group = |(sin, cos): (&Vec<f64>, &Vec<f64>)| sin.iter().zip(cos).map(at).collect();
    sin.iter().zip(cos).map(group).collect()
}

fn without_mean(values: &[Vec<f64>]) -> DVector<f64> {
    let values = DVector::from_vec(values.concat());
    let mean = values.mean();
    values.add_scalar(-mean)
}

/// Share of a series' square that a swing takes.
fn share_in(phases: &[Vec<Vec<f64>>; 2], series: &DVector<f64>) -> f64 {
    let [sin, cos] = phases.each_ref().map(|phase| without_mean(phase));
    // The two are nearly at right angles over any flight of two turns.
    let part = |phase: &DVector<f64>| {
        let square = phase.norm_squared();
        if square > 0.0 { phase.dot(series).powi(2) / square } else { 0.0 }
    };
    (part(&sin) + part(&cos)) / series.norm_squared().max(f64::MIN_POSITIVE)
}

/// What begins or ends so few bins from the end of a flight is no step: there a drone has not settled, or one bin is off. Measured: in a
/// flight in 7 m/s of wind the last hover, of one bin, was 3.9 us off after a descent, and 35 nats spoke for a step there.
const FEWEST_BESIDE_STEP: usize = 3;

/// Moments between any two bins that follow each other, s, but at either end: a few seconds beside the true instant, the shared air
/// explains a sharp step better than a step does.
fn instants(time: &[Vec<f64>]) -> Vec<f64> {
    let mut moments = time.concat();
    moments.sort_by(f64::total_cmp);
    moments.dedup_by(|later, earlier| *later - *earlier < SAME_INSTANT_S);
    let between = moments.windows(2).map(|pair| f64::midpoint(pair[0], pair[1]));
    let count = moments.len().saturating_sub(2 * FEWEST_BESIDE_STEP - 1);
    between.skip(FEWEST_BESIDE_STEP - 1).take(count).collect()
}

/// Zero before an instant and one after it.
fn after(time: &[Vec<f64>], at_s: f64) -> Vec<Vec<f64>> {
    map(time, &|t| if t < at_s { 0.0 } else { 1.0 })
}

/// Steps of the pulse.
fn steps(time: &[Vec<f64>]) -> impl Iterator<Item = Generic> {
    let instants = instants(time);
    let penalty = (instants.len() as f64).ln();
    instants.into_iter().map(move |at_s| Generic {
        depends_on: Dependence::Step,
        axis: "time since arming (s)",
        columns: vec![Column::Shared(after(time, at_s))],
        felt: Vec::new(),
        along: time.to_vec(),
        penalty,
    })
}

/// Instants from which the pulse in hover and the response are others.
fn changes(climb: &[Vec<f64>], time: &[Vec<f64>]) -> impl Iterator<Item = Generic> {
    let instants = instants(time);
    let penalty = 2.0 + (instants.len() as f64).ln();
    instants.into_iter().map(move |at_s| {
        let later = after(time, at_s);
        let product = |(climb, later): (&Vec<f64>, &Vec<f64>)| -> Vec<f64> {
            climb.iter().zip(later).map(|(climb, later)| climb * later).collect()
        };
        let steeper = climb.iter().zip(&later).map(product).collect();
        Generic {
            // A step that grows with the climb is much of what a product of climb and time is.
            depends_on: Dependence::ClimbTime,
            axis: "time since arming (s)",
            felt: vec![straight(map(time, &|_| 0.0)), straight(later.clone())],
            columns: vec![Column::Shared(later), Column::Shared(steeper)],
            along: time.to_vec(),
            penalty,
        }
    })
}

/// A curve over the drones' own charge (by group, drone and bin), where it changes.
fn by_charge(charge: &Pulses) -> Option<Generic> {
    let values = charge.iter().flatten().flatten();
    let (low, high) = values.fold((1.0_f64, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
    if high - low <= LEAST_CHARGE {
        return None;
    }
    let powers = (1..=3).map(|power| {
        let drone =
            |bins: &Vec<f64>| bins.iter().map(|c| chebyshev(power, 2.0 * c - 1.0)).collect();
        let group = |drones: &Vec<Vec<f64>>| drones.iter().map(drone).collect();
        Column::Own(charge.iter().map(group).collect())
    });
    Some(Generic {
        depends_on: Dependence::Voltage,
        axis: "charge by the voltage at rest (share)",
        columns: powers.collect(),
        felt: Vec::new(),
        along: means_of(charge),
        penalty: 4.0,
    })
}

/// The direction of the air from the nose, growing with the air speed in several ways. A direction that
/// does not change is an offset.
fn directions(scene: &Scene, headings: &[Vec<f64>]) -> impl Iterator<Item = Generic> {
    GROWTHS.into_iter().filter_map(|grown| {
        let turns = |of: fn(f64) -> f64| {
            let value =
                |(angle, signals): (&f64, &Signals)| of(*angle) * grown(signals.horizontal_mps);
            let group = |(angles, signals): (&Vec<f64>, &Vec<Signals>)| {
                angles.iter().zip(signals).map(value).collect()
            };
            headings.iter().zip(&scene.signals).map(group).collect::<Vec<Vec<f64>>>()
        };
        let (ahead, aside) = (turns(f64::cos), turns(f64::sin));
        (span(&ahead).max(span(&aside)) > LEAST_TURN_MPS).then(|| Generic {
            depends_on: Dependence::Heading,
            axis: "direction of the air from the nose (rad)",
            columns: vec![Column::Shared(ahead), Column::Shared(aside)],
            felt: Vec::new(),
            along: headings.to_vec(),
            penalty: 2.0 + (GROWTHS.len() as f64).ln(),
        })
    })
}

/// What a smooth shape does to the response is hardly bent over a gust.
fn straight(slopes: Vec<Vec<f64>>) -> Vec<Vec<Response>> {
    let group = |slopes: Vec<f64>| slopes.into_iter().map(Response::straight).collect();
    slopes.into_iter().map(group).collect()
}

fn smooth(
    depends_on: Dependence,
    axis: &'static str,
    along: &[Vec<f64>],
    order: usize,
    least_span: f64,
) -> Option<Generic> {
    let (low, high) = (least(along), most(along));
    if !(high - low).is_finite() || high - low < least_span.max(LEAST_SPAN * high.abs()) {
        return None;
    }
    Some(Generic {
        depends_on,
        axis,
        columns: polynomials(along, 1..=order, 1.0),
        felt: Vec::new(),
        along: along.to_vec(),
        penalty: 2.0 * (order as f64 - 1.0),
    })
}

fn chebyshev(order: usize, x: f64) -> f64 {
    let (mut before, mut now) = (1.0, x);
    for _ in 1..order {
        (before, now) = (now, 2.0 * x * now - before);
    }
    if order == 0 { 1.0 } else { now }
}

fn map(values: &[Vec<f64>], of: &dyn Fn(f64) -> f64) -> Vec<Vec<f64>> {
    values.iter().map(|group| group.iter().map(|value| of(*value)).collect()).collect()
}

fn least(values: &[Vec<f64>]) -> f64 {
    numeric::least(values.iter().flatten()).unwrap_or(f64::INFINITY)
}

fn most(values: &[Vec<f64>]) -> f64 {
    numeric::most(values.iter().flatten()).unwrap_or(f64::NEG_INFINITY)
}

fn span(values: &[Vec<f64>]) -> f64 {
    most(values) - least(values)
}

impl Generic {
    /// The family with what each regressor adds to the response, for a signal that vertical air changes.
    fn feels(self) -> Self {
        let (low, high) = (least(&self.along), most(&self.along));
        let scale = 2.0 / (high - low);
        let slope = |power: usize| {
            straight(map(&self.along, &|v| {
                let at = |by| chebyshev(power, scale * (v + by) - (low + high) / (high - low));
                (at(SLOPE_STEP) - at(-SLOPE_STEP)) / (2.0 * SLOPE_STEP)
            }))
        };
        let felt = (1..=self.columns.len()).map(slope).collect();
        Self { felt, ..self }
    }

    /// Whether all drones of a group have the same. Drones that drift each by its own are not in the noise,
    /// and a regressor of each one's own finds some of it by chance.
    pub(super) fn is_shared(&self) -> bool {
        self.columns.iter().all(|column| matches!(column, Column::Shared(_)))
    }

    /// The shape with these coefficients, by its signal.
    pub(super) fn shape(&self, beta: &[f64]) -> Shape {
        let means: Vec<Vec<Vec<f64>>> = self.columns.iter().map(Column::means).collect();
        let mut points: Vec<(f64, f64)> = Vec::new();
        for (group, along) in self.along.iter().enumerate() {
            for (bin, x) in along.iter().enumerate() {
                let us = means.iter().zip(beta).map(|(mean, b)| b * mean[group][bin]).sum();
                points.push((*x, us));
            }
        }
        drawn(self.axis, points)
    }
}

/// Points of a drawn shape. For drawing only.
const POINTS: usize = 40;

/// A curve through points: means in up to forty places.
pub(super) fn drawn(axis: &str, mut points: Vec<(f64, f64)>) -> Shape {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let size = points.len().div_ceil(POINTS).max(1);
    let means = |of: fn(&(f64, f64)) -> f64| -> Vec<f64> {
        points.chunks(size).filter_map(|chunk| numeric::mean(chunk.iter().map(of))).collect()
    };
    Shape { axis: axis.to_owned(), x: means(|point| point.0), us: means(|point| point.1) }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;

    /// Share of a series' square that is left when a family has been fitted to it.
    fn left(family: &Generic, series: &[f64]) -> f64 {
        let columns: Vec<Vec<f64>> =
            family.columns.iter().map(|column| column.means().concat()).collect();
        let at = DMatrix::from_fn(series.len(), columns.len(), |row, column| columns[column][row]);
        let series = DVector::from_column_slice(series);
        let fitted = at.clone().svd(true, true).solve(&series, 1e-12).unwrap();
        (&series - at * fitted).norm_squared() / series.norm_squared()
    }

    fn least_left(families: impl Iterator<Item = Generic>, series: &[f64]) -> f64 {
        families.map(|family| left(&family, series)).fold(f64::INFINITY, f64::min)
    }

    fn times() -> Vec<Vec<f64>> {
        vec![(0..170).map(|bin| 40.0 + 3.0 * f64::from(bin)).collect()]
    }

    #[test]
    fn a_step_between_any_two_bins_is_found_and_groups_in_step_are_one() {
        let time = times();
        let bins = time[0].len();
        for bin in FEWEST_BESIDE_STEP..=bins - FEWEST_BESIDE_STEP {
            let step: Vec<f64> =
                (0..time[0].len()).map(|place| if place < bin { -2.0 } else { -1.0 }).collect();
            let of = |family: &Generic| {
                let after = family.columns[0].means().concat();
                after.iter().zip(&step).all(|(one, other)| *one == other + 2.0)
            };
            assert!(steps(&time).any(|family| of(&family)), "before bin {bin}");
        }
        assert_eq!(steps(&time).count(), bins + 1 - 2 * FEWEST_BESIDE_STEP, "and none beside them");
        assert!(instants(&[vec![1.0, 4.0, 7.0]]).is_empty(), "a short flight has no step");
        let other: Vec<f64> = time[0].iter().map(|time_s| time_s + 0.5).collect();
        let both = vec![time[0].clone(), other];
        assert_eq!(steps(&both).count(), steps(&time).count());
    }

    #[test]
    fn a_swing_of_any_period_and_phase_is_found() {
        let time = times();
        let still = map(&time, &|_| 0.0);
        for period_s in [31.0, 40.0, 57.3, 91.0, 139.6, 200.0, 250.0] {
            for phase in [0.0, 0.7, 1.9, 4.0] {
                let series = map(&time, &|t| (std::f64::consts::TAU * t / period_s + phase).sin());
                let left = least_left(swings(&still, &time), &series.concat());
                assert!(left < 0.06, "{period_s} s, {phase}: {left}");
            }
        }
        // A flight that is too short for two swings shows none.
        assert_eq!(swings(&[vec![0.0; 3]], &[vec![0.0, 20.0, 50.0]]).count(), 0);
        assert_eq!(swings(&[vec![]], &[vec![]]).count(), 0);
    }

    #[test]
    fn a_swing_with_the_ladders_own_period_is_what_the_climb_has_nothing_of() {
        let time = times();
        // Up and down in a minute, faster every time.
        let climb = map(&time, &|t| {
            let faster = 0.5 + (t - 40.0) / 200.0;
            if (t / 30.0).floor() % 2.0 == 0.0 { faster } else { -faster }
        });
        let swing = |period_s: f64, phase: f64| {
            map(&time, &|t| (std::f64::consts::TAU * t / period_s + phase).sin()).concat()
        };
        let left = |climb: &[Vec<f64>], period_s, phase| {
            least_left(swings(climb, &time), &swing(period_s, phase))
        };
        let still = map(&time, &|_| 0.0);
        assert!(left(&still, 60.0, 0.0) < 0.06);
        assert!(left(&climb, 60.0, 0.0) > 0.5, "it goes with the climb");
        assert!(left(&climb, 60.0, std::f64::consts::FRAC_PI_2) < 0.1, "it turns between");
        assert!(left(&climb, 91.0, 0.0) < 0.06 && left(&climb, 45.0, 0.0) < 0.06);
        let climb = without_mean(&climb);
        let of_one = swings(&[climb.as_slice().to_vec()], &time)
            .filter(|family| family.columns.len() == 1)
            .map(|family| without_mean(&[family.columns[0].means().concat()]))
            .collect::<Vec<_>>();
        assert!(!of_one.is_empty());
        for swing in of_one {
            let likeness = swing.dot(&climb) / (swing.norm() * climb.norm());
            assert!(likeness.abs() < 1e-9, "{likeness}");
        }
    }

    #[test]
    fn a_response_that_changes_with_height_is_found_where_a_flight_spans_some() {
        let time = times();
        let climb = map(&time, &|t| 3.0 * (0.37 * t).sin());
        let of = |span_m: f64| {
            let height = map(&time, &|t| 20.0 + span_m * (0.5 + 0.5 * (0.05 * t).cos()));
            let at = climb[0].iter().zip(&height[0]);
            let series: Vec<f64> = at.map(|(climb, h)| climb * (4.0 + 0.2 * h)).collect();
            climb_times_height(&climb, &height).map(|family| left(&family, &series))
        };
        assert!(of(40.0).is_some_and(|left| left < 1e-9));
        assert_eq!(of(9.0), None, "little height says little");
        assert!(climb_times_height(&[vec![0.0; 9]], &[vec![20.0; 9]]).is_none());
        assert!(climb_times_height(&[vec![]], &[vec![]]).is_none());
    }

    #[test]
    fn a_response_that_is_another_from_one_moment_on_is_found() {
        let time = times();
        let climb = map(&time, &|t| 3.0 * (0.37 * t).sin());
        for from_s in [60.0, 300.0, 301.5, 444.4] {
            let series: Vec<f64> = std::iter::zip(&time[0], &climb[0])
                .map(|(t, climb)| if *t < from_s { 0.0 } else { 9.0 + 5.0 * climb })
                .collect();
            let left = least_left(changes(&climb, &time), &series);
            assert!(left < 1e-9, "from {from_s} s: {left}");
            assert!(least_left(steps(&time), &series) > 0.2, "a step alone is something else");
        }
    }
}
