//! Flights with nothing to find, made by the noise that the search reckons with: least squares that takes
//! every bin for independent names something on most of them, the search on hardly any. And flights with
//! rotor inflow, whose scatter tells it from drag.

use nalgebra::DVector;
use rand_distr::{Distribution as _, StandardNormal};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::bins::{BinValues, of_segments};
use super::candidates::{Candidate, Felt, Updraft, library, of_the_air, set};
use super::compare::{Comparison, Simulated, thrust_exponent};
use super::data::{Data, PlannedPart};
use super::decide::CLASS_NATS;
use super::generic::{Generic, all};
use super::gls::{Column, Problem, Pulses, Split};
use super::noise::{GUSTS, GroupPattern, Hyper, SHARED, SHARED_TIME};
use super::refly::refly;
use super::search::{FLOOR_NATS, FREE_FLOOR_NATS, Ranked, Sought, round};
use crate::base::rng::{Purpose, stream};
use crate::mission::Plan;
use crate::mission::resolve::{Override, resolve};
use crate::vehicle::{Vehicle, library::builtin};

/// Flights with nothing to find: enough to see 97 % against some per cent.
const FLIGHTS: u64 = 20;
/// Chance of naming anything that the F test is held to, all effects together (docs/physics.md, 3.2).
const ALPHA: f64 = 0.01;
/// Mean wind, show frame, m/s.
const WIND_MPS: [f64; 2] = [3.0, 0.0];

/// The paper's ladder for nine drones.
fn plan() -> Plan {
    let grid = [Override::new("grid.rows", 3), Override::new("grid.columns", 3)];
    resolve("calibration", &grid).unwrap().flights.remove(0).plan
}

/// The plan as drones fly it that are all like the model.
fn comparison(plan: &Plan, vehicle: &Vehicle) -> Comparison {
    let bins = of_segments(&plan.groups[0].segments);
    let exponent = thrust_exponent(vehicle);
    let values: Vec<Option<BinValues>> =
        refly(vehicle, plan, &plan.slots[0], &bins, [WIND_MPS[0], WIND_MPS[1], 0.0], exponent)
            .unwrap();
    let slots = plan.slots.iter().collect();
    let part = PlannedPart { name: "all".to_owned(), slots, bins: &bins, values: &values };
    let data = Data::planned(plan, &[part], |_, _| f64::NAN);
    let side = data.groups[0].measured[0].iter().copied().map(Some).collect();
    Comparison::new(
        &data,
        vehicle,
        &Simulated::Given { values: vec![side], flew: vehicle, is_foreign: false },
        Some(plan),
    )
    .unwrap()
}

/// A field day (docs/physics.md, 4.1), as far as it is not the median of the priors.
fn field_day() -> Hyper {
    let mut hyper = Hyper::default();
    for (place, value) in [(SHARED, 0.42), (SHARED_TIME, 100.0), (GUSTS, 0.28)] {
        hyper.0[place] = f64::ln(value);
    }
    hyper
}

/// What the search names of a flight by its floors: an effect, or a free shape.
fn named(problem: &Problem<'_>, sought: Sought<'_>) -> Option<String> {
    let round = round(problem, Hyper::default(), sought, true);
    let library = round.library.iter().find(|ranked| {
        // As `decide` has it: what the air does needs more, and a drift is never named.
        let candidate = &sought.library[ranked.candidate];
        let floor = if candidate.size.is_some() { FLOOR_NATS } else { FREE_FLOOR_NATS };
        candidate.name != "updraft-drift" && ranked.gain > floor
    });
    let free = round.generics.first().filter(|free| free.gain > FREE_FLOOR_NATS);
    library.map(|one| format!("{} {:.1}", sought.library[one.candidate].name, one.gain)).or_else(
        || free.map(|one| format!("{} {:.1}", sought.generics[one.generic].depends_on, one.gain)),
    )
}

/// What an F test names that takes bins for independent: each drone with an offset of its own, one form
/// of one effect added, the level shared out between all forms.
fn named_by_f(pulses: &Pulses, candidates: &[Candidate]) -> Option<&'static str> {
    let offsets: usize = pulses.iter().map(Vec::len).sum();
    let rows: Vec<(usize, usize, usize)> = (pulses.iter().enumerate())
        .flat_map(|(group, drones)| {
            drones
                .iter()
                .enumerate()
                .flat_map(move |(drone, bins)| (0..bins.len()).map(move |bin| (group, drone, bin)))
        })
        .collect();
    let y = within(&rows, |group, drone, bin| pulses[group][drone][bin]);
    let freedom = (rows.len() - offsets - 1) as f64;
    let law = FisherSnedecor::new(1.0, freedom).unwrap();
    let forms: usize = candidates.iter().map(|candidate| candidate.variants.len()).sum();
    let passes = |column: &Column| {
        let x = within(&rows, |group, drone, bin| column.at(group, drone, bin));
        let beta = x.dot(&y) / x.norm_squared();
        let explained = beta * x.dot(&y);
        let f = explained / ((y.norm_squared() - explained) / freedom);
        beta > 0.0 && law.sf(f) < ALPHA / forms as f64
    };
    let finds = |candidate: &&Candidate| candidate.variants.iter().any(|form| passes(&form.column));
    candidates.iter().find(finds).map(|candidate| candidate.name)
}

/// Values less each drone's mean.
fn within(rows: &[(usize, usize, usize)], of: impl Fn(usize, usize, usize) -> f64) -> DVector<f64> {
    let mut values =
        DVector::from_iterator(rows.len(), rows.iter().map(|(g, d, b)| of(*g, *d, *b)));
    let mut start = 0;
    for same in rows.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let mut own = values.rows_mut(start, same.len());
        let mean = own.mean();
        own.add_scalar_mut(-mean);
        start += same.len();
    }
    values
}

#[test]
fn independent_errors_name_something_on_most_null_flights_and_the_search_on_hardly_any() {
    let (plan, vehicle) = (plan(), builtin("airsim-generic-quad").unwrap());
    let comparison = comparison(&plan, &vehicle);
    let patterns = comparison.patterns(&vehicle, 0.0).unwrap();
    let effects = library(&vehicle, &comparison, Updraft::Same).unwrap();
    let hyper = field_day();
    let mut candidates = effects.clone();
    candidates.extend(of_the_air(&comparison.scene, &patterns, &hyper));
    let generics: Vec<Generic> = all(&comparison.scene, &comparison.headings());
    let drones = comparison.data.counts();
    let sought = Sought { library: &candidates, generics: &generics, drones: &drones };
    let nothing = Split::of(&comparison.residual(&vehicle, 0.0).unwrap());
    let truth = Problem::new(&patterns, &nothing).at(&hyper);
    let (mut by_f, mut by_search) = (Vec::new(), Vec::new());
    for flight in 0..FLIGHTS {
        let mut rng = stream(1, flight, Purpose::Resampling);
        let pulses = truth.simulate(|| StandardNormal.sample(&mut rng));
        by_f.extend(named_by_f(&pulses, &effects));
        let split = Split::of(&pulses);
        by_search.extend(named(&Problem::new(&patterns, &split), sought));
    }
    assert!(by_f.len() * 2 > FLIGHTS as usize, "the F test named {by_f:?}");
    assert!(by_search.len() <= 1, "the search named {by_search:?}");
}

#[test]
fn what_leans_misread_in_climb_is_in_doubt_where_the_pulse_feels_the_wind() {
    let (plan, mut vehicle) = (plan(), builtin("airsim-generic-quad").unwrap());
    set(&mut vehicle, "translational-lift", "inflow_share", 0.2);
    let with = comparison(&plan, &vehicle);
    let doubts = with.wind_doubts(&vehicle).unwrap();
    // What goes with the climb is told from what goes with the wind: of another sign in descent.
    let bins = &with.data.groups[0].bins;
    let at = |doubt: &Column, up: bool| {
        let of = bins.iter().enumerate().filter(|(_, bin)| (bin.climb_mps() > 1.0) == up);
        let of = of.filter(|(_, bin)| bin.climb_mps().abs() > 1.0);
        of.map(|(bin, _)| doubt.at(0, 0, bin)).sum::<f64>()
    };
    assert!(doubts.iter().any(|doubt| at(doubt, true) * at(doubt, false) < 0.0));
}

/// Flights with inflow. Chosen for time.
const FEW: u64 = 8;

/// Gain of the rotors' inflow over the best other effect on each flight, nats.
fn inflow_ahead(candidates: &[Candidate], flights: &[(Vec<GroupPattern>, Split)]) -> Vec<f64> {
    let sought = Sought { library: candidates, generics: &[], drones: &[9] };
    let ahead = |(patterns, split): &(Vec<GroupPattern>, Split)| {
        let round = round(&Problem::new(patterns, split), field_day(), sought, true);
        let (inflow, others): (Vec<_>, Vec<_>) = round
            .library
            .iter()
            .partition(|ranked| candidates[ranked.candidate].name == "rotor-inflow");
        let best = |ranked: &[&Ranked]| ranked.iter().map(|one| one.gain).fold(0.0, f64::max);
        best(&inflow) - best(&others)
    };
    flights.iter().map(ahead).collect()
}

#[test]
fn scatter_between_drones_tells_inflow_from_drag() {
    let (plan, vehicle) = (plan(), builtin("airsim-generic-quad").unwrap());
    let comparison = comparison(&plan, &vehicle);
    let mut true_vehicle = vehicle.clone();
    set(&mut true_vehicle, "rotor-inflow", "inflow_share", 0.3);
    let added = comparison.change(&vehicle, &true_vehicle).unwrap();
    let patterns = comparison.patterns(&vehicle, 0.0).unwrap();
    let true_patterns = comparison.patterns(&true_vehicle, 0.0).unwrap();
    let nothing = Split::of(&comparison.residual(&vehicle, 0.0).unwrap());
    let truth = Problem::new(&true_patterns, &nothing).at(&field_day());
    let flights: Vec<(Vec<GroupPattern>, Split)> = (0..FEW)
        .map(|flight| {
            let mut rng = stream(2, flight, Purpose::Resampling);
            let mut pulses = truth.simulate(|| StandardNormal.sample(&mut rng));
            for drone in pulses.iter_mut().flatten() {
                drone.iter_mut().enumerate().for_each(|(bin, us)| *us += added.at(0, 0, bin));
            }
            (patterns.clone(), Split::of(&pulses))
        })
        .collect();
    let feeling = library(&vehicle, &comparison, Updraft::Same).unwrap();
    let mut numb = feeling.clone();
    numb.iter_mut().flat_map(|one| &mut one.variants).for_each(|form| form.felt = Felt::default());
    let is_sure = |ahead: &&f64| **ahead > CLASS_NATS;
    let (with, without) = (inflow_ahead(&feeling, &flights), inflow_ahead(&numb, &flights));
    let sure = |gains: &[f64]| gains.iter().filter(is_sure).count();
    assert!(sure(&with) >= 6, "{with:?}");
    assert!(sure(&without) <= 3, "{without:?}");
}
