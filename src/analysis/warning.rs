//! Warnings that a reader needs before using a flight's numbers, and their sentences.

use std::fmt::{self, Write as _};

use super::calibrate::CalibrationError;
use super::cause::{Cause, later};
use super::caution::STEEP_DEG;
use super::fit_warning::W_LIMIT_MPS;
use super::ladder::{FEWEST_RUNGS, Ladder, PartialLadder};
use super::windows::Tilt;
use crate::base::said::said_in_files;
use crate::flight::{self, Indicator};

/// Drones that are named one by one; the rest is counted.
const NAMED: usize = 8;

/// Warning about a flight, a drone or the whole analysis. In `analysis.json` it stands as its sentence.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Warning {
    /// A doubt about a drone's log.
    Log(flight::Warning),
    /// Nothing of the plan is in a drone's log.
    NothingOfPlan(Cause),
    /// The clock of a drone counts from its take-off.
    TakeoffClock,
    /// A drone's own law is of a part of the ladder, and the map takes the flock's.
    PartialLaw(PartialLadder),
    /// Contradictions between what logs say of their owners.
    WhoseLogs(String),
    /// A flight cannot be analysed: one line of the reason.
    Failed(String),
    /// A drone of a calibration flew at another time than most.
    OtherStart {
        /// Name of the drone.
        name: String,
        /// Delay behind the start of most drones, s.
        later_s: f64,
    },
    /// Drones of a calibration flew a part of the ladder.
    PartialLadders {
        /// Names of the drones and the ladders that they flew.
        drones: Vec<(String, PartialLadder)>,
        /// Number of drones in the fleet.
        of: usize,
        /// The ladder of the fleet's middle drone.
        whole: Ladder,
    },
    /// Most drones have usable windows of a part of the ladder only.
    FleetLadder {
        /// Ladder of the usable windows.
        usable: Ladder,
        /// Ladder that was flown.
        flown: Ladder,
    },
    /// No law was fitted to the drones' average, for this reason.
    NoFlock(CalibrationError),
    /// No law was fitted to any drone.
    NoLaw,
    /// The laws rest on very few windows.
    FewWindows {
        /// Number of windows of vertical motion.
        windows: usize,
    },
    /// The signed quadratic does not describe the flight.
    Misfit {
        /// Reduced chi² of the signed quadratic.
        quadratic: f64,
        /// Reduced chi² of the line.
        linear: f64,
        /// W* if it is stronger than air moves, m/s.
        strong_w_mps: Option<f64>,
    },
    /// W* is the vertex of a parabola.
    Vertex {
        /// Vertical air speed W* of the fit, m/s.
        w_mps: f64,
        /// Lowest and highest commanded speed of the ladder, m/s.
        speeds_mps: [f64; 2],
    },
    /// The drones leaned in a calibration.
    LadderWind {
        /// Mean lean of the drones, degrees.
        lean_deg: f64,
        /// Wind along the rotor axis, m/s.
        axial_mps: f64,
        /// Whether the lean of the vehicle in wind is known.
        known: bool,
    },
    /// The tilt correction that was not used would change u0 by more than its error.
    TiltForm {
        /// Tilt correction that was used.
        used: Tilt,
        /// Indicator of rotor effort.
        indicator: Indicator,
        /// Change of u0 with the correction that was not used, in the indicator's unit.
        change: f64,
        /// Standard error of u0, in the indicator's unit.
        error: f64,
        /// Slope of the line, the indicator's unit per m/s.
        slope: f64,
    },
    /// Angles of tables are steeper than drones fly.
    Steep {
        /// Names of the drones.
        drones: Vec<String>,
        /// Share of the rows that are so steep, of the steepest drone.
        share: f64,
    },
    /// A vehicle's response is not the one that the calibration's legs show.
    OtherResponse {
        /// Names of the drones, their slopes in the hover and those of the legs, the indicator's unit per m/s.
        drones: Vec<(String, [f64; 2])>,
        /// Indicator of rotor effort.
        indicator: Indicator,
    },
    /// No laws are there to measure the air with.
    NoCalibration,
    /// A flight without a plan has some climbs, but too few for a calibration.
    NoLadder {
        /// Number of speeds of climbs.
        up: usize,
        /// Number of speeds of descents.
        down: usize,
    },
    /// The drones leaned in a measurement.
    Wind {
        /// Mean lean of the drones, degrees.
        lean_deg: f64,
        /// Error that wind may leave in the map, m/s.
        error_mps: f64,
        /// Correction of the map for wind.
        corrected: WindHandled,
        /// Whether drones moved along tracks.
        moved: bool,
    },
    /// Batteries that pulses are not corrected for.
    Battery {
        /// Possible error, m/s, where nothing is corrected for want of voltages in the calibration.
        uncorrected_mps: Option<f64>,
        /// Names of the drones without a voltage in the hover, and the possible error, m/s.
        in_hover: Option<(Vec<String>, f64)>,
        /// Names of the drones without a voltage in the calibration.
        in_calibration: Vec<String>,
    },
    /// Measurements depend on the levels of the laws that they are made with.
    LawsOfOthers {
        /// Number of drones.
        drones: usize,
        /// Correlation of their means with the levels.
        correlation: f64,
        /// Standard deviation of the levels, m/s.
        spread_mps: f64,
    },
    /// The map inverts the laws of the tables.
    PlainMap,
    /// The drones moved, so that the map is of their tracks.
    Scan,
    /// A warning as it was read from a file.
    Said(String),
}

/// Correction of a map for wind on leaning drones.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WindHandled {
    /// Corrected with the physics of the vehicle's file.
    Physics,
    /// Corrected with the drag of the simulated vehicle.
    Drag,
    /// The map is not corrected for wind.
    Not,
}

said_in_files!(Warning);

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Log(warning) => warning.fmt(f),
            Self::NothingOfPlan(cause) => cause.fmt(f),
            Self::TakeoffClock => f.write_str(
                "times count from take-off: windows may be shifted against the plan",
            ),
            Self::PartialLaw(partial) => write!(
                f,
                "the map uses the flock's law: its own is of a partial ladder ({})",
                partial.short()
            ),
            Self::WhoseLogs(text) | Self::Failed(text) | Self::Said(text) => f.write_str(text),
            Self::OtherStart { name, later_s } => write!(
                f,
                "{name}: its show began {} than that of most drones (by its log's GPS time). Its law \
                 stands, but is of the air at that time: its zero may be off against the others'",
                later(*later_s)
            ),
            Self::PartialLadders { drones, of, whole } => partial_ladders(f, drones, *of, *whole),
            Self::FleetLadder { usable, flown } => write!(
                f,
                "most drones have usable windows of a part of the ladder only: {} legs from {:+} to \
                 {:+} m/s of {} from {:+} to {:+} m/s. The fleet's numbers are those of that part",
                usable.legs,
                usable.lowest_mps,
                usable.highest_mps,
                flown.legs,
                flown.lowest_mps,
                flown.highest_mps,
            ),
            Self::NoFlock(error) => write!(f, "flock mapping: {error}"),
            Self::NoLaw => f.write_str(
                "no law was fitted: no drone has a usable speed ladder (the reasons are listed)",
            ),
            Self::FewWindows { windows } => write!(
                f,
                "the laws rest on {windows} windows of vertical motion only: this is hardly a ladder, \
                 and their errors are not known well, or not at all"
            ),
            Self::Misfit { quadratic, linear, strong_w_mps } => {
                misfit(f, *quadratic, *linear, *strong_w_mps)
            }
            Self::Vertex { w_mps, speeds_mps } => vertex(f, *w_mps, *speeds_mps),
            Self::LadderWind { lean_deg, axial_mps, known } => write!(
                f,
                "wind: the drones leaned {lean_deg:.1} degrees in the ladder. Wind along the rotor axis \
                 of a leaning drone reads as sinking air: {} {axial_mps:.2} m/s of the fitted W* is \
                 that, and A and u0 are off with it{}",
                if *known { "about" } else { "up to" },
                if *known { " (the map is corrected for it, this table is not)" } else { "" }
            ),
            Self::TiltForm { used, indicator, change, error, slope } => {
                tilt_form(f, *used, indicator.unit(), [*change, *error, *slope])
            }
            Self::Steep { drones, share } => write!(
                f,
                "angles: roll or pitch of {} is beyond {STEEP_DEG:.0} degrees in {:.0} % of the rows, and no \
                 drone flies so: are the columns in degrees, and read as radians? Then give [roll] and [pitch] \
                 scale = 0.0174533 in the mapping (radians need no scale). Until then the values are no \
                 measurement",
                listed(drones),
                100.0 * share
            ),
            Self::OtherResponse { drones, indicator } => {
                other_response(f, drones, indicator.unit())
            }
            Self::NoCalibration => f.write_str(
                "no calibration was given: the air cannot be measured without laws. Analyse the \
                 calibration flight together with this one (updraft analyze CALIBRATION HOVER), or take \
                 the laws of an analysis of these drones (--hold analysis.json). Until then there are \
                 only the flight's windows and its traces",
            ),
            Self::NoLadder { up, down } => write!(
                f,
                "without a plan a flight is a calibration only if it climbs at {FEWEST_RUNGS} speeds or \
                 more and sinks at {FEWEST_RUNGS} or more: this one has steady climbs at {up} and \
                 descents at {down} (take-off and landing?), and is taken for a measurement. If it is a \
                 calibration, give its plan (--plan)"
            ),
            Self::Wind { lean_deg, error_mps, corrected, moved } => {
                let when = if *moved { "on their legs" } else { "in the hover" };
                wind(f, *lean_deg, when, *corrected, *error_mps)
            }
            Self::Battery { uncorrected_mps, in_hover, in_calibration } => {
                battery(f, *uncorrected_mps, in_hover.as_ref(), in_calibration)
            }
            Self::LawsOfOthers { drones, correlation, spread_mps } => write!(
                f,
                "laws: what the {drones} drones measure follows the pulse widths that their laws start from \
                 (correlation {correlation:+.2}). These seem to be the laws of other drones, or of these drones in \
                 other slots. Each drone may be off by about {spread_mps:.1} m/s, which the stated errors do not \
                 include. Use a calibration of these drones, and see which log is of which slot"
            ),
            Self::PlainMap => f.write_str(
                "errors: this map inverts the laws of the tables, as the paper does. Its standard errors \
                 are those of the hover's windows and of the law's parameters: what slow air during the \
                 calibration, battery and density shift for all drones alike has no error in this \
                 method, and the truth may lie further off than is stated",
            ),
            Self::Scan => f.write_str(
                "scan: the drones moved, and each value is the mean of the air over 10 s of the way. A \
                 difference along a track is one of place and of time; no statistics are made of it",
            ),
        }
    }
}

fn partial_ladders(
    f: &mut fmt::Formatter<'_>,
    drones: &[(String, PartialLadder)],
    of: usize,
    whole: Ladder,
) -> fmt::Result {
    let named: Vec<String> =
        drones.iter().map(|(name, partial)| format!("{name} ({})", partial.short())).collect();
    write!(
        f,
        "partial ladder: {} of {of} drones flew less than two thirds of the fleet's ladder ({} legs \
         from {:+} to {:+} m/s): {}. They keep their own laws, but are left out of the fleet's means \
         and standard deviations and of the average of the drones; a map takes the law of that average \
         for them",
        drones.len(),
        whole.legs,
        whole.lowest_mps,
        whole.highest_mps,
        named.join(", "),
    )
}

fn misfit(
    f: &mut fmt::Formatter<'_>,
    quadratic: f64,
    linear: f64,
    strong_w_mps: Option<f64>,
) -> fmt::Result {
    write!(
        f,
        "The signed-quadratic law does not describe this flight: its chi2/nu is {quadratic:.2}, that of \
         the line {linear:.2}. Use A' of the line; A, u0 and W* of the signed quadratic mean nothing \
         here."
    )?;
    let Some(w) = strong_w_mps else { return Ok(()) };
    write!(
        f,
        " Its W* {} is the flank of a parabola that stands in for the line, not moving air.",
        w_words(w)
    )
}

fn vertex(f: &mut fmt::Formatter<'_>, w: f64, [low, high]: [f64; 2]) -> fmt::Result {
    let place = if (low..=high).contains(&w) { "at the edge of" } else { "outside of" };
    write!(
        f,
        "The signed quadratic's W* {} is the vertex of a parabola and no air speed: it lies \
         {place} the ladder's {low:+.1} to {high:+.1} m/s, so that the windows are on one flank, which \
         stands in for a line that bends. A, u0 and W* describe that bend alone",
        w_words(w)
    )
}

/// A fitted W as what it is: at the edge of the searched range it is only known to lie beyond.
fn w_words(w_mps: f64) -> String {
    match w_mps {
        w if w <= -W_LIMIT_MPS => format!("below {:+.0} m/s", -W_LIMIT_MPS),
        w if w >= W_LIMIT_MPS => format!("above {W_LIMIT_MPS:+.0} m/s"),
        w => format!("of {w:+.2} m/s"),
    }
}

fn tilt_form(
    f: &mut fmt::Formatter<'_>,
    used: Tilt,
    unit: &str,
    [change, error, slope]: [f64; 3],
) -> fmt::Result {
    let (ours, other) = match used {
        Tilt::Paper => ("the paper's u cos(phi)", "what the vertical part of the thrust takes"),
        Tilt::Thrust => ("what the vertical part of the thrust takes", "the paper's u cos(phi)"),
    };
    write!(
        f,
        "tilt: pulses are corrected to {ours}. With {other} u0 would change by {change:+.1} {unit}, \
         which is more than its error of {error:.1} {unit} and reads as {:+.2} m/s of updraft where a \
         hover leans alike",
        -change / slope
    )
}

fn other_response(
    f: &mut fmt::Formatter<'_>,
    drones: &[(String, [f64; 2])],
    unit: &str,
) -> fmt::Result {
    let named: Vec<String> = drones
        .iter()
        .map(|(name, [hover, legs])| {
            format!("{name} ({hover:.0} against {legs:.0} {unit} per m/s)")
        })
        .collect();
    write!(
        f,
        "response: that of the vehicle in the hover is not that of the calibration's legs: {}. This is hardly the \
         response of this drone, and its values are no measurement. See that --vehicle is the drone that flew, and \
         that the mapping's columns, signs and scales are right",
        listed(&named)
    )
}

fn wind(
    f: &mut fmt::Formatter<'_>,
    lean_deg: f64,
    when: &str,
    corrected: WindHandled,
    error_mps: f64,
) -> fmt::Result {
    write!(f, "wind: the drones leaned {lean_deg:.1} degrees {when}. ")?;
    match corrected {
        WindHandled::Physics => write!(
            f,
            "What their airspeed does to the pulse (drag, flow along the rotor axis, translational \
             lift) is corrected by their lean, with the physics of their vehicle's file; what is left \
             may be {error_mps:.2} m/s, of the same sign for all drones (stated as the systematic \
             error)"
        ),
        WindHandled::Drag => write!(
            f,
            "What wind does to a leaning drone is corrected with the drag of the simulated vehicle; \
             what is left may be {error_mps:.2} m/s, of the same sign for all drones (stated as the \
             systematic error)"
        ),
        WindHandled::Not => write!(
            f,
            "Wind along the rotor axis of a leaning drone reads as sinking air, and the lift that \
             rotors gain in wind as rising air. Without the drag and the rotors of these drones known \
             nothing is corrected: the map may be off by up to {error_mps:.2} m/s by the first alone, \
             in the same direction for all drones (stated as the systematic error). Fly in still air \
             where that matters"
        ),
    }
}

fn battery(
    f: &mut fmt::Formatter<'_>,
    uncorrected_mps: Option<f64>,
    in_hover: Option<&(Vec<String>, f64)>,
    in_calibration: &[String],
) -> fmt::Result {
    let mut said = Vec::new();
    if let Some(error) = uncorrected_mps {
        said.push(format!(
            "no battery voltage is in the calibration's logs, and pulses are not corrected for it. \
             What the pack may have done is in the errors: {error:.2} m/s (standard error)"
        ));
    }
    if let Some((drones, error)) = in_hover {
        said.push(format!(
            "no voltage in the hover's log of {}: pulses without one are not corrected for it. What \
             the pack may have done is in the error: {error:.2} m/s (standard error). Set \
             BATT_MONITOR, and LOG_BITMASK bit 9 (CURRENT, +512)",
            listed(drones),
        ));
    }
    if !in_calibration.is_empty() {
        said.push(format!(
            "no voltage in the calibration's log of {}: the map takes the law of the average of the \
             drones for them",
            listed(in_calibration),
        ));
    }
    write!(f, "battery: {}", said.join("; "))
}

/// Names in one line; the first ones of many.
fn listed(names: &[String]) -> String {
    let more = names.len().saturating_sub(NAMED);
    let mut text = names.get(..NAMED).unwrap_or(names).join(", ");
    if more > 0 {
        let _ = write!(text, " and {more} more");
    }
    text
}
