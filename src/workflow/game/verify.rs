//! Whether truth, nonce, flight, verdict and record of a game belong together.

use std::path::Path;

use schemars::JsonSchema;
use serde::Serialize;

use super::reveal::{MAX_GAME_BYTES, gap_folder, read_record};
use super::{files, game_path, read_game};
use crate::base::digest::sha256;
use crate::base::file::read_whole;
use crate::base::plain::Shown as _;
use crate::blind::game::GameFile;
use crate::blind::record::{self, BlindRecord};
use crate::blind::seal;
use crate::campaign::CampaignError;
use crate::gap::Verdict;
use crate::workflow::error::{WorkflowError, with_reasons};
use crate::workflow::gap::{VERDICT, proof};
use crate::workflow::{made_by, words};

/// What is wrong with a sealed file that is not there.
const AWAY: &str = "is missing (put the folder back if it was kept from the player)";

/// Name and version of the format of what `updraft blind verify --json` prints.
pub const VERIFY_SCHEMA: &str = "updraft.blind-verify/1";

/// Whether the parts of a game belong together.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Verification {
    /// Format name and version: `updraft.blind-verify/1`.
    pub schema: String,
    /// Program and version.
    pub made_by: String,
    /// SHA-256 of the truth that everything is held against.
    pub truth_sha256: String,
    /// Whether the seal was opened.
    pub revealed: bool,
    /// Whether nothing was altered.
    pub intact: bool,
    /// Each part that was looked at.
    pub checks: Vec<Check>,
}

/// One part of a game.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, JsonSchema)]
pub struct Check {
    /// Its path.
    pub file: String,
    /// What is right with it, if nothing is wrong.
    pub holds: String,
    /// What is wrong with it; absent: nothing.
    pub problem: Option<String>,
}

impl Check {
    /// The problem of a file that was altered, in a sentence that names the file once, with what stands between the
    /// two; `None`: nothing is wrong.
    pub fn wrong(&self, between: &str) -> Option<String> {
        let problem = self.problem.as_ref()?;
        let is_told = problem.contains(&self.file);
        Some(if is_told { problem.clone() } else { format!("{}{between}{problem}", self.file) })
    }
}

/// Checks of a game, as they are made.
struct Checks<'a> {
    folder: &'a Path,
    made: Vec<Check>,
}

impl Checks<'_> {
    fn add(&mut self, path: &Path, holds: impl Into<String>, problem: Option<String>) {
        let file = path.shown().to_string();
        self.made.push(Check { file, holds: holds.into(), problem });
    }
}

/// Verifies a game, before its seal is opened or after. `published` is the truth's SHA-256 as somebody has
/// written it down; `None`: as the record has it, else `game.json`, else `sealed/SHA256`.
///
/// # Errors
/// When there is no game. What was altered is no error, but in [`Verification::checks`].
pub fn run(folder: &Path, published: Option<&str>) -> Result<Verification, WorkflowError> {
    let (game, damage) = match read_game(folder) {
        Ok(game) => (Some(game), None),
        Err(
            error @ (WorkflowError::Campaign(CampaignError::Json { .. }) | WorkflowError::Blind(_)),
        ) => (None, Some(with_reasons(&error))),
        Err(error) => return Err(error),
    };
    let path = record::path(folder);
    let revealed = path.exists();
    let record = revealed.then(|| read_record(&path));
    let (record, unreadable) = match record {
        Some(Ok(record)) => (Some(record), None),
        Some(Err(error)) => (None, Some(with_reasons(&error))),
        None => (None, None),
    };
    let recorded = record.as_ref().map(|record| record.truth_sha256.clone());
    let published = published.map(str::to_lowercase);
    let given = || game.as_ref().map(|game| game.truth_sha256.clone());
    let beside = seal::published(folder).ok();
    let told = most_told([recorded, given(), beside]);
    let mut checks = Checks { folder, made: Vec::new() };
    let is_whole = || seal::truth_sha256(folder).is_ok_and(|found| found == told);
    let truth_sha256 = match published {
        // Files that agree with one another are not each altered.
        Some(published) if published != told && is_whole() => {
            let problem = format!(
                "has the SHA-256 {told}, as all of this game says, and not {published}, which was given: that is of another \
                 game, or this one was exchanged as a whole"
            );
            checks.add(&seal::truth_path(folder), "", Some(problem));
            told
        }
        published => {
            let truth_sha256 = published.unwrap_or(told);
            checks.seal(&truth_sha256);
            truth_sha256
        }
    };
    if let Some(game) = &game {
        checks.game(game, record.as_ref(), &truth_sha256);
        checks.flight(game);
    }
    if let Some(problem) = damage {
        checks.add(&game_path(folder), "", Some(problem));
    }
    let proven = checks.verdict(record.as_ref(), game.as_ref(), revealed);
    if let Some(problem) = unreadable {
        checks.add(&path, "", Some(problem));
    }
    if let Some(record) = &record {
        checks.record(record, &path, &truth_sha256, proven.as_ref());
    }
    Ok(Verification {
        schema: VERIFY_SCHEMA.to_owned(),
        made_by: made_by(),
        truth_sha256,
        revealed,
        intact: checks.made.iter().all(|check| check.problem.is_none()),
        checks: checks.made,
    })
}

/// The hash that most of the files tell, where they differ the first that is told: one file of another game makes
/// no stranger of the others.
fn most_told(told: [Option<String>; 3]) -> String {
    let told: Vec<String> = told.into_iter().flatten().collect();
    let count = |hash: &String| told.iter().filter(|other| *other == hash).count();
    // The last of several maxima is taken.
    told.iter().rev().max_by_key(|hash| count(hash)).cloned().unwrap_or_default()
}

/// What is wrong with a hash, if it is another.
fn other(found: &str, wanted: &str) -> Option<String> {
    (found != wanted)
        .then(|| format!("was altered: its SHA-256 is {found}, published was {wanted}"))
}

impl Checks<'_> {
    /// The truth with its nonce, and the published hash beside it.
    fn seal(&mut self, truth_sha256: &str) {
        let folder = self.folder;
        let problem = match seal::truth_sha256(folder) {
            _ if !seal::truth_path(folder).exists() => Some(AWAY.to_owned()),
            Ok(found) => other(&found, truth_sha256),
            Err(error) => Some(with_reasons(&error)),
        };
        let holds = "the truth and its nonce have the SHA-256 that was published";
        self.add(&seal::truth_path(folder), holds, problem);
        let problem = match seal::published(folder) {
            _ if !seal::hash_path(folder).exists() => Some(AWAY.to_owned()),
            Ok(found) if found == truth_sha256 => None,
            Ok(found) => Some(format!("says {found}, published was {truth_sha256}")),
            Err(error) => Some(with_reasons(&error)),
        };
        self.add(&seal::hash_path(folder), "has that SHA-256", problem);
    }

    /// What the player was given.
    fn game(&mut self, game: &GameFile, record: Option<&BlindRecord>, truth_sha256: &str) {
        let path = game_path(self.folder);
        let problem = if game.truth_sha256 == truth_sha256 {
            let found = read_whole(&path, MAX_GAME_BYTES).map(|bytes| sha256(&bytes));
            match (found, record) {
                (Ok(found), Some(record)) if found != record.game_sha256 => Some(format!(
                    "was altered: its SHA-256 is {found}, in the record stands {}",
                    record.game_sha256
                )),
                (Err(error), _) => Some(with_reasons(&error)),
                _ => None,
            }
        } else {
            let says = &game.truth_sha256;
            Some(format!("says that the truth's SHA-256 is {says}, published was {truth_sha256}"))
        };
        self.add(&path, "names that SHA-256 and those of the flight's files", problem);
    }

    /// Plan, vehicle and logs.
    fn flight(&mut self, game: &GameFile) {
        let differences = files::differences(self.folder, game);
        if differences.is_empty() {
            let count = words::count(game.files.len(), "file");
            let flight = crate::blind::play::flight(self.folder);
            self.add(&flight, format!("{count} as they were flown"), None);
        }
        for difference in differences {
            self.add(&self.folder.join(&difference.path), "", Some(difference.how));
        }
    }

    /// The verdict, if there is one yet.
    fn verdict(
        &mut self,
        record: Option<&BlindRecord>,
        game: Option<&GameFile>,
        revealed: bool,
    ) -> Option<Verdict> {
        let compared = match record {
            Some(record) => self.folder.join(&record.gap),
            None => gap_folder(self.folder),
        };
        let path = compared.join(VERDICT);
        if !path.exists() {
            if revealed {
                self.add(&path, "", Some("is missing".to_owned()));
            }
            return None;
        }
        let again = proof::again(self.folder, None, None);
        let advice = proof::of_game(&again, revealed);
        let found = read_whole(&path, MAX_GAME_BYTES).map(|bytes| sha256(&bytes));
        if let (Ok(found), Some(record)) = (&found, record)
            && *found != record.verdict_sha256
        {
            let problem = format!(
                "was altered: its SHA-256 is {found}, in the record stands {}",
                record.verdict_sha256
            );
            self.add(&path, "", Some(problem));
            return None;
        }
        match proof::read(&compared, &advice) {
            Ok(proven) => {
                // What the seal was opened for was held against the flight then.
                let game = game.filter(|_| record.is_none());
                let why = game.and_then(|game| files::stranger(game, &proven.verdict));
                let holds = if record.is_some() {
                    "is the one for which the seal was opened"
                } else {
                    "is as `updraft gap` wrote it"
                };
                self.add(&path, holds, why);
                Some(proven.verdict)
            }
            Err(error) => {
                self.add(&path, "", Some(with_reasons(&error)));
                None
            }
        }
    }

    /// The record against the truth and the verdict, by this program if it has made the record.
    fn record(
        &mut self,
        record: &BlindRecord,
        path: &Path,
        truth_sha256: &str,
        verdict: Option<&Verdict>,
    ) {
        let opened = || {
            let at = self.folder.join(&record.gap).join(VERDICT);
            seal::open(self.folder, &at, Some(truth_sha256)).ok()
        };
        let mut holds = "is as it was written";
        let problem = if record.truth_sha256 != truth_sha256 {
            let says = &record.truth_sha256;
            Some(format!("is of a truth with the SHA-256 {says}, published was {truth_sha256}"))
        } else if record.made_by != made_by() {
            holds = "is as it was written (by another version: not scored again)";
            None
        } else if let (Some(verdict), Some(opened)) = (verdict, opened()) {
            holds = "has the score that truth and verdict give";
            (!record.is_score_of(&opened.truth, verdict))
                .then(|| "was altered: truth and verdict give another score".to_owned())
        } else {
            None
        };
        self.add(path, holds, problem);
    }
}
