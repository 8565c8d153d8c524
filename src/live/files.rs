//! Pages and results of the campaign that lie beside a flight, for those who may look.
//!
//! Their addresses hold the secret of those who may look, so that the links between them work as they do on a disk. What
//! is not a page, a result or a log of the campaign is not there: neither the secrets of the page nor the journal.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::base::file::open_regular;

/// First part of their addresses.
pub const PREFIX: &str = "/files/";

/// Pages that a flight's page links to, with their titles, from the campaign's folder.
const PAGES: [(&str, &str); 4] = [
    ("The report", "report/index.html"),
    ("Where measurement and model disagree", "gap/report/index.html"),
    ("The simulation study", "study/report/index.html"),
    ("All numbers", "analysis.json"),
];
/// Folders of pages and results.
const FOLDERS: [&str; 4] = ["report", "gap", "study", "fields"];
/// Folders of logs, of the campaign or of one of its flights.
const LOGS: [&str; 2] = ["logs", "simulated"];
/// Most files of a folder that are listed.
const MOST_LISTED: usize = 10_000;
/// Longest path below the campaign, folders.
const DEEPEST: usize = 8;

/// A page that lies beside the flight.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Link {
    /// Title of the page.
    pub title: &'static str,
    /// Address of the page at this server.
    pub href: String,
}

/// Pages that are there, with the secret in their addresses.
pub fn links(root: &Path, secret: &str) -> Vec<Link> {
    let there = PAGES.into_iter().filter(|(_, path)| root.join(path).is_file());
    there.map(|(title, path)| Link { title, href: format!("{PREFIX}{secret}/{path}") }).collect()
}

/// Splits the path of a request into secret and path below the campaign.
pub fn split(path: &str) -> Option<(&str, &str)> {
    path.strip_prefix(PREFIX)?.split_once('/')
}

/// Media type of a file that may be served, by its name's end.
fn media(name: &str) -> Option<&'static str> {
    let (_, end) = name.rsplit_once('.')?;
    Some(match end.to_ascii_lowercase().as_str() {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "pdf" => "application/pdf",
        "json" => "application/json",
        "geojson" => "application/geo+json",
        "kml" => "application/vnd.google-earth.kml+xml",
        "csv" => "text/csv; charset=utf-8",
        "toml" | "md" | "txt" => "text/plain; charset=utf-8",
        "nc" => "application/x-netcdf",
        "parquet" | "bin" => "application/octet-stream",
        _ => return None,
    })
}

/// The parts of a path as in an address, decoded; `None`: no path below a folder.
fn parts(path: &str) -> Option<Vec<String>> {
    let parts: Vec<String> = path.split('/').map(decoded).collect::<Option<_>>()?;
    let is_plain = |part: &String| {
        !part.is_empty()
            && !part.starts_with('.')
            && !part.chars().any(|c| c.is_control() || matches!(c, '/' | '\\' | ':'))
    };
    (parts.len() <= DEEPEST && parts.iter().all(is_plain)).then_some(parts)
}

/// Percent-encoded bytes as they are.
fn decoded(part: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(part.len());
    let mut rest = part.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        if first == b'%' {
            let digits = std::str::from_utf8(after.get(..2)?).ok()?;
            let is_hex = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
            bytes.push(is_hex.then(|| u8::from_str_radix(digits, 16).ok())??);
            rest = &after[2..];
        } else {
            bytes.push(first);
            rest = after;
        }
    }
    String::from_utf8(bytes).ok()
}

/// Whether these parts lead to a page, a result or a log.
fn is_served(parts: &[String]) -> bool {
    let parts: Vec<&str> = parts.iter().map(String::as_str).collect();
    match parts.as_slice() {
        ["analysis.json"] => true,
        [folder, name] | [_, folder, name] if LOGS.contains(folder) => {
            let is_log =
                Path::new(name).extension().is_some_and(|end| end.eq_ignore_ascii_case("bin"));
            is_log || *name == "manifest.json"
        }
        [folder, .., _] => FOLDERS.contains(folder),
        _ => false,
    }
}

/// A file that may be served: open, with its media type and length, bytes. `None`: there is none, or none that is served.
pub fn open(root: &Path, path: &str) -> Option<(File, &'static str, u64)> {
    let parts = parts(path)?;
    let media = media(parts.last()?)?;
    if !is_served(&parts) {
        return None;
    }
    let (file, known) = open_regular(&inside(root, &parts).ok()??).ok()?;
    Some((file, media, known.len()))
}

/// A page with links to the files of a folder that may be served (its address ends with a slash); `None`: there is none.
pub fn listing(root: &Path, path: &str) -> Option<String> {
    let parts = parts(path.strip_suffix('/')?)?;
    if !FOLDERS.contains(&parts.first()?.as_str()) {
        return None;
    }
    let entries = std::fs::read_dir(inside(root, &parts).ok()??).ok()?.take(MOST_LISTED).flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    // A name that needs no escaping: ours are all of them.
    let is_plain = |name: &String| {
        name.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.'))
            && media(name).is_some()
    };
    let mut names: Vec<String> = names.filter(is_plain).collect();
    names.sort();
    let items: Vec<String> =
        names.iter().map(|name| format!("<li><a href=\"{name}\">{name}</a></li>\n")).collect();
    let items = items.concat();
    Some(format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"color-scheme\" content=\"light dark\">\
         <title>Files</title></head>\n<body><h1>Files</h1>\n<ul>\n{items}</ul>\n</body></html>\n"
    ))
}

/// The path below `root`, if no link leads out of it.
fn inside(root: &Path, parts: &[String]) -> io::Result<Option<PathBuf>> {
    let root = root.canonicalize()?;
    let path = parts.iter().fold(root.clone(), |path, part| path.join(part)).canonicalize()?;
    Ok(path.starts_with(&root).then_some(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn served(path: &str) -> bool {
        parts(path).is_some_and(|parts| is_served(&parts) && media(parts.last().unwrap()).is_some())
    }

    #[test]
    fn pages_results_and_logs_are_served_and_nothing_else() {
        for path in [
            "report/index.html",
            "report/figures/fig2-laws.svg",
            "report/data/drone%201.js",
            "gap/report/index.html",
            "gap/verdict.json",
            "analysis.json",
            "fields/updraft.nc",
            "logs/01.BIN",
            "hover/logs/manifest.json",
            "calibration/simulated/01.BIN",
        ] {
            assert!(served(path), "{path}");
        }
        for path in [
            "",
            "/",
            "report",
            "report/",
            "report//index.html",
            "fleet-live.json",
            "fleet-journal.ndjson",
            "hover/fleet-live.json",
            "hover/fleet.json",
            "hover/logs/start.json",
            "report/../fleet-live.json",
            "report/%2e%2e/fleet-live.json",
            "report/..%2ffleet-live.json",
            "report/..%5cfleet-live.json",
            "report/.partial-index.html",
            "report/a%0.html",
            "report/%00.html",
            "report/%+1.html",
            "report/%ff.html",
            "report/c:/x.html",
            "report/a/b/c/d/e/f/g/h.html",
            "report/run.exe",
            "etc/passwd",
        ] {
            assert!(!served(path), "{path}");
        }
    }

    #[test]
    #[cfg(unix)]
    fn a_link_that_leads_out_of_the_campaign_is_not_followed() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("campaign");
        std::fs::create_dir_all(root.join("report")).unwrap();
        std::fs::write(folder.path().join("secret.json"), "{}").unwrap();
        std::fs::write(root.join("report/index.html"), "page").unwrap();
        std::os::unix::fs::symlink("../../secret.json", root.join("report/out.json")).unwrap();
        std::os::unix::fs::symlink("index.html", root.join("report/in.html")).unwrap();
        assert!(open(&root, "report/index.html").is_some_and(|(_, _, length)| length == 4));
        assert!(open(&root, "report/in.html").is_some());
        assert!(open(&root, "report/out.json").is_none());
        let listed = listing(&root, "report/").unwrap();
        assert!(listed.contains("<a href=\"in.html\">") && !listed.contains("report/"), "{listed}");
        for path in ["report", "", "/", "logs/", "report/../", "gap/"] {
            assert!(listing(&root, path).is_none(), "{path}");
        }
        assert!(open(&root, "report").is_none() && open(&root, "gap/verdict.json").is_none());
        assert_eq!(
            links(&root, "s"),
            [Link { title: "The report", href: "/files/s/report/index.html".to_owned() }]
        );
    }
}
