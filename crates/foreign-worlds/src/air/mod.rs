//! Motion of the air: updraft and wind at any place and time.

mod field;
mod shear;
mod thermal;

pub use field::{Field, FieldSettings};
pub use shear::{REFERENCE_M, Shear};
pub use thermal::{Profile, ThermalSettings};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::random::{Purpose, Series, stream};
use crate::vector::Vector;

/// Distance of the values of a drone's own gusts in time, s.
const OWN_STEP_S: f64 = 0.2;
/// The same of what all drones share, s.
const SHARED_STEP_S: f64 = 0.5;

/// Scales of the air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AirSettings {
    /// Updraft that is everywhere and always the same, m/s.
    pub updraft_mps: f64,
    /// Standard deviation of the updraft that all drones share, m/s.
    pub shared_mps: f64,
    /// Its correlation time, s.
    pub shared_s: f64,
    /// Standard deviation of each drone's own vertical gusts, m/s.
    pub own_mps: f64,
    /// Their correlation time, s.
    pub own_s: f64,
    /// A field of the updraft in space, if there is one.
    pub field: Option<FieldSettings>,
    /// A thermal, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub thermal: Option<ThermalSettings>,
    /// Mean horizontal wind at the reference height, show frame x and y, m/s.
    pub wind_mps: [f64; 2],
    /// How the wind grows with height.
    pub shear: Shear,
    /// Standard deviation of each axis' shared gusts as a share of the wind.
    pub gust_share: f64,
    /// Their correlation time, s.
    pub gust_s: f64,
    /// The same of the gusts that each drone has for itself.
    pub own_gust_share: f64,
    /// Their correlation time, s.
    pub own_gust_s: f64,
}

/// The air of one flight.
#[derive(Clone, Debug)]
pub struct Air {
    settings: AirSettings,
    span_s: [f64; 2],
    seed: u64,
    shared: Series,
    field: Option<Field>,
    gusts: [Series; 2],
}

impl Air {
    /// Draws the air of a flight that lasts from `span_s[0]` to `span_s[1]`, show time.
    pub fn new(settings: &AirSettings, span_s: [f64; 2], seed: u64) -> Self {
        let [x, y] = settings.wind_mps;
        let gust_mps = settings.gust_share * x.hypot(y);
        let series = |sd, time_s, drone| {
            let rng = stream(seed, drone, Purpose::SharedAir);
            Series::draw(sd, time_s, span_s, SHARED_STEP_S, rng)
        };
        Self {
            settings: settings.clone(),
            span_s,
            seed,
            shared: series(settings.shared_mps, settings.shared_s, 0),
            field: settings.field.as_ref().map(|field| Field::new(field, settings.wind_mps, seed)),
            gusts: [1, 2].map(|axis| series(gust_mps, settings.gust_s, axis)),
        }
    }

    /// The air at one drone.
    pub fn around(&self, drone: u16) -> Around<'_> {
        let [x, y] = self.settings.wind_mps;
        let gust_mps = self.settings.own_gust_share * x.hypot(y);
        let series = |sd, time_s, axis: u64| {
            let rng = stream(self.seed ^ (axis << 40), drone, Purpose::OwnAir);
            Series::draw(sd, time_s, self.span_s, OWN_STEP_S, rng)
        };
        Around {
            air: self,
            own: series(self.settings.own_mps, self.settings.own_s, 0),
            gusts: [1, 2].map(|axis| series(gust_mps, self.settings.own_gust_s, axis)),
            known: None,
        }
    }
}

/// The air at one drone.
#[derive(Clone, Debug)]
pub struct Around<'a> {
    air: &'a Air,
    own: Series,
    gusts: [Series; 2],
    /// The field at the last moment that it was computed for, and when.
    known: Option<(f64, f64)>,
}

/// The field is computed this often and held between, s: it changes over tens of seconds.
const FIELD_STEP_S: f64 = 0.1;

impl Around<'_> {
    /// Velocity of the air at a place (show frame, m) and show time, m/s.
    pub fn velocity_mps(&mut self, position_m: Vector, time_s: f64) -> Vector {
        let settings = &self.air.settings;
        let ratio = settings.shear.ratio(position_m[2]);
        let horizontal = [0, 1].map(|axis| {
            let gusts = self.air.gusts[axis].at(time_s) + self.gusts[axis].at(time_s);
            ratio * (settings.wind_mps[axis] + gusts)
        });
        let field_mps = match (&self.air.field, self.known) {
            (None, _) => 0.0,
            (Some(_), Some((at_s, value))) if (time_s - at_s).abs() < FIELD_STEP_S => value,
            (Some(field), _) => {
                let value = field.updraft_mps(position_m, time_s);
                self.known = Some((time_s, value));
                value
            }
        };
        let [x, y, _] = position_m;
        let thermal_mps =
            settings.thermal.map_or(0.0, |thermal| thermal.updraft_mps([x, y], time_s));
        let shared_mps = settings.updraft_mps + self.air.shared.at(time_s);
        let up = shared_mps + self.own.at(time_s) + field_mps + thermal_mps;
        [horizontal[0], horizontal[1], up]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings() -> AirSettings {
        AirSettings {
            updraft_mps: 1.5,
            shared_mps: 0.3,
            shared_s: 40.0,
            own_mps: 0.2,
            own_s: 8.0,
            field: Some(FieldSettings {
                sd_mps: 0.4,
                length_m: 60.0,
                time_s: 60.0,
                is_advected: true,
                waves: None,
                stretch: None,
            }),
            thermal: None,
            wind_mps: [3.0, -4.0],
            shear: Shear::Power { exponent: 0.2 },
            gust_share: 0.15,
            gust_s: 60.0,
            own_gust_share: 0.05,
            own_gust_s: 5.0,
        }
    }

    #[test]
    fn the_updraft_has_its_mean_and_variance_over_many_flights() {
        let (mut sum, mut square, mut count) = (0.0, 0.0, 0.0);
        for seed in 0..150 {
            let air = Air::new(&settings(), [-20.0, 700.0], seed);
            for drone in 1..=4 {
                let mut around = air.around(drone);
                for time_s in [0.0, 300.0, 600.0] {
                    let place = [f64::from(drone) * 7.0, 0.0, 10.0];
                    let off = around.velocity_mps(place, time_s)[2] - 1.5;
                    sum += off;
                    square += off * off;
                    count += 1.0;
                }
            }
        }
        let wanted = 0.3_f64.powi(2) + 0.2_f64.powi(2) + 0.4_f64.powi(2);
        assert!((square / count / wanted - 1.0).abs() < 0.15, "{}", square / count);
        assert!((sum / count).abs() < 0.06, "{}", sum / count);
    }

    #[test]
    fn drones_share_the_wind_and_have_gusts_of_their_own() {
        let air = Air::new(&settings(), [-20.0, 700.0], 3);
        let at = |drone, height_m| air.around(drone).velocity_mps([0.0, 0.0, height_m], 50.0);
        assert_eq!(at(1, 10.0), at(1, 10.0));
        assert_ne!(at(1, 10.0)[2], at(2, 10.0)[2]);
        assert!((at(1, 10.0)[0] - at(2, 10.0)[0]).abs() < 1.5);
        let ratio = at(1, 80.0)[0] / at(1, 10.0)[0];
        assert!((ratio - 8.0_f64.powf(0.2)).abs() < 1e-12, "{ratio}");
    }
}
