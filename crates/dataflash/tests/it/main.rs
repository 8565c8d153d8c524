//! What a user of the crate relies on, against other readers and against damage.

#![expect(clippy::unwrap_used, reason = "this is test code")]

mod damage;
mod values;
