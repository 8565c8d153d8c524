//! The first screen of the report: plain sentences for those who fly and those who forecast. Where and
//! when it was, what the air did, how sure that is, and what to distrust.

mod air;
mod extremes;
mod place;
mod trust;

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::result::{Analysis, FlightAnalysis};

use super::compare::{no_measurement, nothing};
use super::page::capitalised;
use super::text::{clean, count};
use air::{air_sentences, law_sentences};
pub(super) use place::{When, day_and_time, laws_sentence, named_site, when};
use trust::distrust;

/// More flights than this are summed up.
pub(super) const SUMMED_FLIGHTS: usize = 3;

/// What the page says first.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Opening {
    /// Where, when, how many drones, how long.
    pub(super) circumstances: Vec<String>,
    /// What the air did, and how sure that is; one paragraph for each flight.
    pub(super) air: Vec<Vec<String>>,
    /// What to distrust most, the worst first.
    pub(super) distrust: Vec<String>,
}

impl Opening {
    /// The opening of an analysis.
    pub(super) fn of(analysis: &Analysis) -> Self {
        Self {
            circumstances: place::circumstances(analysis),
            air: air(analysis),
            distrust: distrust(analysis),
        }
    }

    /// For the page.
    pub(super) fn value(self) -> Value {
        let whole = |sentences: Vec<String>| -> Vec<String> {
            sentences.iter().map(|sentence| unbroken(sentence)).collect()
        };
        context! {
            circumstances => whole(self.circumstances),
            air => self.air.into_iter().map(whole).collect::<Vec<_>>(),
            distrust => whole(self.distrust),
        }
    }
}

/// With numbers, signs and units that no line breaks.
fn unbroken(sentence: &str) -> String {
    [" ±", "± ", " m/s", " %", " UTC", " µs"]
        .into_iter()
        .fold(sentence.to_owned(), |text, part| text.replace(part, &part.replace(' ', "\u{a0}")))
}

/// What the flights found: the air where it was measured, else the laws, else why there is nothing.
fn air(analysis: &Analysis) -> Vec<Vec<String>> {
    let flights = &analysis.flights;
    if flights.len() > SUMMED_FLIGHTS {
        return vec![summed(flights)];
    }
    let measured: Vec<&FlightAnalysis> =
        flights.iter().filter(|flight| flight.map.is_some()).collect();
    let several = flights.len() > 1;
    let mut said: Vec<Vec<String>> =
        measured.iter().map(|flight| air_sentences(flight, measured.len() > 1)).collect();
    if said.is_empty() {
        said.extend(flights.iter().map(|flight| law_sentences(flight, several)));
    }
    said.extend(flights.iter().filter_map(|flight| {
        let words = nothing(flight)?;
        Some(vec![if several {
            format!("{}: {words}", capitalised(&clean(&flight.name)))
        } else {
            words
        }])
    }));
    said.extend(no_measurement(analysis).map(|words| vec![words.to_owned()]));
    said.retain(|paragraph| !paragraph.is_empty());
    said
}

/// Many flights in a sentence.
fn summed(flights: &[FlightAnalysis]) -> Vec<String> {
    let drones = || flights.iter().flat_map(|flight| &flight.drones);
    let fitted = drones().filter(|drone| drone.laws.is_some()).count();
    let measured = flights.iter().filter(|flight| flight.map.is_some()).count();
    let mut said =
        vec![format!("Laws were fitted to {fitted} of {}.", count(drones().count(), "log"))];
    if measured > 0 {
        said.push(format!(
            "{} measured the air; the sections below tell of each.",
            count(measured, "flight")
        ));
    }
    said
}

#[cfg(test)]
mod tests;
