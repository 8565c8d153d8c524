//! Air on a grid that somebody else computed: the output of a large-eddy simulation, for one.
//!
//! Values come block by block from a [`GridSource`], so that memory is bounded whatever the size of the
//! model. Each component has axes of its own, as models stagger them. Between the points values are
//! linear in each direction and in time.

mod axis;
mod blocks;

use nalgebra::{Vector2, Vector3};

use super::{AirSampler, Atmosphere};
pub use axis::{Heights, Regular};
pub use blocks::Block;
use blocks::{Blocks, Held, HeldBlock, Key};

/// Component of the velocity along an axis of the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Component {
    /// Velocity along the model's x axis.
    U,
    /// Velocity along the model's y axis, which is to the left of x.
    V,
    /// Vertical velocity, up positive.
    W,
}

impl Component {
    /// All three, in the order of the model's axes.
    pub const ALL: [Self; 3] = [Self::U, Self::V, Self::W];
}

/// Whoever has the values of a grid.
pub trait GridSource: Send + Sync {
    /// Values of a component at one of the model's times (counted from 0), m/s, in the order of the block: x
    /// fastest, then y, then z. NaN where there is no air.
    ///
    /// # Errors
    /// A sentence that says what could not be read, and what to do.
    fn read(&self, component: Component, time: usize, block: &Block) -> Result<Vec<f32>, String>;
}

/// Points of one component.
#[derive(Clone, Debug, PartialEq)]
pub struct Points {
    /// Along x, m in the model.
    pub x: Regular,
    /// Along y, m in the model.
    pub y: Regular,
    /// Heights, m in the model.
    pub z: Heights,
}

/// Points and times of a model.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    /// Points of the three components.
    pub points: [Points; 3],
    /// Times of the model, s, rising.
    pub times_s: Vec<f64>,
    /// Whether the model repeats itself in x and y.
    pub repeats: bool,
}

/// Place of the show in the model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    /// Place of the show's origin in the model, m.
    pub origin_m: Vector3<f64>,
    /// Direction of the model's x axis in the show frame, radians to the left of the show's x.
    pub turned_rad: f64,
}

/// How the model's time goes on in the flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Passage {
    /// As in the model, from this time of the model at show time 0, s.
    Replay {
        /// The model's time at show time 0, s.
        start_s: f64,
    },
    /// The air of one time, carried along as it is (Taylor's hypothesis).
    Advect {
        /// Number of the time, from 0.
        time: usize,
        /// Velocity at which it is carried, along the model's x and y, m/s.
        wind_mps: Vector2<f64>,
    },
}

/// The air of a grid in a show.
pub struct GriddedAir {
    source: Box<dyn GridSource>,
    grid: Grid,
    placing: Placing,
    passage: Passage,
    blocks: Blocks,
}

impl GriddedAir {
    /// Puts a model's air into a show.
    pub fn new(
        source: Box<dyn GridSource>,
        grid: Grid,
        placing: Placing,
        passage: Passage,
    ) -> Self {
        Self { source, grid, placing, passage, blocks: Blocks::default() }
    }

    /// First block that could not be read, in words. The air that was answered since is not the model's.
    pub fn failure(&self) -> Option<String> {
        self.blocks.failure()
    }

    /// Whether the model has air at a place (show frame, m) and show time: whether any point around it has a
    /// vertical velocity, within the model's heights.
    pub fn has_air(&self, position_m: &Vector3<f64>, time_s: f64) -> bool {
        let mut held = Held::default();
        let at = self.to_model(position_m, time_s);
        let (index, _) = self.moment(time_s);
        self.component(Component::W, &at, index, &mut held.of(Component::W)[0]).is_some()
    }

    /// Place in the model, m: of the frozen air where that is carried.
    fn to_model(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        let (sin, cos) = self.placing.turned_rad.sin_cos();
        let mut at = self.placing.origin_m
            + Vector3::new(
                cos * position_m.x + sin * position_m.y,
                cos * position_m.y - sin * position_m.x,
                position_m.z,
            );
        if let Passage::Advect { wind_mps, .. } = self.passage {
            at.x -= wind_mps.x * time_s;
            at.y -= wind_mps.y * time_s;
        }
        at
    }

    /// The model's time before a show time, and the share of the way to the next.
    fn moment(&self, time_s: f64) -> (usize, f64) {
        match self.passage {
            Passage::Advect { time, .. } => (time, 0.0),
            Passage::Replay { start_s } => axis::bracket(&self.grid.times_s, start_s + time_s),
        }
    }

    fn velocity(&self, position_m: &Vector3<f64>, time_s: f64, held: &mut Held) -> Vector3<f64> {
        let at = self.to_model(position_m, time_s);
        let (index, share) = self.moment(time_s);
        let [x, y, up] = Component::ALL.map(|component| {
            let [now, then] = held.of(component);
            // No air is in a wall or below the ground, where nothing moves.
            let value =
                |time, slot: &mut _| self.component(component, &at, time, slot).unwrap_or(0.0);
            let from = value(index, now);
            if share > 0.0 { from + share * (value(index + 1, then) - from) } else { from }
        });
        let (sin, cos) = self.placing.turned_rad.sin_cos();
        Vector3::new(cos * x - sin * y, sin * x + cos * y, up)
    }

    /// One component at a place of the model; `None` where no point around it has air.
    fn component(
        &self,
        component: Component,
        at: &Vector3<f64>,
        time: usize,
        held: &mut HeldBlock,
    ) -> Option<f64> {
        let points = &self.grid.points[component as usize];
        let (k, along_z, scale) = points.z.at(at.z, component == Component::W);
        let (j, along_y) = points.y.at(at.y, self.grid.repeats);
        let (i, along_x) = points.x.at(at.x, self.grid.repeats);
        let key = Key::around(component, time, [k, j, i]);
        let is_there = matches!(held, Some((there, _)) if *there == key);
        if !is_there {
            *held = Some((key, self.blocks.get(&*self.source, points, self.grid.repeats, key)));
        }
        let values = held.as_ref().map(|(_, values)| values)?;
        let mut sum = 0.0;
        let mut is_air = false;
        for (dk, weight_z) in [(0, 1.0 - along_z), (1, along_z)] {
            for (dj, weight_y) in [(0, 1.0 - along_y), (1, along_y)] {
                for (di, weight_x) in [(0, 1.0 - along_x), (1, along_x)] {
                    let weight = weight_z * weight_y * weight_x;
                    if weight == 0.0 {
                        continue;
                    }
                    let value = f64::from(values.at([k + dk, j + dj, i + di]));
                    if value.is_finite() {
                        is_air = true;
                        sum += weight * value;
                    }
                }
            }
        }
        is_air.then_some(sum * scale)
    }
}

impl Atmosphere for GriddedAir {
    fn air_velocity(&self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.velocity(position_m, time_s, &mut Held::default())
    }

    fn sampler(&self, _drone: u16) -> Box<dyn AirSampler + Send + '_> {
        Box::new(Sampler { air: self, held: Held::default() })
    }
}

/// Keeps the blocks around one drone, so that most queries take no lock.
struct Sampler<'a> {
    air: &'a GriddedAir,
    held: Held,
}

impl AirSampler for Sampler<'_> {
    fn air_velocity(&mut self, position_m: &Vector3<f64>, time_s: f64) -> Vector3<f64> {
        self.air.velocity(position_m, time_s, &mut self.held)
    }
}

#[cfg(test)]
mod tests;
