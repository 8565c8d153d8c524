//! What a study finds: the paper's numbers, correlations, saturated windows.

#![expect(clippy::unwrap_used, reason = "a study that cannot be flown fails its test")]

use crate::study::support::{result, small};
use updraft::analysis::result::{ANALYSIS_SCHEMA, Analysis, Rejection};
use updraft::report::{Provenance, render_study, render_with_study, study_summary};
use updraft::study::StudyPlan;
use updraft::study::result::StudyResult;

/// The paper's ladder in its three winds, with the updrafts next to 0 only.
fn papers_ladder() -> StudyResult {
    let text = include_str!("../../../templates/study.toml")
        .replace("directions = 6", "directions = 1")
        .replace("{ from = -3.5, to = 3.5, step = 0.7 }", "[-0.7, 0.0, 0.7]");
    let study = StudyPlan::parse("templates/study.toml", &text).unwrap();
    let folder = tempfile::tempdir().unwrap();
    result(&study, folder.path())
}

#[test]
fn the_built_in_study_is_the_papers() {
    let study = StudyPlan::load("templates/study.toml").unwrap();
    let cells = study.cells();
    assert_eq!((study.conditions.len(), study.updrafts_mps.len(), cells.len()), (13, 11, 143));
    assert_eq!(study.updrafts_mps[6], 0.7);
    assert_eq!(study.conditions[12].from_deg, Some(300.0));
    assert_eq!(cells.iter().filter(|cell| cell.is_reference()).count(), 1);
    let mut names: Vec<_> = cells.iter().map(updraft::study::Cell::name).collect();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), 143, "names of files are unique");
}

#[test]
fn table_one_and_the_shifts_in_wind_are_those_of_airsims_constants() {
    let study = papers_ladder();
    for (way, table) in [("paper", &study.paper_way.table), ("own", &study.own_way.table)] {
        let windless: Vec<f64> = table.iter().map(|row| row.windless.value).collect();
        assert!((windless[0] - 8.14).abs() <= 0.02, "{way}: A {}", windless[0]);
        assert!((windless[1] - 1598.6).abs() <= 0.5, "{way}: u0 {}", windless[1]);
        assert!((windless[2] + 0.035).abs() <= 0.005, "{way}: W* {}", windless[2]);
    }
    let at_zero: Vec<f64> =
        study.paper_way.conditions.iter().map(|c| c.at_zero_mps.unwrap().value).collect();
    // Wind along the body, where AirSim's drag is that of one face.
    assert!((at_zero[1] - at_zero[0] + 0.010).abs() <= 0.005, "{at_zero:?}");
    assert!((at_zero[2] - at_zero[0] + 0.075).abs() <= 0.005, "{at_zero:?}");
    // Pooled over the winds, as the paper's Table I probably is: within three of its errors.
    let pooled = study.paper_way.table[2].pooled.unwrap().value;
    assert!((pooled + 0.0589).abs() <= 3.0 * 0.0031, "{pooled}");
    assert_eq!(study.windows.used, study.windows.moving);
}

#[test]
fn the_updraft_is_found_and_saturated_windows_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let study = result(&small(), folder.path());
    assert_eq!((study.flights.len(), study.lost.len()), (9, 0));
    for evaluation in [&study.paper_way, &study.own_way] {
        let [lowest, highest] = evaluation.rho.unwrap();
        assert!(lowest > 0.999 && highest <= 1.0, "{:?}", evaluation.rho);
        for condition in &evaluation.conditions {
            let found = condition.regression.unwrap();
            assert!((found.slope.value - 1.0).abs() < 0.02, "{condition:?}");
            assert!(found.rms_error < 0.2, "{condition:?}");
        }
    }
    let mut saturated = 0;
    for flight in &study.flights {
        for window in &flight.windows {
            let through_air_mps = window.commanded_mps - flight.updraft_mps;
            let at_limit = window.rejected.contains(&Rejection::Saturated);
            saturated += usize::from(at_limit);
            if through_air_mps > 6.9 {
                assert!(at_limit, "{} {}", flight.name, window.label);
                // The drone cannot follow, and its measured speed says so.
                assert!(window.velocity_mps.median < 3.3, "{window:?}");
            } else if through_air_mps < 6.0 {
                assert!(!at_limit, "{} {}", flight.name, window.label);
            }
        }
    }
    // One for each wind condition: climbing at 3.5 m/s in the downdraft of 3.5 m/s.
    assert_eq!((saturated, study.windows.saturated), (3, 3));
    assert_eq!(study.windows.moving, 9 * 6);
    assert_eq!(study.windows.used, 9 * 6 - 3);
}

#[test]
fn the_report_says_what_the_study_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut study = result(&small(), folder.path());
    study.title = "<script>alert(1)</script>\u{1b}[31m".to_owned();
    let report = render_study(&study, &Provenance::default()).unwrap();
    assert!(!report.html.contains("<script>") && !report.html.contains('\u{1b}'));
    assert!(report.html.contains("4 m/s from 030°") && report.html.contains("8.207 ± 0.020"));
    let names: Vec<_> = report.figures.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["fig2-study", "study-winds", "study-errors"]);
    for (name, svg) in &report.figures {
        assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN"), "{name}");
    }
    assert_eq!(report, render_study(&study, &Provenance::default()).unwrap());

    // The report of a campaign that holds it has the paper's figure and table.
    let analysis = Analysis {
        schema: ANALYSIS_SCHEMA.to_owned(),
        made_by: String::new(),
        title: String::new(),
        flights: Vec::new(),
        laws_from: None,
        warnings: Vec::new(),
    };
    let whole = render_with_study(&analysis, &study, &Provenance::default()).unwrap();
    assert!(whole.figures.iter().map(|(name, _)| name).eq(["fig2-study"]));
    assert!(whole.html.contains("8.207 ± 0.020") && whole.html.contains("Table I"));
    for width in [40, 80, 100, 200] {
        let text = study_summary(&study, width, false);
        assert!(text.lines().all(|line| line.chars().count() <= width), "{text}");
        assert!(text.contains("4 m/s from 030°") && !text.contains('\u{1b}'), "{text}");
    }
}

#[test]
fn an_empty_result_still_makes_a_report() {
    let folder = tempfile::tempdir().unwrap();
    let mut study = result(&small(), folder.path());
    study.flights.clear();
    study.paper_way.table.clear();
    study.paper_way.conditions.clear();
    (study.paper_way.rho, study.paper_way.p_value) = (None, None);
    study.updrafts_mps.clear();
    assert!(render_study(&study, &Provenance::default()).unwrap().figures.is_empty());
    assert!(!study_summary(&study, 80, true).is_empty());
}
