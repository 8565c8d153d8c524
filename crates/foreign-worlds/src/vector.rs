//! Vectors of three numbers, and the rotation of a leaning vehicle.

/// A vector: x forward, y left, z up; in the show frame or in body axes.
pub type Vector = [f64; 3];

/// Sum of two vectors.
pub fn sum(left: Vector, right: Vector) -> Vector {
    [left[0] + right[0], left[1] + right[1], left[2] + right[2]]
}

/// Difference of two vectors.
pub fn difference(left: Vector, right: Vector) -> Vector {
    [left[0] - right[0], left[1] - right[1], left[2] - right[2]]
}

/// A vector times a number.
pub fn scaled(vector: Vector, factor: f64) -> Vector {
    vector.map(|part| part * factor)
}

/// Scalar product of two vectors.
pub fn dot(left: Vector, right: Vector) -> f64 {
    left[0] * right[0] + left[1] * right[1] + left[2] * right[2]
}

/// Length of a vector.
pub fn norm(vector: Vector) -> f64 {
    dot(vector, vector).sqrt()
}

/// Body axes (forward, left, up) of a vehicle, in the show frame; its nose stays above the show's x.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// Direction of the nose.
    pub forward: Vector,
    /// Direction of the left side.
    pub left: Vector,
    /// Direction of the thrust.
    pub up: Vector,
}

impl Axes {
    /// Axes of a vehicle whose thrust points along a direction of length 1.
    pub fn along(up: Vector) -> Self {
        let nose = [up[2], 0.0, -up[0]];
        let forward = scaled(nose, 1.0 / norm(nose).max(1e-9));
        let left = [
            up[1] * forward[2] - up[2] * forward[1],
            up[2] * forward[0] - up[0] * forward[2],
            up[0] * forward[1] - up[1] * forward[0],
        ];
        Self { forward, left, up }
    }

    /// A vector of the show frame in body axes.
    pub fn to_body(&self, show: Vector) -> Vector {
        [dot(show, self.forward), dot(show, self.left), dot(show, self.up)]
    }

    /// A vector of the body axes in the show frame.
    pub fn to_show(&self, body: Vector) -> Vector {
        let [x, y, z] = body;
        sum(sum(scaled(self.forward, x), scaled(self.left, y)), scaled(self.up, z))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_orthonormal_and_invert_each_other() {
        let up = scaled([0.3, -0.2, 0.9], 1.0 / norm([0.3, -0.2, 0.9]));
        let axes = Axes::along(up);
        assert!(dot(axes.forward, axes.left).abs() < 1e-12 && dot(axes.left, up).abs() < 1e-12);
        assert!((norm(axes.left) - 1.0).abs() < 1e-12 && axes.forward[1] == 0.0);
        let back = axes.to_show(axes.to_body([1.0, 2.0, 3.0]));
        assert!(norm(difference(back, [1.0, 2.0, 3.0])) < 1e-12);
        assert!(Axes::along([0.0, 0.0, 1.0]).left == [0.0, 1.0, 0.0]);
    }
}
