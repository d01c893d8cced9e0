//! A declared publisher that never waits.

use zenoh::Wait;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};

/// Puts that are dropped rather than waited for, all in one priority, so that events and snapshots keep their order.
pub struct Outlet {
    publisher: Publisher<'static>,
}

impl Outlet {
    /// Declares a publisher on `key`; dropping the outlet takes it back.
    ///
    /// # Errors
    /// What Zenoh says.
    pub fn declare(session: &zenoh::Session, key: String) -> zenoh::Result<Self> {
        let publisher = session
            .declare_publisher(key)
            .congestion_control(CongestionControl::Drop)
            .priority(Priority::DataHigh)
            .express(true)
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
