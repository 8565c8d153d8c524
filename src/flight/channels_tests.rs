//! Which boot of a log is read, and what its battery gave.

use super::channels::Messages;
use crate::log::catalog::{BAT, RCOU};
use crate::log::{Log, LogWriter, Value};

/// Motors at one pulse for ten seconds of each boot, from so many seconds of the board's time on.
fn boots(boots: &[(i64, i64)]) -> Messages {
    let mut log = LogWriter::new(Vec::new(), &[&RCOU]).unwrap();
    for (from_s, pulse_us) in boots {
        for row in 0..100 {
            let mut values = vec![Value::Int(1_000_000 * from_s + 100_000 * row)];
            values.extend([Value::Int(*pulse_us); 14]);
            log.row(&RCOU, &values).unwrap();
        }
    }
    Messages::read(&Log::from_bytes(log.finish().unwrap()))
}

#[test]
fn of_several_boots_the_last_is_read_unless_another_is_wanted() {
    for (wanted, boot, pulse_us) in [(None, 2, 1600.0), (Some(0), 0, 1400.0), (Some(1), 1, 1500.0)]
    {
        let mut messages = boots(&[(300, 1400), (200, 1500), (100, 1600)]);
        assert_eq!((messages.keep_one_boot(wanted), messages.boot), (3, boot));
        let [mean, ..] = messages.motors().unwrap();
        assert_eq!(mean.value, [pulse_us; 100], "boot {boot}");
    }
}

/// Batteries in turn, with their voltage, voltage at rest, current and resistance.
fn batteries(values: &[[f64; 4]]) -> Messages {
    let mut log = LogWriter::new(Vec::new(), &[&BAT]).unwrap();
    for row in 0..50 {
        for (instance, [volt, resting, amperes, ohm]) in (0..).zip(values) {
            let mut row = vec![Value::Int(100_000 * row), Value::Int(instance)];
            row.extend([*volt, *resting, *amperes, 0.0, 0.0, 0.0, *ohm].map(Value::Float));
            row.push(Value::Int(80));
            log.row(&BAT, &row).unwrap();
        }
    }
    Messages::read(&Log::from_bytes(log.finish().unwrap()))
}

#[test]
fn a_board_without_a_current_sensor_gives_no_power() {
    let power = |amperes| batteries(&[[12.0, 12.5, amperes, 0.0]]).power().map(|power| power.value);
    assert_eq!(power(0.0), None);
    assert_eq!(power(10.0), Some(vec![120.0; 50]));
}

#[test]
fn the_voltage_at_rest_is_that_of_the_first_battery() {
    let (volts, ohm) = batteries(&[[12.0, 12.5, 10.0, 0.0625], [5.0, 5.5, 1.0, 0.5]]).resting();
    assert_eq!((volts.unwrap().value, ohm.unwrap().value), (vec![12.5; 50], vec![0.0625; 50]));
    let (volts, ohm) = batteries(&[[12.0, 0.0, 10.0, 0.0]]).resting();
    assert_eq!((volts, ohm), (None, None), "an autopilot that does not estimate it logs 0");
}
