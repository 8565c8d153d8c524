//! Drones that move at constant horizontal speed measure the air along their tracks: from the template to
//! the table and the figure, against the air that was simulated.

use std::fs;

use serde_json::Value;

use crate::cli::support::Bench;

/// A field of updrafts that changes over 60 m, gusts, and a wind across the legs.
const AIR: [&str; 6] =
    ["--air", "field:sd=0.6,lambda=60,tau=300", "--wind", "2", "--wind-from", "60"];

/// A calibration in still air and a scan of one pass, planned and flown by two drones.
fn flown(vehicle: &str, seed: u64) -> Bench {
    let bench = Bench::new();
    let plan = ["plan", "scan-campaign", "--grid", "1x2", "-o", "campaign", "--set"];
    let vehicle = format!("vehicle={vehicle}");
    let short = ["--set", "scan.passes=1", "--speeds", "1,2,3"];
    bench.expect(0, &[&plan[..], &[&vehicle], &short].concat());
    let seed = seed.to_string();
    let fly = ["simulate", "campaign", "--quiet", "--seed", &seed, "--flight"];
    bench.expect(0, &[&fly[..], &["calibration"]].concat());
    bench.expect(0, &[&fly[..], &["scan", "--truth"], &AIR].concat());
    bench
}

/// The scan's part of the analysis.
fn scan(bench: &Bench, options: &[&str]) -> Value {
    let args = ["analyze", "campaign", "--no-report", "--json", "--quiet"];
    let value = bench.expect(0, &[&args[..], options].concat()).json("updraft.analyze/1");
    value["analysis"]["flights"][1].clone()
}

fn number(value: &Value, path: &str) -> f64 {
    value.pointer(path).and_then(Value::as_f64).unwrap()
}

/// Mean width of the intervals, m/s.
fn width_mps(scan: &Value) -> f64 {
    let drones = scan["map"]["drones"].as_array().unwrap();
    let intervals = drones.iter().flat_map(|drone| drone["interval_mps"].as_array().unwrap());
    let widths: Vec<f64> = intervals
        .filter_map(|interval| Some(interval.get(1)?.as_f64()? - interval.get(0)?.as_f64()?))
        .collect();
    widths.iter().sum::<f64>() / widths.len() as f64
}

#[test]
fn the_air_along_the_track_is_what_was_there() {
    for (vehicle, seed) in [("pixel", 1), ("pixel", 2), ("airsim-generic-quad", 3)] {
        let bench = flown(vehicle, seed);
        let found = scan(&bench, &[]);
        let truth = |key: &str| number(&found, &format!("/map/truth/{key}"));
        let (rms, zero) = (truth("rms_mps"), truth("zero_rms_mps"));
        println!(
            "{vehicle}: rms {rms:.3} of {zero:.3}, without bias {:.3}, inside {:.2}, width {:.2}",
            truth("rms_without_bias_mps"),
            truth("inside_share"),
            width_mps(&found)
        );
        assert!(truth("values") > 100.0, "{}", found["map"]["truth"]);
        assert!(rms < 0.12 && rms < 0.3 * zero, "{vehicle}: {}", found["map"]["truth"]);
        assert!(truth("rms_without_bias_mps") < 0.1, "{vehicle}: {}", found["map"]["truth"]);
        assert!(truth("inside_share") > 0.9, "{vehicle}: {}", found["map"]["truth"]);

        // Without what is known of the vehicle the intervals say so, and still hold the truth.
        let blind = scan(&bench, &["--no-wind"]);
        let wider = width_mps(&blind) / width_mps(&found);
        // The quad hardly leans at these speeds: little is lost for it.
        assert!(wider > if vehicle == "pixel" { 1.5 } else { 0.9 }, "{vehicle}: {wider}");
        assert!(number(&blind, "/map/truth/inside_share") > 0.9, "{}", blind["map"]["truth"]);
    }
}

#[test]
fn the_table_has_the_places_and_the_report_the_track() {
    let bench = flown("pixel", 4);
    let ended = bench.expect(0, &["analyze", "campaign"]);
    assert!(ended.out.contains("scan: the drones moved"), "{ended}");
    let page = fs::read_to_string(bench.path("campaign/report/index.html")).unwrap();
    assert!(page.contains("Vertical air speed along the track, scan"));
    assert!(!page.contains("Scan: Scan:"), "a flight's name before its own caution");
    let figure = fs::read_to_string(bench.path("campaign/report/figures/track-scan.svg")).unwrap();
    assert!(figure.contains("way flown (m)") && figure.contains("true air"));

    let found = scan(&bench, &[]);
    assert!(found["statistics"].is_null(), "values mix place and time");
    let drones = found["map"]["drones"].as_array().unwrap();
    assert!(drones.iter().all(|drone| drone["position_m"].is_null()));

    let table = fs::read_to_string(bench.path("campaign/fields/updraft.csv")).unwrap();
    let mut rows = csv::Reader::from_reader(table.as_bytes());
    let plan = fs::read_to_string(bench.path("campaign/scan/plan.json")).unwrap();
    let plan: Value = serde_json::from_str(&plan).unwrap();
    let segments = plan["groups"][0]["segments"].as_array().unwrap();
    let (mut farthest, mut values) = (0.0_f64, 0);
    for row in rows.records() {
        let row = row.unwrap();
        let cell = |index: usize| row.get(index).unwrap().parse::<f64>();
        // Only seconds with a value: legs and the hover before them.
        let (Ok(time_s), Ok(_)) = (cell(1), cell(7)) else { continue };
        let slot = row.get(2).unwrap().parse::<usize>().unwrap();
        let segment =
            segments.iter().find(|segment| 1000.0 * time_s < number(segment, "/end_ms")).unwrap();
        let since_s = time_s - number(segment, "/start_ms") / 1000.0;
        for (axis, column) in [(0, 4), (1, 5), (2, 6)] {
            let home = number(&plan, &format!("/slots/{}/home_m/{axis}", slot - 1));
            let planned = home
                + number(segment, &format!("/from_m/{axis}"))
                + number(segment, &format!("/velocity_mps/{axis}")) * since_s;
            let off = (cell(column).unwrap() - planned).abs();
            // The drone follows its plan half a second late.
            assert!(off < 2.5, "{time_s} s, slot {slot}, axis {axis}: {off} m off");
        }
        farthest = farthest.max(cell(4).unwrap());
        values += 1;
    }
    assert!(values > 100 && farthest > 120.0, "{values} values, to {farthest} m");
}

#[test]
fn a_hover_in_the_folder_of_a_scan_is_refused() {
    let bench = flown("pixel", 5);
    let hover = ["plan", "hover", "--grid", "1x2", "--height", "60", "--duration", "130"];
    bench.expect(0, &[&hover[..], &["--set", "vehicle=pixel", "-o", "hover"]].concat());
    bench.expect(0, &["simulate", "hover", "--quiet"]);
    fs::copy(bench.path("hover/simulated/01.BIN"), bench.path("campaign/scan/simulated/01.BIN"))
        .unwrap();
    let ended = bench.expect(3, &["analyze", "campaign", "--no-report"]);
    let out = ended.out.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(out.contains("2 of 2 horizontal legs were not flown"), "{ended}");
    assert!(ended.out.contains("scan, measurement: 1 of 2 drones"), "{ended}");
}
