//! A campaign beside a mast: a real one, one that is known, and wrong records.

#![expect(clippy::unwrap_used, reason = "a test that cannot run the program fails")]

#[cfg(all(feature = "netcdf", feature = "netcdf-input"))]
mod netcdf;
mod slow;
mod tables;

use std::fmt::Write as _;
use std::fs;

use serde_json::Value;

use crate::cli::support::Bench;

const MAPPING: &str = include_str!("../../../templates/csv/phantom4-mast.toml");
const LEGS: &str = include_str!("../../data/phantom4/phantom4-vertical-3ms.csv");
const HOVER: &str = include_str!("../../data/phantom4/phantom4-hover-first300s.csv");
const MAST: &str = r#"schema = "updraft.mast/1"
name = "sonics"
file = "phantom4-hover-first300s.csv"
[time]
column = "Time"
format = "datetime"
[w]
columns = ["windVert_1800cm", "windVert_2130cm"]
"#;

/// A camera drone beside a mast (Meier et al. 2022), analysed.
fn analysed() -> Bench {
    let bench = Bench::new();
    fs::write(bench.path("phantom4-vertical-3ms.csv"), LEGS).unwrap();
    fs::write(bench.path("phantom4-hover-first300s.csv"), HOVER).unwrap();
    let utc = "format = \"datetime\"\nutc_offset_h = 0";
    fs::write(bench.path("map.toml"), MAPPING.replacen("format = \"datetime\"", utc, 1)).unwrap();
    fs::write(bench.path("mast.toml"), MAST).unwrap();
    let zero = ["--zero", "0..150s", "--vehicle", "phantom4"];
    bench.expect(0, &[&["analyze", "--csv", "map.toml", "-o", "out"], &zero[..]].concat());
    bench
}

/// Values of the drone: seconds since 1970, UTC, and w, m/s.
fn values(bench: &Bench) -> Vec<(f64, f64)> {
    let analysis: Value =
        serde_json::from_slice(&fs::read(bench.path("out/analysis.json")).unwrap()).unwrap();
    let map = &analysis["flights"][1]["map"];
    let start = &analysis["flights"][1]["drones"][0]["clock"]["start"];
    // GPS time begins at 1980-01-06 and was 18 s ahead of UTC.
    let zero_s =
        number(&start["week"]) * 604_800.0 + number(&start["tow_ms"]) / 1000.0 + 315_964_800.0
            - 18.0;
    let times = map["time_s"].as_array().unwrap().iter();
    let all = times.zip(map["drones"][0]["updraft_mps"].as_array().unwrap());
    all.filter_map(|(time, value)| Some((zero_s + number(time), value.as_f64()?))).collect()
}

/// The campaign beside a mast, as JSON.
fn compared(bench: &Bench, mast: &str) -> Value {
    let ended = bench.expect(0, &["compare", "out", "--mast", mast, "--json"]);
    ended.json("updraft.mast-comparison/1")
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

#[test]
fn a_real_drone_beside_a_real_mast() {
    let bench = analysed();
    let ended =
        bench.expect(0, &["compare", "out", "--mast", "mast.toml", "-o", "beside", "--json"]);
    let found = ended.json("updraft.mast-comparison/1");
    let flight = &found["flights"][0];
    // Zero by the first half, so that the bias is no result; the differences are.
    assert!(number(&flight["fleet"]["bias_mps"]).abs() < 0.1, "{:#}", flight["fleet"]);
    assert!((0.35..0.50).contains(&number(&flight["fleet"]["rms_mps"])), "{:#}", flight["fleet"]);
    assert!(number(&flight["averages"][1]["fleet"]["rms_mps"]) < 0.3, "{:#}", flight["averages"]);
    let [shift_s, correlation] = [0, 1].map(|at| number(&flight["best_shift"][at]));
    assert!(shift_s < 0.0 && correlation > 0.5, "the drone meets the air first: {shift_s}");
    let variance = |of: &str| number(&flight[of]["value"]);
    assert!((0.2..0.24).contains(&variance("mast_variance")), "{:#}", flight["mast_variance"]);
    assert!(variance("drone_variance") < variance("mast_variance"));
    let page = fs::read_to_string(bench.path("beside/report/index.html")).unwrap();
    assert!(page.contains("2021-04-20 09:29:") && page.contains("mast-time-hover.svg"));
    assert!(bench.path("beside/mast.json").is_file());
    let text = bench.expect(0, &["compare", "out", "--mast", "mast.toml"]).out;
    let words: Vec<&str> = text.split_whitespace().collect();
    assert!(words.join(" ").contains("the bias is within the two together (95 %)"), "{text}");
}

/// A mast that says what the drones say, with a known shift, scale and delay.
#[test]
fn a_known_mast_is_found_out() {
    let bench = analysed();
    let values = values(&bench);
    let mut table = "utc,w\n".to_owned();
    for (time_s, w) in values {
        writeln!(table, "{:.3},{}", time_s + 4.0, 0.5 + 0.8 * w).unwrap();
    }
    fs::write(bench.path("tower.csv"), table).unwrap();
    let ended = bench.expect(0, &["compare", "out", "--mast", "tower.csv", "--json"]);
    let found: Value = serde_json::from_str(&ended.out).unwrap();
    let flight = &found["flights"][0];
    let [shift_s, correlation] = [0, 1].map(|at| number(&flight["best_shift"][at]));
    assert!((shift_s + 4.0).abs() <= 1.0 && correlation > 0.97, "{shift_s} {correlation}");
    let bias = number(&flight["fleet"]["bias_mps"]);
    let mean = number(&flight["fleet"]["mast_mean_mps"]);
    // The drones' mean is (mast - 0.5) / 0.8.
    assert!((bias - ((mean - 0.5) / 0.8 - mean)).abs() < 0.05, "{bias} {mean}");
}

#[test]
fn wrong_records_are_refused_in_words() {
    let bench = analysed();
    let says = |code: i32, mast: &str, words: &str| {
        let ended = bench.expect(code, &["compare", "out", "--mast", mast]);
        assert!(ended.err.contains(words), "{mast}: {ended}");
    };
    says(1, "nowhere.csv", "No such file");
    let write = |name: &str, text: &str| fs::write(bench.path(name), text).unwrap();
    write("no-w.csv", "utc,speed\n2021-04-20T09:30:00Z,1\n");
    says(2, "no-w.csv", "no column with the vertical air speed");
    let rows = |step_s: u64, from: &str| -> String {
        let row = |k: u64| {
            let at = k * step_s;
            format!("{from} {:02}:{:02}:{:02},0.1\n", 9 + at / 3600, at / 60 % 60, at % 60)
        };
        format!("utc,w\n{}", (0..200).map(row).collect::<Vec<_>>().concat())
    };
    let hours = |k: u64| format!("2021-04-{:02} {:02}:00:00,0.1\n", 19 + k / 12, 2 * (k % 12));
    let slowest: String = (0..30).map(hours).collect();
    write("slowest.csv", &format!("utc,w\n{slowest}"));
    says(2, "slowest.csv", "its values are 7200 s apart: give one with means over 3600 s or less");
    write("slow.csv", &rows(600, "2021-04-20").lines().take(60).collect::<Vec<_>>().join("\n"));
    says(5, "slow.csv", "no mean of the mast over 600 s lies within the flight");
    write("other-day.csv", &rows(1, "2021-04-21"));
    says(5, "other-day.csv", "0 s are in both records");
    write(
        "two-spreads.toml",
        &format!("{MAST}[w_sd]\ncolumns = [\"a\"]\n[w_variance]\ncolumns = [\"b\"]\n"),
    );
    says(2, "two-spreads.toml", "w_variance and w_sd say the same");
    let time = "[time]\ncolumn = \"Time\"\nformat = \"datetime\"\n";
    write("no-time.toml", &MAST.replace(time, ""));
    says(2, "no-time.toml", "it is a table, and the mapping has no [time]");
    write("mast-wrong.toml", &MAST.replace("[w]", "height_m = \"x\"\n[w]"));
    says(2, "mast-wrong.toml", "mast-wrong.toml");
    write("one-wind.toml", &format!("{MAST}[u]\ncolumns = [\"roll\"]\n"));
    says(2, "one-wind.toml", "u and v are given both or not at all");
    write("no-column.toml", &MAST.replace("windVert_2130cm", "windVert_9m"));
    says(2, "no-column.toml", "there is no column \"windVert_9m\"");
    let two = bench.expect(2, &["compare", "out", "out", "--mast", "mast.toml"]);
    assert!(two.err.contains("--mast takes one campaign"), "{two}");
    let one = bench.expect(2, &["compare", "out"]);
    assert!(one.err.contains("give two campaigns or more, or one with --mast"), "{one}");
    let over = bench.expect(2, &["compare", "out", "--mast", "mast.toml", "-o", "out"]);
    assert!(over.err.contains("report would be overwritten"), "{over}");
}
