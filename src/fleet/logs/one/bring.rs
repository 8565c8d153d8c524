//! Transfer of a log's bytes: continued where an earlier run ended, begun anew when it is another
//! log, by MAVFTP or by the log messages.

use super::home::Begun;
use super::ways::MUTE;
use super::{MOST_RESTARTS, PullOne, SAMPLE_BYTES, Stage};
use crate::fleet::ftp::FtpError;
use crate::fleet::ftp::get::{Get, GetOptions, Got};
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::get::{LogGet, LogGot};
use crate::fleet::logs::part::{PartFile, Sample};
use crate::fleet::sink::Sink;

impl PullOne {
    /// Downloads what the part lacks; a part of an earlier run is looked at first.
    pub(super) fn begin(&mut self, part: PartFile, looks: bool) -> Stage {
        self.attempts += 1;
        self.held = part.have().total();
        let is_shrunk = part.have().end() > self.size;
        if is_shrunk {
            return self.restart(
                part,
                "the log on the drone is smaller than what was downloaded \
                                       of it",
            );
        }
        let Some(target) = self.target.clone() else { return Stage::Over };
        if looks && part.have().total() > 0 {
            let last = part.have().iter().last().unwrap_or_default();
            let first = part.have().iter().next().unwrap_or_default();
            let tail =
                |(start, end): (u64, u64)| (end.saturating_sub(SAMPLE_BYTES).max(start), end);
            return match Sample::new(part.path(), self.size, &[tail(first), tail(last)]) {
                Err(error) => self.fail(error.to_string(), "run again"),
                Ok(sample) if self.reason.is_none() => {
                    let get =
                        Get::new(self.caller.another(), &target.source, sample, self.get_sample());
                    Stage::Probe(Box::new(get), part)
                }
                Ok(sample) => Stage::LogProbe(Box::new(self.log_get(sample)), part),
            };
        }
        self.bring(part)
    }

    pub(super) fn get(&self) -> GetOptions {
        GetOptions {
            patience: self.options.patience,
            most_size: self.options.most_size,
            budget: self.budget.clone(),
            spacing: self.spacing(),
            ..GetOptions::default()
        }
    }

    /// To look at a sample.
    pub(super) fn get_sample(&self) -> GetOptions {
        GetOptions { up_to: self.size, ..self.get() }
    }

    pub(super) fn log_get<S: Sink>(&self, sink: S) -> LogGet<S> {
        let number = self.target.as_ref().map_or(0, |target| target.number) as u16;
        let (id, patience) = match self.ways.id {
            Some(id) => (id, self.options.patience.min(MUTE)),
            None => (number, self.options.patience),
        };
        LogGet::new(self.drone, id, self.size, sink, patience)
            .with_budget(self.budget.clone())
            .with_rtt(self.caller.rtt())
            .on_link(self.load.as_ref())
    }

    /// The part is of another file.
    pub(super) fn restart(&mut self, mut part: PartFile, why: &str) -> Stage {
        self.restarts += 1;
        if self.begun.is_seeded() {
            self.begun = Begun::Anew;
        }
        if self.restarts > MOST_RESTARTS {
            if self.reason.is_none() {
                return self.fall_back(format!("MAVFTP: {why}, {} times", self.restarts));
            }
            return self.fail(
                format!("{why}, {} times", self.restarts),
                "wait until the drone has closed its log (15 s after disarming) and run again",
            );
        }
        match part.clear() {
            Ok(()) => {
                self.rounds = 0;
                // What it was by the log messages may have been another log.
                self.close_log_messages();
                self.begin(part, false)
            }
            Err(error) => self.fail(error.to_string(), "make room and run again"),
        }
    }

    pub(super) fn on_probed(
        &mut self,
        part: PartFile,
        sample: &Sample,
        result: Result<u64, FtpError>,
    ) -> Stage {
        match result {
            _ if sample.differs => self.on_another(part),
            Ok(_) => self.begin(part, false),
            Err(FtpError::Changed { .. }) => {
                self.restart(part, "the log on the drone is smaller than what was downloaded of it")
            }
            Err(error) => self.on_ftp_failed(part, error),
        }
    }

    pub(super) fn on_ftp_failed(&mut self, mut part: PartFile, error: FtpError) -> Stage {
        if let Err(error) = part.sync() {
            return self.fail(error.to_string(), "make room and run again");
        }
        self.held = part.have().total();
        match error {
            FtpError::Silent { .. } => self.fail_silent(error.to_string()),
            FtpError::Sink(reason) => self.fail(reason, "make room and run again"),
            FtpError::Changed { .. } => {
                self.restart(part, "the log on the drone is smaller than what was downloaded of it")
            }
            FtpError::TooLarge { .. } => self
                .fail(error.to_string(), "raise the limit (--max-size) if that is its real size"),
            error => self.fall_back(format!("MAVFTP: {error}")),
        }
    }

    pub(super) fn on_got(&mut self, got: Got<PartFile>) -> Stage {
        self.tally.new_bytes += got.tally.new_bytes;
        self.attempts += got.tally.opened.saturating_sub(1) as u32;
        let part = got.sink;
        match got.result {
            Err(FtpError::Paused) => self.bring(part),
            Err(error) => self.on_ftp_failed(part, error),
            Ok(size) => {
                self.held = part.have().total();
                if size != self.size {
                    self.resize(size);
                }
                Stage::Settle(part)
            }
        }
    }

    pub(super) fn on_log_failed(&mut self, mut part: PartFile, error: &LogProtocolError) -> Stage {
        let _ = part.sync();
        self.held = part.have().total();
        match error {
            LogProtocolError::Silent { .. } => self.fail_silent(error.to_string()),
            LogProtocolError::Sink(reason) => self.fail(reason.clone(), "make room and run again"),
            _ => self.fail(error.to_string(), "run again; or import its card"),
        }
    }

    pub(super) fn on_log_got(&mut self, got: LogGot<PartFile>) -> Stage {
        self.tally.new_bytes += got.tally.new_bytes;
        match got.result {
            Ok(_) => {
                self.held = got.sink.have().total();
                Stage::Settle(got.sink)
            }
            Err(LogProtocolError::Paused) => self.bring(got.sink),
            // MAVFTP goes on, and finds out whether the drone is there at all.
            Err(error) if self.reason.is_none() && !matches!(error, LogProtocolError::Sink(_)) => {
                self.close_log_messages();
                self.bring(got.sink)
            }
            Err(error) => self.on_log_failed(got.sink, &error),
        }
    }
}
