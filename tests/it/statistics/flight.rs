//! From logs to the statistics of a measurement: air of known scales flown by a small fleet.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::fs;
use std::path::Path;

use crate::analysis::support::{Synthetic, Timetable, ladder_up, ladder_up_segments, plan};
use updraft::analysis::result::{Analysis, FlightAnalysis};
use updraft::analysis::statistics::{FieldScales, Simulator};
use updraft::analysis::{AnalysisOptions, FlightInput, LogInput, analyze};
use updraft::base::rng::{Purpose as Stream, stream};
use updraft::mission::plan::{Plan, Purpose, SegmentKind};
use updraft::report::terminal_summary;

const SLOPE: f64 = 25.0;
const HOVER_S: usize = 240;

fn input<'a>(name: &'a str, plan: &'a Plan, logs: &'a [LogInput]) -> FlightInput<'a> {
    FlightInput {
        name,
        plan: Some(plan),
        purpose: Some(plan.purpose),
        logs,
        ..FlightInput::default()
    }
}

fn log(path: &Path, drone: u8, length_s: f64, up: fn(f64) -> f64, air_mps: Vec<f64>) -> LogInput {
    let pulse_us = Box::new(move |time: f64| {
        let air = air_mps.get(time as usize).copied().unwrap_or(0.0);
        1546.0 + SLOPE * (up(time) - air)
    });
    let log = Synthetic { system_id: drone, duration_s: length_s, velocity_up_mps: up, pulse_us };
    fs::write(path, log.write()).unwrap();
    LogInput { slot: Some(u16::from(drone)), path: path.to_owned(), ..LogInput::default() }
}

/// Calibration in still air, then a hover of drones in a grid.
fn flown(drones: u8) -> Analysis {
    let folder = tempfile::tempdir().unwrap();
    let mut ladder = plan(Purpose::Calibration, ladder_up_segments(), u16::from(drones));
    let table = Timetable::default().add(SegmentKind::Hover, "hover", 0.0, HOVER_S as f64);
    let mut hover = plan(Purpose::Measurement, table.segments, u16::from(drones));
    for plan in [&mut ladder, &mut hover] {
        for (index, slot) in plan.slots.iter_mut().enumerate() {
            slot.home_m = [7.0 * (index / 3) as f64, 7.0 * (index % 3) as f64, 0.0];
        }
    }
    let places: Vec<[f64; 2]> =
        hover.slots.iter().map(|slot| [slot.home_m[0], slot.home_m[1]]).collect();
    let scales = FieldScales { sd_mps: 1.0, length_m: [60.0; 2], tau_s: 20.0, noise_mps: 0.0 };
    let air = Simulator::new(&places, scales, HOVER_S, 1).unwrap();
    // Of a hundred such draws 94 give an interval for tau that holds the truth; this is one of them.
    let air = air.flight(&mut stream(5, 0, Stream::Air));
    let path = |name: &str, drone: u8| folder.path().join(format!("{name}-{drone}.BIN"));
    let still = |drone: u8| log(&path("ladder", drone), drone, 265.0, ladder_up, Vec::new());
    let moving = |drone: u8| {
        let column = air.column(usize::from(drone) - 1).iter().copied().collect();
        log(&path("hover", drone), drone, HOVER_S as f64, |_| 0.0, column)
    };
    let ladders: Vec<LogInput> = (1..=drones).map(still).collect();
    let hovers: Vec<LogInput> = (1..=drones).map(moving).collect();
    let inputs = [input("calibration", &ladder, &ladders), input("hover", &hover, &hovers)];
    analyze("x", &inputs, &AnalysisOptions::default(), None, &|_, _| {}).unwrap()
}

fn hover(analysis: &Analysis) -> &FlightAnalysis {
    analysis.flights.iter().find(|flight| flight.purpose == Purpose::Measurement).unwrap()
}

#[test]
fn a_fleet_has_statistics_with_intervals() {
    let mut analysis = flown(9);
    let calibration = analysis.flights.first().unwrap();
    assert!(calibration.statistics.is_none(), "a calibration has no map");
    let found = hover(&analysis).statistics.as_ref().unwrap();
    assert_eq!((found.record.drones, found.record.running_mean_s), (9, 10.0));
    assert!((found.record.spacing_m - 7.0).abs() < 1e-9);
    let space = found.space.as_ref().unwrap();
    assert_eq!(space.all.classes.iter().map(|class| class.correlations.len()).sum::<usize>(), 36);
    let model = found.likelihood.as_ref().unwrap();
    let interval = model.tau_s.interval_95.unwrap();
    assert!(interval.low < 20.0 && 20.0 < interval.high, "{:?}", model.tau_s);
    assert_eq!(found.simulated.as_ref().unwrap().flights, 200);

    // One-second values, not the running means: a second's average is no better than its air.
    let averaging = found.averaging.as_ref().unwrap();
    assert_eq!((averaging.averaging_s[0], averaging.smoothed_below_s), (1.0, 0.0));
    let expected = (1.0_f64 - (-1.0_f64 / 20.0).exp()).sqrt();
    assert!((averaging.median_mps[0] / expected - 1.0).abs() < 0.25, "{}", averaging.median_mps[0]);

    let wind = found.wind.as_ref().unwrap();
    assert_eq!((wind.speed_mps, wind.lean_deg), (None, 0.0));

    // Where a posterior tells the scales of the air, they stand alone.
    for flight in &mut analysis.flights {
        if let Some(map) = &mut flight.map {
            map.posterior = None;
        }
    }
    let text = terminal_summary(&analysis, 200, false);
    for words in ["correlation length λ", "zero crossing t₀", "λ along x"] {
        let line = text.lines().find(|line| line.contains(words)).unwrap_or_default();
        assert!(line.contains("95 %") && line.contains("paper"), "{words}: {line}");
    }
}

#[test]
fn two_drones_are_told_why_not() {
    let analysis = flown(2);
    let found = hover(&analysis).statistics.as_ref().unwrap();
    assert!(found.space.is_none() && found.averaging.is_some() && found.wind.is_some());
    let text = terminal_summary(&analysis, 200, false);
    assert!(text.contains("no correlations: 2 drones"), "{text}");
}
