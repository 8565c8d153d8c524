//! Campaigns of several flights.

mod air;
