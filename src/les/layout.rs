//! Axes of a model's components, from the coordinates of its variables.

use super::LesError;
use super::file::{DIMENSIONS, File, is_number, listed};
use super::map::{ComponentMap, LesMap};
use crate::sim::air::gridded::{Component, Heights, Points, Regular};

/// Share by which spacings of the components may differ.
const ALIKE: f64 = 2e-3;
/// Times of the components that are the same, s.
const SAME_S: f64 = 1e-3;

/// Points of a component and its times.
pub(super) struct Layout {
    pub(super) points: Points,
    pub(super) times_s: Vec<f64>,
}

/// Length of a unit, m.
fn unit_m(units: Option<&str>) -> Option<f64> {
    match units.unwrap_or("m").to_ascii_lowercase().as_str() {
        "" | "1" | "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "km" | "kilometer" | "kilometers" | "kilometre" | "kilometres" => Some(1000.0),
        _ => None,
    }
}

/// Whether a unit is metres per second, as models write it; without one nothing speaks against it.
fn is_mps(units: &str) -> bool {
    let letters: String =
        units.to_ascii_lowercase().chars().filter(|letter| !letter.is_whitespace()).collect();
    let known = [
        "",
        "m/s",
        "ms-1",
        "ms^-1",
        "ms**-1",
        "m.s-1",
        "ms^{-1}",
        "meterssecond-1",
        "metersecond-1",
        "metres/second",
        "meters/second",
    ];
    known.contains(&letters.as_str())
}

/// Duration of a unit of time, s: `seconds since ...` is one of seconds.
fn unit_s(units: Option<&str>) -> Option<f64> {
    let text = units.unwrap_or("s").to_ascii_lowercase();
    match text.split_whitespace().next().unwrap_or("s") {
        "1" | "s" | "sec" | "secs" | "second" | "seconds" => Some(1.0),
        "min" | "mins" | "minute" | "minutes" => Some(60.0),
        "h" | "hr" | "hrs" | "hour" | "hours" => Some(3600.0),
        "d" | "day" | "days" => Some(86_400.0),
        _ => None,
    }
}

/// Reads the axes of one component.
pub(super) fn layout(file: &File, names: &ComponentMap, map: &LesMap) -> Result<Layout, LesError> {
    let wrong = |reason: String| LesError::of_variable(&file.path, &names.variable, reason);
    let Some(variable) = file.variable(&names.variable) else {
        return Err(wrong(format!(
            "there is no such variable; those with four dimensions are {}",
            listed(&file.fields())
        )));
    };
    if variable.ndim() != DIMENSIONS || !is_number(variable) {
        return Err(wrong(format!(
            "it must be numbers over time, z, y and x (4 dimensions), but has {} dimensions{}",
            variable.ndim(),
            if is_number(variable) { "" } else { " and no numbers" }
        )));
    }
    if let Some(units) = file.units(&names.variable).filter(|units| !is_mps(units)) {
        return Err(wrong(format!(
            "its unit is \"{units}\", and air is read in m/s: convert it (ncap2 -s), or correct its attribute units"
        )));
    }
    let mut axes = Vec::new();
    for (index, dimension) in variable.dimensions().iter().enumerate() {
        let name = names.coordinate(index).unwrap_or(&dimension.name);
        let units = file.units(name);
        let is_time = index == 0;
        let (unit, given, key) = if is_time {
            (unit_s(units.as_deref()), map.time_unit_s, "time_unit_s")
        } else {
            (unit_m(units.as_deref()), map.length_unit_m, "length_unit_m")
        };
        let Some(unit) = given.or(unit) else {
            return Err(LesError::of_variable(
                &file.path,
                name,
                format!(
                    "its unit \"{}\" is not known: dimensions must be time, z, y and x in this order (`ncpdq -a` changes \
                     it), with lengths in m or km; else give {key} in a mapping",
                    units.unwrap_or_default()
                ),
            ));
        };
        let values = file.axis(name)?;
        let expected = variable.shape().get(index).copied().unwrap_or(0);
        if values.len() as u64 != expected {
            return Err(LesError::of_variable(
                &file.path,
                name,
                format!("it has {} points, and {} has {expected}", values.len(), names.variable),
            ));
        }
        axes.push((name.to_owned(), values.iter().map(|value| value * unit).collect::<Vec<_>>()));
    }
    let [time, z, y, x] = <[(String, Vec<f64>); DIMENSIONS]>::try_from(axes)
        .map_err(|_| wrong("it must have four dimensions".to_owned()))?;
    let regular = |(name, values): (String, Vec<f64>)| {
        Regular::of(&values).ok_or_else(|| {
            LesError::of_variable(
                &file.path,
                &name,
                "its points do not rise in equal steps: stretched grids cannot be read; interpolate to an equidistant one",
            )
        })
    };
    let (name_z, z) = z;
    let z = Heights::of(z).ok_or_else(|| {
        LesError::of_variable(&file.path, &name_z, "its heights must be two or more that rise")
    })?;
    let points = Points { x: regular(x)?, y: regular(y)?, z };
    Ok(Layout { points, times_s: times(file, time)? })
}

/// Times that rise; an unlimited axis may end with values that were never written.
fn times(file: &File, (name, mut values): (String, Vec<f64>)) -> Result<Vec<f64>, LesError> {
    let is_written = |value: &f64| value.is_finite() && value.abs() < 1e30;
    let written = values.iter().take_while(|value| is_written(value)).count();
    values.truncate(written);
    let rises = values.windows(2).all(|pair| pair[0] < pair[1]);
    if values.is_empty() || !rises {
        return Err(LesError::of_variable(
            &file.path,
            &name,
            if values.is_empty() { "there is no time" } else { "its times do not rise" },
        ));
    }
    Ok(values)
}

/// Joins the components' layouts: equal times, as many points of each as the model has cells.
pub(super) fn joined(
    files: [&File; 3],
    names: [&ComponentMap; 3],
    layouts: [Layout; 3],
    map: &LesMap,
) -> Result<([Points; 3], Vec<f64>), LesError> {
    let [u, v, w] = layouts;
    for (component, layout) in [(Component::U, &u), (Component::V, &v)] {
        let index = component as usize;
        let wrong = |reason: String| {
            LesError::of_variable(&files[index].path, &names[index].variable, reason)
        };
        let same = layout.times_s.len() == w.times_s.len()
            && layout
                .times_s
                .iter()
                .zip(&w.times_s)
                .all(|(one, other)| (one - other).abs() < SAME_S);
        if !same {
            return Err(wrong(format!(
                "it has {} times from {} s, and {} has {} from {} s: all components must have the same",
                layout.times_s.len(),
                layout.times_s.first().copied().unwrap_or(0.0),
                names[2].variable,
                w.times_s.len(),
                w.times_s.first().copied().unwrap_or(0.0)
            )));
        }
        for (axis, one, other) in
            [("x", layout.points.x, w.points.x), ("y", layout.points.y, w.points.y)]
        {
            if (one.spacing_m / other.spacing_m - 1.0).abs() > ALIKE {
                return Err(wrong(format!(
                    "its points along {axis} are {} m apart, and those of {} {} m",
                    one.spacing_m, names[2].variable, other.spacing_m
                )));
            }
            // Staggered by half a cell, at most.
            if (one.first_m - other.first_m).abs() > 1.01 * other.spacing_m {
                return Err(wrong(format!(
                    "its points along {axis} begin at {} m, and those of {} at {} m",
                    one.first_m, names[2].variable, other.first_m
                )));
            }
        }
    }
    let mut points = [u.points, v.points, w.points];
    for (axis, get) in [(0, along_x as fn(&mut Points) -> &mut Regular), (1, along_y)] {
        let fewest = points.iter_mut().map(|of| get(of).count).min().unwrap_or(0);
        let cells = match map.period_m {
            None => fewest,
            Some(period_m) => {
                let spacing_m = get(&mut points[2]).spacing_m;
                let cells = (period_m[axis] / spacing_m).round();
                if cells < 2.0 || cells > fewest as f64 {
                    return Err(LesError::of_file(
                        &files[2].path,
                        format!(
                            "period_m is {} m, but the model has {fewest} points every {spacing_m} m",
                            period_m[axis]
                        ),
                    ));
                }
                cells as usize
            }
        };
        for of in &mut points {
            get(of).count = cells;
        }
    }
    Ok((points, w.times_s))
}

fn along_x(points: &mut Points) -> &mut Regular {
    &mut points.x
}

fn along_y(points: &mut Points) -> &mut Regular {
    &mut points.y
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_models_are_known() {
        assert_eq!(unit_m(Some("m")), Some(1.0));
        assert_eq!(unit_m(Some("km")), Some(1000.0));
        assert_eq!(unit_m(None), Some(1.0));
        assert!(["m/s", "m s-1", "m s**-1", ""].into_iter().all(is_mps));
        assert!(!["cm/s", "K", "m"].into_iter().any(is_mps));
        assert_eq!(unit_m(Some("degrees_east")), None);
        assert_eq!(unit_s(Some("seconds since 2019-06-21 12:00:00 +00")), Some(1.0));
        assert_eq!(unit_s(Some("minutes")), Some(60.0));
        assert_eq!(unit_s(Some("hours since midnight")), Some(3600.0));
        assert_eq!(unit_s(Some("m")), None);
    }
}
