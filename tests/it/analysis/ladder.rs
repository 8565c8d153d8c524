//! From logs to laws and maps: the two ladders of the real firmware with the laws known from its
//! plants, and a synthetic fleet with a known air.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};

use crate::analysis::support::{
    Synthetic, Timetable, fixture, ladder, ladder_up, ladder_up_segments, plan,
};
use updraft::analysis::calibrate::{FitOptions, Location, Weights};
use updraft::analysis::law::Symbol;
use updraft::analysis::result::{
    Analysis, Fit, FlightAnalysis, Quality, Rejection, WindowStats, Yield,
};
use updraft::analysis::table::{Quantity, TableLaw};
use updraft::analysis::windows::{Tilt, WindowOptions};
use updraft::analysis::{
    AnalysisError, AnalysisOptions, FlightInput, LawKind, LogInput, OffsetRule, Warning, analyze,
    analyze_flight,
};
use updraft::mission::plan::{Plan, Purpose, SegmentKind};

fn input<'a>(name: &'a str, plan: Option<&'a Plan>, logs: &'a [LogInput]) -> FlightInput<'a> {
    FlightInput { name, plan, logs, ..FlightInput::default() }
}

fn logs(paths: &[PathBuf]) -> Vec<LogInput> {
    paths
        .iter()
        .map(|path| LogInput { slot: None, path: path.clone(), ..LogInput::default() })
        .collect()
}

fn run(plan: Option<&Plan>, paths: &[PathBuf], options: &AnalysisOptions) -> FlightAnalysis {
    analyze_flight(&input("flight", plan, &logs(paths)), options, None, &|_, _| {}).unwrap()
}

/// The firmware's simulator has still air: there is no slow air to subtract.
fn still() -> AnalysisOptions {
    AnalysisOptions { offset: OffsetRule::Never, ..AnalysisOptions::default() }
}

fn paper() -> AnalysisOptions {
    let fit = FitOptions {
        location: Location::Median,
        weights: Weights::WindowSd,
        ..FitOptions::default()
    };
    AnalysisOptions { fit, ..still() }
}

fn values(fit: &Fit) -> Vec<f64> {
    fit.parameters.iter().map(|parameter| parameter.estimate.value).collect()
}

fn legs(windows: &[WindowStats]) -> Vec<&WindowStats> {
    windows.iter().filter(|window| window.kind.is_leg()).collect()
}

/// With the plan, and without any.
fn both_ways() -> [Option<Plan>; 2] {
    [Some(plan(Purpose::Calibration, ladder(1.0), 1)), None]
}

#[test]
fn the_still_air_ladder_has_the_law_of_its_plant() {
    for plan in both_ways() {
        let paths = [fixture("ladder-still.trimmed.BIN")];
        let flight = run(plan.as_ref(), &paths, &still());
        assert_eq!(flight.purpose, Purpose::Calibration);
        let windows = &flight.drones[0].windows;
        assert_eq!((windows.len(), legs(windows).len()), (29, 14), "planned: {}", flight.planned);
        assert!(windows.iter().all(|window| window.rejected.is_empty()));
        // Quoted from an independent reading of the plant; 0.036 us per metre is air density.
        let mut squares = 0.0;
        for window in legs(windows) {
            let v = window.velocity_mps.mean;
            let law = 1591.04 + 7.05 * v + 0.281 * v * v + 1.237 * v * v.abs();
            let residual = window.effort_phi.mean - 0.036 * (window.height_m - 20.0) - law;
            squares += residual * residual;
        }
        let rms = (squares / 14.0).sqrt();
        println!("planned {}: rms {rms:.3} us around the plant's law", flight.planned);
        assert!(rms < 0.1, "{rms}");
        let ground: Vec<f64> = windows
            .iter()
            .filter(|window| window.kind.is_hover() && window.height_m < 21.0)
            .map(|window| window.effort_phi.median)
            .collect();
        assert_eq!(ground.len(), 8);
        assert!(ground.iter().all(|pulse| (pulse - 1591.0).abs() < 0.1), "{ground:?}");
        let laws = flight.drones[0].laws.as_ref().unwrap();
        let (line, square) =
            (laws.linear.as_ref().unwrap(), laws.signed_quadratic.as_ref().unwrap());
        assert!(line.chi2_reduced.unwrap() < square.chi2_reduced.unwrap(), "mostly linear");
        assert!(
            square
                .warnings
                .iter()
                .any(|warning| warning.to_string().contains("beyond the searched"))
        );
    }
}

#[test]
fn the_square_law_ladder_has_the_law_of_its_plant() {
    for plan in both_ways() {
        let paths = [fixture("square-law-ladder.trimmed.BIN")];
        let flight = run(plan.as_ref(), &paths, &paper());
        let laws = flight.drones[0].laws.as_ref().unwrap();
        let fit = laws.signed_quadratic.as_ref().unwrap();
        let [a, u0, w] = values(fit)[..] else { panic!("three parameters") };
        println!("planned {}: A {a:.4} u0 {u0:.3} W {w:.4} rms {:.3}", flight.planned, fit.rms_us);
        assert!((a - 4.963).abs() < 0.002, "{a}");
        assert!((u0 - 1462.43).abs() < 0.05, "{u0}");
        assert!((w + 0.044).abs() < 0.003, "{w}");
        assert!((fit.rms_us - 0.12).abs() < 0.02, "{}", fit.rms_us);
        assert!(fit.other_minima.is_empty() && fit.warnings.is_empty(), "{fit:?}");
        assert!(fit.chi2_reduced.unwrap() < laws.linear.as_ref().unwrap().chi2_reduced.unwrap());
    }
}

#[test]
fn the_offset_takes_out_what_height_does() {
    let paths = [fixture("square-law-ladder.trimmed.BIN")];
    let with = AnalysisOptions { offset: OffsetRule::Always, ..paper() };
    let flight = run(None, &paths, &with);
    let drone = &flight.drones[0];
    // Thinner air above asks for more pulse, which an even term, W, imitates where it is left in.
    let fit = drone.laws.as_ref().unwrap().signed_quadratic.as_ref().unwrap();
    let [a, _, w] = values(fit)[..] else { panic!("three parameters") };
    assert!((a - 4.9053).abs() < 0.002 && (w + 0.0097).abs() < 0.003, "{a} {w}");
    let offset = drone.offset.as_ref().unwrap();
    assert_eq!(offset.points.len(), 15);
    assert!((offset.points.iter().map(|point| point.offset_us).sum::<f64>()).abs() < 1e-6);
    let legs = legs(&drone.windows);
    let outside: Vec<bool> = legs.iter().map(|leg| leg.offset_outside).collect();
    assert!(outside[0] && !outside[1..].contains(&true), "only the first climb is outside");
}

#[test]
fn a_reference_calibration_holds_a_and_u0() {
    let paths = [fixture("square-law-ladder.trimmed.BIN")];
    let logs = logs(&paths);
    let own = run(None, &paths, &paper());
    let again =
        analyze_flight(&input("again", None, &logs), &paper(), Some(&own), &|_, _| {}).unwrap();
    let laws = again.drones[0].laws.as_ref().unwrap();
    let (free, held) =
        (laws.signed_quadratic.as_ref().unwrap(), laws.signed_quadratic_held.as_ref().unwrap());
    assert_eq!(values(held)[..2], values(free)[..2]);
    assert!((values(held)[2] - values(free)[2]).abs() < 1e-5, "the same data give the same W");
    assert!(held.parameters[2].estimate.se < free.parameters[2].estimate.se);
    assert!(again.table.iter().any(|row| row.law == TableLaw::SignedQuadraticHeld
        && row.parameter == Quantity::Parameter(Symbol::W)));
}

#[test]
fn the_calibrations_own_curve_is_held_whatever_its_law() {
    // The firmware flown in its own simulator, whose rotors are neither of the paper's laws.
    let still_paths = [fixture("ladder-still.trimmed.BIN")];
    let still = run(None, &still_paths, &AnalysisOptions::default());
    let held = |path: &str, reference: &FlightAnalysis, options: &AnalysisOptions| {
        let logs = logs(&[fixture(path)]);
        let input = input("again", None, &logs);
        analyze_flight(&input, options, Some(reference), &|_, _| {}).unwrap()
    };
    let options = AnalysisOptions::default();
    let flight = held("ladder-updraft.trimmed.BIN", &still, &options);
    let laws = flight.drones[0].laws.as_ref().unwrap();
    let curve = laws.held.as_ref().unwrap();
    let (w, [low, high]) = (curve.updraft.unwrap(), curve.interval_mps.unwrap());
    assert!((w.value - 1.0).abs() < 0.03 && low < 1.0 && 1.0 < high, "{curve:?}");
    assert!(high - low < 0.1 && w.se > 0.003, "{curve:?}");
    assert_eq!(curve.beyond, 2, "the two fastest descents go beyond the calibration");
    assert!(curve.doubt.as_ref().unwrap().contains("2 of 14 legs"), "{curve:?}");
    // What the signed quadratic says of it: half, with a small error.
    let square = laws.signed_quadratic_held.as_ref().unwrap().value(Symbol::W).unwrap();
    assert!((square - 0.54).abs() < 0.02, "{square}");
    let row = flight.table.iter().find(|row| row.law == TableLaw::CurveHeld).unwrap();
    assert_eq!((row.mean, row.n), (w.value, 1));
    // The other way round, and against itself.
    let back = held("ladder-still.trimmed.BIN", &flight, &options);
    let w = back.flock.unwrap().held.unwrap().updraft.unwrap();
    assert!((w.value + 1.0).abs() < 0.03, "{w}");
    let same = held("ladder-still.trimmed.BIN", &still, &options);
    let w = same.flock.unwrap().held.unwrap().updraft.unwrap();
    assert!(w.value.abs() < 1e-3, "{w}");
    let plain = AnalysisOptions { plain: true, ..AnalysisOptions::default() };
    let plain = held("ladder-updraft.trimmed.BIN", &still, &plain);
    assert!(plain.flock.unwrap().held.is_none() && plain.headline.is_none());
}

#[test]
fn the_law_that_the_windows_prefer_is_the_headline() {
    let of = |name: &str| run(None, &[fixture(name)], &AnalysisOptions::default());
    let bent = of("ladder-still.trimmed.BIN");
    let headline = bent.headline.as_ref().unwrap();
    let line = headline.line.unwrap();
    assert_eq!(headline.law, LawKind::Linear);
    assert!(line.is_bent(), "{line:?}");
    // Of the windows around hover: 1595.19 us at +0.5 and 1587.41 us at -0.5 m/s, less 0.15 us by 4.5 m of height.
    assert!((line.slope.value - 7.6).abs() < 0.6, "{line:?}");
    assert!(line.slope_at(3.5) > 15.0 && line.slope_at(-3.5) > 10.0, "{line:?}");
    assert!(bent.drones[0].line.is_some());
    let square = of("square-law-ladder.trimmed.BIN");
    assert_eq!(square.headline.unwrap().law, LawKind::SignedQuadratic);
    assert!(square.drones[0].line.is_none());
}

#[test]
fn a_log_cut_in_flight_keeps_its_whole_windows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("1.BIN");
    let bytes = fs::read(fixture("square-law-ladder.trimmed.BIN")).unwrap();
    fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let plan = plan(Purpose::Calibration, ladder(1.0), 1);
    let flight = run(Some(&plan), &[path], &paper());
    let windows = &flight.drones[0].windows;
    assert_eq!(windows.len(), 29);
    let lost: Vec<&WindowStats> =
        windows.iter().filter(|w| w.rejected.contains(&Rejection::Incomplete)).collect();
    assert!((10..20).contains(&lost.len()), "{} windows lost", lost.len());
    assert!(lost.iter().all(|window| window.start_s > 150.0));
    let fit = flight.drones[0].laws.as_ref().unwrap().signed_quadratic.clone().unwrap();
    assert!((values(&fit)[0] - 4.963).abs() < 0.2, "{:?}", values(&fit));
}

#[test]
fn a_fleet_is_matched_and_what_is_lost_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let square = fixture("square-law-ladder.trimmed.BIN");
    // All logs carry a system id of 1 or 2, so only the file names tell four drones apart.
    let bytes = fs::read(&square).unwrap();
    for (cut, name) in ["drone-01.BIN", "drone-02.BIN", "drone-04.BIN"].iter().enumerate() {
        // The same flight, but not the same bytes.
        fs::write(place(name), &bytes[..bytes.len() - cut]).unwrap();
    }
    fs::write(place("drone-03.BIN"), b"").unwrap();
    let mut plan = plan(Purpose::Calibration, ladder(1.0), 5);
    // All stood on one place: only a plan without an origin does not mind.
    (plan.site.origin_lat_deg, plan.site.origin_lon_deg) = (0.0, 0.0);
    let paths: Vec<PathBuf> =
        (1..=4).rev().map(|number| place(&format!("drone-0{number}.BIN"))).collect();
    let flight = run(Some(&plan), &paths, &paper());
    let slots: Vec<Option<u16>> = flight.drones.iter().map(|drone| drone.slot).collect();
    assert_eq!(slots, [Some(1), Some(2), Some(4)]);
    assert_eq!(flight.drones[1].home_m, Some([7.0, 0.0]));
    let missing: Vec<(u16, bool)> = flight
        .missing
        .iter()
        .map(|missing| (missing.slot, missing.reason.to_string().contains("empty")))
        .collect();
    assert_eq!(missing, [(3, true), (5, false)], "{:?}", flight.missing);
    assert_eq!(flight.missing[1].reason.to_string(), "no log of Drone 5");

    let flock = flight.flock.as_ref().unwrap().signed_quadratic.as_ref().unwrap();
    assert!((values(flock)[0] - 4.963).abs() < 0.002, "the average of equals is one of them");
    let row =
        flight.table.iter().find(|row| row.parameter == Quantity::Parameter(Symbol::A)).unwrap();
    assert_eq!((row.n, row.sd), (3, 0.0));
    assert_eq!(row.paper.map(|paper| paper.value), Some(10.5), "a field flight beside Table II");

    // The same bytes with any number of threads.
    let json = serde_json::to_string(&flight).unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(
        json,
        serde_json::to_string(&one.install(|| run(Some(&plan), &paths, &paper()))).unwrap()
    );
}

#[test]
fn a_log_of_another_plan_is_refused_by_name() {
    let wrong = plan(Purpose::Calibration, ladder(-1.0), 1);
    let logs = logs(&[fixture("ladder-still.trimmed.BIN")]);
    let error =
        analyze_flight(&input("calibration", Some(&wrong), &logs), &still(), None, &|_, _| {})
            .map(|flight| flight.drones.len())
            .unwrap_err()
            .to_string();
    for part in ["does not belong to the plan", "14 of 14 legs", "`up 0.5 m/s`", "planned -0.5"] {
        assert!(error.contains(part), "{error}");
    }
}

#[test]
fn a_flight_that_runs_early_is_told_by_how_much() {
    for (shift_ms, said) in [(4_000, " s earlier than the plan"), (0, "")] {
        let mut segments = ladder(1.0);
        for segment in segments.iter_mut().skip(1) {
            segment.start_ms += shift_ms;
            segment.end_ms += shift_ms;
            if let Some(window) = &mut segment.window {
                window.start_ms += shift_ms;
                window.end_ms += shift_ms;
            }
        }
        let late = plan(Purpose::Calibration, segments, 1);
        let logs = logs(&[fixture("ladder-still.trimmed.BIN")]);
        let flight =
            analyze_flight(&input("calibration", Some(&late), &logs), &still(), None, &|_, _| {});
        match flight {
            Ok(_) => assert_eq!(shift_ms, 0),
            Err(error) => {
                let text = error.to_string();
                assert!(!said.is_empty() && text.contains(said), "{text}");
                // The log has a command every 0.1 s.
                let told = text.split("seems to run ").nth(1).and_then(|rest| rest.get(..3));
                let told: f64 = told.unwrap().parse().unwrap();
                assert!((told - 4.0).abs() < 0.15, "{text}");
                assert!(text.contains("--set takeoff.speed_mps=2"), "{text}");
            }
        }
    }
}

#[test]
fn impossible_inputs_say_what_to_do() {
    let options = still();
    let none = analyze_flight(&input("hover", None, &[]), &options, None, &|_, _| {});
    assert!(none.unwrap_err().to_string().contains("no logs to analyse"));
    let nothing = logs(&[PathBuf::from("nowhere/1.BIN")]);
    let error = analyze_flight(&input("hover", None, &nothing), &options, None, &|_, _| {});
    let text = error.unwrap_err().to_string();
    assert!(text.contains("none of the 1 log(s)") && text.contains("nowhere"), "{text}");
    let empty = analyze("x", &[], &options, None, &|_, _| {});
    assert!(matches!(empty, Err(AnalysisError::NoFlights)));
}

/// Rotors that answer a climb with 26.4 us per m/s, in air that rises as `air` says.
fn drone(system_id: u8, duration_s: f64, up: fn(f64) -> f64, air: fn(f64) -> f64) -> Vec<u8> {
    let u0 = 1546.5 + f64::from(system_id);
    let pulse_us = Box::new(move |time: f64| u0 + 26.4 * (up(time) - air(time)));
    Synthetic { system_id, duration_s, velocity_up_mps: up, pulse_us }.write()
}

fn wave(time: f64) -> f64 {
    0.3 + 0.6 * (time / 120.0 * TAU).sin()
}

fn synthetic_campaign(folder: &Path) -> [Vec<LogInput>; 2] {
    let mut campaign = [Vec::new(), Vec::new()];
    for id in 1..=2 {
        let path = folder.join(format!("cal-{id}.BIN"));
        fs::write(&path, drone(id, 265.0, ladder_up, |_| 0.0)).unwrap();
        campaign[0].push(LogInput { slot: None, path, ..LogInput::default() });
    }
    for id in 1..=3 {
        let path = folder.join(format!("hover-{id}.BIN"));
        fs::write(&path, drone(id, 264.0, |_| 0.0, wave)).unwrap();
        campaign[1].push(LogInput { slot: None, path, ..LogInput::default() });
    }
    campaign
}

fn synthetic_plans() -> [Plan; 2] {
    let hover = Timetable::default().add(SegmentKind::Hover, "hover", 0.0, 264.0).segments;
    [plan(Purpose::Calibration, ladder_up_segments(), 3), plan(Purpose::Measurement, hover, 3)]
}

#[test]
fn a_campaign_measures_the_air_it_flew_in() {
    let folder = tempfile::tempdir().unwrap();
    let [calibration, hover] = synthetic_campaign(folder.path());
    let [ladder, scan] = synthetic_plans();
    for planned in [true, false] {
        // The hover comes first: order must not matter.
        let mut inputs = [
            input("hover", planned.then_some(&scan), &hover),
            input("calibration", planned.then_some(&ladder), &calibration),
        ];
        inputs[0].purpose = Some(Purpose::Measurement);
        inputs[0].folder = Some(folder.path());
        let done = std::sync::atomic::AtomicUsize::new(0);
        let count = |_: usize, total: usize| {
            assert_eq!(total, 5);
            done.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        };
        let analysis = analyze("campaign", &inputs, &still(), None, &count).unwrap();
        assert_eq!(done.into_inner(), 5);
        let [calibration, hover] = &analysis.flights[..] else { panic!("two flights") };
        assert_eq!((calibration.name.as_str(), hover.name.as_str()), ("calibration", "hover"));
        let line = calibration.drones[1].laws.as_ref().unwrap().linear.as_ref().unwrap();
        assert!((values(line)[0] - 26.4).abs() < 0.05, "{:?}", values(line));
        assert_eq!(hover.drones[0].source, "hover-1.BIN");

        let map = hover.map.as_ref().unwrap();
        assert_eq!(map.law, LawKind::Linear);
        let mapping: Vec<&str> = map.drones.iter().map(|drone| drone.mapping.name()).collect();
        // Without a plan a hover log is not known to be the same drone as a ladder log.
        let expected = if planned { ["own", "own", "flock"] } else { ["flock", "flock", "flock"] };
        assert_eq!(mapping, expected);
        for drone in &map.drones {
            // Own hover pulses are 1 us apart; the flock's is in the middle of drones 1 and 2.
            let bias = match (drone.mapping.name(), drone.name.chars().last()) {
                ("flock", Some('1')) => 0.5 / 26.4,
                ("flock", Some('2')) => -0.5 / 26.4,
                ("flock", Some('3')) => -1.5 / 26.4,
                _ => 0.0,
            };
            let mut worst: f64 = 0.0;
            for (time, value) in map.time_s.iter().zip(&drone.updraft_mps) {
                // A centred 10 s mean damps a wave of 120 s by sinc(pi/12) = 0.9886.
                let truth = 0.3 + 0.9886 * (wave(*time) - 0.3);
                worst = worst.max((value.unwrap() - truth - bias).abs());
            }
            assert!(worst < 0.03, "{} {}: {worst}", drone.name, drone.mapping.name());
            assert!(drone.mean.se > 0.0 && drone.mean.se < 0.3, "{}", drone.mean);
        }
        assert_eq!(map.time_s.windows(2).filter(|pair| pair[1] - pair[0] != 1.0).count(), 0);
    }
}

#[test]
fn a_measurement_without_laws_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let [_, hover] = synthetic_campaign(folder.path());
    let [_, scan] = synthetic_plans();
    let options = AnalysisOptions { map_law: Some(LawKind::Linear), ..still() };
    let flight =
        analyze_flight(&input("hover", Some(&scan), &hover), &options, None, &|_, _| {}).unwrap();
    assert!(flight.map.is_none());
    assert!(flight.warnings.iter().any(|w| w.to_string().contains("no calibration was given")));
    assert!(flight.drones.iter().all(|drone| drone.laws.is_none()));
}

#[test]
fn flights_that_cannot_calibrate_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let warning = |name: &str, up: fn(f64) -> f64, pulse: Box<dyn Fn(f64) -> f64>| {
        let path = folder.path().join(name);
        let log =
            Synthetic { system_id: 1, duration_s: 265.0, velocity_up_mps: up, pulse_us: pulse };
        fs::write(&path, log.write()).unwrap();
        let logs = logs(&[path]);
        let mut input = input("calibration", None, &logs);
        input.purpose = Some(Purpose::Calibration);
        let flight = analyze_flight(&input, &still(), None, &|_, _| {}).unwrap();
        assert!(flight.drones[0].laws.is_none());
        assert_eq!(flight.unmeasured.len(), 1, "listed once");
        flight.unmeasured[0].reason.to_string()
    };
    let none = warning("hover.BIN", |_| 0.0, Box::new(|_| 1550.0));
    assert!(none.contains("no ladder"), "{none}");
    let one = warning(
        "one.BIN",
        |time| if (20.0..40.0).contains(&time) { 2.0 } else { 0.0 },
        Box::new(|_| 1550.0),
    );
    assert!(one.contains("only one vertical speed (2 m/s) in 1"), "{one}");
    let constant = warning("constant.BIN", ladder_up, Box::new(|_| 1550.0));
    assert!(constant.contains("1550 us in all windows"), "{constant}");
    let saturated = warning(
        "saturated.BIN",
        ladder_up,
        Box::new(|time| if ladder_up(time) > 0.0 { 1950.0 } else { 1150.0 }),
    );
    assert!(saturated.contains("no ladder") && saturated.contains("8 rejected"), "{saturated}");
}

/// The whole logs of the firmware's flights, where a checkout has them beside it.
#[test]
fn whole_logs_agree_with_the_fixtures() {
    let Ok(folder) = std::env::var("UPDRAFT_SHARED_DATA") else { return };
    let log = |name: &str| [Path::new(&folder).join("arducopter-4.4").join(name)];
    for plan in both_ways() {
        let flight = run(plan.as_ref(), &log("square-law-ladder-still.BIN"), &paper());
        let fit = flight.drones[0].laws.as_ref().unwrap().signed_quadratic.clone().unwrap();
        let found = values(&fit);
        println!("planned {}: {found:?} rms {:.3}", flight.planned, fit.rms_us);
        assert!((found[0] - 4.963).abs() < 0.002 && (found[2] + 0.044).abs() < 0.003);

        let windows = WindowOptions { tilt: Tilt::Paper, ..WindowOptions::default() };
        let paper = AnalysisOptions { windows, ..still() };
        let calm = run(plan.as_ref(), &log("ladder-still.BIN"), &paper);
        let windy = run(plan.as_ref(), &log("ladder-wind5.BIN"), &paper);
        let base = |flight: &FlightAnalysis| {
            let window = flight.drones[0].windows[4].clone();
            assert!(window.kind.is_hover() && window.height_m < 21.0);
            (window.effort.mean, window.effort_phi.mean, window.tilt_deg.mean)
        };
        let ((u, u_phi, _), (wind_u, wind_u_phi, tilt)) = (base(&calm), base(&windy));
        println!("wind: u {:+.2} u_phi {:+.2} us, tilt {tilt:.2}", wind_u - u, wind_u_phi - u_phi);
        assert!((wind_u - u - 2.7).abs() < 0.1);
        assert!((tilt - 11.7).abs() < 0.1);
        // Tilt takes u cos(phi) - u = -33 us off the pulse itself.
        assert!((wind_u_phi - wind_u + 33.0).abs() < 0.1);
    }
}

#[test]
fn the_oldest_command_message_suffices_to_find_the_windows() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.BIN");
    let bytes = fs::read(fixture("square-law-ladder.trimmed.BIN")).unwrap();
    // Without PSCD only CTUN's desired climb rate is left, here once a second and in whole cm/s.
    fs::write(&path, crate::analysis::support::renamed(&bytes, *b"PSCD", *b"PSCX")).unwrap();
    let flight = run(None, &[path], &paper());
    assert_eq!(legs(&flight.drones[0].windows).len(), 14);
    let fit = flight.drones[0].laws.as_ref().unwrap().signed_quadratic.clone().unwrap();
    assert!((values(&fit)[0] - 4.963).abs() < 0.05, "{:?}", values(&fit));
}

#[test]
fn damaged_logs_never_stop_the_others() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(fixture("square-law-ladder.trimmed.BIN")).unwrap();
    let mut plan = plan(Purpose::Calibration, ladder(1.0), 13);
    // All were flown from one place: without an origin their names tell them apart.
    (plan.site.origin_lat_deg, plan.site.origin_lon_deg) = (0.0, 0.0);
    let mut paths = vec![folder.path().join("1.BIN")];
    fs::write(&paths[0], &bytes).unwrap();
    for seed in 2..=13_usize {
        let mut damaged = bytes.clone();
        for step in 0..seed * 60 {
            let at = (seed * 7919 + step * 104_729 + step * step * 31) % damaged.len();
            damaged[at] = damaged[at].wrapping_add(1 << (step % 8));
        }
        damaged.truncate(bytes.len() - seed * 30_011);
        paths.push(folder.path().join(format!("{seed}.BIN")));
        fs::write(&paths[seed - 1], damaged).unwrap();
    }
    for plan in [Some(&plan), None] {
        let flight = run(plan, &paths, &still());
        let fit = flight.drones[0].laws.as_ref().unwrap().signed_quadratic.as_ref().unwrap();
        assert!((values(fit)[0] - 4.963).abs() < 0.01, "the whole log is unharmed");
        assert_eq!(flight.drones.len() + flight.unused.len(), flight.logs);
        if flight.planned {
            assert_eq!(flight.drones.len() + flight.missing.len(), 13);
        }
        let json = serde_json::to_string(&flight).unwrap();
        let back: FlightAnalysis = serde_json::from_str(&json).unwrap();
        assert_eq!(back, flight, "every number is finite, so JSON holds all of it");
        let repaired = flight.drones.iter().filter(|drone| !drone.warnings.is_empty()).count();
        for drone in &flight.drones {
            let fit = drone.laws.as_ref().unwrap().signed_quadratic.as_ref().unwrap();
            assert!((values(fit)[0] - 4.963).abs() < 0.05, "{}: {:?}", drone.name, values(fit));
        }
        assert!(repaired > 0);
    }
}

#[test]
fn a_log_without_id_and_number_is_matched_by_its_home() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("unnamed.BIN");
    let bytes = fs::read(fixture("ladder-still.trimmed.BIN")).unwrap();
    let nameless = crate::analysis::support::renamed(&bytes, *b"PARM", *b"PARX");
    fs::write(&path, &nameless).unwrap();
    // The fixture was flown from the show's origin, which is the home of slot 2 here.
    let mut plan = plan(Purpose::Calibration, ladder(1.0), 3);
    for slot in &mut plan.slots {
        slot.home_m[0] -= 7.0;
    }
    let paths = [path];
    let flight = run(Some(&plan), &paths, &still());
    assert_eq!(flight.drones[0].slot, Some(2));

    // Without GPS the show's clock still aligns it, but nothing tells whose log it is.
    fs::write(&paths[0], crate::analysis::support::renamed(&nameless, *b"GPS\0", *b"GPX\0"))
        .unwrap();
    let logs = logs(&paths);
    let error =
        analyze_flight(&input("calibration", Some(&plan), &logs), &still(), None, &|_, _| {})
            .map(|flight| flight.drones.len())
            .unwrap_err()
            .to_string();
    assert!(error.contains("name it after its slot"), "{error}");

    // Given by the caller, the slot needs no proof.
    let given = [LogInput { slot: Some(3), path: paths[0].clone(), ..LogInput::default() }];
    let flight =
        analyze_flight(&input("calibration", Some(&plan), &given), &still(), None, &|_, _| {})
            .unwrap();
    assert_eq!(flight.drones[0].slot, Some(3));
}

#[test]
fn a_second_log_of_a_slot_is_left_out_and_named() {
    let twice: Vec<LogInput> = ["square-law-ladder.trimmed.BIN", "ladder-still.trimmed.BIN"]
        .map(|name| LogInput { slot: Some(1), path: fixture(name), ..LogInput::default() })
        .to_vec();
    let plan = plan(Purpose::Calibration, ladder(1.0), 1);
    let flight =
        analyze_flight(&input("twice", Some(&plan), &twice), &paper(), None, &|_, _| {}).unwrap();
    assert_eq!((flight.drones.len(), flight.missing.len()), (1, 0));
    let unused: Vec<String> = flight.unused.iter().map(|log| log.sentence().to_string()).collect();
    assert_eq!(unused.len(), 1, "{unused:?}");
    assert!(unused[0].contains("slot 1 has a log already"), "{unused:?}");
}

#[test]
fn chi_squared_is_told_from_before_scatter_was_added() {
    let paths = [fixture("ladder-still.trimmed.BIN")];
    let flight = run(None, &paths, &still());
    let laws = flight.drones[0].laws.as_ref().unwrap();
    let (line, square) = (laws.linear.as_ref().unwrap(), laws.signed_quadratic.as_ref().unwrap());
    let added = laws.sigma_added_us.unwrap();
    println!("added {added} us, {:?} {:?}", line.chi2_reduced, square.chi2_reduced);
    assert!(added > 0.1, "{added}");
    // With the scatter in, the better law's would be 1 by construction.
    assert!(line.chi2_reduced.unwrap() > 2.0 && line.p_value.unwrap() < 1e-3);
    assert!((line.chi2 / line.dof as f64 - line.chi2_reduced.unwrap()).abs() < 1e-9);
    let row = |flight: &FlightAnalysis, of: Quantity| {
        flight.table.iter().find(|row| row.parameter == of).cloned()
    };
    assert_eq!(row(&flight, Quantity::AddedScatter).unwrap().mean, added);
    // Two logs are a fleet, which the paper's Table II is of.
    let folder = tempfile::tempdir().unwrap();
    let bytes = fs::read(fixture("square-law-ladder.trimmed.BIN")).unwrap();
    let fleet = ["1.BIN", "2.BIN"].map(|name| folder.path().join(name));
    for (cut, path) in fleet.iter().enumerate() {
        fs::write(path, &bytes[..bytes.len() - cut]).unwrap();
    }
    let ours = run(None, &fleet, &AnalysisOptions::default());
    let chi2 = row(&ours, Quantity::ReducedChi2).unwrap();
    assert_eq!(chi2.paper.unwrap().value, 2.19, "told all the same");
    assert!(chi2.not_compared.unwrap().contains("spread of their samples"), "not its statistic");
    let as_published = run(None, &fleet, &paper());
    assert_eq!(row(&as_published, Quantity::ReducedChi2).unwrap().not_compared, None);
    assert_eq!(row(&as_published, Quantity::ReducedChi2).unwrap().paper.unwrap().value, 2.19);
    assert_eq!(row(&as_published, Quantity::AddedScatter), None);
}

#[test]
fn a_signed_quadratic_that_does_not_fit_is_called_so() {
    let flight = run(None, &[fixture("ladder-still.trimmed.BIN")], &still());
    let words = joined(&flight.warnings);
    assert!(words.contains("signed-quadratic law does not describe this flight"), "{words}");
    assert!(words.contains("Use A' of the line"), "{words}");
    let square = run(None, &[fixture("square-law-ladder.trimmed.BIN")], &paper());
    assert!(square.warnings.is_empty(), "{:?}", square.warnings);
}

type OfTime = fn(f64) -> f64;

/// Hovers of 264 s (or less, if planned so) measured with the synthetic calibration.
fn measured(pulse: fn(f64) -> f64, up: fn(f64) -> f64, planned_s: f64) -> Analysis {
    let folder = tempfile::tempdir().unwrap();
    let [calibration, mut hover] = synthetic_campaign(folder.path());
    let path = folder.path().join("hover-2.BIN");
    let log = Synthetic {
        system_id: 2,
        duration_s: 264.0,
        velocity_up_mps: up,
        pulse_us: Box::new(pulse),
    };
    fs::write(&path, log.write()).unwrap();
    hover.truncate(2);
    let [ladder, _] = synthetic_plans();
    let table = Timetable::default().add(SegmentKind::Hover, "hover", 0.0, planned_s);
    let scan = plan(Purpose::Measurement, table.segments, 2);
    let inputs =
        [input("calibration", Some(&ladder), &calibration), input("hover", Some(&scan), &hover)];
    analyze("x", &inputs, &still(), None, &|_, _| {}).unwrap()
}

#[test]
fn a_rejected_hover_gives_no_value_and_says_why() {
    fn calm(_: f64) -> f64 {
        1548.5
    }
    fn touches(time: f64) -> f64 {
        if (100.0..101.0).contains(&time) { 1950.0 } else { 1548.5 }
    }
    fn still(_: f64) -> f64 {
        0.0
    }
    fn swings(time: f64) -> f64 {
        (time / 10.0 * TAU).sin()
    }
    fn climbs(_: f64) -> f64 {
        0.25
    }
    fn pinned(_: f64) -> f64 {
        1950.0
    }
    let cases: [(OfTime, OfTime, f64, &str); 2] =
        [(pinned, still, 264.0, "a motor touched its limit"), (calm, still, 12.0, "too short")];
    for (pulse, up, planned_s, reason) in cases {
        let analysis = measured(pulse, up, planned_s);
        let flight = &analysis.flights[1];
        let of_two = flight.unmeasured.iter().find(|drone| drone.slot == Some(2)).unwrap();
        assert!(of_two.reason.to_string().contains(reason), "{reason}: {}", of_two.reason);
        assert_eq!(of_two.name, flight.drones[1].name);
        let values = flight.map.as_ref().map_or(0, |map| map.drones.len());
        assert_eq!(values + flight.unmeasured.len(), 2, "{reason}");
        assert_eq!(analysis.what_was_found(), Yield::Partial, "{reason}");
    }
    // A drone that was told to move up and down did not fly this plan.
    let other = measured(calm, swings, 264.0);
    let unused = &other.flights[1].unused[0];
    assert_eq!(unused.slot, Some(2));
    assert!(unused.reason.to_string().contains("it was to stand still"), "{}", unused.reason);
    assert_eq!(other.what_was_found(), Yield::Partial);
    // A bad part costs its seconds, and a flag says so; the drone keeps the rest.
    let partly = measured(touches, still, 264.0);
    assert!(partly.flights[1].unmeasured.is_empty(), "{:?}", partly.flights[1].unmeasured);
    let map = partly.flights[1].map.as_ref().unwrap();
    let drone = map.drones.iter().find(|drone| drone.slot == Some(2)).unwrap();
    let flag = drone.quality.iter().find(|flag| flag.flag == Quality::Saturation).unwrap();
    assert_eq!(flag.reason, "a motor touched its limit: no values from 96 to 105 s");
    let lost = |index: &usize| drone.updraft_mps[*index].is_none();
    let lost = (0..map.time_s.len()).filter(lost).map(|index| map.time_s[index]);
    assert_eq!(lost.collect::<Vec<_>>(), (96..=105).map(f64::from).collect::<Vec<_>>());
    let whole = measured(calm, climbs, 264.0);
    assert!(whole.flights[1].unmeasured.is_empty(), "{:?}", whole.flights[1].unmeasured);
}

#[test]
fn what_was_found_tells_nothing_from_something() {
    let folder = tempfile::tempdir().unwrap();
    let [calibration, hover] = synthetic_campaign(folder.path());
    let found = |name, logs: &[LogInput]| {
        let inputs = [input(name, None, logs)];
        analyze(name, &inputs, &still(), None, &|_, _| {}).unwrap()
    };
    let nothing = found("hover", &hover);
    assert_eq!(nothing.what_was_found(), Yield::Nothing);
    let text = updraft::report::terminal_summary(&nothing, 100, false);
    assert!(text.contains("No calibration: without its laws"), "{text}");
    let laws = found("calibration", &calibration);
    assert!(matches!(laws.what_was_found(), Yield::Whole | Yield::Partial));
    assert!(!updraft::report::terminal_summary(&laws, 100, false).contains("No calibration"));
}

fn joined(warnings: &[Warning]) -> String {
    warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; ")
}
