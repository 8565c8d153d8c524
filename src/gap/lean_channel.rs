//! The lean as a channel of its own: the lean of a drone at known speeds over ground tells the drag of its
//! rotors and its body, whatever the pulse tells.

use super::compare::Comparison;
use super::decide::CLASS_NATS;
use super::lean::Measured;
use super::lean_fit::Body;
use super::lean_law::LeanLaw;
use super::verdict::{Finding, Fitted, Interval, Step, WindFound};
use crate::base::air::SEA_LEVEL_DENSITY;
use crate::effects::Role;
use crate::numeric::extent;
use crate::vehicle::Vehicle;

/// Half of a 95 % interval in standard errors, rounded up from 1.96.
const HALF: f64 = 2.0;
/// A lean that differs from the model's by less is not named, rad/(m/s): 0.17 degrees per m/s, a tenth of
/// what small rotors have (docs/physics.md, 2.6). Chosen.
const MATERIAL: f64 = 0.003;
/// Standard deviation by which the law of a file that describes its vehicle well may differ from how that leans, rad/(m/s):
/// the form of the drag is another, and the leans of climbs differ from those of hovers. Chosen, a third of [`MATERIAL`]:
/// blades with nothing hidden had differed by 0.004.
const FORM: f64 = 0.001;
/// Standard errors from which a difference is named: those of [`super::detectable`], at which an effect is
/// found nearly always. Chosen.
const NAMED_Z: f64 = 5.0;

/// Standard errors from which a difference is looked into, if it is not named. Chosen: chance does as much once in 700 flights.
const HINT_Z: f64 = 3.0;

/// Air speed of a leg, m/s: those of the templates.
const LEG_MPS: f64 = 3.0;
/// Fastest air of a leg that tells a body, m/s: against a wind that is as fast.
const FASTEST_LEG_MPS: f64 = 2.0 * LEG_MPS;
/// Strongest updraft that a flight may be in as a whole, m/s: thermals that a fleet can fly a calibration in.
const MOST_UPDRAFT_MPS: f64 = 2.0;

/// Standard error of a measured law's linear part, with what its form may make of it, rad/(m/s).
fn standard_error(measured: Measured) -> f64 {
    measured.linear_se.hypot(FORM)
}

/// Wind and lean of a comparison with the model that was planned with.
pub(super) fn found(before: &Comparison) -> WindFound {
    let model = LeanLaw::of(&before.vehicle, SEA_LEVEL_DENSITY, 0.0);
    // Legs that do not bound the lean have not told it.
    let measured = before.wind.measured.filter(|measured| measured.linear_se.is_finite());
    WindFound {
        mean_mps: before.wind.mean_mps,
        lean_per_mps: measured.map(|measured| Interval {
            value: measured.law.linear,
            low: measured.law.linear - HALF * measured.linear_se,
            high: measured.law.linear + HALF * measured.linear_se,
        }),
        model_lean_per_mps: model.linear,
    }
}

/// The least and the most that a measured linear part is in the updrafts that a flight may be in, rad/(m/s): rotors that
/// carry less in air that sinks lean more in the same wind, and no lean tells that updraft.
fn in_updrafts(measured: LeanLaw) -> (f64, f64) {
    let lean_rad = |updraft_mps: f64| {
        LeanLaw { updraft_mps, ..measured }.lean([LEG_MPS, 0.0], 0.0)[0].max(f64::MIN_POSITIVE)
    };
    let here_rad = lean_rad(measured.updraft_mps);
    let told = |updraft_mps: f64| measured.linear * here_rad / lean_rad(updraft_mps);
    let all = [told(measured.updraft_mps), told(-MOST_UPDRAFT_MPS), told(MOST_UPDRAFT_MPS)];
    extent(all).unwrap_or_default()
}

/// What a measured linear part differs by from the model's in whichever updraft brings the two nearest, rad/(m/s).
fn apart(measured: LeanLaw, model: f64) -> f64 {
    let (least, most) = in_updrafts(measured);
    (least - model).max(0.0) + (most - model).min(0.0)
}

/// An interval of a size that the leans told, widened by what the updraft of the flight and the form of its drag may make of it.
fn widened(of: Interval, measured: LeanLaw) -> Interval {
    let (least, most) = in_updrafts(measured);
    let with_form = |half: f64, by_updraft: f64| half.hypot(HALF * FORM).hypot(by_updraft);
    let low = of.value - with_form(of.value - of.low, measured.linear - least);
    Interval { low, high: of.value + with_form(of.high - of.value, most - measured.linear), ..of }
}

/// Effects that lean a drone alike at every speed over ground: rotors that flap, and air that gives up its momentum
/// to them. No lean tells them apart; the first is what the model gets.
pub(super) fn alike() -> Vec<String> {
    let both = [Role::RotorDrag, Role::MomentumDrag];
    both.iter().filter_map(|role| Some(role.place()?.name().to_owned())).collect()
}

/// Whether legs tell more drag than a model has, if not so much that it is named: then a drag of the rotors may stand behind
/// what the pulse tells.
pub(super) fn may_lack_drag(comparison: &Comparison, model: &Vehicle) -> bool {
    let model = LeanLaw::of(model, SEA_LEVEL_DENSITY, 0.0).linear;
    let more = |measured: Measured| measured.law.linear - model > HINT_Z * standard_error(measured);
    comparison.wind.measured.is_some_and(more)
}

/// Drag that the model lacks, or has with another size: a class, because leans do not tell its kind.
pub(super) fn step(before: &Comparison, wind: &WindFound, alpha: f64) -> Option<Step> {
    let measured = before.wind.measured?;
    // Whose drag it is the speeds tell: that of rotors is linear, that of a body goes with the square.
    let body = before.body_told();
    let nats = body.map_or(f64::NEG_INFINITY, |(body, _)| body.better_nats);
    let apart = apart(measured.law, wind.model_lean_per_mps);
    let of_rotors = apart.abs() / standard_error(measured);
    let (z, effects, parameters) = if apart.abs() >= MATERIAL && of_rotors >= NAMED_Z {
        let parameters = match body {
            Some(told) if nats > CLASS_NATS => of_body(told, &before.vehicle)?,
            _ => {
                let place = Role::RotorDrag.place()?;
                let Interval { value, low, high } = widened(wind.lean_per_mps?, measured.law);
                let beside = beside_rotor_drag(&before.vehicle, wind.model_lean_per_mps);
                // Who leans less than its frame does by itself lacks no drag, and there is none below nothing.
                if value < beside {
                    return None;
                }
                vec![Fitted {
                    name: place.parameter.name.to_owned(),
                    unit: place.parameter.unit.to_owned(),
                    value: Interval {
                        value: value - beside,
                        low: low - beside,
                        high: high - beside,
                    },
                    before: Role::RotorDrag.value(&before.vehicle),
                }]
            }
        };
        (of_rotors, names(nats), parameters)
    } else {
        // Rotors may not explain what a body does.
        let told = body.filter(|(body, _)| is_told(body))?;
        (told.0.square / told.0.square_se, bodies(), of_body(told, &before.vehicle)?)
    };
    z.is_finite().then(|| Step {
        finding: Finding::Class { effects, parameters },
        gain_nats: 0.5 * z * z,
        threshold_nats: 0.5 * NAMED_Z * NAMED_Z,
        alpha,
        size_us: 0.0,
        rivals: Vec::new(),
        shape: None,
        in_field: None,
        form: None,
    })
}

/// The finding without a size: what the leans look like, which the model does not get.
pub(super) fn not_taken_in(step: &Step) -> Step {
    let effects = step.finding.effects().into_iter().map(str::to_owned).collect();
    Step { finding: Finding::Class { effects, parameters: Vec::new() }, ..step.clone() }
}

/// What a vehicle leans by besides the drag of its rotors, rad/(m/s): the frame of ArduPilot's simulator has a drag of its own, and so
/// has the momentum of the air that goes through rotors. A drag of the rotors that the leans tell comes on top of it.
fn beside_rotor_drag(vehicle: &Vehicle, model_lean_per_mps: f64) -> f64 {
    if vehicle.airframe.sitl.is_some() || Role::MomentumDrag.is_on(vehicle) {
        model_lean_per_mps - Role::RotorDrag.value(vehicle).unwrap_or(0.0)
    } else {
        0.0
    }
}

/// Whether a body is told by itself: no drag of the rotors explains as much, by twice the margin of a class.
fn is_told(body: &Body) -> bool {
    body.better_nats > 2.0 * CLASS_NATS
        && body.square * LEG_MPS > MATERIAL
        && body.square > NAMED_Z * body.square_se
}

/// Names of a drag that leans tell, by how much better a body explains them than rotors do, nats.
fn names(better_nats: f64) -> Vec<String> {
    if better_nats > CLASS_NATS {
        return bodies();
    }
    let mut effects = alike();
    if better_nats > -CLASS_NATS {
        effects.extend(bodies());
    }
    effects
}

/// Effects that lean a drone with the square of the air speed: a body besides that of the model, and another drag of its own
/// faces. The first is what the model gets.
fn bodies() -> Vec<String> {
    let both = [Role::BodyDragSide, Role::FaceDragSide];
    both.iter().filter_map(|role| Some(role.place()?.name().to_owned())).collect()
}

/// The drag areas, m², of a body that leans the vehicle by so much more than its own does, where each of its sides leans it by so
/// much, rad/(m/s)²: a round one, or the vehicle's own, as much larger from above as from the side.
fn of_body((body, per_m2): (Body, f64), vehicle: &Vehicle) -> Option<Vec<Fitted>> {
    let half = HALF * body.square_se.hypot(FORM / FASTEST_LEG_MPS);
    (per_m2 > 0.0 && half.is_finite()).then_some(())?;
    let sides_m2 = Role::BodyDragSide.value(vehicle).filter(|area| *area > 0.0);
    let one = |role: Role| {
        let parameter = role.place()?.parameter;
        let before = role.value(vehicle);
        let area = |square: f64| {
            let more_m2 = square / per_m2;
            let area_m2 = match (before, sides_m2) {
                (Some(own_m2), Some(sides_m2)) => own_m2 * (1.0 + more_m2 / sides_m2),
                _ => more_m2,
            };
            area_m2.clamp(0.0, parameter.high)
        };
        Some(Fitted {
            name: parameter.name.to_owned(),
            unit: parameter.unit.to_owned(),
            value: Interval {
                value: area(body.square),
                low: area(body.square - half),
                high: area(body.square + half),
            },
            before,
        })
    };
    [Role::BodyDragTop, Role::BodyDragSide].into_iter().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::super::lean::Measured;
    use super::super::trial;
    use super::*;

    #[test]
    fn speeds_tell_a_body_from_rotors() {
        assert_eq!(names(6.1), ["parasitic-drag", "face-drag"]);
        let all = ["blade-flapping", "momentum-drag", "parasitic-drag", "face-drag"];
        assert_eq!([names(5.9), names(-5.9)], [all, all]);
        assert_eq!(names(-6.1), all[..2]);
        assert_eq!(names(f64::NEG_INFINITY), all[..2], "no legs");
    }

    #[test]
    fn what_the_model_does_not_get_has_no_size() {
        let mut told = trial::step(trial::name("blade-flapping"), 26.0, &[]);
        let size = Fitted {
            name: "drag_per_weight".to_owned(),
            unit: "s/m".to_owned(),
            value: Interval { value: 0.027, low: 0.021, high: 0.033 },
            before: None,
        };
        told.finding = Finding::Class { effects: alike(), parameters: vec![size] };
        let left = not_taken_in(&told);
        assert_eq!(left.finding, Finding::Class { effects: alike(), parameters: Vec::new() });
        assert_eq!(left.gain_nats, 26.0);
    }

    #[test]
    fn areas_of_a_round_body_are_alike_and_never_negative() {
        let body = Body { square: 0.002, square_se: 0.0012, better_nats: 9.0 };
        let mut vehicle = trial::vehicle();
        vehicle.effects.clear();
        let found = of_body((body, 0.05), &vehicle).unwrap();
        assert_eq!(found[0].value, found[1].value);
        let Interval { value, low, high } = found[0].value;
        let half = 2.0 * 0.0012_f64.hypot(FORM / FASTEST_LEG_MPS) / 0.05;
        assert!((value - 0.04).abs() < 1e-12 && low == 0.0 && (high - 0.04 - half).abs() < 1e-12);
        assert!(of_body((Body { square_se: f64::INFINITY, ..body }, 0.05), &vehicle).is_none());
        // One that the model has is as much larger from above.
        Role::BodyDragTop.set(&mut vehicle, 0.03);
        Role::BodyDragSide.set(&mut vehicle, 0.02);
        let found = of_body((body, 0.05), &vehicle).unwrap();
        let areas = [found[0].value.value, found[1].value.value];
        assert!((areas[0] - 0.09).abs() < 1e-12 && (areas[1] - 0.06).abs() < 1e-12, "{areas:?}");
        assert_eq!((found[0].before, found[1].before), (Some(0.03), Some(0.02)));
    }

    #[test]
    fn a_body_is_told_by_itself_where_it_is_plain() {
        let body = |square: f64, square_se: f64, better_nats: f64| {
            is_told(&Body { square, square_se, better_nats })
        };
        assert!(body(0.002, 0.0003, 12.1));
        assert!(!body(0.002, 0.0003, 11.9), "rotors explain nearly as much");
        assert!(!body(0.002, 0.0005, 20.0), "four standard errors");
        assert!(!body(0.0009, 0.0001, 20.0), "nobody would notice");
    }

    #[test]
    fn leans_do_not_tell_which_drag_it_is() {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let model = LeanLaw::of(&comparison.vehicle, SEA_LEVEL_DENSITY, 0.0);
        let mut told = |more: f64, linear_se: f64| {
            let law = LeanLaw { linear: model.linear + more, ..model };
            comparison.wind.measured = Some(Measured { law, linear_se, misfit_nats: 0.0 });
            let step = step(&comparison, &found(&comparison), 0.005)?;
            Some(step.finding.effects().join(" "))
        };
        assert_eq!(told(0.02, 1e-3).as_deref(), Some("blade-flapping momentum-drag"));
        assert_eq!(told(0.02, 1e-2), None, "it may be none");
        assert_eq!(told(0.0049, 1e-4), None, "the form of the drag may be another");
        assert!(told(0.0052, 1e-4).is_some());
        assert_eq!(told(0.02, 5e-3), None, "four standard errors are too few");
        assert_eq!(told(0.002, 1e-4), None, "nobody would notice");
        assert_eq!(told(0.02, f64::INFINITY), None);
        assert_eq!(found(&comparison).lean_per_mps, None, "no interval has no end");
    }

    #[test]
    fn an_interval_has_what_another_updraft_would_make_of_the_size() {
        let of = Interval { value: 0.05, low: 0.047, high: 0.053 };
        let round = |mps: f64| (1e4 * mps).round() / 1e4;
        let ends = |vehicle: &str| {
            let vehicle = crate::vehicle::library::builtin(vehicle).unwrap();
            let law = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
            let found = widened(of, LeanLaw { linear: 0.05, ..law });
            (round(found.low), round(found.value), round(found.high))
        };
        let alike = (0.0464, 0.05, 0.0536);
        assert_eq!(ends("airsim-generic-quad"), alike, "who leans alike in all of them");
        // In air that sinks by 2 m/s the rotors carry more, and in air that rises less.
        assert_eq!(ends("arducopter-sitl"), (0.0431, 0.05, 0.0565));
    }

    #[test]
    fn a_drag_that_is_not_named_may_stand_behind_another_finding() {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let vehicle = trial::vehicle();
        let model = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
        assert!(!may_lack_drag(&comparison, &vehicle), "no leg was flown");
        let mut told = |more: f64, linear_se: f64| {
            let law = LeanLaw { linear: model.linear + more, ..model };
            comparison.wind.measured = Some(Measured { law, linear_se, misfit_nats: 0.0 });
            may_lack_drag(&comparison, &vehicle)
        };
        assert!(told(0.021, 0.005));
        assert!(!told(0.021, 0.008), "chance does as much");
        assert!(!told(0.0025, 1e-4), "no file knows its vehicle so well");
        assert!(!told(-0.021, 0.005), "who leans less lacks no drag");
        let mut with_drag = vehicle.clone();
        Role::RotorDrag.set(&mut with_drag, model.linear + 0.021);
        comparison.wind.measured = Some(Measured {
            law: LeanLaw { linear: model.linear + 0.021, ..model },
            linear_se: 0.005,
            misfit_nats: 0.0,
        });
        assert!(!may_lack_drag(&comparison, &with_drag), "the model has it already");
    }

    #[test]
    fn a_drag_that_leans_tell_comes_on_top_of_the_frame_s_own() {
        let mut comparison = trial::comparison(&trial::data(2, |_, _| 0.0));
        let mut told = |vehicle: Vehicle, more: f64| {
            let model = LeanLaw::of(&vehicle, SEA_LEVEL_DENSITY, 0.0);
            comparison.vehicle = vehicle;
            let law = LeanLaw { linear: model.linear + more, ..model };
            comparison.wind.measured = Some(Measured { law, linear_se: 1e-3, misfit_nats: 0.0 });
            Some((step(&comparison, &found(&comparison), 0.005)?, model.linear))
        };
        let sitl = || crate::vehicle::library::builtin("arducopter-sitl").unwrap();
        assert!(told(sitl(), -0.015).is_none(), "there is no drag below nothing");
        let mut named = |vehicle: Vehicle| {
            let (step, own) = told(vehicle, 0.03).unwrap();
            let Finding::Class { parameters, .. } = step.finding else { panic!() };
            (parameters[0].value.value, own)
        };
        let (size, own) = named(sitl());
        assert!(own > 0.02, "the frame leans in wind by itself: {own}");
        assert!((size - 0.03).abs() < 0.003, "{size}");
        let mut with_momentum = trial::vehicle();
        Role::MomentumDrag.set(&mut with_momentum, 0.2);
        let (size, own) = named(with_momentum);
        assert!(own > 0.02, "{own}");
        assert!((size - 0.03).abs() < 1e-9, "{size}");
        // Rotors that have a drag in the file have all of it named.
        let mut with_drag = trial::vehicle();
        Role::RotorDrag.set(&mut with_drag, 0.02);
        assert!((named(with_drag).0 - 0.05).abs() < 1e-9);
    }
}
