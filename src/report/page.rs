//! The HTML page: what goes where; the words and the look are in `templates/report/`.

use minijinja::context;
use minijinja::value::Value;
use rayon::prelude::*;

use crate::analysis::result::{Analysis, FlightAnalysis};
use crate::study::result::StudyResult;

use super::cite::citation;
use super::explorer::Explorer;
use super::figures::{laws as figure_laws, study as figure_study};
use super::fill::{OPEN_LIMIT, STYLE, common, fill};
use super::format::Format;
use super::opening::Opening;
use super::page_air::air_section;
use super::page_flight::flight_section;
use super::study_page::law_table;
use super::text::{clean, slug};
use super::vendor::{plotter, plotter_style};
use super::{Beside, FIGURES_FOLDER, Figure, Provenance, Report, ReportError, glance};

const PAGE: &str = include_str!("../../templates/report/report.html");
/// The plotting library comes before them.
const SCRIPTS: [&str; 7] = [
    include_str!("../../templates/report/unpack.js"),
    include_str!("../../templates/report/shared.js"),
    include_str!("../../templates/report/script.js"),
    include_str!("../../templates/report/film.js"),
    include_str!("../../templates/report/series.js"),
    include_str!("../../templates/report/replay.js"),
    include_str!("../../templates/report/map.js"),
];
const EXPLORER_STYLE: &str = include_str!("../../templates/report/explorer.css");

/// Makes the page and the figures.
pub(super) fn render(
    analysis: &Analysis,
    beside: Beside<'_>,
    provenance: &Provenance,
) -> Result<Report, ReportError> {
    draw(analysis, beside, Format::default()).page(analysis, provenance)
}

/// The figures of the report alone, drawn for a format.
#[cfg(any(feature = "paper-figures", test))]
pub(super) fn figures(
    analysis: &Analysis,
    beside: Beside<'_>,
    format: Format,
) -> Vec<(String, String)> {
    draw(analysis, beside, format).figures.files
}

/// Sections of a page with their figures: all that takes long, and does not tell where the numbers come from.
pub struct Drawn {
    air: Vec<Value>,
    laws: Option<Value>,
    study: Option<Value>,
    flights: Vec<Value>,
    figures: Gallery,
}

/// Draws the sections of the page.
pub(super) fn draw(analysis: &Analysis, beside: Beside<'_>, format: Format) -> Drawn {
    let Beside { study, basemap } = beside;
    let mut figures = Gallery::of(format);
    let section = |make: &(dyn Fn(&mut Gallery) -> Option<Value> + Sync)| {
        let mut own = Gallery::of(format);
        (make(&mut own), own)
    };
    let numbered = || analysis.flights.par_iter().enumerate();
    let (air, flights): (Vec<_>, Vec<_>) = rayon::join(
        || {
            let of = |(index, flight)| {
                section(&|own| air_section(analysis, flight, index, basemap, own))
            };
            numbered().map(of).collect()
        },
        || {
            let of = |(index, flight)| {
                section(&|own| Some(flight_section(analysis, flight, index, own)))
            };
            numbered().map(of).collect()
        },
    );
    let air: Vec<Value> = air.into_iter().filter_map(|made| figures.hang(made)).collect();
    let laws = figure_laws::figure(analysis, figures.format).map(|figure| figures.show(figure));
    let study = study.map(|study| study_section(study, &mut figures));
    let flights: Vec<Value> = flights.into_iter().filter_map(|made| figures.hang(made)).collect();
    Drawn { air, laws, study, flights, figures }
}

impl Drawn {
    /// The page of what was drawn of an analysis, with its files.
    ///
    /// # Errors
    ///
    /// [`ReportError::Page`], a bug of this program.
    pub fn page(self, analysis: &Analysis, provenance: &Provenance) -> Result<Report, ReportError> {
        let Self { air, laws, study, flights, figures } = self;
        let warnings: Vec<String> =
            analysis.warnings.iter().map(|w| clean(&w.to_string())).collect();
        let title = clean(&analysis.title);
        let title = if title.trim().is_empty() { "Updraft report".to_owned() } else { title };
        let values = context! {
            opening => Opening::of(analysis).value(),
            cite => citation(analysis, &title, provenance),
            title,
            script => Value::from_safe_string(format!("\"use strict\";\n{}\n{}", plotter(), SCRIPTS.concat())),
            style => Value::from_safe_string(format!("{STYLE}{EXPLORER_STYLE}{}", plotter_style())),
            made_by => clean(&analysis.made_by),
            schema => clean(&analysis.schema),
            seed => provenance.seed.map(|seed| seed.to_string()),
            made_at => clean(&provenance.made_at),
            tiles => glance::tiles(analysis),
            warnings_open => warnings.len() <= OPEN_LIMIT,
            warnings,
            air,
            laws,
            study,
            flights,
            ..common(provenance),
        };
        let html = fill("report.html", PAGE, values)?;
        Ok(Report { html, figures: figures.files, data: figures.data })
    }
}

/// Names the figures of the page as their files are named, and collects the files.
#[derive(Default)]
pub(super) struct Gallery {
    /// What they are drawn for.
    pub(super) format: Format,
    pub(super) files: Vec<(String, String)>,
    /// Files of data beside the page.
    data: Vec<(String, String)>,
}

impl Gallery {
    /// An empty one of figures for a format.
    pub(super) fn of(format: Format) -> Self {
        Self { format, ..Self::default() }
    }

    /// Keeps all files of a section that was made apart; the section.
    fn hang<T>(&mut self, (section, own): (T, Self)) -> T {
        self.files.extend(own.files);
        self.data.extend(own.data);
        section
    }

    /// Keeps the files of interactive parts; what their template gets.
    pub(super) fn explore(&mut self, explorer: Option<Explorer>) -> Option<Value> {
        let Explorer { values, files } = explorer.filter(|_| !self.format.is_print())?;
        self.data.extend(files);
        Some(values)
    }

    /// Shows a figure with links to others, which lie in a folder as seen from the page.
    pub(super) fn show_linked(&mut self, figure: Figure) -> Value {
        let file = (figure.name.clone(), figure.svg.clone());
        let svg = figure.svg.replace("<a href=\"", &format!("<a href=\"{FIGURES_FOLDER}/"));
        let value = self.show(Figure { svg, ..figure });
        if let Some(last) = self.files.last_mut() {
            *last = file;
        }
        value
    }

    /// Labels a figure and keeps its file.
    pub(super) fn show(&mut self, figure: Figure) -> Value {
        let value = context! {
            label => label(&figure.name),
            name => figure.name.clone(),
            title => figure.title,
            caption => figure.caption,
            svg => Value::from_safe_string(figure.svg.clone()),
        };
        self.files.push((figure.name, figure.svg));
        value
    }
}

/// What a figure is called on every page: as its file, `5-hover` for `fig5-hover.svg` and `map-hover` for
/// `map-hover.svg`.
pub(super) fn label(name: &str) -> &str {
    name.strip_prefix("fig")
        .filter(|rest| rest.starts_with(|c: char| c.is_ascii_digit()))
        .unwrap_or(name)
}

/// The paper's Fig. 2 and Table I, from the study that the campaign holds.
fn study_section(study: &StudyResult, figures: &mut Gallery) -> Value {
    let shown: Vec<Value> = figure_study::figures(study, figures.format)
        .into_iter()
        .filter(|figure| figure.name == figure_study::FIG2)
        .map(|figure| figures.show(figure))
        .collect();
    context! {
        figures => shown,
        table => law_table(study),
        flights => study.flights.len(),
        vehicle => clean(&study.vehicle),
        made_by => clean(&study.made_by),
    }
}

/// The flight in file names: its name, numbered when an earlier flight's looks the same.
pub(super) fn flight_key(analysis: &Analysis, index: usize) -> String {
    let key = |flight: &FlightAnalysis| slug(&flight.name);
    let own = analysis.flights.get(index).map_or_else(|| slug(""), key);
    let twin = analysis.flights.iter().take(index).any(|earlier| key(earlier) == own);
    if twin { format!("{own}-flight{}", index + 1) } else { own }
}

/// With a capital first letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
