//! Shapes of the map's calibration law.

/// Parameters of the fleet's law at most: constant, slope, bends.
pub(super) const PARAMETERS: usize = 4;

/// The line and the cube that are `V|V|` over a ladder of 1 m/s to each side, by least squares.
const SQUARE_AS_CUBIC: [f64; 2] = [5.0 / 16.0, 35.0 / 48.0];
/// Part of a line's odd bend that is a cube near hover, and not `V|V|`. Drag of bodies bends by `V|V|`, rotors by smooth curves;
/// windows half a metre per second apart hardly tell them from each other, and the slope in hover lies between them.
const CUBIC_PART: f64 = 0.5;
/// Rounds of Newton's method. Numerical.
const ROUNDS: usize = 8;

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

    /// Air speed for small motions around hover, of a drone whose law of the map says `air_mps`, m/s; `ladder_mps`: how far to each
    /// side the law was measured.
    ///
    /// The zero of the map does not depend on how a law bends within the ladder; the slope in hover does, by a few per cent.
    pub(super) fn near_hover(self, law: &[f64; PARAMETERS], ladder_mps: f64, air_mps: f64) -> f64 {
        let bend = CUBIC_PART * law[3];
        let is_within = ladder_mps > air_mps.abs();
        if self != Self::Line || !is_within {
            return air_mps;
        }
        let [line, cube] =
            [SQUARE_AS_CUBIC[0] * ladder_mps * bend, SQUARE_AS_CUBIC[1] / ladder_mps * bend];
        let of = |air: f64| line * air + cube * air.powi(3) - bend * air * air.abs();
        let by = |air: f64| line + 3.0 * cube * air * air - 2.0 * bend * air.abs();
        let pulse_us = self.pulse_us(law, air_mps);
        let mut found = air_mps;
        for _ in 0..ROUNDS {
            found -= (self.pulse_us(law, found) + of(found) - pulse_us)
                / (self.slope(law, found) + by(found));
        }
        // Laws without an inverse there stay what they are.
        if (found - air_mps).abs() <= 0.5 * air_mps.abs() { found } else { air_mps }
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
    fn the_slope_in_hover_is_between_those_of_a_square_and_of_a_cube() {
        let ladder_mps = 3.5;
        let laws = |bend: f64| [1500.0, 24.0, 0.7, bend];
        let near = |bend: f64, air: f64| Shape::Line.near_hover(&laws(bend), ladder_mps, air);
        // Half of 5/16 of the bend and the ladder: 24 + 0.5 * 5/16 * 1.2 * 3.5 = 24.66.
        let steeper = 24.0 / (24.0 + 0.5 * 5.0 / 16.0 * 1.2 * ladder_mps);
        assert!((near(1.2, 1e-3) / 1e-3 - steeper).abs() < 1e-4, "{}", near(1.2, 1e-3));
        assert!(near(-1.2, 0.4) > 0.4 && near(1.2, -0.4) > -0.4);
        assert_eq!(near(0.0, 0.4), 0.4);
        // At the ends of the ladder and beyond there is no doubt.
        assert!((near(1.2, 3.4) - 3.4).abs() < 0.02 && near(1.2, 3.6) == 3.6);
        let square = [1500.0, 3.0, 0.0, 1.0];
        assert_eq!(Shape::SignedQuadratic.near_hover(&square, ladder_mps, 0.4), 0.4);
        assert_eq!(Shape::Line.near_hover(&[1500.0, 0.0, 0.0, 0.0], ladder_mps, 0.4), 0.4);
    }

    #[test]
    fn a_square_over_a_ladder_is_nearly_a_cube() {
        let [line, cube] = SQUARE_AS_CUBIC;
        let off = |air: f64| line * air + cube * air.powi(3) - air * air.abs();
        let sums = (0..1000).map(|step| (f64::from(step) + 0.5) / 1000.0);
        let [by_line, by_cube] = sums.fold([0.0; 2], |[a, b], air| {
            [a + off(air) * air / 1000.0, b + off(air) * air.powi(3) / 1000.0]
        });
        assert!(by_line.abs() < 1e-6 && by_cube.abs() < 1e-6, "{by_line} {by_cube}");
    }

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
