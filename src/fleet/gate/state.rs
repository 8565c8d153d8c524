//! State of a drone, as far as orders are concerned. An unknown state counts as flying.

use crate::fleet::telemetry::SILENT_AFTER;
use crate::link::clock::{Micros, S};
use crate::link::frame::{MavMessage, dialect};
use crate::protocol::show::{FROM_DRONE, Stage, Status, flag};

/// State of a drone, as far as orders are concerned, from the safest on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    /// Disarmed, and nothing makes the drone take off without an order.
    Ground,
    /// Disarmed, with an authorized start: the drone arms at any moment.
    Waiting,
    /// Armed, still waiting for its start.
    Armed,
    /// Armed: the drone flies, or may be flying.
    Flying,
    /// No fresh heartbeat: the drone may be flying.
    Unheard,
}

/// What was heard of a drone.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Seen {
    /// When, and whether it was armed.
    beat: Option<(Micros, bool)>,
    status: Option<(Micros, Status)>,
}

impl Seen {
    pub(super) fn on_message(&mut self, now: Micros, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(beat) => {
                let armed = dialect::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED;
                self.beat = Some((now, beat.base_mode.contains(armed)));
            }
            MavMessage::DATA16(data) if data.mavtype == FROM_DRONE => {
                let length = usize::from(data.len).min(data.data.len());
                self.status = Some((now, Status::from_data(&data.data[..length])));
            }
            _ => {}
        }
    }

    fn fresh<T: Copy>(value: Option<(Micros, T)>, now: Micros) -> Option<T> {
        value.filter(|(at, _)| now.saturating_sub(*at) <= SILENT_AFTER).map(|(_, value)| value)
    }

    /// Its motors stand still, by a heartbeat that is fresh.
    pub(super) fn is_disarmed(&self, now: Micros) -> bool {
        Self::fresh(self.beat, now) == Some(false)
    }

    pub(super) fn state(&self, now: Micros) -> State {
        let Some(armed) = Self::fresh(self.beat, now) else { return State::Unheard };
        let status = Self::fresh(self.status, now);
        let stage = status.map(|status| status.stage);
        // What was said of a flight before the motors stopped says nothing any more.
        let is_older = self.status.map(|(at, _)| at) < self.beat.map(|(at, _)| at);
        let waits = matches!(stage, Some(Stage::Init | Stage::WaitForStart));
        let starts = status.is_some_and(|of| of.has(flag::AUTHORIZED) && of.start_tow_s >= 0);
        match (armed, waits) {
            (true, true) => State::Armed,
            (true, false) => State::Flying,
            (false, _) if !is_older && stage.is_some_and(Stage::is_flying) => State::Flying,
            (false, true) if starts => State::Waiting,
            (false, _) => State::Ground,
        }
    }

    /// In words, as they follow its name.
    pub(super) fn words(&self, now: Micros) -> String {
        let stage = Self::fresh(self.status, now).map(|status| status.stage);
        match (self.state(now), stage) {
            (State::Ground, _) => "is disarmed".to_owned(),
            (State::Waiting, _) => "is about to take off (its start is authorized)".to_owned(),
            (State::Armed, _) => "is armed and about to take off".to_owned(),
            (State::Flying, Some(stage)) if stage.is_flying() => format!("is flying ({stage})"),
            (State::Flying, _) => "is armed and may be flying".to_owned(),
            (State::Unheard, _) => match self.beat {
                Some((at, _)) => {
                    format!("has not been heard for {} s", now.saturating_sub(at) / S)
                }
                None => "was never heard".to_owned(),
            },
        }
    }

    /// It was heard once and may be again.
    pub(super) fn was_heard(&self) -> bool {
        self.beat.is_some()
    }
}
