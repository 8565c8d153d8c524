//! The map of disagreement: the residual by climb speed, height, time, wind, lean, charge, place and
//! drone.

use crate::gap::verdict::Regime;
use crate::gap::{Dependence, Verdict};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::Panel;
use crate::report::colour::MUTED;
use crate::report::format::Format;
use crate::report::gap_words::{of_regimes, regime_axis, regime_title};
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::fixed;

use super::{KEY_HEIGHT, OF_95, key, key_left, of_unknown, residuals};

/// The regimes in the order in which they are shown.
pub(in crate::report) const ORDER: [Dependence; 8] = [
    Dependence::Climb,
    Dependence::Height,
    Dependence::Time,
    Dependence::Wind,
    Dependence::Lean,
    Dependence::Voltage,
    Dependence::Place,
    Dependence::Drone,
];
/// Size of a panel, pixels.
const PANEL: [f64; 2] = [516.0, 246.0];
/// From one panel to the next, pixels.
const PITCH: f64 = 522.0;
/// Where the key begins, pixels.
const LEFT: f64 = 68.0;
/// Smallest span of the scale of residuals, us.
const LEAST_SPAN_US: f64 = 4.0;

/// The panels of all regimes that the verdict has; `None` without any.
pub(in crate::report) fn figure(verdict: &Verdict, format: Format) -> Option<Figure> {
    let shown: Vec<(Dependence, Vec<&Regime>)> = ORDER
        .into_iter()
        .map(|by| (by, verdict.regimes.iter().filter(|row| row.by == by).collect::<Vec<_>>()))
        .filter(|(_, rows)| !rows.is_empty())
        .collect();
    if shown.is_empty() {
        return None;
    }
    let shared =
        scale(shown.iter().filter(|(by, _)| !by.is_of_drones()).flat_map(|(_, rows)| rows));
    let own = scale(shown.iter().filter(|(by, _)| by.is_of_drones()).flat_map(|(_, rows)| rows));
    let height = KEY_HEIGHT + shown.len().div_ceil(2) as f64 * PANEL[1];
    let on_page = |index: usize| {
        let corner = [(index % 2) as f64 * PITCH, KEY_HEIGHT + (index / 2) as f64 * PANEL[1]];
        [corner[0], corner[1], PANEL[0], PANEL[1]]
    };
    let on_page: Vec<[f64; 4]> = (0..shown.len()).map(on_page).collect();
    let (size, places) = format.arrange([1040.0, height], &on_page);
    let mut sheet = Sheet::new(format, size);
    let mut notes = Drawing::overlay(format);
    key(&mut notes, [key_left(format, LEFT - 68.0), 14.0]);
    for (index, ((by, rows), at)) in shown.iter().zip(places).enumerate() {
        let scale = if by.is_of_drones() { &own } else { &shared };
        let letter = char::from(b'a' + index as u8);
        let x = abscissa(*by, rows);
        let zero = [(x.min, 0.0), (x.max, 0.0)];
        let mut panel = Panel::new(&format!("({letter}) {}", regime_title(*by)), x, scale.clone());
        panel.line(&zero, MUTED, 1.0, "5 4");
        let room = at[2] - 100.0;
        residuals(
            &mut panel,
            rows,
            (0.45 * room / rows.len() as f64).clamp(3.0, 16.0),
            !by.is_of_drones(),
        );
        sheet.place(panel, at);
        let style = TextStyle { size: 12.0, bold: false, colour: MUTED, anchor: Anchor::End };
        notes.text([at[0] + at[2] - 16.0, at[1] + 17.0], &note(rows, format), style, 0.0);
    }
    sheet.lay_over(notes);
    let name = "gap-map".to_owned();
    let title = "Where measurement and model disagree".to_owned();
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Mean of measured minus modelled pulse in each class: squares before, circles with \
             everything found in the model. Above zero the drones needed more pulse than the \
             model says. Grey bars: where 95 of 100 flights of a correct model would lie, as the \
             air that all drones share and the noise allow. Each drone's own mean is removed, \
             except in the panels of places and drones, which have a scale of their own. Above \
             each panel: root mean square over the classes by their numbers of bins, as a pulse \
             and as the vertical air speed that would make it. All panels look at the same bins: \
             what depends on one of these often shows in others that went along with it.{}",
            of_unknown(verdict)
        ),
    })
}

/// One scale around zero for all of these.
fn scale<'a>(rows: impl Iterator<Item = &'a &'a Regime>) -> Axis {
    let most = rows
        .flat_map(|row| {
            let chance = if row.by.is_of_drones() { 0.0 } else { OF_95 * row.before_us.1 };
            [row.before_us.0.abs(), row.after_us.abs(), chance]
        })
        .filter(|value| value.is_finite())
        .fold(LEAST_SPAN_US / 2.0, f64::max);
    Axis::around("measured − model (µs)", [-most, most].into_iter(), LEAST_SPAN_US)
}

fn abscissa(by: Dependence, rows: &[&Regime]) -> Axis {
    let (least, unit) = match by {
        Dependence::Voltage => (0.1, 0.05),
        Dependence::Place | Dependence::Drone => (2.0, 0.5),
        _ => (1.0, 0.0),
    };
    let values = rows.iter().flat_map(|row| [row.x - unit, row.x + unit]);
    let mut axis = Axis::around(regime_axis(by), values, least);
    if by.is_of_drones() {
        axis.step = axis.step.max(1.0);
    }
    if by == Dependence::Voltage {
        (axis.min, axis.max) = (axis.min.max(0.0), axis.max.min(1.0));
    }
    axis
}

/// Root mean squares before and after, in words.
fn note(rows: &[&Regime], format: Format) -> String {
    let [before, after] = of_regimes(rows);
    if format.is_print() {
        // Beside the title there is room for one of both.
        return format!("rms {} → {} µs", fixed(before[0], 1), fixed(after[0], 1));
    }
    format!(
        "rms {} → {} µs ({} → {} m/s)",
        fixed(before[0], 1),
        fixed(after[0], 1),
        fixed(before[1], 2),
        fixed(after[1], 2)
    )
}
