//! Options of an analysis.

use super::calibrate::{FitOptions, Location, Weights};
use super::input::FlightInput;
use super::law::LawKind;
use super::statistics::StatisticsOptions;
use super::table::PaperTable;
use super::windows::{Tilt, WindowOptions};
use crate::flight::Indicator;

/// Options of an analysis.
#[derive(Clone, Debug, PartialEq)]
pub struct AnalysisOptions {
    /// Indicator of rotor effort to analyse.
    pub indicator: Indicator,
    /// Options for measuring windows.
    pub windows: WindowOptions,
    /// Whether the slow offset of the pulse is subtracted before laws are fitted.
    pub offset: OffsetRule,
    /// Options for fitting laws.
    pub fit: FitOptions,
    /// Windows as in the paper, whatever `fit` says of them: medians in simulations and means in the
    /// field, weighted by the samples' standard deviation.
    pub paper_windows: bool,
    /// Law for the map of the air (`linear`, `signed quadratic`); `None`: the line, which may bend,
    /// unless the calibration's windows make the signed quadratic clearly more probable (with
    /// [`AnalysisOptions::plain`]: the one of lower reduced chi²).
    pub map_law: Option<LawKind>,
    /// The paper's table beside the fleet's numbers; `None`: Table I for flights with a known true
    /// updraft (simulations), Table II for other fleets (of two drones or more).
    pub paper: Option<PaperTable>,
    /// Options for the statistics of a map.
    pub statistics: StatisticsOptions,
    /// Whether the estimate is the paper's own: the laws of the tables are inverted second by second, drone by
    /// drone. Else the map's calibration law knows about slow air, and the map has errors with their origins.
    pub plain: bool,
    /// Whether the map is also made as one estimate of all drones and seconds together, which takes most of the time of an
    /// analysis; without it there is no air between the drones, and there are no thermals.
    pub posterior: bool,
    /// Depth of the mixed layer above the ground, m, which no drone sees; `None`: not known, and no convective velocity
    /// scale is told.
    pub mixed_layer_depth_m: Option<f64>,
    /// Largest number of points of a trace for figures.
    pub trace_points: usize,
}

/// Rule for subtracting the slow offset (eq. 5).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OffsetRule {
    /// In the field, but not in simulations of uniform air, as in the paper.
    #[default]
    Field,
    /// In every flight.
    Always,
    /// In no flight, so that pulses stay as they were measured.
    Never,
}

impl OffsetRule {
    pub(super) fn is_subtracted(self, true_updraft_mps: Option<f64>) -> bool {
        match self {
            Self::Field => true_updraft_mps.is_none(),
            Self::Always => true,
            Self::Never => false,
        }
    }
}

impl Default for AnalysisOptions {
    fn default() -> Self {
        Self {
            indicator: Indicator::default(),
            windows: WindowOptions::default(),
            offset: OffsetRule::default(),
            fit: FitOptions::default(),
            paper_windows: false,
            map_law: None,
            paper: None,
            statistics: StatisticsOptions::default(),
            plain: false,
            posterior: true,
            mixed_layer_depth_m: None,
            trace_points: 1200,
        }
    }
}

impl AnalysisOptions {
    /// The choices for one flight, with what they leave to it decided.
    pub(super) fn of_flight(&self, input: &FlightInput<'_>) -> Self {
        let mut options = self.clone();
        options.fit.indicator = options.indicator;
        options.fit.wide_w_counts = self.plain;
        options.windows.thrust_exponent = options.windows.thrust_exponent.or(input.thrust_exponent);
        if self.paper_windows {
            let field = self.offset.is_subtracted(input.true_updraft_mps);
            options.fit.location = if field { Location::Mean } else { Location::Median };
            options.fit.weights = Weights::WindowSd;
            options.windows.tilt = Tilt::Paper;
        }
        options
    }
}
