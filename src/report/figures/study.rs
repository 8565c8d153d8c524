//! Figures of a study: the paper's Fig. 2 with its inset, the same for every wind, and the error of
//! the fitted updraft.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::analysis::law::Symbol;
use crate::base::estimate::Estimate;
use crate::numeric::{extent, least};
use crate::study::Condition;
use crate::study::result::{ConditionResult, StudyFlight, StudyResult};

use super::laws::{PULSE_LABEL, VELOCITY_LABEL};
use crate::report::Figure;
use crate::report::axis::{Axis, nice_step};
use crate::report::chart::{Mark, Panel};
use crate::report::colour::{BLUE, FAINT, GREEN, INK, MUTED, VERMILLION, sequential};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::text::{count, fixed, signed, usable};

/// Name of the paper's Fig. 2.
pub(in crate::report) const FIG2: &str = "fig2-study";
/// Samples of a drawn curve.
const CURVE_POINTS: u32 = 61;
/// Panels in a row of the figure of winds.
const COLUMNS: usize = 3;
/// Size of such a panel, pixels.
const PANEL: [f64; 2] = [346.0, 292.0];
/// Most panels of winds.
const PANEL_LIMIT: usize = 24;

/// The flights of a condition with their colours.
struct Coloured<'a> {
    flights: Vec<(&'a StudyFlight, String)>,
    law: Option<(f64, f64)>,
}

/// All figures that the study has data for.
pub(in crate::report) fn figures(study: &StudyResult, format: Format) -> Vec<Figure> {
    [still(study, format), winds(study, format), errors(study, format)]
        .into_iter()
        .flatten()
        .collect()
}

/// A and u0 that all fits hold.
fn law(study: &StudyResult) -> Option<(f64, f64)> {
    let get = |symbol: Symbol| {
        let row = study.paper_way.table.iter().find(|row| row.parameter == symbol)?;
        Some(row.windless.value).filter(|value| usable(*value))
    };
    Some((get(Symbol::A)?, get(Symbol::U0)?))
}

fn of_condition(study: &StudyResult, condition: Condition) -> Coloured<'_> {
    let (low, high) = extent(&study.updrafts_mps).unwrap_or_default();
    let colour = |updraft_mps: f64| sequential((updraft_mps - low) / (high - low).max(1e-9));
    let flights = study
        .flights
        .iter()
        .filter(|flight| flight.condition == condition)
        .map(|flight| (flight, colour(flight.updraft_mps)))
        .collect();
    Coloured { flights, law: law(study) }
}

/// Axes around all windows of the study, so that panels compare.
fn axes(study: &StudyResult) -> (Axis, Axis) {
    let windows = || study.flights.iter().flat_map(|flight| &flight.windows);
    (
        Axis::around(VELOCITY_LABEL, windows().map(|window| window.velocity_mps.median), 1.0),
        Axis::around(PULSE_LABEL, windows().map(|window| window.pulse_phi_us.median), 10.0),
    )
}

impl Coloured<'_> {
    /// Windows as points, unused ones as crosses, and each flight's fitted curve.
    fn draw(&self, panel: &mut Panel, (v, u): (&Axis, &Axis), size: f64) -> usize {
        let mut unused = Vec::new();
        for (flight, colour) in &self.flights {
            if let (Some((a, u0)), Some(w)) = (self.law, flight.paper_way_mps) {
                panel.line(&curve(a, u0, w.value, v, u), colour, 1.3, "2 3");
            }
            let mut used = Vec::new();
            for window in &flight.windows {
                let mark = Mark {
                    x: window.velocity_mps.median,
                    y: window.pulse_phi_us.median,
                    x_error: window.velocity_mps.sd,
                    y_error: window.pulse_phi_us.sd,
                };
                if window.rejected.is_empty() { &mut used } else { &mut unused }.push(mark);
            }
            panel.marks(&used, colour, size, MarkerShape::Circle);
        }
        panel.marks(&unused, VERMILLION, size, MarkerShape::Cross);
        unused.len()
    }
}

/// `u = A f(V - W) + u0` inside the frame.
fn curve(a: f64, u0: f64, w: f64, v: &Axis, u: &Axis) -> Vec<(f64, f64)> {
    (0..CURVE_POINTS)
        .map(|i| {
            let x = v.min + (v.max - v.min) * f64::from(i) / f64::from(CURVE_POINTS - 1);
            (x, a * (x - w) * (x - w).abs() + u0)
        })
        // Half a frame of room: the frame cuts, and lines that leave it keep their slope.
        .filter(|(_, y)| *y > 1.5 * u.min - 0.5 * u.max && *y < 1.5 * u.max - 0.5 * u.min)
        .collect()
}

/// Fig. 2 with its inset.
fn still(study: &StudyResult, format: Format) -> Option<Figure> {
    let coloured = of_condition(study, Condition::STILL);
    if coloured.flights.is_empty() {
        return None;
    }
    let (v, mut u) = axes(study);
    // Room above the points on the left, where the inset goes.
    u.step = nice_step((u.max - u.min) / 10.0);
    u.max += u.step;
    let lowest = study.flights.iter().flat_map(|flight| &flight.windows);
    let lowest = least(lowest.map(|w| w.pulse_phi_us.median)).unwrap_or(f64::INFINITY);
    while u.min + 1.5 * u.step < lowest && u.min + 5.0 * u.step < u.max {
        u.min += u.step;
    }
    let mut panel = Panel::new("Still air", v.clone(), u.clone());
    panel.legend_outside(124.0);
    let unused = coloured.draw(&mut panel, (&v, &u), 3.8);
    for (flight, colour) in coloured.flights.iter().rev() {
        let label = format!("W = {}", signed(flight.updraft_mps, 1));
        panel.entry(&label, colour, LegendShape::Circle, "");
    }
    if unused > 0 {
        panel.entry("not used", VERMILLION, LegendShape::Marker(MarkerShape::Cross), "");
    }
    let inset = inset(&coloured);
    let sheet = if format.is_narrow() {
        // No room inside: it stands below.
        let wide = format.width();
        let mut sheet = Sheet::new(format, [wide, 640.0]);
        sheet.place(panel, [0.0, 0.0, wide, 390.0]);
        sheet.place(inset, [0.0, 390.0, wide, 250.0]);
        sheet
    } else {
        let tall = format.choose(720.0, 560.0);
        let [wide, high] = [format.across(350.0), 250.0 * tall / 720.0];
        let mut sheet = Sheet::new(format, [format.width(), tall]);
        sheet.place(panel, [0.0, 0.0, format.width(), tall]);
        sheet.cover([70.0, 33.0, wide, high - 8.0]);
        sheet.place(inset, [68.0, 24.0, wide, high]);
        sheet
    };
    let name = FIG2.to_owned();
    let title = "Pulse width against vertical velocity in still air, by updraft (paper's Fig. 2)"
        .to_owned();
    let rho = study
        .paper_way
        .conditions
        .iter()
        .find(|found| found.condition == Condition::STILL)
        .and_then(|found| found.regression)
        .map_or(String::new(), |r| format!(", Pearson's ρ = {} (n = {})", rho(r.rho), r.n));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Each point is the median of one moving window; bars are one \
             standard deviation of the samples; colour is the true updraft. Dotted lines are the \
             signed-quadratic law with A and u₀ held and W* fitted to each flight. {} \
             (crosses). Inset: the fitted updraft W* (horizontal) and the true one W (vertical); \
             on the dashed line they agree{rho}.",
            match unused {
                0 => "No window was left out".to_owned(),
                n => format!(
                    "{} not used, because a motor was at its limit or the drone did not follow",
                    count(n, "window")
                ),
            }
        ),
    })
}

/// Panel of the fitted updraft W* against the true W.
fn inset(coloured: &Coloured<'_>) -> Panel {
    let both = || {
        coloured.flights.iter().filter_map(|(f, _)| Some([f.updraft_mps, f.paper_way_mps?.value]))
    };
    let x = Axis::around("W* (m/s)", both().flatten(), 1.0);
    let y = Axis { label: "W (m/s)".to_owned(), ..x.clone() };
    let mut panel = Panel::new("", x.clone(), y);
    panel.line(&[(x.min, x.min), (x.max, x.max)], VERMILLION, 1.4, "6 4");
    for (flight, colour) in &coloured.flights {
        if let Some(mark) = flight.paper_way_mps.map(|w| Mark {
            x: w.value,
            y: flight.updraft_mps,
            x_error: w.se,
            y_error: 0.0,
        }) {
            panel.marks(&[mark], colour, 3.8, MarkerShape::Circle);
        }
    }
    panel
}

/// One panel for each wind.
fn winds(study: &StudyResult, format: Format) -> Option<Figure> {
    let windy: Vec<&ConditionResult> = study
        .paper_way
        .conditions
        .iter()
        .filter(|found| found.condition != Condition::STILL)
        .collect();
    let shown = windy.len().min(PANEL_LIMIT);
    if shown == 0 {
        return None;
    }
    let (mut v, mut u) = axes(study);
    "velocity (m/s)".clone_into(&mut v.label);
    "u cos φ (µs)".clone_into(&mut u.label);
    // Every other tick fits these panels.
    v.step *= 2.0;
    let rows = shown.div_ceil(COLUMNS);
    let mut panels = Vec::new();
    for (index, found) in windy.iter().take(shown).enumerate() {
        let coloured = of_condition(study, found.condition);
        let rho = found.regression.map_or(String::new(), |r| format!(", ρ = {}", rho(r.rho)));
        let mut panel =
            Panel::new(&format!("{}{rho}", found.condition.label()), v.clone(), u.clone());
        coloured.draw(&mut panel, (&v, &u), 2.2);
        let (row, column) = (index / COLUMNS, index % COLUMNS);
        let corner = [column as f64 * PANEL[0], row as f64 * PANEL[1]];
        panels.push((panel, [corner[0], corner[1], PANEL[0], PANEL[1]]));
    }
    let sheet = Sheet::of(format, [1040.0, rows as f64 * PANEL[1]], panels);
    let name = "study-winds".to_owned();
    let title = "The same in every wind".to_owned();
    let left_out = windy.len() - shown;
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Points, colours, lines and crosses as in the figure for still air, with A and u₀ still those of still \
             air.{}",
            if left_out > 0 {
                format!(" {} not drawn.", count(left_out, "wind"))
            } else {
                String::new()
            }
        ),
    })
}

/// W* - W against W, a line for each condition.
fn errors(study: &StudyResult, format: Format) -> Option<Figure> {
    let error = |flight: &StudyFlight, w: Option<Estimate>| {
        w.map(|w| (flight.updraft_mps, w.value - flight.updraft_mps))
            .filter(|(_, error)| usable(*error))
    };
    let all =
        || study.flights.iter().flat_map(|f| [error(f, f.paper_way_mps), error(f, f.own_way_mps)]);
    let values = || all().flatten();
    values().next()?;
    let x = Axis::around("true updraft W (m/s)", values().map(|point| point.0), 1.0);
    let y = Axis::around("W* − W (m/s)", values().map(|point| point.1).chain([0.0]), 0.02);
    let mut winds: Vec<f64> = study.flights.iter().map(|f| f.condition.wind_mps).collect();
    winds.sort_by(f64::total_cmp);
    winds.dedup();
    let colour = |wind: f64| {
        let place = winds.iter().position(|other| *other == wind).unwrap_or(0);
        [INK, BLUE, GREEN, MUTED].get(place).copied().unwrap_or(FAINT)
    };
    let mut panels = Vec::new();
    for (index, title) in ["(a) The paper's way", "(b) This program's way"].into_iter().enumerate()
    {
        let mut panel = Panel::new(title, x.clone(), y.clone());
        panel.legend_at(LegendPosition::InsideBottomLeft);
        panel.line(&[(x.min, 0.0), (x.max, 0.0)], VERMILLION, 1.2, "6 4");
        for condition in &study.paper_way.conditions {
            let points: Vec<(f64, f64)> = study
                .flights
                .iter()
                .filter(|flight| flight.condition == condition.condition)
                .filter_map(|f| error(f, if index == 0 { f.paper_way_mps } else { f.own_way_mps }))
                .collect();
            panel.line(&points, colour(condition.condition.wind_mps), 1.2, "");
        }
        for wind in winds.iter().take(4) {
            let label = if *wind == 0.0 { "still air".to_owned() } else { format!("{wind} m/s") };
            panel.entry(&label, colour(*wind), LegendShape::Line, "");
        }
        panels.push((panel, [525.0 * index as f64, 0.0, 515.0, 400.0]));
    }
    let sheet = Sheet::of(format, [1040.0, 400.0], panels);
    let name = "study-errors".to_owned();
    let title = "Error of the fitted updraft".to_owned();
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: "What Pearson's ρ does not show: the fitted updraft W* minus the true one, a line \
                  for each wind condition. The air thins along the climb, which looks like a \
                  downdraft, and in a wind the tilted drone's drag does too. (a) Medians weighted by \
                  the standard deviation in the window; (b) trimmed means weighted by their \
                  standard errors."
            .to_owned(),
    })
}

/// Rho with as many digits as its distance from 1 asks for.
pub(in crate::report) fn rho(rho: f64) -> String {
    let gap = 1.0 - rho.abs();
    if gap <= 0.0 || !gap.is_finite() {
        return fixed(rho, 6);
    }
    fixed(rho, (1 - gap.log10().floor() as i32).clamp(2, 9) as usize)
}
