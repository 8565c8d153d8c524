//! Turbulence of fleets in air whose statistics are known: flown, logged and analysed as a campaign is.

mod foreign;
mod known_air;
mod pages;
mod support;
