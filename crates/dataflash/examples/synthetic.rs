//! Writes a log with a minute of attitude: `cargo run -p dataflash --example synthetic -- OUT.BIN`.

use std::error::Error;
use std::fs::File;

use dataflash::{LogWriter, Value, catalog};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: synthetic OUT.BIN")?;
    let mut log = LogWriter::new(File::create(path)?, &[&catalog::MODE, &catalog::ATT])?;
    for step in 0..600_u32 {
        let time_s = f64::from(step) / 10.0;
        let roll_deg = 5.0 * (time_s / 2.0).sin();
        let attitude = [roll_deg, roll_deg, 0.0, 0.0, 90.0, 90.0, 0.0, 0.0].map(Value::Float);
        let mut row = vec![Value::Int(i64::from(step) * 100_000)];
        row.extend(attitude);
        row.push(Value::Int(3));
        log.row(&catalog::ATT, &row)?;
    }
    log.finish()?;
    Ok(())
}
