//! Writing: definitions first, then rows, as the firmware does.

use std::io::{self, Write};

use super::MessageDef;
use super::catalog;
use super::letter::Letter;
use super::units::{MULTIPLIERS, UNITS};

/// First two bytes of every message.
pub(super) const MAGIC: [u8; 2] = [0xA3, 0x95];

/// A message's length is one byte.
const LONGEST_MESSAGE: usize = 255;

/// Rows gather here before they go out.
const BUFFER_BYTES: usize = 64 * 1024;

/// One field's value in engineering units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value<'a> {
    /// A whole number, for the integer letters.
    Int(i64),
    /// A number, for the float letters and the scaled letters (`c C e E L`), in engineering units.
    Float(f64),
    /// Text, for the text letters; cut at the field's size.
    Text(&'a str),
}

/// Writes a DataFlash log.
///
/// Rows are buffered: a log is whole only after [`LogWriter::finish`].
///
/// A row has a value for each field of its message, and values of the wrong kind are refused:
///
/// ```
/// use dataflash::{LogWriter, Value, catalog};
///
/// # fn main() -> std::io::Result<()> {
/// let mut writer = LogWriter::new(Vec::new(), &[&catalog::MSG])?;
/// assert!(writer.row(&catalog::MSG, &[Value::Int(1_000)]).is_err());
/// writer.row(&catalog::MSG, &[Value::Int(1_000), Value::Text("armed")])?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct LogWriter<W: Write> {
    out: W,
    buffer: Vec<u8>,
    /// Layout of each message type, by its type byte.
    layouts: Vec<Option<Layout>>,
}

#[derive(Clone, Debug)]
struct Layout {
    message: &'static MessageDef,
    letters: Vec<Letter>,
}

impl<W: Write> LogWriter<W> {
    /// Starts a log: FMT, UNIT, MULT and FMTU rows of `messages`.
    ///
    /// The four defining messages are always part of it and need not be listed; listing a message
    /// twice does no harm.
    ///
    /// # Errors
    /// `InvalidInput` for a definition that no log can carry (unknown or unsupported letter, too
    /// long, two messages with one type byte), else the error of `out`.
    pub fn new(out: W, messages: &[&'static MessageDef]) -> io::Result<Self> {
        Self::with_time(out, messages, 0)
    }

    /// Starts a log as [`LogWriter::new`] does; `time_us` is the `TimeUS` of the defining rows, us.
    ///
    /// # Errors
    ///
    /// As [`LogWriter::new`].
    pub fn with_time(out: W, messages: &[&'static MessageDef], time_us: u64) -> io::Result<Self> {
        let defining = [&catalog::FMT, &catalog::UNIT, &catalog::FMTU, &catalog::MULT];
        let mut layouts: Vec<Option<Layout>> = vec![None; 256];
        let mut all: Vec<&'static MessageDef> = Vec::new();
        for &message in defining.iter().chain(messages) {
            let slot = &mut layouts[usize::from(message.id)];
            match slot {
                Some(known) if known.message == message => {}
                Some(known) => {
                    return Err(invalid(format!(
                        "messages {} and {} share type byte {}",
                        known.message.name, message.name, message.id
                    )));
                }
                None => {
                    *slot = Some(Layout { message, letters: check(message)? });
                    all.push(message);
                }
            }
        }
        let buffer = Vec::with_capacity(BUFFER_BYTES + LONGEST_MESSAGE);
        let mut writer = Self { out, buffer, layouts };
        writer.define(&all, i64::try_from(time_us).unwrap_or(i64::MAX))?;
        Ok(writer)
    }

    fn define(&mut self, all: &[&'static MessageDef], time_us: i64) -> io::Result<()> {
        let time = Value::Int(time_us);
        for message in all {
            let length =
                self.layouts[usize::from(message.id)].as_ref().map_or(0, |l| length(&l.letters));
            self.row(
                &catalog::FMT,
                &[
                    Value::Int(message.id.into()),
                    Value::Int(length as i64),
                    Value::Text(message.name),
                    Value::Text(message.format),
                    Value::Text(message.fields),
                ],
            )?;
        }
        for (letter, label) in UNITS {
            self.row(&catalog::UNIT, &[time, Value::Int(letter.into()), Value::Text(label)])?;
        }
        for (letter, factor) in MULTIPLIERS {
            self.row(&catalog::MULT, &[time, Value::Int(letter.into()), Value::Float(factor)])?;
        }
        for message in all {
            self.row(
                &catalog::FMTU,
                &[
                    time,
                    Value::Int(message.id.into()),
                    Value::Text(message.units),
                    Value::Text(message.multipliers),
                ],
            )?;
        }
        Ok(())
    }

    /// Appends one row. Values out of a field's range saturate, whole-number fields round, NaN in
    /// them becomes 0.
    ///
    /// # Errors
    /// `InvalidInput` (and nothing written) if the message was not announced to
    /// [`LogWriter::new`], the number of values differs from the number of fields, or a text meets
    /// a number field or the reverse; else the error of the output.
    pub fn row(&mut self, message: &'static MessageDef, values: &[Value<'_>]) -> io::Result<()> {
        let layout = match &self.layouts[usize::from(message.id)] {
            Some(layout) if std::ptr::eq(layout.message, message) || layout.message == message => {
                layout
            }
            _ => return Err(invalid(format!("{} was not announced to the log", message.name))),
        };
        if values.len() != layout.letters.len() {
            return Err(invalid(format!(
                "{} has {} fields ({}), not {}",
                message.name,
                layout.letters.len(),
                message.fields,
                values.len()
            )));
        }
        let start = self.buffer.len();
        self.buffer.extend_from_slice(&[MAGIC[0], MAGIC[1], message.id]);
        for (index, (letter, value)) in layout.letters.iter().zip(values).enumerate() {
            if !letter.encode(*value, &mut self.buffer) {
                self.buffer.truncate(start);
                let field = message.fields.split(',').nth(index).unwrap_or_default();
                return Err(invalid(format!("{}.{field} cannot hold {value:?}", message.name)));
            }
        }
        if self.buffer.len() >= BUFFER_BYTES {
            self.out.write_all(&self.buffer)?;
            self.buffer.clear();
        }
        Ok(())
    }

    /// Flushes and gives the output back.
    ///
    /// # Errors
    ///
    /// The error of the output.
    pub fn finish(mut self) -> io::Result<W> {
        self.out.write_all(&self.buffer)?;
        self.out.flush()?;
        Ok(self.out)
    }
}

fn invalid(reason: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, reason)
}

fn length(letters: &[Letter]) -> usize {
    3 + letters.iter().map(|letter| letter.size()).sum::<usize>()
}

/// The letters of a definition that a log can carry.
fn check(message: &MessageDef) -> io::Result<Vec<Letter>> {
    let fail = |reason: &str| Err(invalid(format!("message {:?}: {reason}", message.name)));
    if message.name.is_empty() || message.name.len() > 4 {
        return fail("the name must have 1 to 4 characters");
    }
    if message.format.len() > 16 || message.fields.len() > 64 {
        return fail("at most 16 letters and 64 characters of labels fit");
    }
    let count = message.format.len();
    if [message.fields.split(',').count(), message.units.len(), message.multipliers.len()]
        != [count; 3]
    {
        return fail("letters, labels, units and multipliers must be equal in number");
    }
    let mut letters = Vec::with_capacity(count);
    for byte in message.format.bytes() {
        match Letter::from_byte(byte) {
            Some(Letter::Samples | Letter::F16) | None => {
                return fail(&format!("letter {:?} cannot be written", char::from(byte)));
            }
            Some(letter) => letters.push(letter),
        }
    }
    if length(&letters) > LONGEST_MESSAGE {
        return fail("it is longer than 255 bytes");
    }
    Ok(letters)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(message: &'static MessageDef, values: &[Value<'_>]) -> String {
        let mut log = LogWriter::new(Vec::new(), &[&catalog::EV]).unwrap();
        let error = log.row(message, values).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
        let whole = LogWriter::new(Vec::new(), &[&catalog::EV]).unwrap().finish().unwrap();
        assert_eq!(log.finish().unwrap(), whole);
        error.to_string()
    }

    #[test]
    fn bad_rows_are_refused_and_leave_nothing_behind() {
        let time = Value::Int(1);
        assert_eq!(refused(&catalog::EV, &[time]), "EV has 2 fields (TimeUS,Id), not 1");
        assert_eq!(
            refused(&catalog::EV, &[time, Value::Text("x")]),
            "EV.Id cannot hold Text(\"x\")"
        );
        assert_eq!(refused(&catalog::ERR, &[time; 3]), "ERR was not announced to the log");
    }

    #[test]
    fn bad_definitions_are_refused() {
        static CLASH: MessageDef = MessageDef { name: "EV2", ..catalog::EV };
        static LONG: MessageDef = MessageDef { id: 1, name: "EVENT", ..catalog::EV };
        static LETTER: MessageDef = MessageDef { id: 1, format: "Qy", ..catalog::EV };
        static COUNT: MessageDef = MessageDef { id: 1, fields: "TimeUS", ..catalog::EV };
        static BYTES: MessageDef = MessageDef {
            id: 1,
            format: "ZZZZ",
            fields: "A,B,C,D",
            units: "----",
            multipliers: "----",
            name: "BIG",
        };
        for bad in [&CLASH, &LONG, &LETTER, &COUNT, &BYTES] {
            let error = LogWriter::new(Vec::new(), &[&catalog::EV, bad]).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        }
    }

    #[test]
    fn whole_catalog_can_be_announced() {
        LogWriter::new(Vec::new(), catalog::ALL).unwrap();
    }
}
