//! Tables as loggers and programs write them, and doubts about what they say.

use std::fmt::Write as _;
use std::fs;

use updraft::products::iso;

use super::{analysed, compared, number, values};

/// Date and time of day of seconds since 1970, with a blank between.
fn blank(time_s: f64) -> String {
    iso((time_s * 1000.0).round() as i64).replace('T', " ").trim_end_matches('Z').to_owned()
}

/// What the drone says, as some program would write it: lines before the rows, and each row by its time and value.
fn written(values: &[(f64, f64)], before: &str, row: impl Fn(f64, f64) -> String) -> String {
    let rows = values.iter().map(|(time_s, w)| row(*time_s, *w) + "\n");
    format!("{before}\n{}", rows.collect::<String>())
}

#[test]
fn tables_of_loggers_and_programs_are_read_as_they_are() {
    let bench = analysed();
    let values = values(&bench);
    let toa5 = "\"TOA5\",\"tower\",\"CR3000\",\"4711\",\"CR3000.Std.31\",\"CPU:flux.CR3\",\"12345\",\"raw\"\n\
                \"TIMESTAMP\",\"RECORD\",\"Ux\",\"Uz\"\n\"TS\",\"RN\",\"m/s\",\"m/s\"\n\"\",\"\",\"Smp\",\"Smp\"";
    let ms = |time_s: f64| (time_s * 1000.0).round();
    let tables = [
        ("plain.csv", written(&values, "utc,w", |at, w| format!("{at:.3},{w}"))),
        ("toa5.dat", written(&values, toa5, |at, w| format!("\"{}\",7,\"NAN\",{w}", blank(at)))),
        ("pandas.csv", written(&values, "time,w", |at, w| format!("{}+00:00,{w}", blank(at)))),
        (
            "zone.csv",
            written(&values, "time,w", |at, w| format!("{}+0200,{w}", blank(at + 7200.0))),
        ),
        ("semicolons.csv", written(&values, "utc;w", |at, w| format!("{};{w}", blank(at)))),
        ("tabs.tsv", written(&values, "utc\tw", |at, w| format!("{}\t{w}", blank(at)))),
        ("ms.csv", written(&values, "time,w", |at, w| format!("{},{w}", ms(at)))),
        ("us.csv", written(&values, "time,w", |at, w| format!("{},{w}", 1000.0 * ms(at)))),
        ("ns.csv", written(&values, "time,w", |at, w| format!("{},{w}", 1e6 * ms(at)))),
        (
            "apart.csv",
            written(&values, "# tower\ndate,time,w", |at, w| {
                let all = blank(at);
                let (date, clock) = all.split_once(' ').unwrap();
                format!("{date},{clock},{w}")
            }),
        ),
    ];
    for (name, table) in tables {
        fs::write(bench.path(name), table).unwrap();
        let found = compared(&bench, name);
        let fleet = &found["flights"][0]["fleet"];
        assert!(fleet["count"].as_u64().unwrap() > 200, "{name}: {fleet:#}");
        assert!(number(&fleet["correlation"]) > 0.9, "{name}: {fleet:#}");
        let shift = &found["flights"][0]["best_shift"];
        assert!(number(&shift[0]).abs() <= 1.0 && number(&shift[1]) > 0.9, "{name}: {shift}");
        let notes = found["notes"].to_string();
        let has_note = notes.contains("the names of the mast's columns are taken from line 2");
        assert_eq!(has_note, ["toa5.dat", "apart.csv"].contains(&name), "{name}: {notes}");
    }
    // The same by a description, whose columns are found below the first line, too.
    let mapping = "schema = \"updraft.mast/1\"\nfile = \"toa5.dat\"\n[time]\ncolumn = \"TIMESTAMP\"\nformat = \
                   \"datetime\"\n[w]\ncolumns = [\"Uz\"]\n";
    fs::write(bench.path("toa5.toml"), mapping).unwrap();
    let found = compared(&bench, "toa5.toml");
    assert!(number(&found["flights"][0]["fleet"]["correlation"]) > 0.9);
    let mapping = "schema = \"updraft.mast/1\"\nfile = \"apart.csv\"\n[time]\ncolumn = \"date\"\ntime_of_day = \
                   \"time\"\nformat = \"datetime\"\n[w]\ncolumns = [\"w\"]\n";
    fs::write(bench.path("apart.toml"), mapping).unwrap();
    let found = compared(&bench, "apart.toml");
    assert!(number(&found["flights"][0]["fleet"]["correlation"]) > 0.9);
}

/// Means over a minute with groups of columns, names and units, date and time apart, and -9999 for what is missing.
#[test]
fn means_of_eddypro_are_read_as_they_are() {
    let bench = analysed();
    let values = values(&bench);
    let first_s = (values[0].0 / 60.0).floor() * 60.0;
    let mut table = "file_info,,,,wind,,\nfilename,date,time,DOY,w_unrot,w_rot,w_var\n\
                     ,[yyyy-mm-dd],[HH:MM],[ddd.ddd],[m+1s-1],[m+1s-1],[m+2s-2]\n"
        .to_owned();
    for k in 0..8 {
        let from_s = first_s + 60.0 * f64::from(k);
        let within = values.iter().filter(|(at, _)| (from_s..from_s + 60.0).contains(at));
        let within: Vec<f64> = within.map(|(_, w)| *w).collect();
        let mean = within.iter().sum::<f64>() / within.len().max(1) as f64;
        let end = blank(from_s + 60.0);
        let (date, clock) = end.split_once(' ').unwrap();
        let variance = if k == 1 { "-0.3" } else { "0.2" };
        writeln!(table, "raw.dat,{date},{},110.4,{mean},-9999.0,{variance}", &clock[..5]).unwrap();
    }
    fs::write(bench.path("eddypro.csv"), table).unwrap();
    let found = compared(&bench, "eddypro.csv");
    let fleet = &found["flights"][0]["fleet"];
    assert!(fleet["count"].as_u64().unwrap() >= 3, "{fleet:#}");
    assert!(number(&fleet["correlation"]) > 0.98, "{fleet:#}");
    assert!((number(&found["flights"][0]["period_variance"]["mast"]) - 0.2).abs() < 1e-9);
    let notes = found["notes"].to_string();
    assert!(notes.contains("line 2, values from line 4 on: line 3 is no value"), "{notes}");
    assert!(notes.contains("1 variances of w at the mast are below zero"), "{notes}");
}

#[test]
fn doubts_about_a_record_are_told() {
    let bench = analysed();
    let values = values(&bench);
    let notes = |name: &str, table: String| {
        fs::write(bench.path(name), table).unwrap();
        compared(&bench, name)["notes"].to_string()
    };
    let mirrored = notes("down.csv", written(&values, "utc,w", |at, w| format!("{at:.3},{}", -w)));
    assert!(mirrored.contains("falls where the drones' rises"), "{mirrored}");
    let kept: Vec<(f64, f64)> = values.iter().filter(|(at, _)| at % 60.0 < 45.0).copied().collect();
    let holes = notes("holes.csv", written(&kept, "utc,w", |at, w| format!("{at:.3},{w}")));
    assert!(holes.contains("of the mast's values of w between its first and its last are missing"));
    let whole = notes("plain.csv", written(&values, "utc,w", |at, w| format!("{at:.3},{w}")));
    for word in ["falls where", "missing", "names of the mast", "below zero"] {
        assert!(!whole.contains(word), "{word}: {whole}");
    }
}

#[test]
fn tables_that_cannot_be_read_say_what_is_there() {
    let bench = analysed();
    let says = |name: &str, table: &str, words: &str| {
        fs::write(bench.path(name), table).unwrap();
        let ended = bench.expect(2, &["compare", "out", "--mast", name]);
        assert!(ended.err.contains(words), "{name}: {ended}");
    };
    says("w.csv", "utc;speed\n2021-04-20T09:30:00Z;1\n", "the columns are: utc, speed");
    says("t.csv", "when,w\n1,1\n", "the columns are: when, w");
    says("empty.csv", "", "the columns are: none");
    says("noon.csv", "utc,w\nnoon,1\n", "line 2, column \"utc\": \"noon\" is not a time");
    let late = "# tower\nutc,w\n2021-04-20T09:30:00Z,1\n2021-04-20T09:30:01Z,much\n";
    says("late.csv", late, "line 4, column \"w\": \"much\" is not a number");
    says("one.csv", "utc,w\n2021-04-20T09:30:00Z,0.1\n", "it has one value of w alone");
}
