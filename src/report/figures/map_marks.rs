//! Beside the map's squares: the ground below, and how long, where north and where the wind is.

use std::fmt::Write as _;

use super::plan_view::Projection;
use crate::analysis::result::FlightAnalysis;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::report::axis::nice_step;
use crate::report::basemap::Basemap;
use crate::report::colour::{INK, MUTED};
use crate::report::page_air::wind;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, fixed, usable};

/// Height that the marks take below the axes, pixels.
pub(super) const MARKS_HEIGHT: f64 = 46.0;
/// The same of a second row of them.
pub(super) const NEXT_ROW: f64 = 28.0;
/// Share of colour in squares over a picture.
pub(super) const CELLS: f64 = 0.7;

/// The picture below the squares, which are drawn after it; none where the show's place is not known.
pub(super) fn ground(
    drawing: &mut Drawing,
    projection: &Projection,
    flight: &FlightAnalysis,
    basemap: &Basemap,
) {
    let (Some([lat_deg, lon_deg]), Some(orientation_deg)) =
        (flight.site.and_then(|site| site.origin_deg()), flight.orientation_deg)
    else {
        return;
    };
    let origin = Geodetic { lat_deg, lon_deg, amsl_m: 0.0 };
    let corners = basemap.corners_m(&ShowFrame { origin, orientation_deg });
    if !corners.iter().flatten().all(|m| usable(*m)) {
        return;
    }
    let [nw, ne, sw] = corners.map(|[x, y]| [projection.across(y), projection.down(x)]);
    let [x, y] = projection.origin();
    let [w, h] = projection.size();
    let mut told = String::new();
    for [forward, left] in corners {
        let _ = write!(told, "{}[{forward:.2},{left:.2}]", if told.is_empty() { "" } else { "," });
    }
    // In print the squares say it themselves.
    let style = drawing.format().choose(
        format!(
            "<style>svg.ground ~ g[data-pick] > rect {{ fill-opacity: var(--cells, {CELLS}) }}</style>"
        ),
        String::new(),
    );
    // An inner drawing shows nothing beyond its edges.
    drawing.raw(&format!(
        "<svg class=\"ground\" x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" \
         viewBox=\"{x:.1} {y:.1} {w:.1} {h:.1}\"><image class=\"basemap\" width=\"1\" height=\"1\" \
         preserveAspectRatio=\"none\" transform=\"matrix({:.4} {:.4} {:.4} {:.4} {:.2} {:.2})\" \
         data-corners=\"[{told}]\" href=\"{}\"/></svg>{style}",
        ne[0] - nw[0],
        ne[1] - nw[1],
        sw[0] - nw[0],
        sw[1] - nw[1],
        nw[0],
        nw[1],
        basemap.address(),
    ));
}

/// `The ground is field.jpg, whose it is.`
pub(super) fn ground_words(flight: &FlightAnalysis, basemap: Option<&Basemap>) -> String {
    let known = flight.site.and_then(|site| site.origin_deg()).is_some()
        && flight.orientation_deg.is_some();
    let words = basemap.filter(|_| known).map(|basemap| clean(&basemap.words()));
    words.map_or_else(String::new, |words| format!(" The ground is {words}."))
}

/// A scale, the arrow to the north, and the wind, from a place to the right.
pub(super) fn marks(
    drawing: &mut Drawing,
    projection: &Projection,
    flight: &FlightAnalysis,
    [x, y]: [f64; 2],
) {
    let style = TextStyle { size: 12.0, bold: false, colour: INK, anchor: Anchor::Start };
    let ([high, low], [left, right]) = projection.ranges();
    let length_m = nice_step(((high - low).max(left - right) / 5.0).max(1.0));
    let end = x + length_m * projection.scale();
    drawing.line([x, y, end, y], INK);
    for at in [x, end] {
        drawing.line([at, y - 4.0, at, y + 4.0], INK);
    }
    drawing.text([end + 8.0, y + 4.0], &format!("{} m", fixed(length_m, 0)), style, 0.0);
    let is_narrow = drawing.format().is_narrow();
    let mut next = end + 76.0;
    if let Some(orientation) = flight.orientation_deg.filter(|deg| usable(*deg)) {
        // Forward is up and left is left: north turns against the show.
        let (sin, cos) = orientation.to_radians().sin_cos();
        arrow(drawing, [next, y], [-sin, -cos]);
        drawing.text([next + 18.0, y + 4.0], "north", style, 0.0);
        next += 84.0;
    }
    // In one column of print the wind is below.
    let (next, y) = if is_narrow { (x + 12.0, y + NEXT_ROW) } else { (next, y) };
    if let Some([forward, left]) = wind(flight) {
        let speed = forward.hypot(left);
        arrow(drawing, [next, y], [-left / speed, -forward / speed]);
        let known = flight.statistics.as_ref().and_then(|found| found.wind.as_ref()?.from_deg);
        let from = known.map_or_else(String::new, |deg| format!(" from {}°", fixed(deg, 0)));
        let words = format!("wind {} m/s{from}", fixed(speed, 1));
        drawing.text([next + 18.0, y + 4.0], &words, style, 0.0);
    }
}

/// An arrow around a place, in a direction of unit length, pixels.
fn arrow(drawing: &mut Drawing, [x, y]: [f64; 2], [dx, dy]: [f64; 2]) {
    let tip = [x + 11.0 * dx, y + 11.0 * dy];
    drawing.line([x - 11.0 * dx, y - 11.0 * dy, tip[0], tip[1]], MUTED);
    for turn in [2.6_f64, -2.6] {
        let (sin, cos) = turn.sin_cos();
        let barb = [dx * cos - dy * sin, dx * sin + dy * cos];
        drawing.line([tip[0], tip[1], tip[0] + 7.0 * barb[0], tip[1] + 7.0 * barb[1]], MUTED);
    }
}
