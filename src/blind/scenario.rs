//! One blind flight, fully determined by its seed and its cell.

use foreign_worlds::World;
use rand_distr::Distribution as _;
use rand_distr::StandardUniform;
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::air::AirScales;
use super::error::BlindError;
use super::hide::{Hidden, KINDS, between, kind_of, log_between, unit};
use super::vehicles::hover_a;
use super::worlds::{self, Worlds};
use crate::base::rng::{Purpose, stream};
use crate::effects::Role;

/// Name and version of the format of a sealed truth.
pub const SCENARIO_SCHEMA: &str = "updraft.blind-truth/1";
/// Drones along each side of the grid, unless a smaller one is asked for.
pub const FULL_SIDE: u16 = 7;
/// Distance of the drones, m.
pub(super) const SPACING_M: f64 = 7.0;
/// Share of the logs that is lost, when logs are lost.
const LOST_SHARE: f64 = 0.15;
/// Share of the standard deviation of the updraft that all drones have together.
const SHARED: f64 = 0.83;
/// Share that each has for itself.
const LOCAL: f64 = 0.55;
/// Spread of the inflow between drones, relative.
pub(super) const INFLOW_SPREAD: (f64, f64) = (0.05, 0.07);
/// Charge of the batteries when they are staggered.
const STAGGERED: (f64, f64) = (0.62, 1.0);

/// Time that a full battery carries the drone in hover, s: also the least charged one comes home.
const ENDURANCE_S: (f64, f64) = (1_500.0, 2_100.0);
/// Stream of what is hidden when nobody says what.
const CHOICE: u64 = u64::MAX - 2;

/// Which protocol is flown.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Protocol {
    /// The paper's ladder.
    Paper,
    /// The counter-phase ladder, with staggered charge and warmth.
    Enhanced,
}

impl Protocol {
    /// Name of the protocol in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Paper => "paper",
            Self::Enhanced => "enhanced",
        }
    }

    /// Name of the built-in template that the protocol flies.
    pub fn template(self) -> &'static str {
        match self {
            Self::Paper => "calibration",
            Self::Enhanced => "calibration-counterphase",
        }
    }

    /// About how long it lasts, s.
    pub(super) fn length_s(self) -> f64 {
        match self {
            Self::Paper => 430.0,
            Self::Enhanced => 706.0,
        }
    }
}

/// How much the air moves.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum AirClass {
    /// A calm dawn.
    Calm,
    /// In between.
    Moderate,
    /// As in the paper's field flights.
    Field,
    /// It does not change.
    Still,
}

impl AirClass {
    /// Name of the class of air in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Calm => "calm",
            Self::Moderate => "moderate",
            Self::Field => "field",
            Self::Still => "still",
        }
    }

    /// Standard deviation of the updraft, m/s.
    pub fn sd_mps(self) -> f64 {
        match self {
            Self::Calm => 0.12,
            Self::Moderate => 0.36,
            Self::Field => 0.5,
            Self::Still => 0.0,
        }
    }
}

/// The known vehicle, which is handed to the search.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum Base {
    /// AirSim's law: `airsim-generic-quad`.
    Airsim,
    /// AirSim's law with rotor inflow.
    Inflow,
    /// A show drone like `pixel`: motor law, inflow and body drag.
    Pixel,
    /// A camera drone: `phantom4`, with motor law, inflow and body drag.
    Phantom4,
    /// The frame of ArduPilot's own simulator: `arducopter-sitl`.
    Sitl,
}

impl Base {
    /// Name of the base vehicle in files and options.
    pub fn name(self) -> &'static str {
        match self {
            Self::Airsim => "airsim",
            Self::Inflow => "inflow",
            Self::Pixel => "pixel",
            Self::Phantom4 => "phantom4",
            Self::Sitl => "sitl",
        }
    }
}

/// What kind of flight it is.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cell {
    /// Whose physics it is flown with.
    #[serde(default, skip_serializing_if = "Worlds::is_home")]
    pub worlds: Worlds,
    /// The protocol.
    pub protocol: Protocol,
    /// The air.
    pub air: AirClass,
    /// The known vehicle.
    pub base: Base,
    /// What is hidden, by the names of [`super::hide::KINDS`] or, in foreign worlds, of
    /// [`super::tables::FOREIGN_KINDS`]; empty: nothing.
    pub hidden: Vec<String>,
    /// Drones along each side of the grid; with `columns`: its rows.
    pub side: u16,
    /// Columns of the grid; absent: as many as rows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<u16>,
}

impl Cell {
    /// A full grid that hides one effect of the library, which the seed chooses among those that the
    /// base takes.
    pub fn hiding_one(seed: u64, protocol: Protocol, air: AirClass, base: Base) -> Self {
        let takes = KINDS.iter().filter(|kind| !kind.foreign && kind.bases.contains(&base));
        let names: Vec<&str> = takes.map(|kind| kind.name).collect();
        let place = unit(&mut stream(seed, CHOICE, Purpose::Hidden)) * names.len() as f64;
        let hidden = names.get(place as usize).map(|name| (*name).to_owned());
        let hidden = hidden.into_iter().collect();
        let (worlds, side) = (Worlds::Home, FULL_SIDE);
        Self { worlds, protocol, air, base, hidden, side, columns: None }
    }

    /// Number of columns of the grid.
    pub fn columns(&self) -> u16 {
        self.columns.unwrap_or(self.side)
    }

    /// Number of slots in the grid.
    pub fn slots(&self) -> u16 {
        self.side * self.columns()
    }

    /// Width of the array along its longer side, m.
    pub(super) fn width_m(&self) -> f64 {
        f64::from(self.side.max(self.columns()).saturating_sub(1)) * SPACING_M
    }

    /// Short name of the cell: `paper-calm-airsim-none`.
    pub fn name(&self) -> String {
        let hidden = if self.hidden.is_empty() { "none".to_owned() } else { self.hidden.join("+") };
        let words = [self.protocol.name(), self.air.name(), self.base.name(), &hidden].join("-");
        if self.worlds.is_home() { words } else { format!("{}-{words}", self.worlds.name()) }
    }
}

/// The battery that the logs report.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BatteryTruth {
    /// Cells in series.
    pub cells: f64,
    /// Charge of a full battery, Ah.
    pub capacity_ah: f64,
    /// Internal resistance, ohm.
    pub resistance_ohm: f64,
}

/// What is always there, and not to be named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Nuisance {
    /// Spread of thrust between drones, relative.
    pub thrust_spread: f64,
    /// Spread of the inflow between drones, where there is an inflow, relative.
    pub inflow_spread: f64,
    /// The air.
    pub air: AirScales,
    /// The battery of each drone.
    pub battery: BatteryTruth,
    /// Charge of each slot's battery at take-off, share of full.
    pub charges: Vec<f64>,
    /// Slots whose motors were warm at take-off.
    pub warm: Vec<u16>,
    /// Slots without a log.
    pub missing: Vec<u16>,
}

/// One blind flight: the truth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Format name and version: `updraft.blind-truth/1`.
    pub schema: String,
    /// Its seed.
    pub seed: u64,
    /// What kind of flight it is.
    pub cell: Cell,
    /// What is hidden.
    pub hidden: Vec<Hidden>,
    /// What is always there.
    pub nuisance: Nuisance,
    /// The world, if it is a foreign one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub world: Option<World>,
    /// Largest difference of the known vehicle's pulses from those of the foreign plant without what is
    /// hidden, over the flown range of air speeds and without the mean, us. Beyond 1 us something is missing
    /// where nothing is hidden.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_over_us: Option<f64>,
}

impl Scenario {
    /// Draws a blind flight from its seed.
    ///
    /// # Errors
    ///
    /// If an effect is unknown, cannot be hidden from this base, or not together with another.
    pub fn draw(seed: u64, cell: &Cell) -> Result<Self, BlindError> {
        if !cell.worlds.is_home() {
            return Self::foreign(seed, cell);
        }
        let width_m = cell.width_m();
        let mut hidden: Vec<Hidden> = Vec::new();
        for name in &cell.hidden {
            let drawn = kind_of(name)?.draw(seed, cell.base, cell.protocol, width_m)?;
            if let Some(other) = hidden.iter().find(|other| other.effect == drawn.effect) {
                let (name, other) = (name.clone(), other.kind.clone());
                return Err(BlindError::Twice { name, other });
            }
            hidden.push(drawn);
        }
        let nuisance = nuisance(seed, cell)?;
        Ok(Self {
            schema: SCENARIO_SCHEMA.to_owned(),
            seed,
            cell: cell.clone(),
            hidden,
            nuisance,
            world: None,
            left_over_us: None,
        })
    }

    /// Draws a flight in a foreign world.
    fn foreign(seed: u64, cell: &Cell) -> Result<Self, BlindError> {
        let world = worlds::draw::world(seed, cell)?;
        let known = worlds::known::vehicle(&world, cell)?;
        let left_over_us = Some(known.largest_us);
        let hidden = worlds::draw::truths(&world, &known.vehicle);
        // The drones that are charged and lost are drawn as at home; the rest stands in the world.
        let mut nuisance = nuisance(seed, cell)?;
        nuisance.warm.clear();
        nuisance.inflow_spread = 0.0;
        nuisance.thrust_spread = world.thrust_spread;
        let [shared, own] = [world.air.shared_mps, world.air.own_mps];
        nuisance.air = AirScales {
            shared_mps: shared,
            time_s: world.air.shared_s,
            local_mps: own,
            local_s: world.air.own_s,
            wind_mps: world.air.wind_mps,
            wind_gust_mps: 0.0,
            ..nuisance.air
        };
        nuisance.battery = BatteryTruth {
            cells: world.battery.cells,
            capacity_ah: world.battery.capacity_ah,
            resistance_ohm: world.battery.resistance_ohm,
        };
        let (schema, cell) = (SCENARIO_SCHEMA.to_owned(), cell.clone());
        Ok(Self { schema, seed, cell, hidden, nuisance, world: Some(world), left_over_us })
    }

    /// The vertical air speed that the whole flight is in, m/s, up positive.
    pub fn updraft_mps(&self) -> f64 {
        self.world.as_ref().map_or(self.nuisance.air.updraft_mps, |world| world.air.updraft_mps)
    }

    /// Number of slots in the formation.
    pub fn slots(&self) -> u16 {
        self.cell.slots()
    }

    /// True value of the parameter that states the size of a hidden effect, averaged over the
    /// fleet: a drone whose motors were warm at take-off drifts no more.
    pub fn fleet_value(&self, hidden: &Hidden) -> f64 {
        if !Role::WarmUpTime.is_of(&hidden.effect) {
            return hidden.value();
        }
        let warm = self.nuisance.warm.len() as f64 / f64::from(self.slots().max(1));
        hidden.value() * (1.0 - warm)
    }

    /// A slot whose motors were cold at take-off, if there is one.
    pub fn cold_slot(&self) -> Option<u16> {
        (1..=self.slots()).find(|slot| !self.nuisance.warm.contains(slot))
    }

    /// Hidden effects and their sizes in a few words; "nothing" if there are none.
    pub fn words(&self) -> String {
        if self.hidden.is_empty() {
            return "nothing".to_owned();
        }
        let each = self.hidden.iter().map(|hidden| format!("{} ({})", hidden.kind, hidden.words));
        each.collect::<Vec<_>>().join(", ")
    }
}

fn nuisance(seed: u64, cell: &Cell) -> Result<Nuisance, BlindError> {
    // Stream 0 of this purpose: each hidden effect has one behind it.
    let rng = &mut stream(seed, 0, Purpose::Hidden);
    let slots = cell.slots();
    let sd_mps = cell.air.sd_mps();
    let thrust_spread = between(rng, (0.012, 0.02));
    let inflow_spread = between(rng, INFLOW_SPREAD);
    let wind_mps = between(rng, (1.0, 6.0));
    let (sin, cos) = between(rng, (0.0, std::f64::consts::TAU)).sin_cos();
    let air = AirScales {
        shared_mps: SHARED * sd_mps,
        length_m: 145.0,
        time_s: log_between(rng, (40.0, 186.0)),
        local_mps: LOCAL * sd_mps,
        local_s: 8.0,
        wind_mps: [wind_mps * cos, wind_mps * sin],
        wind_gust_mps: 0.15 * wind_mps,
        wind_gust_s: 25.0,
        updraft_mps: 0.0,
    };
    let vehicle = cell.base.known()?;
    let cells = cell.base.battery_cells();
    let endurance_s = between(rng, ENDURANCE_S);
    let battery = BatteryTruth {
        cells,
        capacity_ah: hover_a(&vehicle, cells) * endurance_s / 3600.0,
        resistance_ohm: between(rng, (0.02, 0.05)),
    };
    let is_staggered = cell.protocol == Protocol::Enhanced;
    let charges = staggered(slots, is_staggered, rng);
    let order = shuffled(slots, rng);
    let warm_count = if is_staggered { usize::from(slots) / 2 } else { 0 };
    let mut warm: Vec<u16> = order.into_iter().take(warm_count).collect();
    warm.sort_unstable();
    let loses = unit(rng) < 0.5;
    let lost = if loses { (f64::from(slots) * LOST_SHARE).round() as usize } else { 0 };
    let mut missing: Vec<u16> = shuffled(slots, rng).into_iter().take(lost).collect();
    missing.sort_unstable();
    Ok(Nuisance { thrust_spread, inflow_spread, air, battery, charges, warm, missing })
}

/// Charges of all slots: full, or evenly spaced and shuffled over the grid.
fn staggered(slots: u16, is_staggered: bool, rng: &mut Pcg64) -> Vec<f64> {
    if !is_staggered {
        return vec![1.0; usize::from(slots)];
    }
    let (low, high) = STAGGERED;
    let step = (high - low) / f64::from(slots.saturating_sub(1).max(1));
    let ranks = shuffled(slots, rng);
    ranks.into_iter().map(|rank| low + step * f64::from(rank - 1)).collect()
}

/// The slots in a random order.
fn shuffled(slots: u16, rng: &mut Pcg64) -> Vec<u16> {
    let mut keyed: Vec<(u64, u16)> =
        (1..=slots).map(|slot| (StandardUniform.sample(rng), slot)).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, slot)| slot).collect()
}
