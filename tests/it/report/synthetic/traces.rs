//! Traces of the synthetic campaign: where its drones were, how fast they climbed and how hard they worked.

use std::f64::consts::TAU;

use updraft::analysis::result::{Analysis, Trace};
use updraft::mission::plan::Purpose;

/// The campaign with tracks: a ladder that climbs and sinks, a hover that swings a little around its place.
pub(crate) fn traced(mut analysis: Analysis) -> Analysis {
    for flight in &mut analysis.flights {
        let ladder = flight.purpose == Purpose::Calibration;
        for drone in &mut flight.drones {
            let phase = f64::from(drone.slot.unwrap_or(0)) / 7.0;
            let time_s: Vec<f64> = (0..700).map(f64::from).collect();
            let height = |time: f64| {
                let up = (time / 60.0).min(1.0) * (700.0 - time).min(10.0) / 10.0;
                if ladder { 40.0 + 30.0 * (TAU * time / 120.0 + phase).sin() } else { 100.0 * up }
            };
            let velocity = |time: f64| height(time + 0.5) - height(time - 0.5);
            let swing = |time: f64| 0.3 * (TAU * time / 40.0 + phase).sin();
            drone.trace = Trace {
                height_m: time_s.iter().map(|time| height(*time)).collect(),
                velocity_mps: time_s.iter().map(|time| velocity(*time)).collect(),
                pulse_phi_us: time_s.iter().map(|time| 1600.0 + 9.0 * velocity(*time)).collect(),
                moved_m: time_s
                    .iter()
                    .map(|time| Some([swing(*time), swing(time + 10.0)]))
                    .collect(),
                time_s,
            };
        }
    }
    analysis
}

/// A hover of very many drones: those of the campaign again and again, 7 m apart.
pub(crate) fn crowd(mut analysis: Analysis, drones: u16) -> Analysis {
    analysis.flights.truncate(2);
    let mut hover = analysis.flights.remove(1);
    analysis.flights.clear();
    let place = |i: u16| [f64::from(i / 32) * 7.0, f64::from(i % 32) * 7.0];
    let map = hover.map.as_mut().expect("a map");
    // The same drones have a trace and values.
    let known: Vec<_> = hover
        .drones
        .iter()
        .filter(|drone| map.drones.iter().any(|one| one.slot == drone.slot))
        .cloned()
        .collect();
    let few = map.drones.clone();
    map.drones = (0..drones)
        .map(|i| {
            let mut drone = few[usize::from(i) % few.len()].clone();
            drone.slot = Some(i + 1);
            drone.name = format!("Drone {}", i + 1);
            drone.position_m = Some(place(i));
            drone
        })
        .collect();
    hover.drones = (0..drones)
        .map(|i| {
            let mut drone = known[usize::from(i) % known.len()].clone();
            drone.slot = Some(i + 1);
            drone.name = format!("Drone {}", i + 1);
            drone.home_m = Some(place(i));
            drone
        })
        .collect();
    hover.missing.clear();
    hover.unmeasured.clear();
    hover.statistics = None;
    analysis.flights = vec![hover];
    analysis
}
