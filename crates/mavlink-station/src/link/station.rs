//! A ground station on the air: sockets, routes to the vehicles, and its own heartbeat.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

use super::address::Address;
use super::clock::{Clock, Micros, S};
use super::error::NetError;
use super::frame::{Frame, FrameReader, MavMessage, Sender, dialect, encode};
use super::id::DroneId;
use super::net::{Net, Received};
use super::signing::{Key, Signer, Verifier, signing_time};
use super::stamps::{Keeper, Stamps};
use super::traffic::Traffic;
use super::wire::{self, Peer, Receiving, Sending};

/// Identity that crews know from Skybrush Server: system 254, component 190 (mission planner).
pub const STATION: Sender = Sender { system: 254, component: 190 };
/// Component id of a vehicle's autopilot.
pub const AUTOPILOT: u8 = 1;

/// Pieces of input that wait to be looked at; more are dropped by the kernel, not stored here.
const BACKLOG: usize = 16_384;
/// Bytes of them: seconds of what a fast network of drones sends. Of more, datagrams are thrown away
/// and counted, and streams wait at the other end.
const BACKLOG_BYTES: usize = 16 << 20;
/// How long a stream's reader waits for room.
const NO_ROOM: Duration = Duration::from_millis(5);
/// A reader looks up so often whether it is to end.
const READER_LOOK: Duration = Duration::from_millis(200);
/// Longest piece read at once, bytes; a datagram is never longer.
const PIECE: usize = 65_536;
/// A vehicle keeps the way it was heard by until it has been silent there for so long.
const KEEP_ROUTE: Micros = 3 * S;

/// Setup of a station.
pub struct Setup {
    /// Links to open.
    pub links: Vec<Address>,
    /// Signing key: with one, everything that is sent is signed, and messages that are not signed
    /// with it are refused.
    pub key: Option<Key>,
    /// Clock of the station.
    pub clock: Arc<dyn Clock>,
}

/// A station with open links. Its readers end when it is dropped.
pub struct Station {
    ports: Vec<Port>,
    input: Receiver<Piece>,
    routes: BTreeMap<DroneId, Route>,
    /// Vehicles that were also heard from elsewhere while their route was alive.
    doubled: BTreeSet<DroneId>,
    verifier: Option<Verifier>,
    signer: Option<Signer>,
    keeper: Option<Keeper>,
    backlog: Arc<Backlog>,
    traffic: BTreeMap<u16, Traffic>,
    queue: VecDeque<Received>,
    next_heartbeat: Micros,
    clock: Arc<dyn Clock>,
    end: Arc<AtomicBool>,
    readers: Vec<JoinHandle<()>>,
}

struct Port {
    network: u16,
    sending: Box<dyn Sending>,
    sequence: u8,
    stream: Option<FrameReader>,
}

#[derive(Clone, Copy)]
struct Route {
    port: usize,
    peer: Peer,
    heard: Micros,
}

/// What waits to be looked at.
#[derive(Default)]
struct Backlog {
    bytes: AtomicUsize,
    /// Datagrams that were thrown away, by port.
    dropped: Vec<AtomicU64>,
}

enum Piece {
    Bytes { port: usize, peer: Peer, bytes: Vec<u8> },
    Closed { port: usize, reason: String },
}

impl Station {
    /// Opens all links of a station.
    ///
    /// # Errors
    /// When one cannot be opened; the others are closed again.
    pub fn open(setup: Setup) -> Result<Self, NetError> {
        let Setup { links, key, clock } = setup;
        let (output, input) = sync_channel(BACKLOG);
        let time = signing_time(clock.unix_us());
        let backlog = Backlog {
            bytes: AtomicUsize::new(0),
            dropped: links.iter().map(|_| AtomicU64::new(0)).collect(),
        };
        let mut station = Self {
            ports: Vec::new(),
            input,
            routes: BTreeMap::new(),
            doubled: BTreeSet::new(),
            verifier: key.clone().map(|key| Verifier::new(key, time)),
            signer: key.clone().map(|key| Signer::new(key, 1, time)),
            keeper: None,
            backlog: Arc::new(backlog),
            traffic: BTreeMap::new(),
            queue: VecDeque::new(),
            next_heartbeat: 0,
            clock,
            end: Arc::default(),
            readers: Vec::new(),
        };
        if let Some(shelf) = key.as_ref().and_then(Key::shelf) {
            let kept = shelf.keep(&Stamps::default()).map_err(NetError::Stamps)?;
            station.signer.iter_mut().for_each(|signer| signer.go_on_from(&kept));
            station.verifier.iter_mut().for_each(|verifier| verifier.go_on_from(&kept));
            let started = Keeper::start(shelf);
            station.keeper = Some(started.map_err(NetError::NoKeeper)?);
        }
        for (index, address) in links.iter().enumerate() {
            let (sending, receiving) = wire::open(address)?;
            let stream = (!receiving.is_datagram()).then(FrameReader::default);
            let network = address.network;
            station.ports.push(Port { network, sending, sequence: 0, stream });
            station.traffic.entry(network).or_default();
            let (output, end) = (output.clone(), Arc::clone(&station.end));
            let backlog = Arc::clone(&station.backlog);
            let reader = std::thread::Builder::new()
                .name(format!("link {address}"))
                .spawn(move || read(index, receiving, &output, &backlog, &end))
                .map_err(|source| NetError::Thread { address: address.clone(), source })?;
            station.readers.push(reader);
        }
        Ok(station)
    }

    fn take(&mut self, piece: Piece) -> Result<(), NetError> {
        let (port, peer, bytes) = match piece {
            Piece::Bytes { port, peer, bytes } => {
                self.backlog.bytes.fetch_sub(bytes.len(), Ordering::Relaxed);
                (port, peer, bytes)
            }
            Piece::Closed { port, reason } => {
                let network = self.ports[port].network;
                // The others may go on.
                self.routes.retain(|_, route| route.port != port);
                self.ports[port].stream = None;
                return if self.ports.len() == 1 || !self.ports.iter().any(|p| p.network == network)
                {
                    Err(NetError::Closed { reason })
                } else {
                    Ok(())
                };
            }
        };
        let network = self.ports[port].network;
        let mut verifier = self.verifier.as_mut();
        if let Some(verifier) = verifier.as_deref_mut() {
            verifier.advance(signing_time(self.clock.unix_us()));
        }
        let mut datagram = FrameReader::default();
        let is_stream = self.ports[port].stream.is_some();
        let reader = self.ports[port].stream.as_mut().unwrap_or(&mut datagram);
        let (before, signed) = (reader.loss, reader.signed);
        reader.push(&bytes);
        let mut frames = Vec::new();
        while let Some(frame) = reader.next(verifier.as_deref_mut()) {
            frames.push(frame);
        }
        if !is_stream {
            reader.end_of_datagram();
        }
        let (loss, signed) = (reader.loss, reader.signed - signed);
        let traffic = self.traffic.entry(network).or_default();
        traffic.bytes_in += bytes.len() as u64;
        traffic.frames_in += frames.len() as u64;
        traffic.signed += signed;
        traffic.loss.noise_bytes += loss.noise_bytes - before.noise_bytes;
        traffic.loss.version_1 += loss.version_1 - before.version_1;
        traffic.loss.unknown += loss.unknown - before.unknown;
        traffic.loss.unsigned += loss.unsigned - before.unsigned;
        traffic.loss.forged += loss.forged - before.forged;
        for frame in frames {
            self.hear(network, port, peer, frame);
        }
        Ok(())
    }

    fn hear(&mut self, network: u16, port: usize, peer: Peer, frame: Frame) {
        if frame.sender.component != AUTOPILOT || matches!(frame.sender.system, 0 | 254 | 255) {
            return;
        }
        let from = DroneId { network, system: frame.sender.system };
        let now = self.clock.now();
        match self.routes.get_mut(&from) {
            Some(route) if route.port == port && route.peer == peer => route.heard = now,
            Some(route) if now < route.heard + KEEP_ROUTE => {
                self.doubled.insert(from);
                return;
            }
            _ if is_vehicle(&frame.message) => {
                self.routes.insert(from, Route { port, peer, heard: now });
            }
            // Nobody is known before it says who it is.
            _ => return,
        }
        self.queue.push_back(Received { from, message: frame.message });
    }

    fn send_to(&mut self, port: usize, peer: Peer, message: &MavMessage) -> Result<(), NetError> {
        if let Some(signer) = &mut self.signer {
            signer.advance(signing_time(self.clock.unix_us()));
        }
        let Some(port) = self.ports.get_mut(port) else { return Ok(()) };
        let frame = encode(STATION, port.sequence, message, self.signer.as_mut());
        port.sequence = port.sequence.wrapping_add(1);
        self.traffic.entry(port.network).or_default().bytes_out += frame.len() as u64;
        port.sending
            .send(peer, &frame)
            .map_err(|error| NetError::Closed { reason: error.to_string() })
    }

    /// Has the stamps written down, if they are kept.
    fn keep_stamps(&self) {
        if let (Some(keeper), Some(signer), Some(verifier)) =
            (&self.keeper, &self.signer, &self.verifier)
        {
            keeper.keep(Stamps { sent: signer.stamp(), heard: verifier.newest() });
        }
    }

    fn beat(&mut self) -> Result<(), NetError> {
        let now = self.clock.now();
        if now >= self.next_heartbeat {
            self.next_heartbeat = now + S;
            self.broadcast(&heartbeat())?;
            self.keep_stamps();
        }
        Ok(())
    }
}

impl Net for Station {
    fn now(&self) -> Micros {
        self.clock.now()
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        loop {
            self.beat()?;
            if let Some(received) = self.queue.pop_front() {
                return Ok(Some(received));
            }
            let now = self.clock.now();
            let wait = until.min(self.next_heartbeat).saturating_sub(now);
            let mut came = Err(RecvTimeoutError::Timeout);
            self.clock.wait(Duration::from_micros(wait), &mut |longest| {
                came = self.input.recv_timeout(longest);
                !matches!(came, Err(RecvTimeoutError::Timeout))
            });
            match came {
                Ok(piece) => self.take(piece)?,
                Err(RecvTimeoutError::Timeout) if self.clock.now() >= until => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(NetError::Closed { reason: "no link is open".to_owned() });
                }
            }
        }
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        match self.routes.get(&to).copied() {
            Some(route) => self.send_to(route.port, route.peer, message),
            None => Ok(()),
        }
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        let mut ends: BTreeSet<(usize, Peer)> =
            self.routes.values().map(|route| (route.port, route.peer)).collect();
        for (index, port) in self.ports.iter().enumerate() {
            ends.extend(port.sending.first_peer().map(|peer| (index, peer)));
        }
        for (port, peer) in ends {
            self.send_to(port, peer, message)?;
        }
        Ok(())
    }

    fn heard(&self) -> Vec<DroneId> {
        self.routes.keys().copied().collect()
    }

    fn traffic(&self) -> BTreeMap<u16, Traffic> {
        let mut traffic = self.traffic.clone();
        for (port, dropped) in self.ports.iter().zip(&self.backlog.dropped) {
            traffic.entry(port.network).or_default().dropped += dropped.load(Ordering::Relaxed);
        }
        traffic
    }

    fn doubled(&self) -> BTreeSet<DroneId> {
        self.doubled.clone()
    }
}

impl Drop for Station {
    fn drop(&mut self) {
        self.keep_stamps();
        self.end.store(true, Ordering::Relaxed);
        // A full backlog would keep readers from seeing it.
        while self.input.try_recv().is_ok() {}
        for reader in self.readers.drain(..) {
            while !reader.is_finished() {
                while self.input.try_recv().is_ok() {}
                std::thread::yield_now();
            }
            let _ = reader.join();
        }
    }
}

fn read(
    port: usize,
    mut receiving: Box<dyn Receiving>,
    output: &SyncSender<Piece>,
    backlog: &Backlog,
    end: &AtomicBool,
) {
    let mut buffer = vec![0; PIECE];
    let has_room =
        |size: usize| backlog.bytes.load(Ordering::Relaxed).saturating_add(size) <= BACKLOG_BYTES;
    while !end.load(Ordering::Relaxed) {
        let piece = match receiving.recv(&mut buffer, READER_LOOK) {
            Ok(None) => continue,
            Ok(Some((_, size))) if receiving.is_datagram() && !has_room(size) => {
                if let Some(dropped) = backlog.dropped.get(port) {
                    dropped.fetch_add(1, Ordering::Relaxed);
                }
                continue;
            }
            Ok(Some((peer, size))) => {
                while !has_room(size) && !end.load(Ordering::Relaxed) {
                    std::thread::sleep(NO_ROOM);
                }
                backlog.bytes.fetch_add(size, Ordering::Relaxed);
                Piece::Bytes { port, peer, bytes: buffer[..size].to_vec() }
            }
            Err(error) => Piece::Closed { port, reason: error.to_string() },
        };
        let closed = matches!(piece, Piece::Closed { .. });
        if output.send(piece).is_err() || closed {
            return;
        }
    }
}

fn is_vehicle(message: &MavMessage) -> bool {
    matches!(message, MavMessage::HEARTBEAT(beat)
        if beat.autopilot != dialect::MavAutopilot::MAV_AUTOPILOT_INVALID)
}

/// Heartbeat message of the station.
pub fn heartbeat() -> MavMessage {
    MavMessage::HEARTBEAT(dialect::HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: dialect::MavType::MAV_TYPE_GCS,
        autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: dialect::MavModeFlag::empty(),
        system_status: dialect::MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
    })
}

#[cfg(test)]
mod tests {
    use std::net::UdpSocket;

    use super::*;

    /// Time that is asked for and does not pass by itself.
    struct Still(AtomicU64);

    impl Clock for Still {
        fn now(&self) -> Micros {
            self.0.fetch_add(1, Ordering::Relaxed)
        }

        fn unix_us(&self) -> u64 {
            1_700_000_000_000_000
        }
    }

    fn vehicle() -> Vec<u8> {
        let beat = dialect::HEARTBEAT_DATA {
            autopilot: dialect::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            ..Default::default()
        };
        encode(Sender { system: 7, component: 1 }, 0, &MavMessage::HEARTBEAT(beat), None)
    }

    #[test]
    fn a_flood_is_thrown_away_and_told_of() {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let free = UdpSocket::bind("127.0.0.1:0").unwrap();
        let at = free.local_addr().unwrap();
        drop(free);
        let links = vec![format!("3@udpin:{at}").parse().unwrap()];
        let clock = Arc::new(Still(AtomicU64::new(0)));
        let mut station = Station::open(Setup { links, key: None, clock }).unwrap();
        socket.send_to(&vehicle(), at).unwrap();
        let dropped = |station: &Station| station.traffic()[&3].dropped;
        let datagram = vec![0; 60_000];
        let mut sent = 0_usize;
        // Nobody looks at what comes; the system may lose some of it by itself.
        while dropped(&station) < 100 && sent < 100_000 {
            let _ = socket.send_to(&datagram, at);
            sent += 1;
            std::thread::yield_now();
        }
        assert!(dropped(&station) >= 100, "{sent} sent");
        let held = station.backlog.bytes.load(Ordering::Relaxed);
        assert!(held <= BACKLOG_BYTES && held > BACKLOG_BYTES / 2, "{held} bytes");
        let first = station.recv(u64::MAX).unwrap().unwrap();
        assert_eq!(first.from, DroneId { network: 3, system: 7 });
        // All of it can be taken, and there is room again.
        while station.recv(station.clock.now() + 10_000).unwrap().is_some() {}
        while let Ok(piece) = station.input.try_recv() {
            station.take(piece).unwrap();
        }
        let told = crate::link::traffic::troubles(&station.traffic(), &BTreeSet::new());
        let told: Vec<_> = told.iter().map(|one| one.text.as_str()).collect();
        assert!(told.iter().any(|text| text.contains("thrown away")), "{told:?}");
    }
}
