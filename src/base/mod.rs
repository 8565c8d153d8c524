//! What every room uses: frames, time, checksums, estimates, random streams, whole files.

pub mod air;
pub mod causes;
pub mod estimate;
pub mod json;
pub mod rng;
pub mod time;

pub use skybrush_show::{crc, frame};
pub use untrusted_io::{file, number, parse, plain, private};
