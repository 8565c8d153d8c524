//! Construction of the air from its specification.

use nalgebra::{Vector2, Vector3};
use sha2::{Digest as _, Sha256};

use super::AirSpec;
use crate::rng::{Purpose, stream};
use crate::sim::air::{
    AllenThermals, DroneConstant, FieldScales, GustSpectrum, Gusts, Lenschow, RandomField, Sum,
    Uniform, WindLaw, WindProfile, convective_length_m, convective_sd_mps,
};
use skybrush_show::frame::ShowFrame;

/// Specified air: its uniform part, and the rest.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Air {
    /// Sum of the uniform parts, towards east, north and up, m/s.
    pub uniform_mps: [f64; 3],
    /// All other components, in the order of the specification.
    pub moving: Vec<AirSpec>,
    /// Components that are read from files ([`GriddedAir`](crate::sim::air::GriddedAir)): who has a reader of them
    /// adds them to what [`build`] makes.
    pub read: Vec<AirSpec>,
}

impl Air {
    /// Joins components with a uniform motion (east, north, up, m/s).
    pub fn new(uniform_mps: [f64; 3], specs: &[AirSpec]) -> Self {
        let mut air = Self { uniform_mps, ..Self::default() };
        for spec in specs {
            let part = match spec.kind().name {
                "still" => [0.0; 3],
                "uniform" => [spec.value("east"), spec.value("north"), spec.value("up")],
                "wind" => towards(spec.value("speed"), spec.value("from")),
                "les" => {
                    air.read.push(spec.clone());
                    continue;
                }
                _ => {
                    air.moving.push(spec.clone());
                    continue;
                }
            };
            for (sum, part) in air.uniform_mps.iter_mut().zip(part) {
                *sum += part;
            }
        }
        air
    }

    /// Specifications of the moving components as text, for records.
    pub fn texts(&self) -> Vec<String> {
        self.moving.iter().chain(&self.read).map(ToString::to_string).collect()
    }

    /// Wind that fields move along with, east, north, up, m/s: that of the uniform part and of the
    /// profiles at their reference heights.
    fn mean_wind_mps(&self) -> [f64; 3] {
        let [mut east, mut north, _] = self.uniform_mps;
        for spec in self.moving.iter().filter(|spec| spec.kind().name == "profile") {
            let wind = towards(spec.value("speed"), spec.value("from"));
            east += wind[0];
            north += wind[1];
        }
        [east, north, 0.0]
    }
}

/// A wind's velocity towards east, north and up, m/s, from its speed and the direction it comes from, degrees.
pub fn towards(speed_mps: f64, from_deg: f64) -> [f64; 3] {
    let (sin, cos) = from_deg.to_radians().sin_cos();
    // Adding zero turns -0 into 0, which reads better in files.
    [-speed_mps * sin + 0.0, -speed_mps * cos + 0.0, 0.0]
}

/// Draws the air of one flight in a show's frame, except what is read from files ([`Air::read`]).
///
/// The flight's name goes into the seed: flights of a campaign are flown at different hours, in
/// different air.
pub fn build(air: &Air, frame: &ShowFrame, seed: u64, flight: &str) -> Sum {
    let seed = seed ^ fingerprint(flight);
    let show = |[east, north, up]: [f64; 3]| frame.from_neu(Vector3::new(north, east, up));
    let mean_wind_mps = show(air.mean_wind_mps());
    let mut sum = Sum(vec![Box::new(Uniform(show(air.uniform_mps)))]);
    for (component, spec) in (0_u16..).zip(&air.moving) {
        let wind_mps = match spec.given("wind") {
            Some(speed_mps) => show(towards(speed_mps, spec.value("from"))),
            None => mean_wind_mps,
        };
        // Slots start at 1: stream 0 of a component is what all drones share.
        let mut rng = stream(seed, u64::from(component) << 16, Purpose::Air);
        let value = |name| spec.value(name);
        let modes = value("modes") as usize;
        let (w_star_mps, zi_m) = (value("w_star"), value("zi"));
        match spec.kind().name {
            "profile" => sum.0.push(Box::new(WindProfile {
                reference_mps: show(towards(value("speed"), value("from"))),
                reference_height_m: value("height"),
                law: match spec.given("alpha") {
                    Some(alpha) => WindLaw::Power { alpha },
                    None => WindLaw::Log { roughness_m: value("z0") },
                },
            })),
            "drone-constant" => {
                sum.0.push(Box::new(DroneConstant { sd_mps: value("sd"), seed, component }));
            }
            "thermals" => {
                let first_m = spec.given("x").zip(spec.given("y")).map(|(x, y)| Vector2::new(x, y));
                let count = value("n") as usize;
                sum.0.push(Box::new(AllenThermals::random(
                    w_star_mps, zi_m, wind_mps, count, first_m, &mut rng,
                )));
            }
            "lenschow" => {
                let height_m = value("height").min(zi_m);
                let length_m =
                    spec.given("lambda").unwrap_or_else(|| convective_length_m(zi_m, height_m));
                let sd_mps = convective_sd_mps(w_star_mps, zi_m, height_m).max(0.01);
                let scales = FieldScales {
                    sd_mps,
                    length_m: Vector3::repeat(length_m),
                    time_s: spec.given("tau").unwrap_or(length_m / sd_mps),
                    wind_mps,
                    waves: modes,
                };
                sum.0.push(Box::new(Lenschow::new(w_star_mps, zi_m, &scales, &mut rng)));
            }
            "field" => {
                let length_m = value("lambda");
                let other = |name| spec.given(name).unwrap_or(length_m);
                let scales = FieldScales {
                    sd_mps: value("sd"),
                    length_m: Vector3::new(length_m, other("lambda_y"), other("lambda_z")),
                    time_s: value("tau"),
                    wind_mps,
                    waves: modes,
                };
                sum.0.push(Box::new(RandomField::new(&scales, &mut rng)));
            }
            name @ ("dryden" | "von-karman") => {
                let spectrum =
                    if name == "dryden" { GustSpectrum::Dryden } else { GustSpectrum::VonKarman };
                let (sd_mps, length_m) = (value("sd"), value("length"));
                sum.0.push(Box::new(Gusts::new(
                    spectrum, sd_mps, length_m, wind_mps, modes, &mut rng,
                )));
            }
            // Uniform kinds are in the uniform part.
            _ => {}
        }
    }
    sum
}

/// A number that differs between names.
fn fingerprint(name: &str) -> u64 {
    let digest = Sha256::digest(name.as_bytes());
    digest.iter().take(8).fold(0, |number, byte| number << 8 | u64::from(*byte))
}

#[cfg(test)]
mod tests {
    use skybrush_show::frame::Geodetic;

    use super::*;
    use crate::sim::air::Atmosphere as _;

    /// Updraft at drone 3, 20 m up, after 5 s, of seed 7.
    fn updraft_mps(parts: &[&str], flight: &str) -> f64 {
        let specs: Vec<AirSpec> = parts.iter().map(|part| part.parse().unwrap()).collect();
        let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 100.0 };
        let frame = ShowFrame { origin, orientation_deg: 0.0 };
        let air = build(&Air::new([0.0; 3], &specs), &frame, 7, flight);
        air.sampler(3).air_velocity(&Vector3::new(0.0, 0.0, 20.0), 5.0).z
    }

    #[test]
    fn parts_are_drawn_by_their_place_and_the_flights_name() {
        let (own, field) = ("drone-constant:sd=1", "field:sd=1,lambda=50,tau=30");
        let drawn = [
            updraft_mps(&[own], "ladder"),
            updraft_mps(&[own, own], "ladder"),
            updraft_mps(&[own], "hover"),
            updraft_mps(&[field], "ladder"),
            updraft_mps(&[own, field], "ladder"),
        ];
        let pinned = [
            0.592_156_666_987_890_8,
            0.360_368_362_108_959_06,
            0.627_839_930_998_607_1,
            -0.769_790_689_652_503_7,
            0.785_418_049_369_751_3,
        ];
        assert_eq!(drawn, pinned);
    }
}
