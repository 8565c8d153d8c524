//! Prints a text file of a stranger without letting it drive the terminal:
//! `cargo run -p untrusted-io --example show -- FILE`.

use std::error::Error;
use std::io::{Write as _, stdout};
use std::path::Path;

use untrusted_io::file::read_whole;
use untrusted_io::plain::for_terminal;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: show FILE")?;
    let bytes = read_whole(Path::new(&path), 1 << 20)?;
    let text = String::from_utf8_lossy(&bytes);
    stdout().write_all(for_terminal(&text, false).as_bytes())?;
    Ok(())
}
