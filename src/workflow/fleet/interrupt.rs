//! Meaning of an interruption while drones are in the air: a person is asked, programs decide
//! beforehand.

use std::sync::mpsc::{Receiver, TryRecvError};

use crate::fleet::abort::Action;
use crate::link::clock::{Micros, S};
use crate::workflow::host::{Answer, Host, News};

/// Nobody who answers within this: the choice of `--on-interrupt` is taken.
const ANSWER_WITHIN: Micros = 15 * S;

/// Answers, and what they do.
const ANSWERS: [(&str, &str); 3] =
    [("l", "Land the drones"), ("r", "Drones return"), ("f", "Leave them flying")];

/// What drones in the air do when the program that watches or flies them is to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Choice {
    /// They land where they are.
    Land,
    /// They return to where they took off, and land there
    Return,
    /// They are left flying: a show continues by itself; drones flown with --guided stop within 3 s
    /// and return by their own failsafe
    Leave,
}

impl Choice {
    /// What the drones are told; `None`: nothing.
    pub(crate) fn action(self) -> Option<Action> {
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

/// A question that is open.
struct Question {
    answers: Receiver<Answer>,
    until: Micros,
    count: u32,
}

/// Watches for Ctrl-C, and asks what it means.
pub(crate) struct Interrupt<'a> {
    host: &'a dyn Host,
    default: Choice,
    /// Whether anybody is asked.
    asks: bool,
    open: Option<Question>,
    chosen: Option<Choice>,
}

impl<'a> Interrupt<'a> {
    pub(crate) fn new(host: &'a dyn Host, default: Choice) -> Self {
        Self { host, default, asks: true, open: None, chosen: None }
    }

    /// For drones that end with the program: nobody is asked.
    pub(crate) fn silent(host: &'a dyn Host) -> Self {
        let mut silent = Self::new(host, Choice::Leave);
        silent.asks = false;
        silent
    }

    /// What is chosen; `None`: there was no signal, or nobody has answered yet. To be called often:
    /// drones are flown meanwhile.
    pub(crate) fn poll(&mut self, now: Micros) -> Option<Choice> {
        if self.chosen.is_none() && self.host.check_stop().is_err() {
            self.chosen = self.choose(now);
            if self.chosen.is_some() {
                self.host.news(&News::Answered);
            }
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
            let may_ask = self.asks && self.host.sees_questions();
            let Some(answers) = may_ask.then(|| self.host.offer(&text, &ANSWERS).ok()).flatten()
            else {
                return Some(default);
            };
            let count = self.host.interruptions();
            self.open = Some(Question { answers, until: now + ANSWER_WITHIN, count });
            return None;
        };
        if now >= question.until || self.host.interruptions() > question.count {
            return Some(default);
        }
        match question.answers.try_recv() {
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) | Ok(Err(_) | Ok(None)) => Some(default),
            Ok(Ok(Some(answer))) => {
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

#[cfg(test)]
mod tests {
    use std::io;
    use std::sync::atomic::AtomicBool;
    use std::sync::mpsc::{SyncSender, sync_channel};
    use std::sync::{Arc, Mutex};

    use super::*;
    use crate::workflow::clock::Clock;
    use crate::workflow::host::Quiet;

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

    /// A person with these answers, the next last; who has none keeps the line open.
    struct Person {
        quiet: Quiet,
        answers: Mutex<Vec<String>>,
        open: Mutex<Vec<SyncSender<Answer>>>,
    }

    impl Host for Person {
        fn say(&self, _: &str) {}

        fn insist(&self, _: &str) {}

        fn clock(&self) -> &Arc<dyn Clock> {
            self.quiet.clock()
        }

        fn stop_flag(&self) -> &AtomicBool {
            self.quiet.stop_flag()
        }

        fn interruptions(&self) -> u32 {
            self.quiet.interruptions()
        }

        fn sees_questions(&self) -> bool {
            true
        }

        fn ask(&self, _: &str) -> io::Result<Receiver<Answer>> {
            let (send, answers) = sync_channel(1);
            if let Some(answer) = self.answers.lock().unwrap().pop() {
                send.send(Ok(Some(answer))).unwrap();
            }
            self.open.lock().unwrap().push(send);
            Ok(answers)
        }
    }

    /// The choice for each time in s, with these answers of a person.
    fn chosen(answers: &[&str], at_s: &[u64], again_s: u64) -> Vec<Option<Choice>> {
        let answers = answers.iter().rev().map(|&answer| answer.to_owned()).collect();
        let (quiet, open) = (Quiet::default(), Mutex::default());
        let host = Person { quiet, answers: Mutex::new(answers), open };
        let mut interrupt = Interrupt::new(&host, Choice::Return);
        assert_eq!(interrupt.poll(0), None, "nothing has happened");
        host.quiet.stop();
        let poll = |at_s: &u64| {
            if *at_s == again_s {
                host.quiet.stop();
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
        let host = Quiet::default();
        let mut interrupt = Interrupt::new(&host, Choice::Land);
        assert_eq!(interrupt.poll(0), None);
        host.stop();
        assert_eq!(interrupt.poll(1), Some(Choice::Land));
    }
}
