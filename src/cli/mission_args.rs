//! Options that change a mission template, shared by `plan` and `run`.

use clap::Args;

use super::exit::CommandError;
use crate::mission::plan::Site;
use crate::mission::resolve::{Mission, Override};
use crate::workflow::mission;

/// What to change in a template. Every other number: `--set KEY=VALUE`.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Mission")]
pub(super) struct MissionArgs {
    /// Grid of the fleet, rows x columns
    #[arg(long, value_name = "RxC", value_parser = parse_grid)]
    pub(super) grid: Option<(i64, i64)>,
    /// Number of drones, if the grid is not full
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub(super) drones: Option<i64>,
    /// Distance between neighbours, m
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub(super) spacing: Option<f64>,
    /// Latitude and longitude of the grid's centre, degrees
    #[arg(long, value_name = "LAT,LON", value_parser = parse_origin, allow_hyphen_values = true)]
    pub(super) origin: Option<(f64, f64)>,
    /// Name of the place, for people: reports begin with it
    #[arg(long, value_name = "NAME")]
    pub(super) site: Option<String>,
    /// Local time there less UTC, h, as 2 or -3.5 (without it reports give mean solar time)
    #[arg(long, value_name = "H", value_parser = hours, allow_hyphen_values = true)]
    pub(super) utc_offset: Option<f64>,
    /// Ground height above mean sea level, m
    #[arg(long, value_name = "M", value_parser = metres, allow_hyphen_values = true)]
    pub(super) ground: Option<f64>,
    /// Direction of the rows, degrees clockwise from north
    #[arg(long, value_name = "DEG", value_parser = degrees, allow_hyphen_values = true)]
    pub(super) orientation: Option<f64>,
    /// Vehicle: a built-in name or a vehicle file
    #[arg(long, value_name = "NAME")]
    pub(super) vehicle: Option<String>,
    /// Speeds of the ladder in the order they are flown, m/s
    #[arg(long, value_name = "V,V,...", value_parser = speed, allow_hyphen_values = true, value_delimiter = ',')]
    pub(super) speeds: Vec<f64>,
    /// Duration of each leg of the ladder, s
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) leg: Option<f64>,
    /// Duration of the hovers between legs, s
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) hover: Option<f64>,
    /// Height of the lower hovers above ground, m
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub(super) baseline: Option<f64>,
    /// Height of the measurement hover above ground, m
    #[arg(long, value_name = "M", value_parser = metres, allow_negative_numbers = true)]
    pub(super) height: Option<f64>,
    /// Duration of the measurement hover, s
    #[arg(long, value_name = "S", value_parser = seconds, allow_negative_numbers = true)]
    pub(super) duration: Option<f64>,
    /// Acceleration of ramps between legs, m/s² (0: steps)
    #[arg(long, value_name = "A", value_parser = acceleration, allow_negative_numbers = true)]
    pub(super) ramp: Option<f64>,
    /// Any other value of the template: --set grid.spacing_m=5, --set hover.duration_s=60
    #[arg(long, value_name = "KEY=VALUE")]
    pub(super) set: Vec<String>,
}

pub(super) fn parse_grid(text: &str) -> Result<(i64, i64), String> {
    text.split_once(['x', 'X'])
        .and_then(|(rows, columns)| Some((rows.trim().parse().ok()?, columns.trim().parse().ok()?)))
        .ok_or_else(|| "write it as rows x columns, for example 7x7".to_owned())
}

fn parse_origin(text: &str) -> Result<(f64, f64), String> {
    text.split_once(',')
        .and_then(|(lat, lon)| Some((lat.trim().parse().ok()?, lon.trim().parse().ok()?)))
        .ok_or_else(|| "write it as latitude,longitude in degrees: 47.4733,19.0621".to_owned())
}

fn number(text: &str, unit: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| format!("a number in {unit}, written without the unit: 100"))
}

fn metres(text: &str) -> Result<f64, String> {
    number(text, "metres")
}

fn seconds(text: &str) -> Result<f64, String> {
    number(text, "seconds")
}

fn degrees(text: &str) -> Result<f64, String> {
    number(text, "degrees")
}

fn hours(text: &str) -> Result<f64, String> {
    number(text, "hours")
}

fn speed(text: &str) -> Result<f64, String> {
    text.trim().parse().map_err(|_| "speeds in m/s with commas between them: 0.5,1,1.5".to_owned())
}

fn acceleration(text: &str) -> Result<f64, String> {
    number(text, "m/s²")
}

impl MissionArgs {
    /// The overrides that these options stand for.
    fn overrides(&self) -> Result<Vec<Override>, CommandError> {
        let mut list = Vec::new();
        if let Some((rows, columns)) = self.grid {
            list.push(Override::new("grid.rows", rows));
            list.push(Override::new("grid.columns", columns));
            if self.drones.is_none() {
                list.push(Override::remove("grid.drones"));
            }
        } else if self.drones.is_some() {
            list.push(Override::remove("grid.rows"));
            list.push(Override::remove("grid.columns"));
        }
        if let Some(drones) = self.drones {
            list.push(Override::new("grid.drones", drones));
        }
        if let Some((lat, lon)) = self.origin {
            list.push(Override::new("site.origin", vec![lat, lon]));
        }
        if let Some(name) = &self.site {
            list.push(Override::new("site.name", name.clone()));
        }
        if let Some(offset_h) = self.utc_offset {
            list.push(Override::new("site.utc_offset_h", offset_h));
        }
        if let Some(vehicle) = &self.vehicle {
            list.push(Override::new("vehicle", vehicle.clone()));
        }
        if !self.speeds.is_empty() {
            list.push(Override::new("speeds_mps", self.speeds.clone()));
        }
        let numbers = [
            ("grid.spacing_m", self.spacing),
            ("site.ground_amsl_m", self.ground),
            ("site.orientation_deg", self.orientation),
            ("leg_s", self.leg),
            ("hover_s", self.hover),
            ("baseline_m", self.baseline),
            ("height_m", self.height),
            ("duration_s", self.duration),
            ("motion.ramp_mps2", self.ramp),
        ];
        for (key, value) in numbers {
            if let Some(value) = value {
                list.push(Override::new(key, value));
            }
        }
        for text in &self.set {
            list.push(Override::parse(text)?);
        }
        Ok(list)
    }

    /// Resolves a template with these options.
    pub(super) fn resolve(&self, template: &str) -> Result<Mission, CommandError> {
        mission::resolve(template, &self.overrides()?)
    }

    /// Whether the site of a plan is the built-in templates' example, and nobody has asked for it.
    pub(super) fn is_example(&self, site: &Site) -> Result<bool, CommandError> {
        Ok(mission::is_example(site, &self.overrides()?))
    }
}
