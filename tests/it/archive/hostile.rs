//! Campaigns that are broken, strange or mean harm.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::archive::support::{Campaign, archive, parts, table};
use crate::cli::support::{Bench, contents};

fn analysis_of(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("analysis.json")).unwrap()).unwrap()
}

fn write_analysis(folder: &Path, analysis: &Value) {
    fs::write(folder.join("analysis.json"), serde_json::to_vec(analysis).unwrap()).unwrap();
}

#[test]
fn broken_campaigns_are_named_and_what_the_archive_has_of_them_stays() {
    let bench = Bench::new();
    for (day, name) in ["a", "b", "c"].iter().enumerate() {
        Campaign::on_day(day as i64).write(&bench.path(&format!("season/{name}")));
    }
    archive(&bench, 0, &["season"]);
    let before = contents(&bench.path("archive/seconds"));
    // Cut in the middle of a series: the short tables would still be there.
    let path = bench.path("season/a/analysis.json");
    let text = fs::read(&path).unwrap();
    fs::write(&path, &text[..text.len() - 200]).unwrap();
    fs::remove_file(bench.path("season/b/analysis.json")).unwrap();
    let ended = bench.expect(3, &["archive", "season", "--prune"]);
    assert!(ended.err.contains("season/a is skipped: "), "{ended}");
    assert!(ended.err.contains("analysis.json is not valid: EOF while parsing"), "{ended}");
    assert!(
        ended.err.contains("season/b is skipped: it has no analysis.json: run `updraft analyze`"),
        "{ended}"
    );
    let after = contents(&bench.path("archive/seconds"));
    let kept = |of: &str| {
        let is_of =
            |(path, _): &&(std::path::PathBuf, Vec<u8>)| path.to_string_lossy().contains(of);
        before.iter().find(is_of) == after.iter().find(is_of)
    };
    assert!(kept("campaign=a-") && kept("campaign=c-"));
    assert_eq!(parts(&bench.path("archive"), "flights").len(), 2, "b's analysis is gone");
    fs::remove_dir_all(bench.path("season/c")).unwrap();
    bench.expect(5, &["archive", "season"]);
    bench.expect(5, &["archive", "season/a/calibration", "-o", "other"]);
    bench.expect(1, &["archive", "nowhere"]);
    assert!(!bench.path("archive/.partial-campaign").exists());
}

#[test]
fn a_series_that_breaks_off_leaves_no_part_of_a_campaign() {
    let bench = Bench::new();
    let folder = bench.path("june");
    Campaign::on_day(0).write(&folder);
    let mut analysis = analysis_of(&folder);
    // Passed over by who reads the short parts.
    analysis["flights"][1]["map"]["drones"][3]["sd_mps"][7] = "high".into();
    write_analysis(&folder, &analysis);
    let ended = bench.expect(5, &["archive", "june"]);
    assert!(ended.err.contains("expected f64"), "{ended}");
    assert!(contents(&bench.path(".")).iter().all(|(path, _)| !path.ends_with("part.parquet")));
}

#[test]
fn names_and_texts_of_campaigns_stay_names_and_texts() {
    let bench = Bench::new();
    let folder = bench.path("season/date=1999-01-01;campaign=..%2F..");
    Campaign::on_day(0).write(&folder);
    let mut analysis = analysis_of(&folder);
    analysis["title"] = "\u{1b}[2Jgone\u{202e}".into();
    analysis["flights"][1]["name"] = "../../hover".into();
    write_analysis(&folder, &analysis);
    let said = archive(&bench, 0, &["season"]);
    let id = said["campaigns"][0]["campaign"].as_str().unwrap().to_owned();
    assert!(id.starts_with("date-1999-01-01-campaign-2F-"), "{id}");
    for part in parts(&bench.path("archive"), "seconds") {
        assert_eq!(part.split('/').count(), 4, "{part}");
        assert!(part.ends_with(&format!("campaign={id}/part.parquet")), "{part}");
    }
    let (_, flights) = table(&bench.path("archive"), "flights");
    assert!(flights[0].contains("title: \"␛[2Jgone\u{fffd}\""), "{}", flights[0]);
}

#[test]
fn numbers_that_are_none_and_drones_without_a_place_are_missing() {
    let bench = Bench::new();
    let folder = bench.path("june");
    Campaign::on_day(0).write(&folder);
    let mut analysis = analysis_of(&folder);
    let drone = &mut analysis["flights"][1]["map"]["drones"][0];
    drone["position_m"] = Value::Null;
    drone["mean"]["se"] = Value::Null;
    drone["truth_mps"][0] = Value::Null;
    write_analysis(&folder, &analysis);
    archive(&bench, 0, &["june"]);
    let (_, seconds) = table(&bench.path("archive"), "seconds");
    assert!(seconds[0].contains("latitude_deg: null"), "{}", seconds[0]);
    assert!(seconds[0].ends_with("truth_mps: null}"), "{}", seconds[0]);
}

#[test]
fn other_folders_are_not_taken_for_archives() {
    let bench = Bench::new();
    Campaign::on_day(0).write(&bench.path("june"));
    fs::create_dir(bench.path("photos")).unwrap();
    fs::write(bench.path("photos/cat.jpg"), "cat").unwrap();
    for wrong in ["june", "photos"] {
        let ended = bench.expect(2, &["archive", "june", "-o", wrong]);
        assert!(ended.err.contains("holds other files and no archive"), "{ended}");
    }
    archive(&bench, 0, &["june"]);
    let index = bench.path("archive/archive.json");
    let text = fs::read_to_string(&index).unwrap();
    fs::write(&index, text.replace("2026-06-01", "../../june")).unwrap();
    bench.expect(2, &["archive", "june"]);
    assert!(bench.path("june/analysis.json").is_file());
}
