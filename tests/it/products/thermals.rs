//! Thermals over time as a table.

use updraft::analysis::result::{Analysis, Thermal};
use updraft::products::{iso, thermals};

use super::support::{START_UNIX_MS, placed};

/// A thermal that passes the middle of the fleet 200 s into the flight, and drifts forwards.
fn thermal(peak_mps: f64) -> Thermal {
    let of = |value: f64, se: f64| serde_json::json!({"value": value, "se": se});
    serde_json::from_value(serde_json::json!({
        "time_s": 200.0,
        "core_m": [of(3.0, 2.0), of(-1.0, 1.5)],
        "drift_mps": [of(1.5, 0.2), of(0.0, 0.1)],
        "radius_m": of(40.0, 6.0),
        "peak_mps": of(peak_mps, 0.2),
        "flux_m3ps": of(4000.0, 900.0),
        "sink": of(0.4, 0.3),
        "log_odds": 12.5,
    }))
    .unwrap()
}

fn table(analysis: &Analysis) -> (Vec<String>, Vec<Vec<String>>) {
    let mut csv = Vec::new();
    thermals::write_csv(analysis, &mut csv).unwrap();
    let mut reader = csv::Reader::from_reader(&csv[..]);
    let heads = reader.headers().unwrap().iter().map(str::to_owned).collect();
    let rows = reader.records().map(|row| row.unwrap().iter().map(str::to_owned).collect());
    (heads, rows.collect())
}

#[test]
fn a_thermal_has_a_row_for_each_ten_seconds_of_the_map() {
    let mut analysis = placed();
    assert!(!thermals::any(&analysis));
    let map = analysis.flights[1].map.as_mut().unwrap();
    map.thermals = vec![thermal(2.0), thermal(1.0)];
    let (from_s, to_s) = (map.time_s[0], *map.time_s.last().unwrap());
    assert!(thermals::any(&analysis) && (from_s..to_s).contains(&200.0), "{from_s} {to_s}");
    let (heads, rows) = table(&analysis);
    assert_eq!(heads, thermals::COLUMNS);
    let at = |row: &[String], name: &str| -> String {
        row[heads.iter().position(|head| head == name).unwrap()].clone()
    };
    let number = |row: &[String], name: &str| at(row, name).parse::<f64>().unwrap();
    let each = ((to_s - from_s) / 10.0).floor() as usize + 1;
    assert_eq!(rows.len(), 2 * each);
    assert!(
        rows[..each].iter().all(|row| at(row, "thermal") == "1" && number(row, "peak_mps") == 2.0)
    );
    let first = &rows[0];
    let after_s = from_s - 200.0;
    assert!((number(first, "x_m") - (3.0 + 1.5 * after_s)).abs() < 0.01, "{first:?}");
    let se = 2.0_f64.hypot(0.2 * after_s);
    assert!((number(first, "x_se_m") - se).abs() < 0.01, "{first:?}");
    assert_eq!(at(first, "utc"), iso(START_UNIX_MS + (1000.0 * from_s) as i64));
    assert_eq!((number(first, "radius_se_m"), number(first, "flux_m3ps")), (6.0, 4000.0));
    let over = |row: &&Vec<String>| at(row, "is_over_fleet") == "1";
    let some = rows[..each].iter().filter(over).count();
    assert!(some > 0 && some < each, "{some} of {each}");
    let middle = rows[..each].iter().find(over).unwrap();
    assert!((number(middle, "time_s") - 200.0).abs() < 60.0, "{middle:?}");
    // A degree of latitude is 111 km: the core moves 1.5 m/s, in degrees as well.
    let moved_m =
        |axis: &str, scale: f64| (number(&rows[each - 1], axis) - number(first, axis)) * scale;
    let lat = number(first, "latitude_deg").to_radians();
    let way_m =
        moved_m("latitude_deg", 111_195.0).hypot(moved_m("longitude_deg", 111_320.0 * lat.cos()));
    let took_s = number(&rows[each - 1], "time_s") - from_s;
    assert!((way_m / took_s - 1.5).abs() < 0.01, "{way_m} {took_s}");
    analysis.flights[1].site = None;
    for drone in &mut analysis.flights[1].drones {
        drone.clock.start = None;
    }
    let (_, rows) = table(&analysis);
    assert!(at(&rows[0], "utc").is_empty() && at(&rows[0], "latitude_deg").is_empty());
    assert!(!at(&rows[0], "x_m").is_empty());
}
