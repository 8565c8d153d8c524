//! Momentum and blade element theory of a rotor with uniform inflow.
//!
//! Speeds are shares of `v_s`, the induced velocity that the rotor would have in still air at its
//! present speed; thrusts are shares of its thrust there. With s the share of the geometric thrust
//! that the inflow takes in hover and beta = s / (1 - s), blade element theory (Leishman,
//! Principles of Helicopter Aerodynamics, chapter 3) is
//! `thrust = 1 + beta - beta (axial + induced)`,
//! and momentum theory (Glauert) `thrust = induced sqrt(edgewise² + (axial + induced)²)`.

/// Newton steps: quadratic convergence from a bound takes fewer.
const STEPS: usize = 6;
/// Newton steps of the thrust in a climb: from a thrust near nothing, it takes more.
const CLIMB_STEPS: usize = 10;
/// No rotor that turns carries less, over its thrust in still air. Numerical.
const LEAST_THRUST: f64 = 1e-3;

/// State of a rotor at fixed speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Working {
    /// Thrust over thrust in still air.
    pub thrust: f64,
    /// Flow through the disc, axial + induced, over the induced velocity in still air.
    pub flow: f64,
}

/// Ratio beta = s / (1 - s) of a share s of inflow.
pub fn beta(share: f64) -> f64 {
    share / (1.0 - share)
}

/// Induced velocity over that in hover, at fixed thrust, for speeds over the induced velocity in
/// hover; the branch of climb, continued smoothly into descent.
pub fn induced(axial: f64, edgewise: f64) -> f64 {
    let mut value = -axial / 2.0 + (axial * axial / 4.0 + 1.0).sqrt();
    if edgewise > 0.0 {
        for _ in 0..STEPS {
            let through = axial + value;
            let past = (edgewise * edgewise + through * through).sqrt();
            let slope = past + value * through / past;
            let next = value - (value * past - 1.0) / slope.max(0.1);
            // Every further step would find the same.
            if next == value {
                break;
            }
            value = next;
        }
    }
    value
}

/// A rotor at fixed speed in axial and edgewise flow.
pub fn at_speed(share: f64, axial: f64, edgewise: f64) -> Working {
    let beta = beta(share);
    let half = f64::midpoint(axial, beta);
    let mut value = -half + (half * half + 1.0 + beta - beta * axial).max(0.0).sqrt();
    if edgewise > 0.0 {
        for _ in 0..STEPS {
            let through = axial + value;
            let past = (edgewise * edgewise + through * through).sqrt().max(1e-6);
            let slope = past + value * through / past + beta;
            let next = value - (value * past + beta * through - 1.0 - beta) / slope.max(0.1);
            // Every further step would find the same.
            if next == value {
                break;
            }
            value = next;
        }
    }
    let flow = axial + value;
    Working { thrust: 1.0 + beta - beta * flow, flow }
}

/// A rotor at fixed speed in axial flow, whose induced velocity changes with the climb by a share of what momentum
/// theory says, and goes with the root of the thrust otherwise.
pub fn in_climb(share: f64, induced: f64, axial: f64) -> Working {
    if induced >= 1.0 {
        return at_speed(share, axial, 0.0);
    }
    let beta = beta(share);
    let half = axial / 2.0;
    let flow = |thrust: f64| {
        let by_theory = -half + (half * half + thrust).sqrt();
        axial + (1.0 - induced) * thrust.sqrt() + induced * by_theory
    };
    let mut thrust: f64 = 1.0;
    for _ in 0..CLIMB_STEPS {
        let off = thrust - 1.0 - beta + beta * flow(thrust);
        let of_root = (1.0 - induced) / thrust.sqrt() + induced / (half * half + thrust).sqrt();
        let next = (thrust - off / (1.0 + 0.5 * beta * of_root)).max(LEAST_THRUST);
        // Every further step would find the same.
        if next == thrust {
            break;
        }
        thrust = next;
    }
    Working { thrust, flow: flow(thrust) }
}

/// Speed over hover speed that keeps the thrust when the flow through the disc is `flow` times the
/// induced velocity in hover.
pub fn speed_for_flow(share: f64, flow: f64) -> f64 {
    let beta = beta(share);
    let product = beta * flow;
    (product + (product * product + 4.0 * (1.0 + beta)).sqrt()) / (2.0 * (1.0 + beta))
}

/// Torque over the torque in still air at the same speed, for a rotor that keeps the hover thrust:
/// the profile's share stays, the induced share goes with thrust times flow over speed.
pub fn torque_for_flow(figure_of_merit: f64, flow: f64, speed: f64) -> f64 {
    1.0 - figure_of_merit + figure_of_merit * flow / speed.powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn induced_velocity_has_its_limits() {
        assert!((induced(0.0, 0.0) - 1.0).abs() < 1e-15);
        // Half of a small climb appears as extra flow: v_i = 1 - x/2 + x²/8.
        let x = 0.05;
        assert!((induced(x, 0.0) - (1.0 - x / 2.0 + x * x / 8.0)).abs() < 1e-6);
        // Fast climb and fast forward flight: v_i = 1 / speed.
        assert!((induced(50.0, 0.0) * 50.0 - 1.0).abs() < 1e-3);
        assert!((induced(0.0, 50.0) * 50.0 - 1.0).abs() < 1e-6);
        for (axial, edge) in [(0.3, 0.7), (-0.4, 1.2), (1.0, 0.1)] {
            let v = induced(axial, edge);
            let past = (edge * edge + (axial + v) * (axial + v)).sqrt();
            assert!((v * past - 1.0).abs() < 1e-12, "{axial} {edge}: {v}");
        }
    }

    #[test]
    fn fixed_speed_and_fixed_thrust_agree() {
        let share = 0.5;
        for (axial, edge) in [(0.0, 0.0), (0.4, 0.0), (-0.3, 0.0), (0.1, 0.9), (-0.2, 0.5)] {
            let flow = axial + induced(axial, edge);
            let speed = speed_for_flow(share, flow);
            // At that speed the still-air thrust is speed² and its induced velocity is speed.
            let working = at_speed(share, axial / speed, edge / speed);
            assert!((working.thrust * speed * speed - 1.0).abs() < 1e-9, "{axial} {edge}");
            assert!((working.flow * speed - flow).abs() < 1e-9);
        }
    }

    #[test]
    fn an_induced_velocity_that_stays_makes_the_response_straight() {
        let share = 0.4;
        // Between both ends of the share the flow is the mean of what they say.
        for (induced_share, axial) in
            [(0.0, 0.6), (0.0, -1.3), (0.5, 0.4), (0.5, -0.9), (1.0, 0.3), (1.0, -0.7)]
        {
            let flow = axial + 1.0 + induced_share * (induced(axial, 0.0) - 1.0);
            let speed = speed_for_flow(share, flow);
            let working = in_climb(share, induced_share, axial / speed);
            let thrust = working.thrust * speed * speed;
            assert!((thrust - 1.0).abs() < 1e-9, "{induced_share} {axial}: {thrust}");
            assert!((working.flow * speed - flow).abs() < 1e-9);
        }
        // With the theory in full it is the theory's, up to where a rotor carries nothing.
        assert_eq!(in_climb(0.5, 1.0, 0.2), at_speed(0.5, 0.2, 0.0));
        assert!(in_climb(0.5, 0.0, 50.0).thrust <= LEAST_THRUST);
    }

    #[test]
    fn slope_of_thrust_at_fixed_speed_is_the_textbooks() {
        // dlnT/dV = -(1/v_h) (beta/2) / (1 + beta/2).
        for share in [0.4, 0.5, 0.6] {
            let step = 1e-5;
            let slope = (at_speed(share, step, 0.0).thrust - at_speed(share, -step, 0.0).thrust)
                / (2.0 * step);
            let half = beta(share) / 2.0;
            assert!((slope + half / (1.0 + half)).abs() < 1e-8, "{share}: {slope}");
        }
    }
}
