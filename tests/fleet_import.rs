//! Logs from cards find their slots by what is inside.

#![expect(clippy::unwrap_used, reason = "a test that cannot write a folder fails")]

use std::fs;
use std::path::Path;

use nalgebra::Vector3;
use updraft::base::frame::Geodetic;
use updraft::base::time::GpsTime;
use updraft::fleet::logs::import::{ImportOptions, import};
use updraft::fleet::logs::verify::verify;
use updraft::log::{LogWriter, Value, catalog};
use updraft::mission::Plan;
use updraft::mission::resolve::resolve;

fn plan() -> Plan {
    resolve("hover", &[]).unwrap().flights.remove(0).plan
}

/// A log of a drone that stood `east_m` beside a slot.
fn log(plan: &Plan, system: Option<u8>, slot: u16, offset_m: f64, week: u16) -> Vec<u8> {
    let messages = [&catalog::PARM, &catalog::GPS];
    let mut log = LogWriter::new(Vec::new(), &messages).unwrap();
    let fields = |message: &updraft::log::MessageDef| message.format.len();
    if let Some(system) = system {
        let mut row = vec![Value::Int(0); fields(&catalog::PARM)];
        row[1] = Value::Text("SYSID_THISMAV");
        row[2] = Value::Float(system.into());
        log.row(&catalog::PARM, &row).unwrap();
    }
    let home = Vector3::from(plan.slot(slot).unwrap().home_m) + Vector3::new(offset_m, 0.0, 0.0);
    let Geodetic { lat_deg, lon_deg, .. } = plan.site.frame().to_geodetic(home);
    let labels: Vec<&str> = catalog::GPS.fields.split(',').collect();
    for second in 0..3 {
        let value = |label: &&str| match *label {
            "Status" => Value::Int(6),
            "GMS" => Value::Int(second * 1000),
            "GWk" => Value::Int(week.into()),
            "Lat" => Value::Float(lat_deg),
            "Lng" => Value::Float(lon_deg),
            _ => Value::Int(0),
        };
        let row: Vec<Value<'_>> = labels.iter().map(value).collect();
        log.row(&catalog::GPS, &row).unwrap();
    }
    log.finish().unwrap()
}

fn options(plan: &Plan) -> ImportOptions {
    let files = plan.slots.iter().map(|slot| (slot.slot, format!("{:02}.BIN", slot.slot)));
    ImportOptions {
        slots: std::collections::BTreeMap::new(),
        files: files.collect(),
        start: None,
        again: false,
        made_by: "test".to_owned(),
        unix_s: 0,
    }
}

fn put(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn logs_find_their_slots_by_id_and_by_home() {
    let plan = plan();
    let folder = tempfile::tempdir().unwrap();
    let cards = folder.path().join("cards");
    put(&cards, "a/LOGS/00000001.BIN", &log(&plan, Some(3), 3, 0.5, 2400));
    put(&cards, "a/LOGS/00000002.BIN", &log(&plan, Some(3), 3, 0.5, 2401));
    put(&cards, "b/00000007.bin", &log(&plan, None, 5, 0.5, 2400));
    // Ids that were never set: its home is far from slot 3's.
    let far = plan.slots.last().unwrap().slot;
    put(&cards, "c/00000001.BIN", &log(&plan, Some(3), far, 0.0, 2400));
    put(&cards, "d/00000001.BIN", &log(&plan, None, 1, 900.0, 2400));
    put(&cards, "e/00000001.BIN", b"no log");
    let logs = folder.path().join("logs");
    let report = import(std::slice::from_ref(&cards), &plan, &logs, &options(&plan)).unwrap();
    let taken: Vec<_> = report
        .taken
        .iter()
        .map(|entry| (entry.slot, entry.source.strip_prefix(cards.to_str().unwrap()).unwrap()))
        .collect();
    let expected = [(3, "/a/LOGS/00000002.BIN"), (5, "/b/00000007.bin"), (far, "/c/00000001.BIN")];
    assert_eq!(taken, expected);
    assert_eq!(report.missing.len(), plan.slots.len() - 3);
    let left: Vec<String> =
        report.left.iter().map(|(path, reason)| format!("{}: {reason}", path.display())).collect();
    let left = left.join("\n").replace(folder.path().to_str().unwrap(), "");
    insta::assert_snapshot!(left);
    assert!(verify(&logs).unwrap().iter().all(|one| one.faults.is_empty()));
    // A file that changes is found.
    put(&logs, "03.BIN", b"other");
    let checked = verify(&logs).unwrap();
    assert_eq!(checked[0].faults[0].to_string().split(';').next().unwrap(), {
        let right = checked[0].entry.size_bytes;
        format!("has 5 bytes, {right} when it came")
    });
    // Of several logs the one that covers the start.
    let logs = folder.path().join("again");
    let mut options = options(&plan);
    options.start = Some(GpsTime { week: 2400, tow_ms: 1500 });
    let report = import(&[cards.join("a")], &plan, &logs, &options).unwrap();
    assert!(report.taken[0].source.ends_with("00000001.BIN"));
}

#[test]
fn a_log_that_ends_too_early_is_not_known_to_be_whole() {
    let plan = plan();
    let armed = |states: &[i64]| {
        let mut log = LogWriter::new(Vec::new(), &[&catalog::PARM, &catalog::ARM]).unwrap();
        let mut row = vec![Value::Int(0); catalog::PARM.format.len()];
        row[1] = Value::Text("SYSID_THISMAV");
        row[2] = Value::Float(3.0);
        log.row(&catalog::PARM, &row).unwrap();
        for state in states {
            let mut row = vec![Value::Int(0); catalog::ARM.format.len()];
            row[1] = Value::Int(*state);
            log.row(&catalog::ARM, &row).unwrap();
        }
        log.finish().unwrap()
    };
    let whole = armed(&[1, 0]);
    let cases = [
        (whole.clone(), None),
        (armed(&[1]), Some("it ends while the drone is armed")),
        (whole[..whole.len() - 3].to_vec(), Some("it ends in the middle of a message")),
    ];
    for (bytes, why) in cases {
        let folder = tempfile::tempdir().unwrap();
        put(folder.path(), "card/00000012.BIN", &bytes);
        let logs = folder.path().join("logs");
        let report = import(&[folder.path().join("card")], &plan, &logs, &options(&plan)).unwrap();
        let entry = &report.taken[0];
        assert_eq!((entry.incomplete.as_deref(), entry.boot), (why, Some(12)));
        let faults = verify(&logs).unwrap().remove(0).faults;
        assert_eq!(!faults.is_empty(), why.is_some(), "{faults:?}");
    }
}
