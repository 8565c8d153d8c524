//! Wrong studies are told where, why and what is allowed.

use std::fmt::Write as _;

use crate::study::support::{SMALL, small, small_with};
use updraft::study::{Cell, StudyPlan};

#[test]
fn wrong_studies_are_told_where_and_what_is_allowed() {
    let mut told = String::new();
    for (from, to) in [
        ("updraft.study/1", "updraft.template/1"),
        ("title = \"A small study\"\n", ""),
        ("directions =", "direction ="),
        ("winds_mps = [0.0, 4.0]", "winds_mps = [2.5, 4.0]"),
        ("winds_mps = [0.0, 4.0]", "winds_mps = []"),
        ("winds_mps = [0.0, 4.0]", "winds_mps = [0.0, -4.0]"),
        ("winds_mps = [0.0, 4.0]", "winds_mps = [0.0, 4.0, 4.0]"),
        ("winds_mps = [0.0, 4.0]", "winds_mps = \"calm\""),
        ("[30.0, 135.0]", "0"),
        ("[30.0, 135.0]", "[]"),
        ("[30.0, 135.0]", "[360.0]"),
        ("[30.0, 135.0]", "\"north\""),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "{ from = -3.5, to = 3.5, step = 1.5 }"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "{ from = -3.5, to = 3.5, step = 0.0 }"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "{ from = -3.5, to = 3.5, steps = 10 }"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "{ from = 1.0, to = 3.0, step = 1.0 }"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "{ from = -10, to = 10, step = 0.0001 }"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "[0.0, 1.0]"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "[-1.0, 0.0, nan]"),
        ("{ from = -3.5, to = 3.5, step = 3.5 }", "3.5"),
        ("calibration.toml", "calibrate.toml"),
        ("calibration.toml", "campaign.toml"),
        ("calibration.toml", "hover.toml"),
        ("winds_mps", "vehicle = \"zeppelin\"\nwinds_mps"),
        ("leg_s = 14.0", "legs_s = 14.0"),
        ("leg_s = 14.0", "leg_s = -1.0"),
        ("[set]", "[set"),
    ] {
        assert!(SMALL.contains(from), "the study no longer has {from}");
        let text = SMALL.replacen(from, to, 1);
        let error = StudyPlan::parse("mine.toml", &text).expect_err(to);
        let _ = writeln!(told, "{from}  ->  {to}\n{error}");
    }
    insta::assert_snapshot!(told);
}

#[test]
fn a_template_without_a_ladder_is_refused() {
    let text = SMALL.replace("calibration.toml", "hover.toml").replace("hover_s = 5.0\n", "");
    let text = text.replace("leg_s = 14.0\n", "").replace("speeds_mps = [1.0, 2.0, 3.5]\n", "");
    let error = StudyPlan::parse("mine.toml", &text).unwrap_err().to_string();
    assert!(error.contains("no ladder") && error.contains("mine.toml:3:12"), "{error}");
}

#[test]
fn a_name_that_is_no_study_is_told_what_is_built_in() {
    let error = StudyPlan::load("templates/studies.toml").unwrap_err().to_string();
    assert_eq!(
        error,
        "there is no study templates/studies.toml; built in are study.toml and sensitivity.toml"
    );
}

#[test]
fn keys_of_the_template_may_be_quoted_or_dotted() {
    let dotted =
        small_with("\"grid.rows\" = 1\n\"grid.columns\" = 1", "grid.rows = 1\ngrid.columns = 1");
    assert_eq!(dotted.plan, small().plan);
    assert_eq!(dotted.plan.slots.len(), 1);
}

#[test]
fn still_air_is_flown_once_and_winds_in_every_direction() {
    let names: Vec<String> =
        small().cells().iter().filter(|c| c.updraft_mps == 0.0).map(Cell::name).collect();
    assert_eq!(names, ["still-updraft+0", "wind4-from030-updraft+0", "wind4-from135-updraft+0"]);
    let counted = small_with("[30.0, 135.0]", "3");
    let from: Vec<_> = counted.conditions.iter().filter_map(|c| c.from_deg).collect();
    assert_eq!(from, [0.0, 120.0, 240.0]);
}
