//! Rows of a message with their board time, freed of glitches and cut at reboots.

use std::collections::BTreeMap;
use std::ops::Range;

use super::Series;
use crate::log::Table;

/// A time step back by more than this is a reboot, s (messages of one boot may swap by less).
const REBOOT_S: f64 = 1.0;
/// Rows ahead that vote on whether a time is a glitch.
const VOTERS: usize = 4;

/// Number columns of one message over board time.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// Board time, s.
    pub(super) time_s: Vec<f64>,
    columns: BTreeMap<String, Vec<f64>>,
}

impl Rows {
    /// From a table with a `TimeUS` (or the older `TimeMS`) column; empty without one. Rows whose
    /// time the rows around them contradict are dropped; returns how many.
    pub(super) fn from_table(table: Table) -> (Self, usize) {
        let times: Vec<f64> = match (table.number("TimeUS"), table.number("TimeMS")) {
            (Some(micro), _) => micro.iter().map(|time| time / 1e6).collect(),
            (None, Some(milli)) => milli.iter().map(|time| time / 1e3).collect(),
            (None, None) => return (Self::default(), 0),
        };
        if in_order(&times) {
            return (Self { time_s: times, columns: table.numbers.into_iter().collect() }, 0);
        }
        let kept = plausible(&times);
        let pick = |column: &[f64]| -> Vec<f64> {
            kept.iter().map(|index| column.get(*index).copied().unwrap_or(f64::NAN)).collect()
        };
        let columns =
            table.numbers.iter().map(|(name, column)| (name.clone(), pick(column))).collect();
        let dropped = times.len() - kept.len();
        (Self { time_s: pick(&times), columns }, dropped)
    }

    pub(super) fn is_empty(&self) -> bool {
        self.time_s.is_empty()
    }

    /// A column of the message.
    pub(super) fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.get(name).map(Vec::as_slice)
    }

    /// The rows of each boot, in file order.
    pub(super) fn boots(&self) -> Vec<Range<usize>> {
        let mut boots = Vec::new();
        let mut start = 0;
        for (index, pair) in self.time_s.windows(2).enumerate() {
            let [before, after] = *pair else { continue };
            if after < before - REBOOT_S {
                boots.push(start..index + 1);
                start = index + 1;
            }
        }
        if start < self.time_s.len() {
            boots.push(start..self.time_s.len());
        }
        boots
    }

    /// Keeps the rows for which `keep` says so.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let kept: Vec<usize> = (0..self.time_s.len()).filter(|index| keep(*index)).collect();
        let pick = |column: &[f64]| -> Vec<f64> {
            kept.iter().filter_map(|index| column.get(*index).copied()).collect()
        };
        self.time_s = pick(&self.time_s);
        for column in self.columns.values_mut() {
            *column = pick(column);
        }
    }

    /// A column as a channel over board time, each value passed through `convert`; samples that are
    /// not finite or not later than the one before are dropped.
    pub(super) fn series(&self, name: &str, convert: impl Fn(f64) -> f64) -> Option<Series> {
        let column = self.column(name)?;
        let mut series = Series::default();
        for (time, value) in self.time_s.iter().zip(column) {
            let value = convert(*value);
            if value.is_finite() && series.time_s.last().is_none_or(|last| time > last) {
                series.time_s.push(*time);
                series.value.push(value);
            }
        }
        (!series.is_empty()).then_some(series)
    }
}

/// Whether time never goes back: then every row is credible.
fn in_order(times: &[f64]) -> bool {
    times.is_sorted()
        && times.first().is_none_or(|first| *first >= 0.0)
        && times.last().is_none_or(|last| last.is_finite())
}

/// Indices of the rows with credible times. Time runs on, or starts again after a reboot: a row that
/// jumps while most of the next few rows go on from where time was before has a damaged time.
fn plausible(times: &[f64]) -> Vec<usize> {
    let possible = |time: f64| time.is_finite() && time >= 0.0;
    let mut kept = Vec::with_capacity(times.len());
    let mut last = 0.0;
    for (index, time) in times.iter().enumerate().filter(|(_, time)| possible(**time)) {
        let ahead = times.get(index + 1..).unwrap_or_default();
        let (mut voters, mut against) = (0, 0);
        for next in ahead.iter().filter(|next| possible(**next)).take(VOTERS) {
            // A row that itself lies before the last one has no say on a jump ahead.
            let has_say = *time < last || *next >= last;
            let goes_on = *next >= last && (*time < last || next < time);
            voters += usize::from(has_say);
            against += usize::from(goes_on);
        }
        let alone_and_back = voters == 0 && *time < last;
        if 2 * against > voters || alone_and_back {
            continue;
        }
        // Rows that swapped places within a boot do not set time back.
        last = if *time < last - REBOOT_S { *time } else { time.max(last) };
        kept.push(index);
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(times_us: &[f64]) -> (Rows, usize) {
        let values: Vec<f64> = (0..times_us.len()).map(|index| index as f64).collect();
        Rows::from_table(Table {
            message: "X".into(),
            rows: times_us.len(),
            numbers: vec![("TimeUS".into(), times_us.to_vec()), ("A".into(), values)],
            ..Table::default()
        })
    }

    #[test]
    fn a_glitched_time_is_dropped_and_a_reboot_is_not() {
        let (glitched, dropped) = rows(&[1e6, 2e6, 9e15, 3e6, f64::NAN, 4e6]);
        assert_eq!((glitched.time_s.as_slice(), dropped), (&[1.0, 2.0, 3.0, 4.0][..], 2));
        assert_eq!(glitched.column("A").unwrap(), &[0.0, 1.0, 3.0, 5.0]);
        assert_eq!(glitched.boots(), vec![0..4]);

        let (small, dropped) = rows(&[1e6, 2e6, 9e6, 3e6, 4e6, 6e6, 1.5e6, 7e6, 8e6]);
        assert_eq!(small.time_s, [1.0, 2.0, 3.0, 4.0, 6.0, 7.0, 8.0], "within seconds too");
        assert_eq!(dropped, 2);

        let times: Vec<f64> = (100..110).chain(5..15).map(|time| f64::from(time) * 1e6).collect();
        let (rebooted, dropped) = rows(&times);
        assert_eq!(dropped, 0);
        assert_eq!(rebooted.boots(), vec![0..10, 10..20]);
    }

    #[test]
    fn rows_in_order_are_those_that_the_votes_would_keep() {
        let ordered = [0.0, 1e6, 1e6, 2e6, 9e6];
        assert!(in_order(&ordered));
        assert_eq!(plausible(&ordered), [0, 1, 2, 3, 4]);
        for bad in [&[-1.0, 2.0][..], &[2.0, 1.0], &[1.0, f64::NAN], &[1.0, f64::INFINITY]] {
            assert!(!in_order(bad), "{bad:?}");
        }
        assert!(in_order(&[]));
    }

    #[test]
    fn channels_have_increasing_times_and_finite_values() {
        let (rows, _) = rows(&[1e6, 2e6, 1.5e6, 3e6]);
        let series = rows.series("A", |v| if v == 0.0 { f64::NAN } else { -v }).unwrap();
        assert_eq!(series.time_s, [2.0, 3.0]);
        assert_eq!(series.value, [-1.0, -3.0]);
        assert!(rows.series("B", |v| v).is_none());
    }
}
