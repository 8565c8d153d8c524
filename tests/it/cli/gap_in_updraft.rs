//! What a model lacks, hidden in air that rises or sinks all day: both bend how the pulse goes with climb.

use super::support::Bench;

/// Hides one effect in steady air without wind, and expects it to be named, with its size and the updraft inside their
/// intervals. Without wind the updraft is known from nothing but that bend.
fn expect_named(
    (vehicle, protocol): (&str, &str),
    updraft: f64,
    (effect, hidden, size): (&str, &str, f64),
) {
    let bench = Bench::new();
    let blows = format!("--updraft={updraft}");
    let air = ["blind", "hide", "--air", "still", &blows, "--seed", "11"];
    let flight = ["--vehicle", vehicle, "--protocol", protocol, "--grid", "3x3"];
    let hidden = format!("{effect}={hidden}");
    let game = ["--effect", &hidden, "--quiet", "-o", "game"];
    bench.expect(0, &[&air[..], &flight, &game].concat());
    let ended = bench.run(&["gap", "game", "--json"]);
    let verdict = &ended.json("updraft.gap/1")["verdict"];
    let [step] = verdict["steps"].as_array().unwrap().as_slice() else { panic!("{ended}") };
    assert_eq!(step["finding"]["effect"], effect, "{step}");
    let found = &step["finding"]["parameters"][0]["value"];
    let of = |name: &str| found[name].as_f64().unwrap();
    assert!((of("low")..of("high")).contains(&size), "{found}");
    let air = |name: &str| verdict["noise"][name].as_f64().unwrap();
    let off_mps = (air("updraft_mps") - updraft).abs();
    assert!(off_mps < air("updraft_half_mps") && off_mps < 0.5, "{}", verdict["noise"]);
}

/// A curve in -2 m/s was taken for still air, and nothing.
#[test]
fn a_curve_of_the_thrust_is_named_with_the_updraft_that_it_was_flown_in() {
    expect_named(("pixel", "paper"), -2.0, ("thrust-curve", "0.5", 0.5));
}

/// Inflow in -1.5 m/s was something unknown of the climb in -3.6 m/s, and a share of 0.15 without the induced velocity while the
/// drones could not differ in it.
#[test]
fn inflow_is_named_with_the_updraft_that_it_was_flown_in() {
    // The share that 18 us/(m/s) in hover are.
    expect_named(("airsim-generic-quad", "enhanced"), -1.5, ("rotor-inflow", "18", 0.2628));
}

/// In gusts, a drag of the rotors was told as one of the body while only the body was fitted beside an updraft that nobody knows.
#[test]
fn a_drag_of_the_rotors_in_gusts_is_no_body() {
    let bench = Bench::new();
    let air = ["blind", "hide", "--air", "calm", "--wind", "4", "--seed", "61043"];
    let game = ["--grid", "3x3", "--effect", "blade-flapping=0.03", "--quiet", "-o", "game"];
    bench.expect(0, &[&air[..], &game].concat());
    let ended = bench.run(&["gap", "game", "--json"]);
    let verdict = &ended.json("updraft.gap/1")["verdict"];
    let [step] = verdict["steps"].as_array().unwrap().as_slice() else { panic!("{ended}") };
    assert_eq!(step["finding"]["effects"], serde_json::json!(["blade-flapping", "momentum-drag"]));
}
