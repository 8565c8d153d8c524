//! Prints columns of a log as CSV:
//! `cargo run -p dataflash --example columns -- LOG.BIN ATT TimeUS,Roll,Pitch`.

use std::error::Error;
use std::io::{BufWriter, Write as _, stdout};
use std::path::Path;

use dataflash::{Log, Select};

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [path, message, fields] = args.as_slice() else {
        return Err("usage: columns LOG.BIN MESSAGE FIELD,FIELD,...".into());
    };
    let fields: Vec<&str> = fields.split(',').collect();
    let log = Log::open(Path::new(path))?;
    let (tables, _) = log.select(&[Select { message, fields: &fields }]);
    let Some(table) = tables.first() else { return Ok(()) };
    let mut out = BufWriter::new(stdout().lock());
    writeln!(out, "{}", fields.join(","))?;
    for row in 0..table.rows {
        let cell = |field: &&str| match (table.number(field), table.text(field)) {
            (Some(numbers), _) => numbers.get(row).map(f64::to_string),
            (_, Some(texts)) => texts.get(row).cloned(),
            _ => None,
        };
        let cells: Vec<String> = fields.iter().map(|f| cell(f).unwrap_or_default()).collect();
        writeln!(out, "{}", cells.join(","))?;
    }
    out.flush()?;
    Ok(())
}
