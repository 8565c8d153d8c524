//! The commands that README, docs/ and the program's own help print: all are run, or read as the program reads them.

mod blocks;
mod help;
mod read;
mod run;
mod table;
