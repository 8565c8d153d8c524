//! The table `drones`: a row for each drone of each flight, with its law, its hover and its mean of the map.

use super::flights::{Flown, purpose};
use super::slim::{Drone, Fit, Known, Line, MapDrone, Window, flags};
use super::table::{Column, real, text, time, truth, whole};
use crate::base::frame::Geodetic;

/// One drone of one flight.
#[derive(Debug)]
pub struct DroneRow<'a> {
    flown: &'a Flown<'a>,
    drone: Option<&'a Drone>,
    mapped: Option<&'a MapDrone>,
    hover: Hover,
    flags: String,
}

/// The steady hovers of a drone in one flight.
#[derive(Clone, Copy, Debug, Default)]
struct Hover {
    windows: i64,
    pulse_us: Option<f64>,
    pulse_se_us: Option<f64>,
    resting_v: Option<f64>,
    power_w: Option<f64>,
    tilt_deg: Option<f64>,
}

impl Hover {
    fn of(windows: &[Window]) -> Self {
        let used: Vec<&Window> = windows
            .iter()
            .filter(|window| window.kind.is_hover() && window.rejected.is_empty())
            .collect();
        let pulses: Vec<f64> =
            used.iter().filter_map(|window| window.pulse_phi_us.median).collect();
        let supply = |get: fn(&super::slim::Supply) -> Option<f64>| {
            mean(used.iter().filter_map(|window| window.supply.as_ref().and_then(get)))
        };
        let only = used.first().and_then(|window| window.pulse_phi_us.se).filter(|se| *se > 0.0);
        Self {
            windows: used.len() as i64,
            pulse_us: mean(pulses.iter().copied()),
            pulse_se_us: if pulses.len() > 1 { mean_error(&pulses) } else { only },
            resting_v: supply(|supply| supply.resting_v),
            power_w: supply(|supply| supply.power_w.filter(|power| *power > 0.0)),
            tilt_deg: mean(used.iter().filter_map(|window| window.tilt_deg.median)),
        }
    }
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, number) = values.fold((0.0, 0_u32), |(sum, number), value| (sum + value, number + 1));
    (number > 0).then(|| sum / f64::from(number))
}

/// Standard error of the mean of values, from their spread.
fn mean_error(values: &[f64]) -> Option<f64> {
    let mean = mean(values.iter().copied())?;
    let number = values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Some((squares / (number - 1.0) / number).sqrt())
}

/// Rows of a flight: the analysed drones, then those that the map alone has.
pub fn rows<'a>(flown: &'a Flown<'a>) -> impl Iterator<Item = DroneRow<'a>> {
    let mapped = flown.map().map(|map| map.drones.as_slice()).unwrap_or_default();
    let by_name: std::collections::BTreeMap<(Option<u16>, &str), &MapDrone> =
        mapped.iter().map(|drone| ((drone.slot, drone.name.as_str()), drone)).collect();
    let drones = &flown.flight.drones;
    let names: std::collections::BTreeSet<(Option<u16>, &str)> =
        drones.iter().map(|drone| (drone.slot, drone.name.as_str())).collect();
    let analysed = drones.iter().map(move |drone| {
        let mapped = by_name.get(&(drone.slot, drone.name.as_str())).copied();
        DroneRow::of(flown, Some(drone), mapped)
    });
    let others =
        mapped.iter().filter(move |drone| !names.contains(&(drone.slot, drone.name.as_str())));
    analysed.chain(others.map(|mapped| DroneRow::of(flown, None, Some(mapped))))
}

impl<'a> DroneRow<'a> {
    fn of(flown: &'a Flown<'a>, drone: Option<&'a Drone>, mapped: Option<&'a MapDrone>) -> Self {
        let hover = drone.map(|drone| Hover::of(&drone.windows)).unwrap_or_default();
        let flags = mapped.map(|mapped| flags(&mapped.quality, None)).unwrap_or_default();
        Self { flown, drone, mapped, hover, flags }
    }

    fn slot(&self) -> Option<u16> {
        self.drone.map_or_else(|| self.mapped?.slot, |drone| drone.slot)
    }

    fn airframe(&self) -> Option<&str> {
        self.flown.origin.airframes.get(&self.slot()?).map(String::as_str)
    }

    fn quadratic(&self) -> Option<&Fit> {
        self.drone?.laws.as_ref()?.signed_quadratic.as_ref()
    }

    fn linear(&self) -> Option<&Fit> {
        self.drone?.laws.as_ref()?.linear.as_ref()
    }

    fn line(&self) -> Option<&Line> {
        self.drone?.line.as_ref()
    }

    /// The fit of the law that the fleet's windows prefer, else of the signed quadratic.
    fn preferred(&self) -> Option<&Fit> {
        let headline = self.flown.flight.headline.as_ref();
        let is_linear = headline.is_some_and(|headline| headline.law == "linear");
        if is_linear { self.linear() } else { self.quadratic() }
    }

    fn rejected(&self, reason: Option<&str>) -> Option<i64> {
        let windows = self.drone?.windows.iter();
        let is_of = |window: &&Window| match reason {
            Some(reason) => window.rejected.iter().any(|of| of == reason),
            None => !window.rejected.is_empty(),
        };
        Some(windows.filter(is_of).count() as i64)
    }

    fn place(&self) -> Option<Geodetic> {
        let [x_m, y_m] = self.mapped?.position_m?;
        self.flown.origin.place(x_m?, y_m?)
    }
}

/// Columns of the table.
pub fn columns<'a>() -> Vec<Column<DroneRow<'a>>> {
    let mut columns = vec![
        text("flight", |row: &DroneRow<'_>| Some(row.flown.flight.name.as_str())),
        text("purpose", |row| Some(purpose(row.flown.flight.purpose))),
        truth("simulated", |row| row.flown.origin.simulated),
        time("start_utc", |row| row.flown.origin.utc_ms(0.0)),
        text("site", |row| row.flown.site.as_deref()),
        text("vehicle", |row| row.flown.origin.vehicle.as_deref()),
        whole("slot", |row| row.slot().map(i64::from)),
        text("drone", |row| {
            row.drone.map(|drone| drone.name.as_str()).or(row.mapped.map(|of| of.name.as_str()))
        }),
        text("airframe", DroneRow::airframe),
        text("source", |row| Some(&row.drone?.source)),
        text("effort_unit", |row| Some(row.flown.flight.indicator.unit())),
        text("law", |row| Some(row.flown.flight.headline.as_ref()?.law.as_str())),
    ];
    columns.extend(law_columns());
    columns.extend(hover_columns());
    columns.extend(map_columns());
    columns
}

fn law_columns<'a>() -> [Column<DroneRow<'a>>; 25] {
    fn of(fit: Option<&Fit>, symbol: &str) -> Known {
        fit.map(|fit| fit.of(symbol)).unwrap_or_default()
    }
    [
        real("a_us_per_mps2", |row: &DroneRow<'_>| of(row.quadratic(), "A").value),
        real("a_se_us_per_mps2", |row| of(row.quadratic(), "A").error()),
        real("u0_us", |row| of(row.quadratic(), "u0").value),
        real("u0_se_us", |row| of(row.quadratic(), "u0").error()),
        real("w_law_mps", |row| of(row.quadratic(), "W").value),
        real("w_law_se_mps", |row| of(row.quadratic(), "W").error()),
        real("linear_slope_us_per_mps", |row| of(row.linear(), "A'").value),
        real("linear_slope_se_us_per_mps", |row| of(row.linear(), "A'").error()),
        real("linear_u0_us", |row| of(row.linear(), "u0").value),
        real("linear_u0_se_us", |row| of(row.linear(), "u0").error()),
        real("line_u0_us", |row| row.line()?.u0.value),
        real("line_u0_se_us", |row| row.line()?.u0.error()),
        real("line_slope_us_per_mps", |row| row.line()?.slope.value),
        real("line_slope_se_us_per_mps", |row| row.line()?.slope.error()),
        real("line_bend_us_per_mps2", |row| row.line()?.bend.value),
        real("line_bend_se_us_per_mps2", |row| row.line()?.bend.error()),
        real("line_drag_us_per_mps2", |row| row.line()?.drag.value),
        real("line_drag_se_us_per_mps2", |row| row.line()?.drag.error()),
        whole("fit_points", |row| Some(row.preferred()?.points as i64)),
        real("fit_rms_us", |row| row.preferred()?.rms_us),
        real("fit_chi2_reduced", |row| row.preferred()?.chi2_reduced),
        real("fit_p_value", |row| row.preferred()?.p_value),
        truth("partial_ladder", |row| Some(row.drone?.partial_ladder.is_some())),
        whole("warnings", |row| Some(row.drone?.warnings.len() as i64)),
        text("clock", |row| Some(&row.drone?.clock.method)),
    ]
}

fn hover_columns<'a>() -> [Column<DroneRow<'a>>; 9] {
    [
        whole("hover_windows", |row: &DroneRow<'_>| row.drone.map(|_| row.hover.windows)),
        real("hover_pulse_us", |row| row.hover.pulse_us),
        real("hover_pulse_se_us", |row| row.hover.pulse_se_us),
        real("hover_resting_v", |row| row.hover.resting_v),
        real("hover_power_w", |row| row.hover.power_w),
        real("hover_tilt_deg", |row| row.hover.tilt_deg),
        whole("windows", |row| Some(row.drone?.windows.len() as i64)),
        whole("windows_rejected", |row| row.rejected(None)),
        whole("windows_saturated", |row| row.rejected(Some("saturated"))),
    ]
}

fn map_columns<'a>() -> [Column<DroneRow<'a>>; 19] {
    fn interval(row: &DroneRow<'_>, end: usize) -> Option<f64> {
        row.mapped?.mean_interval_mps?.get(end).copied().flatten()
    }
    [
        real("x_m", |row: &DroneRow<'_>| row.mapped?.position_m?[0]),
        real("y_m", |row| row.mapped?.position_m?[1]),
        real("z_m", |row| row.mapped?.height_m),
        real("latitude_deg", |row| Some(row.place()?.lat_deg)),
        real("longitude_deg", |row| Some(row.place()?.lon_deg)),
        text("mapping", |row| Some(&row.mapped?.mapping)),
        real("w_mps", |row| row.mapped?.mean.value),
        real("w_se_mps", |row| row.mapped?.mean.error()),
        real("w_low_mps", |row| interval(row, 0)),
        real("w_high_mps", |row| interval(row, 1)),
        real("posterior_w_mps", |row| row.mapped?.posterior_mean?.value),
        real("posterior_w_se_mps", |row| row.mapped?.posterior_mean?.error()),
        real("noise_se_mps", |row| row.mapped?.errors.window_mps),
        real("law_se_mps", |row| row.mapped?.errors.law_mps),
        real("zero_se_mps", |row| row.mapped?.errors.zero_mps),
        real("battery_se_mps", |row| row.mapped?.errors.battery_mps),
        real("wind_se_mps", |row| row.mapped?.errors.wind_mps),
        text("flags", |row| row.mapped.map(|_| row.flags.as_str())),
        real("true_updraft_mps", |row| row.flown.flight.true_updraft_mps),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_mean_is_that_of_its_values() {
        assert_eq!(mean([].into_iter()), None);
        assert_eq!(mean([1.0, 3.0].into_iter()), Some(2.0));
        // Standard deviation 1, four values.
        let error = mean_error(&[1.0, 3.0, 1.0, 3.0]).unwrap();
        assert!((error - (4.0 / 3.0_f64).sqrt() / 2.0).abs() < 1e-12, "{error}");
    }
}
