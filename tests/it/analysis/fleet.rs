//! What speaks for a fleet: drones with a part of the ladder do not, and the paper's values stand
//! only beside what they can be compared with.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::fs;
use std::path::{Path, PathBuf};

use crate::analysis::support::{
    Synthetic, Timetable, fixture, ladder, ladder_up, ladder_up_segments, plan,
};
use updraft::analysis::law::LawOf;
use updraft::analysis::result::{Analysis, FlightAnalysis, TableRow, Yield};
use updraft::analysis::table::PaperTable;
use updraft::analysis::{AnalysisOptions, FlightInput, LogInput, Warning, analyze, analyze_flight};
use updraft::mission::plan::{Plan, Purpose, SegmentKind};
use updraft::report::terminal_summary;

/// Show time that holds all of the synthetic ladder, its first six legs, its first four, s.
const WHOLE_S: f64 = 265.0;
const SIX_LEGS_S: f64 = 195.0;
const FOUR_LEGS_S: f64 = 135.0;

fn input<'a>(name: &'a str, plan: Option<&'a Plan>, logs: &'a [LogInput]) -> FlightInput<'a> {
    FlightInput {
        name,
        plan,
        purpose: plan.map(|plan| plan.purpose),
        logs,
        ..FlightInput::default()
    }
}

/// A log whose law is no line and no parabola: what one fits depends on the legs that it has.
fn write(path: &Path, system_id: u8, duration_s: f64, up: fn(f64) -> f64) {
    let u0 = 1546.5 + f64::from(system_id);
    let pulse_us = Box::new(move |time: f64| {
        let v = up(time);
        u0 + 20.0 * v + 3.0 * v * v.abs()
    });
    let log = Synthetic { system_id, duration_s, velocity_up_mps: up, pulse_us };
    fs::write(path, log.write()).unwrap();
}

/// Ladders of these lengths.
fn ladders(folder: &Path, durations_s: &[f64]) -> Vec<LogInput> {
    let one = |(index, duration_s): (usize, &f64)| {
        let path = folder.join(format!("{}.BIN", index + 1));
        write(&path, index as u8 + 1, *duration_s, ladder_up);
        LogInput { slot: None, path, ..LogInput::default() }
    };
    durations_s.iter().enumerate().map(one).collect()
}

fn flown(plan: Option<&Plan>, logs: &[LogInput]) -> FlightAnalysis {
    let input = input("calibration", plan, logs);
    analyze_flight(&input, &AnalysisOptions::default(), None, &|_, _| {}).unwrap()
}

fn row<'a>(flight: &'a FlightAnalysis, law: &str, parameter: &str) -> &'a TableRow {
    flight
        .table
        .iter()
        .find(|row| row.law.name() == law && row.parameter.name() == parameter)
        .unwrap()
}

fn in_terminal(flight: &FlightAnalysis) -> String {
    let analysis = Analysis {
        schema: String::new(),
        made_by: String::new(),
        title: String::new(),
        flights: vec![flight.clone()],
        laws_from: None,
        warnings: Vec::new(),
    };
    terminal_summary(&analysis, 200, false)
}

#[test]
fn a_part_of_the_ladder_does_not_speak_for_the_fleet() {
    let folder = tempfile::tempdir().unwrap();
    let logs = ladders(folder.path(), &[WHOLE_S, WHOLE_S, SIX_LEGS_S, WHOLE_S, FOUR_LEGS_S]);
    let plan = plan(Purpose::Calibration, ladder_up_segments(), 5);
    for plan in [Some(&plan), None] {
        let (flight, without) = (flown(plan, &logs), flown(plan, &logs[..4]));
        let partial: Vec<bool> =
            flight.drones.iter().map(|drone| drone.partial_ladder.is_some()).collect();
        // Six of eight legs at all but the slowest speeds are ladder enough.
        assert_eq!(partial, [false, false, false, false, true], "planned: {}", flight.planned);
        let own = flight.drones[4].laws.as_ref().unwrap().linear.as_ref().unwrap();
        let fleet = row(&without, "linear", "A'");
        assert!((own.parameters[0].estimate.value - fleet.mean).abs() > 10.0 * fleet.sd.max(0.05));
        assert_eq!(flight.table, without.table);
        assert_eq!(flight.flock, without.flock);
        assert_eq!(fleet.n, 4);

        let name = &flight.drones[4].name;
        let caution = flight
            .warnings
            .iter()
            .map(ToString::to_string)
            .find(|w| w.starts_with("partial ladder"))
            .unwrap();
        let words = format!("{name} (4 of 8 legs, -2 to +2 m/s)");
        assert!(caution.contains("1 of 5 drones") && caution.contains(&words), "{caution}");
        assert!(
            !without.warnings.iter().any(|w| w.to_string().contains("ladder")),
            "{:?}",
            without.warnings
        );
        assert!(in_terminal(&flight).contains(", partial "), "marked in the table of drones");
    }
}

#[test]
fn a_map_takes_the_flocks_law_for_a_partial_ladder() {
    let folder = tempfile::tempdir().unwrap();
    let calibration = ladders(folder.path(), &[WHOLE_S, WHOLE_S, FOUR_LEGS_S]);
    let hover: Vec<LogInput> = (1..=3)
        .map(|id| {
            let path = folder.path().join(format!("hover-{id}.BIN"));
            write(&path, id, 264.0, |_| 0.0);
            LogInput { slot: None, path, ..LogInput::default() }
        })
        .collect();
    let ladder = plan(Purpose::Calibration, ladder_up_segments(), 3);
    let table = Timetable::default().add(SegmentKind::Hover, "hover", 0.0, 264.0);
    let scan = plan(Purpose::Measurement, table.segments, 3);
    let inputs =
        [input("calibration", Some(&ladder), &calibration), input("hover", Some(&scan), &hover)];
    let analysis = analyze("x", &inputs, &AnalysisOptions::default(), None, &|_, _| {}).unwrap();
    let measured = &analysis.flights[1];
    let mapping: Vec<LawOf> =
        measured.map.as_ref().unwrap().drones.iter().map(|drone| drone.mapping).collect();
    assert_eq!(mapping, [LawOf::Own, LawOf::Own, LawOf::Flock]);
    let said = joined(&measured.drones[2].warnings);
    assert!(
        said.contains("the map uses the flock's law: its own is of a partial ladder"),
        "{said}"
    );
    assert!(measured.drones[0].warnings.is_empty(), "{:?}", measured.drones[0].warnings);
    assert_eq!(analysis.what_was_found(), Yield::Partial);
}

#[test]
fn most_logs_cut_is_said_of_the_fleet() {
    let folder = tempfile::tempdir().unwrap();
    let logs = ladders(folder.path(), &[WHOLE_S, FOUR_LEGS_S, FOUR_LEGS_S, FOUR_LEGS_S]);
    let plan = plan(Purpose::Calibration, ladder_up_segments(), 4);
    let flight = flown(Some(&plan), &logs);
    let words = "most drones have usable windows of a part of the ladder only: 4 legs from -2 to \
                 +2 m/s of 8 from -3 to +3 m/s";
    assert!(flight.warnings.iter().any(|w| w.to_string().contains(words)), "{:?}", flight.warnings);
    assert_eq!(row(&flight, "linear", "A'").n, 4);
}

/// Logs of one fixture that differ in their last bytes.
fn twins(folder: &Path, name: &str) -> Vec<LogInput> {
    let bytes = fs::read(fixture(name)).unwrap();
    let one = |cut: usize| {
        let path = folder.join(format!("{}.BIN", cut + 1));
        fs::write(&path, &bytes[..bytes.len() - cut]).unwrap();
        LogInput { slot: None, path, ..LogInput::default() }
    };
    (0..2).map(one).collect()
}

#[test]
fn only_what_can_be_compared_stands_beside_the_paper() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = flown(None, &twins(folder.path(), "square-law-ladder.trimmed.BIN"));
    assert_eq!(fleet.paper_table, Some(PaperTable::Field));
    // The paper's value is there in each row; whether the two compare is another thing.
    let told = |flight: &FlightAnalysis, law: &str, parameter: &str| {
        let row = row(flight, law, parameter);
        assert!(row.paper.is_some(), "{law} {parameter}");
        row.not_compared.clone()
    };
    assert_eq!(told(&fleet, "signed quadratic", "A"), None);
    let line = told(&fleet, "linear", "A'").unwrap();
    assert_eq!(line, "this law does not describe this flight");

    // The signed quadratic says nothing about a flight that it does not describe.
    let straight = flown(None, &twins(folder.path(), "ladder-still.trimmed.BIN"));
    assert!(told(&straight, "signed quadratic", "A").is_some());
    assert_eq!(told(&straight, "linear", "A'"), None);
    let text = in_terminal(&straight).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains("10.5 ± 2.6 – –"), "the paper's value without a difference: {text}");
    let why = "of the signed quadratic law: this law does not describe this flight.";
    assert!(text.contains(why), "{text}");

    // One log is no fleet.
    let single = flown(None, &twins(folder.path(), "square-law-ladder.trimmed.BIN")[..1]);
    assert_eq!(single.paper_table, None);
    assert!(single.table.iter().all(|row| row.paper.is_none()));
    let text = in_terminal(&single);
    assert!(!text.contains("Table I") && !text.contains("difference"), "{text}");
}

#[test]
fn a_large_chi_squared_of_the_better_law_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let logs = twins(folder.path(), "ladder-still.trimmed.BIN");
    // Without `--plain` the line that bends is told, by its slopes.
    let options = AnalysisOptions { plain: true, ..AnalysisOptions::default() };
    let plain = analyze_flight(&input("calibration", None, &logs), &options, None, &|_, _| {});
    let text = in_terminal(&plain.unwrap());
    let line = text.lines().find(|line| line.contains("fits better")).unwrap();
    assert!(line.contains("of the drones' average, before scatter is added"), "{line}");
}

#[test]
fn a_contradiction_is_told_once() {
    let folder = tempfile::tempdir().unwrap();
    let path: PathBuf = folder.path().join("02.BIN");
    fs::copy(fixture("ladder-still.trimmed.BIN"), &path).unwrap();
    // Flown from the show's origin, the home of slot 1; record and name say 2.
    let logs = [LogInput { slot: Some(2), path, ..LogInput::default() }];
    let flight = flown(Some(&plan(Purpose::Calibration, ladder(1.0), 2)), &logs);
    assert_eq!(flight.drones[0].slot, Some(1));
    let told: Vec<String> =
        flight.warnings.iter().map(ToString::to_string).filter(|w| w.contains("02.BIN")).collect();
    assert_eq!(told.len(), 1, "{told:?}");
    let words = "home position contradicts flight record and file name; home position counts";
    assert!(told[0].contains(words) && told[0].ends_with("is slot 1, not 2"), "{told:?}");
}

fn joined(warnings: &[Warning]) -> String {
    warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
