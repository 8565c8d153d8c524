//! Page and tables of turbulence.

use std::fs;

use super::support::{Fleet, settings};
use crate::products::support::{can_run, python};
use updraft::analysis::result::Analysis;
use updraft::sim::air::spec::{self, Air};
use updraft::workflow::analyze::analyze_campaign;
use updraft::workflow::host::Quiet;
use updraft::workflow::simulate::{Simulation, simulate};

/// Readers of the NetCDF files.
const READ: &str = include_str!("../products/read.py");

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
    let mut settings = settings();
    settings.options.mixed_layer_depth_m = Some(10.0);
    let Err(error) = analyze_campaign(&host, &root, &settings) else { panic!("was analysed") };
    let error = error.to_string();
    assert!(error.starts_with("--mixed-layer-depth 10: the drones of hover were"), "{error}");
    assert!(!root.join("analysis.json").exists());
    settings.options.mixed_layer_depth_m = Some(1200.0);
    analyze_campaign(&host, &root, &settings).unwrap();
    let page = fs::read_to_string(root.join("report/turbulence.html")).unwrap();
    for words in [
        "Convective velocity scale",
        "Variance of w, up",
        "Simulated flights",
        "href=\"index.html\"",
        "Heat flux",
    ] {
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
    let analysis: Analysis =
        serde_json::from_slice(&fs::read(root.join("analysis.json")).unwrap()).unwrap();
    let convective = analysis.flights[1].turbulence.as_ref().unwrap().convective.unwrap();
    let share = convective.height_m / 1200.0;
    let profile = 1.8 * share.powf(2.0 / 3.0) * (1.0 - 0.8 * share).powi(2);
    for (scale, variance) in of("", "convective_velocity").iter().zip([value, low, high]) {
        assert!((scale.powi(2) * profile / variance - 1.0).abs() < 1e-3, "{scale} {variance}");
    }
    assert_eq!(quantities.iter().filter(|row| row[3] == "mixed_layer_depth").count(), 1);
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
    let text =
        fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/products.md")).unwrap();
    let documented = |file: &str| {
        let mut blocks =
            text.split("```python\n").skip(1).filter_map(|rest| rest.split("```").next());
        blocks.find(|block| block.contains(file)).unwrap()
    };
    if can_run("pandas") {
        let block = documented("turbulence.csv");
        let said = python(
            folder.path(),
            &format!("{block}\nprint(fleet.loc['variance_w'].value, len(w))"),
        );
        let count: usize = said.split_whitespace().last().unwrap().parse().unwrap();
        assert!(count > 10, "{said}");
    }
    let fields = root.join("fields");
    assert_eq!(fields.join("turbulence.nc").is_file(), cfg!(feature = "netcdf"));
    if cfg!(feature = "netcdf") && can_run("xarray, netCDF4, pandas") {
        let said = python(&fields, &format!("{READ}\nturbulence()"));
        assert!(said.contains("quantities "), "{said}");
        python(folder.path(), documented("turbulence.nc"));
    }
    if cfg!(feature = "netcdf") && can_run("compliance_checker, netCDF4") {
        let said = python(&fields, &format!("{READ}\ncomplies('turbulence.nc')"));
        assert_eq!(said.matches("All tests passed!").count(), 1, "{said}");
    }
}
