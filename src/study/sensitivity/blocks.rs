//! Bootstrap of statistics that are functions of sums over campaigns.
//!
//! Campaigns are put into at most [`MOST`] blocks and blocks are drawn, so that the time does not grow with their
//! number: up to [`MOST`] campaigns each is a block, which is the ordinary bootstrap.

use rand::RngExt as _;
use rayon::prelude::*;

use super::result::Uncertain;
use crate::base::rng::{Purpose, stream};
use crate::numeric::Sorted;

/// Most blocks.
const MOST: usize = 1000;
/// Times that blocks are drawn.
const DRAWS: u64 = 1000;
/// Share of draws on either side of the interval.
const TAIL: f64 = 0.025;

/// Sums over campaigns, by blocks.
pub(super) struct Blocks {
    width: usize,
    /// Each campaign is a block.
    is_each: bool,
    /// The sums of one block after the other.
    sums: Vec<f64>,
}

impl Blocks {
    /// Blocks of `width` sums for this many campaigns.
    pub(super) fn new(campaigns: usize, width: usize) -> Self {
        let sums = vec![0.0; campaigns.clamp(1, MOST) * width];
        Self { width, is_each: campaigns <= MOST, sums }
    }

    /// The sums that a campaign is added to.
    pub(super) fn of(&mut self, campaign: usize) -> &mut [f64] {
        let blocks = self.sums.len() / self.width;
        // Above one each by a hash, so that what is near in a grid is not in one block.
        let block = if self.is_each { campaign } else { mixed(campaign) % blocks };
        self.sums.get_mut(block * self.width..(block + 1) * self.width).unwrap_or_default()
    }

    /// Sums over all.
    fn all(&self) -> Vec<f64> {
        let mut all = vec![0.0; self.width];
        self.sums.chunks(self.width).for_each(|block| add(&mut all, block));
        all
    }

    /// Statistics of all campaigns, each with the interval that draws of blocks give it. A statistic that is absent
    /// in all, or in more than half of the draws, has none.
    pub(super) fn uncertain(
        &self,
        seed: u64,
        number: u64,
        statistics: &(dyn Fn(&[f64]) -> Vec<Option<f64>> + Sync),
    ) -> Vec<Option<Uncertain>> {
        let all = statistics(&self.all());
        let blocks = self.sums.len() / self.width;
        let drawn: Vec<Vec<Option<f64>>> = (0..DRAWS)
            .into_par_iter()
            .map(|draw| {
                let mut rng = stream(seed, (number << 20) + draw, Purpose::Resampling);
                let mut sums = vec![0.0; self.width];
                for _ in 0..blocks {
                    let block = rng.random_range(0..blocks);
                    let of_block = self.sums.get(block * self.width..(block + 1) * self.width);
                    add(&mut sums, of_block.unwrap_or_default());
                }
                statistics(&sums)
            })
            .collect();
        all.into_iter()
            .enumerate()
            .map(|(index, value)| {
                let of_draw = |draw: &Vec<Option<f64>>| draw.get(index).copied().flatten();
                let mut draws: Vec<f64> =
                    drawn.iter().filter_map(of_draw).filter(|value| value.is_finite()).collect();
                if draws.len() < DRAWS as usize / 2 {
                    return None;
                }
                let sorted = Sorted::of(&mut draws);
                let value = value.filter(|value| value.is_finite())?;
                let (low, high) = (sorted.quantile(TAIL)?, sorted.quantile(1.0 - TAIL)?);
                Some(Uncertain { value, low: low.min(value), high: high.max(value) })
            })
            .collect()
    }
}

fn add(sums: &mut [f64], more: &[f64]) {
    for (sum, value) in sums.iter_mut().zip(more) {
        *sum += value;
    }
}

/// A number that tells nothing of its neighbours (the finaliser of SplitMix64).
fn mixed(number: usize) -> usize {
    let mut mixed = (number as u64).wrapping_add(0x9E37_79B9_7F4A_7C15);
    mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((mixed ^ (mixed >> 31)) >> 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half width of the interval of a mean of 0 and 1, times the root of the number.
    fn half_width(campaigns: usize) -> f64 {
        let mut blocks = Blocks::new(campaigns, 2);
        for campaign in 0..campaigns {
            add(blocks.of(campaign), &[1.0, (campaign % 2) as f64]);
        }
        let mean = |sums: &[f64]| vec![Some(sums[1] / sums[0])];
        let found = blocks.uncertain(1, 0, &mean)[0].unwrap();
        assert_eq!(found.value, 0.5);
        (found.high - found.low) / 2.0 * (campaigns as f64).sqrt()
    }

    #[test]
    fn intervals_are_those_of_a_mean_with_one_or_many_in_a_block() {
        // 1.96 times the standard deviation of 0.5.
        for campaigns in [200, 1000, 50_000] {
            let half = half_width(campaigns);
            assert!((half - 0.98).abs() < 0.1, "{campaigns}: {half}");
        }
    }
}
