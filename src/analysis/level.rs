//! The words for a map whose law is a vehicle's response with its level fitted, and for how it compares with an
//! instrument over time that it did not take its level from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::running::RUNNING_S;

/// Shortest stretch that sets a zero, s: three running means of 10 s.
pub const LEAST_ZERO_S: f64 = 30.0;
/// Drones whose level is told.
const MOST_TOLD: usize = 4;

/// A map from a vehicle's response with its level fitted to the flight.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LevelledMap {
    /// Whose response: `vehicle phantom4`, `line of the calibration`.
    pub response: String,
    /// Stretch of the hover in which the mean of the air is taken to be zero, from and to, show time, s; absent: the
    /// level is that of the calibration's windows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub zero_s: Option<[f64; 2]>,
    /// The drones, in the map's order.
    pub drones: Vec<DroneLevel>,
    /// Comparison with the true air outside of the zero stretch, where it is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
}

/// Level of one drone, and what its values are made of.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneLevel {
    /// Label.
    pub name: String,
    /// Effort above the response's own, in the indicator's unit.
    pub level: f64,
    /// Standard error of the level as vertical air speed, m/s: the mean of the air over the stretch or the legs is not
    /// zero.
    pub level_se_mps: f64,
    /// Change of the effort with the vertical air speed in the hover, indicator's unit per m/s.
    pub slope: f64,
    /// Mean wind that the leans show, m/s; 0 where the response has no wind.
    pub wind_mps: f64,
    /// Standard deviation of the values that the response gives over the stretch (the hover, without one), m/s.
    pub sd_mps: f64,
    /// Standard deviation of what in these values is not the air, as far as it is known, m/s.
    pub noise_mps: f64,
    /// Factor from these values to the estimate: the air's share of their variance.
    pub gain: f64,
    /// Integral time of the values, s; 0: not known.
    pub integral_time_s: f64,
    /// Standard deviation between the air at the drone and at an instrument beside it, m/s.
    pub apart_mps: f64,
    /// Change of the effort with the vertical speed over the calibration's legs, indicator's unit per m/s, where it is so
    /// far from the response's that the response is hardly that of this drone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub legs_slope: Option<f64>,
}

/// Errors against an instrument beside the drone, outside of the zero stretch. All are root mean squares over means of
/// 10 s, m/s.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldOut {
    /// Errors of all seconds, whose means of 10 s overlap.
    pub running: HeldOutErrors,
    /// Errors of means of 10 s one after the other.
    pub apart: HeldOutErrors,
    /// Mean of estimate less instrument, m/s.
    pub bias_mps: f64,
    /// Slope of the plain straight line, indicator's unit per m/s.
    pub line_slope: f64,
    /// Half width of the 95 % interval for the air at the drone, m/s; the median.
    pub half_width_mps: f64,
    /// Share of the instrument's values inside of it.
    pub inside_share: f64,
    /// Distance between drone and instrument, m.
    pub distance_m: f64,
    /// Half width of the 95 % interval for what the instrument reads, with what the air differs over that distance,
    /// m/s; the median.
    pub half_width_there_mps: f64,
    /// Share of the instrument's values inside of it.
    pub inside_share_there: f64,
}

impl LevelledMap {
    /// Phrase about the map's law.
    pub fn words(&self) -> String {
        let level = match self.zero_s {
            Some([from, to]) => format!(
                "{from:.0} to {to:.0} s of the hover, in which the mean of the air is taken to be zero"
            ),
            None => "the calibration's windows".to_owned(),
        };
        format!("the response of the {} with its level fitted to {level}", self.response)
    }

    /// Whether the running mean at a time has nothing of the stretch that sets the zero.
    pub fn is_outside(&self, time_s: f64) -> bool {
        let half_s = 0.5 * RUNNING_S;
        self.zero_s.is_none_or(|[from, to]| time_s - half_s >= to || time_s + half_s <= from)
    }

    /// Sentences about the levels of the first drones.
    pub fn level_words(&self, unit: &str) -> Vec<String> {
        let one = |drone: &DroneLevel| {
            let wind = if drone.wind_mps > 0.0 {
                format!(" in the {:.1} m/s of wind that the leans show", drone.wind_mps)
            } else {
                String::new()
            };
            let legs = drone.legs_slope.map_or_else(String::new, |slope| {
                format!(" (the calibration's legs have {slope:.0}: see the cautions)")
            });
            format!(
                "{}: {:.0} {unit} per m/s{wind}{legs}; the level is known to \u{b1}{:.2} m/s (95 %); {:.0} % of the values' \
                 deviation is kept (their s.d. {:.2} m/s, known noise {:.2} m/s)",
                drone.name,
                drone.slope,
                1.96 * drone.level_se_mps,
                100.0 * drone.gain,
                drone.sd_mps,
                drone.noise_mps
            )
        };
        self.drones.iter().take(MOST_TOLD).map(one).collect()
    }

    /// Two sentences about the errors outside of the zero stretch; empty without a true air.
    pub fn held_out_words(&self) -> Vec<String> {
        let Some(held) = &self.held_out else { return Vec::new() };
        let over = |errors: &HeldOutErrors| {
            format!(
                "{:.3} m/s (answering zero {:.3}, plain straight line {:.3}, without the factor {:.3})",
                errors.rms_mps,
                errors.zero_rms_mps,
                errors.line_rms_mps,
                errors.without_gain_rms_mps
            )
        };
        let where_from =
            if self.zero_s.is_some() { "outside of the zero stretch" } else { "in the hover" };
        vec![
            format!(
                "against the instrument {where_from}: rms error of {} means of 10 s one after the other {}; of \
                 all {} seconds {}; mean error {:+.3} m/s",
                held.apart.values,
                over(&held.apart),
                held.running.values,
                over(&held.running),
                held.bias_mps
            ),
            format!(
                "its error bar (95 %) is \u{b1}{:.2} m/s for the air at the drone and \u{b1}{:.2} m/s for what an \
                 instrument reads {:.0} m away; {:.0} % and {:.0} % of the instrument's values are inside",
                held.half_width_mps,
                held.half_width_there_mps,
                held.distance_m,
                100.0 * held.inside_share,
                100.0 * held.inside_share_there
            ),
        ]
    }
}

/// Errors of several answers over the same values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HeldOutErrors {
    /// Number of values.
    pub values: usize,
    /// Of the map.
    pub rms_mps: f64,
    /// Of the response without the factor [`DroneLevel::gain`].
    pub without_gain_rms_mps: f64,
    /// Of answering zero.
    pub zero_rms_mps: f64,
    /// Of a plain straight line with the same zero, without wind.
    pub line_rms_mps: f64,
}
