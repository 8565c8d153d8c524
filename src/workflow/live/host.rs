//! A host whose work is seen by pages as well, and whose questions they may answer.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use crate::live::station::Station;
use crate::live::view::Level;
use crate::workflow::clock::{Clock, Micros};
use crate::workflow::host::{Answer, Host, News, Progress, Transfer};

/// A host that tells pages what it tells people.
pub(crate) struct LiveHost<'a> {
    host: &'a dyn Host,
    station: Option<Arc<Station>>,
    /// Whether a page may answer questions.
    may_answer: bool,
}

impl<'a> LiveHost<'a> {
    /// A host whose flight is seen at these pages, if there are any.
    pub(crate) fn new(host: &'a dyn Host, station: Option<Arc<Station>>, may_answer: bool) -> Self {
        Self { host, station, may_answer }
    }

    fn tell(&self, level: Level, text: &str) {
        if let Some(station) = &self.station {
            station.say(level, text);
        }
    }

    /// Station whose page may answer.
    fn answering(&self) -> Option<&Arc<Station>> {
        self.station.as_ref().filter(|_| self.may_answer)
    }
}

impl Drop for LiveHost<'_> {
    fn drop(&mut self) {
        if let Some(station) = &self.station {
            station.over();
        }
    }
}

/// Passes the first of several answers on.
fn pass(from: Receiver<Answer>, to: SyncSender<Answer>) -> io::Result<()> {
    let pass = move || {
        if let Ok(answer) = from.recv() {
            // Somebody else was faster.
            let _ = to.try_send(answer);
        }
    };
    std::thread::Builder::new().name("answers".to_owned()).spawn(pass).map(drop)
}

impl Host for LiveHost<'_> {
    fn say(&self, text: &str) {
        self.tell(Level::Good, text);
        self.host.say(text);
    }

    fn insist(&self, text: &str) {
        self.tell(Level::Warning, text);
        self.host.insist(text);
    }

    fn clock(&self) -> &Arc<dyn Clock> {
        self.host.clock()
    }

    fn stop_flag(&self) -> &AtomicBool {
        self.host.stop_flag()
    }

    fn warn(&self, text: &str) {
        self.tell(Level::Warning, text);
        self.host.warn(text);
    }

    fn show(&self, table: &str) -> io::Result<()> {
        self.host.show(table)
    }

    fn show_no_go(&self, table: &str) -> io::Result<()> {
        self.tell(Level::Alarm, "NO-GO: the preflight table says why");
        self.host.show_no_go(table)
    }

    fn progress(&self, what: &str, total: u64) -> Box<dyn Progress + '_> {
        self.host.progress(what, total)
    }

    fn transfer(&self) -> Box<dyn Transfer + '_> {
        self.host.transfer()
    }

    fn is_attended(&self) -> bool {
        self.host.is_attended() || self.answering().is_some()
    }

    fn sees_questions(&self) -> bool {
        self.host.sees_questions()
    }

    fn ask(&self, question: &str) -> io::Result<Receiver<Answer>> {
        self.host.ask(question)
    }

    fn offer(&self, question: &str, answers: &[(&str, &str)]) -> io::Result<Receiver<Answer>> {
        let Some(station) = self.answering() else { return self.host.offer(question, answers) };
        let at_page = station.ask(question, answers);
        if !self.host.is_attended() {
            return Ok(at_page);
        }
        let here = self.host.offer(question, answers)?;
        let (send, receive) = sync_channel(1);
        pass(at_page, send.clone())?;
        pass(here, send)?;
        Ok(receive)
    }

    fn news(&self, news: &News<'_>) {
        if let Some(station) = &self.station {
            match news {
                News::Step(step, waits) => station.step(*step, waits),
                News::Assigned(table) => station.assign(table),
                News::Preflight(found) => station.preflight(found),
                News::Start(start_gps_ms) => station.start(*start_gps_ms),
                News::Order(notice) => station.ordered(notice),
                News::Answered => station.answered(),
            }
        }
        self.host.news(news);
    }

    fn stream_every(&self) -> Option<Micros> {
        self.station.as_ref()?.stream_every()
    }

    fn interruptions(&self) -> u32 {
        self.host.interruptions()
    }

    fn set_in_flight(&self, words: Option<&'static str>) {
        self.host.set_in_flight(words);
    }

    fn next_ends(&self) {
        self.host.next_ends();
    }

    fn command(&self) -> String {
        self.host.command()
    }
}
