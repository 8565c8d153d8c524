//! The server of a page: threads and sockets, one page, one stream, one way back.
//!
//! A thread accepts, one looks at the flight as often as anybody watches, and each connection has one of its own. All
//! are bounded in number, in bytes and in time.

use std::io::{self, Read as _, Write as _};
use std::net::{IpAddr, SocketAddr, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::Duration;

use super::facts::Facts;
use super::files;
use super::frames::Looks;
use super::http::guard::{Door, Rank};
use super::http::request::{MOST_BODY_BYTES, MOST_HEAD_BYTES, Method, Parsed, Request, parse};
use super::http::response::{Kind, Status, head};
use super::orders::{Refused, Wish};
use super::page;
use super::source::Source;
use crate::base::parse as read;
use crate::link::clock::{Clock, MS, Micros, S};

/// Connections at once: pages hold one each, and six at most come from one browser.
const MOST_CONNECTIONS: usize = 64;
/// Pages are told how it ended for so long at most, us.
const FAREWELL: Micros = S;
/// Longest that a request may take to come.
const REQUEST: Micros = 5 * S;
/// A page that takes nothing for so long is dropped.
const WRITE: Duration = Duration::from_secs(3);
/// Looks are so far apart for a fleet of up to [`FEW`] drones.
const LOOK: Micros = 100 * MS;
/// Number of drones up to which looks are as close as that; for more they are further apart in proportion.
const FEW: usize = 100;
/// Looks are never further apart than this.
const SLOWEST: Micros = 500 * MS;
/// Without news a page hears so often that the station is there.
const HEARTBEAT: Micros = 2 * S;
/// A page tries again so soon, ms.
const RETRY_MS: u32 = 1000;

/// Source of random bytes.
pub type Random = dyn Fn(&mut [u8]) -> io::Result<()> + Send + Sync;

/// Setup of a server.
pub struct Setup {
    /// Flight that is looked at.
    pub source: Arc<dyn Source>,
    /// Clock of the program.
    pub clock: Arc<dyn Clock>,
    /// Random bytes for nonces.
    pub random: Box<Random>,
    /// Secret of those who may look.
    pub look: String,
    /// Secret of those who may give orders, if anybody may.
    pub order: Option<String>,
    /// Folder of the campaign, whose pages and results may be read, too.
    pub campaign: Option<PathBuf>,
}

struct Shared {
    setup: Setup,
    door: Door,
    facts: Facts,
    looks: Mutex<Arc<Looks>>,
    fresh: Condvar,
    /// Streams that are open.
    watched: AtomicUsize,
    connections: AtomicUsize,
    stop: AtomicBool,
}

/// A page that is being served; dropped, it is no more.
pub struct Server {
    shared: Arc<Shared>,
    address: SocketAddr,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl std::fmt::Debug for Server {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Server").field("address", &self.address).finish_non_exhaustive()
    }
}

impl Server {
    /// Listens at an address, and begins to serve.
    ///
    /// # Errors
    /// If the address cannot be listened at, or there is no thread.
    pub fn open(listen: SocketAddr, setup: Setup) -> io::Result<Self> {
        let listener = TcpListener::bind(listen)?;
        let address = listener.local_addr()?;
        let door = Door { address, look: setup.look.clone(), order: setup.order.clone() };
        let facts = setup.source.facts();
        let shared = Arc::new(Shared {
            setup,
            door,
            facts,
            looks: Mutex::default(),
            fresh: Condvar::new(),
            watched: AtomicUsize::new(0),
            connections: AtomicUsize::new(0),
            stop: AtomicBool::new(false),
        });
        let thread = |name: &str, body: Box<dyn FnOnce() + Send>| {
            std::thread::Builder::new().name(name.to_owned()).spawn(body)
        };
        let of = Arc::clone(&shared);
        let look = thread("live look", Box::new(move || look_on(&of)))?;
        let of = Arc::clone(&shared);
        let accept = thread("live accept", Box::new(move || accept(&listener, &of)));
        let mut server = Self { shared, address, threads: vec![look] };
        server.threads.push(accept?);
        Ok(server)
    }

    /// Address that is listened at.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Address of the page for a rank, with its secret; `None`: nobody has that rank.
    pub fn page(&self, rank: Rank) -> Option<String> {
        let secret = match rank {
            Rank::Looker => &self.shared.door.look,
            Rank::Operator => self.shared.door.order.as_ref()?,
        };
        Some(format!("http://{}/#{secret}", self.address))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Pages are told the last of it.
        self.shared.look();
        self.shared.stop.store(true, Ordering::SeqCst);
        self.shared.fresh.notify_all();
        let until = self.shared.now() + FAREWELL;
        while self.shared.watched.load(Ordering::SeqCst) > 0 && self.shared.now() < until {
            std::thread::sleep(Duration::from_millis(10));
        }
        // Who waits for a connection gets one. A wildcard is no address to connect to.
        let mut to = self.address;
        if to.ip().is_unspecified() {
            to.set_ip(match to.ip() {
                IpAddr::V4(_) => std::net::Ipv4Addr::LOCALHOST.into(),
                IpAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
            });
        }
        drop(TcpStream::connect_timeout(&to, Duration::from_secs(1)));
        for thread in self.threads.drain(..) {
            // A thread that has panicked has said so.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn is_over(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn now(&self) -> Micros {
        self.setup.clock.now()
    }

    fn looks(&self) -> std::sync::MutexGuard<'_, Arc<Looks>> {
        self.looks.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Looks at the flight.
    fn look(&self) {
        let view = self.setup.source.view(self.setup.clock.unix_us() / 1000);
        let next = Arc::new(self.looks().next(view));
        *self.looks() = next;
        self.fresh.notify_all();
    }

    /// Waits for a look that is newer than `seen`, for a heartbeat's time at most.
    fn newer(&self, seen: u64) -> Option<Arc<Looks>> {
        let looks = self.looks();
        let wait = Duration::from_micros(HEARTBEAT);
        let stale = |looks: &mut Arc<Looks>| looks.number <= seen && !self.is_over();
        let waited = self.fresh.wait_timeout_while(looks, wait, stale);
        let (looks, _) = waited.unwrap_or_else(PoisonError::into_inner);
        (looks.number > seen).then(|| Arc::clone(&looks))
    }
}

/// Looks at the flight as long as somebody watches.
fn look_on(shared: &Shared) {
    let drones = shared.facts.slots.len();
    let every = (LOOK * drones.max(FEW) as u64 / FEW as u64).min(SLOWEST);
    while !shared.is_over() {
        if shared.watched.load(Ordering::SeqCst) > 0 {
            shared.look();
        }
        std::thread::sleep(Duration::from_micros(every));
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>) {
    while !shared.is_over() {
        let Ok((stream, _)) = listener.accept() else {
            // Out of descriptors, for example: that may pass.
            std::thread::sleep(Duration::from_millis(100));
            continue;
        };
        if shared.is_over() {
            return;
        }
        if shared.connections.fetch_add(1, Ordering::SeqCst) >= MOST_CONNECTIONS {
            shared.connections.fetch_sub(1, Ordering::SeqCst);
            refuse(&stream, Status::Busy);
            continue;
        }
        let of = Arc::clone(shared);
        let serve = move || {
            // A connection that breaks off is the page's affair.
            let _ = serve(&stream, &of);
            of.connections.fetch_sub(1, Ordering::SeqCst);
        };
        if std::thread::Builder::new().name("live page".to_owned()).spawn(serve).is_err() {
            shared.connections.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

fn refuse(stream: &TcpStream, status: Status) {
    let _ = stream.set_write_timeout(Some(Duration::from_millis(200)));
    let _ = answer(stream, status, Kind::Text, b"");
}

fn answer(mut stream: &TcpStream, status: Status, kind: Kind<'_>, body: &[u8]) -> io::Result<()> {
    let head = head(status, kind, Some(body.len() as u64));
    stream.write_all(head.as_bytes())?;
    stream.write_all(body)
}

/// Reads a request, within its time.
fn request(mut stream: &TcpStream, shared: &Shared) -> io::Result<Parsed> {
    let until = shared.now() + REQUEST;
    let mut bytes = Vec::new();
    let mut piece = [0; 4096];
    loop {
        let left = until.saturating_sub(shared.now()).max(1);
        if left == 1 {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(Duration::from_micros(left)))?;
        let count = stream.read(&mut piece)?;
        if count == 0 {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        bytes.extend_from_slice(&piece[..count]);
        match parse(&bytes) {
            Parsed::Partial if bytes.len() <= MOST_HEAD_BYTES + MOST_BODY_BYTES => {}
            Parsed::Partial => return Ok(Parsed::Refused(Status::TooLarge)),
            parsed => return Ok(parsed),
        }
    }
}

/// Answers one request.
fn serve(stream: &TcpStream, shared: &Shared) -> io::Result<()> {
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(WRITE))?;
    let request = match request(stream, shared)? {
        Parsed::Whole(request) => request,
        Parsed::Refused(status) => return answer(stream, status, Kind::Text, b""),
        Parsed::Partial => return Ok(()),
    };
    if let Some((secret, path)) = files::split(&request.path) {
        return file(stream, shared, &request, secret, path);
    }
    if let Err(status) = shared.door.admit(&request) {
        return answer(stream, status, Kind::Text, b"");
    }
    match (request.method, request.path.as_str()) {
        (Method::Get, "/") => {
            let mut bytes = [0; 16];
            (shared.setup.random)(&mut bytes)?;
            let nonce = base16ct::lower::encode_string(&bytes);
            let page = page::html(&nonce);
            answer(stream, Status::Ok, Kind::Page { nonce: &nonce }, page.as_bytes())
        }
        (Method::Get, "/favicon.svg") => {
            answer(stream, Status::Ok, Kind::Picture, page::ICON.as_bytes())
        }
        (Method::Get, "/events") => match shared.door.rank(request.query_token.as_deref()) {
            Ok(rank) => events(stream, shared, rank),
            Err(status) => answer(stream, status, Kind::Text, b""),
        },
        (Method::Post, "/wish") => wish(stream, shared, &request),
        (_, "/" | "/events" | "/wish" | "/favicon.svg") => {
            answer(stream, Status::NotAllowed, Kind::Text, b"")
        }
        _ => answer(stream, Status::NotFound, Kind::Text, b""),
    }
}

/// Sends a file of the campaign.
fn file(
    mut stream: &TcpStream,
    shared: &Shared,
    request: &Request,
    secret: &str,
    path: &str,
) -> io::Result<()> {
    let refuse = |status| {
        let words: &[u8] = match status {
            Status::NotFound => {
                b"This campaign has no such page or file (yet), or it is none that is shown here.\n"
            }
            _ => b"",
        };
        answer(stream, status, Kind::Text, words)
    };
    if let Err(status) = shared.door.admit_reader(request, secret) {
        return refuse(status);
    }
    let Some(root) = &shared.setup.campaign else { return refuse(Status::NotFound) };
    if let Some(page) = files::listing(root, path) {
        let kind = Kind::File { media: "text/html; charset=utf-8" };
        return answer(stream, Status::Ok, kind, page.as_bytes());
    }
    let Some((file, media, length)) = files::open(root, path) else {
        return refuse(Status::NotFound);
    };
    stream.write_all(head(Status::Ok, Kind::File { media }, Some(length)).as_bytes())?;
    // A file that grows meanwhile is sent as long as was said.
    io::copy(&mut file.take(length), &mut stream)?;
    Ok(())
}

fn wish(stream: &TcpStream, shared: &Shared, request: &Request) -> io::Result<()> {
    let rank = match shared.door.rank(request.token.as_deref()) {
        Ok(rank) => rank,
        Err(status) => return answer(stream, status, Kind::Text, b""),
    };
    let (status, text) = match read::json::<Wish>(&request.body) {
        Err(error) => (Status::BadRequest, error.to_string()),
        Ok(wish) => match shared.setup.source.wish(rank, &wish) {
            Ok(said) => (Status::Ok, said),
            Err(refused @ Refused::LooksOnly) => (Status::Forbidden, refused.to_string()),
            Err(refused) => (Status::Conflict, refused.to_string()),
        },
    };
    answer(stream, status, Kind::Text, text.as_bytes())
}

/// Counts a stream as long as it is open.
struct Watching<'a>(&'a AtomicUsize);

impl<'a> Watching<'a> {
    fn begin(count: &'a AtomicUsize) -> Self {
        count.fetch_add(1, Ordering::SeqCst);
        Self(count)
    }
}

impl Drop for Watching<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Sends events until the page goes.
fn events(mut stream: &TcpStream, shared: &Shared, rank: Rank) -> io::Result<()> {
    stream.write_all(head(Status::Ok, Kind::Events, None).as_bytes())?;
    let facts = serde_json::to_string(&shared.facts.clone().seen_by(rank))?;
    stream.write_all(format!("retry: {RETRY_MS}\nevent: facts\ndata: {facts}\n\n").as_bytes())?;
    if let Some(root) = &shared.setup.campaign {
        let links = serde_json::to_string(&files::links(root, &shared.setup.look))?;
        stream.write_all(format!("event: links\ndata: {links}\n\n").as_bytes())?;
    }
    let _watching = Watching::begin(&shared.watched);
    shared.look();
    let mut seen: Option<(u64, usize, u64)> = None;
    loop {
        let is_over = shared.is_over();
        let Some(looks) = shared.newer(seen.map_or(0, |(number, ..)| number)) else {
            if is_over {
                break;
            }
            stream.write_all(b": still here\n\n")?;
            continue;
        };
        let frame = serde_json::to_string(&looks.since(seen))?;
        seen = Some(looks.sent(seen));
        stream.write_all(format!("id: {}\ndata: {frame}\n\n", looks.number).as_bytes())?;
    }
    stream.write_all(b"event: over\ndata: {}\n\n")
}
