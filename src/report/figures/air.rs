//! The fleet's estimate of the air over time, and against the truth where it is known.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::analysis::result::{DroneUpdraft, FlightAnalysis, UpdraftMap};
use crate::numeric::{self, Moments};

use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, GREEN, VERMILLION};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, usable};

/// Mean and standard deviation between drones at one time, and the mean truth.
struct Instant {
    time_s: f64,
    mean: f64,
    sd: f64,
    truth: Option<f64>,
    /// Mean of the posterior.
    posterior: Option<f64>,
}

/// Share of the times with an estimate at which the truth must be known for a mean over them.
const COVERED: f64 = 0.8;

/// Mean truth of a drone over the times that it was estimated at; `None` where it is not known at most of them.
pub(in crate::report) fn mean_truth(drone: &DroneUpdraft) -> Option<f64> {
    let truth = drone.truth_mps.as_ref()?;
    let pairs = || drone.updraft_mps.iter().zip(truth).filter(|(estimate, _)| estimate.is_some());
    let known = pairs().filter(|(_, truth)| truth.is_some()).count();
    let is_covered = known as f64 >= COVERED * pairs().count() as f64;
    mean(pairs().filter_map(|(_, truth)| *truth)).filter(|_| is_covered)
}

/// Error of a drone's mean against the truth, m/s: of the mean over the hover, or over the seconds that can be compared
/// where these are not all of it.
pub(in crate::report) fn mean_error(map: &UpdraftMap, drone: &DroneUpdraft) -> Option<f64> {
    let levelled = map.levelled.as_ref().filter(|levelled| levelled.zero_s.is_some());
    let truth = drone.truth_mps.as_ref()?;
    if levelled.is_none() && truth.iter().all(Option::is_some) {
        return Some(drone.mean.value - mean_truth(drone)?);
    }
    let outside = |time_s: f64| levelled.is_none_or(|levelled| levelled.is_outside(time_s));
    let pairs = map.time_s.iter().zip(drone.updraft_mps.iter().zip(truth));
    let compared = pairs.filter(|(time_s, _)| outside(**time_s));
    mean(compared.filter_map(|(_, (estimate, truth))| Some((*estimate)? - (*truth)?)))
}

/// ` outside of the stretch that sets the zero`, where there is one: over that the mean is zero by what was asked for.
pub(in crate::report) fn where_compared(map: &UpdraftMap) -> &'static str {
    let has_zero = map.levelled.as_ref().is_some_and(|levelled| levelled.zero_s.is_some());
    if has_zero { " outside of the stretch that sets the zero" } else { "" }
}

/// Mean of the usable values.
pub(in crate::report) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    numeric::mean(values.filter(|&value| usable(value)))
}

/// Standard deviation (n - 1) of the usable values; `None` below two.
pub(in crate::report) fn deviation(values: impl Iterator<Item = f64> + Clone) -> Option<f64> {
    Moments::of(values.filter(|&value| usable(value)))?.deviation()
}

fn instants(map: &UpdraftMap) -> Vec<Instant> {
    map.time_s
        .iter()
        .enumerate()
        .filter_map(|(index, &time_s)| {
            let estimates = map
                .drones
                .iter()
                .filter_map(|drone| drone.updraft_mps.get(index).copied().flatten());
            let truths = map.drones.iter().filter_map(|drone| {
                drone.updraft_mps.get(index).copied().flatten()?;
                drone.truth_at(index)
            });
            let posterior = map
                .drones
                .iter()
                .filter_map(|drone| drone.posterior_mps.get(index).copied().flatten());
            Some(Instant {
                time_s,
                mean: mean(estimates.clone())?,
                sd: deviation(estimates).unwrap_or(0.0),
                truth: mean(truths),
                posterior: mean(posterior),
            })
        })
        .collect()
}

/// Fleet mean over time, beside estimate against truth; `None` if nothing was estimated.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    map: &UpdraftMap,
    format: Format,
) -> Option<Figure> {
    let instants = instants(map);
    if instants.len() < 2 {
        return None;
    }
    let reach = instants.iter().flat_map(|i| {
        let [truth, posterior] = [i.truth, i.posterior].map(|value| value.unwrap_or(i.mean));
        [i.mean - i.sd, i.mean + i.sd, truth, posterior]
    });
    let time = Axis::time(instants.iter().map(|instant| instant.time_s));
    let y = Axis::around("updraft W* (m/s, up positive)", reach.chain([0.0]), 0.1);
    let single = map.drones.len() == 1;
    let name = if single { "(a) Over time" } else { "(a) Fleet mean over time" };
    let mut panel = Panel::new(name, time, y);
    panel.legend_at(LegendPosition::InsideTopRight);
    panel.clear_legend();
    let band: Vec<(f64, f64, f64)> =
        instants.iter().map(|i| (i.time_s, i.mean - i.sd, i.mean + i.sd)).collect();
    panel.band(&band, BLUE);
    let line: Vec<(f64, f64)> = instants.iter().map(|i| (i.time_s, i.mean)).collect();
    panel.line(&line, BLUE, 1.8, "");
    panel.entry(
        if single { "estimate" } else { "mean of the drones" },
        BLUE,
        LegendShape::Line,
        "",
    );
    let has_posterior = instants.iter().any(|i| i.posterior.is_some());
    if has_posterior {
        let line: Vec<(f64, f64)> =
            instants.iter().map(|i| (i.time_s, i.posterior.unwrap_or(f64::NAN))).collect();
        panel.line(&line, GREEN, 1.8, "");
        panel.entry("posterior", GREEN, LegendShape::Line, "");
    }
    let truth: Vec<(f64, f64)> =
        instants.iter().map(|i| (i.time_s, i.truth.unwrap_or(f64::NAN))).collect();
    let known = truth.iter().any(|point| point.1.is_finite());
    if known {
        panel.line(&truth, VERMILLION, 1.4, "6 4");
        panel.entry(
            if single { "truth" } else { "true mean" },
            VERMILLION,
            LegendShape::Line,
            "6 4",
        );
    }
    let side = truth_panel(map);
    let wide = if side.is_some() { 620.0 } else { 1040.0 };
    let mut panels = vec![(panel, [0.0, 0.0, wide, 380.0])];
    let mut caption = if single {
        "(a) Running 10 s estimates.".to_owned()
    } else {
        "(a) The mean of all drones' running 10 s estimates; the band is one standard deviation \
         between drones."
            .to_owned()
    };
    if has_posterior {
        caption.push_str(" Green: the posterior, the estimate of all values together.");
    }
    if known {
        caption.push_str(if single {
            " Dashed: the true air beside it."
        } else {
            " Dashed: the mean of the true air at the same drones."
        });
    }
    if let Some(side) = side {
        panels.push((side, [630.0, 0.0, 410.0, 380.0]));
        caption.push_str(
            " (b) Each drone's mean over the hover, with its standard error, against the true \
             mean at its place; on the dashed line they agree.",
        );
    }
    if map.is_scan() {
        caption.push_str(" The drones moved: hover and place are their tracks here.");
    }
    let sheet = Sheet::of(format, [1040.0, 380.0], panels);
    let name = format!("air-{key}");
    let title = format!("Vertical air speed over time, {}", clean(&flight.name));
    Some(Figure { svg: sheet.svg(&name, &title), name, title, caption })
}

fn truth_panel(map: &UpdraftMap) -> Option<Panel> {
    let marks: Vec<Mark> = map
        .drones
        .iter()
        .filter_map(|drone| {
            Some(Mark {
                x: drone.mean.value,
                y: mean_truth(drone)?,
                x_error: drone.mean.se,
                y_error: 0.0,
            })
        })
        .filter(Mark::usable)
        .collect();
    if marks.is_empty() {
        return None;
    }
    // The error bars, too, lie within the frame.
    let ends = |mark: &Mark| [mark.x - mark.x_error, mark.x + mark.x_error, mark.y];
    let values = || marks.iter().flat_map(ends);
    let x = Axis::around("estimated W* (m/s)", values(), 0.1);
    let y = Axis::around("true W (m/s)", values(), 0.1);
    let mut panel = Panel::new("(b) Estimated and true", x.clone(), y);
    panel.line(&[(x.min, x.min), (x.max, x.max)], VERMILLION, 1.4, "6 4");
    panel.entry("W* = W", VERMILLION, LegendShape::Line, "6 4");
    panel.marks(&marks, BLUE, 3.6, MarkerShape::Circle);
    Some(panel)
}
