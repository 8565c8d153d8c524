//! Any plan survives its files: .skyc and back to a plan, .skyb and back to trajectories.

use std::fmt::Write as _;

use proptest::prelude::*;
use updraft::campaign::{parse_plan, to_json};
use updraft::mission::Plan;
use updraft::mission::resolve::resolve_text;
use updraft::show::{Show, csv, skyb, skyc};
use updraft::vehicle::library;

/// Resolution of .skyc files, m.
const SKYC_UNIT_M: f64 = 0.001;

/// One step of a ladder: speed of the leg, its seconds, seconds of the hover.
type Rung = (f64, f64, f64);

/// Rounded, so that it is a number a person could have written.
fn number(range: std::ops::Range<f64>, digits: i32) -> impl Strategy<Value = f64> {
    let scale = 10f64.powi(digits);
    range.prop_map(move |value| (value * scale).round() / scale)
}

/// A template with a grid of any kind, rungs of any speeds, ramps or steps, one or two groups.
fn template() -> impl Strategy<Value = String> {
    let rung = (number(0.2..3.5, 3), number(4.0..20.0, 1), number(4.0..12.0, 2));
    let grid = (1..4_usize, 1..5_usize, 0..3_usize, number(3.0..60.0, 3));
    let side = prop::option::of((number(0.0..360.0, 1), number(0.5..5.0, 2)));
    (
        grid,
        prop::collection::vec(rung, 1..6),
        prop_oneof![Just(0.0), number(1.5..5.0, 2)],
        prop::option::of(number(0.1..40.0, 3)),
        side,
        (number(10.0..60.0, 3), number(0.5..2.0, 2), -180.0..180.0_f64),
    )
        .prop_map(|((rows, columns, fewer, spacing), rungs, ramp, offset, side, other)| {
            let drones = (rows * columns).saturating_sub(fewer).max(1);
            let (baseline, climb, orientation) = other;
            let mut text = format!(
                "schema = \"updraft.template/1\"\nname = \"any\"\ntitle = \"Any\"\n\
                 purpose = \"calibration\"\nvehicle = \"airsim-generic-quad\"\n\
                 [site]\norigin = [47.5, 19.0]\nground_amsl_m = 100.0\n\
                 orientation_deg = {orientation:.1}\n\
                 [grid]\nrows = {rows}\ncolumns = {columns}\ndrones = {drones}\n\
                 spacing_m = {spacing:?}\n[motion]\nramp_mps2 = {ramp:?}\n",
            );
            if let Some(offset) = offset.filter(|_| drones > 1) {
                let _ = write!(
                    text,
                    "[[groups]]\nname = \"a\"\nselect = \"checkerboard-even\"\n\
                     [[groups]]\nname = \"b\"\nselect = \"checkerboard-odd\"\noffset_s = {offset:?}\n"
                );
            }
            let _ = write!(
                text,
                "[[steps]]\nkind = \"climb\"\nto_m = {baseline:?}\nspeed_mps = {climb:?}\n"
            );
            for rung in rungs {
                write_rung(&mut text, rung);
            }
            if let Some((heading, speed)) = side {
                let _ = write!(
                    text,
                    "[[steps]]\nkind = \"horizontal\"\nheading_deg = {heading:?}\n\
                     speed_mps = {speed:?}\nduration_s = 8.0\n\
                     [[steps]]\nkind = \"hover\"\nduration_s = 9.0\n"
                );
            }
            text
        })
}

fn write_rung(text: &mut String, (speed, leg, hover): Rung) {
    for direction in ["up", "down"] {
        let _ = write!(
            text,
            "[[steps]]\nkind = \"leg\"\ndirection = \"{direction}\"\nspeed_mps = {speed:?}\n\
             duration_s = {leg:?}\n[[steps]]\nkind = \"hover\"\nduration_s = {hover:?}\n"
        );
    }
}

fn same(shown: &Show, planned: &Show, tolerance_m: f64) -> Result<(), TestCaseError> {
    prop_assert_eq!(shown.drones.len(), planned.drones.len());
    for (here, there) in shown.drones.iter().zip(&planned.drones) {
        let how = here.trajectory.difference(&there.trajectory, tolerance_m);
        prop_assert_eq!(how, None, "{}", there.name);
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_plan_survives_its_files(text in template()) {
        let mission = resolve_text("any.toml", &text, &[]);
        // The rest are ramps that do not fit into their steps.
        prop_assume!(mission.is_ok());
        let flight = &mission.unwrap().flights[0];
        let plan = &flight.plan;
        let json = to_json(plan).unwrap();
        let parsed = parse_plan(&json);
        prop_assert_eq!(parsed.as_ref(), Ok(plan));
        let again = resolve_text("again.toml", &flight.template_text, &[]).unwrap();
        prop_assert_eq!(&again.flights[0].plan, plan);

        let show = plan.to_show();
        let read = skyc::read(&skyc::write(&show).unwrap()).unwrap();
        same(&read, &show, SKYC_UNIT_M)?;

        let vehicle = library::builtin("airsim-generic-quad").unwrap();
        let recovered = Plan::of_show(&read, &vehicle);
        same(&recovered.to_show(), &show, SKYC_UNIT_M)?;
        prop_assert_eq!(recovered.duration_ms, plan.duration_ms);
        for drone in &show.drones {
            let file = skyb::write(drone, &skyb::SkybOptions::default()).unwrap();
            let read = skyb::read(&file.bytes).unwrap();
            let unit_m = f64::from(file.scale_mm) / 1000.0;
            let how = read.drone.trajectory.difference(&drone.trajectory, unit_m);
            prop_assert_eq!(how, None, "{} at {} mm", drone.name, file.scale_mm);
            prop_assert!(file.quantisation.max_position_m <= unit_m);
        }

        let table = csv::read(&csv::write(&show, &csv::CsvOptions::default()).unwrap()).unwrap();
        prop_assert_eq!(table.drones.len(), show.drones.len());
    }
}
