//! Which of the two laws describes a calibration, and when the signed quadratic does not.

use super::drone::law_fit;
use super::options::MapLaw;
use super::result::{Fit, FlightAnalysis, Laws};
use super::stats::mean_sd;

/// Largest W of a calibration's signed quadratic that may be the air's, m/s.
const LARGEST_CALIBRATION_W_MPS: f64 = 0.5;
/// A reduced chi² this many times the other law's is clearly worse.
const CLEARLY: f64 = 1.5;

/// The law whose fits to the reference's drones have the lower mean reduced chi².
///
/// A signed quadratic that needs a strong W is a parabola's flank standing in for another curve, not
/// air that moved: its inverse is off by that W, and the line is taken.
pub fn better_law(reference: &FlightAnalysis) -> MapLaw {
    let own = match reference.drones.as_slice() {
        [drone] => drone.laws.as_ref(),
        _ => None,
    };
    let calm = reference.flock.as_ref().or(own).is_none_or(|laws| {
        let w = laws.signed_quadratic.as_ref().and_then(w_mps);
        w.is_none_or(|w| w.abs() <= LARGEST_CALIBRATION_W_MPS)
    });
    let reduced = |law: MapLaw| {
        let values: Vec<f64> = reference
            .drones
            .iter()
            .filter(|drone| drone.partial_ladder.is_none())
            .filter_map(|drone| law_fit(drone.laws.as_ref()?, law)?.chi2_reduced)
            .collect();
        (!values.is_empty()).then(|| mean_sd(&values).0)
    };
    match (reduced(MapLaw::Linear), reduced(MapLaw::SignedQuadratic)) {
        (Some(linear), Some(quadratic)) if calm && quadratic < linear => MapLaw::SignedQuadratic,
        (None, Some(_)) => MapLaw::SignedQuadratic,
        _ => MapLaw::Linear,
    }
}

/// The law that describes one set of windows better.
pub fn better_of(laws: &Laws) -> Option<MapLaw> {
    let reduced = |fit: &Option<Fit>| fit.as_ref().and_then(|fit| fit.chi2_reduced);
    match (reduced(&laws.linear), reduced(&laws.signed_quadratic)) {
        (Some(linear), Some(quadratic)) if quadratic < linear => Some(MapLaw::SignedQuadratic),
        (Some(_), _) => Some(MapLaw::Linear),
        (None, Some(_)) => Some(MapLaw::SignedQuadratic),
        (None, None) => match (&laws.linear, &laws.signed_quadratic) {
            (Some(_), _) => Some(MapLaw::Linear),
            (None, quadratic) => quadratic.as_ref().map(|_| MapLaw::SignedQuadratic),
        },
    }
}

/// Whether a law describes a set of windows: unless the other law is clearly better.
pub(super) fn describes(laws: &Laws, law: MapLaw) -> bool {
    let other = match law {
        MapLaw::Linear => MapLaw::SignedQuadratic,
        MapLaw::SignedQuadratic => MapLaw::Linear,
    };
    let reduced = |law| law_fit(laws, law).and_then(|fit| fit.chi2_reduced);
    match (reduced(law), reduced(other)) {
        (Some(this), Some(other)) => this <= CLEARLY * other,
        _ => true,
    }
}

/// In plain words, that the signed quadratic is not the shape of these windows; `None` where it is,
/// or where the windows do not tell.
pub fn misfit(laws: &Laws) -> Option<String> {
    let (quadratic, linear) = (laws.signed_quadratic.as_ref()?, laws.linear.as_ref()?);
    let (worse, than) = (quadratic.chi2_reduced?, linear.chi2_reduced?);
    if describes(laws, MapLaw::SignedQuadratic) {
        return None;
    }
    let w = w_mps(quadratic)?;
    let strong = if w.abs() > LARGEST_CALIBRATION_W_MPS {
        format!(
            " Its W* of {w:+.2} m/s is the flank of a parabola that stands in for the line, not \
             moving air."
        )
    } else {
        String::new()
    };
    Some(format!(
        "The signed-quadratic law does not describe this flight: its chi2/nu is {worse:.2}, that of \
         the line {than:.2}. Use A' of the line; A, u0 and W* of the signed quadratic mean \
         nothing here.{strong}"
    ))
}

fn w_mps(fit: &Fit) -> Option<f64> {
    fit.parameters.iter().find(|found| found.name == "W").map(|w| w.estimate.value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::law::{ErrorScale, Point, linear, signed_quadratic};

    fn laws(pulse_us: fn(f64) -> f64) -> Laws {
        let points: Vec<Point> = (-7..=7)
            .filter(|rung| *rung != 0)
            .map(|rung| {
                let velocity_mps = 0.5 * f64::from(rung);
                let odd = if rung % 2 == 0 { 1.0 } else { -1.0 };
                Point {
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
        }
    }

    #[test]
    fn the_shape_decides() {
        let square = laws(|v| 1598.6 + 8.14 * v * v.abs());
        assert_eq!(better_of(&square), Some(MapLaw::SignedQuadratic));
        assert_eq!(misfit(&square), None);
        let line = laws(|v| 1546.5 + 26.4 * v);
        assert_eq!(better_of(&line), Some(MapLaw::Linear));
        let words = misfit(&line).unwrap();
        assert!(words.contains("does not describe this flight"), "{words}");
        // A bent line looks like a parabola's flank: only W tells that it is none.
        let mut bent = laws(|v| 1546.5 + 26.4 * v + 4.0 * v * v);
        bent.linear = line.linear.clone();
        bent.signed_quadratic.as_mut().unwrap().chi2_reduced = Some(9.0);
        let w = w_mps(bent.signed_quadratic.as_ref().unwrap()).unwrap();
        assert!(w.abs() > LARGEST_CALIBRATION_W_MPS, "{w}");
        assert!(misfit(&bent).unwrap().contains("not moving air"), "{w}");
    }
}
