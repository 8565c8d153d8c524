//! The files of a campaign that an archive takes from, with a hash of all of them.
//!
//! Each is read once, and what is hashed is what is used, whatever is written meanwhile.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use sha2::{Digest as _, Sha256};

use super::ArchiveError;
use super::slim;
use crate::analysis::result::ANALYSIS_SCHEMA;
use crate::base::digest::{hexadecimal, sha256};
use crate::base::file::{FileError, open_regular, read_whole};
use crate::base::parse;
use crate::base::plain::plain;
use crate::campaign::origin::LogOrigin;
use crate::campaign::start::{START_FILE, StartRecord, earlier_folders};
use crate::campaign::{self, CampaignError, FlightFolder, FlightRecord, is_campaign, parse_plan};
use crate::fleet::logs::manifest::Manifest;
use crate::fleet::slots::{FLEET_FILE, FleetTable};
use crate::gap::Verdict;
use crate::gap::verdict::VERDICT_SCHEMA;
use crate::mission::Plan;

/// Counted up when the tables change, so that every campaign is gathered anew.
const FORMAT: u32 = 1;
/// Largest analysis that is read, bytes: those of 5,000 drones, flown twice, have less than half as many.
const MOST_ANALYSIS_BYTES: u64 = 4 << 30;
/// Largest of the other files, bytes.
const MOST_BYTES: u64 = 64 << 20;
/// Earlier starts of a flight that are looked at.
const MOST_STARTS: usize = 1000;
/// Bytes that are read at a time.
const PIECE_BYTES: usize = 1 << 16;

/// Path of the analysis of a campaign's folder.
pub fn analysis_path(folder: &Path) -> PathBuf {
    folder.join("analysis.json")
}

/// Files of a campaign that an archive takes from; its analysis stays open.
#[derive(Debug)]
pub struct Sources {
    /// Folder of the campaign, without links.
    pub folder: PathBuf,
    /// Hash of all the files.
    pub inputs_sha256: String,
    /// Flights, as they were planned and flown.
    pub flights: Vec<FlightSources>,
    /// Verdict of `updraft gap`, if there is one.
    pub verdict: Option<Verdict>,
    analysis: File,
}

/// Plan and records of a flight.
#[derive(Debug)]
pub struct FlightSources {
    /// Name of the flight's folder.
    pub folder: String,
    /// Plan of the flight.
    pub plan: Plan,
    /// SHA-256 of the plan.
    pub plan_sha256: String,
    /// Record of a simulation.
    pub simulated: Option<FlightRecord>,
    /// Records of starts: the latest, then earlier ones.
    pub starts: Vec<StartRecord>,
    /// Logs that were brought home.
    pub manifest: Option<Manifest>,
    /// Table of drones and slots.
    pub fleet: Option<FleetTable>,
}

impl Sources {
    /// Opens the files of a campaign.
    ///
    /// # Errors
    /// If it was not analysed, or a file cannot be read or is broken.
    pub fn open(folder: &Path) -> Result<Self, ArchiveError> {
        let fail = |path: &Path, error| FileError::new("read", path, error);
        let folder = folder.canonicalize().map_err(|error| fail(folder, error))?;
        let path = analysis_path(&folder);
        let (mut analysis, metadata) = match open_regular(&path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(ArchiveError::NotAnalysed);
            }
            opened => opened.map_err(|error| fail(&path, error))?,
        };
        if metadata.len() > MOST_ANALYSIS_BYTES {
            return Err(broken(
                &path,
                format!(
                    "it has {} bytes, more than the {MOST_ANALYSIS_BYTES} allowed here",
                    metadata.len()
                ),
            ));
        }
        let mut hashed = Hashed::default();
        hashed.add("analysis", &hash_of(&mut analysis).map_err(|error| fail(&path, error))?);
        let mut flights = Vec::new();
        if is_campaign(&folder) {
            for flight in campaign::flights(&folder)? {
                flights.extend(FlightSources::read(&flight, &mut hashed)?);
            }
        }
        let path = folder.join("gap").join("verdict.json");
        let verdict: Option<Verdict> = hashed.json("verdict", &path)?;
        if let Some(other) = verdict.as_ref().filter(|of| of.schema != VERDICT_SCHEMA) {
            return Err(of_schema(&path, VERDICT_SCHEMA, &other.schema));
        }
        let inputs_sha256 = hashed.finish();
        Ok(Self { folder, inputs_sha256, flights, verdict, analysis })
    }

    /// The short parts of the analysis.
    ///
    /// # Errors
    /// If it is broken, or of another version.
    pub fn slim(&self) -> Result<slim::Analysis, ArchiveError> {
        let path = analysis_path(&self.folder);
        let slim: slim::Analysis =
            parse::json_from(self.rewound()?, std::marker::PhantomData::<slim::Analysis>)
                .map_err(|error| broken(&path, error.to_string()))?;
        if slim.schema != ANALYSIS_SCHEMA {
            return Err(of_schema(&path, ANALYSIS_SCHEMA, &slim.schema));
        }
        Ok(slim)
    }

    /// The analysis from its beginning.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn rewound(&self) -> Result<impl std::io::Read + '_, ArchiveError> {
        let mut file = &self.analysis;
        file.seek(SeekFrom::Start(0))
            .map_err(|error| FileError::new("read", &analysis_path(&self.folder), error))?;
        Ok(BufReader::with_capacity(PIECE_BYTES, file.take(MOST_ANALYSIS_BYTES)))
    }
}

impl FlightSources {
    /// Reads the files of a flight; `None` if it has no plan.
    fn read(folder: &FlightFolder, hashed: &mut Hashed) -> Result<Option<Self>, ArchiveError> {
        let path = folder.plan();
        let Some(bytes) = hashed.bytes("plan", &path)? else { return Ok(None) };
        let plan = parse_plan(&bytes).map_err(|reason| broken(&path, reason))?;
        let mut starts = Vec::new();
        let logs = folder.logs();
        let earlier = earlier_folders(&logs).unwrap_or_default().into_iter().rev();
        let earlier = earlier.map(|(_, folder)| folder.join(START_FILE));
        for path in std::iter::once(StartRecord::path(folder)).chain(earlier).take(MOST_STARTS) {
            starts.extend(hashed.json::<StartRecord>("start", &path)?);
        }
        let record = folder.logs_of(LogOrigin::Simulated).record();
        let name = folder.0.file_name().unwrap_or_default();
        Ok(Some(Self {
            folder: plain(&name.to_string_lossy()).into_owned(),
            plan,
            plan_sha256: sha256(&bytes),
            simulated: hashed.json("simulated", &record)?,
            starts,
            manifest: hashed.json("manifest", &logs.join("manifest.json"))?,
            fleet: hashed.json("fleet", &folder.0.join(FLEET_FILE))?,
        }))
    }
}

/// Hash of files with their roles, in the order in which they are read.
struct Hashed(Sha256);

impl Default for Hashed {
    fn default() -> Self {
        Self(Sha256::new_with_prefix(FORMAT.to_string()))
    }
}

impl Hashed {
    fn add(&mut self, role: &str, sha256: &str) {
        self.0.update(format!("\n{role} {sha256}"));
    }

    /// Content of a file; `None` if it is not there.
    fn bytes(&mut self, role: &str, path: &Path) -> Result<Option<Vec<u8>>, ArchiveError> {
        if !path.exists() {
            return Ok(None);
        }
        let bytes = read_whole(path, MOST_BYTES)?;
        self.add(role, &sha256(&bytes));
        Ok(Some(bytes))
    }

    fn json<T: DeserializeOwned>(
        &mut self,
        role: &str,
        path: &Path,
    ) -> Result<Option<T>, ArchiveError> {
        let Some(bytes) = self.bytes(role, path)? else { return Ok(None) };
        parse::json(&bytes).map(Some).map_err(|error| broken(path, error.to_string()))
    }

    fn finish(self) -> String {
        hexadecimal(self.0)
    }
}

fn hash_of(file: &mut File) -> std::io::Result<String> {
    let mut sha256 = Sha256::new();
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        match file.read(&mut piece) {
            Ok(0) => return Ok(hexadecimal(sha256)),
            Ok(count) => sha256.update(piece.get(..count).unwrap_or_default()),
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

fn of_schema(path: &Path, wanted: &str, found: &str) -> ArchiveError {
    broken(path, format!("this program reads \"{wanted}\", not \"{found}\""))
}

/// A file that cannot be understood.
pub(super) fn broken(path: &Path, reason: String) -> ArchiveError {
    CampaignError::Json { path: path.to_owned(), reason }.into()
}
