//! Manual pages: one for every command, whole and without complaints of the formatter.

use std::collections::BTreeSet;
use std::fs;
use std::process::Command;

use crate::cli::support::Bench;

/// Pages that a page refers to: `updraft\-fleet(1)`.
fn references(page: &str) -> BTreeSet<String> {
    let plain = page.replace("\\-", "-");
    let names = plain.split("(1)").map(|before| {
        let from = before.rfind(|c: char| !(c.is_ascii_alphanumeric() || c == '-'));
        before[from.map_or(0, |at| at + 1)..].to_owned()
    });
    names.filter(|name| name.starts_with("updraft")).collect()
}

#[test]
fn every_command_has_a_page_and_every_reference_leads_to_one() {
    let bench = Bench::new();
    let said = bench.expect(0, &["man", "--dir", "pages"]);
    let mut pages = BTreeSet::new();
    let mut named = BTreeSet::new();
    for entry in fs::read_dir(bench.path("pages")).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        pages.insert(path.file_stem().unwrap().to_str().unwrap().to_owned());
        named.extend(references(&text));
    }
    assert!(said.err.contains(&format!("Wrote {} pages", pages.len())), "{said}");
    for wanted in ["updraft", "updraft-run", "updraft-fleet-upload", "updraft-gap-next"] {
        assert!(pages.contains(wanted), "{pages:?}");
    }
    assert!(named.len() > 30, "{named:?}");
    assert!(named.is_subset(&pages), "{:?}", named.difference(&pages));
    let one = bench.expect(0, &["man", "fleet", "upload"]).out;
    assert_eq!(one, fs::read_to_string(bench.path("pages/updraft-fleet-upload.1")).unwrap());
    let wrong = bench.expect(2, &["man", "fleet", "fly"]).err;
    assert!(
        wrong.contains("`updraft-fleet` has no command fly; there are status, upload"),
        "{wrong}"
    );
}

#[test]
fn examples_keep_their_lines() {
    let bench = Bench::new();
    let page = bench.expect(0, &["man", "plan"]).out;
    let examples = page.split_once(".SH EXAMPLES\n").unwrap().1;
    let first = examples.lines().nth(1).unwrap().replace("\\-", "-");
    assert!(examples.starts_with(".nf\n"), "{examples}");
    assert_eq!(
        first,
        "  updraft plan templates/calibration.toml --grid 7x7 --spacing 7 --origin 47.4733,19.0621 -o my-campaign"
    );
    // A narrow terminal breaks prose, and no example.
    let mut narrow = bench.command(&["plan", "--help"]);
    let help = narrow.env("COLUMNS", "60").output().unwrap();
    let help = String::from_utf8(help.stdout).unwrap();
    assert!(help.contains(&format!("\n{first}\n")), "{help}");
    assert!(!help.contains('\u{a0}'));
}

/// The pages formatted by groff, with all its warnings. Without groff this says so and passes.
#[test]
fn the_formatter_has_nothing_to_complain_of() {
    let bench = Bench::new();
    bench.expect(0, &["man", "--dir", "pages"]);
    for entry in fs::read_dir(bench.path("pages")).unwrap() {
        let path = entry.unwrap().path();
        let formatted =
            Command::new("groff").args(["-ww", "-man", "-Tutf8", "-z"]).arg(&path).output();
        let Ok(formatted) = formatted else {
            eprintln!("no groff: not tested");
            return;
        };
        let said = String::from_utf8_lossy(&formatted.stderr).into_owned();
        assert!(formatted.status.success() && said.is_empty(), "{}: {said}", path.display());
    }
}
