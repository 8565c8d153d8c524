//! `updraft live`: a flight in a browser, from its logs and its journal.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::live_args::random;
use crate::campaign::origin::LogOrigin;
use crate::live::player::SPEEDS;
use crate::workflow::live::{Address, LiveWish, ReplayWish, replay};
use crate::workflow::words::count;

/// How often Ctrl-C is looked for.
const PAUSE: Duration = Duration::from_millis(100);

/// Arguments of `updraft live`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft live my-campaign                        # the last flight that has logs
  updraft live my-campaign --flight hover --speed 10
  updraft live my-campaign --listen 192.168.1.7:8700   # for others in the network

The page has a slider for the time, a choice of speeds, the board and the map as they were in flight, what
the station said by show time (fleet-journal.ndjson), and the air as it was analysed, if the campaign was
(`updraft analyze`). Without logs there is the journal alone. It is served until Ctrl-C.
A flight that is in the air is shown by `updraft fly --live` or `updraft fleet watch --live`.")]
pub(super) struct LiveCommandArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight to show [default: the last that has logs or, without any, a journal]
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Show the simulated logs, although there are some of real drones
    #[arg(long)]
    simulated: bool,
    /// Times as fast as the flight, 0.1 to 60; the page can change it
    #[arg(long, value_name = "X", default_value_t = 1.0, value_parser = speed)]
    speed: f64,
    /// Serve the page at another IP address, port or both [default: 127.0.0.1:8700, or a free port]
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1", hide_default_value = true)]
    listen: Address,
}

/// Parser of `--speed`.
fn speed(text: &str) -> Result<f64, String> {
    let [least, most] = SPEEDS;
    match text.parse::<f64>() {
        Ok(value) if (least..=most).contains(&value) => Ok(value),
        _ => Err(format!("a number between {least} and {most}")),
    }
}

pub(super) fn run(context: &Context, args: &LiveCommandArgs) -> Result<Exit, CommandError> {
    let wish = ReplayWish {
        campaign: args.campaign.clone(),
        flight: args.flight.clone(),
        origin: args.simulated.then_some(LogOrigin::Simulated),
        speed: args.speed,
    };
    let live = LiveWish { address: args.listen, orders: false, random };
    let replayed = replay(context, &wish, &live)?;
    let drones = match replayed.drones {
        (logged, 0) => count(logged, "drone"),
        (0, told) => {
            format!("{}, by the journal alone: where they were only logs say", count(told, "drone"))
        }
        (logged, told) => {
            format!("{}, and {told} more by the journal alone", count(logged, "drone"))
        }
    };
    context.say(&format!("Replay of {} with {drones}; Ctrl-C ends it", replayed.flight));
    while !context.host().is_stopped() {
        std::thread::sleep(PAUSE);
    }
    Ok(Exit::Done)
}
