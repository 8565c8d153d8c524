//! The steps of a flight one by one, over the drones' own links.

use std::collections::BTreeMap;

use super::crew::Crew;
use super::start::{Lead, fly_now};
use crate::fleet::preflight::Preflight;
use crate::link::id::DroneId;
use crate::workflow::ending::Ending;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::words;

/// How a step is to be taken.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepWish {
    /// Whether parameters are set that must be others.
    pub(crate) set_params: bool,
    /// Whether it is found anew which drone flies which slot.
    pub(crate) assign: bool,
    /// How long drones are waited for, s.
    pub(crate) wait_s: f64,
}

/// Asks for clocks and finds slots; refuses to go on when a drone stands wrong.
fn prepare(crew: &mut Crew<'_>, wish: StepWish) -> Result<(), WorkflowError> {
    crew.greet()?;
    if crew.assign(wish.assign)? {
        return Ok(());
    }
    Err(WorkflowError::Unsafe("nothing was sent: the drones do not stand as planned".to_owned()))
}

/// The table of drones that were loaded by an earlier command.
pub(crate) fn preflight(crew: &mut Crew<'_>, wish: StepWish) -> Result<Preflight, WorkflowError> {
    prepare(crew, wish)?;
    look(crew, wish)
}

/// The table of drones whose slots are known.
fn look(crew: &mut Crew<'_>, wish: StepWish) -> Result<Preflight, WorkflowError> {
    crew.params(wish.set_params)?;
    crew.look_at_files()?;
    crew.preflight(wish.wait_s)
}

/// Loads show, origin and fence. The drones that refused, with their reasons.
pub(crate) fn upload(
    crew: &mut Crew<'_>,
    wish: StepWish,
) -> Result<(BTreeMap<DroneId, String>, Ending), WorkflowError> {
    prepare(crew, wish)?;
    let refused = crew.upload()?;
    // The fence's own switch is one of the parameters.
    let right = crew.params(wish.set_params)?;
    let ending = uploaded(refused.is_empty(), right, wish.set_params);
    Ok((refused, ending))
}

/// How an upload ends. If parameters are not to be set, none is lost.
fn uploaded(all_loaded: bool, params_right: bool, set_params: bool) -> Ending {
    Ending::of_losses(!(all_loaded && (params_right || !set_params)))
}

/// How a start ended.
pub(crate) enum Started {
    /// Something is not right: nothing was started.
    NoGo(Preflight),
    /// It was flown.
    Flown(Ending),
}

/// Starts drones that were loaded by an earlier command, and watches their flight.
pub(crate) fn start(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    wish: StepWish,
    lead: &Lead,
) -> Result<Started, WorkflowError> {
    crew.listen(wish.wait_s)?;
    if let Some(words) = crew.in_flight() {
        return Err(WorkflowError::Unsafe(words));
    }
    prepare(crew, wish)?;
    crew.clear_leftover()?;
    let table = look(crew, wish)?;
    crew.not_ordered_down()?;
    if !table.go() {
        return Ok(Started::NoGo(table));
    }
    fly_now(host, crew, lead).map(|(ending, _)| Started::Flown(ending))
}

/// Puts parameters back that were changed; those that leave a drone without a fence only with
/// `fence_off`.
pub(crate) fn restore(
    host: &dyn Host,
    crew: &mut Crew<'_>,
    fence_off: bool,
) -> Result<Ending, WorkflowError> {
    let (put_back, left) = crew.restore(fence_off)?;
    if left.is_empty() {
        host.say("Parameters have their old values");
        return Ok(Ending::Done);
    }
    host.insist(&match put_back {
        0 => "No parameter was restored, for the reasons above".to_owned(),
        drones => format!(
            "Restored on {}; not on all of {}, for the reasons above",
            words::count(drones, "drone"),
            words::count(left.len(), "drone")
        ),
    });
    Ok(Ending::Losses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_that_could_not_be_set_are_a_loss_where_they_were_to_be_set() {
        assert_eq!(uploaded(true, true, true), Ending::Done);
        assert_eq!(uploaded(true, false, true), Ending::Losses);
        assert_eq!(uploaded(true, false, false), Ending::Done);
        assert_eq!(uploaded(false, true, false), Ending::Losses);
    }
}
