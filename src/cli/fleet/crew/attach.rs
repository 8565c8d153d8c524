//! Takes over the watch of a flight that another station has started.

use std::collections::BTreeMap;

use super::Crew;
use crate::base::time::{GpsTime, WEEK_S};
use crate::campaign::start::StartRecord;
use crate::cli::exit::CommandError;
use crate::cli::fleet::tables::time_of_day;
use crate::fleet::gate::State;
use crate::fleet::slots::FleetTable;
use crate::fleet::start::Start;
use crate::link::net::Net as _;

/// A start that was written down is that of the flight in the air if it is no longer ago, or no
/// further ahead, ms.
const NEAR_MS: i64 = 12 * 3_600_000;

impl Crew<'_> {
    /// Why no flight is started: drones are in the air. `None`: there are none.
    pub(in crate::cli) fn in_flight(&self) -> Option<String> {
        let heard: Vec<_> = self.telemetry.drones.keys().copied().collect();
        let flying = self.net.in_the_air(heard, false);
        let words: Vec<String> =
            flying.iter().map(|(drone, words)| format!("drone {drone} {words}")).collect();
        (!words.is_empty()).then(|| {
            format!(
                "{}: nothing was sent. `updraft fleet watch` follows the flight and brings its logs, \
                 `updraft fleet abort` sends everyone home",
                words.join(", ")
            )
        })
    }

    /// Finds out what is in the air: who flies which slot, and since when.
    pub(in crate::cli) fn attach(&mut self) -> Result<Start, CommandError> {
        self.table = FleetTable::read(&self.folder.0)?;
        self.net.set_fleet(self.drones());
        self.attached = true;
        self.greet()?;
        let start = self.start_in_the_air()?;
        let nobody = self
            .drones()
            .into_iter()
            .all(|drone| matches!(self.net.state(drone), State::Ground | State::Unheard));
        match start {
            Some(start) => self.context.say(&format!("Watching: the start is {}", time_of_day(start))),
            None if nobody => {
                return Err(CommandError::Nothing(
                    "nobody is in the air, and no drone has a start: `updraft fly` flies, `updraft \
                     logs pull` brings the logs of a flight that is over"
                        .to_owned(),
                ));
            }
            None => self.context.warn(
                "no drone says when it started, and logs/start.json does not: they are watched, but \
                 not held against their trajectories",
            ),
        }
        let text = start.map(|start| format!("start at {}", start.tow_ms / 1000));
        self.note("attached", text)?;
        Ok(Start::attached(self.drones(), start))
    }

    /// The start by the word of most drones, else as it was written down.
    fn start_in_the_air(&self) -> Result<Option<GpsTime>, CommandError> {
        let now = self.net.now();
        let drones = self.drones();
        let known = || drones.iter().filter_map(|drone| self.telemetry.get(*drone));
        let mut clocks: Vec<f64> = known().filter_map(|of| of.clock.gps_ms(now)).collect();
        clocks.sort_by(f64::total_cmp);
        let gps_ms = clocks.get(clocks.len() / 2).map(|gps_ms| *gps_ms as i64);
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
