//! A campaign of nine drones from logs to page: `cargo bench --bench analyze`.
//!
//! Both flights are flown once by the simulator into a temporary folder, with the firmware's whole set
//! of messages: logs of 19 and 29 MB, 430 MB together. `UPDRAFT_DRONES` flies another square number.

use std::path::Path;
use std::sync::LazyLock;

use divan::Bencher;
use divan::counter::BytesCount;
use nalgebra::Vector3;
use tempfile::TempDir;
use updraft::analysis::result::Analysis;
use updraft::analysis::{AnalysisOptions, FlightInput, LogInput, analyze};
use updraft::base::json::write_json;
use updraft::base::time::GpsTime;
use updraft::flight::{Flight, FlightOptions};
use updraft::mission::Plan;
use updraft::mission::resolve::{Override, resolve};
use updraft::report::{Provenance, render};
use updraft::sim::{FlightSetup, Hooks, Uniform, fly_to_file};
use updraft::vehicle::library::builtin;

/// Drones of the campaign.
const DRONES: i64 = 9;

struct Campaign {
    plans: Vec<Plan>,
    logs: Vec<Vec<LogInput>>,
    bytes: u64,
    _folder: TempDir,
}

static CAMPAIGN: LazyLock<Campaign> = LazyLock::new(flown);

fn flown() -> Campaign {
    let named = std::env::var("UPDRAFT_DRONES").ok().and_then(|count| count.parse().ok());
    let overrides = [
        Override::remove("grid.rows"),
        Override::remove("grid.columns"),
        Override::new("grid.drones", named.unwrap_or(DRONES)),
    ];
    let mission = resolve("campaign", &overrides).expect("the template is built in");
    let plans: Vec<Plan> = mission.flights.into_iter().map(|flight| flight.plan).collect();
    let folder = TempDir::new().expect("a folder");
    let (mut logs, mut bytes) = (Vec::new(), 0);
    for (number, plan) in plans.iter().enumerate() {
        let updraft_mps = number as f64;
        let show = plan.to_show();
        let flown = plan.slots.iter().zip(&show.drones).map(|(slot, drone)| {
            let path = folder.path().join(format!("{number}-{:03}.BIN", slot.slot));
            let setup = FlightSetup {
                vehicle: &builtin(&plan.vehicle).expect("a built-in vehicle"),
                trajectory: &drone.trajectory,
                home_m: slot.home_m.into(),
                frame: plan.site.frame(),
                atmosphere: &Uniform(Vector3::new(0.0, 0.0, updraft_mps)),
                seed: 1,
                drone: slot.slot,
                start: GpsTime { week: 2445, tow_ms: 442_755_000 },
                lights: &[],
                full_logs: true,
                hooks: Hooks::default(),
            };
            fly_to_file(&setup, &path).expect("a flight");
            bytes += size(&path);
            LogInput { slot: Some(slot.slot), path, ..LogInput::default() }
        });
        logs.push(flown.collect());
    }
    Campaign { plans, logs, bytes, _folder: folder }
}

fn size(path: &Path) -> u64 {
    path.metadata().expect("a log").len()
}

fn analysed() -> Analysis {
    let Campaign { plans, logs, .. } = &*CAMPAIGN;
    let inputs: Vec<FlightInput<'_>> = (plans.iter().zip(logs))
        .map(|(plan, logs)| FlightInput {
            name: "flight",
            plan: Some(plan),
            logs,
            ..FlightInput::default()
        })
        .collect();
    analyze("bench", &inputs, &AnalysisOptions::default(), None, &|_, _| {}).expect("results")
}

fn main() {
    divan::main();
}

/// What the analysis takes from one hover's log.
#[divan::bench]
fn one_flight_from_its_log(bencher: Bencher<'_, '_>) {
    let log = &CAMPAIGN.logs[1][0].path;
    bencher
        .counter(BytesCount::new(size(log)))
        .bench(|| Flight::open(log, FlightOptions::default()).expect("a flight"));
}

#[divan::bench(sample_count = 10)]
fn logs_to_analysis(bencher: Bencher<'_, '_>) {
    let bytes = CAMPAIGN.bytes;
    bencher.counter(BytesCount::new(bytes)).bench(analysed);
}

#[divan::bench(sample_count = 10)]
fn analysis_to_page(bencher: Bencher<'_, '_>) {
    let analysis = analysed();
    bencher.bench(|| render(&analysis, &Provenance::default()).expect("a page"));
}

#[divan::bench(sample_count = 10)]
fn analysis_to_json(bencher: Bencher<'_, '_>) {
    let analysis = analysed();
    bencher.bench(|| write_json(&mut std::io::sink(), &analysis).expect("JSON"));
}
