//! Conversations with vehicles over links that lose, repeat and lie.

mod cards;
mod flight;
mod gate;
mod guided;
mod hostile;
mod import;
mod import_histories;
pub(crate) mod loaded;
mod log_speed;
mod logs;
mod logs_flight;
mod logs_home;
mod show;
mod start;
mod transfers;
mod upload;
mod upload_faults;
