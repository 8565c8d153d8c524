//! Assignment of logs to the slots of a plan.
//!
//! What a log says about its drone counts in this order: the place where it stood when it was armed,
//! a record's word ([`LogInput::slot`](super::LogInput::slot)), the number in its file name, its
//! system id. Where they contradict each other, the first one counts and a warning names the logs.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::path::Path;

use rayon::prelude::*;

use super::cause::Cause;
use crate::base::crc::ap_crc32;
use crate::base::file::open_named;
use crate::base::frame::Geodetic;
use crate::log::Log;
use crate::mission::plan::Plan;

/// How far a home may read from its slot besides half the spacing, m: metres of plain GPS, and the
/// show's origin set by hand on a map.
const GPS_TOLERANCE_M: f64 = 5.0;
/// Distance that a home may read from the slot of a plan of one slot, which has no neighbour to be
/// mixed up with, m.
const LONE_TOLERANCE_M: f64 = 20.0;
/// Digits of the names that the autopilot gives its logs (`00000012.BIN`): they count its flights.
const AUTOPILOT_DIGITS: usize = 8;
/// Logs named in one warning.
const NAMED: usize = 10;

/// What a log says about who wrote it.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidate {
    /// For messages.
    pub(super) name: String,
    pub(super) given: Option<u16>,
    pub(super) system_id: Option<u8>,
    pub(super) file_number: Option<u16>,
    /// Where it stood when it was armed: latitude, longitude.
    pub(super) home_deg: Option<(f64, f64)>,
    /// Whether it holds a flight.
    pub(super) flew: bool,
    /// The first log with the same bytes.
    pub(super) same_as: Option<usize>,
    /// Why nothing can be read from it.
    pub(super) unreadable: Option<Cause>,
    /// Why it is not to be used.
    pub(super) refused: Option<String>,
}

/// The slot of each log, or why it has none; and what contradicts itself, one sentence each.
#[derive(Clone, Debug, Default)]
pub(super) struct Matched {
    pub(super) slots: Vec<Result<u16, Cause>>,
    pub(super) warnings: Vec<String>,
}

/// The number in a file name: the last run of digits of `drone-07.BIN`. The autopilot's own names
/// have none: they count its flights.
pub(super) fn file_number(path: &Path) -> Option<u16> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    if stem.len() == AUTOPILOT_DIGITS && stem.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let head = stem.get(..end)?;
    let start = head.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |last| {
        last + head.get(last..).and_then(|tail| tail.chars().next()).map_or(1, char::len_utf8)
    });
    head.get(start..)?.parse().ok()
}

/// Where a log's home lies on the field.
enum Place {
    /// No position, or a plan that is nowhere on the globe.
    Unknown,
    /// On the home of this slot: the next home is more than twice as far.
    On(u16),
    /// On the field, but between these homes, nearest first.
    Between(Vec<u16>),
    /// Near no home: the nearest, and how far it is, m.
    Away(u16, f64),
}

/// The homes of a plan.
struct Field<'a> {
    plan: &'a Plan,
    /// A home this far away is another place, m; `None`: the plan is nowhere on the globe.
    limit_m: Option<f64>,
}

impl<'a> Field<'a> {
    fn of(plan: &'a Plan) -> Self {
        // Plans recovered from shows that do not say where they are have their origin at 0, 0.
        let placed = plan.site.origin_lat_deg != 0.0 || plan.site.origin_lon_deg != 0.0;
        let mut spacing_m = f64::INFINITY;
        for (index, slot) in plan.slots.iter().enumerate() {
            for other in plan.slots.get(index + 1..).unwrap_or_default() {
                let (dx, dy) = (slot.home_m[0] - other.home_m[0], slot.home_m[1] - other.home_m[1]);
                spacing_m = spacing_m.min(dx.hypot(dy));
            }
        }
        let limit_m = if spacing_m.is_finite() {
            spacing_m / 2.0 + GPS_TOLERANCE_M
        } else {
            LONE_TOLERANCE_M
        };
        Self { plan, limit_m: placed.then_some(limit_m) }
    }

    fn place(&self, home_deg: Option<(f64, f64)>) -> Place {
        let (Some((lat_deg, lon_deg)), Some(limit_m)) = (home_deg, self.limit_m) else {
            return Place::Unknown;
        };
        let amsl_m = self.plan.site.ground_amsl_m;
        let at = self.plan.site.frame().from_geodetic(Geodetic { lat_deg, lon_deg, amsl_m });
        let mut distances: Vec<(f64, u16)> = (self.plan.slots.iter())
            .map(|slot| ((slot.home_m[0] - at.x).hypot(slot.home_m[1] - at.y), slot.slot))
            .collect();
        distances.sort_by(|left, right| left.0.total_cmp(&right.0));
        match distances.as_slice() {
            [] => Place::Unknown,
            [(nearest, slot), ..] if *nearest > limit_m => Place::Away(*slot, *nearest),
            [(nearest, slot), (second, _), ..] if *nearest < second / 2.0 => Place::On(*slot),
            [(_, slot)] => Place::On(*slot),
            near => {
                let near = near.iter().take_while(|(distance, _)| *distance <= limit_m);
                Place::Between(near.map(|(_, slot)| *slot).collect())
            }
        }
    }
}

/// Finds the slot of each log; see the top of this file. A slot takes one log: one with a flight
/// before one without, then one whose name agrees, then the first.
pub(super) fn slots(plan: &Plan, logs: &[Candidate]) -> Matched {
    let field = Field::of(plan);
    let places: Vec<Place> = logs.iter().map(|log| field.place(log.home_deg)).collect();
    let mut work = Work { logs, taken: BTreeMap::new(), result: vec![None; logs.len()] };

    for (index, log) in logs.iter().enumerate() {
        if let Some(reason) = &log.refused {
            work.refuse(index, Cause::Refused(reason.clone()));
        }
    }
    work.refuse_copies(&places);
    let mut standing: Vec<(usize, u16)> = Vec::new();
    for (index, place) in places.iter().enumerate() {
        if work.result[index].is_some() {
            continue;
        }
        match place {
            Place::On(slot) => standing.push((index, *slot)),
            Place::Away(slot, distance_m) => {
                let (slot, distance_m) = (*slot, *distance_m);
                let limit_m = field.limit_m.unwrap_or_default();
                work.refuse(index, Cause::OtherPlace { slot, distance_m, limit_m });
            }
            Place::Unknown | Place::Between(_) => {}
        }
    }
    standing.sort_by_key(|(index, slot)| {
        let log = &logs[*index];
        (!log.flew, log.file_number != Some(*slot) && log.given != Some(*slot))
    });
    for (index, slot) in standing {
        work.claim(index, slot);
    }
    for (index, place) in places.iter().enumerate() {
        let Place::Between(near) = place else { continue };
        if work.result[index].is_some() {
            continue;
        }
        let log = &logs[index];
        let says = [log.given, log.file_number, log.system_id.map(u16::from)];
        let said = says.into_iter().flatten().filter(|slot| near.contains(slot));
        let slot = said.chain(near.iter().copied()).find(|slot| !work.taken.contains_key(slot));
        work.claim(index, slot.or(near.first().copied()).unwrap_or_default());
    }
    for (index, log) in logs.iter().enumerate() {
        match log.given.filter(|_| work.result[index].is_none()) {
            Some(slot) if plan.slot(slot).is_none() => {
                work.refuse(index, Cause::NoSuchSlot { slot });
            }
            Some(slot) => work.claim(index, slot),
            None => {}
        }
    }
    work.by_name(plan);
    let contradictions = contradictions(plan, &work, &places);
    Matched {
        slots: work.result.into_iter().map(|slot| slot.unwrap_or(Err(Cause::NoFreeSlot))).collect(),
        warnings: contradictions,
    }
}

/// Slots given out so far.
struct Work<'a> {
    logs: &'a [Candidate],
    taken: BTreeMap<u16, usize>,
    result: Vec<Option<Result<u16, Cause>>>,
}

impl Work<'_> {
    /// Of logs with the same bytes keeps the one whose name agrees with what it holds, else the first.
    fn refuse_copies(&mut self, places: &[Place]) {
        let logs = self.logs;
        let mut alike: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (index, log) in logs.iter().enumerate() {
            // Of a refused log all copies are refused, each with the reason.
            if let Some(first) = log.same_as.filter(|_| log.refused.is_none()) {
                alike.entry(first).or_insert_with(|| vec![first]).push(index);
            }
        }
        let agrees = |index: &usize| {
            let holds = match places.get(*index) {
                Some(Place::On(slot)) => Some(*slot),
                _ => logs[*index].system_id.map(u16::from),
            };
            holds.is_some() && holds == logs[*index].file_number
        };
        for (first, copies) in alike {
            let kept = copies.iter().copied().find(|index| agrees(index)).unwrap_or(first);
            for index in copies.into_iter().filter(|index| *index != kept) {
                self.refuse(index, Cause::Copy { of: logs[kept].name.clone() });
            }
        }
    }

    fn refuse(&mut self, index: usize, reason: Cause) {
        // That nothing can be read says more than that nothing fits.
        let reason = self.logs[index].unreadable.clone().unwrap_or(reason);
        self.result[index] = Some(Err(reason));
    }

    fn claim(&mut self, index: usize, slot: u16) {
        if let Some(first) = self.taken.get(&slot) {
            let first = self.logs[*first].name.clone();
            self.refuse(index, Cause::SlotTaken { slot, first });
        } else {
            self.taken.insert(slot, index);
            self.result[index] = Some(Ok(slot));
        }
    }

    /// Logs without a known place: the first of file number and system id that gives every one of
    /// them its own slot is taken. Without such a way each log takes the first way that leads to a
    /// slot still free.
    fn by_name(&mut self, plan: &Plan) {
        let logs = self.logs;
        let open: Vec<usize> = (0..logs.len()).filter(|i| self.result[*i].is_none()).collect();
        let by_number = |index: usize| logs[index].file_number.filter(|s| plan.slot(*s).is_some());
        let by_id = |index: usize| {
            logs[index].system_id.map(u16::from).filter(|slot| plan.slot(*slot).is_some())
        };
        let ways: [&dyn Fn(usize) -> Option<u16>; 2] = [&by_number, &by_id];
        let fits_all = |way: &&dyn Fn(usize) -> Option<u16>| {
            let mut seen: BTreeSet<u16> = self.taken.keys().copied().collect();
            open.iter().all(|index| way(*index).is_some_and(|slot| seen.insert(slot)))
        };
        let all = ways.iter().copied().find(fits_all);
        for index in open {
            let found: Vec<u16> = match all {
                Some(way) => way(index).into_iter().collect(),
                None => ways.iter().filter_map(|way| way(index)).collect(),
            };
            let free = found.iter().copied().find(|slot| !self.taken.contains_key(slot));
            match free.or(found.first().copied()) {
                Some(slot) => self.claim(index, slot),
                None => self.refuse(index, Cause::NoFreeSlot),
            }
        }
    }
}

/// Logs of which other evidence says something else than what decided: each log once.
fn contradictions(plan: &Plan, work: &Work<'_>, places: &[Place]) -> Vec<String> {
    const WORDS: [&str; 4] = ["home position", "flight record", "file name", "system id"];
    const SYSTEM_ID: usize = 3;
    let mut found: BTreeMap<(usize, Vec<usize>), Vec<String>> = BTreeMap::new();
    for ((log, place), result) in work.logs.iter().zip(places).zip(&work.result) {
        let Some(Ok(slot)) = result else { continue };
        let placed = matches!(place, Place::On(_) | Place::Between(_));
        let says =
            [placed.then_some(*slot), log.given, log.file_number, log.system_id.map(u16::from)];
        let Some(decided) = says.iter().position(|said| *said == Some(*slot)) else { continue };
        let others: Vec<(usize, u16)> = (says.iter().enumerate())
            .filter_map(|(word, said)| Some((word, (*said)?)))
            .filter(|(_, said)| said != slot && plan.slot(*said).is_some())
            .collect();
        // A drone may fly any slot: its system id says nothing against its place where the record or
        // the file name, which know who flew which, agree with that.
        let known = says.iter().take(SYSTEM_ID).filter(|said| **said == Some(*slot)).count() > 1;
        if known && others.iter().all(|(word, _)| *word == SYSTEM_ID) {
            continue;
        }
        let meant: BTreeSet<u16> = others.iter().map(|(_, said)| *said).collect();
        if meant.is_empty() {
            continue;
        }
        let meant: Vec<String> = meant.iter().map(u16::to_string).collect();
        let line = format!("{} is slot {slot}, not {}", log.name, meant.join(" or "));
        let words = others.into_iter().map(|(word, _)| word).collect();
        found.entry((decided, words)).or_default().push(line);
    }
    found
        .into_iter()
        .map(|((decided, others), lines)| {
            let others: Vec<&str> = others.into_iter().map(|word| WORDS[word]).collect();
            let more = match lines.len().saturating_sub(NAMED) {
                0 => String::new(),
                more => format!(" and {more} more"),
            };
            let named: Vec<&str> = lines.iter().take(NAMED).map(String::as_str).collect();
            format!(
                "{decided} contradicts {}; {decided} counts: {}{more}",
                others.join(" and "),
                named.join(", "),
                decided = WORDS[decided],
            )
        })
        .collect()
}

/// A file whose bytes can be compared.
#[derive(Clone, Copy)]
pub(super) enum Held<'a> {
    /// A log that was opened.
    Log(&'a Log),
    /// A table, with its size in bytes.
    Table(&'a Path, u64),
}

impl<'a> Held<'a> {
    /// A table that can be read more than once; `None`: it cannot (a pipe), or is empty.
    pub(super) fn table(path: &'a Path) -> Option<Self> {
        let metadata = std::fs::metadata(path).ok()?;
        (metadata.is_file() && metadata.len() > 0).then_some(Self::Table(path, metadata.len()))
    }

    fn size_bytes(self) -> u64 {
        match self {
            Self::Log(log) => log.size_bytes(),
            Self::Table(_, size) => size,
        }
    }

    /// The bytes; none where the file cannot be opened any more.
    fn reader(self) -> Box<dyn Read + 'a> {
        match self {
            Self::Log(log) => log.reader(),
            Self::Table(path, size) => match open_named(path) {
                Ok(file) => Box::new(file.take(size)),
                Err(_) => Box::new(std::io::empty()),
            },
        }
    }
}

/// For each file, the earlier one that has the very same bytes.
pub(super) fn same_bytes(logs: &[Option<Held<'_>>]) -> Vec<Option<usize>> {
    let mut sizes: BTreeMap<u64, Vec<(usize, Held<'_>)>> = BTreeMap::new();
    for (index, log) in logs.iter().enumerate() {
        let Some(log) = *log else { continue };
        sizes.entry(log.size_bytes()).or_default().push((index, log));
    }
    let mut result = vec![None; logs.len()];
    for (size, logs) in sizes.into_iter().filter(|(_, logs)| logs.len() > 1) {
        // Logs of one flight may all have one size, but differ early, at the first row with a time.
        let starts: Vec<u32> = logs.par_iter().map(|(_, log)| start_of(*log)).collect();
        let mut first: BTreeMap<u32, Vec<(usize, Held<'_>)>> = BTreeMap::new();
        for ((index, log), start) in logs.into_iter().zip(starts) {
            let alike = first.entry(start).or_default();
            match alike.iter().find(|(_, earlier)| are_same(*earlier, log, size)) {
                Some((earlier, _)) => result[index] = Some(*earlier),
                None => alike.push((index, log)),
            }
        }
    }
    result
}

/// Checksum of the beginning of a log.
fn start_of(log: Held<'_>) -> u32 {
    const START_BYTES: u64 = 1 << 18;
    let mut start = Vec::new();
    // What cannot be read differs from everything, and is named when it is read.
    let _ = log.reader().take(START_BYTES).read_to_end(&mut start);
    ap_crc32(&start)
}

/// Whether two files of `size` bytes are the same, byte by byte.
fn are_same(one: Held<'_>, other: Held<'_>, size: u64) -> bool {
    const PIECE_BYTES: u64 = 1 << 17;
    let (mut one, mut other) = (one.reader(), other.reader());
    let (mut left, mut right) = (Vec::new(), Vec::new());
    let mut same_bytes = 0;
    loop {
        for (log, piece) in [(&mut one, &mut left), (&mut other, &mut right)] {
            piece.clear();
            if log.take(PIECE_BYTES).read_to_end(piece).is_err() {
                return false;
            }
        }
        if left != right {
            return false;
        }
        if left.is_empty() {
            return same_bytes == size;
        }
        same_bytes += left.len() as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::{Held, Log, file_number, same_bytes};
    use std::path::Path;

    #[test]
    fn file_names_give_their_last_number() {
        for (name, number) in [
            ("07.BIN", Some(7)),
            ("logs/drone-12.bin", Some(12)),
            ("2026-05-01 drone 3.BIN", Some(3)),
            ("dröhne4ü.BIN", Some(4)),
            ("ladder-still.BIN", None),
            ("99999999.BIN", None),
            ("00000012.BIN", None),
        ] {
            assert_eq!(file_number(Path::new(name)), number, "{name}");
        }
    }

    #[test]
    fn copies_are_told_from_logs_of_the_same_size() {
        let long = |last: u8| Log::from_bytes([vec![7; 1 << 19], vec![last]].concat());
        let short = |text: &[u8]| Log::from_bytes(text.to_vec());
        let logs = [short(b"abc"), short(b"abd"), short(b"abc"), short(b"ab"), short(b"abc")];
        let more = [long(1), long(2), long(1)];
        let mut all: Vec<Option<Held<'_>>> =
            logs.iter().chain(&more).map(|log| Some(Held::Log(log))).collect();
        all.insert(3, None);
        assert_eq!(
            same_bytes(&all),
            [None, None, Some(0), None, None, Some(0), None, None, Some(6)]
        );
    }

    #[test]
    fn copies_of_tables_are_told_by_their_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let paths = [
            file("a.csv", "time\n1\n"),
            file("b.csv", "time\n2\n"),
            file("c.csv", "time\n1\n"),
            file("empty.csv", ""),
            folder.path().join("none.csv"),
        ];
        let mut tables: Vec<Option<Held<'_>>> =
            paths.iter().map(|path| Held::table(path)).collect();
        tables.push(tables[1]);
        assert_eq!(same_bytes(&tables), [None, None, Some(0), None, None, Some(1)]);
    }
}
