//! Exact safety checks of a show against its limits.
