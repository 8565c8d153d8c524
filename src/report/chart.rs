//! Panels with axes, drawn by `kuva`, and sheets that put panels side by side in one SVG.

use std::fmt::Write as _;

use kuva::backend::svg::SvgBackend;
use kuva::plot::legend::{LegendEntry, LegendPosition, LegendShape};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::plot::{BandPlot, LinePlot};
use kuva::render::layout::{ComputedLayout, Layout, TickFormat};
use kuva::render::plots::Plot;
use kuva::render::render::{
    PathData, Primitive, Scene, TextAnchor, render_multiple, render_twin_y,
};
use kuva::render::theme::Theme;

use super::colour::{INK, RULE};
use super::svg::escape;
use super::text::{clean, fixed, usable};

/// Font of figures; all are found on the reader's machine or replaced there.
pub(super) const FONT: &str =
    "Inter, 'Segoe UI', 'Helvetica Neue', Arial, 'Liberation Sans', sans-serif";

/// Distances of ticks on a time axis.
const TIME_STEPS_S: [f64; 12] =
    [1.0, 2.0, 5.0, 10.0, 20.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0, 7200.0];

/// Pixels right of a panel with a right axis.
const RIGHT_AXIS_MARGIN: f64 = 62.0;

/// Prefix of the clip ids that `kuva` numbers through the whole process.
const KUVA_CLIP: &str = "kuva-clip-";

/// A linear axis: label with unit, range, distance of its ticks.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    pub(super) label: String,
    pub(super) min: f64,
    pub(super) max: f64,
    pub(super) step: f64,
}

impl Axis {
    /// An axis around all usable values, at least `span` wide, ending on ticks.
    pub(super) fn around(label: &str, values: impl Iterator<Item = f64>, span: f64) -> Self {
        let (low, high) = extent(values, span);
        let step = nice_step((high - low) / 5.0);
        // Room between the data and the frame.
        let pad = 0.03 * (high - low);
        let min = ((low - pad) / step).floor() * step;
        let max = ((high + pad) / step).ceil() * step;
        Self { label: label.to_owned(), min, max, step }
    }

    /// A time axis in seconds, not starting before the data.
    pub(super) fn time(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = extent(values, 10.0);
        let wanted = (high - low) / 7.0;
        let step = TIME_STEPS_S
            .into_iter()
            .find(|&step| step >= wanted)
            .unwrap_or_else(|| nice_step(wanted));
        let min = if low > 0.0 && low < step { 0.0 } else { low };
        Self { label: "show time (s)".to_owned(), min, max: high, step }
    }

    /// Tick labels with just the decimals that the step needs.
    fn format(&self) -> TickFormat {
        let decimals = decimals_of(self.step);
        TickFormat::Custom(std::sync::Arc::new(move |value| fixed(value, decimals)))
    }
}

/// Decimals that tell two multiples of `step` apart.
pub(super) fn decimals_of(step: f64) -> usize {
    (0..6)
        .find(|&decimals| {
            let scaled = step * 10_f64.powi(decimals);
            (scaled - scaled.round()).abs() < 1e-6 * scaled.abs().max(1.0)
        })
        .unwrap_or(6) as usize
}

/// The smallest of 1, 2, 2.5, 5 times a power of ten that is not below `raw`.
pub(super) fn nice_step(raw: f64) -> f64 {
    if !(raw.is_finite() && raw > 0.0) {
        return 1.0;
    }
    let power = 10_f64.powf(raw.log10().floor());
    [1.0, 2.0, 2.5, 5.0, 10.0]
        .into_iter()
        .map(|factor| factor * power)
        .find(|&step| step >= raw * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

fn extent(values: impl Iterator<Item = f64>, span: f64) -> (f64, f64) {
    let (low, high) = values
        .filter(|&value| usable(value))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return (0.0, span);
    }
    let lacking = (span - (high - low)).max(0.0) / 2.0;
    (low - lacking, high + lacking)
}

/// A point with half lengths of its error bars.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mark {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) x_error: f64,
    pub(super) y_error: f64,
}

impl Mark {
    /// Whether the point can be drawn.
    pub(super) fn usable(&self) -> bool {
        usable(self.x) && usable(self.y)
    }
}

/// One pair of axes with what is drawn in them, in order.
pub(super) struct Panel {
    title: String,
    x: Axis,
    y: Axis,
    plots: Vec<Plot>,
    right: Option<(Axis, Vec<Plot>)>,
    bars: Vec<(Vec<Mark>, String)>,
    legend: Vec<LegendEntry>,
    legend_position: LegendPosition,
    legend_box: bool,
    right_margin: f64,
}

impl Panel {
    /// An empty panel.
    pub(super) fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: plain(title),
            x,
            y,
            plots: Vec::new(),
            right: None,
            bars: Vec::new(),
            legend: Vec::new(),
            legend_position: LegendPosition::InsideTopLeft,
            legend_box: true,
            right_margin: 16.0,
        }
    }

    /// Where the legend goes.
    pub(super) fn legend_at(&mut self, position: LegendPosition) {
        self.legend_position = position;
    }

    /// Lets what is drawn show behind the legend.
    pub(super) fn clear_legend(&mut self) {
        self.legend_box = false;
    }

    /// Puts the legend right of the panel, so many pixels wide.
    pub(super) fn legend_outside(&mut self, width: f64) {
        self.legend_position = LegendPosition::OutsideRightTop;
        self.right_margin = width;
    }

    /// Leaves room on the right, as a panel with a right axis does, so that both line up.
    pub(super) fn leave_room_right(&mut self) {
        self.right_margin = RIGHT_AXIS_MARGIN;
    }

    /// A second axis on the right, with its own lines.
    pub(super) fn right_axis(&mut self, axis: Axis, lines: Vec<Plot>) {
        self.right = Some((axis, lines));
        self.leave_room_right();
    }

    /// An entry of the legend.
    pub(super) fn entry(&mut self, label: &str, colour: &str, shape: LegendShape, dash: &str) {
        self.legend.push(LegendEntry {
            label: plain(label),
            color: colour.to_owned(),
            shape,
            dasharray: (!dash.is_empty()).then(|| dash.to_owned()),
        });
    }

    /// A line, broken where a point cannot be drawn.
    pub(super) fn line(&mut self, points: &[(f64, f64)], colour: &str, width: f64, dash: &str) {
        self.plots.extend(lines(points, colour, width, dash));
    }

    /// A shaded band: (x, lower, upper).
    pub(super) fn band(&mut self, points: &[(f64, f64, f64)], colour: &str) {
        for run in points.split(|&(x, low, high)| !(usable(x) && usable(low) && usable(high))) {
            if run.len() > 1 {
                let band = BandPlot::new(
                    run.iter().map(|point| point.0),
                    run.iter().map(|point| point.1),
                    run.iter().map(|point| point.2),
                );
                self.plots.push(Plot::Band(band.with_color(colour).with_opacity(0.22)));
            }
        }
    }

    /// Points of one colour, with thin error bars behind them.
    pub(super) fn marks(&mut self, marks: &[Mark], colour: &str, size: f64, shape: MarkerShape) {
        let marks: Vec<Mark> = marks.iter().copied().filter(Mark::usable).collect();
        if marks.is_empty() {
            return;
        }
        let mut scatter = ScatterPlot::new()
            .with_data(marks.iter().map(|mark| (mark.x, mark.y)))
            .with_color(colour)
            .with_size(size)
            .with_marker(shape);
        scatter.marker_opacity = Some(0.85);
        self.plots.push(Plot::Scatter(scatter));
        self.bars.push((marks, colour.to_owned()));
    }

    /// Draws the panel.
    pub(super) fn draw(self, width: f64, height: f64) -> Scene {
        let mut layout = Layout::new((self.x.min, self.x.max), (self.y.min, self.y.max))
            .with_width(width)
            .with_height(height)
            .with_x_label(self.x.label.clone())
            .with_y_label(self.y.label.clone())
            .with_x_axis_min(self.x.min)
            .with_x_axis_max(self.x.max)
            .with_y_axis_min(self.y.min)
            .with_y_axis_max(self.y.max)
            .with_x_tick_step(self.x.step)
            .with_y_tick_step(self.y.step)
            .with_x_tick_format(self.x.format())
            .with_y_tick_format(self.y.format())
            .with_force_margins(66.0, self.right_margin)
            .with_force_margins_y(30.0, 46.0)
            .with_label_size(13)
            .with_tick_size(12)
            .with_body_size(12)
            .with_font_family(FONT)
            .with_theme(theme());
        if !self.legend.is_empty() {
            layout = layout
                .with_legend_entries(self.legend)
                .with_legend_position(self.legend_position)
                .with_legend_box(self.legend_box);
        }
        let mut scene;
        if let Some((axis, lines)) = self.right {
            layout = layout
                .with_y2_range(axis.min, axis.max)
                .with_y2_axis_min(axis.min)
                .with_y2_axis_max(axis.max)
                .with_y2_label(axis.label.clone())
                .with_y2_tick_format(axis.format());
            let computed = ComputedLayout::from_layout(&layout);
            scene = render_twin_y(self.plots, lines, layout);
            insert_bars(&mut scene, &computed, &self.bars);
        } else {
            let computed = ComputedLayout::from_layout(&layout);
            scene = render_multiple(self.plots, layout);
            insert_bars(&mut scene, &computed, &self.bars);
        }
        scene.elements.push(Primitive::Text {
            x: 66.0,
            y: 17.0,
            content: self.title,
            size: 14,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: true,
            color: None,
        });
        scene
    }
}

/// Lines for [`Panel::right_axis`], broken where a point cannot be drawn.
pub(super) fn lines(points: &[(f64, f64)], colour: &str, width: f64, dash: &str) -> Vec<Plot> {
    points
        .split(|&(x, y)| !(usable(x) && usable(y)))
        .filter(|run| run.len() > 1)
        .map(|run| {
            let line = LinePlot::new()
                .with_data(run.iter().copied())
                .with_color(colour)
                .with_stroke_width(width);
            Plot::Line(if dash.is_empty() {
                line
            } else {
                line.with_line_style(kuva::plot::LineStyle::Custom(dash.to_owned()))
            })
        })
        .collect()
}

/// Keeps the highest and the lowest sample of each of `buckets` stretches: a thinned trace looks
/// like the whole one.
pub(super) fn thinned(points: &[(f64, f64)], buckets: usize) -> Vec<(f64, f64)> {
    if points.len() <= 2 * buckets.max(1) {
        return points.to_vec();
    }
    let size = points.len().div_ceil(buckets.max(1));
    let mut kept = Vec::with_capacity(2 * buckets);
    for stretch in points.chunks(size) {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let (Some(low), Some(high)) =
            (stretch.iter().min_by(by_value), stretch.iter().max_by(by_value))
        else {
            continue;
        };
        let (first, second) = if low.0 <= high.0 { (low, high) } else { (high, low) };
        kept.push(*first);
        if first != second {
            kept.push(*second);
        }
    }
    kept
}

/// All bars of a colour in one path: three elements for each bar would make big files.
fn insert_bars(scene: &mut Scene, computed: &ComputedLayout, bars: &[(Vec<Mark>, String)]) {
    let (left, right) = (computed.map_x(computed.x_range.0), computed.map_x(computed.x_range.1));
    let (bottom, top) = (computed.map_y(computed.y_range.0), computed.map_y(computed.y_range.1));
    let mut paths = Vec::new();
    for (marks, colour) in bars {
        let mut d = String::new();
        for mark in marks {
            let (x, y) = (computed.map_x(mark.x), computed.map_y(mark.y));
            if usable(mark.x_error) && mark.x_error > 0.0 {
                let from = computed.map_x(mark.x - mark.x_error).clamp(left, right);
                let to = computed.map_x(mark.x + mark.x_error).clamp(left, right);
                let _ = write!(d, "M{from:.1} {y:.1}H{to:.1}");
            }
            if usable(mark.y_error) && mark.y_error > 0.0 {
                let from = computed.map_y(mark.y - mark.y_error).clamp(top, bottom);
                let to = computed.map_y(mark.y + mark.y_error).clamp(top, bottom);
                let _ = write!(d, "M{x:.1} {from:.1}V{to:.1}");
            }
        }
        if !d.is_empty() {
            paths.push(Primitive::Path(Box::new(PathData {
                d,
                fill: None,
                stroke: colour.as_str().into(),
                stroke_width: 1.0,
                opacity: Some(0.55),
                stroke_dasharray: None,
            })));
        }
    }
    let behind = scene
        .elements
        .iter()
        .position(|element| matches!(element, Primitive::ClipStart { .. }))
        .map_or(scene.elements.len(), |index| index + 1);
    scene.elements.splice(behind..behind, paths);
}

/// `kuva` reads `$...$` as mathematics; names from outside must not be.
fn plain(text: &str) -> String {
    clean(text).replace('$', "\\$")
}

fn theme() -> Theme {
    Theme {
        axis_color: "#8a949e".into(),
        grid_color: RULE.into(),
        tick_color: "#8a949e".into(),
        text_color: INK.into(),
        legend_bg: "#ffffff".into(),
        legend_border: "none".into(),
        ..Theme::light()
    }
}

/// A drawing that panels are put on.
pub(super) struct Sheet {
    scene: Scene,
}

impl Sheet {
    /// An empty white sheet, pixels.
    pub(super) fn new(width: f64, height: f64) -> Self {
        let mut scene = Scene::new(width, height);
        scene.font_family = Some(FONT.to_owned());
        scene.text_color = Some(INK.to_owned());
        Self { scene }
    }

    /// Puts a panel at (x, y).
    pub(super) fn place(&mut self, panel: Scene, x: f64, y: f64) {
        self.scene.defs.extend(panel.defs);
        self.scene.elements.push(Primitive::GroupStart {
            transform: Some(format!("translate({x},{y})")),
            title: None,
            extra_attrs: None,
        });
        self.scene.elements.extend(panel.elements);
        self.scene.elements.push(Primitive::GroupEnd);
    }

    /// The SVG. `name` makes ids unique in a page with several figures; `title` is read aloud.
    pub(super) fn svg(&self, name: &str, title: &str) -> String {
        let drawn = SvgBackend::new().render_scene(&self.scene);
        let body = drawn.split_once('>').map_or("", |(_, body)| body);
        let head = svg_head(self.scene.width, self.scene.height, title);
        format!("{head}{}", tidied(&renumbered(body, name)))
    }
}

/// Opening tag and title of a figure.
pub(super) fn svg_head(width: f64, height: f64, title: &str) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" \
         width=\"{width}\" height=\"{height}\" role=\"img\" font-family=\"{}\" fill=\"{INK}\">\
         <title>{}</title>",
        escape(FONT),
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
    fn axes_end_on_round_numbers() {
        let axis = Axis::around("u (us)", [1498.7, 1702.3].into_iter(), 10.0);
        assert_eq!((axis.min, axis.max, axis.step), (1450.0, 1750.0, 50.0));
        assert_eq!(decimals_of(0.25), 2);
        assert_eq!(decimals_of(50.0), 0);
    }

    #[test]
    fn nothing_and_nonsense_still_make_an_axis() {
        for values in [vec![], vec![f64::NAN], vec![f64::INFINITY, 1e300], vec![3.0, 3.0]] {
            let axis = Axis::around("x", values.into_iter(), 1.0);
            assert!(axis.max > axis.min && axis.step > 0.0, "{axis:?}");
        }
    }

    #[test]
    fn thinning_keeps_the_extremes_in_time_order() {
        let mut points: Vec<(f64, f64)> = (0..1000).map(|i| (f64::from(i), 0.0)).collect();
        points[503].1 = 9.0;
        points[507].1 = -9.0;
        let thin = thinned(&points, 50);
        assert!(thin.len() <= 100);
        assert!(thin.contains(&(503.0, 9.0)) && thin.contains(&(507.0, -9.0)));
        assert!(thin.windows(2).all(|pair| pair[0].0 <= pair[1].0));
    }

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
