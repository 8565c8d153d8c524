//! Wait for a log that is still being written: its size right after a download does not count what
//! the autopilot still holds. The firmware writes on for 15 s after disarming, and pauses while
//! logs are listed and downloaded.

use std::collections::BTreeMap;
use std::time::Duration;

use super::Puller;
use super::one::number;
use crate::fleet::logs::manifest::AtHome;
use crate::link::clock::Micros;
use crate::skybrush_server::{Client, LogEntry};
use crate::workflow::error::WorkflowError;
use crate::workflow::words;

/// The firmware closes a log so long after a flight, and a moment.
const WAIT: Duration = Duration::from_secs(18);
/// A log that grows for longer is not waited for.
const ROUNDS: usize = 3;
/// A log whose own time is older than this is closed, s: one that is open has the time of now.
const OLD_S: i64 = 120;
/// An idle autopilot adds so much at most while it is waited for: a parameter now and then.
const TRICKLE: u64 = 512;
const NAP: Duration = Duration::from_millis(100);

impl Puller<'_> {
    /// Waits until the newest logs that are to come do not grow any more. What the server does not
    /// answer here it will not answer later, where it is told.
    pub(super) fn settle(&mut self, client: &mut Client) -> Result<(), WorkflowError> {
        let open = self.ones.iter().filter(|(_, one)| !one.over);
        let ids: Vec<String> = open.map(|(id, _)| id.clone()).collect();
        if ids.is_empty() {
            return Ok(());
        }
        let mut sizes = self.newest(client, &ids);
        let now_s = (self.host.clock().unix_us() / 1_000_000) as i64;
        sizes.retain(|id, log| {
            let is_old = log.unix_s.is_some_and(|time| time + OLD_S < now_s);
            !is_old && (self.wish.again || !self.is_home(id, log))
        });
        for _ in 0..ROUNDS {
            if sizes.is_empty() {
                return Ok(());
            }
            self.host.say(&format!(
                "The autopilots keep writing for a while after a flight: waiting {} s for {}",
                WAIT.as_secs(),
                words::count(sizes.len(), "log")
            ));
            let clock = self.host.clock();
            let until = clock.now() + WAIT.as_micros() as Micros;
            while clock.now() < until {
                self.host.check_stop()?;
                clock.pause(NAP);
            }
            let ids: Vec<String> = sizes.keys().cloned().collect();
            let now = self.newest(client, &ids);
            self.host.check_stop()?;
            sizes = now
                .into_iter()
                .filter(|(id, log)| {
                    sizes.get(id).is_some_and(|before| {
                        before.id != log.id || before.size + TRICKLE < log.size
                    })
                })
                .collect();
        }
        for id in sizes.keys() {
            if let Some(one) = self.ones.get_mut(id) {
                one.grows = true;
            }
        }
        Ok(())
    }

    fn newest(&self, client: &mut Client, ids: &[String]) -> BTreeMap<String, LogEntry> {
        let listed = client.logs(ids, || !self.host.is_stopped()).unwrap_or_default();
        let newest = |(id, logs): (String, Result<Vec<LogEntry>, String>)| {
            Some((id, logs.ok()?.into_iter().max_by_key(number)?))
        };
        listed.into_iter().filter_map(newest).collect()
    }

    /// Whether a log of this size and number is home.
    fn is_home(&self, id: &str, log: &LogEntry) -> bool {
        self.ones.get(id).is_some_and(|one| match &one.home {
            AtHome::Intact(entry) => {
                entry.size_bytes == log.size && entry.boot == Some(number(log))
            }
            _ => false,
        })
    }
}
