//! How work ends that did not fail.

/// How work ended that did not fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Ending {
    /// All was done.
    Done,
    /// It was done, but something was lost: a drone, a log, a part of the results. What, was told.
    Losses,
    /// A check failed, or somebody said no: nothing was started.
    NoGo,
}

impl Ending {
    /// [`Ending::Losses`] if something was lost.
    pub fn of_losses(lost: bool) -> Self {
        if lost { Self::Losses } else { Self::Done }
    }
}
