//! Input of an analysis: logs, flights, and the truth where it is known.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::battery::Sag;
use super::density::Density;
use super::lean_table::LeanTable;
use super::levelled::Level;
use super::statistics::result::TrueAir;
use super::wind::Leaning;
use super::wind_forms::WindForms;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::flight::table::Mapping;
use crate::flight::{Flight, Indicator};
use crate::mission::plan::{Plan, Purpose};

/// One log of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogInput {
    /// Slot of the plan by somebody's record. Only the home position in the log counts more; without
    /// a record, the file's number and the system id count.
    pub slot: Option<u16>,
    /// Path of the log or table.
    pub path: PathBuf,
    /// Meaning of the columns, if the file is a table and not a DataFlash log.
    pub table: Option<Arc<Mapping>>,
    /// The flight itself, if it is at hand and not in a file: then `path` is its name, and `slot` its slot.
    pub at_hand: Option<AtHand>,
    /// Reason why the log is not to be used, if the caller has one: it is of another flight.
    pub refused: Option<String>,
}

/// A flight at hand; it is the same as itself alone.
#[derive(Clone, Debug)]
pub struct AtHand(pub Arc<Flight>);

impl PartialEq for AtHand {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

/// One flight to analyse.
#[derive(Clone, Copy, Debug, Default)]
pub struct FlightInput<'a> {
    /// Short name of the flight.
    pub name: &'a str,
    /// The plan, if there is one.
    pub plan: Option<&'a Plan>,
    /// Purpose of the flight; `None`: that of the plan, otherwise a calibration if it has a ladder
    /// (climbs at three speeds or more, and descents), otherwise a measurement.
    pub purpose: Option<Purpose>,
    /// The logs, in the order in which unplanned results are listed.
    pub logs: &'a [LogInput],
    /// GPS time of show time 0, for logs without SHOW rows.
    pub start: Option<GpsTime>,
    /// Whether the simulator wrote the logs.
    pub simulated: bool,
    /// The true vertical air speed, when the flight was simulated in uniform air, m/s.
    pub true_updraft_mps: Option<f64>,
    /// The true vertical air speed that each slot met, when it was written down.
    pub truth: Option<&'a BTreeMap<u16, TruthSeries>>,
    /// Ground height and the vehicle's response to air density; `None`: pulses of the map are not
    /// corrected for height.
    pub density: Option<Density>,
    /// Lean of the vehicle in wind, where its drag is known; `None`: the map is not corrected for
    /// wind, and says how wrong it may be.
    pub leaning: Option<Leaning>,
    /// Power of thrust that `u - 1000` goes with, where the vehicle is known: 1 where thrust is linear
    /// in the pulse.
    pub thrust_exponent: Option<f64>,
    /// Effect of the battery on the pulse; `None` if it has none.
    pub sag: Option<Sag>,
    /// Effect of wind on the vehicle's pulse, where its physics is known and
    /// [`FlightInput::leaning`] does not give it.
    pub wind_forms: Option<&'a WindForms>,
    /// Effect of wind on another indicator than the pulse, where the vehicle is known.
    pub lean_table: Option<&'a LeanTable>,
    /// The scales of the air that the flight was simulated in, where it has any.
    pub true_air: Option<&'a TrueAir>,
    /// Whether its calibration was simulated in air of other scales.
    pub calibrated_in_other_air: bool,
    /// Response of the vehicle whose level the flight gives; `None`: the map is inverted with the
    /// calibration's laws.
    pub level: Option<&'a Level>,
    /// Folder to which log paths are given in results.
    pub folder: Option<&'a Path>,
    /// Number of the campaign that the flight is of: its own calibration goes before those of others.
    pub campaign: usize,
}

impl FlightInput<'_> {
    /// Without the corrections that are known for pulses alone.
    pub(super) fn for_indicator(&self, indicator: Indicator) -> Self {
        match indicator {
            Indicator::Pulse => {
                let lean_table = self.lean_table.filter(|table| table.indicator == indicator);
                Self { lean_table, ..*self }
            }
            Indicator::RotorSpeed | Indicator::Power => {
                let lean_table = self.lean_table.filter(|table| table.indicator == indicator);
                Self {
                    density: self.density.map(|density| density.of(indicator)),
                    leaning: None,
                    sag: None,
                    wind_forms: None,
                    lean_table,
                    ..*self
                }
            }
        }
    }

    /// A log's path as results give it.
    pub(super) fn shown(&self, path: &Path) -> String {
        let inside = self.folder.and_then(|folder| path.strip_prefix(folder).ok());
        inside.unwrap_or(path).shown().to_string()
    }
}

/// The vertical air speed that one simulated drone met.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TruthSeries {
    /// Show time of the first value, s; one value follows each second.
    pub first_s: i64,
    /// Mean updraft over the 10 s around each second, m/s, up positive; NaN where it is not known.
    pub updraft_mps: Vec<f64>,
}

impl TruthSeries {
    /// The value at a whole second of show time, m/s, up positive; `None`: it is not known then.
    pub fn at_second(&self, time_s: i64) -> Option<f64> {
        let index = usize::try_from(time_s.checked_sub(self.first_s)?).ok()?;
        self.updraft_mps.get(index).copied().filter(|value| value.is_finite())
    }

    /// The values at whole seconds of show time; `None` if not one is known.
    pub(super) fn at(&self, times_s: &[i64]) -> Option<Vec<Option<f64>>> {
        let values: Vec<Option<f64>> =
            times_s.iter().map(|time_s| self.at_second(*time_s)).collect();
        values.iter().any(Option::is_some).then_some(values)
    }

    /// Seconds with a value, and all seconds.
    pub(super) fn known(&self) -> [usize; 2] {
        let known = self.updraft_mps.iter().filter(|value| value.is_finite()).count();
        [known, self.updraft_mps.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_of_true_air_ends_where_it_ends() {
        let truth = TruthSeries { first_s: -1, updraft_mps: vec![0.1, 0.2, 0.3] };
        let values = [-2, -1, 0, 1, 2, i64::MIN].map(|time_s| truth.at_second(time_s));
        assert_eq!(values, [None, Some(0.1), Some(0.2), Some(0.3), None, None]);
        assert_eq!(truth.at(&[0, 1]), Some(vec![Some(0.2), Some(0.3)]));
        assert_eq!(truth.at(&[1, 2]), Some(vec![Some(0.3), None]));
        assert_eq!(truth.at(&[2, 3]), None);
    }

    #[test]
    fn a_second_without_truth_costs_no_other_second_its_own() {
        let truth = TruthSeries { first_s: 5, updraft_mps: vec![0.1, f64::NAN, 0.3] };
        assert_eq!(truth.at(&[5, 6, 7]), Some(vec![Some(0.1), None, Some(0.3)]));
        assert_eq!(truth.known(), [2, 3]);
    }
}
