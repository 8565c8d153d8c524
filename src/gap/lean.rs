//! The wind, from how the fleet leans.

use super::data::Data;
use super::minimise::minimise;
use crate::effects::{find, select};
use crate::sim::plant::drag::Drag;
use crate::vehicle::Vehicle;

const GRAVITY: f64 = 9.80665;
/// Below this slope of the lean a bin's own lean says less than the flight's mean wind, rad/(m/s).
const LEAST_SLOPE: f64 = 0.004;
/// Fastest wind that is believed, m/s.
const FASTEST_MPS: f64 = 25.0;

/// How a vehicle leans at a horizontal air speed: `a v + b v²`, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeanLaw {
    /// Linear part (blade flapping), rad/(m/s).
    pub linear: f64,
    /// Quadratic part (body drag), rad/(m/s)².
    pub square: f64,
}

impl LeanLaw {
    /// What the vehicle's model says at an air density, kg/m³.
    pub fn of(vehicle: &Vehicle, density: f64) -> Self {
        let of = |name: &str, parameter: &str| -> Option<f64> {
            let effect = find(name)?;
            vehicle.effects.get(name).filter(|table| table.on)?;
            let values = select::values_of(effect, vehicle).ok()?;
            let known = effect.definition().parameters;
            values.get(known.iter().position(|known| known.name == parameter)?).copied()
        };
        let factor = Drag::new(&vehicle.airframe).factor_m2();
        let box_m2 = (factor.x * factor.y).sqrt();
        let body_m2 = of("parasitic-drag", "horizontal_m2").unwrap_or(0.0) / 2.0;
        Self {
            linear: of("blade-flapping", "drag_per_weight").unwrap_or(0.0),
            square: density * (box_m2 + body_m2) / (vehicle.airframe.mass_kg * GRAVITY),
        }
    }

    fn lean(self, speed_mps: f64) -> f64 {
        self.linear * speed_mps + self.square * speed_mps * speed_mps
    }

    fn slope(self, speed_mps: f64) -> f64 {
        self.linear + 2.0 * self.square * speed_mps
    }

    /// Air speed over ground-fixed axes by the lean of the thrust axis, m/s.
    fn air(self, lean_rad: [f64; 2]) -> [f64; 2] {
        let lean = lean_rad[0].hypot(lean_rad[1]);
        if lean < 1e-9 {
            return [0.0; 2];
        }
        let speed = if self.square > 1e-12 {
            ((self.linear * self.linear + 4.0 * self.square * lean).sqrt() - self.linear)
                / (2.0 * self.square)
        } else {
            lean / self.linear.max(1e-6)
        };
        let speed = speed.min(FASTEST_MPS);
        [lean_rad[0] / lean * speed, lean_rad[1] / lean * speed]
    }
}

/// The horizontal air as the leans of a flight show it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    /// Mean wind, show frame, towards, m/s.
    pub mean_mps: [f64; 2],
    /// Air speed of each group's drones in each bin, show frame, m/s.
    pub air_mps: Vec<Vec<[f64; 2]>>,
    /// Lean law that the flight's horizontal legs showed; `None`: it has none, and the model's was
    /// taken.
    pub measured: Option<LeanLaw>,
}

/// Finds the wind. Horizontal legs at known speeds measure the lean law as well.
pub fn wind(data: &Data, law: LeanLaw) -> Wind {
    let leans: Vec<Vec<[f64; 2]>> = data
        .groups
        .iter()
        .map(|group| {
            let mean = |bin, axis: usize| group.mean(bin, |values| values.lean_rad[axis]);
            (0..group.bins.len()).map(|bin| [mean(bin, 0), mean(bin, 1)]).collect()
        })
        .collect();
    let each =
        || data.groups.iter().zip(&leans).flat_map(|(group, leans)| group.bins.iter().zip(leans));
    let (mut sum, mut count) = ([0.0; 2], 0.0);
    for (_, lean) in each().filter(|(bin, _)| !bin.is_horizontal()) {
        let air = law.air(*lean);
        sum[0] -= air[0];
        sum[1] -= air[1];
        count += 1.0;
    }
    let mut mean_mps = sum.map(|sum: f64| if count > 0.0 { sum / count } else { 0.0 });
    let mut law = law;
    let mut measured = None;
    if each().filter(|(bin, _)| bin.is_horizontal()).count() >= 4 {
        let start =
            [mean_mps[0], mean_mps[1], law.linear.max(1e-4).ln(), law.square.max(1e-5).ln()];
        // Leans are in units of a tenth of a degree, so that one unit of the sum matters.
        let misfit = |at: &[f64; 4]| {
            let law = LeanLaw { linear: at[2].exp(), square: at[3].exp() };
            let weak = (at[2] - start[2]).powi(2) + (at[3] - start[3]).powi(2);
            let miss = |(bin, lean): (&super::bins::Bin, &[f64; 2])| {
                let air = [bin.velocity_mps[0] - at[0], bin.velocity_mps[1] - at[1]];
                let speed = air[0].hypot(air[1]).max(1e-9);
                let wanted = law.lean(speed);
                let off = |axis: usize| (lean[axis] - wanted * air[axis] / speed) / 0.0017;
                off(0).powi(2) + off(1).powi(2)
            };
            each().map(miss).sum::<f64>() + 0.05 * weak
        };
        let (at, _) = minimise(start, misfit);
        mean_mps = [at[0], at[1]];
        law = LeanLaw { linear: at[2].exp(), square: at[3].exp() };
        measured = Some(law);
    }
    let air_mps = data
        .groups
        .iter()
        .zip(&leans)
        .map(|(group, leans)| {
            let air = |(bin, lean): (&super::bins::Bin, &[f64; 2])| {
                let steady = [bin.velocity_mps[0] - mean_mps[0], bin.velocity_mps[1] - mean_mps[1]];
                let tells = law.slope(steady[0].hypot(steady[1])) > LEAST_SLOPE;
                if tells { law.air(*lean) } else { steady }
            };
            group.bins.iter().zip(leans).map(air).collect()
        })
        .collect();
    Wind { mean_mps, air_mps, measured }
}
