//! Which campaigns a design flies: the levels and the seed of each, from the study's seed and its number.

use rand::seq::SliceRandom as _;
use rand_distr::{Distribution as _, StandardUniform};
use sha2::{Digest as _, Sha256};

use super::factor::{Factor, Level};
use crate::base::rng::{Purpose, stream};

/// Way in which a study draws its campaigns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Design {
    /// Every combination of all levels, this often.
    Grid {
        /// Campaigns of each combination, which differ by their seed.
        repeats: usize,
    },
    /// Latin hypercube: each factor's range in as many parts as there are campaigns, each part once.
    LatinHypercube {
        /// Number of campaigns.
        samples: usize,
    },
    /// Saltelli's scheme on a scrambled Sobol' sequence.
    Sobol {
        /// Rows of the scheme; each has two campaigns and one more for each factor.
        samples: usize,
    },
}

/// How campaigns get their seeds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeds {
    /// Each has its own; a Sobol' design has a factor for it.
    Each,
    /// All have the same.
    Same,
}

/// The campaigns of a study.
#[derive(Clone, Debug)]
pub struct Drawn<'a> {
    design: Design,
    seeds: Seeds,
    seed: u64,
    factors: &'a [Factor],
    /// Of a Latin hypercube: the part of each campaign, for one factor after the other.
    parts: Vec<Vec<u32>>,
}

/// One campaign of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Place in the study, from 0.
    pub index: usize,
    /// Seed of its air, noise and losses, below 2^48.
    pub seed: u64,
    /// Level of each factor, in the study's order.
    pub levels: Vec<Level>,
}

/// Place of a campaign in Saltelli's scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Matrix {
    A,
    B,
    /// A with one column of B.
    Mixed(usize),
}

impl Design {
    /// Name of the design, as in study files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Grid { .. } => "grid",
            Self::LatinHypercube { .. } => "latin-hypercube",
            Self::Sobol { .. } => "sobol",
        }
    }

    /// Number of columns of Saltelli's scheme: the factors, and chance if it is one.
    pub fn columns(factors: usize, seeds: Seeds) -> usize {
        factors + usize::from(seeds == Seeds::Each)
    }

    /// Number of campaigns, or `None` if there are too many to count.
    pub fn campaigns(self, factors: &[Factor], seeds: Seeds) -> Option<usize> {
        match self {
            Self::Grid { repeats } => factors
                .iter()
                .map(|factor| factor.levels.in_grid().unwrap_or(1))
                .try_fold(repeats, usize::checked_mul),
            Self::LatinHypercube { samples } => Some(samples),
            Self::Sobol { samples } => {
                samples.checked_mul(Self::columns(factors.len(), seeds).checked_add(2)?)
            }
        }
    }
}

impl<'a> Drawn<'a> {
    /// Draws a study.
    pub fn new(design: Design, seeds: Seeds, seed: u64, factors: &'a [Factor]) -> Self {
        let parts = match design {
            Design::LatinHypercube { samples } => (0..factors.len() as u64)
                .map(|column| {
                    let mut parts: Vec<u32> = (0..samples as u32).collect();
                    parts.shuffle(&mut stream(seed, column, Purpose::Design));
                    parts
                })
                .collect(),
            Design::Grid { .. } | Design::Sobol { .. } => Vec::new(),
        };
        Self { design, seeds, seed, factors, parts }
    }

    /// Number of campaigns.
    pub fn len(&self) -> usize {
        self.design.campaigns(self.factors, self.seeds).unwrap_or(0)
    }

    /// Whether there is no campaign.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The campaign of a number.
    pub fn item(&self, index: usize) -> Item {
        let factors = || self.factors.iter().enumerate();
        match self.design {
            Design::Grid { repeats } => {
                let mut rest = index / repeats.max(1);
                // The last factor changes first.
                let mut levels: Vec<Level> = self
                    .factors
                    .iter()
                    .rev()
                    .map(|factor| {
                        let count = factor.levels.in_grid().unwrap_or(1).max(1);
                        let place = rest % count;
                        rest /= count;
                        factor.levels.grid_level(place)
                    })
                    .collect();
                levels.reverse();
                Item { index, seed: self.seed_of("item", index), levels }
            }
            Design::LatinHypercube { samples } => {
                let mut rng = stream(self.seed, (1 << 32) + index as u64, Purpose::Design);
                let level = |(column, factor): (usize, &Factor)| {
                    let part = self.parts.get(column).and_then(|parts| parts.get(index));
                    let within: f64 = StandardUniform.sample(&mut rng);
                    let share = (f64::from(part.copied().unwrap_or(0)) + within) / samples as f64;
                    factor.levels.at(share)
                };
                let levels = factors().map(level).collect();
                Item { index, seed: self.seed_of("item", index), levels }
            }
            Design::Sobol { .. } => {
                let columns = Design::columns(self.factors.len(), self.seeds);
                let (row, matrix) = place(index, columns);
                let of_b = |column: usize| match matrix {
                    Matrix::A => false,
                    Matrix::B => true,
                    Matrix::Mixed(mixed) => mixed == column,
                };
                let level = |(column, factor): (usize, &Factor)| {
                    let half = if of_b(column) { self.factors.len() } else { 0 };
                    factor.levels.at(self.sobol(row, half + column))
                };
                let matrix = if of_b(self.factors.len()) { "B" } else { "A" };
                let levels = factors().map(level).collect();
                Item { index, seed: self.seed_of(matrix, row), levels }
            }
        }
    }

    /// A point of the scrambled sequence, 0 to 1.
    fn sobol(&self, row: usize, dimension: usize) -> f64 {
        let scramble = (self.seed ^ (self.seed >> 32)) as u32;
        f64::from(sobol_burley::sample(row as u32, dimension as u32, scramble))
    }

    /// Seed of a campaign. Below 2^48, so that every JSON reader reads it exactly.
    fn seed_of(&self, kind: &str, number: usize) -> u64 {
        let text = match self.seeds {
            Seeds::Each => format!("{} {kind} {number}", self.seed),
            Seeds::Same => format!("{} same", self.seed),
        };
        Sha256::digest(text).iter().take(6).fold(0, |seed, byte| (seed << 8) | u64::from(*byte))
    }
}

/// Row and matrix of a campaign in Saltelli's scheme. Rows come one after the other, so that more rows leave
/// those that were flown where they are.
fn place(index: usize, columns: usize) -> (usize, Matrix) {
    let matrix = match index % (columns + 2) {
        0 => Matrix::A,
        1 => Matrix::B,
        mixed => Matrix::Mixed(mixed - 2),
    };
    (index / (columns + 2), matrix)
}

#[cfg(test)]
mod tests {
    use super::super::factor::{Levels, Range, Target};
    use super::*;

    fn factors(count: usize) -> Vec<Factor> {
        let range = Range { from: 0.0, to: 1.0, log: false, whole: false, levels: Some(3) };
        (0..count)
            .map(|i| Factor {
                name: format!("x{i}"),
                unit: String::new(),
                target: Target::LostShare,
                levels: Levels::Range(range),
            })
            .collect()
    }

    fn numbers(item: &Item) -> Vec<f64> {
        item.levels.iter().map(|level| level.number().unwrap()).collect()
    }

    #[test]
    fn saltellis_scheme_mixes_one_column_at_a_time_and_chance_is_one() {
        let factors = factors(2);
        let drawn = Drawn::new(Design::Sobol { samples: 4 }, Seeds::Each, 7, &factors);
        assert_eq!(drawn.len(), 4 * (3 + 2));
        let row: Vec<Item> = (5..10).map(|index| drawn.item(index)).collect();
        let [a, b, first, second, chance] = &row[..] else { panic!("five of a row") };
        assert!(a.levels.iter().zip(&b.levels).all(|(a, b)| a != b));
        assert_eq!(first.levels, [b.levels[0].clone(), a.levels[1].clone()]);
        assert_eq!(second.levels, [a.levels[0].clone(), b.levels[1].clone()]);
        assert_eq!(chance.levels, a.levels);
        assert_eq!([first.seed, second.seed, chance.seed], [a.seed, a.seed, b.seed]);
        assert_ne!(a.seed, b.seed);
        let more = Drawn::new(Design::Sobol { samples: 64 }, Seeds::Each, 7, &factors);
        assert_eq!(more.item(7), drawn.item(7), "more rows leave those that are there");
        let other = Drawn::new(Design::Sobol { samples: 4 }, Seeds::Each, 8, &factors);
        assert_ne!(other.item(7).levels, drawn.item(7).levels);
    }

    #[test]
    fn a_hypercube_has_every_part_of_every_range_once() {
        let factors = factors(3);
        let drawn = Drawn::new(Design::LatinHypercube { samples: 50 }, Seeds::Each, 3, &factors);
        for column in 0..3 {
            let mut parts: Vec<_> =
                (0..50).map(|index| (numbers(&drawn.item(index))[column] * 50.0) as u32).collect();
            assert_ne!(parts, (0..50).collect::<Vec<_>>(), "shuffled");
            parts.sort_unstable();
            assert_eq!(parts, (0..50).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_grid_has_every_combination_as_often_as_asked() {
        let factors = factors(2);
        let drawn = Drawn::new(Design::Grid { repeats: 2 }, Seeds::Each, 3, &factors);
        assert_eq!(drawn.len(), 18);
        assert_eq!(numbers(&drawn.item(0)), numbers(&drawn.item(1)));
        assert_ne!(drawn.item(0).seed, drawn.item(1).seed);
        assert_eq!(numbers(&drawn.item(2)), [0.0, 0.5]);
        assert_eq!(numbers(&drawn.item(17)), [1.0, 1.0]);
        let same = Drawn::new(Design::Grid { repeats: 1 }, Seeds::Same, 3, &factors);
        assert_eq!(same.item(0).seed, same.item(8).seed);
    }
}
