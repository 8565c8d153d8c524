//! Time means of two maps by place on one scale, and their difference.

use super::super::plan_view::{Projection, axes, colour_bar, limit};
use crate::base::estimate::Estimate;
use crate::compare::result::{MapComparison, PlaceChange};
use crate::report::Figure;
use crate::report::colour::{INK, diverging, ink_on_diverging};
use crate::report::compare_words::pair;
use crate::report::format::Format;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, estimate, fixed, shortened, signed, usable};

/// Side of a map, pixels.
const SIDE: f64 = 340.0;
/// Pixels above the maps, and between them.
const TOP: f64 = 44.0;
const BETWEEN: f64 = 26.0;
/// Above so many places the cells are too small for text.
const TEXT_LIMIT: usize = 150;
/// Columns of a heading.
const LABEL: usize = 34;

/// Narrowest cell with numbers in print, pixels.
const LEAST_CELL: f64 = 38.0;

type Of = fn(&PlaceChange) -> Estimate;

/// The maps; `None` where their places differ.
pub(in crate::report) fn figure(map: &MapComparison, key: &str, format: Format) -> Option<Figure> {
    let name = format!("compare-maps-{key}");
    let title = format!("Means of the air by place, {}", pair(&map.pair));
    let places = &map.places.as_ref()?.places;
    if format.is_narrow() {
        return Some(Figure::too_wide(name, title));
    }
    let at: Vec<[f64; 2]> = places.iter().map(|place| place.position_m).collect();
    let side = format.choose(SIDE, (format.width() - 302.0) / 3.0);
    let (left, between) = format.choose((70.0, BETWEEN), (58.0, 14.0));
    let first = Projection::new(&at, [left, TOP], [side, side], 0.5)?;
    let [width, height] = first.size();
    // The heading of a map must fit, too.
    let shift = width.max(format.choose(230.0, side)) + between;
    let bar_room = format.choose(110.0, 100.0);
    let lefts = [left + shift, left + 2.0 * shift + bar_room];
    let second = Projection::new(&at, [lefts[0], TOP], [side, side], 0.5)?;
    let third = Projection::new(&at, [lefts[1], TOP], [side, side], 0.5)?;
    let scale = limit(places.iter().flat_map(|place| [place.reference.value, place.other.value]));
    let of_change = limit(places.iter().map(|place| place.change.value));
    let wide = format.choose(70.0 + 3.0 * shift + 110.0 + 100.0, format.width());
    let mut drawing =
        Drawing::new(format, [wide, TOP + height.max(format.choose(200.0, 160.0)) + 58.0]);
    let label = format.choose(LABEL, (side / 8.0) as usize);
    // Numbers of the smallest size that is read.
    let cell_px = at.first().map_or(0.0, |place| first.cell(*place)[2]);
    let with_text = places.len() <= TEXT_LIMIT && (!format.is_print() || cell_px >= LEAST_CELL);
    let maps: [(&Projection, Of, f64, String); 3] = [
        (&first, |place| place.reference, scale, shortened(&map.pair.reference, label)),
        (&second, |place| place.other, scale, shortened(&map.pair.other, label)),
        (&third, |place| place.change, of_change, "second less first".to_owned()),
    ];
    for (projection, of, limit, heading) in &maps {
        for place in places {
            cell(&mut drawing, place, of(place), projection, *limit, with_text);
        }
        let style = TextStyle { size: 14.0, bold: true, colour: INK, anchor: Anchor::Start };
        drawing.text([projection.origin()[0], TOP - 14.0], heading, style, 0.0);
    }
    axes(&mut drawing, &first);
    let tall = height.clamp(160.0, SIDE);
    let bar = [lefts[0] + width + format.choose(20.0, 10.0), TOP, 14.0, tall];
    colour_bar(&mut drawing, bar, scale, "mean W* (m/s)");
    let bar = [lefts[1] + width + format.choose(20.0, 10.0), TOP, 14.0, tall];
    colour_bar(&mut drawing, bar, of_change, "difference (m/s)");
    Some(Figure {
        svg: drawing.finish(&title),
        name,
        title,
        caption: "The grid seen from above, a square for each place that both flights have: the mean vertical air \
                  speed over each hover on one colour scale, and the second less the first on its own. The numbers \
                  below are the drones' own standard errors: an error that all drones share moves a whole map."
            .to_owned(),
    })
}

fn cell(
    drawing: &mut Drawing,
    place: &PlaceChange,
    of: Estimate,
    projection: &Projection,
    limit: f64,
    with_text: bool,
) {
    if !usable(of.value) {
        return;
    }
    let [x, y, w, h] = projection.cell(place.position_m);
    drawing.open(&format!("{}: {} m/s", clean(&place.name), estimate(of)));
    let position = of.value / limit;
    drawing.rect([x + 0.75, y + 0.75, w - 1.5, h - 1.5], &diverging(position), "rx=\"2\"");
    if with_text {
        let colour = ink_on_diverging(position);
        let style = |size: f64, bold| TextStyle { size, bold, colour, anchor: Anchor::Middle };
        let at = [x + w / 2.0, y + h * 0.56];
        drawing.text(at, &signed(of.value, 2), style((w * 0.25).min(18.0), true), 0.0);
        if usable(of.se) && of.se > 0.0 {
            let at = [x + w / 2.0, y + h * 0.8];
            drawing.text(
                at,
                &format!("±{}", fixed(of.se, 2)),
                style((w * 0.18).min(12.0), false),
                0.0,
            );
        }
    }
    drawing.close();
}
