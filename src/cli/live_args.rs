//! `--live`: a flight in a browser while it goes on.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use rand::TryRng as _;
use rand::rngs::SysRng;

use super::context::Context;
use super::exit::CommandError;
use crate::base::causes::with_causes;
use crate::campaign::FlightFolder;
use crate::live::source::Source;
use crate::live::station::Station;
use crate::live::view::{Level, Step};
use crate::mission::Plan;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;
use crate::workflow::live::{Address, AirWatch, AirWish, LiveWish, Served, recall, serve};

/// How a page is served.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Live page")]
pub(super) struct LiveArgs {
    /// Serve a page that shows the flight as it happens, at 127.0.0.1:8700 or another IP address, port or
    /// both; its address is printed
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1")]
    live: Option<Address>,
    /// Print a second address of the page, from which the start can be authorized and drones ordered down
    #[arg(long, requires = "live")]
    live_orders: bool,
    /// The campaign, or analysis.json, with the calibration by which the page tells the air in a measurement flight
    /// [default: the campaign's]
    #[arg(long, value_name = "FILE", requires = "live")]
    law: Option<PathBuf>,
}

/// A page that shows a flight, if one is wished for.
pub(super) struct Live {
    /// What it shows.
    pub(super) station: Option<Arc<Station>>,
    /// Whether it may order.
    pub(super) orders: bool,
    air: Option<AirWatch>,
    _served: Option<Served>,
}

/// Random bytes of the operating system.
pub(super) fn random(bytes: &mut [u8]) -> io::Result<()> {
    SysRng.try_fill_bytes(bytes).map_err(io::Error::other)
}

impl Live {
    /// The logs of the flight are home: the page shows what they say of the air.
    pub(super) fn show_logs(&mut self, host: &dyn Host) {
        if let Some(air) = &mut self.air {
            air.show_logs(host);
        }
    }
}

impl Live {
    /// Says how it ended, in the words of the terminal.
    pub(super) fn tell_end<T>(&self, ended: &Result<T, WorkflowError>) {
        let (Some(station), Err(error)) = (&self.station, ended) else { return };
        let words = with_causes(error, ": ");
        station.say(Level::Alarm, &words);
        station.step(Step::Over, &format!("The station has ended: {words}"));
    }
}

impl LiveArgs {
    /// Refuses where there is nothing to show.
    pub(super) fn refuse(&self, why: &str) -> Result<(), CommandError> {
        match self.live {
            Some(_) => Err(CommandError::Usage(format!("--live: {why}"))),
            None => Ok(()),
        }
    }

    /// Serves the page of a flight, if one is wished for.
    pub(super) fn open(
        &self,
        context: &Context,
        campaign: &Path,
        folder: &FlightFolder,
        plan: &Plan,
    ) -> Result<Live, CommandError> {
        let Some(address) = self.live else {
            return Ok(Live { station: None, orders: false, air: None, _served: None });
        };
        let clock = Arc::clone(context.clock());
        let station = Arc::new(Station::new(plan, folder.0.clone(), clock));
        let wish = LiveWish { address, orders: self.live_orders, random };
        let wish_of_air = AirWish {
            campaign: campaign.to_owned(),
            folder: folder.clone(),
            law: self.law.clone(),
        };
        let air = AirWatch::begin(context, &station, plan, &wish_of_air)?;
        let source = Arc::clone(&station);
        let source: Arc<dyn Source> = source;
        recall(context, &station, folder, plan);
        let served = serve(context, campaign, &folder.0, &source, &wish)?;
        Ok(Live { station: Some(station), orders: self.live_orders, air, _served: Some(served) })
    }
}
