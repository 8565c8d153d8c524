//! JSON documents in the archive, and references between them.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use serde_json::Value;

use super::SkycError;
use super::trajectory::short;
use crate::archive::Archive;
use untrusted_io::parse;

/// Name of the entry everything starts from.
pub(super) const ROOT: &str = "show.json";
/// References followed one after another.
const MAX_HOPS: usize = 16;

/// A value, and the entry it is in.
#[derive(Clone, Debug)]
pub(super) struct Node<'a> {
    pub value: Cow<'a, Value>,
    pub entry: Arc<str>,
}

/// The documents of an archive. Those that several drones refer to are parsed once.
pub(super) struct Documents<'a> {
    pub archive: &'a Archive<'a>,
    pub shared: BTreeMap<String, Value>,
}

impl Documents<'_> {
    /// The value behind a key, if it is there and not null, with references followed.
    pub(super) fn child<'n>(
        &'n self,
        node: &'n Node<'_>,
        key: &str,
    ) -> Result<Option<Node<'n>>, SkycError> {
        match node.value.get(key) {
            None | Some(Value::Null) => Ok(None),
            Some(value) => self.follow(value, &node.entry).map(Some),
        }
    }

    /// A value, or what it refers to.
    pub(super) fn follow<'n>(
        &'n self,
        value: &'n Value,
        entry: &Arc<str>,
    ) -> Result<Node<'n>, SkycError> {
        let mut node = Node { value: Cow::Borrowed(value), entry: Arc::clone(entry) };
        let mut seen = BTreeSet::new();
        while let Some(text) = reference(&node.value) {
            let fail = |problem: String| SkycError::Entry {
                entry: node.entry.to_string(),
                problem: format!("the reference {} {problem}", short(&text.into())),
            };
            let target =
                Target::parse(text, &node.entry).map_err(|problem| fail(problem.into()))?;
            if seen.len() >= MAX_HOPS
                || !seen.insert((target.entry.clone(), target.pointer.clone()))
            {
                return Err(fail("goes round in circles".to_owned()));
            }
            let missing = || fail("points to nothing".to_owned());
            let value = if let Some(document) = self.shared.get(&target.entry) {
                Cow::Borrowed(document.pointer(&target.pointer).ok_or_else(missing)?)
            } else {
                if !self.archive.contains(&target.entry) {
                    return Err(missing());
                }
                let mut document = parse(self.archive, &target.entry)?;
                let part = document.pointer_mut(&target.pointer).ok_or_else(missing)?;
                Cow::Owned(part.take())
            };
            node = Node { value, entry: target.entry.into() };
        }
        Ok(node)
    }
}

/// The reference a value is, if it is one.
pub(super) fn reference(value: &Value) -> Option<&str> {
    value.as_object()?.get("$ref")?.as_str()
}

/// Where a reference points.
pub(super) struct Target {
    pub entry: String,
    pointer: String,
}

impl Target {
    /// From the text of a reference in `base`: a path relative to it, `#`, a JSON pointer; the path,
    /// the `#` and the pointer may each be absent.
    pub(super) fn parse(text: &str, base: &str) -> Result<Self, &'static str> {
        let (path, pointer) = text.split_once('#').unwrap_or((text, ""));
        let path = percent_decoded(path).ok_or("has a broken %-escape")?;
        let pointer = percent_decoded(pointer).ok_or("has a broken %-escape")?;
        if !pointer.is_empty() && !pointer.starts_with('/') {
            return Err("has something else than a JSON pointer after the #");
        }
        if path.contains([':', '\\']) || path.starts_with('/') {
            return Err("leaves the archive; only relative paths are followed");
        }
        if path.is_empty() {
            return Ok(Self { entry: base.to_owned(), pointer });
        }
        let folder = base.rsplit_once('/').map_or("", |(folder, _)| folder);
        let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
        for part in path.split('/') {
            match part {
                "" | "." => {}
                ".." => return Err("has \"..\" in its path; that is not followed"),
                part => parts.push(part),
            }
        }
        Ok(Self { entry: parts.join("/"), pointer })
    }
}

fn percent_decoded(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((first, later)) = rest.split_first() {
        rest = later;
        if *first == b'%' {
            let (digits, later) = rest.split_first_chunk::<2>()?;
            let digit = |byte: u8| char::from(byte).to_digit(16);
            bytes.push((digit(digits[0])? * 16 + digit(digits[1])?) as u8);
            rest = later;
        } else {
            bytes.push(*first);
        }
    }
    String::from_utf8(bytes).ok()
}

/// Unpacks and parses one entry.
pub(super) fn parse(archive: &Archive<'_>, entry: &str) -> Result<Value, SkycError> {
    let content = archive.unpack(entry)?;
    let fail = |problem: String| SkycError::Entry { entry: entry.to_owned(), problem };
    // Some writers put a byte order mark before the text.
    let content = content.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&content);
    let limits = archive.limits();
    check_shape(content, limits.values, limits.depth).map_err(fail)?;
    parse::json(content).map_err(|error| fail(format!("it is not valid JSON: {error}")))
}

/// Refuses JSON that would take far more memory than its text, before it is parsed.
fn check_shape(text: &[u8], max_values: usize, max_depth: usize) -> Result<(), String> {
    let (mut values, mut depth) = (1_usize, 0_usize);
    let (mut in_string, mut escaped) = (false, false);
    for byte in text {
        if in_string {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = true,
                b'"' => in_string = false,
                _ => {}
            }
            continue;
        }
        match byte {
            b'"' => in_string = true,
            b',' => values += 1,
            b'[' | b'{' => {
                values += 1;
                depth += 1;
                if depth > max_depth {
                    return Err(format!("its JSON is nested deeper than {max_depth} levels"));
                }
            }
            b']' | b'}' => depth = depth.saturating_sub(1),
            _ => {}
        }
    }
    if values > max_values {
        return Err(format!("it has more than {max_values} JSON values"));
    }
    Ok(())
}
