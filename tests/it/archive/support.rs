//! Small campaigns of known content, and readers of archives.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use parquet::file::reader::{FileReader as _, SerializedFileReader};
use serde_json::{Value, json};
use updraft::analysis::result::Analysis;
use updraft::base::json::write_json;
use updraft::base::time::GpsTime;
use updraft::campaign::start::{Flying, StartRecord, StartedDrone};
use updraft::campaign::{FlightFolder, to_json};
use updraft::mission::resolve::resolve;

use crate::cli::support::Bench;
use crate::report::synthetic;

/// Drones of the small campaigns.
pub(crate) const DRONES: usize = 6;
/// Seconds of their maps.
pub(crate) const SECONDS: usize = 40;
/// Unix time of the first season's day: 2026-06-01 09:30:00 UTC.
pub(crate) const FIRST_UNIX_S: i64 = 1_780_306_200;

/// GPS time of a Unix time.
pub(crate) fn gps(unix_s: i64) -> GpsTime {
    GpsTime::from_unix_ms(unix_s * 1000).unwrap()
}

/// The synthetic campaign of the report's tests, cut to a few drones and seconds.
pub(crate) fn small() -> Analysis {
    let mut analysis = synthetic::posterior(synthetic::whole_campaign());
    for flight in &mut analysis.flights {
        flight.drones.truncate(DRONES);
        flight.logs = flight.drones.len();
        if let Some(map) = &mut flight.map {
            map.drones.truncate(DRONES);
            map.time_s.truncate(SECONDS);
            for drone in &mut map.drones {
                let lists = [&mut drone.updraft_mps, &mut drone.sd_mps, &mut drone.posterior_mps];
                for list in lists {
                    list.truncate(SECONDS);
                }
                drone.posterior_sd_mps.truncate(SECONDS);
                drone.interval_mps.truncate(SECONDS);
                drone.truth_mps.iter_mut().for_each(|list| list.truncate(SECONDS));
            }
        }
    }
    analysis
}

/// A campaign as it lies in a folder.
pub(crate) struct Campaign {
    pub(crate) analysis: Analysis,
    /// Show time 0 of both flights, by the logs.
    pub(crate) start_unix_s: i64,
    /// Whether the start was recorded, with the drones' system ids: 10 + slot.
    pub(crate) is_recorded: bool,
}

impl Campaign {
    pub(crate) fn on_day(day: i64) -> Self {
        let start_unix_s = FIRST_UNIX_S + 86_400 * day;
        Self { analysis: small(), start_unix_s, is_recorded: true }
    }

    /// Writes it: plan, start record and analysis.
    pub(crate) fn write(mut self, folder: &Path) {
        let start = gps(self.start_unix_s);
        for flight in &mut self.analysis.flights {
            for drone in &mut flight.drones {
                drone.clock.start = Some(start);
            }
        }
        let mission = resolve("campaign", &[]).unwrap();
        let flights: Vec<&str> =
            mission.flights.iter().map(|flight| flight.plan.name.as_str()).collect();
        put(
            &folder.join("campaign.json"),
            &json!({"schema": "updraft.campaign/1", "name": "x", "title": "x", "flights": flights}),
        );
        for flight in &mission.flights {
            let at = FlightFolder(folder.join(&flight.plan.name));
            put(&at.plan(), &flight.plan);
            if self.is_recorded {
                let drone = |slot: usize| StartedDrone {
                    slot: slot as u16,
                    drone: (10 + slot).to_string(),
                    show_crc32: None,
                    booted: None,
                };
                let drones = (1..=49).map(drone).collect();
                let made_by = "updraft".to_owned();
                let record = StartRecord::new(made_by, start, 1, Flying::Show, drones);
                put(&StartRecord::path(&at), &record);
            }
        }
        self.analyse_again(folder);
    }

    /// Writes its analysis alone.
    pub(crate) fn analyse_again(&self, folder: &Path) {
        let mut bytes = Vec::new();
        write_json(&mut bytes, &self.analysis).unwrap();
        fs::write(folder.join("analysis.json"), bytes).unwrap();
    }
}

/// Writes a value as JSON, with the folders above it.
pub(crate) fn put<T: serde::Serialize>(path: &Path, value: &T) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, to_json(value).unwrap()).unwrap();
}

/// Paths of an archive's files of a table, below the archive.
pub(crate) fn parts(archive: &Path, table: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut open = vec![archive.join(table)];
    while let Some(folder) = open.pop() {
        for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                open.push(path);
            } else {
                let below = path.strip_prefix(archive).unwrap();
                found.push(below.to_str().unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

/// Names of the columns and the rows of a table, each as the Parquet crate prints it; all files together.
pub(crate) fn table(archive: &Path, table: &str) -> (Vec<String>, Vec<String>) {
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    for part in parts(archive, table) {
        let reader = SerializedFileReader::new(File::open(archive.join(part)).unwrap()).unwrap();
        let schema = reader.metadata().file_metadata().schema();
        names = schema.get_fields().iter().map(|field| field.name().to_owned()).collect();
        rows.extend(reader.get_row_iter(None).unwrap().map(|row| row.unwrap().to_string()));
    }
    (names, rows)
}

/// What `updraft archive ARGS --json` says.
pub(crate) fn archive(bench: &Bench, code: i32, args: &[&str]) -> Value {
    let ended = bench.expect(code, &[&["archive", "--json"], args].concat());
    ended.json("updraft.archive/1")
}

/// Outcome of each campaign, by the name of its folder.
pub(crate) fn outcomes(said: &Value) -> Vec<(String, String)> {
    let one = |campaign: &Value| {
        let folder = PathBuf::from(campaign["folder"].as_str().unwrap());
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        (name, campaign["outcome"].as_str().unwrap().to_owned())
    };
    said["campaigns"].as_array().unwrap().iter().map(one).collect()
}

/// Whether Python has a module.
pub(crate) fn python_has(module: &str) -> bool {
    let mut command = Command::new("python3");
    command.args(["-c", &format!("import {module}")]).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}
