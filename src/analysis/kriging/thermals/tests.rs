//! Thermals in records that are made up: drawn from a field's own covariance, with a thermal by formulas of the tests'
//! own.

use nalgebra::{DMatrix, DVector};
use rand_distr::{Distribution as _, StandardNormal};

use super::{Record, Thermal};
use crate::analysis::corrections::DOUBTS;
use crate::analysis::kriging::covariance::{Air, Covariance, Form};
use crate::analysis::kriging::data::{Drone, Rows, UNIFORM, Value};
use crate::analysis::kriging::moving;
use crate::analysis::kriging::neighbours::{Reach, before};
use crate::analysis::kriging::scales::{COARSE, FINE, Found, Search, Whole};
use crate::analysis::kriging::vecchia::Common;
use crate::analysis::shape::PARAMETERS;
use crate::base::rng::{Purpose, stream};

const NOISE_MPS: f64 = 0.03;
const OWN_MPS: f64 = 0.05;
/// An error that all drones share, m/s.
const SHIFT_MPS: f64 = 0.3;

#[derive(Clone, Copy, Debug)]
enum Profile {
    Gaussian,
    Ring,
    Flat,
}

#[derive(Clone, Copy, Debug)]
pub(in crate::analysis::kriging) struct Truth {
    profile: Profile,
    /// At 0 s.
    core_m: [f64; 2],
    drift_mps: [f64; 2],
    radius_m: f64,
    peak_mps: f64,
}

impl Truth {
    fn at(&self, [x, y]: [f64; 2], time_s: f64) -> f64 {
        let [u, v] = self.drift_mps;
        let r = (x - self.core_m[0] - u * time_s).hypot(y - self.core_m[1] - v * time_s);
        let s = (r / self.radius_m).powi(2);
        self.peak_mps
            * match self.profile {
                Profile::Gaussian => (-s).exp(),
                Profile::Ring => (1.0 - s) * (-s).exp(),
                Profile::Flat => 1.0 / (1.0 + s * s),
            }
    }

    /// Distance at which it has fallen to 1/e, by sums.
    fn core_radius_m(&self) -> f64 {
        let still = Self { drift_mps: [0.0; 2], core_m: [0.0; 2], ..*self };
        let is_inside = |r: &f64| still.at([*r, 0.0], 0.0) > self.peak_mps * (-1.0_f64).exp();
        0.01 * (0..100_000).map(|step| 0.01 * f64::from(step)).take_while(is_inside).count() as f64
    }

    fn core_flux_m3ps(&self) -> f64 {
        let still = Self { drift_mps: [0.0; 2], core_m: [0.0; 2], ..*self };
        let count = (self.core_radius_m() / 0.01) as usize;
        let radii = (0..count).map(|step| 0.01 * (step as f64 + 0.5));
        std::f64::consts::TAU * 0.01 * radii.map(|r| r * still.at([r, 0.0], 0.0)).sum::<f64>()
    }
}

/// A fleet of 5 x 5 that hovers 10 m apart or flies legs of 160 m at 4 m/s there and back, or one of 3 x 3 that hovers 7 m apart.
#[derive(Clone, Copy, Debug)]
pub(in crate::analysis::kriging) enum Fleet {
    Hover { seconds: usize },
    Small { seconds: usize },
    Scan { legs: usize },
}

/// Seconds of a leg, and of the turn behind it.
const LEG_S: usize = 40;
const TURN_S: usize = 10;

impl Fleet {
    fn seconds(self) -> usize {
        match self {
            Self::Hover { seconds } | Self::Small { seconds } => seconds,
            Self::Scan { legs } => legs * (LEG_S + TURN_S),
        }
    }

    fn places(self) -> Vec<Vec<[f64; 3]>> {
        match self {
            Self::Hover { .. } => (0..25)
                .map(|index| {
                    let [x, y] = [index % 5, index / 5].map(|step| 10.0 * f64::from(step) - 20.0);
                    vec![[x, y, 60.0]]
                })
                .collect(),
            Self::Small { .. } => (0..9)
                .map(|index| {
                    let [x, y] = [index % 3, index / 3].map(|step| 7.0 * f64::from(step) - 7.0);
                    vec![[x, y, 60.0]]
                })
                .collect(),
            Self::Scan { .. } => (0..25)
                .map(|index| {
                    let [behind, y] =
                        [index % 5, index / 5].map(|step| 10.0 * f64::from(step) - 20.0);
                    (0..self.seconds())
                        .map(|second| {
                            let (leg, into) =
                                (second / (LEG_S + TURN_S), second % (LEG_S + TURN_S));
                            let along = 4.0 * into.min(LEG_S) as f64;
                            let x = if leg % 2 == 0 { along } else { 160.0 - along } - 80.0;
                            [x + behind, y, 60.0]
                        })
                        .collect()
                })
                .collect(),
        }
    }

    fn has_value(self, second: usize) -> bool {
        match self {
            Self::Hover { .. } | Self::Small { .. } => true,
            Self::Scan { .. } => (5..=LEG_S - 5).contains(&(second % (LEG_S + TURN_S))),
        }
    }
}

pub(in crate::analysis::kriging) fn air(
    form: Form,
    sd_mps: f64,
    length_m: f64,
    time_s: f64,
) -> Air {
    Air {
        form,
        sd_mps,
        length_m,
        stretch: [0.0; 2],
        time_s,
        drift_mps: [0.0; 2],
        gust_mps: 0.12,
        gust_s: 4.0,
        slow_mps: 0.0,
        shared_mps: 0.0,
    }
}

fn drones(fleet: Fleet) -> Vec<Drone> {
    let value = Value {
        updraft_mps: 0.0,
        law: [0.0; PARAMETERS],
        doubts_mps: [0.0; DOUBTS],
        own_mps: OWN_MPS,
        noise_mps: NOISE_MPS,
    };
    let values: Vec<Option<Value>> =
        (0..fleet.seconds()).map(|second| fleet.has_value(second).then_some(value)).collect();
    let of = |place_m| Drone { place_m, values: values.clone(), ..Drone::default() };
    fleet.places().into_iter().map(of).collect()
}

/// A record in an air, with or without a thermal.
pub(in crate::analysis::kriging) fn made(
    seed: u64,
    fleet: Fleet,
    air: Air,
    truth: Option<Truth>,
) -> (Vec<Drone>, Rows) {
    let drones = drones(fleet);
    let mut rows = Rows::of(&drones, 5, 10);
    let mut rng = stream(seed, 1, Purpose::Sensors);
    let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
    let covariance = Covariance::new(air);
    let count = rows.list.len();
    let matrix = DMatrix::from_fn(count, count, |row, column| {
        let own = if row == column { NOISE_MPS * NOISE_MPS } else { 0.0 };
        own + covariance.of(&rows.list[row].spot, &rows.list[column].spot)
    });
    // Sums over few nodes are no exact covariance: what is missing is noise.
    let jitter = DMatrix::identity(count, count) * (0.1 * air.sd_mps).powi(2);
    let factor = matrix.clone().cholesky().or_else(|| (matrix + jitter).cholesky()).unwrap().l();
    let drawn = factor * DVector::from_fn(count, |_, _| normal());
    let own: Vec<f64> = drones.iter().map(|_| OWN_MPS * normal()).collect();
    for (row, air_mps) in rows.list.iter_mut().zip(drawn.iter()) {
        let spot = row.spot;
        let thermal: f64 = truth.map_or(0.0, |truth| {
            let mean = (0..20).map(|step| 0.5 * (f64::from(step) + 0.5) - 5.0).map(|by_s| {
                let place = [0, 1].map(|axis| spot.place_m[axis] + spot.velocity_mps[axis] * by_s);
                truth.at(place, spot.time_s + by_s)
            });
            mean.sum::<f64>() / 20.0
        });
        row.value_mps = SHIFT_MPS + air_mps + own[spot.drone.unwrap()] + thermal;
    }
    (drones, rows)
}

/// The most probable scales in this wind.
pub(in crate::analysis::kriging) fn scales_of(
    drones: &[Drone],
    rows: &Rows,
    wind_mps: Option<[f64; 2]>,
) -> Found {
    with_search(drones, rows, wind_mps, |search| search.best().unwrap())
}

fn looked_for(drones: &[Drone], rows: &Rows, wind_mps: Option<[f64; 2]>) -> Vec<Thermal> {
    with_search(drones, rows, wind_mps, |search| {
        let found = search.best().unwrap();
        Record { search, drones, found: &found, wind_mps }.thermals()
    })
}

fn with_search<T>(
    drones: &[Drone],
    rows: &Rows,
    wind_mps: Option<[f64; 2]>,
    of: impl FnOnce(&Search<'_>) -> T,
) -> T {
    let moves = drones.iter().any(|drone| !drone.hovers());
    let reach = if moves { moving::REACH } else { Reach { beside: 7, step: 7, own: 2 } };
    let all = before(drones, rows, reach);
    let (fine, coarse) = (Whole::of(drones, rows, FINE), Whole::of(drones, rows, COARSE));
    let own_mps = vec![OWN_MPS; drones.len()];
    let mut factor = Common::zeros();
    factor[(UNIFORM, UNIFORM)] = 3.0;
    of(&Search {
        rows,
        neighbours: &all,
        whole: Some(&fine),
        coarse: Some(&coarse),
        own_mps: &own_mps,
        slope_share: 0.0,
        wind_mps,
        factor,
        lasting_mps: 0.0,
    })
}

/// Draws evenly spread numbers from a seed.
fn share(seed: u64, salt: u64) -> f64 {
    let mut rng = stream(seed, 2 + salt, Purpose::Sensors);
    let normal: f64 = StandardNormal.sample(&mut rng);
    0.5 * (1.0 + statrs::function::erf::erf(normal / std::f64::consts::SQRT_2))
}

fn truth(seed: u64, fleet: Fleet, drift_mps: [f64; 2]) -> Truth {
    let (x, y) = match fleet {
        Fleet::Hover { .. } => (20.0, 20.0),
        Fleet::Small { .. } => (7.0, 7.0),
        Fleet::Scan { .. } => (60.0, 22.0),
    };
    let within = |salt: u64, low: f64, high: f64| low + share(seed, salt) * (high - low);
    let middle_s = 0.5 * fleet.seconds() as f64;
    let core = [within(0, -x, x), within(1, -y, y)];
    Truth {
        profile: [Profile::Gaussian, Profile::Ring, Profile::Flat][(seed % 3) as usize],
        core_m: [0, 1].map(|axis| core[axis] - drift_mps[axis] * middle_s),
        drift_mps,
        radius_m: within(2, 12.0, 30.0),
        peak_mps: within(3, 0.8, 2.5),
    }
}

/// Finds of thermals that are there, against the truth.
#[derive(Default)]
struct Tally {
    missed: usize,
    many: usize,
    place_m: Vec<f64>,
    peak_share: Vec<f64>,
    /// Errors in standard errors: place x and y, peak, radius, flux, drift.
    scores: [Vec<f64>; 6],
}

impl Tally {
    fn add(&mut self, found: &[Thermal], truth: &Truth) {
        let Some(one) = found.first() else {
            self.missed += 1;
            return;
        };
        self.many += usize::from(found.len() > 1);
        let core = [0, 1].map(|axis| truth.core_m[axis] + truth.drift_mps[axis] * one.at_s);
        let off = [0, 1].map(|axis| one.core_m[axis].0 - core[axis]);
        self.place_m.push(off[0].hypot(off[1]));
        self.peak_share.push(one.peak_mps.0 / truth.peak_mps - 1.0);
        let score = |(value, se): (f64, f64), truth: f64| (value - truth) / se;
        self.scores[0].push(score(one.core_m[0], core[0]));
        self.scores[1].push(score(one.core_m[1], core[1]));
        self.scores[2].push(score(one.peak_mps, truth.peak_mps));
        self.scores[3].push(score(one.radius_m, truth.core_radius_m()));
        self.scores[4].push(score(one.flux_m3ps, truth.core_flux_m3ps()));
        self.scores[5].push(score(one.drift_mps[0], truth.drift_mps[0]));
    }

    fn inside(&self, which: usize) -> f64 {
        let scores = &self.scores[which];
        scores.iter().filter(|score| score.abs() < 1.96).count() as f64 / scores.len() as f64
    }

    fn told(&self) -> String {
        let mut place = self.place_m.clone();
        place.sort_by(f64::total_cmp);
        let mut peak: Vec<f64> = self.peak_share.iter().map(|share| share.abs()).collect();
        peak.sort_by(f64::total_cmp);
        let at = |values: &[f64], share: f64| {
            values.get((share * values.len() as f64) as usize).copied().unwrap_or(f64::NAN)
        };
        let within = place.iter().filter(|off| **off < 2.0).count();
        let near = peak.iter().filter(|off| **off < 0.1).count();
        format!(
            "{} found, {} missed, {} with more than one; place off {:.2} m (median), {:.2} m (90 %), {within} within 2 m; \
             peak off {:.3} (median), {:.3} (90 %), {near} within 10 %; inside: x {:.2} y {:.2} peak {:.2} radius {:.2} \
             flux {:.2} drift {:.2}",
            place.len(),
            self.missed,
            self.many,
            at(&place, 0.5),
            at(&place, 0.9),
            at(&peak, 0.5),
            at(&peak, 0.9),
            self.inside(0),
            self.inside(1),
            self.inside(2),
            self.inside(3),
            self.inside(4),
            self.inside(5),
        )
    }
}

const HOVER: Fleet = Fleet::Hover { seconds: 200 };
const SMALL: Fleet = Fleet::Small { seconds: 120 };
const SCAN: Fleet = Fleet::Scan { legs: 4 };

fn seeds(default: u64) -> std::ops::Range<u64> {
    let given = std::env::var("UPDRAFT_SEEDS").ok().and_then(|text| text.parse().ok());
    0..given.unwrap_or(default)
}

#[test]
fn a_thermal_is_found_where_it_is() {
    let quiet = air(Form::Exponential, 0.15, 60.0, 60.0);
    let drift_mps = [0.8, 0.3];
    for seed in 0..2 {
        let truth = truth(seed, HOVER, drift_mps);
        let (drones, rows) = made(seed, HOVER, quiet, Some(truth));
        let found = looked_for(&drones, &rows, Some([0.9, 0.2]));
        let one = found.first().unwrap();
        for axis in 0..2 {
            let core_m = truth.core_m[axis] + truth.drift_mps[axis] * one.at_s;
            let off_m = one.core_m[axis].0 - core_m;
            assert!(off_m.abs() < 2.0, "{seed}: {off_m} {truth:?} {one:?}");
        }
        let off = one.peak_mps.0 / truth.peak_mps - 1.0;
        assert!(off.abs() < 0.2, "{seed}: {off} {truth:?} {one:?}");
    }
}

#[test]
fn a_stationary_field_has_no_thermal() {
    for form in [Form::Exponential, Form::Gaussian] {
        let (drones, rows) = made(0, HOVER, air(form, 0.5, 80.0, 100.0), None);
        let found = looked_for(&drones, &rows, None);
        assert!(found.is_empty(), "{form:?}: {found:?}");
    }
}

#[test]
fn gusts_that_the_wind_carries_through_a_field_are_no_thermals() {
    let stays = air(Form::Exponential, 0.5, 145.0, 186.0);
    let carried = Air { drift_mps: [2.0, 0.0], ..air(Form::Exponential, 0.3, 19.0, 1e4) };
    for seed in 0..2 {
        let (drones, mut rows) = made(seed, HOVER, stays, None);
        let (_, gusts) = made(seed + 100, HOVER, carried, None);
        rows.list
            .iter_mut()
            .zip(&gusts.list)
            .for_each(|(row, gust)| row.value_mps += gust.value_mps);
        let found = looked_for(&drones, &rows, Some([2.0, 0.0]));
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
}

#[test]
fn a_small_fleet_takes_no_slope_of_a_field_for_a_thermal() {
    for seed in 0..4 {
        let (drones, rows) = made(seed, SMALL, air(Form::Exponential, 0.5, 145.0, 186.0), None);
        let found = looked_for(&drones, &rows, None);
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
}

#[test]
#[ignore = "minutes: UPDRAFT_SEEDS=100 cargo test --release --lib kriging::thermals -- --ignored --nocapture"]
fn many_thermals_and_none() {
    let quiet = air(Form::Exponential, 0.15, 60.0, 60.0);
    let only = std::env::var("ONLY").unwrap_or_default();
    for (name, fleet, drift_mps, wind) in [
        ("standing over a hover", HOVER, [0.0; 2], Some([0.0; 2])),
        ("drifting over a hover", HOVER, [0.8, 0.3], Some([0.9, 0.2])),
        ("standing, by scan", SCAN, [0.0; 2], None),
        ("drifting, by scan", SCAN, [0.4, 0.2], None),
    ] {
        if !name.contains(&only) {
            continue;
        }
        let mut tally = Tally::default();
        for seed in seeds(30) {
            let truth = truth(seed, fleet, drift_mps);
            let (drones, rows) = made(seed, fleet, quiet, Some(truth));
            let found = looked_for(&drones, &rows, wind);
            if std::env::var("UPDRAFT_EACH").is_ok() {
                println!("{truth:?}\n   {found:?}");
            }
            tally.add(&found, &truth);
        }
        println!("{name}: {}", tally.told());
    }
    for (name, fleet, air) in [
        ("rough field, hover", HOVER, air(Form::Exponential, 0.5, 80.0, 100.0)),
        ("smooth field, hover", HOVER, air(Form::Gaussian, 0.5, 80.0, 150.0)),
        ("short field, hover", HOVER, air(Form::Gaussian, 0.5, 30.0, 150.0)),
        ("wide field, small fleet", SMALL, air(Form::Exponential, 0.5, 145.0, 186.0)),
        ("rough field, scan", SCAN, air(Form::Exponential, 0.5, 60.0, 100.0)),
        ("smooth field, scan", SCAN, air(Form::Gaussian, 0.5, 40.0, 200.0)),
    ] {
        if !name.contains(&only) {
            continue;
        }
        let mut false_finds = Vec::new();
        for seed in seeds(30) {
            let (drones, rows) = made(seed, fleet, air, None);
            let found = looked_for(&drones, &rows, None);
            false_finds.extend(found.first().map(|one| (one.log_odds * 10.0).round() / 10.0));
        }
        println!(
            "{name}: {} of {} with a thermal that is none, log odds {false_finds:?}",
            false_finds.len(),
            seeds(30).end
        );
    }
}
