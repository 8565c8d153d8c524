//! Show files: what is written comes back, what is broken is refused, what is hostile is survived.

mod check;
mod show;
