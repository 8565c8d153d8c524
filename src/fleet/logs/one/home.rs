//! Comparison of a drone's log at home with what the drone has now: a log that is longer on the
//! drone is continued, one that was damaged at home is brought again.

use std::cmp::Ordering;

use super::{PullOne, Stage, Target, Which};
use crate::fleet::logs::manifest::{AtHome, ManifestEntry, Method};
use crate::fleet::logs::part::PartFile;

/// Part of a log that is to be downloaded.
pub(super) enum Needed {
    /// Nothing: it is there. Why that is not certain, if it is not.
    Nothing(Option<String>),
    /// The whole log.
    Whole,
    /// The part beyond the log at home.
    Rest,
}

/// Beginning of a download, and the fate of the log at home.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Begun {
    /// Nothing; what is at home moves to the folder of its flight.
    Empty,
    /// Nothing: what is at home is damaged, and set aside.
    Damaged,
    /// The log at home, which is known to be whole, and stays if it is another.
    Whole,
    /// The log at home, which is only a beginning.
    Beginning,
    /// Nothing in the end: the log at home was not its beginning, and is set aside.
    Anew,
}

impl Begun {
    /// Whether the log at home is in it.
    pub(super) fn is_seeded(self) -> bool {
        matches!(self, Self::Whole | Self::Beginning)
    }

    /// What the log at home is called when it is set aside.
    pub(super) fn mark(self) -> Option<&'static str> {
        match self {
            Self::Damaged => Some("damaged"),
            Self::Anew => Some("other"),
            Self::Empty | Self::Whole | Self::Beginning => None,
        }
    }
}

impl PullOne {
    /// The log at home, if it is intact and the one that is wanted.
    fn intact(&self) -> Option<&ManifestEntry> {
        let AtHome::Intact(entry) = &self.home else { return None };
        let is_wanted = match self.options.which {
            Which::Flight => true,
            // Which one that is the drone must say.
            Which::Newest | Which::All => false,
            Which::Number(number) => entry.boot == Some(number),
        };
        (is_wanted && !self.options.again).then_some(entry)
    }

    /// Of a drone that cannot be asked: what is home and known to be whole stays as it is.
    pub(super) fn is_excused(&self) -> bool {
        let is_whole = self.intact().is_some_and(|entry| entry.incomplete.is_none());
        is_whole && !self.is_outgrown && self.target.is_none()
    }

    /// Number on the drone of the log at home; numbers of files and of the log messages differ.
    pub(super) fn number_at_home(&self) -> Option<u32> {
        let is_asked = self.options.again || self.options.which == Which::Newest;
        let entry = self.home.entry().filter(|_| !is_asked)?;
        let is_of_messages = matches!(entry.method, Method::LogMessages | Method::SkybrushServer);
        entry.boot.filter(|_| is_of_messages == self.reason.is_some())
    }

    /// What is needed of a log that the drone has.
    pub(super) fn needed(&mut self, target: &Target) -> Needed {
        let is_slots = target.file == self.file;
        let at_home =
            if is_slots { self.home.clone() } else { self.shelf.borrow().at_home(&target.file) };
        self.begun = Begun::Empty;
        if self.options.again {
            return Needed::Whole;
        }
        let entry = match at_home {
            AtHome::Intact(entry) => entry,
            at_home => {
                if matches!(at_home, AtHome::Damaged(_)) {
                    self.begun = Begun::Damaged;
                }
                return Needed::Whole;
            }
        };
        let is_same = entry.source == target.source
            || (is_slots && self.number_at_home() == Some(target.number));
        if !is_same && self.options.which != Which::Flight {
            return Needed::Whole;
        }
        let is_whole = entry.incomplete.is_none();
        match (target.size.cmp(&entry.size_bytes), is_whole) {
            (Ordering::Equal, true) if is_same => Needed::Nothing(None),
            (Ordering::Greater, _) | (Ordering::Equal, false) => {
                self.begun = if is_whole { Begun::Whole } else { Begun::Beginning };
                Needed::Rest
            }
            _ => Needed::Nothing(Some(
                "the drone's log is a different one, and not longer".to_owned(),
            )),
        }
    }

    /// Its log does not begin as what is there of it.
    pub(super) fn on_another(&mut self, part: PartFile) -> Stage {
        if self.begun == Begun::Whole {
            part.discard();
            let why = "the drone's log is a different one (--again downloads it)".to_owned();
            if let Some(target) = self.target.take() {
                self.leave(target.file, Some(why));
            }
            return self.next_target();
        }
        self.restart(part, "the log on the drone is a different one")
    }

    /// It is there.
    pub(super) fn leave(&mut self, file: String, unchecked: Option<String>) {
        self.done.there.push(file);
        if let Some(unchecked) = unchecked {
            self.done.unchecked.get_or_insert(unchecked);
        }
    }
}
