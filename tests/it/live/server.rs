//! The server as strangers meet it: on a socket.

use std::io::{Read as _, Write as _};
use std::net::{SocketAddr, TcpStream};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use updraft::live::facts::Facts;
use updraft::live::http::guard::Rank;
use updraft::live::orders::{Refused, Said, Wish};
use updraft::live::server::{Server, Setup};
use updraft::live::source::Source;
use updraft::live::view::{DroneView, View};
use updraft::mission::resolve::resolve;
use updraft::workflow::clock::{Clock as _, SystemClock};

/// A flight of the built-in hover, which counts how often it is looked at.
struct Counted(AtomicU64);

impl Source for Counted {
    fn facts(&self) -> Facts {
        Facts::of(&resolve("hover", &[]).unwrap().flights[0].plan, false)
    }

    fn view(&self, now_ms: u64) -> View {
        let looks = self.0.fetch_add(1, Ordering::SeqCst);
        let drones = (1..=49).map(|slot| DroneView {
            slot: Some(slot),
            place_m: Some([looks as f64, 0.0, 0.0]),
            ..DroneView::default()
        });
        View { now_ms, drones: drones.collect(), ..View::default() }
    }

    fn wish(&self, rank: Rank, _: &Wish) -> Said {
        match rank {
            Rank::Looker => Err(Refused::LooksOnly),
            Rank::Operator => Ok("done".to_owned()),
        }
    }
}

fn served() -> (Server, Arc<Counted>) {
    served_beside(None)
}

/// A page whose campaign is in this folder.
fn served_beside(campaign: Option<&Path>) -> (Server, Arc<Counted>) {
    let source = Arc::new(Counted(AtomicU64::new(0)));
    let of = Arc::clone(&source);
    let setup = Setup {
        source: of,
        clock: Arc::new(SystemClock::start()),
        random: Box::new(|bytes| {
            bytes.fill(7);
            Ok(())
        }),
        look: "look".to_owned(),
        order: Some("order".to_owned()),
        campaign: campaign.map(Path::to_owned),
    };
    (Server::open("127.0.0.1:0".parse().unwrap(), setup).unwrap(), source)
}

fn connect(address: SocketAddr) -> TcpStream {
    let stream = TcpStream::connect(address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
    stream
}

/// Sends a request; everything that comes until the server closes.
fn ask(address: SocketAddr, request: &str) -> String {
    let mut stream = connect(address);
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = Vec::new();
    // Who is refused may be cut off while it still sends.
    let _ = stream.read_to_end(&mut answer);
    String::from_utf8_lossy(&answer).into_owned()
}

fn get(address: SocketAddr, path: &str, headers: &str) -> String {
    ask(address, &format!("GET {path} HTTP/1.1\r\nHost: {address}\r\n{headers}\r\n"))
}

fn wish(address: SocketAddr, headers: &str, body: &str) -> String {
    let length = body.len();
    ask(
        address,
        &format!(
            "POST /wish HTTP/1.1\r\nHost: {address}\r\nContent-Length: {length}\r\n{headers}\r\n{body}"
        ),
    )
}

/// Reads a stream until this many events came.
fn events(stream: &mut TcpStream, count: usize) -> String {
    let mut text = String::new();
    let mut piece = vec![0; 65536];
    while text.matches("\n\n").count() < count {
        let read = stream.read(&mut piece).unwrap();
        assert!(read > 0, "the stream ended: {text}");
        text.push_str(&String::from_utf8_lossy(&piece[..read]));
    }
    text
}

const LAND: &str = r#"{"wish": "order", "action": "land"}"#;

#[test]
fn the_page_comes_with_all_that_keeps_it_to_itself() {
    let (server, _) = served();
    let page = get(server.address(), "/", "");
    assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
    for header in [
        "Content-Security-Policy: default-src 'none'; script-src 'nonce-07070707",
        "frame-ancestors 'none'",
        "X-Content-Type-Options: nosniff",
        "Referrer-Policy: no-referrer",
        "Cache-Control: no-store",
        "Cross-Origin-Resource-Policy: same-origin",
        "Cross-Origin-Opener-Policy: same-origin",
    ] {
        assert!(page.contains(header), "{header}");
    }
    assert!(!page.contains("{{") && page.contains("<script nonce=\"0707"));
    // Nothing of it comes from elsewhere, and nothing in it tells of the flight or a secret.
    assert!(!page.contains("src=\"http") && !page.contains("url(http") && !page.contains("look\""));
    assert!(get(server.address(), "/nothing", "").starts_with("HTTP/1.1 404 "));
    assert!(
        ask(server.address(), "PUT / HTTP/1.1\r\nHost: x\r\n\r\n").starts_with("HTTP/1.1 405 ")
    );
}

#[test]
fn secrets_decide_who_looks_and_who_orders() {
    let (server, _) = served();
    let address = server.address();
    let own = format!("Origin: http://{address}\r\n");
    for query in ["", "?token=", "?token=wrong", "?token=loo"] {
        let answer = get(address, &format!("/events{query}"), "");
        assert!(answer.starts_with("HTTP/1.1 401 "), "{query}: {answer}");
    }
    let order = |token: &str| wish(address, &format!("{own}X-Token: {token}\r\n"), LAND);
    assert!(order("order").starts_with("HTTP/1.1 200 "));
    let looker = order("look");
    assert!(looker.starts_with("HTTP/1.1 403 ") && looker.contains("--live-orders"), "{looker}");
    assert!(order("wrong").starts_with("HTTP/1.1 401 "));
    // A secret in the address orders nothing, and neither does a page of another site.
    assert!(wish(address, &own, LAND).starts_with("HTTP/1.1 401 "));
    let elsewhere = "Origin: http://evil.example\r\nX-Token: order\r\n";
    assert!(wish(address, elsewhere, LAND).starts_with("HTTP/1.1 403 "));
    assert!(wish(address, "X-Token: order\r\n", LAND).starts_with("HTTP/1.1 403 "));
    let rebound = format!("GET / HTTP/1.1\r\nHost: evil.example:{}\r\n\r\n", address.port());
    assert!(ask(address, &rebound).starts_with("HTTP/1.1 403 "));
    let what = wish(address, &format!("{own}X-Token: order\r\n"), r#"{"wish": "fall"}"#);
    assert!(what.starts_with("HTTP/1.1 400 ") && what.contains("unknown variant"), "{what}");
    let long = format!("{own}X-Token: order\r\n");
    assert!(wish(address, &long, &"x".repeat(20_000)).starts_with("HTTP/1.1 413 "));
}

#[test]
fn a_page_is_told_everything_once_and_then_what_is_new() {
    let (server, _) = served();
    let mut stream = connect(server.address());
    let request = format!("GET /events?token=look HTTP/1.1\r\nHost: {}\r\n\r\n", server.address());
    stream.write_all(request.as_bytes()).unwrap();
    let text = events(&mut stream, 4);
    let data: Vec<serde_json::Value> = text
        .lines()
        .filter_map(|line| line.strip_prefix("data: "))
        .map(|data| serde_json::from_str(data).unwrap())
        .collect();
    assert_eq!(data[0]["flight"], "hover");
    assert_eq!(data[0]["may_order"], false);
    assert_eq!(data[1]["whole"], true);
    assert_eq!(data[1]["drones"].as_array().unwrap().len(), 49);
    assert_eq!(data[2]["whole"], false);
    assert!(data[2]["preflight"].is_null(), "what has not changed is not sent: {}", data[2]);
    assert!(text.contains("retry: 1000\n") && text.contains("\nid: 2\n"), "{text}");
    let operator = get_events(&server, "order");
    assert!(operator.contains("\"may_order\":true"), "{operator}");
}

fn get_events(server: &Server, token: &str) -> String {
    let mut stream = connect(server.address());
    let request =
        format!("GET /events?token={token} HTTP/1.1\r\nHost: {}\r\n\r\n", server.address());
    stream.write_all(request.as_bytes()).unwrap();
    events(&mut stream, 2)
}

#[test]
fn pages_that_hang_are_dropped_and_the_station_is_looked_at_only_while_somebody_watches() {
    let (server, source) = served();
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(source.0.load(Ordering::SeqCst), 0, "nobody watches");
    // A page that asks and reads nothing; one that never ends its request.
    let mut hanging = connect(server.address());
    let request = format!("GET /events?token=look HTTP/1.1\r\nHost: {}\r\n\r\n", server.address());
    hanging.write_all(request.as_bytes()).unwrap();
    let mut slow = connect(server.address());
    slow.write_all(b"GET / HTTP/1.1\r\nA:").unwrap();
    let begun = SystemClock::start();
    // Others are served as if nothing was.
    for _ in 0..20 {
        assert!(get(server.address(), "/", "").starts_with("HTTP/1.1 200 "));
    }
    let mut nothing = Vec::new();
    let _ = slow.read_to_end(&mut nothing);
    assert!(nothing.is_empty() && begun.now() < 15_000_000, "the slow one is cut off");
    assert!(source.0.load(Ordering::SeqCst) > 5);
    drop(hanging);
    drop(server);
}

#[test]
fn many_connections_at_once_are_refused_and_then_served_again() {
    let (server, _) = served();
    let open: Vec<TcpStream> = (0..80).map(|_| connect(server.address())).collect();
    let refused = open.iter().filter(|stream| {
        stream.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
        let mut first = [0; 12];
        let mut stream = *stream;
        stream.read(&mut first).is_ok_and(|count| first[..count].starts_with(b"HTTP/1.1 503"))
    });
    assert!(refused.count() >= 10, "64 connections are enough");
    drop(open);
    let served = (0..100).any(|_| {
        std::thread::sleep(Duration::from_millis(50));
        get(server.address(), "/", "").starts_with("HTTP/1.1 200 ")
    });
    assert!(served);
}

#[test]
fn reports_beside_the_flight_are_read_with_the_secret_alone() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("report")).unwrap();
    std::fs::write(folder.path().join("report/index.html"), "<h1>Report</h1>").unwrap();
    std::fs::write(folder.path().join("fleet-live.json"), "secrets").unwrap();
    let (server, counted) = served_beside(Some(folder.path()));
    let address = server.address();
    // The page is told of what is there.
    let mut stream = connect(address);
    stream
        .write_all(format!("GET /events?token=look HTTP/1.1\r\nHost: {address}\r\n\r\n").as_bytes())
        .unwrap();
    let told = events(&mut stream, 2);
    let link = r#"{"title":"The report","href":"/files/look/report/index.html"}"#;
    assert!(told.contains(&format!("event: links\ndata: [{link}]")), "{told}");
    // From a page in a sandbox, which is of no site, too.
    for headers in ["", "Sec-Fetch-Site: cross-site\r\nOrigin: null\r\n"] {
        let page = get(address, "/files/look/report/index.html", headers);
        assert!(page.starts_with("HTTP/1.1 200 OK\r\n"), "{page}");
        assert!(page.contains("Content-Type: text/html") && page.ends_with("<h1>Report</h1>"));
        assert!(page.contains("Content-Security-Policy: sandbox allow-scripts"), "{page}");
        assert!(page.contains("connect-src 'none'") && !page.contains("allow-same-origin"));
    }
    for (path, status) in [
        ("/files/wrong/report/index.html", 401),
        ("/files//report/index.html", 401),
        // It may order: it is no address of a page that somebody passes on.
        ("/files/order/report/index.html", 403),
        ("/files/look/fleet-live.json", 404),
        ("/files/look/report/../fleet-live.json", 404),
        ("/files/look/report/%2e%2e/fleet-live.json", 404),
        ("/files/look/", 404),
        ("/files/look/gap/", 404),
        ("/files/look/", 404),
    ] {
        let answer = get(address, path, "");
        assert!(answer.starts_with(&format!("HTTP/1.1 {status} ")), "{path}: {answer}");
    }
    let rebound = "GET /files/look/report/index.html HTTP/1.1\r\nHost: evil.example\r\n\r\n";
    assert!(ask(address, rebound).starts_with("HTTP/1.1 403 "));
    let post = format!("POST /files/look/report/index.html HTTP/1.1\r\nHost: {address}\r\n\r\n");
    assert!(ask(address, &post).starts_with("HTTP/1.1 405 "));
    drop((stream, counted));
}
