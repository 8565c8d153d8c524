//! The part of the page that shows the air: map, film, stills, scales, errors.

use minijinja::context;
use minijinja::value::Value;

use crate::analysis::result::{Analysis, FlightAnalysis};

use super::axis::decimals_of;
use super::basemap::Basemap;
use super::colour::diverging;
use super::explorer::explorer;
use super::figures::map::Means;
use super::figures::{
    air, averaging, correlation, evolution, levelled, map as figure_map, posterior, track,
};
use super::film::film;
use super::frames::Frames;
use super::page::{Gallery, capitalised, flight_key};
use super::posterior as words;
use super::posterior_grid::GridField;
use super::text::{clean, fixed, signed, usable};
use super::{errors, scales};

/// Wind that is shown, m/s.
const LEAST_WIND_MPS: f64 = 0.05;

/// The maps of a flight, which the page shows first: they are what the fleet was flown for.
pub(super) fn air_section(
    analysis: &Analysis,
    flight: &FlightAnalysis,
    index: usize,
    basemap: Option<&Basemap>,
    figures: &mut Gallery,
) -> Option<Value> {
    let map = flight.map.as_ref()?;
    let key = flight_key(analysis, index);
    let frames = Frames::of(map);
    let field = GridField::of(map);
    let format = figures.format;
    let drawn = |means, basemap| {
        figure_map::mean_map(analysis, (flight, &key), map, means, basemap, format)
    };
    let together = map.posterior.as_ref().and_then(|_| drawn(Means::Posterior, basemap));
    // One picture is enough for a page.
    let alone = drawn(Means::Alone, basemap.filter(|_| together.is_none()));
    // What each drone tells alone stands behind what all tell together.
    let (mean, alone) = match together {
        Some(together) => (Some(together), alone),
        None => (alone, None),
    };
    let mean = mean.map(|figure| figures.show(figure));
    let shown = frames.as_ref().and_then(|frames| film(map, frames, field.as_ref())).map(|film| {
        context! {
            posterior => film.posterior,
            field => field.is_some(),
            id => format!("film-{key}"),
            json => Value::from_safe_string(film.json),
            step => fixed(film.step_s, usize::from(film.step_s.fract() > 0.05)),
            frames => film.frames,
            truth => frames.as_ref().is_some_and(|frames| frames.truth_known),
            bar => colour_bar(frames.as_ref().map_or(1.0, |frames| frames.limit_mps)),
            difference_bar =>
                colour_bar(frames.as_ref().map_or(1.0, |frames| frames.difference_limit_mps)),
        }
    });
    let film_shown = shown.is_some();
    let explored = figures.explore(explorer(flight, &key, frames.as_ref(), film_shown));
    let still = |field: Option<&GridField<'_>>| {
        let frames = frames.as_ref()?;
        evolution::figure(flight, &key, frames, wind(flight), field, format)
    };
    let (still, still_alone) = match &field {
        Some(field) => (still(Some(field)), still(None)),
        None => (still(None), None),
    };
    let between = frames.as_ref().zip(field.as_ref());
    let more: Vec<Value> = [
        still,
        between.and_then(|(frames, field)| {
            posterior::figure(
                flight,
                &key,
                frames,
                field,
                figure_map::scale_of(map, Means::Posterior),
                format,
            )
        }),
        track::figure(flight, &key, map, format),
        air::figure(flight, &key, map, format),
        levelled::figure(flight, &key, map, format),
    ]
    .into_iter()
    .flatten()
    .map(|figure| figures.show(figure))
    .collect();
    let alone: Vec<Value> =
        [alone, still_alone].into_iter().flatten().map(|figure| figures.show(figure)).collect();
    let no_map = if map.is_scan() {
        Some("The drones moved: what they measured is shown along their tracks.")
    } else if map.drones.iter().all(|drone| drone.position_m.is_none()) {
        Some("Where the drones stood is not known, so there is no map over the ground.")
    } else {
        Some("No drone gave an estimate of the vertical air speed.")
    };
    let of_posterior = words::tells_scales(map);
    let statistics = flight.statistics.as_ref().map(|found| {
        let correlations = correlation::figure(flight, &key, found, (format, of_posterior))
            .map(|f| figures.show(f));
        let averaging = found
            .averaging
            .as_ref()
            .and_then(|averaging| {
                averaging::figure(flight, &key, averaging, found.baseline.as_ref(), format)
            })
            .map(|figure| figures.show(figure));
        context! { correlations, averaging, ..scales::section(found, of_posterior) }
    });
    Some(
        context! { heading => capitalised(&clean(&flight.name)), law => map.law.name(), law_reason => map.law_reason.as_deref().map(clean), no_map, basemap => basemap.is_some() && flight.site.and_then(|site| site.origin_deg()).is_some(), mean, film => shown, explorer => explored, more, alone, posterior => words::sentences(map), has_posterior => map.posterior.is_some(), statistics, errors => errors::section(map) },
    )
}

/// Where the fleet's mean wind blows to, [forward, left] in m/s, where speed and direction are known.
pub(super) fn wind(flight: &FlightAnalysis) -> Option<[f64; 2]> {
    let wind = flight.statistics.as_ref()?.wind.as_ref()?;
    let (speed, from_deg) = (wind.speed_mps?.value, wind.from_deg?);
    // Clockwise from forward, as seen from above.
    let to_rad = (from_deg + 180.0 - flight.orientation_deg?).to_radians();
    let (sin, cos) = to_rad.sin_cos();
    // Slower than that is no wind, and has no arrow.
    (usable(speed) && speed >= LEAST_WIND_MPS && usable(to_rad))
        .then_some([speed * cos, -speed * sin])
}

/// A colour bar of the page: its gradient and the numbers below it.
pub(super) fn colour_bar(limit: f64) -> Value {
    let colours: Vec<String> = (0..=20).map(|i| diverging(f64::from(i) / 10.0 - 1.0)).collect();
    let decimals = decimals_of(limit / 2.0);
    let ticks: Vec<String> =
        [-1.0, -0.5, 0.0, 0.5, 1.0].iter().map(|part| signed(part * limit, decimals)).collect();
    context! { colours => colours.join(","), ticks }
}
