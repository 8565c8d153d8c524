//! Choice of a drone's logs to bring home, given those that are there.

use super::Puller;
use super::one::{One, Target, number};
use crate::fleet::logs::manifest::{AtHome, ManifestEntry, Method};
use crate::fleet::logs::one::Which;
use crate::skybrush_server::{Job, LogEntry};

impl One {
    /// The whole log at home, and its entry.
    fn intact(&self) -> Option<&ManifestEntry> {
        match &self.home {
            AtHome::Intact(entry) if entry.incomplete.is_none() => Some(entry),
            _ => None,
        }
    }

    /// Whether a start was written down that tells which log is wanted.
    pub(super) fn knows_start(&self) -> bool {
        self.flight.as_ref().is_some_and(|of| of.authorized_start.is_some())
    }

    fn has_flight_home(&self) -> bool {
        let of = |entry: &ManifestEntry| entry.flight.clone();
        let there = self.intact().and_then(of);
        there.is_some_and(|there| self.flight.as_ref().is_some_and(|wanted| there.is(wanted)))
    }
}

impl Puller<'_> {
    /// The drone does not say which logs it has: one of this flight that is home counts, but it is
    /// said that nobody has compared it.
    pub(super) fn not_listed(&self, one: &mut One, reason: &str) -> Option<Job> {
        if one.has_flight_home() && self.wish.which == Which::Flight && !self.wish.again {
            one.unchecked = Some(format!(
                "{} is here and belongs to this flight, but was not compared with the drone's: \
                 {reason}",
                one.file
            ));
            one.over = true;
            return None;
        }
        one.fail(reason)
    }

    /// Which of a drone's logs are to come.
    pub(super) fn choose(
        &mut self,
        drone: &str,
        one: &mut One,
        mut logs: Vec<LogEntry>,
    ) -> Option<Job> {
        // Numbers may begin anew; times are there once the autopilot had a clock.
        let have_times = logs.iter().all(|log| log.unix_s.is_some());
        logs.sort_by_key(|log| (log.unix_s.filter(|_| have_times), number(log)));
        let Some(newest) = logs.last().cloned() else {
            return one.fail("the server lists no ArduPilot log of it");
        };
        let known: Vec<String> = logs.iter().map(|log| log.id.clone()).collect();
        match self.wish.which {
            Which::Flight => return self.choose_of_flight(drone, one, logs, &newest),
            Which::Newest => logs.retain(|log| log.id == newest.id),
            Which::Number(wanted) => logs.retain(|log| number(log) == wanted),
            Which::All => {}
        }
        if logs.is_empty() {
            let known = known.join(", ");
            return one.fail(format!(
                "the drone has no such log, only {known}: choose one of these (--log)"
            ));
        }
        for log in logs {
            let is_of_slot = self.wish.which != Which::All || log.id == newest.id;
            let file = if is_of_slot { one.file.clone() } else { older(one, &log) };
            if self.wish.again || !self.is_there(&file, drone, &log) {
                self.add_target(one, file, log)?;
            }
        }
        one.next(drone)
    }

    /// The log of the flight: of its start, if one was written down; else the newest, unless an
    /// older one is home.
    fn choose_of_flight(
        &mut self,
        drone: &str,
        one: &mut One,
        mut logs: Vec<LogEntry>,
        newest: &LogEntry,
    ) -> Option<Job> {
        let again = self.wish.again;
        // Numbers of files and of the log messages, which the server has, differ.
        let of_messages = |method| matches!(method, Method::SkybrushServer | Method::LogMessages);
        if let Some(entry) = one.intact().cloned().filter(|_| !again) {
            let is_home = |log: &&LogEntry| {
                let number = entry.boot.filter(|_| of_messages(entry.method));
                number.map_or(log.size == entry.size_bytes, |it| it == self::number(log))
            };
            let found = logs.iter().find(is_home).cloned();
            let is_newest = found.as_ref().is_some_and(|log| log.id == newest.id);
            match found {
                Some(log) if one.knows_start() || is_newest => {
                    one.newer = (!is_newest).then(|| number(newest));
                    if log.size == entry.size_bytes {
                        return None;
                    }
                    // It has grown.
                    self.add_target(one, one.file.clone(), log)?;
                    return one.next(drone);
                }
                _ if one.has_flight_home() => {
                    one.newer = Some(number(newest));
                    one.unchecked = Some(format!(
                        "{} is here and belongs to this flight; the drone no longer has this \
                         log, or the server numbers it differently",
                        one.file
                    ));
                    return None;
                }
                _ if one.knows_start() => {}
                _ => {
                    let newest = number(newest);
                    return one.fail(format!(
                        "the drone has a newer log (number {newest}) than the one here, and no \
                         start was recorded that says which belongs to this flight: `--log \
                         newest` downloads it; the one here then moves to logs/flight-0"
                    ));
                }
            }
        }
        if !one.knows_start() {
            logs.retain(|log| log.id == newest.id);
        }
        // The newest first; the ones before it if that turns out to be of a later flight.
        for log in logs {
            if again || !self.is_known_to_be_others(one, drone, &log) {
                self.add_target(one, one.file.clone(), log)?;
            }
        }
        one.next(drone)
    }

    /// `None`: it is too large.
    fn add_target(&self, one: &mut One, file: String, log: LogEntry) -> Option<()> {
        if log.size > self.wish.most_bytes {
            one.fail(format!(
                "log {} has {} bytes, and at most {} are allowed; raise the limit (--max-size) \
                 if that is its real size",
                log.id, log.size, self.wish.most_bytes
            ));
            return None;
        }
        one.targets.push(Target { file, log, tries: 0 });
        Some(())
    }
}

/// Where a log goes that is not the slot's.
pub(super) fn older(one: &One, log: &LogEntry) -> String {
    format!("older/{}-{:08}.BIN", one.file.trim_end_matches(".BIN"), number(log))
}
