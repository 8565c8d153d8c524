//! The comparison itself.

use std::collections::BTreeMap;
use std::f64::consts::PI;
use std::path::Path;

use turbulence_statistics::spectrum::{Band, Instrument, cross, mean, spectrum};
use turbulence_statistics::transfer::Transfer;
use turbulence_statistics::{Moment, Record, moments};

use super::matched::{averages, best_shift, matched};
use super::record::MastRecord;
use super::result::{
    Average, MAST_SCHEMA, MastComparison, MastDrone, MastFlight, MastSeries, Matched,
};
use super::{MastError, doubts, slow};
use crate::analysis::result::Analysis;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::numeric;
use crate::products::fields::{FieldRow, ids, rows};
use crate::products::iso;

/// Time over which both are averaged, s.
pub const MEAN_S: f64 = 10.0;
/// Distance of the map's values, s.
const STEP_S: f64 = 1.0;
/// Longer averages that are compared, s.
const LONGER_S: [f64; 5] = [30.0, 60.0, 120.0, 300.0, 600.0];
/// Fewest averages of a length that are told.
const FEWEST: usize = 3;
/// Shifts of the mast's record that are tried, s.
const SHIFTS_S: f64 = 60.0;
/// Spectra are told up to this, Hz: half of the variance is left of a mean over ten seconds.
const HIGHEST_HZ: f64 = 0.044;
/// Fewer common seconds are no comparison.
const FEWEST_SECONDS: usize = 30;
/// Standard deviations to each side of a normal 95 % interval.
const NORMAL: f64 = 1.96;

/// Ten-second means of one drone, second by second.
pub(super) struct Drone {
    pub(super) label: String,
    pub(super) slot: Option<u16>,
    pub(super) values: BTreeMap<i64, Value>,
    pub(super) place_deg: Option<[f64; 2]>,
    pub(super) height_m: Option<f64>,
}

/// A drone's value in one second.
#[derive(Clone, Copy)]
pub(super) struct Value {
    /// Value that is compared: of the posterior where the flight has one, else the drone's own.
    pub(super) w: f64,
    /// The drone's own value, of which variances and spectra are: the posterior is smoother than the air.
    pub(super) own: f64,
    pub(super) se: f64,
    pub(super) noise: f64,
    pub(super) interval: [f64; 2],
    pub(super) wind: Option<[f64; 2]>,
}

/// Compares the flights of an analysis with a mast's record. `campaign` stands in messages, `made_by`: program and version.
///
/// # Errors
/// If no flight can be compared.
pub fn compare(
    analysis: &Analysis,
    campaign: &Path,
    mast: &MastRecord,
    made_by: &str,
) -> Result<MastComparison, MastError> {
    let mut flights: Vec<(String, Vec<FieldRow>)> = Vec::new();
    for row in rows(analysis) {
        match flights.last_mut().filter(|(flight, _)| *flight == row.flight) {
            Some((_, of)) => of.push(row),
            None => flights.push((row.flight.clone(), vec![row])),
        }
    }
    let (mut compared, mut reasons) = (Vec::new(), Vec::new());
    for (name, rows) in &flights {
        match flight(name, rows, mast, fast_part(analysis, name)) {
            Ok(flight) => compared.push(flight),
            Err(reason) => reasons.push(format!("{name}: {reason}")),
        }
    }
    if flights.is_empty() {
        reasons.push("it has no map of the air".to_owned());
    }
    if compared.is_empty() {
        return Err(MastError::Nothing {
            campaign: campaign.to_owned(),
            mast: mast.name.clone(),
            reasons,
        });
    }
    let doubts = compared.iter().flat_map(doubts::of_flight).collect::<Vec<_>>();
    Ok(MastComparison {
        schema: MAST_SCHEMA.to_owned(),
        made_by: made_by.to_owned(),
        campaign: analysis.title.clone(),
        mast: mast.name.clone(),
        mast_height_m: mast.height_m,
        mast_step_s: mast.step_s,
        mast_mean_s: mast.slow_s,
        flights: compared,
        notes: doubts.into_iter().chain(mast.notes.iter().cloned()).chain(reasons).collect(),
    })
}

/// A row's own value with its 95 % interval, and its time, UTC, ms since 1970, if it has all of them.
fn own(row: &FieldRow) -> Option<(i64, f64, [f64; 2])> {
    Some((row.utc_ms?, row.w_mps?, [row.low_mps?, row.high_mps?]))
}

/// Mean and standard deviation of the posterior in a row, m/s.
fn posterior(row: &FieldRow) -> Option<[f64; 2]> {
    Some([row.posterior_mps?, row.posterior_sd_mps?])
}

/// Whether all values of a flight have a posterior: the estimate that its map stands for, with the errors of all drones
/// together.
fn has_posterior(rows: &[FieldRow]) -> bool {
    let mut known = rows.iter().filter(|row| own(row).is_some()).peekable();
    known.peek().is_some() && known.all(|row| posterior(row).is_some())
}

/// The drones of a flight with UTC, by their rows.
fn drones(rows: &[FieldRow]) -> Vec<Drone> {
    let has_posterior = has_posterior(rows);
    let mut drones: Vec<Drone> = Vec::new();
    for row in rows {
        let Some((at, own, interval)) = own(row) else { continue };
        if drones.last().is_none_or(|drone| drone.label != row.drone) {
            drones.push(Drone {
                label: row.drone.clone(),
                slot: row.slot,
                values: BTreeMap::new(),
                place_deg: row.fix.lat_lon_deg.map(|(deg, _)| deg),
                // Heights of tables count from their first row, not from the ground.
                height_m: row.fix.height_m.filter(|_| row.fix.lat_lon_deg.is_some()),
            });
        }
        let Some(drone) = drones.last_mut() else { continue };
        let value = Value {
            w: own,
            own,
            se: row.w_se_mps.unwrap_or(f64::NAN),
            noise: row.sd_mps.unwrap_or(0.0),
            interval,
            wind: row.wind_mps,
        };
        let value = match posterior(row).filter(|_| has_posterior) {
            Some([w, se]) => Value { w, se, interval: [w - NORMAL * se, w + NORMAL * se], ..value },
            None => value,
        };
        drone.values.insert((at as f64 / 1000.0).round() as i64, value);
    }
    drones
}

/// A flight beside the mast.
fn flight(
    name: &str,
    rows: &[FieldRow],
    mast: &MastRecord,
    fast: Option<f64>,
) -> Result<MastFlight, String> {
    let mut drones = drones(rows);
    if drones.is_empty() {
        return Err("the times of its values are not known in UTC (no clock in the logs; for a table, utc_offset_h)".to_owned());
    }
    let ends = |of: fn(&BTreeMap<i64, Value>) -> Option<i64>| {
        drones.iter().filter_map(|drone| of(&drone.values)).collect::<Vec<_>>()
    };
    let from = ends(|values| values.keys().next().copied()).into_iter().min().unwrap_or(0);
    let to = ends(|values| values.keys().next_back().copied()).into_iter().max().unwrap_or(0);
    // A clock that is centuries off must not become a record as long.
    let span = usize::try_from(to - from).unwrap_or(usize::MAX);
    if span > MOST_SECONDS {
        return Err("its drones' clocks are more than a week apart".to_owned());
    }
    let seconds: Vec<i64> = (from..=to).collect();
    if let Some(place) = mast.place_deg {
        let away =
            |drone: &Drone| drone.place_deg.map_or(f64::INFINITY, |deg| distance_m(place, deg));
        drones.sort_by(|a, b| away(a).total_cmp(&away(b)));
    }
    let is_posterior = has_posterior(rows);
    if let Some(length_s) = mast.slow_s {
        return slow::flight(name, &drones, &seconds, (mast, length_s), fast)
            .map(|flight| MastFlight { is_posterior, ..flight })
            .map_err(|reason| format!("{reason}{}", spans(mast, [from, to])));
    }
    let of_mast: Vec<f64> = seconds
        .iter()
        .map(|at| mast.mean(&mast.w, at * 1000, MEAN_S).unwrap_or(f64::NAN))
        .collect();
    let both = of_mast.iter().filter(|value| value.is_finite()).count();
    if both < FEWEST_SECONDS {
        return Err(format!(
            "{both} s are in both records, and {FEWEST_SECONDS} are the least{}",
            spans(mast, [from, to])
        ));
    }
    let columns: Vec<Vec<f64>> =
        drones.iter().map(|drone| column(drone, &seconds, |value| value.w)).collect();
    let (fleet, fleet_se) = fleet(&drones, &seconds);
    let stated = mean_of(&fleet_se);
    let nearest = columns.first().cloned().unwrap_or_default();
    let all = matched(&fleet, &of_mast, STEP_S, stated)
        .ok_or("the fleet's mean and the mast have no seconds in common")?;
    let own = |drone: &Drone| record(&column(drone, &seconds, |value| value.own), &of_mast);
    let records: Vec<Record> = drones.iter().map(own).collect();
    let noise: Vec<f64> = drones.iter().map(noise2).collect();
    let variance =
        |of: Option<Moment>| of.map(|of| if has_hole(&of_mast) { about_own_mean(of) } else { of });
    let told = drones
        .iter()
        .zip(&columns)
        .zip(records.iter().zip(&noise))
        .filter_map(|((drone, values), (record, noise))| {
            let stated = mean_of(&column(drone, &seconds, |value| value.se));
            Some(MastDrone {
                drone: drone.label.clone(),
                slot: drone.slot,
                distance_m: mast
                    .place_deg
                    .zip(drone.place_deg)
                    .map(|(mast, drone)| distance_m(mast, drone)),
                above_m: drone.height_m.zip(mast.height_m).map(|(drone, mast)| drone - mast),
                matched: matched(values, &of_mast, STEP_S, stated)?,
                inside_share: inside(drone, &seconds, &of_mast),
                variance: variance(moments::variance(record, *noise, 0.0)),
            })
        })
        .collect();
    let of_mast_record = record(&of_mast, &fleet);
    let refs: Vec<&Record> = records.iter().collect();
    let instrument = Instrument {
        transfer: Transfer { mean_s: MEAN_S, ..Transfer::NONE },
        highest_hz: HIGHEST_HZ,
        ..Instrument::default()
    };
    let all_of_mast: Vec<f64> = mast
        .w
        .between(
            (from as f64) - mast.zero_ms as f64 / 1000.0,
            to as f64 - mast.zero_ms as f64 / 1000.0,
        )
        .to_vec();
    Ok(MastFlight {
        flight: name.to_owned(),
        span_ms: [from * 1000, to * 1000],
        mean_s: MEAN_S,
        is_posterior,
        periods: Vec::new(),
        period_variance: None,
        averages: longer(&fleet, &nearest, &of_mast, stated),
        mast_variance: variance(moments::variance(&of_mast_record, 0.0, 0.0)),
        mast_variance_all: Some(variance_of(&all_of_mast)),
        drone_variance: variance(moments::mean_variance(&refs, &noise, 0.0)),
        mast_spectrum: spectrum(&of_mast_record, &instrument),
        drone_spectrum: mean(&refs, &instrument),
        coherence: records
            .first()
            .map(|first| cross(first, &of_mast_record, &instrument))
            .unwrap_or_default(),
        best_shift: best_shift(&fleet, &of_mast, STEP_S, SHIFTS_S),
        wind: wind(&drones, &seconds, mast),
        fleet: all,
        drones: told,
        series: MastSeries {
            time_s: seconds.iter().map(|at| (at - from) as f64).collect(),
            mast: of_mast,
            fleet,
            fleet_se,
            nearest,
        },
    })
}

/// Times of a flight (s since 1970) and of a mast's record, for messages.
fn spans(mast: &MastRecord, [from, to]: [i64; 2]) -> String {
    let [first, last] = mast.span_ms();
    format!(
        ": the flight is from {} to {}, the mast's record from {} to {}",
        iso(from * 1000),
        iso(to * 1000),
        iso(first),
        iso(last)
    )
}

/// Variance of w in the eddies that ten-second means have not, (m/s)²: of the spectrum of a flight's turbulence, as far as
/// it is told.
fn fast_part(analysis: &Analysis, name: &str) -> Option<f64> {
    let ids = ids(analysis);
    let (flight, _) = analysis.flights.iter().zip(&ids).find(|(_, id)| *id == name)?;
    missed(&flight.turbulence.as_ref()?.vertical.as_ref()?.spectrum)
}

/// Variance that means over ten seconds take from a spectrum, by the rule of trapezoids.
fn missed(bands: &[Band]) -> Option<f64> {
    let lost = |band: &Band| {
        let turned = PI * band.frequency_hz * MEAN_S;
        band.density * (1.0 - (turned.sin() / turned).powi(2))
    };
    let parts = bands.windows(2).map(|pair| {
        0.5 * (lost(&pair[0]) + lost(&pair[1])) * (pair[1].frequency_hz - pair[0].frequency_hz)
    });
    (bands.len() > 1).then(|| parts.sum::<f64>()).filter(|part| part.is_finite())
}

/// Median height of the drones above the ground, m, if their logs or the plan tell.
pub fn drones_height_m(analysis: &Analysis) -> Option<f64> {
    let placed = rows(analysis).filter(|row| row.fix.lat_lon_deg.is_some());
    numeric::median(placed.filter_map(|row| row.fix.height_m).collect())
}

/// A flight with its mast is not longer, s.
const MOST_SECONDS: usize = 7 * 86_400;

pub(super) fn column(drone: &Drone, seconds: &[i64], of: impl Fn(&Value) -> f64) -> Vec<f64> {
    seconds.iter().map(|at| drone.values.get(at).map_or(f64::NAN, &of)).collect()
}

/// Mean of the drones in each second, with its standard error: most of an error is common to all drones, so that the mean
/// is no better than the drones' own.
pub(super) fn fleet(drones: &[Drone], seconds: &[i64]) -> (Vec<f64>, Vec<f64>) {
    let enough = drones.len().div_ceil(2);
    let mean = |at: &i64| {
        let values: Vec<&Value> = drones.iter().filter_map(|drone| drone.values.get(at)).collect();
        if values.len() < enough {
            return (f64::NAN, f64::NAN);
        }
        let n = values.len() as f64;
        let of = |of: fn(&Value) -> f64| values.iter().map(|value| of(value)).sum::<f64>() / n;
        (of(|value| value.w), of(|value| value.se))
    };
    seconds.iter().map(mean).unzip()
}

pub(super) fn mean_of(values: &[f64]) -> Option<f64> {
    numeric::mean(values.iter().filter(|value| value.is_finite()))
}

pub(super) fn variance_of(values: &[f64]) -> f64 {
    let mean = mean_of(values).unwrap_or(0.0);
    let squares: Vec<f64> = values.iter().map(|value| (value - mean).powi(2)).collect();
    mean_of(&squares).unwrap_or(0.0)
}

/// Mean variance of a drone's own noise, (m/s)².
pub(super) fn noise2(drone: &Drone) -> f64 {
    let squares: Vec<f64> = drone.values.values().map(|value| value.noise.powi(2)).collect();
    mean_of(&squares).unwrap_or(0.0)
}

/// Values where the other record has one, too.
fn record(values: &[f64], other: &[f64]) -> Record {
    let both = values
        .iter()
        .zip(other)
        .map(|(value, other)| (value.is_finite() && other.is_finite()).then_some(*value));
    Record::new(STEP_S, both)
}

/// Whether values are missing between the first and the last.
fn has_hole(values: &[f64]) -> bool {
    let is_known = |value: &f64| value.is_finite();
    let first = values.iter().position(is_known).unwrap_or(0);
    let last = values.iter().rposition(is_known).unwrap_or(0);
    values.get(first..last).unwrap_or_default().iter().any(|value| !is_known(value))
}

/// A variance about the record's own mean, without what this mean takes: that follows from the integral time of a record
/// in one piece. Over a hole it would be made of air that nobody saw, and could be more than all that was measured.
fn about_own_mean(of: Moment) -> Moment {
    if !(of.value > 0.0 && of.systematic > 0.0) {
        return of;
    }
    let share = (1.0 - of.systematic / of.value).max(0.0);
    let random2 = (of.random.powi(2) - 2.0 * of.systematic.powi(2)).max(0.0);
    Moment::of_variance(of.value * share, random2.sqrt() * share, 0.0, (0.0, of.time_s))
}

fn inside(drone: &Drone, seconds: &[i64], mast: &[f64]) -> f64 {
    let both = seconds.iter().zip(mast).filter(|(_, mast)| mast.is_finite());
    let all: Vec<bool> = both
        .filter_map(|(at, mast)| {
            let [low, high] = drone.values.get(at)?.interval;
            Some((low..=high).contains(mast))
        })
        .collect();
    all.iter().filter(|inside| **inside).count() as f64 / all.len().max(1) as f64
}

fn longer(fleet: &[f64], nearest: &[f64], mast: &[f64], stated: Option<f64>) -> Vec<Average> {
    let of = |length_s: f64| {
        let count = (length_s / STEP_S) as usize;
        let [fleet, nearest, mast] = [fleet, nearest, mast].map(|values| averages(values, count));
        Some(Average {
            length_s,
            fleet: matched(&fleet, &mast, length_s, stated)?,
            nearest: matched(&nearest, &mast, length_s, None)?,
        })
    };
    let all = LONGER_S.into_iter().filter_map(of);
    all.filter(|average| average.fleet.count >= FEWEST).collect()
}

/// Wind of the fleet against the mast's.
fn wind(drones: &[Drone], seconds: &[i64], mast: &MastRecord) -> Option<[Matched; 2]> {
    let measured = mast.wind.as_ref()?;
    let one = |axis: usize| {
        let of_mast: Vec<f64> = seconds
            .iter()
            .map(|at| mast.mean(&measured[axis], at * 1000, MEAN_S).unwrap_or(f64::NAN))
            .collect();
        let of_drones: Vec<f64> = seconds
            .iter()
            .map(|at| {
                let all: Vec<f64> = drones
                    .iter()
                    .filter_map(|drone| Some(drone.values.get(at)?.wind?[axis]))
                    .collect();
                mean_of(&all).unwrap_or(f64::NAN)
            })
            .collect();
        matched(&of_drones, &of_mast, STEP_S, None)
    };
    Some([one(0)?, one(1)?])
}

/// Horizontal distance of two places, m.
pub(super) fn distance_m([lat_deg, lon_deg]: [f64; 2], other: [f64; 2]) -> f64 {
    let origin = Geodetic { lat_deg, lon_deg, amsl_m: 0.0 };
    let frame = ShowFrame { origin, orientation_deg: 0.0 };
    let place = frame.from_geodetic(Geodetic { lat_deg: other[0], lon_deg: other[1], amsl_m: 0.0 });
    place.x.hypot(place.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_second_means_miss_what_is_faster() {
        let band = |frequency_hz: f64| Band {
            frequency_hz,
            density: 0.5,
            low: 0.0,
            high: 1.0,
            freedom: 10.0,
        };
        let fine: Vec<Band> = (1..=2000).map(|k| band(5e-4 * f64::from(k))).collect();
        // Of white noise up to 1 Hz a mean over 10 s leaves 1/20 Hz.
        let found = missed(&fine).unwrap();
        assert!((found - 0.5 * 0.95).abs() < 2e-3, "{found}");
        assert!(missed(&fine[..80]).unwrap() < 0.2 * 0.5 * 0.04, "slow air is in the means");
        assert!(missed(&fine[..1]).is_none());
    }

    #[test]
    fn nothing_is_added_to_a_variance_over_a_hole() {
        let hole = [f64::NAN, 0.1, f64::NAN, 0.2, f64::NAN];
        assert!(has_hole(&hole));
        assert!(!has_hole(&hole[..2]) && !has_hole(&[0.1, 0.2]) && !has_hole(&[]));
        let of = Moment {
            value: 0.150,
            low: 0.034,
            high: 28.7,
            random: 0.2,
            systematic: 0.092,
            time_s: 25.0,
        };
        let found = about_own_mean(of);
        assert!((found.value - 0.058).abs() < 1e-12 && found.systematic == 0.0, "{found:?}");
        assert!(found.random < of.random && found.low < found.value && found.value < found.high);
        let whole = Moment { systematic: 0.0, ..of };
        assert_eq!(about_own_mean(whole), whole);
    }

    fn row(second: i64, posterior: Option<[f64; 2]>) -> FieldRow {
        FieldRow {
            flight: "hover".to_owned(),
            time_s: second as f64,
            slot: Some(1),
            drone: "Drone 1".to_owned(),
            x_m: None,
            y_m: None,
            z_m: None,
            w_mps: Some(0.4),
            sd_mps: Some(0.05),
            low_mps: Some(-0.7),
            high_mps: Some(1.5),
            flags: String::new(),
            truth_mps: None,
            posterior_mps: posterior.map(|[w, _]| w),
            posterior_sd_mps: posterior.map(|[_, sd]| sd),
            utc_ms: Some(second * 1000),
            fix: crate::products::Fix::default(),
            w_se_mps: Some(0.56),
            wind_mps: None,
            wind_se_mps: None,
        }
    }

    #[test]
    fn the_posterior_is_what_is_compared_where_there_is_one() {
        let rows = [row(0, Some([0.1, 0.2])), row(1, Some([0.1, 0.2]))];
        assert!(has_posterior(&rows));
        let value = drones(&rows)[0].values[&1];
        assert_eq!((value.w, value.own, value.se), (0.1, 0.4, 0.2));
        assert!((value.interval[0] - (0.1 - 0.392)).abs() < 1e-12, "{:?}", value.interval);
        // Of two estimates that are mixed nobody would know which was judged.
        let mixed = [row(0, Some([0.1, 0.2])), row(1, None)];
        assert!(!has_posterior(&mixed) && !has_posterior(&[]));
        let value = drones(&mixed)[0].values[&0];
        assert_eq!((value.w, value.own, value.se), (0.4, 0.4, 0.56));
    }
}
