//! The HTML page of campaigns side by side.

use minijinja::context;
use minijinja::value::Value;

use crate::compare::result::{
    ComparedCampaign, Comparison, DroneChange, LawComparison, MapComparison, Pair, Quantity,
};

use super::compare_sides::{ComparedFiles, links};
use super::compare_terminal::title;
use super::compare_words as words;
use super::figures::compare::{drones, laws, maps, structure};
use super::fill::{common, fill};
use super::format::Format;
use super::text::{NONE, clean, count, slug, unit};
use super::{Figure, Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/compare.html");

/// Renders the page and the figures of a comparison. `files`: what is there of each campaign, in their order.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_comparison(
    comparison: &Comparison,
    provenance: &Provenance,
    files: &[ComparedFiles],
) -> Result<Report, ReportError> {
    let mut figures = Figures::default();
    let values = values(comparison, provenance, files, &mut figures);
    let html = fill("compare.html", PAGE, values)?;
    Ok(Report { html, figures: figures.files, data: Vec::new() })
}

/// The figures alone, drawn for a format.
#[cfg(any(feature = "paper-figures", test))]
pub(super) fn figures(comparison: &Comparison, format: Format) -> Vec<(String, String)> {
    let mut figures = Figures { format, ..Figures::default() };
    values(comparison, &Provenance::default(), &[], &mut figures);
    figures.files
}

fn values(
    comparison: &Comparison,
    provenance: &Provenance,
    files: &[ComparedFiles],
    figures: &mut Figures,
) -> Value {
    let laws: Vec<Value> = comparison
        .laws
        .iter()
        .enumerate()
        .map(|(index, law)| law_section(comparison, law, index, figures))
        .collect();
    let maps: Vec<Value> = comparison
        .maps
        .iter()
        .enumerate()
        .map(|(index, map)| map_section(comparison, map, index, figures))
        .collect();
    let campaigns: Vec<Value> = comparison
        .campaigns
        .iter()
        .enumerate()
        .map(|(index, one)| {
            let own = files.get(index);
            context! {
                circumstances => own.map_or_else(Vec::new, |own| own.circumstances.clone()),
                links => own.map_or_else(Vec::new, links),
                id => clean(&one.id),
                path => clean(&one.path),
                title => clean(&one.title),
                vehicle => one.vehicle.as_deref().map_or_else(|| NONE.to_owned(), clean),
                flights => one.flights.iter().map(|id| clean(id)).collect::<Vec<_>>().join(", "),
            }
        })
        .collect();
    let cleaned = |items: &[String]| items.iter().map(|item| clean(item)).collect::<Vec<_>>();
    let ids: Vec<String> = comparison.campaigns.iter().map(|one| clean(&one.id)).collect();
    context! {
        title => title(&ids),
        verdict => verdict(comparison),
        tiles => tiles(comparison),
        campaigns,
        laws,
        maps,
        equal => words::equal_sentences(comparison),
        not_compared => cleaned(&comparison.not_compared),
        notes => cleaned(&comparison.notes),
        schema => clean(&comparison.schema),
        ..common(provenance),
    }
}

/// Figures, numbered in the order in which they are shown.
#[derive(Default)]
struct Figures {
    /// What they are drawn for.
    format: Format,
    files: Vec<(String, String)>,
}

impl Figures {
    fn show(&mut self, figure: Option<Figure>) -> Option<Value> {
        let figure = figure?;
        let shown = context! {
            number => self.files.len() + 1,
            name => figure.name.clone(),
            title => figure.title,
            caption => figure.caption,
            svg => Value::from_safe_string(figure.svg.clone()),
        };
        self.files.push((figure.name, figure.svg));
        Some(shown)
    }
}

fn key(of: &Pair, index: usize) -> String {
    format!("{}-{}", slug(&of.other), index + 1)
}

fn verdict(comparison: &Comparison) -> Vec<String> {
    let of_law = |law: &LawComparison| {
        let vehicles = words::other_vehicle(comparison, &law.pair);
        let mut said = words::drone_sentences(law);
        said.extend(words::fleet_sentences(law, vehicles.as_deref()));
        said
    };
    let of_map = |map: &MapComparison| words::map_sentences(map).into_iter().next();
    if comparison.campaigns.len() <= 2 {
        let laws = comparison.laws.iter().flat_map(of_law);
        return laws.chain(comparison.maps.iter().filter_map(of_map)).take(MOST_TOLD).collect();
    }
    // Of several, each has a paragraph that begins with its name.
    let of_campaign = |one: &ComparedCampaign| {
        let is_of = |pair: &Pair| one.flights.contains(&pair.other);
        let laws = comparison.laws.iter().filter(|law| is_of(&law.pair)).flat_map(of_law);
        let maps = comparison.maps.iter().filter(|map| is_of(&map.pair)).filter_map(of_map);
        let said: Vec<String> = laws.chain(maps).collect();
        (!said.is_empty()).then(|| format!("{}: {}", clean(&one.id), said.join(" ")))
    };
    comparison.campaigns.iter().skip(1).filter_map(of_campaign).take(MOST_TOLD).collect()
}

/// Sentences above everything else; all are below.
const MOST_TOLD: usize = 6;

fn tiles(comparison: &Comparison) -> Vec<Value> {
    let several = comparison.campaigns.len() > 2;
    let of =
        |pair: &Pair| if several { format!(", {}", clean(&pair.other)) } else { String::new() };
    let mut tiles = Vec::new();
    for law in &comparison.laws {
        let changed = law.drones.iter().filter(|one| one.is_changed).count();
        tiles.push(context! {
            label => format!("drones that changed{}", of(&law.pair)),
            value => changed.to_string(),
            note => format!("of {} in both", law.drones_in_both),
        });
        let hover = law.fleet.iter().find(|change| change.quantity == Quantity::Hover);
        if let Some(hover) = hover {
            tiles.push(context! {
                label => format!("fleet in hover ({}){}", unit(&hover.unit), of(&law.pair)),
                value => words::change(hover.change),
                note => words::probability(hover.p_value),
            });
        }
    }
    for map in &comparison.maps {
        tiles.push(context! {
            label => format!("mean of the air (m/s){}", of(&map.pair)),
            value => words::change(map.mean.change),
            note => words::probability(map.mean.p_value),
        });
    }
    tiles
}

fn law_section(
    comparison: &Comparison,
    law: &LawComparison,
    index: usize,
    figures: &mut Figures,
) -> Value {
    let vehicles = words::other_vehicle(comparison, &law.pair);
    let key = key(&law.pair, index);
    let fleet: Vec<Value> = law
        .fleet
        .iter()
        .map(|one| {
            let [before, now] = words::before_and_now(one);
            context! {
                name => words::quantity(one),
                unit => unit(&one.unit),
                reference => before,
                other => now,
                change => words::change(one.change),
                p => words::probability_cell(one.p_value),
            }
        })
        .collect();
    let shown = [
        figures.show(laws::figure(law, &key, figures.format)),
        figures.show(drones::figure(law, &key, figures.format)),
    ];
    context! {
        heading => words::pair(&law.pair),
        law => clean(&law.law),
        drones_in_both => count(law.drones_in_both, "drone"),
        sentences => words::drone_sentences(law)
            .into_iter()
            .chain(words::fleet_sentences(law, vehicles.as_deref()))
            .chain(words::errors_sentence(law))
            .collect::<Vec<_>>(),
        fleet,
        drones => law.drones.iter().map(|one| drone_row(law, one)).collect::<Vec<_>>(),
        figures => shown.into_iter().flatten().collect::<Vec<_>>(),
    }
}

fn drone_row(law: &LawComparison, one: &DroneChange) -> Value {
    let of = |quantity: Quantity| {
        let change = one.changes.iter().find(|change| change.quantity == quantity);
        let beyond = change.and_then(|change| change.beyond_fleet);
        context! {
            reference => change.map_or_else(|| NONE.to_owned(), |of| words::value(of.reference)),
            other => change.map_or_else(|| NONE.to_owned(), |of| words::value(of.other)),
            beyond => beyond.map_or_else(|| NONE.to_owned(), words::change),
            p => words::probability_cell(change.and_then(|change| change.p_value)),
            p_holm => words::probability_cell(change.and_then(|change| change.p_holm)),
        }
    };
    context! {
        name => words::drone(one, law.identity),
        is_changed => one.is_changed,
        hover => of(Quantity::Hover),
        response => of(Quantity::Response),
        climb => of(Quantity::Climb),
        descent => of(Quantity::Descent),
    }
}

fn map_section(
    comparison: &Comparison,
    map: &MapComparison,
    index: usize,
    figures: &mut Figures,
) -> Value {
    let key = key(&map.pair, index);
    let scales: Vec<Value> = map
        .scales
        .iter()
        .map(|row| {
            context! {
                name => clean(&row.name),
                unit => unit(&row.unit),
                reference => words::scale(row.reference, row.reference_interval),
                other => words::scale(row.other, row.other_interval),
                p => words::probability_cell(row.p_value),
                p_holm => words::probability_cell(row.p_holm),
                differs => words::differs(row),
            }
        })
        .collect();
    let correlations = comparison.structures.iter().find(|one| one.pair == map.pair);
    let shown = [
        figures.show(maps::figure(map, &key, figures.format)),
        figures.show(correlations.and_then(|one| structure::figure(one, &key, figures.format))),
    ];
    context! {
        heading => words::pair(&map.pair),
        sentences => words::map_sentences(map),
        scales,
        figures => shown.into_iter().flatten().collect::<Vec<_>>(),
    }
}
