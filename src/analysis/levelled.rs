//! A hover through a vehicle's response whose level the flight itself gives.
//!
//! The level comes from a stretch of the hover, in which the mean of the air is taken to be zero, or from the
//! calibration's windows. Nothing is taken from the true air: not the level, not the share of the values that is kept,
//! and not the errors.

use super::cause::Cause;
use super::drone::Shared;
use super::hover::Hover;
use super::input::TruthSeries;
use super::law::LawOf;
use super::level::{DroneLevel, HeldOut, HeldOutErrors, LevelledMap};
use super::measured::Measured;
use super::reference::laws_for;
use super::response::Response;
use super::result::{DroneAnalysis, ErrorBudget, FlightAnalysis, WindowStats};
use super::running::RUNNING_S;
use super::statistics::integral::{Settling, settling};
use super::updraft::{self, DroneSeries};
use super::windows::Target;
use crate::flight::Flight;
use crate::numeric::{Moments, mean, median, rms};

/// Standard errors to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;
/// Distance between a drone and an instrument that it flies beside, where it is not told, m: nobody flies nearer to a
/// mast. Chosen.
const BESIDE_M: f64 = 10.0;
/// The air is not carried past slower than this, m/s. Chosen.
const SLOWEST_MPS: f64 = 0.5;
/// Wind where the response does not tell it from the leans, m/s: a usual day's. Chosen.
const UNKNOWN_WIND_MPS: f64 = 3.0;
/// Further than this factor from the slope of the calibration's legs a response is another vehicle's. The Phantom's own is
/// 1.4 times as steep in its wind.
const MOST_STEEPER: f64 = 2.5;
/// Standard error of the air's density between a calibration and another flight that is not of the same record,
/// relative: 6 K of temperature. Chosen.
const DAY_DENSITY: f64 = 0.02;
/// Half of a running mean, s.
const HALF_S: f64 = RUNNING_S / 2.0;

/// Where the level of a vehicle's response comes from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Level {
    /// Response of the vehicle; `None`: the line of the calibration.
    pub response: Option<Response>,
    /// Stretch of the hover in which the mean of the air is zero, from and to, show time, s; `None`: the calibration's
    /// windows give the level.
    pub zero_s: Option<[f64; 2]>,
    /// Distance between drone and instrument, m; `None`: not told.
    pub distance_m: Option<f64>,
}

/// What a hover gave beside its values, for the comparison with the truth.
#[derive(Clone, Debug, Default)]
pub(super) struct Levelled {
    pub(super) level: DroneLevel,
    response: String,
    zero_s: Option<[f64; 2]>,
    line_slope: f64,
    /// Second by second as the map's values.
    without_gain_mps: Vec<Option<f64>>,
    line_mps: Vec<Option<f64>>,
    distance_m: f64,
}

/// One second of the hover through the response.
#[derive(Clone, Copy)]
struct Moment {
    effort: f64,
    wind_mps: f64,
    velocity_mps: f64,
}

/// The air over a hover, second by second.
pub(super) fn measure(
    shared: &Shared<'_>,
    level: &Level,
    flight: &Flight,
    targets: &[Target],
    slot_name: (Option<u16>, &str),
) -> Result<(DroneSeries, LawOf), Cause> {
    let (slot, name) = slot_name;
    let hover = updraft::hover(targets).ok_or(Cause::NoHover)?;
    if let Some(zero_s) = level.zero_s
        && !(zero_s[0] >= hover.start_s - HALF_S && zero_s[1] <= hover.end_s + HALF_S)
    {
        return Err(Cause::ZeroOutside { zero_s, hover_s: [hover.start_s, hover.end_s] });
    }
    let laws = shared.reference.and_then(|reference| laws_for(reference, slot, name));
    let line = laws.and_then(|(laws, _, _)| {
        let slope = laws.linear.as_ref()?.parameters.first()?.estimate;
        (slope.value > 0.0).then_some((slope.value, slope.se / slope.value))
    });
    let of_line = line.map(|(slope, share)| {
        Response::line("calibration's straight line".to_owned(), slope, share)
    });
    let response = level.response.as_ref().or(of_line.as_ref()).ok_or(Cause::NoResponse)?;
    let windows = shared.reference.map(|reference| windows_of(reference, name));
    let windows: &[&WindowStats] = windows.as_deref().unwrap_or_default();
    if level.zero_s.is_none() && windows.is_empty() {
        return Err(Cause::NoLevel);
    }
    let hover_s = [hover.start_s, hover.end_s];
    let seconds = Hover::of(flight, hover, &shared.options.windows);
    let found = through(response, &seconds, windows, level.zero_s).ok_or_else(|| {
        level.zero_s.map_or(Cause::Gaps, |zero_s| Cause::ZeroOutside { zero_s, hover_s })
    })?;
    // A level from a stretch is off by the mean of the air over it.
    let steady = settled(response, flight, &seconds, found.level, level.zero_s);
    let stretch = |index: usize| {
        let time_s = (seconds.first_s + index as i64) as f64;
        level.zero_s.is_none_or(|[from, to]| time_s - HALF_S >= from && time_s + HALF_S <= to)
    };
    let in_stretch = |values: &[Option<f64>]| -> Vec<f64> {
        values
            .iter()
            .enumerate()
            .filter(|(index, _)| stretch(*index))
            .filter_map(|(_, v)| *v)
            .collect()
    };
    let of_stretch = in_stretch(&found.values_mps);
    let centre = mean(&of_stretch).ok_or(Cause::Gaps)?;
    let sd_mps =
        Moments::of(&of_stretch).and_then(|moments| moments.deviation()).unwrap_or_default();
    let slope = found.slope;
    let white_mps = seconds.noise_us(slope) / RUNNING_S.sqrt() / slope;
    let doubts: Vec<Vec<Option<f64>>> = response
        .doubts
        .iter()
        .filter_map(|other| through(other, &seconds, windows, level.zero_s))
        .map(|other| difference(&other.values_mps, &found.values_mps))
        .collect();
    let doubted = doubts
        .iter()
        .filter_map(|doubt| Moments::of(in_stretch(doubt)).and_then(|moments| moments.variance()));
    let noise_mps = (white_mps * white_mps + doubted.sum::<f64>()).sqrt();
    let gain = if sd_mps > 0.0 { (1.0 - (noise_mps / sd_mps).powi(2)).max(0.0) } else { 0.0 };
    let silent = found.values_mps.iter().enumerate();
    let silent = silent.filter(|(index, value)| stretch(*index) && value.is_none()).count();
    let zero_length_s = level.zero_s.map(|zero_s| told_s(zero_s, silent));
    let level_se_mps = match (zero_length_s, found.level_se) {
        (Some(length_s), _) => steady.map_or(sd_mps, |steady| steady.error_mps(length_s)),
        (None, Some(level_se)) => {
            let indicator = flight.effort.indicator;
            let efforts = seconds.seconds.iter().flatten().map(|second| second.pulse_us);
            let above = mean(efforts).unwrap_or_default() - indicator.without_thrust();
            level_se.hypot(DAY_DENSITY * indicator.thrust_exponent() * above) / slope
        }
        (None, None) => sd_mps,
    };
    let estimate = |value: f64| centre + gain * (value - centre);
    let updraft_mps: Vec<Option<f64>> =
        found.values_mps.iter().map(|value| value.map(estimate)).collect();
    let own_mps = gain * white_mps;
    let sd_at = |index: usize, value: f64| {
        let of_doubts = doubts.iter().filter_map(|doubt| doubt.get(index).copied().flatten());
        let doubts = of_doubts.fold(0.0, |sum: f64, doubt| sum.hypot(gain * doubt));
        // Of the noise the gain leaves this much; a known doubt in this second may be more.
        let left_mps = gain.sqrt() * noise_mps;
        left_mps.max(own_mps.hypot(doubts)).hypot(level_se_mps).hypot(response.slope_share * value)
    };
    let interval_mps: Vec<Option<[f64; 2]>> = updraft_mps
        .iter()
        .enumerate()
        .map(|(index, value)| {
            let half = NORMAL * sd_at(index, (*value)?);
            value.map(|value| [value - half, value + half])
        })
        .collect();
    let mean_mps = mean(updraft_mps.iter().flatten()).ok_or(Cause::Gaps)?;
    let of_doubts = doubts.iter().filter_map(|doubt| mean(doubt.iter().flatten()));
    let errors = ErrorBudget {
        window_mps: own_mps * (RUNNING_S / (hover.end_s - hover.start_s).max(RUNNING_S)).sqrt(),
        law_mps: response.slope_share * mean_mps.abs(),
        zero_mps: level_se_mps,
        wind_mps: of_doubts.fold(0.0, |sum: f64, doubt| sum.hypot(doubt)),
        velocity_mps: seconds.velocity_bias_mps,
        ..ErrorBudget::default()
    };
    let total_mps = [errors.law_mps, errors.zero_mps, errors.wind_mps, errors.velocity_mps]
        .into_iter()
        .fold(errors.window_mps, f64::hypot);
    let distance_m = level.distance_m.unwrap_or(BESIDE_M);
    let wind_mps = mean(found.moments.iter().flatten().map(|moment| moment.wind_mps));
    let wind_mps = wind_mps.unwrap_or_default();
    let carried_mps = if response.lean_deg.len() > 1 { wind_mps } else { UNKNOWN_WIND_MPS };
    let line_slope =
        line.map_or_else(|| response.slope(0.0, 0.0).unwrap_or(slope), |(slope, _)| slope);
    let levelled = Levelled {
        line_mps: line_mps(&found.moments, line_slope, &stretch),
        without_gain_mps: found.values_mps,
        response: response.of.clone(),
        zero_s: level.zero_s,
        line_slope,
        distance_m,
        level: DroneLevel {
            name: name.to_owned(),
            level: found.level,
            level_se_mps,
            slope,
            wind_mps,
            sd_mps,
            noise_mps,
            gain,
            integral_time_s: steady.map_or(0.0, |steady| steady.time_s.value),
            apart_mps: apart_mps(steady, distance_m, carried_mps),
            legs_slope: line.map(|(slope, _)| slope).filter(|slope| {
                let steeper = response.slope(0.0, 0.0).map_or(1.0, |own| own / slope);
                !(MOST_STEEPER.recip()..=MOST_STEEPER).contains(&steeper)
            }),
        },
    };
    let measured = Measured {
        first_s: seconds.first_s,
        sd_mps: updraft_mps.iter().map(|value| value.map(|_| own_mps)).collect(),
        interval_mps,
        modelled: vec![None; updraft_mps.len()],
        slope_share: response.slope_share,
        mean_mps,
        mean_interval_mps: [mean_mps - NORMAL * total_mps, mean_mps + NORMAL * total_mps],
        errors: ErrorBudget { total_mps, ..errors },
        quality: seconds.quality,
        is_own: true,
        updraft_mps,
        ..Measured::default()
    };
    let series = updraft::with_errors(flight, hover, measured, 2.0 * errors.wind_mps);
    Ok((DroneSeries { levelled: Some(Box::new(levelled)), ..series }, LawOf::Own))
}

/// The windows of a calibration that speak for a drone: its own, else those of all drones.
fn windows_of<'a>(reference: &'a FlightAnalysis, name: &str) -> Vec<&'a WindowStats> {
    let own: Vec<&DroneAnalysis> =
        reference.drones.iter().filter(|drone| drone.name == name).collect();
    let all = || reference.drones.iter().collect();
    let drones: Vec<&DroneAnalysis> = if own.is_empty() { all() } else { own };
    drones.iter().flat_map(|drone| &drone.windows).filter(|one| one.rejected.is_empty()).collect()
}

/// Time of a zero stretch that tells of its zero, s: seconds without a value do not.
fn told_s([from, to]: [f64; 2], silent: usize) -> f64 {
    (to - from - silent as f64).max(RUNNING_S)
}

/// A hover through one response.
struct Through {
    moments: Vec<Option<Moment>>,
    values_mps: Vec<Option<f64>>,
    level: f64,
    /// Standard error of a level from windows, in the indicator's unit.
    level_se: Option<f64>,
    slope: f64,
}

fn through(
    response: &Response,
    seconds: &Hover,
    windows: &[&WindowStats],
    zero_s: Option<[f64; 2]>,
) -> Option<Through> {
    let moments: Vec<Option<Moment>> = seconds
        .seconds
        .iter()
        .map(|second| {
            second.map(|second| Moment {
                effort: second.pulse_us,
                wind_mps: response.wind_mps(second.lean_deg),
                velocity_mps: second.velocity_mps,
            })
        })
        .collect();
    let above = |moment: &Moment| {
        Some(moment.effort - response.effort(moment.wind_mps, moment.velocity_mps)?)
    };
    let (level, level_se) = if let Some([from, to]) = zero_s {
        let inside = (moments.iter().enumerate()).filter_map(|(index, moment)| {
            let time_s = (seconds.first_s + index as i64) as f64;
            let is_inside = time_s - HALF_S >= from && time_s + HALF_S <= to;
            moment.as_ref().filter(|_| is_inside).and_then(above)
        });
        (mean(inside)?, None)
    } else {
        let of_window = |window: &&WindowStats| {
            let moment = Moment {
                effort: window.effort.mean,
                wind_mps: response.wind_mps(window.lean_deg),
                velocity_mps: window.velocity_mps.mean,
            };
            above(&moment)
        };
        let levels: Vec<f64> = windows.iter().filter_map(of_window).collect();
        let moments = Moments::of(&levels)?;
        (mean(&levels)?, moments.standard_error())
    };
    let value = |moment: &Moment| {
        let climb = response.climb_mps(moment.wind_mps, moment.effort - level)?;
        Some(moment.velocity_mps - climb)
    };
    let values_mps = moments.iter().map(|moment| moment.as_ref().and_then(value)).collect();
    let slopes = moments.iter().flatten().filter_map(|one| response.slope(one.wind_mps, 0.0));
    let slope = mean(slopes).filter(|slope| *slope > 0.0)?;
    Some(Through { moments, values_mps, level, level_se, slope })
}

fn difference(left: &[Option<f64>], right: &[Option<f64>]) -> Vec<Option<f64>> {
    left.iter().zip(right).map(|(left, right)| Some((*left)? - (*right)?)).collect()
}

/// A plain line with the zero of the stretch (of the hover, without one), without wind.
fn line_mps(
    moments: &[Option<Moment>],
    slope: f64,
    stretch: &dyn Fn(usize) -> bool,
) -> Vec<Option<f64>> {
    let above = |moment: &Moment| moment.effort - slope * moment.velocity_mps;
    let inside = moments.iter().enumerate().filter(|(index, _)| stretch(*index));
    let level = mean(inside.filter_map(|(_, moment)| moment.as_ref().map(above)));
    let value = |moment: &Moment| Some((level? - above(moment)) / slope);
    moments.iter().map(|moment| moment.as_ref().and_then(value)).collect()
}

/// How slowly the values of single seconds settle, over the stretch.
fn settled(
    response: &Response,
    flight: &Flight,
    seconds: &Hover,
    level: f64,
    zero_s: Option<[f64; 2]>,
) -> Option<Settling> {
    let value = |index: usize| {
        let second = seconds.seconds.get(index).copied().flatten()?;
        let (from, to) = (second.time_s - 0.5, second.time_s + 0.5);
        zero_s.is_none_or(|[first, last]| from >= first && to <= last).then_some(())?;
        let effort = mean(flight.effort.values.between(from, to))?;
        let velocity_mps = mean(flight.velocity_up_mps.between(from, to))?;
        let wind_mps = response.wind_mps(second.lean_deg);
        Some(velocity_mps - response.climb_mps(wind_mps, effort - level)?)
    };
    let values: Vec<Option<f64>> = (0..seconds.seconds.len()).map(value).collect();
    let first = values.iter().position(Option::is_some)?;
    let last = values.iter().rposition(Option::is_some)?;
    settling(&[values.get(first..=last)?])
}

/// Standard deviation between the air at two places, m/s: what passes one of them in the time that the wind needs for
/// the distance (Taylor's hypothesis), by the correlation that the record itself shows.
fn apart_mps(steady: Option<Settling>, distance_m: f64, wind_mps: f64) -> f64 {
    let Some(steady) = steady else { return 0.0 };
    let length_m = steady.time_s.value * wind_mps.max(SLOWEST_MPS);
    let left = 1.0 - (-distance_m / length_m.max(f64::MIN_POSITIVE)).exp();
    steady.sd_mps.value * (2.0 * left).sqrt()
}

/// The levelled part of a map, with its comparison with the truth.
pub(super) fn of_map(
    series: &[&DroneSeries],
    truths: &[Option<TruthSeries>],
) -> Option<LevelledMap> {
    let known: Vec<(&DroneSeries, &Levelled, Option<&TruthSeries>)> = series
        .iter()
        .zip(truths)
        .filter_map(|(one, truth)| Some((*one, one.levelled.as_deref()?, truth.as_ref())))
        .collect();
    let first = known.first()?.1;
    let levelled = LevelledMap {
        response: first.response.clone(),
        zero_s: first.zero_s,
        drones: known.iter().map(|(_, one, _)| one.level.clone()).collect(),
        held_out: None,
    };
    Some(LevelledMap { held_out: held_out(&known, &levelled), ..levelled })
}

/// One value outside of the zero stretch.
struct Compared {
    truth: f64,
    estimate: f64,
    without_gain: f64,
    line: f64,
    half: f64,
    half_there: f64,
    is_apart: bool,
}

fn held_out(
    drones: &[(&DroneSeries, &Levelled, Option<&TruthSeries>)],
    map: &LevelledMap,
) -> Option<HeldOut> {
    let mut all: Vec<Compared> = Vec::new();
    for (series, levelled, truth) in drones {
        let (Some(truth), Some(measured)) = (truth, series.measured.as_ref()) else { continue };
        let mut next_s = f64::NEG_INFINITY;
        for (index, estimate) in series.updraft_mps.iter().enumerate() {
            let second = series.first_s + index as i64;
            let time_s = second as f64;
            let outside = map.is_outside(time_s);
            let value = (|| {
                let [low, high] = measured.interval_mps.get(index).copied().flatten()?;
                let half = 0.5 * (high - low);
                Some(Compared {
                    truth: truth.at_second(second)?,
                    estimate: (*estimate)?,
                    without_gain: levelled.without_gain_mps.get(index).copied().flatten()?,
                    line: levelled.line_mps.get(index).copied().flatten()?,
                    half,
                    half_there: half.hypot(NORMAL * levelled.level.apart_mps),
                    is_apart: time_s >= next_s,
                })
            })();
            if let Some(value) = value.filter(|_| outside) {
                if value.is_apart {
                    next_s = time_s + RUNNING_S;
                }
                all.push(value);
            }
        }
    }
    let errors = |apart: bool| {
        let used = || all.iter().filter(move |one| !apart || one.is_apart);
        let of = |answer: fn(&Compared) -> f64| {
            rms(used().map(|one| answer(one) - one.truth)).unwrap_or_default()
        };
        HeldOutErrors {
            values: used().count(),
            rms_mps: of(|one| one.estimate),
            without_gain_rms_mps: of(|one| one.without_gain),
            zero_rms_mps: of(|_| 0.0),
            line_rms_mps: of(|one| one.line),
        }
    };
    let inside = |half: fn(&Compared) -> f64| {
        let held = all.iter().filter(|one| (one.estimate - one.truth).abs() <= half(one)).count();
        held as f64 / all.len() as f64
    };
    let middle = |half: fn(&Compared) -> f64| median(all.iter().map(half).collect());
    Some(HeldOut {
        running: errors(false),
        apart: errors(true),
        bias_mps: mean(all.iter().map(|one| one.estimate - one.truth))?,
        line_slope: drones.first()?.1.line_slope,
        half_width_mps: middle(|one| one.half)?,
        inside_share: inside(|one| one.half),
        distance_m: drones.first()?.1.distance_m,
        half_width_there_mps: middle(|one| one.half_there)?,
        inside_share_there: inside(|one| one.half_there),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stretch_with_a_hole_tells_less_of_its_zero() {
        assert_eq!(told_s([0.0, 150.0], 0), 150.0);
        assert_eq!(told_s([0.0, 150.0], 67), 83.0);
        assert_eq!(told_s([0.0, 30.0], 67), RUNNING_S);
    }
}
