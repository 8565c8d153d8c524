//! Extent of a model's output, and the check that a flight is inside of it.

use std::path::PathBuf;
use std::sync::Arc;

use nalgebra::Vector3;

use super::LesError;
use crate::base::plain::Shown as _;
use crate::sim::air::GriddedAir;

/// Drones this low may stand where the model has none of its air, m.
const LOW_M: f64 = 1.0;

/// Air of a model that was opened.
#[derive(Clone)]
pub struct Les {
    /// Motion of the air in the show.
    pub air: Arc<GriddedAir>,
    /// Extent of the model, and its place in the show.
    pub about: About,
}

/// Extent of a model's output, and its place in the show.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Name of the model: `PALM`, `MicroHH`, `CM1`, or how its variables were found.
    pub model: String,
    /// Files that hold the components, each once, and the mapping.
    pub files: Vec<PathBuf>,
    /// Numbers of points of w along x, y and z.
    pub points: [usize; 3],
    /// Distances of the points along x and y, m.
    pub spacing_m: [f64; 2],
    /// Heights that all components have, above the show's ground, m: below 0 where the ground lies in the model.
    pub heights_m: (f64, f64),
    /// Distance of the two lowest heights of w, m.
    pub lowest_step_m: f64,
    /// First and last time, s, and their number.
    pub times_s: (f64, f64, usize),
    /// Lengths after which the model repeats itself, m.
    pub period_m: [f64; 2],
    /// Whether it does.
    pub repeats: bool,
    /// Edges of the model along x and y, m in the model, within which all components have points.
    pub edges_m: [(f64, f64); 2],
    /// The model's time at show time 0, s: the only one where air is carried.
    pub start_s: f64,
    /// Velocity at which frozen air is carried towards east and north, m/s; `None`: a replay.
    pub carried_mps: Option<[f64; 2]>,
    /// The show's origin in the model, m.
    pub origin_m: [f64; 3],
    /// Direction of the model's x axis in the show frame, radians to the left.
    pub turned_rad: f64,
    /// Carried air: its velocity along the model's x and y, m/s.
    pub carried_in_model_mps: [f64; 2],
}

impl About {
    /// The extent in a sentence or two.
    pub fn words(&self) -> String {
        let files: Vec<String> = self.files.iter().map(|path| path.shown().to_string()).collect();
        let [nx, ny, nz] = self.points;
        let [dx, dy] = self.spacing_m;
        let spacing = if (dx - dy).abs() < 1e-6 * dx {
            format!("{dx:.4}")
        } else {
            format!("{dx:.4} and {dy:.4}")
        };
        let (low_m, high_m) = (self.heights_m.0.max(0.0), self.heights_m.1);
        let (first_s, last_s, times) = self.times_s;
        let [lx, ly] = self.period_m;
        let repeats = if self.repeats {
            format!("repeated every {lx:.0} x {ly:.0} m")
        } else {
            format!("{lx:.0} x {ly:.0} m, not repeated")
        };
        let passage = match self.carried_mps {
            None => format!("replayed from {:.1} s on", self.start_s),
            Some([east, north]) => format!(
                "that of {:.1} s carried at {:.1} m/s towards {:.0} degrees",
                self.start_s,
                east.hypot(north),
                east.atan2(north).to_degrees().rem_euclid(360.0)
            ),
        };
        let time = if times == 1 {
            format!("one time, {first_s:.1} s")
        } else {
            format!("{times} times from {first_s:.1} to {last_s:.1} s")
        };
        format!(
            "Air of {} ({}): {nx} x {ny} x {nz} points every {} m, heights {low_m:.1} to {high_m:.1} m, {time}; {passage}, {repeats}",
            files.join(", "),
            self.model,
            spacing.trim_end_matches('0').trim_end_matches('.'),
        )
    }

    /// Caution about heights below the model's lowest points, if these are high.
    pub fn caution(&self) -> Option<String> {
        let (low_m, _) = self.heights_m;
        (low_m > 1.5 * self.lowest_step_m).then(|| {
            format!(
                "the model's lowest points are {low_m:.1} m above the ground: below them the wind is that of the lowest \
                 points, and the vertical velocity falls to none at the ground"
            )
        })
    }

    fn outside(&self, reason: String) -> LesError {
        let file = self.files.first().map(|path| path.shown().to_string()).unwrap_or_default();
        LesError::Outside { file, reason }
    }

    /// Whether the model's times cover a flight of this duration, s.
    ///
    /// # Errors
    /// [`LesError::Outside`] with what it covers, and what to do.
    pub fn check_times(&self, duration_s: f64) -> Result<(), LesError> {
        let (first_s, last_s, times) = self.times_s;
        if self.carried_mps.is_some() {
            return Ok(());
        }
        if times < 2 {
            return Err(self.outside(format!(
                "there is one time ({first_s:.1} s), which cannot be replayed: give mode=advect to have it carried by \
                 the wind"
            )));
        }
        let end_s = self.start_s + duration_s;
        if self.start_s < first_s || end_s > last_s {
            return Err(self.outside(format!(
                "the flight takes {duration_s:.0} s, from {:.1} to {end_s:.1} s of the model, whose times are {first_s:.1} \
                 to {last_s:.1} s: choose another start=, a shorter flight, or mode=advect",
                self.start_s
            )));
        }
        Ok(())
    }

    /// Whether the model covers a drone at a place (show frame, m) and show time.
    ///
    /// # Errors
    /// [`LesError::Outside`] with the place, what is covered, and what to do.
    pub fn check_place(
        &self,
        air: &GriddedAir,
        slot: u16,
        position_m: &Vector3<f64>,
        time_s: f64,
    ) -> Result<(), LesError> {
        let (_, high_m) = self.heights_m;
        let here = |what: String| {
            Err(self.outside(format!("drone {slot}, {time_s:.0} s into the flight: {what}")))
        };
        if position_m.z > high_m {
            return here(format!(
                "it flies {:.1} m above ground, and the model ends at {high_m:.1} m: fly lower (--height), or give a \
                 model that is higher",
                position_m.z
            ));
        }
        let (sin, cos) = self.turned_rad.sin_cos();
        let at = [
            self.origin_m[0] + cos * position_m.x + sin * position_m.y
                - self.carried_in_model_mps[0] * time_s,
            self.origin_m[1] + cos * position_m.y
                - sin * position_m.x
                - self.carried_in_model_mps[1] * time_s,
        ];
        for ((name, m), (from_m, to_m)) in ["x", "y"].into_iter().zip(at).zip(self.edges_m) {
            if !self.repeats && !(from_m..=to_m).contains(&m) {
                return here(format!(
                    "it meets air of the model's {name} = {m:.1} m, and the model is from {from_m:.1} to {to_m:.1} m: move \
                     the show in it (x=, y=), or let the model repeat itself (repeat=1)"
                ));
            }
        }
        if position_m.z > LOW_M && !air.has_air(position_m, time_s) {
            return here(format!(
                "at x = {:.1}, y = {:.1}, z = {:.1} m of the model there is no air (fill values): it is inside of ground or \
                 buildings, or nothing was written there; move the show in the model (x=, y=, ground=)",
                at[0],
                at[1],
                self.origin_m[2] + position_m.z
            ));
        }
        Ok(())
    }
}
