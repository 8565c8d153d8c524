//! The program and its library against outside truth: one test program, a folder for each room.

mod analysis;
mod blind;
mod campaign;
mod check;
mod cli;
mod effects;
mod firmware;
mod fleet;
mod flight;
mod gap;
mod house;
mod mission;
mod report;
mod skybrush_server;
mod statistics;
mod study;
mod virtual_fleet;
