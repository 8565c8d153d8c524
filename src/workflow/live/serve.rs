//! A page is opened: its port, its secrets, and what people are told of it.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;

use crate::base::causes::with_causes;
use crate::base::plain::Shown as _;
use crate::live::http::guard::Rank;
use crate::live::secrets::{LIVE_FILE, Secrets};
use crate::live::server::{Server, Setup};
use crate::live::source::Source;
use crate::workflow::error::WorkflowError;
use crate::workflow::host::Host;

/// Port without a choice.
const USUAL_PORT: u16 = 8700;

/// Where a page is listened for: an address, a port, or both; by default this machine alone.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Address {
    ip: Option<IpAddr>,
    port: Option<u16>,
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(address) = text.parse::<SocketAddr>() {
            return Ok(Self { ip: Some(address.ip()), port: Some(address.port()) });
        }
        if let Ok(ip) = text.parse::<IpAddr>() {
            return Ok(Self { ip: Some(ip), port: None });
        }
        let (host, port) = text.rsplit_once(':').unwrap_or(("", text));
        match (host, port.parse::<u16>()) {
            ("", Ok(port)) => Ok(Self { ip: None, port: Some(port) }),
            ("localhost", Ok(port)) => {
                Ok(Self { ip: Some(Ipv4Addr::LOCALHOST.into()), port: Some(port) })
            }
            _ => Err(format!(
                "\"{text}\" is no address to listen at: give an IP address, a port or both, as \
                 127.0.0.1:8700 (a campaign goes before this option)"
            )),
        }
    }
}

/// How a page is served.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LiveWish {
    /// Where it is listened for.
    pub(crate) address: Address,
    /// Whether an operator's address is given out, that may order.
    pub(crate) orders: bool,
    /// Source of random bytes.
    pub(crate) random: fn(&mut [u8]) -> io::Result<()>,
}

/// A page that is being served.
pub(crate) struct Served {
    _server: Server,
}

/// Serves the page of a flight, and says where. `campaign` is the folder whose reports it links to, `folder` the one
/// where its port and secrets are kept.
///
/// # Errors
/// If the address cannot be listened at.
pub(crate) fn serve(
    host: &dyn Host,
    campaign: &Path,
    folder: &Path,
    source: &Arc<dyn Source>,
    wish: &LiveWish,
) -> Result<Served, WorkflowError> {
    let unix_s = host.clock().unix_us() / 1_000_000;
    let failed = |error: io::Error| WorkflowError::Failed(format!("no random numbers: {error}"));
    let mut secrets = Secrets::of(folder, unix_s, wish.random).map_err(failed)?;
    let ip = wish.address.ip.unwrap_or(Ipv4Addr::LOCALHOST.into());
    // A page that was open finds the station again where it was.
    let ports = match wish.address.port {
        Some(port) => vec![port],
        None if secrets.port == 0 => vec![USUAL_PORT, 0],
        None => vec![secrets.port, USUAL_PORT, 0],
    };
    let setup = || Setup {
        source: Arc::clone(source),
        clock: Arc::clone(host.clock()),
        random: Box::new(wish.random),
        look: secrets.look.clone(),
        order: wish.orders.then(|| secrets.order.clone()),
        campaign: Some(campaign.to_owned()),
    };
    let mut opened = Err(io::Error::from(io::ErrorKind::AddrNotAvailable));
    for port in ports {
        opened = Server::open(SocketAddr::new(ip, port), setup());
        if opened.is_ok() {
            break;
        }
    }
    let server = opened.map_err(|error| {
        let port = wish.address.port.map_or_else(String::new, |port| format!(":{port}"));
        WorkflowError::Failed(format!(
            "cannot serve a page at {ip}{port}: {error}; give another address"
        ))
    })?;
    secrets.port = server.address().port();
    if let Err(error) = secrets.keep(folder) {
        host.warn(&format!(
            "{}; a page that is open will not find a station that is started anew",
            with_causes(&error, ": ")
        ));
    }
    let look = server.page(Rank::Looker).unwrap_or_default();
    let order = server.page(Rank::Operator);
    host.insist(&format!("Live page, to look: {look}"));
    if let Some(order) = &order {
        host.insist(&format!("Live page, to give orders: {order}"));
    }
    if !ip.is_loopback() {
        host.warn(&format!(
            "everybody in the network of {ip} who has an address of the page can use it, and what is \
             sent is not encrypted; the secrets are in {} and change after a day",
            folder.join(LIVE_FILE).shown()
        ));
    }
    Ok(Served { _server: server })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_in_all_their_forms() {
        let read = |text: &str| text.parse::<Address>();
        let local = Some(Ipv4Addr::LOCALHOST.into());
        assert_eq!(read("127.0.0.1:8700"), Ok(Address { ip: local, port: Some(8700) }));
        assert_eq!(read("127.0.0.1"), Ok(Address { ip: local, port: None }));
        assert_eq!(read("localhost:80"), Ok(Address { ip: local, port: Some(80) }));
        assert_eq!(read("8701"), Ok(Address { ip: None, port: Some(8701) }));
        assert_eq!(read(":8701"), Ok(Address { ip: None, port: Some(8701) }));
        assert!(read("[::1]:8700").is_ok_and(|address| address.port == Some(8700)));
        for text in ["my-campaign", "", "example.org:80", "1.2.3.4:99999", "70000"] {
            let error = read(text).unwrap_err();
            assert!(error.contains("is no address to listen at"), "{text}: {error}");
        }
    }
}
