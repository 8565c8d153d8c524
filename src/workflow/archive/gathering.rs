//! The work itself, campaign by campaign.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::output::{ARCHIVE_SCHEMA, ArchiveOutput, Gathered, Outcome, Rows};
use super::{Request, check_place};
use crate::archive::find::find;
use crate::archive::gather::Campaign;
use crate::archive::index::{ArchiveIndex, ArchivedCampaign};
use crate::archive::sources::{Sources, analysis_path};
use crate::archive::staging::remove;
use crate::archive::{ArchiveError, PART_FILE};
use crate::base::causes::with_causes;
use crate::base::plain::Shown as _;
use crate::workflow::clock::Stopwatch;
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::made_by;

/// The index is written at least so often: a killed run loses no more of it.
const WRITTEN_EVERY: Duration = Duration::from_secs(1);

pub(super) fn run(
    host: &dyn Host,
    request: &Request,
) -> Result<(ArchiveOutput, Ending), WorkflowError> {
    let found = find(&request.folders)?;
    check_place(&request.archive)?;
    if found.campaigns.is_empty() && !request.prune {
        return Err(nothing(&found.empty));
    }
    let _lock = host.lock(&request.archive)?;
    let index = ArchiveIndex::read(&request.archive, &made_by())?;
    let mut work = Gathering::new(&request.archive, index);
    let mut is_lossy = found.cut || !found.unread.is_empty();
    if found.cut {
        host.warn("there are more folders than are looked into: name campaigns, or folders nearer to them");
    }
    for (folder, reason) in &found.unread {
        host.warn(&format!("{} cannot be read: {reason}", folder.shown()));
    }
    for empty in &found.empty {
        is_lossy = true;
        host.warn(&format!("{} holds no campaign", empty.shown()));
    }
    let progress = host.progress("gathering", found.campaigns.len() as u64);
    let watch = Stopwatch::start(host);
    let mut written = Duration::ZERO;
    let mut result = Ok(());
    for folder in &found.campaigns {
        result = host.check_stop().and_then(|()| work.take(host, folder));
        if result.is_err() {
            break;
        }
        if watch.elapsed() > written + WRITTEN_EVERY {
            written = watch.elapsed();
            work.index.write(&request.archive)?;
        }
        progress.advance();
    }
    progress.finish();
    if result.is_ok() && request.prune {
        result = work.prune();
    }
    if !work.index.campaigns.is_empty() || work.is_changed {
        work.index.write(&request.archive)?;
    }
    result?;
    is_lossy |= work.done.iter().any(|one| one.outcome == Outcome::Skipped);
    let is_used = |one: &Gathered| one.outcome != Outcome::Skipped;
    if !work.done.iter().any(is_used) && !request.prune {
        let reason = match work.done.as_slice() {
            [one] => format!("the campaign {} cannot be used", one.folder.shown()),
            more => format!("none of {} campaigns can be used", more.len()),
        };
        return Err(WorkflowError::Nothing(reason));
    }
    let output = ArchiveOutput {
        schema: ARCHIVE_SCHEMA,
        archive: request.archive.clone(),
        held: work.index.campaigns.len(),
        rows: Rows::of(&work.index.campaigns),
        campaigns: work.done,
    };
    Ok((output, Ending::of_losses(is_lossy)))
}

fn nothing(empty: &[PathBuf]) -> WorkflowError {
    let names: Vec<String> = empty.iter().map(|folder| folder.shown().to_string()).collect();
    let holds = if names.len() == 1 { "holds" } else { "hold" };
    WorkflowError::Nothing(format!(
        "{} {holds} no campaign: neither an analysis.json nor a plan",
        names.join(", ")
    ))
}

/// The archive while campaigns are gathered.
struct Gathering<'a> {
    archive: &'a Path,
    index: ArchiveIndex,
    /// Campaigns of each folder when this began.
    by_folder: BTreeMap<PathBuf, Vec<String>>,
    /// Ids of campaigns that this run has seen, with their folders.
    seen: BTreeMap<String, PathBuf>,
    done: Vec<Gathered>,
    is_changed: bool,
}

impl<'a> Gathering<'a> {
    fn new(archive: &'a Path, index: ArchiveIndex) -> Self {
        let mut by_folder: BTreeMap<PathBuf, Vec<String>> = BTreeMap::new();
        for campaign in &index.campaigns {
            by_folder.entry(campaign.folder.clone()).or_default().push(campaign.id.clone());
        }
        let (seen, done) = (BTreeMap::new(), Vec::new());
        Self { archive, index, by_folder, seen, done, is_changed: false }
    }

    /// Gathers one campaign. One that is broken is reported; what ends the work is a full disk and its like.
    fn take(&mut self, host: &dyn Host, folder: &Path) -> Result<(), WorkflowError> {
        match self.gathered(folder) {
            Ok(done) => {
                if let (Outcome::Skipped | Outcome::Copy, Some(reason)) =
                    (done.outcome, &done.reason)
                {
                    let said = format!("{}: {reason}", folder.shown());
                    if done.outcome == Outcome::Copy { host.say(&said) } else { host.warn(&said) }
                }
                self.done.push(done);
                Ok(())
            }
            Err(error) if is_of_campaign(&error, self.archive) => {
                let reason = with_causes(&error, ": ");
                host.warn(&format!("{} is skipped: {reason}", folder.shown()));
                let id = self.by_folder.get(folder).and_then(|ids| ids.first()).cloned();
                self.done.push(self.told(folder, id, Outcome::Skipped, Some(reason)));
                Ok(())
            }
            Err(ArchiveError::File(error)) => Err(error.into()),
            Err(ArchiveError::Campaign(error)) => Err(error.into()),
            Err(error) => Err(WorkflowError::Failed(error.to_string())),
        }
    }

    fn gathered(&mut self, folder: &Path) -> Result<Gathered, ArchiveError> {
        let sources = Sources::open(folder)?;
        let known = self.by_folder.get(folder).into_iter().flatten();
        let known: Vec<&ArchivedCampaign> = known.filter_map(|id| self.index.of_id(id)).collect();
        let is_same = |one: &&&ArchivedCampaign| one.inputs_sha256 == sources.inputs_sha256;
        if let Some(one) = known.iter().find(is_same).filter(|one| self.is_whole(one)) {
            let id = one.id.clone();
            self.seen.insert(id.clone(), folder.to_owned());
            return Ok(self.told(folder, Some(id), Outcome::Unchanged, None));
        }
        if let Some(done) = self.known_elsewhere(folder, &sources.inputs_sha256) {
            return Ok(done);
        }
        let campaign = Campaign::read(sources)?;
        let id = campaign.id.clone();
        if let Some(other) = self.seen.get(&id) {
            return Ok(self.twice(&campaign, &other.clone()));
        }
        let before = self.index.of_id(&id).cloned();
        self.seen.insert(id.clone(), folder.to_owned());
        // A campaign that was moved.
        if let Some(moved) = before
            .as_ref()
            .filter(|of| of.inputs_sha256 == campaign.inputs_sha256() && self.is_whole(of))
        {
            self.index.put(ArchivedCampaign { folder: folder.to_owned(), ..moved.clone() });
            self.is_changed = true;
            return Ok(self.told(folder, Some(id), Outcome::Unchanged, None));
        }
        let entry = campaign.write(self.archive, before.as_ref())?;
        self.index.put(entry);
        self.is_changed = true;
        let mut outcome = if before.is_some() { Outcome::Replaced } else { Outcome::Added };
        // A simulation that was flown anew has replaced the one before; flights in the field stay.
        let old: Vec<String> = self.by_folder.get(folder).cloned().unwrap_or_default();
        for old in old.iter().filter(|old| **old != id) {
            let is_simulated = self.index.of_id(old).is_some_and(|of| of.simulated == Some(true));
            if is_simulated && campaign.simulated == Some(true) && !self.seen.contains_key(old) {
                self.remove(old)?;
                outcome = Outcome::Replaced;
            }
        }
        Ok(self.told(folder, Some(id), outcome, None))
    }

    /// A campaign whose files are, byte by byte, those of one that was gathered from another folder: a copy, or, if that
    /// folder has it no more, the same one moved or renamed.
    fn known_elsewhere(&mut self, folder: &Path, inputs_sha256: &str) -> Option<Gathered> {
        let is_same = |of: &&ArchivedCampaign| {
            of.inputs_sha256 == inputs_sha256 && of.folder != folder && self.is_whole(of)
        };
        let other = self.index.campaigns.iter().find(is_same)?.clone();
        if self.seen.contains_key(&other.id) || analysis_path(&other.folder).is_file() {
            let reason = format!("it is a copy of {}", other.folder.shown());
            return Some(self.told(folder, Some(other.id), Outcome::Copy, Some(reason)));
        }
        self.seen.insert(other.id.clone(), folder.to_owned());
        let id = other.id.clone();
        self.index.put(ArchivedCampaign { folder: folder.to_owned(), ..other });
        self.is_changed = true;
        Some(self.told(folder, Some(id), Outcome::Unchanged, None))
    }

    /// A campaign whose id another folder of this run has.
    fn twice(&self, campaign: &Campaign, other: &Path) -> Gathered {
        let held = self.index.of_id(&campaign.id);
        let is_same = held.is_some_and(|held| held.inputs_sha256 == campaign.inputs_sha256());
        let (outcome, reason) = if is_same {
            (Outcome::Copy, format!("it is a copy of {}", other.shown()))
        } else {
            let reason = format!(
                "it is the flight of {}, analysed otherwise: give one of them, or rename one",
                other.shown()
            );
            (Outcome::Skipped, reason)
        };
        self.told(campaign.folder(), Some(campaign.id.clone()), outcome, Some(reason))
    }

    /// Whether all files of a campaign are there, none of them cut short.
    fn is_whole(&self, campaign: &ArchivedCampaign) -> bool {
        campaign.parts.iter().all(|part| {
            let file = std::fs::metadata(campaign.place(self.archive, part).join(PART_FILE));
            file.is_ok_and(|file| file.is_file() && (part.bytes == 0 || part.bytes == file.len()))
        })
    }

    fn told(
        &self,
        folder: &Path,
        campaign: Option<String>,
        outcome: Outcome,
        reason: Option<String>,
    ) -> Gathered {
        let held = campaign.as_deref().and_then(|id| self.index.of_id(id));
        Gathered { folder: folder.to_owned(), rows: Rows::of(held), campaign, outcome, reason }
    }

    fn remove(&mut self, id: &str) -> Result<(), ArchiveError> {
        if let Some(campaign) = self.index.of_id(id) {
            remove(self.archive, campaign, &campaign.parts)?;
        }
        self.index.remove(id);
        self.is_changed = true;
        Ok(())
    }

    /// Removes campaigns that this run has not met in their folders: the folder is gone, or holds another flight.
    fn prune(&mut self) -> Result<(), WorkflowError> {
        let looked: BTreeSet<&Path> = self
            .done
            .iter()
            .filter(|one| !matches!(one.outcome, Outcome::Skipped))
            .map(|one| one.folder.as_path())
            .collect();
        let is_gone = |campaign: &&ArchivedCampaign| {
            let folder = campaign.folder.as_path();
            let is_other = looked.contains(folder) && !self.seen.contains_key(&campaign.id);
            is_other || !analysis_path(folder).is_file()
        };
        let gone: Vec<ArchivedCampaign> =
            self.index.campaigns.iter().filter(is_gone).cloned().collect();
        if gone.len() == self.index.campaigns.len() && !gone.is_empty() {
            return Err(WorkflowError::Usage(format!(
                "--prune would remove every campaign of {}: are their disks mounted? Nothing was removed; an \
                 archive that is not needed any more can be deleted as a folder",
                self.archive.shown()
            )));
        }
        for campaign in gone {
            self.remove(&campaign.id)
                .map_err(|error| WorkflowError::Failed(with_causes(&error, ": ")))?;
            self.done.push(Gathered {
                rows: Rows::default(),
                campaign: Some(campaign.id),
                folder: campaign.folder,
                outcome: Outcome::Pruned,
                reason: None,
            });
        }
        Ok(())
    }
}

/// Whether an error is the campaign's own, so that others can go on.
fn is_of_campaign(error: &ArchiveError, archive: &Path) -> bool {
    match error {
        ArchiveError::File(error) => !error.path.starts_with(archive),
        ArchiveError::Table { .. } => false,
        _ => true,
    }
}
