//! Where the drones of a flight were, how fast they climbed and how hard they worked, on common times.

use nalgebra::Vector3;

use crate::analysis::result::{DroneAnalysis, FlightAnalysis, Trace};
use crate::base::frame::{Geodetic, ShowFrame};
use crate::numeric::extent;

use super::text::usable;

/// Steps between times, s, of which the shortest is taken that few enough samples allow.
const STEPS_S: [f64; 14] =
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0, 60.0, 300.0, 3600.0];
/// Times of a flight at most.
const MOST_TIMES: usize = 3600;
/// Silences that are bridged, in samples of the trace, and s.
const BRIDGED_SAMPLES: f64 = 3.0;
const BRIDGED_S: f64 = 5.0;

/// Common times of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Times {
    /// First time, show time s.
    pub(super) start_s: f64,
    /// Time between neighbours, s.
    pub(super) step_s: f64,
    pub(super) count: usize,
}

impl Times {
    /// Times over a whole flight of which all drones together have `most` samples at most; `None` without traces.
    pub(super) fn of(flight: &FlightAnalysis, most: usize) -> Option<Self> {
        let traced = flight.drones.iter().filter(|drone| drone.trace.time_s.len() > 1);
        let times = traced.flat_map(|drone| &drone.trace.time_s).copied();
        let (start, end) = extent(times.filter(|time| usable(*time)))?;
        let start_s = start.ceil();
        let most = (most / flight.drones.len().max(1)).clamp(2, MOST_TIMES);
        let counted = |step_s: f64| ((end - start_s) / step_s).floor() as usize + 1;
        let step_s = STEPS_S.into_iter().find(|step_s| counted(*step_s) <= most);
        // Whatever times a damaged log claims: no more than the most.
        let step_s = step_s.unwrap_or((end - start_s) / (most - 1) as f64);
        let count = counted(step_s).min(most);
        (count > 1).then_some(Self { start_s, step_s, count })
    }

    fn iter(self) -> impl Iterator<Item = f64> {
        (0..self.count).map(move |index| self.start_s + index as f64 * self.step_s)
    }
}

/// One drone at common times.
#[derive(Clone, Debug, Default)]
pub(super) struct Track {
    /// Place in the show frame, m: forward, left, and up from its home.
    pub(super) place_m: [Vec<Option<f64>>; 3],
    /// Vertical velocity, m/s, up positive.
    pub(super) climb_mps: Vec<Option<f64>>,
    /// Rotor effort, in the indicator's unit.
    pub(super) effort: Vec<Option<f64>>,
}

impl Track {
    /// Whether it is known where the drone was, at any time.
    pub(super) fn has_place(&self) -> bool {
        let [forward, left, up] = &self.place_m;
        forward
            .iter()
            .zip(left)
            .zip(up)
            .any(|((x, y), z)| x.is_some() && y.is_some() && z.is_some())
    }
}

/// The drone's track; where its log says nothing of its place, it is above its home.
pub(super) fn track(flight: &FlightAnalysis, drone: &DroneAnalysis, times: Times) -> Track {
    let trace = &drone.trace;
    let home = drone.home_m.filter(|home| usable(home[0]) && usable(home[1]));
    let home_m = home.unwrap_or_default();
    let orientation_deg = flight.orientation_deg.filter(|deg| usable(*deg)).unwrap_or(0.0);
    let origin = Geodetic { lat_deg: 0.0, lon_deg: 0.0, amsl_m: 0.0 };
    let frame = ShowFrame { origin, orientation_deg };
    let places: Vec<Option<[f64; 2]>> = (0..trace.time_s.len())
        .map(|index| match trace.moved_m.get(index) {
            Some(Some([north, east])) => {
                let show = frame.from_neu(Vector3::new(*north, *east, 0.0));
                Some([home_m[0] + show.x, home_m[1] + show.y])
            }
            Some(None) => None,
            None => home,
        })
        .collect();
    let axis = |axis: usize| -> Vec<Option<f64>> {
        places.iter().map(|place| place.map(|place| place[axis])).collect()
    };
    let known = |values: &[f64]| values.iter().copied().map(Some).collect::<Vec<_>>();
    let at = |values: &[Option<f64>]| resampled(trace, values, times);
    Track {
        place_m: [at(&axis(0)), at(&axis(1)), at(&known(&trace.height_m))],
        climb_mps: at(&known(&trace.velocity_mps)),
        effort: at(&known(&trace.pulse_phi_us)),
    }
}

/// Values of a trace at common times, linear between its own.
fn resampled(trace: &Trace, values: &[Option<f64>], times: Times) -> Vec<Option<f64>> {
    let own = &trace.time_s;
    let (Some(first), Some(last)) = (own.first(), own.last()) else {
        return vec![None; times.count];
    };
    let mean_step = (last - first) / own.len().saturating_sub(1).max(1) as f64;
    let bridged = (BRIDGED_SAMPLES * mean_step).max(BRIDGED_S);
    let one = |time: f64| {
        let after = own.partition_point(|own| *own < time);
        let value = |index: usize| values.get(index).copied().flatten().filter(|v| usable(*v));
        let high = own.get(after)?;
        if *high - time < 1e-9 {
            return value(after);
        }
        let before = after.checked_sub(1)?;
        let low = own.get(before)?;
        let share = (time - low) / (high - low);
        let (from, to) = (value(before)?, value(after)?);
        (high - low <= bridged).then_some(from + share * (to - from))
    };
    times.iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trace of 10 Hz that climbs at 0.5 m/s and flies north at 2 m/s.
    fn trace(seconds: usize) -> Trace {
        let time_s: Vec<f64> = (0..10 * seconds).map(|i| i as f64 / 10.0).collect();
        Trace {
            height_m: time_s.iter().map(|t| 0.5 * t).collect(),
            velocity_mps: vec![0.5; time_s.len()],
            pulse_phi_us: vec![1500.0; time_s.len()],
            moved_m: time_s.iter().map(|t| Some([2.0 * t, 0.0])).collect(),
            time_s,
        }
    }

    fn flight(drones: usize, trace: &Trace, orientation_deg: f64) -> FlightAnalysis {
        let drone = serde_json::json!({
            "slot": null, "name": "", "source": "", "home_m": [10.0, 20.0], "windows": [],
            "clock": crate::flight::Clock::default(), "laws": null, "warnings": [],
            "trace": trace,
        });
        let mut flight: FlightAnalysis = serde_json::from_value(serde_json::json!({
            "name": "", "purpose": "measurement", "planned": true, "true_updraft_mps": null,
            "drones": [], "missing": [], "flock": null, "table": [], "map": null,
        }))
        .unwrap();
        flight.orientation_deg = Some(orientation_deg);
        flight.drones = vec![serde_json::from_value(drone).unwrap(); drones];
        flight
    }

    #[test]
    fn times_are_thinned_until_all_drones_fit() {
        let one = flight(1, &trace(600), 0.0);
        let whole = Times { start_s: 0.0, step_s: 1.0, count: 600 };
        assert_eq!(Times::of(&one, 600), Some(whole));
        assert_eq!(Times::of(&one, 599).map(|t| (t.step_s, t.count)), Some((2.0, 300)));
        let ten = flight(10, &trace(600), 0.0);
        assert_eq!(Times::of(&ten, 600).map(|t| (t.step_s, t.count)), Some((10.0, 60)));
        assert_eq!(Times::of(&flight(1, &Trace::default(), 0.0), 600), None);
    }

    #[test]
    fn a_track_begins_at_home_and_turns_with_the_show() {
        let times = Times { start_s: 0.0, step_s: 1.0, count: 10 };
        for (orientation_deg, forward, left) in [(0.0, 14.0, 20.0), (90.0, 10.0, 24.0)] {
            let flight = flight(1, &trace(10), orientation_deg);
            let track = track(&flight, &flight.drones[0], times);
            // After two seconds: four metres to the north, which an east-looking show has on its left.
            let at = |axis: usize| track.place_m[axis][2].unwrap();
            let found = [at(0), at(1), at(2)];
            for (found, expected) in found.into_iter().zip([forward, left, 1.0]) {
                assert!((found - expected).abs() < 1e-9, "{found} is not {expected}");
            }
            assert_eq!(track.climb_mps[2], Some(0.5));
        }
    }

    #[test]
    fn nothing_is_drawn_across_a_silence_or_outside_of_the_log() {
        let mut gap = trace(60);
        let keep = |time: &f64| !(20.0..30.0).contains(time);
        let kept: Vec<usize> = (0..600).filter(|i| keep(&gap.time_s[*i])).collect();
        gap.height_m = kept.iter().map(|i| gap.height_m[*i]).collect();
        gap.moved_m = kept.iter().map(|i| gap.moved_m[*i]).collect();
        gap.time_s = kept.iter().map(|i| gap.time_s[*i]).collect();
        let flight = flight(1, &gap, 0.0);
        let times = Times { start_s: -2.0, step_s: 1.0, count: 70 };
        let heights = &track(&flight, &flight.drones[0], times).place_m[2];
        assert_eq!((heights[1], heights[69]), (None, None));
        assert_eq!((heights[23], heights[31]), (None, None), "21 s and 29 s");
        assert!((heights[32].unwrap() - 15.0).abs() < 1e-9, "30 s");
    }

    #[test]
    fn without_places_a_drone_is_above_its_home() {
        let mut still = trace(10);
        still.moved_m.clear();
        let flight = flight(1, &still, 30.0);
        let times = Times { start_s: 0.0, step_s: 1.0, count: 10 };
        let track = track(&flight, &flight.drones[0], times);
        assert_eq!([track.place_m[0][5], track.place_m[1][5]], [Some(10.0), Some(20.0)]);
    }
}
