//! Declared publishers that never wait.

use zenoh::Wait;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

/// Puts that are dropped rather than waited for, all in one priority, so that events and snapshots keep their order.
pub struct Outlet {
    publisher: Publisher<'static>,
}

impl Outlet {
    /// Declares the publisher of a session's snapshots on `key`; dropping the outlet takes it back. A snapshot leaves at
    /// once, together with the events before it.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn for_snapshots(session: &zenoh::Session, key: String) -> zenoh::Result<Self> {
        Self::declare(session, key, true)
    }

    /// Declares the publisher of one layer of a cell on `key`. Cells of one tick share a batch with the snapshots behind them,
    /// for the reason that events do.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn for_cells(session: &zenoh::Session, key: String) -> zenoh::Result<Self> {
        Self::declare(session, key, false)
    }

    /// Declares the publisher of events on `key`. Events of one tick share a batch: each in its own, a dozen of them
    /// (eight players leave at once) overflow the queues of healthy clients.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn for_events(session: &zenoh::Session, key: String) -> zenoh::Result<Self> {
        Self::declare(session, key, false)
    }

    fn declare(session: &zenoh::Session, key: String, express: bool) -> zenoh::Result<Self> {
        let publisher = session
            .declare_publisher(key)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataHigh)
            .express(express)
            .wait()?;
        Ok(Self { publisher })
    }

    /// Hands `bytes` to Zenoh, whose queues take or drop them.
    pub fn put(&self, bytes: Vec<u8>) {
        if let Err(reason) = self.publisher.put(bytes).wait() {
            tracing::debug!("{}: {reason}", self.publisher.key_expr());
        }
    }
}
