//! Requests: parsed within bounds, as their bytes come.

use super::response::Status;
use crate::base::plain::plain_string;

/// Most bytes of a request's line and headers.
pub const MOST_HEAD_BYTES: usize = 16 << 10;
/// Most bytes of a body.
pub const MOST_BODY_BYTES: usize = 16 << 10;
/// Most headers.
const MOST_HEADERS: usize = 64;

/// Method of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Request to read (GET).
    Get,
    /// Request that does something (POST).
    Post,
}

/// A whole request. Header values are as they came, without anything that acts on a terminal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    /// Method of the request.
    pub method: Method,
    /// Path, without the query.
    pub path: String,
    /// Value of `token` in the query.
    pub query_token: Option<String>,
    /// `Host`.
    pub host: Option<String>,
    /// `Origin`.
    pub origin: Option<String>,
    /// `Sec-Fetch-Site`.
    pub fetch_site: Option<String>,
    /// `X-Token`.
    pub token: Option<String>,
    /// Body of the request; empty: it has none.
    pub body: Vec<u8>,
}

/// How far the bytes go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Parsed {
    /// More is to come.
    Partial,
    /// A whole request.
    Whole(Box<Request>),
    /// No request that is answered otherwise.
    Refused(Status),
}

/// Parses the bytes of a connection from its beginning.
pub fn parse(bytes: &[u8]) -> Parsed {
    let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
    let mut parsed = httparse::Request::new(&mut headers);
    let head = match parsed.parse(bytes) {
        Ok(httparse::Status::Complete(head)) => head,
        Ok(httparse::Status::Partial) if bytes.len() < MOST_HEAD_BYTES => return Parsed::Partial,
        Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => {
            return Parsed::Refused(Status::TooLarge);
        }
        Err(_) => return Parsed::Refused(Status::BadRequest),
    };
    if head > MOST_HEAD_BYTES {
        return Parsed::Refused(Status::TooLarge);
    }
    let method = match parsed.method {
        Some("GET") => Method::Get,
        Some("POST") => Method::Post,
        _ => return Parsed::Refused(Status::NotAllowed),
    };
    // A header that stands twice says two things, of which somebody before us may have read the other.
    let one = |name: &str| {
        let mut values = parsed.headers.iter().filter(|of| of.name.eq_ignore_ascii_case(name));
        match (values.next(), values.next()) {
            (None, _) => Ok(None),
            (Some(of), None) => match std::str::from_utf8(of.value) {
                Ok(text) => Ok(Some(plain_string(text.trim().to_owned()))),
                Err(_) => Err(Status::BadRequest),
            },
            _ => Err(Status::BadRequest),
        }
    };
    let whole = || {
        if one("transfer-encoding")?.is_some() {
            return Err(Status::BadRequest);
        }
        let length = match one("content-length")? {
            None => 0,
            // Digits alone: a sign or a space is read differently elsewhere.
            Some(text) if text.bytes().all(|byte| byte.is_ascii_digit()) => {
                text.parse::<usize>().map_err(|_| Status::TooLarge)?
            }
            Some(_) => return Err(Status::BadRequest),
        };
        if length > MOST_BODY_BYTES {
            return Err(Status::TooLarge);
        }
        let Some(body) = bytes.get(head..head + length) else { return Ok(None) };
        let target = parsed.path.unwrap_or_default();
        let (path, query) = target.split_once('?').unwrap_or((target, ""));
        let token = query.split('&').find_map(|pair| pair.strip_prefix("token="));
        Ok(Some(Request {
            method,
            path: path.to_owned(),
            query_token: token.map(str::to_owned),
            host: one("host")?,
            origin: one("origin")?,
            fetch_site: one("sec-fetch-site")?,
            token: one("x-token")?,
            body: body.to_vec(),
        }))
    };
    match whole() {
        Ok(Some(request)) => Parsed::Whole(Box::new(request)),
        Ok(None) => Parsed::Partial,
        Err(status) => Parsed::Refused(status),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_whole_when_its_body_is() {
        let text = b"POST /wish?token=abc HTTP/1.1\r\nHost: 127.0.0.1:8700\r\nX-Token: t\r\n\
                     Content-Length: 2\r\n\r\n{}";
        for length in 0..text.len() {
            assert_eq!(parse(&text[..length]), Parsed::Partial, "{length}");
        }
        let Parsed::Whole(request) = parse(text) else { panic!("not whole") };
        assert_eq!(request.method, Method::Post);
        assert_eq!(request.path, "/wish");
        assert_eq!(request.query_token.as_deref(), Some("abc"));
        assert_eq!(request.host.as_deref(), Some("127.0.0.1:8700"));
        assert_eq!(request.body, b"{}");
    }

    #[test]
    fn what_two_readers_may_read_differently_is_refused() {
        for (headers, status) in [
            ("Content-Length: 1\r\nContent-Length: 2\r\n", Status::BadRequest),
            ("Transfer-Encoding: chunked\r\n", Status::BadRequest),
            ("Content-Length: +2\r\n", Status::BadRequest),
            ("Content-Length: 16385\r\n", Status::TooLarge),
            ("Content-Length: 99999999999999999999999\r\n", Status::TooLarge),
            ("Host: a\r\nHost: b\r\n", Status::BadRequest),
        ] {
            let text = format!("POST / HTTP/1.1\r\n{headers}\r\n{{}}");
            assert_eq!(parse(text.as_bytes()), Parsed::Refused(status), "{headers}");
        }
        assert_eq!(parse(b"DELETE / HTTP/1.1\r\n\r\n"), Parsed::Refused(Status::NotAllowed));
        let endless = [b"GET / HTTP/1.1\r\nA: ".as_slice(), &[b'x'; MOST_HEAD_BYTES]].concat();
        assert_eq!(parse(&endless), Parsed::Refused(Status::TooLarge));
    }
}
