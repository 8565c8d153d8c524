//! The record of a mast from a NetCDF file: variables by their standard names, times by the CF conventions.

mod choose;
mod layout;
mod units;

use std::path::Path;

use super::MastError;
use super::mapping::{MastMapping, Stamp};
use super::raw::Raw;
use crate::base::netcdf::{NetcdfError, NetcdfFile, Selection, Variable, is_number, listed, text};
use crate::base::plain::plain;
use crate::flight::Series;
use crate::flight::table::{Channel, TimeFormat};
use crate::numeric::median;

use choose::{Quantity, find};
use layout::{Layout, layout, place_deg};
use units::{since, speed_mps, variance_m2ps2};

/// Most times that are read.
const MOST_TIMES: u64 = 20_000_000;
/// Times that are read at once.
const AT_ONCE: u64 = 1 << 18;
/// No time is further from 1970, s: what never was written is larger.
const LATEST_S: f64 = 1e11;
/// Share of the distance between times to which a number of 32 bits must know them.
const FINE: f64 = 0.25;

/// Reads a record; `near_m`: height of the drones, which chooses among several of the mast.
pub(super) fn read(
    path: &Path,
    mapping: Option<&MastMapping>,
    near_m: Option<f64>,
) -> Result<Raw, MastError> {
    let broken = |reason: String| MastError::Record { path: path.to_owned(), reason };
    let file = NetcdfFile::open(path).map_err(|error| match error {
        NetcdfError::Open(error) => MastError::File(error),
        NetcdfError::File { reason, .. } => broken(format!(
            "it is not NetCDF that can be read ({reason}): give a whole file, classic or NetCDF-4, or a table (docs/mast.md)"
        )),
    })?;
    Reader { file, mapping, near_m, notes: Vec::new(), path }.record()
}

/// Times of a variable.
struct Times {
    /// Seconds since 1970, UTC; NaN: not known.
    at_s: Vec<f64>,
    /// Duration of the mean that each stands for, by their bounds, s.
    mean_s: Option<f64>,
}

struct Reader<'a> {
    file: NetcdfFile,
    path: &'a Path,
    mapping: Option<&'a MastMapping>,
    near_m: Option<f64>,
    notes: Vec<String>,
}

impl Reader<'_> {
    fn wrong(&self, variable: &str, reason: String) -> MastError {
        MastError::Variable {
            path: self.path.to_owned(),
            variable: plain(variable).into_owned(),
            reason,
        }
    }

    fn record(mut self) -> Result<Raw, MastError> {
        let mut raw = Raw::default();
        let w = self.quantity(Quantity::Up)?;
        let Some((w, of_w, height_m, is_point)) = w else {
            let numbers = self.file.variables().iter().filter(|one| is_number(one));
            let names: Vec<String> =
                numbers.take(20).map(|one| plain(one.name()).into_owned()).collect();
            return Err(MastError::Record {
                path: self.path.to_owned(),
                reason: format!(
                    "no variable with the vertical air speed (standard name upward_air_velocity, or w): name it under [w] in \
                     a TOML file (docs/mast.md) and give that; it has {}",
                    listed(&names)
                ),
            });
        };
        let [u, v] = [self.quantity(Quantity::East)?, self.quantity(Quantity::North)?];
        let variance = match self.quantity(Quantity::Variance)? {
            Some((series, ..)) => Some(series),
            None => self.quantity(Quantity::Deviation)?.map(|(mut series, ..)| {
                series.value.iter_mut().for_each(|sd| *sd = sd.powi(2));
                series
            }),
        };
        let zero_s = w.time_s.first().copied().unwrap_or(0.0);
        let shifted = |mut series: Series| {
            series.time_s.iter_mut().for_each(|time| *time -= zero_s);
            series
        };
        raw.w = shifted(w);
        raw.wind = u.zip(v).map(|((u, ..), (v, ..))| [shifted(u), shifted(v)]);
        raw.w_variance = variance.map(shifted);
        raw.zero_ms = (zero_s * 1000.0).round() as i64;
        raw.mean_s = of_w.mean_s;
        raw.stamp = of_w.mean_s.map(|_| Stamp::Middle);
        raw.is_point = is_point;
        raw.height_m = height_m;
        raw.place_deg = place_deg(&self.file);
        raw.notes = self.notes;
        Ok(raw)
    }

    /// Values of a quantity with times since 1970, s; the times, the height, and whether they are single samples.
    #[expect(clippy::type_complexity, reason = "taken apart where it is made")]
    fn quantity(
        &mut self,
        quantity: Quantity,
    ) -> Result<Option<(Series, Times, Option<f64>, bool)>, MastError> {
        let mapped = self.mapping.and_then(|mapping| mapping.channel(quantity.key()));
        let names: Vec<String> = match mapped {
            Some(channel) => channel.columns.clone(),
            None if self.mapping.is_some_and(|of| of.w.is_some()) => return Ok(None),
            None => {
                let found = find(&self.file, quantity)
                    .map_err(|reason| MastError::Record { path: self.path.to_owned(), reason })?;
                match found {
                    Some(variable) => vec![variable.name().to_owned()],
                    None => return Ok(None),
                }
            }
        };
        let (mut sum, mut first): (Vec<f64>, Option<(Times, Option<f64>, bool)>) =
            (Vec::new(), None);
        for name in &names {
            let (values, times, height_m, is_point) = self.variable(name, quantity, mapped)?;
            match &first {
                None => {
                    sum = values;
                    first = Some((times, height_m, is_point));
                }
                Some((own, ..)) if own.at_s != times.at_s => {
                    return Err(self
                        .wrong(name, format!("its times are not those of {}", plain(&names[0]))));
                }
                Some(_) => sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += value),
            }
        }
        let Some((times, height_m, is_point)) = first else { return Ok(None) };
        let (scale, offset) = mapped.map_or((1.0, 0.0), |channel| (channel.scale, channel.offset));
        let count = names.len() as f64;
        let mut series = Series::default();
        let (mut last_s, mut backward) = (f64::NEG_INFINITY, 0_usize);
        for (at_s, value) in times.at_s.iter().zip(sum) {
            if !at_s.is_finite() {
                continue;
            }
            if *at_s <= last_s {
                backward += 1;
                continue;
            }
            last_s = *at_s;
            let value = value / count * scale + offset;
            if value.is_finite() {
                series.time_s.push(*at_s);
                series.value.push(value);
            }
        }
        if backward > 0 && quantity == Quantity::Up {
            self.notes.push(format!("{backward} of its times do not rise, and were left out"));
        }
        if series.is_empty() {
            return Err(self.wrong(&names[0], "it has no value with a time".to_owned()));
        }
        Ok(Some((series, times, height_m, is_point)))
    }

    /// Values of a variable in our units, with its times.
    fn variable(
        &mut self,
        name: &str,
        quantity: Quantity,
        mapped: Option<&Channel>,
    ) -> Result<(Vec<f64>, Times, Option<f64>, bool), MastError> {
        let wrong = |reason: String| self.wrong(name, reason);
        let variable = self.file.variable(name).ok_or_else(|| {
            let names: Vec<String> = self
                .file
                .variables()
                .iter()
                .map(|one| plain(one.name()).into_owned())
                .take(20)
                .collect();
            wrong(format!(
                "there is no such variable, which the mapping names; the file has {}",
                listed(&names)
            ))
        })?;
        if !is_number(variable) {
            return Err(wrong("it is not of numbers".to_owned()));
        }
        let named = self.mapping.and_then(|mapping| mapping.time.as_ref());
        let named = named.map(|time| time.column.as_str());
        let near_m = self.mapping.and_then(|mapping| mapping.height_m).or(self.near_m);
        let layout = layout(&self.file, variable, (named, near_m)).map_err(wrong)?;
        if layout.count > MOST_TIMES {
            return Err(wrong(format!(
                "it has {} times, and {MOST_TIMES} are the most: cut it to the flight (`ncks -d {}`)",
                layout.count,
                plain(layout.time.name())
            )));
        }
        let unit = match text(variable, "units") {
            None => Some(1.0),
            Some(units) if quantity == Quantity::Variance => variance_m2ps2(&units),
            Some(units) => speed_mps(&units),
        };
        let unit = match (unit, mapped) {
            (Some(unit), _) => unit,
            // Whoever names the variable has its scale.
            (None, Some(_)) => 1.0,
            (None, None) => {
                return Err(wrong(format!(
                    "its units \"{}\" are not known: give the scale to m/s in a TOML file (docs/mast.md)",
                    text(variable, "units").unwrap_or_default()
                )));
            }
        };
        let mut values = Vec::new();
        for start in (0..layout.count).step_by(AT_ONCE as usize) {
            let end = (start + AT_ONCE).min(layout.count);
            let part = self.file.part(name, layout.times(start, end)).map_err(wrong)?;
            values.extend(part.into_iter().map(|value| value * unit));
        }
        let times = self.times(&layout)?;
        let methods = text(variable, "cell_methods").unwrap_or_default();
        let is_point = methods.contains(": point");
        let heights = layout.heights_m.clone();
        // Of one height whoever describes the file knows it best; of several it is the one that is read.
        let said_m = self.mapping.and_then(|mapping| mapping.height_m);
        let height_m =
            if heights.is_empty() { said_m.or(layout.height_m) } else { layout.height_m };
        if let (Quantity::Up, Some(height_m), [_, _, ..]) = (quantity, height_m, &heights[..]) {
            let list: Vec<String> = heights.iter().take(20).map(|m| format!("{m}")).collect();
            self.notes.push(format!(
                "of the heights {} m of {} that of {height_m} m is taken, the nearest to {}",
                list.join(", "),
                plain(name),
                match said_m {
                    Some(m) => format!("height_m = {m} of the mapping"),
                    None => format!("the drones' {:.1} m", self.near_m.unwrap_or(f64::NAN)),
                }
            ));
        }
        Ok((values, times, height_m, is_point))
    }

    /// Times of a variable, UTC; in the middle of their bounds, where they have these.
    fn times(&self, layout: &Layout<'_>) -> Result<Times, MastError> {
        let name = layout.time.name();
        let wrong = |reason: String| self.wrong(name, reason);
        let time = self.mapping.and_then(|mapping| mapping.time.as_ref());
        let units = text(layout.time, "units").unwrap_or_default();
        let calendar = text(layout.time, "calendar");
        let since = match (since(&units, calendar.as_deref()), time) {
            (Ok(since), _) => since,
            // Plain numbers that a mapping explains.
            (Err(_), Some(time)) if !units.to_lowercase().contains("since") => {
                let unit_s = match time.format {
                    TimeFormat::S => 1.0,
                    TimeFormat::Ms => 1e-3,
                    TimeFormat::Us => 1e-6,
                    TimeFormat::Ns => 1e-9,
                    TimeFormat::Datetime => {
                        return Err(wrong(
                            "times of a NetCDF file are numbers: format is s, ms, us or ns"
                                .to_owned(),
                        ));
                    }
                };
                units::Since { unit_s, zero_s: 0.0 }
            }
            (Err(reason), _) => {
                return Err(wrong(format!(
                    "{reason}; or say under [time] in a TOML file (docs/mast.md) how it counts since 1970"
                )));
            }
        };
        if layout.count > MOST_TIMES {
            return Err(wrong(format!("{} times are too many", layout.count)));
        }
        let zone_s = time.and_then(|time| time.utc_offset_h).unwrap_or(0.0) * 3600.0;
        let clock = |value: f64| {
            let at_s = value * since.unit_s + since.zero_s - zone_s;
            if at_s.abs() < LATEST_S { at_s } else { f64::NAN }
        };
        let all = |variable: &str, last: Option<u64>| -> Result<Vec<f64>, MastError> {
            let mut values = Vec::new();
            for start in (0..layout.count).step_by(AT_ONCE as usize) {
                let end = (start + AT_ONCE).min(layout.count);
                let mut selections = vec![Selection::Slice { start, end, step: 1 }];
                selections.extend(last.map(Selection::Index));
                values.extend(self.file.part(variable, selections).map_err(wrong)?);
            }
            Ok(values)
        };
        let mut at_s = all(name, None)?;
        self.fine(layout.time, &at_s, since.unit_s)?;
        for value in &mut at_s {
            *value = clock(*value);
        }
        let bounds = text(layout.time, "bounds").and_then(|bounds| {
            let variable = self.file.variable(&bounds)?;
            (variable.shape() == [layout.count, 2] && is_number(variable)).then_some(bounds)
        });
        let Some(bounds) = bounds else { return Ok(Times { at_s, mean_s: None }) };
        let [from, to] = [all(&bounds, Some(0))?, all(&bounds, Some(1))?];
        let lengths = from.iter().zip(&to).map(|(from, to)| (to - from) * since.unit_s);
        let mean_s = median(lengths.filter(|length| length.is_finite()).collect());
        let Some(mean_s) = mean_s.filter(|length| *length > 0.0) else {
            return Ok(Times { at_s, mean_s: None });
        };
        let at_s = from.iter().zip(&to).map(|(from, to)| clock(0.5 * (from + to))).collect();
        Ok(Times { at_s, mean_s: Some(mean_s) })
    }

    /// Whether the numbers can hold the times that they stand for.
    fn fine(&self, time: &Variable, values: &[f64], unit_s: f64) -> Result<(), MastError> {
        let steps = values.windows(2).map(|pair| pair[1] - pair[0]);
        let step = median(steps.filter(|step| step.is_finite()).collect()).unwrap_or(f64::INFINITY);
        let is_short = text(time, "scale_factor").is_none()
            && matches!(time.dtype(), crate::base::netcdf::Type::Float);
        let largest = values
            .iter()
            .filter(|value| value.abs() < 1e30)
            .fold(0.0_f64, |most, value| most.max(value.abs()));
        let grain = largest * f64::from(f32::EPSILON);
        if is_short && grain > FINE * step.max(1.0 / unit_s) {
            return Err(self.wrong(
                time.name(),
                format!(
                    "its times are numbers of 32 bits, which know them to {:.0} s only: write them as doubles, or since the \
                     day of the record",
                    grain * unit_s
                ),
            ));
        }
        Ok(())
    }
}
