//! The figures, one file each: the paper's Figs. 2 to 6, what they leave out, and those of `gap`.

pub(super) mod air;
pub(super) mod averaging;
pub(super) mod compare;
pub(super) mod correlation;
pub(super) mod drone;
pub(super) mod evolution;
pub(super) mod fleet;
pub(super) mod gap;
pub(super) mod laws;
pub(super) mod levelled;
pub(super) mod map;
mod map_marks;
pub(super) mod mast;
mod plan_view;
pub(super) mod posterior;
pub(super) mod sensitivity;
pub(super) mod study;
pub(super) mod track;
pub(super) mod turbulence;
