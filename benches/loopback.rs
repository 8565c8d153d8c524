//! Whole fleets over UDP on this computer: `cargo bench --bench loopback [-- DRONES BYTES...]`,
//! or only over limited links: `-- limited`.
//!
//! Time and processor time to put a show file onto every drone and to bring a log home from
//! each: 1 drone with 20 MB, 49 with 6.5 MB, 500 in two networks with 1 MB; then how much of a
//! link of 200 kB/s and of 1 MB/s is used at 0, 1, 10 and 20 % loss, by one drone and by nine.
//! Drones send as the firmware does (94 kB/s by MAVFTP, 2.8 MB/s by the log messages). Processor time
//! is told twice: of both ends together, and of the station alone.

#![expect(clippy::expect_used, reason = "a measurement that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "a table for people")]

use std::collections::BTreeMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use nalgebra::Vector3;
use updraft::base::frame::{Geodetic, ShowFrame};
use updraft::base::time::GpsTime;
use updraft::fleet::ftp::Caller;
use updraft::fleet::ftp::put::Put;
use updraft::fleet::logs::one::OneOptions;
use updraft::fleet::logs::pull::{Outcome, PullOptions, Wanted, pull};
use updraft::link::clock::{Clock, MS, Micros, S};
use updraft::link::conversation::{NoObserver, Observer, Progress, run_all};
use updraft::link::id::DroneId;
use updraft::link::net::Net as _;
use updraft::link::station::{Setup, Station};
use updraft::sim::Uniform;
use updraft::vehicle::library::builtin;
use updraft::virtual_fleet::lossy::Faults;
use updraft::virtual_fleet::server::{Pace, ServerOptions, serve};
use updraft::virtual_fleet::storage::MemoryStorage;
use updraft::virtual_fleet::vehicle::{BootTimes, VehicleSetup, VirtualVehicle};
use updraft::virtual_fleet::world::World;

const PER_NETWORK: usize = 250;
const SHOW_BYTES: usize = 8_000;
/// Of the limited links.
const LIMITS_BYTES_PER_S: [f64; 2] = [200e3, 1e6];
/// Of the limited link, shares of the frames each way.
const LOSSES: [f64; 4] = [0.0, 0.01, 0.1, 0.2];
/// Data of a frame of a log message, of all its bytes: 10 header, 7 payload, 2 checksum.
const DATA_SHARE: f64 = 90.0 / 109.0;

struct Wall(Instant);

impl Clock for Wall {
    fn now(&self) -> Micros {
        self.0.elapsed().as_micros() as Micros
    }

    #[expect(clippy::disallowed_methods, reason = "real sockets need a real clock")]
    fn unix_us(&self) -> u64 {
        let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        since.map_or(0, |since| since.as_micros() as u64)
    }
}

/// Processor time so far, s: of this process, and of the station's threads in it. Linux only.
fn cpu_s() -> (f64, f64) {
    let all = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let main = std::process::id().to_string();
    let of_station = tasks
        .filter_map(|task| std::fs::read_to_string(task.path().join("stat")).ok())
        .filter(|stat| stat.starts_with(&format!("{main} ")) || stat.contains("(link "));
    (cpu_of(&all), of_station.map(|stat| cpu_of(&stat)).sum())
}

/// User and system time of a line of `/proc`, which has them in ticks of 10 ms.
fn cpu_of(stat: &str) -> f64 {
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    fields.skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

fn main() {
    let numbers: Vec<usize> = std::env::args().filter_map(|text| text.parse().ok()).collect();
    let is_limited = std::env::args().any(|text| text == "limited");
    let pairs: Vec<(usize, usize)> = match numbers.as_chunks::<2>().0 {
        [] if is_limited => Vec::new(),
        [] => vec![(1, 20_000_000), (49, 6_500_000), (500, 1_000_000)],
        pairs => pairs.iter().map(|&[count, bytes]| (count, bytes)).collect(),
    };
    println!(" drones  task       MB   time s    CPU s  station    MB/s  station CPU s/GB");
    for (count, bytes) in pairs {
        with_fleet(count, bytes, Faults::default(), |station, clock, ids| {
            put_all(station, clock, ids);
            pull_all(station, clock, ids, bytes);
        });
    }
    if !numbers.is_empty() {
        return;
    }
    println!("\n   kB/s  drones   loss  used of what the loss leaves");
    for limit in LIMITS_BYTES_PER_S {
        for (count, loss) in [1, 9].into_iter().flat_map(|n| LOSSES.map(|loss| (n, loss))) {
            limited(limit, count, loss);
        }
    }
}

/// Pulls logs of 8 MB (200 kB/s: 3 MB) in all over a link that loses such a share of the frames each
/// way.
fn limited(bytes_per_s: f64, count: usize, loss: f64) {
    let all = if bytes_per_s < 500e3 { 3_000_000 } else { 8_000_000 };
    let bytes = all / count;
    let faults = Faults { loss, delay: 20 * MS, jitter: 5 * MS, bytes_per_s, ..Faults::default() };
    with_fleet(count, bytes, faults, |station, clock, ids| {
        let (time_s, good) = pull_from(station, clock, ids);
        let carried = bytes_per_s * DATA_SHARE * (1.0 - loss) * time_s;
        let share = (good * bytes) as f64 / carried;
        let kb_per_s = bytes_per_s / 1e3;
        println!(
            "{kb_per_s:>7.0} {count:>7} {loss:>6} {:>5.1} %  {good} whole, {time_s:.1} s",
            100.0 * share
        );
    });
}

/// Lets a station meet a fleet whose drones have a log of so many bytes each.
#[expect(clippy::disallowed_methods, reason = "real sockets need a real clock")]
fn with_fleet(
    count: usize,
    bytes: usize,
    faults: Faults,
    body: impl FnOnce(&mut Station, &Wall, &[DroneId]),
) {
    let vehicle = builtin("airsim-generic-quad").expect("a built-in vehicle");
    let air = Uniform(Vector3::zeros());
    let origin = Geodetic { lat_deg: 47.0, lon_deg: 19.0, amsl_m: 150.0 };
    let frame = ShowFrame { origin, orientation_deg: 0.0 };
    let world = World::new(&vehicle, &air, frame, 1, GpsTime { week: 2445, tow_ms: 100_000_000 });
    let clock = Arc::new(Wall(Instant::now()));
    let stations: Vec<SocketAddr> = (0..count.div_ceil(PER_NETWORK)).map(|_| free_port()).collect();
    let links = stations.iter().enumerate();
    let links = links
        .map(|(network, at)| format!("{network}@udpin:{at}").parse().expect("an address"))
        .collect();
    let wall: Arc<dyn Clock> = clock.clone();
    let mut station = Station::open(Setup { links, key: None, clock: wall }).expect("a port");
    let ids: Vec<DroneId> = (0..count)
        .map(|index| DroneId {
            network: (index / PER_NETWORK) as u16,
            system: (index % PER_NETWORK) as u8 + 1,
        })
        .collect();
    let vehicles = ids
        .iter()
        .enumerate()
        .map(|(index, id)| {
            let mut setup = VehicleSetup::new(index as u16 + 1, id.system, Vector3::zeros());
            setup.network = id.network;
            setup.boot = BootTimes::short();
            let mut storage = MemoryStorage::default();
            let log = (0..bytes).map(|at| (at * 7 + at / 253) as u8).collect();
            storage.put("logs/00000001.BIN", log).expect("a plain name");
            VirtualVehicle::new(&world, setup, Box::new(storage), 0)
        })
        .collect();
    let options = ServerOptions { stations, key: None, pace: Pace::Speed(1.0), faults, seed: 1 };
    serve(vehicles, &options, clock.as_ref(), |_| {
        let until = station.now() + 10 * S;
        let awake = station.now() + 2 * S;
        while station.now() < awake || (station.heard().len() < count && station.now() < until) {
            let next = station.now() + 50 * MS;
            let _ = station.recv(next).expect("a link");
        }
        body(&mut station, &clock, &ids);
    })
    .expect("a fleet");
}

fn put_all(station: &mut Station, clock: &Wall, ids: &[DroneId]) {
    let (begun, cpu) = (clock.now(), cpu_s());
    let puts: BTreeMap<DroneId, Put> = ids
        .iter()
        .map(|id| {
            let caller = Caller::new(*id, 1);
            (*id, Put::new(caller, "/collmot/show.skyb", vec![7; SHOW_BYTES], 60 * S))
        })
        .collect();
    let done = run_all(station, puts, 16, &mut NoObserver).expect("a link");
    let good = done.values().filter(|done| done.is_ok()).count();
    tell(ids.len(), "put", good, good * SHOW_BYTES, clock.now() - begun, cpu);
}

fn pull_all(station: &mut Station, clock: &Wall, ids: &[DroneId], bytes: usize) {
    let (begun, cpu) = (clock.now(), cpu_s());
    let (_, good) = pull_from(station, clock, ids);
    tell(ids.len(), "pull", good, good * bytes, clock.now() - begun, cpu);
}

/// Sees when the last byte came; what follows proves the log.
struct LastByte<'a> {
    clock: &'a Wall,
    at: Micros,
    done: BTreeMap<DroneId, u64>,
}

impl Observer for LastByte<'_> {
    fn on_progress(&mut self, drone: DroneId, progress: Progress, _over: bool) {
        let most = self.done.entry(drone).or_default();
        if progress.done > *most {
            *most = progress.done;
            self.at = self.clock.now();
        }
    }
}

/// Brings every log home; returns the time it took, s, and how many came whole.
fn pull_from(station: &mut Station, clock: &Wall, ids: &[DroneId]) -> (f64, usize) {
    let begun = clock.now();
    let folder = tempfile::tempdir().expect("a folder");
    let wanted: Vec<Wanted> = (1..)
        .zip(ids)
        .map(|(slot, id)| Wanted { drone: *id, slot, file: format!("{slot:03}.BIN"), flight: None })
        .collect();
    let options = PullOptions {
        each: OneOptions::default(),
        at_once: 12,
        bytes_per_s: None,
        made_by: "bench".to_owned(),
    };
    let mut last = LastByte { clock, at: begun, done: BTreeMap::new() };
    let pulled = pull(station, folder.path(), &wanted, &options, &mut last).expect("a link");
    let is_whole = |of: &&Outcome| matches!(of, Outcome::Done(done) if done.failure.is_none());
    let good = pulled.values().filter(is_whole).count();
    ((last.at - begun) as f64 * 1e-6, good)
}

fn tell(count: usize, task: &str, good: usize, bytes: usize, took: Micros, before: (f64, f64)) {
    let (mb, time_s) = (bytes as f64 * 1e-6, took as f64 * 1e-6);
    let after = cpu_s();
    let (both, station) = (after.0 - before.0, after.1 - before.1);
    println!(
        "{good:>4}/{count:<4} {task:>4} {mb:>8.1} {time_s:>8.2} {both:>8.2} {station:>8.2} {:>7.1} {:>8.1}",
        mb / time_s,
        station / mb * 1e3
    );
}

fn free_port() -> SocketAddr {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.local_addr().expect("an address")
}
