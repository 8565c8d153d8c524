//! Errors of templates, drawn with the line they are about.

use std::fmt;
use std::ops::Range;

use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};

use crate::base::plain::plain;

/// A template cannot be used: where, why, and what is allowed.
#[derive(Clone, Debug)]
pub struct TemplateError {
    /// File name, as given by the user.
    pub path: String,
    /// The text the span points into.
    pub text: String,
    /// Bytes of `text` that the error is about.
    pub span: Option<Range<usize>>,
    /// What is wrong.
    pub message: String,
    /// What to do or what is allowed.
    pub help: Option<String>,
}

impl TemplateError {
    /// An error about a place in a text.
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

    /// Adds what to do or what is allowed.
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
