//! Sizes that figures are drawn for: the page, or a column of a printed paper.
//!
//! A figure for print is laid out for its width and not scaled to it, so that its text has the size of the text
//! around it. One pixel of its drawing is 0.6 points.

/// Points in a pixel of a figure for print: text of 12 pixels has 7.2 points.
const POINTS_PER_PIXEL: f64 = 0.6;
/// Points in a millimetre.
pub(super) const POINTS_PER_MM: f64 = 72.0 / 25.4;
/// Smallest text in print, pixels: 6.6 points.
const LEAST_TEXT: f64 = 11.0;
/// Narrower ones have one panel in a row, pixels: 116 mm.
const NARROW: f64 = 550.0;
/// Width of the page's figures, pixels.
const PAGE_WIDTH: f64 = 1040.0;
/// Highest panel of a narrow figure, as a share of its width, and the lowest to which panels are shrunk that do not
/// fit on a page below each other.
const TALLEST: f64 = 0.75;
const LOWEST: f64 = 0.5;
/// Height of the type area of a page, mm: nothing that is higher can be printed on one.
pub(super) const PAGE_HEIGHT_MM: f64 = 232.0;

/// What a figure is drawn for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Format {
    /// Width of the column, mm; absent: the page of the report.
    width_mm: Option<f64>,
}

impl Format {
    /// The page of the report.
    pub(super) const PAGE: Self = Self { width_mm: None };

    /// A column of a printed paper, mm.
    #[cfg(any(feature = "paper-figures", test))]
    pub(super) const fn column(width_mm: f64) -> Self {
        Self { width_mm: Some(width_mm) }
    }

    /// Whether it is printed.
    pub(super) fn is_print(self) -> bool {
        self.width_mm.is_some()
    }

    /// Whether one panel fits beside another.
    pub(super) fn is_narrow(self) -> bool {
        self.is_print() && self.width() < NARROW
    }

    /// Width of the drawing, pixels.
    pub(super) fn width(self) -> f64 {
        self.width_mm.map_or(PAGE_WIDTH, |mm| mm * POINTS_PER_MM / POINTS_PER_PIXEL)
    }

    /// One of two values: that of the page, or that of print.
    pub(super) fn choose<T>(self, page: T, print: T) -> T {
        if self.is_print() { print } else { page }
    }

    /// A length along the width of the page, pixels.
    pub(super) fn across(self, on_page: f64) -> f64 {
        self.choose(on_page, on_page * self.width() / PAGE_WIDTH)
    }

    /// A text's size, pixels: never too small to be read.
    pub(super) fn text(self, size: f64) -> f64 {
        self.choose(size, size.max(LEAST_TEXT))
    }

    /// Lengths of a drawing as attributes of its outermost element; width and height in pixels.
    pub(super) fn lengths(self, [width, height]: [f64; 2]) -> String {
        match self.width_mm {
            None => format!("width=\"{width}\" height=\"{height}\""),
            Some(mm) => {
                let tall = mm * height / width;
                format!("width=\"{mm}mm\" height=\"{tall:.2}mm\"")
            }
        }
    }

    /// Where panels lie that lie at `places` on a sheet of the page, and the size of their sheet: [x, y, width,
    /// height]. Narrow figures have them below each other.
    pub(super) fn arrange(self, page: [f64; 2], places: &[[f64; 4]]) -> ([f64; 2], Vec<[f64; 4]>) {
        if !self.is_print() {
            return (page, places.to_vec());
        }
        let width = self.width();
        if !self.is_narrow() {
            let share = width / page[0];
            let wide = |[x, y, w, h]: &[f64; 4]| [x * share, *y, w * share, *h];
            return ([width, page[1]], places.iter().map(wide).collect());
        }
        // What is above the first of them stays there.
        let mut top = places.iter().map(|place| place[1]).reduce(f64::min).unwrap_or(0.0);
        let heights = places.iter().map(|place| place[3].min(TALLEST * width));
        let room = PAGE_HEIGHT_MM * POINTS_PER_MM / POINTS_PER_PIXEL - top;
        let share = (room / heights.clone().sum::<f64>()).min(1.0);
        let stacked = heights.map(|height| {
            let height = height.min((height * share).floor().max(LOWEST * width));
            let place = [0.0, top, width, height];
            top += height;
            place
        });
        let stacked = stacked.collect();
        ([width, top], stacked)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TWO: [[f64; 4]; 2] = [[0.0, 28.0, 620.0, 460.0], [630.0, 28.0, 410.0, 200.0]];

    #[test]
    fn panels_stand_side_by_side_on_a_page_and_in_two_columns_and_stacked_in_one() {
        assert_eq!(Format::PAGE.arrange([1040.0, 488.0], &TWO), ([1040.0, 488.0], TWO.to_vec()));
        let double = Format::column(171.0);
        let ([wide, tall], places) = double.arrange([1040.0, 488.0], &TWO);
        assert!((wide * 0.6 - 171.0 * 72.0 / 25.4).abs() < 1e-9 && tall == 488.0);
        assert!(places[0][0] + places[0][2] < places[1][0], "{places:?}");
        assert!(places[1][0] + places[1][2] <= wide + 1e-9, "{places:?}");
        let single = Format::column(83.0);
        let ([wide, tall], places) = single.arrange([1040.0, 488.0], &TWO);
        assert!((wide * 0.6 - 83.0 * 72.0 / 25.4).abs() < 1e-9);
        assert_eq!((places[0][1], places[1][1]), (28.0, 28.0 + places[0][3]));
        assert!(places.iter().all(|place| place[0] == 0.0 && place[2] == wide));
        assert_eq!(tall, places[1][1] + 200.0);
    }

    #[test]
    fn no_text_is_smaller_than_can_be_read_in_print() {
        assert_eq!(Format::PAGE.text(6.0), 6.0);
        assert_eq!(Format::column(83.0).text(6.0) * POINTS_PER_PIXEL, 6.6);
    }

    #[test]
    fn lengths_are_in_millimetres_in_print() {
        assert_eq!(Format::PAGE.lengths([1040.0, 460.0]), "width=\"1040\" height=\"460\"");
        assert_eq!(
            Format::column(83.0).lengths([400.0, 200.0]),
            "width=\"83mm\" height=\"41.50mm\""
        );
    }
}
