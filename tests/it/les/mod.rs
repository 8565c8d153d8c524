//! Flights in the output of large-eddy simulations: a generated sample, read, flown and held against itself.
#![cfg(all(feature = "les", feature = "netcdf"))]

mod flown;
mod read;
mod refused;
pub(crate) mod sample;
