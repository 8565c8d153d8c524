//! Origin of a flight: where and when it was flown, by which airframes, in the field or in the simulator.

use std::collections::BTreeMap;
use std::path::Path;

use super::slim;
use super::sources::FlightSources;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::base::time::GpsTime;
use crate::campaign::FlightRecord;
use crate::campaign::start::StartRecord;
use crate::flight::identity::SAME_START_S;
use crate::mission::plan::Site;

/// Origin of a flight, as far as its records and logs tell.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// Site of the plan.
    pub site: Option<Site>,
    /// Vehicle of the plan.
    pub vehicle: Option<String>,
    /// Drones of the plan.
    pub planned: Option<usize>,
    /// Length of the plan, s.
    pub duration_s: Option<f64>,
    /// Whether it was simulated; absent: neither records nor the names of the logs tell.
    pub simulated: Option<bool>,
    /// GPS time of show time 0.
    pub start: Option<GpsTime>,
    /// Airframe of each slot.
    pub airframes: BTreeMap<u16, String>,
    /// Words that no other flight has: plan, start and what was simulated.
    pub identity: String,
}

impl Origin {
    /// Origin of an analysed flight, among the flights of its campaign.
    pub fn of(flight: &slim::Flight, all: &[FlightSources]) -> Self {
        let sources = match all {
            [one] => Some(one),
            // A plan's second flight has the name of its folder.
            several => several
                .iter()
                .find(|sources| sources.plan.name == flight.name)
                .or_else(|| several.iter().find(|sources| sources.folder == flight.name)),
        };
        let by_logs = start_by_logs(flight);
        let starts = sources.map(|sources| sources.starts.as_slice()).unwrap_or_default();
        let started = starts.iter().find(|record| is_of(record.start, by_logs));
        let record = sources.and_then(|sources| sources.simulated.as_ref());
        let record = record.filter(|record| is_of(record.start, by_logs));
        let simulated = simulated(flight, record, started);
        let record = record.filter(|_| simulated == Some(true));
        let started = started.filter(|_| simulated != Some(true));
        let start = record.map(|record| record.start).or(started.map(|record| record.start));
        let start = start.or(by_logs);
        let mut origin = Self { simulated, start, ..Self::default() };
        let known = |record: &FlightRecord| {
            let FlightRecord { seed, vehicle_sha256, air_mps, air, air_files, .. } = record;
            let read: Vec<&str> = air_files.iter().map(|file| file.sha256.as_str()).collect();
            format!("{seed} {vehicle_sha256} {air_mps:?} {air:?}{}", read.join(" "))
        };
        origin.identity = format!(
            "{}\n{}\n{:?}\n{}\n",
            flight.name,
            sources.map(|sources| sources.plan_sha256.as_str()).unwrap_or_default(),
            start.map(GpsTime::total_ms),
            record.map(known).unwrap_or_default()
        );
        let Some(sources) = sources else { return origin };
        let plan = &sources.plan;
        origin.site = Some(plan.site);
        origin.vehicle = Some(plan.vehicle.clone());
        origin.planned = Some(plan.slots.len());
        origin.duration_s = Some(plan.duration_ms as f64 / 1000.0);
        origin.airframes = match record {
            Some(record) => {
                let slots = plan.slots.iter().map(|slot| slot.slot);
                slots.map(|slot| (slot, format!("sim {}:{slot}", record.seed))).collect()
            }
            None if simulated == Some(true) => BTreeMap::new(),
            None => airframes(sources, started),
        };
        origin
    }

    /// Name of the site: its latitude and longitude to a hundred metres, degrees.
    pub fn site_name(&self) -> Option<String> {
        let Site { origin_lat_deg, origin_lon_deg, .. } = self.site?;
        Some(format!("{origin_lat_deg:.3},{origin_lon_deg:.3}"))
    }

    /// UTC of a show time, ms since 1970.
    pub fn utc_ms(&self, time_s: f64) -> Option<i64> {
        let ms = (time_s * 1000.0).round();
        (ms.abs() < 1e12).then_some(())?;
        let at = GpsTime::from_total_ms(self.start?.total_ms() + ms as i64)?;
        Some(at.to_unix_ms())
    }

    /// Date of the start, UTC: `2026-06-01`.
    pub fn date(&self) -> Option<String> {
        let days = self.start?.to_unix_ms().div_euclid(86_400_000);
        let (year, month, day) = crate::base::calendar::date(days);
        Some(format!("{year:04}-{month:02}-{day:02}"))
    }

    /// Place on the globe of a place in the show frame.
    pub fn place(&self, x_m: f64, y_m: f64) -> Option<Geodetic> {
        let Site { origin_lat_deg, origin_lon_deg, ground_amsl_m, orientation_deg, .. } =
            self.site?;
        let origin =
            Geodetic { lat_deg: origin_lat_deg, lon_deg: origin_lon_deg, amsl_m: ground_amsl_m };
        Some(ShowFrame { origin, orientation_deg }.to_geodetic([x_m, y_m, 0.0].into()))
    }
}

/// Median of what the logs say, to the nearest second.
fn start_by_logs(flight: &slim::Flight) -> Option<GpsTime> {
    let mut starts: Vec<i64> =
        flight.drones.iter().filter_map(|drone| drone.clock.start).map(GpsTime::total_ms).collect();
    starts.sort_unstable();
    let median_ms = *starts.get(starts.len() / 2)?;
    GpsTime::from_total_ms(median_ms.saturating_add(500).div_euclid(1000).saturating_mul(1000))
}

/// Whether a record's start is that of the logs, which need not say.
fn is_of(start: GpsTime, by_logs: Option<GpsTime>) -> bool {
    by_logs.is_none_or(|logs| {
        (start.total_ms() - logs.total_ms()).abs() as f64 <= 1000.0 * SAME_START_S
    })
}

/// Whether a flight was simulated, by the folder of its logs, else by its records.
fn simulated(
    flight: &slim::Flight,
    record: Option<&FlightRecord>,
    started: Option<&StartRecord>,
) -> Option<bool> {
    let lies_in = |drone: &slim::Drone, name: &str| {
        Path::new(&drone.source).components().any(|part| part.as_os_str() == name)
    };
    if flight.drones.iter().any(|drone| lies_in(drone, "simulated")) {
        return Some(true);
    }
    match (started, record) {
        (Some(_), _) => Some(false),
        // As older versions kept simulated logs.
        (None, Some(_)) => Some(true),
        (None, None) => flight.drones.iter().any(|drone| lies_in(drone, "logs")).then_some(false),
    }
}

/// Airframes of a flight in the field: those of its start, else of its logs' way home, else of its table.
fn airframes(sources: &FlightSources, started: Option<&StartRecord>) -> BTreeMap<u16, String> {
    let mut found = BTreeMap::new();
    if let Some(fleet) = &sources.fleet {
        found.extend(fleet.drones.iter().map(|line| (line.slot, line.drone.to_string())));
    }
    if let Some(manifest) = &sources.manifest {
        let logs = manifest.logs.iter().filter(|log| !log.file.contains('/'));
        found.extend(logs.filter_map(|log| Some((log.slot, log.drone?.to_string()))));
    }
    if let Some(started) = started {
        found.extend(started.drones.iter().map(|drone| (drone.slot, drone.drone.clone())));
    }
    found
}
