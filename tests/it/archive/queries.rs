//! The queries of docs/archive.md, run by DuckDB, and what pyarrow reads.

use std::fs;
use std::io::Write as _;
use std::process::Command;

use serde_json::{Value, json};
use updraft::analysis::law::Symbol;
use updraft::analysis::result::{Analysis, Laws};

use crate::archive::support::{Campaign, archive, python_has};
use crate::cli::support::Bench;

/// Runs the blocks of a document in one connection, and prints the rows of each by the comment that it begins with.
const RUN_BLOCKS: &str = r#"
import duckdb, json, re, sys
text = open(sys.argv[1], encoding="utf-8").read()
found = {}
for block in re.findall(r"```sql\n(.*?)```", text, re.S):
    rows = duckdb.sql(block)
    title = re.match(r"-- (.*)", block)
    if title:
        found[title[1]] = [dict(zip(rows.columns, map(str, row))) for row in rows.fetchall()]
print(json.dumps(found))
"#;

/// Runs the Python blocks of a document.
const RUN_PYTHON: &str = r#"
import re, sys
for block in re.findall(r"```python\n(.*?)```", open(sys.argv[1], encoding="utf-8").read(), re.S):
    for line in block.splitlines():
        try:
            exec(line)
        except ModuleNotFoundError as missing:
            if missing.name != "pandas": raise
"#;

/// Whether Python has the module; says so if not.
fn can_run(module: &str) -> bool {
    let can = python_has(module);
    if !can {
        // Written directly: the harness swallows what a passing test prints.
        let _ = writeln!(
            std::io::stderr(),
            "SKIPPED: Python has no {module} for tests/it/archive/queries.rs; pip install {module}"
        );
    }
    can
}

fn python(bench: &Bench, script: &str) -> String {
    let document = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/archive.md");
    let output = Command::new("python3")
        .args(["-c", script, document])
        .current_dir(bench.path("."))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn u0_of(laws: &mut Laws) -> &mut f64 {
    let fit = laws.signed_quadratic.as_mut().unwrap();
    &mut fit.parameters.iter_mut().find(|one| one.name == Symbol::U0).unwrap().estimate.value
}

fn thermal(peak_mps: f64) -> Value {
    let known = |value: f64, se: f64| json!({"value": value, "se": se});
    json!({
        "time_s": 100.0, "core_m": [known(3.0, 1.0), known(-4.0, 1.0)],
        "drift_mps": [known(0.5, 0.1), known(0.0, 0.1)], "radius_m": known(20.0, 2.0),
        "peak_mps": known(peak_mps, 0.2), "flux_m3ps": known(900.0, 90.0),
        "sink": known(0.5, 0.1), "log_odds": 12.0
    })
}

/// Five weeks: the motors of the drone in slot 2 weaken by 2 us a week, and weather moves all. Each campaign has a weak
/// and a strong thermal, in more and more wind.
fn season(bench: &Bench) {
    for week in 0..5_i32 {
        let mut campaign = Campaign::on_day(7 * i64::from(week));
        let Analysis { flights, .. } = &mut campaign.analysis;
        for (drone, number) in flights[0].drones.iter_mut().zip(1..) {
            let wear = if number == 2 { 2.0 } else { 0.0 };
            let noise = f64::from((week * 7 + number * 3) % 5) * 0.02;
            let weather = f64::from((week * 3) % 4) * 6.0;
            *u0_of(drone.laws.as_mut().unwrap()) =
                1598.6 + weather + wear * f64::from(week) + noise;
        }
        let statistics = flights[1].statistics.as_mut().unwrap();
        let wind = statistics.wind.as_mut().unwrap();
        wind.speed_mps.as_mut().unwrap().value = 1.5 + f64::from(week);
        let thermals = [thermal(2.5 + f64::from(week)), thermal(1.0)];
        flights[1].map.as_mut().unwrap().thermals =
            thermals.map(|one| serde_json::from_value(one).unwrap()).into();
        campaign.start_unix_s += i64::from(week) * 3600;
        campaign.write(&bench.path(&format!("season/week-{week}")));
    }
}

#[test]
fn every_query_of_the_document_runs_and_finds_what_is_there() {
    if !can_run("duckdb") {
        return;
    }
    let bench = Bench::new();
    season(&bench);
    archive(&bench, 0, &["season"]);
    let found: Value = serde_json::from_str(&python(&bench, RUN_BLOCKS)).unwrap();
    let rows = |title: &str| {
        let titles = found.as_object().unwrap();
        let key =
            titles.keys().find(|key| key.starts_with(title)).unwrap_or_else(|| panic!("{title}"));
        found[key].as_array().unwrap().clone()
    };
    let thermals = rows("thermals above 2 m/s");
    let of = |row: &Value, column: &str| row[column].as_str().unwrap().to_owned();
    let told: Vec<(String, String)> =
        thermals.iter().map(|row| (of(row, "peak_mps"), of(row, "wind_mps"))).collect();
    let wanted = [("3.5", "2.5"), ("2.5", "1.5")];
    assert_eq!(told, wanted.map(|(peak, wind)| (peak.to_owned(), wind.to_owned())));
    assert_eq!(of(&thermals[1], "utc"), "2026-06-01 09:31:40");
    assert!(of(&thermals[1], "campaign").starts_with("week-0-"));

    let weak = rows("drones whose motors weakened");
    assert_eq!(weak.len(), 1, "{weak:?}");
    assert_eq!((of(&weak[0], "airframe").as_str(), of(&weak[0], "flights").as_str()), ("12", "5"));
    let slope: f64 = of(&weak[0], "us_per_month").parse().unwrap();
    assert!((slope - 60.0 / 7.0).abs() < 0.1, "{slope} us a month");

    let hours: Vec<String> = rows("mean w by hour").iter().map(|row| of(row, "hour_utc")).collect();
    assert_eq!(hours, ["9", "10", "11", "12", "13"]);
    let week = rows("the profile of a week");
    assert_eq!(week.len(), 1, "{week:?}");
    assert_eq!(
        (of(&week[0], "date").as_str(), of(&week[0], "height_m").as_str()),
        ("2026-06-01", "100.0")
    );
    assert!(rows("effects by how often").is_empty(), "no verdicts");
    assert_eq!(rows("errors of the maps").len(), 5);
}

#[test]
fn a_missing_date_is_a_null_for_duckdb() {
    if !can_run("duckdb") {
        return;
    }
    let bench = Bench::new();
    Campaign::on_day(3).write(&bench.path("known"));
    let mut unknown = Campaign::on_day(0);
    unknown.is_recorded = false;
    unknown.write(&bench.path("unknown"));
    Campaign { analysis: crate::archive::support::small(), ..Campaign::on_day(0) }
        .analyse_again(&bench.path("unknown"));
    archive(&bench, 0, &["known", "unknown"]);
    let script = "import duckdb; print(duckdb.sql(\"SELECT DISTINCT date FROM \
        read_parquet('archive/flights/**/*.parquet', hive_partitioning = true) ORDER BY date\").fetchall())";
    let said = python(&bench, script);
    assert_eq!(said.trim(), "[(datetime.date(2026, 6, 4),), (None,)]");
}

#[test]
fn pyarrow_reads_what_the_document_says() {
    if !can_run("pyarrow") {
        return;
    }
    let bench = Bench::new();
    season(&bench);
    archive(&bench, 0, &["season"]);
    let said = python(&bench, RUN_PYTHON);
    assert!(
        said.contains("posterior_mps: double") && said.contains("utc: timestamp[ms]"),
        "{said}"
    );
    let count = "import pyarrow.dataset as d; print(d.dataset('archive/drones', partitioning='hive').count_rows())";
    assert_eq!(python(&bench, count).trim(), "60", "6 drones, 2 flights, 5 weeks");
    assert!(fs::metadata(bench.path("archive/archive.json")).is_ok());
}
