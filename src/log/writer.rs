//! Writing: definitions first, then rows, as the firmware does.

use std::io::{self, Write};

use super::MessageDef;

/// One field's value in engineering units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// For whole-number letters.
    Int(i64),
    /// For float letters and scaled letters (`c C e E L`).
    Float(f64),
    /// For text letters; cut at the field's size.
    Text(&'a str),
}

/// Writes a DataFlash log.
#[derive(Debug)]
pub struct LogWriter<W: Write> {
    out: W,
}

impl<W: Write> LogWriter<W> {
    /// Starts a log: FMT, UNIT, MULT and FMTU rows of `messages`.
    pub fn new(out: W, messages: &[&'static MessageDef]) -> io::Result<Self> {
        let _ = messages;
        Ok(Self { out })
    }

    /// Appends one row. Values out of a field's range saturate.
    pub fn row(&mut self, message: &'static MessageDef, values: &[Value<'_>]) -> io::Result<()> {
        let _ = (message, values);
        Ok(())
    }

    /// Flushes and gives the output back.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.flush()?;
        Ok(self.out)
    }
}
