//! The posterior map of a flight ([`super::kriging`]) as part of its result.

use super::budget::TruthCheck;
use super::corrections::{DENSITY, WINDS};
use super::drone::Shared;
use super::kriging::{Air, Calibration, Drone, Form, Input, best, posterior};
use super::result::{
    AirScales, DroneUpdraft, FilledDrone, PosteriorGrid, PosteriorMap, PosteriorScale, UpdraftMap,
};
use super::statistics::result::{TiltWind, TrueAir};
use super::thermal::Thermal;
use super::truth;
use super::updraft::DroneSeries;
use crate::base::estimate::Estimate;
use crate::numeric::mean;

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;

/// Why still air has no scales.
const NO_MOTION: &str =
    "what the drones show varies by no more than their errors do, so no air that moves is told";

/// One drone's values at the map's times, as the model sees them.
pub(super) fn seen(
    series: &DroneSeries,
    position_m: Option<[f64; 2]>,
    track_m: &[Option<[f64; 3]>],
    times: &[i64],
) -> Option<Drone> {
    let measured = series.measured.as_ref()?;
    let values = series.spread(&measured.modelled, times);
    let place_m = if track_m.is_empty() {
        let [x, y] = position_m?;
        vec![[x, y, series.height_m]]
    } else {
        let mut last = track_m.iter().flatten().next().copied()?;
        track_m
            .iter()
            .map(|place| {
                last = place.unwrap_or(last);
                last
            })
            .collect()
    };
    Some(Drone {
        place_m,
        calibrated_m: None,
        values,
        slope_share: measured.slope_share,
        own_slope_share: measured.own_slope_share,
    })
}

/// Adds the posterior to a map whose drones have places and errors.
pub(super) fn add(
    map: &mut UpdraftMap,
    seen: Vec<Option<Drone>>,
    shared: &Shared<'_>,
    wind: Option<&TiltWind>,
) {
    let Some(aware) = shared.aware.as_ref() else { return };
    let (indices, mut drones): (Vec<usize>, Vec<Drone>) =
        seen.into_iter().enumerate().filter_map(|(index, drone)| Some((index, drone?))).unzip();
    if drones.is_empty() {
        return;
    }
    for (index, drone) in indices.iter().zip(&mut drones) {
        drone.calibrated_m = map.drones.get(*index).and_then(|drone| aware.home_m(drone.slot?));
    }
    share_law(&mut drones);
    // Where a drone that is lost would have been in a scan, others come by.
    let lost = if map.is_scan() { Vec::new() } else { lost(map, shared) };
    let height_m = crate::numeric::median(
        drones.iter().filter_map(|drone| Some(drone.place_m.first()?[2])).collect(),
    );
    let height_m = height_m.unwrap_or_default();
    let lost_m: Vec<[f64; 3]> = lost.iter().map(|(_, [x, y])| [*x, *y, height_m]).collect();
    let homes_m = aware.homes_m();
    let input = Input {
        drones: &drones,
        lost_m: &lost_m,
        seconds: map.time_s.len(),
        calibration: Calibration::new(&aware.zero.windows, &homes_m, aware.slope())
            .with_constants(&aware.constants_us()),
        wind_mps: wind.and_then(|wind| wind_mps(wind, shared)),
    };
    let is_checked = map.drones.iter().any(|drone| drone.truth_mps.is_some());
    let at_best = || known_air(shared).filter(|_| is_checked).and_then(|air| best(&input, &air));
    let (found, limit) = rayon::join(|| posterior(&input), at_best);
    let Some(found) = found else { return };
    let places = indices.clone();
    for (index, series) in indices.into_iter().zip(found.drones) {
        let Some(drone) = map.drones.get_mut(index) else { continue };
        drone.posterior_mps = series.mean_mps;
        drone.posterior_sd_mps = series.sd_mps;
        drone.posterior_mean = series.over_all.map(|(mean, se)| Estimate::new(mean, se));
    }
    let filled = lost
        .into_iter()
        .zip(found.lost)
        .map(|((slot, position_m), series)| FilledDrone {
            slot,
            position_m,
            posterior_mps: series.mean_mps,
            posterior_sd_mps: series.sd_mps,
        })
        .collect();
    let scale = |scale: super::kriging::Scale| PosteriorScale {
        value: scale.value,
        interval: scale.interval,
    };
    let first_s = map.time_s.first().copied().unwrap_or_default();
    map.thermals = found.thermals.iter().map(|one| Thermal::new(one, first_s)).collect();
    let no_scales = if !found.adequacy.is_adequate {
        Some(found.adequacy.sentence())
    } else if !found.moves {
        Some(NO_MOTION.to_owned())
    } else {
        None
    };
    map.posterior = Some(PosteriorMap {
        grid: found.grid.map(|grid| PosteriorGrid {
            time_s: grid
                .seconds
                .iter()
                .filter_map(|second| map.time_s.get(*second).copied())
                .collect(),
            x_m: grid.x_m,
            y_m: grid.y_m,
            height_m: grid.height_m,
            updraft_mps: grid.mean_mps,
            sd_mps: grid.sd_mps,
        }),
        fleet: found.fleet_mps.map(|(mean, se)| Estimate::new(mean, se)),
        filled,
        scales: no_scales.is_none().then(|| AirScales {
            form: found.air.form.words().to_owned(),
            sd_mps: found.air.sd_mps,
            length_m: scale(found.length_m),
            time_s: scale(found.time_s),
            drift_mps: found.air.drift_mps,
            gust_mps: found.air.gust_mps,
            gust_s: found.air.gust_s,
            slow_mps: found.air.slow_mps,
        }),
        no_scales,
        zero_shift_mps: found.zero_shift_mps,
        uniform_probability: found.uniform_probability,
        truth: truth::check_posterior(&map.drones).map(|check| {
            let limit_se_mps = limit.as_ref().map(|best| best.mean_se_mps);
            let at_limit =
                limit.and_then(|best| truth::at_limit(&map.drones, &places, &best.values));
            TruthCheck {
                limit_rms_mps: at_limit.map(|[limit, _]| limit),
                at_limit_rms_mps: at_limit.map(|[_, own]| own),
                limit_se_mps: at_limit.and(limit_se_mps),
                ..check
            }
        }),
    });
}

/// The parts of the air that a flight was simulated in, where the covariances of all are known and those of its calibration's air
/// are the same.
fn known_air(shared: &Shared<'_>) -> Option<Vec<Air>> {
    let TrueAir { field, gusts, beside } = shared.input.true_air?;
    if !beside.is_empty() || shared.input.calibrated_in_other_air {
        return None;
    }
    let mut parts = Vec::new();
    if let Some(field) = field {
        parts.push(Air {
            form: if field.is_gaussian { Form::Gaussian } else { Form::Exponential },
            sd_mps: field.sd_mps,
            length_m: (field.lambda_m * field.lambda_y_m).sqrt(),
            stretch: [0.5 * (field.lambda_m / field.lambda_y_m).ln(), 0.0],
            time_s: field.tau_s,
            drift_mps: match field.drift_mps {
                Some(drift_mps) => drift_mps,
                None if field.wind_mps == 0.0 => [0.0; 2],
                None => return None,
            },
            gust_mps: 0.0,
            gust_s: 1.0,
            slow_mps: 0.0,
            shared_mps: 0.0,
        });
    }
    for gust in gusts {
        parts.push(match gust.time_s {
            Some(gust_s) => Air { gust_mps: gust.sd_mps, gust_s, ..STILL },
            None => Air {
                sd_mps: gust.sd_mps,
                length_m: ACROSS * gust.length_m,
                time_s: FROZEN_S,
                drift_mps: gust.drift_mps?,
                ..STILL
            },
        });
    }
    (!parts.is_empty()).then_some(parts)
}

/// Length over which vertical gusts become different (1/e) on the level, as a share of the integral length of gusts along their
/// way: of `(1 - r / 2L) exp(-r / L)`, the correlation across in turbulence that is alike in all directions.
const ACROSS: f64 = 0.63;
/// Gusts that are carried along and do not change, s.
const FROZEN_S: f64 = 1e5;

/// Air without a field.
const STILL: Air = Air {
    form: Form::Exponential,
    sd_mps: 0.0,
    length_m: 1.0,
    stretch: [0.0; 2],
    time_s: 1.0,
    drift_mps: [0.0; 2],
    gust_mps: 0.0,
    gust_s: 1.0,
    slow_mps: 0.0,
    shared_mps: 0.0,
};

/// Gives all values the fleet's mean of what an error of its law adds to them.
///
/// What it adds to one drone's differs by that drone's own slope and mean, which are known with errors. Hundreds of smooth
/// values would take these for a pattern over the fleet, and tell an updraft that is everywhere the same from an error of
/// the zero by it, which nothing can.
fn share_law(drones: &mut [Drone]) {
    let known = || drones.iter().flat_map(|drone| drone.values.iter().flatten());
    let law =
        std::array::from_fn(|index| mean(known().map(|value| value.law[index])).unwrap_or(0.0));
    let steady = [WINDS[0], WINDS[1], DENSITY]
        .map(|doubt| (doubt, mean(known().map(|value| value.doubts_mps[doubt])).unwrap_or(0.0)));
    for value in drones.iter_mut().flat_map(|drone| drone.values.iter_mut().flatten()) {
        value.law = law;
        for (doubt, mps) in steady {
            value.doubts_mps[doubt] = mps;
        }
    }
}

/// Slots of the plan that the map has not, with their places.
fn lost(map: &UpdraftMap, shared: &Shared<'_>) -> Vec<(u16, [f64; 2])> {
    let Some(plan) = shared.input.plan else { return Vec::new() };
    let has = |slot: u16| map.drones.iter().any(|drone: &DroneUpdraft| drone.slot == Some(slot));
    plan.slots
        .iter()
        .filter(|slot| !has(slot.slot))
        .map(|slot| (slot.slot, [slot.home_m[0], slot.home_m[1]]))
        .collect()
}

/// Mean wind along show x and y, m/s; `None` where its speed or direction is not known.
fn wind_mps(wind: &TiltWind, shared: &Shared<'_>) -> Option<[f64; 2]> {
    let (speed, from_deg) = (wind.speed_mps?.value, wind.from_deg?);
    let to_deg = from_deg + 180.0 - shared.input.plan?.site.orientation_deg;
    let (sin, cos) = to_deg.to_radians().sin_cos();
    Some([speed * cos, -speed * sin])
}

/// Half width of the 95 % interval of a value, m/s.
pub(super) fn half_mps(sd_mps: f64) -> f64 {
    NORMAL * sd_mps
}
