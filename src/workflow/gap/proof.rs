//! Proof that nobody has edited a comparison: the SHA-256 of verdict and model, in a file beside them that
//! `sha256sum --check` reads as well.

use std::fmt::Write as _;
use std::path::Path;

use super::{MODEL, VERDICT};
use crate::base::digest::sha256;
use crate::base::file::{FileError, read_whole, write_whole};
use crate::base::parse;
use crate::base::plain::Shown as _;
use crate::campaign::CampaignError;
use crate::gap::Verdict;
use crate::workflow::error::WorkflowError;
use crate::workflow::words;

/// Name of the file in the folder of a comparison.
pub(crate) const PROOF: &str = "SHA256";
/// Largest verdict, model or proof that is read, bytes.
const MAX_BYTES: u64 = 256 << 20;

/// A verdict that is as `updraft gap` wrote it.
pub(crate) struct Proven {
    pub(crate) verdict: Verdict,
    /// SHA-256 of its file, hexadecimal.
    pub(crate) sha256: String,
}

/// Writes the hashes of these files, by their names in the folder.
pub(super) fn write(folder: &Path, files: &[(&str, &[u8])]) -> Result<(), FileError> {
    let mut text = String::new();
    for (name, bytes) in files {
        let _ = writeln!(text, "{}  {name}", sha256(bytes));
    }
    write_whole(&folder.join(PROOF), text.as_bytes())
}

/// The command that compares a campaign again, one of its flights if it is named, into a folder if that is
/// named.
pub(crate) fn again(campaign: &Path, flight: Option<&str>, folder: Option<&Path>) -> String {
    let word = |path: &Path| words::shell(&path.shown().to_string());
    let mut command = vec!["updraft gap".to_owned(), word(campaign)];
    if let Some(name) = flight {
        command.extend(["--flight".to_owned(), words::shell(name)]);
    }
    if let Some(folder) = folder {
        command.extend(["-o".to_owned(), word(folder)]);
    }
    command.join(" ")
}

/// What to do about a comparison that was edited: to make it anew by a command.
pub(crate) fn anew(again: &str) -> String {
    format!("compare again (`{again}`)")
}

/// The same of a game's comparison, which cannot be made anew once the seal was opened: somebody knows the truth.
pub(crate) fn of_game(again: &str, is_opened: bool) -> String {
    if is_opened {
        "put it back as it was: the seal was opened for it".to_owned()
    } else {
        anew(again)
    }
}

/// Reads the verdict of a comparison that nobody has edited, nor its model. `advice` is what to do if it was.
///
/// # Errors
/// When a file cannot be read or was edited, or there is no proof.
pub(crate) fn read(folder: &Path, advice: &str) -> Result<Proven, WorkflowError> {
    let path = folder.join(VERDICT);
    let bytes = read_whole(&path, MAX_BYTES)?;
    let proof = folder.join(PROOF);
    if !proof.is_file() {
        return Err(WorkflowError::Usage(format!(
            "{} has no {PROOF} beside it, so nobody can tell whether it was edited; {advice}",
            path.shown()
        )));
    }
    let text = read_whole(&proof, MAX_BYTES)?;
    let text = String::from_utf8_lossy(&text);
    let found = sha256(&bytes);
    unedited(&text, &path, &found, advice)?;
    let model = folder.join(MODEL);
    unedited(&text, &model, &sha256(&read_whole(&model, MAX_BYTES)?), advice)?;
    let verdict = parse::json(&bytes)
        .map_err(|error| CampaignError::Json { path, reason: error.to_string() })?;
    Ok(Proven { verdict, sha256: found })
}

/// Refuses a file whose hash is not in the proof.
fn unedited(proof: &str, path: &Path, found: &str, advice: &str) -> Result<(), WorkflowError> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let written = proof.lines().find_map(|line| {
        let (hash, file) = line.split_once("  ")?;
        (file == name).then_some(hash)
    });
    if written == Some(found) {
        return Ok(());
    }
    Err(WorkflowError::Usage(format!(
        "{} was edited after `updraft gap` wrote it: its SHA-256 is {found}, in {PROOF} stands {}; \
         {advice}",
        path.shown(),
        written.unwrap_or("none")
    )))
}
