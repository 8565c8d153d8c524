//! Takeover of the watch of a flight that another station has started.

use std::collections::{BTreeMap, BTreeSet};

use super::Crew;
use super::hear::hear_together;
use crate::base::causes::with_causes;
use crate::base::time::{GpsTime, WEEK_S};
use crate::campaign::start::StartRecord;
use crate::fleet::abort::Action;
use crate::fleet::gate::State;
use crate::fleet::messages::start_packet;
use crate::fleet::recorded::{drones_of_steps, read as read_journal, seen_in_the_air};
use crate::fleet::slots::FleetTable;
use crate::fleet::start::Start;
use crate::link::clock::{MS, Micros, S};
use crate::link::conversation::Observer as _;
use crate::link::id::DroneId;
use crate::link::net::Net as _;
use crate::numeric::upper_median;
use crate::protocol::show::{CLEAR_TIME, StartConfig, flag};
use crate::workflow::error::WorkflowError;
use crate::workflow::fleet::end::word;
use crate::workflow::host::News;
use crate::workflow::words::time_of_day;

/// A start that was written down is that of the flight in the air if it is no longer ago, or no
/// further ahead, ms.
const NEAR_MS: i64 = 12 * 3_600_000;

/// What a station that comes later finds.
pub(crate) enum Found {
    /// Drones are in the air, or about to be.
    Flight(Start),
    /// The flight of this start is over: all drones of the table stand disarmed, and none has a start.
    Over(GpsTime),
}

/// Leftovers of a start are taken back for so long.
const CLEARED_WITHIN: Micros = 10 * S;

impl Crew<'_> {
    /// Why no flight is started: drones are in the air. `None`: there are none.
    pub(crate) fn in_flight(&self) -> Option<String> {
        let heard: Vec<_> = self.telemetry.drones.keys().copied().collect();
        let flying = self.net.in_the_air(heard, false);
        let words: Vec<String> =
            flying.iter().map(|(drone, words)| format!("drone {drone} {words}")).collect();
        (!words.is_empty()).then(|| {
            format!(
                "{}: nothing was sent. `updraft fleet watch` follows the flight and downloads \
                 its logs, `updraft fleet abort` sends all drones home",
                words.join(", ")
            )
        })
    }

    /// Takes back a start that an earlier flight has left on drones of this one that stand disarmed: it
    /// would stand in the way of all that comes. Nobody else's drones are told.
    pub(crate) fn clear_leftover(&mut self) -> Result<(), WorkflowError> {
        let drones = self.drones();
        let has_start = |crew: &Self, drone: &DroneId| {
            let status = crew.telemetry.get(*drone).and_then(|known| known.status);
            crew.net.is_disarmed(*drone)
                && status.is_some_and(|(_, status)| {
                    status.start_tow_s >= 0 || status.has(flag::AUTHORIZED)
                })
        };
        let left: BTreeSet<DroneId> =
            drones.into_iter().filter(|drone| has_start(self, drone)).collect();
        if left.is_empty() {
            return Ok(());
        }
        let none =
            StartConfig { start_tow_s: CLEAR_TIME, authorization: 0, countdown_ms: CLEAR_TIME };
        let until = self.net.now() + CLEARED_WITHIN;
        let mut open = left.clone();
        while !open.is_empty() && self.net.now() < until {
            self.host.check_stop()?;
            for drone in &open {
                self.net.send(*drone, &start_packet(&none))?;
            }
            let next = self.net.now() + 200 * MS;
            while let Some(received) = self.net.recv(next)? {
                self.telemetry.on_message(self.net.now(), &received);
            }
            open.retain(|drone| has_start(self, drone));
        }
        let names = |drones: &BTreeSet<DroneId>| {
            drones.iter().map(ToString::to_string).collect::<Vec<_>>().join(", ")
        };
        if open.is_empty() {
            self.host.say(&format!(
                "Cancelled a start left over from an earlier flight: drones {}",
                names(&left)
            ));
        } else {
            self.host.warn(&format!(
                "drones {} still have a start from an earlier flight, and it could not be cancelled",
                names(&open)
            ));
        }
        Ok(())
    }

    /// Whether everyone of the table stands disarmed, without a start that is still to come.
    fn all_are_down(&self) -> bool {
        self.drones().into_iter().all(|drone| self.net.state(drone) == State::Ground)
    }

    /// Listens until everyone of the table is heard, or for `wait_s` as long as nobody flies.
    fn hear_all(&mut self, wait_s: f64) -> Result<(), WorkflowError> {
        let until = self.net.now() + (wait_s * 1e6) as Micros;
        let missing = |crew: &Self| {
            let mut all = crew.drones().into_iter();
            all.any(|drone| crew.net.state(drone) == State::Unheard)
        };
        while self.net.now() < until
            && missing(self)
            && self.net.in_the_air(self.drones(), false).is_empty()
        {
            self.host.check_stop()?;
            let wait = self.net.now() + 100 * MS;
            let telemetry = &mut self.telemetry;
            hear_together(&mut self.net, wait, |now, received| {
                telemetry.on_message(now, received);
            })?;
        }
        Ok(())
    }

    /// Finds out what is in the air: who flies which slot, and since when.
    pub(crate) fn attach(&mut self, wait_s: f64) -> Result<Found, WorkflowError> {
        self.table = FleetTable::read(&self.folder.0)?;
        self.net.set_fleet(self.drones());
        self.host.news(&News::Assigned(&self.table));
        self.attached = true;
        self.greet()?;
        self.hear_all(wait_s)?;
        if let Some(start) = self.flown_before()? {
            return Ok(Found::Over(start));
        }
        let start = self.start_in_the_air()?;
        let nobody = self
            .drones()
            .into_iter()
            .all(|drone| matches!(self.net.state(drone), State::Ground | State::Unheard));
        match start {
            Some(start) => self.host.say(&format!("Watching: the start is {}", time_of_day(start))),
            None if nobody => {
                return Err(WorkflowError::Nothing(
                    "no drone is in the air or has a start: fly with `updraft fly`, or download \
                     the logs of a finished flight with `updraft logs pull`"
                        .to_owned(),
                ));
            }
            None => self.host.warn(
                "neither the drones nor logs/start.json say when the flight started: the drones \
                 are watched, but not compared with their trajectories",
            ),
        }
        self.remember(start)?;
        let text = start.map(|start| format!("start at {}", start.tow_ms / 1000));
        self.note("attached", text)?;
        Ok(Found::Flight(Start::attached(self.drones(), start)))
    }

    /// Who was in the air before this station came, by the journal of the one before it.
    fn remember(&mut self, start: Option<GpsTime>) -> Result<(), WorkflowError> {
        let record = StartRecord::read(self.folder)?;
        let Some(record) = record.filter(|record| Some(record.start) == start) else {
            return Ok(());
        };
        match read_journal(&self.folder.0) {
            Ok(entries) => {
                let since_unix_us = record.authorized_unix_s.saturating_mul(1_000_000);
                let seen = seen_in_the_air(&entries, since_unix_us);
                self.flew.extend(seen.flew);
                self.fell.extend(seen.fell);
                let orders = [Action::Return, Action::Land].map(word);
                self.ordered_before.extend(drones_of_steps(&entries, since_unix_us, &orders));
            }
            Err(error) => self.host.warn(&format!(
                "{}; drones that have landed already are told to be on the ground",
                with_causes(&error, ": ")
            )),
        }
        Ok(())
    }

    /// The start that was written down, if it has passed and all its drones are down.
    fn flown_before(&self) -> Result<Option<GpsTime>, WorkflowError> {
        let Some(record) = StartRecord::read(self.folder)? else { return Ok(None) };
        let passed = self.gps_ms().is_some_and(|now_ms| record.start.total_ms() < now_ms);
        Ok((passed && self.all_are_down()).then_some(record.start))
    }

    /// GPS time by the drones' clocks, ms.
    fn gps_ms(&self) -> Option<i64> {
        let now = self.net.now();
        let clock = |drone: DroneId| self.telemetry.get(drone)?.clock.gps_ms(now);
        let clocks = self.drones().into_iter().filter_map(clock).collect();
        upper_median(clocks).map(|gps_ms| gps_ms as i64)
    }

    /// The start by the word of most drones, else as it was written down.
    fn start_in_the_air(&self) -> Result<Option<GpsTime>, WorkflowError> {
        let drones = self.drones();
        let known = || drones.iter().filter_map(|drone| self.telemetry.get(*drone));
        let gps_ms = self.gps_ms();
        let near = |start: &GpsTime| {
            gps_ms.is_none_or(|now_ms| (start.total_ms() - now_ms).abs() < NEAR_MS)
        };
        let mut votes: BTreeMap<i32, usize> = BTreeMap::new();
        for (_, status) in known().filter_map(|of| of.status) {
            if status.start_tow_s >= 0 {
                *votes.entry(status.start_tow_s).or_default() += 1;
            }
        }
        let said = votes.into_iter().max_by_key(|(_, count)| *count).map(|(tow_s, _)| tow_s);
        let record = StartRecord::read(self.folder)?.map(|record| record.start);
        let Some((said, gps_ms)) = said.zip(gps_ms) else { return Ok(record.filter(near)) };
        let week_ms = i64::from(WEEK_S) * 1000;
        let this_week_ms = gps_ms.div_euclid(week_ms) * week_ms + i64::from(said) * 1000;
        let of_weeks = [this_week_ms - week_ms, this_week_ms, this_week_ms + week_ms];
        let nearest = of_weeks.into_iter().min_by_key(|start_ms| (start_ms - gps_ms).abs());
        Ok(nearest.and_then(GpsTime::from_total_ms))
    }
}
