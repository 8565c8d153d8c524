//! Which logs are of one flight. Drones of one flight meet the same air at the same time; what was flown again later, by the
//! same commands, met another.

use super::data::Flown;
use crate::flight::{Alignment, Flight};

/// Starts of a show that are farther apart are those of two shows, s: drones of one show have the same start in their logs,
/// but for the error of their clocks.
const SAME_SHOW_S: f64 = 10.0;

/// The flight of each log, counted from 0 in the order of their starts. Logs that do not say when they began are of the first.
pub(super) fn of(flown: &[Flown<'_>]) -> Vec<usize> {
    let mut order: Vec<(f64, usize)> = flown
        .iter()
        .enumerate()
        .filter_map(|(index, one)| Some((start_s(one.flight)?, index)))
        .collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut flights = vec![0; flown.len()];
    for pair in order.windows(2) {
        let [(before_s, before), (start_s, index)] = [pair[0], pair[1]];
        let apart_s = start_s - before_s;
        let is_other = apart_s > same_flight_s(flown[before].flight);
        flights[index] = flights[before] + usize::from(is_other);
    }
    flights
}

/// When show time 0 was, s of GPS time.
fn start_s(flight: &Flight) -> Option<f64> {
    flight.clock.start.map(|start| start.total_ms() as f64 / 1000.0)
}

/// A log that began by so much later, s, is of another flight: without a show to keep time by, drones start one after
/// another, but all of them before the first has landed.
fn same_flight_s(flight: &Flight) -> f64 {
    if flight.clock.method == Alignment::ShowRows {
        return SAME_SHOW_S;
    }
    flight.velocity_up_mps.span().map_or(SAME_SHOW_S, |(_, end_s)| end_s.max(SAME_SHOW_S))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::time::GpsTime;
    use crate::flight::{Clock, Series};

    fn log(method: Alignment, start_s: Option<f64>) -> Flight {
        let start = start_s.and_then(|start_s| {
            GpsTime::from_total_ms(1_400_000_000_000 + (start_s * 1000.0) as i64)
        });
        Flight {
            clock: Clock { method, start, ..Clock::default() },
            velocity_up_mps: Series { time_s: vec![0.0, 500.0], value: vec![0.0; 2] },
            ..Flight::default()
        }
    }

    fn flights(logs: &[Flight]) -> Vec<usize> {
        let flown: Vec<Flown<'_>> =
            logs.iter().zip(1..).map(|(flight, slot)| Flown { slot, flight }).collect();
        of(&flown)
    }

    #[test]
    fn a_show_that_was_flown_again_is_another_flight() {
        let show = |start_s: f64| log(Alignment::ShowRows, Some(start_s));
        assert_eq!(flights(&[show(86.0), show(0.0), show(0.2), show(86.1)]), [1, 0, 0, 1]);
        assert_eq!(flights(&[show(0.0), log(Alignment::ShowRows, None), show(900.0)]), [0, 0, 1]);
        assert!(flights(&[]).is_empty());
    }

    #[test]
    fn drones_that_take_off_one_after_another_fly_together() {
        let own = |start_s: f64| log(Alignment::Takeoff, Some(start_s));
        let queue = [own(0.0), own(60.0), own(400.0), own(800.0)];
        assert_eq!(flights(&queue), [0, 0, 0, 0]);
        assert_eq!(flights(&[own(0.0), own(1_200.0)]), [0, 1], "the first had landed");
    }
}
