//! Studies: flown, resumed, evaluated.

mod result;
mod resume;
mod sensitivity;
pub(crate) mod support;
mod template;
