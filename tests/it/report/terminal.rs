//! What the terminal says, as people see it.

use crate::report::synthetic::{campaign, provenance, updraft_series};
use updraft::analysis::Warning;
use updraft::analysis::result::{Analysis, FlightAnalysis, HeldCurve};
use updraft::base::estimate::Estimate;
use updraft::report::{render, terminal_summary};

#[test]
fn campaign_at_usual_width() {
    let mut analysis = campaign();
    // A few drones are enough to see the table.
    analysis.flights[0].drones.retain(|drone| matches!(drone.slot, Some(1 | 2 | 12 | 23 | 30)));
    insta::assert_snapshot!(terminal_summary(&analysis, 120, false));
}

#[test]
fn campaign_in_a_narrow_terminal() {
    let mut analysis = campaign();
    analysis.flights[0].drones.retain(|drone| matches!(drone.slot, Some(1 | 12 | 23)));
    analysis.flights[1].drones.truncate(3);
    insta::assert_snapshot!(terminal_summary(&analysis, 64, false));
}

#[test]
fn no_line_is_wider_than_the_terminal() {
    for analysis in [campaign(), updraft_series()] {
        for width in [40, 64, 80, 100, 140, 220] {
            for line in terminal_summary(&analysis, width, false).lines() {
                assert!(line.chars().count() <= width, "{width}: {line}");
            }
        }
    }
}

#[test]
fn colour_only_adds_escapes() {
    let plain = terminal_summary(&campaign(), 120, false);
    let coloured = terminal_summary(&campaign(), 120, true);
    assert!(!plain.contains('\u{1b}') && coloured.contains('\u{1b}'));
    let mut stripped = String::new();
    let mut rest = coloured.as_str();
    while let Some(at) = rest.find('\u{1b}') {
        stripped.push_str(&rest[..at]);
        rest = &rest[at..];
        rest = &rest[rest.find('m').unwrap() + 1..];
    }
    stripped.push_str(rest);
    // Trailing blanks inside colour are invisible.
    let trimmed = |text: &str| text.lines().map(str::trim_end).collect::<Vec<_>>().join("\n");
    assert_eq!(trimmed(&stripped), trimmed(&plain));
}

#[test]
fn warnings_are_printed_in_full() {
    let mut analysis = campaign();
    let long = |what: &str| {
        format!("{what} {} {}", "word ".repeat(60), "/a/path/without/a/blank".repeat(12))
    };
    analysis.warnings = (0..30).map(|i| Warning::Said(long(&format!("warning{i}")))).collect();
    analysis.flights[0].warnings = vec![Warning::Said(long("caution"))];
    analysis.flights[1].drones[0].warnings = vec![Warning::Said(long("note"))];
    for width in [60, 100] {
        let text = terminal_summary(&analysis, width, false);
        let joined: String = text.split_whitespace().collect();
        let warnings = analysis.warnings.iter().map(ToString::to_string);
        for wanted in warnings.chain([long("caution"), long("note")]) {
            let wanted: String = wanted.split_whitespace().collect();
            assert!(joined.contains(&wanted), "{width}: {wanted:.20} is cut");
        }
    }
}

#[test]
fn drones_without_a_result_are_counted_and_equal_reasons_told_once() {
    let text = terminal_summary(&campaign(), 120, false);
    // Six without a log, of which four for the same reason, and one whose hover was rejected.
    assert!(text.contains("Drones without a result (7)\n  - slots 3, 7, 18, 33: no log"), "{text}");
    let page = render(&campaign(), &provenance()).unwrap().html;
    assert!(page.contains("Drones without a result (7)"));
}

#[test]
fn nothing_found_is_said_plainly() {
    let said = |change: fn(&mut FlightAnalysis), flight: usize| {
        let mut analysis = campaign();
        change(&mut analysis.flights[flight]);
        analysis.flights = vec![analysis.flights.swap_remove(flight)];
        let text = terminal_summary(&analysis, 200, false);
        let page = render(&analysis, &provenance()).unwrap();
        let sentence = text.lines().find(|line| line.trim().starts_with("No ")).unwrap().trim();
        let (start, _) = sentence.split_once(':').unwrap();
        assert!(page.html.contains(start), "the page lacks {start:?}");
        assert!(page.figures.iter().all(|(name, _)| name.starts_with("fig")), "no empty map");
        start.to_owned()
    };
    let no_laws = |flight: &mut FlightAnalysis| {
        flight.flock = None;
        flight.table.clear();
        flight.drones.iter_mut().for_each(|drone| drone.laws = None);
    };
    assert_eq!(said(no_laws, 0), "No calibration");
    let no_ladder = |flight: &mut FlightAnalysis| {
        flight.flock = None;
        flight.table.clear();
        for drone in &mut flight.drones {
            drone.laws = None;
            drone.windows.retain(|window| window.kind.is_hover());
        }
    };
    assert_eq!(said(no_ladder, 0), "No ladder found");
    assert_eq!(said(|flight| flight.map = None, 1), "No ladder and no hover found");
}

#[test]
fn a_w_at_its_bound_is_no_number() {
    let mut analysis = campaign();
    let flight = &mut analysis.flights[0];
    let laws = flight.drones.iter_mut().filter_map(|drone| drone.laws.as_mut());
    for laws in laws.chain(flight.flock.as_mut()) {
        let fit = laws.signed_quadratic.as_mut().unwrap();
        fit.parameters[2].estimate.value = -7.987;
        fit.w_beyond_mps = Some(-8.0);
    }
    let text = terminal_summary(&analysis, 200, false);
    let page = render(&analysis, &provenance()).unwrap().html;
    for said in [&text, &page] {
        assert!(said.contains("below −8"), "{said}");
        assert!(!said.contains("7.987"), "{said}");
    }
    assert!(text.contains("A and u₀ not determined"), "{text}");
}

#[test]
fn a_w_whose_error_reaches_the_bound_is_no_number() {
    let mut analysis = campaign();
    let flight = &mut analysis.flights[0];
    let laws = flight.drones.iter_mut().filter_map(|drone| drone.laws.as_mut());
    for laws in laws.chain(flight.flock.as_mut()) {
        let fit = laws.signed_quadratic.as_mut().unwrap();
        fit.parameters[2].estimate = Estimate::new(-6.321, 1.9);
        fit.w_beyond_mps = Some(-8.0);
    }
    let text = terminal_summary(&analysis, 200, false);
    let page = render(&analysis, &provenance()).unwrap().html;
    for said in [&text, &page] {
        assert!(said.contains("not determined") && !said.contains("6.3 ± 1.9"), "{said}");
        assert!(!said.contains("below −8"), "it ended within: {said}");
    }
    assert!(text.contains("W*, A and u₀ not determined: the error of W*"), "{text}");
}

#[test]
fn laws_of_another_vehicle_tell_no_updraft() {
    let mut analysis = campaign();
    let flight = &mut analysis.flights[0];
    let held = serde_json::json!({
        "updraft": null, "legs": 14, "beyond": 14, "speeds_mps": [-3.5, 3.5],
        "doubt": "W is not determined: this seems to be the calibration of another vehicle",
    });
    let told = |analysis: &Analysis| terminal_summary(analysis, 200, false);
    let set = |flight: &mut FlightAnalysis, is_other: bool| {
        let laws = flight.drones.iter_mut().filter_map(|drone| drone.laws.as_mut());
        for laws in laws.chain(flight.flock.as_mut()) {
            let mut fit = laws.signed_quadratic.clone().unwrap();
            fit.parameters[2].estimate = Estimate::new(1.7161, 0.0692);
            laws.signed_quadratic_held = Some(fit);
            let mut curve: HeldCurve = serde_json::from_value(held.clone()).unwrap();
            curve.is_other_vehicle = is_other;
            laws.held = Some(curve);
        }
    };
    set(flight, false);
    assert!(told(&analysis).contains("1.716 ± 0.069"));
    set(&mut analysis.flights[0], true);
    let text = told(&analysis);
    assert!(!text.contains("1.716") && text.contains("another vehicle"), "{text}");
}

#[test]
fn the_better_law_is_the_headline() {
    let tile = |analysis: &Analysis, label: &str| {
        render(analysis, &provenance()).unwrap().html.contains(&format!("\"label\">{label}"))
    };
    let mut analysis = campaign();
    assert!(tile(&analysis, "A, quadratic law") && !tile(&analysis, "A′, linear law"));
    let text = terminal_summary(&analysis, 100, false);
    assert!(text.contains("The signed-quadratic law fits better"), "{text}");
    assert!(text.contains("Table I (simulation)") && text.contains("Fig. 3d"), "{text}");
    for drone in &mut analysis.flights[0].drones {
        drone.laws.as_mut().unwrap().linear.as_mut().unwrap().chi2_reduced = Some(0.5);
    }
    let flock = analysis.flights[0].flock.as_mut().unwrap();
    flock.linear.as_mut().unwrap().chi2_reduced = Some(0.5);
    assert!(!tile(&analysis, "A, quadratic law") && tile(&analysis, "A′, linear law"));
    assert!(terminal_summary(&analysis, 100, false).contains("The linear law fits better"));
}
