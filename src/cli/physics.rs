//! `updraft physics`: our bodies and our air for unmodified ArduCopter simulators.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use schemars::JsonSchema;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::simulate::{AirArgs, updraft};
use crate::sim::json::{BASE_PORT, Status};
use crate::workflow::physics::{self, Home, Physics, Served};

/// Arguments of `updraft physics`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft physics
  updraft physics --updraft 1.5 --wind 5 --home 47.4733,19.0621,190,59
  updraft physics --campaign my-campaign --flight hover --instances 4
  updraft physics --effect rotor-inflow --effect battery.initial_charge=0.8 --truth

Then start ArduCopter's simulator with the --home that is printed for each instance:
  arducopter --model JSON:127.0.0.1 -I0 --home=47.4733,19.0621,190,59
Instance n listens n times ten ports above the first. Ctrl-C stops it. With --truth, the air that each
instance met is written when it ends: physics-truth/01.csv and so on, in the flight's folder or, without
a campaign, in this one; a row per second since the firmware's last start. See docs/sitl.md.")]
#[command(mut_arg("truth", |truth| truth.help("Write the air that each instance met to physics-truth/ (see below)")))]
pub(super) struct PhysicsArgs {
    /// Address and port of the first instance (port 0: any free port for each)
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = SocketAddr::from(([127, 0, 0, 1], BASE_PORT)))]
    listen: SocketAddr,
    /// Number of instances [default: 1; with a campaign, all its slots]
    #[arg(long, value_name = "N")]
    instances: Option<usize>,
    /// Campaign folder: instance 0 stands at slot 1, and so on
    #[arg(long, value_name = "FOLDER", conflicts_with = "home")]
    campaign: Option<PathBuf>,
    /// Flight of the campaign [default: the first]
    #[arg(long, value_name = "NAME", requires = "campaign")]
    flight: Option<String>,
    /// Where every instance stands: degrees, m above sea level, degrees clockwise from north
    #[arg(long, value_name = "LAT,LON,AMSL,HEADING", value_parser = parse_home, allow_hyphen_values = true)]
    home: Option<Home>,
    /// Vehicle: a built-in name or a vehicle file [default: the campaign's]
    #[arg(long, value_name = "NAME")]
    vehicle: Option<String>,
    /// Vertical air speed, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    #[command(flatten)]
    air: AirArgs,
    /// Seconds between status lines (0: none)
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = clap::value_parser!(u64).range(0..=3600))]
    status: u64,
    /// End when every instance has flown this many simulated seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

fn parse_home(text: &str) -> Result<Home, String> {
    let bad =
        || "write it as latitude,longitude,altitude,heading: 47.4733,19.0621,190,59".to_owned();
    let values: Vec<f64> = text
        .split(',')
        .map(|part| part.trim().parse().map_err(|_| bad()))
        .collect::<Result<_, _>>()?;
    match <[f64; 4]>::try_from(values) {
        Ok(home @ [lat, lon, amsl, heading]) => {
            let inside = |value: f64, limit: f64| (-limit..=limit).contains(&value);
            let placed = inside(lat, 89.0) && inside(lon, 180.0);
            if placed && inside(amsl, 10_000.0) && inside(heading, 360.0) {
                Ok(Home(home))
            } else {
                Err(bad())
            }
        }
        Err(_) => Err(bad()),
    }
}

#[derive(Serialize, JsonSchema)]
pub(super) struct PhysicsOutput {
    schema: &'static str,
    vehicle: String,
    instances: Vec<InstanceOutput>,
}

#[derive(Serialize, JsonSchema)]
struct InstanceOutput {
    instance: usize,
    listen: SocketAddr,
    home: [f64; 4],
    #[serde(flatten)]
    status: Status,
    #[serde(skip_serializing_if = "Option::is_none")]
    truth: Option<PathBuf>,
}

pub(super) fn run(context: &Context, args: &PhysicsArgs) -> Result<Exit, CommandError> {
    let wish = Physics {
        listen: args.listen,
        instances: args.instances,
        campaign: args.campaign.clone(),
        flight: args.flight.clone(),
        home: args.home,
        vehicle: args.vehicle.clone(),
        effects: args.air.effects.clone(),
        truth: args.air.truth,
        air: args.air.air(args.updraft),
        seed: args.air.seed,
        status_every: Duration::from_secs(args.status),
        duration_s: args.duration,
    };
    if args.air.full_logs {
        context.warn("--full-logs does nothing here: the firmware writes its own logs");
    }
    let (vehicle, served) = physics::run(context, &wish)?;
    let flown = served.iter().any(|served| served.status.frames > 0);
    if context.json && flown {
        let output = |(instance, served): (usize, Served)| InstanceOutput {
            instance,
            listen: served.listen,
            home: served.home.0,
            status: served.status,
            truth: served.truth,
        };
        let instances = served.into_iter().enumerate().map(output).collect();
        context.print_json(&PhysicsOutput { schema: "updraft.physics/1", vehicle, instances })?;
    }
    Ok(if flown { Exit::Done } else { Exit::Nothing })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_home_is_written_as_ardupilot_writes_it() {
        assert_eq!(parse_home("47.5, 19.25,190,59").unwrap().0, [47.5, 19.25, 190.0, 59.0]);
        let home = Home::default().to_string();
        assert_eq!(home, "-35.3632610,149.1652300,584,353");
        assert_eq!(parse_home(&home).unwrap(), Home::default());
        for bad in ["", "47,19", "47,19,150", "47,19,150,0,0", "91,0,0,0", "a,b,c,d", "nan,0,0,0"] {
            assert!(parse_home(bad).unwrap_err().contains("heading"), "{bad}");
        }
    }
}
