//! Differences between drones: each one's hover pulse and response against the fleet's.

use nalgebra::{DMatrix, DVector};

use super::compare::Comparison;
use super::error::GapError;
use super::explain::Found;
use super::gls::Split;
use super::noise::{
    GUST_TIME, GUSTS, GroupPattern, Hyper, OFFSETS, OWN, SHARED_TIME, SLOPES, WHITE,
};
use super::verdict::{DroneOffset, Drones, Finding, Fitted, Interval, Step};
use crate::effects::role::Place;
use crate::effects::{Model, Reference, Role, Signals};
use crate::numeric::{Line, Moments, mean};
use crate::vehicle::Vehicle;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// Fewest drones from which a correlation is stated: its standard error is then 0.35. Chosen.
const FEWEST: usize = 8;
/// Spread of the hover pulse above which it is called unusual, us: three times that of the paper's fleet
/// (6.7 us, Table II).
const USUAL_US: f64 = 20.0;

/// Offsets and responses of all drones of a comparison against the fleet's model; and, when they
/// differ more than `original` says and fleets usually do, that as a finding.
///
/// # Errors
/// Effects of the vehicle that are not valid.
pub(super) fn drones(
    all: &Comparison,
    found: &Found,
    original: &Vehicle,
    is_held: impl Fn(u16) -> bool,
) -> Result<(Drones, Option<Step>), GapError> {
    let mut patterns = all.patterns(&found.vehicle, found.gusts_mps)?;
    // Kinds of spread are told apart by how responses follow offsets, so neither may have the other in it.
    for (pattern, slope_us) in patterns.iter_mut().zip(all.beside_hover_us(&found.vehicle)?) {
        pattern.offset.clear();
        pattern.slope_us = slope_us;
    }
    let residual = Split::of(&all.residual(&found.vehicle, found.gusts_mps)?);
    let mut each = Vec::new();
    let mut plain_us = Vec::new();
    let mut reliability: f64 = 1.0;
    for (index, (group, pattern)) in all.data.groups.iter().zip(&patterns).enumerate() {
        let blup = Blup::new(pattern, &found.noise.hyper);
        reliability = reliability.min(blup.slope_reliability(pattern));
        for (slot, deviation) in group.slots.iter().zip(residual.deviations(index)) {
            let (offset_us, slope) = blup.of(deviation);
            plain_us.extend(mean(deviation));
            each.push(DroneOffset { slot: *slot, offset_us, slope, held_out: is_held(*slot) });
        }
    }
    each.sort_by_key(|drone| drone.slot);
    let responses: Vec<f64> =
        patterns.iter().flat_map(|pattern| pattern.responses(&found.noise.hyper)).collect();
    // Who responds more than the others needs another pulse where the air rises, too.
    let by_updraft_us = found.noise.hyper.get(SLOPES)
        * found.updraft_mps.abs()
        * mean(&responses).unwrap_or_default();
    let by_model_us = all.offsets_us(&found.vehicle)?;
    let usual_us = by_model_us.hypot(by_updraft_us);
    let plain = Moments::of(&plain_us).map_or(0.0, |moments| moments.squares);
    let spread = spread((&each, plain), reliability, usual_us, found, original);
    let correlation = (each.len() >= FEWEST).then(|| correlation(&each));
    let words = words(&each, correlation, found);
    Ok((Drones { each, correlation, words }, spread))
}

/// Best linear prediction of a drone's offset and response from its deviations.
struct Blup {
    map: DMatrix<f64>,
}

impl Blup {
    fn new(pattern: &GroupPattern, hyper: &Hyper) -> Self {
        let count = pattern.time_s.len();
        let square = |place: usize| hyper.get(place).powi(2);
        let responses = pattern.own_responses(hyper);
        let covariance = DMatrix::from_fn(count, count, |a, b| {
            let apart_s = (pattern.time_s[a] - pattern.time_s[b]).abs();
            let air = square(OWN) * (-apart_s / hyper.get(SHARED_TIME)).exp()
                + square(GUSTS) * (-apart_s / hyper.get(GUST_TIME)).exp();
            responses[a] * responses[b] * air
                + square(OFFSETS) * pattern.offset_at(a) * pattern.offset_at(b)
                + square(SLOPES) * pattern.slope_us[a] * pattern.slope_us[b]
                + if a == b { square(WHITE) } else { 0.0 }
        });
        let cross = DMatrix::from_fn(count, 2, |bin, which| match which {
            0 => square(OFFSETS) * pattern.offset_at(bin),
            _ => square(SLOPES) * pattern.slope_us[bin],
        });
        let map = covariance
            .cholesky()
            .map_or_else(|| DMatrix::zeros(2, count), |factor| factor.solve(&cross).transpose());
        Self { map }
    }

    /// What is left of a true slope of 1 in the prediction.
    fn slope_reliability(&self, pattern: &GroupPattern) -> f64 {
        (&self.map * DVector::from_column_slice(&pattern.slope_us))[1].clamp(0.0, 1.0)
    }

    fn of(&self, deviation: &[f64]) -> (f64, f64) {
        let found = &self.map * DVector::from_column_slice(deviation);
        (found[0], found[1])
    }
}

/// Spread of thrust or mass between the drones of a usual fleet, relative: 6.7 us of the paper's Table II
/// over a sensitivity of 300 us (docs/physics.md, 3.9).
const USUAL: f64 = 0.023;
/// Spreads are judged from at least this many drones: the 95 % interval of a standard deviation is then 0.7
/// to 1.7 times its value. Chosen.
const FEWEST_FOR_SPREAD: usize = 12;

/// A spread between drones beyond the model's and the usual. `plain` are the squares of the drones' mean pulses
/// about the fleet's, us²: where drones differ in more than an offset and a slope, offsets in hover say too much.
fn spread(
    (each, plain): (&[DroneOffset], f64),
    reliability: f64,
    usual_us: f64,
    found: &Found,
    original: &Vehicle,
) -> Option<Step> {
    if each.len() < FEWEST_FOR_SPREAD {
        return None;
    }
    let count = each.len() as f64;
    let sensitivity = Reference::of(&found.vehicle).sensitivity_us();
    let relative: Vec<f64> = each.iter().map(|drone| drone.offset_us / sensitivity).collect();
    let moments = Moments::of(&relative)?;
    let (centre, square) = (moments.mean, moments.squares);
    let least = square.min(plain / sensitivity.powi(2));
    let freedom = count - 1.0;
    let sd = (least / freedom).sqrt();
    let chi2 = ChiSquared::new(freedom).ok()?;
    let (low, high) =
        ((least / chi2.inverse_cdf(0.975)).sqrt(), (least / chi2.inverse_cdf(0.025)).sqrt());
    let (by_mass, by_thrust) = (Role::MassSpread.place()?, Role::ThrustSpread.place()?);
    let known = |role: Role| role.value(original).unwrap_or(0.0);
    let (mass, thrust) = (known(Role::MassSpread), known(Role::ThrustSpread));
    let expected = mass.hypot(thrust).max(USUAL).max(usual_us / sensitivity);
    let ratio = (sd / expected).powi(2);
    let most = chi2.inverse_cdf(1.0 - SPREAD_ALPHA) / freedom;
    if ratio <= most {
        return None;
    }
    // Log-likelihood of offsets whose variance is this many times the expected one, by their own against the expected.
    let nats = |ratio: f64| 0.5 * count * (ratio - 1.0 - ratio.ln());
    // Thrust makes the response of a drone follow its offset, mass does not.
    let slopes = mean(each.iter().map(|drone| drone.slope))?;
    let cross: f64 =
        each.iter().zip(&relative).map(|(d, r)| (d.slope - slopes) * (r - centre)).sum();
    let follows = cross / square;
    let rest: f64 = each
        .iter()
        .zip(&relative)
        .map(|(d, r)| (d.slope - slopes - follows * (r - centre)).powi(2))
        .sum();
    let se = (rest / (count - 2.0) / square).sqrt() / reliability.max(0.05);
    let follows = follows / reliability.max(0.05);
    let from_model = |known: f64| (known > 0.0).then_some(known);
    // The part beyond what the model has of the other kind.
    let own = |other: f64| (sd * sd - other * other).max(0.0).sqrt();
    let parameter = |place: Place, other: f64, before: f64| Fitted {
        name: place.parameter.name.to_owned(),
        unit: String::new(),
        value: Interval {
            value: own(other),
            low: (low * low - other * other).max(0.0).sqrt(),
            high: (high * high - other * other).max(0.0).sqrt(),
        },
        before: from_model(before),
    };
    // A share of what the other kind would show is named only if it excludes that kind.
    let of = |change: fn(&mut Vehicle)| response_follows(&found.vehicle, change);
    let (thrusts, masses) = (
        of(|vehicle| vehicle.airframe.thrust_coefficient /= LITTLE),
        of(|vehicle| vehicle.airframe.mass_kg *= LITTLE),
    );
    let off = |wanted: f64| (follows - wanted).abs() / se.hypot(FOLLOWS_DOUBT);
    let finding = if off(masses) > EXCLUDED_Z && off(thrusts) < off(masses) {
        Finding::Name {
            effect: by_thrust.name().to_owned(),
            parameters: vec![parameter(by_thrust, mass, thrust)],
            was_there: thrust > 0.0,
        }
    } else if off(thrusts) > EXCLUDED_Z && off(masses) < off(thrusts) {
        Finding::Name {
            effect: by_mass.name().to_owned(),
            parameters: vec![parameter(by_mass, thrust, mass)],
            was_there: mass > 0.0,
        }
    } else {
        Finding::Class {
            effects: vec![by_thrust.name().to_owned(), by_mass.name().to_owned()],
            parameters: vec![parameter(by_thrust, mass, thrust)],
        }
    };
    Some(Step {
        finding,
        gain_nats: nats(ratio),
        threshold_nats: nats(most),
        alpha: SPREAD_ALPHA,
        size_us: sd * sensitivity,
        rivals: Vec::new(),
        shape: None,
        in_field: None,
        form: None,
    })
}

/// A kind of spread that is this many standard errors off is excluded. Convention.
const EXCLUDED_Z: f64 = 3.0;
/// Standard error of how a drone's response follows its offset, besides noise: rotors differ in their
/// inflow, too, by 5 to 7 % in the benchmark. Chosen above that.
const FOLLOWS_DOUBT: f64 = 0.1;
/// A relative change of one per cent, for a derivative.
const LITTLE: f64 = 1.01;

/// By how much a drone's response to climb differs, as a share, over how much its hover pulse does,
/// as a share of thrust, when something of it is a little off.
fn response_follows(vehicle: &Vehicle, change: fn(&mut Vehicle)) -> f64 {
    let mut other = vehicle.clone();
    change(&mut other);
    let (Ok(one), Ok(two)) = (Model::of(vehicle), Model::of(&other)) else { return 0.0 };
    let at = |model: &Model, climb_mps| {
        model.pulse_us(&Signals { climb_mps, density_ratio: 1.0, ..Signals::default() })
    };
    let (mut product, mut square) = (0.0, 0.0);
    for climb_mps in [-3.5, -2.5, -1.5, 1.5, 2.5, 3.5] {
        let own = at(&one, climb_mps) - at(&one, 0.0);
        product += own * (at(&two, climb_mps) - at(&two, 0.0) - own);
        square += own * own;
    }
    let offset = (at(&two, 0.0) - at(&one, 0.0)) / Reference::of(vehicle).sensitivity_us();
    let follows = product / square / offset;
    if follows.is_finite() { follows } else { 0.0 }
}

/// Share of flights in which drones that differ as usual seem to differ by more: what each round allows itself.
const SPREAD_ALPHA: f64 = 0.005;

fn correlation(each: &[DroneOffset]) -> f64 {
    let line = Line::through(each.iter().map(|drone| (drone.offset_us, drone.slope)));
    line.and_then(|line| line.correlation()).unwrap_or_default()
}

fn words(each: &[DroneOffset], correlation: Option<f64>, found: &Found) -> Vec<String> {
    let mut words = Vec::new();
    let spread_us = found.noise.hyper.get(OFFSETS);
    let sensitivity = Reference::of(&found.vehicle).sensitivity_us();
    if each.len() >= FEWEST {
        words.push(format!(
            "hover pulses differ by {spread_us:.1} us from drone to drone (standard deviation): \
             {:.1} % of thrust or mass{}",
            100.0 * spread_us / sensitivity,
            if spread_us > USUAL_US { ", more than is usual" } else { "" },
        ));
        words.push(match correlation {
            Some(value) if value > 0.5 => {
                "drones that need more pulse also respond more: the thrust of rotors differs rather \
                 than the mass"
                    .to_owned()
            }
            _ => "whether thrust or mass differs cannot be told from offsets alone: a known payload \
                  on some drones would tell"
                .to_owned(),
        });
    }
    words
}

#[cfg(test)]
mod tests {
    use super::super::compare::Simulated;
    use super::super::trial;
    use super::*;
    use crate::vehicle::library::builtin;

    /// Spread of thrust that the model states, relative.
    const KNOWN: f64 = 0.016;
    /// Spread of what is hidden, relative.
    const HIDDEN: f64 = 0.05;
    /// Spread of the inflow, relative.
    const INFLOW: f64 = 0.06;
    const DRONES: usize = 49;

    /// Standard normal values in some order.
    fn scatter(drone: usize, times: usize) -> f64 {
        use statrs::distribution::Normal;
        let share = ((times * drone) % DRONES) as f64 + 0.5;
        Normal::standard().inverse_cdf(share / DRONES as f64)
    }

    /// What is said of show drones that differ by so much in something, and in their inflow.
    fn told(differ: fn(&mut Vehicle, f64)) -> Option<Step> {
        let mut known = builtin("pixel").unwrap();
        Role::ThrustSpread.set(&mut known, KNOWN);
        Role::InflowSpread.set(&mut known, INFLOW);
        let pulse_us = |vehicle: &Vehicle, climb_mps: f64| {
            let here = Signals { height_m: 30.0, density_ratio: 1.0, ..Signals::default() };
            Model::of(vehicle).unwrap().pulse_us(&Signals { climb_mps, ..here })
        };
        let flown: Vec<Vehicle> = (0..DRONES)
            .map(|drone| {
                let mut one = known.clone();
                differ(&mut one, 1.0 + HIDDEN * scatter(drone, 1));
                let share = Role::InflowShare.value(&one).unwrap();
                Role::InflowShare.set(&mut one, share * (1.0 + INFLOW * scatter(drone, 17)));
                one
            })
            .collect();
        let data = trial::data(DRONES, |drone, bin| {
            let ripple_us = 0.3 * f64::from((7 * bin.segment as i32 + 3 * drone as i32) % 5 - 2);
            let own_us = pulse_us(&flown[drone], bin.climb_mps());
            own_us - pulse_us(&trial::vehicle(), bin.climb_mps()) + ripple_us
        });
        let all = Comparison::new(&data, &known, &Simulated::Closed, None).unwrap();
        let mut found = Found::nothing(all.clone());
        found.refit(&all).unwrap();
        drones(&all, &found, &known, |_| false).unwrap().1
    }

    fn names(step: &Step) -> Vec<&str> {
        match &step.finding {
            Finding::Name { effect, .. } => vec![effect],
            Finding::Class { effects, .. } => effects.iter().map(String::as_str).collect(),
            Finding::Unknown { .. } => Vec::new(),
        }
    }

    #[test]
    fn a_spread_of_thrust_is_not_one_of_mass() {
        let thrust = told(|vehicle, times| vehicle.airframe.thrust_coefficient /= times).unwrap();
        let mass = told(|vehicle, times| vehicle.airframe.mass_kg *= times).unwrap();
        assert_eq!(names(&thrust), ["thrust-spread"]);
        assert!(names(&mass).contains(&"mass-spread"), "{:?}", mass.finding);
    }
}
