//! A model's output becomes air.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use nalgebra::{Vector2, Vector3};

use super::about::{About, Les};
use super::file::File;
use super::layout::{joined, layout};
use super::map::LesMap;
use super::source::Source;
use super::{LesError, Where, beside, known};
use crate::base::file::read_whole;
use crate::sim::air::GriddedAir;
use crate::sim::air::gridded::{Block, Component, Grid, GridSource, Passage, Placing, Points};
use crate::sim::air::spec::{AirSpec, towards};

/// Largest mapping that is read, bytes.
const MOST_MAP_BYTES: u64 = 1 << 16;
/// Rows of a plane that are read at once, for its mean.
const ROWS: usize = 64;

/// Opens a model's output as air for a show.
///
/// # Errors
/// [`LesError`] names the file and the variable, and says what to do.
pub fn open(spec: &AirSpec, place: Where) -> Result<Les, LesError> {
    let path = PathBuf::from(spec.word("file").unwrap_or_default());
    let main = Arc::new(File::open(&path)?);
    let map_path = spec.word("map").map(PathBuf::from);
    let (map, model) = match &map_path {
        Some(map_path) => (mapping(map_path)?, "by a mapping".to_owned()),
        None => known::mapping(&path, &main)?,
    };
    let names = [&map.u, &map.v, &map.w];
    let mut files = Vec::new();
    for of in names {
        files.push(match &of.file {
            Some(name) => Arc::new(File::open(&beside(&path, name))?),
            None => Arc::clone(&main),
        });
    }
    let [u, v, w] = <[Arc<File>; 3]>::try_from(files)
        .map_err(|_| LesError::of_file(&path, "three components are needed"))?;
    let layouts = [layout(&u, &map.u, &map)?, layout(&v, &map.v, &map)?, layout(&w, &map.w, &map)?];
    let (points, times_s) = joined([&u, &v, &w], names, layouts, &map)?;
    let mut paths: Vec<PathBuf> = Vec::new();
    for of in [&w, &u, &v].into_iter().map(|file| &file.path).chain(&map_path) {
        if !paths.contains(of) {
            paths.push(of.clone());
        }
    }
    let source = Source {
        of: [(u, map.u.variable.clone()), (v, map.v.variable.clone()), (w, map.w.variable.clone())],
    };
    let grid = Grid { points, times_s, repeats: spec.value("repeat") > 0.5 };
    Placed { spec, place, path: &path, model, paths }.into_air(Box::new(source), grid)
}

fn mapping(path: &Path) -> Result<LesMap, LesError> {
    let bytes = read_whole(path, MOST_MAP_BYTES)?;
    LesMap::from_toml(&String::from_utf8_lossy(&bytes))
        .map_err(|reason| LesError::of_file(path, reason))
}

/// A model that is put into a show.
struct Placed<'a> {
    spec: &'a AirSpec,
    place: Where,
    path: &'a Path,
    model: String,
    paths: Vec<PathBuf>,
}

impl Placed<'_> {
    fn into_air(self, source: Box<dyn GridSource>, grid: Grid) -> Result<Les, LesError> {
        let Self { spec, place, path, model, paths } = self;
        let w = &grid.points[2];
        let middle = |axis: &crate::sim::air::gridded::Regular| {
            axis.first_m + 0.5 * (axis.period_m() - axis.spacing_m)
        };
        let origin_m = Vector3::new(
            spec.given("x").unwrap_or_else(|| middle(&w.x)),
            spec.given("y").unwrap_or_else(|| middle(&w.y)),
            spec.value("ground"),
        );
        // Clockwise from north becomes to the left of the show's x.
        let turned_rad = (place.orientation_deg - spec.value("x_towards")).to_radians();
        let (first_s, last_s) = (grid.times_s.first().copied(), grid.times_s.last().copied());
        let first_s = first_s.unwrap_or(0.0);
        let last_s = last_s.unwrap_or(first_s);
        let start_s = spec.given("start").unwrap_or(first_s);
        let advects = spec.word("mode") == Some("advect");
        let (passage, carried) = if advects {
            let nearest = nearest(&grid.times_s, start_s);
            if !(first_s..=last_s).contains(&start_s) {
                return Err(LesError::of_file(
                    path,
                    format!(
                        "start={start_s} is none of the model's times, which are {first_s:.1} to {last_s:.1} s"
                    ),
                ));
            }
            let (sin, cos) = spec.value("x_towards").to_radians().sin_cos();
            // The model's x is towards (sin, cos) of east and north, its y to the left of that.
            let wind_mps = match spec.given("wind") {
                Some(speed_mps) => {
                    let [east, north, _] = towards(speed_mps, spec.value("from"));
                    Vector2::new(sin * east + cos * north, sin * north - cos * east)
                }
                None => mean_wind(&*source, &grid, nearest, origin_m.z + place.height_m)
                    .map_err(|reason| LesError::of_file(path, reason))?,
            };
            let carried = [
                sin * wind_mps.x - cos * wind_mps.y + 0.0,
                cos * wind_mps.x + sin * wind_mps.y + 0.0,
            ];
            (Passage::Advect { time: nearest, wind_mps }, Some((carried, wind_mps)))
        } else {
            (Passage::Replay { start_s }, None)
        };
        let start_s = match passage {
            Passage::Advect { time, .. } => grid.times_s.get(time).copied().unwrap_or(start_s),
            Passage::Replay { start_s } => start_s,
        };
        let about = About {
            model,
            files: paths,
            points: [w.x.count, w.y.count, w.z.all_m().len()],
            spacing_m: [w.x.spacing_m, w.y.spacing_m],
            heights_m: heights_m(&grid.points, origin_m.z),
            lowest_step_m: w
                .z
                .all_m()
                .windows(2)
                .map(|pair| pair[1] - pair[0])
                .next()
                .unwrap_or(0.0),
            times_s: (first_s, last_s, grid.times_s.len()),
            period_m: [w.x.period_m(), w.y.period_m()],
            repeats: grid.repeats,
            edges_m: edges_m(&grid.points),
            start_s,
            carried_mps: carried.map(|(carried, _)| carried),
            origin_m: origin_m.into(),
            turned_rad,
            carried_in_model_mps: carried.map_or([0.0; 2], |(_, wind)| wind.into()),
        };
        let air = GriddedAir::new(source, grid, Placing { origin_m, turned_rad }, passage);
        Ok(Les { air: Arc::new(air), about })
    }
}

/// Number of the time that is nearest.
fn nearest(times_s: &[f64], at_s: f64) -> usize {
    let off = |time_s: &f64| (time_s - at_s).abs();
    let found =
        times_s.iter().enumerate().min_by(|(_, one), (_, other)| off(one).total_cmp(&off(other)));
    found.map_or(0, |(index, _)| index)
}

/// Heights above the show's ground that all components have.
fn heights_m(points: &[Points; 3], ground_m: f64) -> (f64, f64) {
    let low_m = points.iter().map(|of| of.z.ends_m().0).fold(f64::NEG_INFINITY, f64::max);
    let high_m = points.iter().map(|of| of.z.ends_m().1).fold(f64::INFINITY, f64::min);
    (low_m - ground_m, high_m - ground_m)
}

/// Edges within which all components have points.
fn edges_m(points: &[Points; 3]) -> [(f64, f64); 2] {
    [|of: &Points| of.x, |of: &Points| of.y].map(|axis| {
        let first = points.iter().map(|of| axis(of).first_m).fold(f64::NEG_INFINITY, f64::max);
        let last = points.iter().map(|of| axis(of).last_m()).fold(f64::INFINITY, f64::min);
        (first, last)
    })
}

/// Mean of the horizontal wind over the model at a height, along its x and y, m/s.
fn mean_wind(
    source: &dyn GridSource,
    grid: &Grid,
    time: usize,
    height_m: f64,
) -> Result<Vector2<f64>, String> {
    let mut means = [0.0; 2];
    for (mean, component) in means.iter_mut().zip([Component::U, Component::V]) {
        let points = &grid.points[component as usize];
        let heights = points.z.all_m();
        let above = heights.partition_point(|m| *m < height_m).min(heights.len().saturating_sub(1));
        let below = above.saturating_sub(1);
        let (low_m, high_m) = (heights[below], heights[above]);
        let share = if above == below {
            0.0
        } else {
            ((height_m - low_m) / (high_m - low_m)).clamp(0.0, 1.0)
        };
        let low = plane_mean(source, points, (component, time), below)?;
        let high = plane_mean(source, points, (component, time), above)?;
        *mean = low + share * (high - low);
    }
    Ok(means.into())
}

fn plane_mean(
    source: &dyn GridSource,
    points: &Points,
    (component, time): (Component, usize),
    level: usize,
) -> Result<f64, String> {
    let (mut sum, mut number) = (0.0, 0_usize);
    for row in (0..points.y.count).step_by(ROWS) {
        let rows = ROWS.min(points.y.count - row);
        let block = Block { from: [level, row, 0], count: [1, rows, points.x.count] };
        for value in
            source.read(component, time, &block)?.into_iter().filter(|value| value.is_finite())
        {
            sum += f64::from(value);
            number += 1;
        }
    }
    Ok(if number == 0 { 0.0 } else { sum / number as f64 })
}
