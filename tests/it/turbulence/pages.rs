//! Page and tables of turbulence.

use std::fs;

use super::support::{Fleet, settings};
use crate::products::support::{can_run, python};
use updraft::sim::air::spec::{self, Air};
use updraft::workflow::analyze::analyze_campaign;
use updraft::workflow::host::Quiet;
use updraft::workflow::simulate::{Simulation, simulate};

#[test]
fn a_campaign_gets_a_page_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().join("my-campaign");
    let fleet = Fleet { side: 2, spacing_m: 10.0, hover_s: 300.0 };
    let host = Quiet::default();
    for (index, flight) in fleet.plan(&root).iter().enumerate() {
        let specs =
            if index == 0 { "still" } else { "von-karman:sd=0.4,length=20,modes=300,wind=3" };
        let wind = if index == 0 { [0.0; 3] } else { [3.0, 0.0, 0.0] };
        let air = Air::new(wind, &spec::load(specs).unwrap());
        simulate(&host, flight, &flight.read_plan().unwrap(), &Simulation::new(air, 7)).unwrap();
    }
    analyze_campaign(&host, &root, &settings()).unwrap();
    let page = fs::read_to_string(root.join("report/turbulence.html")).unwrap();
    for words in ["Variance of w, up", "Simulated flights", "href=\"index.html\"", "Heat flux"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(
        !page.contains("http://") || page.contains("http://www.w3.org/"),
        "no request leaves the page"
    );
    let index = fs::read_to_string(root.join("report/index.html")).unwrap();
    assert!(index.contains("turbulence.html"));
    assert!(root.join("report/figures/turbulence-spectra-hover.svg").is_file());
    let read = |name: &str| {
        let text = fs::read_to_string(root.join("fields").join(name)).unwrap();
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        reader
            .records()
            .map(|row| row.unwrap().iter().map(str::to_owned).collect())
            .collect::<Vec<Vec<String>>>()
    };
    let quantities = read("turbulence.csv");
    let of = |drone: &str, quantity: &str| {
        let row = quantities.iter().find(|row| row[1] == drone && row[3] == quantity).unwrap();
        [5, 6, 7].map(|column| row[column].parse::<f64>().unwrap())
    };
    let [value, low, high] = of("", "variance_w");
    assert!(low < value && value < high && (value / 0.16 - 1.0).abs() < 0.5, "{value}");
    let drone = quantities.iter().find(|row| !row[1].is_empty()).unwrap()[1].clone();
    assert!(of(&drone, "variance_w")[0] > 0.0);
    let spectra = read("turbulence-spectra.csv");
    assert!(spectra.iter().any(|row| row[3] == "w" && row[1].is_empty()));
    assert!(spectra.iter().any(|row| row[3] == "u") && spectra.iter().any(|row| row[3] == "uw"));
    // Sides and diagonals of a square are one class, which begins at each multiple of the neighbours' distance.
    let pairs = read("turbulence-pairs.csv");
    let without_lag: Vec<_> = pairs.iter().filter(|row| row[3] == "0").collect();
    assert_eq!(without_lag.len(), 1, "{without_lag:?}");
    assert_eq!((without_lag[0][1].as_str(), without_lag[0][2].as_str()), ("11.38", "6"));
    assert!(!read("turbulence-coherence.csv").is_empty());
    if can_run("pandas") {
        let text =
            fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/products.md")).unwrap();
        let blocks = text.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next());
        let block = blocks.filter(|block| block.contains("turbulence")).last().unwrap();
        let said = python(
            folder.path(),
            &format!("{block}\nprint(fleet.loc['variance_w'].value, len(w))"),
        );
        let count: usize = said.split_whitespace().last().unwrap().parse().unwrap();
        assert!(count > 10, "{said}");
    }
}
