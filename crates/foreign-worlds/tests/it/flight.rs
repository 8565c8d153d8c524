//! A flight against the trim, its log read back, and the same bytes again.

use dataflash::{Log, Select};
use foreign_worlds::plant::{GRAVITY, Plant, density_ratio};
use foreign_worlds::telemetry::TelemetrySettings;
use foreign_worlds::{Condition, Trim, World};

use super::support::{BLADES, LAW, flown, hiding, ladder, quiet};

/// Mean of a logged column between two show times, by the log's own show clock.
fn mean(bytes: &[u8], message: &str, field: &str, (from_s, to_s): (f64, f64)) -> f64 {
    let log = Log::from_bytes(bytes.to_vec());
    let select = [
        Select { message: "SHOW", fields: &["TimeUS", "ClockMS"] },
        Select {
            message,
            fields: &["TimeUS", "C1", "C2", "C3", "C4", "VD", "PD", "Pitch", "Roll", "RPM", "Curr"],
        },
    ];
    let (tables, damage) = log.select(&select);
    assert_eq!(damage.bad_bytes, 0);
    let column = |name: &str, field: &str| {
        let table = tables.iter().find(|table| table.message == name).unwrap();
        table.number(field).unwrap().to_vec()
    };
    let offset_us = column("SHOW", "TimeUS")[0] * 1.0 - column("SHOW", "ClockMS")[0] * 1e3;
    let scale = if column("SHOW", "TimeUS")[0] > 1e4 { 1e-6 } else { 1.0 };
    let times = column(message, "TimeUS");
    let values: Vec<Vec<f64>> = if field == "pulse" {
        ["C1", "C2", "C3", "C4"].map(|name| column(message, name)).to_vec()
    } else {
        vec![column(message, field)]
    };
    let (mut sum, mut count) = (0.0, 0.0);
    for (row, time) in times.iter().enumerate() {
        let show_s = (time - offset_us) * scale;
        if (from_s..to_s).contains(&show_s) {
            sum += values.iter().map(|column| column[row]).sum::<f64>() / values.len() as f64;
            count += 1.0;
        }
    }
    assert!(count > 20.0, "{count} rows");
    sum / count
}

#[test]
fn telemetry_has_the_rotors_speed_and_changes_nothing_else() {
    let telemetry = TelemetrySettings {
        speed_white_rpm: 15.0,
        speed_step_rpm: 100.0 / 7.0,
        current_share: 0.02,
        current_coloured_share: 0.01,
        current_coloured_s: 60.0,
        current_white_a: 0.1,
        current_step_a: 0.01,
    };
    let world = quiet(&BLADES);
    let with = World { telemetry: Some(telemetry), ..world.clone() };
    let (plain, told) = (flown(&world).1, flown(&with).1);
    let hover = (44.0, 49.0);
    for (message, field) in [("RCOU", "pulse"), ("XKF1", "VD"), ("ATT", "Pitch")] {
        assert_eq!(mean(&plain, message, field, hover), mean(&told, message, field, hover));
    }
    // Thrust goes with the square of the speed: climbing takes more of it through the inflow.
    let (level, climb) =
        (mean(&told, "ESC", "RPM", hover), mean(&told, "ESC", "RPM", (25.0, 38.0)));
    assert!(climb > 1.01 * level, "{level} {climb}");
    let current = mean(&told, "BAT", "Curr", hover) / mean(&plain, "BAT", "Curr", hover);
    assert!((current - 1.0).abs() < 0.08 && current != 1.0, "{current}");
    let log = Log::from_bytes(plain);
    let (tables, _) = log.select(&[Select { message: "ESC", fields: &["RPM"] }]);
    assert!(tables.iter().all(|table| table.number("RPM").is_none_or(<[f64]>::is_empty)));
    // A thrust law has no rotor speed to tell.
    let law = World { telemetry: Some(telemetry), ..quiet(&LAW) };
    let (tables, _) =
        Log::from_bytes(flown(&law).1).select(&[Select { message: "ESC", fields: &["RPM"] }]);
    assert!(tables.iter().all(|table| table.number("RPM").is_none_or(<[f64]>::is_empty)));
}

#[test]
fn a_thrust_law_hovers_where_its_numbers_say() {
    let trim = Trim::new(&LAW, Vec::new(), 1.0);
    let hover = trim.at(&Condition::default()).unwrap();
    assert!((hover.pulse_us - 1000.0 - 1000.0 * GRAVITY / 18.3).abs() < 1e-6);
    let climb =
        Condition { relative_mps: [0.0, 0.0, 3.0], density_ratio: 0.9, ..Condition::default() };
    let wanted = (GRAVITY + 0.1 * 1.225 * 0.9 * 9.0) / (18.3 * 0.9);
    assert!((trim.at(&climb).unwrap().command - wanted).abs() < 1e-9);
    // A side wind leans it: to first order by drag over weight.
    let wind = Condition { relative_mps: [0.0, -6.0, 0.0], ..Condition::default() };
    let lean = trim.at(&wind).unwrap().lean;
    let side = 0.006 * 1.225 * 36.0 / GRAVITY;
    assert!(lean[0].abs() < 1e-9 && (lean[1] / -side - 1.0).abs() < 0.02, "{lean:?} {side}");
}

#[test]
fn steady_legs_are_flown_at_the_trims_pulse() {
    for plant in [&LAW, &BLADES] {
        let (flown, bytes) = flown(&quiet(plant));
        assert!(flown.farthest_m < 3.0, "{flown:?}");
        let place: &Plant = plant;
        for (span, climb_mps, height_m) in
            [((14.0, 19.0), 0.0, 10.0), ((30.0, 39.0), 2.0, 39.0), ((60.0, 69.0), -2.0, 21.0)]
        {
            let ratio = density_ratio(190.0 + height_m);
            let trim = Trim::new(place, Vec::new(), ratio);
            let condition = Condition {
                relative_mps: [0.0, 0.0, climb_mps],
                density_ratio: ratio,
                height_m,
                ..Condition::default()
            };
            let wanted = trim.at(&condition).unwrap().pulse_us;
            let found = mean(&bytes, "RCOU", "pulse", span);
            assert!((found - wanted).abs() < 0.7, "{climb_mps}: {found} {wanted}");
            let down = mean(&bytes, "XKF1", "VD", span);
            assert!((down + climb_mps).abs() < 0.02, "{down}");
        }
        let target = ladder(45.0);
        let height = -mean(&bytes, "XKF1", "PD", (47.0, 49.5));
        assert!((height - target.position_m[2]).abs() < 0.1, "{height}");
    }
}

#[test]
fn a_side_wind_is_in_the_logged_lean() {
    let mut world = quiet(&LAW);
    world.air.wind_mps = [6.0, 0.0];
    let (_, bytes) = flown(&world);
    // Wind from behind pushes forward: the nose goes up against it.
    let pitch = mean(&bytes, "ATT", "Pitch", (14.0, 19.0));
    let wanted = (0.006 * 1.225 * density_ratio(200.0) * 36.0 / GRAVITY).atan().to_degrees();
    assert!((pitch - wanted).abs() < 0.06, "{pitch} {wanted}");
    assert!(mean(&bytes, "ATT", "Roll", (14.0, 19.0)).abs() < 0.02);
}

#[test]
fn a_velocity_that_is_late_in_the_log_alone_leaves_the_flight_as_it_is() {
    let (_, right) = flown(&quiet(&LAW));
    let (_, late) = flown(&hiding(&LAW, "log-lag", &[0.4]));
    let (_, biased) = flown(&hiding(&LAW, "log-bias", &[0.2]));
    let of = |bytes: &[u8], message, field| mean(bytes, message, field, (19.0, 24.0));
    for other in [&late, &biased] {
        let pulses = [&right, other].map(|bytes| of(bytes, "RCOU", "pulse"));
        assert_eq!(pulses[0], pulses[1]);
    }
    // The leg up begins at 20 s: 0.4 s of 2 m/s are missing from 5 s.
    let missing = of(&late, "XKF1", "VD") - of(&right, "XKF1", "VD");
    assert!((missing - 0.16).abs() < 0.03, "{missing}");
    let off = of(&biased, "XKF1", "VD") - of(&right, "XKF1", "VD");
    assert!((off + 0.2).abs() < 1e-4, "{off}");
}

#[test]
fn logs_repeat_and_have_the_rate_that_was_asked_for() {
    let mut world = hiding(&LAW, "hysteresis", &[10.0]);
    world.noise.pulse_white_us = 4.0;
    world.noise.velocity_mps = 0.03;
    world.air.own_mps = 0.2;
    let (_, first) = flown(&world);
    assert!(first == flown(&world).1);
    world.noise.rate_hz = 25.0;
    let rows = |bytes: &[u8]| {
        let log = Log::from_bytes(bytes.to_vec());
        let (tables, _) = log.select(&[Select { message: "RCOU", fields: &["TimeUS"] }]);
        tables[0].rows as f64
    };
    let ratio = rows(&flown(&world).1) / rows(&first);
    assert!((ratio - 2.5).abs() < 0.05, "{ratio}");
}
