//! How far the live air is from that of the logs, by logs thinned to what telemetry would have told:
//!
//! ```sh
//! cargo run --release --example thinned_telemetry -- CAMPAIGN/hover CALIBRATION/analysis.json
//! ```

use std::path::PathBuf;
use std::sync::Arc;

use updraft::analysis::result::{FlightAnalysis, UpdraftMap};
use updraft::analysis::{AtHand, LogInput, analyze_flight};
use updraft::campaign::read_json;
use updraft::flight::{Flight, FlightOptions, Series};
use updraft::mission::plan::Purpose;
use updraft::workflow::analyze::{Settings, one_input};
use updraft::workflow::find::{Found, Work, find};

#[derive(Clone, Copy, Debug)]
struct Thin {
    rate_hz: f64,
    pulse: bool,
    velocity: bool,
    lean: bool,
    battery: bool,
}

fn thin(series: &Series, rate_hz: f64, quantum: f64, from: (f64, f64)) -> Series {
    let mut out = Series::default();
    let mut next = f64::NEG_INFINITY;
    for (time, value) in series.time_s.iter().zip(&series.value) {
        if *time < from.0 || *time > from.1 {
            continue;
        }
        if *time >= next {
            next = time + 1.0 / rate_hz - 0.02;
            out.time_s.push(*time);
            out.value.push(if quantum > 0.0 {
                (value / quantum).round() * quantum
            } else {
                *value
            });
        }
    }
    out
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let usage = "give a flight and a calibration";
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().ok_or(usage)?);
    let reference = PathBuf::from(args.next().ok_or(usage)?);
    let analysis: updraft::analysis::result::Analysis = read_json(&reference)?;
    let reference = analysis
        .flights
        .into_iter()
        .find(|flight| flight.purpose == Purpose::Calibration)
        .ok_or("no calibration")?;
    let mut work = Work::new(&folder);
    find(&folder, None, &mut work)?;
    let found = work.flights.remove(0);
    let plan = found.plan.clone().ok_or("no plan")?;
    let flights: Vec<(u16, Flight)> = found
        .logs
        .iter()
        .zip(&plan.slots)
        .map(|(log, slot)| {
            let options = FlightOptions {
                start: found.start,
                segments: Some(plan.segments(slot)),
                ..FlightOptions::default()
            };
            Ok((slot.slot, Flight::open(&log.path, options)?))
        })
        .collect::<Result<_, Box<dyn std::error::Error>>>()?;
    let whole = look(&found, &reference, flights.clone())?;
    let all = Thin { rate_hz: 4.0, pulse: true, velocity: true, lean: true, battery: true };
    let none = Thin { pulse: false, velocity: false, lean: false, battery: false, ..all };
    for (name, how) in [
        ("none", none),
        ("pulse", Thin { pulse: true, ..none }),
        ("velocity", Thin { velocity: true, ..none }),
        ("lean", Thin { lean: true, ..none }),
        ("battery", Thin { battery: true, ..none }),
        ("all", all),
    ] {
        if std::env::var("ONLY").is_ok_and(|only| only != name) {
            continue;
        }
        for to_s in [62.0, 92.0, 122.0, 150.0] {
            let cut = (46.0, to_s);
            let thinned = flights
                .iter()
                .map(|(slot, flight)| (*slot, thinned(flight, how, cut, &reference, *slot)))
                .collect();
            let map = look(&found, &reference, thinned)?;
            print!("{name:>9} {to_s:>5} ");
            compare(&map, &whole);
        }
    }
    Ok(())
}

fn thinned(
    flight: &Flight,
    how: Thin,
    cut: (f64, f64),
    reference: &FlightAnalysis,
    slot: u16,
) -> Flight {
    let rate = |on: bool| if on { how.rate_hz } else { 1e3 };
    let quantum = |on: bool, quantum: f64| if on { quantum } else { 0.0 };
    let one = |series: &Series, on: bool, by: f64| thin(series, rate(on), quantum(on, by), cut);
    let mut out = Flight {
        source: flight.source.clone(),
        clock: flight.clock.clone(),
        velocity_up_mps: one(&flight.velocity_up_mps, how.velocity, 0.01),
        height_m: one(&flight.height_m, how.velocity, 0.001),
        effort: flight.effort.clone(),
        pulse_max_us: one(&flight.pulse_max_us, how.pulse, 0.0),
        pulse_min_us: one(&flight.pulse_min_us, how.pulse, 0.0),
        roll_rad: one(&flight.roll_rad, how.lean, 0.0),
        pitch_rad: one(&flight.pitch_rad, how.lean, 0.0),
        pulse_limits_us: flight.pulse_limits_us,
        resistance_ohm: flight.resistance_ohm,
        ..Flight::default()
    };
    out.effort.values = one(&flight.effort.values, how.pulse, 0.0);
    let series =
        |series: &Option<Series>| series.as_ref().map(|series| thin(series, 1e3, 0.0, cut));
    out.voltage_v = series(&flight.voltage_v);
    out.current_a = series(&flight.current_a);
    out.resting_v = series(&flight.resting_v);
    if how.battery {
        let slow = |series: &Option<Series>, by: f64| {
            series.as_ref().map(|series| thin(series, 1.0, by, cut))
        };
        out.voltage_v = slow(&flight.voltage_v, 0.001);
        out.current_a = slow(&flight.current_a, 0.01);
        out.resting_v = None;
        let drone = reference.drones.iter().find(|drone| drone.slot == Some(slot));
        let ohm: Vec<f64> = drone
            .into_iter()
            .flat_map(|drone| &drone.windows)
            .filter_map(|window| Some(window.supply.as_ref()?.resistance_ohm))
            .collect();
        out.resistance_ohm = Some(ohm.iter().sum::<f64>() / ohm.len() as f64);
    }
    out
}

fn look(
    found: &Found,
    reference: &FlightAnalysis,
    flights: Vec<(u16, Flight)>,
) -> Result<UpdraftMap, Box<dyn std::error::Error>> {
    let logs = flights.into_iter().map(|(slot, flight)| LogInput {
        slot: Some(slot),
        path: flight.source.clone(),
        at_hand: Some(AtHand(Arc::new(flight))),
        ..LogInput::default()
    });
    let found = Found { logs: logs.collect(), ..found.clone() };
    let work = Work::default();
    let input = one_input(&work, &found);
    let options = Settings::default().options;
    let flight = analyze_flight(&input, &options, Some(reference), &|_, _| {})?;
    Ok(flight.map.ok_or("no map")?)
}

/// Prints the latest values against those of the whole map at the same seconds.
fn compare(map: &UpdraftMap, whole: &UpdraftMap) {
    let mut sums = [0.0; 5];
    let mut at_s = 0.0;
    for drone in &map.drones {
        let Some(other) = whole.drones.iter().find(|other| other.slot == drone.slot) else {
            continue;
        };
        let Some(last) = drone.updraft_mps.iter().rposition(Option::is_some) else { continue };
        at_s = map.time_s[last];
        let Some(at) = whole.time_s.iter().position(|time| (time - at_s).abs() < 0.5) else {
            continue;
        };
        let own = drone.updraft_mps[last].unwrap_or(f64::NAN);
        let post = drone.posterior_mps.get(last).copied().flatten().unwrap_or(f64::NAN);
        sums[0] += 1.0;
        sums[1] += own;
        sums[2] += other.updraft_mps[at].unwrap_or(f64::NAN);
        sums[3] += post;
        sums[4] += other.posterior_mps.get(at).copied().flatten().unwrap_or(f64::NAN);
    }
    let mean = |k: usize| sums[k] / sums[0];
    println!(
        "at {at_s:>4} own {:.3} of {:.3}, posterior {:.3} of {:.3}, shift {:?}",
        mean(1),
        mean(2),
        mean(3),
        mean(4),
        map.posterior.as_ref().map(|p| p.zero_shift_mps),
    );
}
