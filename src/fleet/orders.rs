//! Orders of another process to a station that is flying: `fleet abort` while `fly` holds the link.
//!
//! No network: small files in the flight's folder `fleet-orders`, each written whole and renamed.
//! The station says there who it is (`station.json`) and looks about once a second. An order names the
//! station it is for, so that one that was given to a station that has died is never carried out
//! by a later one. The station takes an order by removing its file, and writes the answer beside it
//! again and again until every drone has confirmed.
//!
//! Whoever can write there commands the drones: the folder and its files are their user's alone, and one
//! of somebody else, or a link to elsewhere, is refused.

use std::fs::{self, OpenOptions};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::abort::{Aborted, Action};
use crate::base::file::{FileError, create_folder, read_whole};
use crate::base::parse;
use crate::base::private::{is_own_folder, open_own, own_folder};
use crate::link::id::DroneId;

/// Name of the folder of orders in a flight's folder.
pub const ORDERS_FOLDER: &str = "fleet-orders";
/// Name and version of the format of a station's file.
pub const STATION_SCHEMA: &str = "updraft.fleet-station/1";
/// Name and version of the format of an order.
pub const ORDER_SCHEMA: &str = "updraft.fleet-order/1";
/// Name and version of the format of an answer.
pub const ANSWER_SCHEMA: &str = "updraft.fleet-answer/1";

const STATION_FILE: &str = "station.json";
const ORDER_END: &str = ".order.json";
const ANSWER_END: &str = ".answer.json";
/// No order or answer is larger, bytes: a thousand drones need a tenth of it.
const MOST_BYTES: u64 = 1 << 20;
/// Files of the folder that are looked at in one go.
const MOST_FILES: usize = 1_000;

/// `station.json`: a station that carries out orders.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StationFile {
    /// Format name and version: [`STATION_SCHEMA`].
    pub schema: String,
    /// Name of the station: its start time and process.
    pub station: String,
}

/// An order to a station, as it lies in the station's inbox.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Order {
    /// Format name and version: [`ORDER_SCHEMA`].
    pub schema: String,
    /// Name of the station that is meant.
    pub station: String,
    /// Action that the drones are to carry out.
    pub action: Action,
    /// Drones that are meant; absent: all.
    pub drones: Option<Vec<DroneId>>,
    /// Where it was given.
    #[serde(default)]
    pub from: OrderFrom,
}

/// Where an order was given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OrderFrom {
    /// In another terminal.
    #[default]
    Terminal,
    /// On the station's page.
    Page,
}

impl std::fmt::Display for OrderFrom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Terminal => "from another terminal",
            Self::Page => "on the page",
        })
    }
}

/// Progress of a station with an order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Answer {
    /// Format name and version: [`ANSWER_SCHEMA`].
    pub schema: String,
    /// Counter that rises as long as the station works on the order.
    pub beat: u64,
    /// Drones that are meant, each with the end of its flight; `None` as long as it goes on.
    pub drones: Vec<(DroneId, Option<Aborted>)>,
}

impl Answer {
    /// Whether the order is carried out, so that no further answer comes.
    pub fn is_over(&self) -> bool {
        self.drones.iter().all(|(_, done)| done.is_some())
    }
}

/// Writes a file whole. It need not outlive a power cut, and whoever flies must not wait for a disk.
fn put<T: Serialize>(path: &Path, value: &T) -> Result<(), FileError> {
    let failed = |source| FileError::new("write", path, source);
    let bytes = serde_json::to_vec(value).map_err(|error| failed(error.into()))?;
    let part = path.with_extension("part");
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(true);
    open_own(&part, &mut options)
        .and_then(|mut file| file.write_all(&bytes))
        .and_then(|()| fs::rename(&part, path))
        .map_err(failed)
}

/// A file of this format; `None`: there is none that can be read, or not yet.
fn get<T: DeserializeOwned>(path: &Path) -> Option<T> {
    parse::json(&read_whole(path, MOST_BYTES).ok()?).ok()
}

/// An order that a station has taken.
#[derive(Clone, Debug)]
pub struct Taken {
    /// Content of the order.
    pub order: Order,
    answer: PathBuf,
}

impl Taken {
    /// Writes the progress of the order for the process that gave it.
    ///
    /// # Errors
    ///
    /// If the file cannot be written.
    pub fn answer(&self, answer: &Answer) -> Result<(), FileError> {
        put(&self.answer, answer)
    }
}

/// Folder in which a station looks for orders. It is removed with the station.
#[derive(Debug)]
pub struct Inbox {
    folder: PathBuf,
    station: String,
}

impl Inbox {
    /// Opens the inbox of a station, and removes what was left for others. `station` is a name that
    /// no other station of this flight has had or will have.
    ///
    /// # Errors
    ///
    /// If the folder cannot be made or written.
    pub fn open(flight: &Path, station: String) -> Result<Self, FileError> {
        let folder = flight.join(ORDERS_FOLDER);
        create_folder(flight)?;
        own_folder(&folder).map_err(|source| FileError::new("use the folder", &folder, source))?;
        for path in files(&folder) {
            let _ = fs::remove_file(path);
        }
        let file = StationFile { schema: STATION_SCHEMA.to_owned(), station: station.clone() };
        put(&folder.join(STATION_FILE), &file)?;
        Ok(Self { folder, station })
    }

    /// Takes the orders to this station since the last call, oldest name first.
    pub fn take(&mut self) -> Vec<Taken> {
        let mut taken = Vec::new();
        for path in files(&self.folder) {
            let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
            let Some(name) = name.strip_suffix(ORDER_END) else { continue };
            let answer = self.folder.join(format!("{name}{ANSWER_END}"));
            let order = get::<Order>(&path);
            // Who cannot remove it must carry it out all the same, but only once.
            let gone = fs::remove_file(&path);
            let withdrawn = gone.is_err_and(|error| error.kind() == io::ErrorKind::NotFound);
            if let Some(order) = order
                && order.schema == ORDER_SCHEMA
                && order.station == self.station
                && !withdrawn
            {
                taken.push(Taken { order, answer });
            }
        }
        taken
    }
}

impl Drop for Inbox {
    fn drop(&mut self) {
        let _ = fs::remove_file(self.folder.join(STATION_FILE));
        // Answers are left for those who wait for them.
        let _ = fs::remove_dir(&self.folder);
    }
}

/// The files of the folder, in the order of their names.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut all: Vec<PathBuf> =
        entries.take(MOST_FILES).filter_map(|entry| Some(entry.ok()?.path())).collect();
    all.sort();
    all
}

/// An order that was given to a station.
#[derive(Debug)]
pub struct Given {
    order: PathBuf,
    answer: PathBuf,
}

/// Whether a station has announced that it takes orders for this flight; it may have died since.
pub fn has_station(flight: &Path) -> bool {
    flight.join(ORDERS_FOLDER).join(STATION_FILE).is_file()
}

/// Gives an order to the station of a flight; `None` if there is no station. `name` belongs to this
/// order alone and rises with time.
///
/// # Errors
///
/// If the order cannot be written.
pub fn give(
    flight: &Path,
    name: &str,
    action: Action,
    drones: Option<Vec<DroneId>>,
    from: OrderFrom,
) -> Result<Option<Given>, FileError> {
    let folder = flight.join(ORDERS_FOLDER);
    match is_own_folder(&folder) {
        Ok(()) => {}
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(FileError::new("use the folder", &folder, error)),
    }
    let Some(file) = get::<StationFile>(&folder.join(STATION_FILE)) else { return Ok(None) };
    let order =
        Order { schema: ORDER_SCHEMA.to_owned(), station: file.station, action, drones, from };
    let given = Given {
        order: folder.join(format!("{name}{ORDER_END}")),
        answer: folder.join(format!("{name}{ANSWER_END}")),
    };
    put(&given.order, &order)?;
    Ok(Some(given))
}

impl Given {
    /// Present answer of the station, if it has written one.
    pub fn answer(&self) -> Option<Answer> {
        get::<Answer>(&self.answer).filter(|answer| answer.schema == ANSWER_SCHEMA)
    }

    /// Withdraws the order if the station has not taken it; returns whether it was still there.
    pub fn withdraw(&self) -> bool {
        fs::remove_file(&self.order).is_ok()
    }

    /// Removes the answer and, if it is empty, its folder.
    pub fn forget(self) {
        let _ = fs::remove_file(&self.answer);
        let _ = self.answer.parent().map(fs::remove_dir);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRONE: DroneId = DroneId { network: 0, system: 7 };

    #[test]
    fn an_order_is_taken_once_and_answered() {
        let flight = tempfile::tempdir().unwrap();
        let mut inbox = Inbox::open(flight.path(), "one".to_owned()).unwrap();
        let given = give(flight.path(), "1", Action::Land, Some(vec![DRONE]), OrderFrom::Terminal)
            .unwrap()
            .unwrap();
        let taken = inbox.take();
        assert_eq!(taken[0].order.drones, Some(vec![DRONE]));
        assert_eq!(taken[0].order.action, Action::Land);
        assert!(inbox.take().is_empty(), "once");
        assert!(!given.withdraw(), "it is taken");
        let drones = vec![(DRONE, Some(Aborted::Confirmed(Action::Land)))];
        let answer = Answer { schema: ANSWER_SCHEMA.to_owned(), beat: 1, drones };
        taken[0].answer(&answer).unwrap();
        assert_eq!(given.answer(), Some(answer));
        given.forget();
        drop(inbox);
        assert!(!flight.path().join(ORDERS_FOLDER).exists(), "nothing is left");
    }

    #[test]
    fn an_order_to_a_dead_station_is_never_carried_out_by_a_later_one() {
        let flight = tempfile::tempdir().unwrap();
        // A station that is killed leaves its file.
        std::mem::forget(Inbox::open(flight.path(), "one".to_owned()).unwrap());
        let given =
            give(flight.path(), "1", Action::Return, None, OrderFrom::Terminal).unwrap().unwrap();
        let order = fs::read(&given.order).unwrap();
        let mut later = Inbox::open(flight.path(), "two".to_owned()).unwrap();
        assert!(later.take().is_empty(), "removed when the station begins");
        fs::write(&given.order, order).unwrap();
        assert!(later.take().is_empty(), "it is for another station");
        assert!(!given.order.exists(), "and is not looked at again");
    }

    #[cfg(unix)]
    #[test]
    fn only_their_user_can_give_orders() {
        use std::os::unix::fs::{PermissionsExt as _, symlink};
        let flight = tempfile::tempdir().unwrap();
        let folder = flight.path().join(ORDERS_FOLDER);
        fs::create_dir(&folder).unwrap();
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o777)).unwrap();
        let mut inbox = Inbox::open(flight.path(), "one".to_owned()).unwrap();
        let given =
            give(flight.path(), "1", Action::Land, None, OrderFrom::Terminal).unwrap().unwrap();
        let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
        assert_eq!(mode(&folder), 0o700);
        assert_eq!(mode(&folder.join(STATION_FILE)), 0o600);
        assert_eq!(mode(&given.order), 0o600);
        let taken = inbox.take();
        taken[0].answer(&Answer::default()).unwrap();
        assert_eq!(mode(&given.answer), 0o600);
        drop(inbox);
        given.forget();
        // A link to a folder that somebody else watches.
        let elsewhere = tempfile::tempdir().unwrap();
        let _ = fs::remove_dir_all(&folder);
        symlink(elsewhere.path(), &folder).unwrap();
        let error = Inbox::open(flight.path(), "two".to_owned()).unwrap_err();
        assert!(error.source.to_string().contains("symbolic link"), "{error:?}");
        let file = StationFile { schema: STATION_SCHEMA.to_owned(), station: "two".to_owned() };
        put(&elsewhere.path().join(STATION_FILE), &file).unwrap();
        let error =
            give(flight.path(), "1", Action::Return, None, OrderFrom::Terminal).unwrap_err();
        assert!(error.source.to_string().contains("symbolic link"), "{error:?}");
    }

    #[test]
    fn what_is_no_order_is_not_carried_out() {
        let flight = tempfile::tempdir().unwrap();
        assert!(
            give(flight.path(), "1", Action::Return, None, OrderFrom::Terminal).unwrap().is_none(),
            "nobody is there"
        );
        let mut inbox = Inbox::open(flight.path(), "one".to_owned()).unwrap();
        let folder = flight.path().join(ORDERS_FOLDER);
        fs::write(folder.join("1.order.json"), "{\"action\":\"ret").unwrap();
        fs::write(folder.join("2.order.json"), vec![b' '; 2 << 20]).unwrap();
        assert!(inbox.take().is_empty());
    }
}
