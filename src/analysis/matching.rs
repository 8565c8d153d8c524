//! Which log belongs to which slot of a plan.

use std::collections::BTreeSet;
use std::path::Path;

use crate::base::frame::Geodetic;
use crate::mission::plan::Plan;

/// What a log says about who wrote it.
#[derive(Clone, Debug, Default)]
pub(super) struct Candidate {
    pub(super) given: Option<u16>,
    pub(super) system_id: Option<u8>,
    pub(super) file_number: Option<u16>,
    pub(super) first_fix_deg: Option<(f64, f64)>,
}

/// The number in a file name: the last run of digits of `drone-07.BIN`.
pub(super) fn file_number(path: &Path) -> Option<u16> {
    let stem = path.file_stem()?.to_string_lossy().into_owned();
    let end = stem.rfind(|c: char| c.is_ascii_digit())? + 1;
    let head = stem.get(..end)?;
    let start = head.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |last| {
        last + head.get(last..).and_then(|tail| tail.chars().next()).map_or(1, char::len_utf8)
    });
    head.get(start..)?.parse().ok()
}

type Way<'a> = &'a dyn Fn(&Candidate) -> Option<u16>;

/// Slot of each log. Given slots stand. For the others the first of these ways that gives every one
/// of them its own slot of the plan is taken: system id, number in the file name, nearest home.
/// Without such a way each log takes the first way that leads to a slot still free.
pub(super) fn slots(plan: &Plan, logs: &[Candidate]) -> Vec<Option<u16>> {
    let mut taken: BTreeSet<u16> = logs.iter().filter_map(|log| log.given).collect();
    let open: Vec<usize> = (0..logs.len()).filter(|i| logs[*i].given.is_none()).collect();
    let mut result: Vec<Option<u16>> = logs.iter().map(|log| log.given).collect();
    let by_id = |log: &Candidate| log.system_id.map(u16::from).filter(|s| plan.slot(*s).is_some());
    let by_name = |log: &Candidate| log.file_number.filter(|slot| plan.slot(*slot).is_some());
    let by_place = |log: &Candidate| nearest_home(plan, log.first_fix_deg?);
    let ways: [Way<'_>; 3] = [&by_id, &by_name, &by_place];
    for way in ways {
        let found: Vec<Option<u16>> = open.iter().map(|index| way(&logs[*index])).collect();
        let mut all = taken.clone();
        if found.iter().all(|slot| slot.is_some_and(|slot| all.insert(slot))) {
            for (index, slot) in open.iter().zip(found) {
                result[*index] = slot;
            }
            return result;
        }
    }
    for index in open {
        let free = ways.iter().filter_map(|way| way(&logs[index])).find(|s| !taken.contains(s));
        taken.extend(free);
        result[index] = free;
    }
    result
}

/// The slot whose home is nearest, if it is nearer than half the smallest distance between homes.
fn nearest_home(plan: &Plan, fix_deg: (f64, f64)) -> Option<u16> {
    let (lat_deg, lon_deg) = fix_deg;
    let amsl_m = plan.site.ground_amsl_m;
    let place = plan.site.frame().from_geodetic(Geodetic { lat_deg, lon_deg, amsl_m });
    let mut distances: Vec<(f64, u16)> = plan
        .slots
        .iter()
        .map(|slot| ((slot.home_m[0] - place.x).hypot(slot.home_m[1] - place.y), slot.slot))
        .collect();
    distances.sort_by(|left, right| left.0.total_cmp(&right.0));
    let (nearest, slot) = *distances.first()?;
    let limit_m = match distances.get(1) {
        // The nearest home must be clearly nearer than the next one.
        Some((second, _)) => (second / 2.0).min(5.0),
        None => 100.0,
    };
    (nearest < limit_m).then_some(slot)
}

#[cfg(test)]
mod tests {
    use super::file_number;
    use std::path::Path;

    #[test]
    fn file_names_give_their_last_number() {
        for (name, number) in [
            ("07.BIN", Some(7)),
            ("logs/drone-12.bin", Some(12)),
            ("2026-05-01 drone 3.BIN", Some(3)),
            ("dröhne4ü.BIN", Some(4)),
            ("ladder-still.BIN", None),
            ("99999999.BIN", None),
        ] {
            assert_eq!(file_number(Path::new(name)), number, "{name}");
        }
    }
}
