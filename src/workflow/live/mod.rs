//! Flights in a browser: as they happen, and as they were.

mod agreement;
mod air;
mod host;
mod of_map;
mod recorded;
mod replay;
mod serve;

pub(crate) use self::air::{AirWatch, AirWish};
pub(crate) use self::host::LiveHost;
pub(crate) use self::recorded::recall;
pub(crate) use self::replay::{ReplayWish, replay};
pub(crate) use self::serve::{Address, LiveWish, Served, serve};
