//! Bins in which a fleet had not come to rest yet.
//!
//! Near the limits of a vehicle, in a strong wind and a downdraft, some drones take longer than others to settle after a change of the
//! command: in one bin of a leg they scatter by ten times what they do in the rest of it. No noise that is the same in
//! all bins describes that, and an updraft or an effect with which drones answer gusts more in that bin than in others
//! would be preferred for it.

use super::bins::BinValues;
use super::data::{Data, Group};
use crate::numeric::mean;

/// Drones have not settled where they scatter by so many times what they do in the rest of the leg. Measured: on AirSim's quad with twice
/// its drag, in 8 m/s of wind and a downdraft of 2 m/s, two bins by 7.7 and 10.4 times what they do in most, all others by 2.7 at most.
/// Gusts that outlast a leg of three bins make it 1.3.
const TIMES: f64 = 3.0;
/// They scatter at least by so much, us: what nobody describes better (`noise.rs`).
const LEAST_US: f64 = 0.2;
/// Fewest drones that tell a scatter. Chosen: of six, one bin in 60 is left out by chance in legs of three bins, one in 2,000 in legs of
/// five (drawn 40,000 times).
const FEWEST_DRONES: usize = 6;
/// Fewest other bins of a leg that tell what it is in the rest of the leg. Geometry: one has no scatter of its own.
const FEWEST_OTHERS: usize = 2;

impl Data {
    /// Without the bins in which the drones of a group had not settled yet.
    #[must_use]
    pub(super) fn settled(&self) -> Self {
        let unsettled: Vec<Vec<bool>> = self.groups.iter().map(unsettled).collect();
        self.keep(|group, bin| !unsettled[group][bin])
    }
}

/// Whether the drones of a group have not settled, by bin.
fn unsettled(group: &Group) -> Vec<bool> {
    let all = 0..group.bins.len();
    if group.measured.len() < FEWEST_DRONES {
        return vec![false; all.len()];
    }
    let means: Vec<f64> =
        all.clone().map(|bin| group.mean(bin, |values| values.pulse_us)).collect();
    let is_unsettled = |bin: usize| {
        let segment = group.bins[bin].segment;
        let is_other = |other: &usize| *other != bin && group.bins[*other].segment == segment;
        let others: Vec<usize> = all.clone().filter(is_other).collect();
        if others.len() < FEWEST_OTHERS {
            return false;
        }
        let count = others.len() as f64;
        // What the fleet shares, as the air may, is no scatter.
        let of_drone = |drone: &Vec<BinValues>| {
            let own_us = |bin: usize| drone[bin].pulse_us - means[bin];
            let usual_us = others.iter().map(|other| own_us(*other)).sum::<f64>() / count;
            let squares = others.iter().map(|other| (own_us(*other) - usual_us).powi(2));
            [(own_us(bin) - usual_us).powi(2), squares.sum::<f64>() / (count - 1.0)]
        };
        let each: Vec<[f64; 2]> = group.measured.iter().map(of_drone).collect();
        let [here, rest] = [0, 1]
            .map(|place: usize| mean(each.iter().map(|drone| drone[place])).unwrap_or_default());
        // The mean of the others is itself known to one of so many.
        here > TIMES.powi(2) * (1.0 + 1.0 / count) * rest.max(LEAST_US.powi(2))
    };
    all.clone().map(is_unsettled).collect()
}

#[cfg(test)]
mod tests {
    use super::super::bins::Bin;
    use super::super::trial;

    /// Noise of a drone in a bin, us, rms about 0.4.
    fn noise_us(drone: usize, bin: usize) -> f64 {
        0.2 * f64::from((7 * bin as i32 + 3 * drone as i32) % 5 - 2)
    }

    #[test]
    fn a_bin_in_which_drones_have_not_settled_is_left_out() {
        let left_out = |drones: usize, [own_us, shared_us]: [f64; 2]| -> Vec<f64> {
            let mut data = trial::data(drones, |drone, bin| {
                let own_us = if drone % 2 == 0 { own_us } else { -own_us };
                let more_us = if bin.start_s == 0.0 { own_us + shared_us } else { 0.0 };
                noise_us(drone, bin.start_s as usize) + more_us
            });
            // Four bins to a leg.
            data.groups[0].bins.iter_mut().for_each(|bin| bin.segment /= 2);
            let (before, after) = (&data.groups[0].bins, &data.settled().groups[0].bins);
            let is_gone = |bin: &&Bin| !after.contains(bin);
            before.iter().filter(is_gone).map(|bin| bin.start_s).collect()
        };
        let none: [f64; 0] = [];
        assert_eq!(left_out(8, [0.0, 0.0]), none);
        assert_eq!(left_out(8, [6.0, 0.0]), [0.0]);
        assert_eq!(left_out(8, [0.0, 6.0]), none, "all drones share it");
        assert_eq!(left_out(4, [6.0, 0.0]), none, "too few to tell");
    }
}
