//! Shapes of the map's calibration law.

/// Parameters of the fleet's law at most: constant, slope, bends.
pub(super) const PARAMETERS: usize = 4;

/// Shape of the law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Shape {
    /// `u0 + A' V`, with bends `V²` and `V|V|` as far as the windows ask for them.
    Line,
    /// `u0 + A V|V|`.
    SignedQuadratic,
}

impl Shape {
    /// Derivatives of the pulse by the fleet's parameters.
    pub(super) fn basis(self, air_mps: f64) -> [f64; PARAMETERS] {
        let square = air_mps * air_mps.abs();
        match self {
            Self::Line => [1.0, air_mps, air_mps * air_mps, square],
            Self::SignedQuadratic => [1.0, square, 0.0, 0.0],
        }
    }

    pub(super) fn parameters(self) -> usize {
        match self {
            Self::Line => 4,
            Self::SignedQuadratic => 2,
        }
    }

    /// What a drone's own second parameter is multiplied with.
    pub(super) fn own(self, air_mps: f64) -> f64 {
        self.basis(air_mps)[1]
    }

    /// Pulse of a law, us.
    pub(super) fn pulse_us(self, law: &[f64; PARAMETERS], air_mps: f64) -> f64 {
        law.iter().zip(self.basis(air_mps)).map(|(value, basis)| value * basis).sum()
    }

    /// Pulse per air speed, us/(m/s).
    pub(super) fn slope(self, law: &[f64; PARAMETERS], air_mps: f64) -> f64 {
        match self {
            Self::Line => law[1] + 2.0 * law[2] * air_mps + 2.0 * law[3] * air_mps.abs(),
            Self::SignedQuadratic => 2.0 * law[1] * air_mps.abs(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_slope_is_the_derivative_of_the_pulse() {
        let law = [1540.0, 25.0, 0.7, -0.3];
        for shape in [Shape::Line, Shape::SignedQuadratic] {
            for air in [-2.0, -0.4, 0.3, 3.0] {
                let step = 1e-6;
                let rise = shape.pulse_us(&law, air + step) - shape.pulse_us(&law, air - step);
                let slope = shape.slope(&law, air);
                assert!((slope - rise / (2.0 * step)).abs() < 1e-3, "{shape:?} at {air}: {slope}");
            }
        }
    }
}
