//! Nothing hidden, nothing found: every built-in vehicle in steady wind and updraft, by both ladders. Nobody knows the
//! updraft of a day, and no model lacks it.

use std::fmt::Write as _;

use updraft::vehicle::library;

use crate::cli::support::Bench;

/// Who flies what in which air.
struct Flight {
    vehicle: &'static str,
    template: &'static str,
    wind_mps: i32,
    updraft_mps: i32,
}

const TEMPLATES: [&str; 2] = ["calibration", "calibration-counterphase"];
const WINDS_MPS: [i32; 4] = [0, 3, 5, 8];
const UPDRAFTS_MPS: [i32; 5] = [-2, -1, 0, 1, 2];

impl Flight {
    /// What a comparison says that the model lacks; empty: nothing.
    fn found(&self) -> String {
        let Self { vehicle, template, wind_mps, updraft_mps } = self;
        let bench = Bench::new();
        let plan =
            ["plan", template, "--grid", "4x4", "--vehicle", vehicle, "--quiet", "-o", "campaign"];
        bench.expect(0, &plan);
        let (wind, updraft) = (wind_mps.to_string(), format!("--updraft={updraft_mps}"));
        bench.expect(0, &["simulate", "campaign", "--quiet", "--wind", &wind, &updraft]);
        let ended = bench.run(&["gap", "campaign", "--json"]);
        let verdict = &ended.json("updraft.gap/1")["verdict"];
        let mut found = String::new();
        for step in verdict["steps"].as_array().unwrap() {
            let _ = write!(found, " {}", step["finding"]);
        }
        if verdict["sensor"]["named"] != false {
            let _ = write!(found, " {}", verdict["sensor"]);
        }
        // Only a ladder with horizontal legs knows the wind by more than its model.
        let is_by_lean =
            verdict["cautions"].to_string().contains("no horizontal leg tells the wind");
        if is_by_lean && *template == TEMPLATES[1]
            || !is_by_lean && *template == TEMPLATES[0] && *wind_mps == 8
        {
            found.push_str(" wind by lean");
        }
        found
    }

    fn name(&self) -> String {
        let Self { vehicle, template, wind_mps, updraft_mps } = self;
        format!("{vehicle}, {template}, wind {wind_mps}, updraft {updraft_mps}")
    }
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let flights = [
        ("airsim-generic-quad", "calibration", 3, 2),
        ("arducopter-sitl", "calibration", 8, -2),
        ("arducopter-sitl", "calibration", 8, 2),
        ("pixel", "calibration", 0, -2),
        ("phantom4", "calibration-counterphase", 5, 1),
    ];
    for (vehicle, template, wind_mps, updraft_mps) in flights {
        let flight = Flight { vehicle, template, wind_mps, updraft_mps };
        assert_eq!(flight.found(), "", "{}", flight.name());
    }
}

/// `cargo test --release --test it nothing_is_found_in_the_whole_matrix -- --ignored --nocapture`
#[test]
#[ignore = "160 flights; see above"]
fn nothing_is_found_in_the_whole_matrix() {
    let (mut count, mut false_alarms) = (0, 0);
    for vehicle in library::names() {
        for template in TEMPLATES {
            for wind_mps in WINDS_MPS {
                for updraft_mps in UPDRAFTS_MPS {
                    let flight = Flight { vehicle, template, wind_mps, updraft_mps };
                    let found = flight.found();
                    println!("{}:{found}", flight.name());
                    count += 1;
                    false_alarms += usize::from(!found.is_empty());
                }
            }
        }
    }
    assert_eq!(false_alarms, 0, "of {count}");
}
