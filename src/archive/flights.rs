//! The table `flights`: a row for each flight of each campaign.

use super::origin::Origin;
use super::slim::{Flight, Known, Map, Posterior, Scales, Wind};
use super::table::{Column, real, text, time, truth, whole};
use crate::mission::plan::Purpose;
use crate::numeric::median;

/// A flight with its origin, which the rows of all tables are made from.
#[derive(Clone, Debug)]
pub struct Flown<'a> {
    /// Title of the campaign.
    pub title: &'a str,
    /// Program that analysed it.
    pub made_by: &'a str,
    /// Analysis of the flight.
    pub flight: &'a Flight,
    /// Origin of the flight.
    pub origin: Origin,
    /// Name of the site.
    pub site: Option<String>,
}

impl Flown<'_> {
    /// Map of the flight.
    pub fn map(&self) -> Option<&Map> {
        self.flight.map.as_ref()
    }

    /// Wind by the leans.
    pub fn wind(&self) -> Option<&Wind> {
        self.flight.statistics.as_ref()?.wind.as_ref()
    }

    /// Wind speed, m/s, with its error.
    pub fn wind_speed(&self) -> Known {
        self.wind().and_then(|wind| wind.speed_mps).unwrap_or_default()
    }

    /// Median height of the map's drones above home, m.
    pub fn height_m(&self) -> Option<f64> {
        median(self.map()?.drones.iter().filter_map(|drone| drone.height_m).collect())
    }

    fn posterior(&self) -> Option<&Posterior> {
        self.map()?.posterior.as_ref()
    }

    fn scales(&self) -> Option<&Scales> {
        self.posterior()?.scales.as_ref()
    }

    /// Mean vertical air speed of the fleet: the posterior's, else that of the drones with the error that all share.
    fn mean(&self) -> Option<Known> {
        if let Some(fleet) = self.posterior().and_then(|posterior| posterior.fleet) {
            return Some(fleet);
        }
        let map = self.map()?;
        let means: Vec<f64> = map.drones.iter().filter_map(|drone| drone.mean.value).collect();
        let value = means.iter().sum::<f64>() / means.len() as f64;
        let se = map.common.as_ref().and_then(|common| common.se_mps);
        (!means.is_empty()).then_some(Known { value: Some(value), se })
    }

    fn baseline(&self) -> Option<(Option<f64>, Option<f64>, Option<f64>)> {
        let baseline = self.flight.statistics.as_ref()?.baseline.as_ref()?;
        let of = baseline.fleet.as_ref().unwrap_or(&baseline.drone);
        Some((of.sd_mps, of.integral_time_s, baseline.record_s))
    }

    /// Drones with a law, or in the map.
    fn measured(&self) -> usize {
        match self.flight.purpose {
            Purpose::Calibration => {
                self.flight.drones.iter().filter(|drone| drone.laws.is_some()).count()
            }
            Purpose::Measurement => self.map().map_or(0, |map| map.drones.len()),
        }
    }

    fn law(&self) -> Option<&str> {
        let headline = self.flight.headline.as_ref().map(|headline| headline.law.as_str());
        self.map().map(|map| map.law.as_str()).or(headline)
    }
}

/// Name of a purpose in the tables.
pub(super) fn purpose(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Calibration => "calibration",
        Purpose::Measurement => "measurement",
    }
}

/// Columns of the table.
pub fn columns<'a>() -> Vec<Column<Flown<'a>>> {
    vec![
        text("flight", |row| Some(&row.flight.name)),
        text("title", |row| Some(row.title)),
        text("purpose", |row| Some(purpose(row.flight.purpose))),
        truth("simulated", |row| row.origin.simulated),
        time("start_utc", |row| row.origin.utc_ms(0.0)),
        real("duration_s", |row| row.origin.duration_s),
        time("map_start_utc", |row| row.origin.utc_ms(row.map()?.time_s.ends_s?[0])),
        time("map_end_utc", |row| row.origin.utc_ms(row.map()?.time_s.ends_s?[1])),
        text("site", |row| row.site.as_deref()),
        real("site_latitude_deg", |row| Some(row.origin.site?.origin_lat_deg)),
        real("site_longitude_deg", |row| Some(row.origin.site?.origin_lon_deg)),
        real("site_amsl_m", |row| {
            row.origin.site.filter(|site| !site.ground_assumed).map(|site| site.ground_amsl_m)
        }),
        real("orientation_deg", |row| Some(row.origin.site?.orientation_deg)),
        text("vehicle", |row| row.origin.vehicle.as_deref()),
        text("effort_unit", |row| Some(row.flight.indicator.unit())),
        whole("drones_planned", |row| row.origin.planned.map(|number| number as i64)),
        whole("drones_analysed", |row| Some(row.flight.drones.len() as i64)),
        whole("drones_measured", |row| Some(row.measured() as i64)),
        whole("slots_missing", |row| Some(row.flight.missing.len() as i64)),
        whole("logs", |row| Some(row.flight.logs as i64)),
        text("law", Flown::law),
        real("height_m", Flown::height_m),
        real("w_mps", |row| row.mean()?.value),
        real("w_se_mps", |row| row.mean()?.error()),
        real("w_sd_mps", |row| {
            row.flight.statistics.as_ref()?.record.sd_mps.filter(|sd_mps| *sd_mps > 0.0)
        }),
        real("zero_se_mps", |row| row.map()?.common.as_ref()?.zero_mps),
        real("common_se_mps", |row| row.map()?.common.as_ref()?.se_mps),
        real("wind_mps", |row| row.wind_speed().value),
        real("wind_se_mps", |row| row.wind_speed().error()),
        real("wind_from_deg", |row| row.wind()?.from_deg),
        real("wind_from_se_deg", |row| row.wind()?.from_se_deg()),
        real("lean_deg", |row| row.wind()?.lean_deg),
        real("field_sd_mps", |row| row.scales()?.sd_mps),
        real("field_length_m", |row| row.scales()?.length_m.value),
        real("field_time_s", |row| row.scales()?.time_s.value),
        real("gust_mps", |row| row.scales()?.gust_mps),
        real("baseline_sd_mps", |row| row.baseline()?.0),
        real("baseline_integral_time_s", |row| row.baseline()?.1),
        real("baseline_record_s", |row| row.baseline()?.2),
        whole("thermals", |row| row.map().map(|map| map.thermals.len() as i64)),
        real("true_updraft_mps", |row| row.flight.true_updraft_mps),
        real("truth_rms_mps", |row| row.map()?.truth.as_ref()?.rms_mps),
        real("truth_bias_mps", |row| row.map()?.truth.as_ref()?.bias_mps),
        real("posterior_truth_rms_mps", |row| row.posterior()?.truth.as_ref()?.rms_mps),
        text("analysed_by", |row| Some(row.made_by)),
    ]
}
