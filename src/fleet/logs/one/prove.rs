//! Proof that what came is what the drone has: by its checksum, or by pieces that are read again.
//! Only then does the file get its name.

use super::flight::Found;
use super::{Failure, MOST_ROUNDS, PullOne, SAMPLE_BYTES, SAMPLES, Stage};
use crate::fleet::ftp::FtpError;
use crate::fleet::ftp::get::Get;
use crate::fleet::ftp::sum::Sum;
use crate::fleet::logs::manifest::{ManifestEntry, Method, Verified};
use crate::fleet::logs::part::{PartFile, Sample, Sums, part_path};

impl PullOne {
    pub(super) fn compare(&mut self, mut part: PartFile, is_settled: bool) -> Stage {
        let sums = match part.sums(self.size) {
            Ok(sums) => sums,
            Err(error) => return self.fail(error.to_string(), "make room and run again"),
        };
        let Some(target) = &self.target else { return Stage::Over };
        if is_settled {
            let source = target.source.clone();
            let sum = Sum::new(self.caller.another(), &source, self.size, self.options.patience);
            return Stage::Sum(sum, part, sums);
        }
        self.sample(part, sums)
    }

    pub(super) fn sample(&mut self, part: PartFile, sums: Sums) -> Stage {
        let Some(target) = self.target.clone() else { return Stage::Over };
        let step = self.size / SAMPLES;
        let ranges: Vec<_> = (0..SAMPLES)
            .map(|index| index * step + step / 2)
            .map(|start| (start, start + SAMPLE_BYTES))
            .collect();
        match Sample::new(part.path(), self.size, &ranges) {
            Err(error) => self.fail(error.to_string(), "run again"),
            Ok(sample) if self.reason.is_none() => {
                let get =
                    Get::new(self.caller.another(), &target.source, sample, self.get_sample());
                Stage::Sample(Box::new(get), part, sums)
            }
            Ok(sample) => Stage::LogSample(Box::new(self.log_get(sample)), part, sums),
        }
    }

    pub(super) fn on_summed(
        &mut self,
        part: PartFile,
        sums: Sums,
        outcome: Result<u32, FtpError>,
    ) -> Stage {
        match outcome {
            Ok(sum) if sum == sums.crc32 => self.finish(part, sums, Verified::Checksum),
            // It may have grown between the list and the checksum.
            Ok(_) if self.rounds < MOST_ROUNDS => {
                self.rounds += 1;
                Stage::Settle(part)
            }
            Ok(_) => self.restart(part, "the checksum differs"),
            Err(error @ FtpError::Silent { .. }) => self.on_ftp_failed(part, error),
            Err(_) => self.sample(part, sums),
        }
    }

    pub(super) fn on_sampled(&mut self, part: PartFile, sums: Sums, differs: bool) -> Stage {
        if differs {
            return self.restart(part, "pieces that were read again differ");
        }
        self.finish(part, sums, Verified::Sample)
    }

    pub(super) fn finish(&mut self, part: PartFile, sums: Sums, verified: Verified) -> Stage {
        let Some(target) = self.target.take() else { return Stage::Over };
        let entry = ManifestEntry {
            file: target.file,
            slot: self.slot,
            drone: Some(self.drone),
            boot: Some(target.number),
            source: target.source,
            size_bytes: sums.size,
            sha256: sums.sha256,
            method: match &self.reason {
                Some(_) => Method::LogMessages,
                None if self.ways.is_mixed => Method::Mixed,
                None => Method::Mavftp,
            },
            method_reason: self.reason.clone(),
            verified,
            incomplete: self.incomplete.take(),
            attempts: self.attempts,
            at_unix_s: self.options.unix_s,
            flight: None,
        };
        self.attempts = 0;
        (self.held, self.size) = (0, 0);
        let (found, flight) = self.judge(&part_path(part.path()));
        let entry = ManifestEntry { flight, ..entry };
        if self.wants_flight() {
            match found {
                Found::Others { why, is_later } => return self.put_by(part, entry, &why, is_later),
                Found::Unknown(why) => {
                    self.done.failure.get_or_insert(Failure {
                        reason: format!("its log does not say which flight it belongs to: {why}"),
                        advice: "look at it (`updraft inspect`); it is kept as this flight's",
                        kept_bytes: entry.size_bytes,
                    });
                }
                Found::Ours => {}
            }
            self.targets.clear();
            self.not_it = None;
        }
        if let Err(reason) = self.clear_place(&entry) {
            return self
                .fail_for_sure(reason, "make the folder writable, or make room, and run again");
        }
        let set_aside = |mark| self.shelf.borrow().set_aside(&entry.file, mark);
        let aside = self.begun.mark().map_or(Ok(()), set_aside);
        let finished = aside.and_then(|()| self.shelf.borrow_mut().finish(part, entry.clone()));
        if let Err(error) = finished {
            let reason = format!("{error}: {}", error.source);
            return self.fail_for_sure(reason, "make room and run again");
        }
        if entry.incomplete.is_some() {
            self.done.failure.get_or_insert(Failure {
                reason: "its log still grows, and only its beginning has been downloaded"
                    .to_owned(),
                advice: "wait until 15 s after disarming (with LOG_DISARMED 1: reboot it), then \
                         run again",
                kept_bytes: entry.size_bytes,
            });
        }
        self.done.pulled.push(entry);
        self.next_target()
    }
}
