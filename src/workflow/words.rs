//! Small pieces of sentences.

use crate::base::time::GpsTime;

/// `1 log`, `2 logs`, `3 analyses`.
pub(crate) fn count(number: usize, noun: &str) -> String {
    match noun.strip_suffix("sis") {
        _ if number == 1 => format!("1 {noun}"),
        Some(stem) => format!("{number} {stem}ses"),
        None => format!("{number} {noun}s"),
    }
}

/// A word of a shell's command line.
pub(crate) fn shell(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./:@,+=".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// `calibration`, `calibration and hover`, `a, b and c`.
pub(crate) fn list(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [one] => (*one).to_owned(),
        [first @ .., last] => format!("{} and {last}", first.join(", ")),
    }
}

/// UTC of a GPS time: `12:34:56 UTC`.
pub(crate) fn time_of_day(time: GpsTime) -> String {
    let seconds = time.to_unix_ms().div_euclid(1000).rem_euclid(86_400);
    format!("{:02}:{:02}:{:02} UTC", seconds / 3600, seconds / 60 % 60, seconds % 60)
}
