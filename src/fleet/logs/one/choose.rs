//! Choice of a drone's logs to bring home, and of the files that they go to.

use super::home::Needed;
use super::ways::Ways;
use super::{FTP_PATIENCE, Failure, PullOne, Stage, Target, Which};
use crate::base::file::create_folder;
use crate::fleet::ftp::FtpError;
use crate::fleet::ftp::list::Listed;
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::list::Entry;
use crate::fleet::logs::part::PartFile;
use crate::link::clock::S;
use crate::protocol::ftp::NakReason;

impl PullOne {
    pub(super) fn on_list(&mut self, outcome: Result<Vec<Listed>, FtpError>) -> Stage {
        let names = match outcome {
            Ok(names) => names,
            Err(FtpError::Refused { refusal: NakReason::FileNotFound, .. }) => {
                self.folder += 1;
                return match self.list(FTP_PATIENCE) {
                    Some(list) => Stage::List(list),
                    None => self.fall_back("MAVFTP shows no folder of logs".to_owned()),
                };
            }
            // A drone that is only just being switched on, or boots.
            Err(FtpError::Silent { .. }) if !self.is_heard() => {
                let heard = self.heartbeat.or(self.started).unwrap_or(self.now);
                let patience = match self.heartbeat {
                    Some(_) => self.options.patience,
                    None => self.options.wait,
                };
                if self.now >= heard + patience || self.is_excused() {
                    let seconds = self.now.saturating_sub(heard) / S;
                    return self.fail_silent(FtpError::Silent { seconds }.to_string());
                }
                return match self.list(FTP_PATIENCE) {
                    Some(list) => Stage::List(list),
                    None => Stage::Over,
                };
            }
            Err(error) => return self.fall_back(format!("MAVFTP: {error}")),
        };
        let Some(folder) = self.options.folders.get(self.folder) else { return Stage::Over };
        let mut logs: Vec<(u32, String, u64)> = names
            .into_iter()
            .filter_map(|listed| {
                let number = log_number(&listed.name)?;
                Some((number, format!("{folder}/{}", listed.name), listed.size?))
            })
            .collect();
        logs.sort();
        self.oldest = logs.first().map(|(number, ..)| *number);
        self.newest = logs.last().map(|(number, ..)| *number);
        self.choose(&logs)
    }

    pub(super) fn on_log_list(&mut self, outcome: Result<Vec<Entry>, LogProtocolError>) -> Stage {
        let advice = "run again; or import its card";
        match outcome {
            Ok(entries) => {
                // Firmware counts from the oldest log that is there, and on beyond the newest by
                // as many as were deleted: those have no bytes.
                let logs = entries.iter().filter(|entry| entry.size > 0);
                let logs: Vec<_> = logs
                    .map(|entry| (entry.id.into(), format!("log {}", entry.id), entry.size))
                    .collect();
                self.choose(&logs)
            }
            Err(error @ LogProtocolError::Silent { .. }) => {
                let ftp = self.reason.clone().unwrap_or_default();
                self.fail_silent(format!("{error} ({ftp})"))
            }
            Err(error) => self.fail(error.to_string(), advice),
        }
    }

    /// From logs in the order of their numbers.
    pub(super) fn choose(&mut self, logs: &[(u32, String, u64)]) -> Stage {
        let Some((newest, ..)) = logs.last() else {
            return self
                .fail("the drone has no logs".to_owned(), "check its card and LOG_BACKEND_TYPE");
        };
        let newest = *newest;
        // The log of this flight is home, or was: a later one is of another flight.
        let known = self.number_at_home();
        let known = known.filter(|known| logs.iter().any(|(number, ..)| number == known));
        if let Some(known) = known.filter(|known| *known < newest)
            && self.options.which == Which::Flight
        {
            self.done.newer = Some(newest);
            if self.flight.as_ref().is_none_or(|of| of.authorized_start.is_none()) {
                // The one at home is looked after all the same.
                self.done.failure.get_or_insert(Failure {
                    reason: format!(
                        "the drone has a newer log (number {newest}) than the one here (number \
                         {known}), and no start was recorded that says which belongs to this \
                         flight"
                    ),
                    advice: "`--log newest` downloads it; the one here then moves to logs/flight-0",
                    kept_bytes: 0,
                });
            }
        }
        if self.number_at_home().is_some() && known.is_none() && self.is_excused() {
            let why = "the drone no longer has this log".to_owned();
            self.leave(self.file.clone(), Some(why));
            return Stage::Over;
        }
        let wanted = |number: u32| match self.options.which {
            // Newest first; the ones before it if that turns out to be of a later flight.
            Which::Flight if self.wants_flight() => known.is_none_or(|known| number == known),
            Which::Flight => number == known.unwrap_or(newest),
            Which::Newest => number == newest,
            Which::Number(wanted) => number == wanted,
            Which::All => true,
        };
        let target = |(number, source, size): &(u32, String, u64)| Target {
            file: if self.options.which == Which::All && *number != newest {
                let stem = self.file.trim_end_matches(".BIN");
                format!("older/{stem}-{number:08}.BIN")
            } else {
                self.file.clone()
            },
            number: *number,
            source: source.clone(),
            size: *size,
        };
        let targets: Vec<Target> =
            logs.iter().filter(|(number, ..)| wanted(*number)).map(target).collect();
        if targets.is_empty() {
            let last = logs.iter().map(|(number, ..)| number.to_string()).collect::<Vec<_>>();
            let reason = format!("the drone has no such log, only {}", last.join(", "));
            return self.fail(reason, "choose one of these (--log)");
        }
        self.targets = targets;
        self.next_target()
    }

    pub(super) fn next_target(&mut self) -> Stage {
        let Some(target) = self.targets.pop() else {
            return match self.not_it.take() {
                Some(reason) => self.ends_without(reason),
                None => Stage::Over,
            };
        };
        let needed = self.needed(&target);
        if let Needed::Nothing(unchecked) = needed {
            self.leave(target.file, unchecked);
            if self.wants_flight() {
                return Stage::Over;
            }
            return self.next_target();
        }
        let beginning = self.beginning_of(&target.source, target.size);
        let path = self.shelf.borrow().path(&target.file);
        if target.size > self.options.most_size {
            let most = self.options.most_size;
            let error = FtpError::TooLarge { size: target.size, most };
            return self.fail(
                error.to_string(),
                "raise the limit (--max-size) if that is its \
                 real size",
            );
        }
        (self.rounds, self.restarts, self.grows) = (0, 0, None);
        self.ways = Ways::default();
        self.resize(target.size);
        self.is_outgrown |= self.begun.is_seeded();
        let identity = format!("drone={} source={}", self.drone, target.source);
        self.target = Some(target);
        let opened = path
            .parent()
            .map_or(Ok(()), create_folder)
            .and_then(|()| PartFile::open(&path, &identity))
            .map(|part| if self.options.is_durable { part } else { part.without_waiting() });
        let seeded = opened.and_then(|mut part| {
            if matches!(needed, Needed::Rest) {
                part.seed(&path)?;
            } else if let Some(beginning) = beginning {
                part.seed(&beginning)?;
            }
            Ok(part)
        });
        match seeded {
            Ok(part) => self.begin(part, true),
            Err(error) => {
                let reason = format!("{error}: {}", error.source);
                self.fail(reason, "make the folder writable, or make room, and run again")
            }
        }
    }
}

/// The number in a log's name: `00000012.BIN`.
fn log_number(name: &str) -> Option<u32> {
    let (stem, extension) = name.rsplit_once('.')?;
    let is_log = extension.eq_ignore_ascii_case("bin")
        && stem.len() <= 9
        && stem.bytes().all(|byte| byte.is_ascii_digit());
    if is_log { stem.parse().ok() } else { None }
}
