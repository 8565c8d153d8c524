//! Endings of work that did not fail.

/// Ending of work that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Ending {
    /// All of the work was done.
    Done,
    /// The work was done, but something was lost: a drone, a log, a part of the results. The host
    /// was told what.
    Losses,
    /// A check failed, or a person said no: nothing was started.
    NoGo,
}

impl Ending {
    /// [`Ending::Losses`] if something was lost.
    pub fn of_losses(lost: bool) -> Self {
        if lost { Self::Losses } else { Self::Done }
    }
}
