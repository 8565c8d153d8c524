//! **updraft** measures the vertical motion of the air with a swarm of show drones.
//!
//! The data's way through the house is one-directional, and so are the dependencies:
//!
//! ```text
//! mission -> show -> check -> sim | fleet -> log -> flight -> analysis -> gap | study | compare -> report
//! ```
//!
//! Another program can run a campaign through [`workflow`]. Logs, shows, links and the simulator are
//! crates of their own, which this library shows under short names: [`log`] is `dataflash`, [`show`]
//! and [`check`] are of `skybrush-show`, [`link`] and [`protocol`] of `mavlink-station`, [`sim`],
//! [`effects`] and [`vehicle`] of `multirotor-sim`.
//!
//! * [`numeric`]: means, medians, quantiles and straight lines.
//! * [`mission`]: TOML templates become a [`mission::plan::Plan`], the timetable that everything
//!   downstream reads.
//! * [`show`]: plans become trajectories and Skybrush files (`.skyc`, `.skyb`, zipped CSV), and back.
//! * [`check`]: exact safety checks on the trajectory pieces.
//! * [`effects`]: physics beyond the base model, each piece stated once, for simulator and analysis.
//! * [`les`]: the output of large-eddy simulations as air to fly in.
//! * [`sim`]: the embedded simulator flies a show and writes the same `.BIN` logs as a drone.
//! * [`link`], [`protocol`]: MAVLink 2, and what the show protocol's bytes mean.
//! * [`fleet`]: real vehicles: upload, preflight, start, watch, abort, logs.
//! * [`virtual_fleet`]: vehicles that speak as the show firmware does, flown by the simulator.
//! * [`skybrush_server`]: a client of a running Skybrush Server.
//! * [`log`]: the ArduPilot DataFlash format, reader and writer.
//! * [`flight`]: one drone's log as time series in show time.
//! * [`analysis`]: windows, calibration laws, updraft estimates.
//! * [`study`]: the same ladder flown in many airs, as in the paper's simulations.
//! * [`gap`]: which physics a simulation lacks, by measured logs.
//! * [`blind`]: flights with hidden physics that test it.
//! * [`compare`]: campaigns side by side, with tests of what differs.
//! * [`mast`]: a campaign beside a mast.
//! * [`products`]: the measured fields for other programs: tables, NetCDF, maps.
//! * [`report`]: figures, tables and the HTML page.
//! * [`archive`]: many campaigns as one Parquet dataset.
//! * [`live`]: a flight as it happens, or as it was, in a browser.
//! * [`campaign`]: names of the files in a campaign folder.
//! * [`workflow`]: the steps of people with drones, for any program.
//! * [`cli`]: arguments, terminal and exit codes of the program `updraft`.
//!
//! # Conventions
//!
//! SI units in `f64`; the unit is in the name (`_m`, `_mps`, `_us`, `_s`, `_ms`). Vertical velocity
//! and updraft are positive **up** in every public type; NED exists only inside log and wire
//! formats and is converted at that border. Rotor control pulse widths are microseconds.

pub mod analysis;
pub mod archive;
pub mod base;
pub mod blind;
pub mod campaign;
pub mod cli;
pub mod compare;
pub mod fleet;
pub mod flight;
pub mod gap;
pub use dataflash as log;
pub use mavlink_station::{link, protocol};
pub use multirotor_sim::{effects, sim, vehicle};
pub use skybrush_show as show;
pub use skybrush_show::check;
pub mod les;
pub mod live;
pub mod mast;
pub mod mission;
pub mod numeric;
pub mod products;
pub mod report;
pub mod skybrush_server;
pub mod study;
pub mod virtual_fleet;
pub mod workflow;
