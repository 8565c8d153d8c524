//! Whether a log still grows. The firmware writes on while armed and for 15 s after it, its MAVFTP
//! serves the open file as it is, and the checksum of an open file is right for a moment: only a
//! log whose size stays, on a drone that says it is disarmed, can be whole.

use super::{FTP_PATIENCE, PullOne, Stage};
use crate::fleet::ftp::FtpError;
use crate::fleet::ftp::list::Listed;
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::list::{Entry, LogList};
use crate::fleet::logs::part::PartFile;
use crate::fleet::sink::Sink as _;
use crate::link::clock::{Micros, S};

/// A log has settled when its size stays the same for so long.
const SETTLED: Micros = 2 * S;
/// A log that grows is followed for so long (the firmware closes it 15 s after disarming); then
/// its beginning is taken, and called that.
const FOLLOWED: Micros = 20 * S;

impl PullOne {
    /// The drone's log has this size, since now.
    pub(super) fn resize(&mut self, size: u64) {
        self.size = size;
        self.sized = self.now;
    }

    /// All bytes came: when the list is asked for again; `None`: now.
    pub(super) fn settles(&self) -> Option<Micros> {
        let calm = self.sized + SETTLED;
        let says_disarmed = self.heartbeat.is_some_and(|at| at >= self.sized);
        let until = if says_disarmed { calm } else { calm.max(self.sized + FTP_PATIENCE) };
        (self.now < until).then_some(until)
    }

    /// Asks for its size again.
    pub(super) fn relist(&mut self, part: PartFile) -> Stage {
        if self.heartbeat.is_none_or(|at| at < self.sized) {
            self.held = part.have().total();
            return self.fail_silent(
                "no heartbeats arrive, so it may be armed and its log may be growing".to_owned(),
            );
        }
        if self.reason.is_some() {
            return Stage::LogRelist(LogList::new(self.drone, self.options.patience), part);
        }
        match self.list(self.options.patience) {
            Some(list) => Stage::Relist(list, part),
            None => self.compare(part, false),
        }
    }

    pub(super) fn on_relisted(
        &mut self,
        part: PartFile,
        outcome: Result<Vec<Listed>, FtpError>,
    ) -> Stage {
        let names = match outcome {
            Ok(names) => names,
            Err(error @ FtpError::Silent { .. }) => return self.on_ftp_failed(part, error),
            Err(_) => Vec::new(),
        };
        let Some(target) = &self.target else { return Stage::Over };
        let name = target.source.rsplit('/').next().unwrap_or_default();
        let size = names.iter().find(|listed| listed.name == name).and_then(|listed| listed.size);
        self.on_resized(part, size)
    }

    pub(super) fn on_log_relisted(
        &mut self,
        part: PartFile,
        outcome: Result<Vec<Entry>, LogProtocolError>,
    ) -> Stage {
        let entries = match outcome {
            Ok(entries) => entries,
            Err(error) => return self.on_log_failed(part, &error),
        };
        let Some(target) = &self.target else { return Stage::Over };
        let is_it = |entry: &&Entry| u32::from(entry.id) == target.number;
        let size = entries.iter().find(is_it).map(|entry| entry.size);
        self.on_resized(part, size)
    }

    /// Has it grown meanwhile?
    fn on_resized(&mut self, part: PartFile, size: Option<u64>) -> Stage {
        match size {
            Some(size) if size > self.size => {
                let since = *self.grows.get_or_insert(self.now);
                if self.now < since + FOLLOWED {
                    self.resize(size);
                    return self.begin(part, false);
                }
                self.incomplete = Some("the drone's log still grew when it came".to_owned());
                self.compare(part, false)
            }
            Some(size) if size < self.size => {
                self.resize(size);
                self.restart(part, "the log on the drone is smaller than what was downloaded of it")
            }
            // The log messages know no checksum.
            size => self.compare(part, size.is_some() && self.reason.is_none()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::path::Path;
    use std::rc::Rc;

    use super::super::{MOST_RESTARTS, MOST_ROUNDS, OneOptions, Target};
    use super::*;
    use crate::fleet::ftp::get::{Got, Tally};
    use crate::fleet::logs::manifest::Shelf;
    use crate::fleet::logs::part::sums_of;
    use crate::link::id::DroneId;

    const BYTES: u64 = 1_000;

    /// All bytes of a log have come; the drone said that it has so many.
    fn complete(folder: &Path) -> (PullOne, PartFile) {
        let shelf = Rc::new(RefCell::new(Shelf::open(folder, "updraft test").unwrap()));
        let drone = DroneId { network: 0, system: 1 };
        let mut one = PullOne::new(drone, 1, "01.BIN", shelf, OneOptions::default(), None);
        let source = "/APM/LOGS/00000002.BIN".to_owned();
        one.target = Some(Target { file: "01.BIN".to_owned(), number: 2, source, size: BYTES });
        one.size = BYTES;
        let mut part = PartFile::open(&folder.join("01.BIN"), "drone=1").unwrap();
        part.put(0, 0, &[7; BYTES as usize]).unwrap();
        (one, part)
    }

    #[test]
    fn a_log_that_has_shrunk_is_another_and_nothing_of_it_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, part) = complete(folder.path());
        let stage = one.on_resized(part, Some(BYTES - 1));
        assert!(!matches!(stage, Stage::Sum(..) | Stage::Sample(..)), "{stage:?}");
        assert_eq!((one.restarts, one.held, one.size), (1, 0, BYTES - 1));
    }

    #[test]
    fn so_is_one_that_is_smaller_than_what_an_earlier_run_has_brought() {
        let folder = tempfile::tempdir().unwrap();
        for (size, restarts, held) in [(BYTES, 0, BYTES), (BYTES - 1, 1, 0)] {
            let (mut one, part) = complete(folder.path());
            one.size = size;
            one.begin(part, true);
            assert_eq!((one.restarts, one.held), (restarts, held));
        }
    }

    #[test]
    fn one_that_goes_on_shrinking_is_given_up() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, part) = complete(folder.path());
        one.reason = Some("no MAVFTP".to_owned());
        one.restarts = MOST_RESTARTS;
        let stage = one.on_resized(part, Some(BYTES - 1));
        assert!(matches!(stage, Stage::Over), "{stage:?}");
        let failure = one.done.failure.unwrap();
        assert!(failure.reason.contains("smaller than"), "{failure:?}");
    }

    #[test]
    fn one_that_has_grown_is_continued_for_a_while_and_then_called_a_beginning() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, part) = complete(folder.path());
        one.now = 5 * S;
        let stage = one.on_resized(part, Some(BYTES + 1));
        assert!(!matches!(stage, Stage::Sum(..) | Stage::Sample(..)), "{stage:?}");
        assert_eq!((one.restarts, one.held, one.size), (0, BYTES, BYTES + 1));
        drop(stage);
        let (_, part) = complete(folder.path());
        one.now = 5 * S + FOLLOWED;
        let stage = one.on_resized(part, Some(BYTES + 2));
        assert!(matches!(stage, Stage::Sample(..)), "its checksum is right for a moment only");
        assert!(one.incomplete.is_some());
    }

    #[test]
    fn one_that_stays_is_proved_by_its_checksum() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, part) = complete(folder.path());
        let stage = one.on_resized(part, Some(BYTES));
        assert!(matches!(stage, Stage::Sum(..)), "{stage:?}");
        drop(stage);
        let (mut one, part) = complete(folder.path());
        let stage = one.on_resized(part, None);
        assert!(
            matches!(stage, Stage::Sample(..)),
            "a file that is not listed has none: {stage:?}"
        );
    }

    #[test]
    fn another_checksum_is_asked_for_again_and_then_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, mut part) = complete(folder.path());
        let sums = sums_of(&[7; BYTES as usize]);
        for round in 1..=MOST_ROUNDS {
            let stage = one.on_summed(part, sums.clone(), Ok(sums.crc32 ^ 1));
            let Stage::Settle(same) = stage else { panic!("{stage:?}") };
            assert_eq!((one.rounds, one.restarts), (round, 0));
            part = same;
        }
        drop(one.on_summed(part, sums.clone(), Ok(sums.crc32 ^ 1)));
        assert_eq!((one.restarts, one.held), (1, 0));
        assert!(one.done.pulled.is_empty());
    }

    #[test]
    fn only_a_calm_log_of_a_drone_that_says_it_is_disarmed_settles() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, part) = complete(folder.path());
        one.now = 10 * S;
        one.resize(BYTES);
        one.heartbeat = Some(10 * S);
        assert_eq!(one.settles(), Some(10 * S + SETTLED));
        one.now = 10 * S + SETTLED;
        assert_eq!(one.settles(), None);
        one.heartbeat = Some(10 * S - 1);
        assert_eq!(one.settles(), Some(10 * S + FTP_PATIENCE), "it may have been armed since");
        let stage = one.relist(part);
        assert!(matches!(stage, Stage::Over), "{stage:?}");
        assert!(one.done.failure.unwrap().reason.contains("heartbeats"));
    }

    #[test]
    fn a_log_that_was_opened_again_has_taken_so_many_attempts_more() {
        let folder = tempfile::tempdir().unwrap();
        let (mut one, sink) = complete(folder.path());
        one.attempts = 1;
        let tally = Tally { opened: 4, new_bytes: BYTES, ..Tally::default() };
        let stage = one.on_got(Got { sink, result: Ok(BYTES), tally });
        assert!(matches!(stage, Stage::Settle(_)), "{stage:?}");
        assert_eq!((one.attempts, one.held), (4, BYTES));
    }
}
