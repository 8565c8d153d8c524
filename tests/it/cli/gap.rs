//! `updraft gap` with what people bring: too few drones, no plan, logs of a constant, nothing at all. Each
//! message says what is wrong, where, and what to do; what can still be compared is.

use std::fmt::Write as _;
use std::fs;
use std::sync::OnceLock;

use insta::assert_snapshot;

use crate::cli::analyze_inputs::patch;
use crate::cli::support::{Bench, contents};

/// A ladder of two rungs.
const SMALL: [&str; 8] = ["--speeds", "1,2", "--leg", "15", "--hover", "10", "--baseline", "12"];
/// A vehicle whose rotors lose thrust as they climb, which AirSim's do not.
const INFLOW: &str = "\n[effects.rotor-inflow]\ninflow_share = 0.4\n";

fn plan(bench: &Bench) {
    let plan = ["plan", "calibration", "--grid", "2x2", "--quiet", "-o", "campaign"];
    bench.expect(0, &[&plan[..], &SMALL].concat());
}

/// The ladder as four drones flew it in still air; flown once for all tests.
fn campaign() -> Bench {
    static FLOWN: OnceLock<Bench> = OnceLock::new();
    let flown = FLOWN.get_or_init(|| {
        let bench = Bench::new();
        plan(&bench);
        bench.expect(0, &["simulate", "campaign", "--quiet"]);
        bench
    });
    let bench = Bench::new();
    for (path, content) in contents(&flown.path("campaign")) {
        let below = path.strip_prefix(flown.path("")).unwrap();
        let to = bench.path("").join(below);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::write(to, content).unwrap();
    }
    bench
}

/// Leaves the logs of these slots only.
fn keep(bench: &Bench, slots: &[u16]) {
    for slot in (1..=4).filter(|slot| !slots.contains(slot)) {
        fs::remove_file(bench.path(&format!("campaign/simulated/{slot:02}.BIN"))).unwrap();
    }
}

/// What a refused comparison says.
fn refused(bench: &Bench, code: i32, args: &[&str]) -> String {
    let ended = bench.expect(code, &[&["gap"], args].concat());
    assert!(ended.out.is_empty(), "{ended}");
    ended.err
}

/// What a comparison says beside its numbers.
fn said(bench: &Bench, code: i32, args: &[&str]) -> String {
    let ended = bench.expect(code, &[&["gap", "--json"], args].concat());
    let verdict = &ended.json("updraft.gap/1")["verdict"];
    let mut text = format!("drones {}\n", verdict["data"]["drones"]);
    for (name, list) in
        [("caution", &verdict["cautions"]), ("left out", &verdict["data"]["left_out"])]
    {
        for one in list.as_array().unwrap() {
            let _ = writeln!(text, "{name}: {}", one.as_str().unwrap());
        }
    }
    text + "-- err\n" + &ended.err
}

#[test]
fn flights_that_hide_nothing_lack_nothing() {
    let bench = campaign();
    let ended = bench.expect(0, &["gap", "campaign"]);
    assert!(ended.out.to_lowercase().contains("nothing is missing"), "{ended}");
    for file in ["verdict.json", "model.toml", "report/index.html"] {
        assert!(bench.path("campaign/gap").join(file).is_file(), "{file}");
    }
    // Against the logs of a simulation as well: here, its own.
    let logs = "campaign/simulated";
    let args = ["gap", "--measured", logs, "--simulated", logs, "--json", "-o", "own"];
    let verdict = &bench.expect(0, &args).json("updraft.gap/1")["verdict"];
    assert_eq!(verdict["steps"].as_array().unwrap().len(), 0, "{verdict}");
}

#[test]
fn what_the_flown_vehicle_had_and_the_model_lacks_is_named() {
    let bench = campaign();
    let base = fs::read_to_string(bench.path("campaign/vehicle.toml")).unwrap();
    fs::write(bench.path("true.toml"), base.clone() + INFLOW).unwrap();
    fs::write(bench.path("base.toml"), base).unwrap();
    let args = ["simulate", "campaign", "--vehicle", "true.toml", "--force", "--quiet"];
    bench.expect(0, &args);
    let ended = bench.expect(0, &["gap", "campaign", "--vehicle", "base.toml", "--json"]);
    // Four drones for a minute: stronger drag may explain it as well, and then both are named.
    let summary = ended.json("updraft.gap/1")["verdict"]["summary"].to_string();
    assert!(summary.contains("rotor-inflow (inflow_share 0.40"), "{ended}");
    // The model that it leads to flies as the logs say.
    let again = bench.expect(0, &["gap", "campaign", "--vehicle", "campaign/gap/model.toml"]);
    assert!(again.out.to_lowercase().contains("nothing is missing"), "{again}");
}

#[test]
fn one_drone_is_compared_with_its_caution() {
    let bench = campaign();
    keep(&bench, &[2]);
    assert_snapshot!(said(&bench, 0, &["campaign"]));
}

#[test]
fn half_of_the_logs_are_compared_with_a_caution() {
    let bench = campaign();
    keep(&bench, &[1, 4]);
    assert_snapshot!(said(&bench, 0, &["campaign"]));
    // Logs that are there and cannot be read are losses.
    fs::write(bench.path("campaign/simulated/02.BIN"), b"").unwrap();
    assert_snapshot!(said(&bench, 3, &["campaign"]));
}

#[test]
fn without_a_plan_there_must_be_a_simulated_side() {
    let bench = campaign();
    assert_snapshot!(refused(&bench, 2, &["--measured", "campaign/simulated"]));
    fs::remove_file(bench.path("campaign/plan.json")).unwrap();
    assert_snapshot!(refused(&bench, 5, &["campaign"]));
    assert_snapshot!(refused(
        &bench,
        1,
        &["--measured", "campaign/simulated", "--plan", "campaign/plan.json"]
    ));
}

#[test]
fn a_simulated_side_must_be_there_and_be_of_the_flight() {
    let bench = campaign();
    assert_snapshot!(refused(&bench, 1, &["campaign", "--simulated", "nothing-here"]));
    fs::create_dir(bench.path("empty")).unwrap();
    assert_snapshot!(refused(&bench, 5, &["campaign", "--simulated", "empty"]));
    fs::write(bench.path("empty/01.BIN"), b"no log").unwrap();
    assert_snapshot!(refused(&bench, 5, &["campaign", "--simulated", "empty"]));
}

#[test]
fn logs_of_another_plan_are_refused() {
    let bench = campaign();
    let plan = ["plan", "calibration", "--grid", "2x2", "--quiet", "-o", "other"];
    let ladder = ["--speeds", "1.5,2.5", "--leg", "15", "--hover", "10", "--baseline", "12"];
    bench.expect(0, &[&plan[..], &ladder].concat());
    bench.expect(0, &["simulate", "other", "--quiet"]);
    let of_plan = ["--measured", "other/simulated", "--plan", "campaign"];
    let refusal = refused(&bench, 2, &of_plan);
    for words in [
        "4 of 4 logs do not follow the plan",
        "slots 1-4: ",
        "planned 1 m/s, flown 1.50 m/s",
        "give the plan that they flew (--plan)",
    ] {
        assert!(refusal.contains(words), "{words}: {refusal}");
    }
    let own = ["--measured", "campaign/simulated", "--plan", "campaign"];
    let of_other = [&own[..], &["--simulated", "other/simulated"]].concat();
    let refusal = refused(&bench, 2, &of_other);
    assert!(refusal.contains("4 of 4 simulated logs do not follow the plan"), "{refusal}");
    // One log in the wrong folder is left out.
    fs::copy(bench.path("other/simulated/03.BIN"), bench.path("campaign/simulated/03.BIN"))
        .unwrap();
    let told = said(&bench, 3, &own);
    assert!(
        told.starts_with("drones 3\n") && told.contains("slot 3: this log does not belong"),
        "{told}"
    );
}

#[test]
fn half_fleets_in_counter_phase_are_compared_with_their_own_half() {
    let bench = Bench::new();
    let fly = |seed: &str, folder: &str| {
        let plan = ["plan", "calibration-counterphase", "--grid", "2x2", "--quiet", "-o", folder];
        bench.expect(0, &[&plan[..], &["--speeds", "1,2"]].concat());
        bench.expect(0, &["simulate", folder, "--quiet", "--seed", seed]);
    };
    fly("1", "one");
    fly("2", "two");
    let logs = ["--simulated", "one/simulated", "--measured", "two/simulated", "--json"];
    for plan in [&["--plan", "one", "-o", "with"][..], &["-o", "without"]] {
        let ended = bench.expect(0, &[&["gap"], &logs[..], plan].concat());
        let verdict = &ended.json("updraft.gap/1")["verdict"];
        assert_eq!(verdict["steps"].as_array().unwrap().len(), 0, "{plan:?}: {verdict}");
        let groups = verdict["data"]["groups"].as_array().unwrap();
        let drones: Vec<u64> = groups.iter().map(|group| group[1].as_u64().unwrap()).collect();
        assert_eq!(drones, [2, 2], "{plan:?}");
    }
}

#[test]
fn a_hover_that_is_compared_is_not_its_own_map() {
    let bench = Bench::new();
    let run = ["run", "--direct", "--no-study", "--quiet", "--air", "still", "-o", "campaign"];
    let small = ["--grid", "1x2", "--duration", "40", "--height", "30", "--speeds", "1,2"];
    bench.expect(0, &[&run[..], &small, &["--leg", "15", "--hover", "15"]].concat());
    let told = |flight: &str| {
        let ended = bench.expect(0, &["gap", "campaign", "--flight", flight, "--json"]);
        let map = ended.json("updraft.gap/1")["verdict"]["map"]["flight"].clone();
        (map.as_str().map(str::to_owned), ended.err.contains("the error of the map is not given"))
    };
    assert_eq!(told("calibration"), (Some("hover".to_owned()), false));
    assert_eq!(told("hover"), (None, true));
}

/// Has these logs say the same pulse throughout.
fn hold(bench: &Bench, folder: &str, slots: std::ops::RangeInclusive<u16>) {
    for slot in slots {
        let log = bench.path(&format!("{folder}/{slot:02}.BIN"));
        for channel in ["C1", "C2", "C3", "C4"] {
            patch(&log, "RCOU", channel, |_, field| {
                field.copy_from_slice(&1500_u16.to_le_bytes());
            });
        }
    }
}

#[test]
fn logs_of_a_constant_are_refused() {
    let bench = campaign();
    fs::create_dir(bench.path("other")).unwrap();
    for slot in 1..=4 {
        let name = format!("{slot:02}.BIN");
        fs::copy(bench.path("campaign/simulated").join(&name), bench.path("other").join(&name))
            .unwrap();
    }
    hold(&bench, "campaign/simulated", 1..=1);
    assert_snapshot!(said(&bench, 3, &["campaign"]));
    hold(&bench, "other", 1..=4);
    assert_snapshot!(refused(&bench, 5, &["campaign", "--simulated", "other"]));
    hold(&bench, "campaign/simulated", 2..=4);
    assert_snapshot!(refused(&bench, 5, &["campaign"]));
}

#[test]
fn a_half_fleet_that_lost_a_log_is_compared() {
    let bench = Bench::new();
    let plan = ["plan", "calibration-counterphase", "--grid", "3x5", "--quiet", "-o", "campaign"];
    bench.expect(0, &[&plan[..], &SMALL].concat());
    bench.expect(0, &["simulate", "campaign", "--quiet"]);
    fs::remove_file(bench.path("campaign/simulated/02.BIN")).unwrap();
    let ended = bench.expect(0, &["gap", "campaign", "--json"]);
    let data = &ended.json("updraft.gap/1")["verdict"]["data"];
    assert_eq!(data["drones"], 14);
    assert!(data["held_out"].as_array().is_some_and(|held| held.len() == 3), "{data}");

    let plan = fs::read(bench.path("campaign/plan.json")).unwrap();
    let plan: serde_json::Value = serde_json::from_slice(&plan).unwrap();
    let slots = plan["slots"].as_array().unwrap();
    for slot in slots.iter().filter(|slot| slot["group"] == slots[1]["group"] && slot["slot"] != 2)
    {
        let number = slot["slot"].as_u64().unwrap();
        fs::remove_file(bench.path(&format!("campaign/simulated/{number:02}.BIN"))).unwrap();
    }
    let ended = bench.expect(0, &["gap", "campaign", "--json"]);
    let cautions = ended.json("updraft.gap/1")["verdict"]["cautions"].to_string();
    assert!(cautions.contains("of the 7 drones of group"), "{cautions}");
    assert!(cautions.contains("the others climb at the same time"), "{cautions}");
    assert!(!cautions.contains("all drones climb"), "{cautions}");
}

/// Climbs of the ladder in a table.
const CLIMBS_MPS: [f64; 7] = [0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0];

#[test]
fn tables_are_held_against_the_closed_forms() {
    let bench = Bench::new();
    // In rotor speeds: 5400 in hover and 87 per m/s of climb, as the vehicle has it.
    let mut rows = "time,speed,up,height,roll,pitch\n".to_owned();
    let mut height_m = 30.0;
    for step in 0..7 * 100 {
        let climb_mps = CLIMBS_MPS[step / 100];
        height_m += 0.2 * climb_mps;
        let speed_rpm = 5400.0 + 87.0 * climb_mps + (step % 7) as f64;
        let time_s = step as f64 / 5.0;
        let _ = writeln!(rows, "{time_s},{speed_rpm},{climb_mps},{height_m:.2},0.01,-0.01");
    }
    fs::write(bench.path("ladder.csv"), rows).unwrap();
    let column = |name: &str, column: &str| format!("\n[{name}]\ncolumns = [\"{column}\"]\n");
    let mapping = [
        "schema = \"updraft.csv/1\"\ntitle = \"A ladder\"\nindicator = \"rotor_speed\"\n\
         [time]\ncolumn = \"time\"\n"
            .to_owned(),
        column("effort", "speed"),
        column("velocity_up", "up"),
        column("height", "height"),
        column("roll", "roll"),
        column("pitch", "pitch"),
        "[[flights]]\nname = \"ladder\"\npurpose = \"calibration\"\nfiles = [\"ladder.csv\"]\n"
            .to_owned(),
    ];
    fs::write(bench.path("ladder.toml"), mapping.concat()).unwrap();
    let args = ["gap", "--csv", "ladder.toml", "--vehicle", "phantom4", "--json"];
    let ended = bench.expect(0, &args);
    let verdict = &ended.json("updraft.gap/1")["verdict"];
    // The table is a straight line, the vehicle's law nearly one.
    let rungs = verdict["ladder"].as_array().unwrap();
    assert_eq!(rungs.len(), CLIMBS_MPS.len());
    for rung in rungs {
        let off_us = rung["measured_us"].as_f64().unwrap() - rung["before_us"].as_f64().unwrap();
        assert!(off_us.abs() < 5.0, "{rung}");
    }
    let text = fs::read_to_string(bench.path("gap/model.toml")).unwrap();
    assert!(text.contains("resistance_ohm = 0.15"), "the vehicle's own motors: {text}");
    assert_snapshot!(said(&bench, 0, &["--csv", "ladder.toml", "--vehicle", "phantom4"]));
    assert_snapshot!(refused(&bench, 1, &["--csv", "nothing-here.toml"]));
}

#[test]
fn nothing_measured_is_nothing_to_work_on() {
    let bench = Bench::new();
    fs::create_dir(bench.path("empty")).unwrap();
    assert_snapshot!(refused(&bench, 5, &["--measured", "empty"]));
    assert_snapshot!(refused(&bench, 5, &["empty"]));
    assert_snapshot!(refused(&bench, 1, &["nothing-here"]));
    assert_snapshot!(refused(&bench, 1, &["--measured", "nothing-here"]));
    plan(&bench);
    assert_snapshot!(refused(&bench, 5, &["campaign"]));
    assert_snapshot!(refused(&bench, 2, &["campaign", "--flight", "hover"]));
    for slot in 1..=4 {
        fs::create_dir_all(bench.path("campaign/simulated")).unwrap();
        fs::write(bench.path(&format!("campaign/simulated/{slot:02}.BIN")), b"").unwrap();
    }
    assert_snapshot!(refused(&bench, 5, &["campaign"]));
}

#[test]
fn a_model_that_is_not_there_is_named() {
    let bench = campaign();
    assert_snapshot!(refused(&bench, 1, &["campaign", "--vehicle", "no-such.toml"]));
    assert_snapshot!(refused(&bench, 2, &["campaign", "--vehicle", "no-such-vehicle"]));
    let base = fs::read_to_string(bench.path("campaign/vehicle.toml")).unwrap();
    fs::write(bench.path("wrong.toml"), base + "\n[effects.phlogiston]\n").unwrap();
    assert_snapshot!(refused(&bench, 2, &["campaign", "--vehicle", "wrong.toml"]));
}

#[test]
fn a_proposal_needs_a_verdict() {
    let bench = campaign();
    assert_snapshot!(refused(&bench, 5, &["next", "campaign"]));
    assert_snapshot!(refused(&bench, 1, &["next", "nothing-here"]));
}

#[test]
fn a_file_where_the_verdict_should_go_is_kept() {
    let bench = campaign();
    fs::write(bench.path("taken"), "mine").unwrap();
    assert_snapshot!(refused(&bench, 1, &["campaign", "-o", "taken"]));
    assert_eq!(fs::read_to_string(bench.path("taken")).unwrap(), "mine");
}

#[test]
fn the_report_of_another_command_is_kept() {
    let bench = campaign();
    let page = bench.path("campaign/report/index.html");
    fs::create_dir_all(page.parent().unwrap()).unwrap();
    fs::write(&page, "mine").unwrap();
    assert_snapshot!(refused(&bench, 2, &["campaign", "-o", "campaign"]));
    assert_eq!(fs::read_to_string(page).unwrap(), "mine");
}

#[test]
fn options_that_exclude_each_other_are_refused() {
    let bench = campaign();
    assert_snapshot!(refused(&bench, 2, &["campaign", "--plan", "campaign/plan.json"]));
    assert_snapshot!(refused(&bench, 2, &["campaign", "--alpha", "0"]));
}
