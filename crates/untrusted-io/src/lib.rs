#![doc = include_str!("../README.md")]

pub mod crc;
pub mod file;
pub mod names;
pub mod number;
pub mod owner;
#[cfg(feature = "parse")]
pub mod parse;
pub mod plain;
pub mod private;
