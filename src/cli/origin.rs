//! `--logs`: which logs of a campaign are meant.

use clap::ValueEnum;

use crate::campaign::origin::LogOrigin;

/// Which logs of a campaign, if somebody chooses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(super) enum OriginChoice {
    /// Those of real drones, in logs/
    Real,
    /// Simulated ones, in simulated/
    Simulated,
}

impl From<OriginChoice> for LogOrigin {
    fn from(choice: OriginChoice) -> Self {
        match choice {
            OriginChoice::Real => Self::Real,
            OriginChoice::Simulated => Self::Simulated,
        }
    }
}
