//! Bringing logs home: [`pull::pull`] from many drones over the air, [`import`] from
//! cards, [`verify::verify`] what is there.

pub mod import;
pub mod manifest;
pub mod one;
pub mod part;
pub mod pull;
pub mod verify;

pub use mavlink_station::pace;
