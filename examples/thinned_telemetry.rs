//! Cost of thin telemetry: logs of a hover thinned to the rates of a link, against the logs themselves.
//!
//! ```sh
//! cargo run --release --example thinned_telemetry -- my-campaign/hover my-campaign/analysis.json
//! ```
//!
//! Prints, for each rate, how far apart the vertical air speeds of all drones and seconds are: each drone's own, and
//! those of all drones together (the posterior).

#![expect(clippy::print_stdout, reason = "its output")]

use std::error::Error;
use std::path::PathBuf;
use std::sync::Arc;

use updraft::analysis::result::{Analysis, DroneUpdraft, FlightAnalysis, UpdraftMap};
use updraft::analysis::{AtHand, LogInput, analyze_flight};
use updraft::campaign::read_json;
use updraft::flight::{Flight, FlightOptions, Series};
use updraft::mission::plan::Purpose;
use updraft::workflow::analyze::{Settings, one_input};
use updraft::workflow::find::{Found, Work, find};

const RATES_HZ: [f64; 3] = [4.0, 2.0, 1.0];
/// Rate of the battery's messages, whatever the others have.
const BATTERY_HZ: f64 = 1.0;

fn main() -> Result<(), Box<dyn Error>> {
    let usage = "give a measurement flight and the analysis.json of its calibration";
    let mut args = std::env::args().skip(1);
    let folder = PathBuf::from(args.next().ok_or(usage)?);
    let reference = PathBuf::from(args.next().ok_or(usage)?);
    let analysis: Analysis = read_json(&reference)?;
    let is_calibration = |flight: &FlightAnalysis| flight.purpose == Purpose::Calibration;
    let reference = analysis.flights.into_iter().find(is_calibration).ok_or(usage)?;
    let mut work = Work::new(&folder);
    find(&folder, None, &mut work)?;
    let found = work.flights.into_iter().next().ok_or(usage)?;
    let plan = found.plan.as_ref().ok_or("the flight has no plan")?;
    let mut flights = Vec::new();
    for (log, slot) in found.logs.iter().zip(&plan.slots) {
        let segments = Some(plan.segments(slot));
        let options = FlightOptions { start: found.start, segments, ..FlightOptions::default() };
        flights.push((slot.slot, Flight::open(&log.path, options)?));
    }
    let whole = look(&found, &reference, flights.clone())?;
    println!("rate (Hz)  own: mean, rms (m/s)  together: mean, rms (m/s)");
    for rate_hz in RATES_HZ {
        let thin = |(slot, flight): &(u16, Flight)| (*slot, thinned(flight, rate_hz));
        let map = look(&found, &reference, flights.iter().map(thin).collect())?;
        let [own, together] = [
            apart(&map, &whole, |drone| &drone.updraft_mps),
            apart(&map, &whole, |drone| &drone.posterior_mps),
        ];
        println!(
            "{rate_hz:9}  {:+9.3} {:10.3}  {:+13.3} {:11.3}",
            own[0], own[1], together[0], together[1]
        );
    }
    Ok(())
}

/// A flight as messages at some rate tell it, in their units.
fn thinned(flight: &Flight, rate_hz: f64) -> Flight {
    let series = |series: &Series, unit: f64| thin(series, rate_hz, unit);
    let battery =
        |series: &Option<Series>, unit: f64| Some(thin(series.as_ref()?, BATTERY_HZ, unit));
    let mut effort = flight.effort.clone();
    effort.values = series(&effort.values, 0.0);
    Flight {
        source: flight.source.clone(),
        clock: flight.clock.clone(),
        velocity_up_mps: series(&flight.velocity_up_mps, 0.01),
        height_m: series(&flight.height_m, 0.001),
        effort,
        pulse_max_us: series(&flight.pulse_max_us, 1.0),
        pulse_min_us: series(&flight.pulse_min_us, 1.0),
        roll_rad: series(&flight.roll_rad, 0.0),
        pitch_rad: series(&flight.pitch_rad, 0.0),
        voltage_v: battery(&flight.voltage_v, 0.001),
        current_a: battery(&flight.current_a, 0.01),
        resistance_ohm: flight.resistance_ohm,
        pulse_limits_us: flight.pulse_limits_us,
        ..Flight::default()
    }
}

/// Values of a series no closer than a rate's period; a unit of 0 rounds nothing.
fn thin(series: &Series, rate_hz: f64, unit: f64) -> Series {
    let mut thinned = Series::default();
    let mut next_s = f64::NEG_INFINITY;
    for (time_s, value) in series.time_s.iter().zip(&series.value) {
        if *time_s < next_s {
            continue;
        }
        // Rows come a little early or late.
        next_s = time_s + 0.95 / rate_hz;
        thinned.time_s.push(*time_s);
        thinned.value.push(if unit > 0.0 { (value / unit).round() * unit } else { *value });
    }
    thinned
}

fn look(
    found: &Found,
    reference: &FlightAnalysis,
    flights: Vec<(u16, Flight)>,
) -> Result<UpdraftMap, Box<dyn Error>> {
    let logs = flights.into_iter().map(|(slot, flight)| LogInput {
        slot: Some(slot),
        path: flight.source.clone(),
        at_hand: Some(AtHand(Arc::new(flight))),
        ..LogInput::default()
    });
    let found = Found { logs: logs.collect(), ..found.clone() };
    let work = Work::default();
    let options = Settings::default().options;
    let flight = analyze_flight(&one_input(&work, &found), &options, Some(reference), &|_, _| {})?;
    Ok(flight.map.ok_or("the flight gives no map")?)
}

/// Mean and root mean square of what one map has less the other, m/s.
fn apart(
    map: &UpdraftMap,
    whole: &UpdraftMap,
    values: impl Fn(&DroneUpdraft) -> &Vec<Option<f64>>,
) -> [f64; 2] {
    let mut sums = [0.0; 3];
    for (drone, other) in map.drones.iter().zip(&whole.drones) {
        for (value, time_s) in values(drone).iter().zip(&map.time_s) {
            let at = whole.time_s.iter().position(|second| second == time_s);
            let other = at.and_then(|at| values(other).get(at).copied().flatten());
            if let Some((value, other)) = value.zip(other) {
                let apart = value - other;
                sums = [sums[0] + 1.0, sums[1] + apart, sums[2] + apart * apart];
            }
        }
    }
    [sums[1] / sums[0], (sums[2] / sums[0]).sqrt()]
}
