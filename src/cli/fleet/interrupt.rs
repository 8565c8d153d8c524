//! What Ctrl-C means while drones are in the air: a person is asked, programs say it beforehand.

use std::io::{BufRead as _, IsTerminal as _};
use std::sync::mpsc::{Receiver, TryRecvError, sync_channel};

use clap::{Args, ValueEnum};

use crate::cli::context::{Context, prompt};
use crate::fleet::abort::Action;
use crate::link::clock::{Micros, S};

/// Nobody who answers within this: the choice of `--on-interrupt` is taken.
const ANSWER_WITHIN: Micros = 15 * S;

/// What drones in the air do when the program that watches or flies them is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Choice {
    /// They land where they are
    Land,
    /// They return to where they took off, and land there
    Return,
    /// They are left flying: a show goes on by itself; those flown by --guided stop within 3 s and
    /// return by their own failsafe
    Leave,
}

impl Choice {
    /// What the drones are told; `None`: nothing.
    pub(in crate::cli) fn action(self) -> Option<Action> {
        match self {
            Self::Land => Some(Action::Land),
            Self::Return => Some(Action::Return),
            Self::Leave => None,
        }
    }

    /// As a person writes it; `None`: they have written something else.
    fn read(answer: &str, default: Self) -> Option<Self> {
        match answer.trim().to_lowercase().as_str() {
            "" => Some(default),
            "l" | "land" => Some(Self::Land),
            "r" | "return" => Some(Self::Return),
            "f" | "fly" | "leave" => Some(Self::Leave),
            _ => None,
        }
    }

    fn word(self) -> &'static str {
        match self {
            Self::Land => "land",
            Self::Return => "return",
            Self::Leave => "leave them flying",
        }
    }
}

/// What Ctrl-C does in flight.
#[derive(Clone, Copy, Debug, Args)]
pub(in crate::cli) struct InterruptArgs {
    /// What drones in the air do at Ctrl-C, SIGTERM or SIGHUP (a lost terminal)
    ///
    /// On a terminal it is asked, and this is the answer after 15 s, at Enter, and at a second
    /// Ctrl-C; elsewhere it is done at once. While it is done, another Ctrl-C ends the program at
    /// once and says what becomes of the drones.
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = Choice::Return)]
    pub(in crate::cli) on_interrupt: Choice,
}

/// A line that a person has written; `None`: nobody is there.
type Answer = Option<String>;

/// Whom to ask: nobody, or a person.
type Ask = fn(&str) -> Option<Receiver<Answer>>;

/// A question that is open.
struct Question {
    answers: Receiver<Answer>,
    until: Micros,
    count: u32,
}

/// Watches for Ctrl-C, and asks what it means.
pub(in crate::cli) struct Interrupt<'a> {
    context: &'a Context,
    default: Choice,
    ask: Ask,
    open: Option<Question>,
    chosen: Option<Choice>,
}

impl<'a> Interrupt<'a> {
    pub(in crate::cli) fn new(context: &'a Context, default: Choice) -> Self {
        Self { context, default, ask: ask_person, open: None, chosen: None }
    }

    /// For drones that end with the program: nobody is asked.
    pub(in crate::cli) fn silent(context: &'a Context) -> Self {
        let mut silent = Self::new(context, Choice::Leave);
        silent.ask = |_| None;
        silent
    }

    /// What is chosen; `None`: there was no signal, or nobody has answered yet. To be called often:
    /// drones are flown meanwhile.
    pub(in crate::cli) fn poll(&mut self, now: Micros) -> Option<Choice> {
        if self.chosen.is_none() && self.context.check_stop().is_err() {
            self.chosen = self.choose(now);
        }
        self.chosen
    }

    fn choose(&mut self, now: Micros) -> Option<Choice> {
        let default = self.default;
        let Some(question) = &self.open else {
            let words = default.word();
            let text = format!(
                "\nCtrl-C: shall the drones land (l), return (r), or be left flying (f)? Enter, \
                 15 s, or Ctrl-C again: {words}. "
            );
            let Some(answers) = (self.ask)(&text) else { return Some(default) };
            let count = self.context.signals().count();
            self.open = Some(Question { answers, until: now + ANSWER_WITHIN, count });
            return None;
        };
        if now >= question.until || self.context.signals().count() > question.count {
            return Some(default);
        }
        match question.answers.try_recv() {
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) | Ok(None) => Some(default),
            Ok(Some(answer)) => {
                let choice = Choice::read(&answer, default);
                if choice.is_none() {
                    // Asked again, in the same time.
                    let until = question.until;
                    self.open = None;
                    self.choose(now);
                    if let Some(again) = &mut self.open {
                        again.until = until;
                    }
                }
                choice
            }
        }
    }
}

fn ask_person(question: &str) -> Option<Receiver<Answer>> {
    if !std::io::stdin().is_terminal() || !std::io::stderr().is_terminal() {
        return None;
    }
    prompt(question).ok()?;
    let (send, answers) = sync_channel(1);
    // Ends with the program if nobody answers.
    let read = move || {
        let mut answer = String::new();
        let read = std::io::stdin().lock().read_line(&mut answer);
        let _ = send.send(read.ok().filter(|bytes| *bytes > 0).map(|_| answer));
    };
    std::thread::Builder::new().name("answer".to_owned()).spawn(read).ok()?;
    Some(answers)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_words_or_letters_and_anything_else_is_asked_again() {
        for (answer, wanted) in [
            ("l\n", Some(Choice::Land)),
            ("Return", Some(Choice::Return)),
            ("f", Some(Choice::Leave)),
            ("leave", Some(Choice::Leave)),
            ("\n", Some(Choice::Return)),
            ("yes", None),
        ] {
            assert_eq!(Choice::read(answer, Choice::Return), wanted, "{answer:?}");
        }
    }

    /// The choice for each time in s, with these answers of a person.
    fn chosen(answers: &[&str], at_s: &[u64], again_s: u64) -> Vec<Option<Choice>> {
        thread_local! {
            static LEFT: std::cell::RefCell<Vec<String>> = const { std::cell::RefCell::new(Vec::new()) };
        }
        LEFT.with(|left| {
            *left.borrow_mut() = answers.iter().rev().map(|&answer| answer.to_owned()).collect();
        });
        let context = Context::silent();
        let mut interrupt = Interrupt::new(&context, Choice::Return);
        interrupt.ask = |_| {
            let (send, answers) = sync_channel(1);
            if let Some(answer) = LEFT.with(|left| left.borrow_mut().pop()) {
                send.send(Some(answer)).unwrap();
            }
            // A person who is silent keeps the line open.
            std::mem::forget(send);
            Some(answers)
        };
        assert_eq!(interrupt.poll(0), None, "nothing has happened");
        context.signals().pretend();
        let poll = |at_s: &u64| {
            if *at_s == again_s {
                context.signals().pretend();
            }
            interrupt.poll(at_s * S)
        };
        at_s.iter().map(poll).collect()
    }

    #[test]
    fn a_person_is_asked_and_silence_or_a_second_signal_is_the_default() {
        let (land, home) = (Some(Choice::Land), Some(Choice::Return));
        assert_eq!(chosen(&["l"], &[1, 2, 3], 0), [None, land, land]);
        assert_eq!(chosen(&["what?", "l"], &[1, 2, 3], 0), [None, None, land]);
        assert_eq!(chosen(&[], &[1, 15, 16], 0), [None, None, home]);
        assert_eq!(chosen(&[], &[1, 2, 3], 3), [None, None, home]);
    }

    #[test]
    fn where_nobody_can_be_asked_the_option_decides_at_once() {
        let context = Context::silent();
        let mut interrupt = Interrupt::new(&context, Choice::Land);
        interrupt.ask = |_| None;
        assert_eq!(interrupt.poll(0), None);
        context.signals().pretend();
        assert_eq!(interrupt.poll(1), Some(Choice::Land));
    }
}
