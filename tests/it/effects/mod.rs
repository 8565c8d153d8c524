//! Effects as their users read of them.

mod docs;
mod example;
mod names;
