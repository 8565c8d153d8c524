//! Vehicles that come with the program.

use super::{Vehicle, VehicleError};

/// Name and TOML text of every built-in vehicle, sorted by name.
const BUILTIN: &[(&str, &str)] =
    &[("airsim-generic-quad", include_str!("../../templates/vehicles/airsim-generic-quad.toml"))];

/// Names of the built-in vehicles, sorted.
pub fn names() -> impl Iterator<Item = &'static str> {
    BUILTIN.iter().map(|(name, _)| *name)
}

/// The TOML text of a built-in vehicle, as it is in `templates/vehicles/`.
pub fn builtin_toml(name: &str) -> Option<&'static str> {
    BUILTIN.iter().find(|(candidate, _)| *candidate == name).map(|(_, text)| *text)
}

/// A built-in vehicle.
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
        let error = builtin("pixel").unwrap_err().to_string();
        assert!(error.contains("pixel") && error.contains("airsim-generic-quad"), "{error}");
    }
}
