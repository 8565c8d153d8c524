//! Panels with axes, drawn by `kuva`.

use std::fmt::Write as _;

use kuva::plot::legend::{LegendEntry, LegendPosition, LegendShape};
use kuva::plot::scatter::{MarkerShape, ScatterPlot};
use kuva::plot::{BandPlot, LinePlot};
use kuva::render::layout::{ComputedLayout, Layout};
use kuva::render::plots::Plot;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor, render_multiple};
use kuva::render::theme::Theme;

use super::axis::Axis;
use super::colour::{INK, RULE};
use super::format::Format;
use super::legend::{self, Corner, Inked};
use super::print_panel::{
    fitting, legend_below, legend_height, title, with_room_between, with_room_for_labels,
};
use super::shapes::Shape;
use super::sheet::FONT;
use super::text::{clean, usable};

/// Most steps of its y axis that a panel gains for its legend.
const MOST_ROOM: usize = 5;
/// Pixels right of a panel.
const RIGHT_MARGIN: f64 = 16.0;
/// Pixels right of a panel with a colour bar.
const BAR_MARGIN: f64 = 62.0;
/// Pixels left of, above and below every panel's frame.
const LEFT_MARGIN: f64 = 66.0;
const TOP_MARGIN: f64 = 30.0;
const BOTTOM_MARGIN: f64 = 46.0;
/// Size of its title, pixels.
const TITLE: u32 = 14;

/// Where the frame of a panel of a size lies in it, [x, y, width, height], pixels; `room_right`: with
/// [`Panel::leave_room_right`].
pub(super) fn frame(width: f64, height: f64, room_right: bool) -> [f64; 4] {
    let right = if room_right { BAR_MARGIN } else { RIGHT_MARGIN };
    let size = [width - LEFT_MARGIN - right, height - TOP_MARGIN - BOTTOM_MARGIN];
    [LEFT_MARGIN, TOP_MARGIN, size[0], size[1]]
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
    bars: Vec<(Vec<Mark>, String)>,
    shapes: Vec<Shape>,
    front_shapes: Vec<Shape>,
    /// Whether the axes, x and y, are logarithmic.
    log: [bool; 2],
    legend: Vec<LegendEntry>,
    legend_position: LegendPosition,
    legend_box: bool,
    inked: Inked,
    right_margin: f64,
    settled: bool,
}

impl Panel {
    /// An empty panel.
    pub(super) fn new(title: &str, x: Axis, y: Axis) -> Self {
        Self {
            title: plain(title),
            x,
            y,
            plots: Vec::new(),
            bars: Vec::new(),
            shapes: Vec::new(),
            front_shapes: Vec::new(),
            log: [false; 2],
            legend: Vec::new(),
            legend_position: LegendPosition::InsideTopLeft,
            legend_box: true,
            inked: Inked::default(),
            right_margin: RIGHT_MARGIN,
            settled: false,
        }
    }

    /// Where the legend goes, if nothing is drawn there; else it goes to another corner.
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

    /// Leaves room on the right, for a colour bar.
    pub(super) fn leave_room_right(&mut self) {
        self.right_margin = BAR_MARGIN;
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
        self.inked.line(points);
        self.plots.extend(lines(points, colour, width, dash));
    }

    /// A shaded band: (x, lower, upper).
    pub(super) fn band(&mut self, points: &[(f64, f64, f64)], colour: &str) {
        for run in points.split(|&(x, low, high)| !(usable(x) && usable(low) && usable(high))) {
            if run.len() > 1 {
                self.inked.band(run);
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
        for Mark { x, y, x_error, y_error } in &marks {
            self.inked.point(*x, *y);
            for (x_half, y_half) in [(*x_error, 0.0), (0.0, *y_error)] {
                self.inked.line(&[(x - x_half, y - y_half), (x + x_half, y + y_half)]);
            }
        }
        self.bars.push((marks, colour.to_owned()));
    }

    /// An area or strokes behind everything else, in the order given.
    pub(super) fn shape(&mut self, shape: Shape) {
        self.shapes.push(shape);
    }

    /// An area or strokes in front of everything else.
    pub(super) fn front_shape(&mut self, shape: Shape) {
        self.front_shapes.push(shape);
    }

    /// Keeps the legend off a line that a shape draws.
    pub(super) fn keep_clear(&mut self, points: &[(f64, f64)]) {
        self.inked.line(points);
    }

    /// A logarithmic x axis.
    pub(super) fn logarithmic_x(&mut self) {
        self.log[0] = true;
    }

    /// Makes both axes logarithmic: the y axis must end on powers of ten. The legend stays where it is put.
    pub(super) fn logarithmic(&mut self) {
        self.log = [true; 2];
        self.settled = true;
    }

    /// Draws the panel into a scene of this size, pixels.
    pub(super) fn draw(mut self, format: Format, [width, height]: [f64; 2]) -> Scene {
        let below = self.legend_below(format, [width, height]);
        let room = if below.is_empty() { 0.0 } else { legend_height(&below, width) };
        let legend_top = height - room;
        let height = legend_top;
        let mut title_at = (self.title.clone(), LEFT_MARGIN);
        if format.is_print() {
            let frame = width - LEFT_MARGIN - self.right_margin;
            if !self.log[0] {
                with_room_for_labels(&mut self.x, frame);
            }
            self.x.label = fitting(&self.x.label, 2.0 * (width - LEFT_MARGIN - frame / 2.0));
            self.y.label = fitting(&self.y.label, height);
            if !self.log[1] {
                with_room_between(&mut self.y, height - TOP_MARGIN - BOTTOM_MARGIN);
            }
            title_at = title(&self.title, LEFT_MARGIN, width, f64::from(TITLE));
        }
        self.settle([width, height]);
        let mut layout = Layout::new((self.x.min, self.x.max), (self.y.min, self.y.max))
            .with_width(width)
            .with_height(height)
            .with_x_label(self.x.label.clone())
            .with_y_label(self.y.label.clone())
            .with_x_axis_min(self.x.min)
            .with_x_axis_max(self.x.max)
            .with_y_axis_min(self.y.min)
            .with_y_axis_max(self.y.max)
            .with_x_tick_format(self.x.format())
            .with_force_margins(LEFT_MARGIN, self.right_margin)
            .with_force_margins_y(TOP_MARGIN, BOTTOM_MARGIN)
            .with_label_size(13)
            .with_tick_size(12)
            .with_body_size(12)
            .with_font_family(FONT)
            .with_theme(theme());
        layout =
            if self.log[0] { layout.with_log_x() } else { layout.with_x_tick_step(self.x.step) };
        layout = if self.log[1] {
            layout.with_log_y()
        } else {
            layout.with_y_tick_step(self.y.step).with_y_tick_format(self.y.format())
        };
        if !self.legend.is_empty() {
            layout = layout
                .with_legend_entries(self.legend)
                .with_legend_position(self.legend_position)
                .with_legend_box(self.legend_box);
        }
        let computed = ComputedLayout::from_layout(&layout);
        let mut scene = render_multiple(self.plots, layout);
        insert_behind(&mut scene, &computed, &self.shapes, &self.bars);
        let front = self.front_shapes.iter().filter_map(|shape| shape.path(&computed));
        scene.elements.extend(front);
        scene.elements.push(Primitive::Text {
            x: title_at.1,
            y: 17.0,
            content: title_at.0,
            size: TITLE,
            anchor: TextAnchor::Start,
            rotate: None,
            bold: true,
            color: None,
        });
        scene.elements.extend(legend_below(&below, legend_top, width));
        scene
    }

    /// The ranges of x and y that are drawn in a panel of a size, once there is room for the legend.
    pub(super) fn ranges(&mut self, size: [f64; 2]) -> [[f64; 2]; 2] {
        self.settle(size);
        [[self.x.min, self.x.max], [self.y.min, self.y.max]]
    }
}

impl Panel {
    /// The entries of a legend that is drawn below a panel in print: there is no room beside it, or no free corner in
    /// it, and axes do not grow for it there.
    fn legend_below(&mut self, format: Format, size: [f64; 2]) -> Vec<LegendEntry> {
        if !format.is_print() || self.settled || self.legend.is_empty() {
            return Vec::new();
        }
        if matches!(self.legend_position, LegendPosition::OutsideRightTop) {
            if !format.is_narrow() {
                return Vec::new();
            }
            self.right_margin = RIGHT_MARGIN;
            return std::mem::take(&mut self.legend);
        }
        match Corner::of(self.legend_position) {
            Some(wanted) if self.free_corner(wanted, size).1 > 0 => {
                std::mem::take(&mut self.legend)
            }
            _ => Vec::new(),
        }
    }

    /// The corner that has the least behind the legend, and how many points are there.
    fn free_corner(&self, wanted: Corner, [width, height]: [f64; 2]) -> (Corner, usize) {
        let labels: Vec<&str> = self.legend.iter().map(|entry| entry.label.as_str()).collect();
        let frame = [width - LEFT_MARGIN - self.right_margin, height - TOP_MARGIN - BOTTOM_MARGIN];
        let share = |value: f64, low: f64, high: f64| (value - low) / (high - low);
        let place = |[at_x, at_y]: [f64; 2]| {
            let (x, y) = (&self.x, &self.y);
            let across = if self.log[0] {
                share(at_x.ln(), x.min.ln(), x.max.ln())
            } else {
                share(at_x, x.min, x.max)
            };
            [across, 1.0 - share(at_y, y.min, y.max)]
        };
        legend::corner(&self.inked, wanted, legend::size(&labels), frame, place)
    }

    /// Moves a legend off the data: to a free corner, else with more room at the top.
    fn settle(&mut self, [width, height]: [f64; 2]) {
        if std::mem::replace(&mut self.settled, true) {
            return;
        }
        let Some(mut corner) = Corner::of(self.legend_position).filter(|_| !self.legend.is_empty())
        else {
            return;
        };
        for _ in 0..MOST_ROOM {
            let (free, covered) = self.free_corner(corner, [width, height]);
            corner = free;
            self.legend_position = corner.position();
            if covered == 0 {
                return;
            }
            self.y.max += self.y.step;
        }
    }
}

/// Lines, broken where a point cannot be drawn.
fn lines(points: &[(f64, f64)], colour: &str, width: f64, dash: &str) -> Vec<Plot> {
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

/// Shapes, then error bars, behind the plots. All bars of a colour are one path: three elements for
/// each bar would make big files.
fn insert_behind(
    scene: &mut Scene,
    computed: &ComputedLayout,
    shapes: &[Shape],
    bars: &[(Vec<Mark>, String)],
) {
    let (left, right) = (computed.map_x(computed.x_range.0), computed.map_x(computed.x_range.1));
    let (bottom, top) = (computed.map_y(computed.y_range.0), computed.map_y(computed.y_range.1));
    let mut paths: Vec<Primitive> =
        shapes.iter().filter_map(|shape| shape.path(computed)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;

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
}
