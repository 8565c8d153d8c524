//! A field over many ways on the level at once: what the ways have in common is computed once.

use super::covariance::{Covariance, Form};

/// A field whose correlation by time alone has fallen by so many nats is none. Numerical.
const NOTHING_NATS: f64 = 40.0;

/// The covariance of a field over some ways on the level.
pub(super) struct Ways {
    form: Form,
    variance: f64,
    time_s: f64,
    length_m: f64,
    /// How fast the field drifts, lengths of the field per second.
    drift: [f64; 2],
    /// The ways, lengths of the field.
    each: Vec<[f64; 2]>,
}

impl Ways {
    /// Ways are in the show frame, m.
    pub(super) fn of(covariance: &Covariance, ways_m: &[[f64; 2]]) -> Self {
        let air = covariance.air();
        Self {
            form: air.form,
            variance: air.sd_mps * air.sd_mps,
            time_s: air.time_s,
            length_m: air.length_m,
            drift: covariance.in_lengths(air.drift_mps),
            each: ways_m.iter().map(|way_m| covariance.in_lengths(*way_m)).collect(),
        }
    }

    /// The covariance with what is right above and so many seconds before, and its sum over all ways and all ways back, (m/s)²: of
    /// the air itself, not of means.
    pub(super) fn at(&self, up_m: f64, apart_s: f64) -> [f64; 2] {
        let by_time = self.form.fall((apart_s / self.time_s).powi(2));
        if by_time > NOTHING_NATS {
            return [0.0; 2];
        }
        let up = (up_m / self.length_m).powi(2);
        let along = |[x, y]: [f64; 2]| {
            let by_way = self.form.fall(x * x + y * y + up);
            self.variance * (-(by_way + by_time)).exp()
        };
        let [x, y] = self.drift.map(|drift| drift * apart_s);
        let over = if self.drift == [0.0; 2] {
            2.0 * self.each.iter().map(|way| along(*way)).sum::<f64>()
        } else {
            let both = |way: &[f64; 2]| {
                along([way[0] - x, way[1] - y]) + along([-way[0] - x, -way[1] - y])
            };
            self.each.iter().map(both).sum()
        };
        [along([x, y]), over]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::kriging::covariance::Air;
    use crate::analysis::kriging::covariance::tests::air;

    #[test]
    fn ways_at_once_have_the_covariance_of_each() {
        let ways_m = [[10.0, 0.0], [-20.0, 30.0], [0.0, 7.0]];
        for form in Form::ALL {
            for drift_mps in [[0.0; 2], [2.0, -1.0]] {
                let covariance =
                    Covariance::new(Air { stretch: [0.2, 0.1], drift_mps, ..air(form) });
                let ways = Ways::of(&covariance, &ways_m);
                for (up_m, apart_s) in [(0.0, 0.0), (12.0, -30.0), (-3.0, 400.0), (0.0, 9e4)] {
                    let of = |x_m, y_m| covariance.instant_field([x_m, y_m, up_m], apart_s);
                    let over: f64 = ways_m.iter().map(|[x, y]| of(*x, *y) + of(-x, -y)).sum();
                    let [found, found_over] = ways.at(up_m, apart_s);
                    assert!((found - of(0.0, 0.0)).abs() < 1e-12);
                    assert!((found_over - over).abs() < 1e-12, "{form:?} {found_over} {over}");
                }
            }
        }
    }
}
