//! Conversion of metres to whole units and back, and its loss of precision.

use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

use crate::bezier::Scalar;

/// Curves that differ by less are the same curve, m; far below the finest unit.
const SAME_M: f64 = 1e-9;

/// Largest deviation that whole units cause. Exact for straight pieces; for curves an upper bound
/// (from the control points of the difference).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, JsonSchema)]
pub struct Quantisation {
    /// Largest deviation of position, m.
    pub max_position_m: f64,
    /// Largest deviation of velocity, m/s.
    pub max_speed_mps: f64,
}

impl Quantisation {
    /// The larger deviation of each kind.
    #[must_use]
    pub fn max(self, other: Self) -> Self {
        Self {
            max_position_m: self.max_position_m.max(other.max_position_m),
            max_speed_mps: self.max_speed_mps.max(other.max_speed_mps),
        }
    }
}

/// A coordinate in units, if it fits.
pub(crate) fn to_unit(value_m: f64, scale_mm: u8) -> Option<i16> {
    let unit = (value_m * 1000.0 / f64::from(scale_mm)).round();
    // -32768 is left out so that a mirrored show fits as well.
    (unit.abs() <= f64::from(i16::MAX)).then_some(unit as i16)
}

/// A coordinate in metres.
pub(crate) fn to_m(unit: i16, scale_mm: u8) -> f64 {
    f64::from(i32::from(unit) * i32::from(scale_mm)) / 1000.0
}

/// One axis of a piece as the file holds it.
pub(crate) struct Axis {
    /// 0 constant, 1 linear, 2 cubic, 3 7th degree.
    pub code: u8,
    values: [i16; 7],
}

impl Axis {
    /// Values after the start point.
    pub(crate) fn values(&self) -> &[i16] {
        &self.values[..value_count(self.code)]
    }
}

/// How many values an axis code announces.
pub(crate) fn value_count(code: u8) -> usize {
    match code & 3 {
        0 => 0,
        1 => 1,
        2 => 3,
        _ => 7,
    }
}

/// The shortest form of one axis; `None` when it does not fit the scale.
pub(crate) fn encode_axis(points_m: Scalar, scale_mm: u8) -> Option<Axis> {
    let shortest = points_m.reduced(SAME_M);
    let mut units = [0; 8];
    for (unit, point) in units.iter_mut().zip(shortest.points()) {
        *unit = to_unit(*point, scale_mm)?;
    }
    let [start, values @ ..] = units;
    let code = match shortest.degree() {
        0 => 0,
        1 => 1,
        3 => 2,
        _ => 3,
    };
    let moves = values[..value_count(code)].iter().any(|value| *value != start);
    Some(Axis { code: if moves { code } else { 0 }, values })
}

/// Deviation of the encoded axes of one piece from its exact control points.
pub(crate) fn deviation(
    points_m: &[Vector3<f64>],
    axes: &[Axis; 3],
    starts: [i16; 3],
    scale_mm: u8,
    duration_ms: u32,
) -> Quantisation {
    let mut gaps = [Vector3::<f64>::zeros(); 8];
    let degree = if points_m.len() > 4 || axes.iter().any(|axis| axis.code == 3) {
        7
    } else if points_m.len() > 2 {
        3
    } else {
        1
    };
    for (i, (axis, start)) in axes.iter().zip(starts).enumerate() {
        let exact = Scalar::new(points_m.iter().map(|point| point[i])).elevated(degree);
        let units = std::iter::once(start).chain(axis.values().iter().copied());
        let stored = Scalar::new(units.map(|unit| to_m(unit, scale_mm))).elevated(degree);
        for (gap, (a, b)) in gaps.iter_mut().zip(exact.points().iter().zip(stored.points())) {
            gap[i] = a - b;
        }
    }
    let gaps = &gaps[..=degree];
    let rate = degree as f64 * 1000.0 / f64::from(duration_ms.max(1));
    Quantisation {
        max_position_m: gaps.iter().map(Vector3::norm).fold(0.0, f64::max),
        max_speed_mps: gaps
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).norm() * rate)
            .fold(0.0, f64::max),
    }
}
