//! The journal of a fleet, read back: what happened, when, and to whom.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Deserialize;

use super::journal::JOURNAL_FILE;
use super::watch::Event;
use crate::base::file::{FileError, read_whole};
use crate::base::parse;
use crate::link::id::DroneId;
use crate::protocol::show::Stage;

/// A journal is no longer than this, bytes: that of a thousand drones has about 150 a line, and some dozens of lines a
/// drone and flight.
const MOST_BYTES: u64 = 256 << 20;

/// Entry of a journal.
#[derive(Clone, Debug, PartialEq)]
pub struct Recorded {
    /// Unix time of the station, us.
    pub unix_us: u64,
    /// Drone that it is about; absent: the station, or all drones.
    pub drone: Option<DroneId>,
    /// Event or step that the entry tells of.
    pub happened: Happened,
}

/// Content of an entry.
#[derive(Clone, Debug, PartialEq)]
pub enum Happened {
    /// Event in the flight of a drone.
    Event(Event),
    /// Step of the station, or what became of a drone in it.
    Step {
        /// Name of the step, as `authorized`.
        step: String,
        /// Outcome, in words.
        text: String,
    },
}

impl std::fmt::Display for Happened {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Event(event) => event.fmt(f),
            Self::Step { step, text } if text.is_empty() => f.write_str(step),
            Self::Step { step, text } => write!(f, "{step}: {text}"),
        }
    }
}

#[derive(Deserialize)]
struct Line {
    unix_us: u64,
    #[serde(default)]
    drone: Option<DroneId>,
    #[serde(flatten)]
    content: Content,
}

#[derive(Deserialize)]
#[serde(untagged)]
enum Content {
    Event(Event),
    Note {
        step: String,
        #[serde(default)]
        text: Option<String>,
        #[serde(default)]
        drones: Vec<Outcome>,
    },
}

#[derive(Deserialize)]
struct Outcome {
    drone: DroneId,
    outcome: String,
}

/// Drones that were seen in the air.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SeenInTheAir {
    /// Those that flew.
    pub flew: BTreeSet<DroneId>,
    /// Those that restarted there, and were not seen to fly on.
    pub fell: BTreeSet<DroneId>,
}

/// Drones that steps of these names were for, since a time.
pub fn drones_of_steps(
    entries: &[Recorded],
    since_unix_us: u64,
    names: &[&str],
) -> BTreeSet<DroneId> {
    let of_step = |entry: &&Recorded| matches!(&entry.happened, Happened::Step { step, .. } if names.contains(&step.as_str()));
    let later = entries.iter().filter(|entry| entry.unix_us >= since_unix_us);
    later.filter(of_step).filter_map(|entry| entry.drone).collect()
}

/// Drones that were seen in the air since a time, by the stages of the show that they told.
pub fn seen_in_the_air(entries: &[Recorded], since_unix_us: u64) -> SeenInTheAir {
    let mut seen = SeenInTheAir::default();
    for entry in entries.iter().filter(|entry| entry.unix_us >= since_unix_us) {
        let (Some(drone), Happened::Event(event)) = (entry.drone, &entry.happened) else {
            continue;
        };
        match event {
            Event::Stage { number, .. } if Stage::from_number(*number).is_flying() => {
                seen.flew.insert(drone);
                seen.fell.remove(&drone);
            }
            Event::Restarted { in_the_air: true } => {
                seen.flew.insert(drone);
                seen.fell.insert(drone);
            }
            _ => {}
        }
    }
    seen
}

/// Entries of a folder's journal, in the order of their lines; none where there is no journal. Lines that are not whole
/// (a station that lost its power) and those of other versions are left out.
///
/// # Errors
///
/// If the journal is there and cannot be read.
pub fn read(folder: &Path) -> Result<Vec<Recorded>, FileError> {
    let path = folder.join(JOURNAL_FILE);
    if !path.exists() {
        return Ok(Vec::new());
    }
    let bytes = read_whole(&path, MOST_BYTES)?;
    let mut entries = Vec::new();
    for line in bytes.split(|byte| *byte == b'\n') {
        let Ok(Line { unix_us, drone, content }) = parse::json(line) else { continue };
        match content {
            Content::Event(event) => {
                entries.push(Recorded { unix_us, drone, happened: Happened::Event(event) });
            }
            Content::Note { step, text, drones } => {
                let text = text.unwrap_or_default();
                let happened = Happened::Step { step: step.clone(), text };
                entries.push(Recorded { unix_us, drone, happened });
                entries.extend(drones.into_iter().map(|of| Recorded {
                    unix_us,
                    drone: Some(of.drone),
                    happened: Happened::Step { step: step.clone(), text: of.outcome },
                }));
            }
        }
    }
    Ok(entries)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::journal::{Entry, Journal};
    use super::*;

    #[test]
    fn who_was_in_the_air_is_known_from_the_stages_since_the_start() {
        let drone = |system: u8| DroneId { network: 0, system };
        let at = |unix_us: u64, system: u8, event: Event| Recorded {
            unix_us,
            drone: Some(drone(system)),
            happened: Happened::Event(event),
        };
        let stage = |number: u8| Event::Stage { number, stage: String::new() };
        let entries = [
            at(10, 1, stage(4)),
            at(30, 2, stage(3)),
            at(31, 3, stage(2)),
            at(32, 4, stage(4)),
            at(33, 5, stage(4)),
            at(40, 4, Event::Restarted { in_the_air: true }),
            at(41, 5, Event::Restarted { in_the_air: true }),
            at(42, 5, stage(5)),
            at(43, 2, stage(8)),
        ];
        let seen = seen_in_the_air(&entries, 20);
        assert_eq!(seen.flew, BTreeSet::from([drone(2), drone(4), drone(5)]));
        assert_eq!(seen.fell, BTreeSet::from([drone(4)]));
        let step = |unix_us: u64, step: &str| Recorded {
            unix_us,
            drone: Some(drone(9)),
            happened: Happened::Step { step: step.to_owned(), text: String::new() },
        };
        let entries = [step(10, "abort"), step(30, "upload")];
        assert_eq!(drones_of_steps(&entries, 20, &["abort"]), BTreeSet::new());
        assert_eq!(drones_of_steps(&entries, 5, &["abort"]), BTreeSet::from([drone(9)]));
    }

    #[test]
    fn it_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(read(folder.path()).unwrap(), []);
        let drone = DroneId { network: 1, system: 7 };
        let events = [
            Event::Armed { armed: true },
            Event::Stage { number: 4, stage: "performing".to_owned() },
            Event::Far { distance_m: 3.5, show_s: 12.0 },
            Event::HeardAgain,
            Event::Says { severity: 3, text: "Crash".to_owned() },
        ];
        let mut journal = Journal::open(folder.path()).unwrap();
        for (event, unix_us) in events.iter().zip(10..) {
            journal.write(&Entry { unix_us, drone: Some(drone), event }).unwrap();
        }
        let step = serde_json::json!({
            "step": "upload", "text": "1 refused",
            "drones": [{ "drone": { "network": 1, "system": 7 }, "outcome": "no answer" }],
        });
        journal.write(&Entry { unix_us: 20, drone: None, event: &step }).unwrap();
        let path = folder.path().join(JOURNAL_FILE);
        let torn = [&fs::read(&path).unwrap()[..], b"{\"of\":1}\n{\"unix_us\":30,\"drone\":{\"net"]
            .concat();
        fs::write(&path, torn).unwrap();

        let read = read(folder.path()).unwrap();
        let told: Vec<String> = read.iter().map(|of| of.happened.to_string()).collect();
        let words = [
            "armed",
            "performing",
            "3.5 m from its trajectory at 12.0 s",
            "heard again",
            "says: Crash",
            "upload: 1 refused",
            "upload: no answer",
        ];
        assert_eq!(told, words);
        let of: Vec<_> = read.iter().map(|of| (of.unix_us, of.drone)).collect();
        assert_eq!(of[0], (10, Some(drone)));
        assert_eq!(of[5..], [(20, None), (20, Some(drone))]);
        assert_eq!(read[2].happened, Happened::Event(events[2].clone()));
    }
}
