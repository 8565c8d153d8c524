//! Where and when it was, how many drones flew, and for how long.

use crate::analysis::result::{Analysis, DroneAnalysis, FlightAnalysis, FlightSite, LawsFrom};
use crate::base::calendar::date;
use crate::base::time::GpsTime;
use crate::mission::plan::Purpose;
use crate::numeric::extent;
use crate::report::page::capitalised;
use crate::report::text::{clean, count, fixed, purpose, shortened, usable};

use super::SUMMED_FLIGHTS;

/// Places closer than this are one, degrees of latitude or longitude (a hundred metres or less).
const SAME_PLACE_DEG: f64 = 0.001;
/// Nobody measures the air lower than this, m.
const LEAST_HEIGHT_M: f64 = 0.5;
/// Longest path that is shown whole, characters.
const LONGEST_PATH: usize = 60;
/// Heights closer than this are one height, m.
const SAME_HEIGHT_M: f64 = 3.0;

/// When steady flight was measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::report) struct When {
    /// Show time 0 by most logs; absent: no log has GPS time.
    pub(in crate::report) zero: Option<GpsTime>,
    /// First and last second of the windows, show time s.
    pub(in crate::report) span_s: [f64; 2],
}

impl When {
    /// Unix time of a show time, s; `None` where logs do not tell.
    pub(in crate::report) fn unix_s(self, show_s: f64) -> Option<i64> {
        let zero = self.zero?.to_unix_ms();
        let nearest = |show_s: f64| zero.saturating_add((1000.0 * show_s).round() as i64 + 500);
        usable(show_s).then(|| nearest(show_s).div_euclid(1000))
    }

    /// `2026-06-01 12:00:18 to 12:06:02 UTC`; `None` where logs do not tell.
    pub(in crate::report) fn utc(self) -> Option<String> {
        let [from, to] = self.span_s.map(|show_s| self.unix_s(show_s));
        let ((day, from), (last_day, to)) = (day_and_time(from?), day_and_time(to?));
        let to = if day == last_day { to } else { format!("{last_day} {to}") };
        Some(format!("{day} {from} to {to} UTC"))
    }

    /// Length, s.
    pub(in crate::report) fn length_s(self) -> f64 {
        self.span_s[1] - self.span_s[0]
    }
}

/// When the windows of a flight were flown; `None` without windows.
pub(in crate::report) fn when(flight: &FlightAnalysis) -> Option<When> {
    let ends = |drone: &DroneAnalysis| {
        let used = |window: &crate::analysis::result::WindowStats| [window.start_s, window.end_s];
        drone.windows.iter().flat_map(used).filter(|s| usable(*s)).collect::<Vec<_>>()
    };
    let (low, high) = extent(flight.drones.iter().flat_map(ends))?;
    Some(When { zero: flight.start(), span_s: [low, high] })
}

/// `47.4733° N, 19.0621° E, ground 190 m above sea level`
fn site_words(site: &FlightSite) -> String {
    let side = |deg: f64, sides: [&str; 2]| {
        format!("{}° {}", fixed(deg.abs(), 4), sides[usize::from(deg < 0.0)])
    };
    let ground = site.ground_amsl_m.filter(|m| usable(*m));
    let ground =
        ground.map_or_else(String::new, |m| format!(", ground {} m above sea level", fixed(m, 0)));
    format!("{}, {}{ground}", side(site.lat_deg, ["N", "S"]), side(site.lon_deg, ["E", "W"]))
}

/// Date and time of day of Unix seconds: `2026-06-01` and `12:00:18`.
pub(in crate::report) fn day_and_time(unix_s: i64) -> (String, String) {
    let (days, second) = (unix_s.div_euclid(86_400), unix_s.rem_euclid(86_400));
    let (year, month, day) = date(days);
    let (hour, minute, second) = (second / 3600, second / 60 % 60, second % 60);
    (format!("{year:04}-{month:02}-{day:02}"), format!("{hour:02}:{minute:02}:{second:02}"))
}

/// The first sentences.
pub(super) fn circumstances(analysis: &Analysis) -> Vec<String> {
    let flights = &analysis.flights;
    if flights.is_empty() {
        return vec!["There is no flight in this analysis.".to_owned()];
    }
    let mut said = vec![format!("{} {}.", flown(flights), place(flights))];
    if flights.len() <= SUMMED_FLIGHTS {
        said.extend(flights.iter().map(flight_sentence));
    }
    said.extend(analysis.laws_from.as_ref().map(laws_sentence));
    if flights.iter().any(|flight| flight.simulated) {
        said.push(
            if flights.iter().all(|flight| flight.simulated) {
                "Nothing was flown outdoors: drones, air and clock, which begins anew with each flight, are the \
                 simulator's."
            } else {
                "Of simulated flights, drones, air and clock are the simulator's."
            }
            .to_owned(),
        );
    }
    said
}

/// `The laws that measure are held from an earlier calibration of 16 drones, 2026-06-01 12:00 UTC (still/analysis.json).`
pub(in crate::report) fn laws_sentence(from: &LawsFrom) -> String {
    let when = from.start.map_or_else(String::new, |start| {
        let (day, time) = day_and_time((start.to_unix_ms() + 500).div_euclid(1000));
        format!(", {day} {} UTC", time.get(..5).unwrap_or(&time))
    });
    let drones = count(from.drones, "drone");
    format!(
        "The laws that measure are held from an earlier calibration of {drones}{when} ({}).",
        shortened(&clean(&from.path), LONGEST_PATH)
    )
}

/// `Two simulated flights of 16 drones`
fn flown(flights: &[FlightAnalysis]) -> String {
    let simulated = flights.iter().filter(|flight| flight.simulated).count();
    let used = || flights.iter().map(|flight| flight.drones.len());
    let (fewest, most) = (used().min().unwrap_or(0), used().max().unwrap_or(0));
    let drones = if fewest == most {
        count(most, "drone")
    } else {
        format!("{fewest} to {}", count(most, "drone"))
    };
    match (flights.len(), simulated) {
        (1, 0) => format!("A flight of {drones}"),
        (1, _) => format!("A simulated flight of {drones}"),
        (2, 0) => format!("Two flights of {drones}"),
        (n, 0) => format!("{n} flights of {drones}"),
        (2, 2) => format!("Two simulated flights of {drones}"),
        (n, all) if n == all => format!("{n} simulated flights of {drones}"),
        (n, some) => format!("{n} flights of {drones}, {some} of them simulated,"),
    }
}

/// Site of which pages tell: a plan's, which knows the ground's height, else that of the first fixes.
fn shown_site(flights: &[FlightAnalysis]) -> Option<&FlightSite> {
    let sites = || flights.iter().filter_map(|flight| flight.site.as_ref());
    sites().find(|site| site.planned).or_else(|| sites().next())
}

/// `Airfield, 47.4733° N, 19.0621° E, ground 190 m above sea level`; `None` where neither a plan nor a log says.
pub(in crate::report) fn named_site(flights: &[FlightAnalysis]) -> Option<String> {
    let mut names = flights.iter().filter_map(|flight| flight.site_name.as_deref()).map(clean);
    let name = names.next().map_or_else(String::new, |name| format!("{name}, "));
    Some(format!("{name}{}", site_words(shown_site(flights)?)))
}

fn place(flights: &[FlightAnalysis]) -> String {
    let Some((shown, named)) = shown_site(flights).zip(named_site(flights)) else {
        return "at a place that neither a plan nor the logs tell".to_owned();
    };
    let sites: Vec<&FlightSite> =
        flights.iter().filter_map(|flight| flight.site.as_ref()).collect();
    let near = |site: &&FlightSite| {
        let first = sites.first().unwrap_or(site);
        (site.lat_deg - first.lat_deg).abs() < SAME_PLACE_DEG
            && (site.lon_deg - first.lon_deg).abs() < SAME_PLACE_DEG
    };
    let of = if shown.planned { "" } else { " (the drones' first fixes)" };
    let apart = if sites.iter().all(near) {
        ""
    } else {
        ", and elsewhere: the flights are of several places"
    };
    format!("at {named}{of}{apart}")
}

/// `Hover: 2026-06-02 12:00 to 12:02 UTC, 1 min 49 s at 100 m above the ground, by 15 of 16 drones.`
fn flight_sentence(flight: &FlightAnalysis) -> String {
    let name = clean(&flight.name);
    let name = capitalised(if name.is_empty() { purpose(flight.purpose) } else { &name });
    let of = flight.drones.len() + flight.missing.len();
    let drones = if of > flight.drones.len() {
        format!(", with logs of {} of {}", flight.drones.len(), count(of, "drone"))
    } else {
        String::new()
    };
    let Some(when) = when(flight) else {
        return format!("{name}: nothing steady was flown{drones}.");
    };
    let clock = when.utc().map_or_else(
        || "when is not known (the logs have no GPS time)".to_owned(),
        |utc| format!("{utc}{}", local(flight, when)),
    );
    let what = match flight.purpose {
        Purpose::Calibration => " of climbs and descents".to_owned(),
        Purpose::Measurement => heights(flight),
    };
    format!("{name}: {clock}, {}{what}{drones}.", duration(when.length_s()))
}

/// ` (14:00 to 14:07 local time)`: by the plan's offset, else by the mean sun at its longitude, which is what convection
/// goes by.
fn local(flight: &FlightAnalysis, when: When) -> String {
    let by_sun = || flight.site.map(|site| site.lon_deg / 15.0).filter(|h| usable(*h));
    let (offset_h, which) = match flight.utc_offset_h.filter(|h| usable(*h)) {
        Some(offset_h) => (Some(offset_h), "local time"),
        None => (by_sun(), "mean solar time"),
    };
    let at = |show_s: f64| {
        let unix_s = when.unix_s(show_s)? + (3600.0 * offset_h?).round() as i64;
        day_and_time(unix_s).1.get(..5).map(str::to_owned)
    };
    match (at(when.span_s[0]), at(when.span_s[1])) {
        (Some(from), Some(to)) if from == to => format!(" ({from} {which})"),
        (Some(from), Some(to)) => format!(" ({from} to {to} {which})"),
        _ => String::new(),
    }
}

/// ` at 100 m above the ground`
fn heights(flight: &FlightAnalysis) -> String {
    let Some(map) = &flight.map else { return String::new() };
    let all = map.drones.iter().map(|drone| drone.height_m).filter(|m| usable(*m));
    let Some((low, high)) = extent(all) else { return String::new() };
    let moved = if map.is_scan() { " on tracks" } else { "" };
    // Tables without heights have zeros.
    if high < LEAST_HEIGHT_M && low > -LEAST_HEIGHT_M {
        return moved.to_owned();
    }
    if high - low < SAME_HEIGHT_M {
        format!("{moved} at {} m above take-off", fixed(f64::midpoint(low, high), 0))
    } else {
        format!("{moved} at {} to {} m above take-off", fixed(low, 0), fixed(high, 0))
    }
}

/// `1 min 49 s`
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0);
    let (minutes, rest) = ((whole / 60.0).floor(), whole % 60.0);
    match (minutes > 0.0, rest > 0.0) {
        (false, _) => format!("{} s", fixed(rest, 0)),
        (true, false) => format!("{} min", fixed(minutes, 0)),
        (true, true) => format!("{} min {} s", fixed(minutes, 0), fixed(rest, 0)),
    }
}
