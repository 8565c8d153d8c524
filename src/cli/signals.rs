//! Handling of Ctrl-C, SIGTERM and SIGHUP (the terminal was closed, ssh was lost), which all mean
//! an interruption.
//!
//! Only Ctrl-C counts a second time: a session that ends sends SIGHUP and SIGTERM one after the other,
//! and more than once, while drones are being sent home.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use super::context::complain;
use super::exit::Exit;

/// Drones are in the air: a signal is answered by whoever watches them. Should that hang, so many
/// more end the program.
const MOST_UNANSWERED: u32 = 3;

/// What is said when the program is ended while drones are in the air, and the signal that does it.
#[derive(Clone, Copy, Debug)]
struct Air {
    words: &'static str,
    last: u32,
}

#[derive(Debug, Default)]
struct Shared {
    stop: AtomicBool,
    count: AtomicU32,
    air: Mutex<Option<Air>>,
}

/// The signals of this process.
#[derive(Clone, Debug, Default)]
pub(super) struct Signals(Arc<Shared>);

impl Signals {
    /// Takes the signals from now on; else why not.
    pub(super) fn take(&self) -> Result<(), String> {
        let signals = self.clone();
        listen(move |by_hand| signals.on_signal(by_hand))
    }

    /// The flag that the first one raises.
    pub(super) fn stop_flag(&self) -> &AtomicBool {
        &self.0.stop
    }

    /// How often Ctrl-C was pressed.
    pub(super) fn count(&self) -> u32 {
        self.0.count.load(Ordering::SeqCst)
    }

    /// Drones are in the air, and these words say what becomes of them when the program is ended
    /// all the same; `None`: there are none any more.
    pub(super) fn set_flies(&self, words: Option<&'static str>) {
        let last = self.count() + MOST_UNANSWERED;
        *self.air() = words.map(|words| Air { words, last });
    }

    /// The next one ends the program, whatever it is at.
    pub(super) fn next_ends(&self) {
        let count = self.count();
        if let Some(air) = self.air().as_mut() {
            air.last = count + 1;
        }
    }

    fn air(&self) -> std::sync::MutexGuard<'_, Option<Air>> {
        self.0.air.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn on_signal(&self, by_hand: bool) {
        self.0.stop.store(true, Ordering::SeqCst);
        if !by_hand {
            return;
        }
        let count = self.0.count.fetch_add(1, Ordering::SeqCst) + 1;
        let air = *self.air();
        match air {
            Some(air) if count >= air.last => {
                complain(air.words);
                std::process::exit(Exit::Interrupted as i32);
            }
            // Unfinished files are temporary and swept later.
            None if count >= 2 => std::process::abort(),
            _ => {}
        }
    }
}

#[cfg(unix)]
fn listen(mut on_signal: impl FnMut(bool) + Send + 'static) -> Result<(), String> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut wanted = vec![SIGINT, SIGTERM];
    // `nohup` has it ignored, for a program that is to go on without its terminal.
    if !is_ignored(SIGHUP) {
        wanted.push(SIGHUP);
    }
    let mut signals =
        signal_hook::iterator::Signals::new(wanted).map_err(|error| error.to_string())?;
    let listen = move || signals.forever().for_each(|signal| on_signal(signal == SIGINT));
    let thread = std::thread::Builder::new().name("signals".to_owned()).spawn(listen);
    thread.map(drop).map_err(|error| error.to_string())
}

/// Whether a signal was ignored when the program began, where the system tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|digits| u64::from_str_radix(digits.trim(), 16).ok());
    ignored.is_some_and(|bits| bits >> (signal - 1) & 1 == 1)
}

#[cfg(not(unix))]
fn listen(mut on_signal: impl FnMut(bool) + Send + 'static) -> Result<(), String> {
    ctrlc::set_handler(move || on_signal(true)).map_err(|error| error.to_string())
}
