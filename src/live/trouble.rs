//! How bad a drone's state is, and why.

use super::view::Level;
use crate::fleet::telemetry::Drone;
use crate::fleet::watch::{Flying, Limits};
use crate::link::clock::{Micros, S};
use crate::protocol::show::{Stage, flag};

/// Loss of messages that is worth a look, %.
const LOSSY_PERCENT: f64 = 20.0;
/// Fewest satellites that are enough.
const SATELLITES: u8 = 6;

/// State of a drone that is judged.
#[derive(Clone, Copy, Debug)]
pub struct Looked<'a> {
    /// Time, us.
    pub now: Micros,
    /// The drone, if it was ever heard.
    pub drone: Option<&'a Drone>,
    /// Flight of the drone, if it is watched.
    pub flying: Option<Flying>,
    /// Limits of the watch.
    pub limits: &'a Limits,
    /// Whether it has a slot.
    pub has_slot: bool,
}

/// The worst that is wrong with a drone, in a few words.
pub fn trouble(looked: &Looked<'_>) -> (Level, String) {
    let Some(drone) = looked.drone else {
        return (Level::Warning, "not heard yet".to_owned());
    };
    let flying = looked.flying.unwrap_or_default();
    let in_the_air = drone.is_armed() == Some(true);
    let mut worst = (Level::Good, String::new());
    let mut add = |level: Level, words: String| {
        if level > worst.0 {
            worst = (level, words);
        }
    };
    let silence = looked.now.saturating_sub(drone.heard);
    if flying.fell {
        add(Level::Alarm, "came down: restarted in the air".to_owned());
    }
    if silence > looked.limits.silent {
        let level = if in_the_air { Level::Alarm } else { Level::Warning };
        add(level, format!("silent for {} s", silence / S));
    }
    if let Some((_, status)) = drone.status {
        if status.has(flag::FENCE_BREACHED) {
            add(Level::Alarm, "has left its fence".to_owned());
        }
        if status.stage == Stage::Error {
            add(Level::Alarm, "has given up the show".to_owned());
        }
    }
    if let Some(distance_m) = flying.distance_m.filter(|far_m| *far_m > looked.limits.far_m) {
        add(Level::Alarm, format!("{distance_m:.1} m off its trajectory"));
    }
    let health = drone.health.map(|(_, health)| health);
    if let Some(percent) = health.and_then(|health| health.battery_percent)
        && f64::from(percent) < looked.limits.battery_percent
    {
        add(Level::Alarm, format!("battery {percent} %"));
    }
    if health.and_then(|health| health.prearm_ok) == Some(false) && !in_the_air {
        let why = drone.prearm_reason().unwrap_or("arming checks fail");
        add(Level::Warning, why.to_owned());
    }
    if let Some((_, gps)) = drone.gps {
        if gps.fix < 3 {
            add(Level::Warning, "no GPS fix".to_owned());
        } else if gps.satellites < SATELLITES {
            add(Level::Notice, format!("{} satellites", gps.satellites));
        }
    }
    if let Some(quality) = drone.link_quality() {
        let loss = 100.0 * (1.0 - quality);
        if loss > LOSSY_PERCENT {
            add(Level::Notice, format!("loses {loss:.0} % of its messages"));
        }
    }
    if !looked.has_slot {
        add(Level::Notice, "has no slot".to_owned());
    }
    worst
}
