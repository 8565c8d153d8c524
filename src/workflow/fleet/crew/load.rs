//! Loading of drones before a flight: parameters, show, fence.

use std::collections::BTreeMap;

use super::{AT_ONCE, Crew};
use crate::base::crc::ap_crc32;
use crate::base::file::read_whole;
use crate::fleet::changes::{Change, Changes};
use crate::fleet::fence::{Fence, fence_of};
use crate::fleet::ftp::Caller;
use crate::fleet::ftp::sum::Sum;
use crate::fleet::preflight::by_reason;
use crate::fleet::required::{CheckParams, requirements};
use crate::fleet::telemetry::Drone;
use crate::fleet::upload::{ShowLoad, Upload};
use crate::link::clock::{MS, Micros, S};
use crate::link::id::DroneId;
use crate::live::view::Step;
use crate::protocol::show::SHOW_FILE;
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::links::run_number;
use crate::workflow::words;

/// Virtual drones have set their flags by then, and no radio holds older packets back.
const SETTLE_VIRTUAL: Micros = 100 * MS;
/// Uploads at once per network.
const UPLOADS_AT_ONCE: usize = 16;
/// Largest show file, bytes.
pub(super) const MOST_SKYB: u64 = 1 << 20;

impl Crew<'_> {
    /// Reads the required parameters, and mends them if allowed. Whether they are right.
    pub(crate) fn params(&mut self, may_change: bool) -> Result<bool, WorkflowError> {
        self.step(Step::Parameters, "Waiting for every drone's parameters");
        // Who flies, or may be flying, keeps what it has.
        let in_the_air = self.net.in_the_air(self.drones(), true);
        let conversations = self
            .drones()
            .into_iter()
            .map(|drone| {
                let may_change = may_change && !in_the_air.contains_key(&drone);
                let show = self.telemetry.get(drone).and_then(Drone::has_show_firmware);
                let by_show = show.unwrap_or(true) && !self.is_guided;
                let required = requirements(self.plan, by_show);
                (drone, CheckParams::new(drone, required, may_change))
            })
            .collect();
        let standings = self.all(conversations, AT_ONCE)?;
        let mut changes =
            if self.is_virtual { Changes::default() } else { Changes::read(&self.folder.0)? };
        let (mut changed, mut wrong) = (0, 0);
        for (drone, standing) in &standings {
            changes.add(*drone, &standing.changed);
            changed += standing.changed.len();
            wrong += usize::from(!standing.is_right());
        }
        if changed > 0 && !self.is_virtual {
            changes.write(&self.folder.0)?;
            self.host.say(&format!(
                "Changed {} on {}; `updraft fleet restore` restores the old values",
                words::count(changed, "parameter"),
                words::count(
                    standings.values().filter(|standing| !standing.changed.is_empty()).count(),
                    "drone"
                )
            ));
        }
        let mut unset = BTreeMap::new();
        for drone in self.drones() {
            match standings.get(&drone) {
                Some(standing) if may_change && !standing.is_right() => {
                    let complaint = match in_the_air.get(&drone) {
                        Some(words) => format!("it {words}, so no parameter was set"),
                        None => standing.complaint(),
                    };
                    unset.insert(drone, complaint);
                }
                Some(_) => {}
                None => {
                    wrong += 1;
                    let held = self.held.get(&drone).map(|why| format!(", as {why}"));
                    let text = format!("its parameters were not read{}", held.unwrap_or_default());
                    unset.insert(drone, text);
                }
            }
        }
        let slot_of = |drone: &DroneId| self.table.slot_of(*drone).unwrap_or(0);
        let complaints = unset
            .iter()
            .map(|(drone, complaint)| (drone.to_string(), slot_of(drone), complaint.as_str()));
        for line in by_reason(&complaints.collect::<Vec<_>>()) {
            self.host.warn(&line);
        }
        if may_change {
            let fine = |drone: &DroneId| {
                let changed = standings.get(drone).map_or(&[][..], |of| &of.changed);
                let one = |of: &Change| format!("{} {} -> {}", of.name, of.was, of.now);
                let all: Vec<String> = changed.iter().map(one).collect();
                if all.is_empty() { "right".to_owned() } else { format!("set: {}", all.join(", ")) }
            };
            let outcomes = self.outcomes_of(fine, &unset);
            self.note_each("parameters", None, &outcomes)?;
        }
        self.known.params.extend(standings);
        if wrong > 0 && !may_change {
            self.host.warn(&format!(
                "{} parameters with wrong values; --set-params lets this program set them",
                if wrong == 1 { "1 drone has".to_owned() } else { format!("{wrong} drones have") }
            ));
        }
        Ok(wrong == 0)
    }

    /// What is put on a drone.
    fn load(&self, slot: u16, fence: &Fence) -> Result<ShowLoad, WorkflowError> {
        let path = self.folder.skyb(slot, self.plan.slots.len());
        let skyb = read_whole(&path, MOST_SKYB)?;
        Ok(ShowLoad { skyb, site: self.plan.site, fence: fence.clone() })
    }

    /// The plan's fence as drones get it.
    pub(crate) fn fence(&self) -> Result<Fence, WorkflowError> {
        fence_of(self.plan, &self.show).map_err(|error| WorkflowError::Usage(error.to_string()))
    }

    /// The upload of each drone of the table.
    pub(crate) fn uploads(&self) -> Result<BTreeMap<DroneId, Upload>, WorkflowError> {
        let fence = self.fence()?;
        let number = run_number(self.host);
        self.table
            .drones
            .iter()
            .map(|line| {
                let load = self.load(line.slot, &fence)?;
                let upload = Upload::new(line.drone, load, number);
                let upload = if self.is_virtual { upload.settling(SETTLE_VIRTUAL) } else { upload };
                Ok((line.drone, upload))
            })
            .collect()
    }

    /// Loads the show onto every drone. The drones that refused, with their reasons.
    pub(crate) fn upload(&mut self) -> Result<BTreeMap<DroneId, String>, WorkflowError> {
        self.step(
            Step::Uploading,
            "Waiting for every drone to take its show, origin and fence, and to read them back",
        );
        let mut refused = self.remember_fence()?;
        let mut uploads = self.uploads()?;
        let count = uploads.len();
        uploads.retain(|drone, _| !refused.contains_key(drone));
        // Virtual drones share no radio.
        let at_once = if self.is_virtual { AT_ONCE } else { UPLOADS_AT_ONCE };
        let done = self.all(uploads, at_once)?;
        let mut written = std::collections::BTreeSet::new();
        for drone in self.drones() {
            if let Some(why) = self.held.get(&drone).filter(|_| !done.contains_key(&drone)) {
                refused.entry(drone).or_insert_with(|| why.clone());
            }
        }
        let mut failed = BTreeMap::new();
        for (drone, outcome) in done {
            match outcome {
                Ok(loaded) => {
                    if loaded.written {
                        written.insert(drone);
                    }
                    self.known.loaded.insert(drone);
                    self.known.fenced.insert(drone);
                }
                Err(error) => {
                    failed.insert(drone, error.to_string());
                }
            }
        }
        let slot_of = |drone: &DroneId| self.table.slot_of(*drone).unwrap_or(0);
        let reasons =
            failed.iter().map(|(drone, why)| (drone.to_string(), slot_of(drone), why.as_str()));
        for line in by_reason(&reasons.collect::<Vec<_>>()) {
            self.host.warn(&line);
        }
        refused.extend(failed);
        if !self.is_virtual {
            self.host.say(&loaded(count - refused.len(), count, written.len()));
        }
        let fine = |drone: &DroneId| {
            let file = if written.contains(drone) { "file written" } else { "file was there" };
            format!("loaded: {file}, fence set and read back")
        };
        let outcomes = self.outcomes_of(fine, &refused);
        self.note_each("upload", Some(format!("{} refused", refused.len())), &outcomes)?;
        Ok(refused)
    }

    /// For steps that follow an earlier upload: whether each drone's show file is the planned one.
    pub(crate) fn look_at_files(&mut self) -> Result<(), WorkflowError> {
        let (count, number) = (self.plan.slots.len(), run_number(self.host));
        let mut wanted = BTreeMap::new();
        let mut conversations = BTreeMap::new();
        for line in &self.table.drones {
            let file = read_whole(&self.folder.skyb(line.slot, count), MOST_SKYB)?;
            wanted.insert(line.drone, ap_crc32(&file));
            let caller = Caller::new(line.drone, number);
            let sum = Sum::new(caller, SHOW_FILE, file.len() as u64, 10 * S);
            conversations.insert(line.drone, sum);
        }
        let found = self.all(conversations, AT_ONCE)?;
        let same = found.into_iter().filter(|(drone, sum)| sum.as_ref().ok() == wanted.get(drone));
        let same: Vec<DroneId> = same.map(|(drone, _)| drone).collect();
        self.known.loaded.extend(same.iter().copied());
        self.known.fenced.extend(same);
        Ok(())
    }
}

/// How many drones have the show now, and how many had it before.
fn loaded(loaded: usize, count: usize, written: usize) -> String {
    let how = match (written, loaded - written.min(loaded)) {
        (_, 0) => "",
        (0, _) => " (they already had the file)",
        (_, 1) => " (1 of them already had the file)",
        (_, had) => {
            return format!(
                "Loaded {loaded} of {count} drones ({had} of them already had the file)"
            );
        }
    };
    format!("Loaded {loaded} of {count} drones{how}")
}

#[cfg(test)]
mod tests {
    use super::loaded;

    #[test]
    fn who_had_the_file_is_said_where_there_is_somebody() {
        assert_eq!(loaded(0, 2, 0), "Loaded 0 of 2 drones");
        assert_eq!(loaded(2, 2, 2), "Loaded 2 of 2 drones");
        assert_eq!(loaded(2, 2, 0), "Loaded 2 of 2 drones (they already had the file)");
        assert_eq!(loaded(3, 4, 2), "Loaded 3 of 4 drones (1 of them already had the file)");
        assert_eq!(loaded(9, 9, 4), "Loaded 9 of 9 drones (5 of them already had the file)");
    }
}
