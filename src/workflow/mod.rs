//! Workflows of people with drones, step by step, for any program: plan a campaign, check it, fly
//! it in the simulator or for real, bring the logs home, analyse them, and look for missing
//! physics.
//!
//! The command line is one such program; this room knows nothing of arguments, terminals and exit
//! codes. Whoever runs a workflow is its [`host::Host`]: it hears what happens, has the clock, and may
//! stop the work. Errors are values ([`error::WorkflowError`]); how work ended that did not fail is an
//! [`ending::Ending`].
//!
//! A campaign that is planned, simulated and analysed (`examples/campaign.rs` of the repository):
//!
//! ```no_run
//! use updraft::campaign;
//! use updraft::sim::air::spec::Air;
//! use updraft::workflow::analyze::{Settings, analyze_campaign};
//! use updraft::workflow::host::Quiet;
//! use updraft::workflow::simulate::{Simulation, simulate};
//! use updraft::workflow::{mission, plan};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let (host, folder) = (Quiet::default(), std::path::Path::new("my-campaign"));
//! let mission = mission::resolve("campaign", &[])?;
//! plan::write(&host, &mission, &plan::shows(&mission), folder, false)?;
//! for flight in campaign::flights(folder)? {
//!     let air = Air::new([0.0, 0.0, 0.5], &[]);
//!     simulate(&host, &flight, &flight.read_plan()?, &Simulation::new(air, 1))?;
//! }
//! let analysed = analyze_campaign(&host, folder, &Settings::default())?;
//! println!("{} logs were used", analysed.used());
//! # Ok(())
//! # }
//! ```

pub(crate) mod air;
mod analysis_file;
pub mod analyze;
pub mod archive;
pub mod basemap;
pub mod blind;
pub mod check;
pub mod clock;
pub mod cluster;
pub mod compare;
pub mod ending;
pub mod error;
pub mod find;
pub mod fleet;
pub mod game;
pub mod gap;
pub mod hashes;
pub mod hidden;
pub mod host;
pub(crate) mod live;
pub mod mast;
pub mod mission;
mod pages;
pub mod paper;
pub mod physics;
pub mod plan;
mod provenance;
pub mod run;
pub mod sensitivity;
pub mod share;
mod shared_clock;
pub mod shows;
pub mod simulate;
pub mod slots;
pub mod study;
pub(crate) mod times;
pub(crate) mod wind_forms;
pub(crate) mod words;

/// Program and version, for records.
pub(crate) fn made_by() -> String {
    concat!("updraft ", env!("CARGO_PKG_VERSION")).to_owned()
}
