//! Figure 3: one drone's calibration: velocity and pulse width over time, and the fitted laws.

use kuva::plot::legend::{LegendPosition, LegendShape};
use kuva::plot::scatter::MarkerShape;

use crate::analysis::result::{DroneAnalysis, FlightAnalysis, WindowStats};

use crate::report::Figure;
use crate::report::axis::Axis;
use crate::report::chart::{Panel, lines, thinned};
use crate::report::colour::{FAINT, GREEN, INK, MUTED, sequential};
use super::laws::{PULSE_LABEL, VELOCITY_LABEL};
use crate::report::law;
use crate::report::sheet::Sheet;
use crate::report::text::{clean, slug, usable};

/// A trace keeps two samples of each of so many stretches.
const TRACE_BUCKETS: usize = 260;

/// Axes shared by all drones of a flight, so that they compare when one flips through them.
pub(in crate::report) struct Axes {
    time: Axis,
    velocity: Axis,
    pulse: Axis,
    height: Axis,
    law_velocity: Axis,
    law_pulse: Axis,
}

impl Axes {
    /// The axes that hold every drone of the flight.
    pub(in crate::report) fn of(flight: &FlightAnalysis) -> Self {
        let traces = || flight.drones.iter().map(|drone| &drone.trace);
        let windows = || flight.drones.iter().flat_map(|drone| drone.windows.iter());
        let marks = || windows().map(law::mark);
        let ends = windows().flat_map(|window| [window.start_s, window.end_s]);
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
                "u cos φ (µs)",
                traces()
                    .flat_map(|trace| trace.pulse_phi_us.iter().copied())
                    .chain(windows().map(|window| window.pulse_phi_us.median)),
                20.0,
            ),
            height: Axis::around(
                "height (m)",
                traces().flat_map(|trace| trace.height_m.iter().copied()),
                10.0,
            ),
            law_velocity: Axis::around(VELOCITY_LABEL, marks().map(|mark| mark.x), 1.0),
            law_pulse: Axis::around(PULSE_LABEL, marks().map(|mark| mark.y), 10.0),
        }
    }

    /// Position of a time in 0..1 of the flight, for its colour.
    fn progress(&self, time_s: f64) -> f64 {
        (time_s - self.time.min) / (self.time.max - self.time.min)
    }
}

/// Whether there is anything to draw for this drone.
pub(in crate::report) fn drawable(drone: &DroneAnalysis) -> bool {
    !drone.windows.is_empty() || drone.trace.time_s.len() > 1
}

/// The three panels of one drone; `key` names the flight in file names.
pub(in crate::report) fn figure(
    flight: &FlightAnalysis,
    key: &str,
    index: usize,
    axes: &Axes,
) -> Option<Figure> {
    let drone = flight.drones.get(index)?;
    let mut sheet = Sheet::new(1040.0, 470.0);
    sheet.place(velocity_panel(drone, axes).draw(620.0, 232.0), 0.0, 0.0);
    sheet.place(pulse_panel(drone, axes).draw(620.0, 238.0), 0.0, 232.0);
    sheet.place(law_panel(drone, axes).draw(410.0, 470.0), 630.0, 0.0);
    let name = format!("fig3-{key}-{}-{}", index + 1, slug(&drone.name));
    let title = format!("Calibration of {}", clean(&drone.name));
    Some(Figure {
        svg: sheet.svg(&name, &title),
        name,
        title,
        caption: "(a) Vertical velocity; (b) tilt-corrected pulse width (green, left) and height \
                  (dotted, right). Bars are the medians of the windows, over the time that each \
                  takes; colour is time, from early (dark) to late (light), in all panels. Windows \
                  that were rejected are grey. (d) The windows as points, error bars one standard \
                  deviation of the samples, with the signed-quadratic (solid) and the linear law \
                  (dashed). Hover windows are diamonds: they are not fitted."
            .to_owned(),
    })
}

fn velocity_panel(drone: &DroneAnalysis, axes: &Axes) -> Panel {
    let mut panel = Panel::new("(a) Vertical velocity", axes.time.clone(), axes.velocity.clone());
    let trace = trace(&drone.trace.time_s, &drone.trace.velocity_mps);
    panel.leave_room_right();
    panel.line(&trace, GREEN, 1.0, "");
    segments(&mut panel, drone, axes, |window| window.velocity_mps.median);
    panel
}

fn pulse_panel(drone: &DroneAnalysis, axes: &Axes) -> Panel {
    let mut panel = Panel::new("(b) Pulse width and height", axes.time.clone(), axes.pulse.clone());
    panel.line(&trace(&drone.trace.time_s, &drone.trace.pulse_phi_us), GREEN, 0.8, "");
    segments(&mut panel, drone, axes, |window| window.pulse_phi_us.median);
    let height = trace(&drone.trace.time_s, &drone.trace.height_m);
    panel.right_axis(axes.height.clone(), lines(&height, MUTED, 1.2, "2 3"));
    panel
}

fn law_panel(drone: &DroneAnalysis, axes: &Axes) -> Panel {
    let mut panel =
        Panel::new("(d) Fitted laws", axes.law_velocity.clone(), axes.law_pulse.clone());
    panel.legend_at(LegendPosition::InsideTopLeft);
    if let Some(laws) = &drone.laws {
        if let Some(fit) = law::signed_quadratic(laws) {
            let curve = law::signed_quadratic_curve(fit, &axes.law_velocity);
            panel.line(&curve, INK, 1.6, "");
            panel.entry("signed quadratic", INK, LegendShape::Line, "");
        }
        if let Some(fit) = &laws.linear {
            panel.line(&law::linear_curve(fit, &axes.law_velocity), MUTED, 1.6, "7 4");
            panel.entry("linear", MUTED, LegendShape::Line, "7 4");
        }
    }
    for window in &drone.windows {
        let shape = if window.kind.is_leg() { MarkerShape::Circle } else { MarkerShape::Diamond };
        panel.marks(&[law::mark(window)], &colour(window, axes), 4.0, shape);
    }
    panel
}

fn colour(window: &WindowStats, axes: &Axes) -> String {
    if window.rejected.is_empty() {
        sequential(axes.progress(f64::midpoint(window.start_s, window.end_s)))
    } else {
        FAINT.to_owned()
    }
}

fn segments(
    panel: &mut Panel,
    drone: &DroneAnalysis,
    axes: &Axes,
    level: impl Fn(&WindowStats) -> f64,
) {
    for window in &drone.windows {
        let level = level(window);
        let ends = [(window.start_s, level), (window.end_s, level)];
        panel.line(&ends, &colour(window, axes), 4.0, "");
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
