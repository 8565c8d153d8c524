//! A place for a legend inside a panel where nothing is drawn.

use kuva::plot::legend::LegendPosition;

use super::text::usable;

/// Distance of the legend's box from the frame, and its size, pixels: larger than what the plotting crate
/// draws at the report's font size.
const INSET: f64 = 10.0;
const ROW: f64 = 18.0;
const PADDING: f64 = 22.0;
const SWATCH: f64 = 46.0;
const LETTER: f64 = 6.6;
/// Points between two corners of a line.
const BETWEEN: usize = 24;

/// A corner of a panel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Corner {
    TopLeft,
    TopRight,
    BottomLeft,
    BottomRight,
}

/// As good as any in this order.
const CORNERS: [Corner; 4] =
    [Corner::TopLeft, Corner::TopRight, Corner::BottomLeft, Corner::BottomRight];

impl Corner {
    /// The corner that a position means; `None`: it is not in a corner.
    pub(super) fn of(position: LegendPosition) -> Option<Self> {
        match position {
            LegendPosition::InsideTopLeft => Some(Self::TopLeft),
            LegendPosition::InsideTopRight => Some(Self::TopRight),
            LegendPosition::InsideBottomLeft => Some(Self::BottomLeft),
            LegendPosition::InsideBottomRight => Some(Self::BottomRight),
            _ => None,
        }
    }

    /// The same for the plotting crate.
    pub(super) fn position(self) -> LegendPosition {
        match self {
            Self::TopLeft => LegendPosition::InsideTopLeft,
            Self::TopRight => LegendPosition::InsideTopRight,
            Self::BottomLeft => LegendPosition::InsideBottomLeft,
            Self::BottomRight => LegendPosition::InsideBottomRight,
        }
    }
}

/// Everything that a panel shows, as points of its data.
#[derive(Clone, Debug, Default)]
pub(super) struct Inked(Vec<[f64; 2]>);

impl Inked {
    /// A point.
    pub(super) fn point(&mut self, x: f64, y: f64) {
        if usable(x) && usable(y) {
            self.0.push([x, y]);
        }
    }

    /// A line through points.
    pub(super) fn line(&mut self, points: &[(f64, f64)]) {
        for pair in points.windows(2) {
            let [(x1, y1), (x2, y2)] = *pair else { continue };
            for step in 0..=BETWEEN {
                let part = step as f64 / BETWEEN as f64;
                self.point(x1 + part * (x2 - x1), y1 + part * (y2 - y1));
            }
        }
    }

    /// A band between two lines.
    pub(super) fn band(&mut self, points: &[(f64, f64, f64)]) {
        for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
            let line: Vec<(f64, f64)> =
                points.iter().map(|&(x, low, high)| (x, low + part * (high - low))).collect();
            self.line(&line);
        }
    }
}

/// Width and height that a legend takes at a corner of the frame, with its distance from it, pixels.
pub(super) fn size(labels: &[&str]) -> [f64; 2] {
    let letters = labels.iter().map(|label| label.chars().count()).max().unwrap_or(0);
    [INSET + SWATCH + LETTER * letters as f64, INSET + PADDING + ROW * labels.len() as f64]
}

/// The corner with the least below the legend, and how many points are there; of equals `wanted`, then the
/// first. `frame`: width and height, pixels; `place`: where a point lies in it, from the upper left, shares.
pub(super) fn corner(
    inked: &Inked,
    wanted: Corner,
    legend: [f64; 2],
    frame: [f64; 2],
    place: impl Fn([f64; 2]) -> [f64; 2],
) -> (Corner, usize) {
    let [wide, tall] = [legend[0] / frame[0], legend[1] / frame[1]];
    let points: Vec<[f64; 2]> = inked.0.iter().map(|point| place(*point)).collect();
    let covered = |corner: Corner| {
        let inside = |[x, y]: [f64; 2]| {
            let across = match corner {
                Corner::TopLeft | Corner::BottomLeft => x,
                _ => 1.0 - x,
            };
            let down = match corner {
                Corner::TopLeft | Corner::TopRight => y,
                _ => 1.0 - y,
            };
            (0.0..=wide).contains(&across) && (0.0..=tall).contains(&down)
        };
        points.iter().filter(|point| inside(**point)).count()
    };
    let all = std::iter::once(wanted).chain(CORNERS);
    let counted = all.map(|corner| (corner, covered(corner)));
    counted.min_by_key(|(_, count)| *count).unwrap_or((wanted, 0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Shares of a unit square, y up.
    fn found(points: &[(f64, f64)], wanted: Corner) -> (Corner, usize) {
        let mut inked = Inked::default();
        inked.line(points);
        corner(&inked, wanted, [30.0, 30.0], [100.0, 100.0], |[x, y]| [x, 1.0 - y])
    }

    #[test]
    fn a_legend_goes_where_nothing_is() {
        use Corner::{BottomRight, TopLeft, TopRight};
        let rising = [(0.0, 0.0), (1.0, 1.0)];
        assert_eq!(found(&rising, TopRight), (TopLeft, 0));
        assert_eq!(found(&rising, BottomRight), (BottomRight, 0), "what was wanted");
        let falling = [(0.0, 1.0), (1.0, 0.0)];
        assert_eq!(found(&falling, TopLeft), (TopRight, 0));
        let cross = [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0), (1.0, 0.0)];
        assert!(found(&cross, TopLeft).1 > 0, "no corner is free");
    }
}
