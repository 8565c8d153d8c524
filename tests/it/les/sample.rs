//! A field that is known everywhere, written as models write theirs: divergence free on the staggered grid, with an
//! energy spectrum of k^(-5/3), carried along by a wind.

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::{Complex, Vector3};
use netcdf_writer::{
    DimensionId, NcAttrValue, NcFileBuilder, NcWriteFormat, NcWriteOptions, VariableId,
};
use rand::RngExt as _;
use updraft::base::rng::{Purpose, stream};

/// Points along x, y and z, and their distances, m.
pub(crate) const POINTS: [usize; 3] = [32, 32, 16];
pub(crate) const SPACING_M: [f64; 3] = [10.0, 10.0, 8.0];
/// Waves of the field.
const WAVES: usize = 600;
/// Longest and shortest wave, m.
const WAVES_M: (f64, f64) = (160.0, 26.0);
/// The model's time of the first output, s.
pub(crate) const FIRST_S: f64 = 3_600.0;

/// A wave of the field.
struct Wave {
    /// Waves in the domain along each axis.
    number: [i64; 3],
    /// Complex amplitudes of u, v and w, m/s.
    amplitude: [Complex<f64>; 3],
}

/// The field.
pub(crate) struct Field {
    waves: Vec<Wave>,
    /// Velocity that carries it, along x and y, m/s; it is part of the wind.
    pub(crate) wind_mps: [f64; 2],
}

fn length_m(axis: usize) -> f64 {
    POINTS[axis] as f64 * SPACING_M[axis]
}

/// Places of a component's points along an axis, m: half a cell off along its own.
pub(crate) fn first_m(component: usize, axis: usize) -> f64 {
    if component == axis { 0.0 } else { 0.5 * SPACING_M[axis] }
}

impl Field {
    /// Draws a field whose w has this standard deviation, about.
    pub(crate) fn drawn(seed: u64, sd_mps: f64, wind_mps: [f64; 2]) -> Self {
        let mut rng = stream(seed, 0, Purpose::Air);
        let (longest, shortest) = (TAU / WAVES_M.0, TAU / WAVES_M.1);
        let mut waves = Vec::new();
        while waves.len() < WAVES {
            let wanted = longest * (shortest / longest).powf(rng.random::<f64>());
            let up: f64 = rng.random_range(-1.0..1.0);
            let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
            let level = (1.0 - up * up).sqrt();
            let direction = [level * cos, level * sin, up];
            let number: [i64; 3] = [0, 1, 2]
                .map(|axis| (wanted * direction[axis] * length_m(axis) / TAU).round() as i64);
            let k = Vector3::from([0, 1, 2].map(|axis| TAU * number[axis] as f64 / length_m(axis)));
            // What is the same all over a plane would be a mean wind.
            let is_level = number[0] != 0 || number[1] != 0;
            if !is_level
                || k.norm() < 0.9 * longest
                || (0..3).any(|axis| 2 * number[axis].unsigned_abs() as usize >= POINTS[axis])
            {
                continue;
            }
            // What differences between neighbouring points make of k: free of divergence on the grid.
            let on_grid = Vector3::from(
                [0, 1, 2]
                    .map(|axis| 2.0 / SPACING_M[axis] * (0.5 * k[axis] * SPACING_M[axis]).sin()),
            );
            let any = Vector3::from([0, 1, 2].map(|_| rng.random_range(-1.0..1.0)));
            let across = any.cross(&on_grid);
            if across.norm() < 1e-3 {
                continue;
            }
            // Drawn evenly in log k: energy k E(k) ~ k^(-2/3) a wave.
            let size = k.norm().powf(-1.0 / 3.0);
            let phase = Complex::from_polar(size, TAU * rng.random::<f64>());
            let across = across.normalize();
            waves.push(Wave { number, amplitude: [0, 1, 2].map(|axis| phase * across[axis]) });
        }
        let variance: f64 = waves.iter().map(|wave| 0.5 * wave.amplitude[2].norm_sqr()).sum();
        for wave in &mut waves {
            wave.amplitude = wave.amplitude.map(|one| one * (sd_mps / variance.sqrt()));
        }
        Self { waves, wind_mps }
    }

    /// A component at a place of the model, so many seconds after the first output, m/s.
    pub(crate) fn at(&self, component: usize, place_m: [f64; 3], after_s: f64) -> f64 {
        let wind = [self.wind_mps[0], self.wind_mps[1], 0.0];
        let own: f64 = self
            .waves
            .iter()
            .map(|wave| {
                let phase: f64 = (0..3)
                    .map(|axis| {
                        let m = place_m[axis] - wind[axis] * after_s;
                        TAU * wave.number[axis] as f64 * m / length_m(axis)
                    })
                    .sum();
                (wave.amplitude[component] * Complex::from_polar(1.0, phase)).re
            })
            .sum();
        own + wind[component]
    }

    /// A component on its points, z slowest and x fastest.
    #[expect(
        clippy::needless_range_loop,
        reason = "the tables are by wave first, and by point then"
    )]
    pub(crate) fn grid(&self, component: usize, after_s: f64) -> Vec<f32> {
        let [nx, ny, nz] = POINTS;
        let wind = [self.wind_mps[0], self.wind_mps[1], 0.0];
        let turn = |axis: usize, number: i64, index: usize| {
            let m =
                first_m(component, axis) + SPACING_M[axis] * index as f64 - wind[axis] * after_s;
            Complex::from_polar(1.0, TAU * number as f64 * m / length_m(axis))
        };
        let table = |axis: usize| -> Vec<Vec<Complex<f64>>> {
            let most = POINTS[axis] as i64 / 2;
            (-most..=most)
                .map(|number| (0..POINTS[axis]).map(|index| turn(axis, number, index)).collect())
                .collect()
        };
        let [x, y, z] = [table(0), table(1), table(2)];
        let entry = |axis: usize, number: i64| (number + POINTS[axis] as i64 / 2) as usize;
        let mut values = Vec::with_capacity(nx * ny * nz);
        for k in 0..nz {
            for j in 0..ny {
                // All waves of one number along x together.
                let mut along = vec![Complex::new(0.0, 0.0); nx + 1];
                for wave in &self.waves {
                    let [ni, nj, nk] = wave.number;
                    along[entry(0, ni)] +=
                        wave.amplitude[component] * y[entry(1, nj)][j] * z[entry(2, nk)][k];
                }
                for i in 0..nx {
                    let sum: f64 =
                        along.iter().zip(&x).map(|(one, turns)| (one * turns[i]).re).sum();
                    values.push((sum + wind[component]) as f32);
                }
            }
        }
        values
    }
}

/// Names that a model gives to dimensions and coordinates: time, and x, y and z of u, v and w.
pub(crate) struct Names {
    pub(crate) time: &'static str,
    pub(crate) axes: [[&'static str; 3]; 3],
    /// Unit of lengths, and its metres.
    pub(crate) unit: (&'static str, f64),
    /// Unit of times.
    pub(crate) time_unit: (&'static str, f64),
    /// Whether u, v and w have a point more along their own axes, as faces of cells have.
    pub(crate) faces: bool,
}

pub(crate) const PALM: Names = Names {
    time: "time",
    axes: [["xu", "y", "zu_3d"], ["x", "yv", "zu_3d"], ["x", "y", "zw_3d"]],
    unit: ("meters", 1.0),
    time_unit: ("seconds since 2026-06-01 11:00:00 +00", 1.0),
    faces: false,
};
pub(crate) const MICROHH: Names = Names {
    time: "time",
    axes: [["xh", "y", "z"], ["x", "yh", "z"], ["x", "y", "zh"]],
    unit: ("m", 1.0),
    time_unit: ("seconds since start", 1.0),
    faces: false,
};
pub(crate) const CM1: Names = Names {
    time: "time",
    axes: [["xf", "yh", "zh"], ["xh", "yf", "zh"], ["xh", "yh", "zf"]],
    unit: ("km", 1000.0),
    time_unit: ("minutes", 60.0),
    faces: true,
};

/// Format and layout of a file.
#[derive(Clone, Copy)]
pub(crate) struct As<'a> {
    pub(crate) names: &'a Names,
    pub(crate) format: NcWriteFormat,
    /// Seconds after the first output.
    pub(crate) after_s: &'a [f64],
    /// Components that are written.
    pub(crate) components: &'a [usize],
    /// Names of u, v and w.
    pub(crate) called: [&'static str; 3],
    /// Cells of x below this are ground: fill values.
    pub(crate) wall: usize,
}

impl<'a> As<'a> {
    pub(crate) fn new(names: &'a Names, after_s: &'a [f64]) -> Self {
        Self {
            names,
            format: NcWriteFormat::Nc4,
            after_s,
            components: &[0, 1, 2],
            called: ["u", "v", "w"],
            wall: 0,
        }
    }
}

fn text(value: &str) -> NcAttrValue {
    NcAttrValue::Chars(value.to_owned())
}

/// Writes a field as a model's output.
pub(crate) fn write(field: &Field, how: As<'_>, path: &Path) {
    std::fs::write(path, bytes(field, how)).unwrap();
}

pub(crate) fn bytes(field: &Field, how: As<'_>) -> Vec<u8> {
    let As { names, .. } = how;
    let mut builder = NcFileBuilder::new();
    let time = builder.add_unlimited_dimension(names.time).unwrap();
    let mut dimensions: Vec<(&str, DimensionId, usize)> = Vec::new();
    let mut coordinates: Vec<(VariableId, Vec<f64>)> = Vec::new();
    let times: Vec<f64> = how.after_s.iter().map(|s| (FIRST_S + s) / names.time_unit.1).collect();
    let id = builder.add_variable::<f64>(names.time, &[time]).unwrap();
    builder.add_variable_attribute(id, "units", text(names.time_unit.0)).unwrap();
    coordinates.push((id, times));
    for &component in how.components {
        for axis in 0..3 {
            let name = names.axes[component][axis];
            if dimensions.iter().any(|(there, ..)| *there == name) {
                continue;
            }
            let count = POINTS[axis] + usize::from(names.faces && component == axis);
            let dimension = builder.add_dimension(name, count as u64).unwrap();
            let points: Vec<f64> = (0..count)
                .map(|index| {
                    (first_m(component, axis) + SPACING_M[axis] * index as f64) / names.unit.1
                })
                .collect();
            let id = builder.add_variable::<f64>(name, &[dimension]).unwrap();
            builder.add_variable_attribute(id, "units", text(names.unit.0)).unwrap();
            dimensions.push((name, dimension, count));
            coordinates.push((id, points));
        }
    }
    let mut fields = Vec::new();
    for &component in how.components {
        let of = |axis: usize| {
            let name = names.axes[component][axis];
            dimensions.iter().find(|(there, ..)| *there == name).copied().unwrap()
        };
        let [x, y, z] = [of(0), of(1), of(2)];
        let id =
            builder.add_variable::<f32>(how.called[component], &[time, z.1, y.1, x.1]).unwrap();
        builder.set_variable_fill_value(id, -9999.0_f32).unwrap();
        builder.add_variable_attribute(id, "units", text("m/s")).unwrap();
        if how.format == NcWriteFormat::Nc4 {
            let chunk = vec![1, z.2 as u64, y.2 as u64, x.2 as u64];
            builder.set_variable_chunking(id, chunk).unwrap();
            builder.set_variable_deflate(id, Some(4), true).unwrap();
        }
        let mut values = Vec::new();
        for after_s in how.after_s {
            let inner = field.grid(component, *after_s);
            for k in 0..z.2 {
                for j in 0..y.2 {
                    for i in 0..x.2 {
                        // The face beyond the last cell is the first one again.
                        let [nx, ny, nz] = POINTS;
                        let at = ((k % nz) * ny + j % ny) * nx + i % nx;
                        values.push(if i < how.wall { -9999.0 } else { inner[at] });
                    }
                }
            }
        }
        fields.push((id, values));
    }
    for (id, values) in coordinates {
        builder.write_variable(id, &values).unwrap();
    }
    for (id, values) in fields {
        builder.write_variable(id, &values).unwrap();
    }
    builder.to_vec(NcWriteOptions { format: how.format }).unwrap().1
}
