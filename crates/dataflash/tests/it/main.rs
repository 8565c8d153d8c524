//! What a user of the crate relies on, against other readers and against damage.

mod damage;
mod values;
