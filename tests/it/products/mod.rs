//! Files for other programs: tables, NetCDF, maps; read by the programs of those who use them.

mod fields;
mod firmware;
mod maps;
mod netcdf;
pub(crate) mod support;
mod thermals;
