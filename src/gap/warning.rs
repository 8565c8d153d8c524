//! Warnings to the reader of a verdict, and their sentences.

use std::fmt;

use super::bins::of_segments;
use super::data::{Data, Flown};
use super::explain::Found;
use super::make::Input;
use super::verdict::{Gap, Step, is_strong_wind};
use super::words::short;
use crate::base::said::said_in_files;
use crate::effects::Role;
use crate::effects::select::value_of;
use crate::mission::plan::{Group, Plan};
use crate::numeric::upper_median;

/// Fewer drones than this are all fitted, and none is held out.
const FEWEST_TO_HOLD: usize = 8;
/// Share of the plan's bins below which it is said how few are compared. Chosen: a flight in air that the drones can fly keeps more.
const FEW_BINS: f64 = 0.75;
/// Wind that is read from leans alone is doubted aloud from this speed, m/s. Chosen: rotors' drag that was hidden in 1.5 m/s made 8 of
/// it.
const WINDY_MPS: f64 = 3.0;
/// Shares of the square in a thrust curve that differ by less are the same. Chosen: motors of one kind differ by as much.
const SAME_EXPO: f64 = 0.05;

/// Warning to the reader of a verdict. In `verdict.json` it stands as its sentence.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Warning {
    /// A single drone was compared.
    OneDrone,
    /// The drones were too few to hold any out from fitting.
    NoneHeldOut {
        /// Number of drones compared.
        drones: usize,
    },
    /// No more than half of the plan's drones gave a usable log.
    FewDrones {
        /// Number of drones compared.
        drones: usize,
        /// Number of drones in the plan.
        planned: usize,
    },
    /// Much of the plan's steady flight could not be compared.
    FewBins {
        /// Number of bins that are compared.
        bins: usize,
        /// Number of bins of the plan, in the groups that are compared.
        planned: usize,
    },
    /// A parameter was fitted to a bound of its range.
    AtBound {
        /// Name of the effect.
        effect: String,
        /// Name of the parameter.
        parameter: String,
    },
    /// The measured logs are of several flights.
    Flights {
        /// Number of flights that they are of.
        flights: usize,
    },
    /// By the logs' parameters, autopilots count with motors of other thrust curves.
    ThrustCurves {
        /// `MOT_THST_EXPO` of the simulated logs.
        simulated: f64,
        /// `MOT_THST_EXPO` of the measured logs.
        measured: f64,
    },
    /// The measured drones leaned differently from those of another program's simulation.
    OtherWind {
        /// Difference of the leans, degrees.
        lean_deg: f64,
    },
    /// Held-out rungs keep more than noise and air would leave.
    LeftOver {
        /// Root mean square that is left on those rungs, us.
        left_us: f64,
        /// Root mean square that noise and air alone would leave there, us.
        floor_us: f64,
        /// Reduced chi-square of what is left.
        reduced_chi2: f64,
        /// Whether it may be the wind's own.
        in_strong_wind: bool,
    },
    /// Held-out drones keep more than noise and air would leave, held-out rungs do not.
    DronesDiffer {
        /// Root mean square that is left on those drones, us.
        left_us: f64,
        /// Root mean square that noise and air alone would leave there, us.
        floor_us: f64,
    },
    /// Tables were compared, which have no plan.
    Tables,
    /// All drones climb at the same time.
    OneGroup,
    /// The wind is known from nothing but how the drones leaned.
    WindByLean {
        /// Speed of the mean wind, m/s.
        wind_mps: f64,
        /// Whether the plan has horizontal legs, which the drones did not fly.
        has_lost_legs: bool,
    },
    /// None of the drones of a group gave a usable log.
    GroupLost {
        /// Name of the group in the plan.
        group: String,
        /// Number of its drones in the plan.
        planned: usize,
        /// Number of groups that are compared.
        left: usize,
    },
    /// The logs have no battery voltage at rest.
    NoRestingVoltage,
    /// The model that stands for another program's simulation has another drag of its body than its file.
    StandIn {
        /// Name of the effect.
        effect: String,
        /// Name of the parameter.
        parameter: String,
        /// Value by the simulated logs.
        value: f64,
    },
    /// No plan says which vehicle flew.
    VehicleGuessed {
        /// Name of the vehicle that was assumed.
        vehicle: String,
    },
    /// A warning as it was read from a file.
    Said(String),
}

impl Warning {
    /// Warnings that are recognised by their sentence when a verdict is read: what is proposed next
    /// depends on them ([`Verdict::has_resting_voltage`](super::verdict::Verdict::has_resting_voltage)).
    const RECOGNISED: [Self; 1] = [Self::NoRestingVoltage];

    fn from_text(text: String) -> Self {
        let known = Self::RECOGNISED.into_iter().find(|known| known.to_string() == text);
        known.unwrap_or(Self::Said(text))
    }
}

said_in_files!(Warning, Warning::from_text);

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OneDrone => f.write_str(
                "one drone: its own offset and the air at its place cannot be told from the model's \
                 errors; nothing is held out but rungs",
            ),
            Self::NoneHeldOut { drones } => {
                write!(f, "{drones} drones: none is held out from fitting")
            }
            Self::FewDrones { drones, planned } => write!(
                f,
                "only {drones} of {planned} drones gave a usable log: intervals are wide, and groups \
                 may be uneven"
            ),
            Self::FewBins { bins, planned } => write!(
                f,
                "only {bins} of the {planned} stretches of steady flight in the plan are compared: in the others too \
                 few drones followed the plan with motors and lean below their limits and with a whole log, and what \
                 only those show was not looked for"
            ),
            Self::AtBound { effect, parameter } => write!(
                f,
                "{effect}.{parameter} is at its bound: the effect as it is named does not fit, and the \
                 model with it may be worse elsewhere"
            ),
            Self::OtherWind { lean_deg } => write!(
                f,
                "the drones lean by {lean_deg:.1} degrees more or less than the simulated ones in hover \
                 and vertical flight: the two sides flew in different wind, and nothing is named that this \
                 explains"
            ),
            Self::Flights { flights } => write!(
                f,
                "the measured logs are of {flights} flights: each has its own air and wind, and what is named \
                 holds in all of them"
            ),
            Self::ThrustCurves { simulated, measured } => write!(
                f,
                "{}: the logs' own parameters say that the motors differ (MOT_THST_EXPO is {} in the \
                 simulated logs and {} in the measured ones); in steady climbs that looks like more or less drag, \
                 and what this flight shows of it may be in the sizes of other effects",
                thrust_curve(),
                short(*simulated),
                short(*measured)
            ),
            Self::LeftOver { left_us, floor_us, reduced_chi2, in_strong_wind } => {
                write!(
                    f,
                    "on rungs that were held out {left_us:.1} us are left where noise and air alone would \
                     leave {floor_us:.1} (reduced chi-square {reduced_chi2:.1}): "
                )?;
                f.write_str(if *in_strong_wind {
                    "in so strong a wind that may be how the drones lean, an updraft, or something that \
                     this comparison cannot name"
                } else {
                    "something is missing that this comparison cannot name, and names and sizes may stand \
                     for it"
                })
            }
            Self::DronesDiffer { left_us, floor_us } => write!(
                f,
                "on drones that were held out {left_us:.1} us are left where noise and air alone would leave \
                 {floor_us:.1}, and on rungs that were held out no more than that: single drones answer the \
                 climb differently, which one model of all cannot have"
            ),
            Self::Tables => f.write_str(
                "tables have no plan that could be flown again: the model's side is its closed forms at \
                 the climb that was flown",
            ),
            Self::OneGroup => f.write_str(
                "all drones climb at the same time: what depends on climb speed is mixed with the \
                 shared air (calibration-counterphase tells them apart)",
            ),
            Self::WindByLean { wind_mps, has_lost_legs } => {
                write!(
                    f,
                    "no horizontal leg tells the wind: {wind_mps:.1} m/s are read from how the drones lean, by the \
                     model's own drag, and drag of the body or the rotors that the model lacks would look like that "
                )?;
                f.write_str(if *has_lost_legs {
                    "(the plan has legs, but the drones could not fly them in this air: fly in less wind)"
                } else {
                    "(calibration-counterphase has legs)"
                })
            }
            Self::GroupLost { group, planned, left } => {
                write!(
                    f,
                    "none of the {planned} drones of group {group} gave a usable log: "
                )?;
                f.write_str(if *left == 1 {
                    "the others climb at the same time, and what depends on climb speed is mixed with the \
                     shared air"
                } else {
                    "what the groups tell apart, the others tell less surely"
                })
            }
            Self::NoRestingVoltage => f.write_str(
                "the logs have no voltage at rest (BAT.VoltR): battery sag is looked for by time alone",
            ),
            Self::StandIn { effect, parameter, value } => write!(
                f,
                "the simulated logs answer climbs as the model does with {effect}.{parameter} {}, so the model \
                 has that to begin with; it is read from these logs, and in no file",
                short(*value)
            ),
            Self::VehicleGuessed { vehicle } => write!(
                f,
                "no plan says which vehicle flew: {vehicle} is taken, and its balance in steady flight \
                 says what effects do (--vehicle, --plan)"
            ),
            Self::Said(text) => f.write_str(text),
        }
    }
}

/// Warnings about a comparison that ended with this gap.
pub(super) fn warnings(data: &Data, found: &Found, gap: &Gap, input: &Input<'_>) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(rungs) = gap.left_over() {
        warnings.push(Warning::LeftOver {
            left_us: rungs.after_without_air_us,
            floor_us: rungs.floor_us,
            reduced_chi2: rungs.chi2.1,
            in_strong_wind: is_strong_wind(found.comparison.wind.mean_mps),
        });
    }
    if let Some(drones) = gap.drones_differ() {
        let (left_us, floor_us) = (drones.after_without_air_us, drones.floor_us);
        warnings.push(Warning::DronesDiffer { left_us, floor_us });
    }
    let drones = data.drones();
    if drones == 1 {
        warnings.push(Warning::OneDrone);
    } else if drones < FEWEST_TO_HOLD {
        warnings.push(Warning::NoneHeldOut { drones });
    }
    if let Some(plan) = input.plan
        && drones * 2 <= plan.slots.len()
    {
        warnings.push(Warning::FewDrones { drones, planned: plan.slots.len() });
    }
    warnings.extend(input.plan.and_then(|plan| few_bins(plan, &found.comparison.data)));
    for parameter in &found.parameters {
        let value = value_of(&found.vehicle, parameter.effect, parameter.name);
        let (low, high) = parameter.bounds;
        if value.is_some_and(|value| value <= low || value >= high) {
            warnings.push(Warning::AtBound {
                effect: parameter.effect.to_owned(),
                parameter: parameter.name.to_owned(),
            });
        }
    }
    let flights = data.flights().len();
    if flights > 1 {
        warnings.push(Warning::Flights { flights });
    }
    if let Some((simulated, measured)) = thrust_curves(input) {
        warnings.push(Warning::ThrustCurves { simulated, measured });
    }
    if input.simulated.is_some() && found.comparison.is_in_other_wind() {
        let lean_deg = found.comparison.apart_rad().to_degrees();
        warnings.push(Warning::OtherWind { lean_deg });
    }
    if input.table.is_some() {
        warnings.push(Warning::Tables);
    }
    if let Some(plan) = input.plan {
        let lost = groups_lost(plan, data);
        if lost.is_empty() && data.groups.len() == 1 && input.simulated.is_none() {
            warnings.push(Warning::OneGroup);
        }
        warnings.extend(lost);
        let wind = &found.comparison.wind;
        let wind_mps = wind.mean_mps[0].hypot(wind.mean_mps[1]);
        let is_by_lean = wind.measured.is_none() && wind.mean_se_mps > 0.0;
        if is_by_lean && input.simulated.is_none() && is_doubted(wind_mps, &found.steps) {
            let has_lost_legs = !data.has_legs() && has_legs(plan);
            warnings.push(Warning::WindByLean { wind_mps, has_lost_legs });
        }
    }
    if found.comparison.scene.volts.is_none() {
        warnings.push(Warning::NoRestingVoltage);
    }
    warnings
}

/// Whether a wind that leans alone tell is doubted aloud: it is strong, or drag was found, by which a strong wind is read as hardly any.
fn is_doubted(wind_mps: f64, steps: &[Step]) -> bool {
    wind_mps >= WINDY_MPS || steps.iter().any(is_drag)
}

/// Whether a finding leans drones by what it does: drag of the rotors or the body, or air that gives up its momentum.
fn is_drag(step: &Step) -> bool {
    const DRAGS: [Role; 3] = [Role::RotorDrag, Role::MomentumDrag, Role::BodyDragSide];
    step.finding.effects().iter().any(|effect| DRAGS.iter().any(|drag| drag.is_of(effect)))
}

/// Whether so little of a plan's steady flight is compared that it must be said.
fn few_bins(plan: &Plan, data: &Data) -> Option<Warning> {
    let bins: usize = data.bins_of_groups().iter().sum();
    let is_compared = |group: &&Group| data.groups.iter().any(|one| one.name == group.name);
    let groups = plan.groups.iter().filter(is_compared);
    let planned = groups.map(|group| of_segments(&group.segments).len()).sum();
    (bins as f64 <= FEW_BINS * planned as f64).then_some(Warning::FewBins { bins, planned })
}

/// Whether anything is to be flown over ground.
fn has_legs(plan: &Plan) -> bool {
    let bins = plan.groups.iter().flat_map(|group| of_segments(&group.segments));
    bins.into_iter().any(|bin| bin.is_horizontal())
}

/// Name of the effect that a thrust curve is.
pub(super) fn thrust_curve() -> &'static str {
    Role::ThrustExpo.place().map_or("", |place| place.name())
}

/// `MOT_THST_EXPO` of the simulated and of the measured logs, where they differ.
fn thrust_curves(input: &Input<'_>) -> Option<(f64, f64)> {
    let usual = |flown: &[Flown<'_>]| {
        upper_median(flown.iter().filter_map(|one| one.flight.thrust_expo).collect())
    };
    let (simulated, measured) = (usual(input.simulated?)?, usual(input.flown)?);
    ((simulated - measured).abs() > SAME_EXPO).then_some((simulated, measured))
}

/// Groups of a plan of which no drone is compared.
fn groups_lost(plan: &Plan, data: &Data) -> Vec<Warning> {
    let is_lost = |group: &&Group| data.groups.iter().all(|one| one.name != group.name);
    let lost = plan.groups.iter().enumerate().filter(|(_, group)| is_lost(group));
    lost.filter_map(|(index, group)| {
        let planned = plan.slots.iter().filter(|slot| usize::from(slot.group) == index).count();
        let group = group.name.clone();
        (planned > 0).then_some(Warning::GroupLost { group, planned, left: data.groups.len() })
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gap::trial;
    use crate::gap::verdict::{Finding, Shrink, Verdict, WindFound};
    use crate::mission::resolve::resolve;

    #[test]
    fn much_of_a_plan_that_is_not_compared_is_said() {
        let plan = resolve("calibration-counterphase", &[]).unwrap().flights.remove(0).plan;
        let planned = of_segments(&plan.groups[0].segments);
        let mut data = trial::data(2, |_, _| 0.0);
        data.groups[0].name.clone_from(&plan.groups[0].name);
        let mut said = |bins: usize| {
            data.groups[0].bins = planned[..bins].to_vec();
            few_bins(&plan, &data).map(|warning| warning.to_string())
        };
        let count = planned.len();
        assert_eq!(said(count * 4 / 5), None);
        let few = count * 7 / 10;
        let wanted = format!(
            "only {few} of the {count} stretches of steady flight in the plan are compared: "
        );
        let warning = said(few).unwrap();
        assert!(warning.starts_with(&wanted), "{warning}");
    }

    #[test]
    fn legs_that_were_planned_and_not_flown_are_said() {
        let said =
            |has_lost_legs: bool| Warning::WindByLean { wind_mps: 9.2, has_lost_legs }.to_string();
        assert!(said(false).starts_with("no horizontal leg tells the wind: 9.2 m/s are read"));
        assert!(said(false).ends_with("(calibration-counterphase has legs)"), "{}", said(false));
        assert!(said(true).ends_with("could not fly them in this air: fly in less wind)"));
    }

    #[test]
    fn a_weak_wind_is_doubted_where_drag_is_found() {
        let doubted = |wind_mps: f64, effects: &[&str]| {
            let effects = effects.iter().map(|effect| (*effect).to_owned()).collect();
            let class = Finding::Class { effects, parameters: Vec::new() };
            is_doubted(wind_mps, &[trial::step(class, 20.0, &[])])
        };
        assert!(doubted(0.6, &["rotor-inflow", "parasitic-drag"]));
        assert!(doubted(0.6, &["blade-flapping", "momentum-drag"]));
        assert!(!doubted(0.6, &["battery"]) && doubted(3.5, &["battery"]));
    }

    #[test]
    fn much_that_nothing_explains_is_said() {
        let summary_in = |wind_mps: f64, after_without_air_us: f64, chi2: f64| {
            let rungs = Shrink {
                after_without_air_us,
                floor_us: 6.0,
                chi2: (chi2, chi2),
                ..Shrink::default()
            };
            let gap = Gap { rungs: Some(rungs), ..Gap::default() };
            let wind = WindFound { mean_mps: [0.0, wind_mps], ..WindFound::default() };
            crate::gap::words::summary(&Verdict { wind, gap, ..Verdict::default() })
        };
        let summary = |after_us: f64, chi2: f64| summary_in(5.0, after_us, chi2);
        let in_storm = summary_in(8.0, 9.0, 2.25);
        assert!(
            in_storm.starts_with("This flight cannot tell whether something is missing."),
            "{in_storm}"
        );
        assert!(in_storm.ends_with("may be how the drones lean, or an updraft."), "{in_storm}");
        assert_eq!(
            summary(9.0, 2.25),
            "Something is missing, and this comparison cannot say what. On rungs that were held out 9.0 us \
             are left; noise and air alone would leave 6.0."
        );
        assert!(summary(6.4, 2.25).starts_with("Nothing is missing"), "nobody would miss it");
        let of_two_winds = |rungs: Option<Shrink>| {
            let cautions = vec![Warning::OtherWind { lean_deg: 5.0 }];
            let gap = Gap { rungs, ..Gap::default() };
            crate::gap::words::summary(&Verdict { gap, cautions, ..Verdict::default() })
        };
        let much = Shrink {
            after_without_air_us: 9.0,
            floor_us: 6.0,
            chi2: (2.3, 2.3),
            ..Shrink::default()
        };
        let left = of_two_winds(Some(much));
        assert!(left.contains("whether anything is missing besides"), "{left}");
        let cautions = vec![Warning::OtherWind { lean_deg: 5.0 }];
        let in_two_winds = crate::gap::words::summary(&Verdict { cautions, ..Verdict::default() });
        assert!(in_two_winds.starts_with("The two sides flew in different wind"), "{in_two_winds}");
        assert!(summary(9.0, 1.5).starts_with("Nothing is missing"), "noise may leave it");
    }

    #[test]
    fn a_verdict_keeps_its_sentences_and_what_is_decided_by_them() {
        let cautions = vec![Warning::NoneHeldOut { drones: 4 }, Warning::NoRestingVoltage];
        let verdict = Verdict { cautions, ..Verdict::default() };
        assert!(!verdict.has_resting_voltage());
        let text = serde_json::to_string(&verdict).unwrap();
        assert!(text.contains(r#""4 drones: none is held out from fitting""#), "{text}");
        let read: Verdict = serde_json::from_str(&text).unwrap();
        assert_eq!(read, verdict);
        assert!(!read.has_resting_voltage(), "also of a verdict that was read");
        assert!(matches!(&read.cautions[0], Warning::Said(_)), "{:?}", read.cautions);
        let other = Warning::Said("the logs have BAT.VoltR".to_owned());
        assert!(Verdict { cautions: vec![other], ..Verdict::default() }.has_resting_voltage());
    }
}
