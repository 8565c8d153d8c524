//! `updraft effects`: lists the pieces of physics that can be flown, and explains one.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{Args, Subcommand};
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::effects_plot::{svg, text_plot};
use super::exit::{CommandError, Exit};
use super::words::wrap;
use crate::base::file::write_whole;
use crate::base::layout;
use crate::base::plain::Shown as _;
use crate::effects::definition::{Hook, Signal};
use crate::effects::doc::{curve, number, size_text};
use crate::effects::select::{known, values_of};
use crate::effects::{Effect, LIBRARY, Reference};
use crate::vehicle::{Vehicle, library};

/// Points of a curve in JSON and in the SVG.
const POINTS: usize = 141;

/// Arguments of `updraft effects`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft effects
  updraft effects show rotor-inflow
  updraft effects show battery --vehicle phantom4 --svg battery.svg
  updraft simulate my-campaign --vehicle pixel --effect motor-thermal")]
pub(super) struct EffectsArgs {
    #[command(subcommand)]
    command: Option<EffectsCommand>,
    /// Vehicle to state sizes for: a file or a built-in name
    #[arg(long, value_name = "NAME", default_value = "pixel", global = true)]
    vehicle: String,
}

#[derive(Debug, Subcommand)]
enum EffectsCommand {
    /// Explain one effect: formula, parameters, source, size and a plot
    Show {
        /// The effect
        name: String,
        /// Write a plot to this file
        #[arg(long, value_name = "FILE")]
        svg: Option<PathBuf>,
    },
}

#[derive(Serialize, JsonSchema)]
struct ParameterOutput {
    name: &'static str,
    unit: &'static str,
    what: &'static str,
    value: f64,
    low: f64,
    high: f64,
}

#[derive(Serialize, JsonSchema)]
struct EffectOutput {
    name: &'static str,
    title: &'static str,
    what: &'static str,
    explanation: &'static str,
    formula: &'static str,
    source: &'static str,
    class: crate::effects::Class,
    signals: &'static [Signal],
    acts_on: &'static [Hook],
    on: bool,
    /// What it adds to the response in hover, us/(m/s); absent: it does not look at the vertical air speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    hover_us_per_mps: Option<f64>,
    parameters: Vec<ParameterOutput>,
    curve: CurveOutput,
}

#[derive(Serialize, JsonSchema)]
struct CurveOutput {
    signal: Signal,
    points: Vec<(f64, f64)>,
}

#[derive(Serialize, JsonSchema)]
pub(super) struct EffectsOutput {
    /// Format name and version: `updraft.effects/1`.
    schema: &'static str,
    /// Vehicle that sizes are stated for.
    vehicle: String,
    /// Change of the pulse per relative change of thrust in hover (du/dlnT), us.
    sensitivity_us: f64,
    /// The effects, in the order in which they act.
    effects: Vec<EffectOutput>,
}

pub(super) fn run(context: &Context, args: &EffectsArgs) -> Result<Exit, CommandError> {
    let vehicle = library::load(&args.vehicle)?;
    crate::effects::select::resolved(&vehicle)?;
    match &args.command {
        None => list(context, &vehicle)?,
        Some(EffectsCommand::Show { name, svg: file }) => {
            let effect = known(name)?;
            if let Some(file) = file {
                let definition = effect.definition();
                let drawn = svg(
                    &format!("{} on {}", definition.title, vehicle.name),
                    definition.shown.0.label(),
                    &curve(effect, &vehicle, POINTS)?,
                );
                write_whole(file, drawn.as_bytes())?;
                context.say(&format!("Wrote {}", file.shown()));
            }
            if context.json {
                context.print_json(&output(&vehicle, &[effect])?)?;
            } else {
                context.emit(&explained(effect, &vehicle)?)?;
            }
        }
    }
    Ok(Exit::Done)
}

fn list(context: &Context, vehicle: &Vehicle) -> Result<(), CommandError> {
    if context.json {
        return context.print_json(&output(vehicle, LIBRARY)?);
    }
    let width = |text: fn(&'static dyn Effect) -> &'static str| {
        LIBRARY.iter().map(|effect| layout::columns(text(*effect))).max().unwrap_or(0)
    };
    let names = width(|effect| effect.definition().name);
    let classes = width(|effect| effect.definition().class.name());
    let mut text = format!(
        "Effects, and the change of the pulse (us) that they need on {} (L = {:.0} us)\n\n",
        vehicle.name,
        Reference::of(vehicle).sensitivity_us(),
    );
    for effect in LIBRARY {
        let definition = effect.definition();
        let mark = if is_on(*effect, vehicle) { "*" } else { " " };
        let _ = writeln!(
            text,
            "{mark} {:names$}  {:classes$}  {:>14}  {}",
            definition.name,
            definition.class.name(),
            size_text(*effect, vehicle)?,
            definition.what,
        );
    }
    let _ = write!(
        text,
        "\n* acts on this vehicle. Sizes are over the range that `updraft effects show NAME` plots; \
         effects\nof one class leave the same trace in a flight of the paper's protocol.\n"
    );
    context.emit(&wrap(&text, context.width))
}

fn is_on(effect: &dyn Effect, vehicle: &Vehicle) -> bool {
    vehicle.effects.get(effect.definition().name).is_some_and(|table| table.on)
}

fn explained(effect: &dyn Effect, vehicle: &Vehicle) -> Result<String, CommandError> {
    let definition = effect.definition();
    let mut text = format!(
        "{} ({})\n{}.\n\n{}\n\nFormula     {}\nSource      {}\nClass       {}\n",
        definition.title,
        definition.name,
        definition.what,
        wrapped(definition.explanation, ""),
        wrapped(definition.formula, "            "),
        wrapped(definition.source, "            "),
        definition.class.name(),
    );
    let acts = if definition.hooks.is_empty() {
        "nothing in flight: it is in the analysis".to_owned()
    } else {
        let names = definition.hooks.iter().map(|hook| hook.what());
        names.collect::<Vec<_>>().join(", ")
    };
    let state = if is_on(effect, vehicle) { "acts" } else { "does not act" };
    let _ = writeln!(text, "Acts on     {acts}");
    let _ = writeln!(text, "Vehicle     {}: {state} unless --effect says otherwise", vehicle.name);
    if !definition.parameters.is_empty() {
        text.push_str("\nParameters\n");
        let values = values_of(effect, vehicle)?;
        for (parameter, value) in definition.parameters.iter().zip(values) {
            let _ = writeln!(
                text,
                "  {:22} {:>9} {:9} {} ({} to {})",
                parameter.name,
                number(value),
                parameter.unit,
                parameter.what,
                number(parameter.low),
                number(parameter.high),
            );
        }
    }
    let (signal, low, high) = definition.shown;
    let _ = writeln!(text, "\nChange of the pulse (us) by {}", signal.label());
    for index in 0..=4 {
        let points = curve(effect, vehicle, 5)?;
        if let Some((value, us)) = points.get(index) {
            let _ = writeln!(text, "  {:>9}  {us:+9.2}", number(*value));
        }
    }
    if let Some(slope) = hover_us_per_mps(effect, vehicle)? {
        let _ = writeln!(
            text,
            "In hover      {slope:+.1} us/(m/s): what it adds to the response to the air"
        );
    }
    text.push('\n');
    text.push_str(&text_plot(&curve(effect, vehicle, 61)?, low, high));
    Ok(text)
}

/// Half of the step of the slope in hover, m/s: gusts of a field day.
const HOVER_STEP_MPS: f64 = 0.5;

/// What an effect adds to the response in hover, us/(m/s); `None` where it does not look at the vertical air speed.
fn hover_us_per_mps(effect: &dyn Effect, vehicle: &Vehicle) -> Result<Option<f64>, CommandError> {
    let (signal, low, high) = effect.definition().shown;
    if signal != Signal::Climb || low >= -HOVER_STEP_MPS || high <= HOVER_STEP_MPS {
        return Ok(None);
    }
    let points = curve(effect, vehicle, POINTS)?;
    let at = |climb_mps: f64| {
        let after = points.iter().position(|(value, _)| *value >= climb_mps)?;
        let ((x0, y0), (x1, y1)) = (points.get(after.checked_sub(1)?)?, points.get(after)?);
        Some(y0 + (y1 - y0) * (climb_mps - x0) / (x1 - x0))
    };
    let (up, down) = (at(HOVER_STEP_MPS), at(-HOVER_STEP_MPS));
    Ok(up.zip(down).map(|(up, down)| (up - down) / (2.0 * HOVER_STEP_MPS)))
}

/// Text in lines of at most 80 columns. All but the first start with `indent`; on the first, a label of
/// its length stands already.
fn wrapped(text: &str, indent: &str) -> String {
    let options = layout::options(80).initial_indent(indent).subsequent_indent(indent);
    let text = layout::wrapped(text, options.break_words(false)).join("\n");
    text.strip_prefix(indent).unwrap_or(&text).to_owned()
}

fn output(
    vehicle: &Vehicle,
    effects: &[&'static dyn Effect],
) -> Result<EffectsOutput, CommandError> {
    let effects = effects
        .iter()
        .map(|effect| {
            let definition = effect.definition();
            let values = values_of(*effect, vehicle)?;
            let parameters = definition.parameters.iter().zip(values);
            Ok(EffectOutput {
                name: definition.name,
                title: definition.title,
                what: definition.what,
                explanation: definition.explanation,
                formula: definition.formula,
                source: definition.source,
                class: definition.class,
                signals: definition.signals,
                acts_on: definition.hooks,
                on: is_on(*effect, vehicle),
                hover_us_per_mps: hover_us_per_mps(*effect, vehicle)?,
                parameters: parameters
                    .map(|(parameter, value)| ParameterOutput {
                        name: parameter.name,
                        unit: parameter.unit,
                        what: parameter.what,
                        value,
                        low: parameter.low,
                        high: parameter.high,
                    })
                    .collect(),
                curve: CurveOutput {
                    signal: definition.shown.0,
                    points: curve(*effect, vehicle, POINTS)?,
                },
            })
        })
        .collect::<Result<Vec<_>, CommandError>>()?;
    Ok(EffectsOutput {
        schema: "updraft.effects/1",
        vehicle: vehicle.name.clone(),
        sensitivity_us: Reference::of(vehicle).sensitivity_us(),
        effects,
    })
}
