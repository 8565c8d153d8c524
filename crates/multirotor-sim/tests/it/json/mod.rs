//! The interface to the firmware's simulator.

mod firmware;
mod packets;
mod support;
