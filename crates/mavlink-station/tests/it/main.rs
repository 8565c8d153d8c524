//! Conversations with vehicles over links that lose, repeat and lie, in simulated time.

mod content;
mod hostile;
mod logs;
mod support;
mod transfer;
