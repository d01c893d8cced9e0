//! Sessions and bots against a scripted server over real Zenoh on loopback: what a good server does, and what a bad one
//! may do. The real server is tested with this library in `pita-tests`.

mod bots;
mod cells;
mod command_line;
mod datagrams;
mod ending;
mod events;
mod fake_server;
mod joining;
mod misbehaving;
mod snapshots;

use std::time::{Duration, Instant};

use pita_client::{Session, SessionBuilder, Statistics};

use fake_server::FakeServer;

/// Far longer than anything here takes on a busy machine.
const SOON: Duration = Duration::from_secs(20);

/// A builder for the arena of `server` that gives up late.
fn builder(server: &FakeServer) -> SessionBuilder {
    Session::builder(&server.endpoint, "Wu").arena(fake_server::ARENA).connect_timeout(SOON).loss_timeout(SOON)
}

/// A player in the arena of `server`, which has sent the snapshot of tick 101.
async fn player(server: &FakeServer) -> Session {
    let session = builder(server).connect().await.unwrap_or_else(|error| panic!("{error}"));
    first_snapshot(server, &session).await;
    session
}

/// Sends snapshots of tick 101 until one arrives: the server cannot know when the subscription has reached it.
async fn first_snapshot(server: &FakeServer, session: &Session) {
    let until = Instant::now() + SOON;
    while session.latest_snapshot().is_none() {
        assert!(Instant::now() < until, "no snapshot arrived");
        server.put_snapshot(fake_server::snapshot(101)).await;
        tokio::time::sleep(Duration::from_millis(10)).await;
    }
}

/// Waits until the session's counts are as wanted.
async fn eventually(session: &Session, what: &str, wanted: impl Fn(&Statistics) -> bool) -> Statistics {
    let until = Instant::now() + SOON;
    loop {
        let statistics = session.statistics();
        if wanted(&statistics) {
            return statistics;
        }
        assert!(Instant::now() < until, "{what} did not come about: {statistics:?}");
        tokio::time::sleep(Duration::from_millis(5)).await;
    }
}

/// The result of `future`, or a failed test.
async fn soon<T>(what: &str, future: impl Future<Output = T>) -> T {
    tokio::time::timeout(SOON, future).await.unwrap_or_else(|_| panic!("{what}: not within {SOON:?}"))
}
