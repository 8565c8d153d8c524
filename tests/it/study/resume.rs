//! A study can be stopped, killed, changed and continued.

#![expect(clippy::unwrap_used, reason = "a study that cannot be flown fails its test")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};

use crate::study::support::{SMALL, flown, result, settings, small, small_with};
use updraft::study::{CellRecord, Settings, StudyError, Work, cells_folder, evaluate, logs_folder};

/// Every file of a study's cells with its bytes. While a study is flown, a temporary file may be gone before it is read.
fn cells(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(cells_folder(folder))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter_map(|path| {
            let name: String = path.file_name().unwrap().to_string_lossy().into();
            let bytes = fs::read(path);
            if bytes.is_err() && name.starts_with(".partial-") {
                None
            } else {
                Some((name, bytes.unwrap()))
            }
        })
        .collect()
}

fn all_whole(folder: &Path) -> usize {
    let cells = cells(folder);
    let mut whole = 0;
    for (name, bytes) in &cells {
        // A killed run may leave temporary files, which no step takes for a flight.
        if name.starts_with(".partial-") {
            continue;
        }
        let record: CellRecord = serde_json::from_slice(bytes).unwrap();
        assert_eq!(record.key.len(), 64, "{name}");
        whole += 1;
    }
    whole
}

#[test]
fn a_finished_study_flies_nothing_and_says_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let first = result(&small(), folder.path());
    let before = cells(folder.path());
    let again = flown(&small(), folder.path(), settings(1)).unwrap();
    assert_eq!(again.flown, 0);
    assert_eq!(evaluate(&small(), 1, &again).unwrap(), first);
    assert_eq!(cells(folder.path()), before);
    let forced = Settings { force: true, ..settings(1) };
    assert_eq!(flown(&small(), folder.path(), forced).unwrap().flown, 9);
    assert_eq!(cells(folder.path()), before, "the same seed gives the same bytes");
}

#[test]
fn a_changed_study_flies_only_what_changed() {
    let folder = tempfile::tempdir().unwrap();
    result(&small(), folder.path());
    let flown = |from: &str, to: &str| {
        flown(&small_with(from, to), folder.path(), settings(1)).unwrap().flown
    };
    assert_eq!(flown("A small study", "Another title"), 0);
    assert_eq!(flown("{ from = -3.5, to = 3.5, step = 3.5 }", "[-3.5, 0.0, 1.0, 3.5]"), 3);
    assert_eq!(flown("135.0", "180.0"), 3, "a new direction");
    assert_eq!(flown("winds_mps = [0.0, 4.0]", "winds_mps = [0.0]"), 0, "less is there already");
    assert_eq!(flown("hover_s = 5.0", "hover_s = 6.0"), 9, "another ladder");
}

#[test]
fn another_seed_is_another_study() {
    let folder = tempfile::tempdir().unwrap();
    let still = small_with("winds_mps = [0.0, 4.0]", "winds_mps = [0.0]");
    assert_eq!(flown(&still, folder.path(), settings(1)).unwrap().flown, 3);
    assert_eq!(flown(&still, folder.path(), settings(2)).unwrap().flown, 3);
}

#[test]
fn a_stopped_study_goes_on_where_it_stopped() {
    let whole = tempfile::tempdir().unwrap();
    let expected = result(&small(), whole.path());
    let folder = tempfile::tempdir().unwrap();
    let study = small();
    let stop = AtomicBool::new(false);
    let stopped = Work::open(&study, folder.path(), settings(1))
        .unwrap()
        .fly(&stop, &|| stop.store(true, Ordering::Relaxed));
    assert!(matches!(stopped, Err(StudyError::Stopped)), "{stopped:?}");
    let kept = all_whole(folder.path());
    assert!((1..9).contains(&kept), "{kept}");
    assert!(
        cells(folder.path()).keys().all(|name| !name.starts_with(".partial-")),
        "nothing half-written"
    );
    let rest = flown(&study, folder.path(), settings(1)).unwrap();
    assert_eq!(rest.flown, 9 - kept);
    assert_eq!(evaluate(&study, 1, &rest).unwrap(), expected);
    assert_eq!(cells(folder.path()), cells(whole.path()));
}

#[test]
fn damaged_cells_are_flown_again() {
    let folder = tempfile::tempdir().unwrap();
    result(&small(), folder.path());
    let before = cells(folder.path());
    let path = |name: &str| cells_folder(folder.path()).join(name);
    let names: Vec<&String> = before.keys().collect();
    fs::write(path(names[0]), &before[names[0]][..1000]).unwrap();
    fs::write(path(names[1]), b"").unwrap();
    fs::write(path(".partial-x"), b"{").unwrap();
    assert_eq!(flown(&small(), folder.path(), settings(1)).unwrap().flown, 2);
    assert_eq!(cells(folder.path()), before);
}

#[test]
fn threads_do_not_change_a_byte() {
    let run = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| result(&small(), folder.path()));
        (serde_json::to_string(&found).unwrap(), cells(folder.path()))
    };
    let (one, two) = (run(1), run(2));
    assert!(one == two);
}

#[test]
fn logs_are_kept_on_request_and_match_their_flights() {
    let folder = tempfile::tempdir().unwrap();
    let still = small_with("winds_mps = [0.0, 4.0]", "winds_mps = [0.0]");
    let keep = Settings { keep_logs: true, ..settings(1) };
    assert_eq!(flown(&still, folder.path(), settings(1)).unwrap().flown, 3);
    let with_logs = flown(&still, folder.path(), keep).unwrap();
    assert_eq!(with_logs.flown, 3, "their logs were not there");
    for record in with_logs.records.iter().flatten() {
        let log = record.log.as_ref().unwrap();
        let path = logs_folder(folder.path()).join(&log.file);
        assert_eq!(fs::metadata(&path).unwrap().len(), log.bytes);
        assert!(updraft::log::Log::open(&path).unwrap().inventory().messages.len() > 5);
    }
    assert_eq!(flown(&still, folder.path(), keep).unwrap().flown, 0);
    let first = with_logs.records[0].as_ref().unwrap().log.as_ref().unwrap();
    fs::remove_file(logs_folder(folder.path()).join(&first.file)).unwrap();
    assert_eq!(flown(&still, folder.path(), keep).unwrap().flown, 1);
    // Logs of another seed do not stay beside flights of this one.
    assert_eq!(flown(&still, folder.path(), settings(2)).unwrap().flown, 3);
    assert_eq!(fs::read_dir(logs_folder(folder.path())).unwrap().count(), 0);
}

fn sweep(study: &Path, output: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_updraft"));
    command.args(["sweep", "--json", "--quiet", "-o"]).arg(output).arg(study);
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command
}

#[test]
fn a_killed_sweep_goes_on_where_it_was_killed() {
    let folder = tempfile::tempdir().unwrap();
    let study = folder.path().join("small.toml");
    fs::write(&study, SMALL).unwrap();
    let output = folder.path().join("out");
    let mut child = sweep(&study, &output).arg("--jobs=1").spawn().unwrap();
    // As soon as one flight is finished, or the whole is.
    let finished = || cells_folder(&output).is_dir() && all_whole(&output) > 0;
    while !finished() && child.try_wait().unwrap().is_none() {
        std::thread::yield_now();
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = all_whole(&output);
    assert!(kept >= 1);
    let done = sweep(&study, &output).output().unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    let told: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(told["schema"], "updraft.sweep/1");
    assert_eq!(
        (told["kept"].as_u64(), told["flown"].as_u64()),
        (Some(kept as u64), Some(9 - kept as u64))
    );
    assert!(fs::read_dir(cells_folder(&output)).unwrap().count() == 9, "temporary files are swept");
    assert!(output.join("report/index.html").is_file());
    let written: serde_json::Value =
        serde_json::from_slice(&fs::read(output.join("study.json")).unwrap()).unwrap();
    assert_eq!(written, told["study"]);
}

#[test]
fn a_study_does_not_go_into_a_campaign() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("plan.json"), "{}").unwrap();
    let study = folder.path().join("small.toml");
    fs::write(&study, SMALL).unwrap();
    let refused = sweep(&study, folder.path()).output().unwrap();
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("is a campaign"));
}
