//! Flights that pages look at.

use super::facts::Facts;
use super::http::guard::Rank;
use super::orders::{Said, Wish};
use super::view::View;

/// A flight that can be looked at, by several threads.
pub trait Source: Send + Sync {
    /// Facts that do not change: plan, fence, trajectories.
    fn facts(&self) -> Facts;

    /// The flight now; `now_ms`: time of the station, ms since 1970.
    fn view(&self, now_ms: u64) -> View;

    /// Carries out what a page wishes, if its rank allows that.
    ///
    /// # Errors
    /// Why it is not carried out.
    fn wish(&self, rank: Rank, wish: &Wish) -> Said;
}
