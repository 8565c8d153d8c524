//! Sentences whose numbers and names are known apart from their words.

use std::fmt;

/// A part of a sentence.
#[derive(Clone, Debug, PartialEq)]
enum Part {
    /// Words, which say what it is.
    Words(String),
    /// A measured number, and how it is printed.
    Number(f64, String),
    /// The name of a log.
    Log(String),
}

impl Part {
    fn text(&self) -> &str {
        match self {
            Self::Words(text) | Self::Number(_, text) | Self::Log(text) => text,
        }
    }
}

/// A sentence in parts, so that two that say the same of different things can be told together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sentence {
    parts: Vec<Part>,
}

impl From<String> for Sentence {
    /// Words alone.
    fn from(text: String) -> Self {
        Self { parts: vec![Part::Words(text)] }
    }
}

impl From<&str> for Sentence {
    /// Words alone.
    fn from(text: &str) -> Self {
        Self::from(text.to_owned())
    }
}

impl Sentence {
    /// Goes on with words.
    #[must_use]
    pub fn words(mut self, text: &str) -> Self {
        match self.parts.last_mut() {
            Some(Part::Words(words)) => words.push_str(text),
            _ => self.parts.push(Part::Words(text.to_owned())),
        }
        self
    }

    /// Goes on with a measured number as it is printed. One without decimals is a count or a command:
    /// it belongs to the words.
    #[must_use]
    pub fn number(mut self, value: f64, text: &str) -> Self {
        if !text.contains('.') {
            return self.words(text);
        }
        self.parts.push(Part::Number(value, text.to_owned()));
        self
    }

    /// Goes on with the name of a log.
    #[must_use]
    pub fn log(mut self, name: &str) -> Self {
        self.parts.push(Part::Log(name.to_owned()));
        self
    }

    /// Goes on with another sentence.
    #[must_use]
    pub fn then(self, other: Self) -> Self {
        other.parts.into_iter().fold(self, |sentence, part| match part {
            Part::Words(text) => sentence.words(&text),
            part => {
                let mut sentence = sentence;
                sentence.parts.push(part);
                sentence
            }
        })
    }

    /// Whether it names this log.
    pub fn names(&self, log: &str) -> bool {
        self.parts.iter().any(|part| matches!(part, Part::Log(name) if name == log))
    }

    /// Whether two sentences differ at most in measured numbers and in the names of logs.
    pub fn says_the_same(&self, other: &Self) -> bool {
        let same = |(left, right): (&Part, &Part)| match (left, right) {
            (Part::Words(left), Part::Words(right)) => left == right,
            (Part::Number(..), Part::Number(..)) | (Part::Log(_), Part::Log(_)) => true,
            _ => false,
        };
        self.parts.len() == other.parts.len()
            && self.parts.iter().zip(&other.parts).all(|pair| same((pair.0, pair.1)))
    }

    /// Sentences that say the same as one, with the span of what differs: `1.0..1.3 m`.
    pub fn together(same: &[&Self]) -> String {
        let Some(first) = same.first() else { return String::new() };
        let spanned = |index: usize| {
            let mut parts: Vec<&Part> =
                same.iter().filter_map(|sentence| sentence.parts.get(index)).collect();
            let value = |part: &Part| match part {
                Part::Number(value, _) => *value,
                Part::Words(_) | Part::Log(_) => 0.0,
            };
            // Stable: names keep their order.
            parts.sort_by(|left, right| value(left).total_cmp(&value(right)));
            match (parts.first(), parts.last()) {
                (Some(least), Some(most)) if least.text() != most.text() => {
                    format!("{}..{}", least.text(), most.text())
                }
                (Some(one), _) => one.text().to_owned(),
                (None, _) => String::new(),
            }
        };
        (0..first.parts.len()).map(spanned).collect()
    }
}

impl fmt::Display for Sentence {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.parts.iter().try_for_each(|part| f.write_str(part.text()))
    }
}
