//! The air that all drones shared, as the fitted drones show it.

use nalgebra::{DMatrix, DVector};

use super::noise::{
    CURVED, GRADIENT, GUST_TIME, GUSTS, GroupPattern, Hyper, OFFSETS, OWN, SHARED, SHARED_TIME,
    SLOPES, WHITE,
};

/// A linear map from the groups' mean residuals to the shared updraft at the same bins.
#[derive(Clone, Debug)]
pub(super) struct SharedAir {
    /// (group, bin) in the order of rows and columns.
    order: Vec<(usize, usize)>,
    map: DMatrix<f64>,
}

impl SharedAir {
    /// For these groups and this noise.
    pub(super) fn new(groups: &[GroupPattern], hyper: &Hyper) -> Self {
        let order: Vec<(usize, usize)> = groups
            .iter()
            .enumerate()
            .flat_map(|(index, group)| (0..group.time_s.len()).map(move |bin| (index, bin)))
            .collect();
        let square = |place: usize| hyper.get(place).powi(2);
        let responses: Vec<Vec<f64>> = groups.iter().map(|group| group.responses(hyper)).collect();
        let response = |(group, bin): (usize, usize)| responses[group][bin];
        let time = |(group, bin): (usize, usize)| groups[group].time_s[bin];
        let aloft = |(group, bin): (usize, usize)| groups[group].aloft(bin);
        let shared = |a, b| {
            let heights = aloft(a) * aloft(b);
            (square(SHARED) + square(GRADIENT) * heights * (1.0 + CURVED * CURVED * heights))
                * (-(time(a) - time(b)).abs() / hyper.get(SHARED_TIME)).exp()
        };
        let count = order.len();
        let covariance = DMatrix::from_fn(count, count, |row, column| {
            let (a, b) = (order[row], order[column]);
            let mut sum = response(a) * response(b) * shared(a, b);
            sum += groups[a.0].side_gusts(a.1, &groups[b.0], b.1, hyper);
            if a.0 == b.0 {
                let apart_s = (time(a) - time(b)).abs();
                let share = 1.0 / groups[a.0].drones.max(1) as f64;
                let own = square(OWN) * (-apart_s / hyper.get(SHARED_TIME)).exp()
                    + square(GUSTS) * (-apart_s / hyper.get(GUST_TIME)).exp();
                let slopes = groups[a.0].slope_us[a.1] * groups[b.0].slope_us[b.1];
                sum += share
                    * (response(a) * response(b) * own
                        + square(OFFSETS)
                        + square(SLOPES) * slopes
                        + if a == b { square(WHITE) } else { 0.0 });
            }
            // The common offset is free.
            sum + FREE_US * FREE_US
        });
        let cross = DMatrix::from_fn(count, count, |row, column| {
            response(order[column]) * shared(order[row], order[column])
        });
        let map = covariance.cholesky().map_or_else(
            || DMatrix::zeros(count, count),
            |factor| factor.solve(&cross.transpose()).transpose(),
        );
        Self { order, map }
    }

    /// What the shared air does to the pulse, by group and bin, us, from the groups' mean residuals;
    /// the response is applied.
    pub(super) fn pulses(
        &self,
        means: &[Vec<f64>],
        groups: &[GroupPattern],
        hyper: &Hyper,
    ) -> Vec<Vec<f64>> {
        let y = DVector::from_iterator(
            self.order.len(),
            self.order.iter().map(|(group, bin)| means[*group][*bin]),
        );
        let air = &self.map * y;
        let responses: Vec<Vec<f64>> = groups.iter().map(|group| group.responses(hyper)).collect();
        let mut pulses: Vec<Vec<f64>> = groups.iter().map(|_| Vec::new()).collect();
        for ((group, bin), value) in self.order.iter().zip(air.iter()) {
            pulses[*group].push(value * responses[*group][*bin]);
        }
        pulses
    }
}

/// Prior standard deviation of the common offset, us.
const FREE_US: f64 = 300.0;
