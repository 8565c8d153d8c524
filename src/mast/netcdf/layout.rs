//! Axes of a mast's variable: its times, the height that is read of several, and where the mast stands.

use crate::base::netcdf::{NetcdfFile, Selection, Variable, text};
use crate::base::plain::plain;
use crate::numeric::median;

use super::units::length_m;

/// Names of coordinates that are heights, lower case.
const HEIGHTS: [&str; 7] = ["height", "heights", "z", "height_m", "level", "height_agl", "z_m"];
const LATITUDES: [&str; 3] = ["lat", "latitude", "latitude_deg"];
const LONGITUDES: [&str; 3] = ["lon", "longitude", "longitude_deg"];

/// Which values of a variable are read.
pub(super) struct Layout<'a> {
    /// Coordinate of its times.
    pub(super) time: &'a Variable,
    /// Number of times.
    pub(super) count: u64,
    /// Number of the dimension of times.
    time_at: usize,
    /// Index in each other dimension.
    fixed: Vec<u64>,
    /// Height that they are of, m, if known.
    pub(super) height_m: Option<f64>,
    /// All heights that the variable has, where it has several, m.
    pub(super) heights_m: Vec<f64>,
}

impl Layout<'_> {
    /// Selection of some times.
    pub(super) fn times(&self, start: u64, end: u64) -> Vec<Selection> {
        let one = |(at, index): (usize, &u64)| {
            if at == self.time_at {
                Selection::Slice { start, end, step: 1 }
            } else {
                Selection::Index(*index)
            }
        };
        self.fixed.iter().enumerate().map(one).collect()
    }
}

/// Whether a variable counts times.
fn is_time(variable: &Variable) -> bool {
    let has = |attribute: &str, what: &str| text(variable, attribute).as_deref() == Some(what);
    variable.ndim() == 1
        && (has("standard_name", "time")
            || has("axis", "T")
            || text(variable, "units")
                .is_some_and(|units| units.to_lowercase().contains(" since ")))
}

/// Coordinates that a variable names, and those of its dimensions.
fn coordinates<'a>(file: &'a NetcdfFile, variable: &Variable) -> Vec<&'a Variable> {
    let named = text(variable, "coordinates").unwrap_or_default();
    let of_dimensions = variable.dimensions().iter().filter_map(|one| file.variable(&one.name));
    of_dimensions.chain(named.split_whitespace().filter_map(|name| file.variable(name))).collect()
}

/// The coordinate of times: the one that is named, else that of the variable, else any along one of its dimensions.
fn times<'a>(
    file: &'a NetcdfFile,
    variable: &Variable,
    named: Option<&str>,
) -> Result<(&'a Variable, usize), String> {
    let along = |time: &Variable| {
        let own = time.dimensions().first()?;
        variable.dimensions().iter().position(|one| one.name == own.name)
    };
    let place = |time: &'a Variable| {
        along(time).map(|at| (time, at)).ok_or_else(|| {
            format!("its times {} are not along one of its dimensions", plain(time.name()))
        })
    };
    if let Some(name) = named {
        let time = file.variable(name).ok_or_else(|| {
            format!("the mapping names the times {}, and there is no such variable", plain(name))
        })?;
        return place(time);
    }
    let own = coordinates(file, variable);
    let found =
        own.into_iter().chain(file.variables()).find(|one| is_time(one) && along(one).is_some());
    found.map_or_else(
        || {
            Err("no coordinate says its times (units as \"seconds since 1970-01-01 00:00:00\"): name them under [time] in a \
                 TOML file (docs/mast.md) and give that"
                .to_owned())
        },
        place,
    )
}

/// Whether a coordinate is a height above the ground, and the length of its unit, m; below the ground where it is
/// positive downwards.
fn height_unit_m(variable: &Variable) -> Option<f64> {
    let name = variable.name().to_ascii_lowercase();
    let standard = text(variable, "standard_name");
    let is_height = match standard.as_deref() {
        Some(name) => name == "height",
        None => HEIGHTS.contains(&name.as_str()) || text(variable, "axis").as_deref() == Some("Z"),
    };
    let unit_m = match text(variable, "units") {
        Some(units) => length_m(&units)?,
        None => 1.0,
    };
    let down = text(variable, "positive").is_some_and(|way| way.eq_ignore_ascii_case("down"));
    is_height.then_some(if down { -unit_m } else { unit_m })
}

/// Finds the axes of a variable; of several heights the one nearest to `near_m` is read.
pub(super) fn layout<'a>(
    file: &'a NetcdfFile,
    variable: &Variable,
    (time, near_m): (Option<&str>, Option<f64>),
) -> Result<Layout<'a>, String> {
    let (time, time_at) = times(file, variable, time)?;
    let shape = variable.shape();
    let all = coordinates(file, variable);
    let mut found = Layout {
        time,
        count: shape.get(time_at).copied().unwrap_or(0),
        time_at,
        fixed: vec![0; shape.len()],
        height_m: None,
        heights_m: Vec::new(),
    };
    for (at, (dimension, length)) in variable.dimensions().iter().zip(&shape).enumerate() {
        if at == time_at {
            continue;
        }
        let along = |one: &&&Variable| {
            one.dimensions().len() == 1
                && one.dimensions().first().is_some_and(|own| own.name == dimension.name)
        };
        let axis = all.iter().filter(along).find_map(|one| Some((*one, height_unit_m(one)?)));
        let heights_m: Option<Vec<f64>> = match axis {
            Some((one, unit_m)) => {
                Some(file.axis(one)?.into_iter().map(|value| value * unit_m).collect())
            }
            None => None,
        };
        let name = plain(&dimension.name).into_owned();
        match (length, heights_m) {
            (0, _) => return Err(format!("its dimension {name} is empty")),
            (1, heights_m) => {
                found.height_m = found.height_m.or(heights_m.and_then(|all| all.first().copied()));
            }
            (_, Some(heights_m)) => {
                let known = || heights_m.iter().enumerate().filter(|(_, m)| m.is_finite());
                let list: Vec<String> = known().take(20).map(|(_, m)| format!("{m}")).collect();
                let near_m = near_m.ok_or_else(|| {
                    format!(
                        "it has the heights {} m, and that of the drones is not known: say height_m in a TOML file \
                         (docs/mast.md) and give that",
                        list.join(", ")
                    )
                })?;
                let nearest = known().min_by(|(_, one), (_, other)| {
                    (*one - near_m).abs().total_cmp(&(*other - near_m).abs())
                });
                let (index, height_m) =
                    nearest.ok_or_else(|| format!("its heights ({name}) are no numbers"))?;
                found.height_m = Some(*height_m);
                if let Some(fixed) = found.fixed.get_mut(at) {
                    *fixed = index as u64;
                }
                found.heights_m = known().map(|(_, m)| *m).collect();
            }
            (length, None) => {
                return Err(format!(
                    "it has {length} places along {name}, which is neither time nor a height in m: cut one out \
                     (`ncks -d {name},0 IN.nc OUT.nc`)"
                ));
            }
        }
    }
    if found.height_m.is_none() {
        found.height_m = height_m(file, variable);
    }
    Ok(found)
}

/// The only value of a variable that has no more.
fn only(file: &NetcdfFile, variable: &Variable) -> Option<f64> {
    if variable.shape().iter().any(|length| *length != 1) {
        return None;
    }
    let all = vec![Selection::Index(0); variable.ndim()];
    let values = file.part(variable.name(), all).ok()?;
    values.first().copied().filter(|value| value.is_finite())
}

/// Height of the instrument: a coordinate of the variable with one value, else the only such variable of the file.
fn height_m(file: &NetcdfFile, variable: &Variable) -> Option<f64> {
    let of = |one: &Variable| Some(only(file, one)? * height_unit_m(one)?);
    let own = coordinates(file, variable);
    own.into_iter().find_map(of).or_else(|| {
        let all: Vec<f64> = file.variables().iter().filter_map(of).collect();
        if let [height_m] = all[..] { Some(height_m) } else { None }
    })
}

/// Latitude and longitude of the mast, degrees, if the file has one of each.
pub(super) fn place_deg(file: &NetcdfFile) -> Option<[f64; 2]> {
    let find = |standard: &str, names: &[&str], most: f64| {
        let is = |one: &&Variable| {
            text(one, "standard_name").is_some_and(|own| own == standard)
                || names.contains(&one.name().to_ascii_lowercase().as_str())
        };
        let all: Vec<f64> =
            file.variables().iter().filter(is).filter_map(|one| only(file, one)).collect();
        let value = median(all)?;
        (value.abs() <= most).then_some(value)
    };
    let longitude = find("longitude", &LONGITUDES, 360.0)?;
    let longitude = if longitude > 180.0 { longitude - 360.0 } else { longitude };
    Some([find("latitude", &LATITUDES, 90.0)?, longitude])
}
