//! Areas and strokes of a panel that the plotting crate has no plot for: violins, their lines,
//! coloured bars with an outline.

use std::fmt::Write as _;

use kuva::render::layout::ComputedLayout;
use kuva::render::render::{PathData, Primitive};

use super::text::usable;

/// Something drawn in the coordinates of a panel.
#[derive(Clone, Debug)]
pub(super) enum Shape {
    /// A filled outline.
    Area { outline: Vec<(f64, f64)>, fill: String, opacity: f64 },
    /// Straight strokes of one kind, [from, to] each.
    Strokes { lines: Vec<[(f64, f64); 2]>, colour: String, width: f64, dash: &'static str },
}

impl Shape {
    /// The shape in pixels, cut at the panel's frame; `None` if nothing of it can be drawn.
    pub(super) fn path(&self, computed: &ComputedLayout) -> Option<Primitive> {
        let ends = |a: f64, b: f64| (a.min(b), a.max(b));
        let across = ends(computed.x_range.0, computed.x_range.1);
        let up = ends(computed.y_range.0, computed.y_range.1);
        let pixel = |(x, y): (f64, f64)| {
            (usable(x) && usable(y)).then(|| {
                let (x, y) = (x.clamp(across.0, across.1), y.clamp(up.0, up.1));
                (computed.map_x(x), computed.map_y(y))
            })
        };
        let mut d = String::new();
        let (fill, stroke, width, opacity, dash) = match self {
            Self::Area { outline, fill, opacity } => {
                for (x, y) in outline.iter().filter_map(|point| pixel(*point)) {
                    let _ = write!(d, "{}{x:.1} {y:.1}", if d.is_empty() { "M" } else { "L" });
                }
                if !d.is_empty() {
                    d.push('Z');
                }
                (Some(fill.as_str().into()), fill, 0.0, *opacity, "")
            }
            Self::Strokes { lines, colour, width, dash } => {
                for [from, to] in lines {
                    if let (Some((x1, y1)), Some((x2, y2))) = (pixel(*from), pixel(*to)) {
                        let _ = write!(d, "M{x1:.1} {y1:.1}L{x2:.1} {y2:.1}");
                    }
                }
                (None, colour, *width, 1.0, *dash)
            }
        };
        (!d.is_empty()).then(|| {
            Primitive::Path(Box::new(PathData {
                d,
                fill,
                stroke: stroke.as_str().into(),
                stroke_width: width,
                opacity: Some(opacity),
                stroke_dasharray: (!dash.is_empty()).then(|| dash.to_owned()),
            }))
        })
    }
}
