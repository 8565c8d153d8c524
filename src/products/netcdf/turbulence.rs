//! Turbulence of one flight's hover: quantities with their intervals, spectra, covariance and coherence between drones.

use turbulence_statistics::spectrum::Band;

use super::file::{Attribute, Dimension, File, longest, text};
use super::globals::{self, About, Extent};
use super::trajectories::time_attributes;
use super::{Format, NetcdfError};
use crate::analysis::result::{
    Analysis, AtDistance, DroneTurbulence, DroneUpdraft, FlightAnalysis, Turbulence, UpdraftMap,
};
use crate::numeric::extent;
use crate::products::turbulence::{NORMAL, Quantity, quantities};
use crate::products::{Origin, WhereWhen, clean};

/// A band of a spectrum: frequency, density, its interval, degrees of freedom.
type Row = [f64; 5];

/// A quantity of each drone.
type OfDrone<'a> = (&'a str, &'a str, Vec<[f64; 3]>);

/// File of a flight, or the reason that there is none.
pub(super) enum Made {
    File(Vec<u8>),
    /// It has turbulence, but no UTC or no place: the sentence that says so.
    Unplaced(String),
    /// It has none.
    Nothing,
}

/// Whether a flight has turbulence with UTC and places.
pub(super) fn is_placed(flight: &FlightAnalysis) -> bool {
    let here = WhereWhen::of(flight);
    of(flight).is_some_and(|(found, map)| placed(found, map, &here).is_ok())
}

fn of(flight: &FlightAnalysis) -> Option<(&Turbulence, &UpdraftMap)> {
    let found = flight.turbulence.as_ref().filter(|found| found.vertical.is_some())?;
    Some((found, flight.map.as_ref()?))
}

/// Begin and end of the record, ms of UTC, and the drones' latitudes, longitudes and heights.
struct Placed {
    utc_ms: [i64; 2],
    lat_deg: Vec<f64>,
    lon_deg: Vec<f64>,
    height_m: Vec<f64>,
}

fn placed(
    found: &Turbulence,
    map: &UpdraftMap,
    here: &WhereWhen<'_>,
) -> Result<Placed, &'static str> {
    let at = |time_s: f64| here.utc_ms(time_s).ok_or("UTC");
    let utc_ms = [at(found.record.from_s)?, at(found.record.to_s)?];
    let mut placed =
        Placed { utc_ms, lat_deg: Vec::new(), lon_deg: Vec::new(), height_m: Vec::new() };
    for drone in &found.drones {
        let own = |other: &&DroneUpdraft| {
            if drone.slot.is_some() { other.slot == drone.slot } else { other.name == drone.name }
        };
        let on_map = map.drones.iter().find(own).ok_or("place on the globe")?;
        let known = (0..map.time_s.len()).find_map(|index| here.fix(on_map, index).lat_lon_deg);
        let ([lat, lon], _) = known.ok_or("place on the globe")?;
        placed.lat_deg.push(lat);
        placed.lon_deg.push(lon);
        placed.height_m.push(on_map.height_m);
    }
    if placed.lat_deg.is_empty() { Err("drone with a record") } else { Ok(placed) }
}

/// The file of a flight.
pub(super) fn file(
    (flight, id): (&FlightAnalysis, &str),
    analysis: &Analysis,
    origin: &Origin,
    format: Format,
) -> Result<Made, NetcdfError> {
    let Some((found, map)) = of(flight) else { return Ok(Made::Nothing) };
    let placed = match placed(found, map, &WhereWhen::of(flight)) {
        Ok(placed) => placed,
        Err(lacks) => {
            return Ok(Made::Unplaced(format!(
                "{}: its turbulence has no {lacks}: there is no NetCDF file of it; the tables in fields/ have it",
                clean(id)
            )));
        }
    };
    let ends = |values: &[f64]| {
        extent(values.iter().copied()).map_or([f64::NAN; 2], |(low, high)| [low, high])
    };
    let mut file = File::new(format);
    let about = About {
        title: &format!(", turbulence ({})", clean(id)),
        summary: "Turbulence at the drones of a swarm over a hover: variances, covariances, scales and dissipation with their \
                  95 % intervals, spectra, covariance by distance and lag, coherence by distance and frequency.",
        comment: "w is up positive, u along the mean wind and v across it to the left. Names that end in _low and _high are \
                  the ends of a 95 % interval. Quantities without a drone dimension are those of the fleet. What is not known \
                  is not there, or missing.",
        feature_type: "",
        data_type: "Station",
        extent: Extent {
            lat_deg: ends(&placed.lat_deg),
            lon_deg: ends(&placed.lon_deg),
            height_m: ends(&placed.height_m),
            utc_ms: placed.utc_ms,
            step_s: 1,
        },
    };
    globals::write(&mut file, &about, (analysis, origin))?;
    let drone = when_and_where(&mut file, found, &placed)?;
    let all = quantities(found);
    for one in all.iter().filter(|one| one.drone.is_none()) {
        interval(&mut file, &one.name, one.unit, &[], &[one.of])?;
    }
    spectra(&mut file, found, drone)?;
    between(&mut file, found)?;
    Ok(Made::File(file.finish()?))
}

/// Time of the record, names and places of the drones, and the quantities of each.
fn when_and_where(
    file: &mut File,
    found: &Turbulence,
    placed: &Placed,
) -> Result<Dimension, NetcdfError> {
    let [from_s, to_s] = placed.utc_ms.map(|ms| ms as f64 / 1000.0);
    let mut time = time_attributes("");
    time.retain(|(name, _)| !["long_name", "bounds"].contains(name));
    for (name, long_name, value) in [
        ("time", "UTC (middle of the record)", 0.5 * (from_s + to_s)),
        ("time_begin", "UTC (begin of the record)", from_s),
        ("time_end", "UTC (end of the record)", to_s),
    ] {
        let mut own = time.clone();
        own.retain(|(key, _)| *key != "axis" || name == "time");
        own.push(("long_name", text(long_name)));
        file.variable(name, &[], &own, (&[value], None))?;
    }
    let drone = file.dimension("drone", found.drones.len())?;
    let names: Vec<String> = found.drones.iter().map(|one| clean(&one.name)).collect();
    let length = file.dimension("name_strlen", longest(&names))?;
    file.texts("drone_name", [drone, length], &[("long_name", text("name of the drone"))], &names)?;
    for (name, standard, units, values) in [
        ("lat", "latitude", "degrees_north", &placed.lat_deg),
        ("lon", "longitude", "degrees_east", &placed.lon_deg),
        ("height", "height", "m", &placed.height_m),
    ] {
        let mut attributes: Vec<Attribute<'_>> = vec![
            ("standard_name", text(standard)),
            ("long_name", text(if name == "height" { "height above take-off" } else { standard })),
            ("units", text(units)),
        ];
        if name == "height" {
            attributes.push(("positive", text("up")));
        }
        file.variable(name, &[drone], &attributes, (values, None))?;
    }
    for (name, unit, values) in by_drone(&quantities(found), found.drones.len()) {
        interval(file, &format!("drone_{name}"), unit, &[drone], &values)?;
    }
    Ok(drone)
}

/// Quantities that drones have, each with its value and interval at every drone.
fn by_drone(all: &[Quantity], drones: usize) -> Vec<OfDrone<'_>> {
    let mut found: Vec<OfDrone<'_>> = Vec::new();
    for one in all {
        let Some(drone) = one.drone else { continue };
        let known = found.iter().position(|(name, ..)| *name == one.name);
        let at = known.unwrap_or(found.len());
        if known.is_none() {
            found.push((&one.name, one.unit, vec![[f64::NAN; 3]; drones]));
        }
        if let Some(own) = found.get_mut(at).and_then(|(.., values)| values.get_mut(drone)) {
            *own = one.of.map(|value| value.unwrap_or(f64::NAN));
        }
    }
    found
}

/// A variable with the ends of its interval, where it has one.
fn interval(
    file: &mut File,
    name: &str,
    unit: &str,
    dimensions: &[Dimension],
    values: &[impl Copy + Into<Of>],
) -> Result<(), NetcdfError> {
    let all: Vec<[f64; 3]> = values.iter().map(|of| (*of).into().0).collect();
    let of = |which: usize| -> Vec<f64> { all.iter().map(|of| of[which]).collect() };
    let has_ends = all.iter().any(|of| of[1].is_finite() || of[2].is_finite());
    let ends = if has_ends { format!("{name}_low {name}_high") } else { String::new() };
    let words = name.replace('_', " ");
    let coordinates = if dimensions.is_empty() { "time" } else { "time lat lon height drone_name" };
    for (which, end) in [(0, ""), (1, "_low"), (2, "_high")] {
        if which > 0 && !has_ends {
            continue;
        }
        let long_name = match which {
            0 => words.clone(),
            1 => format!("lower end of the 95 % interval of {words}"),
            _ => format!("upper end of the 95 % interval of {words}"),
        };
        // A number of standard deviations has no unit.
        let unit = if unit == "standard deviations" { "1" } else { unit };
        let mut attributes = vec![
            ("long_name", text(long_name)),
            ("units", text(unit)),
            ("coordinates", text(coordinates)),
        ];
        if which == 0 && has_ends {
            attributes.push(("ancillary_variables", text(ends.clone())));
        }
        let name = format!("{name}{end}");
        file.variable(&name, dimensions, &attributes, (&of(which), Some(f64::NAN)))?;
    }
    Ok(())
}

/// A value with its interval; NaN: not known.
#[derive(Clone, Copy)]
struct Of([f64; 3]);

impl From<[f64; 3]> for Of {
    fn from(of: [f64; 3]) -> Self {
        Self(of)
    }
}

impl From<[Option<f64>; 3]> for Of {
    fn from(of: [Option<f64>; 3]) -> Self {
        Self(of.map(|value| value.unwrap_or(f64::NAN)))
    }
}

/// Spectra of the fleet over their own frequencies, and those of the drones.
fn spectra(file: &mut File, found: &Turbulence, drone: Dimension) -> Result<(), NetcdfError> {
    for (name, component) in [("w", &found.vertical), ("u", &found.along), ("v", &found.across)] {
        let bands = component.iter().flat_map(|component| &component.spectrum);
        let rows: Vec<Row> = bands
            .map(|band| [band.frequency_hz, band.density, band.low, band.high, band.freedom])
            .collect();
        spectrum(file, name, &format!("one-sided spectral density of {name}"), &rows)?;
    }
    let cross = found.flux_cospectrum.iter().map(|band| {
        let half = NORMAL * band.co_se;
        [band.frequency_hz, band.co, band.co - half, band.co + half, band.freedom]
    });
    spectrum(file, "uw", "one-sided cospectral density of u and w", &cross.collect::<Vec<_>>())?;
    let most = found.drones.iter().map(|drone| drone.spectrum.len()).max().unwrap_or(0);
    if most == 0 {
        return Ok(());
    }
    let band = file.dimension("band", most)?;
    let table = |get: fn(&Band) -> f64| -> Vec<f64> {
        let row = |one: &DroneTurbulence| {
            let own: Vec<f64> = one.spectrum.iter().map(get).collect();
            own.into_iter().chain(std::iter::repeat(f64::NAN)).take(most).collect::<Vec<_>>()
        };
        found.drones.iter().flat_map(row).collect()
    };
    for (name, long_name, units, values) in [
        (
            "drone_frequency",
            "mean frequency of the band at a drone",
            "Hz",
            table(|band| band.frequency_hz),
        ),
        (
            "drone_spectrum_w",
            "one-sided spectral density of w at a drone",
            DENSITY,
            table(|band| band.density),
        ),
        ("drone_spectrum_w_low", "lower end of its 95 % interval", DENSITY, table(|band| band.low)),
        (
            "drone_spectrum_w_high",
            "upper end of its 95 % interval",
            DENSITY,
            table(|band| band.high),
        ),
    ] {
        let attributes = [("long_name", text(long_name)), ("units", text(units))];
        file.variable(name, &[drone, band], &attributes, (&values, Some(f64::NAN)))?;
    }
    Ok(())
}

/// Unit of a spectral density: (m/s)² per Hz.
const DENSITY: &str = "m2 s-2 Hz-1";

fn spectrum(file: &mut File, name: &str, long_name: &str, rows: &[Row]) -> Result<(), NetcdfError> {
    if rows.is_empty() {
        return Ok(());
    }
    let axis = format!("frequency_{name}");
    let frequency = file.dimension(&axis, rows.len())?;
    let of = |which: usize| -> Vec<f64> { rows.iter().map(|row| row[which]).collect() };
    let coordinate = [("long_name", text("mean frequency of the band")), ("units", text("Hz"))];
    file.variable(&axis, &[frequency], &coordinate, (&of(0), None))?;
    let density = format!("spectrum_{name}");
    let ends = format!("{density}_low {density}_high spectrum_{name}_freedom");
    for (end, long_name, units, which) in [
        ("", long_name.to_owned(), DENSITY, 1),
        ("_low", format!("lower end of the 95 % interval of the {long_name}"), DENSITY, 2),
        ("_high", format!("upper end of the 95 % interval of the {long_name}"), DENSITY, 3),
        ("_freedom", format!("degrees of freedom of the {long_name}"), "1", 4),
    ] {
        let mut attributes = vec![("long_name", text(long_name)), ("units", text(units))];
        if end.is_empty() {
            attributes.push(("ancillary_variables", text(ends.clone())));
            attributes.push(("coordinates", text("time")));
        }
        let name = format!("{density}{end}");
        file.variable(&name, &[frequency], &attributes, (&of(which), Some(f64::NAN)))?;
    }
    Ok(())
}

/// Covariance by distance and lag, coherence by distance and frequency.
fn between(file: &mut File, found: &Turbulence) -> Result<(), NetcdfError> {
    let at = &found.distances;
    let lags = at.iter().map(|one| one.by_lag.len()).max().unwrap_or(0);
    if lags == 0 {
        return Ok(());
    }
    let distance = file.dimension("distance", at.len())?;
    let metres: Vec<f64> = at.iter().map(|one| one.distance_m).collect();
    let named =
        |long_name: &str, units: &str| [("long_name", text(long_name)), ("units", text(units))];
    file.variable(
        "distance",
        &[distance],
        &named("mean distance of the pairs", "m"),
        (&metres, None),
    )?;
    let pairs: Vec<i32> =
        at.iter().map(|one| i32::try_from(one.pairs).unwrap_or(i32::MAX)).collect();
    file.variable("pairs", &[distance], &named("number of pairs of drones", "1"), (&pairs, None))?;
    let of: Vec<[f64; 3]> = at
        .iter()
        .map(|one| [one.covariance.value, one.covariance.low, one.covariance.high])
        .collect();
    for (name, long_name, which) in [
        ("covariance_w", "covariance of w at pairs of drones", 0),
        ("covariance_w_low", "lower end of its 95 % interval", 1),
        ("covariance_w_high", "upper end of its 95 % interval", 2),
    ] {
        let values: Vec<f64> = of.iter().map(|of| of[which]).collect();
        file.variable(name, &[distance], &named(long_name, "m2 s-2"), (&values, Some(f64::NAN)))?;
    }
    let lag = file.dimension("lag", lags)?;
    let seconds: Vec<f64> = (0..lags).map(|lag| lag as f64).collect();
    file.variable("lag", &[lag], &named("lag of either sign", "s"), (&seconds, None))?;
    let padded = |own: &[f64], count: usize| -> Vec<f64> {
        own.iter().copied().chain(std::iter::repeat(f64::NAN)).take(count).collect()
    };
    let by_lag: Vec<f64> = at.iter().flat_map(|one| padded(&one.by_lag, lags)).collect();
    let long_name = "covariance of w at pairs of drones about the means of their records, by lag";
    file.variable(
        "covariance_w_by_lag",
        &[distance, lag],
        &named(long_name, "m2 s-2"),
        (&by_lag, Some(f64::NAN)),
    )?;
    let Some(longest) = at.iter().max_by_key(|one| one.coherence.len()).map(|one| &one.coherence)
    else {
        return Ok(());
    };
    // The frequencies are those of the records, which pairs of all distances share.
    let frequencies: Vec<f64> = longest.iter().map(|band| band.frequency_hz).collect();
    if frequencies.is_empty() {
        return Ok(());
    }
    let frequency = file.dimension("frequency_coherence", frequencies.len())?;
    let own = named("mean frequency of the band", "Hz");
    file.variable("frequency_coherence", &[frequency], &own, (&frequencies, None))?;
    let at_own = |one: &AtDistance, which: usize| -> Vec<f64> {
        let value = |hz: &f64| {
            let band =
                one.coherence.iter().find(|band| (band.frequency_hz / hz - 1.0).abs() < 1e-6);
            band.map_or(f64::NAN, |band| [band.coherence, band.one_pair_from][which])
        };
        frequencies.iter().map(value).collect()
    };
    for (name, long_name, which) in [
        (
            "squared_coherence",
            "squared coherence of w at pairs of drones, corrected for its bias",
            0,
        ),
        ("one_pair_from", "squared coherence above which one pair is told from none", 1),
    ] {
        let values: Vec<f64> = at.iter().flat_map(|one| at_own(one, which)).collect();
        file.variable(
            name,
            &[distance, frequency],
            &named(long_name, "1"),
            (&values, Some(f64::NAN)),
        )?;
    }
    Ok(())
}
