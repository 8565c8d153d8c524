//! Logs from cards: who flew where is in the logs themselves.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::manifest::{ManifestEntry, Method, Shelf, Verified};
use super::part::sums;
use crate::base::file::{FileError, open_regular, write_with};
use crate::base::frame::Geodetic;
use crate::base::plain::Shown as _;
use crate::base::time::GpsTime;
use crate::campaign::CampaignError;
use crate::flight::{Identity, identify};
use crate::log::Log;
use crate::mission::Plan;
use nalgebra::Vector3;

/// A log's home is the slot's when it is nearer than this, m (satellite positions are no better).
const NEAR_M: f64 = 2.5;
/// A home this far from the slot of its system id contradicts it, m.
const FAR_M: f64 = 10.0;
/// Files and folders looked at below a card, at most.
const MOST_FILES: usize = 100_000;

/// How cards are imported.
#[derive(Clone, Debug)]
pub struct ImportOptions {
    /// Slot of each system id; empty: the slot's number is the system id.
    pub slots: BTreeMap<u8, u16>,
    /// File name of each slot's log.
    pub files: BTreeMap<u16, String>,
    /// When the flight started, if that is known: of several logs the one that covers it.
    pub start: Option<GpsTime>,
    /// Takes the place of logs that are there.
    pub again: bool,
    /// Program and version, for the manifest.
    pub made_by: String,
    /// For the manifest, Unix seconds.
    pub unix_s: u64,
}

/// What came of cards.
#[derive(Clone, Debug, Default)]
pub struct Imported {
    /// Taken over.
    pub taken: Vec<ManifestEntry>,
    /// There already: file names.
    pub there: Vec<String>,
    /// Logs that were left, and why.
    pub left: Vec<(PathBuf, String)>,
    /// Slots without a log, now.
    pub missing: Vec<u16>,
}

/// The number of a log in the name that the firmware gave it: `00000012.BIN`.
fn number(path: &Path) -> Option<u32> {
    let stem = path.file_stem()?.to_str()?;
    let is_number = stem.len() == 8 && stem.bytes().all(|byte| byte.is_ascii_digit());
    if is_number { stem.parse().ok() } else { None }
}

struct Candidate {
    path: PathBuf,
    identity: Identity,
}

/// Takes the logs of a flight over from cards (folders or files) into the folder `logs`.
///
/// A log belongs to the slot of its system id. Where ids are missing or were never set (several
/// logs of one flight have the same) its home decides; where both contradict each other the log is
/// left, with the reason.
///
/// # Errors
/// When the folder's manifest cannot be read or written.
pub fn import(
    cards: &[PathBuf],
    plan: &Plan,
    logs: &Path,
    options: &ImportOptions,
) -> Result<Imported, CampaignError> {
    let mut shelf = Shelf::open(logs, &options.made_by)?;
    let mut report = Imported::default();
    let mut found = Vec::new();
    for card in cards {
        find(card, &mut found, &mut report.left);
    }
    found.sort();
    let mut of_slot: BTreeMap<u16, Vec<Candidate>> = BTreeMap::new();
    for path in found {
        match Log::open(&path) {
            Err(error) => report.left.push((path, error.to_string())),
            Ok(log) => {
                let identity = identify(&log);
                match slot_of(&identity, plan, options) {
                    Ok(slot) => {
                        of_slot.entry(slot).or_default().push(Candidate { path, identity });
                    }
                    Err(reason) => report.left.push((path, reason)),
                }
            }
        }
    }
    for (slot, candidates) in of_slot {
        let Some(file) = options.files.get(&slot) else { continue };
        let target = shelf.path(file);
        if target.exists() && !options.again {
            let source = candidates.iter().map(|candidate| candidate.path.clone());
            report.left.extend(source.map(|path| (path, format!("{file} is there already"))));
            report.there.push(file.clone());
            continue;
        }
        let best = choose(candidates, options.start, &mut report.left);
        let Some(Candidate { path, identity }) = best else { continue };
        match copy(&path, &target) {
            Err(error) => report.left.push((path, format!("{error}: {}", error.source))),
            Ok(sums) => {
                let entry = ManifestEntry {
                    file: file.clone(),
                    slot,
                    drone: None,
                    boot: number(&path),
                    source: path.shown().to_string(),
                    size_bytes: sums.size,
                    sha256: sums.sha256,
                    method: Method::Import,
                    method_reason: None,
                    verified: Verified::Copy,
                    incomplete: identity.cut.map(str::to_owned),
                    attempts: 1,
                    at_unix_s: options.unix_s,
                    flight: None,
                };
                shelf.add(entry.clone())?;
                report.taken.push(entry);
            }
        }
    }
    let has = |slot: u16| options.files.get(&slot).is_some_and(|file| shelf.path(file).exists());
    report.missing = plan.slots.iter().map(|slot| slot.slot).filter(|slot| !has(*slot)).collect();
    Ok(report)
}

/// Logs below a folder; links are not followed.
fn find(path: &Path, found: &mut Vec<PathBuf>, left: &mut Vec<(PathBuf, String)>) {
    let mut folders = vec![path.to_owned()];
    while let Some(path) = folders.pop() {
        let about = match fs::symlink_metadata(&path) {
            Ok(about) => about,
            Err(error) => {
                left.push((path, format!("cannot be read: {error}")));
                continue;
            }
        };
        if about.is_dir() {
            let entries = fs::read_dir(&path).into_iter().flatten().flatten();
            folders.extend(entries.map(|entry| entry.path()));
        } else if about.is_file()
            && path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"))
        {
            found.push(path.clone());
        }
        if found.len() + folders.len() > MOST_FILES {
            left.push((path, format!("more than {MOST_FILES} files: give the cards' folders")));
            return;
        }
    }
}

fn slot_of(identity: &Identity, plan: &Plan, options: &ImportOptions) -> Result<u16, String> {
    let frame = plan.site.frame();
    let distance_m = |slot: u16| {
        let home = identity.home(options.start)?;
        let slot = plan.slot(slot)?;
        let there = frame.from_geodetic(Geodetic { amsl_m: frame.origin.amsl_m, ..home });
        let own = Vector3::from(slot.home_m);
        Some((there - own).xy().norm())
    };
    let near = plan.slots.iter().map(|slot| slot.slot).filter_map(|slot| {
        distance_m(slot).filter(|distance| *distance < NEAR_M).map(|distance| (distance, slot))
    });
    let near = near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, slot)| slot);
    let by_id = identity.system_id.and_then(|system| {
        if options.slots.is_empty() {
            plan.slot(system.into()).map(|slot| slot.slot)
        } else {
            options.slots.get(&system).copied()
        }
    });
    match (by_id, near) {
        (Some(slot), Some(near)) if slot != near => {
            if distance_m(slot).is_some_and(|distance| distance > FAR_M) {
                // Ids that were never set: where it stood tells.
                Ok(near)
            } else {
                Err(format!(
                    "its system id is of slot {slot}, but it stood at slot {near}: \
                     copy it by hand if you know which"
                ))
            }
        }
        (Some(slot), None) if distance_m(slot).is_some_and(|distance| distance > FAR_M) => {
            Err(format!("its system id is of slot {slot}, but it was elsewhere: another flight"))
        }
        (Some(slot), _) | (None, Some(slot)) => Ok(slot),
        (None, None) => Err("neither its system id nor its home is in the plan".to_owned()),
    }
}

/// Of several logs of a slot: the one that covers the start, else the latest.
fn choose(
    candidates: Vec<Candidate>,
    start: Option<GpsTime>,
    left: &mut Vec<(PathBuf, String)>,
) -> Option<Candidate> {
    let covers = |candidate: &Candidate| match (start, candidate.identity.span()) {
        (Some(start), Some((first, last))) => {
            (first.total_ms()..=last.total_ms()).contains(&start.total_ms())
        }
        _ => false,
    };
    let rank = |candidate: &Candidate| {
        let latest = candidate.identity.span().map(|(first, _)| first.total_ms());
        (covers(candidate), latest, candidate.path.clone())
    };
    let mut candidates = candidates;
    candidates.sort_by_key(|candidate| rank(candidate));
    let best = candidates.pop()?;
    for other in candidates {
        let reason = format!("{} is of the same drone, and later", best.path.shown());
        left.push((other.path, reason));
    }
    Some(best)
}

fn copy(from: &Path, to: &Path) -> Result<super::part::Sums, FileError> {
    let (mut source, _) =
        open_regular(from).map_err(|error| FileError::new("open", from, error))?;
    write_with(to, |out| io::copy(&mut source, out).map(drop))?;
    let (right, found) = (sums(from)?, sums(to)?);
    if right == found {
        Ok(found)
    } else {
        let error = io::Error::other("the copy differs from the card: read the card again");
        Err(FileError::new("copy", from, error))
    }
}
