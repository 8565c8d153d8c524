//! Turbulence of a hover, as part of its result.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use turbulence_statistics::dissipation::Dissipation;
use turbulence_statistics::moments::Moment;
use turbulence_statistics::spectrum::{Band, CrossBand};

use crate::base::estimate::Estimate;

/// Turbulence over a hover: statistics of records faster than the map's running means.
///
/// The components are along the mean wind of the fleet (u), across it to the left (v) and up (w). Intervals are of 95 %:
/// sampling, and the scale of the instrument.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Turbulence {
    /// Records that it is from.
    pub record: TurbulenceRecord,
    /// Mean wind that carries the eddies past; absent: not known, or calm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub carried_by: Option<CarriedBy>,
    /// Vertical component, of the fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<Component>,
    /// Component along the mean wind, of the fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Component>,
    /// Component across the mean wind, of the fleet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Component>,
    /// Share of the time and the drones in which the air rises faster than the drone's mean: the updraft fraction, which no
    /// error of the zero touches.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub updraft_fraction: Option<Interval>,
    /// Convective velocity scale; absent: nobody said how deep the mixed layer is, or the variance of w is not told.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub convective: Option<Convective>,
    /// Turbulent kinetic energy, half the sum of the three variances, m²/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinetic_energy: Option<Interval>,
    /// Kinematic momentum flux along the wind, the covariance of u and w, m²/s²; negative: momentum goes down.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux_along: Option<Interval>,
    /// The same across the wind, of v and w.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux_across: Option<Interval>,
    /// Covariance of u and v.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along_across: Option<Interval>,
    /// Cospectrum and coherence of u and w, mean over the drones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flux_cospectrum: Vec<CrossBand>,
    /// Rate of dissipation from w's spectrum, m²/s³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dissipation: Option<Dissipation>,
    /// The same from the structure function, over the times of that range, m²/s³: a check.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dissipation_by_structure: Option<f64>,
    /// w at pairs of drones, by distance.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub distances: Vec<AtDistance>,
    /// How fast the pattern of w passes the drones.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub advection: Option<PatternSpeed>,
    /// The drones.
    pub drones: Vec<DroneTurbulence>,
    /// What is not known, one sentence each with the reason.
    #[serde(default)]
    pub absent: Vec<String>,
}

/// Records that turbulence is from.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TurbulenceRecord {
    /// First show time, s.
    pub from_s: f64,
    /// Last show time, s.
    pub to_s: f64,
    /// Length of the blocks that values are means over, s.
    pub step_s: f64,
    /// Known length of a drone's record, without gaps, s: the median.
    pub length_s: f64,
    /// Drones with a record.
    pub drones: usize,
    /// Drones whose pairs were compared: of large fleets, some that are spread over all.
    pub compared: usize,
    /// Frequency up to which w's spectra are told, Hz.
    pub vertical_limit_hz: f64,
    /// The same of u and v, which the lean follows, Hz.
    pub horizontal_limit_hz: f64,
}

/// Mean wind that carries the eddies past.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CarriedBy {
    /// Speed, m/s.
    pub speed_mps: Estimate,
    /// Direction that it blows towards, degrees clockwise from north; absent: the logs have no heading, or the plan no
    /// orientation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub towards_deg: Option<f64>,
    /// Origin of the speed.
    pub by: CarriedByWhat,
}

/// Origin of the wind that carries eddies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CarriedByWhat {
    /// The lean of the drones.
    Lean,
    /// The lags at which pairs of drones are alike, which were known better.
    Advection,
}

/// One component of the fleet's air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Component {
    /// Mean over the drones and the record, m/s.
    pub mean_mps: f64,
    /// Variance, (m/s)², mean over the drones; absent: the record is too short for its eddies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variance: Option<Moment>,
    /// Variance about the record's own mean, without noise, what blocks took added: what is faster than the record, (m/s)².
    pub within_record: f64,
    /// Variance of the white noise of one value that was taken off, (m/s)².
    pub noise: f64,
    /// Skewness; absent: the record is too short for its eddies.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skewness: Option<Interval>,
    /// Integral scales; absent: the record does not have ten integral times.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scales: Option<Scales>,
    /// Relative standard error of the scale of values: the law's slope for w, the drag for u and v.
    pub scale_se: f64,
    /// Mean spectrum over the drones, corrected for response and noise.
    pub spectrum: Vec<Band>,
}

/// Convective velocity scale from the variance of w, by the profile of Lenschow, Wyngaard and Pennell (1980):
/// `σw² = 1.8 w*² (z/zi)^(2/3) (1 - 0.8 z/zi)²`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Convective {
    /// The scale w*, m/s; its interval is that of the variance alone.
    pub velocity_mps: Interval,
    /// Depth of the mixed layer that was given, zi, m.
    pub mixed_layer_depth_m: f64,
    /// Mean height of the drones, z, m.
    pub height_m: f64,
}

impl Convective {
    /// The scale of a variance of w at a height in a mixed layer; `None`: the height is not within it.
    pub fn of(variance: &Moment, height_m: f64, depth_m: f64) -> Option<Self> {
        let share = height_m / depth_m;
        let within = share > 0.0 && share < 1.0;
        let profile = 1.8 * share.powf(2.0 / 3.0) * (1.0 - 0.8 * share).powi(2);
        let scale = |variance: f64| (variance.max(0.0) / profile).sqrt();
        let velocity_mps = Interval {
            value: scale(variance.value),
            low: scale(variance.low),
            high: scale(variance.high),
        };
        within.then_some(Self { velocity_mps, mixed_layer_depth_m: depth_m, height_m })
    }
}

/// Integral scales of a component.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Scales {
    /// Integral time at a drone, s.
    pub time_s: Interval,
    /// Integral length along the wind, m: time and wind; absent: no wind is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length_m: Option<Interval>,
    /// Random error of the mean over one drone's record, in standard deviations of the air.
    pub mean_error: f64,
    /// Relative random error of one drone's variance.
    pub variance_error: f64,
    /// Relative part of the variance that the record's own mean takes, and that was added again.
    pub lost: f64,
    /// Length of a record whose variance has a relative random error of a tenth, s.
    pub for_a_tenth_s: f64,
}

/// A value with its 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Interval {
    /// Best value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// The vertical air at pairs of drones that are so far apart.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AtDistance {
    /// Mean distance, m.
    pub distance_m: f64,
    /// Number of pairs.
    pub pairs: usize,
    /// Mean covariance without lag, (m/s)².
    pub covariance: Interval,
    /// Covariance over the fleet's variance; absent where that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub correlation: Option<f64>,
    /// Mean covariance at lags of 0, 1, ... s of either sign, (m/s)²; at 0 that of `covariance`.
    pub by_lag: Vec<f64>,
    /// Mean squared coherence of the pairs, by frequency.
    pub coherence: Vec<CoherentBand>,
}

/// Coherence in a band of frequencies.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CoherentBand {
    /// Mean frequency, Hz.
    pub frequency_hz: f64,
    /// Squared coherence, corrected for its bias, mean over the pairs.
    pub coherence: f64,
    /// Squared coherence above which one pair is told from none at 95 %.
    pub one_pair_from: f64,
}

/// How fast the pattern of w passes the drones.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PatternSpeed {
    /// Velocity along show x (forward) and y (left), m/s.
    pub velocity_mps: [f64; 2],
    /// Speed with its standard error, m/s.
    pub speed_mps: Estimate,
    /// Pairs that it is from.
    pub pairs: usize,
    /// Speed over that of the wind by the lean; absent: that is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over_lean: Option<Estimate>,
    /// Angle from the wind's direction by the lean, degrees, clockwise positive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub turned_deg: Option<f64>,
}

/// Turbulence at one drone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DroneTurbulence {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Known length of its record, s.
    pub length_s: f64,
    /// Variance of w, (m/s)².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vertical: Option<Moment>,
    /// Skewness of w.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub skewness: Option<Interval>,
    /// Variance of u, (m/s)².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub along: Option<Moment>,
    /// Variance of v, (m/s)².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub across: Option<Moment>,
    /// Turbulent kinetic energy, m²/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kinetic_energy: Option<Interval>,
    /// Covariance of u and w, m²/s².
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flux_along: Option<Interval>,
    /// Rate of dissipation by w, m²/s³.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dissipation: Option<Interval>,
    /// Spectrum of w.
    pub spectrum: Vec<Band>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_convective_scale_gives_the_variance_back() {
        // Lenschow's profile is highest, at 0.44 w*², about a quarter of the layer up.
        let variance = 1.8 * 0.25_f64.powf(2.0 / 3.0) * 0.64 * 4.0;
        let moment = Moment {
            value: variance,
            low: 0.81 * variance,
            high: 1.44 * variance,
            random: 0.0,
            systematic: 0.0,
            time_s: 0.0,
        };
        let found = Convective::of(&moment, 300.0, 1200.0).unwrap();
        let Interval { value, low, high } = found.velocity_mps;
        assert!((value - 2.0).abs() < 1e-12, "{value}");
        assert!((low - 1.8).abs() < 1e-12 && (high - 2.4).abs() < 1e-12, "{low} {high}");
        for height_m in [1200.0, 1300.0, 0.0, -1.0, f64::NAN] {
            assert!(Convective::of(&moment, height_m, 1200.0).is_none(), "{height_m}");
        }
    }
}
