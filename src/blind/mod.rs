//! The blind benchmark: flights with hidden physics, a verdict on each, and only then the truth.
//!
//! The hidden side is a path of its own. Its flights are whole closed-loop flights of the simulator
//! at another step of the plant, with effects in their full form (the search's library has their
//! closed forms), with random air, gusts, noise, spread between drones and missing logs; some hide
//! physics that no library lists ([`foreign`]). In foreign worlds ([`worlds`]) the plant, too, is another.
//! What the search gets is a flight folder like any
//! other: template, vehicle, plan and `.BIN` logs ([`fly`]). The truth is sealed ([`seal`]): its hash
//! is published before the flight is flown, and it is opened only when a verdict is on the disk.
//! [`score`] compares one verdict with the truth, [`table`] many. [`game`] is one such flight for
//! strangers, with what they choose, and [`record`] what came of it.

pub mod air;
pub mod classes;
pub mod error;
pub mod explain;
pub mod fly;
pub mod foreign;
pub mod game;
pub mod hide;
pub mod interval;
mod metrics;
pub mod play;
pub mod record;
pub mod rehearse;
pub mod render;
pub mod scenario;
pub mod score;
pub mod seal;
pub mod series;
pub mod table;
pub mod tables;
pub mod told;
pub mod vehicles;
pub mod worlds;

pub use error::BlindError;
pub use explain::Explain;
pub use scenario::{AirClass, Base, Cell, Protocol, Scenario};
pub use worlds::Worlds;
