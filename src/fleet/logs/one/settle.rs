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
                "its heartbeats do not come, so it may be armed and its log grow".to_owned(),
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
                self.restart(part, "the log on the drone is smaller than what came of it")
            }
            // The log messages know no checksum.
            size => self.compare(part, size.is_some() && self.reason.is_none()),
        }
    }
}
