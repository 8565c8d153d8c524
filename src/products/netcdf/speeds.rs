//! The speeds of each second and their flags: names, words, and what they are of a row.

use netcdf_writer::NcAttrValue;

use super::file::{Attribute, text};
use crate::products::fields::{FILLED, FieldRow};

/// Flags of a value, each a bit from the lowest on; the names are those of the tables.
const FLAGS: [&str; 10] = [
    "saturation",
    "low_battery",
    "gap",
    "incomplete",
    "manoeuvre",
    "misaligned",
    "drift",
    "no_voltage",
    "beyond_ladder",
    FILLED,
];

/// Bits of a row's flags.
pub(super) fn bits(row: &FieldRow) -> i16 {
    let bit = |name: &str| FLAGS.iter().position(|flag| *flag == name).map_or(0, |bit| 1 << bit);
    row.flags.split(';').map(bit).fold(0, |bits: i16, bit| bits | bit)
}

/// Attributes of the flags.
pub(super) fn flag_attributes(coordinates: &str) -> Vec<Attribute<'static>> {
    let masks: Vec<i16> = (0..FLAGS.len()).map(|bit| 1 << bit).collect();
    vec![
        ("standard_name", text("quality_flag")),
        ("long_name", text("doubts about w; 0: none")),
        ("flag_masks", NcAttrValue::Shorts(masks)),
        ("flag_meanings", text(FLAGS.join(" "))),
        ("coordinates", text(coordinates)),
        ("coverage_content_type", text("qualityInformation")),
    ]
}

/// A speed of each second, m/s.
pub(super) struct Speed {
    pub(super) name: &'static str,
    /// By CF; empty: none fits.
    standard_name: &'static str,
    long_name: &'static str,
    /// Errors and flags of a mean over 10 s; empty: there are none. Absent: it is an error itself.
    errors: Option<&'static str>,
    pub(super) get: fn(&FieldRow) -> Option<f64>,
}

impl Speed {
    pub(super) fn attributes(&self, coordinates: &str) -> Vec<Attribute<'static>> {
        let kind = if self.errors.is_some() { "physicalMeasurement" } else { "qualityInformation" };
        let all = [
            ("standard_name", self.standard_name),
            ("long_name", self.long_name),
            ("units", "m s-1"),
            ("ancillary_variables", self.errors.unwrap_or_default()),
            ("cell_methods", self.errors.map_or("", |_| "time: mean")),
            ("coordinates", coordinates),
            ("coverage_content_type", kind),
        ];
        let there = all.into_iter().filter(|(_, value)| !value.is_empty());
        there.map(|(name, value)| (name, text(value))).collect()
    }
}

/// Speeds that any row has. Those that programs look for are there even where they are not known.
pub(super) fn of(rows: &[FieldRow]) -> Vec<Speed> {
    let always = ["w", "w_se", "u", "u_se", "v", "v_se"];
    let used =
        |one: &Speed| always.contains(&one.name) || rows.iter().any(|row| (one.get)(row).is_some());
    all().into_iter().filter(used).collect()
}

fn all() -> [Speed; 10] {
    const W: &str = "upward_air_velocity";
    const W_SE: &str = "upward_air_velocity standard_error";
    [
        Speed {
            name: "w",
            standard_name: W,
            long_name: "vertical air speed, up positive",
            errors: Some("w_se w_flag"),
            get: |row| row.w_mps,
        },
        Speed {
            name: "w_se",
            standard_name: W_SE,
            long_name: "standard error of w, all errors included",
            errors: None,
            get: |row| row.w_se_mps,
        },
        Speed {
            name: "w_noise",
            standard_name: "",
            long_name: "standard error of w from the drone's own noise alone",
            errors: None,
            get: |row| row.sd_mps,
        },
        Speed {
            name: "w_posterior",
            standard_name: W,
            long_name: "vertical air speed, posterior mean (all drones and seconds together)",
            errors: Some("w_posterior_se"),
            get: |row| row.posterior_mps,
        },
        Speed {
            name: "w_posterior_se",
            standard_name: W_SE,
            long_name: "standard deviation of w_posterior, all errors included",
            errors: None,
            get: |row| row.posterior_sd_mps,
        },
        Speed {
            name: "w_true",
            standard_name: W,
            long_name: "true vertical air speed: a simulation's, or by instruments beside the drone",
            errors: Some(""),
            get: |row| row.truth_mps,
        },
        Speed {
            name: "u",
            standard_name: "eastward_wind",
            long_name: "wind towards true east, by the drone's lean",
            errors: Some("u_se"),
            get: |row| Some(row.wind_mps?[0]),
        },
        Speed {
            name: "u_se",
            standard_name: "eastward_wind standard_error",
            long_name: "standard error of u, from drag and trim",
            errors: None,
            get: |row| Some(row.wind_se_mps?[0]),
        },
        Speed {
            name: "v",
            standard_name: "northward_wind",
            long_name: "wind towards true north, by the drone's lean",
            errors: Some("v_se"),
            get: |row| Some(row.wind_mps?[1]),
        },
        Speed {
            name: "v_se",
            standard_name: "northward_wind standard_error",
            long_name: "standard error of v, from drag and trim",
            errors: None,
            get: |row| Some(row.wind_se_mps?[1]),
        },
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analysis::result::Quality;

    #[test]
    fn each_flag_of_an_analysis_has_its_bit() {
        // A new kind of doubt must get a bit, at the end.
        let all = [
            Quality::Saturation,
            Quality::LowBattery,
            Quality::Gap,
            Quality::Incomplete,
            Quality::Manoeuvre,
            Quality::Misaligned,
            Quality::Drift,
            Quality::NoVoltage,
            Quality::BeyondLadder,
        ];
        for (bit, quality) in all.into_iter().enumerate() {
            let name = serde_json::to_value(quality).unwrap();
            assert_eq!(name.as_str(), Some(FLAGS[bit]));
        }
    }
}
