//! Changes of the drones beyond the fleet's, with errors.

use kuva::plot::scatter::MarkerShape;

use super::OF_95;
use crate::compare::result::{Change, DroneChange, LawComparison, Quantity};
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel, frame};
use crate::report::colour::{BLUE, INK, MUTED, VERMILLION};
use crate::report::compare_words::pair;
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{unit, usable};

/// Size of a panel, pixels.
const PANEL: [f64; 2] = [1040.0, 300.0];
/// Every drone is labelled up to this number; beyond it, those that changed.
const MOST_LABELS: usize = 64;

/// The drones; `None` where they are not told from the fleet.
pub(in crate::report) fn figure(law: &LawComparison, key: &str, format: Format) -> Option<Figure> {
    let panels: Vec<(Quantity, &str, String)> = [
        (Quantity::Hover, "(a) Effort in hover", unit(&law.effort_unit)),
        (Quantity::Response, "(b) Response to vertical speed", response_unit(law)),
    ]
    .into_iter()
    .filter(|(quantity, _, _)| law.drones.iter().any(|one| beyond(one, *quantity).is_some()))
    .collect();
    if panels.is_empty() {
        return None;
    }
    let rows = 0..panels.len();
    let on_page: Vec<[f64; 4]> =
        rows.map(|row| [0.0, row as f64 * PANEL[1], PANEL[0], PANEL[1]]).collect();
    let (size, places) = format.arrange([PANEL[0], on_page.len() as f64 * PANEL[1]], &on_page);
    let mut sheet = Sheet::new(format, size);
    for ((quantity, title, unit), place) in panels.iter().zip(places) {
        let (panel, labels) = panel(law, *quantity, title, unit, (place, format));
        sheet.place(panel, place);
        sheet.lay_over(labels);
    }
    let name = format!("compare-drones-{key}");
    let title = format!("Changes of the drones beyond the fleet's, {}", pair(&law.pair));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "How much more each drone changed than the fleet (the median of all), with 95 % intervals of its own error. Red \
             diamonds{} are drones that changed by more than chance, among all drones and both panels together: each \
             is labelled with its slot. A weaker motor needs more of both, a heavier drone more in hover alone.",
            if law.drones.iter().any(|one| one.is_changed) { "" } else { " (there are none)" }
        ),
    })
}

fn response_unit(law: &LawComparison) -> String {
    let change = law.fleet.iter().find(|change| change.quantity == Quantity::Response);
    change.map_or_else(String::new, |change| unit(&change.unit))
}

fn beyond(one: &DroneChange, quantity: Quantity) -> Option<(&Change, f64, f64)> {
    let change = one.changes.iter().find(|change| change.quantity == quantity)?;
    let beyond = change.beyond_fleet.filter(|of| usable(of.value) && usable(of.se))?;
    Some((change, beyond.value, beyond.se))
}

fn panel(
    law: &LawComparison,
    quantity: Quantity,
    title: &str,
    unit: &str,
    ([start, top, wide, tall], format): ([f64; 4], Format),
) -> (Panel, Drawing) {
    let place = |index: usize, one: &DroneChange| one.slot.map_or(index as f64 + 1.0, f64::from);
    let known: Vec<(&DroneChange, Mark, bool)> = (law.drones.iter().enumerate())
        .filter_map(|(index, one)| {
            let (change, y, se) = beyond(one, quantity)?;
            let is_changed = change.p_holm.is_some_and(|p| p < crate::compare::chance::LEVEL);
            let mark = Mark { x: place(index, one), y, x_error: 0.0, y_error: OF_95 * se };
            Some((one, mark, is_changed))
        })
        .collect();
    let mut x = Axis::around("slot", known.iter().map(|(_, mark, _)| mark.x), 4.0);
    let last = known.iter().map(|(_, mark, _)| mark.x).fold(1.0, f64::max);
    (x.min, x.max) = (0.0, last + 1.0);
    x.step = x.step.max(1.0);
    let reach = known.iter().flat_map(|(_, m, _)| [m.y - m.y_error, m.y + m.y_error]);
    let y = Axis::around(&format!("beyond the fleet ({unit})"), reach.chain([0.0]), 1.0);
    let mut panel = Panel::new(title, x.clone(), y.clone());
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    let of = |wanted: bool| -> Vec<Mark> {
        known.iter().filter(|(_, _, is)| *is == wanted).map(|(_, mark, _)| *mark).collect()
    };
    panel.marks(&of(false), BLUE, 3.6, MarkerShape::Circle);
    panel.marks(&of(true), VERMILLION, 5.6, MarkerShape::Diamond);
    let mut labels = Drawing::overlay(format);
    let [left, above, width, height] = frame(wide, tall, false);
    // Each label needs its room.
    let most_labels = format.choose(MOST_LABELS, (width / 20.0) as usize);
    for (one, mark, is_changed) in &known {
        if !is_changed && known.len() > most_labels {
            continue;
        }
        let style = TextStyle {
            size: if *is_changed { 13.0 } else { 10.0 },
            bold: *is_changed,
            colour: if *is_changed { INK } else { MUTED },
            anchor: Anchor::Start,
        };
        let at = [
            start + left + width * (mark.x - x.min) / (x.max - x.min) + 7.0,
            top + above + height * (y.max - mark.y) / (y.max - y.min) + 4.0,
        ];
        let label = one.slot.map_or_else(|| one.name.clone(), |slot| slot.to_string());
        labels.text(at, &label, style, 0.0);
    }
    (panel, labels)
}
