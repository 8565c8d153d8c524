//! A flight of the real firmware: its times and places, as other programs read them from its log.

use std::fs;

use crate::analysis::support::fixture;
use crate::cli::support::Bench;
use crate::products::support::{can_run, python};

/// Show time 0 of the hover: the start that the firmware was given, 2026-11-21 10:20:28 UTC.
const START_UNIX_S: f64 = 1_795_256_428.0;

/// Analyses the hover with the laws of the ladder; the folder has `out/fields`.
fn analysed(bench: &Bench) {
    let logs = ["ladder-still.trimmed.BIN", "hover-still.trimmed.BIN"].map(fixture);
    let [ladder, hover] = logs.each_ref().map(|path| path.to_str().unwrap());
    bench.expect(0, &["analyze", ladder, hover, "-o", "out", "--institution", "A weather service"]);
}

#[test]
fn a_log_of_the_firmware_tells_where_and_when_it_was() {
    let bench = Bench::new();
    analysed(&bench);
    let table = fs::read_to_string(bench.path("out/fields/updraft.csv")).unwrap();
    let mut lines = table.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|one| *one == name).unwrap();
    let mut count = 0;
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |name: &str| fields[column(name)].parse::<f64>().unwrap();
        let utc = fields[column("utc")];
        let (day, time) = utc.split_once('T').unwrap();
        let clock: Vec<f64> =
            time.trim_end_matches('Z').split(':').map(|part| part.parse().unwrap()).collect();
        let second = clock[0] * 3600.0 + clock[1] * 60.0 + clock[2];
        assert_eq!(day, "2026-11-21");
        // 20 778 days after 1970-01-01.
        assert_eq!(20_778.0 * 86_400.0 + second, START_UNIX_S + number("time_s"), "{line}");
        // GPS rows of the log, by pymavlink: -35.3633468, 149.1652581; 584.09 m on the ground, 30 m above it.
        assert!((number("latitude_deg") + 35.363_346_8).abs() < 2e-6, "{line}");
        assert!((number("longitude_deg") - 149.165_258_1).abs() < 2e-6, "{line}");
        assert!((number("height_agl_m") - 30.0).abs() < 0.1, "{line}");
        assert!((number("altitude_amsl_m") - 614.09).abs() < 0.1, "{line}");
        assert_eq!(fields[column("place_by")], "log");
        assert_eq!(fields[column("u_mps")], "", "nobody said what drag it has: {line}");
        count += 1;
    }
    assert!(count > 30, "{count}");
    for file in ["updraft.nc", "updraft.kml", "updraft.geojson"] {
        assert!(bench.path(&format!("out/fields/{file}")).is_file(), "{file}");
    }
    let page = fs::read_to_string(bench.path("out/report/index.html")).unwrap();
    let page = page.replace("&#x2f;", "/");
    for link in ["../fields/updraft.nc", "../fields/updraft.kml", "../fields/updraft.geojson"] {
        assert!(page.contains(link), "{link}");
    }
}

#[test]
fn its_times_are_those_that_pymavlink_reads() {
    if !can_run("pymavlink, pandas") {
        return;
    }
    let bench = Bench::new();
    analysed(&bench);
    let log = fixture("hover-still.trimmed.BIN");
    let script = format!(
        r#"
import pandas, statistics
from pymavlink import mavutil
log = mavutil.mavlink_connection({:?})
utc, show = [], []
while (row := log.recv_match(type=["GPS", "SHOW"])) is not None:
    if row.get_type() == "GPS" and row.Status >= 3:
        utc.append(315964800 + 604800 * row.GWk + row.GMS / 1e3 - 18 - row.TimeUS / 1e6)
    if row.get_type() == "SHOW" and row.Stage in (3, 4):
        show.append(row.TimeUS / 1e6 - row.ClockMS / 1e3)
start = statistics.median(utc) + statistics.median(show)
table = pandas.read_csv("out/fields/updraft.csv", parse_dates=["utc"])
off = table.utc.astype("int64") / {{"datetime64[ns, UTC]": 1e9, "datetime64[us, UTC]": 1e6}}[str(table.utc.dtype)] - table.time_s - start
print(off.min(), off.max())
assert (off.abs() < 0.25).all()
"#,
        log.to_str().unwrap()
    );
    python(&bench.path("."), &script);
}

/// The Python of docs/products.md, in a folder with such a campaign.
#[test]
fn the_documents_python_runs() {
    if !can_run("xarray, netCDF4, pandas, pyarrow") {
        return;
    }
    let bench = Bench::new();
    analysed(&bench);
    fs::rename(bench.path("out"), bench.path("my-campaign")).unwrap();
    for document in ["docs/products.md", "docs/fields.md"] {
        let text =
            fs::read_to_string(format!("{}/{document}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let blocks: Vec<&str> = text
            .split("```python\n")
            .skip(1)
            .filter_map(|rest| rest.split("```").next())
            // Of grids and of turbulence elsewhere: this campaign has neither.
            .filter(|block| !block.contains("updraft-grid") && !block.contains("turbulence"))
            .collect();
        assert!(!blocks.is_empty(), "{document}");
        for block in blocks {
            python(&bench.path("."), block);
        }
    }
}
