//! Counters that any thread adds to without waiting.

use std::sync::atomic::{AtomicU64, Ordering};

use pita_protocol::message::RefusedCounts;

/// A number that only grows.
#[derive(Debug, Default)]
pub struct Counter(AtomicU64);

impl Counter {
    /// Adds `n`.
    pub fn add(&self, n: u64) {
        self.0.fetch_add(n, Ordering::Relaxed);
    }

    /// Its value now.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Everything that is counted from more than one thread; the fields of [`RefusedCounts`] by their names there.
#[derive(Debug, Default)]
#[expect(missing_docs, reason = "the refusals are documented at RefusedCounts")]
pub struct Counters {
    /// Payload handed to Zenoh for clients, bytes.
    pub sent_bytes: Counter,
    /// Payload of inputs and queries received, bytes.
    pub received_bytes: Counter,
    /// Queries that found the queue full.
    pub queries_dropped: Counter,
    /// Frames that were not published, because a newer one waited already.
    pub frames_superseded: Counter,
    pub join_version: Counter,
    pub join_malformed: Counter,
    pub join_full: Counter,
    pub join_ended: Counter,
    pub join_name: Counter,
    pub join_over: Counter,
    pub input_too_long: Counter,
    pub input_version: Counter,
    pub input_malformed: Counter,
    pub input_content: Counter,
    pub input_forged: Counter,
    pub input_no_session: Counter,
    pub input_stale: Counter,
    pub input_flood: Counter,
    pub query_malformed: Counter,
    pub say_refused: Counter,
}

impl Counters {
    /// What was refused so far.
    pub fn refused(&self) -> RefusedCounts {
        RefusedCounts {
            join_version: self.join_version.get(),
            join_malformed: self.join_malformed.get(),
            join_full: self.join_full.get(),
            join_ended: self.join_ended.get(),
            join_name: self.join_name.get(),
            join_over: self.join_over.get(),
            input_too_long: self.input_too_long.get(),
            input_version: self.input_version.get(),
            input_malformed: self.input_malformed.get(),
            input_content: self.input_content.get(),
            input_forged: self.input_forged.get(),
            input_no_session: self.input_no_session.get(),
            input_stale: self.input_stale.get(),
            input_flood: self.input_flood.get(),
            query_malformed: self.query_malformed.get(),
            say_refused: self.say_refused.get(),
        }
    }
}
