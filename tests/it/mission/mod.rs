//! Plans and the shows that are made of them.

mod names;
mod plan_roundtrip;
