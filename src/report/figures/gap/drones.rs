//! Each drone's hover pulse and response against the fleet's.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::gap::Verdict;
use crate::gap::verdict::DroneOffset;
use crate::numeric::rms;
use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Mark, Panel, frame};
use crate::report::colour::{BLUE, GREEN, INK, MUTED};
use crate::report::format::Format;
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::usable;

/// Size of the figure, pixels.
const SIZE: [f64; 2] = [760.0, 460.0];
/// Every drone is labelled up to this number; beyond it, those far out.
const MOST_LABELS: usize = 40;
/// Far out, standard deviations.
const FAR: f64 = 2.0;

/// The drones; `None` with fewer than two.
pub(in crate::report) fn figure(verdict: &Verdict, format: Format) -> Option<Figure> {
    let each: Vec<&DroneOffset> = verdict
        .drones
        .each
        .iter()
        .filter(|drone| usable(drone.offset_us) && usable(drone.slope))
        .collect();
    if each.len() < 2 {
        return None;
    }
    let place = |drone: &DroneOffset| (drone.offset_us, 100.0 * drone.slope);
    let x = Axis::around(
        "hover pulse above the fleet's (µs)",
        each.iter().map(|drone| drone.offset_us).chain([0.0]),
        4.0,
    );
    let y = Axis::around(
        "response above the fleet's (%)",
        each.iter().map(|drone| 100.0 * drone.slope).chain([0.0]),
        1.0,
    );
    let mut panel = Panel::new("", x.clone(), y.clone());
    panel.line(&[(x.min, 0.0), (x.max, 0.0)], MUTED, 1.0, "5 4");
    panel.line(&[(0.0, y.min), (0.0, y.max)], MUTED, 1.0, "5 4");
    let marks = |held_out: bool| -> Vec<Mark> {
        let chosen = each.iter().filter(|drone| drone.held_out == held_out);
        chosen.map(|drone| super::point(place(drone))).collect()
    };
    panel.marks(&marks(false), BLUE, 4.0, MarkerShape::Circle);
    panel.marks(&marks(true), GREEN, 4.6, MarkerShape::Triangle);
    panel.legend_at(LegendPosition::InsideTopLeft);
    panel.clear_legend();
    panel.entry("fitted", BLUE, LegendShape::Circle, "");
    if each.iter().any(|drone| drone.held_out) {
        panel.entry("held out", GREEN, LegendShape::Marker(MarkerShape::Triangle), "");
    }
    let (size, places) = format.arrange(SIZE, &[[0.0, 0.0, SIZE[0], SIZE[1]]]);
    let place_in = *places.first()?;
    let mut sheet = Sheet::new(format, size);
    let [x_range, y_range] = panel.ranges([place_in[2], place_in[3]]);
    sheet.place(panel, place_in);
    let [left, top, width, height] = frame(place_in[2], place_in[3], false);
    let mut labels = Drawing::overlay(format);
    let sd =
        |of: fn(&DroneOffset) -> f64| rms(each.iter().map(|drone| of(drone))).unwrap_or(f64::NAN);
    let far = [FAR * sd(|drone| drone.offset_us), FAR * sd(|drone| drone.slope)];
    for drone in &each {
        let is_far = drone.offset_us.abs() > far[0] || drone.slope.abs() > far[1];
        if each.len() > MOST_LABELS && !is_far {
            continue;
        }
        let (px, py) = place(drone);
        let at = [
            left + width * (px - x_range[0]) / (x_range[1] - x_range[0]) + 7.0,
            top + height * (y_range[1] - py) / (y_range[1] - y_range[0]) + 4.0,
        ];
        let style = TextStyle { size: 11.5, bold: false, colour: INK, anchor: Anchor::Start };
        labels.text(at, &drone.slot.to_string(), style, 0.0);
    }
    sheet.lay_over(labels);
    let name = "gap-drones".to_owned();
    let title = "How drones differ from the fleet".to_owned();
    let some = if each.len() > MOST_LABELS { " Slots of drones far out are labelled." } else { "" };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "Each mark is a drone with its slot: how much more pulse it needs to hover, and how much \
             more its pulse moves with vertical speed, both best estimates that lean to the fleet's \
             mean. Weaker rotors need more of both and lie on a rising line; a heavier drone needs \
             more pulse with less change of response.{some}"
        ),
    })
}
