//! Files in the repository that the program makes are what it makes today.
//!
//! `UPDATE=1 cargo test --test it house::generated` rewrites them.

#![expect(clippy::unwrap_used, reason = "a test that cannot read the repository fails")]

use std::fs;
use std::path::{Path, PathBuf};

use updraft::campaign::write::{FlightFiles, folders, write_index};
use updraft::cli::tools::Format;
use updraft::mission::resolve::resolve;

fn update() -> bool {
    std::env::var_os("UPDATE").is_some()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn json_schemas_are_current() {
    for (format, name) in [
        (Format::Plan, "plan"),
        (Format::Campaign, "campaign"),
        (Format::Flight, "flight"),
        (Format::Analysis, "analysis"),
        (Format::Compare, "compare"),
        (Format::Study, "study"),
        (Format::Cell, "cell"),
        (Format::Sensitivity, "sensitivity"),
        (Format::SensitivityItem, "sensitivity-item"),
        (Format::Vehicle, "vehicle"),
        (Format::Logs, "logs"),
        (Format::Start, "start"),
        (Format::Fleet, "fleet"),
        (Format::Changes, "changes"),
        (Format::Preflight, "preflight"),
        (Format::Fly, "fly"),
        (Format::Verdict, "verdict"),
        (Format::Blind, "blind"),
        (Format::BlindFlight, "blind-flight"),
        (Format::BlindTruth, "blind-truth"),
        (Format::BlindGame, "blind-game"),
        (Format::BlindRecord, "blind-record"),
        (Format::BlindVerify, "blind-verify"),
        (Format::Next, "next"),
        (Format::Hidden, "hidden"),
        (Format::Items, "items"),
        (Format::AnalysisRecord, "analysis-record"),
        (Format::Cluster, "cluster"),
        (Format::ClusterScript, "cluster-script"),
        (Format::ClusterSubmit, "cluster-submit"),
        (Format::ClusterStatus, "cluster-status"),
        (Format::ClusterCancel, "cluster-cancel"),
        (Format::Shard, "shard"),
        (Format::AnalyzeEach, "analyze-each"),
        (Format::Archive, "archive"),
        (Format::ArchiveIndex, "archive-index"),
    ] {
        let path = root().join(format!("docs/schema/{name}.schema.json"));
        let schema = format.schema().unwrap();
        if update() {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(&path, schema).unwrap();
        } else {
            let committed = fs::read_to_string(&path).unwrap_or_default();
            assert!(committed == schema, "{} is out of date: UPDATE=1", path.display());
        }
    }
}

fn files_below(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() { files_below(&path, found) } else { found.push(path) }
    }
}

fn plan_into(template: &str, folder: &Path) {
    let mission = resolve(template, &[]).unwrap();
    for (flight, folder) in mission.flights.iter().zip(folders(folder, &mission)) {
        let show = flight.plan.to_show();
        FlightFiles::of(flight, &show).unwrap().write(&folder).unwrap();
    }
    write_index(folder, &mission).unwrap();
}

#[test]
fn shipped_shows_are_regenerated_byte_for_byte() {
    for template in ["campaign", "calibration-counterphase"] {
        let shipped = root().join("shows").join(template);
        if update() {
            let _ = fs::remove_dir_all(&shipped);
            plan_into(template, &shipped);
            continue;
        }
        let fresh = tempfile::tempdir().unwrap();
        plan_into(template, fresh.path());
        let (mut here, mut there) = (Vec::new(), Vec::new());
        files_below(&shipped, &mut here);
        files_below(fresh.path(), &mut there);
        assert_eq!(here.len(), there.len(), "{template}: other files than shipped");
        for path in there {
            let name = path.strip_prefix(fresh.path()).unwrap();
            let committed = fs::read(shipped.join(name)).unwrap_or_default();
            let same = committed == fs::read(&path).unwrap();
            assert!(same, "shows/{template}/{} is out of date: UPDATE=1", name.display());
        }
    }
}
