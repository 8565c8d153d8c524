//! Mapping files: the names of a model's variables.

use serde::Deserialize;

use crate::base::parse;

/// Name and version of the format of these files.
pub const MAP_SCHEMA: &str = "updraft.les-map/1";
/// Longest name in a file.
const LONGEST: usize = 256;

/// Names of the variables of one component.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ComponentMap {
    /// The component's variable, over time, height, y and x.
    pub variable: String,
    /// File that holds it, beside the one that was given; absent: that one.
    pub file: Option<String>,
    /// Coordinate along x; absent: the variable with the name of the dimension.
    pub x: Option<String>,
    /// Coordinate along y.
    pub y: Option<String>,
    /// Coordinate along the vertical.
    pub z: Option<String>,
    /// Coordinate of the times.
    pub time: Option<String>,
}

impl ComponentMap {
    /// The coordinate of a dimension (0: time, 1: z, 2: y, 3: x), if one is named.
    pub fn coordinate(&self, dimension: usize) -> Option<&str> {
        [&self.time, &self.z, &self.y, &self.x].get(dimension).and_then(|name| name.as_deref())
    }
}

/// A mapping: names and units of a model's output.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LesMap {
    /// Format name and version: `updraft.les-map/1`.
    pub schema: String,
    /// Velocity along x.
    pub u: ComponentMap,
    /// Velocity along y, which is to the left of x.
    pub v: ComponentMap,
    /// Velocity along the vertical, up positive.
    pub w: ComponentMap,
    /// Length of one unit of the coordinates, m; absent: by their attribute `units`, else 1.
    pub length_unit_m: Option<f64>,
    /// Duration of one unit of time, s; absent: by its attribute `units`, else 1.
    pub time_unit_s: Option<f64>,
    /// Lengths after which the model repeats itself along x and y, m; absent: its points times their distance.
    pub period_m: Option<[f64; 2]>,
}

impl LesMap {
    /// Reads a mapping.
    ///
    /// # Errors
    /// A sentence that says which key is wrong.
    pub fn from_toml(text: &str) -> Result<Self, String> {
        let map: Self = parse::toml(text).map_err(|error| parse::toml_trouble(text, &error))?;
        if map.schema != MAP_SCHEMA {
            return Err(format!("this program reads \"{MAP_SCHEMA}\", not \"{}\"", map.schema));
        }
        for (component, of) in [("u", &map.u), ("v", &map.v), ("w", &map.w)] {
            let names = [
                Some(&of.variable),
                of.x.as_ref(),
                of.y.as_ref(),
                of.z.as_ref(),
                of.time.as_ref(),
                of.file.as_ref(),
            ];
            for name in names.into_iter().flatten() {
                if name.is_empty() || name.len() > LONGEST || name.contains('\0') {
                    return Err(format!("[{component}] has a name that is empty or too long"));
                }
            }
        }
        let positive = |name: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                Ok(())
            } else {
                Err(format!("{name} is {value}, but must be above 0"))
            }
        };
        for (name, value) in
            [("length_unit_m", map.length_unit_m), ("time_unit_s", map.time_unit_s)]
        {
            value.map_or(Ok(()), |value| positive(name, value))?;
        }
        for value in map.period_m.into_iter().flatten() {
            positive("period_m", value)?;
        }
        Ok(map)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "schema = \"updraft.les-map/1\"\nperiod_m = [100.0, 200.0]\n[u]\nvariable = \"U\"\nx = \"xf\"\n\
                        [v]\nvariable = \"V\"\nfile = \"v.nc\"\n[w]\nvariable = \"W\"\n";

    #[test]
    fn a_mapping_names_variables_coordinates_and_files() {
        let map = LesMap::from_toml(GOOD).unwrap();
        assert_eq!((map.u.variable.as_str(), map.u.coordinate(3)), ("U", Some("xf")));
        assert_eq!((map.v.file.as_deref(), map.v.coordinate(0)), (Some("v.nc"), None));
        assert_eq!(map.period_m, Some([100.0, 200.0]));
    }

    #[test]
    fn what_is_wrong_is_named() {
        let refused = |from: &str, to: &str, word: &str| {
            let error = LesMap::from_toml(&GOOD.replace(from, to)).unwrap_err();
            assert!(error.contains(word), "{error}");
        };
        refused("les-map/1", "les-map/2", "updraft.les-map/2");
        refused("variable = \"W\"", "", "variable");
        refused("\"V\"", "\"\"", "[v]");
        refused("100.0", "0.0", "period_m");
        refused("100.0", "nan", "period_m");
        refused("period_m", "periode_m", "periode_m");
    }

    /// Whatever the bytes are: an answer, and no panic.
    #[test]
    fn damaged_mappings_do_not_panic() {
        use rand::{Rng as _, RngExt as _};
        let mut rng = crate::base::rng::stream(7, 1, crate::base::rng::Purpose::Air);
        let mut refused = 0;
        for _ in 0..3_000 {
            let mut bytes = GOOD.as_bytes().to_vec();
            for _ in 0..rng.random_range(1..6) {
                let at = rng.random_range(0..bytes.len());
                bytes[at] = (rng.next_u32() & 0x7f) as u8;
            }
            refused += u32::from(LesMap::from_toml(&String::from_utf8_lossy(&bytes)).is_err());
        }
        assert!((1_000..3_000).contains(&refused), "{refused}");
    }
}
