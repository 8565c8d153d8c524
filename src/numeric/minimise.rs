//! A quasi-Newton search for smooth functions of a few variables.

/// Step of the difference quotients of functions of logarithms. Numerical.
pub(crate) const LOGARITHM_STEP: f64 = 1e-4;
/// The search ends when a step gains less, nats. Numerical: a four-thousandth of the threshold.
const ENOUGH: f64 = 2e-3;
/// The same of fits of the noise, of which there are hundreds in a comparison. Numerical: a thousandth of the threshold.
const NOISE_ENOUGH: f64 = 8e-3;
/// Steps at most. Numerical; searches end earlier by [`ENOUGH`].
const MOST_STEPS: usize = 40;
/// The search ends, too, where a step promises less than this share of what is enough, by the curvature that was learned
/// on the way and by that which the search began with. Numerical.
const CERTAIN: f64 = 0.02;
/// The same of fits of the noise.
const NOISE_CERTAIN: f64 = 0.1;
/// Shares of a step that was too long, within which a parabola places the next one. Numerical.
const SHORTER: [f64; 2] = [0.1, 0.5];
/// Longest step of any variable: a factor of e. Numerical.
const LONGEST: f64 = 1.0;

/// Where a function is least, from a start, and its value there. BFGS with a backtracking line
/// search; values that are not numbers count as infinite. The gradient is asked for at a place with its value.
pub(crate) fn minimise<const N: usize>(
    start: [f64; N],
    function: impl Fn(&[f64; N]) -> f64,
    gradient_at: impl Fn(&[f64; N], f64) -> [f64; N],
) -> ([f64; N], f64) {
    let Least { at, value, .. } = of_values(start, None, End::WELL, function, gradient_at);
    (at, value)
}

/// The inverse of a function's second derivatives.
pub(crate) type Inverse<const N: usize> = [[f64; N]; N];

/// The least value of a function.
pub(crate) struct Least<const N: usize, T> {
    /// Variables at which the function is least.
    pub at: [f64; N],
    /// Value of the function at them.
    pub value: f64,
    /// Everything that the function told with it.
    pub known: T,
    /// The inverse of the second derivatives, as the steps there tell them.
    pub inverse: Inverse<N>,
}

/// As [`minimise_known`], to where two steps gain less than `enough` each, without a look at whether they do so because the
/// curvature that was learned on the way is wrong there. For a place to begin at, or where so much is enough.
pub(crate) fn minimise_roughly<const N: usize>(
    start: [f64; N],
    alike: Option<&Inverse<N>>,
    enough: f64,
    function: impl Fn(&[f64; N]) -> f64,
    gradient_at: impl Fn(&[f64; N], f64) -> [f64; N],
) -> Least<N, f64> {
    of_values(start, alike, End { enough, again: false, ..End::WELL }, function, gradient_at)
}

/// As [`minimise`], of a function that tells with its value what its gradient is made from. The inverse of the second
/// derivatives of a function that is much like it, if there is one, saves steps.
pub(crate) fn minimise_known<const N: usize, T>(
    start: [f64; N],
    alike: Option<&Inverse<N>>,
    function: impl Fn(&[f64; N]) -> (f64, T),
    gradient_at: impl Fn(&[f64; N], &T) -> [f64; N],
) -> Least<N, T> {
    descend(start, alike, End::NOISE, function, gradient_at)
}

/// Where a search ends.
#[derive(Clone, Copy, Debug)]
struct End {
    /// Two steps that gain less are the last.
    enough: f64,
    /// A step that promises less than this share of it is not taken.
    certain: f64,
    /// Once more, with a fresh curvature, from where it ends first.
    again: bool,
}

impl End {
    const WELL: Self = Self { enough: ENOUGH, certain: CERTAIN, again: true };
    const NOISE: Self = Self { enough: NOISE_ENOUGH, certain: NOISE_CERTAIN, again: true };
}

/// As [`descend`], of a function that tells its value alone.
fn of_values<const N: usize>(
    start: [f64; N],
    alike: Option<&Inverse<N>>,
    end: End,
    function: impl Fn(&[f64; N]) -> f64,
    gradient_at: impl Fn(&[f64; N], f64) -> [f64; N],
) -> Least<N, f64> {
    let told = |at: &[f64; N]| {
        let value = function(at);
        (value, value)
    };
    descend(start, alike, end, told, |at, value| gradient_at(at, *value))
}

/// BFGS steps from a start to where a search ends.
fn descend<const N: usize, T>(
    start: [f64; N],
    alike: Option<&Inverse<N>>,
    end: End,
    function: impl Fn(&[f64; N]) -> (f64, T),
    gradient_at: impl Fn(&[f64; N], &T) -> [f64; N],
) -> Least<N, T> {
    let value_at = |at: &[f64; N]| {
        let (value, known) = function(at);
        (if value.is_finite() { value } else { f64::INFINITY }, known)
    };
    let first = || alike.copied().unwrap_or_else(identity);
    let mut at = start;
    let (mut value, mut known) = value_at(&at);
    let mut gradient = gradient_at(&at, &known);
    let mut inverse = first();
    let (mut small, mut learned) = (0, None);
    for _ in 0..MOST_STEPS {
        let mut direction = [0.0; N];
        for (row, part) in direction.iter_mut().enumerate() {
            *part = -dot(&inverse[row], &gradient);
        }
        if dot(&direction, &gradient) >= 0.0 {
            inverse = identity();
            direction = gradient.map(|slope| -slope);
        }
        let promised = -0.5 * dot(&direction, &gradient);
        let is_bottom = promised < end.certain * end.enough
            && 0.5 * bilinear(&first(), &gradient) < end.certain * end.enough;
        if is_bottom {
            break;
        }
        let longest = direction.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
        if longest > LONGEST {
            direction = direction.map(|part| part * LONGEST / longest);
        }
        let slope = dot(&direction, &gradient);
        let mut length = 1.0;
        let mut found = None;
        for _ in 0..12 {
            let mut next = at;
            for (part, by) in next.iter_mut().zip(&direction) {
                *part += length * by;
            }
            let (next_value, next_known) = value_at(&next);
            if next_value <= value + 1e-4 * length * slope {
                found = Some((next, next_value, next_known));
                break;
            }
            length *= shorter(value - next_value, length * slope);
        }
        let Some((next, next_value, next_known)) = found else { break };
        let next_gradient = gradient_at(&next, &next_known);
        let gained = value - next_value;
        update(&mut inverse, &difference(&next, &at), &difference(&next_gradient, &gradient));
        (at, value, gradient, known) = (next, next_value, next_gradient, next_known);
        small = if gained < end.enough { small + 1 } else { 0 };
        if small == 2 && (learned.is_some() || !end.again) {
            break;
        }
        if small == 2 {
            // What was learned of the curvature on the way may be wrong here.
            learned = Some(std::mem::replace(&mut inverse, first()));
            small = 0;
        }
    }
    Least { at, value, known, inverse: learned.unwrap_or(inverse) }
}

/// A gradient by difference quotients over a step, for functions without derivatives at hand; `value` is the function's there. The
/// slope is off by half of the step times the curvature: where the function bends by many orders of magnitude more across a valley
/// than along it, a step that is too long moves the bottom of the valley.
pub(crate) fn differences<const N: usize>(
    function: impl Fn(&[f64; N]) -> f64,
    at: &[f64; N],
    value: f64,
    step: f64,
) -> [f64; N] {
    differences_at_once(|moved| moved.map(|place| function(&place)), at, value, step)
}

/// As [`differences`], of a function that is told for all places at once.
pub(crate) fn differences_at_once<const N: usize>(
    function: impl Fn(&[[f64; N]; N]) -> [f64; N],
    at: &[f64; N],
    value: f64,
    step: f64,
) -> [f64; N] {
    let mut moved = [*at; N];
    moved.iter_mut().enumerate().for_each(|(index, place)| place[index] += step);
    function(&moved).map(|there| (there - value) / step)
}

fn identity<const N: usize>() -> [[f64; N]; N] {
    let mut matrix = [[0.0; N]; N];
    for (index, row) in matrix.iter_mut().enumerate() {
        // The curvature of a log-likelihood by a logarithm is about the number of time scales.
        row[index] = 0.1;
    }
    matrix
}

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn bilinear<const N: usize>(matrix: &[[f64; N]; N], by: &[f64; N]) -> f64 {
    matrix.iter().zip(by).map(|(row, part)| part * dot(row, by)).sum()
}

/// Share of a step that gained so little, at whose bottom a parabola lies that begins with the slope over the whole step.
fn shorter(gained: f64, slope: f64) -> f64 {
    let [least, most] = SHORTER;
    let rise = -(gained + slope);
    let share = -0.5 * slope / rise;
    if share.is_finite() { share.clamp(least, most) } else { least }
}

fn difference<const N: usize>(a: &[f64; N], b: &[f64; N]) -> [f64; N] {
    let mut result = *a;
    result.iter_mut().zip(b).for_each(|(a, b)| *a -= b);
    result
}

fn update<const N: usize>(inverse: &mut [[f64; N]; N], step: &[f64; N], change: &[f64; N]) {
    let curvature = dot(step, change);
    if curvature <= 1e-12 {
        return;
    }
    let mut moved = [0.0; N];
    for (row, part) in moved.iter_mut().enumerate() {
        *part = dot(&inverse[row], change);
    }
    let scale = (1.0 + dot(change, &moved) / curvature) / curvature;
    for row in 0..N {
        for column in 0..N {
            inverse[row][column] += scale * step[row] * step[column]
                - (moved[row] * step[column] + step[row] * moved[column]) / curvature;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bends_of_a_like_function_save_steps() {
        use std::cell::Cell;

        // Variables of scales that differ, and that go together.
        let bowl = |at: &[f64; 4]| {
            let sum: f64 = at.iter().sum();
            let own = at.iter().zip([1.0, 20.0, 300.0, 0.05]).map(|(x, bend)| bend * x * x);
            5.0 * sum * sum + own.sum::<f64>()
        };
        let search = |start: [f64; 4], alike: Option<&Inverse<4>>| {
            let asked = Cell::new(0);
            let function = |at: &[f64; 4]| {
                asked.set(asked.get() + 1);
                (bowl(at), bowl(at))
            };
            let slopes = |at: &[f64; 4], value: &f64| differences(bowl, at, *value, LOGARITHM_STEP);
            let least = minimise_known(start, alike, function, slopes);
            assert!(least.value < 1e-2, "{}", least.value);
            (asked.get(), least.inverse)
        };
        let (first, inverse) = search([2.0, -1.0, 0.5, 3.0], None);
        let elsewhere = [-1.0, 0.6, 0.3, -2.0];
        let ((with, _), (without, _)) =
            (search(elsewhere, Some(&inverse)), search(elsewhere, None));
        assert!(2 * with < without && with < first, "{first} {with} {without}");
    }

    #[test]
    fn a_bent_valley_is_followed() {
        let valley = |[x, y]: &[f64; 2]| 20.0 * (y - x * x).powi(2) + (1.0 - x).powi(2);
        let (at, value) = minimise([-1.2, 1.0], valley, |at, value| {
            differences(valley, at, value, LOGARITHM_STEP)
        });
        assert!(value < 1e-2 && (at[0] - 1.0).abs() < 0.1, "{at:?} {value}");
    }
}
