//! Horizontal wind from the lean of the drones: a drone that holds its place leans against the wind.

use super::result::{DroneWind, TiltWind};
use super::words::digits;
use crate::base::estimate::Estimate;

/// A lean that is no wind: trim of the accelerometers, a centre of mass off the middle, degrees.
const TRIM_DEG: f64 = 0.2;

/// How one drone leans on average.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MeanLean {
    /// Slot number, if planned.
    pub slot: Option<u16>,
    /// Label.
    pub name: String,
    /// Angle of the mean attitude from the vertical, degrees.
    pub lean_deg: f64,
    /// Where it leans to, degrees clockwise from north; `None`: not known.
    pub towards_deg: Option<f64>,
}

/// The wind on drones that hold their place; `drag_speed_mps` is the wind at which the vehicle would
/// lean by 45 degrees, with drag that grows with the square of the wind.
pub fn tilt_wind(leans: &[MeanLean], drag_speed_mps: Option<f64>) -> Option<TiltWind> {
    let count = leans.len() as f64;
    if leans.is_empty() {
        return None;
    }
    let speed_of = |lean_deg: f64| {
        drag_speed_mps.map(|drag| drag * lean_deg.clamp(0.0, 60.0).to_radians().tan().sqrt())
    };
    let drones: Vec<DroneWind> = leans
        .iter()
        .map(|lean| DroneWind {
            slot: lean.slot,
            name: lean.name.clone(),
            lean_deg: lean.lean_deg,
            from_deg: lean.towards_deg,
            speed_mps: speed_of(lean.lean_deg),
        })
        .collect();
    // The mean of vectors: leans that point everywhere are no wind.
    let (mut north, mut east, mut known) = (0.0, 0.0, 0.0);
    for lean in leans {
        if let Some(towards) = lean.towards_deg {
            let (sin, cos) = towards.to_radians().sin_cos();
            let size = lean.lean_deg.to_radians().tan();
            north += size * cos;
            east += size * sin;
            known += 1.0;
        }
    }
    let from_deg = (known > 0.0).then(|| east.atan2(north).to_degrees().rem_euclid(360.0));
    let lean_deg = leans.iter().map(|lean| lean.lean_deg).sum::<f64>() / count;
    let fleet_deg =
        if known > 0.0 { (north.hypot(east) / known).atan().to_degrees() } else { lean_deg };
    let speeds: Vec<f64> = drones.iter().filter_map(|drone| drone.speed_mps).collect();
    let mean = speeds.iter().sum::<f64>() / count;
    let variance =
        speeds.iter().map(|speed| (speed - mean).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
    let speed_mps =
        speed_of(fleet_deg).map(|speed| Estimate::new(speed, (variance / count).sqrt()));
    let from = from_deg.map_or_else(
        || " from a direction that is not known (the logs have no heading)".to_owned(),
        |from| format!(" from {from:.0} degrees"),
    );
    let words = match (speed_mps, speed_of(TRIM_DEG)) {
        (Some(speed), Some(trim)) => format!(
            "wind {speed} m/s{from}, from a mean lean of {} degrees and the vehicle's drag (a trim error \
             of {TRIM_DEG} degrees alone would read as {} m/s in calm air)",
            digits(lean_deg),
            digits(trim)
        ),
        _ => format!(
            "the drones lean by {} degrees into a wind{from}; its speed does not follow, as the \
             vehicle's drag is not known",
            digits(lean_deg)
        ),
    };
    Some(TiltWind { drag_speed_mps, speed_mps, from_deg, lean_deg, drones, words })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fleet(lean_deg: f64, towards_deg: impl Fn(u16) -> Option<f64>) -> Vec<MeanLean> {
        (1..=4)
            .map(|slot| MeanLean {
                slot: Some(slot),
                name: format!("{slot}"),
                lean_deg,
                towards_deg: towards_deg(slot),
            })
            .collect()
    }

    #[test]
    fn a_lean_with_known_drag_is_a_wind() {
        // AirSim's stock quad leans by 3.92 degrees in 10 m/s.
        let wind = tilt_wind(&fleet(3.92, |_| Some(350.0)), Some(38.2)).unwrap();
        let speed = wind.speed_mps.unwrap();
        assert!((speed.value - 10.0).abs() < 0.05 && speed.se < 1e-9, "{speed}");
        assert!((wind.from_deg.unwrap() - 350.0).abs() < 1e-9);
        insta::assert_snapshot!(wind.words);
    }

    #[test]
    fn without_drag_only_the_lean_is_told() {
        let wind = tilt_wind(&fleet(2.0, |_| None), None).unwrap();
        assert_eq!((wind.speed_mps, wind.from_deg), (None, None));
        insta::assert_snapshot!(wind.words);
        assert!(tilt_wind(&[], None).is_none());
    }

    #[test]
    fn leans_to_all_sides_are_no_wind() {
        let around = fleet(1.0, |slot| Some(f64::from(slot) * 90.0));
        let wind = tilt_wind(&around, Some(38.2)).unwrap();
        assert!(wind.speed_mps.unwrap().value < 1e-3, "{:?}", wind.speed_mps);
    }
}
