//! The catalogue as a document: `docs/effects.md`.

use std::fmt::Write as _;

use super::definition::Signal;
use super::select::values_of;
use super::{EffectError, LIBRARY, Reference, Signals};
use crate::vehicle::Vehicle;

/// The catalogue in Markdown, with each effect's size on `vehicle`.
///
/// # Errors
/// The vehicle's file sets an effect wrongly.
pub fn markdown(vehicle: &Vehicle) -> Result<String, EffectError> {
    let mut text = format!(
        "# Effects\n\nMade by `UPDATE=1 cargo test --test it effects::docs` from \
         `crates/multirotor-sim/src/effects/`; do not edit.\n\nPhysics beyond the base model. \
         Each effect is written once: the simulator flies it, and the analysis uses its closed \
         form. `updraft effects show NAME` explains one for a vehicle, `updraft simulate \
         --effect NAME` switches it on, `--effect NAME=off` off, and `--effect \
         NAME.PARAMETER=NUMBER` sets a parameter; a vehicle's file does the same in \
         `[effects.NAME]`. Sizes and defaults below are those of `{}`. `du` is the change of the \
         rotor control pulse that steady flight needs, `L` its change per relative change of \
         thrust ({:.0} us), `S` its change per vertical air speed.\n\n\
         | effect | class | what it does | size (us) |\n|---|---|---|---|\n",
        vehicle.name,
        Reference::of(vehicle).sensitivity_us(),
    );
    for effect in LIBRARY {
        let definition = effect.definition();
        let _ = writeln!(
            text,
            "| [{0}](#{0}) | {1} | {2} | {3} |",
            definition.name,
            definition.class.name(),
            definition.what,
            size_text(*effect, vehicle)?,
        );
    }
    for effect in LIBRARY {
        let definition = effect.definition();
        let _ = write!(
            text,
            "\n## {}\n\n**{}**: {}.\n\n{}\n\n```text\n{}\n```\n\nSource: {}.\n",
            definition.name,
            definition.title,
            definition.what,
            definition.explanation,
            definition.formula,
            definition.source,
        );
        let values = values_of(*effect, vehicle)?;
        if !definition.parameters.is_empty() {
            text.push_str(
                "\n| parameter | value | unit | allowed | meaning |\n|---|---|---|---|---|\n",
            );
        }
        for (parameter, value) in definition.parameters.iter().zip(values) {
            let _ = writeln!(
                text,
                "| `{}` | {} | {} | {} to {} | {} |",
                parameter.name,
                number(value),
                parameter.unit,
                number(parameter.low),
                number(parameter.high),
                parameter.what,
            );
        }
    }
    Ok(text)
}

/// A number with four significant digits at most, without trailing zeros.
pub fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{}", value + 0.0);
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{value:.digits$}");
    if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    } else {
        text
    }
}

/// Signals of hover with the shown signal of an effect set, and what goes with it.
pub fn shown_at(vehicle: &Vehicle, signal: Signal, value: f64) -> Result<Signals, EffectError> {
    let mut signals = Signals::default();
    match signal {
        // What changes in time is shown at the end of a usual flight.
        Signal::Climb => (signals.climb_mps, signals.time_s) = (value, 600.0),
        Signal::Horizontal => signals.horizontal_mps = value,
        Signal::Tilt => signals.tilt_rad = value,
        Signal::Height => signals.height_m = value,
        Signal::Time => signals.time_s = value,
        Signal::Density => signals.density_ratio = value,
        Signal::ChargeUsed => signals.charge_used_ah = value,
        Signal::Acceleration => signals.acceleration_mps2 = value,
        Signal::Drone => signals.deviation = value,
        Signal::Neighbours => signals.neighbours = value,
        Signal::ModelIncrement => signals.increment_us = value,
        Signal::Sensitivity => signals.sensitivity = value,
    }
    if signal != Signal::Sensitivity {
        signals.sensitivity = super::Model::of(vehicle)?.sensitivity(&signals);
    }
    Ok(signals)
}

/// The closed form of an effect along its shown signal: (signal, us), from end to end.
pub fn curve(
    effect: &dyn super::Effect,
    vehicle: &Vehicle,
    points: usize,
) -> Result<Vec<(f64, f64)>, EffectError> {
    let (signal, low, high) = effect.definition().shown;
    let values = values_of(effect, vehicle)?;
    let at = Reference::of(vehicle);
    let last = points.max(2) - 1;
    (0..=last)
        .map(|index| {
            let value = low + (high - low) * index as f64 / last as f64;
            let signals = shown_at(vehicle, signal, value)?;
            Ok((value, effect.pulse_us(&at, &values, &signals)))
        })
        .collect()
}

/// Smallest and largest change along the shown signal, as text: `-50 .. +75`.
pub fn size_text(effect: &dyn super::Effect, vehicle: &Vehicle) -> Result<String, EffectError> {
    let curve = curve(effect, vehicle, 201)?;
    let (low, high) =
        curve.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, us)| {
            (low.min(*us), high.max(*us))
        });
    let digits = usize::from(low.abs().max(high.abs()) < 9.95);
    // Adding zero turns a rounded -0 into 0.
    let rounded = |value: f64| {
        let scale = if digits == 1 { 10.0 } else { 1.0 };
        (value * scale).round() / scale + 0.0
    };
    Ok(format!("{:+.digits$} .. {:+.digits$}", rounded(low), rounded(high)))
}
