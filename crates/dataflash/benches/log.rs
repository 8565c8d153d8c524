//! Reading and writing logs: `cargo bench --bench log`.
//!
//! A synthetic flight of about 20 MB stands for a drone's log; with `UPDRAFT_DATA` naming a folder
//! of `.BIN` files these are read too.
//!
//! Against another reader, the crate `dflog` 0.2 (no dependency of this one: its declared Rust is
//! newer), in one program outside of this repository, built with `cargo build --release
//! --ignore-rust-version`, that depends on `dflog` and on `updraft` by path. For a file, in turns, 40
//! times each, and the least of each one's `CLOCK_PROCESS_CPUTIME_ID`:
//!
//! * ours: `Log::open(path)?.select(&WANTED)`, as in `open_and_select_38_columns` here;
//! * theirs: `dflog::Log::open(path)?`, then `columns::get_columns(&log, message, fields)` for each
//!   message of `WANTED` that the log defines, with those of its fields that it has.
//!
//! Both must give as many values with the same sum. On two cores of an AMD EPYC (virtual machine), a
//! ladder logged by ArduCopter 4.4.4 (19.6 MB) and a simulated hover with all messages (28.8 MB): 3.5
//! to 4.2 ms against 10.7 to 12.7 ms and 4.6 to 6.1 ms against 16 to 19.5 ms; 0.28 to 0.33 of the time.
//! With the messages that a flight is analysed from (13 types, 64 columns) 0.25 to 0.30. Most of the
//! rest is the system's: reading the file, and memory for the columns.

use std::path::PathBuf;

use dataflash::{Log, LogWriter, MessageDef, Select, Value, catalog};
use divan::Bencher;
use divan::counter::{BytesCount, ItemsCount};

/// What an analysis wants: 10 types, 38 columns.
const WANTED: [Select<'static>; 10] = [
    Select { message: "SHOW", fields: &["TimeUS", "ClockMS", "Stage", "HDist", "VDist"] },
    Select { message: "ATT", fields: &["TimeUS", "Roll", "Pitch", "Yaw"] },
    Select { message: "RCOU", fields: &["TimeUS", "C1", "C2", "C3", "C4"] },
    Select { message: "XKF1", fields: &["TimeUS", "C", "VN", "VE", "VD", "PD"] },
    Select { message: "PSCD", fields: &["TimeUS", "DVD", "VD", "PD"] },
    Select { message: "BAT", fields: &["TimeUS", "Volt", "Curr"] },
    Select { message: "CTUN", fields: &["TimeUS", "ThO", "Alt"] },
    Select { message: "GPS", fields: &["TimeUS", "GMS", "GWk"] },
    Select { message: "MODE", fields: &["TimeUS", "ModeNum"] },
    Select { message: "BARO", fields: &["TimeUS", "Press", "Temp"] },
];

/// The firmware's messages at their rates: (message, every so many ticks of 5 ms).
fn schedule() -> Vec<(&'static MessageDef, usize)> {
    let mut all = vec![
        (&catalog::IMU, 4),
        (&catalog::SHOW, 8),
        (&catalog::SIM2, 1),
        (&catalog::GPS, 40),
        (&catalog::GPA, 40),
    ];
    for message in [
        &catalog::ATT,
        &catalog::RATE,
        &catalog::POS,
        &catalog::CTUN,
        &catalog::BAT,
        &catalog::RCOU,
        &catalog::RCO2,
        &catalog::RCIN,
        &catalog::MOTB,
        &catalog::XKF1,
        &catalog::XKF2,
        &catalog::XKF3,
        &catalog::XKF4,
        &catalog::XKF5,
        &catalog::XKQ,
        &catalog::PSCN,
        &catalog::PSCE,
        &catalog::PSCD,
        &catalog::VIBE,
        &catalog::BARO,
        &catalog::MAG,
        &catalog::CTRL,
        &catalog::AHR2,
    ] {
        all.push((message, 20));
    }
    all
}

/// A flight of `seconds`; values differ from row to row.
fn flight(seconds: usize) -> Vec<u8> {
    let schedule = schedule();
    let messages: Vec<_> = schedule.iter().map(|(message, _)| *message).collect();
    let mut log = LogWriter::new(Vec::new(), &messages).expect("the catalog is valid");
    let mut values = Vec::new();
    for tick in 0..seconds * 200 {
        for (message, every) in &schedule {
            if tick % every == 0 {
                values.clear();
                values.extend(
                    (0..message.format.len())
                        .map(|field| Value::Float((tick * 7 + field * 13) as f64 % 311.0)),
                );
                values[0] = Value::Int(tick as i64 * 5000);
                log.row(message, &values).expect("values fit");
            }
        }
    }
    log.finish().expect("memory does not fail")
}

fn main() {
    divan::main();
}

#[divan::bench]
fn select_38_columns(bencher: Bencher<'_, '_>) {
    let bytes = flight(850);
    let size = bytes.len();
    let log = Log::from_bytes(bytes);
    bencher.counter(BytesCount::new(size)).bench(|| log.select(&WANTED));
}

#[divan::bench]
fn select_nothing(bencher: Bencher<'_, '_>) {
    let bytes = flight(850);
    let size = bytes.len();
    let log = Log::from_bytes(bytes);
    bencher.counter(BytesCount::new(size)).bench(|| log.select(&[]));
}

#[divan::bench]
fn inventory(bencher: Bencher<'_, '_>) {
    let bytes = flight(850);
    let size = bytes.len();
    let log = Log::from_bytes(bytes);
    bencher.counter(BytesCount::new(size)).bench(|| log.inventory());
}

#[divan::bench]
fn write_rows(bencher: Bencher<'_, '_>) {
    let mut log = LogWriter::new(std::io::sink(), &[&catalog::ATT]).expect("the catalog is valid");
    let mut values = [Value::Float(12.34); 10];
    values[0] = Value::Int(1_000_000);
    bencher.counter(ItemsCount::new(10_000usize)).bench_local(|| {
        for _ in 0..10_000 {
            log.row(&catalog::ATT, divan::black_box(&values)).expect("values fit");
        }
    });
}

/// Logs of the folder `UPDRAFT_DATA`.
fn real_logs() -> Vec<String> {
    let Some(folder) = std::env::var_os("UPDRAFT_DATA").map(PathBuf::from) else {
        return Vec::new();
    };
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "BIN"))
        .map(|path| path.display().to_string())
        .collect();
    names.sort();
    names
}

#[divan::bench(args = real_logs())]
fn open_and_select_38_columns(bencher: Bencher<'_, '_>, name: &str) {
    let size = std::fs::metadata(name).map_or(0, |metadata| metadata.len());
    let open = || Log::open(name.as_ref()).expect("a log");
    bencher.counter(BytesCount::new(size)).bench(|| open().select(&WANTED));
}
