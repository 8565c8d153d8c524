//! Settings of an analysis, and their words for the report.

use crate::analysis::windows::Tilt;
use crate::analysis::{AnalysisOptions, LawKind, OffsetRule};
use crate::flight::Indicator;

/// Settings of an analysis.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// Options for windows, laws and the map.
    pub options: AnalysisOptions,
    /// Corrections of the map that are left out.
    pub without: Uncorrected,
    /// Whether the map is also made of the other indicators that the logs hold, and of all together.
    pub combine: bool,
    /// Files for other programs.
    pub files: Files,
}

/// Files for other programs, beside the report.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Files {
    /// Whether NetCDF files are written in the classic format, for programs without HDF5.
    pub netcdf_classic: bool,
    /// Organisation that measured, for the files' attributes; empty: not stated.
    pub institution: String,
}

/// Corrections of the map that are left out.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uncorrected {
    /// Whether the map is not corrected for the density of the air at different heights.
    pub density: bool,
    /// Whether the map is not corrected for the battery's voltage.
    pub battery: bool,
    /// Whether the map is not corrected for wind on leaning drones.
    pub wind: bool,
}

impl Settings {
    /// How it was analysed, for the report: (what, how).
    pub(super) fn words(&self) -> Vec<(&'static str, String)> {
        let Self { options, without, .. } = self;
        let law = match options.map_law {
            None => "auto",
            Some(LawKind::Linear) => "linear",
            Some(LawKind::SignedQuadratic) => "signed-quadratic",
        };
        let tilt = match options.windows.tilt {
            Tilt::Thrust => "thrust",
            Tilt::Paper => "paper",
        };
        let effort = match options.indicator {
            _ if self.combine => "pulse, and with all others together",
            Indicator::Pulse => "pulse",
            Indicator::RotorSpeed => "rpm",
            Indicator::Power => "power",
        };
        let offset = match options.offset {
            OffsetRule::Field => "field",
            OffsetRule::Always => "always",
            OffsetRule::Never => "never",
        };
        let windows = if options.paper_windows {
            "medians, weighted by the samples' standard deviation (the paper's way)"
        } else {
            "trimmed means, weighted by their standard errors"
        };
        let corrected = |off: bool| if off { "not corrected" } else { "corrected" };
        let depth =
            options.mixed_layer_depth_m.map(|m| ("depth of the mixed layer", format!("{m} m")));
        [
            ("law of the map", law),
            ("tilt correction", tilt),
            ("rotor effort", effort),
            ("offset over time and height", offset),
            ("windows", windows),
            ("air density at height, in the map", corrected(without.density)),
            ("battery voltage, in the map", corrected(without.battery)),
            (
                "wind on leaning drones, in the map, where their drag is known",
                corrected(without.wind),
            ),
        ]
        .map(|(what, how)| (what, how.to_owned()))
        .into_iter()
        .chain(depth)
        .collect()
    }
}
