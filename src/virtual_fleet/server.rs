//! Virtual vehicles behind real sockets, in a time of their own.
//!
//! A thread runs all vehicles: it hands them what has come, lets their time go on, flies those
//! that fly (in parallel), and sends what they say. Their time goes as fast as asked for, or as
//! the computer allows while somebody flies; messages never come in shorter rounds than 20 ms.

use std::io;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;

use rayon::prelude::*;
use thiserror::Error;

use super::endpoint::Endpoint as _;
use super::faulty::FaultyLink;
use super::lossy::Faults;
use super::vehicle::VirtualVehicle;
use crate::link::clock::{Clock, MS, Micros, S};
use crate::link::frame::{FrameReader, MavMessage, Sender, encode};
use crate::link::station::AUTOPILOT;

/// Length of a round, wall time.
const ROUND: Micros = 20 * MS;
/// Rounds of file and log transfers follow each other faster.
const TRANSFER_ROUND: Micros = 2 * MS;
/// Longest step of simulated time in one round.
const LONGEST_STEP: Micros = 10 * S;
/// Up to this speed messages are never too close together; above it time goes on in whole rounds.
const SMOOTH_SPEED: f64 = 20.0;
/// Packets that a vehicle may send in one round, in batches of its servers.
const MOST_BATCHES: usize = 16;
/// Largest datagram.
const DATAGRAM: usize = 65_536;

/// How fast the vehicles' time goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// So many times as fast as the clock on the wall.
    Speed(f64),
    /// As fast as the computer allows while a vehicle counts down, flies, or its log is being
    /// written; so many times as fast as the clock on the wall else.
    Fast {
        /// On the ground.
        ground: f64,
    },
}

/// How a fleet is served.
#[derive(Clone, Copy, Debug)]
pub struct ServerOptions {
    /// Where the station listens; every vehicle sends there from a socket of its own.
    pub station: SocketAddr,
    /// How fast time goes.
    pub pace: Pace,
    /// How bad the link is, each way, in wall time.
    pub faults: Faults,
    /// Seed of the link's faults.
    pub seed: u64,
}

/// Why a fleet cannot be served.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ServerError {
    /// A vehicle got no socket.
    #[error("no socket for virtual vehicle {system} to speak to {station}")]
    Socket {
        /// Its system id.
        system: u8,
        /// Where the station is.
        station: SocketAddr,
        /// The system's reason.
        #[source]
        source: io::Error,
    },
    /// The thread could not be started.
    #[error("no thread for the virtual fleet")]
    Thread(#[source] io::Error),
    /// The pace is none.
    #[error("a speed of {0} is none: give a number above 0 and at most 1000")]
    Pace(f64),
    /// The thread died.
    #[error("the virtual fleet has stopped: its thread panicked")]
    Died,
}

/// A fleet that is being served.
#[derive(Debug)]
pub struct Running {
    end: AtomicBool,
    now: AtomicU64,
    busy: AtomicU64,
}

impl Running {
    /// The vehicles' time.
    pub fn now(&self) -> Micros {
        self.now.load(Ordering::Relaxed)
    }

    /// Vehicles that fly, or whose log is still being written.
    pub fn busy(&self) -> u64 {
        self.busy.load(Ordering::Relaxed)
    }

    /// Ends the service; it is over when [`serve`] returns.
    pub fn stop(&self) {
        self.end.store(true, Ordering::Relaxed);
    }
}

/// Serves a fleet while `body` runs; returns what it gave, and the vehicles.
///
/// # Errors
/// When a socket cannot be opened, or the service died; what `body` gave is lost then.
pub fn serve<'w, T>(
    vehicles: Vec<VirtualVehicle<'w>>,
    options: &ServerOptions,
    clock: &dyn Clock,
    body: impl FnOnce(&Running) -> T,
) -> Result<(T, Vec<VirtualVehicle<'w>>), ServerError> {
    let (Pace::Speed(speed) | Pace::Fast { ground: speed }) = options.pace;
    if !(speed > 0.0 && speed <= 1000.0) {
        return Err(ServerError::Pace(speed));
    }
    let mut posts = Vec::with_capacity(vehicles.len());
    for vehicle in vehicles {
        let system = vehicle.setup.system;
        let socket = open(options.station).map_err(|source| ServerError::Socket {
            system,
            station: options.station,
            source,
        })?;
        posts.push(Post {
            vehicle,
            socket,
            sequence: 0,
            inbox: Vec::new(),
            wake: 0,
            is_sending: false,
        });
    }
    let running =
        Running { end: AtomicBool::new(false), now: AtomicU64::new(0), busy: AtomicU64::new(0) };
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new()
            .name("virtual fleet".to_owned())
            .spawn_scoped(scope, || run(posts, options, clock, &running))
            .map_err(ServerError::Thread)?;
        let stop = StopAtEnd(&running);
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

fn open(station: SocketAddr) -> io::Result<UdpSocket> {
    let any: SocketAddr = match (station.is_ipv6(), station.ip().is_loopback()) {
        (false, true) => ([127, 0, 0, 1], 0).into(),
        (false, false) => ([0, 0, 0, 0], 0).into(),
        (true, _) => (std::net::Ipv6Addr::UNSPECIFIED, 0).into(),
    };
    let socket = UdpSocket::bind(any)?;
    socket.set_nonblocking(true)?;
    Ok(socket)
}

/// A vehicle and its socket.
struct Post<'w> {
    vehicle: VirtualVehicle<'w>,
    socket: UdpSocket,
    sequence: u8,
    inbox: Vec<MavMessage>,
    wake: Micros,
    /// Whether a transfer had more to send.
    is_sending: bool,
}

impl Post<'_> {
    fn is_busy(&self) -> bool {
        self.vehicle.is_busy() || self.vehicle.is_writing()
    }

    /// Takes what has come, and goes on to this time; returns the frames to send.
    fn round(&mut self, now: Micros) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        let heard = !self.inbox.is_empty();
        for message in self.inbox.drain(..) {
            self.vehicle.on_message(now, &message, &mut out);
        }
        self.is_sending = false;
        if heard || self.wake <= now {
            for batch in 1..=MOST_BATCHES {
                self.wake = self.vehicle.poll(now, &mut out);
                if self.wake > now {
                    break;
                }
                self.is_sending = batch == MOST_BATCHES;
            }
        }
        let sender = Sender { system: self.vehicle.setup.system, component: AUTOPILOT };
        out.iter()
            .map(|message| {
                let frame = encode(sender, self.sequence, message, None);
                self.sequence = self.sequence.wrapping_add(1);
                frame
            })
            .collect()
    }
}

/// Frames on their way: whose, and what.
type Frame = (usize, Vec<u8>);

fn run<'w>(
    mut posts: Vec<Post<'w>>,
    options: &ServerOptions,
    clock: &dyn Clock,
    running: &Running,
) -> Vec<VirtualVehicle<'w>> {
    let mut up: FaultyLink<Frame> = FaultyLink::new(options.faults, options.seed, 0);
    let mut down: FaultyLink<Frame> = FaultyLink::new(options.faults, options.seed, 1);
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
        hear(&mut posts, begun, &mut up, &mut buffer);
        let frames: Vec<Vec<Vec<u8>>> = posts.par_iter_mut().map(|post| post.round(now)).collect();
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
            down.send(begun, frame.len(), &(index, frame));
        }
        while let Some((index, frame)) = down.arrived(clock.now()) {
            // A full buffer loses it, as a radio does.
            let _ = posts[index].socket.send_to(&frame, options.station);
        }
        running.now.store(now, Ordering::Relaxed);
        let busy = posts.iter().filter(|post| post.is_busy()).count();
        running.busy.store(busy as u64, Ordering::Relaxed);
        let round = if posts.iter().any(|post| post.is_sending) { TRANSFER_ROUND } else { ROUND };
        let left = round.saturating_sub(clock.now().saturating_sub(begun));
        // The last sleep of a round looks for requests: an exchange of short packets is quick.
        wait(&posts, clock, left);
    }
    posts.into_iter().map(|post| post.vehicle).collect()
}

/// Sleeps, but not for longer than nothing comes.
fn wait(posts: &[Post<'_>], clock: &dyn Clock, left: Micros) {
    let until = clock.now() + left;
    let mut peeked = [0; 1];
    while clock.now() < until {
        std::thread::sleep(Duration::from_micros(MS.min(left)));
        if posts.iter().any(|post| post.socket.peek_from(&mut peeked).is_ok()) {
            return;
        }
    }
}

/// Takes everything that waits at the sockets.
fn hear(posts: &mut [Post<'_>], now: Micros, up: &mut FaultyLink<Frame>, buffer: &mut [u8]) {
    for (index, post) in posts.iter().enumerate() {
        // Errors tell of earlier sends: the station is not there (yet).
        while let Ok((size, _)) = post.socket.recv_from(buffer) {
            up.send(now, size, &(index, buffer[..size].to_vec()));
        }
    }
    while let Some((index, bytes)) = up.arrived(now) {
        let mut reader = FrameReader::default();
        reader.push(&bytes);
        while let Some(frame) = reader.next(None) {
            posts[index].inbox.push(frame.message);
        }
    }
}
