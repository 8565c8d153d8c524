//! The journal of a flight in its replay: what the station heard and did, and when. Of drones whose logs are not here
//! it is all there is.

use std::collections::BTreeMap;

use crate::base::causes::with_causes;
use crate::campaign::FlightFolder;
use crate::campaign::start::StartRecord;
use crate::fleet::recorded::{Happened, Recorded, read};
use crate::fleet::watch::Event;
use crate::live::player::Track;
use crate::live::station::Station;
use crate::live::view::{Level, Said};
use crate::mission::plan::Plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Preparations of a flight are no longer before its start is authorized, us.
const PREPARED_US: u64 = 3_600_000_000;
/// Drones come home so long after the end of their show at most, us.
const LINGERING_US: u64 = 600_000_000;
/// A flight is over so long after its start, us.
const OVER_US: u64 = 6 * 3_600_000_000;
/// Sentences that are shown, the last ones.
const MOST_SAID: usize = 2000;
/// Step of the station that begins a flight.
const AUTHORIZED: &str = "authorized";

/// Tells a page what the station said before it was started anew, as long as the flight that was started is not over.
pub(crate) fn recall(host: &dyn Host, station: &Station, folder: &FlightFolder, plan: &Plan) {
    match spoken(host.clock().unix_us(), folder, plan) {
        Ok(said) => station.recall(said),
        Err(error) => host.warn(&format!(
            "{}; the page shows nothing of what was said before",
            with_causes(&error, ": ")
        )),
    }
}

/// Sentences of a flight that is in the air at `now_us`; none of one that is over.
fn spoken(now_us: u64, folder: &FlightFolder, plan: &Plan) -> Result<Vec<Said>, WorkflowError> {
    let Some(start) = StartRecord::read(folder)? else { return Ok(Vec::new()) };
    let zero_us = u64::try_from(start.start.to_unix_ms()).unwrap_or(0).saturating_mul(1000);
    let long_us = plan.duration_ms.saturating_mul(1000);
    if now_us > zero_us.saturating_add(long_us).saturating_add(LINGERING_US) {
        return Ok(Vec::new());
    }
    Ok(OfJournal::of(&read(&folder.0)?, &start).said)
}

/// Journal of the latest start of a flight.
#[derive(Debug, Default)]
pub(super) struct OfJournal {
    /// Drones by slot: what was heard of each, without places.
    pub(super) tracks: BTreeMap<u16, Track>,
    /// Sentences for all, in order.
    pub(super) said: Vec<Said>,
    /// UTC of show time 0, ms since 1970.
    zero_ms: u64,
}

impl OfJournal {
    /// Reads it; empty where there is no journal, or no start that was recorded.
    ///
    /// # Errors
    /// If one of the two is there and cannot be read.
    pub(super) fn read(folder: &FlightFolder) -> Result<Self, WorkflowError> {
        match StartRecord::read(folder)? {
            Some(start) => Ok(Self::of(&read(&folder.0)?, &start)),
            None => Ok(Self::default()),
        }
    }

    /// The sentences with their show time, which is the time of a replay: all of them are there from its beginning.
    pub(super) fn said_by_show_time(self) -> Vec<Said> {
        let with_time = |said: Said| {
            let show_s = (said.at_ms as f64 - self.zero_ms as f64) / 1000.0;
            let (sign, whole_s) = (if show_s < 0.0 { "−" } else { "" }, show_s.abs() as u64);
            let text = format!("[{sign}{}:{:02}] {}", whole_s / 60, whole_s % 60, said.text);
            Said { text, ..said }
        };
        self.said.into_iter().map(with_time).collect()
    }

    fn of(entries: &[Recorded], start: &StartRecord) -> Self {
        let slots: BTreeMap<&str, u16> =
            start.drones.iter().map(|of| (of.drone.as_str(), of.slot)).collect();
        let zero_us = u64::try_from(start.start.to_unix_ms()).unwrap_or(0).saturating_mul(1000);
        let mut found = Self { zero_ms: zero_us / 1000, ..Self::default() };
        for entry in of_flight(entries, start.authorized_unix_s.saturating_mul(1_000_000), zero_us)
        {
            let show_s = (entry.unix_us as f64 - zero_us as f64) * 1e-6;
            let slot = entry.drone.and_then(|drone| slots.get(drone.to_string().as_str()).copied());
            let words = entry.happened.to_string();
            if let (Some(drone), Some(slot)) = (entry.drone, slot) {
                let track = found.tracks.entry(slot).or_insert_with(|| Track {
                    slot,
                    drone: Some(drone.to_string()),
                    first_s: show_s,
                    ..Track::default()
                });
                note(track, show_s, &entry.happened);
                track.words.push((show_s, words.clone()));
            }
            let is_alarm = matches!(&entry.happened, Happened::Event(event) if event.is_alarm());
            let text = entry.drone.map_or(words.clone(), |drone| format!("drone {drone}: {words}"));
            let level = if is_alarm { Level::Warning } else { Level::Good };
            found.said.push(Said { number: 0, at_ms: entry.unix_us / 1000, level, text });
        }
        found.said.drain(..found.said.len().saturating_sub(MOST_SAID));
        for (said, number) in found.said.iter_mut().zip(1..) {
            said.number = number;
        }
        found
    }
}

/// Entries of one flight: from its preparations, which follow the last event of the flight before, until another is
/// authorized or it is surely over.
fn of_flight(
    entries: &[Recorded],
    authorized_us: u64,
    zero_us: u64,
) -> impl Iterator<Item = &Recorded> {
    let is_start = |entry: &&Recorded| matches!(&entry.happened, Happened::Step { step, .. } if step == AUTHORIZED);
    let is_event = |entry: &&Recorded| matches!(entry.happened, Happened::Event(_));
    let before_us =
        entries.iter().filter(is_event).map(|entry| entry.unix_us).filter(|at| *at < authorized_us);
    let from_us =
        authorized_us.saturating_sub(PREPARED_US).max(before_us.max().map_or(0, |at| at + 1));
    // The second in which it was authorized is whole.
    let later = |entry: &&Recorded| entry.unix_us > authorized_us + 1_000_000;
    let next_us = entries.iter().filter(is_start).filter(later).map(|entry| entry.unix_us).min();
    let to_us = next_us.unwrap_or(u64::MAX).min(zero_us.saturating_add(OVER_US));
    entries.iter().filter(move |entry| (from_us..to_us).contains(&entry.unix_us))
}

/// Stages and motors as they were heard.
fn note(track: &mut Track, show_s: f64, happened: &Happened) {
    match happened {
        Happened::Event(Event::Stage { number, .. }) => track.stages.push((show_s, *number)),
        Happened::Event(Event::Armed { armed: true }) => {
            track.armed_s.push((show_s, f64::INFINITY));
        }
        Happened::Event(Event::Armed { armed: false }) => {
            if let Some((_, to_s)) = track.armed_s.last_mut() {
                *to_s = to_s.min(show_s);
            }
        }
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::GpsTime;
    use crate::campaign::start::{Flying, StartedDrone};
    use crate::link::id::DroneId;

    const ZERO_S: u64 = 1_795_143_537;

    fn step(at_s: u64, step: &str) -> Recorded {
        let happened = Happened::Step { step: step.to_owned(), text: String::new() };
        Recorded { unix_us: at_s * 1_000_000, drone: None, happened }
    }

    fn event(at_s: u64, system: u8, event: Event) -> Recorded {
        let drone = Some(DroneId { network: 0, system });
        Recorded { unix_us: at_s * 1_000_000, drone, happened: Happened::Event(event) }
    }

    fn start() -> StartRecord {
        let drone = |slot: u16| StartedDrone {
            slot,
            drone: (slot + 10).to_string(),
            show_crc32: None,
            booted: None,
        };
        let at = GpsTime::from_unix_ms(ZERO_S as i64 * 1000).unwrap();
        let drones = vec![drone(1), drone(2)];
        StartRecord::new("test".to_owned(), at, ZERO_S - 60, Flying::Show, drones)
    }

    #[test]
    fn a_flight_has_its_own_entries_by_slot_and_show_time() {
        let performs = || Event::Stage { number: 4, stage: "performing".to_owned() };
        let entries = [
            step(ZERO_S - 900, AUTHORIZED),
            event(ZERO_S - 800, 11, performs()),
            step(ZERO_S - 100, "upload"),
            step(ZERO_S - 60, AUTHORIZED),
            event(ZERO_S - 3, 11, Event::Armed { armed: true }),
            event(ZERO_S + 7, 11, performs()),
            event(ZERO_S + 9, 12, Event::Silent { seconds: 3 }),
            event(ZERO_S + 90, 11, Event::Armed { armed: false }),
            event(ZERO_S + 91, 99, Event::HeardAgain),
            step(ZERO_S + 500, AUTHORIZED),
            event(ZERO_S + 600, 11, performs()),
        ];
        let found = OfJournal::of(&entries, &start());
        let told: Vec<&str> = found.said.iter().map(|said| said.text.as_str()).collect();
        // The flight before ends with its last event, the next begins with its authorization.
        let all = [
            "upload",
            "authorized",
            "drone 11: armed",
            "drone 11: performing",
            "drone 12: not heard for 3 s",
            "drone 11: disarmed",
            "drone 99: heard again",
        ];
        assert_eq!(told, all);
        assert_eq!(
            found.said.iter().map(|said| said.number).collect::<Vec<_>>(),
            [1, 2, 3, 4, 5, 6, 7]
        );
        assert_eq!(found.said[4].level, Level::Warning);
        let one = &found.tracks[&1];
        assert_eq!(one.stages, [(7.0, 4)]);
        assert_eq!(one.armed_s, [(-3.0, 90.0)]);
        assert_eq!(one.drone.as_deref(), Some("11"));
        assert_eq!(found.tracks.keys().copied().collect::<Vec<_>>(), [1, 2]);
        assert_eq!(found.tracks[&2].words, [(9.0, "not heard for 3 s".to_owned())]);
    }
}
