//! `updraft compare`: campaigns side by side, what is refused, and flights of several campaigns in one analysis.

use std::collections::BTreeSet;
use std::fs;
use std::sync::OnceLock;

use crate::cli::support::{Bench, contents};

/// Two campaigns of four drones, flown once with two seeds.
fn flown() -> &'static Bench {
    static FLOWN: OnceLock<Bench> = OnceLock::new();
    FLOWN.get_or_init(|| {
        let bench = Bench::new();
        for (folder, seed) in [("monday", "1"), ("tuesday", "2")] {
            let run = ["run", "--direct", "--no-study", "--quiet", "-o", folder, "--seed", seed];
            let small =
                ["--grid", "2x2", "--duration", "40", "--height", "40", "--speeds", "1,2,3"];
            let legs = ["--leg", "12", "--hover", "6"];
            bench.expect(0, &[&run[..], &small, &legs].concat());
        }
        bench
    })
}

#[test]
fn two_campaigns_stand_side_by_side() {
    let bench = flown();
    let done = bench.expect(0, &["compare", "monday", "tuesday", "-o", "both"]);
    assert!(done.out.contains("tuesday against monday"), "{done}");
    assert!(done.out.contains("The fleet as a whole (4 drones in both)"), "{done}");
    assert!(done.err.contains("simulated with the seeds 1 and 2"), "{done}");
    let page = fs::read_to_string(bench.path("both/report/index.html")).unwrap();
    for figure in ["compare-laws-", "compare-drones-", "compare-maps-"] {
        assert!(page.contains(&format!("id=\"{figure}tuesday-")), "{figure} is not on the page");
    }
    let json =
        bench.expect(0, &["compare", "monday", "tuesday", "--json"]).json("updraft.compare/1");
    let file: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("both/compare.json")).unwrap()).unwrap();
    assert_eq!(json, file);
    assert_eq!(file["laws"][0]["pair"]["other"], "tuesday/calibration");
    assert_eq!(file["maps"][0]["places"]["places"].as_array().unwrap().len(), 4);
    let quiet = bench.expect(0, &["compare", "monday", "tuesday", "-o", "both", "--quiet"]);
    assert_eq!(quiet.out.trim(), "both/report/index.html");
}

#[test]
fn what_is_written_depends_on_the_campaigns_alone() {
    let bench = flown();
    let mut made = Vec::new();
    for threads in ["1", "4"] {
        let args = ["compare", "monday", "tuesday", "-o", "again", "--quiet"];
        let mut command = bench.command(&args);
        assert!(command.env("RAYON_NUM_THREADS", threads).status().unwrap().success());
        made.push(contents(&bench.path("again")));
    }
    assert_eq!(made[0], made[1]);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let bench = flown();
    let says = |code: i32, args: &[&str], words: &str| {
        let ended = bench.expect(code, &[&["compare"], args].concat());
        assert!(ended.err.contains(words), "{ended}");
    };
    says(2, &["monday", "monday/analysis.json"], "are the same: give two that differ");
    fs::create_dir_all(bench.path("copy")).unwrap();
    fs::copy(bench.path("monday/analysis.json"), bench.path("copy/analysis.json")).unwrap();
    says(2, &["monday", "copy"], "are the same analysis");
    says(2, &["monday"], "give two campaigns or more, or one with --mast");
    says(1, &["monday", "nowhere"], "nowhere");
    says(5, &["monday", "monday/hover"], "has no analysis.json");
    says(2, &["monday", "tuesday", "-o", "monday"], "would be overwritten");
    fs::write(bench.path("broken.json"), "{\"schema\": \"updraft.analysis/1\", \"made_by\": ")
        .unwrap();
    says(2, &["monday", "broken.json"], "broken.json");
    fs::write(bench.path("newer.json"), "{\"schema\": \"updraft.analysis/2\"}").unwrap();
    says(2, &["monday", "newer.json"], "was made by a newer updraft");
    says(2, &["monday", "tuesday/hover/plan.json"], "is no analysis");
    let mut hover: serde_json::Value =
        serde_json::from_slice(&fs::read(bench.path("tuesday/analysis.json")).unwrap()).unwrap();
    let flights = hover["flights"].as_array_mut().unwrap();
    flights.retain(|flight| flight["purpose"] == "measurement");
    fs::write(bench.path("hover.json"), hover.to_string()).unwrap();
    says(3, &["monday", "hover.json"], "monday/calibration has no counterpart");
    hover["flights"][0]["purpose"] = "calibration".into();
    fs::write(bench.path("other.json"), hover.to_string()).unwrap();
    fs::write(bench.path("hover.json"), {
        hover["flights"][0]["purpose"] = "measurement".into();
        hover.to_string()
    })
    .unwrap();
    says(5, &["hover.json", "other.json"], "no flight in common");
}

/// The rows of two flights named `hover` were one flight's, twice.
#[test]
fn flights_of_several_campaigns_are_kept_apart() {
    let bench = flown();
    bench.expect(0, &["analyze", "monday", "tuesday", "-o", "together", "--quiet"]);
    let table = fs::read_to_string(bench.path("together/fields/updraft.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let keys: BTreeSet<[&str; 3]> = rows.iter().map(|row| [row[0], row[1], row[2]]).collect();
    assert_eq!(keys.len(), rows.len(), "rows that are alike");
    let flights: BTreeSet<&str> = rows.iter().map(|row| row[0]).collect();
    assert_eq!(flights.into_iter().collect::<Vec<_>>(), ["monday/hover", "tuesday/hover"]);
}
