//! A clock that several programs share, and that goes on only while all of them wait.

use std::cell::RefCell;
use std::ffi::OsString;
use std::fs::{File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::process;
use std::str::FromStr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use super::clock::{Clock, MS, Micros, S};

/// How long somebody who waits looks for input before time may go on, on the wall.
const LOOK: Duration = Duration::from_millis(1);
/// Time goes on in steps of this at most, ms: whoever waits for longer must have looked for input meanwhile.
const STEP_MS: u64 = 100;

/// Counts the threads of this process that have taken part.
static SEATS: AtomicU64 = AtomicU64::new(0);

thread_local! {
    static SEAT: RefCell<Option<Seat>> = const { RefCell::new(None) };
}

/// A clock for tests of whole programs that talk to each other: minutes of waiting are over in seconds, and
/// a computer that is busy with something else delays everyone alike.
///
/// Each thread that waits takes part; time goes on when all of them wait, to the first instant that one
/// waits for. The time is that of a file: as many milliseconds have passed as it is long. Those who take part
/// have locked files beside it, each as long as the instant it waits for, or empty. The lock of one that
/// was killed is gone, and nobody waits for it.
///
/// ```
/// use std::time::Duration;
/// use updraft::workflow::clock::{Clock, SharedClock};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let folder = tempfile::tempdir()?;
/// let clock = SharedClock::open(1_800_000_000, &folder.path().join("time"))?;
/// clock.pause(Duration::from_hours(1));
/// assert_eq!(clock.unix_us(), 1_800_003_600_000_000);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct SharedClock {
    unix_s: u64,
    file: Arc<Mutex<File>>,
    path: PathBuf,
    begun_ms: u64,
}

/// Place of a thread among those who take part.
#[derive(Debug)]
struct Seat {
    clock: PathBuf,
    path: PathBuf,
    file: File,
}

impl Drop for Seat {
    fn drop(&mut self) {
        // A process that cannot remove it leaves it unlocked.
        let _ = std::fs::remove_file(&self.path);
    }
}

impl SharedClock {
    /// A clock that is at `unix_s` when its file is empty; the file is made if it is not there.
    ///
    /// # Errors
    /// When the file cannot be opened.
    pub fn open(unix_s: u64, path: &Path) -> io::Result<Self> {
        let file = File::options().write(true).create(true).truncate(false).open(path)?;
        let begun_ms = file.metadata()?.len();
        Ok(Self { unix_s, file: Arc::new(Mutex::new(file)), path: path.to_owned(), begun_ms })
    }

    /// The clock as an argument of another program, `UNIX_S:FILE`, which is read as text is.
    pub fn argument(&self) -> OsString {
        let mut argument = OsString::from(format!("{}:", self.unix_s));
        argument.push(&self.path);
        argument
    }

    /// Makes this thread one of those who take part: time stands still until it waits. A thread that waits
    /// takes part from then on.
    pub fn join(&self) {
        SEAT.with_borrow_mut(|seat| {
            if seat.as_ref().is_none_or(|seat| seat.clock != self.path) {
                *seat = self.take_seat().ok();
            }
        });
    }

    /// Ends what [`SharedClock::join`] began: nobody waits for this thread any more.
    pub fn leave(&self) {
        SEAT.with_borrow_mut(|seat| seat.take_if(|seat| seat.clock == self.path));
    }

    /// Whether the first thread of this process takes part.
    pub fn has_joined(&self, process: u32) -> bool {
        self.seat_of(process, 0).exists()
    }

    fn seat_of(&self, process: u32, count: u64) -> PathBuf {
        let mut name = self.path.clone().into_os_string();
        name.push(format!(".{process}-{count}"));
        PathBuf::from(name)
    }

    fn take_seat(&self) -> io::Result<Seat> {
        let count = SEATS.fetch_add(1, Ordering::Relaxed);
        let path = self.seat_of(process::id(), count);
        // Nobody sees it before it is locked.
        let hidden = path.with_file_name(format!("new-{}-{count}", process::id()));
        let file = File::create(&hidden)?;
        file.lock()?;
        std::fs::rename(&hidden, &path)?;
        Ok(Seat { clock: self.path.clone(), path, file })
    }

    /// The instants for which those who take part wait, ms; 0 of one that does not wait.
    fn waits(&self) -> impl Iterator<Item = u64> {
        let folder = self.path.parent().unwrap_or(Path::new(".")).to_owned();
        let mut begins = self.path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        begins.push('.');
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        entries.filter_map(move |entry| {
            entry.file_name().to_string_lossy().starts_with(&begins).then_some(())?;
            let file = File::open(entry.path()).ok()?;
            let is_taken = matches!(file.try_lock(), Err(TryLockError::WouldBlock));
            is_taken.then_some(file.metadata().ok()?.len())
        })
    }

    fn time_ms(&self) -> u64 {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.metadata().map_or(0, |data| data.len())
    }

    /// When a wait that begins now ends.
    fn end_of(&self, time: Duration) -> u64 {
        self.time_ms() + (time.as_micros() as u64).div_ceil(MS)
    }

    /// Sets the time forward, in turn with all others.
    fn set_forward(&self, to_ms: impl FnOnce(u64) -> u64) {
        let file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        if file.lock().is_err() {
            return;
        }
        let now = file.metadata().map_or(0, |data| data.len());
        let to = to_ms(now);
        if to > now {
            let _ = file.set_len(to);
        }
        let _ = file.unlock();
    }

    /// Lets time go on if everyone waits.
    fn go_on(&self) {
        self.set_forward(|now| self.waits().min().unwrap_or(now));
    }

    fn set_wait(until_ms: u64) {
        SEAT.with_borrow(|seat| {
            if let Some(seat) = seat {
                let _ = seat.file.set_len(until_ms);
            }
        });
    }
}

impl FromStr for SharedClock {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (unix_s, path) = text.split_once(':').ok_or("UNIX_S:FILE is meant")?;
        let unix_s = unix_s.parse().map_err(|_| "its time is not a number of seconds")?;
        Self::open(unix_s, Path::new(path)).map_err(|error| format!("{path}: {error}"))
    }
}

impl Clock for SharedClock {
    fn now(&self) -> Micros {
        self.time_ms().saturating_sub(self.begun_ms) * MS
    }

    fn unix_us(&self) -> u64 {
        self.unix_s * S + self.time_ms() * MS
    }

    fn pause(&self, time: Duration) {
        self.join();
        let end = self.end_of(time);
        Self::set_wait(end);
        loop {
            self.go_on();
            if self.time_ms() >= end {
                break;
            }
            std::thread::sleep(LOOK);
        }
        Self::set_wait(0);
    }

    fn wait(&self, time: Duration, look: &mut dyn FnMut(Duration) -> bool) {
        self.join();
        let end = self.end_of(time);
        loop {
            let now = self.time_ms();
            Self::set_wait(end.min(now + STEP_MS));
            if now >= end || look(LOOK) {
                break;
            }
            self.go_on();
        }
        Self::set_wait(0);
    }

    fn waited(&self, time: Duration) {
        // Somebody else has worked meanwhile, for as long as it took.
        self.set_forward(|now| now + time.as_millis() as u64);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    fn clock() -> (tempfile::TempDir, SharedClock) {
        let folder = tempfile::tempdir().unwrap();
        let clock = SharedClock::open(1_800_000_000, &folder.path().join("time")).unwrap();
        (folder, clock)
    }

    #[test]
    fn time_stands_still_while_somebody_works_and_goes_to_the_first_wait_that_ends() {
        let (_folder, clock) = clock();
        clock.join();
        let (began, begun) = channel();
        let other = clock.clone();
        let thread = std::thread::spawn(move || {
            other.join();
            began.send(()).unwrap();
            other.pause(Duration::from_secs(5));
            let woke = other.now();
            other.pause(Duration::from_mins(1));
            (woke, other.now())
        });
        begun.recv().unwrap();
        std::thread::sleep(Duration::from_millis(20));
        assert_eq!(clock.now(), 0, "this thread works");
        clock.pause(Duration::from_secs(20));
        assert!((20 * S..65 * S).contains(&clock.now()), "{}", clock.now());
        clock.leave();
        assert_eq!(thread.join().unwrap(), (5 * S, 65 * S));
    }

    #[test]
    fn input_ends_a_wait_and_its_time_stays() {
        let (_folder, clock) = clock();
        let mut looks = 0;
        clock.wait(Duration::from_hours(1), &mut |_| {
            looks += 1;
            looks == 3
        });
        assert_eq!(clock.now(), 2 * STEP_MS * MS, "it looked before each step");
    }

    #[test]
    fn nobody_waits_for_a_program_that_was_killed() {
        let (folder, clock) = clock();
        std::fs::write(folder.path().join("time.77-0"), "").unwrap();
        clock.pause(Duration::from_secs(1));
        assert_eq!(clock.now(), S);
    }

    #[test]
    fn other_programs_read_the_clock_as_an_argument() {
        let (_folder, clock) = clock();
        clock.waited(Duration::from_secs(7));
        let argument = clock.argument().into_string().unwrap();
        let read: SharedClock = argument.parse().unwrap();
        assert_eq!(
            (read.now(), read.unix_us()),
            (0, 1_800_000_007 * S),
            "it counts from its opening"
        );
        assert!("noon".parse::<SharedClock>().is_err() && "x:/tmp".parse::<SharedClock>().is_err());
    }
}
