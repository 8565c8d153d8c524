//! Expansion of a template's steps into the segments of a timetable.

use std::ops::Range;

use nalgebra::Vector3;
use toml::Spanned;

use super::error::TemplateError;
use super::plan::{Purpose, Segment, SegmentKind};
use super::source::Source;
use super::template::{Direction, StepKind, StepTemplate, WindowTemplate, span_of};
use super::window::WindowRule;

/// Most segments in one flight: far above any sensible show, far below what exhausts memory.
const MAX_SEGMENTS: usize = 20_000;
/// Longest segment or wait, s.
const MAX_DURATION_S: f64 = 36_000.0;
/// Shortest segment that can be written, s (file times are whole milliseconds).
const MIN_DURATION_S: f64 = 0.001;
/// Highest speed the grammar takes, m/s; vehicles' own limits are checked later.
const MAX_SPEED_MPS: f64 = 50.0;
/// Highest altitude the grammar takes, m: what the `.skyb` format can carry.
const MAX_ALTITUDE_M: f64 = 4_000.0;

/// Builds one timetable: take-off, the template's steps, landing.
pub(super) struct Timeline<'a> {
    source: &'a Source<'a>,
    ramp_mps2: f64,
    window: WindowRule,
    offset: Offset,
    at_ms: u64,
    position_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    segments: Vec<Segment>,
}

/// How much later a group flies than the template says, and the latest group.
#[derive(Clone, Copy, Default)]
pub(super) struct Offset {
    pub(super) own_ms: u64,
    pub(super) largest_ms: u64,
}

/// What a repeat gives to its steps in one pass.
#[derive(Clone, Copy, Default)]
struct Inherited {
    speed_mps: Option<f64>,
    height_m: Option<f64>,
}

/// Converts seconds to whole milliseconds.
fn to_ms(seconds: f64) -> u64 {
    (seconds * 1000.0).round() as u64
}

fn to_s(ms: u64) -> f64 {
    ms as f64 / 1000.0
}

/// Reads the template's window rule.
fn window_rule(source: &Source<'_>, window: &WindowTemplate) -> Result<WindowRule, TemplateError> {
    let seconds = |value, what| source.in_range(value, what, "s", 0.0..=MAX_DURATION_S);
    let length_s = seconds(&window.length_s, "window length")?;
    let trim_s = seconds(&window.trim_s, "window trim")?;
    let settle_s = seconds(&window.settle_s, "settling time")?;
    if trim_s >= length_s {
        return Err(source
            .error(span_of(&window.trim_s), "window trim must be shorter than its length")
            .with_help(format!("the window is {length_s} s long before trimming")));
    }
    Ok(WindowRule {
        length_ms: to_ms(length_s),
        trim_ms: to_ms(trim_s),
        settle_ms: to_ms(settle_s),
    })
}

/// Rounds away the last digits that binary fractions leave, so that files read as written.
fn tidy(vector: Vector3<f64>) -> [f64; 3] {
    [vector.x, vector.y, vector.z].map(|value| {
        let rounded = (value * 1e9).round() / 1e9;
        if rounded == 0.0 { 0.0 } else { rounded }
    })
}

impl<'a> Timeline<'a> {
    /// Expands a template's steps for a group.
    ///
    /// The group's offset is spent where the template has a `stagger` step, else on the ground.
    pub(super) fn expand(
        source: &'a Source<'a>,
        offset: Offset,
    ) -> Result<Vec<Segment>, TemplateError> {
        let template = source.template;
        let mut timeline = Self {
            source,
            ramp_mps2: source.in_range(
                &template.motion.ramp_mps2,
                "ramp acceleration",
                "m/s²",
                0.0..=50.0,
            )?,
            window: window_rule(source, &template.window)?,
            offset,
            at_ms: 0,
            position_m: Vector3::zeros(),
            velocity_mps: Vector3::zeros(),
            segments: Vec::new(),
        };
        let staggered =
            template.steps.iter().any(|step| *step.get_ref().kind.get_ref() == StepKind::Stagger);
        if offset.own_ms > 0 && !staggered {
            timeline.constant(SegmentKind::Wait, "wait", Vector3::zeros(), offset.own_ms, None)?;
        }
        let takeoff = &template.takeoff;
        let altitude_m =
            source.in_range(&takeoff.altitude_m, "take-off altitude", "m", 2.5..=MAX_ALTITUDE_M)?;
        let speed =
            source.in_range(&takeoff.speed_mps, "take-off speed", "m/s", 0.1..=MAX_SPEED_MPS)?;
        timeline.vertical_to(
            SegmentKind::Takeoff,
            altitude_m,
            speed,
            span_of(&takeoff.altitude_m),
        )?;
        let (before, behind) = template.steps.split_at(timeline.steps_before_legs());
        timeline.steps(before, Inherited::default(), 0)?;
        timeline.legs()?;
        timeline.steps(behind, Inherited::default(), 0)?;
        timeline.land()?;
        Ok(timeline.segments)
    }

    fn steps(
        &mut self,
        steps: &[Spanned<StepTemplate>],
        inherited: Inherited,
        depth: usize,
    ) -> Result<(), TemplateError> {
        if depth > 8 {
            let span = steps.first().and_then(span_of);
            return Err(self.source.error(span, "repeats are nested deeper than 8"));
        }
        for step in steps {
            self.step(step, inherited, depth)?;
        }
        Ok(())
    }

    fn step(
        &mut self,
        spanned: &Spanned<StepTemplate>,
        inherited: Inherited,
        depth: usize,
    ) -> Result<(), TemplateError> {
        let step = spanned.get_ref();
        let span = span_of(&step.kind);
        self.refuse_stray_keys(step)?;
        match step.kind.get_ref() {
            StepKind::Climb => {
                let to_m = match (&step.to_m, inherited.height_m) {
                    (None, Some(height_m)) => height_m,
                    (to_m, _) => {
                        let to_m = self.required(to_m.as_ref(), "to_m", step)?;
                        self.source.number(to_m, "height", "m", 0.0..=MAX_ALTITUDE_M)?
                    }
                };
                let speed = self.speed(step, inherited.speed_mps)?;
                let kind = if to_m >= self.position_m.z {
                    SegmentKind::Climb
                } else {
                    SegmentKind::Descend
                };
                self.vertical_to(kind, to_m, speed, span)
            }
            StepKind::Leg => {
                let duration_ms = self.duration(step)?;
                let speed = self.speed(step, inherited.speed_mps)?;
                let direction =
                    *self.required(step.direction.as_ref(), "direction", step)?.get_ref();
                let (kind, word, sign) = match direction {
                    Direction::Up => (SegmentKind::LegUp, "up", 1.0),
                    Direction::Down => (SegmentKind::LegDown, "down", -1.0),
                };
                let velocity = Vector3::new(0.0, 0.0, sign * speed);
                self.timed(kind, &format!("{word} {speed} m/s"), velocity, duration_ms, span)
            }
            StepKind::Hover => {
                let duration_ms = self.duration(step)?;
                let label = format!("hover at {} m", self.rest_height_m());
                self.timed(SegmentKind::Hover, &label, Vector3::zeros(), duration_ms, span)
            }
            StepKind::Horizontal => {
                let duration_ms = self.duration(step)?;
                let speed = self.speed(step, inherited.speed_mps)?;
                let heading = self.required(step.heading_deg.as_ref(), "heading_deg", step)?;
                let heading_deg = self.source.number(heading, "heading", "deg", -360.0..=360.0)?;
                self.horizontal(heading_deg, speed, duration_ms, span)
            }
            StepKind::Repeat => self.repeat(step, inherited, depth),
            StepKind::Stagger => self.wait_in_air(self.offset.own_ms),
            StepKind::Rejoin => {
                self.wait_in_air(self.offset.largest_ms.saturating_sub(self.offset.own_ms))
            }
        }
    }

    fn horizontal(
        &mut self,
        heading_deg: f64,
        speed_mps: f64,
        duration_ms: u64,
        span: Option<Range<usize>>,
    ) -> Result<(), TemplateError> {
        // Clockwise from x seen from above; y points to the left.
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let velocity = Vector3::new(cos * speed_mps, -sin * speed_mps, 0.0);
        let label = format!("{speed_mps} m/s towards {heading_deg}°");
        self.timed(SegmentKind::Horizontal, &label, velocity, duration_ms, span)
    }

    /// Steps before the legs that calibrate what wind does: all of a calibration; of a measurement those up to its
    /// last hover, whose height and wind the legs are flown in.
    fn steps_before_legs(&self) -> usize {
        let steps = &self.source.template.steps;
        let is_hover =
            |step: &Spanned<StepTemplate>| *step.get_ref().kind.get_ref() == StepKind::Hover;
        let last_hover = steps.iter().rposition(is_hover);
        last_hover
            .filter(|_| self.source.template.purpose == Purpose::Measurement)
            .map_or(steps.len(), |last| last + 1)
    }

    /// The horizontal legs that calibrate what wind does.
    fn legs(&mut self) -> Result<(), TemplateError> {
        let source = self.source;
        let Some(spanned) = &source.template.legs else { return Ok(()) };
        let (legs, span) = (spanned.get_ref(), span_of(spanned));
        let first = self.segments.len();
        let usual_window = self.window;
        if source.template.purpose == Purpose::Measurement {
            // A hover waits for the end of its climb, and a scan uses its legs whole.
            self.window = WindowRule::default();
        }
        let speeds_mps =
            source.numbers(&legs.speeds_mps, "speed", "m/s", &(0.01..=MAX_SPEED_MPS))?;
        let headings_deg =
            source.numbers(&legs.headings_deg, "heading", "deg", &(-360.0..=360.0))?;
        let seconds =
            |value, what| source.number(value, what, "s", MIN_DURATION_S..=MAX_DURATION_S);
        let leg_ms = to_ms(seconds(&legs.duration_s, "duration of a leg")?);
        let hover_ms = to_ms(seconds(&legs.hover_s, "duration of a hover")?);
        let ramp_mps2 =
            source.in_range(&legs.ramp_mps2, "ramp acceleration", "m/s²", 0.0..=50.0)?;
        let usual_mps2 = self.ramp_mps2;
        if usual_mps2 == 0.0 {
            self.ramp_mps2 = ramp_mps2;
        }
        let label = format!("hover at {} m", self.rest_height_m());
        self.timed(SegmentKind::Hover, &label, Vector3::zeros(), hover_ms, span.clone())?;
        for speed_mps in speeds_mps {
            for heading_deg in &headings_deg {
                self.horizontal(*heading_deg, speed_mps, leg_ms, span.clone())?;
                self.timed(SegmentKind::Hover, &label, Vector3::zeros(), hover_ms, span.clone())?;
            }
        }
        (self.ramp_mps2, self.window) = (usual_mps2, usual_window);
        self.segments.iter_mut().skip(first).for_each(|segment| segment.calibrates_wind = true);
        Ok(())
    }

    fn wait_in_air(&mut self, duration_ms: u64) -> Result<(), TemplateError> {
        if duration_ms == 0 {
            return Ok(());
        }
        let label = format!("wait at {} m", self.rest_height_m());
        self.timed(SegmentKind::Hover, &label, Vector3::zeros(), duration_ms, None)
    }

    fn repeat(
        &mut self,
        step: &StepTemplate,
        inherited: Inherited,
        depth: usize,
    ) -> Result<(), TemplateError> {
        let inner = step.steps.as_deref().unwrap_or_default();
        if inner.is_empty() {
            return Err(self
                .source
                .error(span_of(&step.kind), "a repeat needs steps to repeat")
                .with_help("add [[steps.steps]] tables below it"));
        }
        match (&step.speeds_mps, &step.heights_m, &step.times) {
            (Some(speeds), None, None) => {
                let range = 0.01..=MAX_SPEED_MPS;
                for speed in self.source.numbers(speeds, "speed", "m/s", &range)? {
                    let pass = Inherited { speed_mps: Some(speed), ..inherited };
                    self.steps(inner, pass, depth + 1)?;
                }
                Ok(())
            }
            (None, Some(heights), None) => {
                let range = 0.0..=MAX_ALTITUDE_M;
                for height_m in self.source.numbers(heights, "height", "m", &range)? {
                    let pass = Inherited { height_m: Some(height_m), ..inherited };
                    self.steps(inner, pass, depth + 1)?;
                }
                Ok(())
            }
            (None, None, Some(times)) => {
                let times = self.source.number(times, "number of passes", "", 1.0..=1000.0)?;
                for _ in 0..times.round() as usize {
                    self.steps(inner, inherited, depth + 1)?;
                }
                Ok(())
            }
            _ => Err(self.source.error(
                span_of(&step.kind),
                "a repeat needs one of `speeds_mps`, `heights_m` and `times`",
            )),
        }
    }

    /// Each kind of step has its own keys; another one's key is a mistake, not a default.
    fn refuse_stray_keys(&self, step: &StepTemplate) -> Result<(), TemplateError> {
        let kind = *step.kind.get_ref();
        let keys: [(&str, bool, Option<Range<usize>>); 9] = [
            ("to_m", step.to_m.is_some(), step.to_m.as_ref().and_then(span_of)),
            ("speed_mps", step.speed_mps.is_some(), step.speed_mps.as_ref().and_then(span_of)),
            ("duration_s", step.duration_s.is_some(), step.duration_s.as_ref().and_then(span_of)),
            ("direction", step.direction.is_some(), step.direction.as_ref().and_then(span_of)),
            (
                "heading_deg",
                step.heading_deg.is_some(),
                step.heading_deg.as_ref().and_then(span_of),
            ),
            ("speeds_mps", step.speeds_mps.is_some(), step.speeds_mps.as_ref().and_then(span_of)),
            ("heights_m", step.heights_m.is_some(), step.heights_m.as_ref().and_then(span_of)),
            ("times", step.times.is_some(), step.times.as_ref().and_then(span_of)),
            ("steps", step.steps.is_some(), span_of(&step.kind)),
        ];
        let allowed: &[&str] = allowed_keys(kind);
        for (key, present, span) in keys {
            if present && !allowed.contains(&key) {
                let list: Vec<_> = allowed.iter().map(|key| format!("`{key}`")).collect();
                return Err(self
                    .source
                    .error(span, format!("a {} step has no `{key}`", kind_name(kind)))
                    .with_help(if list.is_empty() {
                        "it takes no keys".to_owned()
                    } else {
                        format!("it takes {}", list.join(", "))
                    }));
            }
        }
        Ok(())
    }

    fn required<'b, T>(
        &self,
        value: Option<&'b Spanned<T>>,
        key: &str,
        step: &StepTemplate,
    ) -> Result<&'b Spanned<T>, TemplateError> {
        value.ok_or_else(|| {
            let kind = kind_name(*step.kind.get_ref());
            self.source.error(span_of(&step.kind), format!("this {kind} step needs `{key}`"))
        })
    }

    fn duration(&self, step: &StepTemplate) -> Result<u64, TemplateError> {
        let value = self.required(step.duration_s.as_ref(), "duration_s", step)?;
        let range = MIN_DURATION_S..=MAX_DURATION_S;
        Ok(to_ms(self.source.number(value, "duration", "s", range)?))
    }

    fn speed(&self, step: &StepTemplate, inherited: Option<f64>) -> Result<f64, TemplateError> {
        match (&step.speed_mps, inherited) {
            (Some(value), _) => self.source.number(value, "speed", "m/s", 0.01..=MAX_SPEED_MPS),
            (None, Some(speed)) => Ok(speed),
            (None, None) => Err(self
                .source
                .error(span_of(&step.kind), "this step needs `speed_mps`")
                .with_help("it may be omitted only inside a repeat over `speeds_mps`")),
        }
    }

    /// How long the ramp to a new velocity takes, ms (0 for steps).
    fn ramp_ms(&self, velocity_mps: Vector3<f64>) -> u64 {
        let change = (velocity_mps - self.velocity_mps).norm();
        if self.ramp_mps2 > 0.0 && change > 0.0 {
            (change / self.ramp_mps2 * 1000.0).ceil() as u64
        } else {
            0
        }
    }

    /// Where a hover that begins now stands, after the ramp that leads to it, m, to a decimetre.
    fn rest_height_m(&self) -> f64 {
        let ramp_s = to_s(self.ramp_ms(Vector3::zeros()));
        ((self.position_m.z + self.velocity_mps.z * ramp_s / 2.0) * 10.0).round() / 10.0
    }

    fn ramp(&mut self, velocity_mps: Vector3<f64>) -> Result<(), TemplateError> {
        let duration_ms = self.ramp_ms(velocity_mps);
        if duration_ms > 0 {
            let displacement = (self.velocity_mps + velocity_mps) * (to_s(duration_ms) / 2.0);
            let from = self.velocity_mps;
            self.push(
                SegmentKind::Ramp,
                "ramp",
                displacement,
                velocity_mps,
                Some(from),
                duration_ms,
            )?;
        }
        self.velocity_mps = velocity_mps;
        Ok(())
    }

    /// A segment of given duration; its ramp, if any, comes first and is part of the duration.
    fn timed(
        &mut self,
        kind: SegmentKind,
        label: &str,
        velocity_mps: Vector3<f64>,
        duration_ms: u64,
        span: Option<Range<usize>>,
    ) -> Result<(), TemplateError> {
        let ramp_ms = self.ramp_ms(velocity_mps);
        if ramp_ms >= duration_ms {
            return Err(self
                .source
                .error(
                    span,
                    format!(
                        "the ramp to this velocity takes {} s, the whole step only {} s",
                        to_s(ramp_ms),
                        to_s(duration_ms)
                    ),
                )
                .with_help("make the step longer or the ramp acceleration larger"));
        }
        self.ramp(velocity_mps)?;
        self.constant(kind, label, velocity_mps, duration_ms - ramp_ms, span)
    }

    fn constant(
        &mut self,
        kind: SegmentKind,
        label: &str,
        velocity_mps: Vector3<f64>,
        duration_ms: u64,
        span: Option<Range<usize>>,
    ) -> Result<(), TemplateError> {
        let displacement = velocity_mps * to_s(duration_ms);
        self.push(kind, label, displacement, velocity_mps, None, duration_ms)?;
        self.velocity_mps = velocity_mps;
        if self.position_m.z < -1e-6 {
            return Err(self
                .source
                .error(span, format!("\"{label}\" ends {:.2} m below ground", -self.position_m.z))
                .with_help("start higher, or make this leg slower or shorter"));
        }
        Ok(())
    }

    /// A vertical transfer that ends at rest exactly at a height.
    fn vertical_to(
        &mut self,
        kind: SegmentKind,
        to_m: f64,
        speed_mps: f64,
        span: Option<Range<usize>>,
    ) -> Result<(), TemplateError> {
        let distance_m = to_m - self.position_m.z;
        if distance_m.abs() < 1e-6 {
            return self.ramp(Vector3::zeros());
        }
        let label = match kind {
            SegmentKind::Takeoff => format!("take off to {to_m} m"),
            SegmentKind::Landing => format!("descend to {to_m} m and land"),
            SegmentKind::Descend => format!("descend to {to_m} m"),
            _ => format!("climb to {to_m} m"),
        };
        let nominal = Vector3::new(0.0, 0.0, distance_m.signum() * speed_mps);
        let before = self.velocity_mps;
        let start_ramp_s = to_s(self.ramp_ms(nominal));
        // A landing is handed over to the autopilot in motion; everything else stops at its height.
        let stop_ramp_s = if self.ramp_mps2 > 0.0 && kind != SegmentKind::Landing {
            to_s((speed_mps / self.ramp_mps2 * 1000.0).ceil() as u64)
        } else {
            0.0
        };
        let ramps_m =
            f64::midpoint(before.z, nominal.z) * start_ramp_s + nominal.z / 2.0 * stop_ramp_s;
        let cruise_s = (distance_m - ramps_m) / nominal.z;
        let cruise_ms = to_ms(cruise_s.max(0.0));
        if cruise_s <= 0.0 || cruise_ms == 0 {
            return Err(self
                .source
                .error(span, format!("{:.2} m are too short for {speed_mps} m/s", distance_m.abs()))
                .with_help("take a lower speed or a larger ramp acceleration"));
        }
        // Whole milliseconds change the speed a little, so that the height is met exactly.
        let exact_mps = (distance_m - before.z / 2.0 * start_ramp_s)
            / (to_s(cruise_ms) + f64::midpoint(start_ramp_s, stop_ramp_s));
        let velocity = Vector3::new(0.0, 0.0, exact_mps);
        if start_ramp_s > 0.0 {
            let displacement = (before + velocity) * (start_ramp_s / 2.0);
            let ramp_ms = to_ms(start_ramp_s);
            self.push(SegmentKind::Ramp, "ramp", displacement, velocity, Some(before), ramp_ms)?;
        }
        self.constant(kind, &label, velocity, cruise_ms, span)?;
        if stop_ramp_s > 0.0 {
            let displacement = velocity * (stop_ramp_s / 2.0);
            let ramp_ms = to_ms(stop_ramp_s);
            self.push(
                SegmentKind::Ramp,
                "ramp",
                displacement,
                Vector3::zeros(),
                Some(velocity),
                ramp_ms,
            )?;
        }
        self.velocity_mps = Vector3::zeros();
        self.position_m.z = to_m;
        if let Some(last) = self.segments.last_mut() {
            last.to_m = tidy(self.position_m);
        }
        Ok(())
    }

    fn land(&mut self) -> Result<(), TemplateError> {
        let landing = &self.source.template.landing;
        let end_m =
            self.source.in_range(&landing.end_altitude_m, "end of the show", "m", 0.0..=100.0)?;
        let speed = self.source.in_range(
            &landing.speed_mps,
            "landing speed",
            "m/s",
            0.1..=MAX_SPEED_MPS,
        )?;
        let span = span_of(&landing.end_altitude_m);
        if self.position_m.z <= end_m {
            let last =
                self.source.template.steps.last().and_then(|step| span_of(&step.get_ref().kind));
            return Err(self
                .source
                .error(
                    last,
                    format!(
                        "the last step ends at {:.2} m, not above the end of the show at {end_m} m",
                        self.position_m.z
                    ),
                )
                .with_help("add a climb, or lower `end_altitude_m` in [landing]"));
        }
        self.vertical_to(SegmentKind::Landing, end_m, speed, span)
    }

    fn push(
        &mut self,
        kind: SegmentKind,
        label: &str,
        displacement_m: Vector3<f64>,
        velocity_mps: Vector3<f64>,
        from_velocity_mps: Option<Vector3<f64>>,
        duration_ms: u64,
    ) -> Result<(), TemplateError> {
        if self.segments.len() >= MAX_SEGMENTS {
            return Err(self
                .source
                .error(None, format!("the flight has more than {MAX_SEGMENTS} segments")));
        }
        let (start_ms, end_ms) = (self.at_ms, self.at_ms + duration_ms);
        let from_m = self.position_m;
        self.position_m += displacement_m;
        self.at_ms = end_ms;
        self.segments.push(Segment {
            kind,
            label: label.to_owned(),
            start_ms,
            end_ms,
            from_m: tidy(from_m),
            to_m: tidy(self.position_m),
            velocity_mps: tidy(velocity_mps),
            from_velocity_mps: from_velocity_mps.map(tidy),
            window: self.window.of(kind, start_ms, end_ms),
            calibrates_wind: false,
        });
        Ok(())
    }
}

fn kind_name(kind: StepKind) -> &'static str {
    match kind {
        StepKind::Climb => "climb",
        StepKind::Leg => "leg",
        StepKind::Hover => "hover",
        StepKind::Horizontal => "horizontal",
        StepKind::Repeat => "repeat",
        StepKind::Stagger => "stagger",
        StepKind::Rejoin => "rejoin",
    }
}

fn allowed_keys(kind: StepKind) -> &'static [&'static str] {
    match kind {
        StepKind::Climb => &["to_m", "speed_mps"],
        StepKind::Leg => &["direction", "speed_mps", "duration_s"],
        StepKind::Hover => &["duration_s"],
        StepKind::Horizontal => &["heading_deg", "speed_mps", "duration_s"],
        StepKind::Repeat => &["speeds_mps", "heights_m", "times", "steps"],
        StepKind::Stagger | StepKind::Rejoin => &[],
    }
}
