//! Turbulence of a fleet from the records of its drones.

use rayon::prelude::*;
use turbulence_statistics::Record;
use turbulence_statistics::dissipation::{
    Component as Direction, Wind, from_spectrum, from_structure,
};
use turbulence_statistics::moments::{
    Moment, covariance, expected, length_for_variance_s, mean_variance, skewness, variance,
};
use turbulence_statistics::noise::{self, Fastest};
use turbulence_statistics::spectrum::{
    CrossBand, Instrument, cross, mean as mean_spectrum, spectrum,
};
use turbulence_statistics::transfer::Transfer;

use super::super::statistics::result::TiltWind;
use super::pairs;
use super::records::Records;
use super::result::{
    CarriedBy, CarriedByWhat, Component, Convective, DroneTurbulence, Interval, PatternSpeed,
    Scales, Turbulence, TurbulenceRecord,
};
use super::scales::integral_time;
use crate::base::estimate::Estimate;
use crate::numeric::{mean, median};

/// Shorter records are not looked at, s: a minute has a handful of eddies.
const SHORTEST_S: f64 = 60.0;
/// Integral times that a record has at least, if its variance and scales are told: with fewer, what its own mean takes away
/// is more than a fifth, and is known from the same few eddies.
const FEWEST_TIMES: f64 = 10.0;
/// Spectra of w are told up to this share of the sampling frequency: what is left of the pulse's answer is known to a few
/// per cent up to there (docs/products.md).
const VERTICAL_SHARE: f64 = 0.25;
/// Spectra of u and v are told up to here, Hz: the lean follows gusts only so fast (docs/products.md).
const HORIZONTAL_HZ: f64 = 0.2;
/// Relative standard error of the law's slope around hover from its shape: a line that may bend, fitted to a ladder of 3.5 m/s
/// to each side, is 3 % off there for the vehicles of the simulator (docs/products.md).
pub(crate) const SHAPE_SE: f64 = 0.03;
/// Power that the pulse answers vertical gusts with, by frequency, Hz, over that of slow ones: in the middle of what it is in
/// still air and in wind, in the simulator and in foreign worlds up to 0.4 Hz (docs/products.md). Thrust that accelerates
/// the drone is not quite what its steady law says, and gusts of the wind that are too fast for the lean move the pulse.
const PULSE_POWER: [(f64, f64); 9] = [
    (0.03, 1.0),
    (0.1, 1.03),
    (0.2, 1.07),
    (0.28, 1.1),
    (0.37, 1.13),
    (0.5, 1.13),
    (0.65, 1.08),
    (0.87, 1.05),
    (1.0, 1.05),
];
/// Relative standard error of the power that pulse and lean answer with, in each band: what is left of it against the air of
/// the simulator (docs/products.md).
const RESPONSE_SE: f64 = 0.08;
/// A scale that is known worse than this is told of. Chosen.
const ROUGH: f64 = 0.15;
/// Weaker winds have no direction, and carry nothing past, m/s.
const CALM_MPS: f64 = 0.5;
/// Half the width of a normal 95 % interval, standard errors.
const NORMAL: f64 = 1.96;

/// Facts of a flight beside its records.
#[derive(Clone, Copy, Debug)]
pub(in crate::analysis) struct Asked<'a> {
    /// Direction of the show frame's x axis, degrees clockwise from north.
    pub(in crate::analysis) orientation_deg: Option<f64>,
    /// Wind by the lean.
    pub(in crate::analysis) wind: Option<&'a TiltWind>,
    /// Relative standard error of speeds by the lean.
    pub(in crate::analysis) drag_share: Option<f64>,
    /// Mean height of the drones above the ground, m.
    pub(in crate::analysis) height_m: Option<f64>,
    /// Depth of the mixed layer, m, if somebody knows it.
    pub(in crate::analysis) mixed_layer_depth_m: Option<f64>,
}

/// A drone with its records.
#[derive(Clone, Copy, Debug)]
pub(in crate::analysis) struct Drone<'a> {
    pub(in crate::analysis) slot: Option<u16>,
    pub(in crate::analysis) name: &'a str,
    /// Place in the show frame, m.
    pub(in crate::analysis) place_m: Option<[f64; 2]>,
    pub(in crate::analysis) records: &'a Records,
}

/// A drone's records on the fleet's common steps.
pub(super) struct Aligned {
    pub(super) w: Record,
    /// Along and across the wind.
    horizontal: Option<[Record; 2]>,
}

/// What all components share.
struct Common {
    step_s: f64,
    length_s: f64,
    wind: Option<Estimate>,
}

/// The convective velocity scale, where somebody knows the depth of the mixed layer and the record tells the variance of w.
fn convective(found: &mut Turbulence, asked: Asked<'_>) -> Option<Convective> {
    let depth_m = asked.mixed_layer_depth_m?;
    let variance = found.vertical.as_ref().and_then(|of| of.variance);
    let Some((variance, height_m)) = variance.zip(asked.height_m) else {
        found.absent.push(
            "no convective velocity scale: it needs the variance of w, which is not told"
                .to_owned(),
        );
        return None;
    };
    let made = Convective::of(&variance, height_m, depth_m);
    if made.is_none() {
        found.absent.push(format!(
            "no convective velocity scale: the drones at {height_m:.0} m are not within the mixed layer of {depth_m:.0} m"
        ));
    }
    made
}

/// Turbulence of a fleet; `None` where no drone has a record.
pub(in crate::analysis) fn of_fleet(drones: &[Drone<'_>], asked: Asked<'_>) -> Option<Turbulence> {
    let step_s = drones.iter().map(|drone| drone.records.step_s).fold(0.0, f64::max);
    let start_s = |records: &Records| records.first as f64 * records.step_s;
    let first = drones
        .iter()
        .map(|drone| (start_s(drone.records) / step_s).floor())
        .fold(f64::INFINITY, f64::min);
    if !(first.is_finite() && step_s > 0.0) {
        return None;
    }
    let first = first as i64;
    let towards = mean_direction(drones);
    let aligned: Vec<Aligned> = drones
        .par_iter()
        .map(|drone| Aligned::of(drone.records, (step_s, first), towards))
        .collect();
    let count = aligned.iter().map(|one| one.w.len()).max()?;
    let lengths = aligned.iter().map(|one| one.w.count() as f64 * step_s);
    let length_s = median(lengths.collect())?;
    let record = TurbulenceRecord {
        from_s: first as f64 * step_s,
        to_s: (first + count as i64) as f64 * step_s,
        step_s,
        length_s,
        drones: drones.len(),
        compared: 0,
        vertical_limit_hz: VERTICAL_SHARE / step_s,
        horizontal_limit_hz: HORIZONTAL_HZ,
    };
    let mut found = Turbulence { record, ..Turbulence::default() };
    if length_s < SHORTEST_S {
        found.absent.push(format!(
            "no turbulence: the records of {length_s:.0} s are shorter than {SHORTEST_S:.0} s, and have too few eddies \
             for any of its statistics"
        ));
        return Some(found);
    }
    let by_lean = carried_by_lean(asked, &mut found.absent);
    found.carried_by = by_lean;
    advect(&mut found, drones, &aligned, asked);
    let common = Common { step_s, length_s, wind: found.carried_by.map(|wind| wind.speed_mps) };
    vertical(&mut found, drones, &aligned, &common);
    found.convective = convective(&mut found, asked);
    horizontal(&mut found, drones, &aligned, &common, asked);
    each(&mut found, drones, &aligned, &common, asked);
    Some(found)
}

/// Unit vector towards which the mean wind of the fleet blows, east and north; `None` where it is not known or calm.
fn mean_direction(drones: &[Drone<'_>]) -> Option<[f64; 2]> {
    let all = || drones.iter().flat_map(|drone| drone.records.east_north_mps.iter().flatten());
    let (east, north) = (mean(all().map(|wind| wind[0]))?, mean(all().map(|wind| wind[1]))?);
    let size = east.hypot(north);
    (size > CALM_MPS).then(|| [east / size, north / size])
}

impl Aligned {
    fn of(records: &Records, (step_s, first): (f64, i64), towards: Option<[f64; 2]>) -> Self {
        let each = ((step_s / records.step_s).round() as usize).max(1);
        let before = records.first - first * each as i64;
        let together = |value: &dyn Fn(usize) -> Option<f64>| {
            let blocks = (before.max(0) as usize + records.w_mps.len()).div_ceil(each);
            let block = |block: usize| {
                let own = (0..each).map(|part| {
                    let index = (block * each + part) as i64 - before;
                    usize::try_from(index).ok().and_then(value)
                });
                let known: Option<Vec<f64>> = own.collect();
                mean(known?)
            };
            Record::new(step_s, (0..blocks).map(block))
        };
        let w = together(&|index| records.w_mps.get(index).copied().flatten());
        let horizontal =
            towards.filter(|_| !records.east_north_mps.is_empty()).map(|[east, north]| {
                let wind = |index: usize| records.east_north_mps.get(index).copied().flatten();
                [
                    together(&|index| wind(index).map(|wind| wind[0] * east + wind[1] * north)),
                    together(&|index| wind(index).map(|wind| wind[1] * east - wind[0] * north)),
                ]
            });
        Self { w, horizontal }
    }

    fn component(&self, which: usize) -> Option<&Record> {
        match which {
            0 => Some(&self.w),
            along_or_across => self.horizontal.as_ref()?.get(along_or_across - 1),
        }
    }
}

/// Mean wind by the lean of the drones, if it is one.
fn carried_by_lean(asked: Asked<'_>, absent: &mut Vec<String>) -> Option<CarriedBy> {
    let speed = asked.wind.and_then(|wind| wind.speed_mps);
    let Some((wind, speed)) = asked.wind.zip(speed) else {
        absent.push("no wind by the lean: the drag of the vehicle is not known".to_owned());
        return None;
    };
    let of_drag = asked.drag_share.unwrap_or_default() * speed.value;
    let se = speed.se.hypot(of_drag).hypot(wind.trim_se_mps.unwrap_or_default());
    if speed.value < CALM_MPS {
        absent.push(format!("no wind that carries eddies past: {:.1} m/s is calm", speed.value));
        return None;
    }
    let towards_deg = wind.from_deg.map(|from| (from + 180.0).rem_euclid(360.0));
    Some(CarriedBy {
        speed_mps: Estimate::new(speed.value, se),
        towards_deg,
        by: CarriedByWhat::Lean,
    })
}

/// Covariances between the drones, and how fast the pattern passes them; where that is known better than the wind by the
/// lean, it carries the eddies.
fn advect(found: &mut Turbulence, drones: &[Drone<'_>], aligned: &[Aligned], asked: Asked<'_>) {
    let chosen = pairs::chosen(drones, aligned);
    found.record.compared = chosen.len();
    if chosen.len() < 2 {
        found
            .absent
            .push("nothing between drones: fewer than two have a place and a record".to_owned());
        return;
    }
    let scale_se = 2.0 * fleet_scale(drones);
    found.distances = pairs::by_distance(&chosen, found.record.length_s, scale_se);
    let Some(advection) = pairs::advection(&chosen, found.record.length_s) else {
        found.absent.push(
            "no speed of the pattern: too few pairs of drones are alike at other lags than 0, or they do not agree"
                .to_owned(),
        );
        return;
    };
    let speed = Estimate::new(advection.speed_mps(), advection.speed_se_mps);
    let lean = found.carried_by;
    let over_lean = lean.map(|lean| {
        let ratio = speed.value / lean.speed_mps.value;
        let share = (speed.se / speed.value).hypot(lean.speed_mps.se / lean.speed_mps.value);
        Estimate::new(ratio, ratio * share)
    });
    // The show's x is forward, y to the left of it.
    let [x, y] = advection.velocity_mps;
    let towards_deg =
        asked.orientation_deg.map(|deg| (deg - y.atan2(x).to_degrees()).rem_euclid(360.0));
    let turned_deg = towards_deg
        .zip(lean.and_then(|lean| lean.towards_deg))
        .map(|(own, lean)| (own - lean + 180.0).rem_euclid(360.0) - 180.0);
    if lean.is_none_or(|lean| speed.se / speed.value < lean.speed_mps.se / lean.speed_mps.value) {
        found.carried_by =
            Some(CarriedBy { speed_mps: speed, towards_deg, by: CarriedByWhat::Advection });
    }
    found.advection = Some(PatternSpeed {
        velocity_mps: advection.velocity_mps,
        speed_mps: speed,
        pairs: advection.pairs,
        over_lean,
        turned_deg,
    });
}

/// Relative standard error of the scale of a fleet's mean: the law's and its shape's, and the drones' own parts of it.
fn fleet_scale(drones: &[Drone<'_>]) -> f64 {
    let over = |part: usize| {
        mean(drones.iter().map(|drone| drone.records.slope_share[part])).unwrap_or_default()
    };
    over(0).hypot(SHAPE_SE).hypot(over(1) / (drones.len() as f64).sqrt())
}

/// The vertical component of the fleet, and its dissipation.
fn vertical(found: &mut Turbulence, drones: &[Drone<'_>], aligned: &[Aligned], common: &Common) {
    let records: Vec<&Record> = aligned.iter().map(|one| &one.w).collect();
    let limit_hz = found.record.vertical_limit_hz;
    let Some(component) = component(&records, VERTICAL, (fleet_scale(drones), limit_hz), common)
    else {
        return;
    };
    if component.scale_se > ROUGH {
        found.absent.push(format!(
            "the scale of w is known to {:.0} % alone, as the wind is another than the calibration's: calibrate in the wind of \
             the measurement",
            100.0 * component.scale_se
        ));
    }
    if component.scales.is_none() {
        found.absent.push(short("w", common.length_s, integral_time(&records)));
    }
    dissipation(found, &component, &records, common);
    let variance = component.variance.map(|variance| variance.value);
    for at in &mut found.distances {
        at.correlation = variance.map(|variance| at.covariance.value / variance);
    }
    found.updraft_fraction =
        component.variance.and_then(|variance| updraft_fraction(&records, &variance));
    found.vertical = Some(component);
}

/// Share of values above their drone's mean, with the error of a Gaussian process: the signs of one with an exponential
/// autocovariance have `ln 2` of its integral time, and its variance has `t/T` degrees of freedom.
fn updraft_fraction(records: &[&Record], variance: &Moment) -> Option<Interval> {
    let above = |record: &&Record| {
        let centre = record.mean()?;
        mean(record.known().map(|value| if value > centre { 1.0 } else { 0.0 }))
    };
    let value = mean(records.iter().filter_map(above))?;
    let freedom = 2.0 * (variance.value / variance.random).powi(2);
    let se = (value * (1.0 - value) * 2.0 * std::f64::consts::LN_2 / freedom).sqrt();
    let [low, high] = [-1.0, 1.0].map(|sign| (value + sign * NORMAL * se).clamp(0.0, 1.0));
    (freedom > 0.0 && se.is_finite()).then_some(Interval { value, low, high })
}

fn short(name: &str, length_s: f64, time: Option<Interval>) -> String {
    let most = length_s / FEWEST_TIMES;
    match time {
        Some(time) => format!(
            "no variance, skewness and scales of {name}: the record of {length_s:.0} s has less than ten integral times of \
             {:.0} s ({:.0} to {:.0} s); what is faster than the record is told alone",
            time.value, time.low, time.high
        ),
        None => format!(
            "no variance, skewness and scales of {name}: its integral time does not show in a record of {length_s:.0} s, and \
             may be longer than {most:.0} s; what is faster than the record is told alone"
        ),
    }
}

fn dissipation(
    found: &mut Turbulence,
    component: &Component,
    records: &[&Record],
    common: &Common,
) {
    let Some(wind) = common.wind else {
        found.absent.push(
            "no dissipation: no wind is known that carries eddies past the drones".to_owned(),
        );
        return;
    };
    let Some(scales) = component.scales else {
        found.absent.push("no dissipation: without an integral scale it is not known where an inertial range begins".to_owned());
        return;
    };
    let wind = Wind { speed_mps: wind.value, se_mps: wind.se };
    let largest_hz = 0.5 / scales.time_s.value;
    let of =
        from_spectrum(&component.spectrum, Direction::Across, wind, largest_hz, component.scale_se);
    match of {
        Ok(of) => {
            let limit_hz = 0.5 / common.step_s;
            let each = records.iter().filter_map(|record| {
                from_structure(record, component.noise, Direction::Across, wind, (&of, limit_hz))
            });
            found.dissipation_by_structure = mean(each);
            found.dissipation = Some(of);
        }
        Err(reason) => found.absent.push(format!("no dissipation: {reason}")),
    }
}

/// How the noise of a channel is told, and the power that it answers gusts with.
type Channel = (fn(&Record) -> Fastest, &'static [(f64, f64)]);
const VERTICAL: Channel = (of_blocks, &PULSE_POWER);
const HORIZONTAL: Channel = (of_lean, &[]);

/// Noise of a record of w, and what its blocks have lost.
fn of_blocks(record: &Record) -> Fastest {
    noise::of_means(record).unwrap_or_default()
}

/// Noise of a record of u or v, whose values are means over more than their steps.
fn of_lean(record: &Record) -> Fastest {
    Fastest { noise: noise::white(record).unwrap_or(0.0), lost: 0.0 }
}

/// Statistics of one component of the fleet.
fn component(
    records: &[&Record],
    channel: Channel,
    (scale_se, limit_hz): (f64, f64),
    common: &Common,
) -> Option<Component> {
    let (fastest, power) = channel;
    let fastest: Vec<Fastest> = records.iter().map(|record| fastest(record)).collect();
    let white = mean(fastest.iter().map(|of| of.noise))?;
    let own: Vec<Moment> = records
        .iter()
        .zip(&fastest)
        .filter_map(|(record, fastest)| variance(record, fastest.too_much(), 0.0))
        .collect();
    let within = mean(own.iter().map(|own| own.value - own.systematic))?;
    let time_s = integral_time(records);
    let known = time_s.filter(|time| time.value * FEWEST_TIMES <= common.length_s);
    let variance = known.and_then(|_| fleet_variance(records, &own, scale_se));
    let instrument = instrument(white, scale_se, (limit_hz, common.step_s), power);
    let skewnesses: Vec<Moment> = records
        .iter()
        .zip(&fastest)
        .filter_map(|(record, fastest)| skewness(record, fastest.noise))
        .collect();
    Some(Component {
        mean_mps: mean(records.iter().filter_map(|record| record.mean()))?,
        variance,
        within_record: within,
        noise: white,
        skewness: known.and_then(|_| fleet_skewness(&skewnesses, &own, variance.as_ref())),
        scales: known.map(|time| scales(time, common)),
        scale_se,
        // Coherence of all pairs goes with the square of their number.
        spectrum: mean_spectrum(
            &pairs::spread(records).into_iter().copied().collect::<Vec<_>>(),
            &instrument,
        ),
    })
}

fn instrument(
    noise: f64,
    scale_se: f64,
    (highest_hz, step_s): (f64, f64),
    power: &[(f64, f64)],
) -> Instrument {
    let transfer = Transfer { mean_s: step_s, gain2: power.to_vec(), ..Transfer::NONE };
    // A line at the very end would be a band of its own.
    let highest_hz = 0.999 * highest_hz;
    Instrument { transfer, noise, scale_se, response_se: RESPONSE_SE, highest_hz }
}

/// Mean variance of the drones; how far they are independent is told by coarser records.
fn fleet_variance(records: &[&Record], own: &[Moment], scale_se: f64) -> Option<Moment> {
    let coarse: Vec<Record> = records.iter().map(|record| pairs::coarse(record)).collect();
    let coarse: Vec<&Record> = pairs::spread(&coarse);
    let together = mean_variance(&coarse, &vec![0.0; coarse.len()], 0.0)?;
    let each =
        mean(coarse.iter().filter_map(|record| variance(record, 0.0, 0.0)).map(|own| own.random))?;
    let share = if each > 0.0 { (together.random / each).min(1.0) } else { 1.0 };
    let value = mean(own.iter().map(|own| own.value))?;
    let random = share * mean(own.iter().map(|own| own.random))?;
    let systematic = mean(own.iter().map(|own| own.systematic))?;
    let time_s = mean(own.iter().map(|own| own.time_s))?;
    Some(Moment::of_variance(value, random, scale_se, (systematic, time_s)))
}

/// Mean skewness of the drones: as independent as their variances are.
fn fleet_skewness(each: &[Moment], own: &[Moment], variance: Option<&Moment>) -> Option<Interval> {
    let value = mean(each.iter().map(|one| one.value))?;
    let random = mean(each.iter().map(|one| one.random))?;
    let alone = mean(own.iter().map(|own| own.random))?;
    let share = variance.map_or(1.0, |variance| variance.random / alone);
    let half = NORMAL * random * share;
    Some(Interval { value, low: value - half, high: value + half })
}

fn scales(time_s: Interval, common: &Common) -> Scales {
    let errors = expected(time_s.value, common.length_s);
    let length_m = common.wind.map(|wind| {
        let share = wind.se / wind.value;
        let end = |end_s: f64| {
            let sign = (end_s - time_s.value).signum();
            let width = (end_s / time_s.value).ln().abs().hypot(NORMAL * share);
            time_s.value * wind.value * (sign * width).exp()
        };
        Interval { value: time_s.value * wind.value, low: end(time_s.low), high: end(time_s.high) }
    });
    Scales {
        time_s,
        length_m,
        mean_error: errors.mean,
        variance_error: errors.variance,
        lost: errors.lost,
        for_a_tenth_s: length_for_variance_s(time_s.value, 0.1),
    }
}

/// The horizontal components, the kinetic energy and the fluxes.
fn horizontal(
    found: &mut Turbulence,
    drones: &[Drone<'_>],
    aligned: &[Aligned],
    common: &Common,
    asked: Asked<'_>,
) {
    let of = |which: usize| -> Vec<&Record> {
        aligned.iter().filter_map(|one| one.component(which)).collect()
    };
    let (along, across) = (of(1), of(2));
    let Some(share) = asked.drag_share.filter(|_| !along.is_empty()) else {
        found.absent.push(
            "no u and v, kinetic energy and momentum flux: the logs have no heading, the drag of the vehicle is not known, or \
             the wind is calm"
                .to_owned(),
        );
        return;
    };
    let limit_hz = found.record.horizontal_limit_hz;
    found.along = component(&along, HORIZONTAL, (share, limit_hz), common);
    found.across = component(&across, HORIZONTAL, (share, limit_hz), common);
    for (name, one, records) in [("u", &found.along, &along), ("v", &found.across, &across)] {
        if one.as_ref().is_some_and(|one| one.scales.is_none()) {
            found.absent.push(short(name, common.length_s, integral_time(records)));
        }
    }
    let variances = [&found.along, &found.across, &found.vertical];
    found.kinetic_energy = energy(variances.map(|of| of.as_ref().and_then(|of| of.variance)));
    if found.vertical.as_ref().is_none_or(|of| of.scales.is_none()) {
        return;
    }
    let scale_se = share.hypot(fleet_scale(drones));
    let speed = common.wind.map_or(f64::INFINITY, |wind| wind.value);
    let wind_mps = mean(drones.iter().map(|drone| drone.records.wind_mps)).unwrap_or_default();
    let var = |of: &Option<Component>| {
        of.as_ref().and_then(|of| of.variance).map_or(0.0, |variance| variance.value)
    };
    let random_share = found.vertical.as_ref().and_then(|of| of.variance).map_or(1.0, |fleet| {
        let alone =
            mean(aligned.iter().filter_map(|one| variance(&one.w, 0.0, 0.0)).map(|own| own.random));
        alone.map_or(1.0, |alone| (fleet.random / alone).min(1.0))
    });
    // What wind does to the pulse goes with its square: gusts along it are in w to twice the share of the doubt.
    let leaks = 2.0 * wind_mps / speed * var(&found.along);
    let flux = |a: usize, b: usize, leaks: f64| {
        let each: Vec<Moment> = aligned
            .par_iter()
            .filter_map(|one| covariance(one.component(a)?, one.component(b)?, 0.0))
            .collect();
        let value = mean(each.iter().map(|one| one.value))?;
        let random = random_share * mean(each.iter().map(|one| one.random))?;
        let half = NORMAL * random.hypot(value * scale_se).hypot(leaks);
        Some(Interval { value, low: value - half, high: value + half })
    };
    found.flux_along = flux(1, 0, leaks);
    found.flux_across = flux(2, 0, 0.0);
    found.along_across = flux(1, 2, 0.0);
    found.flux_cospectrum = cospectrum(aligned, limit_hz, scale_se, random_share, common);
}

/// Mean cospectrum of u and w over the drones.
fn cospectrum(
    aligned: &[Aligned],
    limit_hz: f64,
    scale_se: f64,
    random_share: f64,
    common: &Common,
) -> Vec<CrossBand> {
    let instrument = instrument(0.0, 0.0, (limit_hz, common.step_s), &[]);
    let each: Vec<_> = aligned
        .par_iter()
        .filter_map(|one| Some(cross(one.component(1)?, &one.w, &instrument)))
        .filter(|bands| !bands.is_empty())
        .collect();
    let bands = each.iter().map(Vec::len).min().unwrap_or(0);
    let longest = each.iter().find(|one| one.len() == bands);
    let band = |index: usize| {
        let over = |of: &dyn Fn(&CrossBand) -> f64| {
            mean(each.iter().filter_map(|one| one.get(index)).map(of)).unwrap_or_default()
        };
        let co = over(&|band| band.co);
        Some(CrossBand {
            frequency_hz: longest?.get(index)?.frequency_hz,
            co,
            co_se: (random_share * over(&|band| band.co_se)).hypot(co * scale_se),
            quad: over(&|band| band.quad),
            coherence: over(&|band| band.coherence),
            coherence_threshold: over(&|band| band.coherence_threshold),
            freedom: over(&|band| band.freedom),
        })
    };
    (0..bands).filter_map(band).collect()
}

/// Half the sum of variances; their errors are independent.
fn energy(variances: [Option<Moment>; 3]) -> Option<Interval> {
    let known: Option<Vec<Moment>> = variances.into_iter().collect();
    let known = known?;
    let value = known.iter().map(|one| 0.5 * one.value).sum::<f64>();
    let width = |end: &dyn Fn(&Moment) -> f64| {
        known.iter().map(|one| (0.5 * (end(one) - one.value)).powi(2)).sum::<f64>().sqrt()
    };
    let (below, above) = (width(&|one| one.low), width(&|one| one.high));
    Some(Interval { value, low: (value - below).max(0.0), high: value + above })
}

/// The drones one by one.
fn each(
    found: &mut Turbulence,
    drones: &[Drone<'_>],
    aligned: &[Aligned],
    common: &Common,
    asked: Asked<'_>,
) {
    let known = |of: &Option<Component>| of.as_ref().is_some_and(|of| of.scales.is_some());
    let (up, along, across) = (known(&found.vertical), known(&found.along), known(&found.across));
    let share = asked.drag_share.unwrap_or_default();
    let largest_hz =
        found.vertical.as_ref().and_then(|of| of.scales).map(|scales| 0.5 / scales.time_s.value);
    let limit_hz = found.record.vertical_limit_hz;
    let one = |(drone, one): (&Drone<'_>, &Aligned)| {
        let own_se =
            drone.records.slope_share[0].hypot(SHAPE_SE).hypot(drone.records.slope_share[1]);
        let white = of_blocks(&one.w).noise;
        let of = |which: usize, is_known: bool, scale_se: f64| {
            let record = one.component(which).filter(|_| is_known)?;
            let fastest = if which == 0 { of_blocks } else { of_lean };
            variance(record, fastest(record).too_much(), scale_se)
        };
        let (vertical, along, across) =
            (of(0, up, own_se), of(1, along, share), of(2, across, share));
        let instrument = instrument(white, own_se, (limit_hz, common.step_s), &PULSE_POWER);
        let spectrum = spectrum(&one.w, &instrument);
        let dissipation = common.wind.zip(largest_hz).and_then(|(wind, largest_hz)| {
            let wind = Wind { speed_mps: wind.value, se_mps: wind.se };
            from_spectrum(&spectrum, Direction::Across, wind, largest_hz, own_se).ok()
        });
        let interval = |one: Moment| Interval { value: one.value, low: one.low, high: one.high };
        let flux = || {
            let scale_se = share.hypot(own_se);
            covariance(one.component(1).filter(|_| up)?, &one.w, scale_se).map(interval)
        };
        DroneTurbulence {
            slot: drone.slot,
            name: drone.name.to_owned(),
            length_s: one.w.count() as f64 * common.step_s,
            vertical,
            skewness: up.then(|| skewness(&one.w, white)).flatten().map(interval),
            along,
            across,
            kinetic_energy: energy([along, across, vertical]),
            flux_along: flux(),
            dissipation: dissipation.map(|of| Interval {
                value: of.value,
                low: of.low,
                high: of.high,
            }),
            spectrum,
        }
    };
    found.drones = drones.par_iter().zip(aligned).map(one).collect();
}
