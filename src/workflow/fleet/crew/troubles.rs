//! Problems of the links: each is reported once, and written into the journal.

use super::Crew;
use crate::link::net::Net as _;
use crate::link::traffic::troubles;

impl Crew<'_> {
    /// Tells what people must know about their links and has not been told yet.
    pub(crate) fn tell_troubles(&mut self) {
        for trouble in troubles(&self.net.traffic(), &self.net.doubled()) {
            if self.told.insert(trouble.key) {
                self.host.warn(&trouble.text);
                if let Err(error) = self.note("link", Some(trouble.text)) {
                    self.host.warn(&format!("not in the journal: {error}"));
                }
            }
        }
    }
}
