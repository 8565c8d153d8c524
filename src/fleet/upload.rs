//! Loads a show onto a vehicle: file, origin, fence, reload, and a check of the status that
//! follows.
//!
//! It ends with a show that is loaded whole, or with a refusal that says why and a vehicle whose
//! show is cleared. A vehicle that is armed or authorized is not touched.

use super::clear::Clear;
use super::command::{Command, CommandError};
use super::fence::{Fence, FenceError, PutFence, degrees_1e7};
use super::ftp::{Caller, FtpError};
use super::messages::{command_int, command_long, set_mode};
use super::put_file::PutFile;
use crate::link::clock::{Micros, S};
use crate::link::conversation::{Conversation, Progress, Step};
use crate::link::error::Refusal;
use crate::link::frame::{MavMessage, dialect};
use crate::link::id::DroneId;
use crate::mission::plan::Site;
use crate::protocol::show::{FROM_DRONE, NO_AMSL_MM, SHOW_FILE, SHOW_MODE, Stage, Status, flag};
use dialect::{MavCmd, MavModeFlag};

/// A vehicle boots within this, and says so.
const BOOT_WITHIN: Micros = 60 * S;
/// A vehicle that is in no show mode for so long is told to enter it.
const ENTER_AFTER: Micros = 3 * S;
/// Status packets so soon after an answer may have been sent before it.
const SETTLE: Micros = S;
/// The status says what is loaded within this.
const STATUS_WITHIN: Micros = 15 * S;
/// So many status packets in a row must say that all is well.
const AGREEING: u32 = 2;

/// Show that is loaded onto a vehicle, with its place and fence.
#[derive(Clone, Debug, PartialEq)]
pub struct ShowLoad {
    /// Content of the slot's `.skyb` file.
    pub skyb: Vec<u8>,
    /// Position and orientation of the show frame.
    pub site: Site,
    /// Fence around the show.
    pub fence: Fence,
}

/// Reason why a show is not on a vehicle.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum UploadError {
    /// The drone is not heard.
    #[error("nothing is heard of the drone: is it on, and does the radio reach it?")]
    Silent,
    /// The drone sends no status of a show mode.
    #[error(
        "the drone sends no show status: its firmware has no show mode; fly it in guided mode, or \
         install the show firmware"
    )]
    NotShowFirmware,
    /// The drone is flying.
    #[error(
        "the drone is flying ({stage}): it is not touched; `updraft fleet watch` follows the \
         flight, `updraft fleet abort` ends it"
    )]
    Flying {
        /// Stage of the show that the drone is in.
        stage: Stage,
    },
    /// The drone is armed, so that its motors may run.
    #[error(
        "the drone is armed and may be flying: it is not touched; `updraft fleet abort` ends its \
         flight"
    )]
    Armed,
    /// The drone's start is authorized: it may take off at any time.
    #[error(
        "the drone's start is authorized: it is not touched; `updraft fleet abort` takes the start \
         back"
    )]
    Authorized,
    /// A message was not sent, because the drone took off meanwhile.
    #[error("the upload was broken off, as {why}")]
    Held {
        /// Reason why it was broken off, as a clause.
        why: String,
    },
    /// The drone does not reach the stage in which it waits for a start.
    #[error("the drone does not enter show mode (stage {stage}): restart it")]
    NotReady {
        /// Stage of the show that the drone is in.
        stage: Stage,
    },
    /// The drone refused the show mode.
    #[error("the drone does not enter show mode")]
    Mode(#[source] CommandError),
    /// The show file could not be put on the drone.
    #[error("the show file is not on the drone")]
    File(#[source] FtpError),
    /// The origin of the show could not be set.
    #[error("the show's origin is not set")]
    Origin(#[source] CommandError),
    /// The fence could not be put on the drone.
    #[error("the fence is not on the drone")]
    Fence(#[source] FenceError),
    /// The drone does not load the file.
    #[error(
        "the drone does not load the show: the file or what its firmware derives from it is not \
         accepted; look at `updraft check`, and at the drone's messages"
    )]
    Reload(#[source] CommandError),
    /// The drone reports that it has no show after loading the file.
    #[error(
        "the drone says that it has no show, or no valid take-off time, after loading it: look at \
         `updraft check`; a file that is missing on board looks like this, too"
    )]
    NotLoaded,
    /// The drone reports that its origin is not set.
    #[error("the drone says that its origin is not set: try again")]
    NoOrigin,
    /// The drone reports that its orientation is not set.
    #[error("the drone says that its orientation is not set: try again")]
    NoOrientation,
    /// The drone reports that its fence is off.
    #[error("the drone says that its fence is off: look at its FENCE parameters and try again")]
    FenceOff,
    /// The drone sends no status after loading the show.
    #[error("the drone sends no status after loading the show: bring it nearer and try again")]
    NoStatus,
}

/// State of a vehicle after a refused upload.
#[derive(Clone, Debug, PartialEq)]
pub enum Left {
    /// The vehicle is as it was.
    Untouched,
    /// The vehicle has no show loaded any more.
    Cleared,
    /// The state is unknown: the clearing was not confirmed.
    Unknown,
}

/// A refused upload, and the state in which it left the vehicle.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused {
    /// Reason why the upload failed.
    pub why: UploadError,
    /// State in which the vehicle was left.
    pub left: Left,
}

impl std::fmt::Display for Refused {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.why)?;
        let mut source = std::error::Error::source(&self.why);
        while let Some(error) = source {
            write!(f, ": {error}")?;
            source = error.source();
        }
        f.write_str(match self.left {
            Left::Untouched => " (nothing was changed on the drone)",
            Left::Cleared => " (the show on the drone was cleared)",
            Left::Unknown => {
                " (AN OLD SHOW MAY STILL BE LOADED: clearing it was not confirmed; switch the \
                 drone off)"
            }
        })
    }
}

impl std::error::Error for Refused {}

/// Success of an upload: the show is loaded whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Loaded {
    /// Whether the file was written; otherwise it was there already.
    pub written: bool,
}

#[derive(Debug)]
enum Phase {
    Wait,
    Mode(Command),
    File(PutFile),
    Origin(Command),
    Fence(Box<PutFence>),
    Reload(Command),
    Flags { since: Micros, agreeing: u32, last: Option<Status> },
    Clear(Clear, UploadError),
}

/// Loads a show onto one vehicle.
#[derive(Debug)]
pub struct Upload {
    drone: DroneId,
    load: ShowLoad,
    numbers: u32,
    phase: Phase,
    started: Option<Micros>,
    off_since: Option<Micros>,
    entered: bool,
    heard: bool,
    armed: Option<bool>,
    status: Option<Status>,
    written: bool,
    step: u64,
    settle: Micros,
}

/// Number of steps in [`Upload::progress`].
const STEPS: u64 = 6;

impl Upload {
    /// Prepares the upload of a show to a vehicle. `numbers` should differ from run to run (see
    /// [`Caller::new`]).
    pub fn new(drone: DroneId, load: ShowLoad, numbers: u32) -> Self {
        Self {
            drone,
            load,
            numbers,
            phase: Phase::Wait,
            started: None,
            off_since: None,
            entered: false,
            heard: false,
            armed: None,
            status: None,
            written: false,
            step: 0,
            settle: SETTLE,
        }
    }

    /// Sets the time after the reload during which status packets are not believed, us (default 1
    /// s): a link that keeps the order needs no longer than the vehicle takes to set its flags.
    #[must_use]
    pub fn settling(mut self, settle: Micros) -> Self {
        self.settle = settle;
        self
    }

    fn origin(&self) -> Command {
        let site = &self.load.site;
        let place =
            (degrees_1e7(site.origin_lat_deg), degrees_1e7(site.origin_lon_deg), NO_AMSL_MM as f32);
        let params = [0.0, 0.0, 0.0, site.orientation_deg.rem_euclid(360.0) as f32];
        let message = command_int(self.drone, MavCmd::MAV_CMD_USER_2, params, place);
        Command::new("set the show's origin", message)
    }

    /// Reason why the vehicle must not be touched at all, if there is one.
    fn untouchable(&self) -> Option<UploadError> {
        let authorized = self.status.is_some_and(|status| status.has(flag::AUTHORIZED));
        let stage = self.status.map(|status| status.stage);
        match (self.armed, stage) {
            // Its heartbeat may come later.
            (_, Some(stage)) if stage.is_flying() => Some(UploadError::Flying { stage }),
            (Some(true), _) => Some(UploadError::Armed),
            _ if authorized => Some(UploadError::Authorized),
            _ => None,
        }
    }

    /// Waits for the stage from which shows start.
    fn wait(&mut self, now: Micros) -> Option<Step<Result<Loaded, Refused>>> {
        let started = *self.started.get_or_insert(now);
        let refuse = |why| Some(Step::Done(Err(Refused { why, left: Left::Untouched })));
        if let Some(why) = self.untouchable() {
            return refuse(why);
        }
        let ready = self
            .status
            .is_some_and(|status| matches!(status.stage, Stage::WaitForStart | Stage::Landed));
        if ready && self.armed == Some(false) {
            let skyb = std::mem::take(&mut self.load.skyb);
            // Numbers of an earlier session must not come again.
            let caller = Caller::new(self.drone, self.numbers.wrapping_add(now as u32));
            self.phase = Phase::File(PutFile::new(caller, SHOW_FILE, skyb));
            self.step = 1;
            return None;
        }
        let is_off = self.status.is_some_and(|status| status.stage == Stage::Off);
        let off_since = is_off.then(|| *self.off_since.get_or_insert(now));
        self.off_since = off_since;
        let ripe = off_since.is_some_and(|since| now >= since + ENTER_AFTER);
        if ripe && !self.entered && self.armed == Some(false) {
            self.entered = true;
            let message = set_mode(self.drone, SHOW_MODE, 0);
            self.phase = Phase::Mode(Command::new("enter show mode", message));
            return None;
        }
        let until = started + BOOT_WITHIN;
        if now >= until {
            return match self.status {
                Some(status) => {
                    // Whatever was on it before must not be flown by mistake.
                    self.fail(UploadError::NotReady { stage: status.stage });
                    None
                }
                None if self.heard => refuse(UploadError::NotShowFirmware),
                None => refuse(UploadError::Silent),
            };
        }
        let again = off_since.filter(|_| !self.entered).map_or(until, |since| since + ENTER_AFTER);
        Some(Step::Wait(again.clamp(now, until)))
    }

    fn fail(&mut self, why: UploadError) {
        self.phase = Phase::Clear(Clear::new(self.drone), why);
    }

    /// What the status packets after loading say.
    fn flags(&mut self, now: Micros) -> Option<Step<Result<Loaded, Refused>>> {
        let Phase::Flags { since, agreeing, last } = &self.phase else { return None };
        if *agreeing >= AGREEING {
            self.step = STEPS;
            return Some(Step::Done(Ok(Loaded { written: self.written })));
        }
        let until = *since + STATUS_WITHIN;
        if now < until {
            return Some(Step::Wait(until));
        }
        let why = last.map_or(UploadError::NoStatus, |status| {
            missing(&status).unwrap_or(UploadError::NoStatus)
        });
        self.fail(why);
        None
    }
}

/// The first thing that is missing on a vehicle, by its status.
fn missing(status: &Status) -> Option<UploadError> {
    [
        (flag::LOADED, UploadError::NotLoaded),
        (flag::ORIGIN_SET, UploadError::NoOrigin),
        (flag::ORIENTATION_SET, UploadError::NoOrientation),
        (flag::FENCE_ON, UploadError::FenceOff),
    ]
    .into_iter()
    .find(|(flag, _)| !status.has(*flag))
    .map(|(_, error)| error)
}

fn reload(drone: DroneId) -> Command {
    let message = command_long(drone, MavCmd::MAV_CMD_USER_1, [0.0; 7], 0);
    Command::new("load the show", message)
}

impl Conversation for Upload {
    type Done = Result<Loaded, Refused>;

    fn on_message(&mut self, now: Micros, message: &MavMessage) {
        self.heard = true;
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let armed = MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
                self.armed = Some(beat.base_mode.contains(armed));
            }
            MavMessage::DATA16(data) if data.mavtype == FROM_DRONE => {
                let length = usize::from(data.len).min(data.data.len());
                let status = Status::from_data(&data.data[..length]);
                self.status = Some(status);
                if let Phase::Flags { since, agreeing, last } = &mut self.phase
                    && now >= *since + self.settle
                {
                    *last = Some(status);
                    *agreeing = if missing(&status).is_none() { *agreeing + 1 } else { 0 };
                }
            }
            _ => {}
        }
        match &mut self.phase {
            Phase::Mode(part) | Phase::Origin(part) | Phase::Reload(part) => {
                part.on_message(now, message);
            }
            Phase::File(part) => part.on_message(now, message),
            Phase::Fence(part) => part.on_message(now, message),
            Phase::Clear(part, _) => part.on_message(now, message),
            Phase::Wait | Phase::Flags { .. } => {}
        }
    }

    fn refused(&mut self, refusal: &Refusal) -> Option<Self::Done> {
        let left = if matches!(self.phase, Phase::Wait) { Left::Untouched } else { Left::Unknown };
        let why = UploadError::Held { why: refusal.why.clone() };
        Some(Err(Refused { why, left }))
    }

    fn poll(&mut self, now: Micros) -> Step<Self::Done> {
        // Runs a part; what it ends with decides how it goes on.
        macro_rules! part {
            ($part:expr) => {
                match $part.poll(now) {
                    Step::Send(message) => return Step::Send(message),
                    Step::Wait(until) => return Step::Wait(until),
                    Step::Done(done) => done,
                }
            };
        }
        loop {
            match &mut self.phase {
                Phase::Wait => {
                    if let Some(step) = self.wait(now) {
                        return step;
                    }
                }
                Phase::Mode(part) => {
                    if let Err(error) = part!(part) {
                        self.fail(UploadError::Mode(error));
                    } else {
                        self.phase = Phase::Wait;
                    }
                }
                Phase::File(part) => match part!(part) {
                    Ok(written) => {
                        self.written = written;
                        self.step = 2;
                        self.phase = Phase::Origin(self.origin());
                    }
                    Err(error) => self.fail(UploadError::File(error)),
                },
                Phase::Origin(part) => match part!(part) {
                    Ok(()) => {
                        self.step = 3;
                        let put = PutFence::new(self.drone, self.load.fence.clone());
                        self.phase = Phase::Fence(Box::new(put));
                    }
                    Err(error) => self.fail(UploadError::Origin(error)),
                },
                Phase::Fence(part) => match part!(part) {
                    Ok(()) => {
                        self.step = 4;
                        self.phase = Phase::Reload(reload(self.drone));
                    }
                    Err(error) => self.fail(UploadError::Fence(error)),
                },
                Phase::Reload(part) => match part!(part) {
                    Ok(()) => {
                        self.step = 5;
                        self.phase = Phase::Flags { since: now, agreeing: 0, last: None };
                    }
                    Err(error) => self.fail(UploadError::Reload(error)),
                },
                Phase::Flags { .. } => {
                    if let Some(step) = self.flags(now) {
                        return step;
                    }
                }
                Phase::Clear(part, why) => {
                    let why = why.clone();
                    let left = if part!(part).is_ok() { Left::Cleared } else { Left::Unknown };
                    return Step::Done(Err(Refused { why, left }));
                }
            }
        }
    }

    fn progress(&self) -> Progress {
        Progress { done: self.step, total: STEPS }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::fence::fence_of;
    use crate::mission::resolve::resolve;

    const ALL_WELL: u8 = flag::LOADED | flag::ORIGIN_SET | flag::ORIENTATION_SET | flag::FENCE_ON;

    fn status(flags: u8) -> MavMessage {
        let status = Status { flags, ..Status::from_data(&[]) };
        MavMessage::DATA16(dialect::DATA16_DATA {
            mavtype: FROM_DRONE,
            len: Status::LENGTH,
            data: status.to_data(),
        })
    }

    /// An upload whose show has just been loaded, at time 0.
    fn loaded() -> Upload {
        let plan = resolve("hover", &[]).unwrap().flights.remove(0).plan;
        let fence = fence_of(&plan, &plan.to_show()).unwrap();
        let load = ShowLoad { skyb: Vec::new(), site: plan.site, fence };
        let mut upload = Upload::new(DroneId { network: 0, system: 1 }, load, 1);
        upload.phase = Phase::Flags { since: 0, agreeing: 0, last: None };
        upload
    }

    fn is_done(upload: &mut Upload, now: Micros) -> bool {
        match upload.poll(now) {
            Step::Done(done) => {
                assert!(done.is_ok(), "{done:?}");
                true
            }
            _ => false,
        }
    }

    #[test]
    fn two_status_packets_in_a_row_must_say_that_all_is_well() {
        let mut upload = loaded();
        upload.on_message(2 * S, &status(ALL_WELL));
        assert!(!is_done(&mut upload, 2 * S), "one may be of before");
        upload.on_message(3 * S, &status(ALL_WELL & !flag::FENCE_ON));
        upload.on_message(4 * S, &status(ALL_WELL));
        assert!(!is_done(&mut upload, 4 * S), "two, but not in a row");
        upload.on_message(5 * S, &status(ALL_WELL));
        assert!(is_done(&mut upload, 5 * S));
    }

    #[test]
    fn what_was_sent_before_the_vehicle_set_its_flags_does_not_count() {
        let mut upload = loaded();
        upload.on_message(SETTLE - 1, &status(ALL_WELL));
        upload.on_message(SETTLE, &status(ALL_WELL));
        assert!(!is_done(&mut upload, SETTLE));
        upload.on_message(SETTLE + 1, &status(ALL_WELL));
        assert!(is_done(&mut upload, SETTLE + 1));
    }

    #[test]
    fn each_flag_is_needed_and_named() {
        for (flag, wanted) in [
            (flag::LOADED, UploadError::NotLoaded),
            (flag::ORIGIN_SET, UploadError::NoOrigin),
            (flag::ORIENTATION_SET, UploadError::NoOrientation),
            (flag::FENCE_ON, UploadError::FenceOff),
        ] {
            let status = Status { flags: ALL_WELL & !flag, ..Status::from_data(&[]) };
            assert_eq!(missing(&status), Some(wanted));
        }
        assert_eq!(missing(&Status { flags: ALL_WELL, ..Status::from_data(&[]) }), None);
    }
}
