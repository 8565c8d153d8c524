//! Ways from a page to the pages and files beside it.

use minijinja::context;
use minijinja::value::Value;

use super::text::clean;

/// A page or file that belongs to a page, as a relative link.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PageLink {
    /// Title for people.
    pub title: String,
    /// Relative address, as seen from the page's folder; empty for what only a command shows.
    pub href: String,
    /// Command that makes or shows it; empty for what is there already.
    pub command: String,
}

impl PageLink {
    /// A file that is there, or that is written together with the page.
    pub fn there(title: &str, href: impl Into<String>) -> Self {
        Self { title: title.to_owned(), href: href.into(), command: String::new() }
    }

    /// A page that a command makes.
    pub fn made_by(title: &str, href: impl Into<String>, command: impl Into<String>) -> Self {
        Self { title: title.to_owned(), href: href.into(), command: command.into() }
    }
}

/// The links as a page has them. What could lead out of the house (another scheme, a root) is text.
pub(super) fn values(links: &[PageLink]) -> Vec<Value> {
    links
        .iter()
        .map(|link| {
            let href = clean(&link.href);
            let own = !href.contains(':') && !href.starts_with('/');
            context! {
                title => clean(&link.title),
                href => if own { href.as_str() } else { "" },
                command => clean(&link.command),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_link_leaves_the_folder_of_the_campaign_by_a_scheme_or_a_root() {
        for href in ["javascript:alert(1)", "https://example.org/", "/etc/passwd"] {
            let shown = values(&[PageLink::there("x", href)]);
            assert_eq!(shown[0].get_attr("href").unwrap().to_string(), "", "{href}");
        }
        let shown = values(&[PageLink::there("x", "../analysis.json")]);
        assert_eq!(shown[0].get_attr("href").unwrap().to_string(), "../analysis.json");
    }
}
