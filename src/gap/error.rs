//! Errors of comparing measurement and simulation.

use thiserror::Error;

use super::left_out::{LeftOut, said_together};
use crate::effects::EffectError;
use crate::mission::resolve::MissionError;
use crate::sim::SimError;

/// Error of a comparison of measurement and simulation.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum GapError {
    /// No drone has steady flight.
    #[error(
        "no log has steady flight of the plan to compare: gaps, motors at their limits, or wind in which the drones lean as far as \
         their autopilot lets them{}",
        listed(.reasons)
    )]
    NothingMeasured {
        /// Reasons why drones were left out.
        reasons: Vec<LeftOut>,
    },
    /// Measurement and simulation have too few bins in common.
    #[error(
        "measurement and simulation have too little steady flight in common: gaps, motors or leans \
         at their limits (`updraft analyze` says where), or were they flown from different plans?"
    )]
    NothingCommon,
    /// The pulse never changes.
    #[error(
        "the pulse is the same ({value_us:.1} us) in all of the flight: RCOU in the logs holds a \
         constant, not the motor commands; log the outputs they are connected to (SERVOn_FUNCTION \
         33 to 40)"
    )]
    ConstantPulse {
        /// Value of the pulse, us.
        value_us: f64,
    },
    /// The pulse of another program's simulation never changes.
    #[error(
        "the simulated pulse is the same ({value_us:.1} us) in all of the flight: its logs hold \
         a constant, not the motor commands"
    )]
    ConstantSimulated {
        /// Value of the pulse, us.
        value_us: f64,
    },
    /// The logs do not follow the plan.
    #[error(
        "{wrong} of {of} {whose} do not follow the plan{}\n  give the plan that they flew (--plan), or the logs of \
         this plan",
        listed(.reasons)
    )]
    OtherPlan {
        /// Whose logs they are: of the drones, or of another simulation.
        whose: &'static str,
        /// Number of logs that do not.
        wrong: usize,
        /// Number of logs.
        of: usize,
        /// Reasons of each of them, and the flight it holds instead.
        reasons: Vec<LeftOut>,
    },
    /// There is neither a plan nor logs of a simulation.
    #[error(
        "there is nothing to compare with: give the plan that was flown (--plan), so that it can \
         be flown again, or logs of a simulation (--simulated)"
    )]
    NoSimulatedSide,
    /// The model could not be flown.
    #[error("the model's flight failed")]
    Simulation(#[from] SimError),
    /// The model could not be flown in the wind that only leans tell, by its own drag.
    #[error(
        "the model cannot fly in the {wind_mps:.0} m/s of wind that the drones' leans say by its own drag: they lean by a drag \
         that it lacks, or the air was more than it can hold. Which it was is told by horizontal legs of known speed \
         (updraft plan calibration-counterphase)"
    )]
    InReadWind {
        /// The wind that the leans say, m/s.
        wind_mps: f64,
        /// Failure of the flight.
        #[source]
        source: SimError,
    },
    /// The template of a proposed flight is not valid.
    #[error("the proposed flight cannot be planned for this fleet")]
    Mission(#[from] Box<MissionError>),
    /// The model is not valid.
    #[error(transparent)]
    Effect(#[from] EffectError),
}

impl GapError {
    /// The same of a flight in a wind that only leans tell.
    pub(super) fn in_read_wind(self, wind_mps: f64) -> Self {
        match self {
            Self::Simulation(source) => Self::InReadWind { wind_mps, source },
            other => other,
        }
    }

    /// Whether it is that the vehicle cannot fly as it would have to: not steadily, or not the plan in that air.
    pub(super) fn is_not_flown(&self) -> bool {
        matches!(
            self,
            Self::Effect(EffectError::NotFlown { .. })
                | Self::Simulation(
                    SimError::NeverBegun { .. }
                        | SimError::NotLanded { .. }
                        | SimError::Diverged { .. }
                )
        )
    }
}

/// Causes one below the other; the first ten.
fn listed(reasons: &[LeftOut]) -> String {
    said_together(reasons)
        .iter()
        .take(10)
        .fold(String::new(), |text, reason| format!("{text}\n  {reason}"))
}
