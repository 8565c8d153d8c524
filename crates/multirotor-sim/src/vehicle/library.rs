//! Vehicles that come with the program.

use std::path::Path;

use super::{Vehicle, VehicleError};
use untrusted_io::file::{FileError, read_whole};

/// Largest vehicle file that is read, bytes.
const MAX_VEHICLE_BYTES: u64 = 1 << 20;

/// Name and TOML text of every built-in vehicle, sorted by name.
const BUILTIN: &[(&str, &str)] = &[
    ("airsim-generic-quad", include_str!("../../vehicles/airsim-generic-quad.toml")),
    ("arducopter-sitl", include_str!("../../vehicles/arducopter-sitl.toml")),
    ("phantom4", include_str!("../../vehicles/phantom4.toml")),
    ("pixel", include_str!("../../vehicles/pixel.toml")),
];

/// Names of the built-in vehicles, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// TOML text of a built-in vehicle, as it is in `templates/vehicles/`; `None` if there is none of
/// this name.
pub fn builtin_toml(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(candidate, _)| *candidate == name).map(|(_, text)| *text)
}

/// Built-in vehicle by its name.
///
/// ```
/// use multirotor_sim::vehicle::library::{builtin, names};
///
/// assert!(names().any(|name| name == "pixel"));
/// assert!(builtin("pixel")?.airframe.mass_kg > 0.1);
/// // The error lists the names that exist.
/// assert!(builtin("zeppelin").unwrap_err().to_string().contains("pixel"));
/// # Ok::<(), multirotor_sim::vehicle::VehicleError>(())
/// ```
///
/// # Errors
/// [`VehicleError::Unknown`] lists the names that exist.
pub fn builtin(name: &str) -> Result<Vehicle, VehicleError> {
    let text = builtin_toml(name).ok_or_else(|| VehicleError::Unknown {
        name: name.to_owned(),
        known: names().collect::<Vec<_>>().join(", "),
    })?;
    Vehicle::from_toml(text, name)
}

/// Reads a vehicle by the path of its TOML file or by its built-in name (with or without folder and
/// `.toml`).
///
/// # Errors
///
/// If the file is unreadable or not valid, or the name is neither a file nor built in.
pub fn load(name: &str) -> Result<Vehicle, VehicleError> {
    let path = Path::new(name);
    if path.is_file() {
        let bytes = read_whole(path, MAX_VEHICLE_BYTES)?;
        return Vehicle::from_toml(&String::from_utf8_lossy(&bytes), name);
    }
    let plain = name.strip_prefix("templates/vehicles/").unwrap_or(name);
    builtin(plain.strip_suffix(".toml").unwrap_or(plain)).map_err(|error| {
        // A path is a file that is not there, not a wrong name.
        if name.contains(['/', '\\', '.']) {
            FileError::new("read", path, std::io::ErrorKind::NotFound.into()).into()
        } else {
            error
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_builtin_is_valid_and_named_like_its_file() {
        for name in names() {
            assert_eq!(builtin(name).unwrap().name, name);
        }
    }

    #[test]
    fn an_unknown_name_is_told_what_exists() {
        let error = builtin("pixle").unwrap_err().to_string();
        assert!(error.contains("pixle") && error.contains("airsim-generic-quad"), "{error}");
    }
}
