//! Induced velocity of a rotor: momentum theory with Glauert's assumption for forward flight.

/// Induced velocity of a disc, m/s, positive against the thrust: the solution of
/// `T = 2 rho A v_i sqrt(V_x² + (V_c + v_i)²)` (Glauert 1926; Leishman 2006, equation 2.126), on the branch
/// of hover and climb, which a slow descent continues.
///
/// `thrust_per_area` is T/(rho A), m²/s²; `climb_mps` is the speed along the thrust and
/// `edgewise_mps` that across it.
pub fn induced_mps(thrust_per_area: f64, climb_mps: f64, edgewise_mps: f64) -> f64 {
    if thrust_per_area <= 0.0 {
        return 0.0;
    }
    let half = thrust_per_area / 2.0;
    // Without edgewise flow the equation is quadratic; that is an upper bound from which Newton's
    // method converges monotonically.
    let mut induced = (climb_mps * climb_mps / 4.0 + half).sqrt() - climb_mps / 2.0;
    for _ in 0..30 {
        let through = climb_mps + induced;
        let root = (edgewise_mps * edgewise_mps + through * through).sqrt().max(1e-9);
        let excess = induced * root - half;
        let slope = root + induced * through / root;
        let step = excess / slope.max(1e-9);
        induced -= step;
        if step.abs() < 1e-12 {
            break;
        }
    }
    induced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hover_and_climb_are_those_of_the_textbook() {
        // v_h = sqrt(T/(2 rho A)).
        let hover = induced_mps(50.0, 0.0, 0.0);
        assert!((hover - 5.0).abs() < 1e-9, "{hover}");
        // Leishman 2006, equation 2.97: v_i/v_h = -V_c/(2 v_h) + sqrt((V_c/(2 v_h))² + 1).
        for climb in [-3.0, 2.0, 5.0, 10.0] {
            let ratio = induced_mps(50.0, climb, 0.0) / 5.0;
            let x = climb / 10.0;
            let wanted = -x + (x * x + 1.0_f64).sqrt();
            assert!((ratio - wanted).abs() < 1e-9, "{climb}: {ratio}");
        }
    }

    #[test]
    fn level_forward_flight_is_glauerts() {
        // Leishman 2006, equation 2.138, level disc:
        // (v_i/v_h)² = sqrt((V/v_h)^4/4 + 1) - (V/v_h)²/2.
        for speed in [0.0, 1.0, 5.0, 8.0, 20.0] {
            let found = (induced_mps(50.0, 0.0, speed) / 5.0_f64).powi(2);
            let x = (speed / 5.0_f64).powi(2);
            let wanted = (x * x / 4.0 + 1.0).sqrt() - x / 2.0;
            assert!((found - wanted).abs() < 1e-9, "{speed}: {found} {wanted}");
        }
        // Fast, it is that of a wing: v_h²/V.
        let fast = induced_mps(50.0, 0.0, 100.0);
        assert!((fast - 0.25).abs() < 1e-4, "{fast}");
    }
}
