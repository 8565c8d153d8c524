//! The HTML page of a campaign beside a mast.

use minijinja::context;
use minijinja::value::Value;

use crate::mast::result::{MastComparison, MastFlight};

use super::figures::mast;
use super::fill::{common, fill};
use super::format::Format;
use super::mast_words as words;
use super::text::{NONE, clean, fixed, signed, slug};
use super::{Provenance, Report, ReportError};

const PAGE: &str = include_str!("../../templates/report/mast.html");

/// Renders the page and the figures of a comparison with a mast.
///
/// # Errors
/// [`ReportError::Page`], a bug of this program.
pub fn render_mast(of: &MastComparison, provenance: &Provenance) -> Result<Report, ReportError> {
    let mut files = Vec::new();
    let flights: Vec<Value> = of.flights.iter().map(|flight| section(flight, &mut files)).collect();
    let values = context! {
        title => words::title(of),
        verdict => of.flights.first().map(words::sentences).unwrap_or_default(),
        when => of.flights.first().map(words::when),
        tiles => of.flights.first().map(tiles).unwrap_or_default(),
        flights,
        mast => clean(&of.mast),
        mast_height => of.mast_height_m.map_or_else(|| "not known".to_owned(), |m| format!("{} m", fixed(m, 1))),
        mast_mean => of.mast_mean_s.map(|s| fixed(s, 0)),
        mast_step => fixed(of.mast_step_s, 2),
        notes => of.notes.iter().map(|note| clean(note)).collect::<Vec<_>>(),
        schema => clean(&of.schema),
        ..common(provenance),
    };
    let html = fill("mast.html", PAGE, values)?;
    Ok(Report { html, figures: files, data: Vec::new() })
}

/// Figures of all flights, drawn for a format: name and SVG.
#[cfg(feature = "paper-figures")]
pub(super) fn figures(of: &MastComparison, format: Format) -> Vec<(String, String)> {
    let drawn = |flight| mast::figures(flight, &slug(&flight.flight), format);
    of.flights.iter().flat_map(drawn).map(|figure| (figure.name, figure.svg)).collect()
}

fn tiles(flight: &MastFlight) -> Vec<Value> {
    let fleet = &flight.fleet;
    let tile = |label: &str, value: String, note: String| context! { label, value, note };
    let of_means = flight.drone_variance.as_ref().zip(flight.mast_variance.as_ref());
    let of_periods = flight.period_variance.map(|of| (of.drones, of.mast));
    let ratio = of_means
        .map(|(drones, mast)| (drones.value, mast.value))
        .or(of_periods)
        .filter(|(_, mast)| *mast > 0.0)
        .map_or_else(|| NONE.to_owned(), |(drones, mast)| fixed(drones / mast, 2));
    let means = words::means(flight);
    let within =
        if flight.period_variance.is_some() { "within ".to_owned() } else { String::new() };
    vec![
        tile(
            "bias, m/s",
            signed(fleet.bias_mps, 2),
            fleet.bias_se_mps.map_or_else(
                || format!("of {} alone", words::means_in(flight)),
                |se| format!("± {} of sampling", fixed(se, 2)),
            ),
        ),
        tile("rms difference, m/s", fixed(fleet.rms_mps, 2), format!("fleet's {means}")),
        tile(
            "correlation",
            fleet.correlation.map_or_else(|| NONE.to_owned(), |r| signed(r, 2)),
            format!("fleet's {means}"),
        ),
        tile("variance, drones over mast", ratio, format!("{within}{means}")),
    ]
}

fn section(flight: &MastFlight, files: &mut Vec<(String, String)>) -> Value {
    let drawn = mast::figures(flight, &slug(&flight.flight), Format::PAGE);
    let mut shown = Vec::new();
    for figure in drawn {
        shown.push(context! {
            number => files.len() + 1,
            name => figure.name.clone(),
            title => figure.title,
            caption => figure.caption,
            svg => Value::from_safe_string(figure.svg.clone()),
        });
        files.push((figure.name, figure.svg));
    }
    context! {
        heading => clean(&flight.flight),
        when => words::when(flight),
        sentences => words::sentences(flight),
        figures => shown,
        period_heads => words::PERIOD_HEADS,
        periods => words::periods(flight),
        average_heads => words::AVERAGE_HEADS,
        averages => words::averages(flight),
        drone_heads => words::DRONE_HEADS,
        drones => flight.drones.iter().map(words::drone).collect::<Vec<_>>(),
    }
}
