//! What a flight and its log say.

mod ladder;
mod log;
