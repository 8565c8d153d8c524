//! What a DataFlash message is: name, field letters, labels, units and multipliers.

use super::letter::Letter;

/// Definition of one message type, as FMT and FMTU rows carry it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MessageDef {
    /// Type byte in this project's logs (other logs assign their own).
    pub id: u8,
    /// Up to 4 characters: `ATT`.
    pub name: &'static str,
    /// One letter per field: `QccccCCCCB`.
    pub format: &'static str,
    /// Comma-separated labels: `TimeUS,DesRoll,...`.
    pub fields: &'static str,
    /// One unit letter per field.
    pub units: &'static str,
    /// One multiplier letter per field.
    pub multipliers: &'static str,
}

/// Bytes that a field letter takes; `None` for an unknown letter.
pub fn letter_size(letter: u8) -> Option<usize> {
    Letter::from_byte(letter).map(Letter::size)
}
