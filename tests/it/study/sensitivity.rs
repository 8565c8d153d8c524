//! Sensitivity studies: whole campaigns, resumed, evaluated and read back.

#![expect(clippy::unwrap_used, reason = "a study that cannot be flown fails its test")]

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};

use updraft::base::shard::Share;
use updraft::study::sensitivity::{
    Done, Gathered, ItemRecord, Outcome, SensitivityPlan, SensitivityWork, evaluate, item_path,
    items_folder,
};
use updraft::study::{AnyStudy, StudyError};
use updraft::workflow::host::{Host as _, Quiet};
use updraft::workflow::sensitivity::{Settings, fly, write};

/// Two drones a side at most, two winds, short flights: a Latin hypercube of four.
const TINY: &str = r#"schema = "updraft.sensitivity/1"
title = "A tiny study"
campaign = "campaign"
vehicle = "pixel"
design = "latin-hypercube"
samples = 4
air = ["field:sd=0.5,lambda=145,tau=186"]

[set]
"grid.columns" = 2
"calibration.speeds_mps" = [1.0, 2.0, 3.5]
"calibration.leg_s" = 14.0
"calibration.hover_s" = 5.0
"calibration.window.length_s" = 6.0

[[factor]]
name = "wind"
unit = "m/s"
drives = "air.wind_mps"
from = 0.0
to = 5.0

[[factor]]
name = "sd"
drives = "air.field.sd"
from = 0.1
to = 1.0
scale = "log"

[[factor]]
name = "rows"
drives = "set.grid.rows"
values = [1, 2]

[[factor]]
name = "hover"
drives = "set.hover.duration_s"
from = 40
to = 60

[[factor]]
name = "inflow"
drives = "effect.rotor-inflow"
values = ["on", "off"]
"#;

fn tiny() -> SensitivityPlan {
    SensitivityPlan::parse("tiny.toml", TINY).unwrap()
}

fn tiny_with(from: &str, to: &str) -> SensitivityPlan {
    assert!(TINY.contains(from), "the study no longer has {from}");
    SensitivityPlan::parse("tiny.toml", &TINY.replacen(from, to, 1)).unwrap()
}

/// Flies what is open, and writes all results.
fn flown(study: &SensitivityPlan, folder: &Path, takes: &(dyn Fn(usize) -> bool + Sync)) -> usize {
    let host = Quiet::default();
    let work = SensitivityWork::open(study, folder, 1, false, Share::default()).unwrap();
    let settings = Settings { seed: 1, ..Settings::default() };
    let gathered = fly(&host, study, work, folder, &settings, takes).unwrap();
    let result = evaluate(study, 1, &gathered);
    write(folder, "updraft sweep tiny.toml".to_owned(), study, &gathered, &result).unwrap();
    gathered.flown
}

/// Every file below a folder with its bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let (mut found, mut folders) = (BTreeMap::new(), vec![folder.to_owned()]);
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_string_lossy().into_owned();
                found.insert(name, fs::read(&path).unwrap());
            }
        }
    }
    found
}

#[test]
fn a_study_of_campaigns_is_the_same_with_any_threads_and_after_an_interruption() {
    let study = tiny();
    let run = |threads: usize| {
        let folder = tempfile::tempdir().unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        assert_eq!(pool.install(|| flown(&study, folder.path(), &|_| true)), 4);
        folder
    };
    let (one, two) = (run(1), run(2));
    let expected = files(one.path());
    assert_eq!(expected, files(two.path()), "one thread and two");
    let names: Vec<&str> = expected.keys().map(String::as_str).collect();
    assert!(names.contains(&"items/000/000003.json"), "{names:?}");
    assert!(names.contains(&"report/figures/scatter-rms-mps.svg"), "{names:?}");
    assert!(!names.iter().any(|name| name.starts_with("work/")), "campaigns' folders are removed");

    // Stopped after the first, then a part of the rest, then all.
    let folder = tempfile::tempdir().unwrap();
    let host = Quiet::default();
    let work = SensitivityWork::open(&study, folder.path(), 1, false, Share::default()).unwrap();
    let stopped = work.fly(
        &|_| true,
        &|item| {
            host.stop();
            let record = fs::read(item_path(one.path(), item.index)).unwrap();
            let record: ItemRecord = serde_json::from_slice(&record).unwrap();
            Ok(Done { result: Ok(record.outcome.unwrap()), warnings: record.warnings })
        },
        host.stop_flag(),
        &|| {},
    );
    assert!(matches!(stopped, Err(StudyError::Stopped)), "{stopped:?}");
    let kept = files(&items_folder(folder.path())).len();
    assert!((1..4).contains(&kept), "{kept}");
    let odd = flown(&study, folder.path(), &|index| index % 2 == 1);
    assert_eq!(flown(&study, folder.path(), &|_| true), 4 - kept - odd);
    assert_eq!(files(folder.path()), expected);
    // A damaged record is flown again; another title and outcome need no flight, another seed needs all.
    fs::write(item_path(folder.path(), 2), &expected["items/000/000002.json"][..100]).unwrap();
    assert_eq!(flown(&study, folder.path(), &|_| true), 1);
    assert_eq!(files(folder.path()), expected);
    let open = |study: &SensitivityPlan, seed| {
        let work =
            SensitivityWork::open(study, folder.path(), seed, false, Share::default()).unwrap();
        work.open_items(&|_| true)
    };
    assert_eq!(open(&tiny_with("A tiny study", "Another"), 1), 0);
    assert_eq!(open(&study, 2), 4);
    assert_eq!(open(&tiny_with("lambda=145", "lambda=100"), 1), 4);
    assert_eq!(open(&tiny_with("vehicle = \"pixel\"\n", ""), 1), 4);

    // What the campaigns came to.
    for index in 0..4 {
        let bytes = fs::read(item_path(folder.path(), index)).unwrap();
        let record: ItemRecord = serde_json::from_slice(&bytes).unwrap();
        let outcome = record.outcome.unwrap();
        let (rms, zero) = (outcome.rms_mps.unwrap(), outcome.zero_rms_mps.unwrap());
        assert!(rms > 0.0 && zero > 0.0 && rms < 3.0, "{outcome:?}");
        assert!((outcome.ratio_to_zero.unwrap() - rms / zero).abs() < 1e-12);
        assert!((0.0..=1.0).contains(&outcome.coverage.unwrap()));
        assert!(outcome.width_ratio.unwrap() > 0.0, "{outcome:?}");
        let rows = record.levels["rows"].as_u64().unwrap();
        assert_eq!(u64::from(outcome.drones), 2 * rows);
        assert!(record.levels["inflow"].is_string());
    }
    #[cfg(feature = "parquet")]
    parquet_is_as_csv(folder.path());
}

/// Reads both tables back.
#[cfg(feature = "parquet")]
fn parquet_is_as_csv(folder: &Path) {
    use parquet::file::reader::{FileReader as _, SerializedFileReader};
    use parquet::record::Field;

    let file = fs::File::open(folder.join("results.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let rows: Vec<_> = reader.get_row_iter(None).unwrap().map(Result::unwrap).collect();
    let text = fs::read_to_string(folder.join("results.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let names = lines.next().unwrap();
    assert_eq!(rows.len(), 4);
    for (row, line) in rows.iter().zip(lines) {
        assert_eq!(names.len(), line.len());
        for (((name, field), expected), text) in row.get_column_iter().zip(&names).zip(line) {
            assert_eq!(name, expected);
            let shown = match field {
                Field::Null => String::new(),
                Field::Long(number) => number.to_string(),
                Field::Double(number) => number.to_string(),
                Field::Str(text) => text.clone(),
                other => panic!("{name}: {other:?}"),
            };
            assert_eq!(shown, text, "{name}");
        }
    }
    let types: Vec<_> = reader
        .metadata()
        .file_metadata()
        .schema_descr()
        .columns()
        .iter()
        .map(|column| format!("{} {}", column.name(), column.physical_type()))
        .collect();
    for column in ["rows INT64", "wind DOUBLE", "inflow BYTE_ARRAY", "rms_mps DOUBLE"] {
        assert!(types.contains(&column.to_owned()), "{types:?}");
    }
}

/// A study whose campaigns are made up: the error is twice the wind, less for more rows.
fn made_up(study: &SensitivityPlan, folder: &Path) -> Gathered {
    let work = SensitivityWork::open(study, folder, 1, false, Share::default()).unwrap();
    let host = Quiet::default();
    let made = |item: &updraft::study::sensitivity::Item| {
        let level = |index: usize| item.levels[index].number().unwrap();
        if item.index == 3 {
            return Ok(Done { result: Err("it was lost".to_owned()), warnings: Vec::new() });
        }
        let rms = 2.0 * level(0) + 0.5 / level(2);
        let outcome = Outcome { rms_mps: Some(rms), coverage: Some(1.0), ..Outcome::default() };
        Ok(Done { result: Ok(outcome), warnings: vec!["a doubt".to_owned()] })
    };
    work.fly(&|_| true, &made, host.stop_flag(), &|| {}).unwrap()
}

#[test]
fn what_decides_is_found_and_lost_campaigns_are_told() {
    for (design, samples) in [("sobol", 64), ("latin-hypercube", 200)] {
        let folder = tempfile::tempdir().unwrap();
        let text = TINY.replace("latin-hypercube", design);
        let text = text.replace("samples = 4", &format!("samples = {samples}"));
        let study = SensitivityPlan::parse("tiny.toml", &text).unwrap();
        let gathered = made_up(&study, folder.path());
        let result = evaluate(&study, 1, &gathered);
        assert_eq!((result.lost, result.open), (1, 0));
        assert_eq!(result.lost_reasons[0].reason, "it was lost");
        assert_eq!(result.finished, result.campaigns - 1);
        let error = &result.outcomes[0];
        assert_eq!(error.name, "rms_mps");
        let main: Vec<_> = error.influences.iter().map(|found| found.main().unwrap()).collect();
        assert!(main[0].value > 0.9, "{design}: {main:?}");
        for other in [1, 3, 4] {
            assert!(main[other].low <= 0.02 && main[other].value.abs() < 0.1, "{design}: {main:?}");
        }
        if design == "sobol" {
            assert_eq!(result.campaigns, 64 * 8);
            assert_eq!(result.factors.last().unwrap().name, "chance");
            assert!(main[5].value.abs() < 1e-9, "chance decides nothing here: {main:?}");
            assert_eq!(error.influences[0].n, 64, "the lost campaign is of another column");
            assert_eq!(error.influences[1].n, 63);
        }
        let nothing = result.outcomes.iter().find(|outcome| outcome.name == "coverage").unwrap();
        assert!(nothing.influences.iter().all(|found| found.main().is_none()));
        // A page can be made of it, without numbers that are none.
        let page = write(folder.path(), String::new(), &study, &gathered, &result).unwrap();
        let html = fs::read_to_string(page).unwrap();
        assert!(html.contains("it was lost") && !html.contains("NaN"));
        for width in [40, 80, 100] {
            let text = updraft::report::sensitivity_summary(&result, width, false);
            assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
        }
    }
}

#[test]
fn open_campaigns_are_taken_once_by_parts() {
    let folder = tempfile::tempdir().unwrap();
    let study = tiny_with("samples = 4", "samples = 2500");
    let flown = AtomicUsize::new(0);
    let host = Quiet::default();
    for part in 0..3 {
        let work =
            SensitivityWork::open(&study, folder.path(), 1, false, Share::default()).unwrap();
        let done = |_: &updraft::study::sensitivity::Item| {
            flown.fetch_add(1, Ordering::SeqCst);
            Ok(Done { result: Ok(Outcome::default()), warnings: Vec::new() })
        };
        work.fly(&|index| index % 3 == part, &done, host.stop_flag(), &|| {}).unwrap();
    }
    assert_eq!(flown.into_inner(), 2500);
    let shelves = fs::read_dir(items_folder(folder.path())).unwrap().count();
    assert_eq!(shelves, 3, "a thousand in a folder");
}

#[test]
fn wrong_studies_are_told_where_and_what_is_allowed() {
    let mut told = String::new();
    for (from, to) in [
        ("updraft.sensitivity/1", "updraft.sensitivity/2"),
        ("title = \"A tiny study\"\n", ""),
        ("latin-hypercube", "monte-carlo"),
        ("samples = 4\n", ""),
        ("samples = 4", "samples = 1"),
        ("samples = 4", "samples = 4\nrepeats = 2"),
        ("\"latin-hypercube\"\nsamples = 4", "\"grid\"\nsamples = 4"),
        ("\"latin-hypercube\"\nsamples = 4", "\"grid\""),
        ("\"latin-hypercube\"\nsamples = 4", "\"sobol\"\nsamples = 100000"),
        ("samples = 4", "samples = 4\nseeds = \"some\""),
        ("samples = 4", "samples = 4\noutcomes = [\"rms\"]"),
        ("samples = 4", "samples = 4\nnaming = \"rotor-inflw\""),
        ("campaign = \"campaign\"", "campaign = \"calibration\""),
        ("campaign = \"campaign\"", "campaign = \"compaign\""),
        ("vehicle = \"pixel\"", "vehicle = \"zeppelin\""),
        ("field:sd=0.5", "fields:sd=0.5"),
        ("\"grid.columns\" = 2", "\"grid.column\" = 2"),
        ("air.wind_mps", "air.wind"),
        ("air.wind_mps", "wind"),
        ("air.field.sd", "air.dryden.sd"),
        ("air.field.sd", "air.field.sds"),
        ("\"set.grid.rows\"", "\"set.rows_of_grid\""),
        ("\"set.grid.rows\"", "[\"set.grid.rows\", \"lost_share\"]"),
        ("\"set.grid.rows\"", "\"lost_share\""),
        ("\"set.grid.rows\"", "\"vehicle.airframe.mass\""),
        ("\"set.grid.rows\"\n", "\"set.grid.rows\"\nknown = true\n"),
        ("values = [1, 2]", "values = [1]"),
        ("values = [1, 2]", "values = [1, 1]"),
        ("values = [1, 2]", "values = [1, 2]\nscale = \"log\""),
        ("values = [1, 2]", "values = [0, 1]"),
        ("values = [\"on\", \"off\"]", "values = [\"on\", \"maybe\"]"),
        ("values = [1, 2]\n", ""),
        ("from = 0.0\nto = 5.0", "from = 5.0\nto = 0.0"),
        ("from = 0.0\nto = 5.0", "from = 0.0\nto = 50.0"),
        ("from = 0.1\n", "from = 0.0\n"),
        ("scale = \"log\"", "scale = \"square\""),
        ("name = \"sd\"", "name = \"wind\""),
        ("name = \"sd\"", "name = \"rms_mps\""),
        ("from = 40\n", "start = 40\n"),
    ] {
        assert!(TINY.contains(from), "the study no longer has {from}");
        let text = TINY.replacen(from, to, 1);
        let error = SensitivityPlan::parse("mine.toml", &text).expect_err(to);
        let _ = writeln!(told, "{from}  ->  {to}\n{error}");
    }
    insta::assert_snapshot!(told);
}

#[test]
fn the_built_in_study_is_one() {
    for name in ["sensitivity", "sensitivity.toml", "templates/sensitivity.toml"] {
        let AnyStudy::Sensitivity(study) = AnyStudy::load(name).unwrap() else { panic!("{name}") };
        assert_eq!(study.factors.len(), 7);
        assert_eq!(study.drawn(1).len(), 16 * (8 + 2));
    }
    let AnyStudy::Ladder(_) = AnyStudy::load("study").unwrap() else { panic!("the paper's") };
}

#[test]
fn sweep_flies_it_and_prints_what_it_wrote() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("tiny.toml");
    // Two campaigns, the smallest.
    let text = TINY.replace("samples = 4", "samples = 2");
    let text = text.replace("from = 40\nto = 60", "from = 40\nto = 41");
    fs::write(&file, text).unwrap();
    let output = folder.path().join("out");
    let sweep = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_updraft"));
        command.args(["sweep", "--json", "--quiet", "-o"]).arg(&output).arg(&file);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).output().unwrap()
    };
    let done = sweep();
    // So short a ladder may give no map in one of them.
    let code = done.status.code();
    assert!(matches!(code, Some(0 | 3)), "{}", String::from_utf8_lossy(&done.stderr));
    let told: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(told["schema"], "updraft.sweep-sensitivity/1");
    assert_eq!((told["flown"].as_u64(), told["kept"].as_u64()), (Some(2), Some(0)));
    let written: serde_json::Value =
        serde_json::from_slice(&fs::read(output.join("sensitivity.json")).unwrap()).unwrap();
    assert_eq!(written, told["study"]);
    assert!(output.join("report/index.html").is_file());
    let again: serde_json::Value = serde_json::from_slice(&sweep().stdout).unwrap();
    assert_eq!((again["flown"].as_u64(), again["kept"].as_u64()), (Some(0), Some(2)));
}
