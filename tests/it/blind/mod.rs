//! Flights with hidden physics: drawn, flown, sealed, scored.

mod flight;
mod foreign;
mod play;
mod score;
mod worlds;
