//! Lists of names that end in numbers, in as few words as tell them all.

use std::fmt::Write as _;

/// Ranges and names that a list has at most.
const MOST: usize = 20;

/// All of these names: `Drone 3`, `Drone 1 and Drone 2`, `drones 1-12, 14 and 16`, `A, B and C`. Names that are the
/// same but for a number at their end are told by ranges of these (`1:1-250, 2:1-250`); names of another kind one by
/// one, and beyond the twentieth by their number.
///
/// ```
/// use untrusted_io::names::listed;
/// assert_eq!(listed(["Drone 1", "Drone 2", "Drone 3", "Drone 7"]), "drones 1-3 and 7");
/// assert_eq!(listed(["Drone 7", "Drone 3"]), "Drone 3 and Drone 7");
/// assert_eq!(listed(["left", "right", "7"]), "left, right and 7");
/// ```
pub fn listed<'a>(names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names: Vec<&str> = names.into_iter().collect();
    let Some(numbered) = numbered(&names) else {
        if let Some(several) = several_stems(&names) {
            return several;
        }
        let mut seen = std::collections::BTreeSet::new();
        names.retain(|name| seen.insert(*name));
        return joined(names.iter().map(|name| (*name).to_owned()).collect(), names.len());
    };
    let (stem, mut numbers) = numbered;
    numbers.sort_unstable();
    numbers.dedup();
    match numbers[..] {
        [one] => format!("{stem}{one}"),
        [one, other] => format!("{stem}{one} and {stem}{other}"),
        _ => {
            let plural =
                stem.strip_suffix(' ').filter(|noun| !noun.is_empty() && !noun.contains(' '));
            let stem =
                plural.map_or_else(|| stem.to_owned(), |noun| format!("{}s ", lowered(noun)));
            format!("{stem}{}", ranges(&numbers))
        }
    }
}

/// Lines that begin with this noun and a number, and say the same, as one line: `drones 1-12 and 14: no GPS`. Others stay
/// as they are; the order is that in which things were first said.
///
/// ```
/// use untrusted_io::names::together;
/// let lines = ["drone 1: no GPS", "the wind is strong", "drone 2: no GPS", "drone 3 is late", "drone 4: no GPS"];
/// assert_eq!(
///     together("drone", lines),
///     ["drones 1, 2 and 4: no GPS", "the wind is strong", "drone 3 is late"]
/// );
/// ```
pub fn together<'a>(noun: &str, lines: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let mut groups: Vec<(Vec<u64>, &str)> = Vec::new();
    for line in lines {
        let split =
            line.strip_prefix(noun).and_then(|rest| rest.strip_prefix(' ')).and_then(|rest| {
                let after = rest.trim_start_matches(|c: char| c.is_ascii_digit());
                let number: u64 = rest.get(..rest.len() - after.len())?.parse().ok()?;
                after.starts_with([':', ' ', ',']).then_some((number, after))
            });
        let Some((number, after)) = split else {
            groups.push((Vec::new(), line));
            continue;
        };
        match groups.iter_mut().find(|(numbers, said)| !numbers.is_empty() && *said == after) {
            Some((numbers, _)) => numbers.push(number),
            None => groups.push((vec![number], after)),
        }
    }
    let line = |(mut numbers, said): (Vec<u64>, &str)| {
        numbers.sort_unstable();
        numbers.dedup();
        match numbers[..] {
            [] => said.to_owned(),
            [one] => format!("{noun} {one}{said}"),
            _ => format!("{noun}s {}{said}", ranges(&numbers)),
        }
    };
    groups.into_iter().map(line).collect()
}

/// Numbers as ranges: `1-12, 14 and 16`; beyond the twentieth range by how many numbers follow.
///
/// ```
/// assert_eq!(untrusted_io::names::ranges(&[1, 2, 3, 5, 6, 9]), "1-3, 5, 6 and 9");
/// ```
pub fn ranges(sorted: &[u64]) -> String {
    let mut runs: Vec<(u64, u64)> = Vec::new();
    for number in sorted {
        match runs.last_mut() {
            Some((_, last)) if *last == *number => {}
            Some((_, last)) if last.checked_add(1) == Some(*number) => *last = *number,
            _ => runs.push((*number, *number)),
        }
    }
    let mut parts = Vec::with_capacity(runs.len());
    let mut told = 0;
    for (from, to) in runs {
        if parts.len() >= MOST {
            break;
        }
        told += usize::try_from(to - from).unwrap_or(usize::MAX).saturating_add(1);
        match to - from {
            0 => parts.push(from.to_string()),
            1 => parts.extend([from.to_string(), to.to_string()]),
            _ => parts.push(format!("{from}-{to}")),
        }
    }
    let all = sorted.len().max(told);
    let left = all - told;
    if left > 0 { format!("{} and {left} more", parts.join(", ")) } else { and(&parts) }
}

fn joined(mut parts: Vec<String>, all: usize) -> String {
    if parts.len() > MOST {
        parts.truncate(MOST);
        let mut text = parts.join(", ");
        let _ = write!(text, " and {} more", all - MOST);
        return text;
    }
    and(&parts)
}

fn and(parts: &[String]) -> String {
    match parts {
        [] => String::new(),
        [one] => one.clone(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    }
}

fn lowered(noun: &str) -> String {
    // Words of one's own, as LEADER, stay as they are.
    let rest_is_low = noun.chars().skip(1).all(char::is_lowercase);
    if rest_is_low { noun.to_lowercase() } else { noun.to_owned() }
}

/// Many names that all end in numbers after a few stems, by ranges for each stem; `None`: of another kind.
fn several_stems(names: &[&str]) -> Option<String> {
    let mut of_stem = std::collections::BTreeMap::<&str, Vec<u64>>::new();
    for name in names {
        let (stem, numbers) = numbered(&[*name])?;
        of_stem.entry(stem).or_default().extend(numbers);
    }
    if of_stem.len() > MOST || names.len() < 3 * of_stem.len() {
        return None;
    }
    let parts = of_stem.into_iter().map(|(stem, mut numbers)| {
        numbers.sort_unstable();
        numbers.dedup();
        format!("{stem}{}", ranges(&numbers))
    });
    Some(parts.collect::<Vec<_>>().join(", "))
}

/// What comes before the number in all of these names, and the numbers; `None` where names are of another kind.
fn numbered<'a>(names: &[&'a str]) -> Option<(&'a str, Vec<u64>)> {
    let split = |name: &'a str| {
        let stem = name.trim_end_matches(|c: char| c.is_ascii_digit());
        let digits = name.get(stem.len()..)?;
        let number: u64 = digits.parse().ok()?;
        // `07` is a name, not the number 7.
        (number.to_string() == digits).then_some((stem, number))
    };
    let (stem, _) = split(names.first()?)?;
    let numbers = names
        .iter()
        .map(|name| split(name).filter(|(other, _)| *other == stem).map(|(_, number)| number));
    Some((stem, numbers.collect::<Option<_>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_with_numbers_are_ranges() {
        let drones: Vec<String> = (1..=12).chain([14, 16]).map(|n| format!("Drone {n}")).collect();
        let names = || drones.iter().map(String::as_str);
        assert_eq!(listed(names()), "drones 1-12, 14 and 16");
        assert_eq!(listed(names().rev()), "drones 1-12, 14 and 16");
        assert_eq!(listed(names().chain(["Drone 14"])), "drones 1-12, 14 and 16");
        assert_eq!(listed(["Drone 5"]), "Drone 5");
        assert_eq!(listed(["x7", "x8", "x9"]), "x7-9");
        assert_eq!(listed(["3", "4", "5"]), "3-5");
        assert_eq!(listed(["UAV 3", "UAV 4", "UAV 5"]), "UAVs 3-5");
        let networks = ["1:1", "1:2", "1:3", "1:7", "2:9", "2:10", "2:11", "2:12"];
        assert_eq!(listed(networks), "1:1-3 and 7, 2:9-12");
    }

    #[test]
    fn other_names_stay_as_they_are() {
        assert_eq!(listed([]), "");
        assert_eq!(listed(["Drone 07", "Drone 08", "Drone 09"]), "Drone 07, Drone 08 and Drone 09");
        assert_eq!(listed(["Drone 1", "Leader", "Drone 1"]), "Drone 1 and Leader");
        let many: Vec<String> = (0..49).map(|n| format!("n{n}x")).collect();
        assert!(listed(many.iter().map(String::as_str)).ends_with("n19x and 29 more"));
    }

    #[test]
    fn long_lists_of_ranges_end_with_their_number() {
        let odd: Vec<u64> = (0..100).map(|n| 2 * n + 1).collect();
        assert!(ranges(&odd).ends_with("37, 39 and 80 more"), "{}", ranges(&odd));
        assert_eq!(ranges(&[u64::MAX - 1, u64::MAX]), format!("{} and {}", u64::MAX - 1, u64::MAX));
        assert_eq!(ranges(&[]), "");
    }
}
