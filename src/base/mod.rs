//! What every room uses: frames, time, checksums, estimates, random streams, whole files.

pub mod air;
pub mod causes;
pub mod crc;
pub mod estimate;
pub mod file;
pub mod frame;
pub mod json;
pub mod number;
pub mod parse;
pub mod plain;
pub mod private;
pub mod rng;
pub mod time;
