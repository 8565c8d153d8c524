//! Identity of a log: who wrote it, in which boots, and when its shows began. Whether it belongs to
//! a given start is decided here and nowhere else.

use std::path::Path;

use super::channels::Messages;
use super::pick;
use crate::base::frame::Geodetic;
use crate::base::time::GpsTime;
use crate::log::{Log, LogError};
use crate::numeric::{least, upper_median};

/// Largest difference between the start of a show and a given start at which they are one start, s.
/// The drones get a start in whole seconds, and the clocks of logs are known to some tenths.
pub const SAME_START_S: f64 = 5.0;
/// A first fix this long after arming is still near home, s.
const SOON_S: f64 = 10.0;
/// ClockMS of a SHOW row while no start time is set.
const NO_CLOCK_MS: f64 = -86_400_000.0;
/// GPS time minus board time is constant in one boot, to less than this, s.
const SAME_BOOT_S: f64 = 2.0;
/// Fewer rows with another clock are damage.
const FEWEST_ROWS: usize = 3;
/// Rows of a show's clock that differ by more are of two starts, s.
const SAME_CLOCK_S: f64 = 1.0;
/// Boots of a log that are looked at, and starts of a boot: more are damage.
const MOST: usize = 64;
/// Stages of the show in which a drone flies it: take-off, performing.
const FLOWN_STAGES: [f64; 2] = [3.0, 4.0];
/// ORGN rows of this type are of the place where the vehicle was armed.
const HOME: f64 = 1.0;

/// Identity of a log: its drone, its boots and their shows, and what casts doubt on them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Identity {
    /// MAVLink system id, if the log has the parameter.
    pub system_id: Option<u8>,
    /// Place where the vehicle stood when it was armed for its flight: (latitude, longitude),
    /// degrees. Without a flight, the first place with a 3-D fix; `None` as well if it was in the
    /// air before it had one.
    pub home_deg: Option<(f64, f64)>,
    /// Whether the log holds a flight: motors armed for some seconds, with their outputs.
    pub flew: bool,
    /// The boots that the log holds, in its order; nearly always one.
    pub boots: Vec<Boot>,
    /// Sign that the log is only the beginning of one, as a clause; `None` if there is none.
    pub cut: Option<&'static str>,
    /// Bytes in the log that belong to no message: damage on the way or on the card.
    pub damaged_bytes: u64,
    /// Reason why the clocks of several boots cannot be told apart, as a clause; `None` if they
    /// can.
    pub doubt: Option<&'static str>,
}

/// One boot of the autopilot, as far as the log holds it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Boot {
    /// Instant at which the board clock was 0, by the satellites.
    pub booted: Option<GpsTime>,
    /// First and last time of the boot, by the satellites.
    pub span: Option<(GpsTime, GpsTime)>,
    /// Home that the autopilot set, or the first fix.
    pub home: Option<Geodetic>,
    /// Starts that the show clock ran for, in the order of their first rows; empty where there are no
    /// SHOW rows with a clock.
    pub shows: Vec<Show>,
    /// Intervals in which the motors were armed for some seconds, (start, end).
    pub armed: Vec<(GpsTime, GpsTime)>,
}

/// A start that a drone knew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Show {
    /// GPS time of show time 0.
    pub start: GpsTime,
    /// Whether the drone took off for the start.
    pub flown: bool,
}

/// Answer to the question whether a log belongs to a start.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Belongs {
    /// The log covers the start, and nothing in it contradicts.
    Yes,
    /// The log is of something else, named by a clause: `its show began 1,204 s before this
    /// flight's start`.
    No(String),
    /// The log does not say enough, for the reason given as a clause.
    Unknown(String),
}

impl Identity {
    /// Reason to think that the log does not hold all of its flight, as a clause; `None` if there
    /// is none.
    pub fn incomplete(&self) -> Option<String> {
        let damaged = || {
            let bytes = self.damaged_bytes;
            (bytes > 0).then(|| format!("{bytes} bytes of it are damaged"))
        };
        self.cut.map(str::to_owned).or_else(damaged)
    }

    /// Name of the flight that the log belongs to, among flights given by name and start.
    pub fn of_any<'a>(&self, starts: &'a [(String, GpsTime)]) -> Option<&'a str> {
        let found = starts.iter().find(|(_, start)| self.belongs_to(*start) == Belongs::Yes);
        found.map(|(name, _)| name.as_str())
    }

    /// Reads a log file; see [`identify`].
    ///
    /// # Errors
    /// When the file cannot be read, or is no log.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        Ok(identify(&Log::open(path)?))
    }

    /// All shows of all boots, in the log's order.
    pub fn shows(&self) -> impl Iterator<Item = &Show> {
        self.boots.iter().flat_map(|boot| &boot.shows)
    }

    /// First and last time of the log, by the satellites.
    pub fn span(&self) -> Option<(GpsTime, GpsTime)> {
        let spans = || self.boots.iter().filter_map(|boot| boot.span);
        let first = spans().map(|(first, _)| first).min()?;
        Some((first, spans().map(|(_, last)| last).max()?))
    }

    /// Home of the boot that knows a start, otherwise of the last boot that has one.
    pub fn home(&self, start: Option<GpsTime>) -> Option<Geodetic> {
        let knows =
            |boot: &&Boot| start.is_some_and(|start| boot.belongs_to(start, None) == Belongs::Yes);
        let of_start = self.boots.iter().find(knows).and_then(|boot| boot.home);
        of_start.or_else(|| self.boots.iter().rev().find_map(|boot| boot.home))
    }

    /// Boot that belongs to a start.
    pub fn boot_of(&self, start: GpsTime) -> Option<&Boot> {
        self.boots.iter().find(|boot| boot.belongs_to(start, None) == Belongs::Yes)
    }

    /// Time between a start and the nearest show of the log, s; without a show, between the start
    /// and the time that the log covers.
    pub fn away_s(&self, start: GpsTime) -> f64 {
        least(self.boots.iter().map(|boot| boot.away_s(start))).unwrap_or(f64::INFINITY)
    }

    /// The show that began at a start, if the log has its clock.
    pub fn show_of(&self, start: GpsTime) -> Option<&Show> {
        let shows = self.shows().filter(|show| later_s(show.start, start).abs() <= SAME_START_S);
        // An abandoned start a second before the one that was flown is not meant.
        shows.max_by_key(|show| show.flown)
    }

    /// Whether the log is of the flight that began at `start` (GPS time of show time 0).
    ///
    /// It is if one of its shows began within [`SAME_START_S`] of it, or, in logs without a show
    /// clock, if its time covers the start.
    pub fn belongs_to(&self, start: GpsTime) -> Belongs {
        let mut why: Option<(f64, Belongs)> = None;
        for boot in &self.boots {
            let found = boot.belongs_to(start, self.cut);
            if found == Belongs::Yes {
                return self.doubt.map_or(Belongs::Yes, |doubt| Belongs::Unknown(doubt.to_owned()));
            }
            let away_s = boot.away_s(start);
            if why.as_ref().is_none_or(|(nearest_s, _)| away_s < *nearest_s) {
                why = Some((away_s, found));
            }
        }
        let clockless = || Belongs::Unknown("it has no GPS time".to_owned());
        match (why, self.doubt) {
            (Some((_, Belongs::No(_))), Some(doubt)) => Belongs::Unknown(doubt.to_owned()),
            (Some((_, found)), _) => found,
            (None, _) => clockless(),
        }
    }
}

impl Boot {
    fn belongs_to(&self, start: GpsTime, cut: Option<&'static str>) -> Belongs {
        let apart = |show: &&Show| later_s(show.start, start).abs();
        let nearest = self.shows.iter().min_by(|a, b| apart(a).total_cmp(&apart(b)));
        if let Some(show) = nearest {
            let later_s = later_s(show.start, start);
            return if later_s.abs() <= SAME_START_S {
                Belongs::Yes
            } else {
                let began = if show.flown { "show began" } else { "show was to begin" };
                Belongs::No(format!("its {began} {} this flight's start", how(later_s)))
            };
        }
        let Some((first, last)) = self.span else {
            return Belongs::Unknown("it has no GPS time".to_owned());
        };
        let (begins_s, ends_s) = (later_s(first, start), later_s(last, start));
        if begins_s > SAME_START_S {
            return Belongs::No(format!("it begins {} this flight's start", how(begins_s)));
        }
        if ends_s < 0.0 {
            let ends = format!("it ends {} this flight's start", how(ends_s));
            return match cut {
                Some(cut) => Belongs::Unknown(format!("{ends}, and is not whole: {cut}")),
                None => Belongs::No(ends),
            };
        }
        Belongs::Yes
    }

    /// How far a start is from what the boot is of, s.
    fn away_s(&self, start: GpsTime) -> f64 {
        let shows = self.shows.iter().map(|show| later_s(show.start, start).abs());
        let nearest = shows.min_by(f64::total_cmp);
        let outside = |(first, last): (GpsTime, GpsTime)| {
            later_s(first, start).max(-later_s(last, start)).max(0.0)
        };
        nearest.or(self.span.map(outside)).unwrap_or(f64::INFINITY)
    }
}

/// How much later one time is than another, s.
pub(crate) fn later_s(time: GpsTime, than: GpsTime) -> f64 {
    (time.total_ms() - than.total_ms()) as f64 / 1000.0
}

/// `1,204 s before`, `2.1 days after`.
pub(crate) fn how(later_s: f64) -> String {
    let side = if later_s < 0.0 { "before" } else { "after" };
    let amount = later_s.abs();
    let amount = if amount < 7200.0 {
        let whole = amount.round() as u64;
        match whole / 1000 {
            0 => format!("{whole} s"),
            thousands => format!("{thousands},{:03} s", whole % 1000),
        }
    } else if amount < 48.0 * 3600.0 {
        format!("{:.1} h", amount / 3600.0)
    } else {
        format!("{:.1} days", amount / 86_400.0)
    };
    format!("{amount} {side}")
}

/// Reads the identity of a log. Only the columns that are needed are decoded: a log of 20 MB takes
/// some tens of milliseconds.
pub fn identify(log: &Log) -> Identity {
    let all = Messages::read_identity(log);
    let mut messages = all.clone();
    let count = messages.keep_one_boot(None).max(1);
    let flight = messages.output_times().and_then(|times| {
        let armed = pick::armed(&messages, &times);
        pick::flight(&armed, &pick::stages(&messages), &times)
    });
    let places = messages.places();
    let home = match &flight {
        // The last fix on the ground, else the first one soon after.
        Some(((armed_s, _), _)) => {
            let before = places.partition_point(|(time, ..)| time <= armed_s);
            let soon = |(time, ..): &&(f64, f64, f64)| *time <= armed_s + SOON_S;
            (before.checked_sub(1).and_then(|last| places.get(last)))
                .or_else(|| places.get(before).filter(soon))
        }
        None => places.first(),
    };
    let mut boots = Vec::new();
    let mut last = None;
    for index in 0..count.min(MOST) {
        let mut one = all.clone();
        one.keep_one_boot(Some(index));
        boots.extend(parts(&one));
        last = Some(one);
    }
    boots.truncate(MOST);
    // Rows of one message cannot be put to the boots of another where their numbers differ.
    let has = |name: &str| all.rows(name).map_or(0, |rows| rows.boots().len());
    let unclear = |name: &str| has(name) != 0 && has(name) != count;
    let doubt = (count > 1 && (unclear("GPS") || unclear("SHOW") || count > MOST))
        .then_some("it holds several boots of the autopilot, whose rows cannot be told apart");
    Identity {
        system_id: messages.system_id(),
        home_deg: home.map(|(_, lat, lon)| (*lat, *lon)),
        flew: flight.is_some(),
        boots,
        cut: last.as_ref().and_then(cut),
        damaged_bytes: all.scan.bad_bytes,
        doubt,
    }
}

/// What tells that a log is only the beginning of one.
fn cut(last: &Messages) -> Option<&'static str> {
    // The firmware writes of disarming before it closes its log. What is begun after that and not
    // ended is nothing of the flight: logs of the real firmware often end so.
    let ends_armed = match pick::last_event(last) {
        Some(false) => return None,
        Some(true) => true,
        // It logs nothing but armed time: without a word of disarming it was still armed.
        None => last.logs_only_armed() && last.rows("RCOU").is_some(),
    };
    match (last.scan.truncated_bytes > 0, ends_armed) {
        (true, _) => Some("it ends in the middle of a message"),
        (_, true) => Some("it ends while the drone is armed"),
        _ => None,
    }
}

/// Where the clock of a boot was at which GPS time.
#[derive(Clone, Copy, Debug)]
struct Clock {
    /// Board time from which on it holds, s.
    from_s: f64,
    /// GPS time minus board time, ms.
    offset_ms: f64,
}

/// The boots in what counts as one boot by its board time: a second boot whose board time happens to go
/// on from the first one's is found by its satellites' time.
fn parts(messages: &Messages) -> Vec<Boot> {
    let fixes = messages.gps_ms();
    let clocks = clocks(&fixes);
    let pulses = messages.output_times().unwrap_or_default();
    let armed = pick::flights(&pick::armed(messages, &pulses), &pulses);
    if clocks.is_empty() {
        return vec![Boot {
            home: home(messages, f64::NEG_INFINITY..f64::INFINITY),
            ..Boot::default()
        }];
    }
    let mut boots = Vec::new();
    for (index, clock) in clocks.iter().enumerate() {
        let from_s = if index == 0 { f64::NEG_INFINITY } else { clock.from_s };
        let to_s = clocks.get(index + 1).map_or(f64::INFINITY, |next| next.from_s);
        let holds = |time: f64| (from_s..to_s).contains(&time);
        let time = |board_s: f64| {
            GpsTime::from_total_ms((board_s * 1000.0 + clock.offset_ms).round() as i64)
        };
        let steady = |(board_s, ms): &&(f64, f64)| {
            holds(*board_s) && same_boot(ms - board_s * 1000.0, clock.offset_ms)
        };
        let mut own = fixes.iter().filter(steady).map(|(_, ms)| *ms as i64);
        let span = own.next().and_then(|first| {
            let last = own.next_back().unwrap_or(first);
            GpsTime::from_total_ms(first).zip(GpsTime::from_total_ms(last))
        });
        let armed = armed.iter().filter(|(start, _)| holds(*start));
        boots.push(Boot {
            booted: time(0.0),
            span,
            home: home(messages, from_s..to_s),
            shows: shows(messages, holds)
                .into_iter()
                .filter_map(|(offset_s, flown)| Some(Show { start: time(offset_s)?, flown }))
                .collect(),
            armed: armed.filter_map(|(start, end)| time(*start).zip(time(*end))).collect(),
        });
    }
    boots
}

/// Whether two differences of GPS time and board time, ms, are of one boot.
fn same_boot(one_ms: f64, other_ms: f64) -> bool {
    (one_ms - other_ms).abs() <= SAME_BOOT_S * 1000.0
}

/// The clocks that the satellites' time tells apart, in the order of board time.
fn clocks(fixes: &[(f64, f64)]) -> Vec<Clock> {
    let offsets: Vec<f64> = fixes.iter().map(|(time, ms)| ms - time * 1000.0).collect();
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for (index, offset) in offsets.iter().enumerate() {
        match runs.last_mut() {
            Some((first, end))
                if offsets.get(*first).is_some_and(|old| same_boot(*old, *offset)) =>
            {
                *end = index + 1;
            }
            _ => runs.push((index, index + 1)),
        }
    }
    // Single rows that jump are damage, unless there is nothing else.
    let rows: usize = runs.iter().map(|(first, end)| end - first).max().unwrap_or_default();
    runs.retain(|(first, end)| end - first >= FEWEST_ROWS.min(rows));
    let mut clocks: Vec<Clock> = Vec::new();
    for (first, end) in runs {
        let own = offsets.get(first..end).unwrap_or_default().to_vec();
        let Some(offset_ms) = upper_median(own) else { continue };
        let from_s = fixes.get(first).map_or(0.0, |(time, _)| *time);
        // After a damaged stretch the same clock goes on.
        if clocks.last().is_none_or(|last| !same_boot(last.offset_ms, offset_ms))
            && clocks.len() < MOST
        {
            clocks.push(Clock { from_s, offset_ms });
        }
    }
    clocks
}

/// Rows of the show's clock that mean one start.
struct Start {
    /// Board time of show time 0 by each row, s.
    offsets_s: Vec<f64>,
    /// Rows in which the drone flew it.
    flown: usize,
}

/// The starts that the show clock ran for: board time of show time 0 (s), and whether it was flown.
fn shows(messages: &Messages, holds: impl Fn(f64) -> bool) -> Vec<(f64, bool)> {
    let Some(rows) = messages.rows("SHOW") else { return Vec::new() };
    let (Some(clocks), Some(stages)) = (rows.column("ClockMS"), rows.column("Stage")) else {
        return Vec::new();
    };
    let mut starts: Vec<Start> = Vec::new();
    for ((time, ms), stage) in rows.time_s.iter().zip(clocks).zip(stages) {
        if !ms.is_finite() || *ms == NO_CLOCK_MS || !holds(*time) {
            continue;
        }
        let offset_s = time - ms / 1000.0;
        let same = |start: &&mut Start| {
            start.offsets_s.first().is_some_and(|own| (own - offset_s).abs() <= SAME_CLOCK_S)
        };
        let flown = usize::from(FLOWN_STAGES.contains(stage));
        if let Some(start) = starts.iter_mut().rev().find(same) {
            start.offsets_s.push(offset_s);
            start.flown += flown;
        } else if starts.len() < MOST {
            starts.push(Start { offsets_s: vec![offset_s], flown });
        }
    }
    starts.retain(|start| start.offsets_s.len() >= FEWEST_ROWS);
    let of = |start: Start| Some((upper_median(start.offsets_s)?, start.flown >= FEWEST_ROWS));
    starts.into_iter().filter_map(of).collect()
}

/// The home that the autopilot set in this time, or the first fix.
fn home(messages: &Messages, times: std::ops::Range<f64>) -> Option<Geodetic> {
    let set = messages.rows("ORGN").and_then(|rows| {
        let kinds = rows.column("Type").unwrap_or_default();
        let is_home = |row: &usize| kinds.get(*row).is_none_or(|kind| *kind == HOME);
        let own = || (0..rows.time_s.len()).filter(|row| times.contains(&rows.time_s[*row]));
        let home = own().rfind(is_home).or_else(|| own().next());
        place(rows, home?)
    });
    set.or_else(|| {
        let rows = messages.rows("GPS")?;
        let status = rows.column("Status").unwrap_or_default();
        let fixed = |row: &usize| status.get(*row).is_none_or(|status| *status >= 3.0);
        let own = (0..rows.time_s.len()).filter(|row| times.contains(&rows.time_s[*row]));
        own.filter(fixed).find_map(|row| place(rows, row))
    })
}

fn place(rows: &super::clean::Rows, row: usize) -> Option<Geodetic> {
    let at = |column: &str| rows.column(column)?.get(row).copied();
    let place = Geodetic {
        lat_deg: at("Lat")?,
        lon_deg: at("Lng")?,
        amsl_m: at("Alt").unwrap_or_default(),
    };
    let is_place = place.lat_deg.abs() <= 90.0
        && place.lon_deg.abs() <= 180.0
        && (place.lat_deg, place.lon_deg) != (0.0, 0.0);
    is_place.then_some(place)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_is_so_many_seconds_later_than_another() {
        let [one, other] =
            [1_400_000_002_000, 1_400_000_005_500].map(|ms| GpsTime::from_total_ms(ms).unwrap());
        assert_eq!((later_s(other, one), later_s(one, other), later_s(one, one)), (3.5, -3.5, 0.0));
    }
}
