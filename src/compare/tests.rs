//! Statistics of the comparison on drawn laws, where the truth is known.

use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rand_pcg::Pcg64;
use serde_json::{Value, json};

use super::result::{Basis, Comparison, Quantity};
use super::{CompareError, FlightFacts, LawChoice, Side, compare};
use crate::analysis::result::Analysis;

/// Seeded pairs of flights of a study.
const PAIRS: u64 = 300;

/// How a fleet is drawn.
#[derive(Clone, Copy)]
struct Fleet {
    drones: usize,
    /// Error that all drones of a flight share, us.
    common_us: f64,
    /// Stated error of each drone's own, us.
    own_us: f64,
    /// What their true error is multiplied with.
    understated: f64,
    /// Change of the whole fleet, us.
    shift_us: f64,
    /// Changes of single drones, us.
    weak: &'static [(usize, f64)],
}

const FLEET: Fleet =
    Fleet { drones: 25, common_us: 10.0, own_us: 2.0, understated: 1.0, shift_us: 0.0, weak: &[] };

fn normal(rng: &mut Pcg64) -> f64 {
    StandardNormal.sample(rng)
}

fn estimate(value: f64, se: f64) -> Value {
    json!({ "value": value, "se": se })
}

fn line(u0: f64, slope: f64, errors: [f64; 2]) -> Value {
    let [of_u0, of_slope] = errors;
    let mut covariance = [[0.0; 4]; 4];
    covariance[0][0] = of_u0 * of_u0;
    covariance[1][1] = of_slope * of_slope;
    json!({
        "u0": estimate(u0, of_u0), "slope": estimate(slope, of_slope), "bend": estimate(0.0, 0.0),
        "drag": estimate(0.0, 0.0), "speeds_mps": [-3.5, 3.5], "covariance": covariance,
    })
}

fn analysis(flights: &[Value]) -> Analysis {
    serde_json::from_value(json!({
        "schema": "updraft.analysis/1", "made_by": "test", "title": "", "flights": flights, "warnings": [],
    }))
    .unwrap()
}

fn drone(slot: usize, line: &Value) -> Value {
    json!({
        "slot": slot, "name": format!("Drone {slot}"), "source": format!("logs/{slot}.BIN"), "home_m": null,
        "clock": { "method": "show_rows", "offset_s": 0.0, "residual_s": 0.0, "start": null }, "windows": [], "laws": null, "line": line,
        "trace": { "time_s": [], "height_m": [], "velocity_mps": [], "pulse_phi_us": [] }, "warnings": [],
    })
}

fn calibration(fleet: &Value, drones: &[Value]) -> Value {
    json!({
        "name": "calibration", "purpose": "calibration", "planned": true, "true_updraft_mps": null, "drones": drones,
        "missing": [], "flock": null, "table": [], "map": null,
        "headline": { "law": "linear", "reason": "drawn", "line": fleet },
    })
}

/// A calibration of a fleet: flown before (`false`) or after what happened to it.
fn drawn(of: Fleet, is_after: bool, rng: &mut Pcg64) -> Analysis {
    let (of_slope, common_of_slope) = (0.1 * of.own_us, 0.1 * of.common_us);
    let shared = [of.common_us * normal(rng), common_of_slope * normal(rng)];
    let total = |own: f64, common: f64| own.hypot(common);
    let drones: Vec<Value> = (1..=of.drones)
        .map(|slot| {
            // The same drones in every flight.
            let (offset, steeper) = ((slot * 7 % 13) as f64 - 6.0, (slot * 5 % 11) as f64 / 10.0);
            let weak = of.weak.iter().find(|(of, _)| *of == slot).map_or(0.0, |(_, us)| *us);
            let changed = if is_after { of.shift_us + weak } else { 0.0 };
            let own = of.understated * of.own_us * normal(rng);
            let u0 = 1540.0 + offset + changed + shared[0] + own;
            let slope = 26.0 + steeper + shared[1] + of.understated * of_slope * normal(rng);
            let errors = [total(of.own_us, of.common_us), total(of_slope, common_of_slope)];
            drone(slot, &line(u0, slope, errors))
        })
        .collect();
    let fleet = line(1540.0 + shared[0], 26.0 + shared[1], [of.common_us, common_of_slope]);
    analysis(&[calibration(&fleet, &drones)])
}

fn side(id: &str, analysis: Analysis) -> Side {
    Side { id: id.to_owned(), path: id.to_owned(), analysis, facts: Vec::new() }
}

fn of(sides: &[Side]) -> Comparison {
    compare(sides, LawChoice::Preferred, "test").unwrap()
}

fn pair(fleet: Fleet, seed: u64) -> Comparison {
    let mut rng = Pcg64::new(u128::from(seed), 0x0A02_BDBF_7BB3_C0A7_AC28_FA16_A64A_BF96);
    let (a, b) = (drawn(fleet, false, &mut rng), drawn(fleet, true, &mut rng));
    of(&[side("a", a), side("b", b)])
}

/// Slots of the drones that a comparison names.
fn named(found: &Comparison) -> Vec<usize> {
    let changed = found.laws[0].drones.iter().filter(|drone| drone.is_changed);
    changed.map(|drone| usize::from(drone.slot.unwrap())).collect()
}

/// Number of pairs in which a drone is named that did not change.
fn false_alarms(fleet: Fleet) -> usize {
    let is_false = |slot: &usize| fleet.weak.iter().all(|(weak, _)| weak != slot);
    (0..PAIRS).filter(|seed| named(&pair(fleet, *seed)).iter().any(&is_false)).count()
}

/// 300 pairs at a level of 5 %: `scipy.stats.binom.ppf(0.999, 300, 0.05)`.
const MOST_FALSE: usize = 28;

#[test]
fn with_nothing_changed_no_drone_is_named_beyond_the_level() {
    let few = Fleet { drones: 5, ..FLEET };
    for (fleet, what) in [(FLEET, "25 drones"), (few, "5 drones")] {
        let alarms = false_alarms(fleet);
        assert!(alarms <= MOST_FALSE, "{alarms} of {PAIRS} with {what}");
    }
}

/// Without the fleet's own scatter two thirds of the pairs would name a drone.
#[test]
fn errors_that_are_stated_too_small_do_not_name_drones() {
    let alarms = false_alarms(Fleet { understated: 2.0, ..FLEET });
    assert!(alarms <= MOST_FALSE, "{alarms} of {PAIRS}");
    let found = pair(Fleet { understated: 2.0, ..FLEET }, 3);
    let scatter = found.laws[0].fleet[0].scatter.unwrap();
    assert!((1.4..2.8).contains(&scatter), "{scatter}");
    assert_eq!(found.laws[0].basis, Basis::Stated);
    assert!(found.laws[0].drones[0].changes[0].dof.is_some());
}

/// Five and a half standard errors of a change are found in most pairs, whatever the whole fleet does, and no other drone with
/// them.
#[test]
fn a_weak_drone_is_found_and_the_others_are_not() {
    let weak = Fleet { weak: &[(7, 16.0)], shift_us: 40.0, ..FLEET };
    let found = (0..PAIRS).filter(|seed| named(&pair(weak, *seed)).contains(&7)).count();
    assert!(found as u64 * 100 > PAIRS * 80, "{found} of {PAIRS}");
    assert!(false_alarms(weak) <= MOST_FALSE);
    let several = Fleet { weak: &[(3, 30.0), (9, -30.0), (20, 30.0), (21, 30.0)], ..FLEET };
    let all = (0..40).filter(|seed| named(&pair(several, *seed)) == [3, 9, 20, 21]).count();
    assert!(all >= 34, "{all} of 40");
}

/// The common errors of both flights are in the fleet's change, each once: 95 % of its intervals hold the truth.
#[test]
fn intervals_of_the_fleets_change_hold_the_truth() {
    let fleet = Fleet { shift_us: 12.0, ..FLEET };
    let inside = (0..PAIRS).filter(|seed| {
        let change = pair(fleet, *seed).laws[0].fleet[0].change;
        (change.value - 12.0).abs() < 1.96 * change.se
    });
    let inside = inside.count();
    // scipy.stats.binom.ppf([0.001, 0.999], 300, 0.95)
    assert!((272..=295).contains(&inside), "{inside} of {PAIRS}");
    let change = pair(fleet, 1).laws[0].fleet[0].change;
    let median = 2.0 * 2.0 * 2.0 * std::f64::consts::FRAC_PI_2 / 25.0;
    let expected = (200.0 + median).sqrt();
    assert!((change.se / expected - 1.0).abs() < 0.1, "{} is not {expected}", change.se);
}

/// What all drones share cancels in what is said of one: the errors are those of two drones' own.
#[test]
fn common_errors_are_not_in_a_drones_change() {
    let found = pair(Fleet { common_us: 1000.0, ..FLEET }, 5);
    let change = &found.laws[0].drones[3].changes[0];
    assert_eq!(change.quantity, Quantity::Hover);
    let se = change.beyond_fleet.unwrap().se;
    let least = 2.0 * std::f64::consts::SQRT_2;
    assert!((least..1.9 * least).contains(&se), "{se}");
}

#[test]
fn three_campaigns_are_tested_together() {
    let all = |weak: &'static [(usize, f64)], seed: u64| {
        let mut rng = Pcg64::new(u128::from(seed), 0x0A02_BDBF_7BB3_C0A7_AC28_FA16_A64A_BF96);
        let mut fly = |is_after| drawn(Fleet { weak, ..FLEET }, is_after, &mut rng);
        let sides =
            [("a", false), ("b", false), ("c", true)].map(|(id, after)| side(id, fly(after)));
        of(&sides)
    };
    let differs = |found: &Comparison| -> Vec<String> {
        let rows = found.all_equal.iter().filter(|row| row.p_holm.is_some_and(|p| p < 0.05));
        rows.filter_map(|row| row.drone.clone()).collect()
    };
    let alarms = (0..PAIRS).filter(|seed| !differs(&all(&[], *seed)).is_empty()).count();
    assert!(alarms <= MOST_FALSE, "{alarms} of {PAIRS}");
    let fleet = (0..PAIRS).filter(|seed| all(&[], *seed).all_equal[0].p_value < 0.05).count();
    assert!((2..=MOST_FALSE).contains(&fleet), "{fleet} of {PAIRS}");
    let found = all(&[(7, 30.0)], 4);
    assert_eq!(found.laws.len(), 2, "each against the first");
    assert_eq!(differs(&found), ["slot 7"]);
    assert_eq!(found.all_equal[0].dof, 2);
}

#[test]
fn drones_are_known_by_their_airframes_where_both_flights_know_them() {
    let mut rng = Pcg64::new(9, 0x0A02_BDBF_7BB3_C0A7_AC28_FA16_A64A_BF96);
    let fleet = Fleet { drones: 8, common_us: 0.1, own_us: 0.01, ..FLEET };
    let (a, b) = (drawn(fleet, false, &mut rng), drawn(fleet, true, &mut rng));
    let facts = |shift: usize| {
        let airframes =
            (1..=8_u16).map(|slot| (slot, format!("{}", (usize::from(slot) + shift) % 8)));
        vec![FlightFacts { airframes: airframes.collect(), ..FlightFacts::default() }]
    };
    // The same drones stand one slot further: by their slots all would have changed.
    let turned = drawn_turned(&b);
    let sides = |facts_b| {
        let before = Side { facts: facts(0), ..side("a", a.clone()) };
        [before, Side { facts: facts_b, ..side("b", turned.clone()) }]
    };
    let by_airframe = of(&sides(facts(7)));
    assert_eq!(named(&by_airframe), [] as [usize; 0]);
    assert_eq!(by_airframe.laws[0].drones[0].other_slot, Some(2));
    let scatter = |found: &Comparison| found.laws[0].fleet[0].scatter.unwrap();
    assert!(scatter(&by_airframe) < 4.0, "{}", scatter(&by_airframe));
    let by_slot = of(&sides(Vec::new()));
    assert!(scatter(&by_slot) > 100.0, "{}", scatter(&by_slot));
}

/// Each drone flies the next slot.
fn drawn_turned(of: &Analysis) -> Analysis {
    let mut turned = of.clone();
    let drones = &mut turned.flights[0].drones;
    for drone in &mut *drones {
        drone.slot = drone.slot.map(|slot| slot % 8 + 1);
    }
    drones.sort_by_key(|drone| drone.slot);
    turned
}

#[test]
fn what_cannot_be_compared_is_told() {
    let mut rng = Pcg64::new(1, 0x0A02_BDBF_7BB3_C0A7_AC28_FA16_A64A_BF96);
    let fleet = Fleet { drones: 4, ..FLEET };
    let (a, b) = (drawn(fleet, false, &mut rng), drawn(fleet, true, &mut rng));
    let with = |sides: &[Side]| compare(sides, LawChoice::Preferred, "test").unwrap_err();
    let same = with(&[side("a", a.clone()), side("b", a.clone())]);
    assert!(matches!(same, CompareError::Same { .. }), "{same}");
    let mut hover = b.clone();
    hover.flights[0].purpose = crate::mission::plan::Purpose::Measurement;
    let nothing = with(&[side("a", a.clone()), side("b", hover)]);
    assert!(matches!(nothing, CompareError::NothingInCommon { .. }), "{nothing}");
    let mut quadratic = b.clone();
    quadratic.flights[0].headline = None;
    let none = with(&[side("a", a.clone()), side("b", quadratic)]);
    assert!(none.to_string().contains("b/calibration has none"), "{none}");
    let vehicle =
        |name: &str| vec![FlightFacts { vehicle: Some(name.to_owned()), ..FlightFacts::default() }];
    let sides = [
        Side { facts: vehicle("pixel"), ..side("a", a) },
        Side { facts: vehicle("phantom4"), ..side("b", b) },
    ];
    assert!(of(&sides).notes[0].contains("flew the vehicle pixel"));
}

#[test]
fn nonsense_in_a_file_is_no_panic() {
    let mut rng = Pcg64::new(2, 0x0A02_BDBF_7BB3_C0A7_AC28_FA16_A64A_BF96);
    let fleet = Fleet { drones: 6, ..FLEET };
    for _ in 0..200 {
        let mut sides = ["a", "b", "c"].map(|id| side(id, drawn(fleet, true, &mut rng)));
        for side in &mut sides {
            for drone in &mut side.analysis.flights[0].drones {
                let Some(line) = &mut drone.line else { continue };
                for value in [&mut line.u0.value, &mut line.u0.se, &mut line.speeds_mps[0]] {
                    match rng.random_range(0..12) {
                        0 => *value = 0.0,
                        1 => *value = f64::MAX,
                        2 => *value = -*value,
                        3 => *value = f64::NAN,
                        _ => {}
                    }
                }
                if rng.random_range(0..6) == 0 {
                    line.covariance = None;
                }
                if rng.random_range(0..6) == 0 {
                    drone.slot = Some(1);
                }
            }
        }
        let found = compare(&sides, LawChoice::Preferred, "test");
        let _ = found.map(|found| serde_json::to_string(&found).unwrap());
    }
}
