//! Small pieces of sentences.

/// `1 log`, `2 logs`.
pub(super) fn count(number: usize, noun: &str) -> String {
    if number == 1 { format!("1 {noun}") } else { format!("{number} {noun}s") }
}

/// `calibration`, `calibration and hover`, `a, b and c`.
pub(super) fn list(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// Names that say the same thing: `Drone 1`, `Drone 1 and Drone 2`, `Drone 1 to Drone 49 (49)`.
pub(super) fn range(names: &[&str]) -> String {
    match names {
        [first, _, .., last] => format!("{first} to {last} ({})", names.len()),
        few => list(few),
    }
}
