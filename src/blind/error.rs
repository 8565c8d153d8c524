//! What can go wrong with a blind flight.

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

/// A blind flight cannot be drawn, flown, sealed, opened or scored.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum BlindError {
    /// A file could not be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// A file is not what it should be.
    #[error(transparent)]
    Campaign(#[from] CampaignError),
    /// The protocol's template is wrong.
    #[error(transparent)]
    Mission(#[from] MissionError),
    /// A vehicle is wrong.
    #[error(transparent)]
    Vehicle(#[from] VehicleError),
    /// An effect does not take what was drawn for it.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// A drone's show does not fit into its file.
    #[error("slot {slot} has no .skyb file")]
    Skyb {
        /// The slot.
        slot: u16,
        /// Why.
        #[source]
        source: SkybError,
    },
    /// A drone could not be flown.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// There is nothing of this name to hide.
    #[error("nothing is called \"{}\" that could be hidden; there are {known}", plain(name))]
    Unknown {
        /// As asked for.
        name: String,
        /// What there is.
        known: String,
    },
    /// A base does not take an effect.
    #[error(
        "\"{name}\" cannot be hidden from the base {base}, which has it or does not feel it; choose \
         another base with --base"
    )]
    NotEligible {
        /// What was to be hidden.
        name: String,
        /// The base.
        base: &'static str,
    },
    /// The same thing twice.
    #[error("\"{name}\" cannot be hidden together with \"{other}\": they are one effect")]
    Twice {
        /// What was to be hidden.
        name: String,
        /// With what.
        other: String,
    },
    /// A seed of the wrong range.
    #[error(
        "seed {seed} is for tuning: scores count only with seeds of {first} or more, which nobody has \
         tuned with; give --tuning to score with it all the same, and the table will say so"
    )]
    TuningSeed {
        /// As asked for.
        seed: u64,
        /// The first seed for scoring.
        first: u64,
    },
    /// A seed of the wrong range.
    #[error(
        "seed {seed} is for scoring: whoever tunes with it spoils it; tune with seeds below {first}"
    )]
    ScoringSeed {
        /// As asked for.
        seed: u64,
        /// The first seed for scoring.
        first: u64,
    },
    /// Too large a number.
    #[error("{what} {value} is too large; at most {most}")]
    TooLarge {
        /// Of what.
        what: &'static str,
        /// As asked for.
        value: u64,
        /// The most.
        most: u64,
    },
    /// The truth was asked for too early.
    #[error(
        "the truth in {} stays sealed: there is no verdict at {}; write the verdict first",
        sealed.shown(), verdict.shown()
    )]
    NoVerdict {
        /// The sealed folder.
        sealed: PathBuf,
        /// Where the verdict was expected.
        verdict: PathBuf,
    },
    /// The truth is not what was sealed.
    #[error(
        "{} was changed after it was sealed: its SHA-256 is {found}, published was {published}",
        path.shown()
    )]
    Tampered {
        /// The truth's file.
        path: PathBuf,
        /// Its hash.
        found: String,
        /// The published one.
        published: String,
    },
    /// The search failed.
    #[error("no verdict on {}", flight.shown())]
    Explain {
        /// The flight's folder.
        flight: PathBuf,
        /// Why.
        #[source]
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A file is of another program.
    #[error("{} has the format \"{found}\", this program reads \"{wanted}\"", path.shown())]
    Schema {
        /// The file.
        path: PathBuf,
        /// Its format.
        found: String,
        /// What this program reads.
        wanted: &'static str,
    },
    /// The folder holds flights of other settings.
    #[error(
        "{} holds flight {index} of another table ({why}); choose another folder with -o",
        folder.shown()
    )]
    Other {
        /// The folder.
        folder: PathBuf,
        /// The flight.
        index: usize,
        /// How it differs.
        why: String,
    },
    /// JSON or TOML could not be made.
    #[error("failed to write {what} as text: {reason}")]
    Text {
        /// What.
        what: &'static str,
        /// Why not.
        reason: String,
    },
    /// Stopped by the user.
    #[error("interrupted; the same command goes on where it stopped")]
    Stopped,
}
