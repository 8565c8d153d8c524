//! Factors of a sensitivity study: what each drives, and the levels that it takes.

use std::fmt;

use serde::{Serialize, Serializer};
use toml::Value;

/// Digits that a drawn value is kept to, so that files are readable.
const DIGITS: i32 = 6;

/// A quantity that differs between the campaigns of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct Factor {
    /// Name for people, and of the column in tables.
    pub name: String,
    /// Unit of the levels, for axes; empty: none.
    pub unit: String,
    /// Quantity that the factor drives.
    pub target: Target,
    /// Levels that it takes.
    pub levels: Levels,
}

/// Quantity that a factor drives.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Template of the campaign.
    Campaign,
    /// Vehicle that is planned for and flown.
    Vehicle,
    /// Keys of the template, all set to the same level.
    Keys(Vec<String>),
    /// Effect of the vehicle: its name alone (`on`, `off`), or with a parameter.
    Effect {
        /// Name of the effect, or of effect and parameter with a dot between them.
        choice: String,
        /// Whether plan and analysis know of it.
        known: bool,
    },
    /// Number in the vehicle's file, by its dotted key.
    Parameter {
        /// Key of the number: `airframe.mass_kg`.
        key: String,
        /// Whether plan and analysis know of it.
        known: bool,
    },
    /// Motion of the air.
    Air(AirTarget),
    /// Share of the drones that bring no log home.
    LostShare,
}

/// Quantity of the air that a factor drives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AirTarget {
    /// Speed of a uniform wind in measurements, m/s.
    Wind,
    /// Direction that all wind comes from, degrees clockwise from north.
    WindFrom,
    /// Vertical speed of uniform air in measurements, m/s, up positive.
    Updraft,
    /// Speed of a uniform wind in calibrations, m/s.
    CalibrationWind,
    /// Vertical speed of uniform air in calibrations, m/s, up positive.
    CalibrationUpdraft,
    /// Key of the components of one kind.
    Component {
        /// Name of the kind: `field`.
        kind: String,
        /// Name of the key: `sd`.
        key: String,
        /// Whether calibrations alone are meant; else all flights with that kind of air.
        in_calibration: bool,
    },
}

/// Levels of a factor.
#[derive(Clone, Debug, PartialEq)]
pub enum Levels {
    /// These, each as likely as the others.
    List(Vec<Level>),
    /// All numbers between two.
    Range(Range),
}

/// Numbers between two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Lowest level of the factor, in its unit.
    pub from: f64,
    /// Highest level of the factor, in its unit.
    pub to: f64,
    /// Whether the logarithm is uniform, instead of the number.
    pub log: bool,
    /// Whether only whole numbers are meant.
    pub whole: bool,
    /// Number of levels in a grid; `None`: not said.
    pub levels: Option<usize>,
}

/// One level of a factor.
#[derive(Clone, Debug, PartialEq)]
pub struct Level(pub Value);

impl Level {
    /// The level as a number; `None`: it is a word or a list.
    pub fn number(&self) -> Option<f64> {
        match &self.0 {
            Value::Integer(number) => Some(*number as f64),
            Value::Float(number) => Some(*number),
            _ => None,
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.0 {
            Value::String(text) => f.write_str(text),
            Value::Float(number) => write!(f, "{number}"),
            other => write!(f, "{other}"),
        }
    }
}

impl Serialize for Level {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            Value::Integer(number) => serializer.serialize_i64(*number),
            Value::Float(number) => serializer.serialize_f64(*number),
            _ => serializer.collect_str(self),
        }
    }
}

impl Levels {
    /// The level at a share of 0 to 1 of the distribution.
    pub fn at(&self, share: f64) -> Level {
        match self {
            Self::List(levels) => {
                let place = (share * levels.len() as f64) as usize;
                let level = levels.get(place).or(levels.last());
                level.cloned().unwrap_or(Level(Value::Boolean(false)))
            }
            Self::Range(range) => range.at(share),
        }
    }

    /// Number of levels in a grid; `None`: a range of which it is not said.
    pub fn in_grid(&self) -> Option<usize> {
        match self {
            Self::List(levels) => Some(levels.len()),
            Self::Range(range) => range.levels,
        }
    }

    /// The level of a place in a grid.
    pub fn grid_level(&self, place: usize) -> Level {
        match self {
            Self::List(levels) => self.at((place as f64 + 0.5) / levels.len().max(1) as f64),
            Self::Range(range) => {
                let last = range.levels.unwrap_or(1).saturating_sub(1).max(1);
                range.between(place as f64 / last as f64)
            }
        }
    }

    /// Whether all levels are numbers.
    pub fn are_numbers(&self) -> bool {
        match self {
            Self::List(levels) => levels.iter().all(|level| level.number().is_some()),
            Self::Range(_) => true,
        }
    }

    /// Number that a level counts as in statistics: its own, or the place of a word in its list.
    pub fn score(&self, level: &Level) -> f64 {
        match self {
            Self::List(levels) if !self.are_numbers() => {
                levels.iter().position(|other| other == level).unwrap_or(0) as f64
            }
            _ => level.number().unwrap_or_default(),
        }
    }

    /// Levels that show whether all others are possible: the lowest and the highest number, or each of a list.
    pub fn ends(&self) -> Vec<Level> {
        match self {
            Self::List(levels) => levels.clone(),
            Self::Range(range) => vec![range.between(0.0), range.between(1.0)],
        }
    }

    /// A level in the middle.
    pub fn middle(&self) -> Level {
        self.at(0.5)
    }
}

impl Range {
    fn at(&self, share: f64) -> Level {
        if !self.whole {
            return self.between(share);
        }
        // Each whole number as likely as the others, the ends too.
        let wide = Self { from: self.from - 0.5, to: self.to + 0.5, ..*self };
        let number = wide.number(share).round().clamp(self.from, self.to);
        Level(Value::Integer(number as i64))
    }

    /// The number at a share of the way from the lowest to the highest.
    fn between(&self, share: f64) -> Level {
        let number = self.number(share);
        if self.whole {
            return Level(Value::Integer(number.round() as i64));
        }
        Level(Value::Float(short(number).clamp(self.from, self.to)))
    }

    fn number(&self, share: f64) -> f64 {
        if self.log {
            let (from, to) = (self.from.ln(), self.to.ln());
            (from + (to - from) * share).exp()
        } else {
            self.from + (self.to - self.from) * share
        }
    }
}

/// A number with some digits.
fn short(number: f64) -> f64 {
    if number == 0.0 || !number.is_finite() {
        return number;
    }
    let decimals = DIGITS - 1 - number.abs().log10().floor() as i32;
    match 10_f64.powi(decimals.abs()) {
        scale if decimals >= 0 => (number * scale).round() / scale,
        scale => (number / scale).round() * scale,
    }
}

impl Target {
    /// The target as a study file names it.
    pub fn words(&self) -> String {
        match self {
            Self::Campaign => "campaign".to_owned(),
            Self::Vehicle => "vehicle".to_owned(),
            Self::Keys(keys) => {
                keys.iter().map(|key| format!("set.{key}")).collect::<Vec<_>>().join(", ")
            }
            Self::Effect { choice, .. } => format!("effect.{choice}"),
            Self::Parameter { key, .. } => format!("vehicle.{key}"),
            Self::Air(air) => air.words(),
            Self::LostShare => "lost_share".to_owned(),
        }
    }
}

impl AirTarget {
    fn words(&self) -> String {
        match self {
            Self::Wind => "air.wind_mps".to_owned(),
            Self::WindFrom => "air.wind_from_deg".to_owned(),
            Self::Updraft => "air.updraft_mps".to_owned(),
            Self::CalibrationWind => "calibration_air.wind_mps".to_owned(),
            Self::CalibrationUpdraft => "calibration_air.updraft_mps".to_owned(),
            Self::Component { kind, key, in_calibration: false } => format!("air.{kind}.{key}"),
            Self::Component { kind, key, in_calibration: true } => {
                format!("calibration_air.{kind}.{key}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(from: f64, to: f64, log: bool, whole: bool) -> Levels {
        Levels::Range(Range { from, to, log, whole, levels: Some(3) })
    }

    #[test]
    fn shares_are_numbers_on_either_scale() {
        assert_eq!(range(0.0, 8.0, false, false).at(0.25).number(), Some(2.0));
        assert_eq!(range(1.0, 100.0, true, false).at(0.5).number(), Some(10.0));
        assert_eq!(range(0.1, 0.3, false, false).at(1.0 / 3.0).number(), Some(0.166_667));
        let grid: Vec<_> = (0..3).map(|i| range(1.0, 100.0, true, false).grid_level(i)).collect();
        assert_eq!(grid.iter().filter_map(Level::number).collect::<Vec<_>>(), [1.0, 10.0, 100.0]);
    }

    #[test]
    fn whole_numbers_and_lists_are_as_likely_as_each_other() {
        let mut counts = [0; 3];
        for i in 0..300 {
            let level = range(2.0, 4.0, false, true).at((f64::from(i) + 0.5) / 300.0);
            counts[level.number().unwrap() as usize - 2] += 1;
        }
        assert_eq!(counts, [100, 100, 100]);
        let words = Levels::List(["a", "b"].map(|word| Level(word.into())).into());
        assert_eq!(words.at(0.49).to_string(), "a");
        assert_eq!(words.at(0.51).to_string(), "b");
        assert_eq!(words.score(&words.at(0.99)), 1.0);
    }
}
