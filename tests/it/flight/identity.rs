//! What a log says of itself, and whether it is of a start.

#![expect(clippy::unwrap_used, reason = "this is test code")]

use updraft::base::time::GpsTime;
use updraft::flight::{Belongs, identify};
use updraft::log::catalog::{ARM, GPS, PARM, RCOU, SHOW};
use updraft::log::{Log, LogWriter, MessageDef, Value};

/// GPS time of board time 0 of a test's first boot.
const BOOTED: GpsTime = GpsTime { week: 2445, tow_ms: 400_000_000 };
const NO_START: i64 = -86_400_000;

fn at(board_s: f64) -> GpsTime {
    GpsTime::from_total_ms(BOOTED.total_ms() + (board_s * 1000.0).round() as i64).unwrap()
}

/// Rows in the order in which they come.
struct Writer(LogWriter<Vec<u8>>);

impl Writer {
    fn new() -> Self {
        let messages = [&PARM, &GPS, &SHOW, &ARM, &RCOU];
        Self(LogWriter::new(Vec::new(), &messages).unwrap())
    }

    fn row(&mut self, message: &'static MessageDef, values: &[(&str, Value<'_>)]) {
        let labels = message.fields.split(',');
        let value = |label| {
            let given = values.iter().find(|(name, _)| *name == label);
            given.map_or(Value::Int(0), |(_, value)| *value)
        };
        let row: Vec<Value<'_>> = labels.map(value).collect();
        self.0.row(message, &row).unwrap();
    }

    fn parameter(&mut self, name: &str, value: f64) {
        self.row(&PARM, &[("Name", Value::Text(name)), ("Value", Value::Float(value))]);
    }

    fn gps(&mut self, board_s: f64, gps: GpsTime) {
        self.row(
            &GPS,
            &[
                ("TimeUS", Value::Int((board_s * 1e6) as i64)),
                ("Status", Value::Int(6)),
                ("GWk", Value::Int(gps.week.into())),
                ("GMS", Value::Int(gps.tow_ms.into())),
                ("Lat", Value::Float(-35.0)),
                ("Lng", Value::Float(149.0)),
            ],
        );
    }

    fn armed(&mut self, board_s: f64, armed: bool) {
        let time = Value::Int((board_s * 1e6) as i64);
        self.row(&ARM, &[("TimeUS", time), ("ArmState", Value::Int(armed.into()))]);
    }

    /// Ten seconds and more of flight: GPS at 5 Hz, the show's clock and outputs at 10 Hz. `start_s`
    /// is the board time of show time 0; take-off is then, for `flown`.
    fn fly(&mut self, boot: GpsTime, from_s: f64, to_s: f64, start_s: Option<f64>, flown: bool) {
        for tick in 0..((to_s - from_s) * 10.0) as i64 {
            let board_s = from_s + tick as f64 / 10.0;
            let time = Value::Int((board_s * 1e6) as i64);
            if tick % 2 == 0 {
                let gps = boot.total_ms() + (board_s * 1000.0).round() as i64;
                self.gps(board_s, GpsTime::from_total_ms(gps).unwrap());
            }
            let clock = start_s.map_or(NO_START, |start| ((board_s - start) * 1000.0) as i64);
            let stage = match start_s {
                Some(start) if flown && board_s >= start => 4,
                _ => 2,
            };
            let show =
                [("TimeUS", time), ("ClockMS", Value::Int(clock)), ("Stage", Value::Int(stage))];
            self.row(&SHOW, &show);
            self.row(&RCOU, &[("TimeUS", time), ("C1", Value::Int(1500))]);
        }
    }

    fn log(self) -> Log {
        Log::from_bytes(self.0.finish().unwrap())
    }
}

fn no(why: &str) -> Belongs {
    Belongs::No(why.to_owned())
}

#[test]
fn a_show_that_began_at_another_time_is_of_another_flight() {
    let mut log = Writer::new();
    log.parameter("SYSID_THISMAV", 7.0);
    log.armed(92.0, true);
    log.fly(BOOTED, 92.0, 160.0, Some(100.0), true);
    log.armed(160.0, false);
    let identity = identify(&log.log());
    assert_eq!(identity.system_id, Some(7));
    assert_eq!((identity.cut, identity.doubt), (None, None));
    let [boot] = identity.boots.as_slice() else { panic!("{identity:?}") };
    assert_eq!(boot.booted, Some(BOOTED));
    assert_eq!(boot.span, Some((at(92.0), at(159.8))));
    assert_eq!(boot.armed, [(at(92.0), at(160.0))]);
    let [show] = boot.shows.as_slice() else { panic!("{boot:?}") };
    assert_eq!((show.start, show.flown), (at(100.0), true));

    assert_eq!(identity.belongs_to(at(100.0)), Belongs::Yes);
    assert_eq!(identity.belongs_to(at(104.9)), Belongs::Yes);
    assert_eq!(identity.belongs_to(at(94.9)), no("its show began 5 s after this flight's start"));
    assert_eq!(
        identity.belongs_to(at(1304.0)),
        no("its show began 1,204 s before this flight's start")
    );
    let days = at(100.0 - 3.0 * 86_400.0);
    assert_eq!(identity.belongs_to(days), no("its show began 3.0 days after this flight's start"));
}

#[test]
fn a_log_of_two_starts_of_one_boot_is_of_both() {
    let mut log = Writer::new();
    log.armed(92.0, true);
    log.fly(BOOTED, 92.0, 98.0, Some(100.0), false);
    log.armed(98.0, false);
    log.armed(292.0, true);
    log.fly(BOOTED, 292.0, 360.0, Some(300.0), true);
    log.armed(360.0, false);
    let identity = identify(&log.log());
    assert_eq!(identity.boots.len(), 1);
    for start in [100.0, 300.0] {
        assert_eq!(identity.belongs_to(at(start)), Belongs::Yes, "{start}");
    }
    assert!(!identity.show_of(at(100.0)).unwrap().flown);
    assert!(identity.show_of(at(300.0)).unwrap().flown);
    let between = no("its show was to begin 90 s before this flight's start");
    assert_eq!(identity.belongs_to(at(190.0)), between);
}

#[test]
fn boots_are_told_apart_by_board_time_and_by_satellites() {
    // The second boot's board time goes on from the first one's: only the satellites tell.
    let later = GpsTime { week: 2445, tow_ms: BOOTED.tow_ms + 3_600_000 };
    for second_s in [200.0, 50.0] {
        let mut log = Writer::new();
        log.fly(BOOTED, 92.0, 160.0, Some(100.0), true);
        log.fly(later, second_s, second_s + 60.0, Some(second_s + 8.0), true);
        let identity = identify(&log.log());
        let booted: Vec<_> = identity.boots.iter().map(|boot| boot.booted).collect();
        assert_eq!(booted, [Some(BOOTED), Some(later)], "{second_s}");
        assert_eq!(identity.belongs_to(at(100.0)), Belongs::Yes);
        assert_eq!(identity.belongs_to(at(3600.0 + second_s + 8.0)), Belongs::Yes);
        let other = identity.belongs_to(at(second_s + 8.0));
        assert!(matches!(other, Belongs::No(_)), "{other:?}");
    }
}

#[test]
fn without_a_show_clock_the_time_that_the_log_covers_tells() {
    let mut log = Writer::new();
    log.fly(BOOTED, 95.0, 160.0, None, true);
    log.armed(160.0, false);
    let identity = identify(&log.log());
    assert_eq!(identity.belongs_to(at(100.0)), Belongs::Yes);
    assert_eq!(identity.belongs_to(at(80.0)), no("it begins 15 s after this flight's start"));
    assert_eq!(identity.belongs_to(at(260.0)), no("it ends 100 s before this flight's start"));

    let mut log = Writer::new();
    log.armed(92.0, true);
    log.fly(BOOTED, 92.0, 96.0, None, true);
    let beginning = identify(&log.log()).belongs_to(at(100.0));
    let why = "it ends 4 s before this flight's start, and is not whole: it ends while the drone is armed";
    assert_eq!(beginning, Belongs::Unknown(why.to_owned()));
}

#[test]
fn a_log_without_time_says_nothing_and_damage_is_no_boot() {
    let mut log = Writer::new();
    log.row(&SHOW, &[("ClockMS", Value::Int(5))]);
    let why = Belongs::Unknown("it has no GPS time".to_owned());
    assert_eq!(identify(&log.log()).belongs_to(at(0.0)), why);

    let mut log = Writer::new();
    log.fly(BOOTED, 92.0, 130.0, Some(100.0), true);
    log.gps(130.1, GpsTime { week: 7, tow_ms: 12 });
    let clock = [("TimeUS", Value::Int(130_100_000)), ("ClockMS", Value::Int(-99_000))];
    log.row(&SHOW, &clock);
    log.fly(BOOTED, 130.2, 160.0, Some(100.0), true);
    let identity = identify(&log.log());
    assert_eq!(identity.boots.len(), 1);
    assert_eq!(identity.boots[0].shows.len(), 1);
    assert_eq!(identity.belongs_to(at(100.0)), Belongs::Yes);
}

#[test]
fn a_log_of_armed_time_alone_that_has_no_disarming_is_cut() {
    for (disarmed, cut) in [(0.0, Some("it ends while the drone is armed")), (1.0, None)] {
        let mut log = Writer::new();
        log.parameter("LOG_DISARMED", disarmed);
        log.fly(BOOTED, 92.0, 120.0, Some(100.0), true);
        assert_eq!(identify(&log.log()).cut, cut, "LOG_DISARMED {disarmed}");
    }
}

#[test]
fn damage_never_panics() {
    let mut log = Writer::new();
    log.parameter("SYSID_THISMAV", 7.0);
    log.armed(92.0, true);
    log.fly(BOOTED, 92.0, 110.0, Some(100.0), true);
    log.armed(110.0, false);
    log.fly(BOOTED, 60.0, 80.0, Some(70.0), true);
    let whole = log.0.finish().unwrap();
    let mut state = 1_u64;
    let mut below = |end: usize| {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) % end as u64) as usize
    };
    for _ in 0..300 {
        let mut bytes = whole.clone();
        for _ in 0..=below(60) {
            let at = below(bytes.len());
            match below(3) {
                0 => bytes[at] ^= 1 << below(8),
                1 => drop(
                    bytes.drain(at..(at + below(90)).min(whole.len()).min(bytes.len()).max(at)),
                ),
                _ => bytes[at] = 0xFF,
            }
        }
        let identity = identify(&Log::from_bytes(bytes));
        // Damage makes no log of another day.
        let other_day = identity.belongs_to(at(100.0 + 86_400.0));
        assert_ne!(other_day, Belongs::Yes);
        let _ = identity.home(Some(at(100.0)));
    }
}
