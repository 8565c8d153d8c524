//! Estimate of the time to an answer (Jacobson's, as in TCP).

use crate::link::clock::{MS, Micros, S};

const FIRST: Micros = S;
const LEAST: Micros = 60 * MS;
const MOST: Micros = 8 * S;

/// Estimate of the time to an answer and of its spread.
#[derive(Clone, Copy, Debug, Default)]
pub struct Rtt {
    /// Smoothed, and its mean deviation, us.
    seen: Option<(f64, f64)>,
}

impl Rtt {
    /// Counts an answer that took this time, us. Only for requests that were sent once.
    pub fn add(&mut self, took: Micros) {
        let took = took as f64;
        self.seen = Some(match self.seen {
            None => (took, took / 2.0),
            Some((mean, deviation)) => {
                let error = took - mean;
                (mean + error / 8.0, deviation + (error.abs() - deviation) / 4.0)
            }
        });
    }

    /// Whether any answer was timed.
    pub fn is_known(&self) -> bool {
        self.seen.is_some()
    }

    /// Time after which an answer counts as lost, us.
    pub fn timeout(&self) -> Micros {
        let time = self
            .seen
            .map_or(FIRST, |(mean, deviation)| (mean + 4.0 * deviation).max(1.5 * mean) as Micros);
        time.clamp(LEAST, MOST)
    }
}
