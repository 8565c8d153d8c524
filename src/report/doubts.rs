//! Doubtful stretches of a map's values: of many drones with the same doubt, one line.

use minijinja::context;
use minijinja::value::Value;
use untrusted_io::names::listed;

use crate::analysis::result::{Quality, UpdraftMap};

use super::text::{fixed, shortened};
use super::typographic::typographic;

/// Most lines of the table.
const MOST_LINES: usize = 400;
/// Columns of a drone's label.
pub(super) const LABEL: usize = 28;

/// Stretches with one doubt, whose reasons differ in their numbers alone.
struct Kind {
    flag: Quality,
    /// The words between the numbers.
    words: Vec<String>,
    drones: Vec<String>,
    stretches: usize,
    /// Lowest and highest start and end, s.
    from_s: [f64; 2],
    to_s: [f64; 2],
    /// Of each number in the reason: the least and the most, as they are written.
    numbers: Vec<[String; 2]>,
}

/// The stretches for the template, a line for each kind.
pub(super) fn doubts(map: &UpdraftMap) -> Value {
    let mut kinds: Vec<Kind> = Vec::new();
    let mut total = 0;
    for drone in &map.drones {
        for flag in &drone.quality {
            total += 1;
            let (words, numbers) = taken_apart(&flag.reason);
            let name = shortened(&drone.name, LABEL);
            let same = |kind: &&mut Kind| kind.flag == flag.flag && kind.words == words;
            match kinds.iter_mut().find(same) {
                Some(kind) => {
                    kind.stretches += 1;
                    if kind.drones.last() != Some(&name) {
                        kind.drones.push(name);
                    }
                    widen_s(&mut kind.from_s, flag.start_s);
                    widen_s(&mut kind.to_s, flag.end_s);
                    for (known, new) in kind.numbers.iter_mut().zip(numbers) {
                        widen(known, new);
                    }
                }
                None => kinds.push(Kind {
                    flag: flag.flag,
                    words,
                    drones: vec![name],
                    stretches: 1,
                    from_s: [flag.start_s; 2],
                    to_s: [flag.end_s; 2],
                    numbers: numbers.into_iter().map(|one| [one.clone(), one]).collect(),
                }),
            }
        }
    }
    let left_out = kinds.len().saturating_sub(MOST_LINES);
    let rows: Vec<Value> = kinds.iter().take(MOST_LINES).map(line).collect();
    context! { rows, left_out, total }
}

fn line(kind: &Kind) -> Value {
    let drones = listed(kind.drones.iter().map(String::as_str));
    let more = kind.stretches > kind.drones.len();
    context! {
        drone => if more {
            format!("{drones} ({} stretches)", kind.stretches)
        } else {
            drones
        },
        flag => kind.flag.words(),
        excluded => kind.flag.excludes(),
        from => span_s(kind.from_s),
        to => span_s(kind.to_s),
        reason => typographic(&put_together(kind)),
    }
}

fn span_s([low, high]: [f64; 2]) -> String {
    let (low, high) = (fixed(low, 0), fixed(high, 0));
    if low == high { low } else { format!("{low} to {high}") }
}

fn widen_s(span: &mut [f64; 2], value: f64) {
    span[0] = span[0].min(value);
    span[1] = span[1].max(value);
}

fn widen(span: &mut [String; 2], new: String) {
    let value = |text: &str| text.parse::<f64>().unwrap_or(0.0);
    if value(&new) < value(&span[0]) {
        span[0] = new;
    } else if value(&new) > value(&span[1]) {
        span[1] = new;
    }
}

/// The words of a reason and its numbers: there is one more of the words.
fn taken_apart(reason: &str) -> (Vec<String>, Vec<String>) {
    let (mut words, mut numbers) = (vec![String::new()], Vec::new());
    let mut rest = reason;
    let mut last = ' ';
    while let Some(first) = rest.chars().next() {
        let length = if last.is_alphanumeric() { 0 } else { number_length(rest) };
        if length > 0 {
            let (number, after) = rest.split_at(length);
            numbers.push(number.to_owned());
            words.push(String::new());
            (rest, last) = (after, '0');
        } else {
            if let Some(word) = words.last_mut() {
                word.push(first);
            }
            (rest, last) = (&rest[first.len_utf8()..], first);
        }
    }
    (words, numbers)
}

/// Length of the number that a text begins with; 0: none.
fn number_length(text: &str) -> usize {
    let sign = usize::from(text.starts_with(['+', '-']));
    let digits = |from: usize| {
        text.get(from..).map_or(0, |rest| rest.bytes().take_while(u8::is_ascii_digit).count())
    };
    let whole = digits(sign);
    if whole == 0 {
        return 0;
    }
    let end = sign + whole;
    let decimals =
        if text.get(end..).is_some_and(|rest| rest.starts_with('.')) { digits(end + 1) } else { 0 };
    end + if decimals > 0 { 1 + decimals } else { 0 }
}

fn put_together(kind: &Kind) -> String {
    let mut out = String::new();
    for (index, words) in kind.words.iter().enumerate() {
        out.push_str(words);
        if let Some([low, high]) = kind.numbers.get(index) {
            out.push_str(low);
            if low != high {
                out.push_str(" to ");
                out.push_str(high);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_taken_out_of_a_reason_and_put_back() {
        let (words, numbers) = taken_apart("by +10.5 us in 3 legs (t0), v2.");
        assert_eq!(numbers, ["+10.5", "3"]);
        assert_eq!(words, ["by ", " us in ", " legs (t0), v2."]);
        for text in ["", "é", "-", "+", "1.", "no number", "3-4"] {
            let (words, numbers) = taken_apart(text);
            assert_eq!(words.len(), numbers.len() + 1);
        }
    }

    #[test]
    fn drones_with_one_doubt_have_one_line_with_the_span_of_its_numbers() {
        let mut span = ["+10".to_owned(), "+10".to_owned()];
        for new in ["+19", "+9.5", "+12"] {
            widen(&mut span, new.to_owned());
        }
        let kind = Kind {
            flag: Quality::Drift,
            words: vec!["by ".to_owned(), " us".to_owned()],
            drones: vec!["Drone 1".to_owned(), "Drone 2".to_owned()],
            stretches: 2,
            from_s: [47.0, 47.2],
            to_s: [216.0, 230.0],
            numbers: vec![span],
        };
        assert_eq!(put_together(&kind), "by +9.5 to +19 us");
        let row = line(&kind);
        let of = |name: &str| row.get_attr(name).unwrap().to_string();
        assert_eq!([of("from"), of("to")], ["47", "216 to 230"]);
        assert_eq!(of("reason"), "by +9.5 to +19 µs");
    }
}
