//! The exported fields: every value of the map, in CSV and in Parquet.

use crate::products::support::{OFF, OWN, START_UNIX_MS, placed};
use crate::report::synthetic::{campaign, posterior};
use updraft::analysis::result::Analysis;
use updraft::products::fields::{COLUMNS, MORE_COLUMNS, POSTERIOR_COLUMNS, rows, write_csv};
use updraft::products::fields_grid;

fn csv(analysis: &Analysis) -> String {
    let mut bytes = Vec::new();
    write_csv(analysis, &mut bytes).expect("memory takes all");
    String::from_utf8(bytes).expect("UTF-8")
}

#[test]
fn every_drone_and_second_is_a_row() {
    let analysis = campaign();
    let map = analysis.flights[1].map.as_ref().unwrap();
    let text = csv(&analysis);
    let mut lines = text.lines();
    let columns = [&COLUMNS[..], &MORE_COLUMNS[..]].concat();
    assert_eq!(lines.next(), Some(columns.join(",").as_str()));
    assert_eq!(lines.clone().count(), map.drones.len() * map.time_s.len());
    assert!(lines.clone().all(|line| line.split(',').count() == columns.len()));
    let first: Vec<&str> = lines.next().unwrap().split(',').collect();
    let drone = &map.drones[0];
    let expected = format!("{:.4}", drone.updraft_mps[0].unwrap());
    assert_eq!(
        first[..8],
        ["hover", "95", "1", "Drone 1", "-21.00", "-21.00", "100.00", &expected]
    );
    assert_eq!(first[12], format!("{:.4}", drone.truth_at(0).unwrap()));
    let silent = map.drones.iter().find(|drone| drone.slot == Some(20)).unwrap();
    assert!(silent.updraft_mps[400].is_none());
    let gap = text.lines().find(|line| line.starts_with("hover,495,20,")).unwrap();
    assert_eq!(gap.split(',').nth(7), Some(""), "no value is empty: {gap}");
}

#[test]
fn values_that_are_no_numbers_are_empty() {
    let mut analysis = campaign();
    let map = analysis.flights[1].map.as_mut().unwrap();
    map.drones[0].updraft_mps[0] = Some(f64::NAN);
    map.drones[0].position_m = Some([f64::INFINITY, 0.0]);
    let first = rows(&analysis).next().unwrap();
    assert_eq!((first.w_mps, first.x_m), (None, None));
    assert!(!csv(&analysis).contains("NaN") && !csv(&analysis).contains("inf"));
}

#[test]
fn a_posterior_adds_columns_and_rows_for_lost_drones() {
    let plain = csv(&campaign());
    let analysis = posterior(campaign());
    let text = csv(&analysis);
    let map = analysis.flights[1].map.as_ref().unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert_eq!(header, [&COLUMNS[..], &POSTERIOR_COLUMNS[..], &MORE_COLUMNS[..]].concat());
    for (before, after) in plain.lines().zip(text.lines()) {
        let fields: Vec<&str> = before.split(',').collect();
        let (measured, more) = fields.split_at(COLUMNS.len());
        assert!(after.starts_with(&measured.join(",")), "{before} has become {after}");
        assert!(after.ends_with(&more.join(",")), "{before} has become {after}");
    }
    let more: Vec<&str> = text.lines().skip(plain.lines().count()).collect();
    assert_eq!(more.len(), map.time_s.len(), "one row for each second of the lost drone");
    assert_eq!(
        more[0],
        "hover,95,48,slot 48,21.00,14.00,100.00,,,,,filled,,0.2500,0.1000,,47.4735265,19.0620785,100.00,\
         290.00,plan,,,,,"
    );
    let first = text.lines().nth(1).unwrap();
    assert!(first.contains(",-0.1235,0.0500,"), "{first}");
}

#[test]
fn the_air_between_drones_has_a_row_for_each_known_cell() {
    let mut bytes = Vec::new();
    fields_grid::write_csv(&posterior(campaign()), &mut bytes).unwrap();
    assert_eq!(
        String::from_utf8(bytes).unwrap(),
        "flight,time_s,x_m,y_m,z_m,w_mps,sd_mps,utc,latitude_deg,longitude_deg,height_agl_m,altitude_amsl_m,\
         u_mps,u_se_mps,v_mps,v_se_mps\n\
         hover,100,-3.50,0.00,100.00,0.1000,0.0500,,47.4732727,19.0620768,100.00,290.00,,,,\n\
         hover,100,3.50,0.00,100.00,-0.2000,0.0600,,47.4733273,19.0621232,100.00,290.00,,,,\n\
         hover,100,3.50,7.00,100.00,0.4000,0.0800,,47.4733587,19.0620428,100.00,290.00,,,,\n"
    );
    assert!(!fields_grid::any(&campaign()), "no posterior, no table");
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_has_the_posterior_as_the_csv_has_it() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use updraft::products::{Origin, fields_parquet};

    let analysis = posterior(campaign());
    let names_and_rows = |bytes: Vec<u8>| {
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let schema = reader.metadata().file_metadata().schema();
        let names: Vec<String> =
            schema.get_fields().iter().map(|field| field.name().to_owned()).collect();
        let rows: Vec<String> = reader
            .get_row_iter(None)
            .unwrap()
            .map(|row| {
                let row = row.unwrap();
                let fields: Vec<String> =
                    row.get_column_iter().map(|(_, field)| field.to_string()).collect();
                fields.join(" ") + " "
            })
            .collect();
        (names, rows)
    };
    let (names, read) =
        names_and_rows(fields_parquet::parquet(&analysis, &Origin::default()).unwrap());
    assert_eq!(names[13..], [&POSTERIOR_COLUMNS[..], &MORE_COLUMNS[..]].concat());
    assert_eq!(read.len(), rows(&analysis).count());
    assert!(read.last().unwrap().contains("\"filled\" null 0.25 0.1 null 47.47"), "{read:?}");
    let (names, read) =
        names_and_rows(fields_parquet::grid_parquet(&analysis, &Origin::default()).unwrap());
    assert_eq!(names, fields_grid::COLUMNS);
    // As the crate prints zero and what is below it.
    assert!(read[1].starts_with("\"hover\" 100.0 3.5 0E0 100.0 -2E-1 0.06 null 47.47"), "{read:?}");
    assert_eq!(read.len(), 3);
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_what_the_csv_holds() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::Field;
    use updraft::products::{Origin, fields_parquet};

    let analysis = placed();
    let bytes = fields_parquet::parquet(&analysis, &Origin::default()).unwrap();
    let csv_bytes = csv(&analysis).len();
    assert!(2 * bytes.len() < csv_bytes, "{} bytes, the CSV has {csv_bytes}", bytes.len());
    let mut file = tempfile::tempfile().unwrap();
    std::io::Write::write_all(&mut file, &bytes).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let columns = reader.metadata().file_metadata().schema().get_fields().to_vec();
    let names: Vec<&str> = columns.iter().map(|field| field.name()).collect();
    assert_eq!(names, [&COLUMNS[..], &POSTERIOR_COLUMNS[..], &MORE_COLUMNS[..]].concat());
    let mut count = 0;
    for (read, row) in reader.get_row_iter(None).unwrap().zip(rows(&analysis)) {
        let read: Vec<Field> =
            read.unwrap().get_column_iter().map(|(_, field)| field.clone()).collect();
        let number = |field: &Field| match field {
            Field::Double(value) => Some(*value),
            Field::Null => None,
            other => panic!("{other} is no number"),
        };
        assert_eq!(read[0], Field::Str(row.flight.clone()));
        assert_eq!(number(&read[1]), Some(row.time_s));
        assert_eq!(read[3], Field::Str(row.drone.clone()));
        assert_eq!(number(&read[7]), row.w_mps, "all digits");
        assert_eq!(number(&read[12]), row.truth_mps);
        assert_eq!(read[15], row.utc_ms.map_or(Field::Null, Field::TimestampMillis));
        assert_eq!(number(&read[16]), row.fix.lat_lon_deg.map(|(deg, _)| deg[0]));
        assert_eq!(number(&read[19]), row.fix.amsl_m);
        assert_eq!(read[20], Field::Str(row.place_by().to_owned()));
        assert_eq!(number(&read[22]), row.wind_mps.map(|wind| wind[0]));
        assert_eq!(number(&read[25]), row.wind_se_mps.map(|se| se[1]));
        count += 1;
    }
    assert_eq!(count, rows(&analysis).count());
}

/// The first row of a drone.
fn row_of(slot: u16) -> updraft::products::fields::FieldRow {
    let analysis = placed();
    rows(&analysis).find(|row| row.slot == Some(slot)).unwrap()
}

#[test]
fn a_row_says_where_and_when_it_was_by_its_own_log() {
    let row = row_of(1);
    assert_eq!(row.time_s, 95.0);
    assert_eq!(row.utc_ms, Some(START_UNIX_MS + 95_000), "a show begins on a whole second");
    assert_eq!((row.fix.lat_lon_deg.unwrap().0, row.place_by()), (OWN.0, "log"));
    // The plan knows the ground better than a receiver.
    assert_eq!((row.fix.height_m, row.fix.amsl_m), (Some(99.5), Some(289.5)));
    assert!((row.w_se_mps.unwrap() - 0.2).abs() < 1e-9, "{row:?}");
    assert_eq!((row.wind_mps, row.wind_se_mps), (Some([3.25, -1.5]), Some([1.0, 0.5])));
    let line = csv(&placed()).lines().nth(1).unwrap().to_owned();
    let wanted = ",2026-06-01T12:01:35.000Z,47.4730512,19.0621983,99.50,289.50,log,0.2000,3.250,1.000,-1.500,0.500";
    assert!(line.ends_with(wanted), "{line}");
}

#[test]
fn a_drone_whose_log_has_no_place_is_where_its_plan_had_it() {
    // 35.36 m at 164.9 degrees from the origin, on the WGS 84 ellipsoid by GeographicLib.
    let mut analysis = placed();
    analysis.flights[1].map.as_mut().unwrap().drones[0].place = None;
    let row = rows(&analysis).next().unwrap();
    let ([lat_deg, lon_deg], by) = row.fix.lat_lon_deg.unwrap();
    assert_eq!(by.name(), "plan");
    assert!((lat_deg - 47.473_041_981).abs() < 2e-9, "{lat_deg}");
    assert!((lon_deg - 19.062_201_968).abs() < 2e-9, "{lon_deg}");
    assert_eq!((row.fix.height_m, row.fix.amsl_m), (Some(100.0), Some(290.0)));
}

#[test]
fn a_log_with_another_clock_has_its_own_times() {
    let row = row_of(OFF.0);
    let own_ms = row.utc_ms.unwrap() - START_UNIX_MS - 95_000;
    assert_eq!(own_ms, OFF.1 - 130, "as its own log says");
}

#[test]
fn what_is_not_known_stays_empty() {
    let mut analysis = placed();
    let flight = &mut analysis.flights[1];
    flight.drones.iter_mut().for_each(|drone| drone.clock.start = None);
    // A show of another program without a place stands at 0, 0.
    let site = flight.site.as_mut().unwrap();
    (site.lat_deg, site.lon_deg, site.ground_amsl_m) = (0.0, 0.0, None);
    flight.map.as_mut().unwrap().drones[0].place = None;
    let row = rows(&analysis).next().unwrap();
    assert_eq!((row.utc_ms, row.fix.lat_lon_deg, row.fix.amsl_m), (None, None, None));
    assert_eq!(row.fix.height_m, Some(100.0), "the hover's height is known");
    assert!(csv(&analysis).lines().nth(1).unwrap().contains(",,,,100.00,,,0.2000,3.250"));
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_says_its_units_and_what_it_is() {
    use crate::products::support::origin;
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use updraft::products::fields_parquet;

    let analysis = placed();
    for bytes in [
        fields_parquet::parquet(&analysis, &origin()).unwrap(),
        fields_parquet::grid_parquet(&analysis, &origin()).unwrap(),
    ] {
        let mut file = tempfile::tempfile().unwrap();
        std::io::Write::write_all(&mut file, &bytes).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let metadata = reader.metadata().file_metadata();
        let said = metadata.key_value_metadata().unwrap();
        let of = |key: &str| {
            let found = said.iter().find(|one| one.key == key);
            found.and_then(|one| one.value.clone()).unwrap_or_else(|| panic!("no {key}"))
        };
        let units: serde_json::Value = serde_json::from_str(&of("units")).unwrap();
        let attributes: serde_json::Value = serde_json::from_str(&of("PANDAS_ATTRS")).unwrap();
        assert_eq!(attributes["units"], units);
        assert_eq!(attributes["analysis_sha256"], "ef".repeat(32));
        assert!(of("title").ends_with("vertical air speed measured by drones"));
        // Each number has a unit, and the unit is that of its name.
        for field in metadata.schema().get_fields() {
            let (name, unit) = (field.name(), &units[field.name()]);
            let wanted = match name.rsplit_once('_').map_or("", |(_, end)| end) {
                "mps" => serde_json::json!("m s-1"),
                "m" => serde_json::json!("m"),
                "s" => serde_json::json!("s"),
                "deg" if name.starts_with("lat") => serde_json::json!("degrees_north"),
                "deg" => serde_json::json!("degrees_east"),
                _ if name == "utc" => serde_json::json!("UTC"),
                _ => serde_json::Value::Null,
            };
            assert_eq!(*unit, wanted, "{name}");
        }
    }
}
