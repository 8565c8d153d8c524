//! Drones and mast over time, against each other, and by frequency.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::mast::matched::averages;
use crate::mast::result::{MastFlight, MastPeriod};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, GREEN, MUTED, VERMILLION};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, usable};

/// Averages in the scatter, s: longer than the ten seconds of single values, so that points are nearly independent.
const SCATTER_S: usize = 20;
/// Standard errors to each side of a 95 % interval.
const OF_95: f64 = 1.96;

/// The figures of a flight.
pub(in crate::report) fn figures(flight: &MastFlight, key: &str, format: Format) -> Vec<Figure> {
    let mut all = vec![over_time(flight, key, format)];
    all.extend(by_frequency(flight, key, format));
    all
}

fn known<'a>(time_s: &'a [f64], values: &'a [f64]) -> Vec<(f64, f64)> {
    let pairs = time_s.iter().copied().zip(values.iter().copied());
    pairs.filter(|(_, value)| usable(*value)).collect()
}

fn over_time(flight: &MastFlight, key: &str, format: Format) -> Figure {
    let series = &flight.series;
    let x = {
        let mut axis = Axis::time(series.time_s.iter().copied());
        "time (s)".clone_into(&mut axis.label);
        axis
    };
    let reach = series.mast.iter().chain(&series.fleet).chain(&series.nearest).copied();
    let y = Axis::around("vertical air speed (m/s)", reach.filter(|value| usable(*value)), 0.5);
    let slow = !flight.periods.is_empty();
    let head = if slow {
        format!("(a) Ten-second means of the drones, {:.0} s of the mast", flight.mean_s)
    } else {
        "(a) Ten-second means".to_owned()
    };
    let mut panel = Panel::new(&head, x, y.clone());
    panel.legend_at(LegendPosition::InsideTopRight);
    let band: Vec<(f64, f64, f64)> = series
        .time_s
        .iter()
        .zip(series.fleet.iter().zip(&series.fleet_se))
        .filter(|(_, (w, se))| usable(**w) && usable(**se))
        .map(|(time, (w, se))| (*time, (w - OF_95 * se).max(y.min), (w + OF_95 * se).min(y.max)))
        .collect();
    panel.band(&band, BLUE);
    panel.line(&known(&series.time_s, &series.mast), VERMILLION, 2.0, "");
    panel.entry("mast", VERMILLION, LegendShape::Line, "");
    panel.line(&known(&series.time_s, &series.fleet), BLUE, 2.0, "");
    panel.entry("mean of the drones, 95 %", BLUE, LegendShape::Line, "");
    if flight.drones.len() > 1 {
        panel.line(&known(&series.time_s, &series.nearest), GREEN, 1.2, "4 3");
        panel.entry("nearest drone", GREEN, LegendShape::Line, "4 3");
    }
    let [mast, fleet, nearest] = if slow {
        let of = |get: fn(&MastPeriod) -> f64| flight.periods.iter().map(get).collect();
        let nearest = |one: &MastPeriod| one.nearest_mps.unwrap_or(f64::NAN);
        [of(|one| one.mast_mps), of(|one| one.fleet_mps), of(nearest)]
    } else {
        [&series.mast, &series.fleet, &series.nearest].map(|values| averages(values, SCATTER_S))
    };
    let ends = || mast.iter().chain(&fleet).chain(&nearest).copied().filter(|w| usable(*w));
    let x = Axis::around("mast (m/s)", ends(), 0.5);
    let y = Axis { label: "drones (m/s)".to_owned(), ..x.clone() };
    let mut against = Panel::new("(b) Against each other", x.clone(), y);
    against.line(&[(x.min, x.min), (x.max, x.max)], MUTED, 1.2, "6 4");
    let marks = |of: &[f64]| -> Vec<Mark> {
        let pairs = mast.iter().zip(of);
        pairs.map(|(x, y)| Mark { x: *x, y: *y, x_error: 0.0, y_error: 0.0 }).collect()
    };
    if flight.drones.len() > 1 {
        against.marks(&marks(&nearest), GREEN, 3.6, MarkerShape::Triangle);
        against.entry("nearest drone", GREEN, LegendShape::Circle, "");
    }
    against.marks(&marks(&fleet), BLUE, 4.2, MarkerShape::Circle);
    against.entry("mean of the drones", BLUE, LegendShape::Circle, "");
    let places = vec![(panel, [0.0, 0.0, 620.0, 380.0]), (against, [630.0, 0.0, 410.0, 380.0])];
    let name = format!("mast-time-{key}");
    let title = format!("Drones and mast over time, {}", clean(&flight.flight));
    Figure {
        svg: Sheet::of(format, [1040.0, 384.0], places).svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a) Running means over ten seconds of the vertical air speed{}; the band is the 95 % interval that the drones \
             state, most of which is one shift of all. (b) Averages of {} s against each other; on the dashed line \
             they agree.",
            if slow { " by the drones, the mast's own means as steps" } else { "" },
            if slow { format!("{:.0}", flight.mean_s) } else { SCATTER_S.to_string() },
        ),
    }
}

fn by_frequency(flight: &MastFlight, key: &str, format: Format) -> Option<Figure> {
    let densities = flight.mast_spectrum.iter().chain(&flight.drone_spectrum);
    let y = Axis::decades("density ((m/s)²/Hz)", densities.map(|band| band.density))?;
    let ends = || flight.mast_spectrum.iter().map(|band| band.frequency_hz);
    let x = Axis::frequencies(ends().reduce(f64::min)?, ends().reduce(f64::max)?);
    let mut spectra = Panel::new("(a) Spectra", x.clone(), y.clone());
    spectra.logarithmic();
    spectra.legend_at(LegendPosition::InsideBottomLeft);
    for (bands, colour, words) in [
        (&flight.mast_spectrum, VERMILLION, "mast, 95 %"),
        (&flight.drone_spectrum, BLUE, "mean of the drones, 95 %"),
    ] {
        let of = |end: f64| end.clamp(y.min, y.max);
        let band = bands.iter().map(|band| (band.frequency_hz, of(band.low), of(band.high)));
        spectra.band(&band.collect::<Vec<_>>(), colour);
        let line = bands.iter().filter(|band| band.density > 0.0);
        let line: Vec<_> = line.map(|band| (band.frequency_hz, band.density)).collect();
        spectra.line(&line, colour, 1.8, "");
        spectra.entry(words, colour, LegendShape::Line, "");
    }
    let unit = Axis { label: "squared coherence".to_owned(), min: 0.0, max: 1.0, step: 0.2 };
    let mut coherence = Panel::new("(b) Coherence of the nearest drone", x, unit);
    coherence.logarithmic_x();
    coherence.legend_at(LegendPosition::InsideTopRight);
    let line = |of: fn(&turbulence_statistics::spectrum::CrossBand) -> f64| -> Vec<(f64, f64)> {
        flight.coherence.iter().map(|band| (band.frequency_hz, of(band).clamp(0.0, 1.0))).collect()
    };
    coherence.line(&line(|band| band.coherence), BLUE, 1.8, "");
    coherence.entry("nearest drone and mast", BLUE, LegendShape::Line, "");
    coherence.line(&line(|band| band.coherence_threshold), MUTED, 1.2, "5 4");
    coherence.entry("chance (95 %)", MUTED, LegendShape::Line, "5 4");
    let places = vec![(spectra, [0.0, 0.0, 518.0, 350.0]), (coherence, [522.0, 0.0, 518.0, 350.0])];
    let name = format!("mast-spectra-{key}");
    let title = format!("Drones and mast by frequency, {}", clean(&flight.flight));
    Some(Figure {
        svg: Sheet::of(format, [1040.0, 354.0], places).svg(&name, &title),
        name,
        title,
        caption: "(a) Spectra of the ten-second means, corrected for what the mean takes from each frequency, with 95 % \
                  bands; the drones' noise is left in. (b) Squared coherence, corrected for its bias."
            .to_owned(),
    })
}
