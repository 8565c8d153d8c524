//! Work that takes the server a while: receipts, and a bounded number of drones at once.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::client::{Client, entries, text, words};
use super::error::ServerError;
use crate::link::clock::{Micros, S};

/// The server gives up work without progress after 90 s, and says so.
const PATIENCE: Micros = 120 * S;
/// Longest wait for a message before other things are looked at.
const TURN: Micros = S / 5;
/// Whoever cancels is about to leave.
const CANCEL: Micros = 2 * S;

/// Result of one drone's part of a request: the server's value, or the reason why it failed.
pub type Outcome = Result<Value, String>;

/// Work in progress at the server, by drone.
#[derive(Debug, Default)]
pub struct Running {
    waited: BTreeMap<String, Waited>,
    over: Vec<(String, Outcome)>,
}

#[derive(Debug)]
struct Waited {
    receipt: String,
    /// Time at which it was begun, or the server last sent anything about it.
    moved: Micros,
    /// Share that is done, 0 to 1.
    share: f64,
}

/// Identifier of the drone at the server.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// The server's name of the drone.
    pub drone: String,
    /// Body of the request.
    pub body: Value,
}

/// Source of the jobs that [`Client`] runs at the server, and receiver of their results.
pub trait Foreman {
    /// Takes the outcome of a drone's job; returns the next job for the drone, if there is one.
    fn over(&mut self, drone: &str, outcome: Outcome) -> Option<Job>;

    /// Progress of a drone's work, as a share from 0 to 1.
    fn progress(&mut self, _drone: &str, _share: f64) {}

    /// Whether to stop: running jobs are cancelled then.
    fn stop(&mut self) -> bool;
}

impl Client {
    /// Asks for work on drones; what is over at once is over, the rest has receipts.
    ///
    /// # Errors
    /// When the server refuses, or is not there.
    pub fn begin(&mut self, body: &Value) -> Result<Running, ServerError> {
        let answer = self.ask(body)?;
        let moved = self.clock.now();
        let waited = |receipt: &str| Waited { receipt: receipt.to_owned(), moved, share: 0.0 };
        let mut running = Running::default();
        for (drone, receipt) in entries(&answer, "receipt") {
            if let Some(receipt) = receipt.as_str() {
                running.waited.insert(drone, waited(receipt));
            }
        }
        for (drone, result) in entries(&answer, "result") {
            running.over.push((drone, Ok(result)));
        }
        for (drone, error) in entries(&answer, "error") {
            running.over.push((drone, Err(words(&error))));
        }
        // What concerns a single drone is not keyed by it.
        if let Some(drone) = text(body, "uavId") {
            if let Some(receipt) = text(&answer, "receipt") {
                running.waited.insert(drone.to_owned(), waited(receipt));
            } else if let Some(error) = text(&answer, "error") {
                running.over.push((drone.to_owned(), Err(error.to_owned())));
            } else if let Some(result) = answer.get("result") {
                running.over.push((drone.to_owned(), Ok(result.clone())));
            }
        }
        Ok(running)
    }

    /// Waits until all work is over, or until `go_on` returns false: the rest is cancelled then.
    ///
    /// # Errors
    /// When the connection breaks.
    pub fn finish(
        &mut self,
        mut running: Running,
        mut go_on: impl FnMut() -> bool,
    ) -> Result<BTreeMap<String, Outcome>, ServerError> {
        let mut over: BTreeMap<_, _> = running.over.drain(..).collect();
        while !running.waited.is_empty() {
            if !go_on() {
                self.cancel(&running);
                break;
            }
            self.turn(&mut running)?;
            over.extend(running.over.drain(..));
        }
        Ok(over)
    }

    /// Runs jobs, for at most `at_once` drones at a time and one request per drone, and passes the
    /// results to `foreman`. A refusal for one drone is that drone's outcome. Jobs that are running
    /// when the foreman stops are cancelled.
    ///
    /// # Errors
    /// If the connection breaks or the server does not answer; the foreman has then had no outcome of
    /// the drones whose work was not over.
    pub fn work(
        &mut self,
        jobs: impl IntoIterator<Item = Job>,
        at_once: usize,
        foreman: &mut dyn Foreman,
    ) -> Result<(), ServerError> {
        let mut jobs = jobs.into_iter();
        let mut running = Running::default();
        loop {
            if foreman.stop() {
                self.cancel(&running);
                return Ok(());
            }
            while running.waited.len() < at_once.max(1) {
                let Some(job) = jobs.next() else { break };
                self.take_on(&mut running, job)?;
                // Many that are over at once must not pile up: each may carry a log.
                self.hand_over(&mut running, foreman)?;
            }
            if running.waited.is_empty() {
                return Ok(());
            }
            self.turn(&mut running)?;
            for (drone, waited) in &running.waited {
                foreman.progress(drone, waited.share);
            }
            self.hand_over(&mut running, foreman)?;
        }
    }

    fn hand_over(
        &mut self,
        running: &mut Running,
        foreman: &mut dyn Foreman,
    ) -> Result<(), ServerError> {
        while let Some((drone, outcome)) = running.over.pop() {
            if let Some(job) = foreman.over(&drone, outcome) {
                self.take_on(running, job)?;
            }
        }
        Ok(())
    }

    fn take_on(&mut self, running: &mut Running, job: Job) -> Result<(), ServerError> {
        let begun = match self.begin(&job.body) {
            Err(error @ ServerError::Refused { .. }) => {
                running.over.push((job.drone, Err(error.to_string())));
                return Ok(());
            }
            other => other?,
        };
        if begun.waited.is_empty() && begun.over.is_empty() {
            let nothing = Err("the server's answer names no work".to_owned());
            running.over.push((job.drone, nothing));
            return Ok(());
        }
        // Nothing of anybody else was asked.
        running.over.extend(begun.over.into_iter().filter(|(drone, _)| *drone == job.drone));
        running.waited.extend(begun.waited.into_iter().filter(|(drone, _)| *drone == job.drone));
        Ok(())
    }

    /// Takes a message, if one comes, and moves what has ended.
    fn turn(&mut self, running: &mut Running) -> Result<(), ServerError> {
        let over = |waited: &Waited, client: &Self| client.ended.contains_key(&waited.receipt);
        // What has overtaken its receipt is not waited for.
        if !running.waited.values().any(|waited| over(waited, self)) {
            let until = self.clock.now() + TURN;
            if let Some(incoming) = self.receive("the end of its work", until)? {
                self.note(&incoming);
            }
        }
        let now = self.clock.now();
        let mut silent = Vec::new();
        let Running { waited, over } = running;
        waited.retain(|drone, waited| {
            if let Some((moved, share)) = self.moved.get(&waited.receipt) {
                (waited.moved, waited.share) = (waited.moved.max(*moved), *share);
            }
            if let Some(outcome) = self.ended.remove(&waited.receipt) {
                self.moved.remove(&waited.receipt);
                over.push((drone.clone(), outcome));
                return false;
            }
            if now > waited.moved + PATIENCE {
                silent.push(waited.receipt.clone());
                let words = format!("nothing was heard of it for {} s", PATIENCE / S);
                over.push((drone.clone(), Err(words)));
                return false;
            }
            true
        });
        self.cancel_receipts(&silent);
        Ok(())
    }

    /// The server goes on with what nobody waits for, and refuses the same drone to the next who
    /// asks: it is told. Whether it obeys does not matter to one who leaves.
    fn cancel(&mut self, running: &Running) {
        let receipts = running.waited.values().map(|waited| waited.receipt.clone());
        self.cancel_receipts(&receipts.collect::<Vec<_>>());
    }

    fn cancel_receipts(&mut self, receipts: &[String]) {
        if !receipts.is_empty() {
            drop(self.ask_within(&json!({ "type": "ASYNC-CANCEL", "ids": receipts }), CANCEL));
        }
    }
}
