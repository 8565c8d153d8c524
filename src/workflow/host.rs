//! Interface to the program that runs a workflow: it hears what happens, provides a clock, and has
//! somebody who may stop the work or be asked.

use std::io;
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::Receiver;
use std::sync::{Arc, Mutex, PoisonError};

use super::clock::{Clock, Micros, SystemClock};
use super::error::WorkflowError;
use crate::base::file::sweep_below;
use crate::base::plain::Shown as _;
use crate::campaign::lock::FolderLock;
use crate::fleet::order_handler::Notice;
use crate::fleet::preflight::Preflight;
use crate::fleet::slots::FleetTable;
use crate::live::view::Step;

/// The program that runs a workflow. All but four methods have a default: no progress is shown, and
/// nobody can be asked.
pub trait Host: Send + Sync {
    /// Reports an action or its result: one line of text, or several.
    fn say(&self, text: &str);

    /// Reports what must reach a person in any case: warnings, no-go reasons, orders to drones.
    fn insist(&self, text: &str);

    /// Clock of the workflow.
    fn clock(&self) -> &Arc<dyn Clock>;

    /// Flag that stops the work: it ends with [`WorkflowError::Interrupted`] at the next step, and
    /// keeps what is finished.
    fn stop_flag(&self) -> &AtomicBool;

    /// Reports a doubt that does not stop the work.
    fn warn(&self, text: &str) {
        self.insist(&format!("warning: {text}"));
    }

    /// Shows a table that a person looks at before the work goes on.
    ///
    /// # Errors
    /// When it cannot be shown; the work ends then with [`WorkflowError::Output`].
    fn show(&self, table: &str) -> io::Result<()> {
        self.say(table);
        Ok(())
    }

    /// Shows a table that says why the work does not go on.
    ///
    /// # Errors
    /// As [`Host::show`].
    fn show_no_go(&self, table: &str) -> io::Result<()> {
        self.insist(table);
        Ok(())
    }

    /// Begins the progress display of long work, in `total` units. `what` is a short verb phrase:
    /// `flying`.
    fn progress(&self, what: &str, total: u64) -> Box<dyn Progress + '_> {
        let _ = (what, total);
        Box::new(Unseen)
    }

    /// Begins the progress display of a transfer of logs.
    fn transfer(&self) -> Box<dyn Transfer + '_> {
        Box::new(Unseen)
    }

    /// Whether a person is there who can give leave to start.
    fn is_attended(&self) -> bool {
        false
    }

    /// Whether a person is there who sees a question that comes unasked.
    fn sees_questions(&self) -> bool {
        false
    }

    /// Asks a person; the answer arrives while the work goes on.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn ask(&self, question: &str) -> io::Result<Receiver<Answer>> {
        Err(io::Error::new(io::ErrorKind::Unsupported, format!("nobody to answer: {question}")))
    }

    /// Asks a person who can choose between answers, each a word and what it does; the answer arrives while the
    /// work goes on.
    ///
    /// # Errors
    /// When nobody can be asked.
    fn offer(&self, question: &str, answers: &[(&str, &str)]) -> io::Result<Receiver<Answer>> {
        let _ = answers;
        self.ask(question)
    }

    /// Reports where a flight stands, for those who show it.
    fn news(&self, news: &News<'_>) {
        let _ = news;
    }

    /// How often drones in flight are asked for attitude and outputs, us; `None`: they are not.
    fn stream_every(&self) -> Option<Micros> {
        None
    }

    /// Number of times that the work was told to stop: a person who insists while drones are in the
    /// air is not kept waiting.
    fn interruptions(&self) -> u32 {
        u32::from(self.stop_flag().load(Ordering::SeqCst))
    }

    /// Reports that drones are in the air, with the words for what becomes of them if the program
    /// ends all the same; `None`: none are in the air any more.
    fn set_in_flight(&self, words: Option<&'static str>) {
        let _ = words;
    }

    /// Allows the next interruption to end the program, whatever it is doing.
    fn next_ends(&self) {}

    /// Command or call that this work comes from, for the provenance of reports.
    fn command(&self) -> String {
        String::new()
    }
}

/// Work that can be stopped, and folders that it writes into.
impl dyn Host + '_ {
    /// Whether the work is to stop.
    pub fn is_stopped(&self) -> bool {
        self.stop_flag().load(Ordering::SeqCst)
    }

    /// Ends the work if it is to stop.
    ///
    /// # Errors
    /// [`WorkflowError::Interrupted`].
    pub fn check_stop(&self) -> Result<(), WorkflowError> {
        if self.is_stopped() { Err(WorkflowError::Interrupted) } else { Ok(()) }
    }

    /// Locks a campaign folder for this process, until the lock is dropped.
    ///
    /// # Errors
    /// When another process holds it, or the folder cannot be made.
    pub fn lock(&self, folder: &Path) -> Result<FolderLock, WorkflowError> {
        let lock = FolderLock::take(folder)?;
        // Nobody else writes here now: what a killed run left is nobody's.
        sweep_below(lock.folder());
        if !lock.is_held() {
            self.warn(&format!(
                "{} cannot be locked on this file system: let no other updraft write into it",
                folder.shown()
            ));
        }
        Ok(lock)
    }
}

/// Where a flight stands.
#[derive(Debug)]
#[non_exhaustive]
pub enum News<'a> {
    /// Another step has begun, and what is waited for in it, in a sentence.
    Step(Step, String),
    /// Which drone flies which slot is known.
    Assigned(&'a FleetTable),
    /// The table before a start, as far as it is filled.
    Preflight(&'a Preflight),
    /// Show time 0, ms since the GPS epoch; `None`: there is no start any more.
    Start(Option<i64>),
    /// News of an order.
    Order(&'a Notice),
    /// The question that was open is answered, or not asked any more.
    Answered,
}

/// Progress display of long work, shared between threads.
pub trait Progress: Send + Sync {
    /// Counts one more unit as done.
    fn advance(&self);

    /// Ends the display: all is done, or given up.
    fn finish(&self);
}

/// A line that a person has written; `None` if nobody is there.
pub type Answer = io::Result<Option<String>>;

/// Progress display of logs on their way home.
pub trait Transfer {
    /// Sets the bytes that have come, those that are known of in total, and the number of drones
    /// that are done.
    fn advance(&self, done: u64, total: u64, drones_done: usize);

    /// Reports a line of text meanwhile.
    fn say(&self, text: &str);

    /// Ends the display: all logs came, or were given up.
    fn finish(&self);
}

/// Progress that nobody looks at.
struct Unseen;

impl Transfer for Unseen {
    fn advance(&self, _done: u64, _total: u64, _drones_done: usize) {}

    fn say(&self, _text: &str) {}

    fn finish(&self) {}
}

impl Progress for Unseen {
    fn advance(&self) {}

    fn finish(&self) {}
}

/// A host for programs without a terminal: it hears nothing but warnings, which it keeps.
///
/// ```
/// use updraft::workflow::host::{Host, Quiet};
///
/// let host = Quiet::default();
/// host.say("flying");
/// host.warn("a log is missing");
/// assert_eq!(host.heard(), ["warning: a log is missing"]);
/// ```
pub struct Quiet {
    clock: Arc<dyn Clock>,
    stop: AtomicBool,
    stopped: AtomicU32,
    heard: Mutex<Vec<String>>,
}

impl Default for Quiet {
    /// By the computer's clock.
    fn default() -> Self {
        Self::new(Arc::new(SystemClock::start()))
    }
}

impl Quiet {
    /// A host with this clock.
    pub fn new(clock: Arc<dyn Clock>) -> Self {
        Self {
            clock,
            stop: AtomicBool::new(false),
            stopped: AtomicU32::new(0),
            heard: Mutex::default(),
        }
    }

    /// Warnings and orders so far, in their order.
    pub fn heard(&self) -> Vec<String> {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Stops the work at its next step; may be called from another thread.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::SeqCst);
        self.stopped.fetch_add(1, Ordering::SeqCst);
    }
}

impl std::fmt::Debug for Quiet {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Quiet").field("heard", &self.heard()).finish_non_exhaustive()
    }
}

impl Host for Quiet {
    fn say(&self, _text: &str) {}

    fn insist(&self, text: &str) {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner).push(text.to_owned());
    }

    fn clock(&self) -> &Arc<dyn Clock> {
        &self.clock
    }

    fn stop_flag(&self) -> &AtomicBool {
        &self.stop
    }

    fn interruptions(&self) -> u32 {
        self.stopped.load(Ordering::SeqCst)
    }
}
