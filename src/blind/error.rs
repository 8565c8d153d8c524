//! Errors of blind flights.

use std::path::PathBuf;

use thiserror::Error;

use crate::base::file::FileError;
use crate::base::plain::Shown as _;
use crate::base::plain::plain;
use crate::campaign::CampaignError;
use crate::effects::EffectError;
use crate::mission::resolve::MissionError;
use crate::show::skyb::SkybError;
use crate::sim::SimError;
use crate::vehicle::VehicleError;

/// Error of drawing, flying, sealing, opening or scoring a blind flight.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BlindError {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file of the campaign folder cannot be used.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The protocol's template is not valid.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// A vehicle is not valid.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// An effect does not accept the parameters drawn for it.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A drone's show does not fit into its file.
    #[error("slot {slot} has no .skyb file")]
    Skyb {
        /// Number of the slot.
        slot: u16,
        /// Reason why its show does not fit into a file.
        #[source]
        source: SkybError,
    },
    /// A drone could not be flown.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// The name to hide is neither an effect nor a group of effects.
    #[error("nothing is called \"{}\" that could be hidden; there are {known}", plain(name))]
    Unknown {
        /// Name as asked for.
        name: String,
        /// Names that can be hidden, for the message.
        known: String,
    },
    /// The effect cannot be hidden from the base vehicle.
    #[error(
        "\"{name}\" cannot be hidden from {base}, which has it or does not feel it; choose another \
         vehicle"
    )]
    NotEligible {
        /// Name of the effect that was to be hidden.
        name: String,
        /// Name of the base vehicle from which it cannot be hidden.
        base: &'static str,
    },
    /// The effect cannot be hidden in this size.
    #[error(
        "\"{name}\" cannot be hidden with a size of {size}; it can be {} to {} {unit}",
        short(*least), short(*most)
    )]
    Size {
        /// Name of the effect that was to be hidden.
        name: &'static str,
        /// Size as asked for.
        size: f64,
        /// Smallest magnitude that can be hidden.
        least: f64,
        /// Largest magnitude that can be hidden.
        most: f64,
        /// Unit of these sizes.
        unit: &'static str,
    },
    /// The effect was asked for twice, perhaps under two names.
    #[error("\"{name}\" cannot be hidden together with \"{other}\": they are one effect")]
    Twice {
        /// Name of the effect that was to be hidden.
        name: String,
        /// Name of the effect that it equals.
        other: String,
    },
    /// A seed for scoring was given where flights are for tuning.
    #[error(
        "seed {seed} is for tuning: scores count only with seeds of {first} or more, which were \
         never used for tuning; give --tuning to score with it anyway, and the table will say so"
    )]
    TuningSeed {
        /// Seed as asked for.
        seed: u64,
        /// First seed for scoring.
        first: u64,
    },
    /// A seed for tuning was given where flights are for scoring.
    #[error(
        "seed {seed} is for scoring: whoever tunes with it spoils it; tune with seeds below {first}"
    )]
    ScoringSeed {
        /// Seed as asked for.
        seed: u64,
        /// First seed for scoring.
        first: u64,
    },
    /// A number is too large.
    #[error("{what} {value} is too large; at most {most}")]
    TooLarge {
        /// Name of the number, with its article: "the seed".
        what: &'static str,
        /// Value as asked for.
        value: u64,
        /// Largest value allowed.
        most: u64,
    },
    /// The seal was to be opened before there is a verdict.
    #[error(
        "the truth in {} stays sealed: there is no verdict at {}; write it first",
        sealed.shown(), verdict.shown()
    )]
    NoVerdict {
        /// Path of the folder that holds the sealed truth.
        sealed: PathBuf,
        /// Path at which the verdict was expected.
        verdict: PathBuf,
    },
    /// The truth is not the one that was sealed.
    #[error(
        "{} was changed after it was sealed: its SHA-256 is {found}, published was {published}",
        path.shown()
    )]
    Tampered {
        /// Path of the truth's file.
        path: PathBuf,
        /// SHA-256 of the file, hexadecimal.
        found: String,
        /// SHA-256 that was published when it was sealed, hexadecimal.
        published: String,
    },
    /// The search for missing physics failed.
    #[error("no verdict on {}", flight.shown())]
    Explain {
        /// Path of the flight's folder.
        flight: PathBuf,
        /// Reason why the search failed.
        #[source]
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file has another format, or another version of it.
    #[error("{} has the format \"{found}\", this program reads \"{wanted}\"", path.shown())]
    Schema {
        /// Path of the file.
        path: PathBuf,
        /// Format that the file states.
        found: String,
        /// Format that this program reads.
        wanted: &'static str,
    },
    /// A finished flight was made by another version of this program.
    #[error(
        "{} was made by {found}, this is {wanted}: one table is made by one version; choose another \
         folder with -o",
        path.shown()
    )]
    Version {
        /// Path of the flight's file.
        path: PathBuf,
        /// Program and version that made it.
        found: String,
        /// Program and version that reads it.
        wanted: String,
    },
    /// The flight is not finished, and nothing was to be flown.
    #[error("flight {index} is missing")]
    NotFlown {
        /// Index of the flight in its table.
        index: usize,
    },
    /// The folder holds flights of other settings.
    #[error(
        "{} holds flight {index} of another table ({why}); choose another folder with -o",
        folder.shown()
    )]
    Other {
        /// Path of the folder.
        folder: PathBuf,
        /// Index of the flight in its table.
        index: usize,
        /// Difference from the flight that was expected, in words.
        why: String,
    },
    /// Content has no form as JSON or TOML.
    #[error("failed to write {what} as text: {reason}")]
    Text {
        /// Name of the content, for the message.
        what: &'static str,
        /// Reason why it has no text form.
        reason: String,
    },
    /// The user stopped the run.
    #[error("interrupted; run the same command again to resume")]
    Stopped,
}

impl BlindError {
    /// The same error, told of a vehicle by its own name instead of its name in the tables.
    pub(super) fn of_vehicle(self, vehicle: &'static str) -> Self {
        match self {
            Self::NotEligible { name, .. } => Self::NotEligible { name, base: vehicle },
            other => other,
        }
    }
}

/// A number with three digits.
fn short(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}
