//! What a flight and its log say.

mod identity;
