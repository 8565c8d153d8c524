//! The record of a mast: vertical air speed and wind at times in UTC.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use super::heads::{self, Heads};
use super::mapping::{MastMapping, Stamp};
use super::raw::Raw;
use super::{MastError, doubts};
use crate::base::file::{FileError, open_named};
use crate::flight::Series;
use crate::flight::table::read_columns;
use crate::numeric::{median, rms};

/// Values that are further apart than this, or means over more, s, are compared mean by mean: drones are averaged over
/// ten seconds.
const SLOWEST_S: f64 = 5.0;
/// Longer means are none of the air at a place, s.
const LONGEST_S: f64 = 3600.0;
/// Faster air is a value that stands for none, m/s.
const FASTEST_MPS: f64 = 200.0;
/// Vertical air speeds are not as strong as this in the root of their mean square, m/s.
const STRONG_MPS: f64 = 10.0;
/// Share of the values that a mean must have.
const COVERED: f64 = 0.8;
/// First bytes of NetCDF files, classic and NetCDF-4.
const MAGIC: [&[u8]; 2] = [b"CDF", b"\x89HDF"];

/// Record of a mast.
#[derive(Clone, Debug, PartialEq)]
pub struct MastRecord {
    /// Table or NetCDF file that it was read from.
    pub file: PathBuf,
    /// Name of the mast.
    pub name: String,
    /// Latitude and longitude, degrees, if known.
    pub place_deg: Option<[f64; 2]>,
    /// Height of the instrument above the ground, m, if known.
    pub height_m: Option<f64>,
    /// UTC of time 0 of the series, ms since 1970.
    pub zero_ms: i64,
    /// Distance between values, s.
    pub step_s: f64,
    /// Duration of the means that its values are, s, where it is slow: compared mean by mean. Times are then those of
    /// the means' middles.
    pub slow_s: Option<f64>,
    /// Vertical air speed, m/s, up positive.
    pub w: Series,
    /// Variance of w within each mean, (m/s)², if measured.
    pub w_variance: Option<Series>,
    /// Wind towards east and north, m/s, if measured.
    pub wind: Option<[Series; 2]>,
    /// Doubts about how it was read, a sentence each.
    pub notes: Vec<String>,
}

impl MastRecord {
    /// Reads a table (`.csv`), a NetCDF file, or the description of one of both (`.toml`). `near_m`: height of the drones
    /// above the ground, m, if known: of a mast with several heights the nearest is taken.
    ///
    /// # Errors
    /// [`MastError`]: what is missing or wrong, and where.
    pub fn read(path: &Path, near_m: Option<f64>) -> Result<Self, MastError> {
        let is = |end: &str| path.extension().is_some_and(|own| own.eq_ignore_ascii_case(end));
        let mapping = if is("toml") { Some(MastMapping::load(path)?) } else { None };
        let file = mapping.as_ref().map_or(path, |mapping| &mapping.file);
        if is_netcdf(file)? {
            let raw = netcdf(file, mapping.as_ref(), near_m)?;
            return Self::of(raw, file, mapping.as_ref());
        }
        let lines = heads::lines(file)?;
        let (mapping, heads) = if let Some(mapping) = mapping {
            let heads = Heads::described(&lines, mapping.delimiter, mapping.time()?);
            (mapping, heads)
        } else {
            let heads = Heads::usual(&lines);
            (MastMapping::of_heads(path, &heads)?, heads)
        };
        Self::of(table(&mapping, &heads)?, &mapping.file, Some(&mapping))
    }

    fn of(raw: Raw, file: &Path, mapping: Option<&MastMapping>) -> Result<Self, MastError> {
        let broken = |reason: String| MastError::Record { path: file.to_owned(), reason };
        let Raw { zero_ms, mut w, mut w_variance, mut wind, mut notes, .. } = raw;
        let mut left_out = take_out(&mut w, FASTEST_MPS);
        for series in wind.iter_mut().flatten() {
            left_out += take_out(series, FASTEST_MPS);
        }
        if let Some(variance) = &mut w_variance {
            left_out += take_out(variance, FASTEST_MPS.powi(2));
            notes.extend(doubts::negative(variance));
        }
        if left_out > 0 {
            notes.push(format!(
                "{left_out} values of the mast are faster than {FASTEST_MPS:.0} m/s, which stands for none, and are left out"
            ));
        }
        if w.value.is_empty() {
            return Err(broken("no value of w is a vertical air speed in m/s".to_owned()));
        }
        let strong_mps = rms(&w.value).unwrap_or_default();
        if strong_mps > STRONG_MPS {
            notes.push(format!(
                "w of the mast has a root mean square of {strong_mps:.1} m/s: is it in m/s? A mapping has scale = 0.01 for cm/s"
            ));
        }
        let steps = w.time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let step_s = median(steps).unwrap_or(f64::INFINITY);
        let mean_s = raw.mean_s.unwrap_or(step_s);
        if !mean_s.is_finite() {
            return Err(broken(
                "it has one value of w alone, of which nobody knows over how long it is a mean: give more, or a NetCDF file \
                 with bounds of its times"
                    .to_owned(),
            ));
        }
        notes.extend(doubts::of_times(&w, step_s, mean_s));
        let slow_s = (mean_s.max(step_s) > SLOWEST_S).then_some(mean_s);
        if let Some(mean_s) = slow_s {
            if mean_s > LONGEST_S {
                return Err(broken(format!(
                    "its values are {mean_s:.0} s apart: give one with means over {LONGEST_S:.0} s or less"
                )));
            }
            if raw.is_point {
                return Err(broken(format!(
                    "its values are single samples {step_s:.0} s apart (cell_methods \"time: point\"), which tell no mean: give \
                     means, or a record with a value at least every {SLOWEST_S:.0} s"
                )));
            }
        }
        let said = mapping.and_then(|mapping| mapping.stamp);
        let later_s = match (said.or(raw.stamp), slow_s) {
            (Some(Stamp::Start), _) => 0.5 * mean_s,
            (Some(Stamp::Middle), _) | (None, None) => 0.0,
            (Some(Stamp::End), _) => -0.5 * mean_s,
            (None, Some(mean_s)) => {
                notes.push(format!(
                    "values of the mast are {mean_s:.0} s apart: they are taken as means over the {mean_s:.0} s that end at \
                     their times, as loggers write them; stamp = \"start\" or \"middle\" in a mapping says otherwise"
                ));
                -0.5 * mean_s
            }
        };
        if later_s != 0.0 {
            let all =
                std::iter::once(&mut w).chain(&mut w_variance).chain(wind.iter_mut().flatten());
            for series in all {
                series.time_s.iter_mut().for_each(|time| *time += later_s);
            }
        }
        if let Some(mean_s) = slow_s {
            notes.push(format!(
                "the mast tells means over {mean_s:.0} s: spectra, coherence and gusts are not compared{}",
                if w_variance.is_some() {
                    ""
                } else {
                    ", nor variances, for which it would need a column w_variance or w_sd"
                }
            ));
        }
        let place_deg = mapping
            .and_then(|mapping| mapping.latitude_deg.zip(mapping.longitude_deg))
            .map(<[f64; 2]>::from)
            .or(raw.place_deg);
        if place_deg.is_none() {
            notes.push(
                "the mast's place is not known: distances are not told, and the drone that is called the nearest is the first"
                    .to_owned(),
            );
        }
        let stem = file.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Self {
            name: mapping.map_or_else(|| stem.into_owned(), |mapping| mapping.name.clone()),
            file: file.to_owned(),
            place_deg,
            height_m: raw.height_m.or(mapping.and_then(|mapping| mapping.height_m)),
            zero_ms,
            step_s,
            slow_s,
            w,
            w_variance,
            wind,
            notes,
        })
    }

    /// First and last time, UTC, ms since 1970.
    pub fn span_ms(&self) -> [i64; 2] {
        let (from_s, to_s) = self.w.span().unwrap_or_default();
        [from_s, to_s].map(|time_s| self.zero_ms + (time_s * 1000.0) as i64)
    }

    /// Mean of a series over `length_s` around a time (UTC, ms since 1970); `None` where too much of it is missing.
    pub fn mean(&self, series: &Series, at_ms: i64, length_s: f64) -> Option<f64> {
        let middle_s = (at_ms - self.zero_ms) as f64 / 1000.0;
        let values = series.between(middle_s - 0.5 * length_s, middle_s + 0.5 * length_s);
        let enough = (COVERED * length_s / self.step_s).max(1.0);
        (values.len() as f64 >= enough).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Takes out what is no air; the number of values.
fn take_out(series: &mut Series, most: f64) -> usize {
    let is_air = |value: f64| value.abs() <= most;
    let kept: Vec<usize> =
        (0..series.value.len()).filter(|index| is_air(series.value[*index])).collect();
    let finite = series.value.iter().filter(|value| !value.is_nan()).count();
    let taken = finite - kept.len();
    if kept.len() < series.value.len() {
        series.time_s = kept.iter().map(|index| series.time_s[*index]).collect();
        series.value = kept.iter().map(|index| series.value[*index]).collect();
    }
    taken
}

/// Whether a file is NetCDF, by its first bytes; the name counts where it has none.
fn is_netcdf(path: &Path) -> Result<bool, MastError> {
    let failed = |error| FileError::new("read", path, error);
    let mut head = Vec::new();
    open_named(path).map_err(failed)?.take(4).read_to_end(&mut head).map_err(failed)?;
    let named = path.extension().is_some_and(|own| {
        ["nc", "nc4", "cdf", "netcdf"].iter().any(|end| own.eq_ignore_ascii_case(end))
    });
    Ok(named || MAGIC.iter().any(|magic| head.starts_with(magic)))
}

#[cfg(feature = "netcdf-input")]
use super::netcdf::read as netcdf;

#[cfg(not(feature = "netcdf-input"))]
fn netcdf(
    path: &Path,
    _mapping: Option<&MastMapping>,
    _near_m: Option<f64>,
) -> Result<Raw, MastError> {
    Err(MastError::Record {
        path: path.to_owned(),
        reason: "this program was built without a reader of NetCDF: build it with the feature \"netcdf-input\", which is \
                 on by default, or give a table (docs/mast.md)"
            .to_owned(),
    })
}

/// Reads a table.
fn table(mapping: &MastMapping, heads: &Heads) -> Result<Raw, MastError> {
    let columns = read_columns(&mapping.file, &mapping.wish(heads)?)?;
    let broken =
        |reason: &str| MastError::Record { path: mapping.file.clone(), reason: reason.to_owned() };
    let start = columns.start.ok_or_else(|| broken("its times are no dates"))?;
    let mut raw = Raw { zero_ms: start.to_unix_ms(), notes: columns.warnings, ..Raw::default() };
    raw.notes.extend(heads.note());
    let (mut u, mut v) = (None, None);
    for (name, mut series) in columns.channels {
        match name {
            "w" => raw.w = series,
            "u" => u = Some(series),
            "v" => v = Some(series),
            "w_variance" => raw.w_variance = Some(series),
            _ => {
                series.value.iter_mut().for_each(|sd| *sd = sd.powi(2));
                raw.w_variance = Some(series);
            }
        }
    }
    raw.wind = u.zip(v).map(<[Series; 2]>::from);
    Ok(raw)
}
