//! Whether a stationary Gaussian field describes a record at all.
//!
//! What the neighbours of a value do not say about it is normal and equally strong everywhere if the model is
//! right. A thermal that stands in one corner, or passes, is not: its surprises are few and large.

/// Standard errors beyond which kurtosis, or the strength of a part of the record, is no chance. Chosen: one in 10 000
/// campaigns, with some room for innovations that are not quite independent.
const SURPRISING: f64 = 6.0;
/// Smaller differences in strength do no harm, as a ratio of standard deviations. Chosen.
const HARMLESS: f64 = 1.35;
/// Excess kurtosis that does no harm. Chosen.
const HARMLESS_KURTOSIS: f64 = 1.0;

/// How the innovations of a record differ from independent normal ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in super::super) struct Adequacy {
    /// Excess kurtosis.
    pub(in super::super) kurtosis: f64,
    /// Largest ratio of a drone's standard deviation to the fleet's.
    pub(in super::super) strongest: f64,
    pub(in super::super) is_adequate: bool,
}

impl Adequacy {
    /// Why there are no scales.
    pub(in super::super) fn sentence(&self) -> String {
        format!(
            "no stationary field describes this air (what neighbours do not tell has a kurtosis of {:.1} instead of 3, and is up \
             to {:.1} times as strong at one drone as on average), so it has no one correlation length",
            3.0 + self.kurtosis,
            self.strongest
        )
    }
}

/// Judges innovations in the order of `drones`, which says whose each is.
pub(super) fn judge(innovations: &[f64], drones: &[usize]) -> Adequacy {
    let n = innovations.len() as f64;
    let moment = |power: i32| innovations.iter().map(|value| value.powi(power)).sum::<f64>() / n;
    let (second, fourth) = (moment(2), moment(4));
    let kurtosis = fourth / (second * second) - 3.0;
    let count = drones.iter().copied().max().map_or(0, |last| last + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for (value, drone) in innovations.iter().zip(drones) {
        let (sum, values) = &mut sums[*drone];
        *sum += value * value;
        *values += 1.0;
    }
    let (mut strongest, mut surprise) = (1.0_f64, 0.0_f64);
    for (sum, values) in sums.into_iter().filter(|(_, values)| *values >= 6.0) {
        let ratio = sum / values / second;
        strongest = strongest.max(ratio.sqrt());
        // The cube root of a chi-square over its degrees of freedom is nearly normal (Wilson and Hilferty).
        let spread = 2.0 / (9.0 * values);
        surprise = surprise.max((ratio.cbrt() - (1.0 - spread)) / spread.sqrt());
    }
    let heavy = kurtosis > HARMLESS_KURTOSIS && kurtosis / (24.0 / n).sqrt() > SURPRISING;
    let uneven = strongest > HARMLESS && surprise > SURPRISING;
    Adequacy { kurtosis, strongest, is_adequate: !(heavy || uneven) && n > 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution as _, StandardNormal};

    fn drawn(seed: u64, count: usize) -> Vec<f64> {
        let mut rng = rand_pcg::Pcg64::new(u128::from(seed), 7);
        (0..count).map(|_| StandardNormal.sample(&mut rng)).collect()
    }

    #[test]
    fn normal_surprises_are_adequate_and_those_of_a_passing_thermal_are_not() {
        let drones: Vec<usize> = (0..900).map(|index| index % 30).collect();
        for seed in 0..200 {
            assert!(judge(&drawn(seed, 900), &drones).is_adequate, "{seed}");
        }
        for seed in 0..20 {
            let mut passing = drawn(seed, 900);
            passing.iter_mut().skip(300).take(60).for_each(|value| *value *= 4.0);
            assert!(!judge(&passing, &drones).is_adequate);
            let mut corner = drawn(seed, 900);
            corner
                .iter_mut()
                .zip(&drones)
                .filter(|(_, drone)| **drone < 2)
                .for_each(|(value, _)| *value *= 2.5);
            assert!(!judge(&corner, &drones).is_adequate, "{:?}", judge(&corner, &drones));
        }
    }
}
