//! What every room uses: frames, time, checksums, estimates, random streams, whole files.

pub mod air;
pub mod causes;
pub mod crc;
pub mod estimate;
pub mod frame;
pub mod json;
pub mod number;
pub mod rng;
pub mod time;

pub use untrusted_io::{file, parse, plain, private};
