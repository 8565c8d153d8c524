//! Says what is in a log and what of it is damaged: `cargo run -p dataflash --example damage -- LOG.BIN`.

use std::error::Error;
use std::io::{Write as _, stdout};
use std::path::Path;

use dataflash::Log;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: damage LOG.BIN")?;
    let inventory = Log::open(Path::new(&path))?.inventory();
    let mut out = stdout().lock();
    for message in &inventory.messages {
        writeln!(out, "{:>8}  {}", message.count, message.name)?;
    }
    let damage = inventory.stats;
    writeln!(
        out,
        "{} bytes that are no message, {} bytes cut off at the end, {} messages of unknown types, {} \
         jumps of time",
        damage.bad_bytes, damage.truncated_bytes, damage.unknown, damage.time_jumps
    )?;
    Ok(())
}
