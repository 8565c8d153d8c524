//! `updraft fleet virtual`: drones to practise with, for this or any other ground station.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::PathBuf;

use clap::Args;

use super::connect::read_key;
use crate::base::time::GpsTime;
use crate::campaign::FlightFolder;
use crate::cli::context::Context;
use crate::cli::exit::{CommandError, Exit};
use crate::cli::simulate::{AirArgs, parse_slots, updraft};
use crate::link::clock::{MS, Micros, S};
use crate::mission::Plan;
use crate::virtual_fleet::lossy::Faults;
use crate::virtual_fleet::server::Pace;
use crate::virtual_fleet::vehicle::BootTimes;
use crate::workflow::air::ReadAir;
use crate::workflow::fleet::hangar::{Hangar, Mishaps};
use crate::workflow::fleet::one_flight;
use crate::workflow::fleet::practice::{cards, serve};
use crate::workflow::simulate::resolved_vehicle;
use crate::workflow::slots::SlotSet;

/// Arguments of `updraft fleet virtual`.
#[derive(Clone, Debug, Args)]
pub(in crate::cli) struct VirtualArgs {
    /// Campaign folder
    campaign: PathBuf,
    /// Which flight to use, if the campaign has several
    #[arg(long, value_name = "NAME")]
    flight: Option<String>,
    /// Where the ground station listens; repeat it for several networks, among which the drones are
    /// divided evenly (a network has 253 system ids)
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:14550")]
    station: Vec<SocketAddr>,
    /// UDP port at which all drones listen for broadcasts, such as Skybrush Server's starts; 0 for
    /// none [default: 14555]
    #[arg(long, value_name = "PORT")]
    broadcast_port: Option<u16>,
    /// File with the signing key: the drones sign every frame, and refuse frames not signed with it
    #[arg(long, value_name = "FILE")]
    key: Option<PathBuf>,
    /// How many times faster than real time the drones' time runs
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    speed: f64,
    /// Share of frames that are lost, each way, 0 to 0.95
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    loss: f64,
    /// Delay each way, ms
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    delay: u64,
    /// Largest random addition to the delay, ms; reorders frames
    #[arg(long, value_name = "MS", default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=10_000))]
    jitter: u64,
    /// Share of frames that arrive twice, 0 to 0.95
    #[arg(long, value_name = "SHARE", default_value_t = 0.0, value_parser = share)]
    repeat: f64,
    /// How much all drones together can send, bytes per second; 0 for no limit
    #[arg(long, value_name = "BYTES", default_value_t = 0)]
    rate: u32,
    /// Boot as slowly as real drones do (45 s to a position)
    #[arg(long)]
    slow_boot: bool,
    /// These slots' drones have stock firmware, without show mode: 1-10,12 [without SLOTS: all]
    #[arg(long, value_name = "SLOTS", num_args = 0..=1, value_parser = parse_slots)]
    #[expect(clippy::option_option, reason = "an option whose value may be left out")]
    stock: Option<Option<SlotSet>>,
    /// Put the campaign's logs on the drones' cards, to practise downloading them
    #[arg(long)]
    flown: bool,
    /// These slots' drones are switched off for good: 1-10,12
    #[arg(long, value_name = "SLOTS", value_parser = parse_slots)]
    gone: Option<SlotSet>,
    /// These slots' drones reboot once: 1-10,12
    #[arg(long, value_name = "SLOTS", value_parser = parse_slots)]
    reboot: Option<SlotSet>,
    /// When --gone and --reboot take effect, s of the drones' time after they are switched on
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = super::connect::seconds)]
    after: f64,
    /// Vertical air speed, m/s, up positive
    #[arg(long, value_name = "MPS", default_value_t = 0.0, value_parser = updraft, allow_hyphen_values = true)]
    updraft: f64,
    #[command(flatten)]
    air: AirArgs,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=0.95).contains(&value) => Ok(value),
        _ => Err("a share between 0 and 0.95".to_owned()),
    }
}

fn mishaps(
    args: &VirtualArgs,
    folder: &FlightFolder,
    plan: &Plan,
) -> Result<Mishaps, CommandError> {
    let named = args.gone.iter().chain(&args.reboot).chain(args.stock.iter().flatten());
    if let Some(slot) = named.into_iter().find_map(|slots| slots.stray(plan)) {
        return Err(CommandError::Usage(format!(
            "the plan has no slot {slot}: it has {}",
            plan.slots.len()
        )));
    }
    let cards = if args.flown { cards(folder, plan)? } else { BTreeMap::new() };
    let at = (args.after * S as f64) as Micros;
    let (gone, reboot, stock) = (args.gone.clone(), args.reboot.clone(), args.stock.clone());
    Ok(Mishaps { gone, reboot, stock, at, cards })
}

pub(in crate::cli) fn run(context: &Context, args: &VirtualArgs) -> Result<Exit, CommandError> {
    let (folder, plan) = one_flight(&args.campaign, args.flight.as_deref())?;
    if args.air.truth {
        return Err(CommandError::Usage(
            "--truth: virtual drones write no truth; `updraft simulate --truth` with the same --air and \
             --seed writes that of the same air"
                .to_owned(),
        ));
    }
    let vehicle = resolved_vehicle(&folder, None, &args.air.effects)?;
    let frame = plan.site.frame();
    let air = args.air.air(args.updraft);
    let slots: Vec<_> = plan.slots.iter().collect();
    let read = ReadAir::of_plan(context, &air, &plan, &slots)?;
    let air = read.with_drawn(&air, &frame, args.air.seed, &plan.name);
    let clock = context.clock();
    let switched_on = GpsTime::from_unix_ms((clock.unix_us() / 1000) as i64).ok_or_else(|| {
        CommandError::Failed("this computer's clock is not set to any GPS time".to_owned())
    })?;
    let mishaps = mishaps(args, &folder, &plan)?;
    let hangar = Hangar {
        plan: &plan,
        slots: plan.slots.iter().collect(),
        vehicle: &vehicle,
        air: &air,
        seed: args.air.seed,
        full_logs: args.air.full_logs,
        boots_by_seed: false,
        switched_on,
        pace: Pace::Speed(args.speed),
        faults: Faults {
            loss: args.loss,
            repeat: args.repeat,
            delay: args.delay * MS,
            jitter: args.jitter * MS,
            bytes_per_s: f64::from(args.rate),
            ..Faults::default()
        },
        boot: if args.slow_boot { BootTimes::default() } else { BootTimes::short() },
        mishaps,
        key: read_key(args.key.as_deref())?,
    };
    serve(context, &hangar, args.station.clone(), args.broadcast_port)?;
    Ok(Exit::Done)
}
