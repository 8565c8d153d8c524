//! The same PDF with the same bytes each time: the library that makes it names its objects in an order that differs from
//! run to run.
//!
//! Entries of dictionaries are sorted, objects numbered as they are met from the catalogue on. This is for files that
//! `svg2pdf` writes, one key to a line; what looks otherwise is refused.

use std::collections::BTreeMap;
use std::fmt::Write as _;

/// An object: its dictionary as text, and its stream, if it has one.
struct Object<'a> {
    dictionary: String,
    stream: &'a [u8],
}

/// The file with its objects in order; `None` if it is not such a file.
pub(super) fn canonical(pdf: &[u8]) -> Option<Vec<u8>> {
    let table = find_last(pdf, b"\nxref\n")? + 1;
    let tail = std::str::from_utf8(pdf.get(table..)?).ok()?;
    let objects = objects(pdf, table, tail)?;
    let trailer = tail.split_once("trailer")?.1;
    let [root, info] =
        ["/Root ", "/Info "].map(|key| Some(references(after(trailer, key)?).next()?.2));
    let (root, info) = (root?, info?);
    // Numbers by the first time that an object is met.
    let mut order = vec![root, info];
    let mut next = 0;
    while let Some(id) = order.get(next).copied() {
        for (_, _, id) in references(&objects.get(&id)?.dictionary) {
            if !order.contains(&id) {
                order.push(id);
            }
        }
        next += 1;
    }
    let numbers: BTreeMap<u32, u32> = order.iter().copied().zip(1..).collect();
    let header = pdf.get(..pdf.windows(7).position(|bytes| bytes == b" 0 obj\n")?)?;
    let mut out = header.get(..=header.iter().rposition(|byte| *byte == b'\n')?)?.to_vec();
    let mut offsets = Vec::new();
    for (id, number) in order.iter().zip(1..) {
        let object = objects.get(id)?;
        offsets.push(out.len());
        out.extend(
            format!("{number} 0 obj\n{}", renumbered(&object.dictionary, &numbers)?).bytes(),
        );
        out.extend(object.stream);
    }
    let start = out.len();
    let mut end = format!("xref\n0 {}\n0000000000 65535 f\r\n", offsets.len() + 1);
    for offset in &offsets {
        let _ = write!(end, "{offset:010} 00000 n\r\n");
    }
    let size = offsets.len() + 1;
    let _ = write!(
        end,
        "trailer\n<<\n  /Size {size}\n  /Root 1 0 R\n  /Info 2 0 R\n>>\nstartxref\n{start}\n%%EOF"
    );
    out.extend(end.bytes());
    Some(out)
}

fn find_last(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    bytes.windows(wanted.len()).rposition(|window| window == wanted)
}

fn after<'a>(text: &'a str, key: &str) -> Option<&'a str> {
    text.split_once(key).map(|(_, rest)| rest)
}

/// All objects by their numbers, as the table of the file places them.
fn objects<'a>(pdf: &'a [u8], table: usize, tail: &str) -> Option<BTreeMap<u32, Object<'a>>> {
    let entries = tail.lines().skip(2).take_while(|line| !line.starts_with("trailer"));
    let mut places: Vec<(usize, u32)> = entries
        .zip(0..)
        .filter(|(line, _)| line.trim_end().ends_with('n'))
        .map(|(line, id)| Some((line.get(..10)?.parse().ok()?, id)))
        .collect::<Option<_>>()?;
    places.sort_unstable();
    let ends = places.iter().skip(1).map(|(place, _)| *place).chain([table]);
    places
        .iter()
        .zip(ends)
        .map(|((start, id), end)| {
            let text = pdf.get(*start..end)?.strip_prefix(format!("{id} 0 obj\n").as_bytes())?;
            let of_stream = text.windows(8).position(|window| window == b"\nstream\n");
            let (dictionary, stream) = text.split_at(of_stream.unwrap_or(text.len()));
            let dictionary = sorted(std::str::from_utf8(dictionary).ok()?);
            Some((*id, Object { dictionary, stream }))
        })
        .collect()
}

/// The text with neighbouring lines of one key each in order.
fn sorted(dictionary: &str) -> String {
    let mut lines: Vec<&str> = dictionary.split('\n').collect();
    let depth = |line: &str| line.len() - line.trim_start().len();
    let is_entry = |line: &str| {
        line.trim_start().starts_with('/') && !line.contains("<<") && !line.contains(">>")
    };
    lines
        .chunk_by_mut(|a, b| is_entry(a) && is_entry(b) && depth(a) == depth(b))
        .for_each(<[&str]>::sort_unstable);
    lines.join("\n")
}

/// References in a text: where each begins and ends, and the number of its object.
fn references(text: &str) -> impl Iterator<Item = (usize, usize, u32)> + '_ {
    text.match_indices(" 0 R").filter_map(|(at, found)| {
        let before = text.get(..at)?;
        let start = before.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        Some((start, at + found.len(), before.get(start..)?.parse().ok()?))
    })
}

fn renumbered(dictionary: &str, numbers: &BTreeMap<u32, u32>) -> Option<String> {
    let mut out = String::with_capacity(dictionary.len());
    let mut done = 0;
    for (start, end, id) in references(dictionary) {
        let _ = write!(out, "{}{} 0 R", dictionary.get(done..start)?, numbers.get(&id)?);
        done = end;
    }
    out.push_str(dictionary.get(done..)?);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of two fonts in one order or the other; its objects have the numbers and the order given.
    fn file([first, second]: [u32; 2], swapped: bool) -> Vec<u8> {
        let mut fonts = [format!("    /f0 {first} 0 R"), format!("    /f1 {second} 0 R")];
        let mut objects = vec![
            (1, "<<\n  /Type /Catalog\n  /Pages 2 0 R\n>>".to_owned()),
            (first, "<<\n  /Name /Regular\n  /Length 3\n>>\nstream\na\nb\nendstream".to_owned()),
            (second, "<<\n  /Name /Bold\n>>".to_owned()),
            (5, "<<\n  /Producer (p)\n>>".to_owned()),
        ];
        if swapped {
            fonts.reverse();
            objects.swap(1, 2);
        }
        objects.insert(1, (2, format!("<<\n  /Font <<\n{}\n  >>\n>>", fonts.join("\n"))));
        let mut text = "%PDF-1.7\n%abc\n\n".to_owned();
        let mut places = BTreeMap::new();
        for (id, object) in objects {
            places.insert(id, text.len());
            text.push_str(&format!("{id} 0 obj\n{object}\nendobj\n\n"));
        }
        let table = text.len();
        text.push_str("xref\n0 6\n0000000000 65535 f\r\n");
        for place in places.values() {
            text.push_str(&format!("{place:010} 00000 n\r\n"));
        }
        text.push_str(&format!(
            "trailer\n<<\n  /Size 6\n  /Root 1 0 R\n  /Info 5 0 R\n>>\nstartxref\n{table}\n%%EOF"
        ));
        text.into_bytes()
    }

    #[test]
    fn the_order_of_objects_and_of_keys_makes_no_difference() {
        let [one, other] = [file([3, 4], false), file([4, 3], true)];
        assert_ne!(one, other);
        let canonical_one = canonical(&one).unwrap();
        assert_eq!(canonical_one, canonical(&other).unwrap());
        assert_eq!(canonical_one, canonical(&canonical_one).unwrap(), "nothing more to do");
        let text = String::from_utf8(canonical_one).unwrap();
        assert!(text.contains("/f0 4 0 R\n    /f1 5 0 R"), "{text}");
        assert!(
            text.contains("4 0 obj\n<<\n  /Length 3\n  /Name /Regular\n>>\nstream\na\nb"),
            "{text}"
        );
    }

    #[test]
    fn what_is_no_such_file_is_refused() {
        let whole = file([3, 4], false);
        for length in 0..whole.len() {
            let _ = canonical(&whole[..length]);
        }
        assert!(canonical(b"").is_none() && canonical(b"%PDF-1.7\nxref\n0 0\n").is_none());
    }
}
