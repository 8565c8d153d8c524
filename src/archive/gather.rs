//! Gathers one campaign into an archive.

use std::collections::BTreeMap;
use std::fs::File;
use std::path::Path;

use super::flights::{self, Flown};
use super::index::{ArchivedCampaign, NO_DATE, id_of};
use super::origin::Origin;
use super::seconds::{self, SecondRow};
use super::slim::Span;
use super::sources::{Sources, analysis_path, broken};
use super::staging::Staging;
use super::table::Table;
use super::{ArchiveError, drones, series, slim, thermals, verdicts};

/// Flights that a campaign may have.
const MOST_FLIGHTS: usize = 1000;
/// Days on which the flights of a campaign may be.
const MOST_DAYS: usize = 16;

/// A campaign that can be gathered.
#[derive(Debug)]
pub struct Campaign {
    /// Id of the campaign.
    pub id: String,
    /// Whether it was simulated; absent: not known.
    pub simulated: Option<bool>,
    sources: Sources,
    analysis: slim::Analysis,
    origins: Vec<Origin>,
}

impl Campaign {
    /// Reads what makes a campaign's short tables.
    ///
    /// # Errors
    /// If the analysis is broken or too large.
    pub fn read(sources: Sources) -> Result<Self, ArchiveError> {
        let analysis = sources.slim()?;
        let number = analysis.flights.len();
        if number > MOST_FLIGHTS {
            return Err(ArchiveError::TooMany { number, what: "flights", most: MOST_FLIGHTS });
        }
        let flights = analysis.flights.iter();
        let origins: Vec<Origin> =
            flights.map(|flight| Origin::of(flight, &sources.flights)).collect();
        let mut identity: String = origins.iter().map(|origin| origin.identity.as_str()).collect();
        if origins.iter().all(|origin| origin.start.is_none()) {
            // Nothing tells flights of the same plan apart but where they are kept.
            identity.push_str(&sources.folder.to_string_lossy());
        }
        let id = id_of(&sources.folder, &identity);
        let simulated = origins.iter().find_map(|origin| origin.simulated);
        Ok(Self { id, simulated, sources, analysis, origins })
    }

    /// Writes the campaign's tables into an archive, which must be locked, in place of those of `before`. Returns its entry
    /// for the index.
    ///
    /// # Errors
    /// If the analysis is broken, or a table cannot be written: then what was there stays.
    pub fn write(
        &self,
        archive: &Path,
        before: Option<&ArchivedCampaign>,
    ) -> Result<ArchivedCampaign, ArchiveError> {
        let flown = self.flown();
        let dates: Vec<String> = self
            .origins
            .iter()
            .map(|origin| origin.date().unwrap_or_else(|| NO_DATE.to_owned()))
            .collect();
        let mut days: BTreeMap<&str, Vec<&Flown<'_>>> = BTreeMap::new();
        for (date, flown) in dates.iter().zip(&flown) {
            days.entry(date).or_default().push(flown);
        }
        if days.len() > MOST_DAYS {
            let number = days.len();
            return Err(ArchiveError::TooMany { number, what: "days", most: MOST_DAYS });
        }
        let mut staging = Staging::begin(archive)?;
        self.write_seconds(&flown, &dates, days.keys().copied(), &mut staging)?;
        for (date, flown) in &days {
            let of = || flown.iter().copied();
            staging.write("drones", date, drones::columns(), of().flat_map(drones::rows))?;
            staging.write("thermals", date, thermals::columns(), of().flat_map(thermals::rows))?;
            staging.write("flights", date, flights::columns(), of().cloned())?;
            // A verdict is the campaign's: it stands at the date of its first flight.
            let is_first = dates.first().is_some_and(|first| first == date);
            let verdict = self.sources.verdict.as_ref().filter(|_| is_first);
            let rows = verdict.map(verdicts::rows).unwrap_or_default();
            staging.write("verdicts", date, verdicts::columns(), rows)?;
        }
        Ok(ArchivedCampaign {
            id: self.id.clone(),
            folder: self.sources.folder.clone(),
            inputs_sha256: self.sources.inputs_sha256.clone(),
            simulated: self.simulated,
            parts: staging.place(archive, &self.id, before)?,
        })
    }

    /// Hash of the campaign's files.
    pub fn inputs_sha256(&self) -> &str {
        &self.sources.inputs_sha256
    }

    /// Folder of the campaign.
    pub fn folder(&self) -> &Path {
        &self.sources.folder
    }

    fn flown(&self) -> Vec<Flown<'_>> {
        let flights = self.analysis.flights.iter().zip(&self.origins);
        flights
            .map(|(flight, origin)| Flown {
                title: &self.analysis.title,
                made_by: &self.analysis.made_by,
                flight,
                origin: origin.clone(),
                site: origin.site_name(),
            })
            .collect()
    }

    /// Streams the long table: one drone of the analysis is in memory, and one group of rows for each day.
    fn write_seconds<'d>(
        &self,
        flown: &[Flown<'_>],
        dates: &[String],
        days: impl Iterator<Item = &'d str>,
        staging: &mut Staging,
    ) -> Result<(), ArchiveError> {
        const TABLE: &str = "seconds";
        let begun = days.map(|date| Ok((date, staging.table(TABLE, date, seconds::columns())?)));
        let mut tables: BTreeMap<&str, Table<SecondRow, File>> =
            begun.collect::<Result<_, ArchiveError>>()?;
        let spans: Vec<Span> = flown
            .iter()
            .map(|flown| flown.map().map(|map| map.time_s).unwrap_or_default())
            .collect();
        let mut failed = None;
        let walked =
            series::walk(self.sources.rewound()?, &spans, &mut |flight, time_s, series| {
                let flight = flown.get(flight).zip(dates.get(flight));
                let flight =
                    flight.and_then(|(flown, date)| Some((flown, tables.get_mut(&**date)?)));
                let (flown, table) =
                    flight.ok_or_else(|| "a flight more than before".to_owned())?;
                seconds::rows(flown, time_s, &series).try_for_each(|row| table.push(row)).map_err(
                    |error| {
                        let reason = error.to_string();
                        failed = Some(ArchiveError::Table { table: TABLE, reason });
                        String::new()
                    },
                )
            });
        if let Some(error) = failed {
            return Err(error);
        }
        walked.map_err(|reason| broken(&analysis_path(&self.sources.folder), reason))?;
        for (date, table) in tables {
            staging.finish(TABLE, date, table)?;
        }
        Ok(())
    }
}
