//! The program on a terminal, with somebody who types.

use std::io::Write as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::cli::support::Bench;

/// Runs the program on a terminal and types each answer when it has said what comes before it: its exit
/// code, and all that the terminal showed. `None`: there is no `script` here.
#[expect(clippy::disallowed_methods, reason = "the program under test has the real clock")]
pub(crate) fn on_a_terminal(
    bench: &Bench,
    args: &[&str],
    talk: &[(&str, &str)],
) -> Option<(i32, String)> {
    let words: Vec<String> = args.iter().map(|word| format!("'{word}'")).collect();
    let program = env!("CARGO_BIN_EXE_updraft");
    let line =
        format!("trap : INT; '{program}' {}; echo $?, ended with that code", words.join(" "));
    let mut command = Command::new("script");
    command.args(["-q", "-e", "-f", "-c", &line, "typescript"]).current_dir(bench.path(""));
    let _ = std::fs::remove_file(bench.path("typescript"));
    let child = command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
    let mut child = child.ok()?;
    let mut keys = child.stdin.take().unwrap();
    let shown = || {
        let bytes = std::fs::read(bench.path("typescript")).unwrap_or_default();
        // Its first line shows the command.
        let text = String::from_utf8_lossy(&bytes).into_owned();
        text.split_once('\n').map(|(_, shown)| shown.to_owned()).unwrap_or_default()
    };
    let begun = Instant::now();
    let wait = |text: &str| {
        loop {
            let shown = shown();
            if shown.contains(text) {
                return;
            }
            let is_there =
                !shown.contains("ended with ") && begun.elapsed() < Duration::from_mins(2);
            assert!(is_there, "no {text:?}:\n{shown}");
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    for (said, typed) in talk {
        wait(said);
        keys.write_all(typed.as_bytes()).unwrap();
    }
    wait("ended with ");
    drop(keys);
    let _ = child.kill();
    let _ = child.wait();
    let shown = shown();
    let (before, _) = shown.rsplit_once(", ended with").unwrap();
    let digits = before.rsplit(|c: char| !c.is_ascii_digit()).next().unwrap();
    Some((digits.parse().unwrap(), shown))
}
