//! A mast whose values are slow means, as those of towers: compared mean by mean, over the same seconds.

use super::make::{Drone, column, distance_m, fleet, mean_of, noise2, variance_of};
use super::matched::{averages, matched};
use super::record::MastRecord;
use super::result::{
    Average, MastDrone, MastFlight, MastPeriod, MastSeries, Matched, PeriodVariance,
};
use crate::flight::Series;

/// Share of a mean's seconds that the drones must have.
const COVERED: f64 = 0.8;
/// Longer averages that are told, means.
const LONGER: [usize; 5] = [2, 3, 5, 10, 30];
/// Longest average that is told, s.
const LONGEST_S: f64 = 3600.0;
/// Fewest averages of a length that are told.
const FEWEST: usize = 3;
/// Fewest means for a shift in time, and the steps in which it is tried, s.
const FEWEST_TO_SHIFT: usize = 5;
const SHIFT_STEP_S: i64 = 5;

/// Seconds of a mean of the mast.
struct Period {
    /// Time of its middle in the mast's series, s.
    at_s: f64,
    /// The same since the flight's first second, s.
    middle_s: f64,
    w: f64,
    /// Indices of its seconds.
    from: i64,
    to: i64,
}

impl Period {
    /// Values in its seconds, `later` of them later.
    fn seconds<'a>(&self, values: &'a [f64], later: i64) -> Option<&'a [f64]> {
        let count = values.len() as i64;
        let end = |at: i64| usize::try_from((at + later).clamp(0, count)).ok();
        values.get(end(self.from)?..end(self.to)?)
    }
}

/// Means of the mast over the seconds of a flight.
struct Periods {
    all: Vec<Period>,
    length_s: f64,
}

impl Periods {
    /// Means that lie within the flight, none over another.
    fn of(mast: &MastRecord, series: &Series, seconds: &[i64], length_s: f64) -> Self {
        let first_s = seconds.first().copied().unwrap_or(0);
        let zero_s = mast.zero_ms as f64 / 1000.0;
        let mut all: Vec<Period> = Vec::new();
        for (time_s, w) in series.time_s.iter().zip(&series.value) {
            let middle_s = zero_s + time_s - first_s as f64;
            let from = (middle_s - 0.5 * length_s).ceil() as i64;
            let to = (middle_s + 0.5 * length_s).ceil() as i64;
            let beside = all.last().is_none_or(|last| middle_s - last.middle_s > 0.99 * length_s);
            if to > 0 && from < seconds.len() as i64 && beside {
                all.push(Period { at_s: *time_s, middle_s, w: *w, from, to });
            }
        }
        Self { all, length_s }
    }

    /// Means of values over the same seconds, `later` of them later; NaN where too few are known.
    fn means(&self, values: &[f64], later: i64) -> Vec<f64> {
        let of = |period: &Period| {
            let seconds = period.seconds(values, later)?;
            let count = seconds.iter().filter(|value| value.is_finite()).count();
            if (count as f64) < COVERED * self.length_s { None } else { mean_of(seconds) }
        };
        self.all.iter().map(|period| of(period).unwrap_or(f64::NAN)).collect()
    }

    /// Values of the periods at their places in a row of equal steps; NaN where the mast has none.
    fn in_row(&self, values: &[f64]) -> Vec<f64> {
        let first_s = self.all.first().map_or(0.0, |period| period.middle_s);
        let mut row: Vec<f64> = Vec::new();
        for (period, value) in self.all.iter().zip(values) {
            let at = ((period.middle_s - first_s) / self.length_s).round() as usize;
            row.resize(at.max(row.len()), f64::NAN);
            row.push(*value);
        }
        row
    }
}

/// A flight beside a mast of slow means. `drones`: the nearest first; `fast`: variance of w in eddies that the map's
/// ten-second means have not, (m/s)², if known.
pub(super) fn flight(
    name: &str,
    drones: &[Drone],
    seconds: &[i64],
    (mast, length_s): (&MastRecord, f64),
    fast: Option<f64>,
) -> Result<MastFlight, String> {
    let from = seconds.first().copied().unwrap_or(0);
    let to = seconds.last().copied().unwrap_or(0);
    let mut periods = Periods::of(mast, &mast.w, seconds, length_s);
    let (of_fleet, fleet_se) = fleet(drones, seconds);
    let told = periods.means(&of_fleet, 0);
    let mut is_told = told.iter().map(|value| value.is_finite());
    periods.all.retain(|_| is_told.next().unwrap_or(false));
    if periods.all.is_empty() {
        return Err(format!(
            "no mean of the mast over {length_s:.0} s lies within the flight of {} s: fly longer, or give a faster record",
            to - from
        ));
    }
    let columns: Vec<Vec<f64>> =
        drones.iter().map(|drone| column(drone, seconds, |value| value.w)).collect();
    let of_mast: Vec<f64> = periods.all.iter().map(|period| period.w).collect();
    let stated = mean_of(&fleet_se);
    let row = |values: &[f64]| periods.in_row(values);
    let mast_row = row(&of_mast);
    let agreement = |values: &[f64], stated: Option<f64>| {
        matched(&row(&periods.means(values, 0)), &mast_row, length_s, stated)
    };
    let whole = agreement(&of_fleet, stated)
        .ok_or("the fleet's mean and the mast have no seconds in common")?;
    let nearest = columns.first().cloned().unwrap_or_default();
    let noise: Vec<f64> = drones.iter().map(noise2).collect();
    let of_drones: Vec<MastDrone> = drones
        .iter()
        .zip(&columns)
        .filter_map(|(drone, values)| {
            let stated = mean_of(&column(drone, seconds, |value| value.se));
            let [low, high] = [0, 1]
                .map(|end| periods.means(&column(drone, seconds, |value| value.interval[end]), 0));
            Some(MastDrone {
                drone: drone.label.clone(),
                slot: drone.slot,
                distance_m: mast.place_deg.zip(drone.place_deg).map(|(a, b)| distance_m(a, b)),
                above_m: drone.height_m.zip(mast.height_m).map(|(drone, mast)| drone - mast),
                matched: agreement(values, stated)?,
                inside_share: share_inside(&of_mast, &low, &high),
                variance: None,
            })
        })
        .collect();
    let own: Vec<Vec<f64>> =
        drones.iter().map(|drone| column(drone, seconds, |value| value.own)).collect();
    let of_periods = beside(&periods, mast, (&own, &noise), [&of_fleet, &nearest], fast);
    Ok(MastFlight {
        flight: name.to_owned(),
        span_ms: [from * 1000, to * 1000],
        mean_s: length_s,
        is_posterior: false,
        averages: longer(&periods, [&of_fleet, &nearest], &mast_row, stated),
        fleet: whole,
        drones: of_drones,
        period_variance: period_variance(&of_periods, fast.is_none()),
        mast_variance: None,
        mast_variance_all: None,
        drone_variance: None,
        mast_spectrum: Vec::new(),
        drone_spectrum: Vec::new(),
        coherence: Vec::new(),
        best_shift: best_shift(&periods, &of_fleet, &mast_row),
        wind: wind(drones, seconds, (mast, length_s)),
        series: MastSeries {
            time_s: seconds.iter().map(|at| (at - from) as f64).collect(),
            mast: steps(&periods, seconds.len()),
            fleet: of_fleet,
            fleet_se,
            nearest,
        },
        periods: of_periods,
    })
}

/// Means of the mast beside those of the drones, with variances within them.
fn beside(
    periods: &Periods,
    mast: &MastRecord,
    (columns, noise): (&[Vec<f64>], &[f64]),
    [of_fleet, nearest]: [&[f64]; 2],
    fast: Option<f64>,
) -> Vec<MastPeriod> {
    let means = periods.means(of_fleet, 0);
    let nearest = periods.means(nearest, 0);
    let known =
        |values: &[f64], index: usize| values.get(index).copied().filter(|value| value.is_finite());
    let row = |(index, period): (usize, &Period)| {
        let variance = mast.w_variance.as_ref().and_then(|series| series.at(period.at_s, 0.0));
        let within: Vec<f64> = columns
            .iter()
            .zip(noise)
            .filter_map(|(values, noise)| {
                let seconds = period.seconds(values, 0)?;
                let known = seconds.iter().filter(|value| value.is_finite()).count();
                let enough = known as f64 >= COVERED * periods.length_s;
                enough.then(|| (variance_of(seconds) - noise).max(0.0))
            })
            .collect();
        Some(MastPeriod {
            middle_ms: mast.zero_ms + (period.at_s * 1000.0).round() as i64,
            mast_mps: period.w,
            fleet_mps: known(&means, index)?,
            nearest_mps: known(&nearest, index),
            mast_variance: variance.filter(|value| *value >= 0.0),
            drone_variance: mean_of(&within).map(|of| of + fast.unwrap_or(0.0)),
        })
    };
    periods.all.iter().enumerate().filter_map(row).collect()
}

/// Share of the means in which the mast is within an interval.
fn share_inside(mast: &[f64], low: &[f64], high: &[f64]) -> f64 {
    let all = mast.iter().zip(low.iter().zip(high));
    let known: Vec<bool> = all
        .filter(|(_, (low, high))| low.is_finite() && high.is_finite())
        .map(|(mast, (low, high))| (low..=high).contains(&mast))
        .collect();
    known.iter().filter(|inside| **inside).count() as f64 / known.len().max(1) as f64
}

/// Variances within the means, of those that both have.
fn period_variance(periods: &[MastPeriod], is_slow_part: bool) -> Option<PeriodVariance> {
    let both: Vec<(f64, f64)> =
        periods.iter().filter_map(|one| one.mast_variance.zip(one.drone_variance)).collect();
    let of = |get: fn(&(f64, f64)) -> f64| mean_of(&both.iter().map(get).collect::<Vec<_>>());
    let (mast, drones) = (of(|pair| pair.0)?, of(|pair| pair.1)?);
    let differences: Vec<f64> = both.iter().map(|(mast, drones)| drones - mast).collect();
    let count = both.len() as f64;
    let se = (both.len() >= FEWEST).then(|| (variance_of(&differences) / (count - 1.0)).sqrt());
    Some(PeriodVariance { count: both.len(), mast, drones, difference_se: se, is_slow_part })
}

fn longer(
    periods: &Periods,
    [fleet, nearest]: [&[f64]; 2],
    mast_row: &[f64],
    stated: Option<f64>,
) -> Vec<Average> {
    let [fleet, nearest] = [fleet, nearest].map(|values| periods.in_row(&periods.means(values, 0)));
    let of = |count: &usize| {
        let length_s = *count as f64 * periods.length_s;
        let [fleet, nearest, mast] =
            [&fleet[..], &nearest, mast_row].map(|values| averages(values, *count));
        Some(Average {
            length_s,
            fleet: matched(&fleet, &mast, length_s, stated)?,
            nearest: matched(&nearest, &mast, length_s, None)?,
        })
    };
    let lengths = LONGER.iter().filter(|count| **count as f64 * periods.length_s <= LONGEST_S);
    lengths.filter_map(of).filter(|average| average.fleet.count >= FEWEST).collect()
}

/// Shift of the drones within a mean to each side at which they follow the mast best, s (positive: the drones see the
/// air later), with the correlation.
fn best_shift(periods: &Periods, fleet: &[f64], mast_row: &[f64]) -> Option<[f64; 2]> {
    let most = periods.length_s as i64 / SHIFT_STEP_S;
    let at = |step: i64| {
        let later = step * SHIFT_STEP_S;
        let row = periods.in_row(&periods.means(fleet, later));
        let found = matched(&row, mast_row, periods.length_s, None)?;
        (found.count >= FEWEST_TO_SHIFT).then_some([later as f64, found.correlation?])
    };
    (-most..=most).filter_map(at).max_by(|a, b| a[1].total_cmp(&b[1]))
}

/// Wind of the fleet against the mast's, in its means.
fn wind(
    drones: &[Drone],
    seconds: &[i64],
    (mast, length_s): (&MastRecord, f64),
) -> Option<[Matched; 2]> {
    let measured = mast.wind.as_ref()?;
    let one = |axis: usize| {
        let series = measured.get(axis)?;
        let periods = Periods::of(mast, series, seconds, length_s);
        let of_drones: Vec<f64> = seconds
            .iter()
            .map(|at| {
                let all: Vec<f64> = drones
                    .iter()
                    .filter_map(|drone| drone.values.get(at)?.wind?.get(axis).copied())
                    .collect();
                mean_of(&all).unwrap_or(f64::NAN)
            })
            .collect();
        let of_mast: Vec<f64> = periods.all.iter().map(|period| period.w).collect();
        let means = periods.in_row(&periods.means(&of_drones, 0));
        matched(&means, &periods.in_row(&of_mast), length_s, None)
    };
    Some([one(0)?, one(1)?])
}

/// The mast's means second by second, for the figure.
fn steps(periods: &Periods, count: usize) -> Vec<f64> {
    let mut values = vec![f64::NAN; count];
    for period in &periods.all {
        let end = |at: i64| usize::try_from(at.clamp(0, count as i64)).unwrap_or(0);
        if let Some(seconds) = values.get_mut(end(period.from)..end(period.to)) {
            seconds.fill(period.w);
        }
    }
    values
}
