//! Runs the program in a folder of its own.

use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Output};
use std::sync::Arc;
use std::time::Duration;

use tempfile::TempDir;
use updraft::workflow::clock::{Clock, S, SharedClock, SystemClock};

/// A ladder of two rungs of 6 s, on a grid of two: a second to fly, even in a debug build.
pub(crate) const SHORT: &[&str] =
    &["--speeds", "1,2", "--leg", "6", "--hover", "4", "--baseline", "10"];

/// Unix time at which the time of a test begins, if it does not take the clock on the wall.
const BEGINS_UNIX_S: u64 = 1_795_300_000;
/// No command of a test goes on for longer, s of the shared clock.
const LONGEST_COMMAND_S: u64 = 3600;
/// A program that has left the shared time ends within this, s on the wall.
const LAST_MOMENT_S: u64 = 30;
/// A test looks this often for what it waits for.
const LOOK: Duration = Duration::from_millis(50);
/// After so long on the wall, a test fails that waits for what nobody does.
const STANDSTILL: Duration = Duration::from_mins(15);

/// A folder to work in, and the program.
pub(crate) struct Bench {
    folder: TempDir,
    time: Option<Time>,
}

/// The clock that a test and its programs share, and the folder of its files.
struct Time {
    clock: SharedClock,
    _folder: TempDir,
}

impl Drop for Bench {
    fn drop(&mut self) {
        if let Some(time) = &self.time {
            time.clock.leave();
        }
    }
}

/// What the program said and how it ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) code: Option<i32>,
    pub(crate) out: String,
    pub(crate) err: String,
}

impl Bench {
    pub(crate) fn new() -> Self {
        Self { folder: tempfile::tempdir().unwrap(), time: None }
    }

    /// The same with a clock that the test and all its programs share: it goes on only while all of
    /// them wait. The release build of the program has the clock on the wall only.
    pub(crate) fn with_shared_clock() -> Self {
        let mut bench = Self::new();
        if cfg!(debug_assertions) {
            let folder = tempfile::tempdir().unwrap();
            let clock = SharedClock::open(BEGINS_UNIX_S, &folder.path().join("time")).unwrap();
            clock.join();
            bench.time = Some(Time { clock, _folder: folder });
        }
        bench
    }

    /// The clock that a command with these arguments shares: drones and station in one program have a
    /// time of their own.
    fn clock_of(&self, args: &[&str]) -> Option<&SharedClock> {
        let time = self.time.as_ref()?;
        (!args.contains(&"sim")).then_some(&time.clock)
    }

    /// The clock of the test's programs.
    pub(crate) fn clock(&self) -> Arc<dyn Clock> {
        match &self.time {
            Some(time) => Arc::new(time.clock.clone()),
            None => Arc::new(SystemClock::start()),
        }
    }

    /// Waits until `found` finds something, for `longest_s` at most.
    pub(crate) fn wait_for<T>(
        &self,
        longest_s: u64,
        mut found: impl FnMut() -> Option<T>,
    ) -> Option<T> {
        let clock = self.clock();
        let begun = clock.now();
        let on_the_wall = SystemClock::start();
        loop {
            let it = found();
            if it.is_some() || clock.now() - begun > longest_s * S {
                return it;
            }
            clock.wait(LOOK, &mut |time| {
                std::thread::sleep(time);
                let waited = Duration::from_micros(on_the_wall.now());
                assert!(
                    waited < STANDSTILL,
                    "somebody neither waits nor leaves: time stands still"
                );
                false
            });
        }
    }

    /// Waits for the end of a program, for `longest_s` at most. Who ends leaves the shared time a little before, and
    /// that time then flies: the last moment is on the wall.
    pub(crate) fn end_of(&self, child: &mut Child, longest_s: u64) -> Option<ExitStatus> {
        let ended = self.wait_for(longest_s, || child.try_wait().unwrap());
        ended.or_else(|| {
            let on_the_wall = SystemClock::start();
            loop {
                let ended = child.try_wait().unwrap();
                if ended.is_some() || on_the_wall.now() > LAST_MOMENT_S * S {
                    return ended;
                }
                std::thread::sleep(Duration::from_millis(20));
            }
        })
    }

    /// Does both at the same time, in threads of their own.
    pub(crate) fn together<A: Send, B: Send>(
        &self,
        one: impl FnOnce() -> A + Send,
        other: impl FnOnce() -> B + Send,
    ) -> (A, B) {
        std::thread::scope(|scope| {
            let (one, other) = (scope.spawn(one), scope.spawn(other));
            // Whoever just joined a thread would not wait on the clock, and time would stand still.
            let end = || (one.is_finished() && other.is_finished()).then_some(());
            self.wait_for(LONGEST_COMMAND_S, end).expect("both end");
            (one.join().unwrap(), other.join().unwrap())
        })
    }

    /// Waits, s.
    pub(crate) fn pause(&self, time_s: u64) {
        self.clock().pause(Duration::from_secs(time_s));
    }

    /// Starts the program; it takes part in the shared time when this returns, or has ended.
    pub(crate) fn start(&self, command: &mut Command) -> Child {
        let mut child = command.spawn().unwrap();
        if let Some(time) = &self.time {
            while !time.clock.has_joined(child.id()) && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_millis(1));
            }
        }
        child
    }

    pub(crate) fn path(&self, below: &str) -> PathBuf {
        self.folder.path().join(below)
    }

    /// The program, in the folder, without the caller's environment.
    pub(crate) fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_updraft"));
        command
            .args(args)
            .current_dir(self.folder.path())
            .env_remove("NO_COLOR")
            .env_remove("UPDRAFT_NO_PROGRESS")
            .env("COLUMNS", "120");
        if let Some(clock) = self.clock_of(args) {
            command.arg("--shared-clock").arg(clock.argument());
        }
        command
    }

    pub(crate) fn run(&self, args: &[&str]) -> Ended {
        let mut command = self.command(args);
        if self.clock_of(args).is_none() {
            return Ended::of(&command.output().unwrap());
        }
        let (mut out, mut err) = (tempfile::tempfile().unwrap(), tempfile::tempfile().unwrap());
        command.stdout(out.try_clone().unwrap()).stderr(err.try_clone().unwrap());
        let mut child = self.start(&mut command);
        let status = self.end_of(&mut child, LONGEST_COMMAND_S).expect("it goes on");
        let read = |file: &mut File| {
            let mut bytes = Vec::new();
            file.rewind().unwrap();
            file.read_to_end(&mut bytes).unwrap();
            bytes
        };
        Ended::of(&Output { status, stdout: read(&mut out), stderr: read(&mut err) })
    }

    /// The same, which must end with this code.
    pub(crate) fn expect(&self, code: i32, args: &[&str]) -> Ended {
        let ended = self.run(args);
        assert_eq!(ended.code, Some(code), "updraft {}\n{ended}", args.join(" "));
        ended
    }

    /// Plans the short calibration on a grid of 1 x 2 into `campaign`.
    pub(crate) fn plan(&self) -> Ended {
        let args = ["plan", "calibration", "--grid", "1x2", "-o", "campaign"];
        self.expect(0, &[&args[..], SHORT].concat())
    }

    /// Plans and flies it.
    pub(crate) fn fly(&self) {
        self.plan();
        self.expect(0, &["simulate", "campaign"]);
    }
}

impl Ended {
    pub(crate) fn of(output: &Output) -> Self {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        Self { code: output.status.code(), out: text(&output.stdout), err: text(&output.stderr) }
    }

    /// Standard output as JSON with this schema.
    pub(crate) fn json(&self, schema: &str) -> serde_json::Value {
        let value: serde_json::Value = serde_json::from_str(&self.out).unwrap();
        assert_eq!(value["schema"], schema);
        value
    }
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "exit {:?}\n-- out\n{}-- err\n{}", self.code, self.out, self.err)
    }
}

/// All files below a folder with their content, by path.
pub(crate) fn contents(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let content = std::fs::read(&path).unwrap();
                found.push((path, content));
            }
        }
    }
    found.sort();
    found
}
