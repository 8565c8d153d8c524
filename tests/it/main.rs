//! The program and its library against outside truth: one test program, a folder for each room.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]

mod analysis;
#[cfg(feature = "parquet")]
mod archive;
mod blind;
mod campaign;
mod check;
mod cli;
mod cluster;
mod docs;
mod effects;
mod firmware;
mod fleet;
mod flight;
mod gap;
mod house;
mod les;
mod live;
mod mast;
mod mission;
mod ports;
mod products;
mod report;
mod skybrush_server;
mod statistics;
mod study;
mod turbulence;
mod virtual_fleet;
