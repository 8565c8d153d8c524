//! Flies a campaign (the paper's ladder, and a hover) in a foreign world with air of a known kind, and writes the true
//! air beside it: what maps are held against.
//!
//! ```text
//! cargo run --release --example foreign_campaign -- gusty 7 FOLDER
//! updraft analyze FOLDER
//! ```
//!
//! More arguments set values of the campaign's templates: `'calibration.legs.speeds_mps=[3, 6]'`.
//!
//! The kind is `still`, `field`, `gusty`, `advected` or `wind-change`. `truth.csv` has the mean of the true vertical air
//! speed over the 10 s around each second of the hover.

#![expect(clippy::print_stderr, reason = "it says what went wrong")]

use std::error::Error;
use std::fmt::Write as _;
use std::path::PathBuf;

use foreign_worlds::World;
use foreign_worlds::air::{Air, AirSettings, FieldSettings, Shear};
use foreign_worlds::hidden::HiddenEffect;
use updraft::blind::scenario::{AirClass, Base, Cell, Protocol};
use updraft::blind::worlds::fly::{Settings, fly_plan};
use updraft::blind::worlds::{Worlds, draw};
use updraft::campaign;
use updraft::mission::Plan;
use updraft::mission::plan::SegmentKind;
use updraft::mission::resolve::Override;
use updraft::workflow::host::Quiet;
use updraft::workflow::{mission, plan};

/// Share of logs that are lost.
const LOST: f64 = 0.15;
/// Seconds of a running mean.
const MEAN_S: usize = 10;
/// Steps of the truth within a second.
const STEPS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(kind), Some(seed), Some(folder)) = (words.next(), words.next(), words.next()) else {
        eprintln!("usage: foreign_campaign still|field|gusty|advected|wind-change SEED FOLDER");
        return Ok(());
    };
    let (seed, root) = (seed.parse::<u64>()?, PathBuf::from(folder));
    let more: Result<Vec<Override>, _> = words.map(|word| Override::parse(&word)).collect();
    let mut overrides = vec![
        Override::new("grid.rows", 5),
        Override::new("grid.columns", 5),
        Override::new("grid.spacing_m", 10.0),
        Override::new("duration_s", 300.0),
        Override::new("vehicle", "pixel"),
    ];
    overrides.extend(more?);
    let planned = mission::resolve("campaign", &overrides)?;
    let host = Quiet::default();
    plan::write(&host, &planned, &plan::shows(&planned), &root, false)?;
    let cell = Cell {
        worlds: Worlds::Foreign,
        protocol: Protocol::Paper,
        air: AirClass::Calm,
        base: Base::Pixel,
        hidden: Vec::new(),
        side: 5,
        columns: None,
    };
    // Pulses follow the battery's voltage, as those of all controllers do that do not measure it.
    let voltage = HiddenEffect { kind: "voltage".to_owned(), values: vec![1.0] };
    let drawn = World { hidden: vec![voltage], ..draw::world(seed, &cell)? };
    for (index, flight) in campaign::flights(&root)?.iter().enumerate() {
        let plan = flight.read_plan()?;
        let air = air(&kind, index).ok_or("this kind of air is not known")?;
        let world = World { air, ..drawn.clone() };
        let air_seed = seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
        let missing = missing(&plan, air_seed);
        std::fs::create_dir_all(flight.logs())?;
        let settings =
            Settings { world: &world, air_seed, charges: &[], missing: &missing, stop: None };
        fly_plan(&plan, &settings, flight)?;
        if index == 1 {
            std::fs::write(root.join("truth.csv"), truth(&plan, &world, air_seed))?;
        }
    }
    Ok(())
}

/// Air of a kind in the first (calibration) or second flight.
fn air(kind: &str, flight: usize) -> Option<AirSettings> {
    let field = |sd_mps, length_m, time_s, is_advected| {
        Some(FieldSettings { sd_mps, length_m, time_s, is_advected })
    };
    let still = AirSettings {
        updraft_mps: 0.0,
        shared_mps: 0.0,
        shared_s: 40.0,
        own_mps: 0.0,
        own_s: 4.0,
        field: None,
        wind_mps: [0.0; 2],
        shear: Shear::None,
        gust_share: 0.1,
        gust_s: 60.0,
        own_gust_share: 0.05,
        own_gust_s: 5.0,
    };
    Some(match kind {
        "still" => still,
        "field" => AirSettings { field: field(0.5, 145.0, 186.0, false), ..still },
        "gusty" => AirSettings { field: field(0.5, 145.0, 186.0, false), own_mps: 0.25, ..still },
        "advected" => {
            AirSettings { field: field(0.5, 60.0, 300.0, true), wind_mps: [2.0, 0.0], ..still }
        }
        "wind-change" => AirSettings {
            field: field(0.3, 60.0, 60.0, false),
            wind_mps: [if flight == 0 { 1.0 } else { 8.0 }, 0.0],
            ..still
        },
        _ => return None,
    })
}

/// Slots whose log is lost.
fn missing(plan: &Plan, seed: u64) -> Vec<u16> {
    let mut slots: Vec<(u64, u16)> =
        plan.slots.iter().map(|slot| (mixed(seed ^ u64::from(slot.slot)), slot.slot)).collect();
    slots.sort_unstable();
    let count = (LOST * slots.len() as f64).round() as usize;
    slots.into_iter().take(count).map(|(_, slot)| slot).collect()
}

/// A number that looks like no other (splitmix64).
fn mixed(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The true air of the hover as a table.
fn truth(plan: &Plan, world: &World, air_seed: u64) -> String {
    let mut text = "slot,time_s,w10_mps\n".to_owned();
    let end_s = plan.duration_ms as f64 / 1000.0;
    let air = Air::new(&world.air, [-30.0, end_s + 90.0], air_seed);
    for slot in &plan.slots {
        let hover = plan.segments(slot).iter().filter(|segment| segment.kind == SegmentKind::Hover);
        let Some(hover) = hover.max_by_key(|segment| segment.end_ms - segment.start_ms) else {
            continue;
        };
        let (start, end) = (hover.start_ms as usize / 1000, hover.end_ms as usize / 1000);
        let place_m = [slot.home_m[0], slot.home_m[1], hover.from_m[2]];
        let mut around = air.around(slot.slot);
        let seconds: Vec<f64> = (start * STEPS..end * STEPS)
            .map(|step| around.velocity_mps(place_m, (step as f64 + 0.5) / STEPS as f64)[2])
            .collect();
        for middle in start + MEAN_S / 2..=end.saturating_sub(MEAN_S / 2) {
            let from = (middle - MEAN_S / 2 - start) * STEPS;
            let mean =
                seconds[from..from + MEAN_S * STEPS].iter().sum::<f64>() / (MEAN_S * STEPS) as f64;
            let _ = writeln!(text, "{},{middle},{mean:.4}", slot.slot);
        }
    }
    text
}
