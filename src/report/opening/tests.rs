use serde_json::{Value, json};

use super::*;

/// A drone that hovered: slot, place, mean, and the highest of its 10 s values.
fn hovering(slot: u16, place: [f64; 2], mean: f64, se: f64) -> Value {
    json!({
        "slot": slot, "name": format!("Drone {slot}"), "position_m": place, "height_m": 100.0,
        "mapping": "own", "mean": { "value": mean, "se": se },
        "updraft_mps": [mean - 0.3, mean, mean + 0.3],
        "interval_mps": [[mean - 0.9, mean + 0.3], null, [mean - 0.3, mean + 0.9]],
        "truth_mps": null,
    })
}

/// What a log gives beside its results.
fn logged(slot: u16, from_s: f64, to_s: f64, start: &Value) -> Value {
    json!({
        "slot": slot, "name": format!("Drone {slot}"), "source": "01.BIN", "home_m": null,
        "clock": { "method": "show_rows", "offset_s": 0.0, "residual_s": 0.0, "start": start },
        "windows": [window("hover", from_s, to_s)], "laws": null,
        "trace": { "time_s": [], "height_m": [], "velocity_mps": [], "pulse_phi_us": [] },
        "warnings": [],
    })
}

fn window(kind: &str, from_s: f64, to_s: f64) -> Value {
    let stats = json!({ "median": 0.0, "mean": 0.0, "sd": 0.0, "n": 9, "trimmed": 0.0, "se": 0.0 });
    json!({
        "kind": kind, "label": "", "start_s": from_s, "end_s": to_s, "commanded_mps": 0.0,
        "height_m": 100.0, "velocity_mps": stats, "pulse_us": stats, "pulse_phi_us": stats,
        "tilt_deg": stats, "offset_us": null, "rejected": [],
    })
}

fn flight(name: &str, more: &Value) -> Value {
    let mut flight = json!({
        "name": name, "purpose": if name == "calibration" { "calibration" } else { "measurement" },
        "planned": true, "true_updraft_mps": null, "drones": [], "missing": [], "flock": null,
        "table": [], "map": null,
    });
    for (key, value) in more.as_object().unwrap() {
        flight[key] = value.clone();
    }
    flight
}

fn opening_of(flights: &Value) -> String {
    let analysis = json!({
        "schema": "updraft.analysis/1", "made_by": "updraft", "title": "x", "flights": flights,
        "warnings": [],
    });
    let opening = Opening::of(&serde_json::from_value(analysis).unwrap());
    let mut lines = vec![opening.circumstances.join(" ")];
    lines.extend(opening.air.iter().map(|paragraph| paragraph.join(" ")));
    lines.extend(opening.distrust.iter().map(|doubt| format!("- {doubt}")));
    lines.join("\n")
}

/// A hover over the airfield, with everything known.
fn hover(more: &Value) -> Value {
    let start = json!({ "week": 2421, "tow_ms": 129_618_000 });
    let mut hover = flight(
        "hover",
        &json!({
            "orientation_deg": 90.0,
            "site": { "lat_deg": 47.4733, "lon_deg": 19.0621, "ground_amsl_m": 190.0, "planned": true },
            "drones": [logged(1, 40.0, 149.0, &start), logged(2, 40.0, 149.0, &start)],
            "map": {
                "law": "linear", "time_s": [45.0, 46.0, 47.0],
                "drones": [hovering(1, [10.0, 0.0], 2.9, 0.23), hovering(2, [0.0, 10.0], 2.7, 0.23)],
                "common": {
                    "se_mps": 0.22, "half_width_mps": 0.45, "zero_mps": 0.21, "battery_mps": 0.02,
                    "wind_mps": 0.03, "density_mps": 0.01, "law_mps": 0.02,
                },
            },
            "statistics": {
                "record": {
                    "drones": 2, "length_s": 100.0, "missing_share": 0.0, "running_mean_s": 10.0,
                    "spacing_m": 14.0, "extent_m": 14.0, "sd_mps": 0.1, "common_sd_mps": 0.1,
                },
                "space": null, "time": null, "likelihood": null, "variants": [], "absent": [],
                "wind": {
                    "speed_mps": { "value": 2.8261, "se": 0.0039 }, "from_deg": 271.0,
                    "lean_deg": 4.0, "drones": [], "words": "",
                },
            },
        }),
    );
    for (key, value) in more.as_object().unwrap() {
        hover[key] = value.clone();
    }
    hover
}

#[test]
fn a_measured_updraft_is_told_with_its_error_place_time_and_wind() {
    insta::assert_snapshot!(opening_of(&json!([hover(&json!({}))])));
}

#[test]
fn an_updraft_within_its_error_is_not_told_from_zero() {
    let mut hover = hover(&json!({ "simulated": true }));
    hover["map"]["posterior"] = json!({
        "fleet": { "value": -0.145, "se": 0.47 }, "zero_shift_mps": 0.0, "uniform_probability": 0.5,
        "truth": {
            "drones": 2, "values": 6, "rms_mps": 0.4, "bias_mps": 0.1, "rms_without_bias_mps": 0.1,
            "inside_share": 0.752, "means_inside_share": 1.0,
        },
    });
    for drone in hover["map"]["drones"].as_array_mut().unwrap() {
        drone["truth_mps"] = json!([-0.4, -0.39, -0.38]);
    }
    insta::assert_snapshot!(opening_of(&json!([hover])));
}

#[test]
fn logs_without_a_plan_clock_or_calibration_say_so() {
    let mut hover = hover(&json!({
        "planned": false, "orientation_deg": null, "statistics": null, "map": null,
        "site": { "lat_deg": -33.9, "lon_deg": -70.66 },
        "missing": [{ "slot": 3, "reason": "no log" }],
        "warnings": ["no calibration was given: the air cannot be measured without laws"],
    }));
    for drone in hover["drones"].as_array_mut().unwrap() {
        drone["clock"]["start"] = Value::Null;
    }
    insta::assert_snapshot!(opening_of(&json!([hover])));
}

#[test]
fn a_calibration_alone_tells_its_laws_and_what_they_do_not() {
    let start = json!({ "week": 2421, "tow_ms": 129_618_000 });
    let mut drone = logged(1, 60.0, 500.0, &start);
    drone["windows"] = json!([window("leg_up", 60.0, 500.0)]);
    let parameter = |name: &str, unit: &str, value: f64, se: f64| json!({ "name": name, "unit": unit, "estimate": { "value": value, "se": se }, "held": false });
    drone["laws"] = json!({
        "signed_quadratic": null, "signed_quadratic_held": null, "sigma_added_us": null,
        "linear": {
            "parameters": [parameter("A'", "us/(m/s)", 26.88, 2.6), parameter("u0", "us", 1540.2, 9.8)],
            "covariance": [], "points": 14, "chi2": 12.0, "chi2_reduced": 1.0, "p_value": 0.5,
            "dof": 12, "rms_us": 1.0, "other_minima": [], "warnings": [],
        },
    });
    let calibration = flight("calibration", &json!({ "drones": [drone], "simulated": true }));
    insta::assert_snapshot!(opening_of(&json!([calibration])));
}

#[test]
fn nothing_at_all_and_many_flights_are_summed_up() {
    assert_eq!(opening_of(&json!([])), "There is no flight in this analysis.");
    let start = json!({ "week": 2421, "tow_ms": 129_618_000 });
    let one = hover(&json!({ "drones": [logged(1, 40.0, 149.0, &start)] }));
    insta::assert_snapshot!(opening_of(&json!([one, one, one, hover(&json!({}))])));
}
