//! Covariance of the vertical air speed between two places and times, as means over 10 s show it.
//!
//! A field that varies over a length and a time and may drift with the wind, and gusts that each drone
//! meets alone. What is asked for is the covariance of running means: gusts of a few seconds are mostly
//! averaged away, and the field nearly not at all.

use super::along::along;
use crate::analysis::running::RUNNING_S;

/// Nodes of a mean over a window of 10 s as shares of it, all with the same weight (Chebyshev). They are the same for all
/// windows, so that the covariance is one of sums of the field and positive definite, however the field drifts; nodes for the
/// difference of two times would be closer where a rough field has its edge, and were not.
pub(super) const WINDOW: [f64; 3] = [-0.353_553_391, 0.0, 0.353_553_391];
/// The differences of two nodes, with the share of the pairs that have them.
pub(super) const DIFFERENCES: [(f64, f64); 5] = [
    (0.0, 3.0 / 9.0),
    (0.353_553_391, 2.0 / 9.0),
    (-0.353_553_391, 2.0 / 9.0),
    (std::f64::consts::FRAC_1_SQRT_2, 1.0 / 9.0),
    (-std::f64::consts::FRAC_1_SQRT_2, 1.0 / 9.0),
];

/// How the correlation of a field falls with distance and time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(in super::super) enum Form {
    /// `exp(-(r/lambda)^(2/3) - (|dt|/tau)^(2/3))`: differences grow as they do within turbulence (Kolmogorov's law of two
    /// thirds), so that gusts of all sizes lie within the field.
    Turbulent,
    /// `exp(-r/lambda) exp(-|dt|/tau)`: rough at all scales.
    #[default]
    Exponential,
    /// `exp(-(r/lambda)^2 - (dt/tau)^2)`: smooth.
    Gaussian,
}

impl Form {
    pub(super) const ALL: [Self; 3] = [Self::Turbulent, Self::Exponential, Self::Gaussian];

    /// Minus the logarithm of the correlation by a distance or a time, by the square of that in units of its scale.
    pub(super) fn fall(self, square: f64) -> f64 {
        match self {
            // Faster than the root that rounds correctly.
            Self::Turbulent => (square.ln() / 3.0).exp(),
            Self::Exponential => square.sqrt(),
            Self::Gaussian => square,
        }
    }

    /// In a few words.
    pub(in super::super) fn words(self) -> &'static str {
        match self {
            Self::Turbulent => "two-thirds",
            Self::Exponential => "exponential",
            Self::Gaussian => "Gaussian",
        }
    }
}

/// Length of the slow part of air that varies on two scales, m: that of updrafts over a field (docs/physics.md, 4.1). One
/// field would take the scale of the gusts that it shows most of, and know the zero by hundreds of them. It does not drift: gusts
/// go with the wind over updrafts that stay.
const SLOW_M: f64 = 145.0;
/// Its time, s.
const SLOW_S: f64 = 186.0;

/// Time of errors that all drones share, s: wind comes and goes within half a minute at the heights of shows.
const SHARED_S: f64 = 30.0;

/// Scales of the air.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in super::super) struct Air {
    pub(in super::super) form: Form,
    /// Standard deviation of the field, m/s.
    pub(in super::super) sd_mps: f64,
    /// Distance at which its correlation is 1/e, m: the geometric mean over directions.
    pub(in super::super) length_m: f64,
    /// Logarithms of how much longer the field is along x than along y, and along the diagonal than across
    /// it (halves).
    pub(in super::super) stretch: [f64; 2],
    /// Time after which its correlation is 1/e for who drifts along, s.
    pub(in super::super) time_s: f64,
    /// How fast the field drifts, along show x and y, m/s.
    pub(in super::super) drift_mps: [f64; 2],
    /// Standard deviation of each drone's own gusts, m/s.
    pub(in super::super) gust_mps: f64,
    /// Their time scale, s.
    pub(in super::super) gust_s: f64,
    /// Standard deviation of an error that all drones share, m/s: what the correction for wind leaves as the wind comes and
    /// goes. No air; it lasts for [`SHARED_S`].
    pub(in super::super) shared_mps: f64,
    /// Standard deviation of slow air besides, m/s: an exponential field of [`SLOW_M`] and [`SLOW_S`].
    pub(in super::super) slow_mps: f64,
}

/// A place (show frame, z up, m) at a time (s), and whose it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spot {
    pub(super) place_m: [f64; 3],
    pub(super) time_s: f64,
    /// Gusts are shared only by what has the same number; `None`: meets none.
    pub(super) drone: Option<usize>,
    /// How fast it moves: its means over 10 s are means over that long a way, m/s.
    pub(super) velocity_mps: [f64; 3],
}

/// What drones show besides the field.
#[derive(Clone, Copy, Debug)]
pub(super) struct Besides {
    own_stretch: f64,
    gusts: f64,
    shared: f64,
}

impl Besides {
    /// Covariance of a drone's own gusts, (m/s)².
    pub(super) fn gusts(&self) -> f64 {
        self.gusts
    }

    /// Covariance of the means of one drone, or of two, by that of the field, (m/s)².
    pub(super) fn with(&self, field: f64, is_own: bool) -> f64 {
        let air = if is_own { self.own_stretch * field + self.gusts } else { field };
        air + self.shared
    }
}

/// The covariance function of an air, with what does not depend on the spots computed once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Covariance {
    air: Air,
    /// Inverse of the matrix of lengths.
    inverse: [[f64; 2]; 2],
    /// Variance of the drones' own slopes, as a share of them: what one shows of a field is stretched by as much.
    slopes: f64,
}

impl Covariance {
    pub(super) fn new(air: Air) -> Self {
        // The exponential of a symmetric matrix without trace.
        let [q, r] = air.stretch;
        let size = q.hypot(r);
        let (cosh, sinh) = if size > 1e-9 { (size.cosh(), size.sinh() / size) } else { (1.0, 1.0) };
        let inverse = [[cosh - sinh * q, -sinh * r], [-sinh * r, cosh + sinh * q]]
            .map(|row| row.map(|value| value / air.length_m));
        Self { air, inverse, slopes: 0.0 }
    }

    /// The correlation of the field alone.
    pub(super) fn alone(&self) -> Self {
        let air = Air {
            sd_mps: 1.0,
            gust_mps: 0.0,
            gust_s: 1.0,
            slow_mps: 0.0,
            shared_mps: 0.0,
            ..self.air
        };
        Self { air, slopes: 0.0, ..*self }
    }

    /// As drones show it whose laws have slopes of their own, with this standard error as a share.
    pub(super) fn shown(self, slope_share: f64) -> Self {
        Self { slopes: slope_share * slope_share, ..self }
    }

    /// The air that it is of.
    pub(super) fn air(&self) -> &Air {
        &self.air
    }

    /// Whether the past is as the future: where nothing drifts by.
    pub(super) fn is_reversible(&self) -> bool {
        self.air.drift_mps == [0.0; 2]
    }

    /// Covariance of two means over 10 s as drones show them, (m/s)².
    pub(super) fn of(&self, one: &Spot, other: &Spot) -> f64 {
        let is_own = one.drone.is_some() && one.drone == other.drone;
        self.covariance(one, other, if is_own { 1.0 + self.slopes } else { 1.0 })
            + self.shared(one.time_s - other.time_s)
    }

    /// What drones that stand still show so many seconds apart, besides the field.
    pub(super) fn besides(&self, apart_s: f64) -> Besides {
        Besides {
            own_stretch: 1.0 + self.slopes,
            gusts: self.gusts(apart_s),
            shared: self.shared(apart_s),
        }
    }

    /// Covariance of a mean of the air itself with one that a drone shows, (m/s)².
    pub(super) fn with_air(&self, air: &Spot, shown: &Spot) -> f64 {
        self.covariance(air, shown, 1.0)
    }

    fn covariance(&self, one: &Spot, other: &Spot, stretch: f64) -> f64 {
        let apart_s = one.time_s - other.time_s;
        let apart_m = [0, 1, 2].map(|axis| one.place_m[axis] - other.place_m[axis]);
        let velocities = [one.velocity_mps, other.velocity_mps];
        let field = if velocities == [[0.0; 3]; 2] {
            self.field(apart_m, apart_s)
        } else {
            along(self, apart_m, apart_s, velocities)
        };
        if one.drone.is_some() && one.drone == other.drone {
            stretch * field + self.gusts(apart_s)
        } else {
            field
        }
    }

    /// Covariance of the error that all drones share, (m/s)².
    fn shared(&self, apart_s: f64) -> f64 {
        let variance = self.air.shared_mps.powi(2);
        if variance == 0.0 { 0.0 } else { variance * mean_exponential(apart_s, SHARED_S) }
    }

    /// Covariance of the field alone, (m/s)².
    pub(super) fn field(&self, apart_m: [f64; 3], apart_s: f64) -> f64 {
        self.apart(apart_s).field(apart_m)
    }

    /// The field so many seconds apart.
    pub(super) fn apart(&self, apart_s: f64) -> Apart<'_> {
        let Air { form, time_s, drift_mps: [u, v], .. } = self.air;
        let nodes = DIFFERENCES.map(|(node, share)| {
            let dt = apart_s + node * RUNNING_S;
            Node { drifted_m: [u * dt, v * dt], share, fall: form.fall((dt / time_s).powi(2)) }
        });
        let still = self.is_reversible().then(|| match form {
            Form::Exponential => mean_exponential(apart_s, time_s),
            Form::Turbulent | Form::Gaussian => {
                nodes.iter().map(|node| node.share * (-node.fall).exp()).sum()
            }
        });
        Apart { of: self, seconds: apart_s, nodes, still }
    }

    /// Covariance of the field by the way alone, (m/s)², and that of its slow part: all that the way counts for where nothing drifts.
    pub(super) fn by_way(&self, way_m: [f64; 3]) -> [f64; 2] {
        let Air { form, sd_mps, .. } = self.air;
        [sd_mps * sd_mps * (-form.fall(self.square(way_m))).exp(), self.slow(way_m, 0.0)]
    }

    /// Covariance of the slow part, which stays where it is and which means over 10 s do not change, (m/s)².
    pub(super) fn slow(&self, way_m: [f64; 3], apart_s: f64) -> f64 {
        let slow_mps = self.air.slow_mps;
        if slow_mps == 0.0 { 0.0 } else { slow_mps * slow_mps * slow(way_m, apart_s) }
    }

    /// Covariance of the air itself, not of means, (m/s)².
    pub(super) fn instant(&self, apart_m: [f64; 3], apart_s: f64) -> f64 {
        self.instant_field(apart_m, apart_s) + self.slow(apart_m, apart_s)
    }

    /// The same of the field alone, without the slow part.
    pub(super) fn instant_field(&self, apart_m: [f64; 3], apart_s: f64) -> f64 {
        let [x, y, z] = apart_m;
        let Air { form, sd_mps, time_s, drift_mps: [u, v], .. } = self.air;
        let square = self.square([x - u * apart_s, y - v * apart_s, z]);
        let fall = form.fall(square) + form.fall((apart_s / time_s).powi(2));
        sd_mps * sd_mps * (-fall).exp()
    }

    /// Covariance of a drone's own gusts, (m/s)².
    pub(super) fn gusts(&self, apart_s: f64) -> f64 {
        self.air.gust_mps.powi(2) * mean_exponential(apart_s, self.air.gust_s)
    }

    /// A way on the level in lengths of the field, each direction in its own.
    pub(super) fn in_lengths(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [[a, b], [c, d]] = self.inverse;
        [a * x + b * y, c * x + d * y]
    }

    /// Square of the distance in units of the length.
    fn square(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [along, across] = self.in_lengths([x, y]);
        let up = z / self.air.length_m;
        along * along + across * across + up * up
    }
}

/// One difference of two windows.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// How far the field drifts meanwhile, m.
    drifted_m: [f64; 2],
    /// Share of the pairs that have it.
    share: f64,
    /// Minus the logarithm of the correlation by the time.
    fall: f64,
}

/// A field at times so far apart, with what does not depend on the places computed once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Apart<'a> {
    of: &'a Covariance,
    seconds: f64,
    nodes: [Node; DIFFERENCES.len()],
    /// Where nothing drifts: the correlation by the time.
    still: Option<f64>,
}

impl Apart<'_> {
    /// Covariance of the field over a way, (m/s)².
    pub(super) fn field(&self, way_m: [f64; 3]) -> f64 {
        if self.still.is_some() {
            return self.field_by(way_m, self.of.by_way(way_m));
        }
        let Air { form, sd_mps, .. } = self.of.air;
        let [x, y, z] = way_m;
        let at = |node: &Node| {
            let [u, v] = node.drifted_m;
            node.share * (-form.fall(self.of.square([x - u, y - v, z])) - node.fall).exp()
        };
        sd_mps * sd_mps * self.nodes.iter().map(at).sum::<f64>() + self.of.slow(way_m, self.seconds)
    }

    /// The same where the covariances by the way are known, which count if nothing drifts.
    pub(super) fn field_by(&self, way_m: [f64; 3], [field, slow]: [f64; 2]) -> f64 {
        match self.still {
            Some(by_time) => field * by_time + slow * slow_by_time(self.seconds),
            None => self.field(way_m),
        }
    }
}

/// Correlation of the slow part by time alone.
pub(super) fn slow_by_time(apart_s: f64) -> f64 {
    (-apart_s.abs() / SLOW_S).exp()
}

/// Correlation of the slow part, which stays where it is.
pub(super) fn slow([x, y, z]: [f64; 3], apart_s: f64) -> f64 {
    (-(x * x + y * y + z * z).sqrt() / SLOW_M - apart_s.abs() / SLOW_S).exp()
}

/// Mean of `exp(-|t|/tau)` over two windows of 10 s whose middles are so far apart.
fn mean_exponential(apart_s: f64, tau_s: f64) -> f64 {
    let (ratio, apart) = (RUNNING_S / tau_s, apart_s.abs() / tau_s);
    if ratio < 1e-3 {
        return (-apart).exp();
    }
    let square = ratio * ratio;
    if apart >= ratio {
        return (-apart).exp() * (2.0 * ratio.cosh() - 2.0) / square;
    }
    // Windows that overlap.
    let (inner, outer) = (ratio - apart, ratio + apart);
    ((-inner).exp() + (-outer).exp() - 2.0 * (-apart).exp() + 2.0 * inner) / square
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::analysis::kriging) fn air(form: Form) -> Air {
        Air {
            form,
            sd_mps: 0.5,
            length_m: 80.0,
            stretch: [0.0; 2],
            time_s: 60.0,
            drift_mps: [0.0; 2],
            gust_mps: 0.2,
            gust_s: 4.0,
            slow_mps: 0.0,
            shared_mps: 0.0,
        }
    }

    fn spot(place_m: [f64; 3], time_s: f64, drone: usize) -> Spot {
        Spot { place_m, time_s, drone: Some(drone), velocity_mps: [0.0; 3] }
    }

    /// The mean of a correlation over two windows, by summing.
    fn summed(apart_s: f64, correlation: impl Fn(f64) -> f64) -> f64 {
        let steps = 400;
        let at = |index: usize| (index as f64 + 0.5) / steps as f64 * RUNNING_S;
        let mut sum = 0.0;
        for one in 0..steps {
            for other in 0..steps {
                sum += correlation(apart_s + at(one) - at(other));
            }
        }
        sum / (steps * steps) as f64
    }

    #[test]
    fn means_over_windows_have_the_covariance_that_sums_say() {
        for tau_s in [3.0, 40.0, 300.0] {
            for apart_s in [0.0, 4.0, 10.0, 35.0] {
                let expected = summed(apart_s, |dt| (-dt.abs() / tau_s).exp());
                let found = mean_exponential(apart_s, tau_s);
                assert!((found - expected).abs() < 1e-3, "{tau_s} {apart_s}: {found} {expected}");
            }
        }
        let covariance = Covariance::new(Air { drift_mps: [2.0, 0.0], ..air(Form::Gaussian) });
        let expected = 0.25
            * summed(20.0, |dt| (-((30.0 - 2.0 * dt) / 80.0).powi(2) - (dt / 60.0).powi(2)).exp());
        let found = covariance.field([30.0, 0.0, 0.0], 20.0);
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }

    #[test]
    fn what_is_computed_once_changes_nothing() {
        for (form, by) in
            [(Form::Turbulent, 2.0 / 3.0), (Form::Exponential, 1.0), (Form::Gaussian, 2.0)]
        {
            for drift_mps in [[0.0; 2], [2.0, -0.5]] {
                let covariance = Covariance::new(Air { drift_mps, slow_mps: 0.1, ..air(form) });
                let [u, v] = drift_mps;
                for (way_m, apart_s) in
                    [([0.0; 3], 0.0), ([30.0, -10.0, 5.0], 20.0), ([0.0, 7.0, 0.0], -4.0)]
                {
                    let [x, y, z] = way_m;
                    let fall = |dt: f64| {
                        let r = ((x - u * dt).powi(2) + (y - v * dt).powi(2) + z * z).sqrt() / 80.0;
                        r.powf(by) + (dt.abs() / 60.0).powf(by)
                    };
                    let nodes = DIFFERENCES
                        .map(|(node, share)| share * (-fall(apart_s + node * RUNNING_S)).exp());
                    let of_field = if form == Form::Exponential && covariance.is_reversible() {
                        (-fall(0.0)).exp() * mean_exponential(apart_s, 60.0)
                    } else {
                        nodes.iter().sum()
                    };
                    let expected = 0.25 * of_field + covariance.slow(way_m, apart_s);
                    let apart = covariance.apart(apart_s);
                    let by_way = apart.field_by(way_m, covariance.by_way(way_m));
                    for found in [apart.field(way_m), by_way, covariance.field(way_m, apart_s)] {
                        assert!((found - expected).abs() < 1e-12, "{form:?} {found} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn covariances_are_positive_definite_whatever_drifts() {
        let spots: Vec<Spot> = (0..96)
            .map(|index| {
                let (drone, block) = (index % 12, index / 12);
                let place_m = [10.0 * (drone % 4) as f64, 10.0 * (drone / 4) as f64, 40.0];
                spot(place_m, 10.0 * block as f64, drone)
            })
            .collect();
        for form in Form::ALL {
            for drift_mps in [[0.0; 2], [2.0, 0.2], [-1.0, 3.3]] {
                let covariance =
                    Covariance::new(Air { drift_mps, gust_mps: 0.0, ..air(form) }).shown(0.02);
                let mut matrix =
                    nalgebra::DMatrix::from_fn(spots.len(), spots.len(), |row, column| {
                        covariance.of(&spots[row], &spots[column])
                    });
                for index in 0..spots.len() {
                    matrix[(index, index)] += 0.002_f64.powi(2);
                }
                assert!(matrix.cholesky().is_some(), "{form:?} {drift_mps:?}");
            }
        }
    }

    #[test]
    fn gusts_are_a_drones_own_and_a_field_is_longer_along_its_stretch() {
        let covariance = Covariance::new(air(Form::Exponential));
        let here = spot([0.0; 3], 0.0, 1);
        let own = covariance.of(&here, &here);
        let neighbour = covariance.of(&here, &spot([0.0; 3], 0.0, 2));
        assert!(own > neighbour + 0.015, "{own} {neighbour}");
        let stretched = Covariance::new(Air { stretch: [0.5, 0.0], ..air(Form::Exponential) });
        let (along, across) =
            (stretched.field([40.0, 0.0, 0.0], 0.0), stretched.field([0.0, 40.0, 0.0], 0.0));
        assert!(along > covariance.field([40.0, 0.0, 0.0], 0.0) && along > across);
        let ratio =
            stretched.square([1.0, 0.0, 0.0]).sqrt() / stretched.square([0.0, 1.0, 0.0]).sqrt();
        assert!((ratio - (-1.0_f64).exp()).abs() < 1e-9, "{ratio}");
        let diagonal = Covariance::new(Air { stretch: [0.0, 0.5], ..air(Form::Exponential) });
        let (with, against) =
            (diagonal.square([1.0, 1.0, 0.0]).sqrt(), diagonal.square([1.0, -1.0, 0.0]).sqrt());
        assert!((with / against - (-1.0_f64).exp()).abs() < 1e-9);
    }

    #[test]
    fn a_field_that_drifts_is_found_where_it_went() {
        for form in Form::ALL {
            let drifting =
                Covariance::new(Air { drift_mps: [2.0, -1.0], time_s: 1e4, ..air(form) });
            let followed = drifting.field([60.0, -30.0, 0.0], 30.0);
            let share = if form == Form::Turbulent { 0.8 } else { 0.9 };
            assert!(followed > share * drifting.field([0.0; 3], 0.0), "{form:?} {followed}");
            assert!(followed > 1.5 * drifting.field([0.0; 3], 30.0));
        }
    }
}
