//! Flies a campaign (the paper's ladder, and a hover or a scan) in a foreign world with air of a known kind, and writes
//! the true air beside it: what maps are held against.
//!
//! ```text
//! cargo run --release --example foreign_campaign -- gusty 7 FOLDER
//! updraft analyze FOLDER
//! ```
//!
//! The kind is `still`, `field`, `gusty`, `advected`, `wind-change`, `thermal` or `drifting-thermal`; after `scan-` the
//! fleet flies `scan-campaign`. `truth.csv` has the mean of the true vertical air speed over the 10 s around each second,
//! along the planned way; `truth-thermal.json` the thermal. A fourth argument is the side of the grid (5), a fifth the
//! distance of its drones (10 m). Arguments with an equals sign, wherever behind the folder, set values of the campaign's
//! templates: `'calibration.legs.speeds_mps=[3, 6]'`, `'hover.legs.speeds_mps=[3, 6]'`. With `telemetry=true` the logs
//! have rotor speeds, and currents with errors.

#![expect(clippy::print_stderr, reason = "it says what went wrong")]

use std::error::Error;
use std::f64::consts::SQRT_2;
use std::fmt::Write as _;
use std::path::PathBuf;

use foreign_worlds::World;
use foreign_worlds::air::{AirSettings, FieldSettings, Profile, Shear, ThermalSettings};
use foreign_worlds::hidden::HiddenEffect;
use foreign_worlds::telemetry::TelemetrySettings;
use updraft::analysis::statistics::result::{TrueAir, TrueField, TrueGusts};
use updraft::blind::scenario::{AirClass, Base, Cell, Protocol};
use updraft::blind::worlds::fly::{Settings, air_of, fly_plan};
use updraft::blind::worlds::{Worlds, draw};
use updraft::campaign;
use updraft::mission::Plan;
use updraft::mission::plan::SegmentKind;
use updraft::mission::resolve::Override;
use updraft::show::quantise::as_flown;
use updraft::show::trajectory::Cursor;
use updraft::workflow::host::Quiet;
use updraft::workflow::{mission, plan};

/// Share of logs that are lost.
const LOST: f64 = 0.15;
/// Seconds of a running mean.
const MEAN_S: usize = 10;
/// The argument that asks for rotor speeds.
const TELEMETRY: &str = "telemetry=true";
/// Steps of the truth within a second.
const STEPS: usize = 5;

fn main() -> Result<(), Box<dyn Error>> {
    let mut words = std::env::args().skip(1);
    let (Some(kind), Some(seed), Some(folder)) = (words.next(), words.next(), words.next()) else {
        eprintln!(
            "usage: foreign_campaign [scan-]KIND SEED FOLDER [SIDE] [SPACING] [KEY=VALUE...]"
        );
        return Ok(());
    };
    let (mut more, numbers): (Vec<String>, Vec<String>) =
        words.partition(|word| word.contains('='));
    let has_telemetry = more.iter().any(|word| word == TELEMETRY);
    more.retain(|word| word != TELEMETRY);
    let mut numbers = numbers.into_iter();
    let side = numbers.next().map_or(Ok(5), |word| word.parse::<u32>())?;
    let spacing_m = numbers.next().map_or(Ok(10.0), |word| word.parse::<f64>())?;
    let (seed, root) = (seed.parse::<u64>()?, PathBuf::from(folder));
    let (template, kind) = kind
        .strip_prefix("scan-")
        .map_or(("campaign", kind.as_str()), |kind| ("scan-campaign", kind));
    let mut overrides = vec![
        Override::new("grid.rows", i64::from(side)),
        Override::new("grid.columns", i64::from(side)),
        Override::new("grid.spacing_m", spacing_m),
        Override::new("vehicle", "pixel"),
    ];
    if template == "campaign" {
        overrides.push(Override::new("duration_s", 300.0));
    }
    for word in &more {
        overrides.push(Override::parse(word)?);
    }
    let planned = mission::resolve(template, &overrides)?;
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
    let telemetry = has_telemetry.then(telemetry);
    let mut drawn = World { hidden: vec![voltage], telemetry, ..draw::world(seed, &cell)? };
    if !kind.starts_with("noisy") {
        // Noise of pulses that lasts for seconds cannot be told from gusts of a drone's own: only one kind has it.
        drawn.noise.pulse_coloured_us = 0.0;
    }
    for (index, flight) in campaign::flights(&root)?.iter().enumerate() {
        let plan = flight.read_plan()?;
        let mut air = air(kind, index).ok_or("this kind of air is not known")?;
        if index == 1 && kind.ends_with("thermal") {
            let thermal = thermal(&plan, seed, air.wind_mps);
            air.thermal = Some(thermal);
            std::fs::write(
                root.join("truth-thermal.json"),
                serde_json::to_string_pretty(&thermal)?,
            )?;
        }
        let world = World { air, ..drawn.clone() };
        let air_seed = seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
        let missing = missing(&plan, air_seed);
        std::fs::create_dir_all(flight.logs())?;
        let settings =
            Settings { world: &world, air_seed, charges: &[], missing: &missing, stop: None };
        fly_plan(&plan, &settings, flight)?;
        if index == 1 {
            std::fs::write(root.join("truth.csv"), truth(&plan, &world, air_seed)?)?;
            let scales = serde_json::to_string_pretty(&scales(&world.air))?;
            std::fs::write(root.join("truth-air.json"), scales)?;
        }
    }
    Ok(())
}

/// Telemetry of controllers that send hundreds of electrical revolutions of motors with seven pairs of poles, and a
/// current sensor as power modules have them: calibrated to a hundredth. Chosen.
fn telemetry() -> TelemetrySettings {
    TelemetrySettings {
        speed_white_rpm: 15.0,
        speed_step_rpm: 100.0 / 7.0,
        current_share: 0.01,
        current_coloured_share: 0.005,
        current_coloured_s: 60.0,
        current_white_a: 0.1,
        current_step_a: 0.01,
    }
}

/// Air of a kind in the first (calibration) or second flight.
fn air(kind: &str, flight: usize) -> Option<AirSettings> {
    let field = |sd_mps, length_m, time_s, is_advected| {
        Some(FieldSettings { sd_mps, length_m, time_s, is_advected, waves: Some(200) })
    };
    let still = AirSettings {
        updraft_mps: 0.0,
        shared_mps: 0.0,
        shared_s: 40.0,
        own_mps: 0.0,
        own_s: 4.0,
        field: None,
        thermal: None,
        wind_mps: [0.0; 2],
        shear: Shear::None,
        gust_share: 0.1,
        gust_s: 60.0,
        own_gust_share: 0.05,
        own_gust_s: 5.0,
    };
    Some(match kind {
        "still" => still,
        // `noisy` has noise of the pulses besides.
        "field" | "noisy" => AirSettings { field: field(0.5, 145.0, 186.0, false), ..still },
        "gusty" => AirSettings { field: field(0.5, 145.0, 186.0, false), own_mps: 0.25, ..still },
        "advected" => {
            AirSettings { field: field(0.5, 60.0, 300.0, true), wind_mps: [2.0, 0.0], ..still }
        }
        "wind-change" => AirSettings {
            field: field(0.3, 60.0, 60.0, false),
            wind_mps: [if flight == 0 { 1.0 } else { 8.0 }, 0.0],
            ..still
        },
        // Alone in the hover; the calibration is flown in the field.
        "thermal" => AirSettings { field: field(0.15, 60.0, 60.0, false), own_mps: 0.15, ..still },
        "drifting-thermal" => AirSettings {
            field: field(0.15, 60.0, 60.0, true),
            own_mps: 0.15,
            wind_mps: [0.8, 0.3],
            ..still
        },
        _ => return None,
    })
}

/// A thermal that the fleet meets: its core is within the tracks, in the middle of the flight if it drifts.
fn thermal(plan: &Plan, seed: u64, drift_mps: [f64; 2]) -> ThermalSettings {
    let draw = |salt: u64, [low, high]: [f64; 2]| {
        let share = mixed(seed.wrapping_mul(31) ^ (salt << 50)) as f64 / u64::MAX as f64;
        low + share * (high - low)
    };
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for slot in &plan.slots {
        for segment in plan.segments(slot) {
            for axis in 0..2 {
                let at_m = slot.home_m[axis] + segment.to_m[axis];
                low[axis] = low[axis].min(at_m);
                high[axis] = high[axis].max(at_m);
            }
        }
    }
    let middle_s = plan.duration_ms as f64 / 2000.0;
    let core_m = [0, 1]
        .map(|axis| draw(1 + axis as u64, [low[axis], high[axis]]) - drift_mps[axis] * middle_s);
    let profile = match seed % 3 {
        0 => Profile::Gaussian,
        1 => Profile::Ring,
        _ => Profile::Flat,
    };
    let (radius_m, peak_mps) = (draw(3, [12.0, 30.0]), draw(4, [0.8, 2.5]));
    ThermalSettings { profile, core_m, radius_m, peak_mps, drift_mps }
}

/// The true scales; a foreign field's are those of its correlation's fall to exp(-1/2).
fn scales(air: &AirSettings) -> TrueAir {
    let field = air.field.as_ref().map(|field| {
        let drift_mps = if field.is_advected { air.wind_mps } else { [0.0; 2] };
        TrueField {
            sd_mps: field.sd_mps,
            lambda_m: SQRT_2 * field.length_m,
            lambda_y_m: SQRT_2 * field.length_m,
            tau_s: SQRT_2 * field.time_s,
            wind_mps: drift_mps[0].hypot(drift_mps[1]),
            is_gaussian: true,
            drift_mps: Some(drift_mps),
        }
    });
    let gusts = TrueGusts {
        spectrum: "first order".to_owned(),
        sd_mps: air.own_mps,
        length_m: 0.0,
        time_s: Some(air.own_s),
        drift_mps: None,
    };
    TrueAir { field, gusts: if air.own_mps > 0.0 { vec![gusts] } else { Vec::new() } }
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

/// The true air along the planned ways, from the beginning of the first hover to the end of the last hover or leg, as
/// a table.
fn truth(plan: &Plan, world: &World, air_seed: u64) -> Result<String, Box<dyn Error>> {
    let mut text = "slot,time_s,w10_mps\n".to_owned();
    let air = air_of(plan, &world.air, air_seed)?;
    let show = plan.to_show();
    for (slot, drone) in plan.slots.iter().zip(&show.drones) {
        let measures = |kind| matches!(kind, SegmentKind::Hover | SegmentKind::Horizontal);
        let mut measured =
            plan.segments(slot).iter().filter(|segment| measures(segment.kind)).peekable();
        let Some(start_ms) = measured.peek().map(|segment| segment.start_ms) else { continue };
        let end_ms = measured.map(|segment| segment.end_ms).max().unwrap_or(start_ms);
        let (start, end) = (start_ms as usize / 1000, end_ms as usize / 1000);
        let flown = as_flown(drone)?;
        let mut cursor = Cursor::new(&flown.trajectory);
        let mut around = air.around(slot.slot);
        let seconds: Vec<f64> = (start * STEPS..end * STEPS)
            .map(|step| {
                let time_s = (step as f64 + 0.5) / STEPS as f64;
                let place_m = cursor.state_at(time_s).position_m.into();
                around.velocity_mps(place_m, time_s)[2]
            })
            .collect();
        for middle in start + MEAN_S / 2..=end.saturating_sub(MEAN_S / 2) {
            let from = (middle - MEAN_S / 2 - start) * STEPS;
            let mean =
                seconds[from..from + MEAN_S * STEPS].iter().sum::<f64>() / (MEAN_S * STEPS) as f64;
            let _ = writeln!(text, "{},{middle},{mean:.4}", slot.slot);
        }
    }
    Ok(text)
}
