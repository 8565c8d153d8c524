//! Statistics of the map, over many seeds.

mod coverage;
mod flight;
mod inputs;
mod support;
mod truth;
