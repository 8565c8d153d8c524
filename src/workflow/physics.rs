//! Simulated bodies and air for unmodified ArduCopter simulators.

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use nalgebra::Vector3;

use super::air::ReadAir;
use super::clock::Stopwatch;
use super::error::WorkflowError;
use super::host::Host;
use crate::base::file::write_whole;
use crate::base::frame::{Geodetic, ShowFrame};
use crate::base::plain::Shown as _;
use crate::campaign;
use crate::effects::definition::Hook;
use crate::effects::select::{choose, known, resolved};
use crate::sim::Atmosphere;
use crate::sim::air::spec::Air;
use crate::sim::json::{Instance, InstanceSetup, PORTS_PER_INSTANCE, Refusal, Status, serve};
use crate::vehicle::{Vehicle, library};

/// ArduPilot's own home when it is not told another: latitude, longitude, m above sea level, heading.
const ARDUPILOT_HOME: [f64; 4] = [-35.363261, 149.165230, 584.0, 353.0];
/// Most instances of one program: each is a thread and a socket.
const MAX_INSTANCES: usize = 500;
/// Folder of the air that the instances met.
const TRUTH: &str = "physics-truth";
/// The stop request and the clock are looked at so often.
const LOOK: Duration = Duration::from_millis(100);

/// Request for instances that simulate the physics of ArduCopter's simulators.
#[derive(Clone, Debug)]
pub struct Physics {
    /// Address and port of the first instance; port 0: any free port for each.
    pub listen: SocketAddr,
    /// Number of instances; `None`: one for each slot of the campaign, or one without a campaign.
    pub instances: Option<usize>,
    /// Campaign folder: instance 0 stands at slot 1, and so on.
    pub campaign: Option<PathBuf>,
    /// Name of the campaign's flight; `None`: the first.
    pub flight: Option<String>,
    /// Place at which every instance stands without a campaign.
    pub home: Option<Home>,
    /// Vehicle, a built-in name or a file; `None`: the campaign's.
    pub vehicle: Option<String>,
    /// Choices of effects, over the vehicle's own: `NAME`, `NAME=off`, `NAME.PARAMETER=NUMBER`.
    pub effects: Vec<String>,
    /// Whether the air that each instance meets is written down.
    pub truth: bool,
    /// Motion of the air.
    pub air: Air,
    /// Seed of sensor noise and random air.
    pub seed: u64,
    /// Time between status lines; zero: no status lines.
    pub status_every: Duration,
    /// Simulated time after which an instance ends, s; `None`: when it is stopped.
    pub duration_s: Option<f64>,
}

/// A place and a heading, as ArduPilot's `--home` has them: degrees, m above sea level, degrees
/// clockwise from north.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Home(pub [f64; 4]);

impl Default for Home {
    /// ArduPilot's own.
    fn default() -> Self {
        Self(ARDUPILOT_HOME)
    }
}

impl std::fmt::Display for Home {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [lat, lon, amsl, heading] = self.0;
        write!(f, "{lat:.7},{lon:.7},{amsl},{heading}")
    }
}

/// Outcome of one instance.
#[derive(Clone, Debug)]
pub struct Served {
    /// Address that it listened on.
    pub listen: SocketAddr,
    /// Place and heading at which it stood.
    pub home: Home,
    /// Statistics and state at its end.
    pub status: Status,
    /// Path of the air that it met since its last start, if that was asked for and it flew.
    pub truth: Option<PathBuf>,
}

/// Serves all instances until it is stopped, or all have flown long enough. Returns the vehicle's
/// name and the outcome of each instance.
///
/// # Errors
/// When the campaign, vehicle or effects cannot be used, a socket fails, or the truth cannot be written.
pub fn run(host: &dyn Host, wish: &Physics) -> Result<(String, Vec<Served>), WorkflowError> {
    let fleet = fleet(wish)?;
    let read = ReadAir::open(host, &wish.air, &fleet.frame, None)?;
    let air = read.with_drawn(&wish.air, &fleet.frame, wish.seed, "physics");
    let mut stations = stations(wish, &fleet, &air)?;
    for (index, station) in stations.iter().enumerate() {
        host.say(&format!(
            "instance {index} on {}: arducopter --model JSON:{} -I{index} --home={}",
            station.address,
            station.address.ip(),
            station.home
        ));
    }
    fly(host, wish, &mut stations)?;
    read.check_read()?;
    let mut served = Vec::new();
    for (station, slot) in stations.iter().zip(1..) {
        let truth = station.instance.truth();
        served.push(Served {
            listen: station.address,
            home: station.home,
            status: *station.instance.status(),
            truth: truth.map(|text| write_truth(host, &fleet.place, slot, &text)).transpose()?,
        });
    }
    Ok((fleet.vehicle.name.clone(), served))
}

/// Writes the air that an instance met, below the flight's folder or the current one: apart from the truth
/// of `updraft simulate`, whose seconds are those of the show.
fn write_truth(
    host: &dyn Host,
    place: &Path,
    slot: u16,
    text: &str,
) -> Result<PathBuf, WorkflowError> {
    let path = place.join(TRUTH).join(format!("{slot:02}.csv"));
    write_whole(&path, text.as_bytes())?;
    host.say(&format!("instance {}: the air it met -> {}", slot - 1, path.shown()));
    Ok(path)
}

/// Where the instances stand and what they are.
struct Fleet {
    /// Folder of the flight; empty: there is none.
    place: PathBuf,
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

fn fleet(wish: &Physics) -> Result<Fleet, WorkflowError> {
    let Some(folder) = &wish.campaign else {
        let Home([lat_deg, lon_deg, amsl_m, orientation_deg]) = wish.home.unwrap_or_default();
        let name = wish.vehicle.as_deref().unwrap_or("airsim-generic-quad");
        return Ok(Fleet {
            place: PathBuf::new(),
            vehicle: affected(library::load(name)?, &wish.effects)?,
            frame: ShowFrame { origin: Geodetic { lat_deg, lon_deg, amsl_m }, orientation_deg },
            homes_m: vec![Vector3::zeros(); counted(wish.instances.unwrap_or(1))?],
        });
    };
    for folder in campaign::flights(folder)? {
        let plan = folder.read_plan()?;
        if wish.flight.as_ref().is_some_and(|name| *name != plan.name) {
            continue;
        }
        let vehicle = match &wish.vehicle {
            Some(name) => library::load(name)?,
            None => library::load(&folder.vehicle().to_string_lossy())?,
        };
        let count = counted(wish.instances.unwrap_or(plan.slots.len()))?;
        if count > plan.slots.len() {
            return Err(WorkflowError::Usage(format!(
                "{count} instances, but the flight has {} slots",
                plan.slots.len()
            )));
        }
        let homes_m = plan.slots.iter().take(count).map(|slot| slot.home_m.into()).collect();
        let vehicle = affected(vehicle, &wish.effects)?;
        return Ok(Fleet { place: folder.0, vehicle, frame: plan.site.frame(), homes_m });
    }
    let name = wish.flight.as_deref().unwrap_or_default();
    Err(WorkflowError::Usage(format!("the campaign has no flight \"{name}\"")))
}

/// The vehicle with the effects that were chosen.
fn affected(mut vehicle: Vehicle, choices: &[String]) -> Result<Vehicle, WorkflowError> {
    for choice in choices {
        choose(&mut vehicle, choice)?;
        let name = choice.split(['=', '.']).next().unwrap_or_default().trim();
        let hooks = known(name)?.definition().hooks;
        let is_on = vehicle.effects.get(name).is_some_and(|table| table.on);
        if is_on
            && !hooks.is_empty()
            && hooks.iter().all(|hook| matches!(hook, Hook::Sense | Hook::Log))
        {
            return Err(WorkflowError::Usage(format!(
                "{name} is an error of the autopilot's sensors, and the firmware simulates its own: set its SIM_* parameters instead"
            )));
        }
    }
    resolved(&vehicle)?;
    Ok(vehicle)
}

fn counted(instances: usize) -> Result<usize, WorkflowError> {
    if (1..=MAX_INSTANCES).contains(&instances) {
        Ok(instances)
    } else {
        Err(WorkflowError::Usage(format!(
            "{instances} instances; between 1 and {MAX_INSTANCES} are possible: give --instances"
        )))
    }
}

fn stations<'a>(
    wish: &Physics,
    fleet: &'a Fleet,
    atmosphere: &'a dyn Atmosphere,
) -> Result<Vec<Station<'a>>, WorkflowError> {
    let mut stations = Vec::new();
    for (index, home_m) in fleet.homes_m.iter().enumerate() {
        let mut address = wish.listen;
        if address.port() != 0 {
            let port = usize::from(address.port()) + index * usize::from(PORTS_PER_INSTANCE);
            address.set_port(u16::try_from(port).map_err(|_| {
                WorkflowError::Usage(format!("there is no port {port} for instance {index}"))
            })?);
        }
        let failed = |error: std::io::Error| {
            WorkflowError::Failed(format!(
                "failed to listen on {address}: {error}; is another simulator running?"
            ))
        };
        let socket = UdpSocket::bind(address).map_err(failed)?;
        let instance = Instance::new(InstanceSetup {
            vehicle: &fleet.vehicle,
            home_m: *home_m,
            frame: fleet.frame,
            atmosphere,
            seed: wish.seed,
            drone: (index + 1) as u16,
        });
        let place = fleet.frame.to_geodetic(*home_m);
        let heading_deg = fleet.frame.orientation_deg;
        stations.push(Station {
            address: socket.local_addr().map_err(failed)?,
            socket,
            home: Home([place.lat_deg, place.lon_deg, place.amsl_m, heading_deg]),
            instance: if wish.truth { instance.with_truth() } else { instance },
            status: Mutex::default(),
        });
    }
    Ok(stations)
}

/// Serves all instances, one thread each, until Ctrl-C or the wanted duration.
fn fly(host: &dyn Host, wish: &Physics, stations: &mut [Station<'_>]) -> Result<(), WorkflowError> {
    let over = AtomicBool::new(false);
    let stop = || over.load(Ordering::SeqCst) || host.is_stopped();
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
                    tell(host, index, &last, now, refusal);
                    last = *now;
                    put(status, now);
                });
                served.map_err(|error| {
                    over.store(true, Ordering::SeqCst);
                    WorkflowError::Failed(format!("the socket on {address} failed: {error}"))
                })
            }));
        }
        watch(host, wish, &watched, &stop);
        over.store(true, Ordering::SeqCst);
        threads.into_iter().try_for_each(|thread| {
            thread.join().unwrap_or_else(|_| {
                Err(WorkflowError::Failed("an instance ended unexpectedly".to_owned()))
            })
        })
    })
}

/// Prints status lines until it is time to stop.
fn watch(host: &dyn Host, wish: &Physics, watched: &[&Mutex<Status>], stop: &dyn Fn() -> bool) {
    let watch = Stopwatch::start(host);
    let mut printed_at = Duration::ZERO;
    let mut printed: Vec<Status> = vec![Status::default(); watched.len()];
    while !stop() {
        host.clock().pause(LOOK);
        let now: Vec<Status> = watched.iter().map(|status| got(status)).collect();
        let elapsed = watch.elapsed();
        if !wish.status_every.is_zero() && elapsed >= printed_at + wish.status_every {
            let wall_s = elapsed.saturating_sub(printed_at).as_secs_f64();
            printed_at = elapsed;
            for (index, (now, before)) in now.iter().zip(&mut printed).enumerate() {
                host.say(&status_line(index, before, now, wall_s));
                *before = *now;
            }
        }
        if wish.duration_s.is_some_and(|end_s| now.iter().all(|status| status.time_s >= end_s)) {
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
fn tell(host: &dyn Host, index: usize, before: &Status, now: &Status, refusal: Option<Refusal>) {
    if let (Some(peer), true) = (now.peer, now.starts > before.starts) {
        host.say(&format!("instance {index}: {peer} starts at home"));
    }
    if now.diverged > before.diverged && now.diverged % 1000 == 1 {
        host.warn(&format!(
            "instance {index}: the motion became undefined, the body is back home; check the wind"
        ));
    }
    if let Some(refusal) = refusal
        && now.refused % 1000 == 1
    {
        host.warn(&format!("instance {index}: {refusal} ({} refused so far)", now.refused));
    }
}

fn put(status: &Mutex<Status>, now: &Status) {
    *status.lock().unwrap_or_else(std::sync::PoisonError::into_inner) = *now;
}

fn got(status: &Mutex<Status>) -> Status {
    *status.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
