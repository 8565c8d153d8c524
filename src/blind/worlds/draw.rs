//! Draws of foreign worlds: plant, air, noise and hidden effects from a flight's seed.

use foreign_worlds::World;
use foreign_worlds::air::{AirSettings, FieldSettings, Shear};
use foreign_worlds::battery::BatterySettings;
use foreign_worlds::hidden::{self, Drawn, HiddenEffect};
use foreign_worlds::noise::NoiseSettings;
use foreign_worlds::plant::{BladeElement, Motor, Plant, Rotor};
use rand_pcg::Pcg64;

use super::kind_of;
use super::known;
use crate::base::rng::{Purpose, stream};
use crate::blind::error::BlindError;
use crate::blind::hide::{Hidden, between, counted_by_s, log_between, unit};
use crate::blind::scenario::{Base, Cell};
use crate::effects::Role;
use crate::gap::Dependence;
use crate::vehicle::Vehicle;

/// Stream of the plant; those of hidden effects are behind it.
const PLANT: u64 = 1 << 32;
/// Stream of air, battery and noise.
const AIR: u64 = PLANT + 1;
/// Streams of hidden effects, by their place in the list of kinds.
const HIDDEN: u64 = PLANT + 2;
/// Updraft that is everywhere, m/s.
const UPDRAFT_MPS: (f64, f64) = (-2.0, 2.0);
/// Top of the ladders, m.
pub(super) const TOP_M: f64 = 90.0;
/// Mean wind at the top of the ladders, m/s.
const WIND_MPS: (f64, f64) = (0.0, 8.0);
/// Standard deviation of shared and own vertical motion over that of the air's class.
const SHARED: f64 = 0.7;
const OWN: f64 = 0.45;
const FIELD: f64 = 0.55;

/// Draws the world of a flight.
///
/// # Errors
/// An unknown effect, or one that the base does not take.
pub fn world(seed: u64, cell: &Cell) -> Result<World, BlindError> {
    let plant = plant(seed, cell.base)?;
    let rng = &mut stream(seed, AIR, Purpose::Hidden);
    let air = air(rng, cell.air.sd_mps());
    let cells = if cell.base == Base::Pixel { 2.0 } else { 3.0 };
    let reference_v = 3.95 * cells;
    let hover_w = match &plant {
        Plant::ThrustLaw(law) => law.power_w(law.mass_kg * 9.80665 / law.full_thrust_n),
        Plant::BladeElement(_) => 45.0,
    };
    let endurance_s = between(rng, (1_500.0, 2_100.0));
    let battery = BatterySettings {
        cells,
        capacity_ah: hover_w / reference_v * endurance_s / 3600.0,
        resistance_ohm: between(rng, (0.02, 0.05)),
        reference_v,
    };
    let noise = noise(rng);
    let mut hidden = Vec::new();
    for name in &cell.hidden {
        hidden.push(effect(seed, cell, name)?);
    }
    let thrust_spread = between(rng, (0.012, 0.02));
    Ok(World { seed, plant, thrust_spread, air, battery, noise, hidden, telemetry: None })
}

fn plant(seed: u64, base: Base) -> Result<Plant, BlindError> {
    let rng = &mut stream(seed, PLANT, Purpose::Hidden);
    if base != Base::Pixel {
        return known::thrust_law(rng);
    }
    let mut about = |value: f64, share: f64| value * (1.0 + share * (2.0 * unit(rng) - 1.0));
    let rotor = Rotor {
        radius_m: 0.0762,
        blades: 2.0,
        chord_m: about(0.0145, 0.08),
        pitch_m: about(0.0635, 0.08),
        lift_slope: about(5.2, 0.08),
        section_drag: about(0.03, 0.15),
        induced_factor: about(1.2, 0.06),
    };
    let motor = Motor {
        speed_radps_per_v: about(233.0, 0.05),
        resistance_ohm: about(0.22, 0.15),
        no_load_a: about(0.44, 0.1),
        supply_v: 7.89,
        inertia_kgm2: 3e-6,
    };
    let (side_m2, top_m2) = (about(0.010, 0.3), about(0.020, 0.3));
    Ok(Plant::BladeElement(BladeElement {
        mass_kg: about(0.4, 0.04),
        rotor,
        motor,
        side_m2,
        top_m2,
    }))
}

fn air(rng: &mut Pcg64, sd_mps: f64) -> AirSettings {
    let updraft_mps = between(rng, UPDRAFT_MPS);
    let wind_mps = between(rng, WIND_MPS);
    let (sin, cos) = between(rng, (0.0, std::f64::consts::TAU)).sin_cos();
    let shared_s = log_between(rng, (30.0, 120.0));
    let has_field = unit(rng) < 0.6;
    let field = FieldSettings {
        sd_mps: FIELD * sd_mps,
        length_m: log_between(rng, (40.0, 150.0)),
        time_s: log_between(rng, (40.0, 300.0)),
        is_advected: unit(rng) < 0.5,
        waves: None,
        stretch: None,
    };
    let law = unit(rng);
    let shear = if law < 0.4 {
        Shear::Power { exponent: between(rng, (0.1, 0.3)) }
    } else if law < 0.8 {
        Shear::Log { roughness_m: log_between(rng, (0.01, 0.5)) }
    } else {
        Shear::None
    };
    let at_reference_mps = wind_mps / shear.ratio(TOP_M);
    AirSettings {
        updraft_mps,
        shared_mps: SHARED * sd_mps,
        shared_s,
        own_mps: OWN * sd_mps,
        own_s: log_between(rng, (4.0, 15.0)),
        field: has_field.then_some(field),
        thermal: None,
        wind_mps: [at_reference_mps * cos, at_reference_mps * sin],
        shear,
        gust_share: 0.15,
        gust_s: 60.0,
        own_gust_share: 0.05,
        own_gust_s: 5.0,
    }
}

fn noise(rng: &mut Pcg64) -> NoiseSettings {
    NoiseSettings {
        pulse_white_us: between(rng, (1.0, 5.0)),
        pulse_coloured_us: between(rng, (0.0, 5.0)),
        pulse_coloured_s: log_between(rng, (3.0, 8.0)),
        velocity_mps: between(rng, (0.01, 0.04)),
        velocity_s: log_between(rng, (0.3, 3.0)),
        height_m: between(rng, (0.02, 0.1)),
        height_s: 60.0,
        clock_s: between(rng, (0.0, 0.03)),
        level_deg: between(rng, (0.0, 0.2)),
        rate_hz: if unit(rng) < 0.5 { 10.0 } else { 25.0 },
    }
}

/// Draws one hidden effect.
fn effect(seed: u64, cell: &Cell, name: &str) -> Result<HiddenEffect, BlindError> {
    let unknown = || BlindError::Unknown {
        name: name.to_owned(),
        known: hidden::KINDS.iter().map(|kind| kind.name).collect::<Vec<_>>().join(", "),
    };
    let kind = kind_of(name).ok_or_else(unknown)?;
    if !kind.bases.contains(&cell.base) {
        let name = name.to_owned();
        return Err(BlindError::NotEligible { name, base: cell.base.name() });
    }
    let found = hidden::KINDS.iter().position(|one| one.name == name).ok_or_else(unknown)?;
    let rng = &mut stream(seed, HIDDEN + found as u64, Purpose::Hidden);
    let length_s = cell.protocol.length_s();
    let value = |one: &hidden::Parameter| {
        let bounds = (one.low, one.high);
        match one.drawn {
            Drawn::Uniform => between(rng, bounds),
            Drawn::Log => log_between(rng, bounds),
            Drawn::EitherSign => {
                let size = log_between(rng, bounds);
                if unit(rng) < 0.5 { -size } else { size }
            }
            Drawn::FlightShare => length_s * between(rng, bounds),
        }
    };
    let values = hidden::KINDS[found].parameters.iter().map(value).collect();
    Ok(HiddenEffect { kind: name.to_owned(), values })
}

/// Hidden effects of a world as the scorer takes them; `known` is the vehicle that is handed over.
pub fn truths(world: &World, known: &Vehicle) -> Vec<Hidden> {
    world.hidden.iter().filter_map(|effect| truth(world, known, effect)).collect()
}

fn truth(world: &World, known: &Vehicle, effect: &HiddenEffect) -> Option<Hidden> {
    let (kind, own) = (kind_of(&effect.kind)?, hidden::find(&effect.kind)?);
    let first = own.parameters.first()?;
    let mut parameters: std::collections::BTreeMap<String, f64> = own
        .parameters
        .iter()
        .zip(&effect.values)
        .map(|(one, value)| (one.name.to_owned(), *value))
        .collect();
    let magnitude = effect.values.first().copied().unwrap_or_default();
    let mut size = first.name;
    let mut before = None;
    if let Some(known_size) = kind.size {
        size = known_size;
        before = crate::effects::select::value_of(known, kind.like.unwrap_or_default(), size);
        let value = if Role::BodyDragTop.place().is_some_and(|place| place.parameter.name == size) {
            before.unwrap_or(0.0) + magnitude * top_drag_m2(&world.plant)
        } else {
            magnitude
        };
        parameters.insert(size.to_owned(), value);
    }
    // A drift is so much by the end of the flight here, and within a time of its own there.
    if let (Some(slope_us), Some(time_s), Some(known_s)) = (
        parameters.get("slope_us").copied(),
        parameters.get("time_s").copied(),
        kind.like.and_then(|effect| counted_by_s(effect, known)),
    ) {
        parameters.insert("slope_us".to_owned(), slope_us * known_s / time_s);
        parameters.insert("time_s".to_owned(), known_s);
    }
    Some(Hidden {
        kind: kind.name.to_owned(),
        effect: kind.like.unwrap_or(kind.name).to_owned(),
        foreign: kind.like.is_none(),
        parameters,
        size: size.to_owned(),
        before,
        words: format!("{magnitude:.3} {}", first.name),
        depends_on: own.depends_on.iter().filter_map(|name| Dependence::of(name)).collect(),
    })
}

/// Drag coefficient times area from above, m².
fn top_drag_m2(plant: &Plant) -> f64 {
    match plant {
        Plant::ThrustLaw(law) => 2.0 * law.drag_m2[2],
        Plant::BladeElement(blades) => blades.top_m2,
    }
}
