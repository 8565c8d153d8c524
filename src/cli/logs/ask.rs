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
        if let Some(answer) = answer(&line, choices.len()) {
            return Ok(answer);
        }
    }
}

/// What a line means: one of so many, or none of them; `None`: nothing.
fn answer(line: &str, count: usize) -> Option<Option<usize>> {
    match line.trim() {
        "none" | "n" => Some(None),
        number => {
            let number: usize = number.parse().ok()?;
            (1..=count).contains(&number).then(|| Some(number - 1))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::answer;

    #[test]
    fn an_answer_is_a_number_or_none() {
        assert_eq!(answer("2\n", 2), Some(Some(1)));
        assert_eq!(answer(" none ", 2), Some(None));
        for wrong in ["", "0", "3", "yes", "-1"] {
            assert_eq!(answer(wrong, 2), None, "{wrong}");
        }
    }
}
