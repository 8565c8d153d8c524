//! The exported fields: every value of the map, in CSV and in Parquet.

use crate::report::synthetic::{campaign, posterior};
use updraft::analysis::result::Analysis;
use updraft::report::fields::{COLUMNS, POSTERIOR_COLUMNS, rows, write_csv};
use updraft::report::fields_grid;

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
    assert_eq!(lines.next(), Some(COLUMNS.join(",").as_str()));
    assert_eq!(lines.clone().count(), map.drones.len() * map.time_s.len());
    assert!(lines.clone().all(|line| line.split(',').count() == COLUMNS.len()));
    let first: Vec<&str> = lines.next().unwrap().split(',').collect();
    let drone = &map.drones[0];
    let expected = format!("{:.4}", drone.updraft_mps[0].unwrap());
    assert_eq!(
        first[..8],
        ["hover", "95", "1", "Drone 1", "-21.00", "-21.00", "100.00", &expected]
    );
    assert_eq!(first[12], format!("{:.4}", drone.truth_mps.as_ref().unwrap()[0]));
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
fn a_posterior_adds_columns_at_the_end_and_rows_for_lost_drones() {
    let plain = csv(&campaign());
    let analysis = posterior(campaign());
    let text = csv(&analysis);
    let map = analysis.flights[1].map.as_ref().unwrap();
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    assert_eq!(header, [&COLUMNS[..], &POSTERIOR_COLUMNS[..]].concat());
    for (before, after) in plain.lines().zip(text.lines()) {
        assert!(after.starts_with(before), "{before} has become {after}");
    }
    let more: Vec<&str> = text.lines().skip(plain.lines().count()).collect();
    assert_eq!(more.len(), map.time_s.len(), "one row for each second of the lost drone");
    assert_eq!(more[0], "hover,95,48,slot 48,21.00,14.00,100.00,,,,,filled,,0.2500,0.1000");
    let first = text.lines().nth(1).unwrap();
    assert!(first.ends_with(",-0.1235,0.0500"), "{first}");
}

#[test]
fn the_air_between_drones_has_a_row_for_each_known_cell() {
    let mut bytes = Vec::new();
    fields_grid::write_csv(&posterior(campaign()), &mut bytes).unwrap();
    assert_eq!(
        String::from_utf8(bytes).unwrap(),
        "flight,time_s,x_m,y_m,z_m,w_mps,sd_mps\n\
         hover,100,-3.50,0.00,100.00,0.1000,0.0500\n\
         hover,100,3.50,0.00,100.00,-0.2000,0.0600\n\
         hover,100,3.50,7.00,100.00,0.4000,0.0800\n"
    );
    assert!(!fields_grid::any(&campaign()), "no posterior, no table");
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_has_the_posterior_as_the_csv_has_it() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};

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
        names_and_rows(updraft::report::fields_parquet::parquet(&analysis).unwrap());
    assert_eq!(names[13..], POSTERIOR_COLUMNS);
    assert_eq!(read.len(), rows(&analysis).count());
    assert!(read.last().unwrap().ends_with("\"filled\" null 0.25 0.1 "), "{read:?}");
    let (names, read) =
        names_and_rows(updraft::report::fields_parquet::grid_parquet(&analysis).unwrap());
    assert_eq!(names, fields_grid::COLUMNS);
    // As the crate prints zero and what is below it.
    assert_eq!(read[1], "\"hover\" 100.0 3.5 0E0 100.0 -2E-1 0.06 ");
    assert_eq!(read.len(), 3);
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_what_the_csv_holds() {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::Field;

    let analysis = campaign();
    let bytes = updraft::report::fields_parquet::parquet(&analysis).unwrap();
    let csv_bytes = csv(&analysis).len();
    assert!(2 * bytes.len() < csv_bytes, "{} bytes, the CSV has {csv_bytes}", bytes.len());
    let mut file = tempfile::tempfile().unwrap();
    std::io::Write::write_all(&mut file, &bytes).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let columns = reader.metadata().file_metadata().schema().get_fields().to_vec();
    let names: Vec<&str> = columns.iter().map(|field| field.name()).collect();
    assert_eq!(names, COLUMNS);
    let mut count = 0;
    for (read, row) in reader.get_row_iter(None).unwrap().zip(rows(&analysis)) {
        let read: Vec<Field> =
            read.unwrap().get_column_iter().map(|(_, field)| field.clone()).collect();
        let number = |field: &Field| match field {
            Field::Double(value) => Some(*value),
            Field::Null => None,
            other => panic!("{other} is no number"),
        };
        assert_eq!(read[0], Field::Str(row.flight));
        assert_eq!(number(&read[1]), Some(row.time_s));
        assert_eq!(read[3], Field::Str(row.drone));
        assert_eq!(number(&read[7]), row.w_mps, "all digits");
        assert_eq!(number(&read[12]), row.truth_mps);
        count += 1;
    }
    assert_eq!(count, rows(&analysis).count());
}
