//! Filling in the pages: the templates, and what all pages tell of where they came from.

use minijinja::value::Value;
use minijinja::{Environment, UndefinedBehavior, context};

use super::text::clean;
use super::{Provenance, ReportError, links};

/// Macros that the pages import under this name.
const SHARED: (&str, &str) = ("shared.html", include_str!("../../templates/report/shared.html"));
const CITE: (&str, &str) = ("cite.html", include_str!("../../templates/report/cite.html"));
pub(super) const STYLE: &str = concat!(
    include_str!("../../templates/report/style.css"),
    include_str!("../../templates/report/dark.css"),
    include_str!("../../templates/report/print.css"),
);
/// Interactive parts of a flight.
const EXPLORER: (&str, &str) =
    ("explorer.html", include_str!("../../templates/report/explorer.html"));

/// Lists that are longer than this start folded.
pub(super) const OPEN_LIMIT: usize = 6;

/// Fills in the page of this name. Names must end in `.html`: that has text escaped.
pub(super) fn fill(name: &str, page: &str, values: Value) -> Result<String, ReportError> {
    let mut environment = Environment::new();
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    environment.add_template(SHARED.0, SHARED.1)?;
    environment.add_template(CITE.0, CITE.1)?;
    environment.add_template(EXPLORER.0, EXPLORER.1)?;
    environment.add_template(name, page)?;
    Ok(environment.get_template(name)?.render(values)?)
}

/// The look of every page, and where it came from.
pub(super) fn common(provenance: &Provenance) -> Value {
    let inputs: Vec<Value> = provenance
        .inputs
        .iter()
        .map(|input| context! { path => clean(&input.path), sha256 => clean(&input.sha256) })
        .collect();
    let settings: Vec<Value> = provenance
        .settings
        .iter()
        .map(|(what, how)| context! { what => clean(what), how => clean(how) })
        .collect();
    context! {
        style => Value::from_safe_string(STYLE.to_owned()),
        program => clean(&provenance.program),
        command => clean(&provenance.command),
        settings,
        inputs_open => inputs.len() <= OPEN_LIMIT,
        inputs,
        kuva => kuva::VERSION,
        links => links::values(&provenance.links),
    }
}
