//! Definition of a DataFlash message: name, field letters, labels, units and multipliers.

use super::letter::Letter;

/// Definition of one message type, as FMT and FMTU rows carry it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageDef {
    /// Type byte in this project's logs (other logs assign their own).
    pub id: u8,
    /// Name of the message, up to 4 characters: `ATT`.
    pub name: &'static str,
    /// Format letters, one per field: `QccccCCCCB`.
    pub format: &'static str,
    /// Comma-separated labels of the fields: `TimeUS,DesRoll,...`.
    pub fields: &'static str,
    /// Unit letters, one per field.
    pub units: &'static str,
    /// Multiplier letters, one per field.
    pub multipliers: &'static str,
}

/// Size of a field by its format letter, bytes; `None` for an unknown letter.
pub fn letter_size(letter: u8) -> Option<usize> {
    Letter::from_byte(letter).map(Letter::size)
}
