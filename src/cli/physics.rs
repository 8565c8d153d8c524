//! `updraft physics`: our bodies and our air for unmodified ArduCopter simulators.

use std::net::{SocketAddr, UdpSocket};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use clap::Args;
use nalgebra::Vector3;
use serde::Serialize;

use super::context::Context;
use super::exit::{CommandError, Exit};
use super::simulate::{AirArgs, updraft};
use crate::base::frame::{Geodetic, ShowFrame};
use crate::campaign;
use crate::sim::Atmosphere;
use crate::sim::air::spec;
use crate::sim::json::{
    BASE_PORT, Instance, InstanceSetup, PORTS_PER_INSTANCE, Refusal, Status, serve,
};
use crate::vehicle::{Vehicle, library};
use crate::workflow::clock::Stopwatch;

/// ArduPilot's own home when it is not told another: latitude, longitude, m above sea level, heading.
const ARDUPILOT_HOME: [f64; 4] = [-35.363261, 149.165230, 584.0, 353.0];
/// Most instances of one program: each is a thread and a socket.
const MAX_INSTANCES: usize = 500;
/// The stop request and the clock are looked at so often.
const LOOK: Duration = Duration::from_millis(100);

/// Arguments of `updraft physics`.
#[derive(Debug, Args)]
#[command(after_long_help = "Examples:
  updraft physics
  updraft physics --updraft 1.5 --wind 5 --home 47.4733,19.0621,190,59
  updraft physics --campaign my-campaign --flight hover --instances 4

Then start ArduCopter's simulator with the --home that is printed for each instance:
  arducopter --model JSON:127.0.0.1 -I0 --home=47.4733,19.0621,190,59
Instance n is expected n times ten ports above the first. Ctrl-C ends it. See docs/sitl.md.")]
pub(super) struct PhysicsArgs {
    /// Address and port of the first instance (port 0: any free port for each)
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = SocketAddr::from(([127, 0, 0, 1], BASE_PORT)))]
    listen: SocketAddr,
    /// Number of instances; with a campaign all its slots unless stated
    #[arg(long, value_name = "N")]
    instances: Option<usize>,
    /// Campaign folder: instance 0 stands at slot 1, and so on
    #[arg(long, value_name = "FOLDER", conflicts_with = "home")]
    campaign: Option<PathBuf>,
    /// Flight of the campaign; the first unless stated
    #[arg(long, value_name = "NAME", requires = "campaign")]
    flight: Option<String>,
    /// Where every instance stands: degrees, m above sea level, degrees clockwise from north
    #[arg(long, value_name = "LAT,LON,AMSL,HEADING", value_parser = parse_home, allow_hyphen_values = true)]
    home: Option<Home>,
    /// Vehicle: a built-in name or a vehicle file; the campaign's unless stated
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
    /// End when every instance has flown so many simulated seconds
    #[arg(long, value_name = "S")]
    duration: Option<f64>,
}

/// A place and a heading, as ArduPilot's `--home` has them.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Home([f64; 4]);

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

impl std::fmt::Display for Home {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [lat, lon, amsl, heading] = self.0;
        write!(f, "{lat:.7},{lon:.7},{amsl},{heading}")
    }
}

/// Where the instances stand and what they are.
struct Fleet {
    vehicle: Vehicle,
    frame: ShowFrame,
    homes_m: Vec<Vector3<f64>>,
}

/// One instance and its socket.
struct Station<'a> {
    socket: UdpSocket,
    address: SocketAddr,
    home: Home,
    instance: Instance<'a>,
    status: Mutex<Status>,
}

#[derive(Serialize)]
struct PhysicsOutput {
    schema: &'static str,
    vehicle: String,
    instances: Vec<InstanceOutput>,
}

#[derive(Serialize)]
struct InstanceOutput {
    instance: usize,
    listen: SocketAddr,
    home: [f64; 4],
    #[serde(flatten)]
    status: Status,
}

pub(super) fn run(context: &Context, args: &PhysicsArgs) -> Result<Exit, CommandError> {
    let fleet = fleet(args)?;
    let air = air(args, &fleet.frame);
    let mut stations = stations(args, &fleet, &*air)?;
    for (index, station) in stations.iter().enumerate() {
        context.say(&format!(
            "instance {index} on {}: arducopter --model JSON:{} -I{index} --home={}",
            station.address,
            station.address.ip(),
            station.home
        ));
    }
    fly(context, args, &mut stations)?;
    let instances: Vec<_> = stations
        .iter()
        .enumerate()
        .map(|(instance, station)| InstanceOutput {
            instance,
            listen: station.address,
            home: station.home.0,
            status: *station.instance.status(),
        })
        .collect();
    let flown = instances.iter().any(|instance| instance.status.frames > 0);
    if context.json {
        let vehicle = fleet.vehicle.name;
        context.print_json(&PhysicsOutput { schema: "updraft.physics/1", vehicle, instances })?;
    }
    Ok(if flown { Exit::Done } else { Exit::Nothing })
}

/// The air that the options ask for.
fn air(args: &PhysicsArgs, frame: &ShowFrame) -> Box<dyn Atmosphere> {
    Box::new(spec::build(&args.air.air(args.updraft), frame, args.air.seed, "physics"))
}

fn fleet(args: &PhysicsArgs) -> Result<Fleet, CommandError> {
    let Some(folder) = &args.campaign else {
        let Home([lat_deg, lon_deg, amsl_m, orientation_deg]) =
            args.home.unwrap_or(Home(ARDUPILOT_HOME));
        let name = args.vehicle.as_deref().unwrap_or("airsim-generic-quad");
        return Ok(Fleet {
            vehicle: library::load(name)?,
            frame: ShowFrame { origin: Geodetic { lat_deg, lon_deg, amsl_m }, orientation_deg },
            homes_m: vec![Vector3::zeros(); counted(args.instances.unwrap_or(1))?],
        });
    };
    for folder in campaign::flights(folder)? {
        let plan = folder.read_plan()?;
        if args.flight.as_ref().is_some_and(|name| *name != plan.name) {
            continue;
        }
        let vehicle = match &args.vehicle {
            Some(name) => library::load(name)?,
            None => library::load(&folder.vehicle().to_string_lossy())?,
        };
        let count = counted(args.instances.unwrap_or(plan.slots.len()))?;
        if count > plan.slots.len() {
            return Err(CommandError::Usage(format!(
                "{count} instances, but the flight has {} slots",
                plan.slots.len()
            )));
        }
        let homes_m = plan.slots.iter().take(count).map(|slot| slot.home_m.into()).collect();
        return Ok(Fleet { vehicle, frame: plan.site.frame(), homes_m });
    }
    let name = args.flight.as_deref().unwrap_or_default();
    Err(CommandError::Usage(format!("the campaign has no flight \"{name}\"")))
}

fn counted(instances: usize) -> Result<usize, CommandError> {
    if (1..=MAX_INSTANCES).contains(&instances) {
        Ok(instances)
    } else {
        Err(CommandError::Usage(format!(
            "{instances} instances; between 1 and {MAX_INSTANCES} are possible: give --instances"
        )))
    }
}

fn stations<'a>(
    args: &PhysicsArgs,
    fleet: &'a Fleet,
    atmosphere: &'a dyn Atmosphere,
) -> Result<Vec<Station<'a>>, CommandError> {
    let mut stations = Vec::new();
    for (index, home_m) in fleet.homes_m.iter().enumerate() {
        let mut address = args.listen;
        if address.port() != 0 {
            let port = usize::from(address.port()) + index * usize::from(PORTS_PER_INSTANCE);
            address.set_port(u16::try_from(port).map_err(|_| {
                CommandError::Usage(format!("there is no port {port} for instance {index}"))
            })?);
        }
        let failed = |error: std::io::Error| {
            CommandError::Failed(format!(
                "failed to listen on {address}: {error}; is another simulator running?"
            ))
        };
        let socket = UdpSocket::bind(address).map_err(failed)?;
        let place = fleet.frame.to_geodetic(*home_m);
        let heading_deg = fleet.frame.orientation_deg;
        stations.push(Station {
            address: socket.local_addr().map_err(failed)?,
            socket,
            home: Home([place.lat_deg, place.lon_deg, place.amsl_m, heading_deg]),
            instance: Instance::new(InstanceSetup {
                vehicle: &fleet.vehicle,
                home_m: *home_m,
                frame: fleet.frame,
                atmosphere,
                seed: args.air.seed,
                drone: (index + 1) as u16,
            }),
            status: Mutex::default(),
        });
    }
    Ok(stations)
}

/// Serves all instances, one thread each, until Ctrl-C or the wanted duration.
fn fly(
    context: &Context,
    args: &PhysicsArgs,
    stations: &mut [Station<'_>],
) -> Result<(), CommandError> {
    let over = AtomicBool::new(false);
    let stop = || over.load(Ordering::SeqCst) || context.stop_flag().load(Ordering::SeqCst);
    thread::scope(|scope| {
        let mut watched = Vec::new();
        let mut threads = Vec::new();
        for (index, station) in stations.iter_mut().enumerate() {
            let Station { socket, instance, status, address, .. } = station;
            let (status, address) = (&*status, *address);
            watched.push(status);
            let (over, stop) = (&over, &stop);
            threads.push(scope.spawn(move || {
                let mut last = Status::default();
                let served = serve(socket, instance, stop, &mut |now, refusal| {
                    tell(context, index, &last, now, refusal);
                    last = *now;
                    put(status, now);
                });
                served.map_err(|error| {
                    over.store(true, Ordering::SeqCst);
                    CommandError::Failed(format!("the socket on {address} failed: {error}"))
                })
            }));
        }
        watch(context, args, &watched, &stop);
        over.store(true, Ordering::SeqCst);
        threads.into_iter().try_for_each(|thread| {
            thread.join().unwrap_or_else(|_| {
                Err(CommandError::Failed("an instance ended unexpectedly".to_owned()))
            })
        })
    })
}

/// Prints status lines until it is time to stop.
fn watch(
    context: &Context,
    args: &PhysicsArgs,
    watched: &[&Mutex<Status>],
    stop: &dyn Fn() -> bool,
) {
    let watch = Stopwatch::start(context);
    let interval = Duration::from_secs(args.status);
    let mut printed_at = Duration::ZERO;
    let mut printed: Vec<Status> = vec![Status::default(); watched.len()];
    while !stop() {
        thread::sleep(LOOK);
        let now: Vec<Status> = watched.iter().map(|status| got(status)).collect();
        let elapsed = watch.elapsed();
        if args.status > 0 && elapsed >= printed_at + interval {
            let wall_s = elapsed.saturating_sub(printed_at).as_secs_f64();
            printed_at = elapsed;
            for (index, (now, before)) in now.iter().zip(&mut printed).enumerate() {
                context.say(&status_line(index, before, now, wall_s));
                *before = *now;
            }
        }
        if args.duration.is_some_and(|end_s| now.iter().all(|status| status.time_s >= end_s)) {
            return;
        }
    }
}

fn status_line(index: usize, before: &Status, now: &Status, wall_s: f64) -> String {
    let Some(peer) = now.peer else {
        return format!("{index}  waiting for a firmware");
    };
    let speed = ((now.time_s - before.time_s) / wall_s).max(0.0);
    format!(
        "{index}  {peer}  {:.1} s at {speed:.1} x real time  {} Hz  frame {}  height {:.2} m  \
         climb {:+.2} m/s  {:.0} us{}",
        now.time_s,
        now.frame_rate_hz,
        now.frames,
        now.height_m,
        now.climb_mps,
        now.pulse_us,
        if now.refused > 0 { format!("  refused {}", now.refused) } else { String::new() },
    )
}

/// Says what happens rarely; of refusals the first and then every thousandth.
fn tell(context: &Context, index: usize, before: &Status, now: &Status, refusal: Option<Refusal>) {
    if let (Some(peer), true) = (now.peer, now.starts > before.starts) {
        context.say(&format!("instance {index}: {peer} starts at home"));
    }
    if now.diverged > before.diverged && now.diverged % 1000 == 1 {
        context.warn(&format!(
            "instance {index}: the motion became undefined, the body is back home; check the wind"
        ));
    }
    if let Some(refusal) = refusal
        && now.refused % 1000 == 1
    {
        context.warn(&format!("instance {index}: {refusal} ({} refused so far)", now.refused));
    }
}

fn put(status: &Mutex<Status>, now: &Status) {
    *status.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = *now;
}

fn got(status: &Mutex<Status>) -> Status {
    *status.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_home_is_written_as_ardupilot_writes_it() {
        assert_eq!(parse_home("47.5, 19.25,190,59").unwrap().0, [47.5, 19.25, 190.0, 59.0]);
        let home = Home(ARDUPILOT_HOME).to_string();
        assert_eq!(home, "-35.3632610,149.1652300,584,353");
        assert_eq!(parse_home(&home).unwrap(), Home(ARDUPILOT_HOME));
        for bad in ["", "47,19", "47,19,150", "47,19,150,0,0", "91,0,0,0", "a,b,c,d", "nan,0,0,0"] {
            assert!(parse_home(bad).unwrap_err().contains("heading"), "{bad}");
        }
    }
}
