//! Campaigns of a comparison: where and when they were flown, and where their own pages are.

use minijinja::value::Value;

use crate::analysis::result::{Analysis, FlightAnalysis, FlightSite};

use super::links::{self, PageLink};
use super::opening::{day_and_time, site_words, when};
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
    let sites = || analysis.flights.iter().filter_map(|flight| flight.site);
    // A plan knows the ground's height, which first fixes do not.
    let site: Option<FlightSite> = sites().find(|site| site.planned).or_else(|| sites().next());
    let mut said: Vec<String> = site.iter().map(site_words).collect();
    said.extend(analysis.flights.iter().filter_map(time_words).take(MOST_FLIGHTS));
    said
}

/// `calibration: 2026-06-01 12:00:18 to 12:06:02 UTC`
fn time_words(flight: &FlightAnalysis) -> Option<String> {
    let when = when(flight)?;
    let (from, to) = (when.unix_s(when.span_s[0])?, when.unix_s(when.span_s[1])?);
    let ((day, from), (last_day, to)) = (day_and_time(from), day_and_time(to));
    let to = if day == last_day { to } else { format!("{last_day} {to}") };
    Some(format!("{}: {day} {from} to {to} UTC", clean(&flight.name)))
}
