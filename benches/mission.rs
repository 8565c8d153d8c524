//! From a template to the bytes of all files of a flight.

use updraft::campaign::write::FlightFiles;
use updraft::check::{CheckInput, CheckReport, check};
use updraft::mission::resolve::{Mission, Override, resolve};
use updraft::show::Show;

fn main() {
    divan::main();
}

const COUNTS: [i64; 2] = [49, 5000];

/// The built-in template for this many drones.
fn mission(template: &str, count: i64) -> Mission {
    let overrides = [
        Override::remove("grid.rows"),
        Override::remove("grid.columns"),
        Override::new("grid.drones", count),
    ];
    resolve(template, &overrides).expect("the template is built in")
}

fn checked(mission: &Mission, show: &Show) -> CheckReport {
    let plan = &mission.flights[0].plan;
    check(&CheckInput::new(show, &plan.limits).with_fence(Some(&plan.fence)))
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn plan(bencher: divan::Bencher<'_, '_>, count: i64) {
    bencher.bench(|| mission("calibration", count));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn safety(bencher: divan::Bencher<'_, '_>, count: i64) {
    let mission = mission("calibration", count);
    let show = mission.flights[0].plan.to_show();
    bencher.bench(|| checked(&mission, &show));
}

#[divan::bench(args = COUNTS, sample_count = 5)]
fn files(bencher: divan::Bencher<'_, '_>, count: i64) {
    let mission = mission("calibration", count);
    let show = mission.flights[0].plan.to_show();
    bencher.bench(|| FlightFiles::of(&mission.flights[0], &show).expect("it is safe"));
}

/// What `updraft plan` does but for the disk.
#[divan::bench(args = COUNTS, sample_count = 3)]
fn plan_check_and_files(bencher: divan::Bencher<'_, '_>, count: i64) {
    bencher.bench(|| whole("calibration", count));
}

/// The same in counter-phase, where neighbours pass each other all the time.
#[divan::bench(args = COUNTS, sample_count = 3)]
fn counter_phase(bencher: divan::Bencher<'_, '_>, count: i64) {
    bencher.bench(|| whole("calibration-counterphase", count));
}

fn whole(template: &str, count: i64) -> (CheckReport, FlightFiles) {
    let mission = mission(template, count);
    let show = mission.flights[0].plan.to_show();
    let report = checked(&mission, &show);
    (report, FlightFiles::of(&mission.flights[0], &show).expect("it is safe"))
}
