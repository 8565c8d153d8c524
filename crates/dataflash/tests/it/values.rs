//! Values: against another parser's reading of real logs, and through the writer and back.

use std::fs;
use std::path::Path;

use dataflash::{Log, LogError, LogWriter, MessageDef, Select, Value, catalog};
use proptest::prelude::*;

const NAN: u64 = 0x7ff8 << 48;

/// Compares every column of a fixture with the listing that pymavlink made of it.
fn agrees_with_pymavlink(name: &str) {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    let log = Log::open(&data.join(format!("{name}.BIN"))).unwrap();
    let listing = fs::read_to_string(data.join(format!("{name}.pymavlink.txt"))).unwrap();
    let mut columns = 0;
    for line in listing.lines().filter(|line| !line.starts_with('#')) {
        let parts: Vec<&str> = line.split(' ').collect();
        let &[message, field, rows, first, last, checksum] = parts.as_slice() else {
            panic!("{line}");
        };
        let (tables, stats) = log.select(&[Select { message, fields: &[field] }]);
        assert_eq!((stats.bad_bytes, stats.unknown, stats.truncated_bytes), (0, 0, 0));
        assert_eq!(tables[0].rows, rows.parse::<usize>().unwrap(), "{line}");
        let mut crc = crc32fast::Hasher::new();
        if let Some(texts) = tables[0].text(field) {
            for text in texts {
                crc.update(format!("{text}\n").as_bytes());
            }
        } else {
            let numbers = tables[0].number(field).unwrap_or_else(|| panic!("no column: {line}"));
            assert_eq!(numbers.len(), tables[0].rows);
            let same = |number: f64, text: &str| {
                let other: f64 = text.parse().unwrap();
                number == other || (number.is_nan() && other.is_nan())
            };
            assert!(same(numbers[0], first) && same(numbers[numbers.len() - 1], last), "{line}");
            for number in numbers {
                let bits = if number.is_nan() { NAN } else { number.to_bits() };
                crc.update(&bits.to_le_bytes());
            }
        }
        assert_eq!(format!("{:08x}", crc.finalize()), checksum, "{line}");
        columns += 1;
    }
    assert_eq!(columns, 144);
}

#[test]
fn ladder_has_the_values_that_pymavlink_reads() {
    agrees_with_pymavlink("ladder-still.trimmed");
}

#[test]
fn square_law_ladder_has_the_values_that_pymavlink_reads() {
    agrees_with_pymavlink("square-law-ladder.trimmed");
}

#[test]
fn units_come_from_the_log() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ladder-still.trimmed.BIN");
    let log = Log::open(&path).unwrap();
    let wanted = [
        Select { message: "BAT", fields: &["Curr", "CurrTot", "RemPct", "Nothing"] },
        Select { message: "NKF1", fields: &["VD"] },
    ];
    let (tables, _) = log.select(&wanted);
    let battery = &tables[0];
    assert_eq!((battery.unit("Curr"), battery.multiplier("Curr")), (Some("A"), Some(1.0)));
    assert_eq!((battery.unit("CurrTot"), battery.multiplier("CurrTot")), (Some("Ah"), Some(1e-3)));
    assert_eq!((battery.unit("RemPct"), battery.multiplier("RemPct")), (Some("%"), Some(1.0)));
    assert_eq!((battery.unit("Nothing"), battery.number("Nothing")), (None, None));
    // The log defines no NKF1.
    assert_eq!((tables[1].rows, tables[1].number("VD")), (0, None));
}

#[test]
fn inventory_tells_what_the_log_is() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ladder-still.trimmed.BIN");
    let inventory = Log::open(&path).unwrap().inventory();
    assert_eq!(inventory.size_bytes, 882_773);
    assert_eq!(inventory.firmware.as_deref(), Some("ArduCopter V4.4.4 (e483eb80)"));
    assert_eq!(inventory.vehicle.as_deref(), Some("ArduCopter"));
    assert_eq!((inventory.boots, inventory.defined), (1, 20));
    assert_eq!((inventory.start_us, inventory.end_us), (Some(79_086_686), Some(559_886_789)));
    let attitude = inventory.messages.iter().find(|message| message.name == "ATT").unwrap();
    assert_eq!((attitude.count, attitude.bytes), (4809, 4809 * 28));
    assert!((attitude.rate_hz().unwrap() - 10.0).abs() < 1e-3);
    assert_eq!(attitude.fields[1].label, "DesRoll");
    assert_eq!(attitude.fields[1].unit.as_deref(), Some("deg"));
    let bytes: u64 = inventory.messages.iter().map(|message| message.bytes).sum();
    assert_eq!(bytes, inventory.size_bytes);
}

#[test]
fn catalog_is_what_the_firmware_defines() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/ladder-still.trimmed.BIN");
    let log = Log::open(&path).unwrap();
    let fmt = ["Type", "Name", "Format", "Columns"];
    let wanted = [
        Select { message: "FMT", fields: &fmt },
        Select { message: "FMTU", fields: &["FmtType", "UnitIds", "MultIds"] },
        Select { message: "UNIT", fields: &["Id", "Label"] },
        Select { message: "MULT", fields: &["Id", "Mult"] },
    ];
    let (firmware, _) = log.select(&wanted);
    let own = LogWriter::new(Vec::new(), catalog::ALL).unwrap().finish().unwrap();
    let (own, _) = Log::from_bytes(own).select(&wanted);
    let rows = |tables: &[dataflash::Table]| -> Vec<Vec<String>> {
        let cell = |table: &dataflash::Table, field: &str, row: usize| match table.text(field) {
            Some(texts) => texts[row].clone(),
            None => table.number(field).unwrap()[row].to_string(),
        };
        let mut all = Vec::new();
        for (table, select) in tables.iter().zip(&wanted) {
            for row in 0..table.rows {
                let mut cells = vec![select.message.to_owned()];
                cells.extend(select.fields.iter().map(|field| cell(table, field, row)));
                all.push(cells);
            }
        }
        all
    };
    let own = rows(&own);
    for row in rows(&firmware) {
        assert!(own.contains(&row), "{row:?}");
    }
}

#[test]
fn what_is_no_log_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let cases: [(&str, &[u8], &str); 5] = [
        ("empty.BIN", b"", "it is empty"),
        ("show.skyc", b"PK\x03\x04....", "ZIP archive"),
        ("show.skyb", b"skyb\x02", ".skyb show"),
        ("text.log", b"FMT, 128, 89, FMT, BBnNZ, Type,Length,Name,Format,Columns\n", "text form"),
        ("noise.BIN", &[0xA3, 0x95, 0x80, 0x80, 0x59], "first 5 bytes define no message"),
    ];
    for (name, bytes, reason) in cases {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        let error = Log::open(&path).unwrap_err();
        assert!(matches!(error, LogError::NotALog { .. }));
        let text = error.to_string();
        assert!(text.contains(name) && text.contains(reason), "{text}");
    }
    for path in [folder.path().to_owned(), folder.path().join("absent.BIN")] {
        assert!(matches!(Log::open(&path).unwrap_err(), LogError::Open { .. }));
    }
}

/// A stored value that a letter can hold, as the writer takes it and the reader gives it back.
#[derive(Clone, Debug)]
enum Cell {
    Int(i64),
    Float(f64),
    Text(String),
}

fn cell(letter: u8) -> BoxedStrategy<Cell> {
    fn int(range: std::ops::RangeInclusive<i64>) -> BoxedStrategy<Cell> {
        range.prop_map(Cell::Int).boxed()
    }
    fn scaled(range: std::ops::RangeInclusive<i64>, divisor: f64) -> BoxedStrategy<Cell> {
        range.prop_map(move |raw| Cell::Float(raw as f64 / divisor)).boxed()
    }
    fn text(most: usize) -> BoxedStrategy<Cell> {
        let text = proptest::collection::vec(proptest::char::range('\u{1}', '\u{7f}'), 0..=most);
        text.prop_map(|chars| Cell::Text(chars.into_iter().collect())).boxed()
    }
    let (i16s, u16s) = (i16::MIN as i64..=i16::MAX as i64, 0..=u16::MAX as i64);
    let (i32s, u32s) = (i32::MIN as i64..=i32::MAX as i64, 0..=u32::MAX as i64);
    match letter {
        b'b' => int(-128..=127),
        b'B' | b'M' => int(0..=255),
        b'h' => int(i16s),
        b'H' => int(u16s),
        b'i' => int(i32s),
        b'I' => int(u32s),
        b'q' => int(-(1 << 53)..=1 << 53),
        b'Q' => int(0..=1 << 53),
        b'c' => scaled(i16s, 100.0),
        b'C' => scaled(u16s, 100.0),
        b'e' => scaled(i32s, 100.0),
        b'E' => scaled(u32s, 100.0),
        b'L' => scaled(i32s, 1e7),
        b'f' => any::<f32>().prop_map(|single| Cell::Float(f64::from(single))).boxed(),
        b'd' => any::<f64>().prop_map(Cell::Float).boxed(),
        b'n' => text(4),
        b'N' => text(16),
        _ => text(64),
    }
}

/// A format and rows of it.
fn log() -> impl Strategy<Value = (String, Vec<Vec<Cell>>)> {
    proptest::collection::vec(proptest::sample::select(b"bBMhHiIqQcCeELfdnNZ".to_vec()), 1..=12)
        .prop_filter("fits", |letters| {
            let size = |&letter: &u8| dataflash::definition::letter_size(letter).unwrap();
            letters.iter().map(size).sum::<usize>() <= 252
        })
        .prop_flat_map(|letters| {
            let row: Vec<_> = letters.iter().map(|&letter| cell(letter)).collect();
            let format = String::from_utf8(letters).unwrap();
            (Just(format), proptest::collection::vec(row, 0..20))
        })
}

proptest! {
    #[test]
    fn any_log_survives_writing_and_reading((format, rows) in log()) {
        let labels: Vec<String> = (0..format.len()).map(|index| format!("F{index}")).collect();
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        let leak = |text: String| -> &'static str { Box::leak(text.into_boxed_str()) };
        let message: &'static MessageDef = Box::leak(Box::new(MessageDef {
            id: 200,
            name: "ANY",
            units: leak("-".repeat(format.len())),
            multipliers: leak("-".repeat(format.len())),
            fields: leak(labels.join(",")),
            format: leak(format.clone()),
        }));
        let mut writer = LogWriter::new(Vec::new(), &[message]).unwrap();
        for row in &rows {
            let values: Vec<Value<'_>> = row
                .iter()
                .map(|cell| match cell {
                    Cell::Int(int) => Value::Int(*int),
                    Cell::Float(float) => Value::Float(*float),
                    Cell::Text(text) => Value::Text(text),
                })
                .collect();
            writer.row(message, &values).unwrap();
        }
        let log = Log::from_bytes(writer.finish().unwrap());
        let (tables, stats) = log.select(&[Select { message: "ANY", fields: &labels }]);
        prop_assert_eq!(stats, dataflash::ScanStats::default());
        prop_assert_eq!(tables[0].rows, rows.len());
        for (column, label) in labels.iter().enumerate() {
            for (index, row) in rows.iter().enumerate() {
                match &row[column] {
                    Cell::Int(int) => {
                        prop_assert_eq!(tables[0].number(label).unwrap()[index], *int as f64);
                    }
                    Cell::Float(float) => {
                        prop_assert_eq!(tables[0].number(label).unwrap()[index], *float);
                    }
                    Cell::Text(text) => {
                        // What acts on a terminal is shown instead.
                        let plain = untrusted_io::plain::plain(text);
                        prop_assert_eq!(&tables[0].text(label).unwrap()[index], &*plain);
                    }
                }
            }
        }
    }
}
