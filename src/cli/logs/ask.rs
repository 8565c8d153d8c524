//! A question with numbered answers, on a terminal.

use std::io::{BufRead as _, stdin};

use crate::cli::context::Context;
use crate::cli::exit::CommandError;

/// Asks which of the choices is meant; `None`: none of them, or no answer.
pub(super) fn which(
    context: &Context,
    question: &str,
    choices: &[String],
) -> Result<Option<usize>, CommandError> {
    context.insist(question);
    for (index, choice) in choices.iter().enumerate() {
        context.insist(&format!("  {}: {choice}", index + 1));
    }
    loop {
        context.insist(&format!("Type 1 to {}, or none:", choices.len()));
        let mut line = String::new();
        let read = stdin().lock().read_line(&mut line);
        let read = read.map_err(|error| CommandError::Failed(format!("failed to ask: {error}")))?;
        context.check_stop()?;
        if read == 0 {
            return Ok(None);
        }
        match answer(&line, choices.len()) {
            Answer::One(choice) => return Ok(Some(choice)),
            Answer::None => return Ok(None),
            Answer::Unclear => {}
        }
    }
}

/// What a line means.
#[derive(Debug, PartialEq)]
enum Answer {
    /// This one of the choices, from 0.
    One(usize),
    /// None of them.
    None,
    /// Nothing.
    Unclear,
}

fn answer(line: &str, count: usize) -> Answer {
    match line.trim() {
        "none" | "n" => Answer::None,
        number => match number.parse::<usize>() {
            Ok(number) if (1..=count).contains(&number) => Answer::One(number - 1),
            _ => Answer::Unclear,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::{Answer, answer};

    #[test]
    fn an_answer_is_a_number_or_none() {
        assert_eq!(answer("2\n", 2), Answer::One(1));
        assert_eq!(answer(" none ", 2), Answer::None);
        for wrong in ["", "0", "3", "yes", "-1"] {
            assert_eq!(answer(wrong, 2), Answer::Unclear, "{wrong}");
        }
    }
}
