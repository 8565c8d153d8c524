//! The air on the page, which telemetry tells, against that of the logs when they are home.

use std::fs;

use crate::cli::guided::Flight;
use crate::cli::support::Bench;
use crate::ports::free_port;

/// Number before or after some words of the station.
fn number(said: &str, before: &str, after: &str) -> f64 {
    let (_, rest) = said.split_once(before).unwrap_or_else(|| panic!("no {before:?}:\n{said}"));
    rest.split_once(after).unwrap().0.trim().parse().unwrap()
}

#[test]
#[ignore = "takes minutes: cargo test --release --test it -- --ignored live::air"]
fn the_air_of_telemetry_is_that_of_the_logs() {
    let bench = Bench::new();
    for folder in ["campaign", "drones"] {
        let plan = ["plan", "campaign", "--grid", "4x4", "--duration", "150", "-o", folder];
        bench.expect(0, &plan);
    }
    bench.expect(0, &["simulate", "campaign", "--flight", "calibration", "--air", "still"]);
    // The hover is not flown yet, which is told.
    bench.expect(3, &["analyze", "campaign"]);
    let (station, live) = (free_port().to_string(), free_port().to_string());
    let air = ["--air", "field:sd=0.5,lambda=145,tau=120", "--seed", "5", "--speed", "2"];
    let _fleet = bench.fleet(&station, &[&["--flight", "hover"][..], &air].concat());
    let link = format!("udpin:{station}");
    let fly = ["fly", "campaign", "--flight", "hover", "--connect", &link, "--set-params", "--yes"];
    let page = ["--lead", "30", "--wait", "20", "--live", &live];
    let mut flight = Flight::of(&bench, &[&fly[..], &page].concat());
    flight.hear("performing");
    std::thread::sleep(std::time::Duration::from_mins(1));
    flight.hear("have landed");
    flight.hear("The page's air was");
    assert_eq!(flight.end(), Some(0), "{}", flight.said());
    let said = flight.said();
    let apart_mps = number(&said, "The page's air was ", "m/s too");
    let stated_mps = number(&said, "(it stated +- ", "m/s)");
    let correlation = number(&said, ", correlation ", ", ");
    assert!(apart_mps < stated_mps, "{said}");
    assert!(correlation > 0.95, "{said}");
    // Nothing of the page is part of the campaign's numbers.
    let analysed = |path: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(bench.path(path)).unwrap()).unwrap()
    };
    assert_eq!(analysed("campaign/analysis.json")["flights"].as_array().unwrap().len(), 1);
    // The battery that these drones tell of acts on nothing, and nothing is corrected for it.
    let hold = ["analyze", "campaign/hover", "--hold", "campaign/analysis.json", "-o", "hover"];
    bench.expect(0, &hold);
    let flights = analysed("hover/analysis.json");
    let map = &flights["flights"][0]["map"];
    assert!(map["posterior"].is_object() && map["battery"].is_null(), "{}", map["battery"]);
}
