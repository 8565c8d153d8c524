//! Studies: flown, resumed, evaluated.

mod result;
mod resume;
mod support;
mod template;
