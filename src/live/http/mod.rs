//! The part of HTTP/1.1 that one page needs, without sockets.

pub mod guard;
pub mod request;
pub mod response;
