//! What the terminal says, as people see it.

mod report_synthetic;

use report_synthetic::{campaign, updraft_series};
use updraft::report::terminal_summary;

#[test]
fn campaign_at_usual_width() {
    let mut analysis = campaign();
    // A few drones are enough to see the table.
    analysis.flights[0].drones.retain(|drone| matches!(drone.slot, Some(1 | 2 | 12 | 23 | 30)));
    insta::assert_snapshot!(terminal_summary(&analysis, 120, false));
}

#[test]
fn campaign_in_a_narrow_terminal() {
    let mut analysis = campaign();
    analysis.flights[0].drones.retain(|drone| matches!(drone.slot, Some(1 | 12 | 23)));
    analysis.flights[1].drones.truncate(3);
    insta::assert_snapshot!(terminal_summary(&analysis, 64, false));
}

#[test]
fn no_line_is_wider_than_the_terminal() {
    for analysis in [campaign(), updraft_series()] {
        for width in [40, 64, 80, 100, 140, 220] {
            for line in terminal_summary(&analysis, width, false).lines() {
                assert!(line.chars().count() <= width, "{width}: {line}");
            }
        }
    }
}

#[test]
fn colour_only_adds_escapes() {
    let plain = terminal_summary(&campaign(), 120, false);
    let coloured = terminal_summary(&campaign(), 120, true);
    assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    let mut stripped = String::new();
    let mut rest = coloured.as_str();
    while let Some(at) = rest.find('\u{1b}') {
        stripped.push_str(&rest[..at]);
        rest = &rest[at..];
        rest = &rest[rest.find('m').unwrap() + 1..];
    }
    stripped.push_str(rest);
    // Trailing blanks inside colour are invisible.
    let trimmed = |text: &str| text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    assert_eq!(trimmed(&stripped), trimmed(&plain));
}
