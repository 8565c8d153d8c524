//! Figure 3: one drone's calibration: velocity and adjusted pulse width over time, the offset over
//! time and height, and the mapping.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use super::laws::VELOCITY_LABEL;
use super::plan_view::narrow_bar;
use crate::analysis::law::LawKind;
use crate::analysis::offset::OffsetMap;
use crate::analysis::result::{DroneAnalysis, FlightAnalysis, WindowStats};
use crate::numeric::upper_median;
use crate::report::Figure;
use crate::report::axis::{Axis, decimals_of, nice_step};
use crate::report::chart::{Panel, frame, thinned};
use crate::report::colour::{FAINT, GREEN, INK, MUTED, diverging, sequential};
use crate::report::format::Format;
use crate::report::law;
use crate::report::offset_field::OffsetScale;
use crate::report::raster::image;
use crate::report::shapes::Shape;
use crate::report::sheet::Sheet;
use crate::report::svg::{Anchor, Drawing, TextStyle};
use crate::report::text::{clean, effort_label, fixed, signed, slug, unit, usable};

/// A trace keeps two samples of each of so many stretches.
const TRACE_BUCKETS: usize = 200;
/// Sizes of the panels, pixels: (a) and (b), (c), (d).
const TRACES: [f64; 2] = [620.0, 206.0];
const OFFSET: [f64; 2] = [620.0, 216.0];
const LAW: [f64; 2] = [412.0, 560.0];
/// Where (c) starts and (d) stands.
const OFFSET_TOP: f64 = 2.0 * TRACES[1];
const LAW_LEFT: f64 = 628.0;
/// Heights of (a) and (b), (c) and (d) below each other in one column of print, and of what is below (d).
const NARROW: [f64; 3] = [186.0, 198.0, 290.0];
const BELOW_LAW: f64 = 52.0;
/// Picture elements of the offset.
const ELEMENTS: (usize, usize) = (164, 46);

/// Axes and scales shared by all drones of a flight, so that they compare when one flips through
/// them.
pub(in crate::report) struct Axes {
    time: Axis,
    velocity: Axis,
    pulse: Axis,
    height: Axis,
    law_velocity: Axis,
    law_pulse: Axis,
    /// End of the scale of velocities, m/s.
    velocity_limit: f64,
    /// Middle and half width of the scale of pulses, us.
    pulse_scale: (f64, f64),
    offset: Option<OffsetScale>,
}

impl Axes {
    /// The axes that hold every drone of the flight.
    pub(in crate::report) fn of(flight: &FlightAnalysis) -> Self {
        let traces = || flight.drones.iter().map(|drone| &drone.trace);
        let windows = || flight.drones.iter().flat_map(|drone| drone.windows.iter());
        let marks = || windows().map(law::mark);
        let ends = windows().flat_map(|window| [window.start_s, window.end_s]);
        let end = |sizes: &mut dyn Iterator<Item = f64>, least: f64| {
            let largest = sizes.filter(|v| usable(*v)).map(f64::abs).fold(least, f64::max);
            let step = nice_step(largest / 4.0);
            (largest / step).ceil() * step
        };
        let velocity_limit = end(&mut windows().map(|window| window.velocity_mps.median), 0.5);
        // Centred on hover, where the windows of vertical motion lie on both sides.
        let pulses: Vec<f64> =
            windows().filter(|w| w.kind.is_hover()).map(adjusted).filter(|u| usable(*u)).collect();
        let middle = upper_median(pulses)
            .or_else(|| upper_median(windows().map(adjusted).filter(|u| usable(*u)).collect()))
            .unwrap_or(1500.0);
        let pulse_limit = end(&mut windows().map(|window| adjusted(window) - middle), 5.0);
        Self {
            time: Axis::time(traces().flat_map(|trace| trace.time_s.iter().copied()).chain(ends)),
            velocity: Axis::around(
                "velocity (m/s)",
                traces()
                    .flat_map(|trace| trace.velocity_mps.iter().copied())
                    .chain(windows().map(|window| window.velocity_mps.median)),
                1.0,
            ),
            pulse: Axis::around(
                &format!("u* ({})", unit(flight.indicator.unit())),
                // Around the windows: take-off and landing would squeeze them into a line.
                [middle - 1.5 * pulse_limit, middle + 1.5 * pulse_limit].into_iter(),
                20.0,
            ),
            height: Axis::heights(traces().flat_map(|trace| trace.height_m.iter().copied())),
            law_velocity: Axis::around(
                VELOCITY_LABEL,
                marks().flat_map(|mark| [mark.x - mark.x_error, mark.x + mark.x_error]),
                1.0,
            ),
            law_pulse: Axis::around(
                &effort_label(flight.indicator),
                marks().flat_map(|mark| [mark.y - mark.y_error, mark.y + mark.y_error]),
                10.0,
            ),
            velocity_limit,
            pulse_scale: (middle, pulse_limit),
            offset: OffsetScale::of(flight),
        }
    }

    /// Position of a time in 0..1 of the flight, for its colour.
    fn progress(&self, time_s: f64) -> f64 {
        (time_s - self.time.min) / (self.time.max - self.time.min)
    }
}

/// The window's pulse without the slow offset, us.
fn adjusted(window: &WindowStats) -> f64 {
    window.effort_phi.median - window.offset_us.unwrap_or(0.0)
}

/// Whether there is anything to draw for this drone.
pub(in crate::report) fn drawable(drone: &DroneAnalysis) -> bool {
    !drone.windows.is_empty() || drone.trace.time_s.len() > 1
}

/// The name of the drone's figure; `key` names the flight in file names.
pub(in crate::report) fn name(key: &str, index: usize, drone: &DroneAnalysis) -> String {
    format!("fig3-{key}-{}-{}", index + 1, slug(&drone.name))
}

/// Where the panels lie, [x, y, width, height], and the size of the sheet.
struct Places {
    size: [f64; 2],
    velocity: [f64; 4],
    pulse: [f64; 4],
    offset: [f64; 4],
    law: [f64; 4],
}

impl Places {
    fn of(format: Format) -> Self {
        let wide = format.width();
        if format.is_narrow() {
            let [trace, offset, law] = NARROW;
            let tops = [2.0 * trace, 2.0 * trace + offset];
            return Self {
                size: [wide, tops[1] + law + BELOW_LAW],
                velocity: [0.0, 0.0, wide, trace],
                pulse: [0.0, trace, wide, trace],
                offset: [0.0, tops[0], wide, offset],
                law: [0.0, tops[1], wide, law],
            };
        }
        let (left, law_left) = (format.across(TRACES[0]), format.across(LAW_LEFT));
        Self {
            size: [wide, OFFSET_TOP + OFFSET[1]],
            velocity: [0.0, 0.0, left, TRACES[1]],
            pulse: [0.0, TRACES[1], left, TRACES[1]],
            offset: [0.0, OFFSET_TOP, left, OFFSET[1]],
            law: [law_left, 0.0, format.across(LAW[0]), LAW[1]],
        }
    }
}

/// The frame of a panel in the sheet.
fn frame_in([x, y, width, height]: [f64; 4], room_right: bool) -> [f64; 4] {
    let [left, top, w, h] = frame(width, height, room_right);
    [x + left, y + top, w, h]
}

/// The four panels of one drone.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    index: usize,
    axes: &Axes,
    format: Format,
) -> Option<Figure> {
    let drone = flight.drones.get(index)?;
    let offset = drone.offset.as_ref();
    let places = Places::of(format);
    let mut sheet = Sheet::new(format, places.size);
    sheet.place(velocity_panel(drone, axes), places.velocity);
    sheet.place(pulse_panel(drone, axes, offset), places.pulse);
    sheet.place(height_panel(axes, offset), places.offset);
    sheet.place(law_panel(drone, axes), places.law);
    let mut over = Drawing::overlay(format);
    flight_path(&mut over, drone, axes, offset, places.offset);
    bars(&mut over, axes, offset.is_some(), &places);
    sheet.lay_over(over);
    let name = name(key, index, drone);
    let title = format!("Calibration of {} (paper's Fig. 3)", clean(&drone.name));
    let offset_words = if offset.is_some() {
        "(c) The slow offset that is subtracted, over time and height, from the hovers (circles); \
         hatched: not between hovers, the nearest hover's stands in; the line is the flight."
    } else {
        "(c) The flight; no offset was subtracted."
    };
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: format!(
            "(a) Vertical velocity and (b) tilt-corrected \
             rotor effort without the offset, u* (green). Bars are the windows, over the time that each takes, \
             coloured by value; windows that were rejected are grey. {offset_words} (d) The windows \
             as points, coloured by time, error bars one standard deviation of the samples, with \
             the linear law (solid) and the signed-quadratic law (dashed). Hovers are diamonds: \
             they are not fitted. All drones of a flight share axes and colours."
        ),
    })
}

fn velocity_panel(drone: &DroneAnalysis, axes: &Axes) -> Panel {
    let mut panel = Panel::new("(a) Vertical velocity", axes.time.clone(), axes.velocity.clone());
    panel.leave_room_right();
    panel.line(&trace(&drone.trace.time_s, &drone.trace.velocity_mps), GREEN, 1.0, "");
    let colour = |v: f64| diverging(v / axes.velocity_limit);
    segments(&mut panel, drone, |window| window.velocity_mps.median, colour);
    panel
}

fn pulse_panel(drone: &DroneAnalysis, axes: &Axes, offset: Option<&OffsetMap>) -> Panel {
    let mut panel =
        Panel::new("(b) Adjusted rotor effort u*", axes.time.clone(), axes.pulse.clone());
    panel.leave_room_right();
    let surface = offset.map(OffsetMap::surface);
    let values: Vec<f64> = drone
        .trace
        .pulse_phi_us
        .iter()
        .enumerate()
        .map(|(i, pulse)| {
            let place = drone.trace.time_s.get(i).zip(drone.trace.height_m.get(i));
            let offset = surface.as_ref().zip(place).and_then(|(s, (t, h))| s.at(*t, *h));
            pulse - offset.map_or(0.0, |offset| offset.us)
        })
        .collect();
    panel.line(&trace(&drone.trace.time_s, &values), GREEN, 0.8, "");
    let (middle, half) = axes.pulse_scale;
    segments(&mut panel, drone, adjusted, |u: f64| diverging((u - middle) / half));
    panel
}

/// Axes only: picture and path are laid over.
fn height_panel(axes: &Axes, offset: Option<&OffsetMap>) -> Panel {
    let title =
        if offset.is_some() { "(c) Offset over time and height" } else { "(c) Height over time" };
    let mut panel = Panel::new(title, axes.time.clone(), axes.height.clone());
    panel.leave_room_right();
    // A panel without a plot has no ticks.
    let bottom = axes.height.min;
    panel.line(&[(axes.time.min, bottom), (axes.time.max, bottom)], FAINT, 0.5, "");
    panel
}

/// The picture of the offset, the hovers it was made from, and the flight through it.
fn flight_path(
    over: &mut Drawing,
    drone: &DroneAnalysis,
    axes: &Axes,
    offset: Option<&OffsetMap>,
    place: [f64; 4],
) {
    let [x, y, w, h] = frame_in(place, true);
    let (time, height) = (&axes.time, &axes.height);
    let pixel = |(t, z): (f64, f64)| {
        (
            x + w * ((t - time.min) / (time.max - time.min)).clamp(0.0, 1.0),
            y + h * (1.0 - (z - height.min) / (height.max - height.min)).clamp(0.0, 1.0),
        )
    };
    let picture = offset.zip(axes.offset.as_ref());
    if let Some((map, scale)) = picture {
        let scale = OffsetScale { time: time.clone(), height: height.clone(), ..*scale };
        let pixels = scale.pixels(map, ELEMENTS.0, ELEMENTS.1);
        over.raw(&image(&pixels, ELEMENTS, [x, y, w, h], false));
    }
    let path = trace(&drone.trace.time_s, &drone.trace.height_m);
    let path: Vec<(f64, f64)> = path.into_iter().map(pixel).collect();
    if path.len() > 1 {
        over.polyline(&path, if offset.is_some() { INK } else { GREEN }, "stroke-width=\"0.9\"");
    }
    if let Some((map, scale)) = picture {
        for point in map.points.iter().filter(|p| usable(p.time_s) && usable(p.height_m)) {
            let (px, py) = pixel((point.time_s, point.height_m));
            over.disc([px, py], 4.0, &diverging(point.offset_us / scale.limit_us), INK);
        }
    }
}

/// Colour bars beside the panels.
fn bars(over: &mut Drawing, axes: &Axes, with_offset: bool, places: &Places) {
    let symmetric = |limit: f64| {
        let text = |v: f64| signed(v, decimals_of(limit));
        vec![(0.0, text(-limit)), (0.5, text(0.0)), (1.0, text(limit))]
    };
    let beside = |place: [f64; 4]| {
        let [x, y, w, h] = frame_in(place, true);
        [x + w + 8.0, y, 9.0, h]
    };
    let two_sided = |place: f64| diverging(2.0 * place - 1.0);
    narrow_bar(over, beside(places.velocity), two_sided, &symmetric(axes.velocity_limit));
    let (middle, half) = axes.pulse_scale;
    let ticks = [(0.0, middle - half), (0.5, middle), (1.0, middle + half)];
    let ticks = ticks.map(|(place, value)| (place, fixed(value, 0)));
    narrow_bar(over, beside(places.pulse), two_sided, &ticks);
    if let (Some(scale), true) = (&axes.offset, with_offset) {
        narrow_bar(over, beside(places.offset), two_sided, &symmetric(scale.limit_us));
    }
    // The colours of (d), below it.
    let [left, _, w, _] = frame_in(places.law, false);
    let top = places.law[1] + places.law[3] + over.format().choose(22.0, 10.0);
    for step in 0..60 {
        let place = f64::from(step) / 60.0;
        let slice = [left + place * w, top, w / 60.0 + 0.4, 10.0];
        over.rect(slice, &sequential(place), "");
    }
    let style = |anchor| TextStyle { size: 12.0, bold: false, colour: INK, anchor };
    let from = fixed(axes.time.min, 0);
    over.text([left, top + 25.0], &from, style(Anchor::Start), 0.0);
    over.text([left + w, top + 25.0], &fixed(axes.time.max, 0), style(Anchor::End), 0.0);
    let words = "time of the window (s)";
    over.text([left + w / 2.0, top + 25.0], words, style(Anchor::Middle), 0.0);
}

fn law_panel(drone: &DroneAnalysis, axes: &Axes) -> Panel {
    let mut panel = Panel::new("(d) Mapping", axes.law_velocity.clone(), axes.law_pulse.clone());
    panel.legend_at(LegendPosition::InsideTopLeft);
    if let Some(laws) = &drone.laws {
        if let Some(fit) = &laws.linear {
            panel.line(&law::linear_curve(fit, &axes.law_velocity), INK, 1.6, "");
            panel.entry(LawKind::Linear.name(), INK, LegendShape::Line, "");
        }
        if let Some(fit) = law::signed_quadratic(laws) {
            let curve = law::signed_quadratic_curve(fit, &axes.law_velocity);
            panel.line(&curve, MUTED, 1.6, "7 4");
            panel.entry(LawKind::SignedQuadratic.name(), MUTED, LegendShape::Line, "7 4");
        }
    }
    for window in &drone.windows {
        let shape = if window.kind.is_leg() { MarkerShape::Circle } else { MarkerShape::Diamond };
        let colour = if window.rejected.is_empty() {
            sequential(axes.progress(f64::midpoint(window.start_s, window.end_s)))
        } else {
            FAINT.to_owned()
        };
        panel.marks(&[law::mark(window)], &colour, 4.0, shape);
    }
    panel
}

/// Windows as bars over their time, outlined: the middle of the scale is white.
fn segments(
    panel: &mut Panel,
    drone: &DroneAnalysis,
    level: impl Fn(&WindowStats) -> f64,
    colour: impl Fn(f64) -> String,
) {
    let bar = |window: &WindowStats| {
        let level = level(window);
        [(window.start_s, level), (window.end_s, level)]
    };
    panel.front_shape(Shape::Strokes {
        lines: drone.windows.iter().map(bar).collect(),
        colour: INK.to_owned(),
        width: 6.0,
        dash: "",
    });
    for window in &drone.windows {
        let colour =
            if window.rejected.is_empty() { colour(level(window)) } else { FAINT.to_owned() };
        let lines = vec![bar(window)];
        panel.front_shape(Shape::Strokes { lines, colour, width: 4.0, dash: "" });
    }
}

fn trace(time_s: &[f64], value: &[f64]) -> Vec<(f64, f64)> {
    let points: Vec<(f64, f64)> = time_s
        .iter()
        .copied()
        .zip(value.iter().copied())
        .filter(|&(time, value)| usable(time) && usable(value))
        .collect();
    thinned(&points, TRACE_BUCKETS)
}
