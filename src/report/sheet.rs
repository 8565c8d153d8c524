//! Sheets that put panels side by side in one small, repeatable SVG.

use std::fmt::Write as _;
use std::io::Read as _;
use std::path::Path;

use kuva::backend::svg::SvgBackend;
use kuva::render::render::{PathData, Primitive, Scene};

use super::chart::Panel;
use super::colour::INK;
use super::format::Format;
use super::svg::{Drawing, escape};
use super::text::clean;
use crate::base::file::open_regular;

/// Font of figures; all are found on the reader's machine or replaced there.
pub(super) const FONT: &str =
    "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif";
/// Font of figures for print, which goes with them.
pub(super) const PRINT_FONT: &str = "'Noto Sans', sans-serif";

/// Prefix of the clip ids that `kuva` numbers through the whole process.
const KUVA_CLIP: &str = "kuva-clip-";

/// A drawing that panels are put on.
pub(super) struct Sheet {
    format: Format,
    scene: Scene,
    overlay: String,
}

impl Sheet {
    /// An empty white sheet, pixels.
    pub(super) fn new(format: Format, [width, height]: [f64; 2]) -> Self {
        let mut scene = Scene::new(width, height);
        scene.font_family = Some(FONT.to_owned());
        scene.text_color = Some(INK.to_owned());
        Self { format, scene, overlay: String::new() }
    }

    /// A sheet with these panels; each has its place on a sheet of the page: [x, y, width, height].
    pub(super) fn of(format: Format, page: [f64; 2], panels: Vec<(Panel, [f64; 4])>) -> Self {
        let (panels, on_page): (Vec<Panel>, Vec<[f64; 4]>) = panels.into_iter().unzip();
        let (size, places) = format.arrange(page, &on_page);
        let mut sheet = Self::new(format, size);
        for (panel, place) in panels.into_iter().zip(places) {
            sheet.place(panel, place);
        }
        sheet
    }

    /// Draws a panel at [x, y, width, height].
    pub(super) fn place(&mut self, panel: Panel, [x, y, width, height]: [f64; 4]) {
        let panel = panel.draw(self.format, [width, height]);
        self.scene.defs.extend(panel.defs);
        self.scene.elements.push(Primitive::GroupStart {
            transform: Some(format!("translate({x},{y})")),
            title: None,
            extra_attrs: None,
        });
        self.scene.elements.extend(panel.elements);
        self.scene.elements.push(Primitive::GroupEnd);
    }

    /// Puts a white box over what is there: [x, y, width, height].
    pub(super) fn cover(&mut self, [x, y, width, height]: [f64; 4]) {
        self.scene.elements.push(Primitive::Path(Box::new(PathData {
            d: format!("M{x} {y}h{width}v{height}h-{width}z"),
            fill: Some("#ffffff".into()),
            stroke: "#ffffff".into(),
            stroke_width: 0.0,
            opacity: None,
            stroke_dasharray: None,
        })));
    }

    /// Lays a drawing over the panels; its coordinates are the sheet's.
    pub(super) fn lay_over(&mut self, drawing: Drawing) {
        self.overlay.push_str(&drawing.into_body());
    }

    /// The SVG. `name` makes ids unique in a page with several figures; `title` is read aloud.
    pub(super) fn svg(&self, name: &str, title: &str) -> String {
        let drawn = SvgBackend::new().render_scene(&self.scene);
        let body = drawn.split_once('>').map_or("", |(_, body)| body);
        let head = svg_head(self.format, [self.scene.width, self.scene.height], title);
        let tidy = tidied(&renumbered(body, name));
        // The overlay is tidy by itself, and its pictures hold digits that are no coordinates.
        let inner = tidy.trim_end().strip_suffix("</svg>").unwrap_or(&tidy);
        format!("{head}{inner}{}</svg>", self.overlay)
    }
}

/// What figures begin with.
const HEAD: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 ";
/// Within so many bytes is the opening tag.
const HEAD_BYTES: u64 = 512;

/// Whether a file begins as the figures of this program do: with its font in the opening tag.
pub(super) fn is_drawing(path: &Path) -> bool {
    let Ok((file, _)) = open_regular(path) else { return false };
    let mut head = Vec::new();
    if file.take(HEAD_BYTES).read_to_end(&mut head).is_err() {
        return false;
    }
    let head = String::from_utf8_lossy(&head);
    let has_font = |font: &str| head.contains(&format!("font-family=\"{}\"", escape(font)));
    head.starts_with(HEAD) && (has_font(FONT) || has_font(PRINT_FONT))
}

/// Opening tag and title of a figure.
pub(super) fn svg_head(format: Format, [width, height]: [f64; 2], title: &str) -> String {
    format!(
        "{HEAD}{width} {height}\" \
         {} role=\"img\" font-family=\"{}\" fill=\"{INK}\"><title>{}</title>",
        format.lengths([width, height]),
        escape(format.choose(FONT, PRINT_FONT)),
        escape(&clean(title)),
    )
}

/// Clip ids by order in the figure: the process-wide numbers would make each repeat differ.
fn renumbered(svg: &str, name: &str) -> String {
    let mut seen: Vec<&str> = Vec::new();
    let mut pieces = svg.split(KUVA_CLIP);
    let mut out = String::with_capacity(svg.len());
    out.push_str(pieces.next().unwrap_or(""));
    for piece in pieces {
        let digits = piece.find(|c: char| !c.is_ascii_digit()).unwrap_or(piece.len());
        let (number, rest) = piece.split_at(digits);
        let index = seen.iter().position(|&known| known == number).unwrap_or_else(|| {
            seen.push(number);
            seen.len() - 1
        });
        let _ = write!(out, "{name}-clip{index}{rest}");
    }
    out
}

/// Coordinates to a tenth of a pixel, which nobody sees and which saves a third of the size. Touches
/// numbers inside tags only, and only those that have more digits than they need.
fn tidied(svg: &str) -> String {
    let mut out = String::with_capacity(svg.len());
    let mut rest = svg;
    let mut in_tag = false;
    while let Some(c) = rest.chars().next() {
        let digits = if in_tag { number_length(rest) } else { 0 };
        if digits > 0 {
            let (number, tail) = rest.split_at(digits);
            out.push_str(&rounded(number));
            rest = tail;
            continue;
        }
        match c {
            '<' => in_tag = true,
            '>' => in_tag = false,
            _ => {}
        }
        out.push(c);
        rest = rest.get(c.len_utf8()..).unwrap_or("");
    }
    out
}

/// Length of the decimal number at the start of `text`; 0 if there is none.
fn number_length(text: &str) -> usize {
    text.bytes().position(|byte| !(byte.is_ascii_digit() || byte == b'.')).unwrap_or(text.len())
}

fn rounded(number: &str) -> String {
    let decimals = number.split_once('.').map_or(0, |(_, decimals)| decimals.len());
    match number.parse::<f64>() {
        Ok(value) if decimals > 1 && value >= 10.0 => {
            let text = format!("{value:.1}");
            text.strip_suffix(".0").unwrap_or(&text).to_owned()
        }
        Ok(value) if decimals > 3 => format!("{value:.2}"),
        _ => number.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_coordinates_are_rounded() {
        assert_eq!(
            tidied("<a d=\"M 112.25000000000001 7.449 \" o=\"0.85\">112.2500001</a>"),
            "<a d=\"M 112.3 7.449 \" o=\"0.85\">112.2500001</a>"
        );
        assert_eq!(tidied("<a x=\"16.00000001\"/>"), "<a x=\"16\"/>");
        assert_eq!(tidied("1.2.3 <b c=\"1.2.3\"/>"), "1.2.3 <b c=\"1.2.3\"/>");
    }

    #[test]
    fn clip_ids_depend_on_the_figure_only() {
        let one = renumbered("<a id=\"kuva-clip-17\"/><b u=\"#kuva-clip-17\"/>", "f");
        assert_eq!(one, "<a id=\"f-clip0\"/><b u=\"#f-clip0\"/>");
    }
}
