//! Context of every command: where to print, how much to say, and whether to stop.

use std::io::{self, BufRead as _, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};

use serde::Serialize;

use super::Global;
use super::exit::CommandError;
use super::fleet::bar::LogsBar;
use super::help_text;
use super::progress::Bar;
use super::signals::Signals;
use crate::base::plain::{Shown as _, for_terminal, json_for_terminal};
use crate::campaign::lock::FolderLock;
use crate::workflow::clock::{Clock, SystemClock};
use crate::workflow::host::{Answer, Host, Progress, Transfer};

/// Output and interruption for one run of the program.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is an option of the command line")]
pub(super) struct Context {
    /// Say only what went wrong, and print only the path of the result.
    pub(super) quiet: bool,
    /// One JSON object on standard output instead of tables.
    pub(super) json: bool,
    /// Whether standard output takes colours.
    pub(super) color: bool,
    /// Whether progress bars make sense.
    pub(super) interactive: bool,
    /// Columns of the terminal that standard output is read on; none for files and pipes.
    pub(super) width: Option<usize>,
    signals: Signals,
    /// Whether something was said that must be said even when quiet.
    insisted: Arc<AtomicBool>,
    /// Whether there is an object on standard output.
    printed_json: Arc<AtomicBool>,
    clock: RunClock,
}

/// The clock of a run.
#[derive(Clone)]
struct RunClock(Arc<dyn Clock>);

impl std::fmt::Debug for RunClock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("RunClock")
    }
}

impl Default for RunClock {
    fn default() -> Self {
        Self(Arc::new(SystemClock::start()))
    }
}

impl RunClock {
    #[cfg(debug_assertions)]
    fn of(global: &Global) -> Self {
        let shared = global.shared_clock.clone();
        shared.map_or_else(Self::default, |clock| {
            clock.join();
            Self(Arc::new(clock))
        })
    }

    #[cfg(not(debug_assertions))]
    fn of(_global: &Global) -> Self {
        Self::default()
    }
}

impl Context {
    /// From the global options and the terminal.
    pub(super) fn new(global: &Global) -> Self {
        let signals = Signals::default();
        let installed = signals.take();
        let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
        let color = match global.color {
            super::ColorChoice::Always => true,
            super::ColorChoice::Never => false,
            super::ColorChoice::Auto => io::stdout().is_terminal() && !no_color,
        };
        let context = Self {
            quiet: global.quiet,
            json: global.json,
            color,
            interactive: io::stderr().is_terminal() && !global.quiet && !global.no_progress,
            width: columns(),
            signals,
            insisted: Arc::default(),
            printed_json: Arc::default(),
            clock: RunClock::of(global),
        };
        if let Err(error) = installed {
            context.warn(&format!("Ctrl-C will end the program at once ({error})"));
        }
        context
    }

    /// The time of this run.
    pub(super) fn clock(&self) -> &Arc<dyn Clock> {
        &self.clock.0
    }

    /// The flag that Ctrl-C raises.
    pub(super) fn stop_flag(&self) -> &AtomicBool {
        self.signals.stop_flag()
    }

    /// As what runs a workflow.
    pub(super) fn host(&self) -> &dyn Host {
        self
    }

    /// Ends the command if Ctrl-C was pressed.
    pub(super) fn check_stop(&self) -> Result<(), CommandError> {
        self.host().check_stop()
    }

    /// Locks a campaign folder for this process; dropped, it is free again.
    pub(super) fn lock(&self, folder: &Path) -> Result<FolderLock, CommandError> {
        self.host().lock(folder)
    }

    /// A table or a summary, on standard output, unless quiet.
    pub(super) fn print(&self, text: &str) -> Result<(), CommandError> {
        if self.quiet { Ok(()) } else { self.emit(text) }
    }

    /// The file or folder that the command made: on standard output when that is all that is asked
    /// for.
    pub(super) fn result(&self, path: &Path) -> Result<(), CommandError> {
        if self.quiet && !self.json { self.emit(&format!("{}\n", path.shown())) } else { Ok(()) }
    }

    /// What the user asked for, on standard output, also when quiet.
    pub(super) fn emit(&self, text: &str) -> Result<(), CommandError> {
        self.try_emit(text).map_err(CommandError::Output)
    }

    fn try_emit(&self, text: &str) -> io::Result<()> {
        write_out(&for_terminal(text, self.color))
    }

    /// Data as one JSON object, on standard output.
    pub(super) fn print_json<T: Serialize>(&self, value: &T) -> Result<(), CommandError> {
        let mut text = serde_json::to_string_pretty(value)
            .map_err(|error| CommandError::Failed(format!("failed to make JSON: {error}")))?;
        text.push('\n');
        self.printed_json.store(true, Ordering::Relaxed);
        write_out(&json_for_terminal(&text)).map_err(CommandError::Output)
    }

    /// Whether [`Self::print_json`] was called.
    pub(super) fn has_printed_json(&self) -> bool {
        self.printed_json.load(Ordering::Relaxed)
    }

    /// Talk, on standard error, unless quiet.
    pub(super) fn say(&self, text: &str) {
        if !self.quiet {
            complain(text);
        }
    }

    /// Says that something was lost if nobody has said what: no command ends so in silence.
    pub(super) fn account_for_losses(&self) {
        if !self.insisted.load(Ordering::Relaxed) {
            self.insist("warning: done, with the losses named above (exit code 3)");
        }
    }

    /// A warning, on standard error, always.
    pub(super) fn warn(&self, text: &str) {
        self.insist(&format!("warning: {text}"));
    }

    /// Something that must be said even when quiet, on standard error.
    pub(super) fn insist(&self, text: &str) {
        self.insisted.store(true, Ordering::Relaxed);
        complain(text);
    }
}

/// Help or version, on standard output, with styles on a terminal that takes them.
pub(super) fn emit_help(text: &clap::builder::StyledStr) -> io::Result<()> {
    let no_color = std::env::var_os("NO_COLOR").is_some_and(|value| !value.is_empty());
    let styled = io::stdout().is_terminal() && !no_color;
    // What clap made of this program's own words.
    let text = if styled { text.ansi().to_string() } else { text.to_string() };
    write_out(&help_text::printed(&text))
}

fn write_out(text: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes()).and_then(|()| out.flush())
}

impl Host for Context {
    fn say(&self, text: &str) {
        Self::say(self, text);
    }

    fn insist(&self, text: &str) {
        Self::insist(self, text);
    }

    fn clock(&self) -> &Arc<dyn Clock> {
        Self::clock(self)
    }

    fn stop_flag(&self) -> &AtomicBool {
        Self::stop_flag(self)
    }

    fn show(&self, table: &str) -> io::Result<()> {
        if self.json {
            Self::say(self, table);
            Ok(())
        } else if self.quiet {
            Ok(())
        } else {
            self.try_emit(table)
        }
    }

    fn show_no_go(&self, table: &str) -> io::Result<()> {
        if self.json {
            Self::insist(self, table);
            Ok(())
        } else {
            self.try_emit(table)
        }
    }

    fn progress(&self, what: &str, total: u64) -> Box<dyn Progress + '_> {
        Box::new(Bar::new(self, what, total))
    }

    fn transfer(&self) -> Box<dyn Transfer + '_> {
        Box::new(LogsBar::new(self))
    }

    fn is_attended(&self) -> bool {
        io::stdin().is_terminal()
    }

    fn sees_questions(&self) -> bool {
        io::stdin().is_terminal() && io::stderr().is_terminal()
    }

    fn ask(&self, question: &str) -> io::Result<Receiver<Answer>> {
        prompt(question)?;
        let (send, answers) = sync_channel(1);
        // Ends with the program if nobody answers.
        let read = move || {
            let mut answer = String::new();
            let read = io::stdin().lock().read_line(&mut answer);
            let _ = send.send(read.map(|bytes| (bytes > 0).then_some(answer)));
        };
        std::thread::Builder::new().name("answer".to_owned()).spawn(read)?;
        Ok(answers)
    }

    fn interruptions(&self) -> u32 {
        self.signals.count()
    }

    fn set_in_flight(&self, words: Option<&'static str>) {
        self.signals.set_flies(words);
    }

    fn next_ends(&self) {
        self.signals.next_ends();
    }

    fn command(&self) -> String {
        let shown: Vec<_> = std::env::args()
            .skip(1)
            .map(|word| if word.contains(' ') { format!("'{word}'") } else { word })
            .collect();
        format!("updraft {}", shown.join(" "))
    }
}

/// A question on standard error; the answer follows on its line.
fn prompt(question: &str) -> io::Result<()> {
    let mut err = io::stderr().lock();
    err.write_all(for_terminal(question, false).as_bytes()).and_then(|()| err.flush())
}

/// A line, or some, on standard error, without styles: the one way out to it.
pub(super) fn complain(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{}", for_terminal(text, false));
}

/// Narrowest terminal that lines are broken for.
const MIN_COLUMNS: usize = 30;

/// Columns that standard output has: `COLUMNS`, else the terminal's; none for files and pipes.
fn columns() -> Option<usize> {
    let asked = std::env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    // Asks standard output first, then the other streams: these may be a terminal although it is not.
    let terminal = || {
        let size = io::stdout().is_terminal().then(terminal_size::terminal_size).flatten();
        size.map(|(width, _)| usize::from(width.0))
    };
    asked.or_else(terminal).filter(|columns| *columns >= MIN_COLUMNS)
}
