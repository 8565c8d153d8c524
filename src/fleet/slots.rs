//! Assignment of vehicles to slots: the table of a campaign, compared with where each vehicle
//! stands.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::telemetry::{Position, Telemetry};
use crate::base::file::{read_whole, write_whole};
use crate::base::frame::Geodetic;
use crate::base::parse;
use crate::campaign::{CampaignError, to_json};
use crate::link::clock::{Micros, S};
use crate::link::id::DroneId;
use crate::mission::Plan;

/// Name and version of the format of the table.
pub const FLEET_SCHEMA: &str = "updraft.fleet/1";
/// Name of the table's file in a flight's folder.
pub const FLEET_FILE: &str = "fleet.json";
/// A table is never longer, bytes.
const MOST_BYTES: u64 = 16 << 20;
/// A position older than this does not say where a drone stands.
const FRESH: Micros = 5 * S;

/// `fleet.json`: which vehicle flies which slot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FleetTable {
    /// Format name and version: `updraft.fleet/1`.
    pub schema: String,
    /// The vehicles, in slot order.
    pub drones: Vec<Assignment>,
}

/// One line of the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assignment {
    /// Number of the slot, from 1.
    pub slot: u16,
    /// The vehicle.
    pub drone: DroneId,
}

impl FleetTable {
    /// A table of these pairs of vehicle and slot, sorted by slot.
    pub fn new(drones: impl IntoIterator<Item = (DroneId, u16)>) -> Self {
        let mut drones: Vec<Assignment> =
            drones.into_iter().map(|(drone, slot)| Assignment { slot, drone }).collect();
        drones.sort_by_key(|line| (line.slot, line.drone));
        Self { schema: FLEET_SCHEMA.to_owned(), drones }
    }

    /// Path of the table in a flight's folder.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(FLEET_FILE)
    }

    /// Reads the table of a flight's folder.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or is not a fleet table.
    pub fn read(folder: &Path) -> Result<Self, CampaignError> {
        let path = Self::path(folder);
        let bytes = read_whole(&path, MOST_BYTES)?;
        Self::parse(&bytes).map_err(|reason| CampaignError::Json { path, reason })
    }

    /// Reads a table from its JSON; the error says what is wrong.
    ///
    /// # Errors
    ///
    /// A description of the problem.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let table: Self = parse::json(bytes).map_err(|error| error.to_string())?;
        if table.schema == FLEET_SCHEMA {
            Ok(table)
        } else {
            Err(format!("this program reads \"{FLEET_SCHEMA}\", not \"{}\"", table.schema))
        }
    }

    /// Writes the table into a flight's folder.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), CampaignError> {
        let path = Self::path(folder);
        let json = to_json(self).map_err(|error| CampaignError::Json {
            path: path.clone(),
            reason: error.to_string(),
        })?;
        Ok(write_whole(&path, &json)?)
    }

    /// Slot of a vehicle, if the table has one.
    pub fn slot_of(&self, drone: DroneId) -> Option<u16> {
        self.drones.iter().find(|line| line.drone == drone).map(|line| line.slot)
    }

    /// Vehicle of each slot.
    pub fn by_slot(&self) -> BTreeMap<u16, DroneId> {
        self.drones.iter().map(|line| (line.slot, line.drone)).collect()
    }

    /// Slot of each vehicle.
    pub fn by_drone(&self) -> BTreeMap<DroneId, u16> {
        self.drones.iter().map(|line| (line.drone, line.slot)).collect()
    }
}

/// Conflict between vehicles and slots.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SlotProblem {
    /// The table names a slot that the plan does not have.
    #[error("drone {drone} is to fly slot {slot}, but the plan has {slots} slots")]
    NoSuchSlot {
        /// Identifier of the vehicle.
        drone: DroneId,
        /// Number of the slot in the table.
        slot: u16,
        /// Number of slots in the plan.
        slots: usize,
    },
    /// The table gives one slot to two vehicles.
    #[error("slot {slot} is given to drones {first} and {second}: take one of them out")]
    DoubledSlot {
        /// Number of the slot.
        slot: u16,
        /// First vehicle on the slot.
        first: DroneId,
        /// Second vehicle on the slot.
        second: DroneId,
    },
    /// The table gives two slots to one vehicle.
    #[error("drone {drone} is given slots {first} and {second}: it can fly one")]
    DoubledDrone {
        /// Identifier of the vehicle.
        drone: DroneId,
        /// First slot of the vehicle.
        first: u16,
        /// Second slot of the vehicle.
        second: u16,
    },
    /// A slot has no vehicle.
    #[error("slot {slot} has no drone: put one there, or plan the flight with fewer")]
    Empty {
        /// Number of the slot.
        slot: u16,
    },
    /// The position of a vehicle with a slot is not known.
    #[error("drone {drone} (slot {slot}) does not say where it stands: is it on, with GPS?")]
    NoPosition {
        /// Identifier of the vehicle.
        drone: DroneId,
        /// Slot of the vehicle.
        slot: u16,
    },
    /// The vehicle stands nearest to a slot that is not its own.
    #[error(
        "drone {drone} is to fly slot {slot} but stands on slot {stands}: move it {distance_m:.1} \
         m, or let the table follow where the drones stand"
    )]
    WrongSlot {
        /// Identifier of the vehicle.
        drone: DroneId,
        /// Slot that it is to fly.
        slot: u16,
        /// Slot that it stands nearest to.
        stands: u16,
        /// Distance from its own slot, m.
        distance_m: f64,
    },
    /// The vehicle stands nearest to its slot, but too far from it.
    #[error(
        "drone {drone} stands {distance_m:.1} m from slot {slot}, {allowed_m:.1} m are allowed: \
         move it there"
    )]
    TooFar {
        /// Identifier of the vehicle.
        drone: DroneId,
        /// Slot of the vehicle.
        slot: u16,
        /// Distance from its slot, m.
        distance_m: f64,
        /// Largest distance allowed, m.
        allowed_m: f64,
    },
    /// Two vehicles stand on one slot.
    #[error("drones {first} and {second} both stand on slot {slot}: move one of them")]
    BothOn {
        /// Number of the slot.
        slot: u16,
        /// First vehicle on the slot.
        first: DroneId,
        /// Second vehicle on the slot.
        second: DroneId,
    },
    /// The position of a vehicle is not known, and no table gives it a slot.
    #[error("drone {drone} does not say where it stands: is it on, with GPS?")]
    Nowhere {
        /// Identifier of the vehicle.
        drone: DroneId,
    },
    /// A vehicle is switched on but belongs to no slot.
    #[error("drone {drone} is on but has no slot: switch it off, or give it one")]
    Unassigned {
        /// Identifier of the vehicle.
        drone: DroneId,
    },
}

/// Place where a vehicle stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// Number of the nearest slot.
    pub nearest: u16,
    /// Horizontal distance to the nearest slot, m.
    pub distance_m: f64,
    /// Position of the vehicle, show x and y, m.
    pub at_m: [f64; 2],
}

/// The place that a vehicle reports.
pub fn geodetic(position: &Position) -> Geodetic {
    Geodetic { lat_deg: position.lat_deg, lon_deg: position.lon_deg, amsl_m: position.amsl_m }
}

/// Places of all vehicles with a fresh position.
pub fn stands(plan: &Plan, telemetry: &Telemetry, now: Micros) -> BTreeMap<DroneId, Stand> {
    let stand = |(drone, known): (&DroneId, &super::telemetry::Drone)| {
        let (at, position) = known.position?;
        if !position.has_place() || now.saturating_sub(at) > FRESH {
            return None;
        }
        Some((*drone, Stand::of(plan, geodetic(&position))?))
    };
    telemetry.drones.iter().filter_map(stand).collect()
}

impl Stand {
    /// Place of a drone at this position; `None` if the plan has no slots.
    pub fn of(plan: &Plan, place: Geodetic) -> Option<Self> {
        let place = plan.site.frame().from_geodetic(place);
        let at_m = [place.x, place.y];
        let distance = |slot: &crate::mission::plan::Slot| distance_m(at_m, slot.home_m);
        let nearest = plan.slots.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
        Some(Self { nearest: nearest.slot, distance_m: distance(nearest), at_m })
    }
}

fn distance_m(at_m: [f64; 2], home_m: [f64; 3]) -> f64 {
    (at_m[0] - home_m[0]).hypot(at_m[1] - home_m[1])
}

/// Largest distance between a drone and its slot, m: under half the grid's spacing, and under what
/// the firmware allows ([`Plan`]s keep drones further apart than twice that).
pub fn allowed_m(plan: &Plan) -> f64 {
    let spacing_m = plan.grid.map_or(f64::INFINITY, |grid| grid.spacing_m);
    (0.4 * spacing_m).min(2.5)
}

/// Problems of a table on its own, without the vehicles' positions.
pub fn check_table(plan: &Plan, table: &FleetTable) -> Vec<SlotProblem> {
    let mut problems = Vec::new();
    let (mut slots, mut drones) = (BTreeMap::new(), BTreeMap::new());
    for Assignment { slot, drone } in table.drones.iter().copied() {
        if plan.slot(slot).is_none() {
            problems.push(SlotProblem::NoSuchSlot { drone, slot, slots: plan.slots.len() });
        }
        if let Some(first) = slots.insert(slot, drone) {
            problems.push(SlotProblem::DoubledSlot { slot, first, second: drone });
        }
        if let Some(first) = drones.insert(drone, slot) {
            problems.push(SlotProblem::DoubledDrone { drone, first, second: slot });
        }
    }
    let empty = plan.slots.iter().filter(|slot| !slots.contains_key(&slot.slot));
    problems.extend(empty.map(|slot| SlotProblem::Empty { slot: slot.slot }));
    problems
}

/// Problems of a table, including those of where the vehicles stand.
pub fn check_stands(
    plan: &Plan,
    table: &FleetTable,
    telemetry: &Telemetry,
    now: Micros,
) -> Vec<SlotProblem> {
    let mut problems = check_table(plan, table);
    let stands = stands(plan, telemetry, now);
    let allowed_m = allowed_m(plan);
    let mut on: BTreeMap<u16, DroneId> = BTreeMap::new();
    for Assignment { slot, drone } in table.drones.iter().copied() {
        let Some(home) = plan.slot(slot) else { continue };
        let Some(stand) = stands.get(&drone) else {
            problems.push(SlotProblem::NoPosition { drone, slot });
            continue;
        };
        let distance_m = distance_m(stand.at_m, home.home_m);
        if stand.nearest != slot && stand.distance_m <= allowed_m {
            let stands = stand.nearest;
            problems.push(SlotProblem::WrongSlot { drone, slot, stands, distance_m });
        } else if distance_m > allowed_m {
            problems.push(SlotProblem::TooFar { drone, slot, distance_m, allowed_m });
        }
    }
    for (drone, stand) in &stands {
        if stand.distance_m <= allowed_m
            && let Some(first) = on.insert(stand.nearest, *drone)
        {
            let slot = stand.nearest;
            problems.push(SlotProblem::BothOn { slot, first, second: *drone });
        }
    }
    let named: BTreeSet<DroneId> = table.drones.iter().map(|line| line.drone).collect();
    let unnamed = telemetry.drones.keys().filter(|drone| !named.contains(drone));
    problems.extend(unnamed.map(|drone| SlotProblem::Unassigned { drone: *drone }));
    problems
}

/// Proposes the table in which each vehicle flies the slot that it stands on.
///
/// # Errors
///
/// Every slot without a vehicle or with two, and every vehicle that stands on none.
pub fn propose(
    plan: &Plan,
    telemetry: &Telemetry,
    now: Micros,
) -> Result<FleetTable, Vec<SlotProblem>> {
    let stands = stands(plan, telemetry, now);
    let table = FleetTable::new(stands.iter().map(|(drone, stand)| (*drone, stand.nearest)));
    let mut seen = BTreeSet::new();
    let mut problems = check_stands(plan, &table, telemetry, now);
    // Two drones on one place are one problem, however it is found.
    problems.retain(|problem| match problem {
        SlotProblem::DoubledSlot { slot, .. } | SlotProblem::BothOn { slot, .. } => {
            seen.insert(*slot)
        }
        _ => true,
    });
    if problems.is_empty() { Ok(table) } else { Err(problems) }
}

/// Proposes a table of the vehicles that stand near enough to a slot and alone on it, and names
/// every vehicle that does not.
pub fn propose_clear(
    plan: &Plan,
    telemetry: &Telemetry,
    now: Micros,
) -> (FleetTable, Vec<SlotProblem>) {
    let stands = stands(plan, telemetry, now);
    let allowed_m = allowed_m(plan);
    let mut problems = Vec::new();
    let mut on: BTreeMap<u16, Vec<DroneId>> = BTreeMap::new();
    for drone in telemetry.drones.keys().copied() {
        match stands.get(&drone) {
            None => problems.push(SlotProblem::Nowhere { drone }),
            Some(stand) if stand.distance_m <= allowed_m => {
                on.entry(stand.nearest).or_default().push(drone);
            }
            Some(stand) => {
                let (slot, distance_m) = (stand.nearest, stand.distance_m);
                problems.push(SlotProblem::TooFar { drone, slot, distance_m, allowed_m });
            }
        }
    }
    let mut clear = Vec::new();
    for (slot, drones) in on {
        match drones.as_slice() {
            [drone] => clear.push((*drone, slot)),
            [first, others @ ..] => {
                problems.extend(others.iter().map(|second| SlotProblem::BothOn {
                    slot,
                    first: *first,
                    second: *second,
                }));
            }
            [] => {}
        }
    }
    (FleetTable::new(clear), problems)
}

/// Picture of the grid seen from above, with the drones that stand on it: the show's x axis points
/// up, so that it is as one sees it looking along the show's orientation. `.` is an empty slot, `?`
/// two drones on one; drones beside the grid are listed below.
pub fn picture(plan: &Plan, telemetry: &Telemetry, now: Micros) -> String {
    let stands = stands(plan, telemetry, now);
    let allowed_m = allowed_m(plan);
    let mut cells: BTreeMap<u16, String> = BTreeMap::new();
    let mut beside = Vec::new();
    for (drone, stand) in &stands {
        if stand.distance_m <= allowed_m {
            let cell = cells.entry(stand.nearest);
            cell.and_modify(|text| "?".clone_into(text)).or_insert_with(|| drone.to_string());
        } else {
            beside.push(format!(
                "  drone {drone}: {:.1} m from slot {}, at x {:.1} y {:.1} m\n",
                stand.distance_m, stand.nearest, stand.at_m[0], stand.at_m[1]
            ));
        }
    }
    let rows = plan.slots.iter().map(|slot| slot.row).max().unwrap_or(0);
    let columns = plan.slots.iter().map(|slot| slot.column).max().unwrap_or(0);
    let width = cells.values().map(String::len).max().unwrap_or(1).max(2);
    let mut text = String::new();
    for row in (0..=rows).rev() {
        let mut line = String::new();
        for column in (0..=columns).rev() {
            let slot = plan.slots.iter().find(|slot| slot.row == row && slot.column == column);
            let cell = match slot {
                Some(slot) => cells.get(&slot.slot).map_or(".", String::as_str),
                None => "",
            };
            let _ = write!(line, " {cell:>width$}");
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text.push_str("  (up: along the show's x axis");
    let _ = writeln!(text, ", {:.0} degrees from north)", plan.site.orientation_deg);
    text.extend(beside);
    text
}
