//! The parts of an `analysis.json` that go into an archive's short tables.
//!
//! An analysis of thousands of drones has hundreds of megabytes, nearly all of them series: these are passed over
//! here, and read one drone at a time by [`super::series`]. Numbers that are no numbers stand as null in JSON; here they
//! are unknown.

use std::fmt;

use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};

use crate::base::time::GpsTime;
use crate::flight::Indicator;
use crate::mission::plan::{Purpose, SegmentKind};

/// An analysis without its series.
#[derive(Debug, Deserialize)]
pub struct Analysis {
    /// Name and version of its format.
    pub schema: String,
    /// Program and version that made it.
    pub made_by: String,
    /// Title for people.
    pub title: String,
    /// Flights, calibration first.
    pub flights: Vec<Flight>,
}

/// One flight of an analysis.
#[derive(Debug, Deserialize)]
pub struct Flight {
    /// Short name of the flight.
    pub name: String,
    /// Purpose of the flight.
    pub purpose: Purpose,
    /// Indicator that stands for rotor effort.
    #[serde(default)]
    pub indicator: Indicator,
    /// True vertical air speed of a simulated flight in uniform air, m/s.
    #[serde(default)]
    pub true_updraft_mps: Option<f64>,
    /// Drones with an analysed log.
    pub drones: Vec<Drone>,
    /// Number of logs given.
    #[serde(default)]
    pub logs: usize,
    /// Slots without a log.
    #[serde(default)]
    pub missing: Vec<IgnoredAny>,
    /// Law that the windows prefer.
    #[serde(default)]
    pub headline: Option<Headline>,
    /// Map of the air.
    #[serde(default)]
    pub map: Option<Map>,
    /// Statistics of the map.
    #[serde(default)]
    pub statistics: Option<Statistics>,
}

/// The law that the windows of a calibration prefer.
#[derive(Debug, Deserialize)]
pub struct Headline {
    /// Name of the law.
    pub law: String,
}

/// A value with its standard error, both if known.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
pub struct Known {
    /// Value of the estimate.
    pub value: Option<f64>,
    /// Standard error; 0 for what was held.
    #[serde(default)]
    pub se: Option<f64>,
}

impl Known {
    /// Standard error, if it is one: a held value has none.
    pub fn error(&self) -> Option<f64> {
        self.se.filter(|se| *se > 0.0)
    }
}

/// One drone of a flight.
#[derive(Debug, Deserialize)]
pub struct Drone {
    /// Number of the drone's slot.
    pub slot: Option<u16>,
    /// Label of the drone.
    pub name: String,
    /// Path of the drone's log.
    pub source: String,
    /// Alignment of its clock.
    pub clock: Clock,
    /// Windows of the flight.
    pub windows: Vec<Window>,
    /// Laws fitted to them.
    pub laws: Option<Laws>,
    /// Line that may bend.
    #[serde(default)]
    pub line: Option<Line>,
    /// Set if the laws rest on a part of the ladder.
    #[serde(default)]
    pub partial_ladder: Option<IgnoredAny>,
    /// Doubts about the drone.
    #[serde(default)]
    pub warnings: Vec<IgnoredAny>,
}

/// Alignment of a drone's clock.
#[derive(Debug, Deserialize)]
pub struct Clock {
    /// Way of the alignment: `show_rows`, `gps_time`, `plan`, `takeoff`.
    pub method: String,
    /// Spread of the alignment, s.
    pub residual_s: Option<f64>,
    /// GPS time of show time 0.
    pub start: Option<GpsTime>,
}

/// One window of a drone.
#[derive(Debug, Deserialize)]
pub struct Window {
    /// Kind of the segment.
    pub kind: SegmentKind,
    /// Tilt-corrected rotor effort.
    pub pulse_phi_us: Sample,
    /// Tilt, degrees.
    pub tilt_deg: Sample,
    /// Battery in the window.
    #[serde(default)]
    pub supply: Option<Supply>,
    /// Reasons why it is not used.
    pub rejected: Vec<String>,
}

/// Statistics of samples.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Sample {
    /// Median of the samples.
    pub median: Option<f64>,
    /// Standard error of the mean.
    #[serde(default)]
    pub se: Option<f64>,
}

/// The battery in a window.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Supply {
    /// Voltage at rest, V.
    pub resting_v: Option<f64>,
    /// Electrical power, W; 0: not logged.
    pub power_w: Option<f64>,
}

/// Laws fitted to windows.
#[derive(Debug, Deserialize)]
pub struct Laws {
    /// Signed quadratic, W free.
    pub signed_quadratic: Option<Fit>,
    /// Fit of a straight line.
    pub linear: Option<Fit>,
}

/// A fitted law.
#[derive(Debug, Deserialize)]
pub struct Fit {
    /// Parameters of the law.
    pub parameters: Vec<Parameter>,
    /// Number of points fitted.
    pub points: usize,
    /// Reduced chi² of the fit.
    pub chi2_reduced: Option<f64>,
    /// Probability of that chi².
    #[serde(default)]
    pub p_value: Option<f64>,
    /// Root mean square of the residuals, us.
    pub rms_us: Option<f64>,
    /// Set where the fit ended at the edge of the searched range.
    #[serde(default)]
    pub w_beyond_mps: Option<f64>,
}

/// A parameter of a law.
#[derive(Debug, Deserialize)]
pub struct Parameter {
    /// Symbol of the parameter.
    pub name: String,
    /// Value and standard error.
    pub estimate: Known,
}

impl Fit {
    /// Parameter by its symbol; unknown where the fit ended at the edge of its range.
    pub fn of(&self, symbol: &str) -> Known {
        let found = self.parameters.iter().find(|parameter| parameter.name == symbol);
        match (found, self.w_beyond_mps) {
            (Some(parameter), None) => parameter.estimate,
            _ => Known::default(),
        }
    }
}

/// The line that may bend.
#[derive(Debug, Deserialize)]
pub struct Line {
    /// Effort in hover, us.
    pub u0: Known,
    /// Slope in hover, us/(m/s).
    pub slope: Known,
    /// Bend of both branches to one side, us/(m/s)².
    pub bend: Known,
    /// Bend of each branch away from hover, us/(m/s)².
    pub drag: Known,
}

/// The map of a flight without its series.
#[derive(Debug, Deserialize)]
pub struct Map {
    /// Law of the inversion.
    pub law: String,
    /// Seconds of the map.
    #[serde(default)]
    pub time_s: Span,
    /// Drones of the map.
    pub drones: Vec<MapDrone>,
    /// Error that all drones share.
    #[serde(default)]
    pub common: Option<Common>,
    /// Comparison with the truth.
    #[serde(default)]
    pub truth: Option<Truth>,
    /// Posterior of the map.
    #[serde(default)]
    pub posterior: Option<Posterior>,
    /// Thermals of the map.
    #[serde(default)]
    pub thermals: Vec<Thermal>,
}

/// Seconds of a map: a list of times that is kept by its ends, as they are evenly spaced.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// First and last time, s; absent: the list is empty.
    pub ends_s: Option<[f64; 2]>,
    /// Number of times.
    pub count: usize,
    /// Whether a time is off the even spacing of 1 s.
    pub is_uneven: bool,
}

/// Distance of the times of a map, s.
const STEP_S: f64 = 1.0;
/// A time is even up to this, s.
const EVEN_S: f64 = 1e-6;

impl Span {
    /// The time of each second; `None` where they are not even.
    pub fn times_s(&self) -> Option<Vec<f64>> {
        let [first_s, _] = self.ends_s?;
        let times = (0..self.count).map(|index| first_s + STEP_S * index as f64);
        (!self.is_uneven).then(|| times.collect())
    }
}

impl<'de> Deserialize<'de> for Span {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Ends;
        impl<'de> Visitor<'de> for Ends {
            type Value = Span;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list of times")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut times: A) -> Result<Span, A::Error> {
                let mut span = Span::default();
                while let Some(time_s) = times.next_element::<f64>()? {
                    let first_s = span.ends_s.map_or(time_s, |ends| ends[0]);
                    let even_s = first_s + STEP_S * span.count as f64;
                    span.is_uneven |= (time_s - even_s).abs() > EVEN_S;
                    span.ends_s = Some([first_s, time_s]);
                    span.count += 1;
                }
                Ok(span)
            }
        }
        deserializer.deserialize_seq(Ends)
    }
}

/// Error that all drones of a map share.
#[derive(Debug, Deserialize)]
pub struct Common {
    /// Standard error of the fleet's mean, m/s.
    #[serde(default)]
    pub se_mps: Option<f64>,
    /// Part of it that is the zero's, m/s.
    #[serde(default)]
    pub zero_mps: Option<f64>,
}

/// Comparison with the true air.
#[derive(Debug, Deserialize)]
pub struct Truth {
    /// Root mean square error, m/s.
    #[serde(default)]
    pub rms_mps: Option<f64>,
    /// Mean error, m/s.
    #[serde(default)]
    pub bias_mps: Option<f64>,
}

/// The posterior of a map without its series.
#[derive(Debug, Deserialize)]
pub struct Posterior {
    /// Mean over drones and seconds, m/s.
    #[serde(default)]
    pub fleet: Option<Known>,
    /// Scales of the air.
    #[serde(default)]
    pub scales: Option<Scales>,
    /// Comparison with the truth.
    #[serde(default)]
    pub truth: Option<Truth>,
}

/// Scales of the air.
#[derive(Debug, Deserialize)]
pub struct Scales {
    /// Standard deviation of the field, m/s.
    pub sd_mps: Option<f64>,
    /// Length, m.
    pub length_m: Known,
    /// Time, s.
    pub time_s: Known,
    /// Standard deviation of each drone's own gusts, m/s.
    #[serde(default)]
    pub gust_mps: Option<f64>,
}

/// One drone of a map without its series.
#[derive(Debug, Deserialize)]
pub struct MapDrone {
    /// Number of the drone's slot.
    pub slot: Option<u16>,
    /// Label of the drone.
    pub name: String,
    /// Position in the show frame, m.
    #[serde(default)]
    pub position_m: Option<[Option<f64>; 2]>,
    /// Height above home, m.
    pub height_m: Option<f64>,
    /// Owner of the law: `own` or `flock`.
    pub mapping: String,
    /// Mean, m/s.
    pub mean: Known,
    /// 95 % interval of the mean, m/s.
    #[serde(default)]
    pub mean_interval_mps: Option<[Option<f64>; 2]>,
    /// Origins of its error.
    #[serde(default)]
    pub errors: Errors,
    /// Posterior of the mean, m/s.
    #[serde(default)]
    pub posterior_mean: Option<Known>,
    /// Doubts by stretches of time.
    #[serde(default)]
    pub quality: Vec<Flag>,
}

/// Standard errors of a drone's mean by origin, m/s.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub struct Errors {
    /// Noise of its own.
    pub window_mps: Option<f64>,
    /// Law apart from the zero.
    pub law_mps: Option<f64>,
    /// Part of the zero.
    pub zero_mps: Option<f64>,
    /// Part of the battery.
    pub battery_mps: Option<f64>,
    /// Part of the wind.
    pub wind_mps: Option<f64>,
}

/// A doubt from one time to another.
#[derive(Debug, Deserialize)]
pub struct Flag {
    /// Name of the doubt.
    pub flag: String,
    /// From this show time, s.
    pub start_s: Option<f64>,
    /// To this show time, s.
    pub end_s: Option<f64>,
}

/// Names of the flags, sorted and each once, separated by semicolons: of all, or of those that hold at a time.
pub fn flags(quality: &[Flag], at_s: Option<f64>) -> String {
    let holds = |flag: &&Flag| {
        at_s.is_none_or(|at_s| {
            flag.start_s.is_some_and(|from| from <= at_s) && flag.end_s.is_some_and(|to| at_s <= to)
        })
    };
    let mut names: Vec<&str> =
        quality.iter().filter(holds).map(|flag| flag.flag.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names.join(";")
}

/// A thermal of a map.
#[derive(Debug, Deserialize)]
pub struct Thermal {
    /// Show time of its place, s.
    pub time_s: Option<f64>,
    /// Core along show x and y, m.
    pub core_m: [Known; 2],
    /// Drift along show x and y, m/s.
    pub drift_mps: [Known; 2],
    /// Radius, m.
    pub radius_m: Known,
    /// Updraft in the core, m/s.
    pub peak_mps: Known,
    /// Flux, m³/s.
    pub flux_m3ps: Known,
    /// Share that sinks around it.
    pub sink: Known,
    /// Logarithm of the evidence for it.
    pub log_odds: Option<f64>,
}

/// Statistics of a map.
#[derive(Debug, Deserialize)]
pub struct Statistics {
    /// Data that they are made of.
    pub record: Record,
    /// Wind by the leans.
    #[serde(default)]
    pub wind: Option<Wind>,
    /// Length of a baseline.
    #[serde(default)]
    pub baseline: Option<Baseline>,
}

/// Data of the statistics.
#[derive(Debug, Deserialize)]
pub struct Record {
    /// Standard deviation of the values about each drone's mean, m/s.
    #[serde(default)]
    pub sd_mps: Option<f64>,
}

/// Wind by the drones' leans.
#[derive(Debug, Deserialize)]
pub struct Wind {
    /// Mean speed, m/s.
    #[serde(default)]
    pub speed_mps: Option<Known>,
    /// Direction that it comes from, degrees.
    #[serde(default)]
    pub from_deg: Option<f64>,
    /// Mean lean, degrees.
    #[serde(default)]
    pub lean_deg: Option<f64>,
    /// Wind on each drone.
    #[serde(default)]
    pub drones: Vec<DroneWind>,
}

/// Wind on one drone.
#[derive(Debug, Deserialize)]
pub struct DroneWind {
    /// Direction that it comes from, degrees.
    #[serde(default)]
    pub from_deg: Option<f64>,
}

impl Wind {
    /// Standard error of the direction, degrees, from the spread of the drones' directions (circular standard deviation over
    /// the root of their number); absent below three drones.
    pub fn from_se_deg(&self) -> Option<f64> {
        let angles: Vec<f64> =
            self.drones.iter().filter_map(|drone| drone.from_deg).map(f64::to_radians).collect();
        let number = angles.len() as f64;
        let (east, north) = angles
            .iter()
            .fold((0.0, 0.0), |(east, north), angle| (east + angle.sin(), north + angle.cos()));
        let together = f64::hypot(east, north) / number;
        let sd = (-2.0 * together.min(1.0).ln()).sqrt().to_degrees();
        (angles.len() >= 3 && sd.is_finite()).then(|| sd / number.sqrt())
    }
}

/// Length of a baseline.
#[derive(Debug, Deserialize)]
pub struct Baseline {
    /// Length of the record, s.
    pub record_s: Option<f64>,
    /// Mean of one drone.
    pub drone: BaselineOf,
    /// Mean of all drones.
    #[serde(default)]
    pub fleet: Option<BaselineOf>,
}

/// The slow air that a mean averages.
#[derive(Debug, Deserialize)]
pub struct BaselineOf {
    /// Standard deviation of the slow air, m/s.
    pub sd_mps: Option<f64>,
    /// Integral time of the slow air, s.
    pub integral_time_s: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::parse;

    #[test]
    fn times_leave_their_ends() {
        let span = |text: &str| parse::json::<Span>(text.as_bytes()).unwrap();
        assert_eq!((span("[]").ends_s, span("[]").times_s()), (None, None));
        assert_eq!(span("[95.0]").ends_s, Some([95.0, 95.0]));
        assert_eq!(span("[95, 96, 97]").times_s(), Some(vec![95.0, 96.0, 97.0]));
        let uneven = span("[95, 96, 97.5]");
        assert_eq!((uneven.ends_s, uneven.times_s()), (Some([95.0, 97.5]), None));
    }

    #[test]
    fn directions_around_north_are_near_each_other() {
        let drones = [359.0, 1.0, 0.0].map(|deg| DroneWind { from_deg: Some(deg) });
        let wind = Wind { speed_mps: None, from_deg: None, lean_deg: None, drones: drones.into() };
        let se = wind.from_se_deg().unwrap();
        assert!((se - 0.816 / 3_f64.sqrt()).abs() < 0.01, "{se}");
    }

    #[test]
    fn a_law_at_the_edge_of_its_range_has_no_parameters() {
        let fit = |beyond: &str| {
            let text = format!(
                r#"{{"parameters": [{{"name": "A", "estimate": {{"value": 8.0, "se": 0.0}}}}],
                    "points": 14, "chi2_reduced": null, "rms_us": 1.0 {beyond}}}"#
            );
            parse::json::<Fit>(text.as_bytes()).unwrap().of("A")
        };
        assert_eq!((fit("").value, fit("").error()), (Some(8.0), None));
        assert_eq!(fit(r#", "w_beyond_mps": -8.0"#).value, None);
    }
}
