//! Ways between the pages of a campaign: what lies beside each, and the commands that make what does not.

use std::path::{Component, Path};

use super::words::shell;
use crate::analysis::result::Analysis;
use crate::base::plain::Shown as _;
use crate::campaign::{self, FlightFolder};
use crate::products::{self, fields, fields_grid};
use crate::report::{PAGE_FILE, PageLink, TURBULENCE_PAGE};

/// Page of a report, of a comparison and of a study, from their folder.
const PAGE: &str = "report";
/// Manifest of a folder of logs.
const MANIFEST: &str = "manifest.json";

/// Links of an analysis's report in `folder`, made of the campaign (or logs) at `root`.
pub(super) fn of_report(root: &Path, folder: &Path, analysis: &Analysis) -> Vec<PageLink> {
    let mut links = vec![PageLink::there("All numbers of this page", "../analysis.json")];
    if fields::any(analysis) {
        links.push(PageLink::there(
            "The map, second by second, as a table",
            relative(folder, &campaign::fields_csv(folder)),
        ));
    }
    if fields_grid::any(analysis) {
        links.push(PageLink::there(
            "The posterior between the drones, as a table",
            relative(folder, &campaign::fields_grid_csv(folder)),
        ));
    }
    links.extend(netcdf(folder, analysis));
    links.extend(turbulence(folder, analysis));
    if products::thermals::any(analysis) {
        let path = campaign::fields_thermals(folder);
        links.push(PageLink::there("Thermals over time, as a table", relative(folder, &path)));
    }
    if products::has_map(analysis) {
        for (title, path) in [
            ("The drones on a map, for Google Earth (KML)", campaign::fields_kml(folder)),
            ("The drones on a map, for a GIS (GeoJSON)", campaign::fields_geojson(folder)),
        ] {
            links.push(PageLink::there(title, relative(folder, &path)));
        }
    }
    links.push(PageLink::there("The figures, one SVG each", "figures/"));
    if folder != root || !campaign::is_campaign(root) {
        return links;
    }
    let named = shell(&root.shown().to_string());
    let gap = format!("gap/{PAGE}/{PAGE_FILE}");
    let gap_title = "Where measurement and model disagree";
    links.push(if root.join(&gap).is_file() {
        PageLink::there(gap_title, format!("../{gap}"))
    } else {
        PageLink::made_by(gap_title, format!("../{gap}"), format!("updraft gap {named}"))
    });
    let study = campaign::study_folder(root).join(PAGE).join(PAGE_FILE);
    if study.is_file() {
        links.push(PageLink::there("The simulation study", relative(root, &study)));
    }
    for flight in campaign::flights(root).unwrap_or_default() {
        links.extend(manifests(root, &flight));
    }
    links.push(PageLink::made_by(
        "The flight again, in a browser",
        "",
        format!("updraft live {named}"),
    ));
    links
}

/// The page and the tables of turbulence.
fn turbulence(folder: &Path, analysis: &Analysis) -> Vec<PageLink> {
    let mut links = Vec::new();
    if analysis.flights.iter().any(|flight| flight.turbulence.is_some()) {
        links.push(PageLink::there("Turbulence", TURBULENCE_PAGE));
    }
    if products::turbulence::any(analysis) {
        let table = products::turbulence::Table::Quantities;
        let path = campaign::fields_turbulence(folder, table.stem());
        links.push(PageLink::there("Turbulence as tables", relative(folder, &path)));
    }
    links
}

/// Links of the page of turbulence, which lies beside the report in `folder`.
pub(super) fn of_turbulence(folder: &Path, analysis: &Analysis) -> Vec<PageLink> {
    let mut links = vec![PageLink::there("The report", PAGE_FILE)];
    if products::turbulence::any(analysis) {
        for (title, table) in [
            (
                "Quantities with their intervals, as a table",
                products::turbulence::Table::Quantities,
            ),
            ("Spectra, as a table", products::turbulence::Table::Spectra),
            ("Covariance by distance and lag, as a table", products::turbulence::Table::Pairs),
            (
                "Coherence by distance and frequency, as a table",
                products::turbulence::Table::Coherence,
            ),
        ] {
            let path = campaign::fields_turbulence(folder, table.stem());
            links.push(PageLink::there(title, relative(folder, &path)));
        }
    }
    links.push(PageLink::there("All numbers", "../analysis.json"));
    links
}

/// The NetCDF files.
#[cfg(feature = "netcdf")]
fn netcdf(folder: &Path, analysis: &Analysis) -> Vec<PageLink> {
    let (drones, grids) = products::netcdf::expected(analysis);
    let single = grids.len() == 1;
    let drones = drones
        .then(|| ("The drones, second by second".to_owned(), campaign::fields_netcdf(folder)));
    let grids = grids.iter().map(|flight| {
        let named = if single { String::new() } else { format!(", {flight}") };
        let path = campaign::fields_grid_netcdf(folder, (!single).then_some(flight));
        (format!("The posterior between the drones{named}"), path)
    });
    let hovers = products::netcdf::expected_turbulence(analysis);
    let hovers: Vec<(String, _)> = hovers
        .iter()
        .map(|flight| {
            let named = if hovers.len() == 1 { String::new() } else { format!(", {flight}") };
            let name = (hovers.len() > 1).then_some(flight.as_str());
            (format!("Turbulence{named}"), campaign::fields_turbulence_netcdf(folder, name))
        })
        .collect();
    let files = drones.into_iter().chain(grids).chain(hovers);
    files
        .map(|(title, path)| {
            PageLink::there(&format!("{title}, as NetCDF (CF)"), relative(folder, &path))
        })
        .collect()
}

#[cfg(not(feature = "netcdf"))]
fn netcdf(_: &Path, _: &Analysis) -> Vec<PageLink> {
    Vec::new()
}

/// Manifests of a flight's logs.
fn manifests(root: &Path, flight: &FlightFolder) -> Vec<PageLink> {
    let folders = [(flight.logs(), "Logs"), (flight.simulated(), "Simulated logs")];
    let there = folders.into_iter().map(|(folder, whose)| (folder.join(MANIFEST), whose));
    there
        .filter(|(path, _)| path.is_file())
        .map(|(path, whose)| {
            let name = flight.0.file_name().filter(|_| flight.0 != root);
            let name =
                name.map_or_else(String::new, |name| format!(", {}", Path::new(name).shown()));
            PageLink::there(&format!("{whose} with their checksums{name}"), relative(root, &path))
        })
        .collect()
}

/// Links of the page of a comparison in `folder`; `campaign`: the one that was compared.
pub(super) fn of_gap(folder: &Path, campaign: Option<&Path>) -> Vec<PageLink> {
    let mut links = vec![
        PageLink::there("All numbers of this page", "../verdict.json"),
        PageLink::there("The vehicle with what was found", "../model.toml"),
        PageLink::there("The figures, one SVG each", "figures/"),
    ];
    let inside = campaign.filter(|root| folder.parent() == Some(*root));
    let Some(root) = inside else { return links };
    let named = shell(&root.shown().to_string());
    let report = format!("{PAGE}/{PAGE_FILE}");
    let title = "The report of the flights";
    links.push(if root.join(&report).is_file() {
        PageLink::there(title, format!("../../{report}"))
    } else {
        PageLink::made_by(title, format!("../../{report}"), format!("updraft analyze {named}"))
    });
    links.push(PageLink::made_by(
        "The flight to fly next, for what is left open",
        "../next.toml",
        format!("updraft gap next {named}"),
    ));
    links.push(PageLink::made_by(
        "The flight again, in a browser",
        "",
        format!("updraft live {named}"),
    ));
    links
}

/// Links of a study's page, in `folder`, with these files of numbers beside `report`.
pub(super) fn of_study(folder: &Path, files: &[(&str, &str)]) -> Vec<PageLink> {
    let mut links: Vec<PageLink> = files
        .iter()
        .filter(|(_, file)| folder.join(file).is_file())
        .map(|(title, file)| PageLink::there(title, format!("../{file}")))
        .collect();
    links.push(PageLink::there("The figures, one SVG each", "figures/"));
    let is_campaigns =
        |root: &&Path| campaign::study_folder(root) == folder && campaign::is_campaign(root);
    if let Some(root) = folder.parent().filter(is_campaigns) {
        let named = shell(&root.shown().to_string());
        links.push(PageLink::made_by(
            "The report of the campaign",
            format!("../../{PAGE}/{PAGE_FILE}"),
            format!("updraft analyze {named}"),
        ));
    }
    links
}

/// The address of a file below `base`, from a page in the folder `report` of it.
fn relative(base: &Path, path: &Path) -> String {
    let inside = path.strip_prefix(base).unwrap_or(path);
    let part = |part: Component<'_>| {
        let text = Path::new(part.as_os_str()).shown().to_string();
        // What would end a path in an address.
        text.replace('%', "%25").replace('#', "%23").replace('?', "%3F")
    };
    let parts: Vec<String> = inside.components().map(part).collect();
    format!("../{}", parts.join("/"))
}
