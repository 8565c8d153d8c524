//! Whether the map's intervals hold the truth: simulated campaigns, each with its own values of what
//! the analysis only assumes (battery, warming motors, rotor drag), analysed with the vehicle as its
//! file has it.
//!
//! Values of one campaign share the error of its zero, so that campaigns are counted and not values.
//! The bulk of the evidence is in two longer runs, which print their shares:
//!
//! ```text
//! cargo test --release --test it analysis::coverage -- --ignored --nocapture
//! cargo test --release --lib coverage -- --ignored --nocapture
//! ```
//!
//! `UPDRAFT_CAMPAIGNS` sets the campaigns of each kind of air in the first one (30), `UPDRAFT_FIRST_SEED`
//! the seed of its first (0), `UPDRAFT_VEHICLE` the only vehicle.

#![expect(clippy::unwrap_used, reason = "a test fails")]
#![expect(clippy::print_stdout, reason = "the long runs print their shares")]

use std::path::Path;
use std::process::Command;

use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use updraft::analysis::result::{Analysis, CommonError, TruthCheck};
use updraft::base::rng::{Purpose, stream};
use updraft::vehicle::library;

/// The air of a field day: correlated updrafts and gusts in a light wind.
const FIELD: &str = "--air field:sd=0.5,lambda=145,tau=186,wind=0 \
    --air von-karman:sd=0.2,length=30 --calibration-air field:sd=0.5,lambda=145,tau=186,wind=0 \
    --calibration-air von-karman:sd=0.2,length=30 --wind 2 --calibration-wind 2";
const STILL: &str = "--updraft 0";
const SAME_WIND: &str = "--updraft 0 --wind 5 --calibration-wind 5";
const OTHER_WIND: &str = "--updraft 0 --wind 5 --calibration-wind 1";
const AIRS: [(&str, &str); 4] = [
    ("still", STILL),
    ("the same wind", SAME_WIND),
    ("another wind", OTHER_WIND),
    ("turbulent", FIELD),
];

/// What one campaign says of itself.
struct Outcome {
    truth: TruthCheck,
    common: CommonError,
}

fn updraft(arguments: &str, folder: &Path) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_updraft"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Flies and analyses a campaign. `size` are options that make it shorter.
fn campaign(vehicle: &str, air: &str, size: &str, seed: u64) -> Outcome {
    let folder = tempfile::tempdir().unwrap();
    let mut rng: Pcg64 = stream(seed, 0, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    // The stated doubts: 5 % of the battery's exponent, 3 us of warming up, and 15 % of what wind
    // does, from the drag that tells the wind and the lift that it gives.
    let (exponent, warm_us) = (1.0 + 0.05 * normal(), 3.0 * normal());
    let (drag, lift) = (0.021 * (1.0 + 0.075 * normal()), 0.5 + 0.035 * normal());
    let truth = match vehicle {
        "pixel" => format!(
            "--effect battery.exponent={exponent:.4} --effect motor-thermal.drift_us={warm_us:.3} \
             --effect motor-thermal.time_s=100 --effect blade-flapping.drag_per_weight={drag:.5} \
             --effect translational-lift.inflow_share={lift:.4}"
        ),
        _ => String::new(),
    };
    let run = format!(
        "run --no-study --direct --truth --no-progress -q --vehicle {vehicle} --seed {seed} {size} {air} \
         {truth} -o c"
    );
    updraft(&run, folder.path());
    if vehicle == "pixel" {
        let assumed = toml::to_string(&library::builtin(vehicle).unwrap()).unwrap();
        for flight in ["calibration", "hover"] {
            let file = folder.path().join("c").join(flight).join("vehicle.toml");
            std::fs::write(file, &assumed).unwrap();
        }
    }
    let said = updraft("analyze c --no-report --json --no-progress", folder.path());
    let said: serde_json::Value = serde_json::from_str(&said).unwrap();
    let analysis: Analysis = serde_json::from_value(said["analysis"].clone()).unwrap();
    let map = analysis.flights.into_iter().find_map(|flight| flight.map).unwrap();
    Outcome { truth: map.truth.unwrap(), common: map.common.unwrap() }
}

/// Wilson's 95 % interval of a share seen in `n` independent campaigns.
fn wilson(share: f64, n: f64) -> [f64; 2] {
    let z2 = 1.96_f64.powi(2);
    let middle = (share + z2 / (2.0 * n)) / (1.0 + z2 / n);
    let half = 1.96 / (1.0 + z2 / n) * (share * (1.0 - share) / n + z2 / (4.0 * n * n)).sqrt();
    [middle - half, middle + half]
}

/// Flies campaigns, prints what they gave, and returns the share of values inside of their intervals.
fn share(vehicle: &str, (name, air): (&str, &str), size: &str, seeds: std::ops::Range<u64>) -> f64 {
    let outcomes: Vec<Outcome> =
        seeds.into_par_iter().map(|seed| campaign(vehicle, air, size, seed)).collect();
    let n = outcomes.len() as f64;
    let mean = |value: fn(&Outcome) -> f64| outcomes.iter().map(value).sum::<f64>() / n;
    let share = mean(|one| one.truth.inside_share.unwrap());
    let [low, high] = wilson(share, n);
    println!(
        "{vehicle}, {name}: {n} campaigns, {:.1} % of values inside ({:.0} to {:.0} %), {:.1} % of \
         means; rms error {:.3} m/s, without the bias {:.3}, common error stated {:.3}",
        100.0 * share,
        100.0 * low,
        100.0 * high,
        100.0 * mean(|one| one.truth.means_inside_share.unwrap()),
        mean(|one| one.truth.rms_mps.powi(2)).sqrt(),
        mean(|one| one.truth.rms_without_bias_mps.powi(2)).sqrt(),
        mean(|one| one.common.se_mps.powi(2)).sqrt(),
    );
    share
}

/// Shorter than the paper's, with all that matters: a ladder up and down, and a hover.
const SMALL: &str = "--grid 1x2 --speeds 1,2,3 --duration 40";
const PAPER: &str = "--grid 2x2 --duration 120";

#[test]
fn a_few_campaigns_hold_what_they_state() {
    for air in [AIRS[0], AIRS[2], AIRS[3]] {
        let share = share("pixel", air, SMALL, 0..4);
        assert!(share > 0.7, "{}: {share} of four campaigns", air.0);
    }
    let air = AIRS[0];
    assert!(share("airsim-generic-quad", air, SMALL, 0..2) > 0.7);
}

#[test]
fn a_battery_that_is_not_corrected_for_would_be_seen() {
    let folder = tempfile::tempdir().unwrap();
    let run = format!(
        "run --no-study --direct --truth --no-progress -q --vehicle pixel {SMALL} {STILL} -o c"
    );
    updraft(&run, folder.path());
    let found = |options: &str| -> TruthCheck {
        let analyze = format!("analyze c --no-report --json --no-progress {options}");
        let said: serde_json::Value =
            serde_json::from_str(&updraft(&analyze, folder.path())).unwrap();
        let analysis: Analysis = serde_json::from_value(said["analysis"].clone()).unwrap();
        analysis.flights.into_iter().find_map(|flight| flight.map).unwrap().truth.unwrap()
    };
    let (with, without) = (found(""), found("--no-battery"));
    assert!(with.rms_mps < 0.05, "{with:?}");
    assert!(without.rms_mps > 3.0 * with.rms_mps, "{without:?} {with:?}");
}

#[test]
#[ignore = "half an hour on two cores in release mode"]
fn many_campaigns_hold_95_percent() {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let first = number("UPDRAFT_FIRST_SEED").unwrap_or(0);
    let campaigns = number("UPDRAFT_CAMPAIGNS").unwrap_or(30);
    let seeds = first..first + campaigns;
    let only = std::env::var("UPDRAFT_VEHICLE").ok();
    for vehicle in ["pixel", "airsim-generic-quad"] {
        if only.as_ref().is_some_and(|only| only != vehicle) {
            continue;
        }
        for air in AIRS {
            let share = share(vehicle, air, PAPER, seeds.clone());
            let [_, high] = wilson(share, campaigns as f64);
            assert!(high >= 0.93, "{vehicle} in {} air: {share}", air.0);
        }
    }
}
