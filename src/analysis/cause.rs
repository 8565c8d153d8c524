//! Reasons for leaving a log, a drone or a value out of an analysis, and their sentences.

use std::fmt;

use super::calibrate::CalibrationError;
use super::level::LEAST_ZERO_S;
use super::running::RUNNING_S;
use crate::base::said::said_in_files;
use crate::base::sentence::Sentence;
use crate::flight::Loss;

/// Reason why a log is not used, or a drone has no result. In `analysis.json` it stands as its sentence.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Cause {
    /// The log cannot be read, or holds no flight, in the words of its reader.
    Log(Sentence),
    /// The caller says that the log is not to be used, for the reason given.
    Refused(String),
    /// The log has the same bytes as another one.
    Copy {
        /// Name of the other log.
        of: String,
    },
    /// The drone's slot has a log already.
    SlotTaken {
        /// Number of the slot.
        slot: u16,
        /// Name of the log that the slot has.
        first: String,
    },
    /// The log is meant for a slot that the plan does not have.
    NoSuchSlot {
        /// Number of the slot.
        slot: u16,
    },
    /// The drone stood somewhere else.
    OtherPlace {
        /// Number of the slot with the nearest home.
        slot: u16,
        /// Distance from that home, m.
        distance_m: f64,
        /// Largest distance that counts as GPS error, m.
        limit_m: f64,
    },
    /// Nothing tells which drone the log is of.
    NoFreeSlot,
    /// Without a plan, the log has no commands to find windows by.
    NoCommands,
    /// The plan has no windows for the slot.
    NoWindows,
    /// The drone was to stand still and was commanded up and down.
    Restless {
        /// Name of the window.
        label: String,
        /// Start and end of the window, show time, s.
        from_to_s: [f64; 2],
    },
    /// Vertical speeds were flown that are not the plan's.
    OtherSpeeds {
        /// Number of windows with another speed, and of windows compared.
        wrong_of: [usize; 2],
        /// Whether legs were compared, or all windows.
        legs: bool,
        /// Name of the first window with another speed.
        label: String,
        /// Start of the first window with another speed, show time, s.
        start_s: f64,
        /// Vertical speed planned and flown, m/s, up positive.
        planned_flown_mps: [f64; 2],
        /// Delay of the flown legs behind the planned ones, if they are the plan's, s.
        offset_s: Option<f64>,
    },
    /// Horizontal legs of the plan were not flown.
    OtherTrack {
        /// Number of legs that were not flown, and of legs compared.
        wrong_of: [usize; 2],
        /// Name of the first leg that was not flown.
        label: String,
        /// Start of the first leg that was not flown, show time, s.
        start_s: f64,
        /// Length of the leg planned and flown, m.
        planned_flown_m: [f64; 2],
    },
    /// No window of the plan lies in the time that the log speaks of.
    OtherTime {
        /// Start and end of the log, show time, s.
        log_s: [f64; 2],
        /// Start and end of the plan's windows, show time, s.
        plan_s: [f64; 2],
    },
    /// The log ends after the show's start, and before the plan's first window.
    EndsBefore {
        /// End of the log, show time, s.
        end_s: f64,
        /// Start of the plan's first window, show time, s.
        first_s: f64,
        /// Height above the ground at which the log ends, m; `None`: the drone had landed.
        height_m: Option<f64>,
    },
    /// The drone's show began at another time than those of most drones.
    OtherStart {
        /// Delay behind the start of most drones, s.
        later_s: f64,
    },
    /// The log is used, but not all of it is there.
    InPart(Vec<Loss>),
    /// There is no log of the drone.
    NoLog {
        /// Name of the drone.
        name: String,
    },
    /// None of the drone's logs is used: their names and the reasons.
    LogsNotUsed(Vec<(String, Cause)>),
    /// No law could be fitted to the drone's windows.
    Calibration(CalibrationError),
    /// The calibration has no law for the drone.
    NoLaw,
    /// The calibration has no fit of the map's law for the drone.
    NoFit,
    /// The flight has no hover.
    NoHover,
    /// The drone moved, and its law does not know its errors.
    TrackWithoutErrors,
    /// The hover or the track was rejected.
    Rejected {
        /// Whether the drone moved along a track.
        track: bool,
        /// Start and end of the hover or track, show time, s.
        from_to_s: [f64; 2],
        /// Reasons for the rejection, as clauses.
        reasons: Vec<&'static str>,
    },
    /// The hover is shorter than a running mean.
    TooShort {
        /// Length of the hover, s.
        length_s: f64,
    },
    /// The pulses lie outside of what the law can invert.
    OutsideLaw {
        /// Whether the drone moved along a track.
        track: bool,
    },
    /// The log has gaps that cover the whole hover.
    Gaps,
    /// The stretch that sets the zero is not within the hover.
    ZeroOutside {
        /// Start and end of the stretch, show time, s.
        zero_s: [f64; 2],
        /// Start and end of the hover, show time, s.
        hover_s: [f64; 2],
    },
    /// Neither a vehicle nor a calibration says how the effort answers the air.
    NoResponse,
    /// Neither a stretch of the hover nor a calibration gives the level.
    NoLevel,
    /// A reason as it was read from a file.
    Said(String),
}

said_in_files!(Cause);

impl From<CalibrationError> for Cause {
    fn from(error: CalibrationError) -> Self {
        Self::Calibration(error)
    }
}

impl Cause {
    /// Of an error about a log: errors name the file as it was opened, results as their reader finds it.
    pub(super) fn of_log(error: &str, opened_as: &str, source: &str) -> Self {
        let prefix = format!("{opened_as}: ");
        let said = error.strip_prefix(&prefix).unwrap_or(error);
        let mut sentence = Sentence::default();
        for (index, words) in said.split(opened_as).enumerate() {
            if index > 0 {
                sentence = sentence.log(source);
            }
            sentence = sentence.words(words);
        }
        Self::Log(sentence)
    }

    /// One sentence about a log that names it.
    pub fn about(&self, log: &str) -> Sentence {
        let sentence = self.sentence();
        if sentence.names(log) {
            return sentence;
        }
        Sentence::default().log(log).words(": ").then(sentence)
    }

    /// The reason in a sentence.
    pub fn sentence(&self) -> Sentence {
        match self {
            Self::Log(sentence) => sentence.clone(),
            Self::Refused(text) | Self::Said(text) => text.as_str().into(),
            Self::Copy { of } => Sentence::from("a copy of ").log(of).words(" (the same bytes)"),
            Self::SlotTaken { slot, first } => {
                Sentence::from(format!("slot {slot} has a log already (")).log(first).words(")")
            }
            Self::NoSuchSlot { slot } => format!("the plan has no slot {slot}").into(),
            Self::OtherPlace { slot, distance_m, limit_m } => {
                other_place(*slot, *distance_m, *limit_m)
            }
            Self::NoFreeSlot => "the log fits no free slot of the plan by home position, file name or \
                                 system id; name it after its slot (07.BIN)"
                .into(),
            Self::NoCommands => "without a plan the windows come from the log's desired velocity, and \
                                 it has none (GUIP, PSCD or CTUN); give the plan"
                .into(),
            Self::NoWindows => "the plan has no analysis windows for this slot: its legs and hovers \
                                are too short for one"
                .into(),
            Self::Restless { .. } | Self::OtherSpeeds { .. } | Self::OtherTrack { .. } => {
                self.other_plan()
            }
            Self::OtherTime { log_s: [from, to], plan_s: [first, last] } => format!(
                "the log runs from {from:.0} to {to:.0} s of show time, and the plan's windows lie \
                 between {first:.0} and {last:.0} s: the drone's clock jumped or was set wrong, or the \
                 log is of another start; nothing of the plan is in it"
            )
            .into(),
            Self::EndsBefore { end_s, first_s, height_m } => {
                ends_before(*end_s, *first_s, *height_m)
            }
            Self::OtherStart { later_s } => format!(
                "its show began {} than that of most drones (by its log's GPS time): it flew the plan \
                 at another time, in other air, and has no place in this map. Analyse its log by itself \
                 (--plan FLIGHT --hold analysis.json), or put the log of this flight in its place",
                later(*later_s)
            )
            .into(),
            Self::InPart(losses) => {
                let told = losses.iter().enumerate();
                told.fold(Sentence::default(), |sentence, (index, loss)| {
                    sentence.words(if index > 0 { "; " } else { "" }).then(loss.sentence())
                })
            }
            Self::NoLog { name } => format!("no log of {name}").into(),
            Self::LogsNotUsed(logs) => logs_not_used(logs),
            Self::Calibration(error) => calibration(error),
            Self::NoLaw => {
                "the calibration has no law for it (neither its own nor the flock's)".into()
            }
            Self::NoFit => "the calibration has no fit of the law that the map uses".into(),
            Self::NoHover => "no hover was found in the flight".into(),
            Self::TrackWithoutErrors => "the drone moved, and a track is measured with a law that \
                                         knows its errors: this calibration allows none, or the \
                                         paper's way was asked for"
                .into(),
            Self::Rejected { track, from_to_s: [from, to], reasons } => format!(
                "the {} from {from:.0} to {to:.0} s was rejected: {}",
                way(*track),
                reasons.join(", ")
            )
            .into(),
            Self::TooShort { length_s } => format!(
                "the hover is too short: its window has {length_s:.0} s, the running mean needs \
                 {RUNNING_S:.0} s"
            )
            .into(),
            Self::OutsideLaw { track } => {
                format!("the {}'s pulses are outside of the law's range", way(*track)).into()
            }
            Self::Gaps => "the hover has no 10 s without a gap in the log".into(),
            Self::ZeroOutside { zero_s: [from, to], hover_s: [first, last] } => {
                let half = f64::midpoint(*first, *last);
                let advice = if half - first < LEAST_ZERO_S {
                    "too short to set a zero of its own".to_owned()
                } else {
                    format!("give a stretch of it (--zero {first:.0}..{half:.0}s)")
                };
                format!(
                    "the stretch {from:.0} to {to:.0} s that sets the zero has no 10 s of this hover, or is \
                     not within it: it lasts from {first:.0} to {last:.0} s of the table; {advice}"
                )
                .into()
            }
            Self::NoResponse => "nothing says how the rotor effort answers the air: give --vehicle, or \
                                 a calibration flight in the mapping"
                .into(),
            Self::NoLevel => "nothing says what the rotor effort is in still air: give the stretch of \
                              the hover that sets the zero (--zero 0..150s), or a calibration flight in \
                              the mapping"
                .into(),
        }
    }

    /// That what was flown is not the plan.
    fn other_plan(&self) -> Sentence {
        let sentence = Sentence::from("this log does not belong to the plan: ");
        let folder = "check that the logs are in the folder of their own flight";
        match self {
            Self::Restless { label, from_to_s: [from, to] } => sentence.words(&format!(
                "it was to stand still in `{label}` from {from:.0} to {to:.0} s, and was commanded up \
                 and down most of that time; {folder}"
            )),
            Self::OtherSpeeds {
                wrong_of: [wrong, of],
                legs,
                label,
                start_s,
                planned_flown_mps: [planned, flown],
                offset_s,
            } => {
                let what = if *legs { "legs" } else { "windows" };
                let sentence = sentence
                    .words(&format!(
                        "{wrong} of {of} {what} were flown at another vertical speed (first: `{label}` \
                         at {start_s:.0} s, planned "
                    ))
                    .number(*planned, &planned.to_string())
                    .words(" m/s, flown ")
                    .number(*flown, &format!("{flown:.2}"))
                    .words(" m/s); ");
                match offset_s {
                    Some(offset_s) => sentence
                        .words(
                            "the legs are the plan's, but the flight seems to run ",
                        )
                        .number(offset_s.abs(), &format!("{:.1}", offset_s.abs()))
                        .words(&format!(
                            " s {} than the plan: plan it with the take-off and the waits that were \
                             flown (for example --set takeoff.speed_mps=2)",
                            if *offset_s < 0.0 { "earlier" } else { "later" },
                        )),
                    None => sentence.words(folder),
                }
            }
            Self::OtherTrack {
                wrong_of: [wrong, of],
                label,
                start_s,
                planned_flown_m: [planned, flown],
            } => sentence.words(&format!(
                "{wrong} of {of} horizontal legs were not flown (first: `{label}` at {start_s:.0} s, \
                 planned {planned:.0} m, flown {flown:.0} m); {folder}"
            )),
            _ => sentence,
        }
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.sentence().fmt(f)
    }
}

/// `3600 s later`.
pub(super) fn later(later_s: f64) -> String {
    format!("{:.0} s {}", later_s.abs(), if later_s < 0.0 { "earlier" } else { "later" })
}

fn way(track: bool) -> &'static str {
    if track { "track" } else { "hover" }
}

fn other_place(slot: u16, distance_m: f64, limit_m: f64) -> Sentence {
    let (distance, unit) =
        if distance_m < 1000.0 { (distance_m, "m") } else { (distance_m / 1000.0, "km") };
    Sentence::from("it was flown somewhere else: its home is ")
        .number(distance, &format!("{distance:.1}"))
        .words(&format!(" {unit} from that of slot {slot}, the nearest (at most "))
        .number(limit_m, &format!("{limit_m:.1}"))
        .words(
            " m is taken for GPS error); take the log away, or plan with the origin and orientation \
             that were flown",
        )
}

fn ends_before(end_s: f64, first_s: f64, height_m: Option<f64>) -> Sentence {
    let sentence = match height_m {
        Some(height_m) => Sentence::from("the log ends in the air, ")
            .number(height_m, &format!("{height_m:.1}"))
            .words(" m above the ground, "),
        None => Sentence::from("the flight ends "),
    };
    sentence.number(end_s, &format!("{end_s:.1}")).words(&format!(
        " s after the show's start, before the plan's first window (from {first_s:.0} s): there is \
         nothing to measure in it"
    ))
}

fn logs_not_used(logs: &[(String, Cause)]) -> Sentence {
    let start = match logs {
        [_] => Sentence::from("its log is not used: "),
        several => format!("its {} logs are not used: ", several.len()).into(),
    };
    let told = logs.iter().enumerate();
    told.fold(start, |sentence, (index, (log, cause))| {
        let between = if index > 0 { "; " } else { "" };
        sentence.words(between).then(cause.about(log))
    })
}

fn calibration(error: &CalibrationError) -> Sentence {
    match error {
        CalibrationError::OneSpeed { speed_mps, windows } => Sentence::from(
            "only one vertical speed (",
        )
        .number(*speed_mps, &speed_mps.to_string())
        .words(&format!(
            " m/s) in {windows} usable window(s); a calibration needs legs at two speeds or more"
        )),
        error => error.to_string().into(),
    }
}
