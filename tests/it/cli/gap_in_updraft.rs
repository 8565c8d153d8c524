//! What a model lacks, hidden in air that rises or sinks all day: both bend how the pulse goes with climb.

use super::support::Bench;

/// Without wind the updraft is known from nothing but that bend. A curve in -2 m/s was taken for still air, and nothing.
#[test]
fn a_curve_of_the_thrust_is_named_with_the_updraft_that_it_was_flown_in() {
    let bench = Bench::new();
    let air = ["blind", "hide", "--air", "still", "--updraft=-2", "--seed", "11"];
    let flight = ["--vehicle", "pixel", "--protocol", "paper", "--grid", "3x3"];
    let hidden = ["--effect", "thrust-curve=0.5", "--quiet", "-o", "game"];
    bench.expect(0, &[&air[..], &flight, &hidden].concat());
    let ended = bench.run(&["gap", "game", "--json"]);
    let verdict = &ended.json("updraft.gap/1")["verdict"];
    let [step] = verdict["steps"].as_array().unwrap().as_slice() else { panic!("{ended}") };
    assert_eq!(step["finding"]["effect"], "thrust-curve", "{step}");
    let size = &step["finding"]["parameters"][0]["value"];
    let of = |name: &str| size[name].as_f64().unwrap();
    assert!((of("low")..of("high")).contains(&0.5), "{size}");
    let air = |name: &str| verdict["noise"][name].as_f64().unwrap();
    let off_mps = (air("updraft_mps") + 2.0).abs();
    assert!(off_mps < air("updraft_half_mps") && off_mps < 0.5, "{}", verdict["noise"]);
}
