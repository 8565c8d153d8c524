//! The live page: a flight as it happens, or as it was, in a browser.
//!
//! A station serves one page, one stream of events and one way back, by threads and sockets alone. What is shown is a
//! [`view::View`]: a [`source::Source`] makes one whenever it is asked, from what drones say ([`station`]) or from logs
//! ([`player`]), and [`server`] sends each page what has changed since its last look. The station shares nothing with a
//! page but a short lock: one that is closed, or hangs, is dropped.
//!
//! What a page may do is decided in one place, [`http::guard`]; an order from it takes the way of `fleet abort` from
//! another terminal ([`crate::fleet::orders`]).

pub mod facts;
pub mod files;
pub mod frames;
pub mod http;
pub mod orders;
pub mod page;
pub mod player;
pub mod secrets;
pub mod server;
pub mod source;
pub mod station;
pub mod tap;
pub mod thin;
pub mod trouble;
pub mod view;
