//! Virtual vehicles behind real sockets, in a time of their own.
//!
//! A thread runs all vehicles: it hands them what has come, lets their time go on, flies those
//! that fly (in parallel), and sends what they say. Their time goes as fast as asked for, or as
//! the computer allows while somebody flies; messages never come in shorter rounds than 20 ms.

use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use rayon::prelude::*;
use thiserror::Error;

use super::broadcast::Broadcasts;
use super::faulty::FaultyLink;
use super::lossy::Faults;
use super::post::Post;
use super::vehicle::VirtualVehicle;
use crate::link::clock::{Clock, MS, Micros, S};
use crate::link::signing::{Key, signing_time};

/// Length of a round, wall time.
const ROUND: Micros = 20 * MS;
/// Rounds of file and log transfers follow each other faster.
const TRANSFER_ROUND: Micros = 2 * MS;
/// Longest step of simulated time in one round.
const LONGEST_STEP: Micros = 10 * S;
/// Up to this speed messages are never too close together; above it time goes on in whole rounds.
const SMOOTH_SPEED: f64 = 20.0;
/// Largest datagram that is received, bytes.
const DATAGRAM: usize = 65_536;

/// Speed of the vehicles' time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// A fixed multiple of the speed of wall time.
    Speed(f64),
    /// As fast as the computer allows while a vehicle counts down, flies, or its log is being
    /// written; otherwise a fixed multiple of the speed of wall time.
    Fast {
        /// Multiple of the speed of wall time while nothing flies.
        ground: f64,
    },
}

/// Options for serving a virtual fleet over sockets.
#[derive(Clone, Debug)]
pub struct ServerOptions {
    /// Addresses at which the station listens, network by network; every vehicle sends to the
    /// address of its network from a socket of its own.
    pub stations: Vec<SocketAddr>,
    /// Key with which vehicles sign their messages, refusing those that are not signed with it;
    /// `None`: nothing is signed.
    pub key: Option<Key>,
    /// Speed of the vehicles' time.
    pub pace: Pace,
    /// Faults of each network's link, each way, in wall time.
    pub faults: Faults,
    /// Seed of the link's faults.
    pub seed: u64,
}

/// Error of serving a virtual fleet.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// No socket could be opened for a vehicle.
    #[error("no socket for virtual vehicle {system} to speak to {station}")]
    Socket {
        /// MAVLink system id of the vehicle.
        system: u8,
        /// Address of the station.
        station: SocketAddr,
        /// Reason given by the operating system.
        #[source]
        source: io::Error,
    },
    /// A vehicle is in a network for which the station has no port.
    #[error(
        "virtual vehicle {system} is in network {network}, but the station has {stations} ports: \
         give one for each network"
    )]
    Network {
        /// MAVLink system id of the vehicle.
        system: u8,
        /// Network of the vehicle, from 0.
        network: u16,
        /// Number of networks that have a port.
        stations: usize,
    },
    /// The thread could not be started.
    #[error("no thread for the virtual fleet")]
    Thread(#[source] io::Error),
    /// The speed is not a number above 0 and at most 1000.
    #[error("{0} is not a valid speed: give a number above 0 and at most 1000")]
    Pace(f64),
    /// The thread of the fleet panicked.
    #[error("the virtual fleet has stopped: its thread panicked")]
    Died,
}

/// A fleet while it is being served.
#[derive(Debug)]
pub struct Running {
    end: AtomicBool,
    now: AtomicU64,
    busy: AtomicU64,
    refused: AtomicU64,
}

impl Running {
    /// Present time of the vehicles, us.
    pub fn now(&self) -> Micros {
        self.now.load(Ordering::Relaxed)
    }

    /// Number of vehicles that fly, or whose log is still being written.
    pub fn busy(&self) -> u64 {
        self.busy.load(Ordering::Relaxed)
    }

    /// Number of frames that vehicles refused because they were unsigned, wrongly signed, or
    /// repeated.
    pub fn refused(&self) -> u64 {
        self.refused.load(Ordering::Relaxed)
    }

    /// Ends the service, which is over when [`serve`] returns.
    pub fn stop(&self) {
        self.end.store(true, Ordering::Relaxed);
    }
}

/// Serves a fleet while `body` runs; returns the result of `body`, and the vehicles.
///
/// # Errors
///
/// If a socket cannot be opened, or the service fails; the result of `body` is lost then.
pub fn serve<'w, T>(
    vehicles: Vec<VirtualVehicle<'w>>,
    options: &ServerOptions,
    clock: &dyn Clock,
    body: impl FnOnce(&Running) -> T,
) -> Result<(T, Vec<VirtualVehicle<'w>>), ServerError> {
    serve_with(vehicles, None, options, clock, body)
}

/// Serves a fleet whose vehicles also hear what a station broadcasts at one port.
///
/// # Errors
/// As [`serve`].
pub fn serve_with<'w, T>(
    vehicles: Vec<VirtualVehicle<'w>>,
    broadcasts: Option<&Broadcasts>,
    options: &ServerOptions,
    clock: &dyn Clock,
    body: impl FnOnce(&Running) -> T,
) -> Result<(T, Vec<VirtualVehicle<'w>>), ServerError> {
    let (Pace::Speed(speed) | Pace::Fast { ground: speed }) = options.pace;
    if !(speed > 0.0 && speed <= 1000.0) {
        return Err(ServerError::Pace(speed));
    }
    let time = signing_time(clock.unix_us());
    let mut posts = Vec::with_capacity(vehicles.len());
    for vehicle in vehicles {
        let (system, network) = (vehicle.setup.system, vehicle.setup.network);
        let stations = options.stations.len();
        let Some(&station) = options.stations.get(usize::from(network)) else {
            return Err(ServerError::Network { system, network, stations });
        };
        let post = Post::open(vehicle, station, options.key.as_ref(), time)
            .map_err(|source| ServerError::Socket { system, station, source })?;
        posts.push(post);
    }
    let running = Running {
        end: AtomicBool::new(false),
        now: AtomicU64::new(0),
        busy: AtomicU64::new(0),
        refused: AtomicU64::new(0),
    };
    let (begins, begun) = mpsc::channel();
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .name("virtual fleet".to_owned())
            .spawn_scoped(scope, || {
                // A clock that is shared waits for those who have waited once.
                clock.pause(Duration::ZERO);
                let _ = begins.send(());
                run(posts, broadcasts, options, clock, &running)
            })
            .map_err(ServerError::Thread)?;
        let stop = StopAtEnd(&running);
        begun.recv().map_err(|_| ServerError::Died)?;
        let given = body(&running);
        drop(stop);
        let vehicles = thread.join().map_err(|_| ServerError::Died)?;
        Ok((given, vehicles))
    })
}

/// Stops the service also when the body panics: the scope would wait for ever.
struct StopAtEnd<'a>(&'a Running);

impl Drop for StopAtEnd<'_> {
    fn drop(&mut self) {
        self.0.stop();
    }
}

/// Frames on their way: whose, and what.
type Frame = (usize, Vec<u8>);

fn run<'w>(
    mut posts: Vec<Post<'w>>,
    broadcasts: Option<&Broadcasts>,
    options: &ServerOptions,
    clock: &dyn Clock,
    running: &Running,
) -> Vec<VirtualVehicle<'w>> {
    let links = |direction: u64| -> Vec<FaultyLink<Frame>> {
        let networks = 0..options.stations.len() as u64;
        networks
            .map(|network| FaultyLink::new(options.faults, options.seed, 2 * network + direction))
            .collect()
    };
    let (mut up, mut down) = (links(0), links(1));
    let is_perfect = options.faults.is_none();
    let mut buffer = vec![0; DATAGRAM];
    let mut now: Micros = 0;
    let mut last = clock.now();
    let mut step = ROUND;
    while !running.end.load(Ordering::Relaxed) {
        let begun = clock.now();
        let is_busy = posts.iter().any(Post::is_busy);
        let passed = begun.saturating_sub(last);
        let whole_rounds = match options.pace {
            Pace::Speed(speed) => speed > SMOOTH_SPEED,
            Pace::Fast { .. } => is_busy,
        };
        let goes_on = !whole_rounds || passed >= ROUND;
        if goes_on {
            last = begun;
            now += match options.pace {
                Pace::Speed(speed) => ((passed as f64 * speed) as Micros).min(LONGEST_STEP),
                Pace::Fast { .. } if is_busy => step.max(passed),
                Pace::Fast { ground } => ((passed.min(S) as f64) * ground) as Micros,
            };
        }
        let time = signing_time(clock.unix_us());
        let refused = hear(&mut posts, broadcasts, begun, time, &mut up, &mut buffer);
        running.refused.fetch_add(refused, Ordering::Relaxed);
        let frames: Vec<Vec<Vec<u8>>> = posts
            .par_iter_mut()
            .map(|post| {
                let frames = post.round(now, time);
                if !is_perfect {
                    return frames;
                }
                for frame in &frames {
                    post.send(frame);
                }
                post.flush();
                Vec::new()
            })
            .collect();
        let took = clock.now().saturating_sub(begun);
        if is_busy && goes_on {
            // So long a step that a round takes about as long as it should.
            let grow = ROUND as f64 / took.max(MS / 2) as f64;
            step = ((step as f64 * grow.clamp(0.5, 2.0)) as Micros).clamp(ROUND, LONGEST_STEP);
        } else if !is_busy {
            step = ROUND;
        }
        for (index, frame) in frames
            .into_iter()
            .enumerate()
            .flat_map(|(index, all)| all.into_iter().map(move |frame| (index, frame)))
        {
            let network = usize::from(posts[index].vehicle.setup.network);
            down[network].send(begun, frame.len(), &(index, frame));
        }
        for link in &mut down {
            while let Some((index, frame)) = link.arrived(clock.now()) {
                posts[index].send(&frame);
            }
        }
        posts.iter_mut().for_each(Post::flush);
        running.now.store(now, Ordering::Relaxed);
        let busy = posts.iter().filter(|post| post.is_busy()).count();
        running.busy.store(busy as u64, Ordering::Relaxed);
        let round = if posts.iter().any(|post| post.is_sending) { TRANSFER_ROUND } else { ROUND };
        // Nor does what the links carry wait for a whole round.
        let arrives = up.iter().chain(&down).filter_map(FaultyLink::next).min();
        let until = arrives.unwrap_or(Micros::MAX).max(begun + TRANSFER_ROUND).min(begun + round);
        let left = until.saturating_sub(clock.now());
        // The last sleep of a round looks for requests: an exchange of short packets is quick.
        wait(&posts, broadcasts, running, clock, left);
    }
    posts.into_iter().map(|post| post.vehicle).collect()
}

/// Sleeps, but not for longer than nothing comes.
fn wait(
    posts: &[Post<'_>],
    broadcasts: Option<&Broadcasts>,
    running: &Running,
    clock: &dyn Clock,
    left: Micros,
) {
    let until = clock.now() + left;
    let mut is_over = false;
    while !is_over && clock.now() < until {
        clock.wait(Duration::from_micros(left), &mut |longest| {
            std::thread::sleep(longest.min(Duration::from_micros(MS)));
            is_over = running.end.load(Ordering::Relaxed)
                || posts.iter().any(Post::has_mail)
                || broadcasts.is_some_and(Broadcasts::has_mail);
            is_over
        });
    }
}

/// Takes everything that waits at the sockets; returns how many frames were refused.
fn hear(
    posts: &mut [Post<'_>],
    broadcasts: Option<&Broadcasts>,
    now: Micros,
    time: u64,
    up: &mut [FaultyLink<Frame>],
    buffer: &mut [u8],
) -> u64 {
    for (index, post) in posts.iter().enumerate() {
        let link = &mut up[usize::from(post.vehicle.setup.network)];
        while let Some(bytes) = post.receive(buffer) {
            link.send(now, bytes.len(), &(index, bytes.to_vec()));
        }
    }
    while let Some(bytes) = broadcasts.and_then(|broadcasts| broadcasts.receive(buffer)) {
        // It is on the air once for all drones of a network.
        let mut counted = vec![false; up.len()];
        for (index, post) in posts.iter().enumerate() {
            let network = usize::from(post.vehicle.setup.network);
            let on_air = if counted[network] { 0 } else { bytes.len() };
            counted[network] = true;
            up[network].send(now, on_air, &(index, bytes.to_vec()));
        }
    }
    let mut refused = 0;
    for link in up {
        while let Some((index, bytes)) = link.arrived(now) {
            refused += posts[index].hear(&bytes, time);
        }
    }
    refused
}
