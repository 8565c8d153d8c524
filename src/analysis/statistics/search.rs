//! The smallest value of a smooth function of two variables.

/// First step in each variable.
const STEP: f64 = 0.4;
/// The search ends when the values of the simplex differ by less than this.
const TOLERANCE: f64 = 1e-4;
/// More evaluations are not made.
const MOST: usize = 200;

/// Nelder and Mead's simplex.
pub(super) fn minimum(f: impl Fn([f64; 2]) -> f64, start: [f64; 2]) -> [f64; 2] {
    let value = |at: [f64; 2]| {
        let value = f(at);
        (at, if value.is_finite() { value } else { f64::MAX })
    };
    let mut simplex =
        [value(start), value([start[0] + STEP, start[1]]), value([start[0], start[1] + STEP])];
    let mut count = 3;
    while count < MOST {
        simplex.sort_by(|left, right| left.1.total_cmp(&right.1));
        let [best, middle, worst] = simplex;
        let size =
            (0..2).map(|i| (worst.0[i] - best.0[i]).abs().max((middle.0[i] - best.0[i]).abs()));
        if worst.1 - best.1 < TOLERANCE && size.fold(0.0, f64::max) < 0.05 {
            break;
        }
        let centre = [0, 1].map(|i| f64::midpoint(best.0[i], middle.0[i]));
        let along = |share: f64| [0, 1].map(|i| centre[i] + share * (worst.0[i] - centre[i]));
        let reflected = value(along(-1.0));
        count += 1;
        let tried = if reflected.1 < best.1 {
            count += 1;
            let further = value(along(-2.0));
            if further.1 < reflected.1 { further } else { reflected }
        } else if reflected.1 < middle.1 {
            reflected
        } else {
            count += 1;
            value(along(if reflected.1 < worst.1 { -0.5 } else { 0.5 }))
        };
        if tried.1 < worst.1 {
            simplex[2] = tried;
        } else {
            let towards = |point: [f64; 2]| [0, 1].map(|i| f64::midpoint(point[i], best.0[i]));
            simplex = [best, value(towards(middle.0)), value(towards(worst.0))];
            count += 2;
        }
    }
    simplex.sort_by(|left, right| left.1.total_cmp(&right.1));
    simplex[0].0
}
