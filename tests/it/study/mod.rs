//! Studies: flown, resumed, evaluated.

mod result;
mod resume;
pub(crate) mod support;
mod template;
