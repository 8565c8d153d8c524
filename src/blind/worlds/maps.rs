//! Campaigns in foreign worlds that maps of the air are held against: air of a known kind, and the truth beside the logs.

use std::collections::BTreeMap;
use std::f64::consts::SQRT_2;
use std::sync::atomic::AtomicBool;

use foreign_worlds::World;
use foreign_worlds::air::{AirSettings, FieldSettings, Profile, Shear, ThermalSettings};
use foreign_worlds::hidden::HiddenEffect;
use foreign_worlds::telemetry::TelemetrySettings;

use super::fly::{Settings, air_of, fly_plan};
use super::{Worlds, draw};
use crate::analysis::TruthSeries;
use crate::analysis::statistics::result::{TrueAir, TrueField, TrueGusts};
use crate::base::file::create_folder;
use crate::blind::error::BlindError;
use crate::blind::scenario::{AirClass, Base, Cell, Protocol};
use crate::campaign::FlightFolder;
use crate::mission::Plan;
use crate::mission::plan::SegmentKind;
use crate::show::quantise::as_flown;
use crate::show::trajectory::Cursor;

/// Kinds of air; `noisy` is a field with noise of the pulses besides.
pub const KINDS: [&str; 8] =
    ["still", "field", "noisy", "gusty", "advected", "wind-change", "thermal", "drifting-thermal"];
/// Share of logs that are lost.
const LOST: f64 = 0.15;
/// How many times as long anisotropic air is along show x as along y.
const STRETCH: f64 = 3.0;
/// Seconds of a running mean.
const MEAN_S: usize = 10;
/// Steps of the truth within a second.
const STEPS: usize = 5;

/// The truth about the last flight of a campaign.
#[derive(Clone, Debug, Default)]
pub struct Truth {
    /// Mean vertical air speed over the 10 s around each second along each slot's planned way, m/s, up positive: from the
    /// beginning of the first hover or leg to the end of the last.
    pub updraft: BTreeMap<u16, TruthSeries>,
    /// Scales of the air.
    pub air: TrueAir,
    /// The thermal, where there is one.
    pub thermal: Option<ThermalSettings>,
}

/// Flies the flights of a campaign that is planned, a calibration first: they get the logs that are not lost.
///
/// # Errors
/// An unknown kind of air, or when nothing can be read or written.
pub fn fly(
    flights: &[FlightFolder],
    kind: &str,
    seed: u64,
    telemetry: Option<TelemetrySettings>,
    stop: Option<&AtomicBool>,
) -> Result<Truth, BlindError> {
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
    let mut drawn = World { hidden: vec![voltage], telemetry, ..draw::world(seed, &cell)? };
    if kind != "noisy" {
        // Noise of pulses that lasts for seconds cannot be told from gusts of a drone's own: only one kind has it.
        drawn.noise.pulse_coloured_us = 0.0;
    }
    let mut truth = Truth::default();
    for (index, flight) in flights.iter().enumerate() {
        let text = |what, reason: String| BlindError::Text { what, reason };
        let plan = flight.read_plan().map_err(|error| text("the plan", error.to_string()))?;
        let unknown = || BlindError::Unknown { name: kind.to_owned(), known: KINDS.join(", ") };
        let mut air = air(kind, index).ok_or_else(unknown)?;
        if index > 0 && kind.ends_with("thermal") {
            air.thermal = Some(thermal(&plan, seed, air.wind_mps));
            truth.thermal = air.thermal;
        }
        let world = World { air, ..drawn.clone() };
        let air_seed = seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
        let missing = missing(&plan, air_seed);
        create_folder(&flight.logs())?;
        let settings = Settings { world: &world, air_seed, charges: &[], missing: &missing, stop };
        fly_plan(&plan, &settings, flight)?;
        if index + 1 == flights.len() {
            truth.updraft = updraft(&plan, &world, air_seed)?;
            truth.air = scales(&world.air);
        }
    }
    Ok(truth)
}

/// Air of a kind in the first (calibration) or second flight.
fn air(kind: &str, flight: usize) -> Option<AirSettings> {
    let field = |sd_mps, length_m, time_s, is_advected| {
        Some(FieldSettings {
            sd_mps,
            length_m,
            time_s,
            is_advected,
            waves: Some(200),
            stretch: None,
        })
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
        "anisotropic" => AirSettings {
            field: field(0.5, 100.0, 186.0, false)
                .map(|field| FieldSettings { stretch: Some(STRETCH), ..field }),
            ..still
        },
        "advected" => {
            AirSettings { field: field(0.5, 60.0, 300.0, true), wind_mps: [2.0, 0.0], ..still }
        }
        // Turbulence: eddies that the wind carries past, and gusts of each drone's own; calibrated in the same wind, or in
        // still air.
        "turbulent" | "turbulent-calibrated-calm" => AirSettings {
            field: field(0.4, 25.0, 60.0, true),
            own_mps: 0.3,
            own_s: 3.0,
            wind_mps: if flight == 0 && kind != "turbulent" { [0.0; 2] } else { [3.0, 0.0] },
            ..still
        },
        "turbulent-calm" => {
            AirSettings { field: field(0.4, 25.0, 10.0, false), own_mps: 0.3, own_s: 3.0, ..still }
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
        let root = field.stretch.map_or(1.0, f64::sqrt);
        TrueField {
            sd_mps: field.sd_mps,
            lambda_m: SQRT_2 * field.length_m * root,
            lambda_y_m: SQRT_2 * field.length_m / root,
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
    let gusts = if air.own_mps > 0.0 { vec![gusts] } else { Vec::new() };
    TrueAir { field, gusts, beside: Vec::new() }
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

/// The true air along the planned ways.
fn updraft(
    plan: &Plan,
    world: &World,
    air_seed: u64,
) -> Result<BTreeMap<u16, TruthSeries>, BlindError> {
    let mut found = BTreeMap::new();
    let air = air_of(plan, &world.air, air_seed)?;
    let show = plan.to_show();
    for (slot, drone) in plan.slots.iter().zip(&show.drones) {
        let measures = |kind| matches!(kind, SegmentKind::Hover | SegmentKind::Horizontal);
        let mut measured =
            plan.segments(slot).iter().filter(|segment| measures(segment.kind)).peekable();
        let Some(start_ms) = measured.peek().map(|segment| segment.start_ms) else { continue };
        let end_ms = measured.map(|segment| segment.end_ms).max().unwrap_or(start_ms);
        let (start, end) = (start_ms as usize / 1000, end_ms as usize / 1000);
        let flown =
            as_flown(drone).map_err(|source| BlindError::Skyb { slot: slot.slot, source })?;
        let mut cursor = Cursor::new(&flown.trajectory);
        let mut around = air.around(slot.slot);
        let seconds: Vec<f64> = (start * STEPS..end * STEPS)
            .map(|step| {
                let time_s = (step as f64 + 0.5) / STEPS as f64;
                let place_m = cursor.state_at(time_s).position_m.into();
                around.velocity_mps(place_m, time_s)[2]
            })
            .collect();
        let updraft_mps = seconds
            .windows(MEAN_S * STEPS)
            .step_by(STEPS)
            .map(|window| window.iter().sum::<f64>() / window.len() as f64)
            .collect();
        let first_s = (start + MEAN_S / 2) as i64;
        found.insert(slot.slot, TruthSeries { first_s, updraft_mps });
    }
    Ok(found)
}
