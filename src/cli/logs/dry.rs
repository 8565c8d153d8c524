//! Dry run of a pull: the logs that it would ask for.

use std::collections::BTreeMap;

use super::PullArgs;
use crate::base::plain::Shown as _;
use crate::campaign::FlightFolder;
use crate::fleet::logs::one::Which;
use crate::mission::Plan;

/// By slot: which drone stands there, only the drones know.
pub(super) fn lines(
    folder: &FlightFolder,
    plan: &Plan,
    args: &PullArgs,
) -> BTreeMap<String, Vec<String>> {
    let what = match args.log {
        Which::Flight => "its log of this flight".to_owned(),
        Which::Newest => "its newest log".to_owned(),
        Which::All => "all of its logs".to_owned(),
        Which::Number(number) => format!("its log {number}"),
    };
    let is_meant = |slot: u16| args.slots.as_ref().is_none_or(|slots| slots.contains(slot));
    let mut lines = BTreeMap::new();
    for slot in plan.slots.iter().map(|slot| slot.slot).filter(|slot| is_meant(*slot)) {
        let path = folder.log(slot, plan.slots.len());
        let place = path.strip_prefix(&folder.0).unwrap_or(&path).shown();
        let line = if path.exists() && !args.again && args.log == Which::Flight {
            format!("the list of its logs, and what {place} is missing")
        } else {
            format!("the list of its logs, and {what}, for {place}")
        };
        lines.insert(format!("on slot {slot}"), vec![line]);
    }
    lines
}
