//! Snapshots over a second connection, of datagrams: one that is lost does not hold up those behind it.
//!
//! Owns that connection and the choice between it and the first one, over which everything else goes. Nothing is
//! repeated over it, not even what opens it and what asks for snapshots; so both are tried again here. Where no
//! snapshots come through it, or none any more, they are asked for over the first connection instead, for good.

use std::{
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::{
    task::JoinHandle,
    time::{sleep, timeout},
};
use zenoh::pubsub::Subscriber;

use crate::{error::ClientError, join::SnapshotKey, transport};

/// How long one attempt to connect may take; a lost handshake is not repeated within it.
const ATTEMPT: Duration = Duration::from_millis(700);
/// Between two attempts.
const PAUSE: Duration = Duration::from_millis(50);
/// How often it is looked whether snapshots come, and asked for them again where none do.
const LOOK: Duration = Duration::from_millis(400);
/// Looks without a snapshot after which the first connection has to do: well before a session counts as lost.
const LOOKS_MAX: u32 = 4;

/// Checks that datagrams can come over `endpoint`.
///
/// # Errors
/// [`ClientError::Datagrams`] for something else than UDP.
pub fn check(endpoint: &str) -> Result<(), ClientError> {
    match endpoint.strip_prefix("udp/") {
        Some(address) if !address.is_empty() => Ok(()),
        _ => Err(ClientError::Datagrams(endpoint.to_owned())),
    }
}

/// Connects to `endpoint`, in as many attempts as `patience` allows; `None` where nobody answers.
pub async fn open(endpoint: &str, patience: Duration) -> Option<zenoh::Session> {
    let attempts = async {
        loop {
            match transport::open_datagrams(endpoint, ATTEMPT).await {
                Ok(zenoh) => return zenoh,
                Err(_) => sleep(PAUSE).await,
            }
        }
    };
    let opened = timeout(patience, attempts).await.ok();
    if opened.is_none() {
        tracing::warn!("no datagrams from {endpoint} within {patience:?}: snapshots come over the first connection");
    }
    opened
}

/// Asks for snapshots over datagrams for as long as they come, and then over the first connection. Ends when dropped.
#[derive(Debug)]
pub struct Following(JoinHandle<()>);

impl Following {
    /// Begins; `key` is what is asked for.
    pub fn new(control: zenoh::Session, datagrams: zenoh::Session, key: SnapshotKey) -> Self {
        Self(tokio::spawn(follow(control, datagrams, key)))
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.0.abort();
    }
}

async fn follow(control: zenoh::Session, datagrams: zenoh::Session, key: SnapshotKey) {
    let received = Arc::new(AtomicU64::new(0));
    let mut subscribed = key.subscribe(&datagrams, Some(Arc::clone(&received))).await;
    let (mut seen, mut silent_looks) = (0, 0);
    while silent_looks < LOOKS_MAX {
        sleep(LOOK).await;
        let now = received.load(Ordering::Relaxed);
        silent_looks = if now == seen { silent_looks + 1 } else { 0 };
        seen = now;
        if silent_looks > 0 {
            // What asked for them may have been lost.
            drop(subscribed);
            subscribed = key.subscribe(&datagrams, Some(Arc::clone(&received))).await;
        }
    }
    let over_control: Result<Subscriber<()>, _> = key.subscribe(&control, None).await;
    match &over_control {
        Ok(_) => tracing::warn!("no snapshots come as datagrams: they come over the first connection from now on"),
        Err(error) => tracing::warn!("no snapshots come as datagrams, and over the first connection neither: {error}"),
    }
    drop(subscribed);
    transport::close(&datagrams).await;
    // Holds the subscription until the session ends.
    std::future::pending().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_udp_is_refused_by_name() {
        assert_eq!(check("udp/127.0.0.1:7447"), Ok(()));
        for bad in ["tcp/127.0.0.1:7447", "127.0.0.1:7447", "udp/", ""] {
            let said = check(bad).unwrap_err().to_string();
            assert!(said.contains(bad) && said.contains("udp/HOST:PORT"), "{said}");
        }
    }
}
