//! The program on a terminal, with somebody who types.

use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::cli::support::Bench;

/// Runs the program on a terminal and types each answer when it has said what comes before it: its exit
/// code, and all that the terminal showed. `None`: there is no `script` here.
pub(crate) fn on_a_terminal(
    bench: &Bench,
    args: &[&str],
    talk: &[(&str, &str)],
) -> Option<(i32, String)> {
    let program = bench.command(args);
    let words: Vec<String> =
        program.get_args().map(|word| format!("'{}'", word.to_str().unwrap())).collect();
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
    let wait = |text: &str| {
        let seen = bench.wait_for(120, || {
            let shown = shown();
            let has = shown.contains(text);
            assert!(has || !shown.contains("ended with "), "no {text:?}:\n{shown}");
            has.then_some(())
        });
        assert!(seen.is_some(), "no {text:?}:\n{}", shown());
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
