//! Foundations that every room uses: frames, time, checksums, estimates, random streams, whole
//! files.

pub mod calendar;
pub mod causes;
pub mod digest;
pub mod estimate;
pub mod json;
pub mod layout;
pub mod markup;
#[cfg(feature = "netcdf-input")]
pub mod netcdf;
pub mod own_folder;
pub(crate) mod said;
pub mod sentence;
pub mod shard;

pub use dataflash::time;
pub use multirotor_sim::{air, rng};
pub use skybrush_show::frame;
pub use untrusted_io::{crc, file, names, number, owner, parse, plain, private};
