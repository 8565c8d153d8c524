//! A host for one campaign of many: it keeps warnings for the campaign's record and says nothing.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError};

use crate::workflow::clock::Clock;
use crate::workflow::host::Host;

/// Hears for another host, which is stopped with it.
pub(super) struct Silent<'a> {
    host: &'a dyn Host,
    heard: Mutex<Vec<String>>,
}

impl<'a> Silent<'a> {
    pub(super) fn new(host: &'a dyn Host) -> Self {
        Self { host, heard: Mutex::default() }
    }

    /// Warnings so far, in their order.
    pub(super) fn into_heard(self) -> Vec<String> {
        self.heard.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Host for Silent<'_> {
    fn say(&self, _text: &str) {}

    fn insist(&self, text: &str) {
        self.heard.lock().unwrap_or_else(PoisonError::into_inner).push(text.to_owned());
    }

    fn warn(&self, text: &str) {
        self.insist(text);
    }

    fn clock(&self) -> &Arc<dyn Clock> {
        self.host.clock()
    }

    fn stop_flag(&self) -> &AtomicBool {
        self.host.stop_flag()
    }
}
