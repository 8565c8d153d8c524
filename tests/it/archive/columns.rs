//! The documents name the columns that the tables have.

use crate::archive::support::{Campaign, archive, table};
use crate::cli::support::Bench;

/// Names in backquotes in the first column of the table below a heading of docs/archive.md.
fn documented(heading: &str) -> Vec<String> {
    let text = include_str!("../../../docs/archive.md");
    let (_, section) = text.split_once(&format!("\n## {heading}\n")).unwrap();
    let section = section.split("\n## ").next().unwrap();
    let rows = section.lines().filter(|line| line.starts_with("| `"));
    let first = rows.map(|row| row.split('|').nth(1).unwrap());
    first
        .flat_map(|cell| cell.split('`').skip(1).step_by(2).map(str::to_owned).collect::<Vec<_>>())
        .collect()
}

#[test]
fn every_column_is_documented_and_none_besides() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("june"));
    archive(&bench, 0, &["june"]);
    for name in ["flights", "drones", "thermals", "verdicts", "seconds"] {
        let (mut columns, _) = table(&bench.path("archive"), name);
        let mut wanted = documented(name);
        columns.sort();
        wanted.sort();
        assert_eq!(columns, wanted, "{name}");
    }
}
