//! Values of a template, read with errors that point at them.

use std::ops::{Range, RangeInclusive};

use toml::Spanned;

use super::error::TemplateError;
use super::template::{FlightTemplate, Quantity, span_of};
use crate::base::number::plain;

/// A template with its text, for reading values and making errors that point at them.
pub(super) struct Source<'a> {
    pub(super) path: &'a str,
    pub(super) text: &'a str,
    pub(super) template: &'a FlightTemplate,
}

impl Source<'_> {
    /// An error about a place in the template.
    pub(super) fn error(
        &self,
        span: Option<Range<usize>>,
        message: impl Into<String>,
    ) -> TemplateError {
        TemplateError::new(self.path, self.text, span, message)
    }

    /// A plain number that must lie in a range.
    pub(super) fn in_range(
        &self,
        value: &Spanned<f64>,
        what: &str,
        unit: &str,
        range: RangeInclusive<f64>,
    ) -> Result<f64, TemplateError> {
        self.checked(*value.get_ref(), span_of(value), what, unit, range)
    }

    fn checked(
        &self,
        value: f64,
        span: Option<Range<usize>>,
        what: &str,
        unit: &str,
        range: RangeInclusive<f64>,
    ) -> Result<f64, TemplateError> {
        if range.contains(&value) {
            return Ok(value);
        }
        let (low, high) = (range.start(), range.end());
        let gap = if unit.is_empty() { "" } else { " " };
        Err(self
            .error(span, format!("{what} cannot be {}{gap}{unit}", plain(value)))
            .with_help(format!("allowed: {low} to {high}{gap}{unit}")))
    }

    /// Follows a `"$name"` to its parameter.
    fn follow<'b>(
        &'b self,
        value: &'b Spanned<Quantity>,
    ) -> Result<&'b Spanned<Quantity>, TemplateError> {
        let Quantity::Reference(name) = value.get_ref() else { return Ok(value) };
        match self.template.parameters.get(name) {
            Some(found) if !matches!(found.get_ref(), Quantity::Reference(_)) => Ok(found),
            Some(_) => Err(self
                .error(span_of(value), format!("parameter `{name}` refers to another parameter"))
                .with_help("a parameter holds a number or a list of numbers")),
            None => {
                let names: Vec<_> =
                    self.template.parameters.keys().map(|name| format!("`{name}`")).collect();
                Err(self
                    .error(span_of(value), format!("there is no parameter `{name}`"))
                    .with_help(if names.is_empty() {
                        "add it to [parameters]".to_owned()
                    } else {
                        format!("[parameters] has {}", names.join(", "))
                    }))
            }
        }
    }

    /// A number, or a reference to one, that must lie in a range.
    pub(super) fn number(
        &self,
        value: &Spanned<Quantity>,
        what: &str,
        unit: &str,
        range: RangeInclusive<f64>,
    ) -> Result<f64, TemplateError> {
        let found = self.follow(value)?;
        match found.get_ref() {
            Quantity::Number(number) => self.checked(*number, span_of(found), what, unit, range),
            _ => Err(self.error(span_of(found), format!("{what} must be one number"))),
        }
    }

    /// A list of numbers, or a reference to one, each in a range.
    pub(super) fn numbers(
        &self,
        value: &Spanned<Quantity>,
        what: &str,
        unit: &str,
        range: &RangeInclusive<f64>,
    ) -> Result<Vec<f64>, TemplateError> {
        let found = self.follow(value)?;
        let list: &[f64] = match found.get_ref() {
            Quantity::List(list) => list,
            Quantity::Number(number) => std::slice::from_ref(number),
            Quantity::Reference(_) => &[],
        };
        if list.is_empty() {
            return Err(self
                .error(span_of(found), format!("this list has no {what}"))
                .with_help("give one number or more, for example [0.5, 1.0, 1.5]"));
        }
        list.iter()
            .map(|value| self.checked(*value, span_of(found), what, unit, range.clone()))
            .collect()
    }
}
