//! `updraft analyze --csv`: what is wrong with a mapping or a table is said with its place, and what can
//! still be read is.

use std::fmt::Write as _;
use std::fs;

use insta::assert_snapshot;

use crate::cli::support::{Bench, Ended};

const MAPPING: &str = r#"schema = "updraft.csv/1"
title = "A ladder"
indicator = "pulse"

[time]
column = "time"
format = "s"

[effort]
columns = ["motor 1", "motor 2"]

[velocity_up]
columns = ["down"]
scale = -1.0

[height]
columns = ["height"]

[roll]
columns = ["roll"]

[pitch]
columns = ["pitch"]

[[flights]]
name = "ladder"
purpose = "calibration"
files = ["ladder.csv"]
"#;

/// A ladder at 5 Hz, up and down at 1 to 3 m/s for 12 s each, after a hover of 12 s.
fn table() -> Vec<String> {
    const UP_MPS: [f64; 7] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0];
    let mut rows = vec!["time,motor 1,motor 2,down,height,roll,pitch".to_owned()];
    let mut height_m = 20.0;
    for step in 0..7 * 60 {
        let up = UP_MPS[step / 60];
        let pulse_us = 1540.0 + 30.0 * up + (step % 5) as f64;
        height_m += 0.2 * up;
        let time_s = step as f64 / 5.0;
        rows.push(format!(
            "{time_s},{pulse_us},{},{},{height_m:.2},0.01,-0.01",
            pulse_us + 4.0,
            -up
        ));
    }
    rows
}

/// Analyses the table with the mapping.
fn analyze(bench: &Bench, code: i32, mapping: &str, rows: &[String]) -> Ended {
    fs::write(bench.path("mapping.toml"), mapping).unwrap();
    fs::write(bench.path("ladder.csv"), rows.join("\n")).unwrap();
    bench.expect(code, &["analyze", "--csv", "mapping.toml", "--no-report"])
}

/// The messages of mappings, one below the other.
fn refused(changes: &[(&str, &str)]) -> String {
    let bench = Bench::new();
    let mut told = String::new();
    for (from, to) in changes {
        assert!(MAPPING.contains(from), "{from}");
        let ended = analyze(&bench, 2, &MAPPING.replacen(from, to, 1), &table());
        assert_eq!(ended.out, "", "nothing is analysed");
        writeln!(told, "# {to}\n{}", ended.err.trim()).unwrap();
    }
    told
}

#[test]
fn a_wrong_mapping_is_refused_with_the_place() {
    let told = refused(&[
        ("updraft.csv/1", "updraft.csv/7"),
        ("\"pulse\"", "\"thrust\""),
        ("format = \"s\"", "format = \"minutes\""),
        ("[roll]\ncolumns = [\"roll\"]", "[roll]\ncolumns = []"),
        ("[pitch]", "[pitsch]"),
        ("scale = -1.0", "scale = 0.0"),
        ("scale = -1.0", "unit = \"ft/s\""),
        ("[[flights]]", "[steps]\nwobble_mps = nan\n\n[[flights]]"),
        ("[\"ladder.csv\"]", "[]"),
        ("\"calibration\"", "\"training\""),
    ]);
    assert_snapshot!(told);
}

#[test]
fn a_mapping_that_is_not_there() {
    let missing = Bench::new().expect(1, &["analyze", "--csv", "mapping.toml"]);
    assert_snapshot!(missing.err);
}

#[test]
fn a_wrong_table_is_refused_with_its_line() {
    let bench = Bench::new();
    let mut told = String::new();
    let mut say = |what: &str, mapping: &str, rows: &[String]| {
        let ended = analyze(&bench, 5, mapping, rows);
        writeln!(told, "# {what}\n{}", ended.err.trim()).unwrap();
    };
    let changed = |line: usize, from: &str, to: &str| {
        let mut rows = table();
        assert!(rows[line - 1].contains(from), "{}", rows[line - 1]);
        rows[line - 1] = rows[line - 1].replacen(from, to, 1);
        rows
    };
    say("a column is not there", &MAPPING.replace("\"down\"", "\"vd\""), &table());
    say("a cell is no number", MAPPING, &changed(31, "1544", "fast"));
    say("a time is no time", MAPPING, &changed(12, "2,", "soon,"));
    say("a decimal comma", MAPPING, &changed(7, "0.01", "0,01"));
    say("another delimiter", &format!("delimiter = \";\"\n{MAPPING}"), &table());
    say("no rows", MAPPING, &table()[..1]);
    say("nothing at all", MAPPING, &[]);
    say("too few rows", MAPPING, &table()[..15]);
    let backward: Vec<String> =
        table().into_iter().take(1).chain(table().into_iter().rev()).collect();
    say("time runs backward", MAPPING, &backward[..backward.len() - 1]);
    say("a date where seconds are said", &MAPPING.replace("\"s\"", "\"datetime\""), &table());
    say(
        "a quote that is not closed",
        MAPPING,
        &[table()[0].clone(), format!("\"{}", "0.1,1540\n".repeat(200_000))],
    );
    assert_snapshot!(told);
}

/// Lines that end with CR and LF are counted as others, and the first of them is read.
#[test]
fn tables_of_windows_have_the_same_lines() {
    let bench = Bench::new();
    for line in [2, 31] {
        let mut rows = table();
        let mut cells: Vec<&str> = rows[line - 1].split(',').collect();
        cells[1] = "fast";
        rows[line - 1] = cells.join(",");
        for row in &mut rows {
            row.push('\r');
        }
        let ended = analyze(&bench, 5, MAPPING, &rows);
        let words = format!("line {line}, column \"motor 1\": \"fast\" is not a number");
        assert!(ended.err.contains(&words), "{words}: {ended}");
    }
}

#[test]
fn a_table_that_is_missing_or_too_large() {
    let bench = Bench::new();
    fs::write(bench.path("mapping.toml"), MAPPING).unwrap();
    let missing = bench.expect(1, &["analyze", "--csv", "mapping.toml", "--no-report"]);
    // A file with a hole: its size is all that is looked at.
    let huge = fs::File::create(bench.path("ladder.csv")).unwrap();
    huge.set_len((8 << 30) + 1).unwrap();
    let huge = bench.expect(5, &["analyze", "--csv", "mapping.toml", "--no-report"]);
    assert_snapshot!(format!("{}{}", missing.err, huge.err));
}

#[test]
fn one_wrong_table_does_not_stop_the_others() {
    let bench = Bench::new();
    fs::write(bench.path("other.csv"), "time,motor 1\n").unwrap();
    let mapping = MAPPING.replace("[\"ladder.csv\"]", "[\"ladder.csv\", \"other.csv\"]");
    let ended = analyze(&bench, 3, &mapping, &table());
    assert!(ended.out.contains("Logs not used (1)"), "{ended}");
    assert!(ended.out.contains("other.csv: there is no column \"motor 2\""), "{ended}");
}

#[test]
fn the_same_table_twice_is_one_drone() {
    let bench = Bench::new();
    let mapping = MAPPING.replace("[\"ladder.csv\"]", "[\"ladder.csv\", \"ladder.csv\"]");
    let ended = analyze(&bench, 3, &mapping, &table());
    assert!(ended.out.contains("1 of 2 logs used"), "{ended}");
    assert!(ended.out.contains("ladder.csv: it is given twice, and used once"), "{ended}");
}

#[test]
fn a_rotor_that_stands_alone_is_refused_by_name() {
    let bench = Bench::new();
    let mut rows = table();
    for row in &mut rows[1..] {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[2] = "0";
        *row = cells.join(",");
    }
    let ended = analyze(&bench, 5, MAPPING, &rows);
    let words = "ladder.csv: \"motor 2\" is 0 or less in 420 of 420 rows in which the other columns of effort are not: a \
                 mean with it is no rotor effort; leave the column out of [effort]";
    let told = ended.err.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains(words), "{ended}");
}

#[test]
fn degrees_that_are_read_as_radians_are_a_caution() {
    let bench = Bench::new();
    let rows: Vec<String> =
        table().iter().map(|row| row.replace(",0.01,-0.01", ",2.9,-1.2")).collect();
    let ended = analyze(&bench, 0, MAPPING, &rows);
    let cautions = ended.out.split("Cautions").nth(1).unwrap_or_default();
    let told = cautions.split_whitespace().collect::<Vec<_>>().join(" ");
    let words = "angles: roll or pitch of ladder is beyond 45 degrees in 100 % of the rows";
    assert!(told.contains(words) && told.contains("scale = 0.0174533"), "{ended}");
    assert!(!ended.out.contains("ladder: angles"), "it is said once: {ended}");
}

#[test]
fn what_can_be_read_is_read_and_the_rest_is_told() {
    let bench = Bench::new();
    // A mark at the start, rows that go back, empty and infinite cells, a last line that is cut off.
    let mut rows = table();
    rows[0].insert(0, '\u{feff}');
    let twice = rows[40].clone();
    rows.insert(50, twice);
    rows[60] = rows[60].replacen("0.01", "", 1);
    rows[61] = rows[61].replacen("0.01", "inf", 1);
    rows.push("84.0,15".to_owned());
    let ended = analyze(&bench, 0, MAPPING, &rows);
    assert!(ended.out.contains("A\u{2032} = 30.0"), "{ended}");
    let notes = ended.out.split("Notes on drones").nth(1).unwrap_or_default();
    assert_snapshot!(notes.split("\n\n").next().unwrap_or_default().trim_end());
}

#[test]
fn rows_without_numbers_are_counted() {
    let bench = Bench::new();
    let mut rows = table();
    for row in &mut rows[100..150] {
        let mut cells: Vec<&str> = row.split(',').collect();
        cells[1] = "NaN";
        *row = cells.join(",");
    }
    let ended = analyze(&bench, 0, MAPPING, &rows);
    let from = ended.out.find("effort: ").unwrap_or_else(|| panic!("{ended}"));
    let told: Vec<&str> = ended.out[from..].lines().take(2).map(str::trim).collect();
    assert_snapshot!(told.join(" "));
}

#[cfg(unix)]
#[test]
fn what_has_no_end_is_refused_and_what_never_begins_is_not_waited_for() {
    let bench = Bench::new();
    let endless = bench.expect(1, &["analyze", "--csv", "/dev/zero", "--no-report"]);
    assert!(endless.err.contains("/dev/zero") && endless.err.contains("allowed here"), "{endless}");
    let folder = bench.expect(1, &["analyze", "--csv", ".", "--no-report"]);
    assert!(folder.err.contains("is a directory"), "{folder}");
    let pipe = bench.path("ladder.csv");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    fs::write(bench.path("mapping.toml"), MAPPING).unwrap();
    let waiting = bench.run(&["analyze", "--csv", "mapping.toml", "--no-report"]);
    let said = format!("{}{}", waiting.out, waiting.err);
    assert!(waiting.code != Some(0) && said.contains("it is not a file but a pipe"), "{waiting}");
    let mapping = MAPPING.replace("ladder.csv", "/dev/zero");
    fs::write(bench.path("mapping.toml"), mapping).unwrap();
    let zeros = bench.run(&["analyze", "--csv", "mapping.toml", "--no-report"]);
    assert!(zeros.code != Some(0), "{zeros}");
    let mapping = bench.expect(1, &["analyze", "--csv", "ladder.csv", "--no-report"]);
    assert!(mapping.err.contains("it is not a file but a pipe"), "{mapping}");
}

#[test]
fn a_local_time_tells_when_in_utc() {
    let bench = Bench::new();
    let dated: Vec<String> = table()
        .into_iter()
        .map(|row| match row.split_once(',') {
            Some(("time", _)) => row,
            Some((time_s, rest)) => {
                let time_s: f64 = time_s.parse().unwrap();
                let (minute, second) = (29 + (time_s / 60.0) as u32, time_s % 60.0);
                format!("2021-04-20 09:{minute:02}:{second:06.3},{rest}")
            }
            None => unreachable!("a row without a comma"),
        })
        .collect();
    fs::write(bench.path("ladder.csv"), dated.join("\n")).unwrap();
    let start = |time: &str| {
        let mapping = MAPPING.replace("format = \"s\"", time);
        fs::write(bench.path("mapping.toml"), mapping).unwrap();
        bench.expect(0, &["analyze", "--csv", "mapping.toml", "-o", "out"]);
        let read = |file: &str| fs::read_to_string(bench.path("out").join(file)).unwrap();
        let analysis: serde_json::Value = serde_json::from_str(&read("analysis.json")).unwrap();
        (analysis["flights"][0]["drones"][0]["clock"]["start"].clone(), read("report/index.html"))
    };
    let (unknown, _) = start("format = \"datetime\"");
    assert!(unknown.is_null(), "{unknown}");
    // 2021-04-20 07:29:00 UTC: in GPS week 2154, two days, that time and the leap seconds.
    let (known, page) = start("format = \"datetime\"\nutc_offset_h = 2");
    let ms = (2 * 24 * 3600 + 7 * 3600 + 29 * 60 + 18) * 1000;
    assert_eq!(known, serde_json::json!({"week": 2154, "tow_ms": ms}));
    assert!(page.contains("2021-04-20") && page.contains("07:29"), "the page does not tell when");
}
