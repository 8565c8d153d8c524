//! Horizontal wind from the lean of drones that hold their place against it.

use super::result::{DroneWind, TiltWind};
use super::words::digits;
use crate::analysis::lean_table::LeanTable;
use crate::base::estimate::Estimate;
use crate::numeric::{Moments, mean};

/// A lean that is no wind: trim of the accelerometers, a centre of mass off the middle, degrees. Chosen.
pub(in crate::analysis) const TRIM_DEG: f64 = 0.2;
/// Steepest lean that is taken for wind: its tangent. Convention.
const STEEPEST: f64 = 2.0;

/// How well a vehicle's file knows its drag, as a share of the wind's speed.
pub const DRAG_SHARE: f64 = 1.0 / 3.0;
/// The same of a vehicle that is a box: the drag factors of its sides differ by as much (docs/physics.md, 2.6).
const FACES_SHARE: f64 = 0.08;

/// Mean lean of one drone.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeanLean {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label of the drone.
    pub name: String,
    /// Angle of the mean attitude from the vertical, degrees.
    pub lean_deg: f64,
    /// Tangents of the mean lean forward and to the right, in the frame of the vehicle.
    pub forward_right: [f64; 2],
    /// Heading of the vehicle, degrees clockwise from north; `None`: not known.
    pub heading_deg: Option<f64>,
}

/// Relation between wind and lean.
#[derive(Clone, Copy, Debug)]
pub enum LeanDrag<'a> {
    /// The drag on each pair of faces grows with the square of the flow onto them: wind onto one side,
    /// m/s, at which the vehicle would lean by 45 degrees.
    Faces(f64),
    /// The table of leans in the vehicle's file.
    Table(&'a LeanTable),
    /// The drag of the vehicle is not known.
    Unknown,
}

impl LeanDrag<'_> {
    /// The wind of a lean along one axis, m/s.
    fn speed_mps(self, tangent: f64) -> Option<f64> {
        match self {
            Self::Faces(drag) => Some(drag * tangent.min(STEEPEST).sqrt()),
            Self::Table(table) => table.wind_at(tangent.atan().to_degrees()),
            Self::Unknown => None,
        }
    }

    /// Standard error of a wind's speed as a share of it; `None` where no wind follows.
    pub(in crate::analysis) fn share(self) -> Option<f64> {
        match self {
            Self::Faces(_) => Some(FACES_SHARE),
            Self::Table(_) => Some(DRAG_SHARE),
            Self::Unknown => None,
        }
    }

    /// The wind that a lean (tangents forward and to the right) is held against, along the vehicle's own axes, m/s; NaN
    /// beyond the end of a table, and without drag the lean itself.
    pub(in crate::analysis) fn flow(self, forward_right: [f64; 2]) -> [f64; 2] {
        let [forward, right] = forward_right;
        let size = forward.hypot(right);
        match self {
            Self::Faces(_) => forward_right
                .map(|tangent| self.speed_mps(tangent.abs()).unwrap_or(0.0).copysign(tangent)),
            // A rotor's drag points along the wind, whichever side the wind comes from.
            Self::Table(_) if size > 0.0 => {
                let speed = self.speed_mps(size).unwrap_or(f64::NAN);
                [speed * forward / size, speed * right / size]
            }
            Self::Table(_) | Self::Unknown => forward_right,
        }
    }

    /// A speed with the error that the drag adds: digits that the drag does not support are none.
    fn with_own_error(self, speed: Estimate) -> Estimate {
        match self {
            Self::Table(_) => Estimate::new(speed.value, speed.se.hypot(DRAG_SHARE * speed.value)),
            _ => speed,
        }
    }

    /// In words, what the speed rests on.
    fn words(self) -> &'static str {
        match self {
            Self::Table(_) => {
                "the drag of rotors and body in the vehicle's own physics, which a file alone knows to a third"
            }
            _ => "the vehicle's drag",
        }
    }
}

impl MeanLean {
    /// The wind that it leans against along its own axes, m/s; without drag, the lean itself.
    fn flow(&self, drag: LeanDrag<'_>) -> [f64; 2] {
        drag.flow(self.forward_right)
    }

    /// Tangents of an attitude: forward with the nose down, right with the right side down.
    pub(in crate::analysis) fn forward_right_of(roll_rad: f64, pitch_rad: f64) -> [f64; 2] {
        [-pitch_rad.tan(), roll_rad.tan() / pitch_rad.cos()]
    }
}

/// Wind on drones that hold their place. For a lean beyond the end of a vehicle's table, the lean
/// alone is given.
pub fn tilt_wind(leans: &[MeanLean], drag: LeanDrag<'_>) -> Option<TiltWind> {
    let steep = leans.iter().any(|lean| lean.flow(drag).iter().any(|flow| flow.is_nan()));
    let drag = if steep { LeanDrag::Unknown } else { drag };
    let known_speed = !matches!(drag, LeanDrag::Unknown);
    if leans.is_empty() {
        return None;
    }
    let size = |[forward, right]: [f64; 2]| forward.hypot(right);
    let drones: Vec<DroneWind> = leans
        .iter()
        .map(|lean| {
            let flow = lean.flow(drag);
            let bearing = flow[1].atan2(flow[0]).to_degrees();
            DroneWind {
                slot: lean.slot,
                name: lean.name.clone(),
                lean_deg: lean.lean_deg,
                from_deg: lean.heading_deg.map(|heading| (heading + bearing).rem_euclid(360.0)),
                speed_mps: known_speed.then(|| size(flow)),
            }
        })
        .collect();
    // The mean of vectors: leans that point everywhere are no wind.
    let (mut north, mut east, mut known) = (0.0, 0.0, 0.0);
    for (lean, drone) in leans.iter().zip(&drones) {
        if let Some(from) = drone.from_deg {
            let (sin, cos) = from.to_radians().sin_cos();
            north += size(lean.flow(drag)) * cos;
            east += size(lean.flow(drag)) * sin;
            known += 1.0;
        }
    }
    let from_deg = (known > 0.0).then(|| east.atan2(north).to_degrees().rem_euclid(360.0));
    let lean_deg = mean(leans.iter().map(|lean| lean.lean_deg)).unwrap_or(f64::NAN);
    let speed_mps = Moments::of(drones.iter().filter_map(|drone| drone.speed_mps)).map(|speeds| {
        let speed = if known > 0.0 { north.hypot(east) / known } else { speeds.mean };
        Estimate::new(speed, speeds.standard_error().unwrap_or_default())
    });
    let from = from_deg.map_or_else(
        || " from a direction that is not known (the logs have no heading)".to_owned(),
        |from| format!(" from {from:.0} degrees"),
    );
    let words = match (speed_mps, drag.speed_mps(TRIM_DEG.to_radians().tan())) {
        (Some(speed), Some(trim)) => format!(
            "wind {} m/s{from}, from a mean lean of {} degrees and {}{} (a trim error of \
             {TRIM_DEG} degrees alone would read as {} m/s in calm air)",
            drag.with_own_error(speed),
            digits(lean_deg),
            drag.words(),
            match drag {
                LeanDrag::Table(_) => format!("; the drones agree to ± {} m/s", digits(speed.se)),
                _ => String::new(),
            },
            digits(trim)
        ),
        _ => format!(
            "the drones lean by {} degrees into a wind{from}; its speed does not follow, as the \
             vehicle's drag is not known",
            digits(lean_deg)
        ),
    };
    let at = |lean_deg: f64| drag.speed_mps(lean_deg.to_radians().tan());
    let trim_se_mps =
        at(lean_deg + TRIM_DEG).zip(at(lean_deg)).map(|(more, speed)| (more - speed).abs());
    let drag_speed_mps = match drag {
        LeanDrag::Faces(speed_mps) => Some(speed_mps),
        _ => None,
    };
    Some(TiltWind { drag_speed_mps, speed_mps, from_deg, lean_deg, trim_se_mps, drones, words })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fleet(forward_right: [f64; 2], heading_deg: impl Fn(u16) -> Option<f64>) -> Vec<MeanLean> {
        (1..=4)
            .map(|slot| MeanLean {
                slot: Some(slot),
                name: format!("{slot}"),
                lean_deg: forward_right[0].hypot(forward_right[1]).atan().to_degrees(),
                forward_right,
                heading_deg: heading_deg(slot),
            })
            .collect()
    }

    #[test]
    fn a_lean_with_known_drag_is_a_wind() {
        // AirSim's stock quad leans by 3.92 degrees in 10 m/s.
        let forward = 3.92_f64.to_radians().tan();
        let wind =
            tilt_wind(&fleet([forward, 0.0], |_| Some(350.0)), LeanDrag::Faces(38.2)).unwrap();
        let speed = wind.speed_mps.unwrap();
        assert!((speed.value - 10.0).abs() < 0.05 && speed.se < 1e-9, "{speed}");
        assert!((wind.from_deg.unwrap() - 350.0).abs() < 1e-9);
        insta::assert_snapshot!(wind.words);
    }

    #[test]
    fn wind_on_a_corner_is_the_wind_on_its_sides() {
        let tangent = |mps: f64| (mps / 38.2_f64).powi(2);
        let corner = fleet([tangent(8.0), -tangent(6.0)], |_| Some(20.0));
        let wind = tilt_wind(&corner, LeanDrag::Faces(38.2)).unwrap();
        assert!((wind.speed_mps.unwrap().value - 10.0).abs() < 1e-9);
        assert!((wind.from_deg.unwrap() - (360.0 + 20.0 - 36.8699)).abs() < 1e-3);
    }

    #[test]
    fn without_drag_only_the_lean_is_told() {
        let forward = 2_f64.to_radians().tan();
        let wind = tilt_wind(&fleet([forward, 0.0], |_| None), LeanDrag::Unknown).unwrap();
        assert_eq!((wind.speed_mps, wind.from_deg), (None, None));
        insta::assert_snapshot!(wind.words);
        assert!(tilt_wind(&[], LeanDrag::Unknown).is_none());
    }

    #[test]
    fn a_vehicles_own_table_tells_the_wind_and_its_end_is_no_wind() {
        let table = LeanTable {
            indicator: crate::flight::Indicator::Pulse,
            lean_step_deg: 1.0,
            wind_mps: vec![0.0, 1.5, 3.0, 4.4],
            ..LeanTable::default()
        };
        // As much of the lean to each side as of the wind.
        let of_lean = |deg: f64| [deg.to_radians().tan() * 0.6, deg.to_radians().tan() * 0.8];
        let leaning = fleet(of_lean(2.0), |_| Some(270.0));
        let wind = tilt_wind(&leaning, LeanDrag::Table(&table)).unwrap();
        assert!((wind.speed_mps.unwrap().value - 3.0).abs() < 1e-9, "{:?}", wind.speed_mps);
        assert!((wind.from_deg.unwrap() - (270.0 + 53.1301)).abs() < 1e-3);
        assert!(wind.words.contains("the drag of rotors and body"), "{}", wind.words);
        let steep = tilt_wind(&fleet(of_lean(9.0), |_| None), LeanDrag::Table(&table)).unwrap();
        assert_eq!(steep.speed_mps, None, "beyond the table");
    }

    #[test]
    fn leans_to_all_sides_are_no_wind() {
        let around = fleet([0.02, 0.0], |slot| Some(f64::from(slot) * 90.0));
        let wind = tilt_wind(&around, LeanDrag::Faces(38.2)).unwrap();
        assert!(wind.speed_mps.unwrap().value < 1e-3, "{:?}", wind.speed_mps);
    }
}
