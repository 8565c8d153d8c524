//! One drone's logs: list, download, compare, give the file its name.

use std::cell::RefCell;
use std::rc::Rc;

use super::manifest::{ManifestEntry, Method, Shelf, Verified};
use super::part::{PartFile, Sample, Sums};
use crate::base::file::create_folder;
use crate::fleet::budget::Budget;
use crate::fleet::ftp::get::{Get, GetOptions, Got, Tally};
use crate::fleet::ftp::list::{List, Listed};
use crate::fleet::ftp::sum::Sum;
use crate::fleet::ftp::{Caller, FtpError};
use crate::fleet::log_protocol::LogProtocolError;
use crate::fleet::log_protocol::get::{LogGet, LogGot};
use crate::fleet::log_protocol::list::{Entry, LogList};
use crate::fleet::sink::Sink;
use crate::link::clock::{Micros, S};
use crate::link::drive::{Machine, Progress, Step};
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::protocol::ftp::Refusal;

/// MAVFTP is given up for the log messages when a drone that is heard does not answer for so
/// long.
const FTP_PATIENCE: Micros = 12 * S;
/// A drone whose last heartbeat is older is not heard.
const HEARD: Micros = 4 * S;
/// A log that still grows is continued so often; then what was listed is taken.
const MOST_ROUNDS: u32 = 3;
/// A log that turns out to be another is begun anew so often.
const MOST_RESTARTS: u32 = 3;
/// Pieces that are compared when there is no checksum, and the bytes of each.
const SAMPLES: u64 = 8;
const SAMPLE_BYTES: u64 = 90;

/// Which of a drone's logs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Which {
    /// The newest.
    Newest,
    /// The one of this number.
    Number(u32),
    /// All; the newest becomes the slot's log, the others go to `older/`.
    All,
}

/// How logs are brought home.
#[derive(Clone, Debug)]
pub struct OneOptions {
    /// Which of a drone's logs.
    pub which: Which,
    /// A drone is given up after so long without an answer.
    pub patience: Micros,
    /// Larger logs are refused, bytes.
    pub most_size: u64,
    /// Folders of logs, as autopilots name them; the first that is there is taken.
    pub folders: Vec<String>,
    /// Brings a log again that is there.
    pub again: bool,
    /// Waits for the disk, so that a power loss loses little; needless for logs that can be had
    /// again at any time.
    pub is_durable: bool,
    /// Differs from run to run.
    pub start_number: u32,
    /// For the manifest, Unix seconds.
    pub unix_s: u64,
}

impl Default for OneOptions {
    fn default() -> Self {
        Self {
            which: Which::Newest,
            patience: 60 * S,
            most_size: 2 << 30,
            folders: vec!["/APM/LOGS".to_owned(), "logs".to_owned()],
            again: false,
            is_durable: true,
            start_number: 0,
            unix_s: 0,
        }
    }
}

/// Why a drone's log is not home.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What went wrong.
    pub reason: String,
    /// What to do.
    pub advice: &'static str,
    /// Bytes that came and are kept for the next run.
    pub kept_bytes: u64,
}

/// What became of a drone's logs.
#[derive(Clone, Debug, Default)]
pub struct OneDone {
    /// Brought home now.
    pub pulled: Vec<ManifestEntry>,
    /// There already: file names.
    pub there: Vec<String>,
    /// Why not all.
    pub failure: Option<Failure>,
}

/// One log to bring.
#[derive(Clone, Debug)]
struct Target {
    file: String,
    /// Number of the log: of the file's name, or the id.
    number: u32,
    /// Its path, or `log N`.
    source: String,
    size: u64,
}

/// Brings one drone's logs home.
#[derive(Debug)]
pub struct PullOne {
    drone: DroneId,
    slot: u16,
    /// The slot's file name.
    file: String,
    options: OneOptions,
    budget: Option<Budget>,
    shelf: Rc<RefCell<Shelf>>,
    caller: Caller,
    stage: Stage,
    folder: usize,
    targets: Vec<Target>,
    target: Option<Target>,
    size: u64,
    rounds: u32,
    restarts: u32,
    attempts: u32,
    /// Why not MAVFTP.
    reason: Option<String>,
    heartbeat: Option<Micros>,
    started: Option<Micros>,
    now: Micros,
    tally: Tally,
    done: OneDone,
    held: u64,
}

#[derive(Debug)]
enum Stage {
    Start,
    List(List),
    /// A part of an earlier run: is it of the same file?
    Probe(Box<Get<Sample>>, PartFile),
    Get(Box<Get<PartFile>>),
    Relist(List, PartFile),
    Sum(Sum, PartFile, Sums),
    Sample(Box<Get<Sample>>, PartFile, Sums),
    LogList(LogList),
    LogProbe(Box<LogGet<Sample>>, PartFile),
    LogGet(Box<LogGet<PartFile>>),
    LogSample(Box<LogGet<Sample>>, PartFile, Sums),
    Over,
}

/// What a stage wants: a step of the link's, or it is over and another follows.
enum Next {
    Step(Step<OneDone>),
    Go(Box<Stage>),
}

impl PullOne {
    /// Brings logs of `drone` into the shelf's file `file`.
    pub fn new(
        drone: DroneId,
        slot: u16,
        file: &str,
        shelf: Rc<RefCell<Shelf>>,
        options: OneOptions,
        budget: Option<Budget>,
    ) -> Self {
        let number = options.start_number ^ (u32::from(drone.system) << 20);
        Self {
            drone,
            slot,
            file: file.to_owned(),
            budget,
            shelf,
            caller: Caller::new(drone, number),
            stage: Stage::Start,
            folder: 0,
            targets: Vec::new(),
            target: None,
            size: 0,
            rounds: 0,
            restarts: 0,
            attempts: 0,
            reason: None,
            heartbeat: None,
            started: None,
            now: 0,
            tally: Tally::default(),
            done: OneDone::default(),
            held: 0,
            options,
        }
    }

    /// New bytes so far.
    pub fn new_bytes(&self) -> u64 {
        let now = match &self.stage {
            Stage::Get(get) => get.tally().new_bytes,
            Stage::LogGet(get) => get.tally().new_bytes,
            _ => 0,
        };
        self.tally.new_bytes + now
    }

    /// When something of use was heard last.
    pub fn heard(&self) -> Option<Micros> {
        let now = match &self.stage {
            Stage::Get(get) => get.heard(),
            Stage::LogGet(get) => get.heard(),
            _ => None,
        };
        now.max(self.heartbeat)
    }

    fn fail(&mut self, reason: String, advice: &'static str) -> Stage {
        let kept_bytes = self.held;
        self.done.failure.get_or_insert(Failure { reason, advice, kept_bytes });
        Stage::Over
    }

    fn fail_silent(&mut self, reason: String) -> Stage {
        self.fail(
            reason,
            "switch it on and bring it within reach, then run again; or take its card and import",
        )
    }

    /// Whether its heartbeats come.
    fn is_heard(&self) -> bool {
        self.heartbeat.is_some_and(|at| self.now < at + HEARD)
    }

    fn list(&self, patience: Micros) -> Option<List> {
        let folder = self.options.folders.get(self.folder)?;
        Some(List::new(self.caller.another(), folder, patience))
    }

    /// By the log messages instead.
    fn fall_back(&mut self, reason: String) -> Stage {
        if self.reason.is_some() {
            return self.fail(reason, "run again; or take its card and import");
        }
        self.reason = Some(reason);
        self.targets.clear();
        self.target = None;
        Stage::LogList(LogList::new(self.drone, self.options.patience))
    }

    fn start(&mut self) -> Stage {
        let there = {
            let shelf = self.shelf.borrow();
            let path = shelf.path(&self.file);
            let size = std::fs::metadata(&path).map(|about| about.len()).ok();
            match (shelf.entry(&self.file), size) {
                (Some(entry), Some(size)) if entry.size_bytes == size => {
                    Some(match self.options.which {
                        Which::Newest => true,
                        Which::Number(number) => entry.boot == Some(number),
                        Which::All => false,
                    })
                }
                (None, Some(_)) => None,
                _ => Some(false),
            }
        };
        match there {
            _ if self.options.again => {}
            Some(true) => {
                self.done.there.push(self.file.clone());
                return Stage::Over;
            }
            Some(false) => {}
            None => {
                return self.fail(
                    format!("{} is there, but the manifest does not know it", self.file),
                    "move the file away, or bring the log again in its place (--again)",
                );
            }
        }
        match self.list(FTP_PATIENCE) {
            Some(list) => Stage::List(list),
            None => self.fall_back("no folder to look into".to_owned()),
        }
    }

    fn on_list(&mut self, outcome: Result<Vec<Listed>, FtpError>) -> Stage {
        let names = match outcome {
            Ok(names) => names,
            Err(FtpError::Refused { refusal: Refusal::FileNotFound, .. }) => {
                self.folder += 1;
                return match self.list(FTP_PATIENCE) {
                    Some(list) => Stage::List(list),
                    None => self.fall_back("MAVFTP shows no folder of logs".to_owned()),
                };
            }
            // A drone that is only just being switched on, or boots.
            Err(FtpError::Silent { .. }) if !self.is_heard() => {
                let heard = self.heartbeat.or(self.started).unwrap_or(self.now);
                if self.now >= heard + self.options.patience {
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
        self.choose(&logs)
    }

    fn on_log_list(&mut self, outcome: Result<Vec<Entry>, LogProtocolError>) -> Stage {
        let advice = "run again; or take its card and import";
        match outcome {
            Ok(entries) => {
                let logs = entries.iter();
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
    fn choose(&mut self, logs: &[(u32, String, u64)]) -> Stage {
        let Some((newest, ..)) = logs.last() else {
            return self
                .fail("the drone has no logs".to_owned(), "check its card and LOG_BACKEND_TYPE");
        };
        let newest = *newest;
        let wanted = |number: u32| match self.options.which {
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
            return self.fail(reason, "choose one of them (--log)");
        }
        self.targets = targets;
        self.next_target()
    }

    fn next_target(&mut self) -> Stage {
        let Some(target) = self.targets.pop() else { return Stage::Over };
        let (path, is_there) = {
            let shelf = self.shelf.borrow();
            let path = shelf.path(&target.file);
            let is_there = shelf.entry(&target.file).is_some_and(|entry| {
                entry.source == target.source
                    && std::fs::metadata(&path).is_ok_and(|about| about.len() == entry.size_bytes)
            });
            (path, is_there)
        };
        if is_there && !self.options.again {
            self.done.there.push(target.file);
            return self.next_target();
        }
        if target.size > self.options.most_size {
            let most = self.options.most_size;
            let error = FtpError::TooLarge { size: target.size, most };
            return self.fail(error.to_string(), "allow more (--max-size), if that is its size");
        }
        (self.size, self.rounds, self.restarts) = (target.size, 0, 0);
        let identity = format!("drone={} source={}", self.drone, target.source);
        self.target = Some(target);
        let opened = path
            .parent()
            .map_or(Ok(()), create_folder)
            .and_then(|()| PartFile::open(&path, &identity))
            .map(|part| if self.options.is_durable { part } else { part.without_waiting() });
        match opened {
            Ok(part) => self.begin(part, true),
            Err(error) => {
                let reason = format!("{error}: {}", error.source);
                self.fail(reason, "make the folder writable, or make room, and run again")
            }
        }
    }

    /// Downloads what the part lacks; a part of an earlier run is looked at first.
    fn begin(&mut self, part: PartFile, looks: bool) -> Stage {
        self.attempts += 1;
        self.held = part.have().total();
        let is_shrunk = part.have().end() > self.size;
        if is_shrunk {
            return self.restart(part, "the log on the drone is smaller than what came of it");
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
        if self.reason.is_none() {
            let get = Get::new(self.caller.another(), &target.source, part, self.get());
            Stage::Get(Box::new(get))
        } else {
            Stage::LogGet(Box::new(self.log_get(part)))
        }
    }

    fn get(&self) -> GetOptions {
        GetOptions {
            patience: self.options.patience,
            most_size: self.options.most_size,
            budget: self.budget.clone(),
            ..GetOptions::default()
        }
    }

    /// To look at a sample.
    fn get_sample(&self) -> GetOptions {
        GetOptions { up_to: self.size, ..self.get() }
    }

    fn log_get<S: Sink>(&self, sink: S) -> LogGet<S> {
        let id = self.target.as_ref().map_or(0, |target| target.number) as u16;
        LogGet::new(self.drone, id, self.size, sink, self.options.patience)
            .with_budget(self.budget.clone())
    }

    /// The part is of another file.
    fn restart(&mut self, mut part: PartFile, why: &str) -> Stage {
        self.restarts += 1;
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
                self.begin(part, false)
            }
            Err(error) => self.fail(error.to_string(), "make room and run again"),
        }
    }

    fn on_probed(
        &mut self,
        part: PartFile,
        sample: &Sample,
        result: Result<u64, FtpError>,
    ) -> Stage {
        match result {
            _ if sample.differs => self.restart(part, "the log on the drone is another"),
            Ok(_) => self.begin(part, false),
            Err(FtpError::Changed { .. }) => {
                self.restart(part, "the log on the drone is smaller than what came of it")
            }
            Err(error) => self.on_ftp_failed(part, error),
        }
    }

    fn on_ftp_failed(&mut self, mut part: PartFile, error: FtpError) -> Stage {
        if let Err(error) = part.sync() {
            return self.fail(error.to_string(), "make room and run again");
        }
        self.held = part.have().total();
        match error {
            FtpError::Silent { .. } => self.fail_silent(error.to_string()),
            FtpError::Sink(reason) => self.fail(reason, "make room and run again"),
            FtpError::Changed { .. } => {
                self.restart(part, "the log on the drone is smaller than what came of it")
            }
            FtpError::TooLarge { .. } => {
                self.fail(error.to_string(), "allow more (--max-size), if that is its size")
            }
            error => self.fall_back(format!("MAVFTP: {error}")),
        }
    }

    fn on_got(&mut self, got: Got<PartFile>) -> Stage {
        self.tally.new_bytes += got.tally.new_bytes;
        self.attempts += got.tally.opened.saturating_sub(1) as u32;
        let part = got.sink;
        match got.result {
            Err(error) => self.on_ftp_failed(part, error),
            Ok(size) => {
                self.size = size;
                self.rounds += 1;
                match self.list(self.options.patience) {
                    Some(list) => Stage::Relist(list, part),
                    None => self.compare(part, false),
                }
            }
        }
    }

    /// Has it grown meanwhile?
    fn on_relisted(&mut self, part: PartFile, outcome: Result<Vec<Listed>, FtpError>) -> Stage {
        let Some(target) = &self.target else { return Stage::Over };
        let name = target.source.rsplit('/').next().unwrap_or_default();
        let names = outcome.unwrap_or_default();
        let size = names.iter().find(|listed| listed.name == name).and_then(|listed| listed.size);
        match size {
            Some(size) if size > self.size && self.rounds < MOST_ROUNDS => {
                self.size = size;
                self.begin(part, false)
            }
            Some(size) if size < self.size => {
                self.restart(part, "the log on the drone is smaller than what came of it")
            }
            size => {
                let is_settled = size == Some(self.size);
                self.compare(part, is_settled)
            }
        }
    }

    fn compare(&mut self, mut part: PartFile, is_settled: bool) -> Stage {
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

    fn sample(&mut self, part: PartFile, sums: Sums) -> Stage {
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

    fn on_summed(&mut self, part: PartFile, sums: Sums, outcome: Result<u32, FtpError>) -> Stage {
        match outcome {
            Ok(sum) if sum == sums.crc32 => self.finish(part, sums, Verified::Checksum),
            // It may have grown between the list and the checksum.
            Ok(_) if self.rounds < MOST_ROUNDS => {
                self.rounds += 1;
                match self.list(self.options.patience) {
                    Some(list) => Stage::Relist(list, part),
                    None => self.restart(part, "the checksum differs"),
                }
            }
            Ok(_) => self.restart(part, "the checksum differs"),
            Err(error @ FtpError::Silent { .. }) => self.on_ftp_failed(part, error),
            Err(_) => self.sample(part, sums),
        }
    }

    fn on_sampled(&mut self, part: PartFile, sums: Sums, differs: bool) -> Stage {
        if differs {
            return self.restart(part, "pieces that were read again differ");
        }
        self.finish(part, sums, Verified::Sample)
    }

    fn finish(&mut self, part: PartFile, sums: Sums, verified: Verified) -> Stage {
        let Some(target) = self.target.take() else { return Stage::Over };
        let entry = ManifestEntry {
            file: target.file,
            slot: self.slot,
            drone: Some(self.drone),
            boot: Some(target.number),
            source: target.source,
            size_bytes: sums.size,
            sha256: sums.sha256,
            method: if self.reason.is_none() { Method::Mavftp } else { Method::LogMessages },
            method_reason: self.reason.clone(),
            verified,
            attempts: self.attempts,
            at_unix_s: self.options.unix_s,
        };
        self.attempts = 0;
        self.held = 0;
        let finished = self.shelf.borrow_mut().finish(part, entry.clone());
        if let Err(error) = finished {
            let reason = format!("{error}: {}", error.source);
            return self.fail(reason, "make room and run again");
        }
        self.done.pulled.push(entry);
        self.next_target()
    }

    fn on_log_failed(&mut self, mut part: PartFile, error: &LogProtocolError) -> Stage {
        let _ = part.sync();
        self.held = part.have().total();
        match error {
            LogProtocolError::Silent { .. } => self.fail_silent(error.to_string()),
            _ => self.fail(error.to_string(), "run again; or take its card and import"),
        }
    }

    fn on_log_got(&mut self, got: LogGot<PartFile>) -> Stage {
        self.tally.new_bytes += got.tally.new_bytes;
        match got.result {
            Ok(_) => self.compare(got.sink, false),
            Err(error) => self.on_log_failed(got.sink, &error),
        }
    }

    fn advance(&mut self, now: Micros, stage: Stage) -> (Stage, Next) {
        macro_rules! machine {
            ($machine:ident, $done:pat => $next:expr, $stage:expr) => {
                match $machine.poll(now) {
                    Step::Send(message) => ($stage, Next::Step(Step::Send(message))),
                    Step::Wait(until) => ($stage, Next::Step(Step::Wait(until))),
                    Step::Done($done) => (Stage::Over, Next::Go(Box::new($next))),
                }
            };
        }
        match stage {
            Stage::Start => (Stage::Over, Next::Go(Box::new(self.start()))),
            Stage::List(mut list) => {
                machine!(list, done => self.on_list(done), Stage::List(list))
            }
            Stage::Probe(mut get, part) => {
                machine!(get, got => self.on_probed(part, &got.sink, got.result), Stage::Probe(get, part))
            }
            Stage::Get(mut get) => machine!(get, got => self.on_got(got), Stage::Get(get)),
            Stage::Relist(mut list, part) => {
                machine!(list, done => self.on_relisted(part, done), Stage::Relist(list, part))
            }
            Stage::Sum(mut sum, part, sums) => {
                machine!(sum, done => self.on_summed(part, sums, done), Stage::Sum(sum, part, sums))
            }
            Stage::Sample(mut get, part, sums) => machine!(
                get,
                got => match got.result {
                    Ok(_) => self.on_sampled(part, sums, got.sink.differs),
                    Err(error) => self.on_ftp_failed(part, error),
                },
                Stage::Sample(get, part, sums)
            ),
            Stage::LogList(mut list) => {
                machine!(list, done => self.on_log_list(done), Stage::LogList(list))
            }
            Stage::LogProbe(mut get, part) => machine!(
                get,
                got => match got.result {
                    _ if got.sink.differs => self.restart(part, "the log on the drone is another"),
                    Ok(_) => self.begin(part, false),
                    Err(error) => self.on_log_failed(part, &error),
                },
                Stage::LogProbe(get, part)
            ),
            Stage::LogGet(mut get) => {
                machine!(get, got => self.on_log_got(got), Stage::LogGet(get))
            }
            Stage::LogSample(mut get, part, sums) => machine!(
                get,
                got => match got.result {
                    Ok(_) => self.on_sampled(part, sums, got.sink.differs),
                    Err(error) => self.on_log_failed(part, &error),
                },
                Stage::LogSample(get, part, sums)
            ),
            Stage::Over => (Stage::Over, Next::Step(Step::Done(std::mem::take(&mut self.done)))),
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

impl Machine for PullOne {
    type Done = OneDone;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        if let MavMessage::HEARTBEAT(beat) = message {
            self.heartbeat = Some(now);
            let armed = dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
            if beat.base_mode.contains(armed) && !matches!(self.stage, Stage::Over) {
                // A link is not loaded while anything flies on it.
                self.stage = self.fail("it is armed".to_owned(), "land and disarm, then run again");
            }
            return;
        }
        match &mut self.stage {
            Stage::List(machine) | Stage::Relist(machine, _) => machine.on_message(now, message),
            Stage::Probe(machine, _) | Stage::Sample(machine, ..) => {
                machine.on_message(now, message);
            }
            Stage::Get(machine) => machine.on_message(now, message),
            Stage::Sum(machine, ..) => machine.on_message(now, message),
            Stage::LogList(machine) => machine.on_message(now, message),
            Stage::LogProbe(machine, _) | Stage::LogSample(machine, ..) => {
                machine.on_message(now, message);
            }
            Stage::LogGet(machine) => machine.on_message(now, message),
            Stage::Start | Stage::Over => {}
        }
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        self.started.get_or_insert(now);
        self.now = now;
        loop {
            let stage = std::mem::replace(&mut self.stage, Stage::Over);
            let (stage, next) = self.advance(now, stage);
            match next {
                Next::Step(step) => {
                    self.stage = stage;
                    return step;
                }
                Next::Go(stage) => self.stage = *stage,
            }
        }
    }

    fn progress(&self) -> Progress {
        match &self.stage {
            Stage::Get(get) => get.progress(),
            Stage::LogGet(get) => get.progress(),
            _ => Progress { done: self.held, total: self.size },
        }
    }
}
