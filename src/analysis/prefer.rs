//! Choice between the two laws for a calibration, and the cases in which the signed quadratic does
//! not describe it.

use super::law::{LawKind, Symbol};
use super::result::{DroneAnalysis, Fit, FlightAnalysis, Laws};
use super::stats::mean_sd;
use super::warning::Warning;

/// Largest W of a calibration's signed quadratic that may be the air's, m/s: a mean over seven minutes of
/// field air has a standard deviation of 0.3 (docs/physics.md, 5.3). Lines give several m/s (2.7).
const LARGEST_CALIBRATION_W_MPS: f64 = 0.5;
/// Fastest vertical air that a calibration is flown in, as a mean over minutes, m/s. A strong thermal;
/// convention.
const FASTEST_AIR_MPS: f64 = 3.0;
/// Beyond this share of the ladder's highest and lowest speed, only one flank of the signed quadratic holds
/// windows. Chosen: the last rung alone is beyond.
const EDGE: f64 = 0.9;
/// A reduced chi² this many times the other law's is clearly worse. Chosen.
const CLEARLY: f64 = 1.5;

/// The law whose fits to the reference's drones have the lower mean reduced chi².
///
/// A signed quadratic that needs a strong W is a parabola's flank standing in for another curve, not
/// air that moved: its inverse is off by that W, and the line is taken.
pub fn better_law(reference: &FlightAnalysis) -> LawKind {
    chosen(reference).0
}

/// [`better_law`], and why in one phrase.
pub(super) fn chosen(reference: &FlightAnalysis) -> (LawKind, String) {
    let own = match reference.drones.as_slice() {
        [drone] => drone.laws.as_ref(),
        _ => None,
    };
    let calm = reference.flock.as_ref().or(own).is_none_or(|laws| {
        let w = laws.signed_quadratic.as_ref().and_then(w_mps);
        w.is_none_or(|w| w.abs() <= LARGEST_CALIBRATION_W_MPS)
    });
    let reduced = |law: LawKind| {
        let values: Vec<f64> = reference
            .drones
            .iter()
            .filter(|drone| drone.partial_ladder.is_none())
            .filter_map(|drone| drone.laws.as_ref()?.of(law)?.chi2_reduced)
            .collect();
        (!values.is_empty()).then(|| mean_sd(&values).0)
    };
    match (reduced(LawKind::Linear), reduced(LawKind::SignedQuadratic)) {
        (Some(linear), Some(quadratic)) => {
            let chi2 = format!(
                "mean chi2/nu of the drones' fits: {linear:.2} with the line, {quadratic:.2} with the \
                 signed quadratic"
            );
            match (quadratic < linear, calm) {
                (true, true) => (LawKind::SignedQuadratic, chi2),
                (true, false) => (
                    LawKind::Linear,
                    format!("{chi2}, but its W* is that of a parabola's flank and no air"),
                ),
                (false, _) => (LawKind::Linear, chi2),
            }
        }
        (None, Some(_)) => (LawKind::SignedQuadratic, "there is no line".to_owned()),
        _ => (LawKind::Linear, "there is no signed quadratic to compare with".to_owned()),
    }
}

/// W of the signed quadratic where it is the vertex of a parabola that stands in for a bent line, and
/// no speed of air: at or beyond the ends of the ladder's speeds, or faster than air moves over a
/// whole calibration. `None` where it may be air, or is known to be.
pub fn vertex_mps(
    laws: &Laws,
    drones: &[DroneAnalysis],
    true_updraft_mps: Option<f64>,
) -> Option<f64> {
    let w = laws.signed_quadratic.as_ref().and_then(w_mps)?;
    if true_updraft_mps.is_some_and(|truth| (w - truth).abs() <= LARGEST_CALIBRATION_W_MPS) {
        return None;
    }
    let [low, high] = speeds_mps(drones)?;
    (w >= EDGE * high || w <= EDGE * low || w.abs() > FASTEST_AIR_MPS).then_some(w)
}

/// Lowest and highest commanded speed of the usable legs, m/s.
fn speeds_mps(drones: &[DroneAnalysis]) -> Option<[f64; 2]> {
    let legs = drones
        .iter()
        .flat_map(|drone| &drone.windows)
        .filter(|window| window.kind.is_leg() && window.rejected.is_empty())
        .map(|window| window.commanded_mps);
    legs.fold(None, |ends, speed| {
        let [low, high] = ends.unwrap_or([0.0; 2]);
        Some([f64::min(low, speed), f64::max(high, speed)])
    })
}

/// That W* is no air ([`vertex_mps`]).
pub(super) fn vertex_caution(
    laws: &Laws,
    drones: &[DroneAnalysis],
    true_updraft_mps: Option<f64>,
) -> Option<Warning> {
    let w_mps = vertex_mps(laws, drones, true_updraft_mps)?;
    Some(Warning::Vertex { w_mps, speeds_mps: speeds_mps(drones)? })
}

/// The law that describes one set of windows better.
pub fn better_of(laws: &Laws) -> Option<LawKind> {
    let reduced = |fit: &Option<Fit>| fit.as_ref().and_then(|fit| fit.chi2_reduced);
    match (reduced(&laws.linear), reduced(&laws.signed_quadratic)) {
        (Some(linear), Some(quadratic)) if quadratic < linear => Some(LawKind::SignedQuadratic),
        (Some(_), _) => Some(LawKind::Linear),
        (None, Some(_)) => Some(LawKind::SignedQuadratic),
        (None, None) => match (&laws.linear, &laws.signed_quadratic) {
            (Some(_), _) => Some(LawKind::Linear),
            (None, quadratic) => quadratic.as_ref().map(|_| LawKind::SignedQuadratic),
        },
    }
}

/// Whether a law describes a set of windows: unless the other law is clearly better.
pub(super) fn describes(laws: &Laws, law: LawKind) -> bool {
    let reduced = |law| laws.of(law).and_then(|fit| fit.chi2_reduced);
    match (reduced(law), reduced(law.other())) {
        (Some(this), Some(other)) => this <= CLEARLY * other,
        _ => true,
    }
}

/// Warning that the signed quadratic is not the shape of these windows; `None` where it is, or
/// where the windows do not tell.
pub fn misfit(laws: &Laws) -> Option<Warning> {
    let (square, line) = (laws.signed_quadratic.as_ref()?, laws.linear.as_ref()?);
    let (quadratic, linear) = (square.chi2_reduced?, line.chi2_reduced?);
    if describes(laws, LawKind::SignedQuadratic) {
        return None;
    }
    let strong_w_mps = Some(w_mps(square)?).filter(|w| w.abs() > LARGEST_CALIBRATION_W_MPS);
    Some(Warning::Misfit { quadratic, linear, strong_w_mps })
}

fn w_mps(fit: &Fit) -> Option<f64> {
    fit.value(Symbol::W)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::law::{ErrorScale, LawPoint, linear, signed_quadratic};

    fn laws(pulse_us: fn(f64) -> f64) -> Laws {
        let points: Vec<LawPoint> = (-7..=7)
            .filter(|rung| *rung != 0)
            .map(|rung| {
                let velocity_mps = 0.5 * f64::from(rung);
                let odd = if rung % 2 == 0 { 1.0 } else { -1.0 };
                LawPoint {
                    velocity_mps,
                    pulse_us: pulse_us(velocity_mps) + odd,
                    sigma_us: 1.0,
                    velocity_sigma_mps: 0.0,
                }
            })
            .collect();
        Laws {
            signed_quadratic: signed_quadratic(&points, ErrorScale::Unscaled).ok(),
            signed_quadratic_held: None,
            linear: linear(&points, ErrorScale::Unscaled).ok(),
            sigma_added_us: None,
            held: None,
        }
    }

    #[test]
    fn the_shape_decides() {
        let square = laws(|v| 1598.6 + 8.14 * v * v.abs());
        assert_eq!(better_of(&square), Some(LawKind::SignedQuadratic));
        assert_eq!(misfit(&square), None);
        let line = laws(|v| 1546.5 + 26.4 * v);
        assert_eq!(better_of(&line), Some(LawKind::Linear));
        let words = misfit(&line).unwrap().to_string();
        assert!(words.contains("does not describe this flight"), "{words}");
        // A bent line looks like a parabola's flank: only W tells that it is none.
        let mut bent = laws(|v| 1546.5 + 26.4 * v + 4.0 * v * v);
        bent.linear = line.linear.clone();
        bent.signed_quadratic.as_mut().unwrap().chi2_reduced = Some(9.0);
        let w = w_mps(bent.signed_quadratic.as_ref().unwrap()).unwrap();
        assert!(w.abs() > LARGEST_CALIBRATION_W_MPS, "{w}");
        assert!(misfit(&bent).unwrap().to_string().contains("not moving air"), "{w}");
    }

    #[test]
    fn a_w_beyond_the_ladder_is_a_vertex_and_no_air() {
        let leg = |commanded_mps: f64| -> crate::analysis::result::WindowStats {
            let stats = serde_json::json!({"median": 0.0, "mean": 0.0, "sd": 0.0, "n": 1});
            serde_json::from_value(serde_json::json!({
                "kind": "leg_up", "label": "", "start_s": 0.0, "end_s": 1.0,
                "commanded_mps": commanded_mps, "height_m": 50.0, "velocity_mps": stats,
                "pulse_us": stats, "pulse_phi_us": stats, "tilt_deg": stats,
                "offset_us": null, "rejected": []
            }))
            .unwrap()
        };
        let drone: DroneAnalysis = serde_json::from_value(serde_json::json!({
            "slot": 1, "name": "", "source": "", "home_m": null,
            "clock": crate::flight::Clock { method: crate::flight::Alignment::Plan, ..Default::default() },
            "windows": [leg(-3.5), leg(3.5)], "laws": null, "trace": crate::analysis::result::Trace::default(),
            "warnings": []
        }))
        .unwrap();
        let drones = [drone];
        // A line with a weak bend: one flank of a parabola whose vertex is far below the ladder.
        let bent = laws(|v| 1546.5 + 26.4 * v + 3.0 * v * v);
        let w = vertex_mps(&bent, &drones, None).unwrap();
        assert!(w < -3.15, "{w}");
        let words = vertex_caution(&bent, &drones, None).unwrap().to_string();
        assert!(words.contains("no air speed") && words.contains("-3.5 to +3.5 m/s"), "{words}");
        assert_eq!(vertex_mps(&bent, &drones, Some(w)), None, "the air is known to be as fast");
        let windy = laws(|v| 1598.6 + 8.14 * (v - 1.5) * (v - 1.5).abs());
        assert_eq!(vertex_mps(&windy, &drones, None), None, "air that moved");
    }
}
