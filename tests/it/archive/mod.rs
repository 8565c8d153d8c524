//! Archives of campaigns: gathered by the program, read by other programs.

mod columns;
mod gather;
mod hostile;
mod queries;
mod support;
