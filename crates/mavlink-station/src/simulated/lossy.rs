//! A radio network that drops, delays, reorders and duplicates frames, in simulated time.
//!
//! Frames are really encoded and decoded, and everything depends on the seed alone.

use std::collections::BTreeMap;

use rand::RngExt as _;
use rand_pcg::Pcg64;

use super::endpoint::Endpoint;
use crate::link::clock::Micros;
use crate::link::error::NetError;
use crate::link::frame::{FrameReader, MavMessage, Sender, encode};
use crate::link::id::DroneId;
use crate::link::net::{Net, Received};
use crate::link::station::{AUTOPILOT, STATION, heartbeat};

/// Start of the random stream for seed 0, and its number: with them, faults are the same in all
/// releases.
const STATE: u128 = 0x9E37_79B9_7F4A_7C15_F39C_C060_5CED_C834;
const STREAM: u128 = 6;

/// Faults of a simulated network; the default is a perfect one.
#[derive(Clone, Copy, Debug)]
pub struct Faults {
    /// Share of frames lost in each direction, 0 to 1.
    pub loss: f64,
    /// Share of frames that arrive twice, 0 to 1.
    pub repeat: f64,
    /// Delay in each direction, us.
    pub delay: Micros,
    /// Largest addition to the delay, us; if it exceeds the time between frames, they are
    /// reordered.
    pub jitter: Micros,
    /// Data that all vehicles of a network together can send, bytes per second; 0: no limit. Frames
    /// beyond it wait, and are lost when they would have to wait for longer than `queue`.
    pub bytes_per_s: f64,
    /// Longest time that a frame waits to be sent, us.
    pub queue: Micros,
}

impl Default for Faults {
    fn default() -> Self {
        Self { loss: 0.0, repeat: 0.0, delay: 0, jitter: 0, bytes_per_s: 0.0, queue: 500_000 }
    }
}

impl Faults {
    /// Whether the link is perfect.
    pub fn is_none(&self) -> bool {
        let Self { loss, repeat, delay, jitter, bytes_per_s, queue: _ } = *self;
        loss <= 0.0 && repeat <= 0.0 && delay == 0 && jitter == 0 && bytes_per_s <= 0.0
    }
}

/// Traffic of a simulated network, bytes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Carried {
    /// Bytes that vehicles put on the air.
    pub down: u64,
    /// Bytes from vehicles that arrived at the station.
    pub down_arrived: u64,
    /// Bytes that the station put on the air.
    pub up: u64,
}

/// Vehicles behind a bad network, with a clock that jumps to the next event.
pub struct LossyNet<E> {
    /// The vehicles; one that is taken out is gone for good.
    pub vehicles: BTreeMap<DroneId, E>,
    /// Present faults of the network; may be changed at any time.
    pub faults: Faults,
    /// Traffic since the network was made.
    pub carried: Carried,
    now: Micros,
    wake: BTreeMap<DroneId, Micros>,
    /// On their way, by arrival and a running number.
    air: BTreeMap<(Micros, u64), Flying>,
    count: u64,
    /// When the downlink of a network is free again.
    free: BTreeMap<u16, Micros>,
    inbox: std::collections::VecDeque<Received>,
    heard: Vec<DroneId>,
    next_heartbeat: Micros,
    sequence: u8,
    rng: Pcg64,
}

struct Flying {
    drone: DroneId,
    to_drone: bool,
    bytes: Vec<u8>,
}

impl<E: Endpoint> LossyNet<E> {
    /// A network of these vehicles with these faults; `seed` determines every loss.
    pub fn new(vehicles: BTreeMap<DroneId, E>, faults: Faults, seed: u64) -> Self {
        Self {
            vehicles,
            faults,
            carried: Carried::default(),
            now: 0,
            wake: BTreeMap::new(),
            air: BTreeMap::new(),
            count: 0,
            free: BTreeMap::new(),
            inbox: std::collections::VecDeque::new(),
            heard: Vec::new(),
            next_heartbeat: 0,
            sequence: 0,
            rng: Pcg64::new(u128::from(seed) ^ STATE, STREAM),
        }
    }

    fn launch(&mut self, drone: DroneId, to_drone: bool, message: &MavMessage) {
        let sender =
            if to_drone { STATION } else { Sender { system: drone.system, component: AUTOPILOT } };
        let bytes = encode(sender, self.sequence, message, None);
        self.sequence = self.sequence.wrapping_add(1);
        let size = bytes.len() as u64;
        let mut leaves = self.now;
        if to_drone {
            self.carried.up += size;
        } else {
            if self.faults.bytes_per_s > 0.0 {
                let free = self.free.entry(drone.network).or_default();
                leaves = leaves.max(*free);
                if leaves - self.now > self.faults.queue {
                    return;
                }
                leaves += (size as f64 / self.faults.bytes_per_s * 1e6) as Micros;
                *free = leaves;
            }
            self.carried.down += size;
        }
        let copies = 1 + usize::from(self.rng.random_bool(self.faults.repeat));
        for _ in 0..copies {
            if self.rng.random_bool(self.faults.loss) {
                continue;
            }
            let jitter = match self.faults.jitter {
                0 => 0,
                most => self.rng.random_range(0..=most),
            };
            self.count += 1;
            let flying = Flying { drone, to_drone, bytes: bytes.clone() };
            self.air.insert((leaves + self.faults.delay + jitter, self.count), flying);
        }
    }

    fn arrive(&mut self, flying: &Flying) {
        let drone = flying.drone;
        let mut reader = FrameReader::default();
        reader.push(&flying.bytes);
        while let Some(frame) = reader.next(None) {
            if flying.to_drone {
                let mut out = Vec::new();
                if let Some(vehicle) = self.vehicles.get_mut(&drone) {
                    vehicle.on_message(self.now, &frame.message, &mut out);
                    self.wake.insert(drone, self.now);
                }
                for message in out {
                    self.launch(drone, false, &message);
                }
            } else {
                self.carried.down_arrived += flying.bytes.len() as u64;
                if !self.heard.contains(&drone) {
                    self.heard.push(drone);
                    self.heard.sort_unstable();
                }
                self.inbox.push_back(Received { from: drone, message: frame.message });
            }
        }
    }

    /// Lets all vehicles speak that want to by now, and delivers what has arrived.
    fn settle(&mut self) -> Result<(), NetError> {
        if self.now >= self.next_heartbeat {
            self.next_heartbeat = self.now + 1_000_000;
            self.broadcast(&heartbeat())?;
        }
        let due: Vec<DroneId> = self
            .vehicles
            .keys()
            .copied()
            .filter(|drone| self.wake.get(drone).is_none_or(|wake| *wake <= self.now))
            .collect();
        for drone in due {
            let mut out = Vec::new();
            if let Some(vehicle) = self.vehicles.get_mut(&drone) {
                let wake = vehicle.poll(self.now, &mut out);
                // A vehicle that never waits would stop time.
                self.wake.insert(drone, wake.max(self.now + 100));
            }
            for message in out {
                self.launch(drone, false, &message);
            }
        }
        while let Some(entry) = self.air.first_entry() {
            if entry.key().0 > self.now {
                break;
            }
            let flying = entry.remove();
            self.arrive(&flying);
        }
        Ok(())
    }

    fn next_event(&self) -> Micros {
        let awake = self.vehicles.keys().filter_map(|drone| self.wake.get(drone));
        let wake = awake.copied().min().unwrap_or(Micros::MAX);
        let air = self.air.keys().next().map_or(Micros::MAX, |(time, _)| *time);
        wake.min(air).min(self.next_heartbeat)
    }
}

impl<E: Endpoint> Net for LossyNet<E> {
    fn now(&self) -> Micros {
        self.now
    }

    fn recv(&mut self, until: Micros) -> Result<Option<Received>, NetError> {
        loop {
            if let Some(received) = self.inbox.pop_front() {
                return Ok(Some(received));
            }
            self.settle()?;
            if !self.inbox.is_empty() {
                continue;
            }
            let next = self.next_event();
            if next > until {
                self.now = self.now.max(until);
                return Ok(None);
            }
            self.now = self.now.max(next);
        }
    }

    fn send(&mut self, to: DroneId, message: &MavMessage) -> Result<(), NetError> {
        self.launch(to, true, message);
        Ok(())
    }

    fn broadcast(&mut self, message: &MavMessage) -> Result<(), NetError> {
        let all: Vec<DroneId> = self.vehicles.keys().copied().collect();
        for drone in all {
            self.launch(drone, true, message);
        }
        Ok(())
    }

    fn heard(&self) -> Vec<DroneId> {
        self.heard.clone()
    }
}
