//! Shards: the items of long work (flights of a table, cells of a study, drones, campaigns) shared out
//! between processes that do not talk to each other.

use std::fmt;
use std::str::FromStr;

use thiserror::Error;

use super::plain::plain;

/// Largest number of shards.
pub const MOST_SHARDS: u32 = 1_000_000;

/// One of N equal shares of some work: item `i` (from 0) belongs to shard `i mod N + 1`.
///
/// ```
/// use updraft::base::shard::Shard;
///
/// let shard: Shard = "2/3".parse().unwrap();
/// let its: Vec<usize> = (0..8).filter(|item| shard.takes(*item)).collect();
/// assert_eq!(its, [1, 4, 7]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    number: u32,
    of: u32,
}

/// Error of a shard that was asked for.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ShardError {
    /// The text is not `K/N`.
    #[error("a shard is K/N, such as 3/10 (K from 1 to N), or slurm inside an array job, not \"{}\"", plain(.0))]
    NotAShard(String),
    /// The number of the shard is not one of `1..=N`.
    #[error("there is no shard {number} of {of}: K goes from 1 to N, and N to {MOST_SHARDS}")]
    OutOfRange {
        /// Number that was asked for.
        number: u64,
        /// Number of shards that was asked for.
        of: u64,
    },
    /// A variable of a Slurm array job is not set, or is not a number.
    #[error(
        "--shard slurm takes K and N from the variables of an array job, and {variable} is {found}; submit with \
         sbatch --array=1-N, or give --shard K/N"
    )]
    NoArray {
        /// Name of the variable.
        variable: &'static str,
        /// State of the variable, in words.
        found: String,
    },
    /// The tasks of the array are not consecutive, so that a task does not know its place among them.
    #[error(
        "--shard slurm needs an array without gaps, and this one has {count} tasks from {least} to {most} in steps of \
         {step}; give --shard K/N instead"
    )]
    Gaps {
        /// Number of tasks in the array.
        count: u32,
        /// Lowest task number.
        least: u32,
        /// Highest task number.
        most: u32,
        /// Distance of neighbouring task numbers.
        step: u32,
    },
}

impl Shard {
    /// Shard `number` of `of`, both from 1.
    ///
    /// # Errors
    ///
    /// [`ShardError::OutOfRange`].
    pub fn new(number: u64, of: u64) -> Result<Self, ShardError> {
        let out = ShardError::OutOfRange { number, of };
        let (Ok(small), Ok(all)) = (u32::try_from(number), u32::try_from(of)) else {
            return Err(out);
        };
        if small == 0 || small > all || all > MOST_SHARDS {
            Err(out)
        } else {
            Ok(Self { number: small, of: all })
        }
    }

    /// Shard of a task of a Slurm array job, from the job's variables, which `variable` looks up. Tasks are
    /// counted within the array as it was submitted, so that a part of an array that is submitted again
    /// covers all items too.
    ///
    /// # Errors
    ///
    /// [`ShardError::NoArray`] outside of an array job, [`ShardError::Gaps`] for arrays such as `1,4,7-9`.
    pub fn of_slurm(variable: impl Fn(&str) -> Option<String>) -> Result<Self, ShardError> {
        let read = |name: &'static str| {
            let text = variable(name).filter(|text| !text.is_empty());
            let Some(text) = text else {
                return Err(ShardError::NoArray { variable: name, found: "not set".to_owned() });
            };
            let found = format!("\"{}\"", plain(&text));
            text.parse::<u32>().map_err(|_| ShardError::NoArray { variable: name, found })
        };
        let task = read("SLURM_ARRAY_TASK_ID")?;
        let count = read("SLURM_ARRAY_TASK_COUNT")?;
        let (least, most) = (read("SLURM_ARRAY_TASK_MIN")?, read("SLURM_ARRAY_TASK_MAX")?);
        // Older versions do not set it for arrays without a step.
        let step = read("SLURM_ARRAY_TASK_STEP").unwrap_or(1).max(1);
        let span =
            most.checked_sub(least).filter(|span| span % step == 0).map(|span| span / step + 1);
        let place =
            task.checked_sub(least).filter(|place| place % step == 0).map(|place| place / step + 1);
        match (span, place) {
            (Some(span), Some(place)) if span == count => Self::new(place.into(), count.into()),
            _ => Err(ShardError::Gaps { count, least, most, step }),
        }
    }

    /// Whether an item, counted from 0, belongs to this shard.
    pub fn takes(self, item: usize) -> bool {
        item % self.of as usize == self.number as usize - 1
    }

    /// Number of the shard, from 1.
    pub fn number(self) -> u32 {
        self.number
    }

    /// Number of shards in all.
    pub fn of(self) -> u32 {
        self.of
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let digits = |part: &str| {
            let whole = !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
            whole.then(|| part.parse::<u64>().ok()).flatten()
        };
        let parts = text.split_once('/').and_then(|(number, of)| digits(number).zip(digits(of)));
        let (number, of) = parts.ok_or_else(|| ShardError::NotAShard(text.to_owned()))?;
        Self::new(number, of)
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// The share of some work that a process has, and whether it does what is missing or only gathers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Shard whose items are worked on; `None`: all items, whose results are then put together.
    pub shard: Option<Shard>,
    /// Whether nothing is done: missing items are only named.
    pub gather_only: bool,
}

impl Share {
    /// Whether an item, counted from 0, is looked at.
    pub fn takes(self, item: usize) -> bool {
        self.shard.is_none_or(|shard| shard.takes(item))
    }

    /// Number of items that are looked at, out of `all`.
    pub fn count(self, all: usize) -> usize {
        let Some(shard) = self.shard else { return all };
        let before = shard.number() as usize - 1;
        all.saturating_sub(before).div_ceil(shard.of() as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn slurm(values: &[(&str, &str)]) -> Result<Shard, ShardError> {
        Shard::of_slurm(|name| {
            let value = values.iter().find(|(known, _)| *known == name);
            value.map(|(_, value)| (*value).to_owned())
        })
    }

    #[test]
    fn what_is_no_shard_is_refused() {
        for text in
            ["", "3", "0/4", "5/4", "1/0", "-1/4", "1/4/2", "a/b", " 1/2", "+1/2", "1/1000001"]
        {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
        let error = "5/4".parse::<Shard>().unwrap_err().to_string();
        assert_eq!(error, "there is no shard 5 of 4: K goes from 1 to N, and N to 1000000");
    }

    #[test]
    fn slurm_tells_the_place_in_the_array() {
        let array = |task, count, least, most| {
            slurm(&[
                ("SLURM_ARRAY_TASK_ID", task),
                ("SLURM_ARRAY_TASK_COUNT", count),
                ("SLURM_ARRAY_TASK_MIN", least),
                ("SLURM_ARRAY_TASK_MAX", most),
            ])
        };
        assert_eq!(array("3", "10", "1", "10").unwrap(), Shard::new(3, 10).unwrap());
        assert_eq!(array("0", "4", "0", "3").unwrap(), Shard::new(1, 4).unwrap());
        // A part that was submitted again does all that is missing.
        assert_eq!(array("7", "2", "7", "8").unwrap(), Shard::new(1, 2).unwrap());
        let gaps = array("7", "2", "3", "7").unwrap_err().to_string();
        assert!(gaps.contains("2 tasks from 3 to 7 in steps of 1"), "{gaps}");
        let none = slurm(&[]).unwrap_err().to_string();
        assert!(none.contains("SLURM_ARRAY_TASK_ID is not set"), "{none}");
    }

    #[test]
    fn slurm_counts_in_steps() {
        let task = |task| {
            slurm(&[
                ("SLURM_ARRAY_TASK_ID", task),
                ("SLURM_ARRAY_TASK_COUNT", "3"),
                ("SLURM_ARRAY_TASK_MIN", "2"),
                ("SLURM_ARRAY_TASK_MAX", "10"),
                ("SLURM_ARRAY_TASK_STEP", "4"),
            ])
        };
        assert_eq!(task("6").unwrap(), Shard::new(2, 3).unwrap());
    }

    #[test]
    fn the_first_shard_begins_with_the_first_item() {
        let items = |text: &str| {
            let shard: Shard = text.parse().unwrap();
            (0..7).filter(|item| shard.takes(*item)).collect::<Vec<_>>()
        };
        assert_eq!(items("1/3"), [0, 3, 6]);
        assert_eq!(items("3/3"), [2, 5]);
    }

    proptest! {
        #[test]
        fn every_item_has_one_shard(items in 0_usize..500, of in 1_u64..60) {
            let shards: Vec<Shard> = (1..=of).map(|number| Shard::new(number, of).unwrap()).collect();
            for item in 0..items {
                prop_assert_eq!(shards.iter().filter(|shard| shard.takes(item)).count(), 1);
            }
            let counted = shards.iter().map(|shard| Share { shard: Some(*shard), gather_only: false }.count(items));
            prop_assert_eq!(counted.sum::<usize>(), items);
        }
    }
}
