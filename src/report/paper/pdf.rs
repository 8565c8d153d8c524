//! A drawing as a PDF of one page.

use svg2pdf::usvg::{ImageHrefResolver, Options, Tree};
use svg2pdf::{ConversionOptions, PageOptions, to_pdf};

use super::PaperError;
use super::canonical::canonical;
use super::font::{FAMILY, fonts};
use crate::report::format::POINTS_PER_MM;

/// Dots of a drawing in an inch: its lengths come out in points.
const DPI: f32 = 72.0;

/// A drawing, read.
pub(super) fn tree(name: &str, svg: &str) -> Result<Tree, PaperError> {
    let options = Options {
        dpi: DPI,
        font_family: FAMILY.to_owned(),
        fontdb: fonts(),
        image_href_resolver: ImageHrefResolver {
            resolve_data: ImageHrefResolver::default_data_resolver(),
            // Pictures are in the drawing: no file is opened.
            resolve_string: Box::new(|_, _| None),
        },
        ..Options::default()
    };
    Tree::from_str(svg, &options)
        .map_err(|source| PaperError::Svg { name: name.to_owned(), source })
}

/// Height of a drawing, mm.
pub(super) fn height_mm(tree: &Tree) -> f64 {
    f64::from(tree.size().height()) / POINTS_PER_MM
}

/// The page, of the size of the drawing.
pub(super) fn pdf(name: &str, tree: &Tree) -> Result<Vec<u8>, PaperError> {
    let failed = |reason: String| PaperError::Pdf { name: name.to_owned(), reason };
    let made = to_pdf(tree, ConversionOptions::default(), PageOptions { dpi: DPI })
        .map_err(|error| failed(error.to_string()))?;
    canonical(&made).ok_or_else(|| failed("its objects are not as expected".to_owned()))
}
