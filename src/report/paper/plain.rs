//! A drawing of ours as other programs understand it: no links, nothing for scripts or style sheets, and no character
//! that its font has not.

use std::collections::BTreeSet;

/// Stands for a character that the font has not.
const MISSING: char = '\u{fffd}';
/// Elements that go with all that is in them, but for the first title, which names the figure.
const DROPPED: [&str; 2] = ["title", "style"];

/// A drawing, and what was replaced in it.
pub(super) struct Plain {
    pub(super) svg: String,
    pub(super) missing: Vec<char>,
}

/// The drawing, plain; `has` tells whether the font has a character. For drawings of this program: values of attributes
/// are in double quotes, and hold no angle brackets.
pub(super) fn plain(svg: &str, has: impl Fn(char) -> bool) -> Plain {
    let mut out = String::with_capacity(svg.len());
    let mut missing = BTreeSet::new();
    let mut is_titled = false;
    let mut rest = svg;
    while let Some(start) = rest.find('<') {
        let (text, tail) = rest.split_at(start);
        for c in text.chars() {
            if has(c) || c.is_ascii_whitespace() {
                out.push(c);
            } else {
                missing.insert(c);
                out.push(MISSING);
            }
        }
        if let Some(comment) = tail.strip_prefix("<!--") {
            rest = after(comment, "-->");
            continue;
        }
        let Some(end) = tail.find('>') else { break };
        let (tag, tail) = tail.split_at(end + 1);
        rest = tail;
        let name = tag.trim_start_matches(['<', '/']);
        let name = name.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or("");
        let is_first_title = name == "title" && !is_titled;
        if DROPPED.contains(&name) && !is_first_title {
            if !tag.starts_with("</") {
                rest = after(rest, &format!("</{name}>"));
            }
        } else if is_first_title {
            is_titled = tag.starts_with("</");
            out.push_str(tag);
        } else if name != "a" {
            push_tag(&mut out, tag, name);
        }
    }
    Plain { svg: out, missing: missing.into_iter().collect() }
}

fn after<'a>(text: &'a str, end: &str) -> &'a str {
    text.split_once(end).map_or("", |(_, rest)| rest)
}

/// A tag with the attributes that other programs know.
fn push_tag(out: &mut String, tag: &str, name: &str) {
    let mut rest = tag;
    while let Some((before, tail)) = rest.split_once("=\"") {
        let Some((value, tail)) = tail.split_once('"') else { break };
        rest = tail;
        let (lead, attribute) = before.rsplit_once(char::is_whitespace).unwrap_or(("", before));
        out.push_str(lead.trim_end());
        if let Some((attribute, value)) = known(attribute, value) {
            out.push_str(&format!(" {attribute}=\"{value}\""));
        }
        if name == "svg" && attribute == "xmlns" {
            out.push_str(" xmlns:xlink=\"http://www.w3.org/1999/xlink\"");
        }
    }
    out.push_str(rest);
}

/// The attribute as SVG 1.1 has it; `None`: it is for the page alone.
fn known<'a>(attribute: &'a str, value: &'a str) -> Option<(&'a str, &'a str)> {
    if attribute == "class" || attribute.starts_with("data-") || attribute.starts_with("aria-") {
        return None;
    }
    Some(match (attribute, value) {
        ("style", "image-rendering:pixelated") => ("image-rendering", "optimizeSpeed"),
        ("style", _) => return None,
        ("href", _) => ("xlink:href", value),
        ("fill", "transparent") => ("fill", "none"),
        ("font-weight", "600" | "700") => ("font-weight", "bold"),
        ("role", _) => return None,
        _ => (attribute, value),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(svg: &str) -> String {
        plain(svg, |c| c != '山').svg
    }

    #[test]
    fn what_is_for_the_page_is_gone() {
        assert_eq!(
            of("<g data-pick=\"1\" class=\"x\"><title>tip</title><rect x=\"1\" fill=\"transparent\"/></g>")
                .replace("<title>tip</title>", ""),
            "<g><rect x=\"1\" fill=\"none\"/></g>"
        );
        assert_eq!(of("<a href=\"b.svg\"><circle r=\"1\"/></a>"), "<circle r=\"1\"/>");
        assert_eq!(of("<style>g { x: var(--y) }</style><!-- c --><g></g>"), "<g></g>");
        assert_eq!(
            of("<image style=\"image-rendering:auto\" href=\"data:\"/>"),
            "<image xlink:href=\"data:\"/>"
        );
    }

    #[test]
    fn the_first_title_stays_and_names_the_figure() {
        let svg = "<svg><title>Figure</title><g><title>tip</title></g></svg>";
        assert_eq!(of(svg), "<svg><title>Figure</title><g></g></svg>");
    }

    #[test]
    fn characters_without_a_glyph_are_replaced_and_told() {
        let found = plain("<text x=\"1\">Field 山, a &amp; b</text>", |c| c != '山');
        assert_eq!(found.svg, "<text x=\"1\">Field \u{fffd}, a &amp; b</text>");
        assert_eq!(found.missing, ['山']);
    }

    #[test]
    fn a_torn_drawing_is_no_panic() {
        for torn in ["<", "<svg", "<a b=\"", "<!--", "<title>", "<style>x", ">", "a=\"b\""] {
            plain(torn, |_| true);
        }
    }
}
