//! The verdict in plain words.

use std::borrow::Cow;
use std::fmt::Write as _;

use super::dependence::Dependence;
use super::formula::symbol;
use super::verdict::{Finding, Fitted, Form, Rest, Step, Verdict, is_strong_wind};
use super::warning::{Warning, thrust_curve};
use crate::effects::Role;

/// One finding as a phrase: `rotor-inflow (inflow_share 0.42, 0.39 to 0.45)`.
pub fn phrase(step: &Step) -> String {
    let form = step.form.as_ref();
    match &step.finding {
        Finding::Name { effect, parameters, was_there } => {
            let again = if *was_there { ", with another size than the model's" } else { "" };
            format!("{effect}{}{again}", values(parameters, form))
        }
        Finding::Class { effects, parameters } => format!(
            "{}: this flight cannot separate them{}",
            either(&effects.iter().map(|name| member(name)).collect::<Vec<_>>()),
            if parameters.is_empty() {
                String::new()
            } else {
                format!(" (as {}{})", effects[0], values(parameters, form))
            }
        ),
        Finding::Unknown { depends_on, formula } => {
            let shape = formula.as_ref().map_or_else(String::new, |text| {
                format!(", about {}", with_symbol(text, *depends_on))
            });
            let quantity = quantity(*depends_on);
            format!("something that is not in the library and depends on {quantity}{shape}")
        }
    }
}

/// A formula with what its letter stands for.
pub fn with_symbol(formula: &str, depends_on: Dependence) -> String {
    symbol(depends_on).map_or_else(
        || formula.to_owned(),
        |(letter, meaning)| format!("{formula} ({letter}: {meaning})"),
    )
}

/// A member of a class in words: effects by their names; motions of the air and what something unknown would
/// depend on by what they are.
pub fn member(name: &str) -> Cow<'_, str> {
    match name {
        "updraft-drift" => "an updraft that changes steadily".into(),
        "updraft-profile" => "an updraft that grows with height".into(),
        name => Dependence::of(name).map_or_else(
            || name.into(),
            |on| format!("something unknown that depends on {}", quantity(on)).into(),
        ),
    }
}

/// The quantity that something unknown depends on, in words.
pub fn quantity(depends_on: Dependence) -> &'static str {
    match depends_on {
        Dependence::Climb => "climb speed",
        Dependence::ClimbTime => "climb speed times time",
        Dependence::ClimbHeight => "climb speed times height",
        Dependence::Height => "height",
        Dependence::Time => "time",
        Dependence::Step => "time, in a step",
        Dependence::Wind => "the wind",
        Dependence::Lean => "the lean",
        Dependence::Voltage => "the charge",
        Dependence::Place => "the drone's place",
        Dependence::Drone => "the drone",
        Dependence::Heading => "the heading",
    }
}

fn either(names: &[Cow<'_, str>]) -> String {
    match names {
        [] => String::new(),
        [one] => one.to_string(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

fn values(parameters: &[Fitted], form: Option<&Form>) -> String {
    let one = |fitted: &Fitted| {
        let unit = if fitted.unit.is_empty() { String::new() } else { format!(" {}", fitted.unit) };
        let before = fitted
            .before
            .map_or_else(String::new, |before| format!(", the model had {}", short(before)));
        format!(
            "{} {}{unit}, {} to {}{before}",
            fitted.name,
            short(fitted.value.value),
            short(fitted.value.low),
            short(fitted.value.high)
        )
    };
    if parameters.is_empty() {
        return String::new();
    }
    let of_form = form
        .filter(|form| !form.is_usual)
        .map_or_else(String::new, |form| format!("; with {} {}", form.name, short(form.value)));
    format!(" ({}{of_form})", parameters.iter().map(one).collect::<Vec<_>>().join("; "))
}

/// A number with three significant digits.
pub fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value:.0}");
    }
    let digits = (2 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    format!("{value:.digits$}")
}

/// How the logged vertical velocity is wrong: by how much, how late, or both.
fn velocity_error(verdict: &Verdict) -> String {
    let bias_mps = verdict.sensor.bias_mps.map_or(0.0, |bias| bias.value);
    let lag_s = verdict.sensor.lag_s.map_or(0.0, |lag| lag.value);
    let off = format!("off by {bias_mps:+.3} m/s");
    let late = format!("late by {lag_s:.2} s");
    // Half a digit of each: what would be printed as zero is not worth a word.
    match (bias_mps.abs() >= 0.000_5, lag_s.abs() >= 0.005) {
        (true, false) => off,
        (false, true) => late,
        _ => format!("{off} and {late}"),
    }
}

/// Whether simulated logs were flown in another wind than the measured ones.
fn flew_in_other_wind(verdict: &Verdict) -> bool {
    verdict.cautions.iter().any(|caution| matches!(caution, Warning::OtherWind { .. }))
}

/// The thrust curves that the logs of both sides say, where they differ.
fn thrust_curves(verdict: &Verdict) -> Option<(f64, f64)> {
    verdict.cautions.iter().find_map(|caution| match caution {
        Warning::ThrustCurves { simulated, measured } => Some((*simulated, *measured)),
        _ => None,
    })
}

/// What explains more than chance does, and was not taken; empty: nothing does.
fn too_little(rest: &Rest) -> String {
    if rest.gain_nats <= rest.threshold_nats {
        return String::new();
    }
    format!(
        " It found that {} would explain more than chance does, but moves the pulse by too little, or as the air may.",
        member(&rest.candidate)
    )
}

/// The verdict in one or two sentences.
pub fn summary(verdict: &Verdict) -> String {
    let is_strong_wind = is_strong_wind(verdict.wind.mean_mps);
    let mut text = if verdict.is_unexplained() && flew_in_other_wind(verdict) {
        "The two sides flew in different wind: whether anything is missing besides, this comparison cannot tell."
            .to_owned()
    } else if verdict.is_unexplained() {
        "Something is missing, and this comparison cannot say what.".to_owned()
    } else if verdict.steps.is_empty() && is_strong_wind && verdict.gap.left_over().is_some() {
        "This flight cannot tell whether something is missing.".to_owned()
    } else if verdict.steps.is_empty() && flew_in_other_wind(verdict) {
        "The two sides flew in different wind: what that explains, this comparison cannot tell, and beside it nothing \
         is missing that this flight could show."
            .to_owned()
    } else if verdict.steps.is_empty() {
        let would = verdict.detectable.iter().filter(|one| one.would_be_seen).count();
        format!(
            "Nothing is missing that this flight could show: of {} effects it would have shown {} at \
             their usual size.{}",
            verdict.detectable.len(),
            would,
            too_little(&verdict.rest)
        )
    } else {
        let named: Vec<String> = verdict.steps.iter().map(phrase).collect();
        format!("The model lacks {}.", named.join("; and "))
    };
    if let Some((simulated, measured)) = thrust_curves(verdict) {
        let _ = write!(
            text,
            " By the logs' own parameters the two sides differ in {} as well (MOT_THST_EXPO {} and {}).",
            thrust_curve(),
            short(simulated),
            short(measured)
        );
    }
    if verdict.sensor.named {
        let but = if verdict.steps.is_empty() { " But the" } else { " The" };
        let effect = Role::SensorBias.place().map_or("", |place| place.name());
        let _ = write!(
            text,
            "{but} logged vertical velocity is {} ({effect}).",
            velocity_error(verdict)
        );
    }
    if let Some(rungs) = verdict.gap.left_over() {
        let _ = write!(
            text,
            " On rungs that were held out {:.1} us are left; noise and air alone would leave {:.1}.",
            rungs.after_without_air_us, rungs.floor_us
        );
        if verdict.steps.is_empty() && is_strong_wind {
            text.push_str(" In so strong a wind that may be how the drones lean, or an updraft.");
        }
    } else if let Some(shrink) =
        verdict.gap.drones.or(verdict.gap.rungs).filter(|_| !verdict.steps.is_empty())
    {
        let is_unknown = |step: &Step| matches!(step.finding, Finding::Unknown { .. });
        let without = if verdict.steps.iter().any(is_unknown) {
            " (with the unknown's shape taken away, which no model has)"
        } else {
            ""
        };
        let _ = write!(
            text,
            " On data that was not used for fitting the gap goes from {:.1} to {:.1} us{}; noise and air \
             alone leave {:.1}.",
            shrink.before_without_air_us, shrink.after_without_air_us, without, shrink.floor_us
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_explains_more_than_chance_does_and_is_not_taken_is_said() {
        let left = |gain_nats: f64| {
            let rest = Rest {
                gain_nats,
                candidate: "climb".to_owned(),
                threshold_nats: 8.0,
                reduced_chi2: 1.0,
            };
            summary(&Verdict { rest, ..Verdict::default() })
        };
        assert!(!left(7.9).contains("more than chance"), "{}", left(7.9));
        let said = left(8.1);
        assert!(said.starts_with("Nothing is missing"), "{said}");
        assert!(said.ends_with("moves the pulse by too little, or as the air may."), "{said}");
    }

    #[test]
    fn thrust_curves_that_the_logs_parameters_tell_are_named() {
        let cautions = vec![Warning::ThrustCurves { simulated: 0.0, measured: 0.5 }];
        let said = summary(&Verdict { cautions, ..Verdict::default() });
        assert!(
            said.contains("differ in thrust-curve as well (MOT_THST_EXPO 0 and 0.500)"),
            "{said}"
        );
        assert!(!summary(&Verdict::default()).contains("thrust-curve"));
    }
}
