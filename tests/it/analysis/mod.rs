//! Windows, laws, their fits and the map, against published and simulated truth.

mod coverage;
mod fleet;
mod flight;
mod foreign_maps;
mod ladder;
mod law;
mod nist;
pub(crate) mod support;
mod table_two;
mod windows;
