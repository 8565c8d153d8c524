//! Logs of the real firmware, analysed.

mod ladder;
mod short;
mod support;
