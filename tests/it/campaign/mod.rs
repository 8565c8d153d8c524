//! Campaigns of several flights.

mod air;
mod legs;
