//! Turbulence: spectra, the cospectrum of u and w, covariance and coherence between the drones.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::analysis::result::{AtDistance, Component, FlightAnalysis, Turbulence};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, GREEN, INK, MUTED, VERMILLION, sequential};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, fixed};

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [518.0, 350.0];
/// Distances whose coherence and lags are drawn.
const MOST_LINES: usize = 5;
/// Half the width of a normal 95 % interval, standard errors.
const NORMAL: f64 = 1.96;

/// The figures that there are data for.
pub(in crate::report) fn figures(
    flight: &FlightAnalysis,
    key: &str,
    found: &Turbulence,
    format: Format,
) -> Vec<Figure> {
    let named = (key, clean(&flight.name));
    [
        spectra(&named, found, format),
        cospectrum(&named, found, format),
        pairs(&named, found, format),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn sheet(panels: Vec<Panel>, format: Format) -> Sheet {
    let place = |index: usize| [index as f64 * 522.0, 0.0, PANEL[0], PANEL[1]];
    let panels: Vec<(Panel, [f64; 4])> =
        panels.into_iter().enumerate().map(|(index, panel)| (panel, place(index))).collect();
    let width = if panels.len() > 1 { 1040.0 } else { PANEL[0] + 4.0 };
    Sheet::of(format, [width, PANEL[1] + 4.0], panels)
}

/// Spectra of w, and of u and v, with their bands.
fn spectra((key, flight): &(&str, String), found: &Turbulence, format: Format) -> Option<Figure> {
    let up = found.vertical.as_ref()?;
    let horizontal =
        [(&found.along, "u, along the wind", BLUE), (&found.across, "v, across it", GREEN)];
    let of_horizontal = horizontal.iter().filter_map(|(of, ..)| of.as_ref());
    let all = || of_horizontal.clone().chain([up]).flat_map(|of| &of.spectrum);
    let densities: Vec<f64> = all().map(|band| band.density).collect();
    let y = Axis::decades("density ((m/s)²/Hz)", densities.iter().copied())?;
    let ends = all().map(|band| band.frequency_hz);
    let x = Axis::frequencies(ends.clone().reduce(f64::min)?, ends.reduce(f64::max)?);
    let mut first = Panel::new("(a) w, up", x.clone(), y.clone());
    first.logarithmic();
    first.legend_at(LegendPosition::InsideBottomLeft);
    component(&mut first, up, VERMILLION, &y);
    first.entry("w, mean of the drones, 95 %", VERMILLION, LegendShape::Line, "");
    // Through the middle of the range that was fitted, else of what there is.
    let through = found
        .dissipation
        .map(|of| (of.from_hz * of.to_hz).sqrt())
        .or_else(|| up.spectrum.get(2 * up.spectrum.len() / 3).map(|band| band.frequency_hz));
    let near = through.and_then(|hz| {
        let off = |frequency: f64| (frequency / hz).ln().abs();
        up.spectrum.iter().min_by(|a, b| off(a.frequency_hz).total_cmp(&off(b.frequency_hz)))
    });
    if let Some(band) = near {
        let at = |hz: f64| (hz, band.density * (hz / band.frequency_hz).powf(-5.0 / 3.0));
        let (from, to) =
            found.dissipation.map_or((0.3 * band.frequency_hz, 3.0 * band.frequency_hz), |of| {
                (of.from_hz, of.to_hz)
            });
        let line: Vec<(f64, f64)> =
            [from, to.min(x.max)].map(at).into_iter().filter(|(_, y_at)| *y_at > y.min).collect();
        first.line(&line, INK, 1.6, "6 4");
        let words = if found.dissipation.is_some() {
            "−5/3, over the inertial range"
        } else {
            "−5/3, for comparison"
        };
        first.entry(words, INK, LegendShape::Line, "6 4");
    }
    let noise = 2.0 * up.noise * found.record.step_s;
    if noise > y.min {
        first.line(&[(x.min, noise), (x.max, noise)], MUTED, 1.0, "2 3");
        first.entry("white noise that was taken off", MUTED, LegendShape::Line, "2 3");
    }
    let mut panels = vec![first];
    if horizontal.iter().any(|(of, ..)| of.is_some()) {
        let mut second = Panel::new("(b) u and v", x, y.clone());
        second.logarithmic();
        second.legend_at(LegendPosition::InsideBottomLeft);
        for (of, words, colour) in horizontal {
            if let Some(of) = of {
                component(&mut second, of, colour, &y);
                second.entry(words, colour, LegendShape::Line, "");
            }
        }
        panels.push(second);
    }
    let name = format!("turbulence-spectra-{key}");
    let title = format!("Spectra, {flight}");
    Some(Figure {
        svg: sheet(panels, format).svg(&name, &title),
        name,
        title,
        caption: format!(
            "Mean of the drones with 95 % bands, corrected for the response of blocks of {} s and for white noise. Above \
             {} Hz (w) and {} Hz (u, v) nothing is told.",
            found.record.step_s,
            fixed(found.record.vertical_limit_hz, 2),
            fixed(found.record.horizontal_limit_hz, 2)
        ),
    })
}

fn component(panel: &mut Panel, of: &Component, colour: &str, y: &Axis) {
    let inside = |value: f64| value.clamp(y.min, y.max);
    let band: Vec<(f64, f64, f64)> = of
        .spectrum
        .iter()
        .map(|band| (band.frequency_hz, inside(band.low), inside(band.high)))
        .collect();
    panel.band(&band, colour);
    let line: Vec<(f64, f64)> = of
        .spectrum
        .iter()
        .filter(|band| band.density >= y.min)
        .map(|band| (band.frequency_hz, band.density))
        .collect();
    panel.line(&line, colour, 2.0, "");
}

/// Cospectrum of u and w times the frequency: equal areas are equal parts of the flux.
fn cospectrum(
    (key, flight): &(&str, String),
    found: &Turbulence,
    format: Format,
) -> Option<Figure> {
    let bands = &found.flux_cospectrum;
    if bands.len() < 3 {
        return None;
    }
    let band: Vec<(f64, f64, f64)> = bands
        .iter()
        .map(|band| {
            let half = NORMAL * band.co_se;
            let hz = band.frequency_hz;
            (hz, hz * (band.co - half), hz * (band.co + half))
        })
        .collect();
    let y = Axis::around(
        "frequency × cospectrum (m²/s²)",
        band.iter().flat_map(|(_, low, high)| [*low, *high]),
        0.01,
    );
    let x = Axis::frequencies(band.first()?.0, band.last()?.0);
    let mut panel = Panel::new("u and w", x.clone(), y);
    panel.logarithmic_x();
    panel.legend_at(LegendPosition::InsideBottomLeft);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 0.8, "");
    panel.band(&band, BLUE);
    let line: Vec<(f64, f64)> =
        bands.iter().map(|band| (band.frequency_hz, band.frequency_hz * band.co)).collect();
    panel.line(&line, BLUE, 2.0, "");
    panel.entry("mean of the drones, 95 %", BLUE, LegendShape::Line, "");
    let name = format!("turbulence-cospectrum-{key}");
    let title = format!("Cospectrum of u and w, {flight}");
    Some(Figure {
        svg: sheet(vec![panel], format).svg(&name, &title),
        name,
        title,
        caption: "Times the frequency, over its logarithm: equal areas are equal parts of the momentum flux. Below zero \
                  momentum goes down."
            .to_owned(),
    })
}

/// Covariance over distance, over lag, and coherence over frequency.
fn pairs((key, flight): &(&str, String), found: &Turbulence, format: Format) -> Option<Figure> {
    if found.distances.is_empty() {
        return None;
    }
    let variance = found.vertical.as_ref().and_then(|up| up.variance);
    let mut panels = vec![covariance(found, variance.map(|of| [of.value, of.low, of.high]))?];
    let few = few(&found.distances);
    let coherence = coherence(&few);
    let of_coherence = if coherence.is_some() {
        " (b) Squared coherence by frequency, mean of the pairs at some of the distances, corrected for its bias."
    } else {
        " The record is too short for the coherence."
    };
    panels.extend(coherence);
    let name = format!("turbulence-pairs-{key}");
    let title = format!("w at pairs of drones, {flight}");
    Some(Figure {
        svg: sheet(panels, format).svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a) Mean covariance of w at pairs of drones by their distance, with the 95 % interval of one pair (pairs of \
             one fleet see the same eddies); at 0 m the variance.{of_coherence}"
        ),
    })
}

fn covariance(found: &Turbulence, variance: Option<[f64; 3]>) -> Option<Panel> {
    let mark = |x: f64, value: f64, low: f64, high: f64| Mark {
        x,
        y: value,
        x_error: 0.0,
        y_error: 0.5 * (high - low),
    };
    let of = |at: &AtDistance| {
        mark(at.distance_m, at.covariance.value, at.covariance.low, at.covariance.high)
    };
    let marks: Vec<Mark> = found.distances.iter().map(of).collect();
    let own: Vec<Mark> =
        variance.iter().map(|[value, ..]| mark(0.0, *value, *value, *value)).collect();
    let ends =
        || marks.iter().chain(&own).flat_map(|mark| [mark.y - mark.y_error, mark.y + mark.y_error]);
    let bar = variance.iter().flat_map(|[_, low, high]| [*low, *high]);
    let y = Axis::around("covariance ((m/s)²)", ends().chain(bar).chain([0.0]), 0.05);
    let farthest = marks.iter().map(|mark| mark.x).reduce(f64::max)?;
    let mut x =
        Axis::around("distance between drones (m)", [0.0, 1.03 * farthest].into_iter(), 1.0);
    x.min = -0.03 * farthest;
    let mut panel = Panel::new("(a) Covariance by distance", x.clone(), y);
    panel.legend_at(LegendPosition::InsideTopRight);
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 0.8, "");
    panel.marks(&marks, VERMILLION, 4.5, MarkerShape::Circle);
    // The interval of a variance is not symmetric.
    if let Some([_, low, high]) = variance {
        panel.line(&[(0.0, low), (0.0, high)], INK, 1.0, "");
    }
    panel.marks(&own, INK, 5.5, MarkerShape::Square);
    panel.entry("pairs", VERMILLION, LegendShape::Circle, "");
    if !own.is_empty() {
        panel.entry("variance of the fleet", INK, LegendShape::Rect, "");
    }
    Some(panel)
}

/// Some of the distances, from the nearest to the farthest.
fn few(distances: &[AtDistance]) -> Vec<&AtDistance> {
    let count = distances.len().min(MOST_LINES);
    let step = |index: usize| index * (distances.len() - 1) / (count - 1).max(1);
    (0..count).filter_map(|index| distances.get(step(index))).collect()
}

fn coherence(few: &[&AtDistance]) -> Option<Panel> {
    let all = || few.iter().flat_map(|at| &at.coherence);
    let ends = || all().map(|band| band.frequency_hz);
    let x = Axis::frequencies(ends().reduce(f64::min)?, ends().reduce(f64::max)?);
    let y = Axis { label: "squared coherence".to_owned(), min: 0.0, max: 1.0, step: 0.2 };
    let mut panel = Panel::new("(b) Coherence by frequency", x, y);
    panel.logarithmic_x();
    panel.legend_at(LegendPosition::InsideTopRight);
    for (index, at) in few.iter().enumerate() {
        let colour = sequential(index as f64 / (few.len() - 1).max(1) as f64);
        let line: Vec<(f64, f64)> =
            at.coherence.iter().map(|band| (band.frequency_hz, band.coherence)).collect();
        panel.line(&line, &colour, 2.0, "");
        panel.entry(&format!("{} m", fixed(at.distance_m, 0)), &colour, LegendShape::Line, "");
    }
    Some(panel)
}
