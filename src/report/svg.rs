//! A minimal SVG writer for what the plotting crate does not draw: the labelled map of the grid.

use std::fmt::Write as _;

pub(super) use crate::base::markup::escape;

use super::format::Format;
use super::sheet::svg_head;
use super::text::clean;

/// Where a text's position lies in it.
#[derive(Clone, Copy, Debug)]
pub(super) enum Anchor {
    /// At its left end.
    Start,
    /// The text is centred on its point.
    Middle,
    /// At its right end.
    End,
}

/// Size, weight and colour of a text.
#[derive(Clone, Copy, Debug)]
pub(super) struct TextStyle<'a> {
    pub(super) size: f64,
    pub(super) bold: bool,
    pub(super) colour: &'a str,
    pub(super) anchor: Anchor,
}

/// A drawing being written, pixels, y down.
pub(super) struct Drawing {
    format: Format,
    width: f64,
    height: f64,
    body: String,
}

impl Drawing {
    /// An empty white drawing.
    pub(super) fn new(format: Format, [width, height]: [f64; 2]) -> Self {
        let mut drawing = Self { format, width, height, body: String::new() };
        drawing.rect([0.0, 0.0, width, height], "#ffffff", "");
        drawing
    }

    /// A filled rectangle: x, y, width, height; `more` holds further attributes of our own making.
    pub(super) fn rect(&mut self, [x, y, w, h]: [f64; 4], fill: &str, more: &str) {
        let _ = write!(
            self.body,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{w:.1}\" height=\"{h:.1}\" fill=\"{fill}\"{}{more}/>",
            if more.is_empty() { "" } else { " " },
        );
    }

    /// A straight line.
    pub(super) fn line(&mut self, [x1, y1, x2, y2]: [f64; 4], stroke: &str) {
        let _ = write!(
            self.body,
            "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{stroke}\"/>",
        );
    }

    /// A line through points.
    pub(super) fn polyline(&mut self, points: &[(f64, f64)], stroke: &str, more: &str) {
        let mut d = String::new();
        for (x, y) in points {
            let _ = write!(d, "{}{x:.1} {y:.1}", if d.is_empty() { "M" } else { "L" });
        }
        let _ = write!(
            self.body,
            "<path d=\"{d}\" fill=\"none\" stroke=\"{stroke}\"{}{more}/>",
            if more.is_empty() { "" } else { " " },
        );
    }

    /// A disc with an outline: centre, radius.
    pub(super) fn disc(&mut self, [x, y]: [f64; 2], r: f64, fill: &str, stroke: &str) {
        let _ = write!(
            self.body,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{r:.1}\" fill=\"{fill}\" stroke=\"{stroke}\"/>",
        );
    }

    /// A text; `turn_deg` rotates it around its position.
    pub(super) fn text(&mut self, at: [f64; 2], text: &str, style: TextStyle<'_>, turn_deg: f64) {
        let [x, y] = at;
        let anchor = match style.anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let _ = write!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"{}\"",
            self.format.text(style.size),
            style.colour,
        );
        if style.bold {
            self.body.push_str(" font-weight=\"600\"");
        }
        if turn_deg != 0.0 {
            let _ = write!(self.body, " transform=\"rotate({turn_deg} {x:.1} {y:.1})\"");
        }
        let _ = write!(self.body, ">{}</text>", escape(&clean(text)));
    }

    /// What it is drawn for.
    pub(super) fn format(&self) -> Format {
        self.format
    }

    /// An element of our own making.
    pub(super) fn raw(&mut self, element: &str) {
        self.body.push_str(element);
    }

    /// Opens a group with a tooltip.
    pub(super) fn open(&mut self, tooltip: &str) {
        let _ = write!(self.body, "<g><title>{}</title>", escape(&clean(tooltip)));
    }

    /// Opens a group with a tooltip that stands for a drone, in all parts of the page.
    pub(super) fn open_drone(&mut self, pick: &str, tooltip: &str) {
        let (pick, tooltip) = (escape(&clean(pick)), escape(&clean(tooltip)));
        let _ = write!(self.body, "<g data-pick=\"{pick}\"><title>{tooltip}</title>");
    }

    /// Closes the innermost group.
    pub(super) fn close(&mut self) {
        self.body.push_str("</g>");
    }

    /// A drawing without a ground of its own, to be laid over another.
    pub(super) fn overlay(format: Format) -> Self {
        Self { format, width: 0.0, height: 0.0, body: String::new() }
    }

    /// What was drawn, without the outer element.
    pub(super) fn into_body(self) -> String {
        self.body
    }

    /// The whole SVG; `title` is read aloud.
    pub(super) fn finish(self, title: &str) -> String {
        format!("{}{}</svg>", svg_head(self.format, [self.width, self.height], title), self.body)
    }
}
