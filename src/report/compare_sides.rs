//! Campaigns of a comparison: where and when they were flown, and where their own pages are.

use minijinja::value::Value;

use crate::analysis::result::{Analysis, FlightAnalysis};

use super::links::{self, PageLink};
use super::opening::{named_site, when};
use super::text::clean;

/// Most flights whose time is told.
const MOST_FLIGHTS: usize = 4;

/// Place, time and files of a compared campaign, which stand beside its numbers.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ComparedFiles {
    /// Files of the campaign, as links from the folder of the page.
    pub links: Vec<PageLink>,
    /// Where and when it was flown, a line each.
    pub circumstances: Vec<String>,
}

/// The links as the page has them.
pub(super) fn links(of: &ComparedFiles) -> Vec<Value> {
    links::values(&of.links)
}

/// Where a campaign was flown, and when each of its flights was, UTC; empty where neither is known.
pub fn where_and_when(analysis: &Analysis) -> Vec<String> {
    let mut said = Vec::from_iter(named_site(&analysis.flights));
    said.extend(analysis.flights.iter().filter_map(time_words).take(MOST_FLIGHTS));
    said
}

/// `calibration: 2026-06-01 12:00:18 to 12:06:02 UTC`
fn time_words(flight: &FlightAnalysis) -> Option<String> {
    Some(format!("{}: {}", clean(&flight.name), when(flight)?.utc()?))
}
