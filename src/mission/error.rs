//! Errors of templates, drawn with the line that they point at.

use std::fmt;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::base::plain::plain;

/// Error of a template: its place, its reason, and what is allowed there.
#[derive(Clone, Debug)]
pub struct TemplateError {
    /// Name of the template's file, as given by the user.
    pub path: String,
    /// Text of the template.
    pub text: String,
    /// Bytes of `text` that the error is about.
    pub span: Option<Range<usize>>,
    /// Statement of the problem, one sentence.
    pub message: String,
    /// Remedy, or the values that are allowed.
    pub help: Option<String>,
}

impl TemplateError {
    /// An error at a place in a template's text.
    pub fn new(
        path: &str,
        text: &str,
        span: Option<Range<usize>>,
        message: impl Into<String>,
    ) -> Self {
        Self {
            path: plain(path).into_owned(),
            text: text.into(),
            span,
            message: message.into(),
            help: None,
        }
    }

    /// Adds the remedy, or the values that are allowed.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// The error with the line it is about, coloured or plain.
    pub fn render(&self, color: bool) -> String {
        let renderer = if color { Renderer::styled() } else { Renderer::plain() };
        let title = Level::ERROR.primary_title(&self.message);
        let mut group = match &self.span {
            Some(span) if span.end <= self.text.len() => Group::with_title(title).element(
                Snippet::source(&self.text)
                    .path(&self.path)
                    .annotation(AnnotationKind::Primary.span(span.clone())),
            ),
            _ => Group::with_title(title).element(Level::NOTE.message(format!("in {}", self.path))),
        };
        if let Some(help) = &self.help {
            group = group.element(Level::HELP.message(help));
        }
        renderer.render(&[group])
    }
}

impl fmt::Display for TemplateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.render(false))
    }
}

impl std::error::Error for TemplateError {}
