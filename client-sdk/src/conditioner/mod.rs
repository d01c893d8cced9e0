//! A bad network on demand: delays, loses, repeats, reorders, throttles and freezes what a session sends and receives.
//!
//! It stands between a session and Zenoh and treats each message as a datagram of its own: inputs up, snapshots down,
//! those of cells too. Events come down in order and none is lost: a loss delays them and what follows, as a stream does
//! that sends again. Questions for keyframes take as long as the way there and back; joining and others are not touched. Everything random follows from a seed.

mod link;
mod schedule;
mod text;

use std::time::Duration;

pub(crate) use link::Link;
pub(crate) use schedule::Delivery;
pub use text::ConditionsError;

/// What a session's messages meet on their way, in both directions. As text, for command lines: `latency=50,jitter=20,
/// loss=5,seed=7`; see [`Conditions`] for the keys, and put `up.` or `down.` before one that is for one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ConditionerSettings {
    /// To the server.
    pub up: Conditions,
    /// From the server.
    pub down: Conditions,
    /// Of everything random.
    pub seed: u64,
}

/// What messages meet in one direction. Nothing, by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Conditions {
    /// Mean time that a message takes; `latency`, ms, 0 to 10000.
    pub latency: Duration,
    /// It takes up to so much more or less, evenly distributed; `jitter`, ms, 0 to 10000. Messages overtake each other.
    pub jitter: Duration,
    /// Share of messages that do not arrive; `loss`, per cent, 0 to 100.
    pub loss: f64,
    /// Share of messages that arrive twice; `duplicate`, per cent, 0 to 100.
    pub duplicate: f64,
    /// Share of messages that take no time, and so overtake those before them; `reorder`, per cent, 0 to 100.
    pub reorder: f64,
    /// Bytes a second that get through; what would wait longer than half a second for that is lost; `rate`, B/s, 1 or
    /// more.
    pub rate: Option<u64>,
    /// Time and again nothing arrives for a while; `freeze`, as `EVERY/FOR`, s.
    pub freeze: Option<Freeze>,
}

/// A link that stands still time and again, what it carries waiting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Freeze {
    /// From the start of one freeze to the start of the next.
    pub every: Duration,
    /// Length of a freeze, at the end of each such period.
    pub lasting: Duration,
}
