//! A small study: two winds, two directions, three updrafts, a short ladder.

#![allow(dead_code, reason = "each test file uses its own part")]

use std::path::Path;
use std::sync::atomic::AtomicBool;

use updraft::study::result::StudyResult;
use updraft::study::{Flown, Settings, StudyError, StudyPlan, Work, evaluate};

pub(crate) const SMALL: &str = r#"schema = "updraft.study/1"
title = "A small study"
template = "calibration.toml"
winds_mps = [0.0, 4.0]
directions = [30.0, 135.0]
updrafts_mps = { from = -3.5, to = 3.5, step = 3.5 }

[set]
"grid.rows" = 1
"grid.columns" = 1
"window.length_s" = 6.0
speeds_mps = [1.0, 2.0, 3.5]
leg_s = 14.0
hover_s = 5.0
"#;

/// [`SMALL`] with a piece of its text replaced.
pub(crate) fn small_with(from: &str, to: &str) -> StudyPlan {
    assert!(SMALL.contains(from), "the study no longer has {from}");
    StudyPlan::parse("small.toml", &SMALL.replacen(from, to, 1)).unwrap()
}

pub(crate) fn small() -> StudyPlan {
    StudyPlan::parse("small.toml", SMALL).unwrap()
}

pub(crate) fn settings(seed: u64) -> Settings {
    Settings { seed, ..Settings::default() }
}

/// Flies what is open in a folder.
pub(crate) fn flown(
    study: &StudyPlan,
    folder: &Path,
    settings: Settings,
) -> Result<Flown, StudyError> {
    Work::open(study, folder, settings)?.fly(&AtomicBool::new(false), &|| {})
}

pub(crate) fn result(study: &StudyPlan, folder: &Path) -> StudyResult {
    let flown = flown(study, folder, settings(1)).unwrap();
    evaluate(study, 1, &flown).unwrap()
}
