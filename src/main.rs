//! The `updraft` command: see [`updraft::cli`].

fn main() {}
