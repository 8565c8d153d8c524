//! Models whose output is known by its names.

use std::path::Path;

use super::file::{DIMENSIONS, File, listed};
use super::map::{ComponentMap, LesMap};
use super::{LesError, beside};

/// Names of the components in all of them.
const COMPONENTS: [&str; 3] = ["u", "v", "w"];
/// Dimensions of CM1 up to its release 19 whose coordinates have other names.
const OF_CM1: &[(&str, &[&str])] = &[
    ("ni", &["xh"]),
    ("nip1", &["xf"]),
    ("nj", &["yh"]),
    ("njp1", &["yf"]),
    ("nk", &["zh", "z"]),
    ("nkp1", &["zf"]),
];

/// Names of the variables of a known model, and the model.
///
/// MicroHH writes a file for each component: of `w.nc`, `u.nc` and `v.nc` that lie together, any may be given.
pub(super) fn mapping(path: &Path, file: &File) -> Result<(LesMap, String), LesError> {
    let mut components = Vec::new();
    let mut dimensions = Vec::new();
    for name in COMPONENTS {
        let own = file.variable(name).is_some_and(|variable| variable.ndim() == DIMENSIONS);
        let other = beside(path, &format!("{name}.nc"));
        let opened = if own || !other.is_file() { None } else { Some(File::open(&other)?) };
        let holder = opened.as_ref().unwrap_or(file);
        let Some(variable) = holder.variable(name).filter(|one| one.ndim() == DIMENSIONS) else {
            return Err(LesError::of_file(
                path,
                format!(
                    "there is no variable {name} over time, z, y and x: name the components in a mapping (map=FILE.toml); \
                     variables with four dimensions are {}",
                    listed(&file.fields())
                ),
            ));
        };
        let dims: Vec<String> =
            variable.dimensions().iter().map(|dimension| dimension.name.clone()).collect();
        let coordinate = |dimension: usize| {
            let dimension = dims.get(dimension)?;
            let (_, names) = OF_CM1.iter().find(|(name, _)| name == dimension)?;
            names.iter().find(|name| holder.variable(name).is_some()).map(|name| (*name).to_owned())
        };
        components.push(ComponentMap {
            variable: name.to_owned(),
            file: opened.is_some().then(|| format!("{name}.nc")),
            time: coordinate(0),
            z: coordinate(1),
            y: coordinate(2),
            x: coordinate(3),
        });
        dimensions.push(dims);
    }
    let of = |component: usize, dimension: usize| {
        dimensions.get(component).and_then(|dims| dims.get(dimension)).map_or("", String::as_str)
    };
    let model = match (of(2, 1), of(0, 3)) {
        ("zw_3d", _) => "PALM",
        ("zh", "xh") => "MicroHH",
        ("zf", "xf") | ("nkp1", "nip1") => "CM1",
        _ => "variables u, v and w",
    };
    let mut components = components.into_iter();
    let mut next = || components.next().unwrap_or_default();
    let map = LesMap { u: next(), v: next(), w: next(), ..LesMap::default() };
    Ok((map, model.to_owned()))
}
