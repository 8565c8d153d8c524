//! Who may look, and who may give orders.
//!
//! A page of another site can make a browser send requests here, and a name of another site can be made to mean this
//! machine (DNS rebinding): so the `Host` must be one that this server has, the `Origin` this page's own, and every
//! request but that for the bare page carries a secret that other sites do not know.

use std::net::{IpAddr, SocketAddr};

use sha2::{Digest as _, Sha256};

use super::request::{Method, Request};
use super::response::Status;

/// Rank of a page, by what it may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Rank {
    /// It may look.
    Looker,
    /// It may give orders as well.
    Operator,
}

/// Addresses and secrets of a server.
#[derive(Clone, Debug)]
pub struct Door {
    /// Address that is listened at.
    pub address: SocketAddr,
    /// Secret of those who may look.
    pub look: String,
    /// Secret of those who may give orders, if anybody may.
    pub order: Option<String>,
}

impl Door {
    /// Whether a `Host` is one of this server's.
    fn is_own(&self, host: &str) -> bool {
        let port = self.address.port();
        let name = host.strip_suffix(&format!(":{port}")).or((port == 80).then_some(host));
        let Some(name) = name else { return false };
        let ip = name.trim_start_matches('[').trim_end_matches(']').parse::<IpAddr>();
        match (self.address.ip(), ip) {
            // No name but this one: any other may be somebody else's.
            (own, Err(_)) => own.is_loopback() && name.eq_ignore_ascii_case("localhost"),
            (own, Ok(ip)) => own == ip || own.is_unspecified(),
        }
    }

    /// The `Host` of a request, if it is one of this server's.
    fn own_host<'a>(&self, request: &'a Request) -> Result<&'a str, Status> {
        let host = request.host.as_deref().ok_or(Status::BadRequest)?;
        if self.is_own(host) { Ok(host) } else { Err(Status::Forbidden) }
    }

    /// Refuses who may not read the campaign's files: the secret in their address is what lets in, from wherever the
    /// request comes, as pages in a sandbox are of no site. The operator's secret belongs into no address.
    ///
    /// # Errors
    /// The status to answer with.
    pub fn admit_reader(&self, request: &Request, secret: &str) -> Result<(), Status> {
        self.own_host(request)?;
        if request.method != Method::Get {
            return Err(Status::NotAllowed);
        }
        match self.rank(Some(secret))? {
            Rank::Looker => Ok(()),
            Rank::Operator => Err(Status::Forbidden),
        }
    }

    /// Refuses what another site may have sent.
    ///
    /// # Errors
    /// The status to answer with.
    pub fn admit(&self, request: &Request) -> Result<(), Status> {
        let host = self.own_host(request)?;
        let own = |origin: &str| origin.strip_prefix("http://") == Some(host);
        match &request.origin {
            Some(origin) if !own(origin) => return Err(Status::Forbidden),
            None if request.method == Method::Post => return Err(Status::Forbidden),
            _ => {}
        }
        match request.fetch_site.as_deref() {
            None | Some("same-origin" | "none") => Ok(()),
            Some(_) => Err(Status::Forbidden),
        }
    }

    /// Rank of who has this secret.
    ///
    /// # Errors
    /// [`Status::Unauthorized`].
    pub fn rank(&self, secret: Option<&str>) -> Result<Rank, Status> {
        let secret = secret.ok_or(Status::Unauthorized)?;
        // Of hashes: how long it takes says nothing of the secret.
        let is = |own: &str| Sha256::digest(own) == Sha256::digest(secret);
        if self.order.as_deref().is_some_and(is) {
            Ok(Rank::Operator)
        } else if is(&self.look) {
            Ok(Rank::Looker)
        } else {
            Err(Status::Unauthorized)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn door(address: &str) -> Door {
        Door {
            address: address.parse().unwrap(),
            look: "look".to_owned(),
            order: Some("order".to_owned()),
        }
    }

    fn request(method: Method, host: &str, origin: Option<&str>, site: Option<&str>) -> Request {
        Request {
            method,
            path: "/".to_owned(),
            query_token: None,
            host: Some(host.to_owned()),
            origin: origin.map(str::to_owned),
            fetch_site: site.map(str::to_owned),
            token: None,
            body: Vec::new(),
        }
    }

    #[test]
    fn only_own_hosts_and_origins_are_let_in() {
        let door = door("127.0.0.1:8700");
        let get = |host, origin, site| door.admit(&request(Method::Get, host, origin, site));
        assert_eq!(get("127.0.0.1:8700", None, Some("none")), Ok(()));
        assert_eq!(get("localhost:8700", Some("http://localhost:8700"), None), Ok(()));
        for (host, origin, site) in [
            ("updraft.example:8700", None, None),
            ("127.0.0.1:8701", None, None),
            ("127.0.0.1", None, None),
            ("127.0.0.1:8700", Some("http://evil.example"), None),
            ("127.0.0.1:8700", Some("null"), None),
            ("127.0.0.1:8700", Some("http://localhost:8700"), None),
            ("127.0.0.1:8700", None, Some("cross-site")),
            ("127.0.0.1:8700", None, Some("same-site")),
        ] {
            assert_eq!(
                get(host, origin, site),
                Err(Status::Forbidden),
                "{host} {origin:?} {site:?}"
            );
        }
        let post = |origin| door.admit(&request(Method::Post, "127.0.0.1:8700", origin, None));
        assert_eq!(post(None), Err(Status::Forbidden), "who posts says from where");
        assert_eq!(post(Some("http://127.0.0.1:8700")), Ok(()));
    }

    #[test]
    fn in_a_network_addresses_are_let_in_and_names_are_not() {
        let get = |door: &Door, host| door.admit(&request(Method::Get, host, None, None));
        let all = door("0.0.0.0:8700");
        assert_eq!(get(&all, "192.168.1.7:8700"), Ok(()));
        assert_eq!(get(&all, "station.example:8700"), Err(Status::Forbidden));
        let one = door("[fd00::7]:8700");
        assert_eq!(get(&one, "[fd00::7]:8700"), Ok(()));
        assert_eq!(get(&one, "[fd00::8]:8700"), Err(Status::Forbidden));
    }

    #[test]
    fn secrets_tell_ranks() {
        let door = door("127.0.0.1:8700");
        assert_eq!(door.rank(Some("look")), Ok(Rank::Looker));
        assert_eq!(door.rank(Some("order")), Ok(Rank::Operator));
        assert_eq!(door.rank(Some("orde")), Err(Status::Unauthorized));
        assert_eq!(door.rank(Some("")), Err(Status::Unauthorized));
        assert_eq!(door.rank(None), Err(Status::Unauthorized));
        let nobody = Door { order: None, ..door };
        assert_eq!(nobody.rank(Some("order")), Err(Status::Unauthorized));
    }
}
