//! The embedded simulator: flies a show and writes one DataFlash log per drone.
