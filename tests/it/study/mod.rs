//! Studies: flown, resumed, evaluated.

mod result;
mod resume;
mod sensitivity;
mod support;
mod template;
