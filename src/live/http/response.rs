//! Answers, with the headers that keep a page to itself.

use std::fmt::Write as _;

/// Status of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// 200.
    Ok,
    /// 400.
    BadRequest,
    /// 401: the token is missing or another's.
    Unauthorized,
    /// 403.
    Forbidden,
    /// 404.
    NotFound,
    /// 405.
    NotAllowed,
    /// 409: it cannot be done now.
    Conflict,
    /// 413.
    TooLarge,
    /// 503: too many pages look already.
    Busy,
}

impl Status {
    fn line(self) -> &'static str {
        match self {
            Self::Ok => "200 OK",
            Self::BadRequest => "400 Bad Request",
            Self::Unauthorized => "401 Unauthorized",
            Self::Forbidden => "403 Forbidden",
            Self::NotFound => "404 Not Found",
            Self::NotAllowed => "405 Method Not Allowed",
            Self::Conflict => "409 Conflict",
            Self::TooLarge => "413 Content Too Large",
            Self::Busy => "503 Service Unavailable",
        }
    }
}

/// Kind of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind<'a> {
    /// The page; scripts and styles need this nonce.
    Page {
        /// Nonce of this answer alone.
        nonce: &'a str,
    },
    /// Answer in JSON.
    Json,
    /// Events that go on.
    Events,
    /// Answer in plain text.
    Text,
    /// The small picture in the browser's tab.
    Picture,
    /// A file of the campaign, of this media type.
    File {
        /// Media type of the file.
        media: &'static str,
    },
}

/// Line and headers of an answer; `length`: bytes of its body, none for events.
pub fn head(status: Status, kind: Kind<'_>, length: Option<u64>) -> String {
    let media = match kind {
        Kind::Page { .. } => "text/html; charset=utf-8",
        Kind::Json => "application/json",
        Kind::Events => "text/event-stream",
        Kind::Text => "text/plain; charset=utf-8",
        Kind::Picture => "image/svg+xml",
        Kind::File { media } => media,
    };
    let policy = match kind {
        Kind::Page { nonce } => format!(
            "default-src 'none'; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src \
             'self'; img-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
        ),
        // In a sandbox a page is of no site: it can neither ask this server for anything nor see the flight's page.
        Kind::File { .. } => "sandbox allow-scripts allow-downloads allow-popups; default-src 'none'; \
             script-src 'self' 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' data: blob:; \
             font-src data:; connect-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
            .to_owned(),
        _ => "default-src 'none'; frame-ancestors 'none'".to_owned(),
    };
    // What is in a sandbox loads its pictures and data as a stranger: the secret in their addresses is what lets it in.
    let (resources, opener) = match kind {
        Kind::File { .. } => ("cross-origin", "unsafe-none"),
        _ => ("same-origin", "same-origin"),
    };
    let mut text = format!(
        "HTTP/1.1 {}\r\nContent-Type: {media}\r\nContent-Security-Policy: {policy}\r\n\
         X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nReferrer-Policy: no-referrer\r\n\
         Cache-Control: no-store\r\nCross-Origin-Resource-Policy: {resources}\r\n\
         Cross-Origin-Opener-Policy: {opener}\r\nConnection: close\r\n",
        status.line()
    );
    if let Some(length) = length {
        // Infallible on a String.
        let _ = write!(text, "Content-Length: {length}\r\n");
    }
    text.push_str("\r\n");
    text
}
